/*
rkpm_bar.c - implicit reproducing-kernel bar: nodal integration of coupled thermo-elasticity, section 9 of paper 003

Five ways to integrate the weak form at the nodes are compared (see scenes/rkpm_bar.c): the patch test on irregular
nodes, the first Danilovskaya problem without inertia on even and uneven nodes, its convergence, the dynamic problems, and free
vibrations, where the corrected (VC) methods grow because their stiffness is not symmetric.
*/
#include "common/common.h"
#include "scenes/scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SEEDS 20
#define CURVE 400
#define MOST 4000 /* steps of a history that are kept */

static char folder[512];

static const char *path(const char *file) {
    static char text[1024];
    snprintf(text, sizeof text, "%s/%s", folder, file);
    return text;
}

/* Keys have no hyphens: vc_nsni_error_theta. */
static const char *key(rkpm_method method, const char *rest) {
    static char text[128];
    snprintf(text, sizeof text, "%s_%s", rkpm_names[method], rest);
    for (char *c = text; *c; c++) *c = *c == '-' ? '_' : *c >= 'A' && *c <= 'Z' ? (char)(*c - 'A' + 'a') : *c;
    return text;
}

static double entry(danilovskaya_state s, int i) { return i == 0 ? s.theta : i == 1 ? s.u : s.sigma; }

/* ---- runs and curves --------------------------------------------------------------------------------------------- */

typedef struct outcome {
    rkpm_parameters p;
    danilovskaya_errors errors;
    size_t nodes, samples;
    double *y, *along[3], t[MOST + 1], history[3][MOST + 1]; /* history: at y = 1 */
} outcome;

static void outcome_free(outcome *o) {
    if (!o) return;
    free(o->y);
    for (int i = 0; i < 3; i++) free(o->along[i]);
    free(o);
}

/* NULL where the bar cannot be made or solved. */
static outcome *follow(const rkpm_parameters *p, double end) {
    rkpm_bar *bar = rkpm_create(p);
    outcome *o = calloc(1, sizeof *o);
    const double *y;
    const danilovskaya_state *state;
    int bad = !bar || !o;
    while (!bad && rkpm_time(bar) < end * (1 - 1e-9)) {
        danilovskaya_state probe;
        bad = rkpm_step(bar);
        o->nodes = rkpm_read(bar, &y, &state);
        probe = danilovskaya_at(o->nodes, y, state, 1);
        for (int i = 0; i < 3; i++) o->history[i][o->samples] = entry(probe, i);
        o->t[o->samples] = rkpm_time(bar);
        if (o->samples < MOST) o->samples++;
    }
    if (!bad) {
        o->p = *p;
        o->errors = rkpm_compare(bar);
        o->y = malloc(o->nodes * sizeof *o->y);
        bad = !o->y;
        for (int i = 0; i < 3; i++) bad |= !(o->along[i] = malloc(o->nodes * sizeof **o->along));
        for (size_t k = 0; k < o->nodes && !bad; k++) {
            o->y[k] = y[k];
            for (int i = 0; i < 3; i++) o->along[i][k] = entry(state[k], i);
        }
    }
    rkpm_destroy(bar);
    if (bad) { outcome_free(o); return NULL; }
    return o;
}

/* Exact curve of a field over y at the end of the run, or over t at y = 1; y values are the caller's to free. */
static ex_curve exact_curve(const outcome *o, int field, int along, int colour) {
    double *x = malloc((CURVE + 1) * sizeof *x), *value = malloc((CURVE + 1) * sizeof *value);
    const double end = o->t[o->samples - 1], reach = along ? o->y[o->nodes - 1] : end;
    const ex_curve curve = { "exact", x, value, CURVE + 1, 1, colour };
    for (int i = 0; x && value && i <= CURVE; i++) {
        const double at = reach * i / CURVE;
        x[i] = at;
        const double place = along ? at : 1, time = along ? end : at;
        const danilovskaya_problem problem = (danilovskaya_problem)o->p.problem;
        value[i] = entry(o->p.quasi_static ? danilovskaya_quasi_static(o->p.delta, place, time)
                                           : danilovskaya_exact(problem, o->p.delta, place, time), field);
    }
    return curve;
}

