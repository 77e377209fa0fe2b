/* Balances: entropy production pair by pair, angular momentum with the projection, energy with every kind of load. */
#include "physics.h"

/* ---- entropy production ------------------------------------------------------------------------------------------ */

/* Column of 1 x 1 x 6 m, E = 17 MPa, rho = 1100 kg/m^3, clamped at its foot and thrown into a twist:
   v = omega sin(pi Z / 12) (-Y, X, 0) about its axis (001 section 7.5). */
static const double column_omega = 105; /* rad/s */

static void twist(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double rate = *(const double *)scene * sin(SCENE_PI * (double)X[2] / 12);
    state->v[0] = -rate * (double)X[1];
    state->v[1] = rate * (double)X[0];
}

static tlsph_material column_material(tlsph_material_kind kind, double poisson) {
    tlsph_material m = tlsph_material_default(kind);
    m.density = 1100; m.young = 17000000; m.poisson = R(poisson);
    m.expansion = R(2.223e-4); m.specific_heat = 1000; m.conductivity = 10; m.reference_temperature = R(293.15);
    return m;
}

static tlsph_result column_create(tlsph_unknowns unknowns, tlsph_thermal thermal, tlsph_material_kind kind, double poisson,
                                  scene_body *body) {
    const tlsph_material material = column_material(kind, poisson);
    scene_options options = physics_options(unknowns, thermal);
    tlsph_fill fill = tlsph_fill_default(3);
    scene_setup setup;
    tlsph_result result;
    options.audit = 1;
    fill.origin[0] = fill.origin[1] = R(-0.5);
    fill.size[0] = fill.size[1] = 1; fill.size[2] = 6;
    fill.spacing = R(0.25);
    scene_begin(&setup, &fill, &material, NULL);
    scene_add_plane(&setup, TLSPH_CLAMPED, 2, 0);
    result = scene_end(&setup, &options, body, NULL);
    return result == TLSPH_OK ? scene_set_state(body, &column_omega, twist) : result;
}

/* Every step up to `end`: least pair production so far, largest stretch, energy kept (kinetic and strain; isothermal). */
static void audit_run(tlsph_solver *solver, double end, double *least, double *drift) {
    tlsph_ledger l;
    *least = HUGE_VAL;
    *drift = 0;
    while ((double)tlsph_time(solver) < end) {
        REQUIRE_OK(tlsph_step(solver, R(end)));
        tlsph_ledger_read(solver, &l);
        *least = fmin(*least, l.least_pair_production);
        *drift = fmax(*drift, l.drift_largest);
    }
}

static void column_audit(tlsph_unknowns unknowns, tlsph_thermal thermal, tlsph_material_kind kind, double poisson) {
    scene_body body;
    tlsph_ledger start, end;
    double least, drift, stretch = 0;
    tlsph_real *F;
    REQUIRE_OK(column_create(unknowns, thermal, kind, poisson, &body));
    tlsph_ledger_read(body.solver, &start);
    audit_run(body.solver, 0.1, &least, &drift);
    tlsph_ledger_read(body.solver, &end);
    F = scene_read(body.solver, TLSPH_FIELD_F);
    for (size_t i = 0; F && i < 9 * tlsph_count(body.solver); i++) stretch = fmax(stretch, fabs((double)F[i]));
    free(F);
    REPORT("least production %.1e, mechanical energy kept %.3f, drift %.3f, largest |F| %.2f", least,
           1 - end.dissipation / start.kinetic_energy, drift, stretch);
    CHECK(least >= -1e-12);
    CHECK(end.dissipation >= 0);
    scene_destroy(&body);
}

TEST(twisting_column_pair_production_pF) { DOUBLE_ONLY(); column_audit(TLSPH_PF, TLSPH_ISOTHERMAL, TLSPH_NEO_HOOKEAN, 0.45); }
TEST(slow_twisting_column_pair_production_pFHJ) {
    DOUBLE_ONLY();
    column_audit(TLSPH_PFHJ, TLSPH_ISOTHERMAL, TLSPH_NEO_HOOKEAN, 0.495);
}
TEST(twisting_column_pair_production_energy) { DOUBLE_ONLY(); column_audit(TLSPH_PFHJ, TLSPH_ENERGY, TLSPH_MIE_GRUNEISEN, 0.45); }
TEST(twisting_column_pair_production_entropy) { DOUBLE_ONLY(); column_audit(TLSPH_PFJ, TLSPH_ENTROPY, TLSPH_MIE_GRUNEISEN, 0.45); }
TEST(slow_twisting_column_pair_production_mee) {
    DOUBLE_ONLY();
    column_audit(TLSPH_PFHJ, TLSPH_ENERGY, TLSPH_MEE, 0.45);
}

