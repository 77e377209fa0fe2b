/*
perforated_block.c - block with holes, pulled or punched near incompressibility: 001 sections 7.2.1 and 7.2.2

  tensile: v_0 = V (0, 0, Z/H) everywhere, V = 100 m/s; clamped at Z = 0, else free
  punch:   v_0 = -V (0, 0, Z/H) over a quarter of the plan, V = 250 m/s; top free, rollers on all other outer faces
with H = 0.5 m. Figure 10 gives no sizes besides H: here the block is 1 m x 1 m x 0.5 m and has four square holes of 0.2 m
from top to bottom, with 0.2 m of material around each.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HEIGHT 0.5 /* m */

void perforated_block_default(perforated_block_parameters *p, int punch) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.end_time = punch ? 1e-3 : 5e-3;
    p->options.unknowns = TLSPH_PFHJ;
    p->punch = punch;
    p->n = 2;
    p->nu = 0.499;
    p->speed = punch ? 250 : 100;
}

/* In the material: outside the holes 0.2 to 0.4 and 0.6 to 0.8 in X and Y. */
static int in_block(void *user, const tlsph_real X[3]) {
    int hole = 1;
    (void)user;
    for (int i = 0; i < 2; i++) {
        const double x = fmod((double)X[i], 0.4);
        if (!(x > 0.2 && (double)X[i] < 0.8)) hole = 0;
    }
    return !hole;
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const perforated_block_parameters *p = &((const perforated_block *)scene)->parameters;
    const double rate = p->speed / HEIGHT;
    if (!p->punch) state->v[2] = rate * (double)X[2];
    else if ((double)X[0] < 0.5 + 1e-6 && (double)X[1] < 0.5 + 1e-6) state->v[2] = -rate * (double)X[2];
}

tlsph_result perforated_block_create(const perforated_block_parameters *p, perforated_block *out, tlsph_error *error) {
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
    fill.shape = TLSPH_PREDICATE;
    fill.inside = in_block;
    fill.size[0] = fill.size[1] = 1;
    fill.size[2] = (tlsph_real)HEIGHT;
    fill.spacing = (tlsph_real)(0.1 / p->n);
    if (options.operator_kind == TLSPH_CORRECTED_KERNEL) options.operator_kind = TLSPH_CELLS; /* closed at re-entrant edges */
    scene_begin(&setup, &fill, &material, error);
    if (p->punch) {
        scene_add_rollers(&setup, 0);
        scene_add_rollers(&setup, 1);
        scene_add_plane(&setup, TLSPH_ROLLER, 2, 0);
    } else scene_add_plane(&setup, TLSPH_CLAMPED, 2, 0);
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}
