/* Sizes near the limits of their types, which must be refused before any array is touched; and the balances under every
   rounding mode of the machine and with denormals flushed to zero. */
#include "support.h"

#include <fenv.h>
#if defined(__SSE2__) && !defined(__TINYC__)
#include <immintrin.h>
#endif

static void *malloc_like(void *user, size_t size)
{
    (void)user;
    return malloc(size);
}

/* ---- sizes ---- */

typedef struct small_scene { own_cloud cloud; tlsph_material material; tlsph_desc desc; } small_scene;

static int small_scene_make(small_scene *s)
{
    static const int cells[3] = {2, 2, 2};
    s->material = soft_material(TLSPH_NEO_HOOKEAN);
    s->desc = tlsph_desc_default(3);
    if (!own_box(&s->cloud, 3, cells, 0.5, 0)) return 0;
    s->desc.particles = s->cloud.particles;
    s->desc.materials = &s->material;
    s->desc.material_count = 1;
    s->desc.threads = 1;
    return 1;
}
/* Both calls refuse, take no memory, and say why. */
static void refused(small_scene *s, tlsph_result expected)
{
    tally counts;
    tlsph_size size;
    tlsph_error error;
    tlsph_solver *solver = NULL;
    memset(&counts, 0, sizeof counts);
    s->desc.allocator = tally_allocator(&counts);
    CHECK_RESULT(tlsph_measure(&s->desc, &size, &error), expected);
    CHECK(error.message[0] != 0);
    CHECK_RESULT(tlsph_create(&s->desc, &solver, &error), expected);
    CHECK(error.message[0] != 0 && !solver);
    CHECK_SAME(counts.live, 0);
}
static const size_t edges[] = {SIZE_MAX,         SIZE_MAX - 1,       SIZE_MAX / 2 + 1, SIZE_MAX / 3 + 1, SIZE_MAX / 8 + 1,
                               SIZE_MAX / 8 + 2, SIZE_MAX / 24 + 1,  0xffffffffu,      SIZE_MAX / 64 + 1};
#define EDGES (sizeof edges / sizeof *edges)