/* The audit sees what it is for: without the limiter the inequality breaks (METHOD section 3). */
TEST(reconstruction_without_limiter_breaks_the_inequality) {
    scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
    const tlsph_material material = column_material(TLSPH_NEO_HOOKEAN, 0.45);
    double least, drift;
    scene_setup setup;
    scene_body body;
    DOUBLE_ONLY();
    options.audit = 1;
    options.dissipation = TLSPH_RECONSTRUCTED;
    box_begin(&setup, 4, 4, 12, &material);
    scene_add_plane(&setup, TLSPH_CLAMPED, 2, 0);
    REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
    REQUIRE_OK(scene_set_state(&body, &column_omega, twist));
    audit_run(body.solver, 0.02, &least, &drift);
    REPORT("least production %.1e", least);
    CHECK(least < -1e-3);
    scene_destroy(&body);
}

static void block_audit(tlsph_unknowns unknowns, tlsph_thermal thermal) {
    l_block_parameters p;
    l_block block;
    double least, drift;
    l_block_default(&p);
    p.options.threads = 1;
    p.options.unknowns = (int)unknowns;
    p.options.thermal = (int)thermal;
    p.options.audit = 1;
    p.spacing = 0.75;
    REQUIRE_OK(l_block_create(&p, &block, NULL));
    audit_run(block.body.solver, 8, &least, &drift);
    REPORT("least production %.1e, drift %.4f", least, drift);
    CHECK(least >= -1e-12);
    CHECK_BELOW(drift, 0.02);
    scene_destroy(&block.body);
}

TEST(l_block_pair_production_pF_energy) { DOUBLE_ONLY(); block_audit(TLSPH_PF, TLSPH_ENERGY); }
TEST(l_block_pair_production_pFHJ_energy) { DOUBLE_ONLY(); block_audit(TLSPH_PFHJ, TLSPH_ENERGY); }
TEST(l_block_pair_production_pFHJ_entropy) { DOUBLE_ONLY(); block_audit(TLSPH_PFHJ, TLSPH_ENTROPY); }

/* ---- projection -------------------------------------------------------------------------------------------------- */

static const double lively = 1.5; /* 1/s: stretches of some 20 % in the paper's material */

/* Angular momentum about the origin of all particles of one body. */
static void body_angular_momentum(const tlsph_solver *solver, double number, double out[3], double *scale) {
    tlsph_real *x = scene_read(solver, TLSPH_FIELD_POSITION), *v = scene_read(solver, TLSPH_FIELD_VELOCITY);
    tlsph_real *m = scene_read(solver, TLSPH_FIELD_MASS), *body = scene_read(solver, TLSPH_FIELD_BODY);
    out[0] = out[1] = out[2] = *scale = 0;
    for (size_t a = 0; a < tlsph_count(solver); a++) {
        const double mass = (double)m[a], X[3] = { (double)x[3 * a], (double)x[3 * a + 1], (double)x[3 * a + 2] };
        const double V[3] = { (double)v[3 * a], (double)v[3 * a + 1], (double)v[3 * a + 2] };
        if (fabs((double)body[a] - number) > 0.5) continue;
        for (int i = 0; i < 3; i++) out[i] += mass * (X[(i + 1) % 3] * V[(i + 2) % 3] - X[(i + 2) % 3] * V[(i + 1) % 3]);
        *scale += mass * length3(X) * length3(V);
    }
    free(x); free(v); free(m); free(body);
}

static void lively_run(int projection, tlsph_thermal thermal, double *change, double *scale) {
    const tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    scene_options options = physics_options(TLSPH_PFHJ, thermal);
    double before[3], after[3];
    scene_setup setup;
    scene_body body;
    *change = HUGE_VAL;
    options.projection = projection;
    box_begin(&setup, 4, 6, 3, &material);
    REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
    REQUIRE_OK(scene_set_state(&body, &lively, lively_state));
    body_angular_momentum(body.solver, 0, before, scale);
    CHECK_RESULT(tlsph_advance(body.solver, 2), TLSPH_OK);
    body_angular_momentum(body.solver, 0, after, scale);
    for (int i = 0; i < 3; i++) after[i] -= before[i];
    *change = length3(after);
    scene_destroy(&body);
}

