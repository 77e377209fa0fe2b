/* What a scene needs is what it takes: sizes, the caller's block, failing allocations, no allocation in a step. */
#include "support.h"

static const tlsph_unknowns unknown_sets[4] = {TLSPH_PF, TLSPH_PFJ, TLSPH_PFH, TLSPH_PFHJ};
static const tlsph_thermal thermals[3] = {TLSPH_ISOTHERMAL, TLSPH_ENERGY, TLSPH_ENTROPY};

/* ---- sizes ---- */

typedef struct plain_scene { own_cloud cloud; tlsph_material material; tlsph_desc desc; } plain_scene;

/* A box without conditions, of 64 particles in 3-D and in 2-D. */
static int plain_scene_make(plain_scene *s, int dimension, tlsph_unknowns unknowns, tlsph_thermal thermal)
{
    static const int space[3] = {3, 3, 3}, plane[3] = {7, 7, 0};
    s->material = soft_material(TLSPH_MIE_GRUNEISEN);
    if (!own_box(&s->cloud, dimension, dimension == 3 ? space : plane, 0.25, 0)) return 0;
    s->desc = tlsph_desc_default(dimension);
    s->desc.particles = s->cloud.particles;
    s->desc.materials = &s->material;
    s->desc.material_count = 1;
    s->desc.unknowns = unknowns;
    s->desc.thermal = thermal;
    s->desc.threads = 1;
    return 1;
}

static size_t measured(int dimension, tlsph_unknowns unknowns, tlsph_thermal thermal, size_t *total)
{
    plain_scene s;
    tlsph_size size;
    memset(&size, 0, sizeof size);
    if (!CHECK(plain_scene_make(&s, dimension, unknowns, thermal))) return 0;
    CHECK_RESULT(tlsph_measure(&s.desc, &size, NULL), TLSPH_OK);
    own_cloud_destroy(&s.cloud);
    if (total) *total = size.bytes;
    return size.bytes_per_particle;
}

/* Each unknown costs at least its own numbers, and a scene without it does not pay for it. */
TEST(every_unknown_adds_bytes)
{
    size_t real = sizeof(tlsph_real);
    int dimension, t;
    for (dimension = 2; dimension <= 3; dimension++) {
        size_t tensor = dimension == 3 ? 9 : 4;
        for (t = 0; t < 3; t++) {
            size_t pf = measured(dimension, TLSPH_PF, thermals[t], NULL);
            size_t pfj = measured(dimension, TLSPH_PFJ, thermals[t], NULL);
            size_t pfh = measured(dimension, TLSPH_PFH, thermals[t], NULL);
            size_t pfhj = measured(dimension, TLSPH_PFHJ, thermals[t], NULL);
            CHECK(pfj >= pf + real);
            CHECK(pfh >= pf + tensor * real);
            CHECK(pfhj >= pfj + tensor * real);
            CHECK(pfhj >= pfh + real);
        }
    }
}

TEST(heat_adds_bytes)
{
    int dimension, u;
    for (dimension = 2; dimension <= 3; dimension++)
        for (u = 0; u < 4; u++) {
            size_t cold = measured(dimension, unknown_sets[u], TLSPH_ISOTHERMAL, NULL);
            CHECK(measured(dimension, unknown_sets[u], TLSPH_ENERGY, NULL) >= cold + 2 * sizeof(tlsph_real));
            CHECK(measured(dimension, unknown_sets[u], TLSPH_ENTROPY, NULL) >= cold + 2 * sizeof(tlsph_real));
        }
}

TEST(two_dimensions_need_less)
{
    int u, t;
    for (u = 0; u < 4; u++)
        for (t = 0; t < 3; t++) {
            size_t plane = 0, space = 0; /* 64 particles each */
            CHECK(measured(2, unknown_sets[u], thermals[t], &plane) + 10 * sizeof(tlsph_real) <
                  measured(3, unknown_sets[u], thermals[t], &space));
            CHECK(plane < space);
        }
}

/* Half the numbers, half the bytes: an absolute bound for the leanest scene, so that it holds nothing superfluous.
   Two stages of p, F, x (2 + 4 + 2) in 2-D, gradients, stress, volumes and the like fit in 60 numbers. */
