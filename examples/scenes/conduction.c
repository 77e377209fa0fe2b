/*
conduction.c - heat conduction alone, in a body at rest, held in a stretched and sheared state, or turned

Without expansion nothing couples heat to motion, and Q = -h/J H^T H grad theta (000-13) is Fourier's law with the
constant conductivity K = h/J H^T H in the reference: the isotropic h again in a rigid rotation, anisotropic in the
stretched body. c_v d theta/dt = DIV (K grad theta) then has the exact solutions spot  A sqrt(det S_0/det S) exp(-X.S^-1
X/2), S = S_0 + 2 t K/c_v, S_0 = sigma^2 I, as long as it is far from the surface; mode  A prod_i cos(pi (X_i + 1/2))
e^{-st}, s = pi^2 sum_i K_ii/c_v, in the body that is not sheared: its faces are insulated. The alternating state +-A
from particle to particle is no solution of the equation, but what a scheme may keep: the double gradient (56) does not
see it; the compact flux makes it fall with 4 K/(c_v h^2) for each axis.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void conduction_default(conduction_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.thermal = TLSPH_ENERGY;
    p->options.end_time = 0.018;   /* the variance of the spot grows by a half */
    p->options.threads = 1;
    p->dimension = 2;
    p->n = 48;
    p->amplitude = 50;
    p->sigma = 0.08;
    p->omega = SCENE_PI / 3 / p->options.end_time; /* turns by 60 degrees */
    p->material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    p->material.expansion = 0;
    p->material.conductivity = 100; /* 0.1 m^2/s */
}

static const double *held_gradient(const conduction_parameters *p) {
    static const double rest[9] = { 1, 0, 0, 0, 1, 0, 0, 0, 1 };
    static const double plane[9] = { 1.3, 0.4, 0, -0.2, 0.9, 0, 0, 0, 1 },
                        space[9] = { 1.3, 0.4, 0.1, -0.2, 0.9, 0.15, 0.1, -0.1, 1.1 };
    static const double diagonal[9] = { 1.3, 0, 0, 0, 0.8, 0, 0, 0, 1 };
    if (p->motion != CONDUCTION_STRETCHED) return rest;
    if (p->state == CONDUCTION_MODE) return diagonal;
    return p->dimension == 2 ? plane : space;
}

/* K/c_v, m^2/s. */
static void diffusivity(const conduction_parameters *p, double D[9]) {
    const tlsph_material *m = &p->material;
    tlsph_real F[9], H[9];
    for (int i = 0; i < 9; i++) F[i] = (tlsph_real)held_gradient(p)[i];
    tlsph_cofactor(F, H);
    for (int i = 0; i < 9; i++) {
        double sum = 0;
        for (int k = 0; k < 3; k++) sum += (double)(H[3 * k + i / 3] * H[3 * k + i % 3]);
        D[i] = (double)m->conductivity / (double)(m->density * m->specific_heat) / (double)tlsph_determinant(F) * sum;
    }
}

/* In 2-D the third direction is left out: S_33 = 1, X_3 = 0. */
static double spot(const conduction_parameters *p, const double X[3], double t) {
    const double s0 = p->sigma * p->sigma;
    double D[9], X_S_X = 0, det;
    tlsph_real S[9], cofactor[9];
    diffusivity(p, D);
    for (int i = 0; i < 9; i++) S[i] = (tlsph_real)((i % 4 == 0 ? 1 : 0) + 2 * t / s0 * D[i]); /* by sigma^2 */
    if (p->dimension == 2) { S[2] = S[5] = S[6] = S[7] = 0; S[8] = 1; }
    tlsph_cofactor(S, cofactor); /* S is symmetric: its inverse is cof S/det S */
    det = (double)tlsph_determinant(S);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) X_S_X += X[i] * (double)cofactor[3 * i + j] / det * X[j] / s0;
    return exp(-X_S_X / 2) / sqrt(det);
}

static double mode(const conduction_parameters *p, const double X[3], double t) {
    double D[9], rate = 0, product = 1;
    diffusivity(p, D);
    for (int i = 0; i < p->dimension; i++) {
        rate += SCENE_PI * SCENE_PI * D[4 * i];
        product *= cos(SCENE_PI * (X[i] + 0.5));
    }
    return product * exp(-rate * t);
}

static double alternating(const conduction_parameters *p, const double X[3]) {
    long sum = 0;
    for (int i = 0; i < p->dimension; i++) sum += lround((X[i] + 0.5) * p->n);
    return sum % 2 ? -1 : 1;
}