TEST(counts_near_the_limits)
{
    small_scene s;
    REQUIRE(small_scene_make(&s));
    const tlsph_desc good = s.desc;
    for (size_t i = 0; i < EDGES; i++) {
        s.desc.particles.count = edges[i];
        if (edges[i] > 0xfffffffeu) refused(&s, TLSPH_ERROR_DESCRIPTION);
        s.desc = good;
        s.desc.operator_kind = TLSPH_CELLS;
        s.desc.particles.cell_count = edges[i];
        refused(&s, TLSPH_ERROR_DESCRIPTION);
        s.desc.operator_kind = TLSPH_CELLS_4;
        refused(&s, TLSPH_ERROR_DESCRIPTION);
        s.desc = good;
        s.desc.material_count = edges[i];
        refused(&s, TLSPH_ERROR_DESCRIPTION);
        s.desc = good;
    }
    own_cloud_destroy(&s.cloud);
}
TEST(numbers_near_the_limits)
{
    static const uint32_t numbers[3] = {0xffffffffu, 0xfffffffeu, 0x80000000u};
    small_scene s;
    tlsph_condition condition = tlsph_condition_default(TLSPH_CLAMPED);
    REQUIRE(small_scene_make(&s));
    const tlsph_desc good = s.desc;
    for (int i = 0; i < 3; i++) {
        condition.particles = &numbers[i];
        condition.count = SIZE_MAX; /* the first number ends it */
        s.desc.conditions = &condition;
        s.desc.condition_count = 1;
        refused(&s, TLSPH_ERROR_CONDITION);
        condition.particles = NULL;
        refused(&s, TLSPH_ERROR_CONDITION);
        s.desc = good;
        s.cloud.cells[5] = numbers[i];
        s.desc.operator_kind = TLSPH_CELLS;
        refused(&s, TLSPH_ERROR_ARGUMENT);
        s.desc = good;
    }
    own_cloud_destroy(&s.cloud);
}
TEST(given_lists_near_the_limits)
{
    static const uint32_t neighbours[2] = {0xffffffffu, 1};
    static const tlsph_real vectors[6] = {1, 0, 0, -1, 0, 0};
    size_t first[28] = {0};
    small_scene s;
    REQUIRE(small_scene_make(&s));
    s.desc.operator_kind = TLSPH_GIVEN;
    s.desc.particles.first = first;
    s.desc.particles.neighbours = neighbours;
    s.desc.particles.pair_vectors = vectors;
    for (size_t i = 0; i < EDGES; i++) {
        for (int k = 1; k < 28; k++) first[k] = edges[i];
        refused(&s, TLSPH_ERROR_ARGUMENT); /* the first neighbour is nobody */
        first[1] = 0;
        first[2] = SIZE_MAX - 1;
        first[3] = 1;
        for (int k = 4; k < 28; k++) first[k] = 1;
        refused(&s, TLSPH_ERROR_ARGUMENT);
    }
    own_cloud_destroy(&s.cloud);
}
TEST(lattices_near_the_limits)
{
    static const double finest[4] = {1e-3, 2.5e-4, 2.44e-4, 1e-30};
    for (int dimension = 2; dimension <= 3; dimension++)
        for (int i = 0; i < 4; i++) {
            tally counts;
            tlsph_fill fill = tlsph_fill_default(dimension);
            tlsph_cloud cloud;
            tlsph_error error;
            if (dimension == 2 && i < 2) continue; /* that can be had */
            memset(&counts, 0, sizeof counts);
            fill.size[0] = fill.size[1] = fill.size[2] = 1;
            fill.spacing = R(finest[i]);
            fill.allocator = tally_allocator(&counts);
            if (i == 0) fill.size[0] = fill.size[1] = fill.size[2] = 4; /* 4000 cells an axis */
            const tlsph_result result = tlsph_cloud_create(&fill, &cloud, &error);
            CHECK(result == TLSPH_ERROR_SIZE || result == TLSPH_ERROR_DESCRIPTION);
            CHECK(error.message[0] != 0 && !cloud.memory && counts.calls == 0);
        }
}
static const tlsph_real square[24] = {0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 1, 0, 1, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0};
TEST(surfaces_near_the_limits)
{
    tlsph_real X[3] = {R(0.5), R(0.5), 0}, V[1], B[3], spacings[2] = {1, R(1e-9)}, corners[24];
    tlsph_particles particles;
    tlsph_surface surface = {4, square};
    tlsph_fill fill = tlsph_fill_default(2);
    tlsph_cloud cloud;
    memset(&particles, 0, sizeof particles);
    particles.count = 1;
    particles.positions = X;
    particles.spacing = 1;
    CHECK_RESULT(tlsph_voronoi(2, &particles, &surface, NULL, V, B, NULL, NULL), TLSPH_OK);
    for (size_t i = 0; i < EDGES; i++) {
        particles.count = edges[i];
        if (edges[i] > 0xfffffffeu)
            CHECK_RESULT(tlsph_voronoi(2, &particles, &surface, NULL, V, B, NULL, NULL), TLSPH_ERROR_ARGUMENT);
        particles.count = 1;
        if (edges[i] <= 1000000000u) continue; /* of 32 bits: so many facets are allowed */
        surface.count = edges[i];
        CHECK_RESULT(tlsph_voronoi(2, &particles, &surface, NULL, V, B, NULL, NULL), TLSPH_ERROR_SURFACE);
        fill.shape = TLSPH_TRIANGLES;
        fill.placement = TLSPH_SCATTERED;
        fill.surface = surface;
        fill.spacing = R(0.5);
        CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, NULL), TLSPH_ERROR_SURFACE);
        surface.count = 4;
    }
    fill.surface = surface;
    fill.spacing = R(1e-30);
    CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, NULL), TLSPH_ERROR_DESCRIPTION);
    for (int i = 0; i < 24; i++) corners[i] = square[i] * R(1e30) * R(sizeof(tlsph_real) == 8 ? 1e250 : 1);
    fill.surface.corners = corners;
    fill.spacing = corners[3];
    CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, NULL), TLSPH_ERROR_SURFACE); /* their area cannot be had */
    fill.surface.corners = NULL;
    CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, NULL), TLSPH_ERROR_SURFACE);
    particles.count = 2;
    particles.spacings = spacings;
    tlsph_real two[6] = {R(0.2), R(0.5), 0, R(0.8), R(0.5), 0}, V2[2], B2[6];
    particles.positions = two;
    CHECK_RESULT(tlsph_voronoi(2, &particles, &surface, NULL, V2, B2, NULL, NULL), TLSPH_ERROR_ARGUMENT);
    spacings[1] = 0;
    CHECK_RESULT(tlsph_voronoi(2, &particles, &surface, NULL, V2, B2, NULL, NULL), TLSPH_ERROR_VOLUME);
    particles.spacings = NULL;
    two[1] = R(HUGE_VAL);
    CHECK_RESULT(tlsph_voronoi(2, &particles, &surface, NULL, V2, B2, NULL, NULL), TLSPH_ERROR_NOT_FINITE);
}
TEST(normals_and_lengths_near_the_limits)
{
    const tlsph_real huge = R(sizeof(tlsph_real) == 8 ? 1e200 : 1e30);
    small_scene s;
    tlsph_condition condition = tlsph_condition_default(TLSPH_ROLLER);
    REQUIRE(small_scene_make(&s));
    s.desc.conditions = &condition;
    s.desc.condition_count = 1;
    condition.normal[0] = huge; /* its square is infinite */
    refused(&s, TLSPH_ERROR_CONDITION);
    condition.kind = TLSPH_VELOCITY;
    refused(&s, TLSPH_ERROR_CONDITION);
    s.desc.condition_count = 0;
    s.desc.particles.spacing = huge;
    s.desc.support = 100;
    for (size_t a = 0; a < s.desc.particles.count; a++) s.cloud.weights[a] = huge * huge / huge;
    CHECK(tlsph_measure(&s.desc, NULL, NULL) != TLSPH_OK || sizeof(tlsph_real) == 8);
    own_cloud_destroy(&s.cloud);
}

