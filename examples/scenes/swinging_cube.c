/*
swinging_cube.c - cube of 1 m in its lowest swinging mode: 001 section 7.1, references/README

  u_i = U0 cos(w t) sin(pi X_i / 2) cos(pi X_j / 2) cos(pi X_k / 2),  w = (sqrt(3)/2) pi c_p.
  The mode is curl-free, so that only the p-wave speed c_p enters.
  Rollers on X, Y, Z = 0 (normal displacement zero), skew symmetry on X, Y, Z = 1 (tangential displacement zero).
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void swinging_cube_default(swinging_cube_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.end_time = 0.002; /* 001 table 1 */
    p->options.operator_kind = TLSPH_CELLS_4; /* the best error a second of computing time, see METHOD in tlsph.h */
    p->options.integrator = TLSPH_RK3_FROZEN;
    p->options.cfl = 0.5;
    p->n = 16;
    p->amplitude = 5e-7;         /* so small that every material is linear (METHOD section 4) */
    p->young = 17e6; p->poisson = 0.3; p->density = 1100;
    p->linear = 1;
}

void swinging_cube_exact(const swinging_cube *cube, const tlsph_real X[3], double t, double v[3], double F[9],
                         double P[9]) {
    const tlsph_material *m = &cube->body.material;
    const double U = cube->parameters.amplitude * cos(cube->omega * t);
    const double rate = -cube->parameters.amplitude * cube->omega * sin(cube->omega * t), q = SCENE_PI / 2;
    double s[3], c[3], p_wave, bulk, shear, trace;
    scene_moduli(m, &p_wave, &bulk, &shear);
    for (int i = 0; i < 3; i++) { s[i] = sin(q * (double)X[i]); c[i] = cos(q * (double)X[i]); }
    for (int i = 0; i < 3; i++) v[i] = rate * s[i] * c[(i + 1) % 3] * c[(i + 2) % 3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            F[3 * i + j] = i == j ? U * q * c[0] * c[1] * c[2] : -U * q * s[i] * s[j] * c[3 - i - j];
    trace = F[0] + F[4] + F[8];
    for (int i = 0; i < 9; i++) P[i] = 2 * shear * F[i]; /* F is symmetric here: the mode is curl-free */
    for (int i = 0; i < 9; i += 4) { P[i] += (bulk - 2 * shear / 3) * trace; F[i] += 1; }
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double q = SCENE_PI / 2;
    double P[9], s[3], c[3];
    swinging_cube_exact(scene, X, 0, state->v, state->F, P);
    for (int i = 0; i < 3; i++) { s[i] = sin(q * (double)X[i]); c[i] = cos(q * (double)X[i]); }
    for (int i = 0; i < 3; i++)
        state->x[i] += ((const swinging_cube *)scene)->parameters.amplitude * s[i] * c[(i + 1) % 3] * c[(i + 2) % 3];
}

static tlsph_material make_material(const swinging_cube_parameters *p) {
    tlsph_material material = tlsph_material_default(p->linear ? TLSPH_LINEAR : TLSPH_NEO_HOOKEAN);
    material.young = (tlsph_real)p->young;
    material.poisson = (tlsph_real)p->poisson;
    material.density = (tlsph_real)p->density;
    material.specific_heat = 1; /* thermal runs only; without expansion any will do */
    return material;
}

tlsph_result swinging_cube_create(const swinging_cube_parameters *p, swinging_cube *out, tlsph_error *error) {
    const tlsph_material material = make_material(p);
    tlsph_fill fill = tlsph_fill_default(3);
    scene_options options = p->options;
    double p_wave, bulk, shear;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    if (options.operator_kind == TLSPH_CELLS_4 && (options.sharp || p->jitter > 0)) { /* for lattices, and sharp itself */
        options.operator_kind = options.sharp ? TLSPH_CELLS : TLSPH_CORRECTED_KERNEL;
        options.cfl = fmin(options.cfl, 0.3);
    }
    if (p->jitter > 0) scene_options_cloud(&options, &fill);
    scene_moduli(&material, &p_wave, &bulk, &shear);
    out->omega = sqrt(3) / 2 * SCENE_PI * sqrt(p_wave / p->density);
    fill.size[0] = fill.size[1] = fill.size[2] = 1;
    fill.spacing = (tlsph_real)(1.0 / p->n);
    fill.jitter = (tlsph_real)p->jitter;
    scene_begin(&setup, &fill, &material, error);
    for (int axis = 0; axis < 3; axis++) {
        scene_add_plane(&setup, TLSPH_ROLLER, axis, 0);
        scene_add_plane(&setup, TLSPH_TANGENT, axis, 1);
    }
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

void swinging_cube_errors(const swinging_cube *cube, double *error_p, double *error_P) {
    const tlsph_particles *particles = &cube->body.cloud.particles;
    const double t = (double)tlsph_time(cube->body.solver);
    tlsph_real *velocity = scene_read(cube->body.solver, TLSPH_FIELD_VELOCITY);
    tlsph_real *stress = scene_read(cube->body.solver, TLSPH_FIELD_STRESS);
    double sum[4] = { 0 };
    for (size_t i = 0; velocity && stress && i < particles->count; i++) {
        double v[3], F[9], P[9];
        swinging_cube_exact(cube, particles->positions + 3 * i, t, v, F, P);
        sum[0] += pow((double)velocity[3 * i] - v[0], 2);
        sum[1] += v[0] * v[0];
        sum[2] += pow((double)stress[9 * i] - P[0], 2);
        sum[3] += P[0] * P[0];
    }
    free(velocity); free(stress);
    *error_p = sum[1] > 0 ? sqrt(sum[0] / sum[1]) : HUGE_VAL;
    *error_P = sum[3] > 0 ? sqrt(sum[2] / sum[3]) : HUGE_VAL;
}
