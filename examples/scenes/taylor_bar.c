/*
taylor_bar.c - a copper bar hits a rigid wall: 001 section 7.2.3, figures 18 and 19, table 2

The bar lies along Y with its foot on the wall Y = 0; a quarter is computed, X = 0 and Z = 0 are planes of symmetry.
Von Mises plasticity with linear hardening, {p,F}. The radius is that of the disc with the area of the foot: with particles
on the surface this needs no guess about where the surface is.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void taylor_bar_default(taylor_bar_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.end_time = 80e-6;
    p->options.cfl = 0.4;
    p->n = 4;
    p->fill = 1;
    p->radius = 0.0032; p->length = 0.0324;
    p->speed = 227;
    p->material = tlsph_material_default(TLSPH_VON_MISES);
    p->material.density = 8930;
    p->material.young = (tlsph_real)117e9;
    p->material.poisson = (tlsph_real)0.35;
    p->material.yield_stress = (tlsph_real)0.4e9;
    p->material.hardening = (tlsph_real)0.1e9;
}

static int in_bar(void *user, const tlsph_real X[3]) {
    const taylor_bar_parameters *p = user;
    return hypot((double)X[0], (double)X[2]) <= p->radius;
}
static tlsph_result make_cloud(taylor_bar_parameters *p, tlsph_cloud *cloud, tlsph_error *error) {
    tlsph_fill fill = tlsph_fill_default(3);
    if (!p->fill) return scene_round_bar(p->radius, p->length, p->n, cloud);
    fill.shape = TLSPH_PREDICATE;
    fill.inside = in_bar;
    fill.inside_user = p;
    fill.size[0] = fill.size[2] = (tlsph_real)p->radius;
    fill.size[1] = (tlsph_real)p->length;
    fill.spacing = (tlsph_real)(p->radius / p->n);
    return tlsph_cloud_create(&fill, cloud, error);
}

/* The faces of cells on Y = 0: corners without the second bit, in turn. */
static tlsph_result find_foot(taylor_bar *bar) {
    static const size_t turn[4] = { 0, 1, 5, 4 };
    const tlsph_particles *p = &bar->body.cloud.particles;
    bar->foot = malloc((4 * p->cell_count + 1) * sizeof *bar->foot);
    if (!bar->foot) return TLSPH_ERROR_MEMORY;
    for (size_t c = 0; c < p->cell_count; c++) {
        const uint32_t *corner = p->cells + 8 * c;
        if ((double)p->positions[3 * corner[0] + 1] > 1e-3 * (double)bar->body.cloud.cell_size[1]) continue;
        for (int k = 0; k < 4; k++) bar->foot[4 * bar->faces + (size_t)k] = corner[turn[k]];
        bar->faces++;
    }
    return TLSPH_OK;
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    (void)X;
    state->v[1] = -((const taylor_bar *)scene)->parameters.speed;
}

tlsph_result taylor_bar_create(const taylor_bar_parameters *p, taylor_bar *out, tlsph_error *error) {
    taylor_bar_parameters copy = *p;
    scene_options options = p->options;
    tlsph_cloud cloud;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    result = make_cloud(&copy, &cloud, error);
    scene_begin_cloud(&setup, &cloud, result, &p->material, error);
    options.operator_kind = p->fill ? TLSPH_CELLS : TLSPH_GIVEN;
    scene_add_plane(&setup, TLSPH_ROLLER, 0, 0);
    scene_add_plane(&setup, TLSPH_ROLLER, 2, 0);
    if (p->wall) scene_add_plane(&setup, TLSPH_ROLLER, 1, 0);
    else scene_add(&setup, TLSPH_WALL)->normal[1] = 1;
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = find_foot(out);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result == TLSPH_OK) out->tip = scene_nearest(&out->body.cloud.particles, 0, p->length, 0);
    else taylor_bar_destroy(out);
    return result;
}

void taylor_bar_destroy(taylor_bar *bar) {
    free(bar->foot);
    scene_destroy(&bar->body);
    memset(bar, 0, sizeof *bar);
}

/* Area of a foot face in the plane of the wall. */
static double face_area(const uint32_t *corner, const tlsph_real *x) {
    double sum = 0;
    for (int k = 0; k < 4; k++) {
        const tlsph_real *a = x + 3 * corner[k], *b = x + 3 * corner[(k + 1) % 4];
        sum += (double)a[0] * (double)b[2] - (double)a[2] * (double)b[0];
    }
    return fabs(sum) / 2;
}

void taylor_bar_read(const taylor_bar *bar, taylor_bar_shape *shape) {
    tlsph_real *x = scene_read(bar->body.solver, TLSPH_FIELD_POSITION);
    tlsph_real *strain = scene_read(bar->body.solver, TLSPH_FIELD_PLASTIC_STRAIN);
    const tlsph_particles *p = &bar->body.cloud.particles;
    double now = 0, before = 0, low = HUGE_VAL;
    memset(shape, 0, sizeof *shape);
    for (size_t f = 0; x && f < bar->faces; f++) {
        now += face_area(bar->foot + 4 * f, x);
        before += face_area(bar->foot + 4 * f, p->positions);
        for (int k = 0; k < 4; k++) shape->lift = fmax(shape->lift, (double)x[3 * bar->foot[4 * f + (size_t)k] + 1]);
    }
    for (size_t i = 0; x && i < p->count; i++) low = fmin(low, (double)x[3 * i + 1]);
    for (size_t i = 0; strain && i < p->count; i++) shape->plastic_strain = fmax(shape->plastic_strain, (double)strain[i]);
    if (x) {
        shape->radius = bar->parameters.radius * sqrt(now / before);
        shape->length = (double)x[3 * bar->tip + 1] - low;
    }
    free(x);
    free(strain);
}
