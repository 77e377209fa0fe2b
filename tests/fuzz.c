/*
fuzz.c - descriptions, fields and checkpoints from arbitrary bytes: whatever they say, the header must answer with a
result code and keep its promises

  libFuzzer:   clang -g -O1 -fsanitize=fuzzer,address,undefined -DFUZZ_ENTRY -I. tests/fuzz.c -lm -o build/fuzz
  AFL++:       afl-clang-fast -O2 -I. tests/fuzz.c -lm -o build/fuzz      (reads standard input when there is no argument)
  by itself:   build/fuzz COUNT [SEED]: COUNT random inputs; half of them are good scenes with a few bytes changed

The bytes are consumed by a reader that gives zeros at the end. Bodies are small, so that thousands run in a second.
Checks: a failed creation leaves no memory behind; a solver that was created holds finite values; a step that fails leaves
the state of the step before, bit for bit; a checkpoint restores; a damaged one is refused and changes nothing.
*/
#define TLSPH_IMPLEMENTATION
#include "../tlsph.h"

#include <stdio.h>

#define MOST_PARTICLES 64

typedef struct reader { const uint8_t *at, *end; } reader;

static uint8_t byte(reader *r) { return r->at < r->end ? *r->at++ : 0; }
/* A number in a range, of 2 bytes; now and then a wild one: that, too, must be refused and not believed. */
static tlsph_real number(reader *r, double low, double high)
{
    static const double wild[8] = {0, -1, 1e300, -1e300, 1e-300, 1e30, -0.0, 1e9};
    const unsigned a = byte(r), b = byte(r);
    if (a == 255 && b < 8) return (tlsph_real)wild[b];
    if (a == 255 && b < 12) return (tlsph_real)HUGE_VAL;
    if (a == 255 && b < 16) return (tlsph_real)(HUGE_VAL - HUGE_VAL);
    return (tlsph_real)(low + (high - low) * (256 * a + b) / 65535.0);
}
static int choice(reader *r, int count) /* rarely one that does not exist */
{
    const int b = byte(r);
    return b == 255 ? count : b == 254 ? -1 : b % count;
}

#define DEMAND(condition) ((condition) ? (void)0 : complain(#condition, __LINE__))
static void complain(const char *what, int line)
{
    fprintf(stderr, "fuzz.c:%d: does not hold: %s\n", line, what);
    abort();
}

/* ---- an allocator that counts, and sometimes fails ---- */

typedef struct tally { long live; int left; } tally;
static void *count_allocate(void *user, size_t size)
{
    tally *t = user;
    if (t->left-- == 0 || size > (size_t)1 << 26) return NULL;
    t->live++;
    return malloc(size ? size : 1);
}
static void count_release(void *user, void *memory, size_t size)
{
    tally *t = user;
    (void)size;
    if (memory) t->live--;
    free(memory);
}

/* ---- a scene of bytes ---- */

typedef struct scene {
    tlsph_real positions[3 * MOST_PARTICLES], volumes[MOST_PARTICLES];
    uint32_t list[8];
    tlsph_material materials[2];
    tlsph_condition conditions[3];
    tlsph_desc desc;
    tally memory;
} scene;

