/*
spherical_ball.c - thin-walled ball with an unsymmetrical pattern of holes, punched on its top and heated from inside:
000 section 7.6

Draws the paper's figure 24 (pressure and temperature at six times), and checks momenta, energy against the heat, the
symmetry that the holes leave, and that neither field is spotted.
*/
#include "common/driver.h"

#include <math.h>
#include <string.h>

#define PRESSURE TLSPH_FIELD_PRESSURE, 0, 1e-3 /* kPa, tension positive as in the paper */
#define TEMPERATURE TLSPH_FIELD_TEMPERATURE, 0, 1
enum { SEQUENCE = 6, SNAPSHOTS = 2 * SEQUENCE };

static const driver_moment moments[SNAPSHOTS] = {
    { 0, PRESSURE }, { 0.01, PRESSURE }, { 0.02, PRESSURE }, { 0.03, PRESSURE }, { 0.04, PRESSURE }, { 0.042, PRESSURE },
    { 0, TEMPERATURE }, { 0.01, TEMPERATURE }, { 0.02, TEMPERATURE }, { 0.03, TEMPERATURE }, { 0.04, TEMPERATURE },
    { 0.042, TEMPERATURE } };

typedef struct run {
    driver base;
    spherical_ball ball;
    driver_history probe;     /* u_z at the top, temperature range, oscillation of both fields */
    driver_snapshot snapshots[SNAPSHOTS];
    tlsph_ledger start;
    double linear, angular, energy, asymmetry, drift;
    double spots[2];          /* pressure, temperature */
} run;

