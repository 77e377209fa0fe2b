/* shear_wave.c - finite circularly polarised shear wave on a stretched body: finite_shear_wave.csv, references/README. */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double wavelength = 1; /* m */

void shear_wave_default(shear_wave_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.thermal = TLSPH_ENERGY;
    p->options.end_time = 0.1;
    p->n = 16;
    p->width = 0.5;
    p->stretch = p->stretch_along = 1;
    p->amplitude = 0.08;
    p->omega = 27.5673636549431512; /* first row of the table */
    p->theta = 293.15;
    p->material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    p->material.conductivity = 0;   /* theta is uniform anyway; the table is adiabatic */
}

void shear_wave_exact(const shear_wave *wave, const tlsph_real X[3], double t, double x[3], double v[3], double F[9]) {
    const shear_wave_parameters *p = &wave->parameters;
    const double phase = wave->k * (double)X[2] - p->omega * t, A = p->amplitude, c = cos(phase), s = sin(phase);
    memset(F, 0, 9 * sizeof *F);
    x[0] = p->stretch * (double)X[0] + A * c;   v[0] = A * p->omega * s;
    x[1] = p->stretch * (double)X[1] + A * s;   v[1] = -A * p->omega * c;
    x[2] = p->stretch_along * (double)X[2];     v[2] = 0;
    F[0] = F[4] = p->stretch;
    F[8] = p->stretch_along;
    F[2] = -A * wave->k * s;
    F[5] = A * wave->k * c;
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    shear_wave_exact(scene, X, 0, state->x, state->v, state->F);
    state->theta = ((const shear_wave *)scene)->parameters.theta;
}

static void exact_velocity(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                           const tlsph_real *x, tlsph_real *values) {
    (void)particle; (void)x;
    for (size_t i = 0; i < count; i++) {
        double place[3], v[3], F[9];
        shear_wave_exact(user, X + 3 * i, (double)time, place, v, F);
        for (int j = 0; j < 3; j++) values[3 * i + (size_t)j] = (tlsph_real)v[j];
    }
}

/* Distance of X from the bar's surface, m. */
static double depth_of(const shear_wave_parameters *p, const tlsph_real X[3]) {
    const double size[3] = { p->width, p->width, wavelength };
    double depth = HUGE_VAL;
    for (int i = 0; i < 3; i++) depth = fmin(depth, fmin((double)X[i], size[i] - (double)X[i]));
    return depth;
}

static int on_surface(void *user, const tlsph_real X[3]) {
    const shear_wave_parameters *p = &((const shear_wave *)user)->parameters;
    return depth_of(p, X) < 1e-3 / p->n;
}

/* The exact solution fills space with a wave of period 1 m; a bar sees the rest of space through its surface, which
   moves with the exact velocity. */
tlsph_result shear_wave_create(const shear_wave_parameters *p, shear_wave *out, tlsph_error *error) {
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_condition *surface;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    out->k = 2 * SCENE_PI / wavelength;
    fill.size[0] = fill.size[1] = (tlsph_real)p->width;
    fill.size[2] = (tlsph_real)wavelength;
    fill.spacing = (tlsph_real)(wavelength / p->n);
    scene_begin(&setup, &fill, &p->material, error);
    surface = scene_add_where(&setup, TLSPH_VELOCITY, on_surface, out);
    surface->values = exact_velocity;
    surface->values_user = out;
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

void shear_wave_errors(const shear_wave *wave, double depth, double *error_v, double *error_F) {
    const tlsph_particles *particles = &wave->body.cloud.particles;
    const double t = (double)tlsph_time(wave->body.solver), A = wave->parameters.amplitude;
    tlsph_real *velocity = scene_read(wave->body.solver, TLSPH_FIELD_VELOCITY);
    tlsph_real *gradient = scene_read(wave->body.solver, TLSPH_FIELD_F);
    double sum_v = 0, sum_F = 0, count = 0;
    for (size_t i = 0; velocity && gradient && i < particles->count; i++) {
        const tlsph_real *X = particles->positions + 3 * i;
        double x[3], v[3], F[9];
        if (depth_of(&wave->parameters, X) < depth) continue;
        shear_wave_exact(wave, X, t, x, v, F);
        for (size_t j = 0; j < 3; j++) sum_v += pow((double)velocity[3 * i + j] - v[j], 2);
        for (size_t j = 0; j < 9; j++) sum_F += pow((double)gradient[9 * i + j] - F[j], 2);
        count++;
    }
    free(velocity); free(gradient);
    *error_v = count > 0 ? sqrt(sum_v / count) / (A * wave->parameters.omega) : HUGE_VAL;
    *error_F = count > 0 ? sqrt(sum_F / count) / (A * wave->k) : HUGE_VAL;
}