/* One picture of panels; `runs[i]` with their names in every panel, and the exact curve of each delta once. */
static void draw(const char *file, outcome *const *runs, const char *const *names, int count, const int *fields,
                 int panels, int along, const char *title) {
    static const char *const labels[3] = { "theta", "u", "sigma" };
    ex_axes axes[4];
    ex_curve curves[4][16];
    const ex_curve *list[4];
    int counts[4];
    memset(axes, 0, sizeof axes);
    for (int k = 0; k < panels; k++) {
        axes[k].title = title;
        axes[k].x_label = along ? "y" : "t";
        axes[k].y_label = labels[fields[k]];
        counts[k] = 0;
        for (int i = 0; i < count && i < 7; i++) {
            const outcome *o = runs[i];
            const ex_curve c = { names[i], along ? o->y : o->t, along ? o->along[fields[k]] : o->history[fields[k]],
                                 along ? o->nodes : o->samples, 0, i };
            curves[k][counts[k]++] = c;
        }
        for (int i = 0; i < count; i++)
            if (i == 0 || fabs(runs[i]->p.delta - runs[i - 1]->p.delta) > 0)
                 curves[k][counts[k]++] = exact_curve(runs[i], fields[k], along, 7);
        list[k] = curves[k];
    }
    ex_plot_grid(path(file), 640, 420, axes, list, counts, panels, panels);
    for (int k = 0; k < panels; k++)
        for (int j = count; j < counts[k]; j++) { free((void *)curves[k][j].x); free((void *)curves[k][j].y); }
}

/* ---- studies ----------------------------------------------------------------------------------------------------- */

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* 003 table 2, on twenty sets of 11 nodes instead of the one that the paper does not give. */
static void patch_study(void) {
    double median[RKPM_METHODS];
    for (int m = 0; m < RKPM_METHODS; m++) {
        double u[SEEDS], theta[SEEDS];
        for (int s = 0; s < SEEDS; s++)
            if (rkpm_patch((rkpm_method)m, 11, 0.4, (unsigned long)s + 1, &u[s], &theta[s])) u[s] = theta[s] = HUGE_VAL;
        qsort(u, SEEDS, sizeof *u, by_value);
        qsort(theta, SEEDS, sizeof *theta, by_value);
        median[m] = theta[SEEDS / 2];
        ex_result(key((rkpm_method)m, "patch_theta"), median[m], "1");
        ex_result(key((rkpm_method)m, "patch_u"), u[SEEDS / 2], "1");
        if (m == RKPM_VC_DNI || m == RKPM_VC_NSNI)
            ex_check_below(key((rkpm_method)m, "patch_largest"), fmax(u[SEEDS - 1], theta[SEEDS - 1]), 1e-12);
    }
    ex_check_true("patch_dni_above_nsni", median[RKPM_DNI] > median[RKPM_NSNI]);
}

