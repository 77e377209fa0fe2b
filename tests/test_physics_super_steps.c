/* Conduction in stages of its own (SUPER-STEPS): balances, entropy, exact solutions, refusals. */
#include "physics.h"
#include "support.h"

typedef struct warm_block {
    scene_options options;
    tlsph_material material;
    double speed;
    tlsph_condition_kind load;
    double jitter; /* > 0: an irregular cloud with corrected kernels */
    int rollers;   /* 1: on the lattice's faces Y = 0 */
} warm_block;

static warm_block warm_default(tlsph_thermal thermal, double conductivity, int stages) {
    warm_block w;
    memset(&w, 0, sizeof w);
    w.options = physics_options(TLSPH_PF, thermal);
    w.options.conduction_stages = stages;
    w.material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    w.material.conductivity = R(conductivity);
    w.speed = 0.3;
    w.load = TLSPH_CLAMPED; /* none */
    return w;
}

/* Rough temperatures, so that conduction has much to do. */
static void rough_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double x = (double)X[0], y = (double)X[1], z = (double)X[2];
    lively_state(scene, X, state);
    state->theta += 100 * sin(40 * x + 3) * sin(35 * y + 1) * cos(28 * z);
}

static tlsph_result warm_create(const warm_block *w, scene_body *body) {
    scene_setup setup;
    tlsph_result result;
    if (w->jitter > 0) {
        tlsph_fill fill = tlsph_fill_default(3);
        fill.spacing = R(0.25);
        fill.size[0] = fill.size[1] = fill.size[2] = 1;
        fill.jitter = R(w->jitter);
        scene_begin(&setup, &fill, &w->material, NULL);
    } else box_begin(&setup, 5, 4, 3, &w->material);
    if (w->rollers) scene_add_rollers(&setup, 1);
    if (w->load != TLSPH_CLAMPED) {
        tlsph_condition *c = scene_add(&setup, w->load);
        c->value[0] = w->load == TLSPH_TEMPERATURE ? 350 : w->load == TLSPH_HEAT_SOURCE ? R(2e5) : 0;
        if (w->load == TLSPH_TEMPERATURE) {
            setup.condition_count--;
            c = scene_add_plane(&setup, TLSPH_TEMPERATURE, 0, 0);
            c->value[0] = 350;
        }
    }
    result = scene_end(&setup, &w->options, body, NULL);
    if (result == TLSPH_OK) result = scene_set_state(body, &w->speed, rough_state);
    return result;
}

/* Conserved to round-off, entropy made in every step, longer steps than conduction allows. */
static void balances(tlsph_thermal thermal, tlsph_condition_kind load, double jitter) {
    warm_block w = warm_default(thermal, 2e4, 15);
    scene_body body, plain;
    tlsph_ledger before, now;
    double scale;
    w.load = load;
    w.jitter = jitter;
    w.options.support = jitter > 0 ? 0.9 : w.options.support;
    REQUIRE_OK(warm_create(&w, &body));
    w.options.conduction_stages = 0;
    REQUIRE_OK(warm_create(&w, &plain));
    CHECK(tlsph_stable_time_step(body.solver) > 8 * tlsph_stable_time_step(plain.solver));
    tlsph_ledger_read(body.solver, &before);
    scale = fabs(before.thermal_energy) + 100 * before.mass; /* 100 K of c_v = 1 J/(kg K) */
    for (int i = 0; i < 15; i++) {
        REQUIRE_OK(tlsph_step(body.solver, 1));
        tlsph_ledger_read(body.solver, &now);
        /* E and eta are stored rounded, in every one of some ten stages */
        CHECK(now.conduction_entropy - before.conduction_entropy > -10 * EPSILON * scale / now.temperature_least);
        if (thermal == TLSPH_ENERGY) CHECK_BELOW(fabs(now.energy_residual), 100 * EPSILON * scale);
        for (int k = 0; k < 3; k++) CHECK_BELOW(fabs(now.linear_residual[k]), 1000 * EPSILON * now.mass * w.speed);
        before = now;
    }
    CHECK(now.temperature_largest - now.temperature_least < 60);
    REPORT("energy %.1e, entropy %.1e of %.1e", now.energy_residual / scale, now.entropy_residual,
           now.conduction_entropy);
    scene_destroy(&body);
    scene_destroy(&plain);
}

TEST(balances_energy_form) { balances(TLSPH_ENERGY, TLSPH_CLAMPED, 0); }
TEST(balances_entropy_form) { balances(TLSPH_ENTROPY, TLSPH_CLAMPED, 0); }
TEST(balances_with_held_temperature) { balances(TLSPH_ENERGY, TLSPH_TEMPERATURE, 0); }
TEST(balances_on_a_cloud) { balances(TLSPH_ENERGY, TLSPH_CLAMPED, 0.2); }
TEST(balances_with_source) { balances(TLSPH_ENERGY, TLSPH_HEAT_SOURCE, 0); }

