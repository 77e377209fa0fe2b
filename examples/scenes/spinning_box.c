/* spinning_box.c - a free plate (plane strain) or cube of 1 m that starts to turn as a rigid body: 002 section 5.2 */
#include "scenes.h"

#include <string.h>

void spinning_box_default(spinning_box_parameters *p, int dimension) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    scene_options_of_002(&p->options, 0.125);
    p->options.end_time = dimension == 2 ? 0.2 : 0.1;
    p->dimension = dimension;
    p->n = dimension == 2 ? 24 : 10;
    p->spin = 105;
    p->young = 17e6; p->poisson = dimension == 2 ? 0.45 : 0.3; p->density = 1100;
}

static void turning(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double spin = ((const spinning_box *)scene)->parameters.spin;
    state->v[0] = -spin * (double)X[1];
    state->v[1] = spin * (double)X[0];
}

tlsph_result spinning_box_create(const spinning_box_parameters *p, spinning_box *out, tlsph_error *error) {
    tlsph_material material = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    tlsph_fill fill = tlsph_fill_default(p->dimension);
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.young = (tlsph_real)p->young;
    material.poisson = (tlsph_real)p->poisson;
    material.density = (tlsph_real)p->density;
    for (int i = 0; i < p->dimension; i++) { fill.size[i] = 1; fill.origin[i] = (tlsph_real)-0.5; }
    fill.spacing = (tlsph_real)(1.0 / p->n);
    fill.placement = TLSPH_CELL_CENTRED;
    scene_begin(&setup, &fill, &material, error);
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, turning);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}
