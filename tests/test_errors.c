/* Every refusal: the right code, the right particle, the value, a message that names them, and nothing left behind. */
#include "support.h"

#define VICTIM 21 /* the particle that is spoilt, inside the box of 64 */

/* A good thermal scene that a case then spoils in one place. */
typedef struct spoilt {
    own_cloud cloud;
    tlsph_material materials[2];
    tlsph_condition conditions[2];
    uint32_t set[8];
    tlsph_real areas[8];
    tlsph_desc desc;
} spoilt;

static int spoilt_make(spoilt *s, int dimension)
{
    static const int space[3] = {3, 3, 3}, plane[3] = {7, 7, 0};
    int i;
    memset(s, 0, sizeof *s);
    if (!own_box(&s->cloud, dimension, dimension == 3 ? space : plane, 0.25, 0)) return 0;
    for (i = 0; i < 8; i++) { s->set[i] = (uint32_t)i; s->areas[i] = R(0.01); }
    for (i = 0; i < 2; i++) {
        s->materials[i] = soft_material(TLSPH_MIE_GRUNEISEN);
        s->conditions[i] = tlsph_condition_default(i ? TLSPH_TRACTION : TLSPH_CLAMPED);
        s->conditions[i].particles = s->set;
        s->conditions[i].count = 8;
    }
    s->conditions[1].areas = s->areas;
    s->desc = tlsph_desc_default(dimension);
    s->desc.particles = s->cloud.particles;
    s->desc.materials = s->materials;
    s->desc.material_count = 2;
    s->desc.conditions = s->conditions;
    s->desc.condition_count = 2;
    s->desc.thermal = TLSPH_ENERGY;
    s->desc.threads = 1;
    return 1;
}

static int says(const tlsph_error *error, size_t particle)
{
    char number[24];
    snprintf(number, sizeof number, "%lu", (unsigned long)particle);
    return strstr(error->message, number) != NULL;
}

/* The error and what creation leaves behind. `particle`: TLSPH_NO_PARTICLE where none is to blame. */
static void check_refused(spoilt *s, tlsph_result expected, size_t particle, tlsph_error *error, int line)
{
    tally counts;
    tlsph_size size;
    tlsph_solver *solver = (tlsph_solver *)s; /* rubbish that must become NULL */
    tlsph_result result;
    int holds;
    memset(&counts, 0, sizeof counts);
    memset(error, 0x55, sizeof *error);
    s->desc.allocator = tally_allocator(&counts);
    result = tlsph_create(&s->desc, &solver, error);
    holds = CHECK_RESULT(result, expected);
    holds &= CHECK_RESULT(error->result, result);
    holds &= CHECK(solver == NULL);
    if (!result) tlsph_destroy(solver);
    holds &= CHECK_SAME(counts.live, 0);
    holds &= CHECK(!counts.wrong_size);
    holds &= CHECK(memchr(error->message, 0, sizeof error->message) != NULL && error->message[0] != 0);
    holds &= CHECK_SAME(error->particle, particle);
    if (particle != TLSPH_NO_PARTICLE) holds &= CHECK(says(error, particle));
    holds &= CHECK_RESULT(tlsph_measure(&s->desc, &size, NULL), expected); /* "the same checks and errors" */
    holds &= CHECK_SAME(counts.live, 0);
    result = tlsph_create(&s->desc, &solver, NULL); /* without an error record */
    holds &= CHECK_RESULT(result, expected);
    if (!result) tlsph_destroy(solver);
    if (!holds) printf("    the case of line %d; message: %.255s\n", line, error->message);
    own_cloud_destroy(&s->cloud);
}

/* One case: spoil, expect. `s` is the scene, `error` the record. */
#define REFUSED(statement, expected, particle)                               \
    do {                                                                     \
        spoilt s;                                                            \
        REQUIRE(spoilt_make(&s, 3));                                         \
        statement;                                                           \
        check_refused(&s, expected, particle, &error, __LINE__);             \
    } while (0)

TEST(the_unspoilt_scene_is_good)
{
    int dimension;
    for (dimension = 2; dimension <= 3; dimension++) {
        spoilt s;
        tlsph_error error;
        tlsph_solver *solver = NULL;
        REQUIRE(spoilt_make(&s, dimension));
        if (!CHECK_RESULT(tlsph_create(&s.desc, &solver, &error), TLSPH_OK)) printf("    %s\n", error.message);
        CHECK_RESULT(error.result, TLSPH_OK);
        tlsph_destroy(solver);
        own_cloud_destroy(&s.cloud);
    }
}

