/* Time schemes: orders, balances to round-off, entropy, stability of small bodies, stage times of loads. */
#include "physics.h"

static const char *const scheme_name[5] = { "RK2", "SSP RK3", "RK3 frozen", "RK4 frozen", "leapfrog" };
static const double lively = 1.5; /* 1/s */

static tlsph_result lively_box(const scene_options *options, const tlsph_material *material, tlsph_condition_kind load,
                               scene_body *body) {
    scene_setup setup;
    tlsph_result result;
    box_begin(&setup, 4, 6, 3, material);
    if (load != TLSPH_CLAMPED) {
        tlsph_condition *push = scene_add_plane(&setup, load, 1, 0);
        push->value[0] = push->value[2] = 200;
    }
    result = scene_end(&setup, options, body, NULL);
    return result == TLSPH_OK ? scene_set_state(body, &lively, lively_state) : result;
}

/* ---- balances ---------------------------------------------------------------------------------------------------- */

/* 60 steps of a spinning body that stretches by 20 %: both momenta against the impulses of the loads, the energy in E. */
static void balance(int integrator, tlsph_unknowns unknowns, tlsph_thermal thermal, tlsph_condition_kind load) {
    const tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    scene_options options = physics_options(unknowns, thermal);
    double angular[3], linear[3], kinetic;
    tlsph_ledger l;
    scene_body body;
    options.integrator = integrator;
    REQUIRE_OK(lively_box(&options, &material, load, &body));
    tlsph_ledger_read(body.solver, &l);
    kinetic = l.kinetic_energy;
    REQUIRE_OK(fixed_steps(body.solver, 0.008, 60));
    tlsph_ledger_read(body.solver, &l);
    for (int i = 0; i < 3; i++) { angular[i] = l.angular_residual[i]; linear[i] = l.linear_residual[i]; }
    REPORT(" %s %s: angular %.0e, linear %.0e, energy %.0e", scheme_name[integrator],
           load == TLSPH_CLAMPED ? "free" : "pushed", length3(angular) / length3(l.angular_momentum),
           length3(linear) / length3(l.linear_momentum), l.energy_residual / kinetic);
    CHECK_BELOW(length3(angular), 1e-13 * length3(l.angular_momentum));
    CHECK_BELOW(length3(linear), 1e-13 * length3(l.linear_momentum));
    if (thermal == TLSPH_ENERGY && load == TLSPH_CLAMPED) CHECK_BELOW(fabs(l.energy_residual), 1e-12 * kinetic);
    scene_destroy(&body);
}

TEST(momenta_and_energy_of_every_scheme) {
    DOUBLE_ONLY();
    for (int integrator = 0; integrator < 5; integrator++) {
        balance(integrator, TLSPH_PFHJ, TLSPH_ENERGY, TLSPH_CLAMPED);
        balance(integrator, TLSPH_PF, TLSPH_ENTROPY, TLSPH_CLAMPED);
        balance(integrator, TLSPH_PF, TLSPH_ISOTHERMAL, TLSPH_TRACTION);
    }
}

/* The leapfrog knows the velocity of a whole step, so that also the work of loads, drives and walls closes the balance. */
TEST(work_on_the_leapfrog) {
    static const tlsph_condition_kind kind[6] = { TLSPH_TRACTION, TLSPH_PRESSURE, TLSPH_ACCELERATION, TLSPH_VELOCITY,
                                                  TLSPH_WALL, TLSPH_HEAT_FLUX };
    const tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    DOUBLE_ONLY();
    for (int i = 0; i < 6; i++) {
        scene_options options = physics_options(TLSPH_PFHJ, TLSPH_ENERGY);
        scene_setup setup;
        scene_body body;
        tlsph_ledger l;
        options.integrator = TLSPH_LEAPFROG;
        box_begin(&setup, 4, 6, 3, &material);
        tlsph_condition *push = scene_add_plane(&setup, kind[i], 1, 0);
        push->value[0] = push->value[2] = 300;
        if (kind[i] == TLSPH_VELOCITY) push->value[0] = push->value[2] = 0.5;
        if (kind[i] == TLSPH_WALL) push->normal[1] = 1;
        if (kind[i] == TLSPH_HEAT_FLUX) push->value[0] = -1e3;
        REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
        REQUIRE_OK(scene_set_state(&body, &lively, lively_state));
        REQUIRE_OK(fixed_steps(body.solver, 0.008, 60));
        tlsph_ledger_read(body.solver, &l);
        REPORT(" %.1g J: %.0e", l.external_work + l.external_heat + l.contact_loss, l.energy_residual / l.kinetic_energy);
        CHECK(fabs(l.external_work) + l.contact_loss + fabs(l.external_heat) > 1e-5 * l.kinetic_energy);
        CHECK_BELOW(fabs(l.energy_residual), 1e-12 * l.kinetic_energy);
        scene_destroy(&body);
    }
}

