/*
satellite.c - spinning cone with four arms: 001 section 7.1.2

Draws figures 7 (shape and pressure in time), 8 (angular and linear momentum) and 9 (sums of internal forces and of
dissipative forces), and checks that the first are constant and the last zero to round-off.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PANELS 6

typedef struct run {
    driver base;
    satellite craft;
    driver_history history;     /* 3 angular and 3 linear momenta, 3 forces, 3 dissipative forces */
    driver_snapshot snapshots[PANELS];
    tlsph_ledger start;
    double angular, linear, force, dissipation, energy; /* largest deviations; forces by their terms' size */
} run;

static double length3(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static void record(run *r) {
    const tlsph_ledger *l = &r->base.now;
    double row[12], size[2], change[3];
    if (satellite_resultants(&r->craft, row + 6, row + 9, size) == TLSPH_OK) {
        if (size[0] > 0) r->force = fmax(r->force, length3(row + 6) / size[0]);
        if (size[1] > 0) r->dissipation = fmax(r->dissipation, length3(row + 9) / size[1]);
    }
    for (int i = 0; i < 3; i++) {
        row[i] = l->angular_momentum[i];
        row[3 + i] = l->linear_momentum[i];
        change[i] = l->angular_momentum[i] - r->start.angular_momentum[i];
    }
    r->angular = fmax(r->angular, length3(change) / length3(r->start.angular_momentum));
    r->linear = fmax(r->linear, length3(l->linear_momentum));
    r->energy = fmax(r->energy, l->total_energy / r->start.total_energy);
    driver_history_add(&r->history, l->time, row);
}

static void after_step(driver *d) { record(d->user); }

static void draw(run *r) {
    static const driver_chart momenta[] = {
        { "angular momentum (001 figure 8a)", "[kg m2/s]", 0, 3, { "x", "y", "z" } },
        { "linear momentum (001 figure 8b)", "[kg m/s]", 3, 3, { "x", "y", "z" } } };
    static const driver_chart forces[] = {
        { "sum of internal forces (001 figure 9a)", "[N]", 6, 3, { "x", "y", "z" } },
        { "sum of dissipative forces (001 figure 9b)", "[N]", 9, 3, { "x", "y", "z" } } };
    ex_view view;
    memset(&view, 0, sizeof view);
    view.panel_width = 420; view.panel_height = 330;
    view.camera.azimuth = 30; view.camera.elevation = 35; view.camera.up_axis = 2; view.camera.zoom = 1;
    view.map = EX_MAP_DIVERGING;
    view.label = "pressure [kPa], tension positive";
    view.heading = "spinning satellite (001 figure 7)";
    view.common_scale = 1;
    driver_render(&r->base, "figure7_pressure.png", &view, r->snapshots, PANELS, 3, r->craft.parameters.spacing / 2);
    driver_plot(&r->base, "figure8_momenta.png", &r->history, momenta, 2, 2);
    driver_plot(&r->base, "figure9_forces.png", &r->history, forces, 2, 2);
}

static void report(const run *r) {
    const tlsph_ledger *l = &r->base.now;
    const double scale = length3(r->start.angular_momentum) / 6.5; /* a momentum: that of the mass at the arms' ends */
    ex_result("particles", (double)tlsph_count(r->craft.body.solver), "1");
    ex_result("steps", (double)l->step, "1");
    ex_result("angular_momentum", r->start.angular_momentum[2], "kg m2/s");
    ex_result("energy_kept", l->total_energy / r->start.total_energy, "1");
    ex_check_below("angular_momentum_change", r->angular, 1e-12);
    ex_check_below("linear_momentum_by_scale", r->linear / scale, 1e-12);
    ex_check_below("sum_of_internal_forces_by_terms", r->force, 1e-13);
    ex_check_below("sum_of_dissipation_by_terms", r->dissipation, 1e-13);
    ex_check_below("largest_energy_by_initial", r->energy, 1 + 1e-3);
}

static int run_satellite(const satellite_parameters *p) {
    static run r;
    tlsph_error error;
    int code;
    if (satellite_create(p, &r.craft, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&r.base, "satellite", &p->options, &r.craft.body, p->options.end_time)) return 1;
    r.history.columns = 12;
    r.base.step = after_step;
    r.base.stride = 5;
    r.base.user = &r;
    r.start = r.base.now;
    record(&r);
    for (int i = 0; i < PANELS && r.base.result == TLSPH_OK; i++) {
        if (driver_run_to(&r.base, p->options.end_time * i / (PANELS - 1)) == TLSPH_OK)
            driver_snap(&r.craft.body, TLSPH_FIELD_PRESSURE, 0, 1e-3, &r.snapshots[i]);
    }
    draw(&r);
    report(&r);
    code = driver_end(&r.base);
    driver_history_free(&r.history);
    for (int i = 0; i < PANELS; i++) driver_snapshot_free(&r.snapshots[i]);
    scene_destroy(&r.craft.body);
    return code;
}

int main(int argc, char **argv) {
    satellite_parameters p;
    const ex_option own[] = {
        { "spacing", EX_REAL, &p.spacing, "m", NULL, 0.05, 0.5, "distance of particles: 0.5, 0.25, 0.125, ..." },
        { "spin", EX_REAL, &p.spin, "rad/s", NULL, -100, 100, "about Z" } };
    satellite_default(&p);
    driver_arguments(argc, argv, "satellite", "spinning cone with four arms (001 section 7.1.2)", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    return run_satellite(&p);
}