double conduction_exact(const conduction_parameters *p, const tlsph_real X[3], double t) {
    const double place[3] = { (double)X[0], (double)X[1], p->dimension == 2 ? 0 : (double)X[2] };
    const double shape = p->state == CONDUCTION_SPOT ? spot(p, place, t)
                       : p->state == CONDUCTION_MODE ? mode(p, place, t) : alternating(p, place);
    return (double)p->material.reference_temperature + p->amplitude * shape;
}

/* The rotation turns about the centre in the plane of the first two axes. */
static void turning_velocity(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                             const tlsph_real *x, tlsph_real *values) {
    const double w = ((const conducting_body *)user)->parameters.omega, c = w * cos(w * (double)time),
                 s = w * sin(w * (double)time);
    (void)particle; (void)x;
    for (size_t i = 0; i < count; i++) {
        values[3 * i] = (tlsph_real)(-s * (double)X[3 * i] - c * (double)X[3 * i + 1]);
        values[3 * i + 1] = (tlsph_real)(c * (double)X[3 * i] - s * (double)X[3 * i + 1]);
        values[3 * i + 2] = 0;
    }
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const conduction_parameters *p = &((const conducting_body *)scene)->parameters;
    const double *F = held_gradient(p);
    const int turning = p->motion == CONDUCTION_TURNING;
    memcpy(state->F, F, sizeof state->F);
    for (int i = 0; i < p->dimension; i++) {
        state->x[i] = 0;
        for (int j = 0; j < p->dimension; j++) state->x[i] += F[3 * i + j] * (double)X[j];
    }
    state->v[0] = turning ? -p->omega * (double)X[1] : 0;
    state->v[1] = turning ? p->omega * (double)X[0] : 0;
    state->theta = conduction_exact(p, X, 0);
}

tlsph_result conduction_create(const conduction_parameters *p, conducting_body *out, tlsph_error *error) {
    tlsph_fill fill = tlsph_fill_default(p->dimension);
    scene_options options = p->options;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    for (int i = 0; i < p->dimension; i++) { fill.origin[i] = (tlsph_real)-0.5; fill.size[i] = 1; }
    fill.spacing = (tlsph_real)(1.0 / p->n);
    fill.jitter = (tlsph_real)p->jitter;
    if (p->jitter > 0) scene_options_cloud(&options, &fill);
    scene_begin(&setup, &fill, &p->material, error);
    if (p->motion == CONDUCTION_STRETCHED) scene_add(&setup, TLSPH_CLAMPED); /* all particles */
    if (p->motion == CONDUCTION_TURNING) {
        tlsph_condition *turn = scene_add(&setup, TLSPH_VELOCITY);
        turn->values = turning_velocity;
        turn->values_user = out;
    }
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

double conduction_error(const conducting_body *body) {
    const tlsph_particles *particles = &body->body.cloud.particles;
    const double t = (double)tlsph_time(body->body.solver),
                 theta_R = (double)body->parameters.material.reference_temperature;
    tlsph_real *theta = scene_read(body->body.solver, TLSPH_FIELD_TEMPERATURE);
    double error = 0, scale = 0;
    for (size_t a = 0; theta && a < particles->count; a++) {
        const double V = (double)particles->volumes[a],
                     exact = conduction_exact(&body->parameters, particles->positions + 3 * a, t);
        error += V * pow((double)theta[a] - exact, 2);
        scale += V * pow(exact - theta_R, 2);
    }
    free(theta);
    return scale > 0 ? sqrt(error / scale) : HUGE_VAL;
}

double conduction_amplitude(const conducting_body *body) {
    const tlsph_particles *particles = &body->body.cloud.particles;
    const double theta_R = (double)body->parameters.material.reference_temperature;
    tlsph_real *theta = scene_read(body->body.solver, TLSPH_FIELD_TEMPERATURE);
    double is = 0, was = 0;
    for (size_t a = 0; theta && a < particles->count; a++) {
        const tlsph_real *X = particles->positions + 3 * a;
        const double V = (double)particles->volumes[a];
        if (fmax(fabs((double)X[0]), fabs((double)X[1])) > 0.25) continue; /* faces see what alternates */
        const double start = conduction_exact(&body->parameters, X, 0) - theta_R;
        is += V * start * ((double)theta[a] - theta_R);
        was += V * start * start;
    }
    free(theta);
    return was > 0 ? is / was : 0;
}
