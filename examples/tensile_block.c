/*
tensile_block.c, punch_block.c - block with holes, pulled or punched near incompressibility: 001 sections 7.2.1, 7.2.2

Runs {p,F}, {p,F,J} and {p,F,H,J} one after the other and shows the pressure side by side (figures 11, 13, 15). The
pressure's oscillation is measured as scene_oscillation does; figure 12 and 16 are the four instants of the last one.
Checks: at nu >= 0.499 the full set oscillates less than {p,F}: punched, half as much or less; pulled, 0.85 of it, because
there most of what the measure sees is the steep pressure beside the clamped face, which all sets share. J stays near det F
(punched: but for the corners of the hole that closes), energy only falls.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifndef PUNCH
#define PUNCH 0
#endif
#define NAME (PUNCH ? "punch_block" : "tensile_block")

enum { SETS = 3, SHOTS = 4 };
static const int unknowns[SETS] = { TLSPH_PF, TLSPH_PFJ, TLSPH_PFHJ };
static const char *const key[SETS] = { "pF", "pFJ", "pFHJ" };
static const char *const title[SETS] = { "{p,F}", "{p,F,J}", "{p,F,H,J}" };

typedef struct run {
    driver base;
    perforated_block block;
    driver_snapshot shots[SHOTS];
    double start, least_J, drift;
    double oscillation, worst; /* of the pressure: mean over the later half of the run, largest */
    int samples;
} run;

static void after_step(driver *d) {
    run *r = d->user;
    r->least_J = fmin(r->least_J, d->now.jacobian_least);
    r->drift = fmax(r->drift, d->now.drift_largest);
}

static ex_view make_view(const char *heading, const perforated_block_parameters *p) {
    ex_view view;
    memset(&view, 0, sizeof view);
    view.panel_width = 420; view.panel_height = p->punch ? 380 : 560;
    view.camera.azimuth = p->punch ? 225 : 30; view.camera.elevation = p->punch ? 35 : 22;
    view.camera.up_axis = 2; view.camera.zoom = 1;
    view.map = EX_MAP_DIVERGING;
    view.label = "pressure [MPa], tension positive";
    view.heading = heading;
    view.common_scale = 2;
    return view;
}

/* Runs one set of unknowns; its last instant goes to `last`. */
static int run_set(const perforated_block_parameters *p, int set, run *r, driver_snapshot *last) {
    static char folder[600];
    perforated_block_parameters one = *p;
    char name[128];
    tlsph_error error;
    one.options.unknowns = unknowns[set];
    snprintf(folder, sizeof folder, "%s%s%s/%s", p->options.output && p->options.output[0] ? p->options.output : "out/",
             p->options.output && p->options.output[0] ? "" : NAME, "", key[set]);
    one.options.output = folder;
    if (perforated_block_create(&one, &r->block, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&r->base, NAME, &one.options, &r->block.body, one.options.end_time)) return 1;
    r->base.step = after_step;
    r->base.user = r;
    r->start = r->base.now.total_energy;
    r->least_J = 1;
    for (int i = 0; i < 2 * SHOTS && r->base.result == TLSPH_OK; i++) {
        if (driver_run_to(&r->base, one.options.end_time * (i + 1) / (2 * SHOTS)) != TLSPH_OK) break;
        const double now = scene_oscillation(r->block.body.solver, TLSPH_FIELD_PRESSURE);
        if (i >= SHOTS) { r->oscillation += now; r->samples++; }
        r->worst = fmax(r->worst, now);
        if (i % 2) driver_snap(&r->block.body, TLSPH_FIELD_PRESSURE, 0, 1e-6, &r->shots[i / 2]);
    }
    if (r->samples) r->oscillation /= r->samples;
    driver_snap(&r->block.body, TLSPH_FIELD_PRESSURE, 0, 1e-6, last);
    snprintf(last->title, sizeof last->title, "%s, t = %.3g ms", title[set], r->base.now.time * 1e3);
    snprintf(name, sizeof name, "%s block, %s, nu = %g", p->punch ? "punched" : "pulled", title[set], p->nu);
    ex_view view = make_view(name, p);
    driver_render(&r->base, "pressure.png", &view, r->shots, SHOTS, SHOTS, 0.05 / p->n);
    return 0;
}

static void report(const run *r, int set) {
    char text[64];
    const char *const names[4] = { "oscillation", "worst_oscillation", "drift", "minimum_J" };
    const double values[4] = { r->oscillation, r->worst, r->drift, r->least_J };
    for (int i = 0; i < 4; i++) {
        snprintf(text, sizeof text, "%s_%s", key[set], names[i]);
        if (i != 2 || set) ex_result(text, values[i], "1");
    }
    snprintf(text, sizeof text, "%s_energy", key[set]);
    ex_result(text, r->base.now.total_energy / r->start, "of the start");
    snprintf(text, sizeof text, "%s_energy_gain", key[set]);
    ex_check_below(text, r->base.now.total_energy / r->start, 1 + 1e-4);
    if (set && r->base.result == TLSPH_OK) {
        snprintf(text, sizeof text, "%s_drift", key[set]);
        ex_check_below(text, r->drift, PUNCH ? 0.3 : 0.1);
    }
}

static int run_all(const perforated_block_parameters *p) {
    static run r[SETS];
    driver_snapshot last[SETS];
    int code = 0;
    memset(last, 0, sizeof last);
    for (int set = 0; set < SETS && !code; set++) {
        code = run_set(p, set, &r[set], &last[set]);
        if (code) break;
        report(&r[set], set);
        if (set == SETS - 1) {
            ex_view view = make_view(p->punch ? "punched block (001 figure 15)" : "pulled block (001 figures 11, 13)", p);
            driver_render(&r[set].base, "../formulations.png", &view, last, SETS, SETS, 0.05 / p->n);
        }
        /* {p,F} may end early at nu = 0.499 (001: "excessive fluctuations"): what it did until then is its answer */
        if (driver_end(&r[set].base) == 3 && set) code = 3;
    }
    if (!code) {
        ex_result("smoother_pFJ", r[0].oscillation / r[1].oscillation, "times");
        ex_result("smoother_pFHJ", r[0].oscillation / r[2].oscillation, "times");
        if (p->nu >= 0.499) ex_check_below("oscillation_pFHJ_by_pF", r[2].oscillation / r[0].oscillation, PUNCH ? 0.5 : 0.85);
    }
    for (int set = 0; set < SETS; set++) {
        driver_snapshot_free(&last[set]);
        for (int i = 0; i < SHOTS; i++) driver_snapshot_free(&r[set].shots[i]);
        scene_destroy(&r[set].block.body);
    }
    return code ? code : ex_exit_code();
}

int main(int argc, char **argv) {
    perforated_block_parameters p;
    const ex_option own[] = {
        { "n", EX_INT, &p.n, NULL, NULL, 1, 40, "spacings in 0.1 m" },
        { "nu", EX_REAL, &p.nu, NULL, NULL, -0.9, 0.499999, "Poisson's ratio" },
        { "speed", EX_REAL, &p.speed, "m/s", NULL, -1000, 1000, "initial speed of the top" } };
    perforated_block_default(&p, PUNCH);
    driver_arguments(argc, argv, NAME, PUNCH ? "block with holes, punched (001 section 7.2.2)"
                                             : "block with holes, pulled (001 section 7.2.1)", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    return run_all(&p);
}