TEST(leanest_scene_is_lean)
{
    static const int many[3] = {31, 31, 0}; /* what neighbours read lies in blocks of 128 particles: 64 would pay for 136 */
    plain_scene s;
    tlsph_size size;
    REQUIRE(plain_scene_make(&s, 2, TLSPH_PF, TLSPH_ISOTHERMAL));
    own_cloud_destroy(&s.cloud);
    REQUIRE(own_box(&s.cloud, 2, many, 0.25, 0));
    s.desc.particles = s.cloud.particles;
    REQUIRE_OK(tlsph_measure(&s.desc, &size, NULL));
    own_cloud_destroy(&s.cloud);
    const size_t bytes = size.bytes_per_particle;
    REPORT("%d bytes a particle, {p,F}, 2-D; %d {p,F,H,J} with energy, 3-D", (int)bytes,
           (int)measured(3, TLSPH_PFHJ, TLSPH_ENERGY, NULL));
    CHECK(bytes >= 16 * sizeof(tlsph_real));
    CHECK(bytes <= 60 * sizeof(tlsph_real));
}

/* 4,096 particles with 26 neighbours at multiples of `spacing`, away from the origin by `shift`. */
static double bytes_on_lattice(double spacing, const double shift[3])
{
    static const int cells[3] = {15, 15, 15};
    plain_scene s;
    tlsph_size size;
    memset(&size, 0, sizeof size);
    if (!CHECK(plain_scene_make(&s, 3, TLSPH_PFHJ, TLSPH_ENERGY))) return 0;
    own_cloud_destroy(&s.cloud);
    if (!CHECK(own_box(&s.cloud, 3, cells, spacing, 0))) return 0;
    tlsph_real *X = s.cloud.positions;
    for (size_t i = 0; i < 3 * s.cloud.particles.count; i++) X[i] += R(shift[i % 3]);
    s.desc.particles = s.cloud.particles;
    s.desc.support = R(0.9);
    CHECK_RESULT(tlsph_measure(&s.desc, &size, NULL), TLSPH_OK);
    own_cloud_destroy(&s.cloud);
    return (double)size.bytes_per_particle + (double)size.bytes_per_pair * (double)size.pairs / 4096;
}
/* Positions that are no sums of powers of 2 are rounded, and every pair is another: what they were meant to be is stored
   once all the same, pair vectors and corrections. */
TEST(rounded_lattices_share_their_pairs)
{
    static const double none[3] = {0, 0, 0}, aside[3] = {0.37, -5.3, 1.1};
    const double exact = bytes_on_lattice(0.125, none), rounded = bytes_on_lattice(0.1, none);
    const double shifted = bytes_on_lattice(0.1, aside);
    REPORT("%.0f, %.0f, %.0f bytes a particle", exact, rounded, shifted);
    CHECK_BELOW(rounded, 1.02 * exact);
    CHECK_BELOW(shifted, 1.02 * exact);
}

