/* pulsating_rotation.c - homogeneous rotation with pulsating stretch: rotation_with_pulsating_stretch.csv. */
#include "scenes.h"

#include <math.h>
#include <string.h>

static const double start_temperature = 310; /* K */

void pulsating_rotation_default(pulsating_rotation_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.thermal = TLSPH_ENERGY;
    p->options.end_time = 0.5; /* last row of the table */
    p->n = 4;
    p->hold_surface = 1;
    p->material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    p->material.conductivity = 0;
}

/* The three stretches U with their first and second derivatives. */
static void stretches(double t, double U[3], double rate[3], double second[3]) {
    U[0] = 1 + 0.2 * sin(3 * t);          rate[0] = 0.6 * cos(3 * t);   second[0] = -1.8 * sin(3 * t);
    U[1] = 1 + 0.1 * (1 - cos(4 * t));    rate[1] = 0.4 * sin(4 * t);   second[1] = 1.6 * cos(4 * t);
    U[2] = 1 - 0.15 * sin(2 * t);         rate[2] = -0.3 * cos(2 * t);  second[2] = 0.6 * sin(2 * t);
}

/* With R' = w S R, S = e_z x:  F' = R U' + w S R U,  F'' = R (U'' - w^2 U) + 2 w S R U' in the plane of rotation. */
void pulsating_rotation_exact(double t, double F[9], double rate[9], double second[9]) {
    const double w = 2 * SCENE_PI, c = cos(w * t), s = sin(w * t);
    double U[3], dU[3], ddU[3];
    stretches(t, U, dU, ddU);
    memset(F, 0, 9 * sizeof *F);
    memset(rate, 0, 9 * sizeof *rate);
    memset(second, 0, 9 * sizeof *second);
    for (int i = 0; i < 2; i++) {
        const double r[2] = { i == 0 ? c : -s, i == 0 ? s : c };   /* column i of R */
        const double q[2] = { i == 0 ? -s : -c, i == 0 ? c : -s }; /* column i of S R */
        for (int j = 0; j < 2; j++) {
            F[3 * j + i] = r[j] * U[i];
            rate[3 * j + i] = r[j] * dU[i] + w * q[j] * U[i];
            second[3 * j + i] = r[j] * (ddU[i] - w * w * U[i]) + 2 * w * q[j] * dU[i];
        }
    }
    F[8] = U[2]; rate[8] = dU[2]; second[8] = ddU[2];
}

static void multiply(const double A[9], const tlsph_real X[3], double out[3]) {
    for (int i = 0; i < 3; i++)
        out[i] = A[3 * i] * (double)X[0] + A[3 * i + 1] * (double)X[1] + A[3 * i + 2] * (double)X[2];
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    double F[9], rate[9], second[9];
    (void)scene;
    pulsating_rotation_exact(0, F, rate, second);
    memcpy(state->F, F, sizeof F);
    multiply(F, X, state->x);
    multiply(rate, X, state->v);
    state->theta = start_temperature;
}

static void exact_velocity(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                           const tlsph_real *x, tlsph_real *values) {
    double F[9], rate[9], second[9], v[3];
    (void)user; (void)particle; (void)x;
    pulsating_rotation_exact((double)time, F, rate, second);
    for (size_t i = 0; i < count; i++) {
        multiply(rate, X + 3 * i, v);
        for (size_t j = 0; j < 3; j++) values[3 * i + j] = (tlsph_real)v[j];
    }
}

static void inertia(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                    const tlsph_real *x, tlsph_real *values) {
    const double rho = (double)((const pulsating_rotation *)user)->parameters.material.density;
    double F[9], rate[9], second[9], a[3];
    (void)particle; (void)x;
    pulsating_rotation_exact((double)time, F, rate, second);
    for (size_t i = 0; i < count; i++) {
        multiply(second, X + 3 * i, a);
        for (size_t j = 0; j < 3; j++) values[3 * i + j] = (tlsph_real)(rho * a[j]);
    }
}

static int on_surface(void *user, const tlsph_real X[3]) {
    const double tolerance = 1e-3 / ((const pulsating_rotation *)user)->parameters.n;
    for (int i = 0; i < 3; i++) if (fabs(fabs((double)X[i]) - 0.5) < tolerance) return 1;
    return 0;
}

tlsph_result pulsating_rotation_create(const pulsating_rotation_parameters *p, pulsating_rotation *out,
                                       tlsph_error *error) {
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_condition *condition;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    for (int i = 0; i < 3; i++) { fill.origin[i] = (tlsph_real)-0.5; fill.size[i] = 1; }
    fill.spacing = (tlsph_real)(1.0 / p->n);
    scene_begin(&setup, &fill, &p->material, error);
    condition = scene_add(&setup, TLSPH_BODY_FORCE);
    condition->values = inertia;
    condition->values_user = out;
    if (p->hold_surface) {
        condition = scene_add_where(&setup, TLSPH_VELOCITY, on_surface, out);
        condition->values = exact_velocity;
        condition->values_user = out;
    }
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}
