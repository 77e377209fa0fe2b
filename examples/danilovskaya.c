/*
danilovskaya.c - heated half space with thermo-elastic coupling: figures 13 to 17 of paper 003 by total Lagrangian SPH

The surface of a half space is heated and free. Heat diffuses inwards, and the stress that it makes runs ahead of it as
a wave with a jump at its front. Paper 003 solves these problems with an implicit reproducing-kernel method; here the
explicit solver does, on a bar between rollers, against the exact solution (see scenes/danilovskaya_exact.c).
By default the first problem of the family is run, and then all five cases of the figures in plane strain.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SAMPLES 160  /* of the histories */
#define CURVE 400    /* points of an exact curve */
#define PROBE 1.0    /* y of the histories in 003 */

/* One case: what happened at y = 1, and what stands along y at the end. */
typedef struct outcome {
    danilovskaya_problem problem;
    double delta, end, t[SAMPLES + 1], history[3][SAMPLES + 1], *y, *along[3];
    size_t sections, samples;
    danilovskaya_errors errors;
    danilovskaya_state probe;
} outcome;

static const char *const symbols[3] = { "theta", "u", "sigma" };

static double entry(danilovskaya_state s, int i) { return i == 0 ? s.theta : i == 1 ? s.u : s.sigma; }

static void outcome_free(outcome *o) {
    free(o->y);
    for (int i = 0; i < 3; i++) free(o->along[i]);
    memset(o, 0, sizeof *o);
}

/* Keeps the state along the bar, and of y = 1 as sample k. Returns 0 on success. */
static int look(const danilovskaya *bar, outcome *o, size_t k) {
    danilovskaya_state *state = malloc(bar->sections * sizeof *state);
    int bad = !state || !o->y || danilovskaya_profile(bar, o->y, state);
    for (int i = 0; i < 3 && !bad; i++)
        for (size_t j = 0; j < bar->sections; j++) o->along[i][j] = entry(state[j], i);
    if (!bad) o->probe = danilovskaya_at(bar->sections, o->y, state, PROBE);
    for (int i = 0; i < 3; i++) o->history[i][k] = entry(o->probe, i);
    o->t[k] = danilovskaya_time(bar);
    o->samples = k + 1;
    free(state);
    return bad;
}