/* Stages by tiles and, with `audit`, pair by pair: temperatures differ by round-off only, and so does the entropy. */
static double compare_with_pairs(warm_block w) {
    tlsph_real *theta[2], dt = 0;
    tlsph_ledger ledger[2];
    double most = 0;
    for (int i = 0; i < 2; i++) {
        scene_body body;
        w.options.audit = i;
        if (!CHECK_RESULT(warm_create(&w, &body), TLSPH_OK)) return 0;
        if (i == 0) dt = R(0.9) * tlsph_stable_time_step(body.solver); /* one for both, see BOUNDED */
        for (int k = 0; k < 3; k++) CHECK_RESULT(tlsph_step(body.solver, dt), TLSPH_OK);
        theta[i] = scene_read(body.solver, TLSPH_FIELD_TEMPERATURE);
        tlsph_ledger_read(body.solver, ledger + i);
        if (!CHECK(theta[i] != NULL)) return 0;
        for (size_t a = 0; i && a < tlsph_count(body.solver); a++)
            most = fmax(most, fabs((double)(theta[1][a] - theta[0][a])));
        scene_destroy(&body);
    }
    CHECK(ledger[0].conduction_entropy > 0);
    CHECK_CLOSE(ledger[0].conduction_entropy, ledger[1].conduction_entropy, 1e6 * EPSILON * ledger[0].conduction_entropy);
    if (!CHECK(most < 1e4 * EPSILON * 300))
        printf("    unknowns %d, thermal %d, conduction %d, jitter %g, rollers %d: %.1e K\n", w.options.unknowns,
               w.options.thermal, w.options.conduction, w.jitter, w.rollers, most);
    free(theta[0]);
    free(theta[1]);
    return most;
}
TEST(tiles_and_pairs_agree) {
    double most = 0;
    for (int i = 0; i < 16; i++) {
        warm_block w = warm_default(i & 1 ? TLSPH_ENTROPY : TLSPH_ENERGY, 2e4, 9);
        w.options.unknowns = i & 2 ? TLSPH_PFJ : TLSPH_PF;
        w.options.conduction = i & 4 ? TLSPH_DOUBLE_GRADIENT : TLSPH_COMPACT;
        w.jitter = i & 8 ? 0.2 : 0;
        w.options.support = i & 8 ? 0.9 : w.options.support;
        w.rollers = i % 3 == 0 && !(i & 8);
        most = fmax(most, compare_with_pairs(w));
    }
    REPORT("%.1e K", most);
}

/* The same temperatures as without, and both thermal forms agree. */
TEST(agrees_with_small_steps) {
    tlsph_real *theta[3];
    double change = 0, most[2] = { 0, 0 };
    DOUBLE_ONLY();
    for (int i = 0; i < 3; i++) {
        warm_block w = warm_default(i == 2 ? TLSPH_ENTROPY : TLSPH_ENERGY, 2e4, i == 0 ? 0 : 15);
        scene_body body;
        REQUIRE_OK(warm_create(&w, &body));
        REQUIRE_OK(tlsph_advance(body.solver, R(0.04)));
        theta[i] = scene_read(body.solver, TLSPH_FIELD_TEMPERATURE);
        REQUIRE(theta[i] != NULL);
        for (size_t a = 0; a < tlsph_count(body.solver); a++) {
            change = fmax(change, fabs((double)theta[0][a] - 293.15));
            for (int k = 0; k < i; k++) most[k] = fmax(most[k], fabs((double)(theta[i][a] - theta[k][a])));
        }
        scene_destroy(&body);
    }
    REPORT("differences %.2e, %.2e K of %.1f K", most[0], most[1], change);
    CHECK_BELOW(most[0], 0.02 * change);
    CHECK_BELOW(most[1], 0.01 * change);
    for (int i = 0; i < 3; i++) free(theta[i]);
}

/* Where conduction is slower than sound nothing changes, to the bit. */
TEST(off_where_sound_limits) {
    uint64_t hash[2];
    for (int i = 0; i < 2; i++) {
        warm_block w = warm_default(TLSPH_ENERGY, 10, 9 * i);
        scene_body body;
        REQUIRE_OK(warm_create(&w, &body));
        for (int k = 0; k < 5; k++) REQUIRE_OK(tlsph_step(body.solver, 1));
        hash[i] = state_hash(body.solver);
        scene_destroy(&body);
    }
    CHECK(hash[0] == hash[1]);
}

TEST(threads_and_checkpoints_change_nothing) {
    uint64_t hash[3];
    for (int i = 0; i < 3; i++) {
        warm_block w = warm_default(TLSPH_ENERGY, 2e4, 9);
        scene_body body;
        w.load = TLSPH_TEMPERATURE;
        w.options.threads = i == 1 ? 3 : 1;
        REQUIRE_OK(warm_create(&w, &body));
        for (int k = 0; k < 6; k++) {
            REQUIRE_OK(tlsph_step(body.solver, 1));
            if (i < 2 || k != 2) continue; /* the third run goes on from a checkpoint */
            size_t size;
            unsigned char *saved = save_state(body.solver, &size);
            REQUIRE(saved != NULL);
            scene_destroy(&body);
            REQUIRE_OK(warm_create(&w, &body));
            REQUIRE_OK(tlsph_restore(body.solver, saved, size));
            free(saved);
        }
        hash[i] = state_hash(body.solver);
        scene_destroy(&body);
    }
    CHECK(hash[0] == hash[1]);
    CHECK(hash[0] == hash[2]);
}

