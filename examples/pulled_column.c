/*
pulled_column.c - how far a rubber column can be pulled before the scheme fails: 002 section 5.4

Draws figure 20 (shape and pressure at five elongations) and the force over the elongation beside that of a homogeneous
bar of the same material, which the middle of the column must follow once the waves of the start have died down.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PANELS 5

typedef struct run {
    driver base;
    pulled_column column;
    driver_history history;
    driver_snapshot snapshots[PANELS + 1]; /* the last one: where it ended, if that is earlier */
    double elongation, spots;              /* percent; oscillation of the pressure */
} run;

static void after_step(driver *d) {
    run *r = d->user;
    r->elongation = pulled_column_elongation(&r->column);
    const double row[2] = { pulled_column_force(&r->column) / 1e6,
                            pulled_column_bar_force(&r->column.body.material, 1 + r->elongation / 100) / 1e6 };
    driver_history_add(&r->history, r->elongation, row);
}

static void snap(run *r, int i) {
    if (driver_snap(&r->column.body, TLSPH_FIELD_PRESSURE, 0, 1e-6, &r->snapshots[i])) return;
    snprintf(r->snapshots[i].title, sizeof r->snapshots[i].title, "%.0f %%", r->elongation);
}

static void simulate(run *r, double end) {
    for (int i = 0; i < PANELS; i++) {
        if (driver_run_to(&r->base, end * (i + 1) / PANELS) != TLSPH_OK) break;
        snap(r, i);
    }
    r->elongation = pulled_column_elongation(&r->column);
    r->spots = scene_oscillation(r->column.body.solver, TLSPH_FIELD_PRESSURE);
    if (r->base.result != TLSPH_OK) snap(r, PANELS);
}

static void draw(run *r) {
    static const driver_chart chart = { "force", "[MN]", 0, 2, { "lowest layer", "homogeneous bar" } };
    ex_view view;
    memset(&view, 0, sizeof view);
    view.panel_width = 180; view.panel_height = 760;
    view.camera.azimuth = 30; view.camera.elevation = 8; view.camera.up_axis = 2; view.camera.zoom = 1;
    view.map = EX_MAP_VIRIDIS;
    view.label = "pressure [MPa], tension positive";
    view.heading = "pulled column (002 figure 20)";
    view.common_scale = 1;
    driver_render(&r->base, "figure20_pressure.png", &view, r->snapshots, PANELS + 1, PANELS + 1,
                  0.5 / r->column.parameters.n);
    driver_plot(&r->base, "force.png", &r->history, &chart, 1, 1);
}

static int run_column(const pulled_column_parameters *p) {
    static run r;
    tlsph_error error;
    int code;
    if (pulled_column_create(p, &r.column, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&r.base, "pulled_column", &p->options, &r.column.body, pulled_column_end(p))) return 1;
    r.history.columns = 2;
    r.history.x_label = "elongation [%]";
    r.base.step = after_step;
    r.base.stride = 20;
    r.base.user = &r;
    simulate(&r, pulled_column_end(p));
    draw(&r);
    ex_result("particles", (double)tlsph_count(r.column.body.solver), "1");
    ex_result("steps", (double)r.base.now.step, "1");
    ex_result("elongation", r.elongation, "percent");
    ex_result("failed", r.base.result != TLSPH_OK, "1");
    ex_result("minimum_J", r.base.now.jacobian_least, "1");
    ex_result("pressure_oscillation", r.spots, "1");
    if (r.base.result == TLSPH_OK) {
        const double bar = pulled_column_bar_force(&r.column.body.material, 1 + r.elongation / 100);
        ex_check("force_by_homogeneous_bar", pulled_column_force(&r.column) / bar, 1, 0.05);
    }
    ex_check_true("pulled_to_the_end", r.base.result == TLSPH_OK);
    code = driver_end(&r.base);
    driver_history_free(&r.history);
    for (int i = 0; i <= PANELS; i++) driver_snapshot_free(&r.snapshots[i]);
    scene_destroy(&r.column.body);
    return code;
}

int main(int argc, char **argv) {
    pulled_column_parameters p;
    const ex_option own[] = {
        { "n", EX_INT, &p.n, NULL, NULL, 2, 64, "spacings across the width of 1 m; 002: 12, centred" },
        { "nu", EX_REAL, &p.poisson, NULL, NULL, -0.9, 0.49999, "Poisson's ratio; 002: 0.45 and 0.495" },
        { "elongation", EX_REAL, &p.elongation, "percent", NULL, 1, 1e5, "at which the pull ends" },
        { "speed", EX_REAL, &p.speed, "m/s", NULL, 1e-3, 1e4, "of the head" },
        { "placement", EX_CHOICE, &p.centred, NULL, "faces|centred", 0, 0, "particles on faces or at cell centres" } };
    pulled_column_default(&p);
    driver_arguments(argc, argv, "pulled_column", "column pulled until it fails (002 section 5.4)", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    return run_column(&p);
}