/* ---- particles ---- */

TEST(particles_not_finite)
{
    tlsph_error error;
    REFUSED(s.cloud.positions[3 * VICTIM + 1] = R(NAN), TLSPH_ERROR_NOT_FINITE, VICTIM);
    CHECK(isnan(error.value));
    REFUSED(s.cloud.positions[3 * VICTIM] = R(INFINITY), TLSPH_ERROR_NOT_FINITE, VICTIM);
    CHECK(isinf(error.value));
    REFUSED(s.cloud.volumes[VICTIM] = R(NAN), TLSPH_ERROR_NOT_FINITE, VICTIM);
    REFUSED(s.cloud.weights[VICTIM] = R(NAN), TLSPH_ERROR_NOT_FINITE, VICTIM);
    REFUSED(s.cloud.volumes[63] = R(INFINITY), TLSPH_ERROR_NOT_FINITE, 63);
}

TEST(volumes_not_positive)
{
    tlsph_error error;
    REFUSED(s.cloud.volumes[VICTIM] = 0, TLSPH_ERROR_VOLUME, VICTIM);
    CHECK(error.value == 0);
    REFUSED(s.cloud.volumes[VICTIM] = -2, TLSPH_ERROR_VOLUME, VICTIM);
    CHECK(error.value == -2);
    CHECK(strstr(error.message, "-2") != NULL);
    REFUSED(s.cloud.weights[VICTIM] = 0, TLSPH_ERROR_VOLUME, VICTIM);
    REFUSED(s.cloud.weights[VICTIM] = -1, TLSPH_ERROR_VOLUME, VICTIM);
}

TEST(duplicate_positions)
{
    spoilt s;
    tlsph_error error;
    tlsph_solver *solver = NULL;
    REQUIRE(spoilt_make(&s, 3));
    s.desc.support = R(0.9); /* so that the hole leaves nobody without neighbours */
    memcpy(s.cloud.positions + 3 * VICTIM, s.cloud.positions + 3 * 40, 3 * sizeof(tlsph_real));
    CHECK_RESULT(tlsph_create(&s.desc, &solver, &error), TLSPH_ERROR_DUPLICATE);
    CHECK(solver == NULL);
    CHECK(error.particle == VICTIM || error.particle == 40); /* which of the two is named is open */
    CHECK(says(&error, error.particle));
    own_cloud_destroy(&s.cloud);
}

/* A flat grid in 3-D, a line in 2-D: many neighbours, but no gradient across. */
static void check_flat(int dimension, tlsph_operator_kind kind)
{
    static const int cells[3] = {7, 7, 0};
    spoilt s;
    own_cloud flat;
    tlsph_error error;
    tlsph_solver *solver = NULL;
    size_t a;
    REQUIRE(spoilt_make(&s, dimension));
    own_cloud_destroy(&s.cloud);
    REQUIRE(own_box(&flat, 2, cells, 0.25, 0.1));
    s.cloud = flat;
    for (a = 0; a < flat.particles.count; a++) {
        flat.positions[3 * a + 2] = R(0.5);
        if (dimension == 2) { flat.positions[3 * a] = R(0.1 * (double)a); flat.positions[3 * a + 1] = R(0.2 * (double)a); }
    }
    s.desc.particles = flat.particles;
    s.desc.particles.spacing = R(0.25);
    s.desc.support = R(1.2);
    s.desc.operator_kind = kind;
    s.desc.particles.areas = flat.positions; /* TLSPH_CLOSED wants some */
    CHECK_RESULT(tlsph_create(&s.desc, &solver, &error), TLSPH_ERROR_NEIGHBOURS);
    CHECK(solver == NULL);
    CHECK(error.particle < flat.particles.count && says(&error, error.particle));
    own_cloud_destroy(&s.cloud);
}

TEST(neighbours_missing_or_flat)
{
    tlsph_error error;
    REFUSED((s.desc.support = R(0.9), s.cloud.positions[3 * VICTIM] = 100), TLSPH_ERROR_NEIGHBOURS, VICTIM);
    CHECK_SAME(error.neighbours, 0);
    static const tlsph_operator_kind kinds[] = {TLSPH_CORRECTED_KERNEL, TLSPH_ZEROTH_KERNEL, TLSPH_FIRST_KERNEL,
                                                TLSPH_ZEROTH_BOND,      TLSPH_BOND,          TLSPH_CLOSED};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        check_flat(3, kinds[i]);
        check_flat(2, kinds[i]);
    }
}

