/* The library as one object; the sanitized builds check its invariants, too. */
#ifdef CHECK_INVARIANTS
#include <assert.h>
#define TLSPH_ASSERT(x) assert(x)
#endif
#define TLSPH_IMPLEMENTATION
#include "../tlsph.h"

/* -Ofast and -ffast-math: sums and products in any order. */
int reorders(void);
int reorders(void)
{
#ifdef __FAST_MATH__
    return 1;
#else
    return 0;
#endif
}
/* Whether the flags of this file let the compiler compute a*b + c with one rounding, keep more digits than a type holds,
   or reorder: then bits differ from machine to machine. */
int contracts_or_reorders(void);
int contracts_or_reorders(void)
{
#ifdef TLSPH_REAL_FLOAT
#define EXACT_METHOD(method) ((method) == 0)
#else
#define EXACT_METHOD(method) ((method) == 0 || (method) == 1) /* 1: float is computed as double, as on s390x */
#endif
#if defined(__FLT_EVAL_METHOD__)
    if (!EXACT_METHOD(__FLT_EVAL_METHOD__)) return 1;
#endif
    if (reorders()) return 1;
    volatile double third = 1.0 / 3, minus_one = -1;
    const double a = third, c = minus_one;
    return a * 3 + c != 0; /* 1/3 is rounded down: exactly, three of it are less than 1 */
}
