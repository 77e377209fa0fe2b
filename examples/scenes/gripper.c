/* gripper.c - four soft arms on a hollow cylinder, pulled upward at their ends: 000 section 7.5. */
#include "scenes.h"

#include <math.h>
#include <string.h>

void gripper_default(gripper_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.unknowns = TLSPH_PFHJ;
    p->options.thermal = TLSPH_ENERGY;
    p->options.operator_kind = TLSPH_CELLS;
    p->options.end_time = 0.5; /* figure 21 shows 0.47 s */
    p->spacing = 0.02;
    p->arm = 0.4; p->width = 0.08; p->thickness = 0.06; p->radius = 0.1; p->bore = 0.06;
    p->traction = 1000;
    p->cold = 280; p->hot = 300;
}

/* Symmetric to the last bit: only |x|, |y| and a sum that does not depend on their order. */
static int inside(void *user, const tlsph_real X[3]) {
    const gripper_parameters *p = user;
    const double x = fabs((double)X[0]), y = fabs((double)X[1]), r = sqrt(x * x + y * y);
    return r >= p->bore && (r <= p->radius || fmin(x, y) <= p->width / 2);
}

/* Signed distance from the same body, right near the surface. */
static tlsph_real distance(void *user, const tlsph_real X[3]) {
    const gripper_parameters *p = user;
    const tlsph_real w = (tlsph_real)(p->width / 2), a = (tlsph_real)p->arm, t = (tlsph_real)(p->thickness / 2);
    const tlsph_real along[3] = { a, w, t }, across[3] = { w, a, t }, back[3] = { -a, -w, -t }, left[3] = { -w, -a, -t };
    const double r = sqrt((double)(X[0] * X[0] + X[1] * X[1])), slab = fabs((double)X[2]) - p->thickness / 2;
    const double arms = fmin((double)tlsph_distance_box(X, back, along), (double)tlsph_distance_box(X, left, across));
    return (tlsph_real)fmax(fmin(fmax(r - p->radius, slab), arms), p->bore - r);
}

/* Faces of the bore: inside the cylinder, normal toward the axis. */
static double bore_share(void *user, const scene_face *face) {
    const gripper_parameters *p = user;
    const double r = sqrt(face->middle[0] * face->middle[0] + face->middle[1] * face->middle[1]);
    const double along = -(face->area[0] * face->middle[0] + face->area[1] * face->middle[1]) / r;
    return r < (p->bore + p->radius) / 2 ? along : 0;
}

/* The wall of the bore; the areas are of no use to these conditions. */
static void add_bore(scene_setup *setup, tlsph_condition_kind kind, gripper_parameters *p) {
    tlsph_condition *condition = scene_add_surface(setup, kind, bore_share, p, 0);
    condition->areas = NULL;
    if (kind == TLSPH_TEMPERATURE) condition->value[0] = (tlsph_real)p->cold;
}

static void add_end(scene_setup *setup, const gripper_parameters *p, int axis, double place) {
    tlsph_condition *condition = scene_add_plane(setup, TLSPH_TRACTION, axis, place);
    condition->normal[axis] = (tlsph_real)(place > 0 ? 1 : -1);
    if (!p->cloud) {
        scene_share_area(setup, condition, p->width * p->thickness);
        condition->normal[axis] = 0; /* the areas are given */
    }
    condition->value[2] = (tlsph_real)p->traction;
}

static void warm_ends(const void *scene, const tlsph_real X[3], scene_state *state) {
    const gripper_parameters *p = &((const gripper *)scene)->parameters;
    const double far = fmax(fabs((double)X[0]), fabs((double)X[1]));
    if (far > p->arm - 1e-3 * p->spacing) state->theta = p->hot;
}

tlsph_result gripper_create(const gripper_parameters *p, gripper *out, tlsph_error *error) {
    tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    tlsph_fill fill = tlsph_fill_default(3);
    scene_options options = p->options;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.poisson = (tlsph_real)0.45;
    fill.shape = TLSPH_PREDICATE;
    fill.inside = inside;
    fill.inside_user = &out->parameters;
    for (int i = 0; i < 2; i++) { fill.origin[i] = (tlsph_real)-p->arm; fill.size[i] = (tlsph_real)(2 * p->arm); }
    fill.origin[2] = (tlsph_real)(-p->thickness / 2);
    fill.size[2] = (tlsph_real)p->thickness;
    fill.spacing = (tlsph_real)p->spacing;
    if (p->cloud) scene_options_scatter(&options, &fill, distance, &out->parameters);
    scene_begin(&setup, &fill, &material, error);
    for (int i = 0; i < 4; i++) add_end(&setup, p, i / 2, i % 2 ? p->arm : -p->arm);
    add_bore(&setup, TLSPH_CLAMPED, &out->parameters);
    add_bore(&setup, TLSPH_TEMPERATURE, &out->parameters);
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, warm_ends);
    if (result != TLSPH_OK) { scene_destroy(&out->body); return result; }
    out->probe = scene_nearest(&out->body.cloud.particles, p->arm, 0, -p->thickness / 2);
    return TLSPH_OK;
}
