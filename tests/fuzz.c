/*
fuzz.c - descriptions, fields, checkpoints, shapes, surfaces, materials and nodes from arbitrary bytes: whatever they say,
the header must answer with a result code and keep its promises

  build/fuzz COUNT [SEED]        COUNT random inputs; half of them are good ones with a few bytes changed
  make build/fuzz_libfuzzer      clang: build/fuzz_libfuzzer -runs=1000000 [corpus folder]
  make build/fuzz_afl            AFL++: afl-fuzz -i seeds -o out -- build/fuzz_afl
  build/fuzz < file              one input, for instance one that a fuzzer found

The bytes are consumed by a reader that gives zeros at the end. Bodies are tiny, so that thousands run in a second. The
first byte says what is tried; checks: a failed creation leaves no memory behind; a solver that was created holds finite
values; a step that fails leaves the state of the step before, bit for bit; a checkpoint restores; a damaged one is refused
and changes nothing; a forged one (right checksum) leads to a state that holds finite values or changes nothing.
*/
#define TLSPH_IMPLEMENTATION
#include "../tlsph.h"

#include <stdio.h>

#define MOST_PARTICLES 64
#define MOST_PAIRS 256

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

typedef struct tally { long live; int left; size_t most; } tally; /* most: bytes of one allocation; 0: 64 MiB */
static void *count_allocate(void *user, size_t size)
{
    tally *t = user;
    if (t->left-- == 0 || size > (t->most ? t->most : (size_t)1 << 26)) return NULL;
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
    tlsph_real positions[3 * MOST_PARTICLES], volumes[MOST_PARTICLES], extra[3 * MOST_PARTICLES];
    tlsph_real vectors[3 * MOST_PAIRS], areas[24];
    uint32_t list[8], cells[8 * 8], neighbours[MOST_PAIRS];
    size_t first[MOST_PARTICLES + 1];
    uint8_t material_of[MOST_PARTICLES];
    tlsph_material materials[2];
    tlsph_condition conditions[3];
    tlsph_desc desc;
    tally memory;
} scene;