/* What keeping the pairs costs, and that nothing else depends on it: neither states nor the survey before the run. */
TEST(pairs_are_kept_on_request)
{
    for (int k = 0; k < 2; k++) {
        plain_scene s;
        tlsph_solver *solver[2] = {NULL, NULL};
        tlsph_operator view[2];
        tlsph_size size[2];
        tlsph_preflight_report report[2];
        REQUIRE(plain_scene_make(&s, 3, TLSPH_PF, TLSPH_ISOTHERMAL));
        if (k) s.desc.support = R(0.9);
        for (int i = 0; i < 2; i++) {
            s.desc.keep_pairs = i;
            REQUIRE_OK(tlsph_create(&s.desc, &solver[i], NULL));
            tlsph_operator_view(solver[i], &view[i]);
            tlsph_size_read(solver[i], &size[i]);
            tlsph_preflight(solver[i], 1, &report[i]);
            for (int step = 0; step < 3; step++) REQUIRE_OK(tlsph_step(solver[i], R(1)));
        }
        CHECK(!view[0].first && !view[0].neighbours && !view[0].vectors);
        CHECK(view[1].first && view[1].neighbours && view[1].vectors);
        CHECK_SAME(view[0].pairs, view[1].first[view[1].count]);
        CHECK(size[1].bytes - size[0].bytes >= size[0].pairs * (4 + 3 * sizeof(tlsph_real)));
        CHECK(report[0].support > 0 && report[0].support < 1);
        double least = 1; /* the same from the pairs: the least eigenvalue of sum |C| e e is at most each of its diagonal */
        for (size_t a = 0; a < view[1].count; a++) {
            double K[3] = {0, 0, 0}, sum = 0;
            for (size_t p = view[1].first[a]; p < view[1].first[a + 1]; p++) {
                const tlsph_real *C = view[1].vectors + 3 * p;
                const double length = sqrt((double)(C[0] * C[0] + C[1] * C[1] + C[2] * C[2]));
                for (int i = 0; i < 3 && length > 0; i++) K[i] += (double)(C[i] * C[i]) / length;
                sum += length;
            }
            least = fmin(least, 3 * fmin(K[0], fmin(K[1], K[2])) / sum);
        }
        for (int i = 0; i < 2; i++) CHECK_BELOW(report[i].support, least * (1 + 1e-5));
        CHECK(report[0].support == report[1].support && report[0].weakest == report[1].weakest);
        if (k == 0) CHECK_CLOSE(report[0].support, least, 1e-5); /* axis pairs only: the diagonal is all */
        CHECK(state_hash(solver[0]) == state_hash(solver[1]));
        for (int i = 0; i < 2; i++) tlsph_destroy(solver[i]);
        own_cloud_destroy(&s.cloud);
    }
}

TEST(measured_size_is_the_size_taken)
{
    int u, t;
    for (u = 0; u < 4; u++)
        for (t = 0; t < 3; t++) {
            plain_scene s;
            tally counts;
            tlsph_size size, read;
            tlsph_solver *solver = NULL;
            memset(&counts, 0, sizeof counts);
            REQUIRE(plain_scene_make(&s, 3, unknown_sets[u], thermals[t]));
            s.desc.allocator = tally_allocator(&counts);
            REQUIRE_OK(tlsph_measure(&s.desc, &size, NULL));
            CHECK_SAME(counts.live, 0);
            REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
            CHECK_SAME(counts.live, 1); /* one block */
            CHECK(counts.live_bytes >= size.bytes && counts.live_bytes <= size.bytes + 64); /* room to align it */
            tlsph_size_read(solver, &read);
            CHECK_SAME(read.bytes, size.bytes);
            CHECK_SAME(read.pairs, size.pairs);
            CHECK_SAME(size.neighbours_least, 3); /* corner and inside of a lattice */
            CHECK_SAME(size.neighbours_most, 6);
            CHECK(size.bytes >= size.pairs * size.bytes_per_pair + 64 * size.bytes_per_particle);
            tlsph_destroy(solver);
            CHECK_SAME(counts.live, 0);
            CHECK(!counts.wrong_size);
            own_cloud_destroy(&s.cloud);
        }
}

/* ---- fields that a scene lacks ---- */

static void check_absent(tlsph_solver *solver, tlsph_field field)
{
    tlsph_real values[9 * 64];
    CHECK_RESULT(tlsph_read(solver, field, values), TLSPH_ERROR_FIELD);
}

TEST(isothermal_scenes_have_no_energy)
{
    int dimension;
    for (dimension = 2; dimension <= 3; dimension++) {
        plain_scene s;
        tlsph_solver *solver = NULL;
        tlsph_real values[64] = {0};
        REQUIRE(plain_scene_make(&s, dimension, TLSPH_PF, TLSPH_ISOTHERMAL));
        REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
        check_absent(solver, TLSPH_FIELD_ENERGY);
        check_absent(solver, TLSPH_FIELD_ENTROPY);
        CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_TEMPERATURE, values), TLSPH_ERROR_FIELD);
        CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_J, values), TLSPH_ERROR_FIELD); /* not evolved */
        tlsph_destroy(solver);
        own_cloud_destroy(&s.cloud);
    }
}

