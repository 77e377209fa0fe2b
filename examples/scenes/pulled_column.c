/*
pulled_column.c - rubber column of 1 x 1 x 6 m, held at its foot, whose head moves off at 10 m/s: 002 section 5.4

The paper asks how far each formulation goes before it fails: 422 to 527 % at nu = 0.45 and 428 to 465 % at nu = 0.495.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double width = 1, length = 6; /* m */

void pulled_column_default(pulled_column_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.integrator = TLSPH_RK3_FROZEN; /* the pull is 40 thousand steps long: the cheapest scheme */
    p->options.cfl = 0.5;
    p->options.threads = 1;                   /* a small scene runs best on one */
    p->n = 3;
    p->poisson = 0.45;
    p->speed = 10;
    p->elongation = 1000;
}

double pulled_column_end(const pulled_column_parameters *p) {
    return p->options.end_time > 0 ? p->options.end_time : p->elongation / 100 * length / p->speed;
}

tlsph_result pulled_column_create(const pulled_column_parameters *p, pulled_column *out, tlsph_error *error) {
    const double first = p->centred ? width / p->n / 2 : 0; /* height of the lowest particles */
    const int quarter = p->quarter && !p->centred && p->n % 2 == 0;
    tlsph_material material = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_condition *pull;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.density = 1100;
    material.young = 17000000;
    material.poisson = (tlsph_real)p->poisson;
    fill.origin[0] = fill.origin[1] = (tlsph_real)(quarter ? 0 : -width / 2);
    fill.size[0] = fill.size[1] = (tlsph_real)(quarter ? width / 2 : width);
    fill.size[2] = (tlsph_real)length;
    fill.spacing = (tlsph_real)(width / p->n);
    fill.placement = p->centred ? TLSPH_CELL_CENTRED : TLSPH_ON_FACES;
    scene_begin(&setup, &fill, &material, error);
    scene_add_plane(&setup, p->sliding ? TLSPH_ROLLER : TLSPH_CLAMPED, 2, first);
    pull = scene_add_plane(&setup, TLSPH_VELOCITY, 2, length - first);
    pull->value[2] = (tlsph_real)p->speed;
    if (!p->sliding) memset(pull->normal, 0, sizeof pull->normal); /* the head is held sideways too */
    for (int axis = 0; quarter && axis < 2; axis++) scene_add_plane(&setup, TLSPH_ROLLER, axis, 0);
    out->parameters.quarter = quarter;
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) out->tip = scene_nearest(&out->body.cloud.particles, 0, 0, length);
    else scene_destroy(&out->body);
    return result;
}

double pulled_column_elongation(const pulled_column *column) {
    tlsph_real *u = scene_read(column->body.solver, TLSPH_FIELD_DISPLACEMENT);
    const double first = column->parameters.centred ? width / column->parameters.n / 2 : 0;
    const double share = u ? 100 * (double)u[3 * column->tip + 2] / (length - 2 * first) : 0;
    free(u);
    return share;
}

double pulled_column_force(const pulled_column *column) {
    const tlsph_particles *particles = &column->body.cloud.particles;
    const double spacing = width / column->parameters.n, layer = (column->parameters.centred ? 1.5 : 1) * spacing;
    tlsph_real *P = scene_read(column->body.solver, TLSPH_FIELD_STRESS);
    double force = 0;
    const double share = column->parameters.quarter ? 4 : 1;
    for (size_t a = 0; P && a < particles->count; a++)
        if (fabs((double)particles->positions[3 * a + 2] - layer) < 0.1 * spacing)
            force += share * (double)P[9 * a + 8] * (double)particles->volumes[a] / spacing;
    free(P);
    return force;
}

/* Stretch of the sides of a homogeneous bar, from P = 0 there. */
static double side_stretch(double bulk, double shear, double stretch) {
    double low = 1e-3, high = 3;
    for (int i = 0; i < 60; i++) {
        const double b = sqrt(low * high), J = stretch * b * b, FF = stretch * stretch + 2 * b * b;
        const double side = shear * pow(J, -2. / 3) * (b - FF / (3 * b)) + bulk * (J - 1) * J / b;
        if (side > 0) high = b;
        else low = b;
    }
    return low;
}

double pulled_column_bar_force(const tlsph_material *material, double stretch) {
    double p_wave, bulk, shear;
    scene_moduli(material, &p_wave, &bulk, &shear);
    const double b = side_stretch(bulk, shear, stretch), J = stretch * b * b, FF = stretch * stretch + 2 * b * b;
    return shear * pow(J, -2. / 3) * (stretch - FF / (3 * stretch)) + bulk * (J - 1) * J / stretch;
}

double pulled_column_stiffening(const tlsph_material *material, double stretch) {
    double p_wave, bulk, shear;
    scene_moduli(material, &p_wave, &bulk, &shear);
    const double b = side_stretch(bulk, shear, stretch), J = stretch * b * b, FF = stretch * stretch + 2 * b * b;
    return sqrt((bulk * J * J + shear * pow(J, -2. / 3) * (5 * FF / 9 - b * b / 3)) / p_wave);
}
