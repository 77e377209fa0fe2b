/* The same bits on every machine, in every byte order and from every compiler that neither fuses a*b + c nor reorders:
   a checkpoint is defined byte by byte and the scenes here call nothing of libm but sqrt, so its hash can be written
   down. A machine whose checkpoint has this hash can continue any other's. When the arithmetic of the header changes on
   purpose, the hashes change with it: see them in the message. */
#include "support.h"

/* Of the library's own flags (implementation.c). */
int contracts_or_reorders(void);

#define STEPS 20

typedef struct portable_case {
    tlsph_unknowns unknowns;
    tlsph_thermal thermal;
    tlsph_material_kind material;
    double jitter;
    uint64_t hash_double, hash_float;
} portable_case;

static const portable_case cases[] = {
    {TLSPH_PF, TLSPH_ISOTHERMAL, TLSPH_NEO_HOOKEAN, 0.2, 0x03376e83a375940cu, 0xe4704d6e379e9ca0u},
    {TLSPH_PFHJ, TLSPH_ENERGY, TLSPH_MIE_GRUNEISEN, 0, 0x8f5e3ad1db82986eu, 0xc5aef9e6b11f61e8u},
    {TLSPH_PFJ, TLSPH_ISOTHERMAL, TLSPH_LINEAR, 0, 0xbddc35255729ad53u, 0x868504594903ab3eu},
};

/* v from polynomials: sin and cos differ from one libm to another. */
static tlsph_result kick(tlsph_solver *solver)
{
    size_t a, n = tlsph_count(solver);
    tlsph_real *X = read_field(solver, TLSPH_FIELD_REFERENCE_POSITION), *v = read_field(solver, TLSPH_FIELD_VELOCITY);
    tlsph_result result = TLSPH_ERROR_MEMORY;
    if (X && v) {
        for (a = 0; a < n; a++) {
            const tlsph_real x = X[3 * a], y = X[3 * a + 1];
            v[3 * a] = x * (1 - y) / 4;
            v[3 * a + 1] = x * x / 2;
            v[3 * a + 2] = x * y / 8;
        }
        result = tlsph_write(solver, TLSPH_FIELD_VELOCITY, v);
    }
    free(X);
    free(v);
    return result;
}

static uint64_t fnv(const unsigned char *bytes, size_t count)
{
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t i = 0; i < count; i++) hash = (hash ^ bytes[i]) * 0x100000001B3u;
    return hash;
}

/* Hash of the checkpoint without the description's fingerprint (bytes 16 to 23), which counts what the state does not. */
static uint64_t hash_after_steps(const portable_case *c)
{
    tlsph_solver *solver = NULL;
    moving_block s = moving_block_default();
    unsigned char *bytes;
    uint64_t hash = 0;
    size_t size = 0;
    s.cells = 6;
    s.unknowns = c->unknowns;
    s.thermal = c->thermal;
    s.material = c->material;
    s.jitter = c->jitter;
    if (!CHECK_RESULT(moving_block_create(&s, &solver, NULL), TLSPH_OK)) return 0;
    CHECK_RESULT(kick(solver), TLSPH_OK);
    CHECK_RESULT(take_steps(solver, STEPS), TLSPH_OK);
    bytes = save_state(solver, &size);
    if (CHECK(bytes != NULL && size > 24)) {
        CHECK_RESULT(tlsph_restore(solver, bytes, size), TLSPH_OK);
        hash = fnv(bytes + 24, size - 32); /* nor the checksum at the end */
    }
    free(bytes);
    tlsph_destroy(solver);
    return hash;
}

TEST(checkpoint_has_the_same_bytes_everywhere)
{
    if (contracts_or_reorders()) SKIP("this build fuses a*b + c, or reorders");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const uint64_t hash = hash_after_steps(cases + i);
        const uint64_t expected = sizeof(tlsph_real) == 8 ? cases[i].hash_double : cases[i].hash_float;
        if (!CHECK(hash == expected)) printf("    case %d: 0x%08lx%08lxu\n", (int)i, (unsigned long)(hash >> 32),
                                             (unsigned long)(hash & 0xffffffffu));
    }
}

SUITE(portable, ENTRY(checkpoint_has_the_same_bytes_everywhere))