/* A checkpoint whose checksum is right, but whose state cannot have come from steps, changes nothing. */
TEST(forged_checkpoints_are_undone)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver = NULL;
    size_t size;
    REQUIRE_OK(moving_block_create(&s, &solver, NULL));
    CHECK_RESULT(moving_block_kick(solver, 0.1), TLSPH_OK);
    CHECK_RESULT(take_steps(solver, 3), TLSPH_OK);
    unsigned char *saved = save_state(solver, &size);
    REQUIRE(saved);
    const uint64_t before = state_hash(solver);
    const size_t places[3] = {24, size - 8 - sizeof(tlsph_real), size - 8 - 1000 * sizeof(tlsph_real)};
    for (int i = 0; i < 3; i++) { /* all ones: not a number; the time, the last and another entry of the state */
        unsigned char kept[8];
        const size_t bytes = i ? sizeof(tlsph_real) : 8;
        memcpy(kept, saved + places[i], bytes);
        memset(saved + places[i], 0xff, bytes);
        for (int pass = 0; pass < 2; pass++) {
            uint64_t hash = 0xcbf29ce484222325u;
            for (size_t k = 0; k < size - 8; k++) hash = (hash ^ saved[k]) * 0x100000001b3u;
            for (int k = 0; k < 8; k++) saved[size - 8 + (size_t)k] = (unsigned char)(hash >> (8 * k) & 255);
            CHECK_RESULT(tlsph_restore(solver, saved, size), pass ? TLSPH_OK : TLSPH_ERROR_CHECKPOINT);
            CHECK(state_hash(solver) == before);
            memcpy(saved + places[i], kept, bytes);
        }
    }
    saved[8] = 12 - (unsigned char)sizeof(tlsph_real); /* one of the other precision */
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t k = 0; k < size - 8; k++) hash = (hash ^ saved[k]) * 0x100000001b3u;
    for (int k = 0; k < 8; k++) saved[size - 8 + (size_t)k] = (unsigned char)(hash >> (8 * k) & 255);
    CHECK_RESULT(tlsph_restore(solver, saved, size), TLSPH_ERROR_CHECKPOINT);
    CHECK(strcmp(tlsph_last_error(solver)->field, "fingerprint") == 0 && state_hash(solver) == before);
    CHECK_RESULT(take_steps(solver, 3), TLSPH_OK);
    free(saved);
    tlsph_destroy(solver);
}

/* ---- arguments, one wrong at a time ---- */

