/* Plane strain: the swinging plate of references/README, exact in linear elasticity. */
#include "physics.h"

static swinging_plate_parameters parameters(int n, int sharp, int projection) {
    swinging_plate_parameters p;
    swinging_plate_default(&p);
    p.options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
    p.options.sharp = sharp;
    p.options.projection = projection;
    p.amplitude = 5e-4;
    p.poisson = 0.3;
    p.n = n;
    return p;
}

/* The formula against both tables of references/. */
static void check_table(const char *path, double poisson, double amplitude) {
    static table t;
    swinging_plate_parameters p = parameters(4, 0, 1);
    swinging_plate plate;
    p.poisson = poisson;
    p.amplitude = amplitude;
    REQUIRE_OK(swinging_plate_create(&p, &plate, NULL));
    if (!CHECK(table_read(&t, path) == 0)) { scene_destroy(&plate.body); return; }
    CHECK(t.rows >= 4);
    for (size_t i = 0; i < t.rows; i++) {
        const tlsph_real X[3] = {R(table_number(&t, i, "X")), R(table_number(&t, i, "Y")), 0};
        double u[3], v[3], F[9], P[9], expected[9];
        swinging_plate_exact(&plate, X, 0.002, u, v, F, P);
        CHECK_CLOSE(u[0], table_number(&t, i, "u1"), 1e1 * EPSILON * amplitude);
        CHECK_CLOSE(u[1], table_number(&t, i, "u2"), 1e1 * EPSILON * amplitude);
        CHECK_CLOSE(v[0], table_number(&t, i, "v1"), 1e1 * EPSILON * 200 * amplitude);
        CHECK_CLOSE(v[1], table_number(&t, i, "v2"), 1e1 * EPSILON * 200 * amplitude);
        table_tensor(&t, i, "F", "", expected);
        for (int j = 0; j < 9; j++) CHECK_CLOSE(F[j], expected[j], 2 * EPSILON);
        table_tensor(&t, i, "P", "", expected);
        for (int j = 0; j < 9; j++) CHECK_CLOSE(P[j], expected[j], 1e1 * EPSILON * 8e6 * amplitude);
    }
    free(t.text);
    scene_destroy(&plate.body);
}

TEST(swinging_plate_formula_is_that_of_the_tables) {
    check_table(REFERENCES "/swinging_plate_t0.002_nu0.3_U5e-4m.csv", 0.3, 5e-4);
    check_table(REFERENCES "/swinging_plate_t0.002_nu0.495_U0.01m.csv", 0.495, 0.01);
}

/* w t = 2.5, where neither velocity nor stress is small and an error of the frequency shows in both. */
static int plate_run(int n, int sharp, int projection, double *error_v, double *error_P) {
    const swinging_plate_parameters p = parameters(n, sharp, projection);
    swinging_plate plate;
    plate_errors errors;
    int ran;
    *error_v = *error_P = HUGE_VAL;
    if (!CHECK_RESULT(swinging_plate_create(&p, &plate, NULL), TLSPH_OK)) return 0;
    ran = CHECK_RESULT(tlsph_advance(plate.body.solver, R(2.5 / plate.omega)), TLSPH_OK);
    if (ran) {
        swinging_plate_errors(&plate, 0, &errors);
        *error_v = errors.velocity;
        *error_P = errors.stress;
    }
    scene_destroy(&plate.body);
    return ran;
}

static void check_order(int projection) {
    double v[3], P[3];
    for (int i = 0; i < 3; i++) REQUIRE(plate_run(8 << i, 0, projection, &v[i], &P[i]));
    REPORT("v %.1e %.1e %.1e order %.2f, P %.1e %.1e %.1e order %.2f", v[0], v[1], v[2], observed_order(v, 3), P[0],
           P[1], P[2], observed_order(P, 3));
    CHECK(observed_order(v, 3) >= 1.8);
    CHECK(observed_order(P, 3) >= 1.8);
    CHECK_BELOW(v[2], 0.005); /* a wrong frequency would not converge to zero */
    CHECK_BELOW(P[2], 0.007);
}

static void check_sharp(int projection) {
    double v[2], P[2];
    for (int sharp = 0; sharp < 2; sharp++) REQUIRE(plate_run(16, sharp, projection, &v[sharp], &P[sharp]));
    REPORT("v %.1e, sharp %.1e; P %.1e, sharp %.1e", v[0], v[1], P[0], P[1]);
    CHECK_BELOW(v[1], v[0] / 5);
    CHECK_BELOW(P[1], P[0] / 5);
}

/* This mode has angular momentum about the middle, which the swinging cube has not: what the projection takes for a rigid
   turn must not disturb the mirror rules at the rollers. Hence with and without projection. */
TEST(swinging_plate_is_second_order) {
    DOUBLE_ONLY();
    check_order(1);
}
TEST(swinging_plate_is_second_order_without_projection) {
    DOUBLE_ONLY();
    check_order(0);
}
TEST(swinging_plate_sharp_gradients_are_sharper) {
    DOUBLE_ONLY();
    check_sharp(1);
}
TEST(swinging_plate_sharp_gradients_are_sharper_without_projection) {
    DOUBLE_ONLY();
    check_sharp(0);
}

SUITE(physics_plate, ENTRY(swinging_plate_formula_is_that_of_the_tables), ENTRY(swinging_plate_is_second_order),
      ENTRY(swinging_plate_is_second_order_without_projection), ENTRY(swinging_plate_sharp_gradients_are_sharper),
      ENTRY(swinging_plate_sharp_gradients_are_sharper_without_projection))
