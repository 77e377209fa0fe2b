/* The incompressible scheme's contract: refusals, limits on iterations, checkpoints, threads. */
#include "support.h"

static tlsph_material rubber(double poisson) {
    tlsph_material m = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    m.young = R(1e6);
    m.density = R(1000);
    m.poisson = R(poisson);
    return m;
}

/* A beam of 4 x 2 x 2 cells, clamped at X = 0, that swings; `change` may spoil the description. */
static tlsph_result beam(void (*change)(tlsph_desc *desc, tlsph_material *material, tlsph_condition *conditions),
                         tlsph_solver **solver, tlsph_error *error) {
    const int cells[3] = { 4, 2, 2 };
    tlsph_material material = rubber(0.5);
    tlsph_condition conditions[2] = { tlsph_condition_default(TLSPH_CLAMPED), tlsph_condition_default(TLSPH_ACCELERATION) };
    tlsph_desc desc = tlsph_desc_default(3);
    uint32_t root[64];
    own_cloud cloud;
    tlsph_result result;
    *solver = NULL;
    if (!own_box(&cloud, 3, cells, 0.25, 0)) return TLSPH_ERROR_MEMORY;
    desc.particles = cloud.particles;
    desc.materials = &material;     desc.material_count = 1;
    desc.conditions = conditions;   desc.condition_count = 2;
    desc.scheme = TLSPH_INCOMPRESSIBLE;
    desc.threads = 1;
    conditions[0].particles = root;
    conditions[0].count = tlsph_select_plane(&cloud.particles, 0, 0, R(1e-6), root, 64);
    conditions[1].value[1] = R(-50);
    if (change) change(&desc, &material, conditions);
    result = tlsph_create(&desc, solver, error);
    own_cloud_destroy(&cloud);
    return result;
}

static void thermal(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) {
    (void)c; d->thermal = TLSPH_ENERGY; m->specific_heat = 1;
}
static void evolves_J(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)m; (void)c; d->unknowns = TLSPH_PFJ; }
static void evolves_all(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)m; (void)c; d->unknowns = TLSPH_PFHJ; }
static void bonds(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)m; (void)c; d->operator_kind = TLSPH_BOND; }
static void fourth(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)m; (void)c; d->operator_kind = TLSPH_CELLS_4; }
static void sharp(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)m; (void)c; d->sharp_gradients = 1; }
static void third_order(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)m; (void)c; d->integrator = TLSPH_SSP_RK3; }
static void gas(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)d; (void)c; m->kind = TLSPH_MIE_GRUNEISEN; }
static void beyond(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)d; (void)c; m->poisson = R(0.51); }
static void plain_half(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)m; (void)c; d->scheme = TLSPH_EXPLICIT; }
static void wall(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) {
    (void)d; (void)m; c[1] = tlsph_condition_default(TLSPH_WALL); c[1].normal[0] = 1;
}
static void few_iterations(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) {
    (void)m; (void)c; d->incompressible.iteration_limit = 1;
}
static void no_tolerance(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)m; (void)c; d->incompressible.tolerance = 0; }

TEST(refuses_what_it_cannot_do) {
    static const struct {
        void (*change)(tlsph_desc *, tlsph_material *, tlsph_condition *);
        tlsph_result result;
        const char *field;
    } cases[] = { { thermal, TLSPH_ERROR_DESCRIPTION, "thermal" },      { evolves_J, TLSPH_ERROR_DESCRIPTION, "unknowns" },
                  { sharp, TLSPH_ERROR_DESCRIPTION, "sharp_gradients" }, { third_order, TLSPH_ERROR_DESCRIPTION, "integrator" },
                  { gas, TLSPH_ERROR_MATERIAL, "kind" },                 { beyond, TLSPH_ERROR_MATERIAL, "poisson" },
                  { plain_half, TLSPH_ERROR_MATERIAL, "poisson" },       { wall, TLSPH_ERROR_CONDITION, "kind" },
                  { evolves_all, TLSPH_ERROR_DESCRIPTION, "unknowns" },  { bonds, TLSPH_ERROR_DESCRIPTION, "operator" },
                  { fourth, TLSPH_ERROR_DESCRIPTION, "operator_kind" },
                  { no_tolerance, TLSPH_ERROR_DESCRIPTION, "incompressible.tolerance" } };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tlsph_solver *solver;
        tlsph_error error;
        CHECK_RESULT(beam(cases[i].change, &solver, &error), cases[i].result);
        CHECK(solver == NULL);
        if (!CHECK(strcmp(error.field, cases[i].field) == 0)) REPORT("%s", error.message);
    }
}