TEST(every_field_says_whether_it_can_be_written)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver = NULL;
    int writable = 0;
    REQUIRE_OK(moving_block_create(&s, &solver, NULL));
    for (int field = 0; field < TLSPH_FIELD_COUNT; field++) {
        const tlsph_result result = tlsph_write(solver, (tlsph_field)field, NULL);
        CHECK(result == TLSPH_ERROR_FIELD || result == TLSPH_ERROR_ARGUMENT);
        writable += result == TLSPH_ERROR_ARGUMENT;
    }
    CHECK_SAME(writable, 5); /* position, velocity, F, J, temperature */
    tlsph_destroy(solver);
}
static tlsph_fill good_fill(void)
{
    tlsph_fill f = tlsph_fill_default(3);
    f.size[0] = f.size[1] = f.size[2] = 1;
    f.spacing = R(0.5);
    return f;
}
TEST(every_entry_of_a_fill_is_checked)
{
    const tlsph_real nan = R(HUGE_VAL) - R(HUGE_VAL);
    for (int i = 0; i < 22; i++) {
        tlsph_fill f = good_fill();
        tlsph_cloud cloud;
        tlsph_error error;
        switch (i) {
        case 0: f.cookie = 0; break;
        case 1: f.dimension = 1; break;
        case 2: f.dimension = 4; break;
        case 3: f.shape = (tlsph_shape)(TLSPH_TRIANGLES + 1); break;
        case 4: f.placement = (tlsph_placement)(TLSPH_SCATTERED_INSIDE + 1); break;
        case 5: f.shape = TLSPH_PREDICATE; break;
        case 6: f.shape = TLSPH_DISTANCE; break;
        case 7: f.shape = TLSPH_TRIANGLES; break;
        case 8: f.shape = TLSPH_TRIANGLES; f.surface.count = 4; break; /* not scattered */
        case 9: f.axis = -1; break;
        case 10: f.axis = 3; break;
        case 11: f.origin[1] = nan; break;
        case 12: f.size[2] = nan; break;
        case 13: f.spacing = nan; break;
        case 14: f.size[1] = 0; break;
        case 15: f.spacing = 0; break;
        case 16: f.shape = TLSPH_L_SHAPE; f.notch[0] = R(0.5); f.notch[1] = 1; break;
        case 17: f.jitter = R(-0.1); break;
        case 18: f.jitter = R(0.5); break;
        case 19: f.allocator.allocate = malloc_like; break;
        case 20: f.inner_radius = -1; break;
        default: f.shape = TLSPH_SPHERE; f.inner_radius = 2; break; /* nothing is left */
        }
        const tlsph_result result = tlsph_cloud_create(&f, &cloud, &error);
        CHECK(result == (i > 10 && i < 14 ? TLSPH_ERROR_NOT_FINITE : i == 21 ? TLSPH_ERROR_SIZE : TLSPH_ERROR_DESCRIPTION));
        CHECK(error.message[0] != 0 && !cloud.memory);
    }
    tlsph_fill f = good_fill();
    CHECK_RESULT(tlsph_cloud_create(NULL, NULL, NULL), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_cloud_create(&f, NULL, NULL), TLSPH_ERROR_ARGUMENT);
    tlsph_cloud_destroy(NULL);
}
TEST(every_argument_of_voronoi_is_checked)
{
    static const tlsph_real X[3] = {R(0.5), R(0.5), 0};
    for (int i = 0; i < 9; i++) {
        tlsph_particles p;
        tlsph_surface surface = {4, square};
        tlsph_real V[1], B[3];
        memset(&p, 0, sizeof p);
        p.count = i == 6 ? 0 : 1;
        p.positions = i == 5 ? NULL : X;
        p.spacing = R(i == 7 ? 0 : 1);
        const tlsph_result result =
            tlsph_voronoi(i == 3 ? 1 : i == 4 ? 4 : 2, i == 0 ? NULL : &p, i == 1 ? NULL : &surface, NULL, i == 2 ? NULL : V,
                          i == 8 ? NULL : B, NULL, NULL);
        CHECK_RESULT(result, TLSPH_ERROR_ARGUMENT);
    }
}
TEST(every_argument_of_reproduce_is_checked)
{
    static const tlsph_real X[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, radii[3] = {3, 3, 3}, x[3] = {R(0.3), R(0.3), 0};
    tlsph_real value[3];
    const tlsph_shape_functions out = {value, NULL, NULL, NULL};
    static const int wrong[4][2] = {{0, 1}, {4, 1}, {2, 0}, {2, 3}};
    tlsph_nodes nodes = {2, 1, TLSPH_QUADRATIC, 3, X, radii};
    CHECK_RESULT(tlsph_reproduce(&nodes, x, &out, NULL), TLSPH_OK);
    for (int i = 0; i < 4; i++) {
        nodes.dimension = wrong[i][0];
        nodes.order = wrong[i][1];
        CHECK_RESULT(tlsph_reproduce(&nodes, x, &out, NULL), TLSPH_ERROR_DESCRIPTION);
    }
    nodes.dimension = nodes.order = 2; /* six monomials, three nodes */
    CHECK_RESULT(tlsph_reproduce(&nodes, x, &out, NULL), TLSPH_ERROR_NEIGHBOURS);
}
/* Without a spacing it is that of the mean weight; local ones count if they are given. */
TEST(spacing_follows_from_weights)
{
    small_scene s;
    tlsph_size given, found;
    REQUIRE(small_scene_make(&s));
    REQUIRE_OK(tlsph_measure(&s.desc, &given, NULL));
    s.desc.particles.spacing = 0;
    REQUIRE_OK(tlsph_measure(&s.desc, &found, NULL));
    CHECK_SAME(found.pairs, given.pairs);
    tlsph_real *spacings = malloc(s.desc.particles.count * sizeof *spacings);
    REQUIRE(spacings);
    for (size_t a = 0; a < s.desc.particles.count; a++) spacings[a] = R(0.5);
    s.desc.particles.spacings = spacings;
    REQUIRE_OK(tlsph_measure(&s.desc, &found, NULL));
    CHECK_SAME(found.pairs, given.pairs);
    free(spacings);
    own_cloud_destroy(&s.cloud);
}

/* ---- rounding modes and denormals ---- */

/* A free block that moves, turns and conducts heat: momenta and energy stay as they were, to round-off. */
static void check_balances(const char *name)
{
    static const int cells[3] = {4, 4, 4};
    own_cloud cloud;
    tlsph_material material = soft_material(TLSPH_MIE_GRUNEISEN);
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_solver *solver = NULL;
    tlsph_ledger first, last;
    REQUIRE(own_box(&cloud, 3, cells, 0.25, 0));
    desc.particles = cloud.particles;
    desc.materials = &material;
    desc.material_count = 1;
    desc.unknowns = TLSPH_PFHJ;
    desc.thermal = TLSPH_ENERGY;
    desc.threads = 1;
    REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
    CHECK_RESULT(moving_block_kick(solver, 1), TLSPH_OK);
    tlsph_ledger_read(solver, &first);
    CHECK_RESULT(take_steps(solver, 100), TLSPH_OK);
    tlsph_ledger_read(solver, &last);
    double linear = 0, angular = 0, size = 0;
    for (int i = 0; i < 3; i++) {
        linear = fmax(linear, fabs(last.linear_residual[i]));
        angular = fmax(angular, fabs(last.angular_residual[i]));
        size += fabs(first.linear_momentum[i]);
    }
    const double energy = fabs(last.energy_residual) / first.kinetic_energy;
    REPORT("%s %.1e %.1e %.1e; ", name, linear / size, angular / size, energy);
    CHECK_BELOW(linear / size, 1e3 * EPSILON);
    CHECK_BELOW(angular / size, 1e3 * EPSILON);
    CHECK_BELOW(energy, 1e6 * EPSILON);
    CHECK(first.kinetic_energy > 1 && state_finite(solver));
    tlsph_destroy(solver);
    own_cloud_destroy(&cloud);
}
TEST(balances_in_every_rounding_mode)
{
    static const struct { int mode; const char *name; } modes[] = {
        {FE_TONEAREST, "nearest"},
#ifdef FE_UPWARD
        {FE_UPWARD, "up"},
#endif
#ifdef FE_DOWNWARD
        {FE_DOWNWARD, "down"},
#endif
#ifdef FE_TOWARDZERO
        {FE_TOWARDZERO, "zero"},
#endif
    };
    for (size_t i = 0; i < sizeof modes / sizeof *modes; i++) {
        if (fesetround(modes[i].mode)) continue;
        check_balances(modes[i].name);
        fesetround(FE_TONEAREST);
    }
}
TEST(balances_with_denormals_flushed)
{
#if defined(__SSE2__) && !defined(__TINYC__)
    const unsigned before = _mm_getcsr();
    _mm_setcsr(before | 0x8040u); /* flush results to zero, take denormals as zero */
    check_balances("flushed");
    _mm_setcsr(before);
#else
    SKIP("no SSE2");
#endif
}

SUITE(limits, ENTRY(counts_near_the_limits), ENTRY(numbers_near_the_limits), ENTRY(given_lists_near_the_limits),
      ENTRY(lattices_near_the_limits), ENTRY(surfaces_near_the_limits), ENTRY(normals_and_lengths_near_the_limits),
      ENTRY(forged_checkpoints_are_undone), ENTRY(every_field_says_whether_it_can_be_written),
      ENTRY(every_entry_of_a_fill_is_checked), ENTRY(every_argument_of_voronoi_is_checked),
      ENTRY(every_argument_of_reproduce_is_checked), ENTRY(spacing_follows_from_weights), ENTRY(balances_in_every_rounding_mode),
      ENTRY(balances_with_denormals_flushed))