/* ---- materials ---- */

TEST(impossible_material_constants)
{
    tlsph_error error;
#define BAD_CONSTANT(member, constant) \
    REFUSED(s.materials[1].member = R(constant), TLSPH_ERROR_MATERIAL, TLSPH_NO_PARTICLE); \
    CHECK(strstr(error.message, #member) != NULL || strstr(error.field, #member) != NULL)
    BAD_CONSTANT(density, 0);
    BAD_CONSTANT(density, -1);
    BAD_CONSTANT(density, NAN);
    BAD_CONSTANT(density, INFINITY);
    BAD_CONSTANT(young, 0);
    BAD_CONSTANT(young, -5);
    BAD_CONSTANT(young, NAN);
    BAD_CONSTANT(poisson, 0.5);
    BAD_CONSTANT(poisson, -1);
    BAD_CONSTANT(poisson, NAN);
    BAD_CONSTANT(expansion, -1e-4);
    BAD_CONSTANT(expansion, NAN);
    BAD_CONSTANT(specific_heat, 0);
    BAD_CONSTANT(specific_heat, -1);
    BAD_CONSTANT(conductivity, -1);
    BAD_CONSTANT(conductivity, INFINITY);
    BAD_CONSTANT(reference_temperature, 0);
    BAD_CONSTANT(reference_temperature, -10);
    BAD_CONSTANT(gruneisen_exponent, -0.1);
    BAD_CONSTANT(gruneisen_exponent, 1.1);
    BAD_CONSTANT(mooney_fraction, -0.1);
    BAD_CONSTANT(mooney_fraction, 1.1);
    REFUSED((s.materials[1].gruneisen_exponent = 0, s.materials[1].expansion = R(0.01)), TLSPH_ERROR_MATERIAL, TLSPH_NO_PARTICLE);
    CHECK(strcmp(error.field, "chi_R") == 0); /* kappa - 3 kappa alpha theta_R < 0 */
    REFUSED(s.materials[0].young = -1, TLSPH_ERROR_MATERIAL, TLSPH_NO_PARTICLE);
    REFUSED(s.materials[1].kind = TLSPH_USER, TLSPH_ERROR_MATERIAL, TLSPH_NO_PARTICLE); /* no callback */
    REFUSED(s.materials[1].kind = (tlsph_material_kind)77, TLSPH_ERROR_MATERIAL, TLSPH_NO_PARTICLE);
    REFUSED(s.cloud.materials[VICTIM] = 2, TLSPH_ERROR_MATERIAL, VICTIM);
}

/* ---- the description ---- */

TEST(impossible_descriptions)
{
    tlsph_error error;
#define BAD_VALUE(statement) REFUSED(statement, TLSPH_ERROR_DESCRIPTION, TLSPH_NO_PARTICLE)
    BAD_VALUE(s.desc.cookie = 0);
    BAD_VALUE(s.desc.cookie ^= 0x5A5A5A5Au);
    BAD_VALUE(s.desc.dimension = 1);
    BAD_VALUE(s.desc.dimension = 4);
    BAD_VALUE(s.desc.cfl = 0);
    BAD_VALUE(s.desc.cfl = R(1.5));
    BAD_VALUE(s.desc.cfl = R(NAN));
    BAD_VALUE(s.desc.support = 0);
    BAD_VALUE(s.desc.support = R(NAN));
    BAD_VALUE(s.desc.unknowns = (tlsph_unknowns)9);
    BAD_VALUE(s.desc.thermal = (tlsph_thermal)9);
    BAD_VALUE(s.desc.operator_kind = (tlsph_operator_kind)9);
    BAD_VALUE(s.desc.kernel = (tlsph_kernel)9);
    BAD_VALUE(s.desc.dissipation = (tlsph_dissipation)9);
    BAD_VALUE(s.desc.volume_coupling = (tlsph_volume_coupling)9);
    BAD_VALUE(s.desc.conduction = (tlsph_conduction)9);
    BAD_VALUE(s.desc.integrator = (tlsph_integrator)9);
    BAD_VALUE(s.desc.drift_stiffness = -1);
    BAD_VALUE(s.desc.drift_scale = 0);
    BAD_VALUE(s.desc.jump_share = -1);
    BAD_VALUE(s.desc.drift_relaxation = -1);
    BAD_VALUE(s.desc.threads = -1);
    REFUSED(s.desc.particles.spacing = R(NAN), TLSPH_ERROR_NOT_FINITE, TLSPH_NO_PARTICLE);
    BAD_VALUE(s.desc.particles.spacing = -1);
}

TEST(wrong_counts)
{
    tlsph_error error;
    BAD_VALUE(s.desc.particles.count = 0);
    BAD_VALUE(s.desc.particles.count = (size_t)-1);
    BAD_VALUE(s.desc.material_count = 0);
    BAD_VALUE(s.desc.material_count = 257);
    BAD_VALUE(s.desc.particles.positions = NULL);
    BAD_VALUE(s.desc.particles.volumes = NULL);
    BAD_VALUE(s.desc.materials = NULL);
    BAD_VALUE(s.desc.conditions = NULL);
}

static void garbage(spoilt *s, int byte) { memset(&s->desc, byte, sizeof s->desc); }

TEST(uninitialised_descriptions)
{
    int byte;
    tlsph_error error;
    for (byte = 0; byte < 256; byte += 51) {
        spoilt s;
        tlsph_solver *solver = (tlsph_solver *)&s;
        tlsph_size size;
        REQUIRE(spoilt_make(&s, 3));
        garbage(&s, byte);
        CHECK_RESULT(tlsph_create(&s.desc, &solver, &error), TLSPH_ERROR_DESCRIPTION);
        CHECK(solver == NULL);
        CHECK(error.message[0] != 0);
        CHECK_RESULT(tlsph_measure(&s.desc, &size, &error), TLSPH_ERROR_DESCRIPTION);
        own_cloud_destroy(&s.cloud);
    }
    CHECK(tlsph_create(NULL, NULL, &error) != TLSPH_OK);
}

/* ---- conditions ---- */

TEST(impossible_conditions)
{
    tlsph_error error;
#define BAD_CONDITION(statement, particle) REFUSED(statement, TLSPH_ERROR_CONDITION, particle)
    BAD_CONDITION(s.set[5] = 64, 64);
    BAD_CONDITION(s.set[5] = 0xFFFFFFFFu, 0xFFFFFFFFu);
    BAD_CONDITION(s.conditions[1].kind = (tlsph_condition_kind)99, TLSPH_NO_PARTICLE);
    BAD_CONDITION(s.conditions[1].value[1] = R(NAN), TLSPH_NO_PARTICLE);
    BAD_CONDITION(s.conditions[1].normal[2] = R(INFINITY), TLSPH_NO_PARTICLE);
    BAD_CONDITION(s.conditions[1].point[0] = R(NAN), TLSPH_NO_PARTICLE);
    BAD_CONDITION(s.conditions[1].particles = NULL, TLSPH_NO_PARTICLE); /* with a count */
    BAD_CONDITION(s.conditions[1].cookie = 0, TLSPH_NO_PARTICLE);
    BAD_CONDITION(memset(&s.conditions[1], 0, sizeof s.conditions[1]), TLSPH_NO_PARTICLE);
    BAD_CONDITION(memset(&s.conditions[1], 0xAA, sizeof s.conditions[1]), TLSPH_NO_PARTICLE);
    BAD_CONDITION((s.conditions[0].kind = TLSPH_ROLLER), TLSPH_NO_PARTICLE); /* without a normal */
    BAD_CONDITION((s.conditions[0].kind = TLSPH_WALL), TLSPH_NO_PARTICLE);
    BAD_CONDITION(s.areas[3] = R(NAN), 3);
}

TEST(heat_needs_a_thermal_scene)
{
    static const tlsph_condition_kind kinds[3] = {TLSPH_TEMPERATURE, TLSPH_HEAT_FLUX, TLSPH_HEAT_SOURCE};
    tlsph_error error;
    int i;
    for (i = 0; i < 3; i++)
        REFUSED((s.desc.thermal = TLSPH_ISOTHERMAL, s.conditions[0].kind = kinds[i], s.conditions[0].value[0] = 300),
                TLSPH_ERROR_CONDITION, TLSPH_NO_PARTICLE);
    REFUSED((s.conditions[0].kind = TLSPH_TEMPERATURE, s.conditions[0].value[0] = 0), TLSPH_ERROR_CONDITION,
            TLSPH_NO_PARTICLE);
}

/* ---- cells and given pair vectors ---- */

static void all_meet(spoilt *s) { for (int c = 0; c < 27; c++) s->cloud.cells[8 * c] = 0; }

TEST(impossible_cells)
{
    tlsph_error error;
#define CELLS(statement, expected, particle) \
    REFUSED((s.desc.operator_kind = TLSPH_CELLS, statement), expected, particle)
    CELLS(s.cloud.cells[13] = 64, TLSPH_ERROR_ARGUMENT, TLSPH_NO_PARTICLE);
    CHECK(error.value == 64 && says(&error, 64));
    CELLS(s.desc.particles.cells = NULL, TLSPH_ERROR_DESCRIPTION, TLSPH_NO_PARTICLE);
    CELLS(s.desc.particles.cell_count = 0, TLSPH_ERROR_DESCRIPTION, TLSPH_NO_PARTICLE);
    CELLS(s.desc.particles.cell_count = 26, TLSPH_ERROR_NEIGHBOURS, 63); /* the last corner is left alone */
    CELLS(all_meet(&s), TLSPH_ERROR_ARGUMENT, 0);
    CELLS((s.cloud.cells[0] = 1, s.cloud.cells[1] = 0), TLSPH_ERROR_VOLUME, 1); /* turned inside out */
}
TEST(impossible_areas)
{
    static tlsph_real areas[3 * 64];
    tlsph_error error;
    areas[3 * VICTIM + 2] = R(INFINITY);
    REFUSED((s.desc.operator_kind = TLSPH_CLOSED, s.desc.particles.areas = areas), TLSPH_ERROR_NOT_FINITE, VICTIM);
}

TEST(impossible_pair_vectors)
{
    spoilt s;
    tlsph_error error;
    static const size_t first[5] = {0, 1, 2, 3, 4};
    static const uint32_t bad_index[4] = {1, 0, 9, 2};
    static const uint32_t good_index[4] = {1, 0, 3, 2};
    static const uint32_t own_index[4] = {0, 0, 3, 2}, one_way[4] = {1, 2, 3, 0};
    static const size_t falling[5] = {0, 1, 0, 3, 4};
    static const tlsph_real endless[12] = {1, 0, R(HUGE_VAL)}, nothing[12] = {0};
    static const tlsph_real not_antisymmetric[12] = {1, 0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0};
    tlsph_solver *solver = NULL;
    REQUIRE(spoilt_make(&s, 3));
    s.desc.particles.count = 4;
    s.desc.particles.cell_count = 0;
    s.desc.condition_count = 0;
    s.desc.operator_kind = TLSPH_GIVEN;
    s.desc.particles.first = first;
    s.desc.particles.neighbours = bad_index;
    s.desc.particles.pair_vectors = not_antisymmetric;
    CHECK(tlsph_create(&s.desc, &solver, &error) != TLSPH_OK);
    CHECK(solver == NULL && error.message[0] != 0);
    s.desc.particles.neighbours = good_index;
    CHECK(tlsph_create(&s.desc, &solver, &error) != TLSPH_OK);
    CHECK(solver == NULL && error.message[0] != 0);
    const struct { const size_t *first; const uint32_t *neighbours; const tlsph_real *vectors; tlsph_result result; } rows[] = {
        {first, good_index, NULL, TLSPH_ERROR_DESCRIPTION},
        {first, NULL, not_antisymmetric, TLSPH_ERROR_DESCRIPTION},
        {NULL, good_index, not_antisymmetric, TLSPH_ERROR_DESCRIPTION},
        {falling, good_index, not_antisymmetric, TLSPH_ERROR_SIZE},
        {first, own_index, not_antisymmetric, TLSPH_ERROR_ARGUMENT},
        {first, one_way, not_antisymmetric, TLSPH_ERROR_ARGUMENT},
        {first, good_index, endless, TLSPH_ERROR_NOT_FINITE},
        {first, good_index, nothing, TLSPH_ERROR_NEIGHBOURS}, /* antisymmetric, but no gradient follows */
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        s.desc.particles.first = rows[i].first;
        s.desc.particles.neighbours = rows[i].neighbours;
        s.desc.particles.pair_vectors = rows[i].vectors;
        if (!CHECK_RESULT(tlsph_create(&s.desc, &solver, &error), rows[i].result)) printf("    row %d: %.200s\n", (int)i, error.message);
        CHECK(solver == NULL);
    }
    own_cloud_destroy(&s.cloud);
}

/* ---- calls on a good solver ---- */

static tlsph_solver *good_solver(tlsph_unknowns unknowns, tlsph_thermal thermal)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver = NULL;
    s.unknowns = unknowns;
    s.thermal = thermal;
    CHECK_RESULT(moving_block_create(&s, &solver, NULL), TLSPH_OK);
    return solver;
}

/* Writes a field with one spoilt number; the state must stay. */
static void check_write_refused(tlsph_solver *solver, tlsph_field field, size_t at, double value, tlsph_result expected)
{
    tlsph_real *values = read_field(solver, field);
    uint64_t before = state_hash(solver);
    const tlsph_error *error = tlsph_last_error(solver);
    REQUIRE(values);
    values[at] = R(value);
    CHECK_RESULT(tlsph_write(solver, field, values), expected);
    CHECK(state_hash(solver) == before);
    if (CHECK(error != NULL)) {
        CHECK_RESULT(error->result, expected);
        CHECK_SAME(error->particle, at / (size_t)tlsph_field_components(field));
        CHECK(error->message[0] != 0);
    }
    free(values);
}

TEST(impossible_values_written)
{
    tlsph_solver *solver = good_solver(TLSPH_PFHJ, TLSPH_ENERGY);
    REQUIRE(solver);
    check_write_refused(solver, TLSPH_FIELD_VELOCITY, 3 * VICTIM + 1, (double)NAN, TLSPH_ERROR_NOT_FINITE);
    check_write_refused(solver, TLSPH_FIELD_POSITION, 3 * VICTIM + 2, (double)INFINITY, TLSPH_ERROR_NOT_FINITE);
    check_write_refused(solver, TLSPH_FIELD_F, 9 * VICTIM, (double)NAN, TLSPH_ERROR_NOT_FINITE);
    check_write_refused(solver, TLSPH_FIELD_F, 9 * VICTIM, -1, TLSPH_ERROR_INVERSION);
    check_write_refused(solver, TLSPH_FIELD_J, VICTIM, 0, TLSPH_ERROR_INVERSION);
    check_write_refused(solver, TLSPH_FIELD_TEMPERATURE, VICTIM, 0, TLSPH_ERROR_TEMPERATURE);
    check_write_refused(solver, TLSPH_FIELD_TEMPERATURE, VICTIM, -3, TLSPH_ERROR_TEMPERATURE);
    check_write_refused(solver, TLSPH_FIELD_TEMPERATURE, VICTIM, (double)NAN, TLSPH_ERROR_NOT_FINITE);
    CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_VELOCITY, NULL), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_read(solver, TLSPH_FIELD_VELOCITY, NULL), TLSPH_ERROR_ARGUMENT);
    tlsph_destroy(solver);
}