static double heat(const run *r, double t) { return -r->ball.parameters.heat_flux * r->ball.inner_area * t; }
static double distance3(const double a[3], const double b[3]) {
    return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

static void record(run *r) {
    double row[4];
    row[0] = scene_value(r->ball.body.solver, TLSPH_FIELD_DISPLACEMENT, r->ball.probe, 2);
    row[1] = r->base.now.centre[2] - r->start.centre[2];
    row[2] = r->base.now.temperature_least;
    row[3] = r->base.now.temperature_largest;
    driver_history_add(&r->probe, r->base.now.time, row);
}

static void after_step(driver *d) {
    run *r = d->user;
    const tlsph_ledger *l = &d->now;
    record(r);
    r->linear = fmax(r->linear, distance3(l->linear_momentum, r->start.linear_momentum));
    r->angular = fmax(r->angular, distance3(l->angular_momentum, r->start.angular_momentum));
    r->energy = fmax(r->energy, fabs(l->total_energy - r->start.total_energy - heat(r, l->time)));
    r->drift = fmax(r->drift, l->drift_largest);
    if (l->step % 50) return;
    r->asymmetry = fmax(r->asymmetry, scene_asymmetry(d->body, 1));
    r->spots[0] = fmax(r->spots[0], scene_oscillation(d->body->solver, TLSPH_FIELD_PRESSURE));
    r->spots[1] = fmax(r->spots[1], scene_oscillation(d->body->solver, TLSPH_FIELD_TEMPERATURE));
}

static ex_view make_view(const char *label, const char *heading, ex_map map) {
    return driver_view(380, 360, 35, 30, 2, map, label, heading);
}

static void draw(run *r) {
    static const driver_chart charts[2] = {
        { "fall of the top and of the centre of mass", "[m]", 0, 2, { "top", "centre" } },
        { "temperature", "[K]", 2, 2, { "least", "largest" } } };
    const double radius = r->ball.parameters.wall / r->ball.parameters.n / 2;
    ex_view view = make_view("pressure [kPa], tension positive", "spherical ball, pressure (000 figure 24)",
                             EX_MAP_DIVERGING);
    driver_render(&r->base, "figure24_pressure.png", &view, r->snapshots, SEQUENCE, 3, radius);
    view = make_view("temperature [K]", "spherical ball, temperature (000 figure 24)", EX_MAP_HEAT);
    driver_render(&r->base, "figure24_temperature.png", &view, r->snapshots + SEQUENCE, SEQUENCE, 3, radius);
    driver_table(&r->base, "probe.csv", "time [s],u_z of the top [m],u_z of the centre [m],least temperature [K],largest",
                 &r->probe);
    driver_plot(&r->base, "histories.png", &r->probe, charts, 2, 2);
}

static void check(const run *r) {
    const double momentum = sqrt(pow(r->start.linear_momentum[0], 2) + pow(r->start.linear_momentum[1], 2) +
                                 pow(r->start.linear_momentum[2], 2));
    const double size = r->ball.parameters.inner_radius + r->ball.parameters.wall;
    ex_result("particles", (double)tlsph_count(r->ball.body.solver), "1");
    ex_result("steps", (double)r->base.now.step, "1");
    ex_result("inner_area", r->ball.inner_area, "m2");
    ex_result("heat", heat(r, r->base.now.time), "J");
    ex_result("largest_pressure_oscillation", r->spots[0], "1");
    ex_result("largest_temperature_oscillation", r->spots[1], "1");
    ex_result("jacobian_drift", r->drift, "1");
    ex_check_below("linear_momentum_change", r->linear / momentum, 1e-10);
    ex_check_below("angular_momentum_change", r->angular / (momentum * size), 1e-8);
    if (r->ball.parameters.options.thermal == TLSPH_ENERGY)
        ex_check_below("energy_minus_heat", r->energy / fabs(heat(r, r->base.now.time)), 1e-8);
    if (!r->ball.parameters.cloud) ex_check_below("asymmetry_y", r->asymmetry, 1e-8); /* clouds have no symmetry */
}

static int run_ball(const spherical_ball_parameters *p) {
    static run r;
    tlsph_error error;
    int code;
    if (spherical_ball_create(p, &r.ball, &error) != TLSPH_OK) return driver_error(&error);
    r.probe.columns = 4;
    if (driver_begin(&r.base, "spherical_ball", &p->options, &r.ball.body, p->options.end_time)) return 1;
    r.base.step = after_step;
    r.base.user = &r;
    r.start = r.base.now;
    driver_run_moments(&r.base, p->options.end_time, moments, r.snapshots, SNAPSHOTS);
    draw(&r);
    check(&r);
    code = driver_end(&r.base);
    driver_history_free(&r.probe);
    for (int i = 0; i < SNAPSHOTS; i++) driver_snapshot_free(&r.snapshots[i]);
    scene_destroy(&r.ball.body);
    return code;
}

int main(int argc, char **argv) {
    spherical_ball_parameters p;
    const ex_option own[] = {
        { "cloud", EX_FLAG, &p.cloud, NULL, NULL, 0, 0, "an irregular cloud on the true surface, closed operator" },
        { "n", EX_INT, &p.n, NULL, NULL, 1, 20, "spacings through the wall" },
        { "inner-radius", EX_REAL, &p.inner_radius, "m", NULL, 1e-3, 10, "0.13 or 0.013, see scenes.h" },
        { "wall", EX_REAL, &p.wall, "m", NULL, 1e-4, 1, "thickness" },
        { "speed", EX_REAL, &p.speed, "m/s", NULL, 0, 100, "of the cap, downward" },
        { "cap", EX_REAL, &p.cap, "degrees", NULL, 1, 180, "size of the punched cap from the top; 180: the whole ball" },
        { "heat-flux", EX_REAL, &p.heat_flux, "W/m^2", NULL, -1e9, 1e9, "on the inner surface; positive: leaves" } };
    spherical_ball_default(&p);
    driver_arguments(argc, argv, "spherical_ball", "thin-walled ball with holes, punched and heated (000 section 7.6)",
                     &p.options, own, (int)(sizeof own / sizeof *own));
    if (p.options.thermal == TLSPH_ISOTHERMAL) {
        fprintf(stderr, "spherical_ball: --thermal must be energy or entropy\n");
        return 2;
    }
    return run_ball(&p);
}
