/* Conduction alone, against exact solutions: spots in resting, stretched and turning bodies, a cosine mode, and the
   odd-even state that only the compact flux removes. */
#include "physics.h"

static double run_error(const conduction_parameters *p) {
    conducting_body body;
    double error;
    if (!CHECK_RESULT(conduction_create(p, &body, NULL), TLSPH_OK)) return HUGE_VAL;
    CHECK_RESULT(tlsph_advance(body.body.solver, R(p->options.end_time)), TLSPH_OK);
    error = conduction_error(&body);
    scene_destroy(&body.body);
    return error;
}

static void second_order(int dimension, conduction_motion motion, conduction_state state, tlsph_thermal thermal, int n,
                         int scheme) {
    conduction_parameters p;
    double e[3];
    DOUBLE_ONLY();
    conduction_default(&p);
    p.dimension = dimension;
    p.motion = motion;
    p.state = state;
    p.options.thermal = (int)thermal;
    p.options.conduction = scheme;
    if (state == CONDUCTION_MODE) p.options.end_time = 0.2; /* what the faces do wrong at first must spread */
    for (int i = 0; i < 3; i++) {
        p.n = n << i;
        e[i] = run_error(&p);
    }
    REPORT("%.2e %.2e %.2e order %.2f", e[0], e[1], e[2], observed_order(e, 3));
    CHECK(observed_order(e, 3) >= 1.9);
    CHECK_BELOW(e[2], 0.01);
}

TEST(spot_at_rest) { second_order(2, CONDUCTION_RESTING, CONDUCTION_SPOT, TLSPH_ENERGY, 16, TLSPH_COMPACT); }
TEST(spot_at_rest_entropy_form) {
    second_order(2, CONDUCTION_RESTING, CONDUCTION_SPOT, TLSPH_ENTROPY, 16, TLSPH_COMPACT);
}
TEST(spot_at_rest_double_gradient) {
    second_order(2, CONDUCTION_RESTING, CONDUCTION_SPOT, TLSPH_ENERGY, 16, TLSPH_DOUBLE_GRADIENT);
}
TEST(spot_in_a_stretched_body) {
    second_order(2, CONDUCTION_STRETCHED, CONDUCTION_SPOT, TLSPH_ENERGY, 16, TLSPH_COMPACT);
}
TEST(spot_in_a_stretched_body_entropy_form) {
    second_order(2, CONDUCTION_STRETCHED, CONDUCTION_SPOT, TLSPH_ENTROPY, 16, TLSPH_COMPACT);
}
TEST(spot_in_a_turning_body) { second_order(2, CONDUCTION_TURNING, CONDUCTION_SPOT, TLSPH_ENERGY, 16, TLSPH_COMPACT); }
TEST(mode_at_rest) { second_order(2, CONDUCTION_RESTING, CONDUCTION_MODE, TLSPH_ENERGY, 8, TLSPH_COMPACT); }
TEST(mode_in_a_stretched_body) {
    second_order(2, CONDUCTION_STRETCHED, CONDUCTION_MODE, TLSPH_ENERGY, 8, TLSPH_COMPACT);
}
TEST(slow_spot_in_a_stretched_body_in_space) {
    second_order(3, CONDUCTION_STRETCHED, CONDUCTION_SPOT, TLSPH_ENERGY, 12, TLSPH_COMPACT);
}

/* In a cloud some pair vectors are nearly perpendicular to the pair: with k = h/J |c|^2/(C.d) this one explodes. */
TEST(spot_in_a_cloud) {
    conduction_parameters p;
    double error;
    DOUBLE_ONLY();
    conduction_default(&p);
    p.dimension = 3;
    p.n = 10;
    p.jitter = 0.3;
    error = run_error(&p);
    REPORT("%.2e", error);
    CHECK_BELOW(error, 0.15);
}

static void cloud_order(conduction_motion motion) {
    conduction_parameters p;
    double e[3];
    DOUBLE_ONLY();
    conduction_default(&p);
    p.motion = motion;
    p.jitter = 0.2;
    for (int i = 0; i < 3; i++) {
        p.n = 16 << i;
        e[i] = run_error(&p);
    }
    REPORT("%.2e %.2e %.2e order %.2f", e[0], e[1], e[2], observed_order(e, 3));
    CHECK(observed_order(e, 3) >= 1.6);
}
TEST(spot_in_a_cloud_order) { cloud_order(CONDUCTION_RESTING); }
TEST(slow_spot_in_a_stretched_cloud_order) { cloud_order(CONDUCTION_STRETCHED); }

/* The amplitude after ten decay times 1/(dimension 4 D/h^2) of the two-point flux. */
static double alternating_left(int scheme, tlsph_thermal thermal, conduction_motion motion) {
    conduction_parameters p;
    conducting_body body;
    double left;
    conduction_default(&p);
    p.n = 16;
    p.state = CONDUCTION_ALTERNATING;
    p.motion = motion;
    p.amplitude = 10;
    p.options.conduction = scheme;
    p.options.thermal = (int)thermal;
    if (!CHECK_RESULT(conduction_create(&p, &body, NULL), TLSPH_OK)) return 1;
    CHECK_RESULT(tlsph_advance(body.body.solver, R(10 / (2 * 4 * 0.1 * 256))), TLSPH_OK);
    left = conduction_amplitude(&body);
    scene_destroy(&body.body);
    return left;
}

TEST(alternating_temperatures_fall_with_the_compact_flux_only) {
    DOUBLE_ONLY();
    for (int motion = CONDUCTION_RESTING; motion <= CONDUCTION_STRETCHED; motion++)
        for (int thermal = TLSPH_ENERGY; thermal <= TLSPH_ENTROPY; thermal++) {
            CHECK_BELOW(fabs(alternating_left(TLSPH_COMPACT, (tlsph_thermal)thermal, (conduction_motion)motion)), 0.02);
            CHECK(alternating_left(TLSPH_DOUBLE_GRADIENT, (tlsph_thermal)thermal, (conduction_motion)motion) > 0.9);
        }
    REPORT("left at rest: compact %.1e, double gradient %.4f",
           alternating_left(TLSPH_COMPACT, TLSPH_ENERGY, CONDUCTION_RESTING),
           alternating_left(TLSPH_DOUBLE_GRADIENT, TLSPH_ENERGY, CONDUCTION_RESTING));
}

SUITE(physics_conduction, ENTRY(spot_at_rest), ENTRY(spot_at_rest_entropy_form), ENTRY(spot_at_rest_double_gradient),
      ENTRY(spot_in_a_stretched_body), ENTRY(spot_in_a_stretched_body_entropy_form), ENTRY(spot_in_a_turning_body),
      ENTRY(mode_at_rest), ENTRY(mode_in_a_stretched_body), ENTRY(slow_spot_in_a_stretched_body_in_space),
      ENTRY(spot_in_a_cloud), ENTRY(spot_in_a_cloud_order), ENTRY(slow_spot_in_a_stretched_cloud_order),
      ENTRY(alternating_temperatures_fall_with_the_compact_flux_only))