static void check_step_refused(tlsph_solver *solver, double dt)
{
    uint64_t before = state_hash(solver);
    tlsph_result result = tlsph_step(solver, R(dt));
    CHECK(result == TLSPH_ERROR_ARGUMENT || result == TLSPH_ERROR_TIME_STEP);
    CHECK(state_hash(solver) == before);
    CHECK_RESULT(tlsph_last_error(solver)->result, result);
    CHECK(tlsph_last_error(solver)->message[0] != 0);
}

TEST(impossible_time_steps)
{
    tlsph_solver *solver = good_solver(TLSPH_PF, TLSPH_ISOTHERMAL);
    REQUIRE(solver);
    check_step_refused(solver, 0);
    check_step_refused(solver, -1);
    check_step_refused(solver, (double)NAN);
    CHECK(tlsph_advance(solver, R(NAN)) != TLSPH_OK);
    CHECK_RESULT(tlsph_step(solver, R(INFINITY)), TLSPH_OK);
    CHECK_RESULT(tlsph_advance(solver, 0), TLSPH_OK); /* past: nothing happens */
    CHECK_SAME(tlsph_step_count(solver), 1);
    tlsph_destroy(solver);
}

TEST(advance_meets_its_time)
{
    tlsph_solver *solver = good_solver(TLSPH_PF, TLSPH_ISOTHERMAL);
    REQUIRE(solver);
    CHECK_RESULT(tlsph_advance(solver, R(0.1)), TLSPH_OK);
    CHECK(tlsph_time(solver) == R(0.1));
    CHECK_RESULT(tlsph_advance(solver, R(0.1)), TLSPH_OK);
    CHECK(tlsph_time(solver) == R(0.1));
    CHECK_RESULT(tlsph_advance(solver, R(0.17)), TLSPH_OK);
    CHECK(tlsph_time(solver) == R(0.17));
    tlsph_destroy(solver);
}

