/*
gripper.c - four soft arms on a cooled hollow cylinder, pulled upward at their warm ends: 000 section 7.5

Draws the paper's figures 21 (pressure and temperature at 0.47 s from three sides) and 22 (displacement at X = (0.4, 0,
-0.03) m), and checks the symmetry of the four arms, the energy balance and that the pressure is not spotted.
*/
#include "common/driver.h"

#include <math.h>
#include <string.h>

enum { SNAPSHOTS = 6 };

static const driver_moment moments[SNAPSHOTS] = {
    { 0.47, TLSPH_FIELD_PRESSURE, 0, 1e-3 }, { 0.47, TLSPH_FIELD_TEMPERATURE, 0, 1 }, /* figure 21 */
    { 0.1, TLSPH_FIELD_PRESSURE, 0, 1e-3 }, { 0.2, TLSPH_FIELD_PRESSURE, 0, 1e-3 },
    { 0.3, TLSPH_FIELD_PRESSURE, 0, 1e-3 }, { 0.4, TLSPH_FIELD_PRESSURE, 0, 1e-3 } };

typedef struct run {
    driver base;
    gripper body;
    driver_history probe;
    driver_snapshot snapshots[SNAPSHOTS];
    double drift, residual, work, oscillation, asymmetry;
} run;

static void record(run *r) {
    double u[3];
    for (int i = 0; i < 3; i++) u[i] = scene_value(r->body.body.solver, TLSPH_FIELD_DISPLACEMENT, r->body.probe, i);
    driver_history_add(&r->probe, r->base.now.time, u);
}

static void after_step(driver *d) {
    run *r = d->user;
    record(r);
    r->drift = fmax(r->drift, d->now.drift_largest);
    r->residual = fmax(r->residual, fabs(d->now.energy_residual));
    r->work = fmax(r->work, d->now.external_work);
    if (d->now.step % 50) return;
    r->oscillation = fmax(r->oscillation, scene_oscillation(d->body->solver, TLSPH_FIELD_PRESSURE));
    for (int axis = 0; axis < 2; axis++) r->asymmetry = fmax(r->asymmetry, scene_asymmetry(d->body, axis));
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

static ex_view make_view(const char *label, const char *heading, ex_map map, double azimuth, double elevation) {
    return driver_view(420, 340, azimuth, elevation, 2, map, label, heading);
}

static void draw(run *r) {
    static const struct { const char *name; double azimuth, elevation; } sides[3] = {
        { "isometric", 30, 30 }, { "front", 0, 0 }, { "top", -90, 90 } };
    static const driver_chart chart = { "displacement at X = (0.4, 0, -0.03) m (000 figure 22)", "[m]", 0, 3,
                                        { "u_x", "u_y", "u_z" } };
    const double radius = r->body.parameters.spacing / 2;
    ex_view view;
    char file[64];
    for (int i = 0; i < 3; i++) {
        view = make_view("pressure [kPa], tension positive", "gripper, pressure (000 figure 21)", EX_MAP_DIVERGING,
                         sides[i].azimuth, sides[i].elevation);
        snprintf(file, sizeof file, "figure21_pressure_%s.png", sides[i].name);
        driver_render(&r->base, file, &view, &r->snapshots[0], 1, 1, radius);
        view = make_view("temperature [K]", "gripper, temperature (000 figure 21)", EX_MAP_HEAT, sides[i].azimuth,
                         sides[i].elevation);
        snprintf(file, sizeof file, "figure21_temperature_%s.png", sides[i].name);
        driver_render(&r->base, file, &view, &r->snapshots[1], 1, 1, radius);
    }
    view = make_view("pressure [kPa], tension positive", "gripper, pressure", EX_MAP_DIVERGING, 30, 30);
    driver_render(&r->base, "sequence_pressure.png", &view, r->snapshots + 2, 4, 4, radius);
    driver_table(&r->base, "probe.csv", "time [s],u_x [m],u_y,u_z", &r->probe);
    driver_plot(&r->base, "figure22_probe.png", &r->probe, &chart, 1, 1);
}

static void check(const run *r) {
    const double *u = r->probe.values + 3 * (r->probe.count - 1);
    ex_result("particles", (double)tlsph_count(r->body.body.solver), "1");
    ex_result("steps", (double)r->base.now.step, "1");
    ex_result("u_x", u[0], "m");
    ex_result("u_z", u[2], "m");
    ex_result("largest_pressure_oscillation", r->oscillation, "1");
    if (!r->body.parameters.cloud) { /* clouds have no symmetry */
        ex_check_below("u_y_by_u_z", fabs(u[1] / u[2]), 1e-8);
        ex_check_below("asymmetry", r->asymmetry, 1e-8);
    }
    ex_result("jacobian_drift", r->drift, "1"); /* largest at the clamped edges of the bore, which are singular */
    if (r->body.parameters.options.thermal == TLSPH_ENERGY)
        ex_check_below("energy_residual_by_work", r->residual / r->work, 1e-10);
}

static int run_gripper(const gripper_parameters *p) {
    static run r;
    tlsph_error error;
    int code;
    if (gripper_create(p, &r.body, &error) != TLSPH_OK) return driver_error(&error);
    r.probe.columns = 3;
    if (driver_begin(&r.base, "gripper", &p->options, &r.body.body, p->options.end_time)) return 1;
    r.base.step = after_step;
    r.base.user = &r;
    record(&r);
    driver_run_moments(&r.base, p->options.end_time, moments, r.snapshots, SNAPSHOTS);
    draw(&r);
    check(&r);
    code = driver_end(&r.base);
    driver_history_free(&r.probe);
    for (int i = 0; i < SNAPSHOTS; i++) driver_snapshot_free(&r.snapshots[i]);
    scene_destroy(&r.body.body);
    return code;
}

int main(int argc, char **argv) {
    gripper_parameters p;
    const ex_option own[] = {
        { "cloud", EX_FLAG, &p.cloud, NULL, NULL, 0, 0, "an irregular cloud on the true surface, closed operator" },
        { "spacing", EX_REAL, &p.spacing, "m", NULL, 0.002, 0.02, "0.02 by a whole number" },
        { "traction", EX_REAL, &p.traction, "Pa", NULL, -1e5, 1e5, "on the ends of the arms, upward" } };
    double cells;
    gripper_default(&p);
    driver_arguments(argc, argv, "gripper", "four-armed soft gripper (000 section 7.5)", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    cells = 0.02 / p.spacing;
    if (fabs(cells - round(cells)) > 1e-6) {
        fprintf(stderr, "gripper: --spacing must be 0.02 m by a whole number, found %g\n", p.spacing);
        return 2;
    }
    return run_gripper(&p);
}