/* 003 section 9.2: without inertia, on even and uneven nodes (figures 4 to 11). */
static int quasi_static_study(void) {
    static const int fields[2] = { 0, 1 };
    outcome *runs[RKPM_METHODS];
    int bad = 0;
    for (int uneven = 0; uneven < 2; uneven++) {
        for (int m = 0; m < RKPM_METHODS; m++) {
            rkpm_parameters p;
            rkpm_default(&p);
            p.method = m;
            p.quasi_static = 1;
            p.jitter = uneven ? 0.4 : 0;
            runs[m] = follow(&p, 2);
            bad |= !runs[m];
            if (!runs[m]) continue;
            ex_result(key((rkpm_method)m, uneven ? "uneven_theta" : "even_theta"), runs[m]->errors.theta, "1");
            ex_result(key((rkpm_method)m, uneven ? "uneven_u" : "even_u"), runs[m]->errors.u, "1");
        }
        if (!bad) {
            draw(uneven ? "quasi_static_uneven_y.png" : "quasi_static_even_y.png", runs, rkpm_names, RKPM_METHODS,
                 fields, 2, 1, "first problem without inertia, t = 2");
            draw(uneven ? "quasi_static_uneven_t.png" : "quasi_static_even_t.png", runs, rkpm_names, RKPM_METHODS,
                 fields, 2, 0, "first problem without inertia, y = 1");
            const double dni = runs[RKPM_DNI]->errors.theta, nsni = runs[RKPM_NSNI]->errors.theta;
            const danilovskaya_errors vc = runs[RKPM_VC_NSNI]->errors;
            ex_check_below(uneven ? "vc_nsni_uneven_theta" : "vc_nsni_even_theta", vc.theta, 5e-3);
            ex_check_below(uneven ? "vc_nsni_uneven_u" : "vc_nsni_even_u", vc.u, 0.025);
            if (uneven) ex_check_true("uneven_dni_above_nsni_above_vc_nsni", dni > nsni && nsni > vc.theta);
        }
        for (int m = 0; m < RKPM_METHODS; m++) outcome_free(runs[m]);
    }
    return bad;
}

/* Figure 12: NSNI on even nodes, error against spacing. Steps of h^2, so that space alone decides. */
static int convergence_study(void) {
    static const double spacings[4] = { 0.2, 0.1, 0.05, 0.025 };
    static const char *const names[4] = { "u, delta = 1", "theta, delta = 1", "u, delta = 0", "theta, delta = 0" };
    const ex_axes axes = { "NSNI, without inertia, t = 2", "spacing", "relative L2 error", 1, 1, 0, 0, 0, 0 };
    ex_curve curves[4];
    double errors[4][4];
    int bad = 0;
    for (int k = 0; k < 4; k++)
        for (int loose = 0; loose < 2; loose++) {
            rkpm_parameters p;
            outcome *o;
            rkpm_default(&p);
            p.method = RKPM_NSNI;
            p.quasi_static = 1;
            p.delta = loose ? 0 : 1;
            p.spacing = spacings[k];
            p.time_step = 0.25 * p.spacing * p.spacing + 5e-4;
            o = follow(&p, 2);
            errors[2 * loose][k] = o ? o->errors.u : HUGE_VAL;
            errors[2 * loose + 1][k] = o ? o->errors.theta : HUGE_VAL;
            bad |= !o;
            outcome_free(o);
        }
    for (int i = 0; i < 4; i++) {
        const ex_curve c = { names[i], spacings, errors[i], 4, 3, i };
        curves[i] = c;
    }
    if (bad) return 1;
    ex_plot(path("figure_12.png"), 800, 560, &axes, curves, 4);
    ex_result("nsni_order_u", log2(errors[0][0] / errors[0][3]) / 3, "1");
    ex_result("nsni_order_theta", log2(errors[1][0] / errors[1][3]) / 3, "1");
    ex_check_true("nsni_order_two", log2(errors[0][0] / errors[0][3]) / 3 > 1.8);
    return 0;
}