/* Round-off grows with the square root of the steps at worst; 1e-12 leaves room for some thousand of them. */
TEST(projection_keeps_angular_momentum) {
    double with, without, scale;
    DOUBLE_ONLY();
    lively_run(1, TLSPH_ENERGY, &with, &scale);
    lively_run(0, TLSPH_ENERGY, &without, &scale);
    REPORT("change by scale %.1e with, %.1e without", with / scale, without / scale);
    CHECK_BELOW(with, 1e-12 * scale);
    CHECK(without > 1e3 * with);
    lively_run(1, TLSPH_ENTROPY, &with, &scale);
    CHECK_BELOW(with, 1e-12 * scale);
}

/* Two boxes 5 m apart as one cloud; `two` gets the arrays, freed by the caller. */
typedef struct two_boxes { tlsph_real *positions, *volumes, *weights; tlsph_particles particles; } two_boxes;

static int make_two_boxes(two_boxes *two, const tlsph_particles *one) {
    const size_t n = one->count;
    two->positions = malloc(6 * n * sizeof *two->positions);
    two->volumes = malloc(2 * n * sizeof *two->volumes);
    two->weights = malloc(2 * n * sizeof *two->weights);
    if (!two->positions || !two->volumes || !two->weights) return 1;
    for (size_t i = 0; i < 2 * n; i++) {
        for (size_t j = 0; j < 3; j++) two->positions[3 * i + j] = one->positions[3 * (i % n) + j] + (i < n || j ? 0 : 5);
        two->volumes[i] = one->volumes[i % n];
        two->weights[i] = one->weights ? one->weights[i % n] : one->volumes[i % n];
    }
    two->particles = *one;
    two->particles.count = 2 * n;
    two->particles.positions = two->positions;
    two->particles.volumes = two->volumes;
    two->particles.weights = two->weights;
    two->particles.cell_count = 0;
    two->particles.cells = NULL;
    return 0;
}

static void opposed_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double sign = (double)X[0] < 3 ? 1 : -2; /* the second body spins the other way, faster */
    const tlsph_real local[3] = { (double)X[0] < 3 ? X[0] : X[0] - 5, X[1], X[2] };
    lively_state(scene, local, state);
    for (int i = 0; i < 3; i++) state->v[i] *= sign;
}

TEST(projection_keeps_angular_momentum_of_each_body) {
    const tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_cloud cloud;
    two_boxes two;
    scene_body body;
    double before[2][3], after[2][3], scale[2];
    DOUBLE_ONLY();
    memset(&body, 0, sizeof body);
    fill.spacing = R(0.25);
    fill.size[0] = 1; fill.size[1] = R(1.5); fill.size[2] = R(0.75);
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    REQUIRE(make_two_boxes(&two, &cloud.particles) == 0);
    desc.particles = two.particles;
    desc.materials = &material; desc.material_count = 1;
    desc.unknowns = TLSPH_PFHJ; desc.thermal = TLSPH_ENERGY;
    REQUIRE_OK(tlsph_create(&desc, &body.solver, NULL));
    body.cloud.particles = two.particles;
    body.material = material;
    CHECK_SAME(tlsph_body_count(body.solver), 2);
    REQUIRE_OK(scene_set_state(&body, &lively, opposed_state));
    for (int b = 0; b < 2; b++) body_angular_momentum(body.solver, b, before[b], &scale[b]);
    CHECK_RESULT(tlsph_advance(body.solver, 1), TLSPH_OK);
    for (int b = 0; b < 2; b++) {
        body_angular_momentum(body.solver, b, after[b], &scale[b]);
        for (int i = 0; i < 3; i++) CHECK_CLOSE(after[b][i], before[b][i], 1e-12 * scale[b]);
    }
    tlsph_destroy(body.solver);
    tlsph_cloud_destroy(&cloud);
    free(two.positions); free(two.volumes); free(two.weights);
}

TEST(projection_with_a_clamped_end_conserves_energy) {
    scene_body body;
    tlsph_ledger l;
    DOUBLE_ONLY();
    REQUIRE_OK(column_create(TLSPH_PFHJ, TLSPH_ENERGY, TLSPH_MIE_GRUNEISEN, 0.45, &body));
    CHECK_RESULT(tlsph_advance(body.solver, R(0.1)), TLSPH_OK);
    tlsph_ledger_read(body.solver, &l);
    REPORT("residual %.1e of %.1e J, projection work %.1e J", l.energy_residual, l.kinetic_energy + l.strain_energy,
           l.projection_work);
    CHECK_CLOSE(l.energy_residual, 0, 1e-11 * fabs(l.total_energy));
    CHECK_CLOSE(l.external_work, 0, 1e-11 * fabs(l.total_energy)); /* the clamp does no work */
    scene_destroy(&body);
}

