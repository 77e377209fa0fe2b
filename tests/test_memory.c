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
    size_t bytes = measured(2, TLSPH_PF, TLSPH_ISOTHERMAL, NULL);
    REPORT("%d bytes a particle, {p,F}, 2-D; %d {p,F,H,J} with energy, 3-D", (int)bytes,
           (int)measured(3, TLSPH_PFHJ, TLSPH_ENERGY, NULL));
    CHECK(bytes >= 16 * sizeof(tlsph_real));
    CHECK(bytes <= 60 * sizeof(tlsph_real));
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
      ENTRY(leanest_scene_is_lean), ENTRY(measured_size_is_the_size_taken), ENTRY(isothermal_scenes_have_no_energy),
      ENTRY(field_table), ENTRY(callers_memory_is_used), ENTRY(callers_memory_too_small),
      ENTRY(failing_allocations_leak_nothing), ENTRY(failing_allocations_in_measure), ENTRY(a_step_allocates_nothing),
      ENTRY(half_an_allocator_is_refused), ENTRY(destroying_nothing))
