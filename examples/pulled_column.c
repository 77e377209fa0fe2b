/*
pulled_column.c - how far a rubber column can be pulled before the scheme fails: 002 section 5.4

Draws figure 20 (shape and pressure at five elongations) and the force over the elongation beside that of a homogeneous
bar of the same material, which the middle of the column must follow once the waves of the start have died down.

Layers pair up beside the held ends, because the column hardly changes its volume: the first layer beside a foot that may
not shrink sideways may not stretch either. So the first gap stays near 1.2 spacings, while P_0 = P_2 asks the central
difference (x_2 - x_0)/2d for the column's whole stretch: the second gap takes nearly twice its share, the third too little,
and as each interior gradient sees two gaps only, the pattern fades over a width of the column and not over a spacing. Each
operator, kernel and dissipation does it, bonds most; with --ends sliding there is none.
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
    const double pairing = scene_alternation(&r.column.body, 2);
    if (p->sliding) ex_check_below("layer_pairing", pairing, 0.02);
    else ex_result("layer_pairing", pairing, "spacings");
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

enum { RATIOS = 2, OWN_ROWS = 4, STEP_ROWS = 10, MATRIX_ROWS = 12, ROWS = OWN_ROWS + MATRIX_ROWS + STEP_ROWS };
enum { OWN_SET = 1, PAPER_SET = 2, MATRIX_SET = 4, STEP_SET = 8 };

/* A row: what differs from the setting of 002 (or, `own`, from the library's), and to which sets it belongs. */
typedef struct scheme_row {
    char key[64];
    int sets, own, gradient, force, dissipation, step, unknowns;
    double cfl; /* 0: that of the command line */
} scheme_row;

static const scheme_row other_rows[OWN_ROWS + STEP_ROWS] = {
    { "own", OWN_SET | PAPER_SET, 1, TLSPH_CORRECTED_KERNEL, TLSPH_ADJOINT, TLSPH_LIMITED, TLSPH_STEP_BY_PARTICLE, TLSPH_PF, 0 },
    { "own_pFJ", OWN_SET, 1, TLSPH_CORRECTED_KERNEL, TLSPH_ADJOINT, TLSPH_LIMITED, TLSPH_STEP_BY_PARTICLE, TLSPH_PFJ, 0 },
    { "own_first_order", OWN_SET, 1, TLSPH_CORRECTED_KERNEL, TLSPH_ADJOINT, TLSPH_FIRST_ORDER, TLSPH_STEP_BY_PARTICLE, TLSPH_PF, 0 },
    { "own_jst", OWN_SET, 1, TLSPH_CORRECTED_KERNEL, TLSPH_ADJOINT, TLSPH_JST, TLSPH_STEP_BY_PARTICLE, TLSPH_PF, 0 },
    /* (31), (32) by the p speed of the undeformed body, which does not know how the column stiffens; the last: by the stretch */
#define LINEAR(name, gradient, force, cfl) { name, STEP_SET, 0, gradient, force, TLSPH_JST, TLSPH_STEP_BY_PAIR_LINEAR, TLSPH_PF, cfl }
    LINEAR("bonds_linear_step_0.4", TLSPH_BOND, TLSPH_ADJOINT, 0.4),
    LINEAR("bonds_linear_step_0.5", TLSPH_BOND, TLSPH_ADJOINT, 0.5),
    LINEAR("bonds_linear_step_0.6", TLSPH_BOND, TLSPH_ADJOINT, 0.6),
    LINEAR("bonds_linear_step_0.7", TLSPH_BOND, TLSPH_ADJOINT, 0.7),
    LINEAR("bonds_linear_step_0.9", TLSPH_BOND, TLSPH_ADJOINT, 0.9),
    LINEAR("kernel_linear_step_0.5", TLSPH_FIRST_KERNEL, TLSPH_ADJOINT, 0.5),
    LINEAR("kernel_linear_step_0.6", TLSPH_FIRST_KERNEL, TLSPH_ADJOINT, 0.6),
    LINEAR("bonds_printed_force_linear_step_0.5", TLSPH_BOND, TLSPH_FORCE_AS_PRINTED, 0.5),
    LINEAR("kernel_printed_force_linear_step_0.5", TLSPH_FIRST_KERNEL, TLSPH_FORCE_AS_PRINTED, 0.5),
#undef LINEAR
    { "bonds_pair_step_0.5", STEP_SET, 0, TLSPH_BOND, TLSPH_ADJOINT, TLSPH_JST, TLSPH_STEP_BY_PAIR, TLSPH_PF, 0.5 } };

