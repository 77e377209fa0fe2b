/* The library as one object; the sanitized builds check its invariants, too. */
#ifdef CHECK_INVARIANTS
#include <assert.h>
#define TLSPH_ASSERT(x) assert(x)
#endif
#define TLSPH_IMPLEMENTATION
#include "../tlsph.h"
