/* l_block.c - L-shaped block that is twisted by two opposite forces and then flies free: 000 section 7.2, figure 4. */
#include "scenes.h"

#include <math.h>
#include <string.h>

/* Corners (0,0), (6,0), (6,3), (3,3), (3,10), (0,10) m in the plane, 3 m thick. */
static const double width = 6, height = 10, arm = 3;

void l_block_default(l_block_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.unknowns = TLSPH_PFHJ;
    p->options.thermal = TLSPH_ENERGY;
    p->options.operator_kind = TLSPH_CELLS; /* exact at the re-entrant edge too, where corrected kernels are not */
    p->options.end_time = 38;               /* last picture of figure 9 */
    p->spacing = 0.3;
    p->force[0] = 150; p->force[1] = 300; p->force[2] = 450;
    p->ramp = 2.5;
    p->hot = 300;
    p->cold = 250;
}

double l_block_impulse(const l_block_parameters *p) {
    const double force = sqrt(p->force[0] * p->force[0] + p->force[1] * p->force[1] + p->force[2] * p->force[2]);
    return force * p->ramp * p->ramp; /* the area under f(t), a triangle of base 2 ramp and height ramp */
}

static double load(const l_block *block, double t) {
    const double ramp = block->parameters.ramp;
    if (t < ramp) return t;
    return t < 2 * ramp ? 2 * ramp - t : 0;
}

/* `values` comes filled with the traction at f = 1, which is F1 or -F1 by its area. */
static void scale_traction(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                           const tlsph_real *x, tlsph_real *values) {
    const tlsph_real f = (tlsph_real)load(user, (double)time);
    (void)particle; (void)X; (void)x;
    for (size_t i = 0; i < 3 * count; i++) values[i] *= f;
}

/* The paper's forces are total forces on the loaded faces (METHOD section 4): spread evenly, by the areas that belong
   to the particles, so that F1 and F2 cancel to the last bit that the sums allow. */
static void add_force(scene_setup *setup, l_block *out, int axis, double place, double sign) {
    const double area = arm * arm;
    tlsph_condition *condition = scene_add_plane(setup, TLSPH_TRACTION, axis, place);
    scene_share_area(setup, condition, area);
    for (int i = 0; i < 3; i++) {
        condition->value[i] = (tlsph_real)(sign * out->parameters.force[i] / area);
        condition->normal[i] = 0; /* the areas are given; a normal would only project them */
    }
    condition->values = scale_traction;
    condition->values_user = out;
}

/* 300 K on Y = 10, 250 K on X = 6; the two faces have no particle in common, so neither must win. */
static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const l_block_parameters *p = &((const l_block *)scene)->parameters;
    const double tolerance = 1e-3 * p->spacing;
    if ((double)X[1] > height - tolerance) state->theta = p->hot;
    if ((double)X[0] > width - tolerance) state->theta = p->cold;
}

tlsph_result l_block_create(const l_block_parameters *p, l_block *out, tlsph_error *error) {
    const tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    tlsph_fill fill = tlsph_fill_default(3);
    scene_options options = p->options;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    fill.shape = TLSPH_L_SHAPE;
    fill.size[0] = (tlsph_real)width; fill.size[1] = (tlsph_real)height; fill.size[2] = (tlsph_real)arm;
    fill.notch[0] = fill.notch[1] = (tlsph_real)arm;
    fill.spacing = (tlsph_real)p->spacing;
    fill.jitter = (tlsph_real)p->jitter;
    if (p->jitter > 0) {
        if (options.operator_kind == TLSPH_CELLS) options.operator_kind = TLSPH_CORRECTED_KERNEL; /* the scene's default */
        scene_options_cloud(&options, &fill);
    }
    scene_begin(&setup, &fill, &material, error);
    add_force(&setup, out, 1, height, 1);
    add_force(&setup, out, 0, width, -1);
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) { scene_destroy(&out->body); return result; }
    out->probe = scene_nearest(&out->body.cloud.particles, 0, height, 0);
    return TLSPH_OK;
}