/* Figures 13 to 17. */
static int dynamic_study(void) {
    static const struct { int problem; double delta; const char *name; } cases[5] = {
        { DANILOVSKAYA_FIRST, 1, "delta = 1" }, { DANILOVSKAYA_FIRST, 0, "delta = 0" },
        { DANILOVSKAYA_SECOND, 1, "delta = 1" }, { DANILOVSKAYA_SECOND, 0, "delta = 0" },
        { STERNBERG_CHAKRAVORTY, 1, "delta = 1" } };
    static const char *const names[2] = { "delta = 1", "delta = 0" };
    static const char *const keys[3] = { "first", "second", "sternberg" };
    static const int fields[3] = { 0, 1, 2 };
    outcome *runs[5];
    int bad = 0;
    for (int i = 0; i < 5; i++) {
        for (int m = RKPM_NSNI; m <= RKPM_VC_NSNI; m++) { /* the last one is drawn */
            rkpm_parameters p;
            char text[64];
            rkpm_default(&p);
            p.method = m;
            p.problem = cases[i].problem;
            p.delta = cases[i].delta;
            if (m == RKPM_VC_NSNI) outcome_free(runs[i]);
            runs[i] = follow(&p, 2);
            if (!runs[i]) { bad = 1; break; }
            if (cases[i].delta < 1) continue;
            snprintf(text, sizeof text, "%s_theta", keys[cases[i].problem]);
            ex_result(key((rkpm_method)m, text), runs[i]->errors.theta, "1");
            if (m == RKPM_VC_NSNI) ex_check_below(key((rkpm_method)m, text), runs[i]->errors.theta, 2.5e-3);
            snprintf(text, sizeof text, "%s_u", keys[cases[i].problem]);
            ex_result(key((rkpm_method)m, text), runs[i]->errors.u, "1");
            if (m == RKPM_VC_NSNI) ex_check_below(key((rkpm_method)m, text), runs[i]->errors.u, 7.5e-3);
        }
    }
    if (!bad) {
        draw("figures_13_to_15.png", runs, names, 2, fields, 3, 0, "first problem, y = 1");
        draw("figure_16.png", runs + 2, names, 2, fields, 2, 0, "second problem, y = 1");
        draw("figure_17.png", runs + 4, names, 1, fields, 2, 0, "Sternberg and Chakravorty, y = 1");
    }
    for (int i = 0; i < 5; i++) outcome_free(runs[i]);
    return bad;
}

/* Largest growth rates of free vibrations over eight sets of uneven nodes. Symmetric positive stiffness cannot grow.
   The corrected ones are not symmetric: pairs of frequencies become complex. The symmetric part of VC-NSNI alone is
   positive, so that nothing grows with it: asymmetry is the cause. That of VC-DNI has negative values too and is
   worse than the whole: there the correction takes away what little stiffness short waves have. */
static void growth_study(void) {
    for (int m = 0; m < RKPM_METHODS; m++)
        for (int kind = 0; kind < 3; kind++) {
            static const char *const kinds[3] = { "growth", "growth_lumped", "growth_symmetric" };
            double most = -HUGE_VAL;
            for (unsigned long seed = 1; seed <= 8; seed++) {
                rkpm_parameters p;
                double rate = HUGE_VAL;
                rkpm_default(&p);
                p.method = m;
                p.lumped = kind == 1;
                p.symmetric = kind == 2;
                p.jitter = 0.4;
                p.seed = seed;
                p.length = 2;
                p.spacing = 0.05;
                p.time_step = 0.0125;
                if (rkpm_growth(&p, 40, &rate)) rate = HUGE_VAL;
                most = fmax(most, rate);
            }
            ex_result(key((rkpm_method)m, kinds[kind]), most, "c_s/a");
            if (m != RKPM_VC_DNI && (m != RKPM_VC_NSNI || kind == 2))
                ex_check_below(key((rkpm_method)m, kinds[kind]), most, 0.01);
        }
}

/* ---- the run that was asked for ---------------------------------------------------------------------------------- */

static void write_files(const outcome *o) {
    ex_csv csv;
    ex_series series;
    double *points = calloc(3 * o->nodes, sizeof *points);
    const ex_field fields[3] = { { "theta", 1, o->along[0] }, { "u", 1, o->along[1] }, { "sigma", 1, o->along[2] } };
    for (size_t i = 0; points && i < o->nodes; i++) points[3 * i] = o->y[i];
    if (points && !ex_series_open(&series, folder, "rkpm_bar")) {
        ex_series_frame(&series, o->t[o->samples - 1], o->nodes, points, fields, 3);
        ex_series_close(&series);
    }
    if (!ex_csv_open(&csv, folder, "probe.csv", "t,theta,u,sigma")) {
        for (size_t i = 0; i < o->samples; i++) {
            const double row[4] = { o->t[i], o->history[0][i], o->history[1][i], o->history[2][i] };
            ex_csv_row(&csv, row);
        }
        ex_csv_close(&csv);
    }
    free(points);
}