/* Cells, pairs and areas of the lattice of read_cloud, with now and then a wrong number. */
static void read_cells(reader *r, scene *s, int D, int side)
{
    tlsph_particles *p = &s->desc.particles;
    for (int c = 0; c < 8 && c < (D == 3 ? (side - 1) * (side - 1) * (side - 1) : (side - 1) * (side - 1)); c++) {
        const int m = side - 1, x = c % m, y = c / m % m, z = c / m / m;
        for (int k = 0; k < 1 << D; k++)
            s->cells[(p->cell_count << D) + (size_t)k] =
                byte(r) >= 254 ? byte(r) : (uint32_t)(((z + (k >> 2)) * side + y + (k >> 1 & 1)) * side + x + (k & 1));
        p->cell_count++;
    }
    p->cells = byte(r) == 255 ? NULL : s->cells;
}
static void read_pairs(reader *r, scene *s, int D)
{
    tlsph_particles *p = &s->desc.particles;
    size_t at = 0;
    for (size_t a = 0; a < p->count; a++) {
        for (size_t b = 0; b < p->count && at < MOST_PAIRS; b++) {
            tlsph_real d[3], r2 = 0;
            for (size_t k = 0; k < 3; k++) d[k] = p->positions[3 * b + k] - p->positions[3 * a + k];
            for (int k = 0; k < D; k++) r2 += d[k] * d[k];
            if (a == b || !(r2 < 1.5)) continue;
            s->neighbours[at] = byte(r) == 255 ? byte(r) : (uint32_t)b;
            for (size_t k = 0; k < 3; k++) s->vectors[3 * at + k] = byte(r) == 255 ? number(r, -1, 1) : d[k];
            at++;
        }
        s->first[a + 1] = at;
    }
    p->first = s->first;
    p->neighbours = s->neighbours;
    p->pair_vectors = byte(r) == 255 ? NULL : s->vectors;
}
static void read_cloud(reader *r, scene *s)
{
    const int D = s->desc.dimension == 2 ? 2 : 3, side = byte(r) % 8 ? 2 : 3, random = byte(r) % 4 == 0;
    tlsph_particles *p = &s->desc.particles;
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
    p->positions = s->positions;
    p->volumes = s->volumes;
    p->count = byte(r) == 255 ? byte(r) % MOST_PARTICLES : count;
    p->spacing = byte(r) % 4 ? 1 : number(r, 0, 3);
    switch (byte(r) % 16) {
    case 0: p->weights = s->extra; break;
    case 1: p->spacings = s->extra; break;
    case 2: p->areas = s->extra; break;
    case 3: p->materials = s->material_of; break;
    default: break;
    }
    for (size_t i = 0; i < 3 * count && (p->weights || p->spacings || p->areas); i++)
        s->extra[i] = p->areas ? 2 * s->positions[i] - 1 : number(r, 0.5, 1.5);
    for (size_t a = 0; a < count && p->materials; a++) s->material_of[a] = byte(r) == 255 ? byte(r) : byte(r) % 2;
    if (s->desc.operator_kind == TLSPH_CELLS || s->desc.operator_kind == TLSPH_CELLS_4) read_cells(r, s, D, side);
    if (s->desc.operator_kind == TLSPH_GIVEN) read_pairs(r, s, D);
}
/* A spring between F and I, with wrong derivatives if the bytes behind `user` say so; it may return anything. */
static void respond(void *user, size_t count, const uint32_t *particle, const tlsph_real *F, const tlsph_real *J,
                    tlsph_response *out)
{
    const uint8_t *wish = user;
    (void)particle, (void)J;
    memset(out, 0, count * sizeof *out);
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 9; k++) {
            const tlsph_real e = F[9 * i + (size_t)k] - (k % 4 == 0);
            out[i].energy += 5 * e * e;
            out[i].e_F[k] = 10 * e;
        }
        out[i].p_modulus[0] = wish[0] == 255 ? (tlsph_real)-1 : 10;
        out[i].s_modulus[0] = 10;
        if (wish[1] == 255) out[i].e_F[wish[2] % 9] = (tlsph_real)(HUGE_VAL - HUGE_VAL);
    }
}
static void read_material(reader *r, tlsph_material *m)
{
    static uint8_t wishes[3];
    *m = tlsph_material_default((tlsph_material_kind)choice(r, TLSPH_USER + 1));
    m->density = number(r, 0.1, 10);
    m->young = number(r, 0.1, 100);
    m->poisson = number(r, -0.2, 0.5);
    m->specific_heat = number(r, 0.1, 10);
    m->conductivity = number(r, 0, 5);
    if (m->kind != TLSPH_NEO_HOOKEAN) m->expansion = number(r, 0, 1e-3);
    m->reference_temperature = number(r, 1, 500);
    if (byte(r) % 4 == 0) m->mooney_fraction = number(r, 0, 1);
    if (byte(r) % 4 == 0) m->gruneisen_exponent = number(r, 0, 1);
    if (m->kind == TLSPH_VON_MISES) {
        m->yield_stress = number(r, 0.01, 1);
        m->hardening = number(r, 0, 10);
        m->plastic_heat = number(r, 0, 1);
    }
    for (int i = 0; i < 3; i++) wishes[i] = byte(r);
    if (byte(r) != 255) m->response = respond;
    m->response_user = wishes;
}
/* Values that follow from the place, and if `user` says so impossible ones. */
static void follow(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                   const tlsph_real *x, tlsph_real *values)
{
    const scene *s = user;
    (void)time, (void)particle, (void)X;
    for (size_t i = 0; i < count; i++) values[i] = x[3 * i] * s->areas[0];
}
static void read_condition(reader *r, scene *s, tlsph_condition *c)
{
    *c = tlsph_condition_default((tlsph_condition_kind)choice(r, TLSPH_WALL + 1));
    for (int i = 0; i < 8; i++) s->list[i] = byte(r) == 255 ? 0xffffffffu : (uint32_t)i % 4;
    if (byte(r) % 4) {
        c->particles = s->list;
        c->count = (size_t)(byte(r) % 9);
    }
    for (int i = 0; i < 3; i++) c->value[i] = number(r, -20, 20);
    c->normal[byte(r) % 3] = 1;
    if (byte(r) % 8 == 0) c->normal[0] = number(r, -1, 1);
    c->point[0] = number(r, -3, 1);
    c->conducts = byte(r) % 2;
    for (int i = 0; i < 24; i++) s->areas[i] = (tlsph_real)0.25;
    if (byte(r) % 8 == 0) s->areas[byte(r) % 24] = number(r, -1, 1);
    if (byte(r) % 4 == 0 && c->particles) c->areas = s->areas;
    if (byte(r) % 8 == 0) {
        c->values = follow;
        c->values_user = s;
    }
}
static void read_desc(reader *r, tlsph_desc *d)
{
    *d = tlsph_desc_default(byte(r) % 4 ? 3 : byte(r) % 4);
    d->unknowns = (tlsph_unknowns)choice(r, 4);
    d->thermal = (tlsph_thermal)choice(r, 3);
    d->operator_kind = byte(r) % 2 ? TLSPH_CORRECTED_KERNEL : (tlsph_operator_kind)choice(r, TLSPH_CLOSED + 1);
    d->kernel = (tlsph_kernel)choice(r, TLSPH_WENDLAND_C4 + 1);
    if (byte(r) % 2) d->support = number(r, 0.3, 1.5);
    d->dissipation = (tlsph_dissipation)choice(r, TLSPH_SELF_ADJOINT + 1);
    d->conduction = (tlsph_conduction)choice(r, 2);
    d->volume_coupling = (tlsph_volume_coupling)choice(r, 2);
    d->integrator = (tlsph_integrator)choice(r, TLSPH_LEAPFROG + 1);
    d->projection = byte(r) % 2;
    d->sharp_gradients = byte(r) % 8 == 0;
    d->audit = byte(r) % 4 == 0;
    if (byte(r) % 4 == 0) d->cfl = number(r, 0, 1.2);
    switch (byte(r) % 16) { /* what is rarer */
    case 0: d->harmonic = number(r, 0, 1); break;
    case 1: d->drift_relaxation = number(r, 0, 1); break;
    case 2: d->conduction_stages = byte(r) % 16; break;
    case 3: d->retries = byte(r) % 8; break;
    case 4: d->force_form = (tlsph_force_form)choice(r, 2); break;
    case 5: d->step_rule = (tlsph_step_rule)choice(r, 3); break;
    case 6: d->mirror_gradients = 0; break;
    case 7: d->dissipation_heats = 0; break;
    case 8: d->jump_share = number(r, 0, 2); break;
    case 9: d->drift_scale = number(r, 0, 1); break;
    case 10: d->tight_closure = 1; break;
    case 11:
        d->scheme = (tlsph_scheme)choice(r, 2);
        d->thermal = TLSPH_ISOTHERMAL;
        d->integrator = TLSPH_RK2;
        d->incompressible.iteration = (tlsph_pressure_iteration)choice(r, 2);
        d->incompressible.iteration_limit = byte(r) % 64;
        d->incompressible.laplacian_as_printed = byte(r) % 2;
        d->incompressible.tolerance = (tlsph_real)0.001;
        break;
    case 12:
        d->rates = byte(r) % 10;
        d->thermal = TLSPH_ISOTHERMAL;
        d->integrator = TLSPH_LEAPFROG;
        break;
    default: break;
    }
    d->threads = 1;
}
static void read_scene(reader *r, scene *s)
{
    memset(s, 0, sizeof *s);
    read_desc(r, &s->desc);
    for (int i = 0; i < 2; i++) read_material(r, s->materials + i);
    s->desc.materials = s->materials;
    s->desc.material_count = byte(r) == 255 ? 0 : 1 + byte(r) % 2;
    read_cloud(r, s);
    s->desc.condition_count = (size_t)(byte(r) % 4);
    s->desc.conditions = s->conditions;
    for (size_t i = 0; i < s->desc.condition_count; i++) read_condition(r, s, s->conditions + i);
    s->memory.left = byte(r) < 8 ? byte(r) % 24 : -1;
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
    for (int i = byte(r) % 4; i > 0; i--) {
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

static long tried[8], good[8]; /* inputs of each kind, and how many were good ones */

static void fuzz_scene(reader *r)
{
    static scene s;
    tlsph_solver *solver = NULL;
    tlsph_error error;
    tlsph_preflight_report report;
    tlsph_ledger ledger;
    read_scene(r, &s);
    const tlsph_result result = tlsph_create(&s.desc, &solver, &error);
    DEMAND((result == TLSPH_OK) == (solver != NULL));
    if (result) {
        DEMAND(error.result == result && error.message[0] && s.memory.live == 0);
        return;
    }
    good[0]++;
    const size_t size = tlsph_save_size(solver);
    uint8_t *before = malloc(size), *after = malloc(size);
    DEMAND(before && after && finite_state(solver));
    if (byte(r) % 2) try_write(r, solver);
    try_steps(r, solver, before, after, size);
    if (byte(r) % 4 == 0) try_checkpoint(r, solver, before, after, size);
    if (byte(r) % 8 == 0) tlsph_preflight(solver, number(r, 0, 10), &report);
    if (byte(r) % 8 == 0) tlsph_advance(solver, number(r, -1, 0.001));
    tlsph_ledger_read(solver, &ledger);
    DEMAND(finite_state(solver));
    free(before);
    free(after);
    tlsph_destroy(solver);
    DEMAND(s.memory.live == 0);
}

/* Solvers that stay, in several kinds: many checkpoints a creation. */
static tlsph_solver *standing(int kind)
{
    static tlsph_solver *solvers[8];
    static const tlsph_real X[24] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
    static const tlsph_real V[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    static const tlsph_material_kind kinds[4] = {TLSPH_NEO_HOOKEAN, TLSPH_MIE_GRUNEISEN, TLSPH_VON_MISES, TLSPH_LINEAR};
    if (solvers[kind]) return solvers[kind];
    tlsph_material m = tlsph_material_default(kinds[kind % 4]);
    tlsph_desc d = tlsph_desc_default(kind < 4 ? 3 : 2);
    m.density = m.young = m.specific_heat = m.yield_stress = 1;
    m.poisson = (tlsph_real)0.3;
    d.particles.count = kind < 4 ? 8 : 4;
    d.particles.positions = X;
    d.particles.volumes = V;
    d.particles.spacing = 1;
    d.materials = &m;
    d.material_count = 1;
    d.unknowns = (tlsph_unknowns)(kind % 4);
    d.thermal = (tlsph_thermal)(kind % 3);
    d.threads = 1;
    if (kind == 4) {
        d.scheme = TLSPH_INCOMPRESSIBLE;
        d.unknowns = TLSPH_PF;
        d.thermal = TLSPH_ISOTHERMAL;
    }
    DEMAND(tlsph_create(&d, solvers + kind, NULL) == TLSPH_OK);
    return solvers[kind];
}
static void fuzz_checkpoint(reader *r)
{
    static uint8_t before[4096], forged[4096], after[4096];
    tlsph_solver *const solver = standing(byte(r) % 8);
    const size_t size = tlsph_save_size(solver);
    DEMAND(size <= sizeof before && tlsph_save(solver, before, size) == TLSPH_OK);
    memcpy(forged, before, size);
    for (int i = 1 + byte(r) % 4; i > 0; i--) {
        const size_t place = (size_t)(256 * byte(r) + byte(r)) % size;
        forged[place] = byte(r);
    }
    if (byte(r) % 8) { /* a checksum for it: FNV-1a, as [CHECKPOINT] says */
        uint64_t h = 0xcbf29ce484222325u;
        for (size_t i = 0; i < size - 8; i++) h = (h ^ forged[i]) * 0x100000001b3u;
        for (size_t i = 0; i < 8; i++) forged[size - 8 + i] = (uint8_t)(h >> (8 * i));
    }
    const tlsph_result result = tlsph_restore(solver, forged, size);
    DEMAND(result == TLSPH_OK || result == TLSPH_ERROR_CHECKPOINT);
    DEMAND(tlsph_save(solver, after, size) == TLSPH_OK);
    if (result) {
        DEMAND(memcmp(before, after, size) == 0);
        return;
    }
    good[1]++;
    DEMAND(memcmp(forged, after, size) == 0);
    if (tlsph_step(solver, 1)) {
        DEMAND(tlsph_save(solver, forged, size) == TLSPH_OK && memcmp(forged, after, size) == 0);
    } else DEMAND(finite_state(solver));
    DEMAND(tlsph_restore(solver, before, size) == TLSPH_OK);
}

typedef struct shape_bytes { tlsph_real a, b; int wild; } shape_bytes;
static int shape_inside(void *user, const tlsph_real X[3])
{
    const shape_bytes *s = user;
    return X[0] * s->a + X[1] * s->b < 1;
}
static tlsph_real shape_distance(void *user, const tlsph_real X[3])
{
    const shape_bytes *s = user;
    const tlsph_real centre[3] = {s->a, s->b, s->b};
    if (s->wild > 252 && X[0] > s->a) return (tlsph_real)(s->wild == 255 ? HUGE_VAL - HUGE_VAL : HUGE_VAL);
    return tlsph_distance_sphere(X, centre, (tlsph_real)0.4);
}
static tlsph_real shape_spacing(void *user, const tlsph_real X[3])
{
    const shape_bytes *s = user;
    return s->wild > 250 ? (s->wild > 252 ? (tlsph_real)(HUGE_VAL - HUGE_VAL) : 0) : (tlsph_real)0.5 + X[0] * s->a / 8;
}
static const tlsph_real tetrahedron[36] = {0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1,
                                           0, 0, 0, 0, 0, 1, 0, 1, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const tlsph_real triangle[18] = {0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0};
/* Tetrahedron or triangle, with a corner moved everywhere or in one facet only (a leak). */
static void read_surface(reader *r, int dimension, tlsph_real corners[36], tlsph_surface *out)
{
    out->count = dimension == 2 ? 3 : 4;
    out->corners = corners;
    memcpy(corners, dimension == 2 ? triangle : tetrahedron, sizeof triangle * (dimension == 2 ? 1 : 2));
    if (byte(r) == 255) out->count = byte(r) % 5;
    if (byte(r) % 4) return;
    const int entry = byte(r) % 36, everywhere = byte(r) % 2;
    const tlsph_real from[3] = {corners[entry - entry % 3], corners[entry - entry % 3 + 1], corners[entry - entry % 3 + 2]};
    const tlsph_real to = number(r, -1, 2);
    for (int c = 0; c < 36; c += 3)
        if (c == entry - entry % 3 || (everywhere && !memcmp(corners + c, from, sizeof from))) corners[c + entry % 3] = to;
}
static void fuzz_cloud(reader *r)
{
    tally memory = {0, -1, 1 << 22};
    shape_bytes bytes;
    tlsph_fill f = tlsph_fill_default(byte(r) % 4 ? 2 : 3);
    tlsph_cloud cloud;
    tlsph_error error;
    tlsph_real corners[36] = {0};
    if (byte(r) == 255) f.dimension = byte(r);
    f.shape = (tlsph_shape)choice(r, TLSPH_TRIANGLES + 1);
    f.placement = byte(r) % 32 ? (tlsph_placement)(byte(r) % 2) : (tlsph_placement)choice(r, 3);
    if (f.shape == TLSPH_TRIANGLES && byte(r) % 8 == 0) f.placement = TLSPH_SCATTERED;
    for (int i = 0; i < 3; i++) {
        f.origin[i] = number(r, -1, 1);
        f.size[i] = number(r, 0.5, 1.5);
    }
    f.notch[0] = number(r, 0.1, 1);
    f.notch[1] = number(r, 0.1, 1);
    f.inner_radius = byte(r) % 2 ? 0 : number(r, 0, 0.4);
    f.axis = byte(r) == 255 ? byte(r) : byte(r) % 3;
    f.spacing = number(r, 0.35, 0.7);
    if (byte(r) % 2) f.jitter = number(r, 0, 0.46);
    f.seed = byte(r);
    f.voronoi = byte(r) % 32 == 0;
    bytes.a = number(r, -1, 1);
    bytes.b = number(r, -1, 1);
    bytes.wild = byte(r);
    f.inside_user = f.distance_user = f.spacing_user = &bytes;
    f.inside = byte(r) == 255 ? NULL : shape_inside;
    f.distance = byte(r) == 255 ? NULL : shape_distance;
    if (byte(r) % 4 == 0) f.spacing_at = shape_spacing;
    if (f.dimension == 2 || f.dimension == 3) read_surface(r, f.dimension, corners, &f.surface);
    memory.left = byte(r) < 8 ? byte(r) % 48 : -1;
    f.allocator.allocate = count_allocate;
    f.allocator.release = count_release;
    f.allocator.user = &memory;
    if ((double)f.size[0] * (double)f.size[1] * (double)f.size[2] > 1e3 * pow((double)f.spacing, 3)) return; /* slow */
    const tlsph_result result = tlsph_cloud_create(&f, &cloud, &error);
    DEMAND((result == TLSPH_OK) == (cloud.memory != NULL));
    if (result) DEMAND(error.result == result && error.message[0] && memory.live == 0);
    else good[2]++;
    for (size_t i = 0; i < cloud.particles.count; i++)
        DEMAND(tlsphi_all_finite(cloud.particles.positions + 3 * i, 3) && tlsphi_finite(cloud.particles.volumes[i]));
    tlsph_cloud_destroy(&cloud);
    DEMAND(memory.live == 0);
}
static void fuzz_voronoi(reader *r)
{
    const int dimension = byte(r) % 2 ? 2 : 3;
    tlsph_particles p;
    tlsph_surface surface;
    tlsph_error error;
    tlsph_real X[24], V[8], B[24], corners[36] = {0}, spacings[8];
    memset(&p, 0, sizeof p);
    p.count = (size_t)(1 + byte(r) % 8);
    for (size_t i = 0; i < 24; i++) X[i] = dimension == 2 && i % 3 == 2 ? 0 : number(r, 0.01, i % 3 ? 0.3 : 0.4);
    for (size_t i = 0; i < 8; i++) spacings[i] = number(r, 0.3, 1);
    p.positions = X;
    p.spacing = byte(r) % 4 ? 1 : number(r, 0.1, 2);
    if (byte(r) % 4 == 0) p.spacings = spacings;
    read_surface(r, dimension, corners, &surface);
    const tlsph_result result = tlsph_voronoi(dimension, &p, &surface, NULL, V, B, NULL, &error);
    if (result) {
        DEMAND(error.result == result && error.message[0]);
        return;
    }
    good[3]++;
    for (size_t i = 0; i < p.count; i++) DEMAND(tlsphi_finite(V[i]) && tlsphi_all_finite(B + 3 * i, 3));
}
static void fuzz_material(reader *r)
{
    tlsph_material m;
    tlsph_material_state state;
    tlsph_material_report report;
    tlsph_error error;
    tlsph_real F[9];
    read_material(r, &m);
    for (int i = 0; i < 9; i++) F[i] = (tlsph_real)(i % 4 == 0) + number(r, -0.5, 0.5);
    const tlsph_real theta = number(r, 0, 1000);
    if (tlsph_material_evaluate(&m, F, theta, &state) == TLSPH_OK) good[4]++;
    const tlsph_result result = tlsph_material_check(&m, (double)number(r, 0, 0.5), byte(r) % 3, &report, &error);
    DEMAND(error.result == result && (!result || error.message[0]));
}
static void fuzz_nodes(reader *r)
{
    tlsph_nodes nodes;
    tlsph_shape_functions out;
    tlsph_error error;
    tlsph_real X[36], R[12], x[3], value[12], gradient[36], implicit[36], slope[108];
    nodes.dimension = byte(r) == 255 ? byte(r) : 1 + byte(r) % 3;
    nodes.order = byte(r) == 255 ? byte(r) : 1 + byte(r) % 2;
    nodes.kernel = (tlsph_kernel)(byte(r) % 4);
    nodes.count = byte(r) % 13;
    for (int i = 0; i < 36; i++) X[i] = number(r, -1, 1);
    for (int i = 0; i < 12; i++) R[i] = number(r, 0.5, 3);
    for (int i = 0; i < 3; i++) x[i] = number(r, -1, 1);
    nodes.positions = X;
    nodes.radii = R;
    out.value = value;
    out.gradient = gradient;
    out.implicit = byte(r) % 2 ? implicit : NULL;
    out.implicit_gradient = byte(r) % 2 ? slope : NULL;
    if (tlsph_reproduce(&nodes, x, &out, &error)) return;
    good[5]++;
    double sum = 0;
    for (size_t i = 0; i < nodes.count; i++) sum += (double)value[i];
    DEMAND(fabs(sum - 1) < 1e-3);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count)
{
    static void (*const kinds[6])(reader *) = {fuzz_scene, fuzz_checkpoint, fuzz_cloud, fuzz_voronoi, fuzz_material, fuzz_nodes};
    static const char shares[] = "00000000000000111111222224444555"; /* by numbers of `kinds`; cells of particles are slow */
    reader r;
    r.at = data;
    r.end = data + count;
    const uint8_t first = byte(&r);
    const int kind = first == 255 ? 3 : shares[first % 32] - '0';
    tried[kind]++;
    kinds[kind](&r);
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
static void random_inputs(long count, uint64_t state)
{
    enum { LENGTH = 512 };
    uint8_t bytes[LENGTH];
    for (long i = 0; i < count; i++) {
        const uint64_t plain = random_bits(&state) % 4; /* how rarely a byte may stand for what does not exist */
        for (int k = 0; k < LENGTH; k += 2) {
            const uint64_t bits = random_bits(&state);
            bytes[k] = (uint8_t)(bits >> 8);
            bytes[k + 1] = (uint8_t)(bits >> 16);
            if (plain && bits >> 32 & (plain == 1 ? 7 : 255)) {
                if (bytes[k] > 250) bytes[k] = (uint8_t)(bits >> 40) & 127;
                if (bytes[k + 1] > 250) bytes[k + 1] = (uint8_t)(bits >> 48) & 127;
            }
        }
        LLVMFuzzerTestOneInput(bytes, LENGTH);
    }
}
int main(int argc, char **argv)
{
    static const char *const names[6] = {"scenes", "checkpoints", "clouds", "Voronoi cells", "materials", "nodes"};
    if (argc < 2) {
        uint8_t bytes[4096];
        const size_t count = fread(bytes, 1, sizeof bytes, stdin);
        return LLVMFuzzerTestOneInput(bytes, count);
    }
    random_inputs(strtol(argv[1], NULL, 10), argc > 2 ? strtoull(argv[2], NULL, 10) * 2 + 1 : 88172645463325253u);
    for (int i = 0; i < 6; i++) printf("%s: %ld, %ld good\n", names[i], tried[i], good[i]);
    printf("1 passed, 0 failed\n");
    return 0;
}

#endif
