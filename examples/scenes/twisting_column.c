/*
twisting_column.c - column of 1 m x 6 m x 1 m, clamped at Y = 0 and thrown into torsion: 001 section 7.3.1

  v_0 = w_0 x X,  w_0 = (0, omega sin(pi Y / 2 L), 0),  with the origin on the axis of the column, |X|, |Z| <= 1/2 m.
The paper's formula has the axis along Y; where it names a point on the top's axis it means (0, 6, 0) m here.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LENGTH 6.0 /* m */

void twisting_column_default(twisting_column_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.end_time = 0.1;
    p->options.unknowns = TLSPH_PFHJ;
    p->n = 6;
    p->nu = 0.4995;
    p->omega = 105;
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const twisting_column *column = scene;
    const double omega = column->parameters.omega * sin(SCENE_PI * (double)X[1] / (2 * LENGTH));
    state->v[0] = omega * (double)X[2];
    state->v[2] = -omega * (double)X[0];
}

tlsph_result twisting_column_create(const twisting_column_parameters *p, twisting_column *out, tlsph_error *error) {
    tlsph_material material = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    tlsph_fill fill = tlsph_fill_default(3);
    scene_options options = p->options;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.young = (tlsph_real)17e6;
    material.density = 1100;
    material.poisson = (tlsph_real)p->nu;
    material.specific_heat = 1; /* thermal runs only; without expansion any will do */
    fill.size[0] = fill.size[2] = 1;
    fill.size[1] = (tlsph_real)LENGTH;
    fill.origin[0] = fill.origin[2] = (tlsph_real)-0.5;
    fill.spacing = (tlsph_real)(1.0 / p->n);
    fill.placement = p->centred ? TLSPH_CELL_CENTRED : TLSPH_ON_FACES;
    fill.jitter = (tlsph_real)p->jitter;
    if (p->jitter > 0) scene_options_cloud(&options, &fill);
    scene_begin(&setup, &fill, &material, error);
    scene_add_plane(&setup, TLSPH_CLAMPED, 1, p->centred ? 0.5 / p->n : 0);
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

void twisting_column_read(const twisting_column *column, twisting_column_shape *shape) {
    const tlsph_particles *particles = &column->body.cloud.particles;
    tlsph_real *x = scene_read(column->body.solver, TLSPH_FIELD_POSITION);
    tlsph_real *v = scene_read(column->body.solver, TLSPH_FIELD_VELOCITY);
    const double top = LENGTH - (column->parameters.centred ? 0.5 / column->parameters.n : 0);
    double volume = 0, height = 0, cosine = 0, sine = 0, axis[2] = { 0 }, axis_velocity[2] = { 0 };
    for (size_t i = 0; x && v && i < particles->count; i++) {
        const tlsph_real *X = particles->positions + 3 * i, *xi = x + 3 * i;
        const double V = (double)particles->volumes[i];
        if (particles->moments ? !(particles->areas[3 * i + 1] > 0) : (double)X[1] < top * (1 - 1e-5)) continue; /* below */
        volume += V;
        height += V * (double)xi[1];
        cosine += V * ((double)X[0] * (double)xi[0] + (double)X[2] * (double)xi[2]);
        sine += V * ((double)X[2] * (double)xi[0] - (double)X[0] * (double)xi[2]);
        for (int k = 0; k < 2; k++) {
            axis[k] += V * (double)xi[2 * k];
            axis_velocity[k] += V * (double)v[3 * i + 2 * (size_t)k];
        }
    }
    free(x); free(v);
    if (!(volume > 0)) return;
    shape->tip_height = height / volume;
    shape->tip_twist += remainder(atan2(sine, cosine) - shape->tip_twist, 2 * SCENE_PI);
    for (int k = 0; k < 2; k++) {
        shape->axis[k] = axis[k] / volume;
        shape->axis_velocity[k] = axis_velocity[k] / volume;
    }
}
