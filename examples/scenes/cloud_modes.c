/*
cloud_modes.c - two bodies with free surfaces and exact modes, on irregular clouds

  breathing ball   u = A j1(k r) e_r,  x cot x = 1 - x^2 (c_p/c_s)^2 / 4 with x = k R,  w = k c_p: radial mode of a free ball
  Lame's mode      u = A (cos kX sin kY, -sin kX cos kY, 0), k = pi/a, w = sqrt(2) k c_s: a cube of edge a whose faces
                   carry no traction at all; no volume changes
  Both start undeformed with the velocity A w of the mode. Linear material.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void set_default(cloud_mode_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->amplitude = 1e-6;
    p->young = 17e6; p->poisson = 0.3; p->density = 1100;
    p->periods = 2;
    p->seed = 1;
    p->n = 8;
}

void breathing_ball_default(cloud_mode_parameters *p) { set_default(p); p->ball = 1; p->n = 6; }

void lame_mode_default(cloud_mode_parameters *p) { set_default(p); p->jitter = 0.2; }

/* Lowest root of x cot x = 1 - x^2 ratio/4. */
static double radial_root(double ratio) {
    double low = 1e-3, high = SCENE_PI - 1e-9;
    for (int i = 0; i < 200; i++) { /* the difference is negative above the root: cot falls to minus infinity at pi */
        const double x = (low + high) / 2;
        if (x / tan(x) - 1 + x * x * ratio / 4 > 0) low = x;
        else high = x;
    }
    return low;
}

/* Shape phi(X) and its gradient. */
static void shape(const cloud_mode *m, const tlsph_real X[3], double phi[3], double grad[9]) {
    const double k = m->k;
    if (m->parameters.ball) {
        const double x[3] = { (double)X[0], (double)X[1], (double)X[2] };
        const double r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), q = k * r;
        const double ratio = q > 1e-3 ? (sin(q) / q - cos(q)) / (q * q) : 1.0 / 3 - q * q / 30; /* j1(q)/q */
        const double slope = q > 1e-3 ? sin(q) / q - 2 * ratio : 1.0 / 3 - q * q / 10;          /* j1'(q) */
        for (int i = 0; i < 3; i++) phi[i] = k * x[i] * ratio;
        for (int i = 0; i < 9; i++)
            grad[i] = k * (ratio * (i % 4 == 0) + (r > 0 ? (slope - ratio) * x[i / 3] * x[i % 3] / (r * r) : 0));
        return;
    }
    const double cx = cos(k * (double)X[0]), sx = sin(k * (double)X[0]), cy = cos(k * (double)X[1]), sy = sin(k * (double)X[1]);
    phi[0] = cx * sy; phi[1] = -sx * cy; phi[2] = 0;
    memset(grad, 0, 9 * sizeof *grad);
    grad[0] = -k * sx * sy; grad[1] = k * cx * cy;
    grad[3] = -k * cx * cy; grad[4] = k * sx * sy;
}

void cloud_mode_exact(const cloud_mode *m, const tlsph_real X[3], double t, double v[3], double F[9], double P[9]) {
    const double u = m->parameters.amplitude * sin(m->omega * t), rate = m->parameters.amplitude * m->omega * cos(m->omega * t);
    double phi[3], grad[9], p_wave, bulk, shear;
    scene_moduli(&m->body.material, &p_wave, &bulk, &shear);
    shape(m, X, phi, grad);
    const double trace = grad[0] + grad[4] + grad[8];
    for (int i = 0; i < 3; i++) v[i] = rate * phi[i];
    for (int i = 0; i < 9; i++) {
        const int transposed = 3 * (i % 3) + i / 3;
        F[i] = (i % 4 == 0) + u * grad[i];
        P[i] = u * (shear * (grad[i] + grad[transposed]) + (i % 4 == 0 ? (bulk - 2 * shear / 3) * trace : 0));
    }
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    double P[9];
    cloud_mode_exact(scene, X, 0, state->v, state->F, P);
}