/* In the eta form the entropy grows by what the ledger books as made of dissipated work, to round-off. */
TEST(entropy_on_the_leapfrog) {
    const tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    scene_options options = physics_options(TLSPH_PFHJ, TLSPH_ENTROPY);
    scene_body body;
    tlsph_ledger l;
    DOUBLE_ONLY();
    options.integrator = TLSPH_LEAPFROG;
    REQUIRE_OK(lively_box(&options, &material, TLSPH_CLAMPED, &body));
    REQUIRE_OK(fixed_steps(body.solver, 0.008, 60));
    tlsph_ledger_read(body.solver, &l);
    CHECK(l.dissipation_entropy > 0);
    CHECK_BELOW(fabs(l.entropy_residual), 1e-10 * l.dissipation_entropy);
    scene_destroy(&body);
}

/* The same for linear elasticity, which takes moments about the reference positions. */
TEST(linear_material_in_every_scheme) {
    const tlsph_material material = scene_paper_material(TLSPH_LINEAR);
    DOUBLE_ONLY();
    for (int integrator = 0; integrator < 5; integrator++) {
        scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
        scene_body body;
        tlsph_ledger l;
        options.integrator = integrator;
        REQUIRE_OK(lively_box(&options, &material, TLSPH_CLAMPED, &body));
        REQUIRE_OK(fixed_steps(body.solver, 0.008, 20));
        tlsph_ledger_read(body.solver, &l);
        CHECK_BELOW(length3(l.angular_residual), 1e-13 * length3(l.angular_momentum));
        scene_destroy(&body);
    }
}

/* ---- entropy ----------------------------------------------------------------------------------------------------- */

/* What the scheme itself adds to the entropy beside the productions, and the dissipated work, against those of RK2 with a
   tenth of the step: the frozen schemes keep both within a few percent at the full step. */
TEST(entropy_of_frozen_dissipation) {
    const tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    double work[6], made[6];
    DOUBLE_ONLY();
    for (int run = 0; run < 6; run++) {
        scene_options options = physics_options(TLSPH_PFHJ, TLSPH_ENERGY);
        scene_body body;
        tlsph_ledger l;
        options.integrator = run % 5;
        options.audit = 1;
        REQUIRE_OK(lively_box(&options, &material, TLSPH_CLAMPED, &body));
        REQUIRE_OK(fixed_steps(body.solver, run < 5 ? 0.008 : 0.0008, run < 5 ? 50 : 500));
        tlsph_ledger_read(body.solver, &l);
        work[run] = l.dissipation;
        made[run] = l.dissipation_entropy + l.entropy_residual;
        CHECK(l.least_pair_production >= -1e-12);
        scene_destroy(&body);
    }
    for (int run = 0; run < 5; run++) {
        REPORT(" %s: work %+.1f %%, entropy %+.1f %%", scheme_name[run], 100 * (work[run] / work[5] - 1),
               100 * (made[run] / made[5] - 1));
        CHECK_CLOSE(work[run] / work[5], 1, 0.03);
        CHECK_CLOSE(made[run] / made[5], 1, 0.03);
    }
}

/* ---- order ------------------------------------------------------------------------------------------------------- */