/* Steady heat flow through a bar is linear, but for (h theta'/theta)^2/2 of it from the flux Q theta_b/theta_a. */
TEST(steady_flow_is_linear) {
    scene_options options = physics_options(TLSPH_PF, TLSPH_ENERGY);
    tlsph_material material = scene_paper_material(TLSPH_LINEAR);
    scene_setup setup;
    scene_body body;
    tlsph_condition *flux;
    tlsph_real *theta;
    DOUBLE_ONLY();
    material.conductivity = 20000;
    material.expansion = 0;
    options.conduction_stages = 15;
    box_begin(&setup, 8, 1, 1, &material);
    scene_add_rollers(&setup, 1);
    scene_add_rollers(&setup, 2);
    scene_add_plane(&setup, TLSPH_TEMPERATURE, 0, 0)->value[0] = 300;
    flux = scene_add_plane(&setup, TLSPH_HEAT_FLUX, 0, 2);
    flux->value[0] = 50000; /* W/m^2 leave: 2.5 K/m */
    scene_share_area(&setup, flux, 0.0625);
    REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
    REQUIRE_OK(tlsph_advance(body.solver, 3)); /* several times L^2 c_v/(h pi^2/4) */
    theta = scene_read(body.solver, TLSPH_FIELD_TEMPERATURE);
    REQUIRE(theta != NULL);
    for (size_t a = 0; a < body.cloud.particles.count; a++)
        CHECK_CLOSE(theta[a], 300 - 2.5 * (double)body.cloud.particles.positions[3 * a], 2e-5);
    free(theta);
    scene_destroy(&body);
}

TEST(failed_step_leaves_the_last_good_state) {
    for (int i = 0; i < 2; i++) {
        warm_block w = warm_default(i ? TLSPH_ENTROPY : TLSPH_ENERGY, 2e4, 9);
        scene_setup setup;
        scene_body body;
        uint64_t hash;
        box_begin(&setup, 4, 3, 3, &w.material);
        scene_add(&setup, TLSPH_HEAT_SOURCE)->value[0] = R(-1e9); /* freezes everything in a step */
        REQUIRE_OK(scene_end(&setup, &w.options, &body, NULL));
        hash = state_hash(body.solver);
        CHECK(tlsph_step(body.solver, 1) != TLSPH_OK);
        CHECK(state_hash(body.solver) == hash);
        CHECK(tlsph_step_count(body.solver) == 0);
        scene_destroy(&body);
    }
}

TEST(too_few_stages_are_refused) {
    warm_block w = warm_default(TLSPH_ENERGY, 2e4, 2);
    scene_body body;
    CHECK_RESULT(warm_create(&w, &body), TLSPH_ERROR_DESCRIPTION);
}

/* The splitting is of second order for resolved waves, here where conduction is as fast as the wave. */
TEST(standing_wave_second_order) {
    double u[3] = { 0 }, theta[3] = { 0 };
    DOUBLE_ONLY();
    for (int i = 0; i < 3; i++) {
        standing_wave_parameters p;
        standing_wave wave;
        standing_wave_default(&p);
        p.dimension = 2;
        p.across = 1;
        p.n = 32 << i;
        p.options.conduction_stages = 15;
        REQUIRE_OK(standing_wave_create(&p, &wave, NULL));
        for (int k = 1; k <= 5; k++) {
            double error_u, error_theta;
            REQUIRE_OK(tlsph_advance(wave.body.solver, R(0.2 * k * 2 * SCENE_PI / wave.s[1])));
            standing_wave_errors(&wave, &error_u, &error_theta);
            u[i] = fmax(u[i], error_u);
            theta[i] = fmax(theta[i], error_theta);
        }
        scene_destroy(&wave.body);
    }
    REPORT("u %.1e %.1e %.1e, theta %.1e %.1e %.1e", u[0], u[1], u[2], theta[0], theta[1], theta[2]);
    CHECK(observed_order(u, 3) > 1.7);
    CHECK(observed_order(theta, 3) > 1.8);
}

SUITE(physics_super_steps, ENTRY(balances_energy_form), ENTRY(balances_entropy_form),
      ENTRY(balances_with_held_temperature), ENTRY(balances_with_source), ENTRY(balances_on_a_cloud),
      ENTRY(tiles_and_pairs_agree), ENTRY(agrees_with_small_steps),
      ENTRY(off_where_sound_limits), ENTRY(threads_and_checkpoints_change_nothing), ENTRY(steady_flow_is_linear),
      ENTRY(failed_step_leaves_the_last_good_state), ENTRY(too_few_stages_are_refused),
      ENTRY(standing_wave_second_order))