/* ---- steps that fail ---- */

/* v = -rate (X - X0) along x about the middle: with rate x dt > 1 the body would pass through itself in one step. */
static void crush(tlsph_solver *solver, double rate)
{
    size_t a, n = tlsph_count(solver);
    tlsph_real *X = read_field(solver, TLSPH_FIELD_REFERENCE_POSITION), *v = calloc(3 * n, sizeof *v);
    for (a = 0; a < n; a++) v[3 * a] = R(-rate * ((double)X[3 * a]));
    CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_VELOCITY, v), TLSPH_OK);
    free(X);
    free(v);
}

static void check_record(const tlsph_solver *solver, tlsph_result expected)
{
    const tlsph_error *error = tlsph_last_error(solver);
    CHECK_RESULT(error->result, expected);
    CHECK(error->particle < tlsph_count(solver));
    CHECK(says(error, error->particle));
    CHECK(error->value <= 0 && error->limit >= 0);
    CHECK_CLOSE(error->time, tlsph_time(solver), EPSILON * error->time);
    CHECK_SAME(error->step, tlsph_step_count(solver));
    CHECK(error->stretches[0] >= error->stretches[1] && error->stretches[1] >= error->stretches[2]);
    CHECK(error->neighbours > 0);
}

static void check_failed_step(tlsph_unknowns unknowns, tlsph_thermal thermal)
{
    tlsph_solver *solver = good_solver(unknowns, thermal);
    unsigned char *before, *after;
    size_t size;
    uint64_t hash;
    tlsph_result result;
    int again;
    REQUIRE(solver);
    CHECK_RESULT(take_steps(solver, 3), TLSPH_OK);
    crush(solver, 10 / (double)tlsph_stable_time_step(solver));
    before = save_state(solver, &size);
    hash = state_hash(solver);
    result = tlsph_step(solver, 1);
    CHECK(result == TLSPH_ERROR_INVERSION || (thermal && result == TLSPH_ERROR_TEMPERATURE));
    check_record(solver, result);
    CHECK(state_hash(solver) == hash); /* bit for bit the last good state */
    after = save_state(solver, &size);
    REQUIRE(before && after);
    CHECK(memcmp(before, after, size) == 0);
    for (again = 0; again < 3; again++) (void)tlsph_step(solver, 1); /* may fail again, may not spread nonsense */
    CHECK(state_finite(solver));
    CHECK_RESULT(tlsph_restore(solver, after, size), TLSPH_OK);
    CHECK(state_hash(solver) == hash);
    free(before);
    free(after);
    tlsph_destroy(solver);
}