/* Velocities at t = 0.4 s after `steps` steps, of a linear (or not) body without dissipation (or with frozen one). */
static tlsph_real *after(int integrator, tlsph_material_kind kind, tlsph_dissipation dissipation, int steps) {
    const tlsph_material material = scene_paper_material(kind);
    scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
    tlsph_real *v = NULL;
    scene_body body;
    options.integrator = integrator;
    options.dissipation = (int)dissipation;
    options.cfl = 1; /* the steps are fixed */
    if (lively_box(&options, &material, TLSPH_CLAMPED, &body)) return NULL;
    if (fixed_steps(body.solver, 0.4 / steps, steps) == TLSPH_OK) v = scene_read(body.solver, TLSPH_FIELD_VELOCITY);
    scene_destroy(&body);
    return v;
}

static double order_in_time(int integrator, tlsph_material_kind kind, tlsph_dissipation dissipation, int steps) {
    double error[2] = { 0, 0 };
    tlsph_real *exact = after(TLSPH_RK4_FROZEN, kind, dissipation, 8 * steps);
    for (int level = 0; level < 2 && exact; level++) {
        tlsph_real *v = after(integrator, kind, dissipation, steps << level);
        for (size_t i = 0; v && i < 3 * 5 * 7 * 4; i++) error[level] += pow((double)(v[i] - exact[i]), 2);
        free(v);
    }
    free(exact);
    return error[1] > 0 ? log2(error[0] / error[1]) / 2 : 0;
}

TEST(orders_in_time) {
    static const double linear[5] = { 2, 3, 3, 4, 2 }, nonlinear[5] = { 2, 3, 2, 2, 2 };
    DOUBLE_ONLY();
    for (int i = 0; i < 5; i++) {
        const double free_order = order_in_time(i, TLSPH_LINEAR, TLSPH_NO_DISSIPATION, 40);
        const double curved = order_in_time(i, TLSPH_NEO_HOOKEAN, TLSPH_NO_DISSIPATION, 40);
        REPORT(" %s: %.2f linear, %.2f nonlinear", scheme_name[i], free_order, curved);
        CHECK(free_order > linear[i] - 0.2);
        CHECK(curved > nonlinear[i] - 0.2);
    }
}

/* A force that grows with t^2: (002-30) with stages at 0, dt, dt/2 is Simpson's rule, exact up to t^3. As printed, with
   stages at 0, dt/3, dt/2 or so, it would not be. */
static void growing(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                    const tlsph_real *x, tlsph_real *values) {
    (void)user; (void)particle; (void)X; (void)x;
    for (size_t i = 0; i < count; i++) values[3 * i] = time * time;
}

TEST(loads_at_the_right_stage_times) {
    const tlsph_material material = scene_paper_material(TLSPH_NEO_HOOKEAN);
    DOUBLE_ONLY();
    for (int integrator = 0; integrator < 5; integrator++) {
        const int exact = integrator == TLSPH_SSP_RK3;
        scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
        scene_setup setup;
        scene_body body;
        double error[2];
        options.integrator = integrator;
        for (int level = 0; level < 2; level++) {
            tlsph_ledger l;
            box_begin(&setup, 2, 2, 2, &material);
            scene_add(&setup, TLSPH_ACCELERATION)->values = growing;
            REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
            REQUIRE_OK(fixed_steps(body.solver, 0.008 / (1 << level), 25 << level));
            tlsph_ledger_read(body.solver, &l);
            error[level] = fabs(l.linear_momentum[0] / l.mass / (pow(0.2, 3) / 3) - 1);
            scene_destroy(&body);
        }
        REPORT(" %s: %.1e, %.1e", scheme_name[integrator], error[0], error[1]);
        if (exact) CHECK_BELOW(error[0], 1e-12);
        else CHECK_CLOSE(log2(error[0] / error[1]), 2, 0.1);
    }
}

/* ---- stability --------------------------------------------------------------------------------------------------- */