/* Runs a bar to its end and keeps what is to be drawn; d: NULL, or the driver that writes frames and ledger. */
static tlsph_result follow(danilovskaya *bar, double end, outcome *o, driver *d) {
    tlsph_result result = TLSPH_OK;
    int bad = 0;
    memset(o, 0, sizeof *o);
    o->problem = (danilovskaya_problem)bar->parameters.problem;
    o->delta = bar->parameters.delta;
    o->end = end;
    o->sections = bar->sections;
    o->y = malloc(bar->sections * sizeof *o->y);
    for (int i = 0; i < 3; i++) bad |= !(o->along[i] = malloc(bar->sections * sizeof **o->along));
    for (size_t k = 0; k <= SAMPLES && !bad && result == TLSPH_OK; k++) {
        result = danilovskaya_advance(bar, end * (double)k / SAMPLES);
        bad = look(bar, o, k);
        if (d && k && result == TLSPH_OK) driver_stepped(d);
    }
    if (bad) return TLSPH_ERROR_MEMORY;
    danilovskaya_compare(bar, &o->errors);
    return result;
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

typedef struct chart { ex_axes axes; ex_curve curves[4]; int count; } chart;

/* A computed curve, and the exact one with dashes; `along`: over y at the end instead of over t at y = 1. */
static void add_curves(chart *c, const outcome *o, int field, int along, const char *names[2]) {
    double *x = malloc((CURVE + 1) * sizeof *x), *exact = malloc((CURVE + 1) * sizeof *exact);
    const double reach = along ? 0.75 * o->y[o->sections - 1] : o->end;
    const ex_curve computed = { names[0], along ? o->y : o->t, along ? o->along[field] : o->history[field],
                                along ? o->sections : o->samples, 0, c->count };
    for (int i = 0; x && exact && i <= CURVE; i++) {
        x[i] = reach * i / CURVE;
        exact[i] = entry(danilovskaya_exact(o->problem, o->delta, along ? x[i] : PROBE, along ? o->end : x[i]), field);
    }
    c->curves[c->count++] = computed;
    if (x && exact) {
        const ex_curve curve = { names[1], x, exact, CURVE + 1, 1, c->count };
        c->curves[c->count++] = curve;
    } else {
        free(x); free(exact);
    }
    if (along) { c->axes.x_low = 0; c->axes.x_high = reach; }
}

static chart start_chart(const char *title, int field, int along) {
    chart c;
    memset(&c, 0, sizeof c);
    c.axes.title = title;
    c.axes.x_label = along ? "y" : "t";
    c.axes.y_label = symbols[field];
    return c;
}

static void draw(driver *d, const char *file, chart *charts, int count, int columns) {
    ex_axes axes[8];
    const ex_curve *curves[8];
    int counts[8];
    for (int i = 0; i < count; i++) {
        axes[i] = charts[i].axes;
        curves[i] = charts[i].curves;
        counts[i] = charts[i].count;
    }
    ex_plot_grid(driver_path(d, file), 640, 420, axes, curves, counts, count, columns);
    for (int i = 0; i < count; i++)
        for (int j = 1; j < charts[i].count; j += 2) {
            free((void *)charts[i].curves[j].x);
            free((void *)charts[i].curves[j].y);
        }
}

static void draw_run(driver *d, const outcome *o) {
    static const char *names[2] = { "computed", "exact" };
    chart charts[6];
    for (int i = 0; i < 6; i++) {
        charts[i] = start_chart(i < 3 ? "along y at the end" : "at y = 1", i % 3, i < 3);
        add_curves(&charts[i], o, i % 3, i < 3, names);
    }
    draw(d, "run.png", charts, 6, 3);
}

/* The cases of figures 13 to 17, and which curve of which of them goes into which figure. */
static const struct { int problem; double delta; const char *names[2]; } cases[] = {
    { DANILOVSKAYA_FIRST, 1, { "delta = 1", "exact" } }, { DANILOVSKAYA_FIRST, 0, { "delta = 0", "exact" } },
    { DANILOVSKAYA_SECOND, 1, { "delta = 1", "exact" } }, { DANILOVSKAYA_SECOND, 0, { "delta = 0", "exact" } },
    { STERNBERG_CHAKRAVORTY, 1, { "delta = 1", "exact" } } };
#define CASES ((int)(sizeof cases / sizeof *cases))
static const struct { const char *file, *title; int problem, fields[2]; } figures[] = {
    { "figure_13.png", "first problem, y = 1", DANILOVSKAYA_FIRST, { 0, -1 } },
    { "figure_14.png", "first problem, y = 1", DANILOVSKAYA_FIRST, { 1, -1 } },
    { "figure_15.png", "first problem, y = 1", DANILOVSKAYA_FIRST, { 2, -1 } },
    { "figure_16.png", "second problem, y = 1", DANILOVSKAYA_SECOND, { 0, 1 } },
    { "figure_17.png", "Sternberg and Chakravorty, y = 1", STERNBERG_CHAKRAVORTY, { 0, 1 } } };

static void draw_figures(driver *d, const outcome *family) {
    for (size_t f = 0; f < sizeof figures / sizeof *figures; f++) {
        chart charts[2];
        int count = 0;
        for (int k = 0; k < 2 && figures[f].fields[k] >= 0; k++) {
            const int field = figures[f].fields[k];
            charts[count] = start_chart(figures[f].title, field, 0);
            for (int i = 0; i < CASES; i++)
                if (cases[i].problem == figures[f].problem) {
                    const char *names[2] = { cases[i].names[0], cases[i].names[1] };
                    add_curves(&charts[count], &family[i], field, 0, names);
                }
            count++;
        }
        draw(d, figures[f].file, charts, count, count);
    }
}

static tlsph_result run_family(driver *d, const danilovskaya_parameters *given, tlsph_error *error) {
    static outcome family[CASES];
    tlsph_result result = TLSPH_OK;
    for (int i = 0; i < CASES && result == TLSPH_OK; i++) {
        danilovskaya_parameters p = *given;
        danilovskaya bar;
        p.dimension = 2; /* the same in uniaxial strain, at half the cost */
        p.problem = cases[i].problem;
        p.delta = cases[i].delta;
        result = danilovskaya_create(&p, &bar, error);
        if (result != TLSPH_OK) break;
        result = follow(&bar, 2, &family[i], NULL);
        if (result != TLSPH_OK) *error = *tlsph_last_error(bar.body.solver);
        danilovskaya_destroy(&bar);
    }
    if (result == TLSPH_OK) draw_figures(d, family);
    for (int i = 0; i < CASES; i++) outcome_free(&family[i]);
    return result;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

static void report(const danilovskaya_parameters *p, const outcome *o) {
    const danilovskaya_state exact = danilovskaya_exact(o->problem, o->delta, PROBE, o->end);
    const double h = p->spacing;
    ex_result("error_theta", o->errors.theta, "1");
    ex_result("error_u", o->errors.u, "1");
    ex_result("error_sigma", o->errors.sigma, "1");
    ex_result("overshoot", o->errors.overshoot, "of the jump");
    for (int i = 0; i < 3; i++) ex_result(symbols[i], entry(o->probe, i), "1");
    ex_result("exact_theta", exact.theta, "1");
    ex_result("exact_u", exact.u, "1");
    ex_result("exact_sigma", exact.sigma, "1");
    ex_check("theta", o->probe.theta, exact.theta, 0.1 * h);
    ex_check("u", o->probe.u, exact.u, 0.1 * h);
    if (p->problem != DANILOVSKAYA_FIRST || fabs(p->delta - 1) > 1e-12) return;
    ex_check_below("error_theta", o->errors.theta, 0.1 * h); /* 5e-3 and 8e-3 at the spacing 0.05, and first order */
    ex_check_below("error_u", o->errors.u, 0.16 * h);
    ex_check_below("overshoot", o->errors.overshoot, 0.1);
}

static int run_bar(const danilovskaya_parameters *p, int family) {
    static danilovskaya bar;
    static driver d;
    static outcome o;
    tlsph_error error;
    const double end = p->options.end_time;
    int code;
    if (danilovskaya_create(p, &bar, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&d, "danilovskaya", &p->options, &bar.body, (end - bar.start) * bar.time_unit)) return 1;
    d.result = follow(&bar, end, &o, &d);
    if (d.result == TLSPH_OK) {
        draw_run(&d, &o);
        report(p, &o);
    }
    if (d.result == TLSPH_OK && family && run_family(&d, p, &error) != TLSPH_OK) {
        danilovskaya_destroy(&bar);
        return driver_error(&error);
    }
    code = driver_end(&d);
    outcome_free(&o);
    danilovskaya_destroy(&bar);
    return code;
}

int main(int argc, char **argv) {
    danilovskaya_parameters p;
    int family = 1, material = 0;
    const ex_option own[] = {
        { "problem", EX_CHOICE, &p.problem, NULL, "first|second|sternberg", 0, 0, "of 003 section 9.3" },
        { "delta", EX_REAL, &p.delta, NULL, NULL, 0, 100, "coupling; 0: exact solution of 0, the solver takes 1e-6" },
        { "spacing", EX_REAL, &p.spacing, "a", NULL, 1e-3, 0.5, "of the particles; a = kappa/c_s is 1 m here" },
        { "length", EX_REAL, &p.length, "a", NULL, 3, 100, "of the bar" },
        { "across", EX_INT, &p.across, NULL, NULL, 1, 20, "spacings across the bar" },
        { "dimension", EX_INT, &p.dimension, NULL, NULL, 2, 3, "2: plane strain" },
        { "material", EX_CHOICE, &material, NULL, "linear|mg", 0, 0, "mg: Mie-Grueneisen" },
        { "load", EX_REAL, &p.load, NULL, NULL, 1e-9, 0.1, "delta times the applied temperature over T0" },
        { "rise", EX_REAL, &p.rise, "spacings", NULL, 0, 100, "first problem: the jump lasts a wave's time over these" },
        { "nsni", EX_REAL, &p.nsni, NULL, NULL, 0, 10, "factor f of the stabilised force instead of sharp gradients" },
        { "family", EX_INT, &family, NULL, NULL, 0, 1, "1: figures 13 to 17 too, in plane strain" } };
    danilovskaya_default(&p);
    p.options.end_time = 2;
    driver_arguments(argc, argv, "danilovskaya",
                     "heated half space against the exact solution; --end-time is in units of a/c_s", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    p.material = material ? TLSPH_MIE_GRUNEISEN : TLSPH_LINEAR;
    if (p.length < p.spacing * 4 || p.dimension * p.spacing > p.length) {
        fprintf(stderr, "danilovskaya: --spacing %g is too wide for --length %g\n", p.spacing, p.length);
        return 2;
    }
    return run_bar(&p, family);
}