TEST(inversion_in_a_step)
{
    static const tlsph_unknowns sets[4] = {TLSPH_PF, TLSPH_PFJ, TLSPH_PFH, TLSPH_PFHJ};
    static const tlsph_thermal thermals[3] = {TLSPH_ISOTHERMAL, TLSPH_ENERGY, TLSPH_ENTROPY};
    int u, t;
    for (u = 0; u < 4; u++)
        for (t = 0; t < 3; t++) check_failed_step(sets[u], thermals[t]);
}

/* A sink takes more heat than there is. */
TEST(temperature_below_zero_in_a_step)
{
    spoilt s;
    tlsph_solver *solver = NULL;
    tlsph_result result = TLSPH_OK;
    uint64_t hash = 0;
    int step;
    REQUIRE(spoilt_make(&s, 3));
    s.desc.condition_count = 1;
    s.conditions[0] = tlsph_condition_default(TLSPH_HEAT_SOURCE);
    s.conditions[0].value[0] = R(-1e7);
    REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
    for (step = 0; step < 1000 && !result; step++) {
        hash = state_hash(solver);
        result = tlsph_step(solver, 1);
    }
    CHECK_RESULT(result, TLSPH_ERROR_TEMPERATURE);
    check_record(solver, TLSPH_ERROR_TEMPERATURE);
    CHECK(state_hash(solver) == hash);
    CHECK(state_finite(solver));
    tlsph_destroy(solver);
    own_cloud_destroy(&s.cloud);
}

