/* rotating_disk.c - free disk with a hole that spins and is heated and cooled on a quarter of its rim: 000 section 7.3. */
#include "scenes.h"

#include <math.h>
#include <string.h>

void rotating_disk_default(rotating_disk_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.unknowns = TLSPH_PFHJ;
    p->options.thermal = TLSPH_ENERGY;
    p->options.operator_kind = TLSPH_CELLS;
    p->options.end_time = 10; /* last picture of figure 14: 9.9 s */
    p->n = 16;
    p->radius = 2; p->hole = 1; p->thickness = 1;
    p->omega[0] = p->omega[1] = p->omega[2] = 1;
    p->heat_flux = -1591.5;
    p->heated[0] = 0; p->heated[1] = 90;
    p->switch_off = 4;
}

static double heated_area(const rotating_disk_parameters *p) {
    return (p->heated[1] - p->heated[0]) / 180 * SCENE_PI * p->radius * p->thickness;
}

double rotating_disk_heat(const rotating_disk_parameters *p, double t) {
    const double omega = 2 * SCENE_PI / p->switch_off;
    return -p->heat_flux * heated_area(p) * (1 - cos(omega * fmin(t, p->switch_off))) / omega;
}

/* Radius and azimuth (degrees, 0 to 360) about the centre of the disk. */
static double polar(const rotating_disk_parameters *p, double X, double Y, double *azimuth) {
    const double x = X - p->radius, y = Y - p->radius;
    *azimuth = atan2(y, x) * 180 / SCENE_PI;
    if (*azimuth < 0) *azimuth += 360;
    return sqrt(x * x + y * y);
}

static int inside(void *user, const tlsph_real X[3]) {
    const rotating_disk_parameters *p = user;
    double azimuth;
    const double r = polar(p, (double)X[0], (double)X[1], &azimuth);
    return r <= p->radius && r >= p->hole;
}

/* Faces of the outer staircase within the heated sector, by their component along the true normal. */
static double heated_share(void *user, const scene_face *face) {
    const rotating_disk_parameters *p = user;
    double azimuth;
    const double r = polar(p, face->middle[0], face->middle[1], &azimuth);
    const double x = face->middle[0] - p->radius, y = face->middle[1] - p->radius;
    const double along = (face->area[0] * x + face->area[1] * y) / r;
    return r > (p->radius + p->hole) / 2 && azimuth >= p->heated[0] && azimuth <= p->heated[1] ? along : 0;
}

/* (93); `values` comes filled with the amplitude. At the very instant of switching off both formulae give 0. */
static void pulse(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                  const tlsph_real *x, tlsph_real *values) {
    const double off = ((const rotating_disk *)user)->parameters.switch_off, t = (double)time;
    const tlsph_real f = (tlsph_real)(t < off ? sin(2 * SCENE_PI * t / off) : 0);
    (void)particle; (void)X; (void)x;
    for (size_t i = 0; i < count; i++) values[i] *= f;
}

static void spin(const void *scene, const tlsph_real X[3], scene_state *state) {
    const rotating_disk_parameters *p = &((const rotating_disk *)scene)->parameters;
    const double *w = p->omega;
    const double r[3] = { (double)X[0] - p->radius, (double)X[1] - p->radius, (double)X[2] - p->thickness / 2 };
    for (int i = 0; i < 3; i++) state->v[i] = w[(i + 1) % 3] * r[(i + 2) % 3] - w[(i + 2) % 3] * r[(i + 1) % 3];
}

static tlsph_material rubber(void) {
    tlsph_material m = tlsph_material_default(TLSPH_MIE_GRUNEISEN);
    m.density = 10;
    m.young = 1474;
    m.poisson = (tlsph_real)0.478;
    m.expansion = (tlsph_real)2.223e-4;
    m.specific_heat = 10;
    m.conductivity = 10;
    m.reference_temperature = (tlsph_real)308.15;
    return m;
}

tlsph_result rotating_disk_create(const rotating_disk_parameters *p, rotating_disk *out, tlsph_error *error) {
    const tlsph_material material = rubber();
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_condition *heat;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    fill.shape = TLSPH_PREDICATE;
    fill.inside = inside;
    fill.inside_user = &out->parameters;
    fill.size[0] = fill.size[1] = (tlsph_real)(2 * p->radius);
    fill.size[2] = (tlsph_real)p->thickness;
    fill.spacing = (tlsph_real)(2 * p->radius / p->n);
    scene_begin(&setup, &fill, &material, error);
    heat = scene_add_surface(&setup, TLSPH_HEAT_FLUX, heated_share, &out->parameters, heated_area(p));
    heat->value[0] = (tlsph_real)p->heat_flux;
    heat->values = pulse;
    heat->values_user = out;
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, spin);
    if (result != TLSPH_OK) { scene_destroy(&out->body); return result; }
    out->probe = scene_nearest(&out->body.cloud.particles, p->radius, 2 * p->radius, 0);
    return TLSPH_OK;
}