static int run_one(const rkpm_parameters *p, double end) {
    static const int fields[3] = { 0, 1, 2 };
    outcome *o = follow(p, end);
    if (!o) {
        fprintf(stderr, "error: no solution with %s at spacing %g, jitter %g\n", rkpm_names[p->method], p->spacing,
                p->jitter);
        return 3;
    }
    write_files(o);
    draw("run_y.png", &o, &rkpm_names[p->method], 1, fields, 3, 1, "along y at the end");
    draw("run_t.png", &o, &rkpm_names[p->method], 1, fields, 3, 0, "at y = 1");
    ex_result("error_theta", o->errors.theta, "1");
    ex_result("error_u", o->errors.u, "1");
    ex_result("error_sigma", o->errors.sigma, "1");
    outcome_free(o);
    return 0;
}

int main(int argc, char **argv) {
    rkpm_parameters p;
    const char *output = "out/rkpm_bar";
    double end = 2;
    int seed = 1, studies = 1, quiet = 0, code;
    const ex_option options[] = {
        { "method", EX_CHOICE, &p.method, NULL, "dni|vc-dni|nsni|vc-nsni|gi", 0, 0, "integration of the weak form" },
        { "problem", EX_CHOICE, &p.problem, NULL, "first|second|sternberg", 0, 0, "of 003 section 9.3" },
        { "quasi-static", EX_INT, &p.quasi_static, NULL, NULL, 0, 1, "1: first problem without inertia" },
        { "newmark", EX_INT, &p.newmark, NULL, NULL, 0, 1, "0: backward differences" },
        { "lumped", EX_INT, &p.lumped, NULL, NULL, 0, 1, "1: lumped mass" },
        { "delta", EX_REAL, &p.delta, NULL, NULL, 0, 100, "thermo-elastic coupling" },
        { "spacing", EX_REAL, &p.spacing, "a", NULL, 1e-3, 0.5, "of the nodes" },
        { "length", EX_REAL, &p.length, "a", NULL, 3, 100, "of the bar" },
        { "jitter", EX_REAL, &p.jitter, "spacings", NULL, 0, 0.45, "by which inner nodes are moved" },
        { "seed", EX_INT, &seed, NULL, NULL, 0, 1e9, "of the jitter" },
        { "time-step", EX_REAL, &p.time_step, "a/c_s", NULL, 1e-5, 1, "of the implicit scheme" },
        { "end-time", EX_REAL, &end, "a/c_s", NULL, 1e-3, 100, "time to stop at" },
        { "studies", EX_INT, &studies, NULL, NULL, 0, 1, "1: all studies of 003 section 9 after the run" },
        { "output", EX_TEXT, &output, NULL, NULL, 0, 0, "folder to write to" },
        { "quiet", EX_FLAG, &quiet, NULL, NULL, 0, 0, "accepted; there are no progress lines" } };
    rkpm_default(&p);
    ex_arguments(argc, argv, "rkpm_bar", "implicit reproducing-kernel bar (003): nodal integration of thermoelasticity",
                 options, (int)(sizeof options / sizeof *options));
    p.seed = (unsigned long)seed;
    snprintf(folder, sizeof folder, "%s", output);
    if (ex_make_directory(folder)) {
        fprintf(stderr, "error: cannot write to %s\n", folder);
        return 1;
    }
    if (p.quasi_static && p.problem != DANILOVSKAYA_FIRST) {
        fprintf(stderr, "rkpm_bar: --quasi-static 1 knows the first problem only\n");
        return 2;
    }
    code = run_one(&p, end);
    if (code == 0 && studies) {
        patch_study();
        if (quasi_static_study() || convergence_study() || dynamic_study()) code = 3;
        growth_study();
    }
    printf("written to %s\n", folder);
    return code ? code : ex_exit_code();
}