tlsph_result cloud_mode_create(const cloud_mode_parameters *p, cloud_mode *out, tlsph_error *error) {
    tlsph_material material = tlsph_material_default(TLSPH_LINEAR);
    tlsph_fill fill = tlsph_fill_default(3);
    scene_options options = p->options;
    double p_wave, bulk, shear;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.young = (tlsph_real)p->young;
    material.poisson = (tlsph_real)p->poisson;
    material.density = (tlsph_real)p->density;
    scene_moduli(&material, &p_wave, &bulk, &shear);
    for (int k = 0; k < 3; k++) { fill.size[k] = p->ball ? 2 : 1; fill.origin[k] = p->ball ? -1 : 0; }
    fill.spacing = (tlsph_real)(1.0 / p->n);
    fill.jitter = (tlsph_real)p->jitter;
    fill.seed = (uint64_t)p->seed;
    if (p->ball || p->scattered) { fill.shape = p->ball ? TLSPH_SPHERE : TLSPH_BOX; fill.placement = TLSPH_SCATTERED; }
    if (p->ball || p->scattered || p->jitter > 0) scene_options_cloud(&options, &fill);
    out->k = p->ball ? radial_root(p_wave / shear) : SCENE_PI;
    out->omega = p->ball ? out->k * sqrt(p_wave / p->density) : sqrt(2 * shear / p->density) * SCENE_PI;
    scene_begin(&setup, &fill, &material, error);
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

double cloud_mode_amplitude(const cloud_mode *m) {
    const tlsph_particles *particles = &m->body.cloud.particles;
    tlsph_real *velocity = scene_read(m->body.solver, TLSPH_FIELD_VELOCITY);
    double sum = 0, norm = 0, phi[3], grad[9];
    for (size_t a = 0; velocity && a < particles->count; a++) {
        const double V = (double)particles->volumes[a];
        shape(m, particles->positions + 3 * a, phi, grad);
        for (size_t i = 0; i < 3; i++) {
            sum += V * phi[i] * (double)velocity[3 * a + i];
            norm += V * phi[i] * phi[i];
        }
    }
    free(velocity);
    return norm > 0 ? sum / norm : 0;
}

void cloud_mode_errors(const cloud_mode *m, double *error_p, double *error_P) {
    const tlsph_particles *particles = &m->body.cloud.particles;
    const double t = (double)tlsph_time(m->body.solver);
    tlsph_real *velocity = scene_read(m->body.solver, TLSPH_FIELD_VELOCITY);
    tlsph_real *stress = scene_read(m->body.solver, TLSPH_FIELD_STRESS);
    double sum[4] = { 0 };
    for (size_t a = 0; velocity && stress && a < particles->count; a++) {
        double v[3], F[9], P[9];
        cloud_mode_exact(m, particles->positions + 3 * a, t, v, F, P);
        for (size_t i = 0; i < 3; i++) { sum[0] += pow((double)velocity[3 * a + i] - v[i], 2); sum[1] += v[i] * v[i]; }
        for (size_t i = 0; i < 9; i++) { sum[2] += pow((double)stress[9 * a + i] - P[i], 2); sum[3] += P[i] * P[i]; }
    }
    free(velocity); free(stress);
    *error_p = sum[1] > 0 ? sqrt(sum[0] / sum[1]) : HUGE_VAL;
    *error_P = sum[3] > 0 ? sqrt(sum[2] / sum[3]) : HUGE_VAL;
}

double cloud_mode_period(const cloud_mode *m) { return 2 * SCENE_PI / m->omega; }

tlsph_result cloud_mode_measure(cloud_mode *m, double *frequency_error, void (*step)(void *user), void *user) {
    const double end = m->parameters.periods * cloud_mode_period(m);
    const size_t samples = 64;
    double t[64], y[64], s[2] = { 0, m->omega };
    for (size_t i = 0; i < samples; i++) {
        const tlsph_result result = tlsph_advance(m->body.solver, (tlsph_real)(end * (double)(i + 1) / (double)samples));
        if (result != TLSPH_OK) return result;
        t[i] = (double)tlsph_time(m->body.solver);
        y[i] = cloud_mode_amplitude(m) / (m->parameters.amplitude * m->omega);
        if (step) step(user);
    }
    *frequency_error = standing_wave_fit(t, y, samples, s) == 0 ? fabs(s[1]) / m->omega - 1 : HUGE_VAL;
    return TLSPH_OK;
}