TEST(field_table)
{
    plain_scene s;
    tlsph_solver *solver = NULL;
    tlsph_real values[9 * 64];
    int field;
    REQUIRE(plain_scene_make(&s, 3, TLSPH_PFHJ, TLSPH_ENERGY));
    REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
    for (field = 0; field < TLSPH_FIELD_COUNT; field++) {
        int components = tlsph_field_components((tlsph_field)field);
        CHECK(components == 1 || components == 3 || components == 9);
        CHECK(tlsph_field_name((tlsph_field)field)[0] != 0);
        CHECK(tlsph_field_unit((tlsph_field)field)[0] != 0);
        CHECK_RESULT(tlsph_read(solver, (tlsph_field)field, values),
                     field == TLSPH_FIELD_PLASTIC_STRAIN ? TLSPH_ERROR_FIELD : TLSPH_OK); /* not in this scene */
    }
    check_absent(solver, TLSPH_FIELD_COUNT);
    check_absent(solver, (tlsph_field)12345);
    CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_STRESS, values), TLSPH_ERROR_FIELD);
    CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_COUNT, values), TLSPH_ERROR_FIELD);
    tlsph_destroy(solver);
    own_cloud_destroy(&s.cloud);
}

/* ---- the caller's block ---- */

TEST(callers_memory_is_used)
{
    enum { GUARD = 64 };
    plain_scene s;
    tally counts;
    tlsph_size size;
    tlsph_solver *solver = NULL;
    unsigned char *raw, *block;
    int i;
    memset(&counts, 0, sizeof counts);
    REQUIRE(plain_scene_make(&s, 3, TLSPH_PFHJ, TLSPH_ENERGY));
    s.desc.allocator = tally_allocator(&counts);
    REQUIRE_OK(tlsph_measure(&s.desc, &size, NULL));
    raw = malloc(size.bytes + 2 * GUARD);
    REQUIRE(raw);
    block = raw + (GUARD - (uintptr_t)raw % GUARD); /* on a cache line */
    memset(block, 0xC3, size.bytes + GUARD);
    s.desc.memory = block;
    s.desc.memory_size = size.bytes;
    REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
    CHECK((unsigned char *)solver >= block && (unsigned char *)solver < block + size.bytes);
    CHECK_SAME(counts.live, 0);
    CHECK_RESULT(moving_block_kick(solver, 0.1), TLSPH_OK);
    CHECK_RESULT(take_steps(solver, 5), TLSPH_OK);
    for (i = 0; i < GUARD; i++) CHECK_SAME(block[size.bytes + (size_t)i], 0xC3);
    tlsph_destroy(solver);
    CHECK_SAME(counts.live, 0);
    free(raw);
    own_cloud_destroy(&s.cloud);
}

TEST(callers_memory_too_small)
{
    plain_scene s;
    tally counts;
    tlsph_size size;
    tlsph_error error;
    tlsph_solver *solver = (tlsph_solver *)&s;
    tlsph_result result;
    unsigned char *block;
    memset(&counts, 0, sizeof counts);
    REQUIRE(plain_scene_make(&s, 3, TLSPH_PF, TLSPH_ISOTHERMAL));
    s.desc.allocator = tally_allocator(&counts);
    REQUIRE_OK(tlsph_measure(&s.desc, &size, NULL));
    block = malloc(size.bytes);
    REQUIRE(block);
    memset(block, 0xC3, size.bytes);
    s.desc.memory = block;
    s.desc.memory_size = size.bytes - 1;
    result = tlsph_create(&s.desc, &solver, &error);
    CHECK(result == TLSPH_ERROR_SIZE || result == TLSPH_ERROR_MEMORY);
    CHECK(solver == NULL);
    CHECK(error.message[0] != 0);
    CHECK_SAME(counts.live, 0);
    s.desc.memory_size = 0;
    CHECK(tlsph_create(&s.desc, &solver, &error) != TLSPH_OK);
    CHECK_SAME(counts.live, 0);
    free(block);
    own_cloud_destroy(&s.cloud);
}

/* ---- allocations ---- */

