/* bending_column.c - column fixed at its foot that is thrown sideways: 002 section 5.3 */
#include "scenes.h"

#include <string.h>

void scene_options_of_002(scene_options *o, double biharmonic) {
    o->operator_kind = (int)TLSPH_BOND;
    o->kernel = (int)TLSPH_CUBIC_SPLINE;
    o->support = 0.9;
    o->dissipation = (int)TLSPH_JST;
    o->harmonic = 0;
    o->biharmonic = biharmonic;
    o->threads = 1; /* small scenes run best on one */
    o->integrator = (int)TLSPH_SSP_RK3;
    o->projection = 0;
}

void bending_column_default(bending_column_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    scene_options_of_002(&p->options, 1.0 / 64);
    p->options.end_time = 0.3;
    p->n = 5;
    p->centred = 1;
    p->speed = 10; /* 5 Z/3 at Z = 6 m */
    p->young = 17e6; p->poisson = 0.495; p->density = 1100;
}

static void thrown(const void *scene, const tlsph_real X[3], scene_state *state) {
    state->v[1] = ((const bending_column *)scene)->parameters.speed * (double)X[2] / 6;
}

tlsph_result bending_column_create(const bending_column_parameters *p, bending_column *out, tlsph_error *error) {
    tlsph_material material = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    tlsph_fill fill = tlsph_fill_default(3);
    const double d = 1.0 / p->n;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.young = (tlsph_real)p->young;
    material.poisson = (tlsph_real)p->poisson;
    material.density = (tlsph_real)p->density;
    fill.size[0] = fill.size[1] = 1;
    fill.size[2] = 6;
    fill.origin[0] = fill.origin[1] = (tlsph_real)-0.5;
    fill.spacing = (tlsph_real)d;
    fill.placement = p->centred ? TLSPH_CELL_CENTRED : TLSPH_ON_FACES;
    scene_begin(&setup, &fill, &material, error);
    scene_add_plane(&setup, TLSPH_CLAMPED, 2, p->centred ? d / 2 : 0);
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, thrown);
    if (result == TLSPH_OK) out->tip = scene_nearest(&out->body.cloud.particles, 0, 0, 6);
    else scene_destroy(&out->body);
    return result;
}
