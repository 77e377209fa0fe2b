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

/* ---- study: elongation at failure by gradient, force and dissipation, beside the paper's ------------------------- */

enum { OWN, BONDS, KERNEL, BONDS_PRINTED, KERNEL_PRINTED, FIRST_ORDER, LINEAR_STEP, SCHEMES, RATIOS = 2 };
static const char *const scheme_keys[SCHEMES] = { "own", "bonds", "kernel", "bonds_printed_force", "kernel_printed_force",
                                                  "bonds_first_order_dissipation", "bonds_linear_step" };
static const double ratios[RATIOS] = { 0.45, 0.495 };
static const double paper[2][RATIOS] = { { 526.80, 464.50 }, { 421.90, 427.58 } }; /* figure 20: bonds, JST-SPH */

static pulled_column_parameters scheme_parameters(const pulled_column_parameters *given, int scheme, double poisson) {
    pulled_column_parameters p = *given;
    p.poisson = poisson;
    if (scheme == OWN) return p;
    scene_options_of_002(&p.options, 1.0 / 64);
    p.centred = 1;
    if (scheme == KERNEL || scheme == KERNEL_PRINTED) p.options.operator_kind = TLSPH_FIRST_KERNEL;
    if (scheme == BONDS_PRINTED || scheme == KERNEL_PRINTED) p.options.force_form = TLSPH_FORCE_AS_PRINTED;
    /* the paper's step by the p speed of the undeformed body, which does not shorten when the column stiffens across */
    if (scheme == LINEAR_STEP) p.options.step_rule = TLSPH_STEP_BY_PAIR_LINEAR;
    if (scheme == FIRST_ORDER) p.options.dissipation = TLSPH_FIRST_ORDER;
    return p;
}

/* Elongation at failure, or at the end of the pull, percent. */
static double elongation_of(const pulled_column_parameters *p, int *failed) {
    static pulled_column column;
    tlsph_error error;
    *failed = 1;
    if (pulled_column_create(p, &column, &error) != TLSPH_OK) { driver_error(&error); return 0; }
    *failed = tlsph_advance(column.body.solver, (tlsph_real)pulled_column_end(p)) != TLSPH_OK;
    const double elongation = pulled_column_elongation(&column);
    scene_destroy(&column.body);
    return elongation;
}

static int run_study(const pulled_column_parameters *given) {
    static double reached[RATIOS][SCHEMES], place[SCHEMES], paper_place[2] = { BONDS, KERNEL };
    double published[RATIOS][2];
    ex_curve curves[2 * RATIOS];
    ex_axes axes;
    const char *folder = given->options.output[0] ? given->options.output : "out/pulled_column";
    char key[96], path[600];
    for (int r = 0; r < RATIOS; r++)
        for (int scheme = 0; scheme < SCHEMES; scheme++) {
            const pulled_column_parameters p = scheme_parameters(given, scheme, ratios[r]);
            int failed;
            place[scheme] = scheme;
            reached[r][scheme] = elongation_of(&p, &failed);
            snprintf(key, sizeof key, "elongation_%s_%g%s", scheme_keys[scheme], ratios[r], failed ? "" : "_at_least");
            ex_result(key, reached[r][scheme], "percent");
            if (scheme == OWN) ex_check_true(r ? "own_reaches_the_end_0.495" : "own_reaches_the_end_0.45", !failed);
        }
    for (int r = 0; r < RATIOS; r++) {
        for (int i = 0; i < 2; i++) published[r][i] = paper[i][r];
        const ex_curve here = { r ? "nu = 0.495" : "nu = 0.45", place, reached[r], SCHEMES, 2, r };
        const ex_curve there = { r ? "paper, 0.495" : "paper, 0.45", paper_place, published[r], 2, 2, 2 + r };
        curves[2 * r] = here;
        curves[2 * r + 1] = there;
    }
    memset(&axes, 0, sizeof axes);
    axes.title = "elongation at failure or end";
    axes.x_label = "0 own, 1 bonds, 2 kernel, 3, 4 printed forces, 5 first order, 6 linear step";
    axes.y_label = "[%]";
    if (ex_make_directory(folder)) return 1;
    snprintf(path, sizeof path, "%s/study.png", folder);
    ex_plot(path, 720, 460, &axes, curves, 2 * RATIOS);
    return ex_exit_code();
}

int main(int argc, char **argv) {
    pulled_column_parameters p;
    int study = 0;
    const ex_option own[] = {
        { "n", EX_INT, &p.n, NULL, NULL, 2, 64, "spacings across the width of 1 m; 002: 12, centred" },
        { "nu", EX_REAL, &p.poisson, NULL, NULL, -0.9, 0.49999, "Poisson's ratio; 002: 0.45 and 0.495" },
        { "elongation", EX_REAL, &p.elongation, "percent", NULL, 1, 1e5, "at which the pull ends" },
        { "speed", EX_REAL, &p.speed, "m/s", NULL, 1e-3, 1e4, "of the head" },
        { "placement", EX_CHOICE, &p.centred, NULL, "faces|centred", 0, 0, "particles on faces or at cell centres" },
        { "study", EX_FLAG, &study, NULL, NULL, 0, 0, "elongation at failure of seven schemes at nu = 0.45 and 0.495; minutes" } };
    pulled_column_default(&p);
    driver_arguments(argc, argv, "pulled_column", "column pulled until it fails (002 section 5.4)", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    return study ? run_study(&p) : run_column(&p);
}