/* Own rows, then gradient x force x dissipation, then the paper's steps. */
static scheme_row row_of(int i) {
    static const char *const gradients[2] = { "kernel", "bonds" }, *const forces[2] = { "", "_printed_force" };
    static const char *const dissipations[3] = { "", "_limited", "_first_order" }; /* the first: JST */
    static const int dissipation_kinds[3] = { TLSPH_JST, TLSPH_LIMITED, TLSPH_FIRST_ORDER };
    if (i < OWN_ROWS) return other_rows[i];
    if (i >= OWN_ROWS + MATRIX_ROWS) return other_rows[i - MATRIX_ROWS];
    const int m = i - OWN_ROWS, bonds = m % 2, printed = m / 2 % 2, damped = m / 4;
    scheme_row row = { "", MATRIX_SET | (bonds && !damped ? PAPER_SET : 0), 0, bonds ? TLSPH_BOND : TLSPH_FIRST_KERNEL,
                       printed ? TLSPH_FORCE_AS_PRINTED : TLSPH_ADJOINT, dissipation_kinds[damped], TLSPH_STEP_BY_PARTICLE,
                       TLSPH_PF, 0 };
    snprintf(row.key, sizeof row.key, "%s%s%s", gradients[bonds], forces[printed], dissipations[damped]);
    return row;
}

static const int row_sets[] = { OWN_SET | MATRIX_SET | STEP_SET, OWN_SET, PAPER_SET, MATRIX_SET, STEP_SET };
static const double ratios[RATIOS] = { 0.45, 0.495 };
static const double paper[2][RATIOS] = { { 526.80, 464.50 }, { 421.90, 427.58 } }; /* figure 20: bonds, JST-SPH */

typedef struct study_options { int on, set, ratio; double seconds; const char *row; } study_options;

static pulled_column_parameters row_parameters(const pulled_column_parameters *given, const scheme_row *row, double poisson) {
    pulled_column_parameters p = *given;
    p.poisson = poisson;
    p.centred = !row->own;
    if (!row->own) scene_options_of_002(&p.options, 1.0 / 64);
    p.options.biharmonic = 1.0 / 64;
    p.options.operator_kind = row->gradient;
    p.options.force_form = row->force;
    p.options.dissipation = row->dissipation;
    p.options.step_rule = row->step;
    p.options.unknowns = row->unknowns;
    if (row->cfl > 0) p.options.cfl = row->cfl;
    return p;
}

/* What became of a run: it reached the end, failed, or used up its processor time. */
typedef enum outcome { REACHED, FAILED, OUT_OF_TIME } outcome;

/* *force: by that of a homogeneous bar, where the run stopped: what it was worth. */
static outcome elongation_of(const pulled_column_parameters *p, double seconds, double *elongation, double *force) {
    static pulled_column column;
    const double end = pulled_column_end(p), began = ex_cpu_seconds();
    outcome what = REACHED;
    tlsph_error error;
    *elongation = *force = 0;
    if (pulled_column_create(p, &column, &error) != TLSPH_OK) { driver_error(&error); return FAILED; }
    while (what == REACHED && end - (double)tlsph_time(column.body.solver) > 1e-10 * end) {
        if (tlsph_step(column.body.solver, (tlsph_real)(end - (double)tlsph_time(column.body.solver))) != TLSPH_OK) what = FAILED;
        else if (seconds > 0 && ex_cpu_seconds() - began > seconds) what = OUT_OF_TIME;
    }
    *elongation = pulled_column_elongation(&column);
    *force = pulled_column_force(&column) / pulled_column_bar_force(&column.body.material, 1 + *elongation / 100);
    scene_destroy(&column.body);
    return what;
}

static void draw_study(const char *folder, const double *place, double reached[RATIOS][ROWS], int count) {
    static double x[2][2], levels[RATIOS][2][2];
    static const char *const names[4] = { "paper, bonds, 0.45", "paper, JST-SPH, 0.45", "paper, bonds, 0.495", "paper, JST-SPH, 0.495" };
    ex_curve curves[3 * RATIOS];
    ex_axes axes;
    char path[600];
    for (int r = 0; r < RATIOS; r++) {
        const ex_curve here = { r ? "nu = 0.495" : "nu = 0.45", place, reached[r], (size_t)count, 2, r };
        curves[3 * r] = here;
        for (int i = 0; i < 2; i++) {
            x[i][0] = 0; x[i][1] = count - 1;
            levels[r][i][0] = levels[r][i][1] = paper[i][r];
            const ex_curve there = { names[2 * r + i], x[i], levels[r][i], 2, i, 2 + 2 * r };
            curves[3 * r + 1 + i] = there;
        }
    }
    memset(&axes, 0, sizeof axes);
    axes.title = "elongation at failure or end";
    axes.x_label = "row of the study, as printed";
    axes.y_label = "[%]";
    snprintf(path, sizeof path, "%s/study.png", folder);
    ex_plot(path, 760, 480, &axes, curves, 3 * RATIOS);
}

static int is_chosen(const study_options *study, const scheme_row *row) {
    return study->row[0] ? !strcmp(study->row, row->key) : row->sets & row_sets[study->set];
}