/* Takes more heat than there is from a time on: a step that ends before it is good. */
static void sudden_sink(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                        const tlsph_real *x, tlsph_real *values)
{
    const tlsph_real *from = user;
    (void)particle; (void)X; (void)x;
    for (size_t i = 0; time > *from && i < count; i++) values[i] = R(-1e9);
}
TEST(retries_halve_the_step)
{
    static const tlsph_unknowns sets[2] = {TLSPH_PF, TLSPH_PFHJ};
    for (int i = 0; i < 2; i++)
        for (int retries = 0; retries < 4; retries++) {
            spoilt s;
            tlsph_solver *solver = NULL;
            tlsph_ledger ledger;
            tlsph_real from = 0;
            REQUIRE(spoilt_make(&s, 3));
            s.desc.unknowns = sets[i];
            s.desc.condition_count = 1;
            s.desc.retries = retries;
            s.conditions[0] = tlsph_condition_default(TLSPH_HEAT_SOURCE);
            s.conditions[0].values = sudden_sink;
            s.conditions[0].values_user = &from;
            REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
            const tlsph_real dt = tlsph_stable_time_step(solver);
            const uint64_t hash = state_hash(solver);
            from = R(0.3) * dt; /* a step and its half end after it, a quarter does not */
            const tlsph_result result = tlsph_step(solver, dt);
            tlsph_ledger_read(solver, &ledger);
            CHECK_RESULT(result, retries < 2 ? TLSPH_ERROR_TEMPERATURE : TLSPH_OK);
            CHECK_SAME(ledger.retries, retries < 2 ? 0 : 2);
            if (result) CHECK(state_hash(solver) == hash);
            else CHECK_CLOSE(tlsph_time(solver), (double)dt / 4, 1e-6 * (double)dt);
            tlsph_destroy(solver);
            own_cloud_destroy(&s.cloud);
        }
}