/* Makes allocation 1, 2, 3, ... fail until creation succeeds. */
static void check_failing_allocations(const moving_block *wanted)
{
    size_t n;
    for (n = 1; n < 200; n++) {
        moving_block s = *wanted;
        tally counts;
        tlsph_error error;
        tlsph_solver *solver = NULL;
        tlsph_result result;
        memset(&counts, 0, sizeof counts);
        memset(&error, 0, sizeof error);
        counts.fail_at = n;
        s.allocator = tally_allocator(&counts);
        result = moving_block_create(&s, &solver, &error);
        tlsph_destroy(solver);
        CHECK_SAME(counts.live, 0);
        CHECK(!counts.wrong_size);
        if (result == TLSPH_OK) break;
        CHECK_RESULT(result, TLSPH_ERROR_MEMORY);
        CHECK_RESULT(error.result, TLSPH_ERROR_MEMORY);
        CHECK(error.message[0] != 0);
        CHECK(solver == NULL);
    }
    CHECK(n > 1 && n < 200);
    REPORT("%d allocations; ", (int)n - 1);
}

TEST(failing_allocations_leak_nothing)
{
    moving_block s = moving_block_default();
    check_failing_allocations(&s);
    s.dimension = 2;
    s.unknowns = TLSPH_PF;
    s.thermal = TLSPH_ISOTHERMAL;
    s.jitter = 0.2;
    check_failing_allocations(&s);
}

TEST(failing_allocations_in_measure)
{
    plain_scene s;
    size_t n;
    REQUIRE(plain_scene_make(&s, 3, TLSPH_PFHJ, TLSPH_ENERGY));
    for (n = 1; n < 200; n++) {
        tally counts;
        tlsph_size size;
        tlsph_result result;
        memset(&counts, 0, sizeof counts);
        counts.fail_at = n;
        s.desc.allocator = tally_allocator(&counts);
        result = tlsph_measure(&s.desc, &size, NULL);
        CHECK_SAME(counts.live, 0);
        if (result == TLSPH_OK) break;
        CHECK_RESULT(result, TLSPH_ERROR_MEMORY);
    }
    CHECK(n < 200);
    own_cloud_destroy(&s.cloud);
}

/* ---- every allocation fails in turn, in everything that creates ---- */

/* Calls make with allocation 1, 2, 3, ... failing until it succeeds; make gives back what it made. Returns how many
   allocations a success takes. */
typedef tlsph_result (*make_fn)(const void *what, const tlsph_allocator *allocator, tlsph_error *error);
static size_t sweep(make_fn make, const void *what)
{
    for (size_t n = 1; n < 1000; n++) {
        tally counts;
        tlsph_error error;
        memset(&counts, 0, sizeof counts);
        memset(&error, 0, sizeof error);
        counts.fail_at = n;
        const tlsph_allocator allocator = tally_allocator(&counts);
        const tlsph_result result = make(what, &allocator, &error);
        if (!CHECK(counts.live == 0 && counts.live_bytes == 0 && !counts.wrong_size)) return 0;
        if (result == TLSPH_OK) return counts.calls;
        if (!CHECK_RESULT(result, TLSPH_ERROR_MEMORY) || !CHECK_RESULT(error.result, TLSPH_ERROR_MEMORY)) return 0;
        CHECK(error.message[0] && error.value > 0 && counts.calls >= n);
    }
    return 0;
}