static int unknown_row(const study_options *study) {
    fprintf(stderr, "pulled_column: --row has the value '%s'; allowed is", study->row);
    for (int i = 0; i < ROWS; i++) fprintf(stderr, " %s", row_of(i).key);
    fprintf(stderr, "\n");
    return 2;
}

/* The Courant number by the current speed across the column at failure. It is the same, 0.92 to 0.99 at n = 3, from 770 % at
   0.4 to 75 % at 0.9 of the undeformed body's speed: it is the step that fails, not the scheme. */
static void report_courant(const scheme_row *row, const pulled_column_parameters *p, double poisson, double elongation) {
    tlsph_material material = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    char key[96];
    material.young = 17000000;
    material.density = 1100;
    material.poisson = (tlsph_real)poisson;
    snprintf(key, sizeof key, "courant_at_failure_%s_%g", row->key, poisson);
    const double courant = p->options.cfl * pulled_column_stiffening(&material, 1 + elongation / 100);
    if (p->n == 3 && row->force == TLSPH_ADJOINT && poisson < 0.46) ex_check(key, courant, 0.95, 0.06);
    else ex_result(key, courant, "1");
}

/* Prints each run as soon as it is done: the elongation at failure, at the end (at least), or when its time was up. */
static int run_study(const pulled_column_parameters *given, const study_options *study) {
    static const char *const suffix[3] = { "_at_least", "", "_out_of_time" };
    static double reached[RATIOS][ROWS], place[ROWS];
    const char *folder = given->options.output[0] ? given->options.output : "out/pulled_column";
    int count = 0;
    char key[96];
    for (int i = 0; i < ROWS; i++) {
        const scheme_row row = row_of(i);
        if (!is_chosen(study, &row)) continue;
        for (int r = 0; r < RATIOS; r++) {
            if (study->ratio && study->ratio != r + 1) continue;
            const pulled_column_parameters p = row_parameters(given, &row, ratios[r]);
            const double began = ex_cpu_seconds();
            double force;
            const outcome what = elongation_of(&p, study->seconds, &reached[r][count], &force);
            snprintf(key, sizeof key, "elongation_%s_%g%s", row.key, ratios[r], suffix[what]);
            ex_result(key, reached[r][count], "percent");
            snprintf(key, sizeof key, "force_by_bar_%s_%g", row.key, ratios[r]);
            ex_result(key, force, "1");
            if (!given->options.quiet) fprintf(stderr, "%s: %.0f s\n", key, ex_cpu_seconds() - began);
            if (row.sets & STEP_SET && what == FAILED) report_courant(&row, &p, ratios[r], reached[r][count]);
            if (i == 0) ex_check_true(r ? "own_does_not_fail_0.495" : "own_does_not_fail_0.45", what != FAILED);
        }
        place[count] = count;
        count++;
    }
    if (!count) return unknown_row(study);
    if (ex_make_directory(folder)) return 1;
    draw_study(folder, place, reached, count);
    return ex_exit_code();
}

int main(int argc, char **argv) {
    pulled_column_parameters p;
    study_options study = { 0, 0, 0, 0, "" };
    const ex_option own[] = {
        { "n", EX_INT, &p.n, NULL, NULL, 2, 64, "spacings across the width of 1 m; 002: 12, centred" },
        { "nu", EX_REAL, &p.poisson, NULL, NULL, -0.9, 0.49999, "Poisson's ratio; 002: 0.45 and 0.495" },
        { "elongation", EX_REAL, &p.elongation, "percent", NULL, 1, 1e5, "at which the pull ends" },
        { "speed", EX_REAL, &p.speed, "m/s", NULL, 1e-3, 1e4, "of the head" },
        { "placement", EX_CHOICE, &p.centred, NULL, "faces|centred", 0, 0, "particles on faces or at cell centres" },
        { "ends", EX_CHOICE, &p.sliding, NULL, "held|sliding", 0, 0, "sideways, in foot and head" },
        { "study", EX_FLAG, &study.on, NULL, NULL, 0, 0, "elongation at failure of many schemes at nu = 0.45 and 0.495; minutes" },
        { "rows", EX_CHOICE, &study.set, NULL, "all|own|paper|matrix|step", 0, 0,
          "of the study; matrix: gradient x force x dissipation; step: the paper's time steps" },
        { "ratio", EX_CHOICE, &study.ratio, NULL, "both|0.45|0.495", 0, 0, "Poisson's ratios of the study" },
        { "quarter", EX_INT, &p.quarter, NULL, NULL, 0, 1, "1: a quarter of the section between rollers (even n, faces)" },
        { "row", EX_TEXT, &study.row, NULL, NULL, 0, 0, "one row of the study by its name" },
        { "seconds", EX_REAL, &study.seconds, "s", NULL, 0, 1e6, "processor time after which a run of the study is given up; 0: none" } };
    pulled_column_default(&p);
    driver_arguments(argc, argv, "pulled_column", "column pulled until it fails (002 section 5.4)", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    return study.on ? run_study(&p, &study) : run_column(&p);
}