static void few_pseudo_times(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) {
    few_iterations(d, m, c); d->incompressible.iteration = TLSPH_DUAL_TIME;
}
static void too_few(void (*change)(tlsph_desc *, tlsph_material *, tlsph_condition *)) {
    tlsph_solver *solver;
    REQUIRE_OK(beam(change, &solver, NULL));
    uint64_t before = 0;
    tlsph_result result = tlsph_step(solver, R(1e-4)); /* so short a fall needs next to no pressure */
    CHECK_RESULT(result, TLSPH_OK);
    for (int i = 0; i < 10 && result == TLSPH_OK; i++) {
        before = state_hash(solver);
        CHECK_SAME(tlsph_step_count(solver), i + 1);
        result = tlsph_step(solver, R(1));
    }
    CHECK_RESULT(result, TLSPH_ERROR_CONVERGENCE);
    CHECK(state_hash(solver) == before);
    CHECK(tlsph_last_error(solver)->value > tlsph_last_error(solver)->limit);
    CHECK(strstr(tlsph_last_error(solver)->message, "iteration_limit") != NULL);
    tlsph_destroy(solver);
}
TEST(too_few_iterations_are_an_error_and_leave_the_last_good_state) { too_few(few_iterations); too_few(few_pseudo_times); }

/* A bar in a symmetric motion, whole or its right half with a mirror at X = 0; `mirrored`: fields know of it. Returns the
   velocities. */
static tlsph_real *symmetric_bar(int half, int mirrored, own_cloud *cloud) {
    const int cells[3] = { half ? 4 : 8, 2, 2 };
    tlsph_material material = rubber(0.5);
    tlsph_condition mirror = tlsph_condition_default(TLSPH_ROLLER);
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_solver *solver;
    tlsph_real *v;
    uint32_t face[9];
    if (!CHECK(own_box(cloud, 3, cells, 0.25, 0))) return NULL;
    for (size_t a = 0; a < cloud->particles.count && !half; a++) cloud->positions[3 * a] -= 1;
    mirror.count = tlsph_select_plane(&cloud->particles, 0, 0, R(1e-6), face, 9);
    mirror.particles = face;
    mirror.normal[0] = 1;
    desc.particles = cloud->particles;
    desc.materials = &material;
    desc.material_count = 1;
    desc.conditions = &mirror;
    desc.condition_count = (size_t)half;
    desc.mirror_gradients = mirrored;
    desc.scheme = TLSPH_INCOMPRESSIBLE;
    desc.projection = 0; /* a half body bears forces at its mirror */
    desc.incompressible.tolerance = R(1e-9);
    desc.threads = 1;
    if (!CHECK_RESULT(tlsph_create(&desc, &solver, NULL), TLSPH_OK)) return NULL;
    v = read_field(solver, TLSPH_FIELD_VELOCITY);
    for (size_t a = 0; v && a < cloud->particles.count; a++) {
        const double x = (double)cloud->positions[3 * a], y = (double)cloud->positions[3 * a + 1];
        v[3 * a] = R(3 * sin(1.5 * x));
        v[3 * a + 1] = R(2 * cos(3 * x) * (y - 0.2));
    }
    CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_VELOCITY, v), TLSPH_OK);
    for (int i = 0; i < 20; i++) CHECK_RESULT(tlsph_step(solver, R(5e-4)), TLSPH_OK);
    free(v);
    v = read_field(solver, TLSPH_FIELD_VELOCITY);
    tlsph_destroy(solver);
    return v;
}
TEST(a_mirror_stands_for_the_other_half) {
    double off[2] = { 0, 0 }, most = 0;
    own_cloud whole, half;
    DOUBLE_ONLY();
    tlsph_real *v = symmetric_bar(0, 1, &whole);
    for (int i = 0; i < 2; i++) {
        tlsph_real *w = symmetric_bar(1, 1 - i, &half);
        REQUIRE(v && w);
        for (size_t a = 0, at = 0; a < whole.particles.count; a++) {
            if ((double)whole.positions[3 * a] < -1e-6) continue;
            for (size_t k = 0; k < 3; k++) {
                off[i] = fmax(off[i], fabs((double)(v[3 * a + k] - w[3 * at + k])));
                most = fmax(most, fabs((double)v[3 * a + k]));
            }
            at++;
        }
        free(w);
        own_cloud_destroy(&half);
    }
    CHECK_BELOW(off[0], 1e-6 * most);
    CHECK(off[1] > 1e-3 * most); /* without, the half body's end is rough */
    REPORT("off by %.1e, without mirrored fields by %.1e", off[0] / most, off[1] / most);
    free(v);
    own_cloud_destroy(&whole);
}