/* ---- energy with every kind of load ------------------------------------------------------------------------------ */

static void swing(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                  const tlsph_real *x, tlsph_real *values) {
    (void)user; (void)particle; (void)x;
    for (size_t i = 0; i < count; i++) {
        values[3 * i] = R(0.3 * sin(5 * (double)time) * (1 + (double)X[3 * i + 1]));
        values[3 * i + 1] = R(0.1 * (double)time);
        values[3 * i + 2] = 0;
    }
}

static void ramp_temperature(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                             const tlsph_real *x, tlsph_real *values) {
    (void)user; (void)particle; (void)x;
    for (size_t i = 0; i < count; i++) values[i] = R(293.15 + 30 * (double)time + 5 * (double)X[3 * i]);
}

static void add_all_loads(scene_setup *setup) {
    tlsph_condition *c = scene_add_plane(setup, TLSPH_VELOCITY, 0, 0);
    memset(c->normal, 0, sizeof c->normal); /* all three components */
    c->values = swing;
    c = scene_add_plane(setup, TLSPH_TRACTION, 0, 1);
    scene_share_area(setup, c, 1.5 * 0.75);
    memset(c->normal, 0, sizeof c->normal);
    c->value[0] = 800; c->value[1] = -300;
    c = scene_add_plane(setup, TLSPH_PRESSURE, 1, 1.5);
    c->value[0] = 500;
    c = scene_add(setup, TLSPH_ACCELERATION);
    c->value[2] = R(-9.81);
    c = scene_add_plane(setup, TLSPH_TEMPERATURE, 2, 0);
    c->values = ramp_temperature;
    c = scene_add_plane(setup, TLSPH_HEAT_FLUX, 2, 0.75);
    scene_share_area(setup, c, 1.5);
    c->value[0] = -2000; /* into the body */
    c = scene_add(setup, TLSPH_HEAT_SOURCE);
    c->value[0] = 3000;
}

static void all_loads(tlsph_unknowns unknowns, double *residual, double *scale) {
    const tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    const scene_options options = physics_options(unknowns, TLSPH_ENERGY);
    scene_setup setup;
    scene_body body;
    tlsph_ledger l;
    *residual = HUGE_VAL;
    box_begin(&setup, 4, 6, 3, &material);
    add_all_loads(&setup);
    REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
    CHECK_RESULT(tlsph_advance(body.solver, R(0.5)), TLSPH_OK);
    tlsph_ledger_read(body.solver, &l);
    *residual = l.energy_residual;
    *scale = fabs(l.external_work) + fabs(l.external_heat);
    CHECK(fabs(l.external_work) > 1);
    CHECK(fabs(l.external_heat) > 100);
    scene_destroy(&body);
}

TEST(energy_balance_with_all_loads) {
    double residual, scale;
    DOUBLE_ONLY();
    all_loads(TLSPH_PF, &residual, &scale);
    CHECK_CLOSE(residual, 0, 1e-11 * scale);
    all_loads(TLSPH_PFHJ, &residual, &scale);
    REPORT("residual %.1e J of %.1e J that went in", residual, scale);
    CHECK_CLOSE(residual, 0, 1e-11 * scale);
}

SUITE(physics_balances, ENTRY(twisting_column_pair_production_pF), ENTRY(slow_twisting_column_pair_production_pFHJ),
      ENTRY(twisting_column_pair_production_energy), ENTRY(twisting_column_pair_production_entropy),
      ENTRY(slow_twisting_column_pair_production_mee), ENTRY(reconstruction_without_limiter_breaks_the_inequality),
      ENTRY(l_block_pair_production_pF_energy),
      ENTRY(l_block_pair_production_pFHJ_energy), ENTRY(l_block_pair_production_pFHJ_entropy),
      ENTRY(projection_keeps_angular_momentum), ENTRY(projection_keeps_angular_momentum_of_each_body),
      ENTRY(projection_with_a_clamped_end_conserves_energy), ENTRY(energy_balance_with_all_loads))
