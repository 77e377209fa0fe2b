/* Plane strain: the swinging plate of references/README, exact in linear elasticity. */
#include "physics.h"

/* [0,2]^2 with rollers on all four sides: u = U sin(w t) {-sin(pi X/2) cos(pi Y/2), cos(pi X/2) sin(pi Y/2)}. The mode has
   no divergence, so that only the shear speed enters: w = (pi/2) sqrt(2 mu/rho). */
typedef struct plate {
    scene_body body;
    double amplitude, omega, shear;
} plate;

static tlsph_material plate_material(void) {
    tlsph_material m = tlsph_material_default(TLSPH_LINEAR);
    m.young = R(17e6);
    m.poisson = R(0.3);
    m.density = 1100;
    return m;
}

static void plate_constants(plate *p) {
    double p_wave, bulk;
    scene_moduli(&p->body.material, &p_wave, &bulk, &p->shear);
    p->omega = SCENE_PI / 2 * sqrt(2 * p->shear / (double)p->body.material.density);
}

static void plate_exact(const plate *p, const tlsph_real X[3], double t, double u[3], double v[3], double F[9],
                        double P[9]) {
    const double q = SCENE_PI / 2, U = p->amplitude * sin(p->omega * t),
                 rate = p->amplitude * p->omega * cos(p->omega * t);
    const double sx = sin(q * (double)X[0]), cx = cos(q * (double)X[0]), sy = sin(q * (double)X[1]),
                 cy = cos(q * (double)X[1]);
    const double shape[3] = {-sx * cy, cx * sy, 0};
    const double slope[9] = {-q * cx * cy, q * sx * sy, 0, -q * sx * sy, q * cx * cy, 0, 0, 0, 0};
    for (int i = 0; i < 3; i++) {
        u[i] = U * shape[i];
        v[i] = rate * shape[i];
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            F[3 * i + j] = (i == j) + U * slope[3 * i + j];
            P[3 * i + j] = p->shear * U * (slope[3 * i + j] + slope[3 * j + i]); /* no trace */
        }
}

TEST(swinging_plate_formula_is_that_of_the_table) {
    static table t;
    plate p;
    memset(&p, 0, sizeof p);
    p.body.material = plate_material();
    p.amplitude = 5e-4;
    plate_constants(&p);
    REQUIRE(table_read(&t, REFERENCES "/swinging_plate_t0.002_nu0.3_U5e-4m.csv") == 0);
    CHECK(t.rows >= 50);
    for (size_t i = 0; i < t.rows; i++) {
        const tlsph_real X[3] = {R(table_number(&t, i, "X")), R(table_number(&t, i, "Y")), 0};
        double u[3], v[3], F[9], P[9], expected[9];
        plate_exact(&p, X, 0.002, u, v, F, P);
        CHECK_CLOSE(u[0], table_number(&t, i, "u1"), 1e1 * EPSILON * 5e-4);
        CHECK_CLOSE(u[1], table_number(&t, i, "u2"), 1e1 * EPSILON * 5e-4);
        CHECK_CLOSE(v[0], table_number(&t, i, "v1"), 1e1 * EPSILON * 0.1);
        CHECK_CLOSE(v[1], table_number(&t, i, "v2"), 1e1 * EPSILON * 0.1);
        table_tensor(&t, i, "F", "", expected);
        for (int j = 0; j < 9; j++) CHECK_CLOSE(F[j], expected[j], 2 * EPSILON);
        table_tensor(&t, i, "P", "", expected);
        for (int j = 0; j < 9; j++) CHECK_CLOSE(P[j], expected[j], 1e1 * EPSILON * 4e3);
    }
    free(t.text);
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    double u[3], P[9];
    plate_exact(scene, X, 0, u, state->v, state->F, P);
}

static tlsph_result plate_create(plate *p, int n, int sharp, int projection) {
    const tlsph_material material = plate_material();
    scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
    tlsph_fill fill = tlsph_fill_default(2);
    scene_setup setup;
    tlsph_result result;
    memset(p, 0, sizeof *p);
    options.sharp = sharp;
    options.projection = projection;
    fill.size[0] = fill.size[1] = 2;
    fill.spacing = R(2.0 / n);
    scene_begin(&setup, &fill, &material, NULL);
    for (int axis = 0; axis < 2; axis++) scene_add_rollers(&setup, axis);
    result = scene_end(&setup, &options, &p->body, NULL);
    if (result != TLSPH_OK) return result;
    p->amplitude = 5e-4;
    plate_constants(p);
    return scene_set_state(&p->body, p, initial_state);
}

/* Relative L2 errors over all particles and components of velocity and stress. */
static void plate_errors(const plate *p, double *error_v, double *error_P) {
    const double t = (double)tlsph_time(p->body.solver);
    tlsph_real *velocity = scene_read(p->body.solver, TLSPH_FIELD_VELOCITY);
    tlsph_real *stress = scene_read(p->body.solver, TLSPH_FIELD_STRESS);
    double off_v = 0, all_v = 0, off_P = 0, all_P = 0;
    for (size_t a = 0; velocity && stress && a < tlsph_count(p->body.solver); a++) {
        double u[3], v[3], F[9], P[9];
        plate_exact(p, p->body.cloud.particles.positions + 3 * a, t, u, v, F, P);
        for (size_t i = 0; i < 3; i++) {
            off_v += pow((double)velocity[3 * a + i] - v[i], 2);
            all_v += v[i] * v[i];
        }
        for (size_t i = 0; i < 9; i++) {
            off_P += pow((double)stress[9 * a + i] - P[i], 2);
            all_P += P[i] * P[i];
        }
    }
    free(velocity);
    free(stress);
    *error_v = all_v > 0 ? sqrt(off_v / all_v) : HUGE_VAL;
    *error_P = all_P > 0 ? sqrt(off_P / all_P) : HUGE_VAL;
}

/* w t = 2.5, where neither velocity nor stress is small and an error of the frequency shows in both. */
static int plate_run(int n, int sharp, int projection, double *error_v, double *error_P) {
    plate p;
    int ran;
    *error_v = *error_P = HUGE_VAL;
    ran = CHECK_RESULT(plate_create(&p, n, sharp, projection), TLSPH_OK);
    if (ran) ran = CHECK_RESULT(tlsph_advance(p.body.solver, R(2.5 / p.omega)), TLSPH_OK);
    if (ran) plate_errors(&p, error_v, error_P);
    scene_destroy(&p.body);
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

SUITE(physics_plate, ENTRY(swinging_plate_formula_is_that_of_the_table), ENTRY(swinging_plate_is_second_order),
      ENTRY(swinging_plate_is_second_order_without_projection), ENTRY(swinging_plate_sharp_gradients_are_sharper),
      ENTRY(swinging_plate_sharp_gradients_are_sharper_without_projection))