TEST(report_counts_and_the_explicit_scheme_has_none) {
    moving_block block = moving_block_default();
    tlsph_pressure_report report;
    tlsph_solver *solver;
    uint64_t sum = 0;
    REQUIRE_OK(beam(NULL, &solver, NULL));
    for (int i = 0; i < 5; i++) {
        CHECK_RESULT(tlsph_step(solver, R(1)), TLSPH_OK);
        CHECK_RESULT(tlsph_pressure_report_read(solver, &report), TLSPH_OK);
        sum += (uint64_t)(report.iterations[0] + report.iterations[1]);
        CHECK(report.residual[0] <= report.tolerance && report.residual[1] <= report.tolerance);
    }
    CHECK(sum > 0 && report.iterations_total == sum);
    CHECK_BELOW(report.volume_error, 1e-3);
    CHECK_RESULT(tlsph_pressure_report_read(solver, NULL), TLSPH_ERROR_ARGUMENT);
    tlsph_destroy(solver);
    REQUIRE_OK(moving_block_create(&block, &solver, NULL));
    CHECK_RESULT(tlsph_pressure_report_read(solver, &report), TLSPH_ERROR_FIELD);
    tlsph_destroy(solver);
}

TEST(checkpoint_continues_bitwise) {
    tlsph_solver *whole, *resumed;
    size_t size;
    REQUIRE_OK(beam(NULL, &whole, NULL));
    CHECK_RESULT(take_steps(whole, 4), TLSPH_OK);
    unsigned char *saved = save_state(whole, &size);
    REQUIRE(saved);
    CHECK_RESULT(take_steps(whole, 6), TLSPH_OK);
    REQUIRE_OK(beam(NULL, &resumed, NULL));
    CHECK_RESULT(tlsph_restore(resumed, saved, size), TLSPH_OK);
    CHECK_RESULT(take_steps(resumed, 6), TLSPH_OK);
    CHECK(state_hash(whole) == state_hash(resumed));
    free(saved);
    tlsph_destroy(whole);
    tlsph_destroy(resumed);
}

/* Blocks in any order, as threads would take them. */
static void backwards(void *user, tlsph_task_fn task, void *arg, size_t count) {
    (void)user;
    while (count-- > 0) task(arg, count);
}
static void own_threads(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)m; (void)c; d->run = backwards; }

TEST(order_of_tasks_changes_no_bit) {
    tlsph_solver *one, *two;
    REQUIRE_OK(beam(NULL, &one, NULL));
    REQUIRE_OK(beam(own_threads, &two, NULL));
    CHECK_RESULT(take_steps(one, 5), TLSPH_OK);
    CHECK_RESULT(take_steps(two, 5), TLSPH_OK);
    CHECK(state_hash(one) == state_hash(two));
    tlsph_destroy(one);
    tlsph_destroy(two);
}

/* A linear material has H = I and J = 1 + tr eps: the beam under its own weight keeps its volume too. */
static void linear(tlsph_desc *d, tlsph_material *m, tlsph_condition *c) { (void)d; m->kind = TLSPH_LINEAR; c[1].value[1] = R(-1); }

TEST(linear_material_keeps_its_volume) {
    tlsph_solver *solver;
    tlsph_pressure_report report;
    REQUIRE_OK(beam(linear, &solver, NULL));
    CHECK_RESULT(take_steps(solver, 20), TLSPH_OK);
    CHECK_RESULT(tlsph_pressure_report_read(solver, &report), TLSPH_OK);
    CHECK_BELOW(report.volume_error, 1e-4);
    tlsph_destroy(solver);
}

SUITE(incompressible, ENTRY(refuses_what_it_cannot_do), ENTRY(too_few_iterations_are_an_error_and_leave_the_last_good_state),
      ENTRY(a_mirror_stands_for_the_other_half),
      ENTRY(report_counts_and_the_explicit_scheme_has_none), ENTRY(checkpoint_continues_bitwise),
      ENTRY(order_of_tasks_changes_no_bit), ENTRY(linear_material_keeps_its_volume))