static void noise(const void *scene, const tlsph_real X[3], scene_state *state) {
    (void)scene;
    for (int i = 0; i < 3; i++) /* sines of large arguments: as good as random, and the same everywhere */
        state->v[i] = 1e-3 * sin(1e3 * (double)X[i] + 2e3 * (double)X[(i + 1) % 3] + 3e3 * (double)X[(i + 2) % 3]);
}

/* Energy after 600 steps of a noisy linear body over that at the beginning. */
static double noise_gain(int integrator, double cfl) {
    const tlsph_material material = scene_paper_material(TLSPH_LINEAR);
    scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
    double first;
    tlsph_ledger l;
    scene_setup setup;
    scene_body body;
    options.integrator = integrator;
    options.cfl = cfl;
    box_begin(&setup, 4, 4, 4, &material);
    if (scene_end(&setup, &options, &body, NULL) || scene_set_state(&body, NULL, noise)) return HUGE_VAL;
    tlsph_ledger_read(body.solver, &l);
    first = l.total_energy;
    for (int i = 0; i < 600; i++)
        if (tlsph_step(body.solver, 1)) { first = 0; break; }
    tlsph_ledger_read(body.solver, &l);
    scene_destroy(&body);
    return first > 0 ? l.total_energy / first : HUGE_VAL;
}

/* Breathing of a body of two cells a side is a linear field, which the reconstruction leaves undamped: RK2 amplifies it
   at any CFL number, three stages damp it. Energy after 1500 steps over that at the beginning. */
static double two_cells(int integrator, double cfl) {
    const tlsph_material material = scene_paper_material(TLSPH_LINEAR);
    scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
    double gain = HUGE_VAL;
    tlsph_ledger l;
    scene_setup setup;
    scene_body body;
    options.integrator = integrator;
    options.cfl = cfl;
    box_begin(&setup, 2, 2, 2, &material);
    if (scene_end(&setup, &options, &body, NULL) || scene_set_state(&body, &lively, lively_state)) return HUGE_VAL;
    tlsph_ledger_read(body.solver, &l);
    gain = 1 / l.total_energy;
    if (fixed_steps(body.solver, 1, 1500)) gain = HUGE_VAL;
    tlsph_ledger_read(body.solver, &l);
    scene_destroy(&body);
    return gain * l.total_energy;
}

TEST(two_cells_are_stable_with_three_stages) {
    double gain[5];
    DOUBLE_ONLY();
    for (int i = 0; i < 5; i++) gain[i] = two_cells(i, 0.3);
    REPORT("energy RK2 %.1e, SSP RK3 %.2f, frozen %.2f, %.2f, leapfrog %.2f times", gain[0], gain[1], gain[2], gain[3],
           gain[4]);
    CHECK(gain[0] > 100);
    for (int i = 1; i < 4; i++) CHECK_BELOW(gain[i], 1);
    CHECK_CLOSE(gain[4], 1, 0.05);
}

/* Noise in a body of four cells a side, at the limit that the library states and well beyond it (RK2: with damping of the
   linear modes by time only, so that nothing is asked of it). */
TEST(limits_of_the_cfl_number) {
    DOUBLE_ONLY();
    for (int i = 1; i < 5; i++) {
        const double limit = (double)tlsph_cfl_limit((tlsph_integrator)i);
        CHECK_BELOW(noise_gain(i, limit), 1);
        CHECK(noise_gain(i, fmin(1, 1.7 * limit)) > 1);
    }
    CHECK((double)tlsph_cfl_limit(TLSPH_RK2) > 0.3);
    CHECK(!((double)tlsph_cfl_limit((tlsph_integrator)5) > 0));
}

SUITE(physics_integrators, ENTRY(limits_of_the_cfl_number), ENTRY(momenta_and_energy_of_every_scheme), ENTRY(work_on_the_leapfrog), ENTRY(entropy_on_the_leapfrog),
      ENTRY(linear_material_in_every_scheme),
      ENTRY(entropy_of_frozen_dissipation), ENTRY(orders_in_time), ENTRY(loads_at_the_right_stage_times),
      ENTRY(two_cells_are_stable_with_three_stages))
