/* punch_test.c - perforated cylinder, nearly incompressible, punched from above: 000 section 7.4. */
#include "scenes.h"

#include <math.h>
#include <string.h>

void punch_test_default(punch_test_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.unknowns = TLSPH_PFHJ;
    p->options.thermal = TLSPH_ENERGY;
    p->options.operator_kind = TLSPH_CELLS;
    p->options.end_time = 0.42; /* figure 19 ends at 0.35 s, figure 17 shows 0.38 s */
    p->n = 12;
    p->radius = 1; p->height = 1; p->hole = 0.25;
    p->speed = 10;
    p->punch = 0.5;
    p->poisson = 0.499;
}

static double from_axis(const tlsph_real X[3]) { return sqrt((double)X[0] * (double)X[0] + (double)X[1] * (double)X[1]); }

static int inside(void *user, const tlsph_real X[3]) {
    const punch_test_parameters *p = user;
    const double r = from_axis(X);
    return r <= p->radius && r >= p->hole;
}

/* (94); a particle just on the edge of the punched part belongs to it. */
static void punched(const void *scene, const tlsph_real X[3], scene_state *state) {
    const punch_test_parameters *p = &((const punch_test *)scene)->parameters;
    if (from_axis(X) <= p->punch * (1 + 1e-9)) state->v[2] = -p->speed * (double)X[2] / p->height;
}

tlsph_result punch_test_create(const punch_test_parameters *p, punch_test *out, tlsph_error *error) {
    tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    tlsph_fill fill = tlsph_fill_default(3);
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.poisson = (tlsph_real)p->poisson;
    fill.shape = TLSPH_PREDICATE;
    fill.inside = inside;
    fill.inside_user = &out->parameters;
    fill.origin[0] = fill.origin[1] = (tlsph_real)-p->radius;
    fill.size[0] = fill.size[1] = (tlsph_real)(2 * p->radius);
    fill.size[2] = (tlsph_real)p->height;
    fill.spacing = (tlsph_real)(2 * p->radius / p->n);
    scene_begin(&setup, &fill, &material, error);
    scene_add_plane(&setup, TLSPH_ROLLER, 2, 0);
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, punched);
    if (result != TLSPH_OK) { scene_destroy(&out->body); return result; }
    out->probe = scene_nearest(&out->body.cloud.particles, 0, p->radius, p->height);
    return TLSPH_OK;
}