static tlsph_result make_solver(const void *what, const tlsph_allocator *allocator, tlsph_error *error)
{
    tlsph_desc desc = *(const tlsph_desc *)what;
    int nobody = 0;
    tlsph_solver *solver = (tlsph_solver *)(void *)&nobody;
    desc.allocator = *allocator;
    const tlsph_result result = tlsph_create(&desc, &solver, error);
    CHECK((result == TLSPH_OK) == (solver != NULL));
    tlsph_destroy(solver);
    return result;
}
static tlsph_result make_size(const void *what, const tlsph_allocator *allocator, tlsph_error *error)
{
    tlsph_desc desc = *(const tlsph_desc *)what;
    tlsph_size size, before;
    memset(&size, 0x5A, sizeof size);
    before = size;
    desc.allocator = *allocator;
    const tlsph_result result = tlsph_measure(&desc, &size, error);
    CHECK((result == TLSPH_OK) == (memcmp(&size, &before, sizeof size) != 0));
    return result;
}
static tlsph_result make_cloud(const void *what, const tlsph_allocator *allocator, tlsph_error *error)
{
    tlsph_fill fill = *(const tlsph_fill *)what;
    static const tlsph_cloud none; /* all zero */
    tlsph_cloud cloud;
    memset(&cloud, 0x5A, sizeof cloud);
    fill.allocator = *allocator;
    const tlsph_result result = tlsph_cloud_create(&fill, &cloud, error);
    if (result) CHECK(memcmp(&cloud, &none, sizeof cloud) == 0);
    tlsph_cloud_destroy(&cloud);
    return result;
}

/* The pair vectors of a lattice as a host would give them. */
static int own_pairs(tlsph_desc *lattice, tlsph_particles *out)
{
    lattice->operator_kind = TLSPH_CELLS;
    lattice->keep_pairs = 1;
    tlsph_solver *solver = NULL;
    tlsph_operator view;
    if (!CHECK_RESULT(tlsph_create(lattice, &solver, NULL), TLSPH_OK)) return 0;
    tlsph_operator_view(solver, &view);
    size_t *first = malloc((view.count + 1) * sizeof *first), at = 0;
    uint32_t *neighbours = malloc(view.pairs * sizeof *neighbours);
    tlsph_real *vectors = calloc(3 * view.pairs, sizeof *vectors);
    for (size_t h = 0; first && neighbours && vectors && h < view.count; h++) {
        size_t a = 0;
        while (view.host[a] != h) a++;
        first[h] = at;
        for (size_t k = view.first[a]; k < view.first[a + 1]; k++, at++) {
            neighbours[at] = view.host[view.neighbours[k]];
            memcpy(vectors + 3 * at, view.vectors + (size_t)view.dimension * k, (size_t)view.dimension * sizeof *vectors);
        }
        first[h + 1] = at;
    }
    out->first = first;
    out->neighbours = neighbours;
    out->pair_vectors = vectors;
    tlsph_destroy(solver);
    return 1;
}

/* A fixed face, mirrors and loads with values of their own, so that every array is asked for. */
static void load_values(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                        const tlsph_real *x, tlsph_real *values)
{
    (void)user, (void)time, (void)count, (void)particle, (void)X, (void)x, (void)values;
}
static void check_operator(tlsph_operator_kind kind, int dimension)
{
    tlsph_fill fill = tlsph_fill_default(dimension);
    tlsph_cloud cloud;
    tlsph_material material = soft_material(TLSPH_NEO_HOOKEAN);
    tlsph_condition conditions[4] = {tlsph_condition_default(TLSPH_CLAMPED), tlsph_condition_default(TLSPH_ROLLER),
                                     tlsph_condition_default(TLSPH_PRESSURE), tlsph_condition_default(TLSPH_VELOCITY)};
    tlsph_desc desc = tlsph_desc_default(dimension);
    uint32_t face[200];
    for (int i = 0; i < dimension; i++) fill.size[i] = 1;
    fill.spacing = R(0.25);
    fill.voronoi = kind == TLSPH_CLOSED;
    fill.jitter = R(fill.voronoi ? 0.1 : 0);
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    const size_t count = tlsph_select_plane(&cloud.particles, 0, 0, R(1e-3), face, 200);
    for (int i = 0; i < 4; i++) {
        conditions[i].particles = face;
        conditions[i].count = count;
        conditions[i].normal[0] = 1;
        conditions[i].values = load_values;
    }
    desc.particles = cloud.particles;
    desc.materials = &material;
    desc.material_count = 1;
    desc.threads = 1;
    if (kind == TLSPH_GIVEN) REQUIRE(own_pairs(&desc, &desc.particles));
    desc.operator_kind = kind;
    if (kind > TLSPH_CELLS && kind < TLSPH_CELLS_4) desc.support = R(0.9);
    if (kind == TLSPH_CLOSED) {
        desc.support = R(0.825);
        desc.kernel = TLSPH_WENDLAND_C2;
        desc.tight_closure = 1;
    }
    desc.conditions = conditions;
    desc.condition_count = 4;
    const size_t allocations = sweep(make_solver, &desc), measured = sweep(make_size, &desc);
    CHECK(measured > 5 && allocations > measured);
    REPORT("%d ", (int)allocations);
    if (desc.particles.first != cloud.particles.first) {
        free((void *)desc.particles.first);
        free((void *)desc.particles.neighbours);
        free((void *)desc.particles.pair_vectors);
    }
    tlsph_cloud_destroy(&cloud);
}
TEST(failing_allocations_of_every_operator)
{
    for (int dimension = 2; dimension <= 3; dimension++)
        for (int kind = TLSPH_CORRECTED_KERNEL; kind <= TLSPH_CLOSED; kind++)
            check_operator((tlsph_operator_kind)kind, dimension);
}