static void read_cloud(reader *r, scene *s)
{
    const int D = s->desc.dimension == 2 ? 2 : 3, side = 2 + byte(r) % 3, random = byte(r) % 4 == 0;
    size_t count = 0;
    for (int z = 0; z < (D == 3 ? side : 1); z++)
        for (int y = 0; y < side; y++)
            for (int x = 0; x < side; x++, count++) {
                const int cell[3] = {x, y, z};
                for (int i = 0; i < 3; i++) {
                    s->positions[3 * count + (size_t)i] = (tlsph_real)cell[i];
                    if (random) s->positions[3 * count + (size_t)i] += number(r, -0.5, 0.5);
                }
                s->volumes[count] = random ? number(r, 0.1, 2) : 1;
            }
    s->desc.particles.positions = s->positions;
    s->desc.particles.volumes = s->volumes;
    s->desc.particles.count = byte(r) == 255 ? byte(r) % MOST_PARTICLES : count;
    s->desc.particles.spacing = byte(r) % 4 ? 1 : number(r, 0, 3);
}
static void read_material(reader *r, tlsph_material *m)
{
    *m = tlsph_material_default((tlsph_material_kind)choice(r, TLSPH_USER + 1));
    m->density = number(r, 0.1, 10);
    m->young = number(r, 0.1, 100);
    m->poisson = number(r, -0.2, 0.499);
    m->specific_heat = number(r, 0.1, 10);
    m->conductivity = number(r, 0, 5);
    m->expansion = number(r, 0, 1e-3);
    m->reference_temperature = number(r, 1, 500);
    if (byte(r) % 4 == 0) m->mooney_fraction = number(r, 0, 1);
    if (byte(r) % 4 == 0) m->gruneisen_exponent = number(r, 0, 1);
}
static void read_condition(reader *r, scene *s, tlsph_condition *c)
{
    *c = tlsph_condition_default((tlsph_condition_kind)choice(r, TLSPH_WALL + 1));
    for (int i = 0; i < 8; i++) s->list[i] = byte(r) == 255 ? 0xffffffffu : (uint32_t)i;
    if (byte(r) % 4) {
        c->particles = s->list;
        c->count = (size_t)(byte(r) % 9);
    }
    for (int i = 0; i < 3; i++) c->value[i] = number(r, -20, 20);
    c->normal[byte(r) % 3] = 1;
    if (byte(r) % 8 == 0) c->normal[0] = number(r, -1, 1);
    c->point[0] = number(r, -3, 1);
}
static void read_scene(reader *r, scene *s)
{
    memset(s, 0, sizeof *s);
    s->desc = tlsph_desc_default(byte(r) % 4 ? 3 : byte(r) % 4);
    s->desc.unknowns = (tlsph_unknowns)choice(r, 4);
    s->desc.thermal = (tlsph_thermal)choice(r, 3);
    s->desc.operator_kind = byte(r) % 4 ? TLSPH_CORRECTED_KERNEL : (tlsph_operator_kind)choice(r, TLSPH_GIVEN + 1);
    s->desc.kernel = (tlsph_kernel)choice(r, TLSPH_WENDLAND_C4 + 1);
    if (byte(r) % 2) s->desc.support = number(r, 0.3, 1.5);
    s->desc.dissipation = (tlsph_dissipation)choice(r, TLSPH_NO_DISSIPATION + 1);
    s->desc.conduction = (tlsph_conduction)choice(r, 2);
    s->desc.volume_coupling = (tlsph_volume_coupling)choice(r, 2);
    s->desc.integrator = (tlsph_integrator)choice(r, TLSPH_RK4_FROZEN + 1);
    s->desc.projection = byte(r) % 2;
    s->desc.sharp_gradients = byte(r) % 4 == 0;
    s->desc.audit = byte(r) % 4 == 0;
    if (byte(r) % 4 == 0) s->desc.cfl = number(r, 0, 1.2);
    s->desc.threads = 1;
    for (int i = 0; i < 2; i++) read_material(r, s->materials + i);
    s->desc.materials = s->materials;
    s->desc.material_count = byte(r) == 255 ? 0 : 1;
    read_cloud(r, s);
    s->desc.condition_count = (size_t)(byte(r) % 4);
    s->desc.conditions = s->conditions;
    for (size_t i = 0; i < s->desc.condition_count; i++) read_condition(r, s, s->conditions + i);
    s->memory.left = byte(r) < 8 ? byte(r) % 16 : -1;
    s->desc.allocator.allocate = count_allocate;
    s->desc.allocator.release = count_release;
    s->desc.allocator.user = &s->memory;
}

/* ---- what is done with it ---- */