static void not_a_number(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                         const tlsph_real *x, tlsph_real *values)
{
    (void)user; (void)particle; (void)X; (void)x;
    if (count && time > 0) values[0] = R(NAN);
}

/* The host's callback turns bad. */
TEST(a_load_that_is_not_finite)
{
    spoilt s;
    tlsph_solver *solver = NULL;
    tlsph_result result = TLSPH_OK;
    uint64_t hash = 0;
    int step;
    REQUIRE(spoilt_make(&s, 3));
    s.conditions[1].values = not_a_number;
    s.conditions[0].kind = TLSPH_FORCE; /* nothing is clamped: the force must reach a velocity */
    REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
    for (step = 0; step < 3 && !result; step++) {
        hash = state_hash(solver);
        result = tlsph_step(solver, 1);
    }
    CHECK_RESULT(result, TLSPH_ERROR_NOT_FINITE);
    CHECK(state_hash(solver) == hash);
    CHECK(state_finite(solver));
    tlsph_destroy(solver);
    own_cloud_destroy(&s.cloud);
}

TEST(every_result_has_a_text)
{
    int r;
    for (r = 0; r < TLSPH_RESULT_COUNT; r++) CHECK(strlen(tlsph_result_text((tlsph_result)r)) > 3);
    CHECK(tlsph_result_text((tlsph_result)999) != NULL);
}

SUITE(errors, ENTRY(the_unspoilt_scene_is_good), ENTRY(particles_not_finite), ENTRY(volumes_not_positive),
      ENTRY(duplicate_positions), ENTRY(neighbours_missing_or_flat),
      ENTRY(impossible_material_constants), ENTRY(impossible_descriptions), ENTRY(wrong_counts),
      ENTRY(uninitialised_descriptions), ENTRY(impossible_conditions), ENTRY(heat_needs_a_thermal_scene),
      ENTRY(impossible_cells), ENTRY(impossible_areas), ENTRY(impossible_pair_vectors), ENTRY(impossible_values_written),
      ENTRY(impossible_time_steps), ENTRY(advance_meets_its_time), ENTRY(inversion_in_a_step),
      ENTRY(temperature_below_zero_in_a_step), ENTRY(retries_halve_the_step),
      ENTRY(a_load_that_is_not_finite), ENTRY(every_result_has_a_text))
