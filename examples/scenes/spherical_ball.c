/* spherical_ball.c - thin-walled ball with holes, punched on its top and heated from inside: 000 section 7.6. */
#include "scenes.h"

#include <math.h>
#include <string.h>

void spherical_ball_default(spherical_ball_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.unknowns = TLSPH_PFHJ;
    p->options.thermal = TLSPH_ENERGY;
    p->options.operator_kind = TLSPH_CELLS;
    p->options.end_time = 0.042; /* last picture of figure 24 */
    p->inner_radius = 0.13; p->wall = 0.02;
    p->n = 2;
    p->holes[0] = 17; p->holes[1] = 15;
    p->latitude = 40;
    p->cap = 30;
    p->speed = 1.5;
    p->heat_flux = -470871;
}

static double radius(const double X[3]) { return sqrt(X[0] * X[0] + X[1] * X[1] + X[2] * X[2]); }

/* Cosine of the angle between X and this azimuth and latitude. |Y| makes the pattern symmetric to the last bit. */
static double cosine(const double X[3], double azimuth, double latitude) {
    const double a = azimuth * SCENE_PI / 180, b = latitude * SCENE_PI / 180;
    return (X[0] * cos(a) * cos(b) + fabs(X[1]) * sin(a) * cos(b) + X[2] * sin(b)) / radius(X);
}
static int near_direction(const double X[3], double azimuth, double latitude, double degrees) {
    return cosine(X, azimuth, latitude) >= cos(degrees * SCENE_PI / 180);
}

/* Holes at azimuth 0, 90, 180, 270 on the equator and 0, 120, 240 above; those at negative Y are mirror images. */
static int in_hole(const spherical_ball_parameters *p, const double X[3]) {
    for (int i = 0; i < 3; i++)
        if (p->holes[0] > 0 && near_direction(X, 90 * i, 0, p->holes[0])) return 1;
    for (int i = 0; i < 2; i++)
        if (p->holes[1] > 0 && near_direction(X, 120 * i, p->latitude, p->holes[1])) return 1;
    return 0;
}

static int inside(void *user, const tlsph_real at[3]) {
    const spherical_ball_parameters *p = user;
    const double X[3] = { (double)at[0], (double)at[1], (double)at[2] }, r = radius(X);
    return r >= p->inner_radius && r <= p->inner_radius + p->wall && !in_hole(p, X);
}

/* Signed distance from the same body, right near the surface; holes are cones. */
static double cone(const double X[3], double azimuth, double latitude, double degrees) {
    const double c = fmax(-1, fmin(1, cosine(X, azimuth, latitude))), angle = acos(c) - degrees * SCENE_PI / 180;
    return degrees > 0 ? radius(X) * sin(fmin(SCENE_PI / 2, angle)) : HUGE_VAL;
}
static tlsph_real distance(void *user, const tlsph_real at[3]) {
    const spherical_ball_parameters *p = user;
    const double X[3] = { (double)at[0], (double)at[1], (double)at[2] }, r = radius(X);
    double hole = r;
    if (!(r > 0)) return (tlsph_real)p->inner_radius;
    for (int i = 0; i < 3; i++) hole = fmin(hole, cone(X, 90 * i, 0, p->holes[0]));
    for (int i = 0; i < 2; i++) hole = fmin(hole, cone(X, 120 * i, p->latitude, p->holes[1]));
    return (tlsph_real)fmax(fmax(p->inner_radius - r, r - p->inner_radius - p->wall), -hole);
}

/* The inner staircase; faces along the edges of holes look sideways and count little, those that look outward not. */
static double inner_share(void *user, const scene_face *face) {
    const spherical_ball_parameters *p = user;
    const double r = radius(face->middle);
    double along = 0;
    for (int i = 0; i < 3; i++) along -= face->area[i] * face->middle[i] / r;
    return r < p->inner_radius + p->wall / 2 ? along : 0;
}

static void punched(const void *scene, const tlsph_real at[3], scene_state *state) {
    const spherical_ball_parameters *p = &((const spherical_ball *)scene)->parameters;
    const double X[3] = { (double)at[0], (double)at[1], (double)at[2] };
    if (near_direction(X, 0, 90, p->cap)) state->v[2] = -p->speed;
}

static tlsph_material rubber(void) {
    tlsph_material m = tlsph_material_default(TLSPH_MEE);
    m.density = 1100;
    m.young = (tlsph_real)17e6;
    m.poisson = (tlsph_real)0.3;
    m.expansion = (tlsph_real)2.223e-4;
    m.specific_heat = 1000;
    m.conductivity = (tlsph_real)0.2;
    m.reference_temperature = (tlsph_real)293.15;
    return m;
}

tlsph_result spherical_ball_create(const spherical_ball_parameters *p, spherical_ball *out, tlsph_error *error) {
    const tlsph_material material = rubber();
    const double outer = p->inner_radius + p->wall;
    tlsph_fill fill = tlsph_fill_default(3);
    scene_options options = p->options;
    tlsph_condition *heat;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    fill.shape = TLSPH_PREDICATE;
    fill.inside = inside;
    fill.inside_user = &out->parameters;
    for (int i = 0; i < 3; i++) { fill.origin[i] = (tlsph_real)-outer; fill.size[i] = (tlsph_real)(2 * outer); }
    fill.spacing = (tlsph_real)(p->wall / p->n);
    if (p->cloud) scene_options_scatter(&options, &fill, distance, &out->parameters);
    scene_begin(&setup, &fill, &material, error);
    heat = scene_add_surface(&setup, TLSPH_HEAT_FLUX, inner_share, &out->parameters, 0);
    heat->value[0] = (tlsph_real)p->heat_flux;
    for (size_t i = 0; i < heat->count; i++) out->inner_area += (double)heat->areas[i];
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, punched);
    if (result != TLSPH_OK) { scene_destroy(&out->body); return result; }
    out->probe = scene_nearest(&out->body.cloud.particles, 0, 0, outer);
    return TLSPH_OK;
}