static int finite_state(const tlsph_solver *solver)
{
    tlsph_real values[9 * MOST_PARTICLES];
    static const tlsph_field fields[] = {TLSPH_FIELD_POSITION, TLSPH_FIELD_VELOCITY, TLSPH_FIELD_F, TLSPH_FIELD_STRESS};
    for (size_t k = 0; k < sizeof fields / sizeof *fields; k++) {
        if (tlsph_read(solver, fields[k], values)) return 0;
        for (size_t i = 0; i < tlsph_count(solver) * (size_t)tlsph_field_components(fields[k]); i++)
            if (!tlsphi_finite(values[i])) return 0;
    }
    return 1;
}
static void try_write(reader *r, tlsph_solver *solver)
{
    tlsph_real values[9 * MOST_PARTICLES];
    const tlsph_field field = (tlsph_field)choice(r, TLSPH_FIELD_COUNT);
    const int components = tlsph_field_components(field);
    for (size_t i = 0; i < 9 * MOST_PARTICLES; i++) values[i] = components == 9 && i % 9 % 4 == 0 ? 1 : 0;
    for (int i = byte(r) % 16; i > 0; i--) values[byte(r) % (9 * MOST_PARTICLES)] += number(r, -1, 1);
    tlsph_write(solver, field, values);
    DEMAND(finite_state(solver));
}
static void try_steps(reader *r, tlsph_solver *solver, uint8_t *before, uint8_t *after, size_t size)
{
    for (int i = byte(r) % 8; i > 0; i--) {
        const tlsph_real limit = byte(r) % 2 ? (tlsph_real)HUGE_VAL : number(r, 0, 1);
        DEMAND(tlsph_save(solver, before, size) == TLSPH_OK);
        if (tlsph_step(solver, limit)) {
            DEMAND(tlsph_last_error(solver)->result != TLSPH_OK && tlsph_last_error(solver)->message[0]);
            DEMAND(tlsph_save(solver, after, size) == TLSPH_OK && memcmp(before, after, size) == 0);
            return;
        }
        DEMAND(finite_state(solver));
    }
}
static void try_checkpoint(reader *r, tlsph_solver *solver, uint8_t *good, uint8_t *other, size_t size)
{
    DEMAND(tlsph_save(solver, good, size) == TLSPH_OK);
    memcpy(other, good, size);
    const size_t place = (size_t)(256 * byte(r) + byte(r)) % size;
    const uint8_t change = byte(r);
    other[place] ^= change;
    DEMAND(tlsph_restore(solver, other, size) == (change ? TLSPH_ERROR_CHECKPOINT : TLSPH_OK));
    DEMAND(tlsph_restore(solver, other, size / 2) == TLSPH_ERROR_CHECKPOINT);
    DEMAND(tlsph_save(solver, other, size) == TLSPH_OK && memcmp(good, other, size) == 0);
}

static long created; /* how many scenes were good: shown at the end */

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count)
{
    reader r;
    scene s;
    tlsph_solver *solver = NULL;
    tlsph_error error;
    r.at = data;
    r.end = data + count;
    read_scene(&r, &s);
    const tlsph_result result = tlsph_create(&s.desc, &solver, &error);
    DEMAND((result == TLSPH_OK) == (solver != NULL));
    if (result) {
        DEMAND(error.result == result && error.message[0] && s.memory.live == 0);
        return 0;
    }
    created++;
    const size_t size = tlsph_save_size(solver);
    uint8_t *before = malloc(size), *after = malloc(size);
    DEMAND(before && after && finite_state(solver));
    try_write(&r, solver);
    try_steps(&r, solver, before, after, size);
    try_checkpoint(&r, solver, before, after, size);
    free(before);
    free(after);
    tlsph_destroy(solver);
    DEMAND(s.memory.live == 0);
    return 0;
}

#ifndef FUZZ_ENTRY

static uint64_t random_bits(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}
int main(int argc, char **argv)
{
    enum { LENGTH = 512 };
    uint8_t bytes[4096];
    if (argc < 2) {
        const size_t count = fread(bytes, 1, sizeof bytes, stdin);
        return LLVMFuzzerTestOneInput(bytes, count);
    }
    const long count = strtol(argv[1], NULL, 10);
    uint64_t state = argc > 2 ? strtoull(argv[2], NULL, 10) * 2 + 1 : 88172645463325253u;
    for (long i = 0; i < count; i++) {
        const int plain = (int)(random_bits(&state) % 2);
        for (int k = 0; k < LENGTH; k++) {
            const uint64_t bits = random_bits(&state);
            /* plain: bytes that mean nothing unusual; 255 and 254 stand for what does not exist */
            bytes[k] = (uint8_t)(plain && bits >> 32 & 7 ? bits % 254 : bits);
        }
        LLVMFuzzerTestOneInput(bytes, LENGTH);
    }
    printf("%ld of %ld scenes were good\n1 passed, 0 failed\n", created, count);
    return 0;
}

#endif