static tlsph_real ball(void *user, const tlsph_real X[3])
{
    static const tlsph_real centre[3] = {R(0.5), R(0.5), R(0.5)}, middle[3] = {R(0.5), R(0.5), 0};
    return tlsph_distance_sphere(X, user ? middle : centre, R(0.45));
}
static tlsph_real finer_to_the_right(void *user, const tlsph_real X[3])
{
    (void)user;
    return R(0.25) - R(0.08) * X[0];
}
static const tlsph_real tetrahedron[36] = {0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1,
                                           0, 0, 0, 0, 0, 1, 0, 1, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
TEST(failing_allocations_of_clouds)
{
    static const tlsph_shape shapes[4] = {TLSPH_BOX, TLSPH_L_SHAPE, TLSPH_SPHERE, TLSPH_DISTANCE};
    int plane = 1;
    for (int i = 0; i < 24; i++) {
        tlsph_fill fill = tlsph_fill_default(2 + i / 12);
        if (i / 12 && i % 12 % 5) continue; /* of space every shape and every placement once */
        fill.shape = shapes[i % 4];
        fill.placement = (tlsph_placement)(i / 4 % 3);
        fill.voronoi = fill.shape < TLSPH_CYLINDER;
        for (int k = 0; k < fill.dimension; k++) fill.size[k] = 1;
        fill.notch[0] = fill.notch[1] = R(0.5);
        fill.spacing = R(0.34);
        fill.distance = ball;
        fill.distance_user = fill.dimension == 2 ? &plane : NULL;
        if (fill.shape == TLSPH_DISTANCE) fill.spacing_at = finer_to_the_right;
        REPORT("%d ", (int)sweep(make_cloud, &fill));
    }
    tlsph_fill fill = tlsph_fill_default(3);
    fill.shape = TLSPH_TRIANGLES;
    fill.placement = TLSPH_SCATTERED;
    fill.spacing = R(0.5);
    fill.surface.count = 4;
    fill.surface.corners = tetrahedron;
    CHECK(sweep(make_cloud, &fill) > 20);
}
static tlsph_result make_voronoi(const void *what, const tlsph_allocator *allocator, tlsph_error *error)
{
    static const tlsph_real positions[6] = {R(0.1), R(0.1), R(0.1), R(0.3), R(0.3), R(0.2)};
    tlsph_particles particles;
    tlsph_surface surface = {4, tetrahedron};
    tlsph_real volumes[2] = {-1, -1}, areas[6] = {-1, -1, -1, -1, -1, -1};
    (void)what;
    memset(&particles, 0, sizeof particles);
    particles.count = 2;
    particles.positions = positions;
    particles.spacing = 1;
    const tlsph_result result = tlsph_voronoi(3, &particles, &surface, allocator, volumes, areas, NULL, error);
    if (result) CHECK(volumes[0] < 0 && volumes[1] < 0 && areas[0] < 0 && areas[5] < 0);
    else CHECK_CLOSE(volumes[0] + volumes[1], 1.0 / 6, 100 * EPSILON);
    return result;
}
TEST(failing_allocations_of_cells_of_particles) { CHECK(sweep(make_voronoi, NULL) > 10); }

/* Scratch lists are of fixed length: growing arrays must not fill them. 5000 particles make them grow. */
TEST(growing_arrays_give_back_the_old_ones)
{
    size_t most[2];
    for (int i = 0; i < 2; i++) {
        tlsph_fill fill = tlsph_fill_default(2);
        tlsph_cloud cloud;
        tally counts;
        memset(&counts, 0, sizeof counts);
        fill.placement = TLSPH_SCATTERED;
        fill.size[0] = fill.size[1] = 1;
        fill.spacing = R(i ? 0.0145 : 0.05);
        fill.allocator = tally_allocator(&counts);
        REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
        CHECK(i == 0 || cloud.particles.count > 4200);
        most[i] = counts.most_live;
        tlsph_cloud_destroy(&cloud);
        CHECK_SAME(counts.live, 0);
    }
    CHECK_SAME(most[1], most[0]);
}

TEST(a_step_allocates_nothing)
{
    int u, t;
    for (u = 0; u < 4; u++)
        for (t = 0; t < 3; t++) {
            moving_block s = moving_block_default();
            tally counts;
            tlsph_solver *solver = NULL;
            tlsph_ledger ledger;
            size_t calls, size;
            unsigned char *saved;
            memset(&counts, 0, sizeof counts);
            s.unknowns = unknown_sets[u];
            s.thermal = thermals[t];
            s.allocator = tally_allocator(&counts);
            REQUIRE_OK(moving_block_create(&s, &solver, NULL));
            calls = counts.calls;
            CHECK_RESULT(moving_block_kick(solver, 0.1), TLSPH_OK);
            CHECK_RESULT(take_steps(solver, 5), TLSPH_OK);
            tlsph_ledger_read(solver, &ledger);
            tlsph_ledger_reset(solver);
            saved = save_state(solver, &size);
            CHECK_RESULT(tlsph_restore(solver, saved, size), TLSPH_OK);
            (void)state_hash(solver);
            CHECK_SAME(counts.calls, calls);
            free(saved);
            tlsph_destroy(solver);
        }
}

static void check_half(int without_release)
{
    plain_scene s;
    tally counts;
    tlsph_solver *solver = NULL;
    memset(&counts, 0, sizeof counts);
    REQUIRE(plain_scene_make(&s, 3, TLSPH_PF, TLSPH_ISOTHERMAL));
    s.desc.allocator = tally_allocator(&counts);
    if (without_release) s.desc.allocator.release = NULL;
    else s.desc.allocator.allocate = NULL;
    CHECK_RESULT(tlsph_create(&s.desc, &solver, NULL), TLSPH_ERROR_DESCRIPTION);
    tlsph_destroy(solver);
    own_cloud_destroy(&s.cloud);
}

TEST(half_an_allocator_is_refused)
{
    check_half(0);
    check_half(1);
}

TEST(destroying_nothing)
{
    tlsph_cloud cloud;
    memset(&cloud, 0, sizeof cloud);
    tlsph_destroy(NULL);
    tlsph_cloud_destroy(&cloud);
    tlsph_cloud_destroy(&cloud);
}

SUITE(memory, ENTRY(every_unknown_adds_bytes), ENTRY(heat_adds_bytes), ENTRY(two_dimensions_need_less),
      ENTRY(leanest_scene_is_lean), ENTRY(rounded_lattices_share_their_pairs), ENTRY(pairs_are_kept_on_request),
      ENTRY(measured_size_is_the_size_taken), ENTRY(isothermal_scenes_have_no_energy),
      ENTRY(field_table), ENTRY(callers_memory_is_used), ENTRY(callers_memory_too_small),
      ENTRY(failing_allocations_leak_nothing), ENTRY(failing_allocations_in_measure),
      ENTRY(failing_allocations_of_every_operator), ENTRY(failing_allocations_of_clouds),
      ENTRY(failing_allocations_of_cells_of_particles), ENTRY(growing_arrays_give_back_the_old_ones),
      ENTRY(a_step_allocates_nothing),
      ENTRY(half_an_allocator_is_refused), ENTRY(destroying_nothing))
