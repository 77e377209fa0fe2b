/*
stent.c - perforated tube, pushed together to two fifths of its length: 001 section 7.3.2

Draws the whole tube (the eighth and its mirror images) with pressure at four instants, as in figures 29 and 30. Checks that
no particle inverts, that the end goes the way of (60), and that work, stored energy and losses add up.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SHOTS = 4 };

typedef struct run {
    driver base;
    stent tube;
    driver_snapshot shots[SHOTS];
    driver_history history;
    double least_J, largest_residual, largest_work;
} run;

static void after_step(driver *d) {
    run *r = d->user;
    const double row[4] = { d->now.kinetic_energy, d->now.strain_energy, d->now.external_work, d->now.dissipation };
    r->least_J = fmin(r->least_J, d->now.jacobian_least);
    r->largest_residual = fmax(r->largest_residual, fabs(d->now.energy_residual));
    r->largest_work = fmax(r->largest_work, fabs(d->now.external_work));
    driver_history_add(&r->history, d->now.time, row);
}

/* The eighth and its images at X = 0, Y = 0 and Z = 0. */
static void mirror(driver_snapshot *s) {
    const size_t n = s->count;
    double *positions = malloc(24 * n * sizeof *positions), *F = malloc(72 * n * sizeof *F), *values = malloc(8 * n * sizeof *values);
    if (!positions || !F || !values) { free(positions); free(F); free(values); return; }
    for (size_t image = 0; image < 8; image++)
        for (size_t i = 0; i < n; i++) {
            values[image * n + i] = s->values[i];
            for (size_t k = 0; k < 3; k++)
                positions[3 * (image * n + i) + k] = (image >> k & 1 ? -1 : 1) * s->positions[3 * i + k];
            for (size_t k = 0; k < 9; k++)
                F[9 * (image * n + i) + k] = ((image >> (k / 3) ^ image >> (k % 3)) & 1 ? -1 : 1) * s->F[9 * i + k];
        }
    free(s->positions); free(s->F); free(s->values);
    s->positions = positions; s->F = F; s->values = values;
    s->count = 8 * n;
}

static void draw(run *r) {
    static const driver_chart chart = { "energies of the eighth", "[mJ]", 0, 4, { "kinetic", "strain", "work", "dissipated" } };
    ex_view view;
    memset(&view, 0, sizeof view);
    view.panel_width = 460; view.panel_height = 420;
    view.camera.azimuth = 35; view.camera.elevation = 20; view.camera.up_axis = 2; view.camera.zoom = 1;
    view.map = EX_MAP_DIVERGING;
    view.label = "pressure [kPa], tension positive";
    view.heading = "stent-like structure (001 figures 29, 30)";
    view.common_scale = 2;
    for (int i = 0; i < SHOTS; i++) if (r->shots[i].count) mirror(&r->shots[i]);
    driver_render(&r->base, "pressure.png", &view, r->shots, SHOTS, 2, r->tube.parameters.spacing / 2);
    for (size_t i = 0; i < 4 * r->history.count; i++) r->history.values[i] *= 1e3;
    driver_plot(&r->base, "energies.png", &r->history, &chart, 1, 1);
}

static void report(const run *r) {
    const tlsph_particles *particles = &r->tube.body.cloud.particles;
    tlsph_real *x = scene_read(r->tube.body.solver, TLSPH_FIELD_POSITION);
    const double start = r->tube.parameters.start_time;
    double volume = 0, way = 0, count = 0;
    for (size_t i = 0; x && i < particles->count; i++) {
        volume += (double)particles->volumes[i];
        if ((double)particles->positions[3 * i + 2] < 0.010 * (1 - 1e-6)) continue;
        way += (double)particles->positions[3 * i + 2] - (double)x[3 * i + 2];
        count++;
    }
    free(x);
    ex_result("particles", (double)particles->count, "1");
    ex_result("steps", (double)r->base.now.step, "1");
    ex_result("volume", volume, "m^3");
    ex_result("shortening", way / fmax(count, 1), "m");
    ex_result("minimum_J", r->least_J, "1");
    ex_result("strain_energy", r->base.now.strain_energy, "J");
    ex_result("pressure_oscillation", scene_oscillation(r->tube.body.solver, TLSPH_FIELD_PRESSURE), "1");
    ex_check("volume", volume, stent_volume(&r->tube.parameters), 0.1 * volume); /* the holes are polygons */
    ex_check_true("positive_J", r->least_J > 0);
    ex_check("shortening", way / fmax(count, 1),
             stent_shortening(start + r->base.now.time) - stent_shortening(start), 1e-6);
    ex_check_below("energy_residual_by_work", r->largest_residual / fmax(r->largest_work, 1e-300), 0.02);
}

static int run_stent(const stent_parameters *p) {
    static run r;
    tlsph_error error;
    int code;
    if (stent_create(p, &r.tube, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&r.base, "stent", &p->options, &r.tube.body, p->options.end_time - p->start_time)) return 1;
    r.history.columns = 4;
    r.least_J = 1;
    r.base.step = after_step;
    r.base.user = &r;
    for (int i = 0; i < SHOTS && r.base.result == TLSPH_OK; i++) {
        /* the way is an S in time: pictures at about equal shares of it say more than at equal times */
        static const double share[SHOTS] = { 0.62, 0.69, 0.76, 1 };
        const double time = p->options.end_time * share[i];
        if (driver_run_to(&r.base, time - p->start_time) != TLSPH_OK) break;
        driver_snap(&r.tube.body, TLSPH_FIELD_PRESSURE, 0, 1e-3, &r.shots[i]);
        snprintf(r.shots[i].title, sizeof r.shots[i].title, "t = %.4g s", time);
    }
    draw(&r);
    if (r.base.result == TLSPH_OK) report(&r);
    code = driver_end(&r.base);
    driver_history_free(&r.history);
    for (int i = 0; i < SHOTS; i++) driver_snapshot_free(&r.shots[i]);
    scene_destroy(&r.tube.body);
    return code;
}

int main(int argc, char **argv) {
    stent_parameters p;
    const ex_option own[] = {
        { "spacing", EX_REAL, &p.spacing, "m", NULL, 0.00005, 0.0006, "distance of particles; the wall is 0.5 mm" },
        { "around", EX_INT, &p.around, NULL, NULL, 4, 24, "holes on the circumference, a multiple of 4" },
        { "rows", EX_INT, &p.rows, NULL, NULL, 1, 4, "rows of holes on half the length" },
        { "young", EX_REAL, &p.young, "Pa", NULL, 1, 1e15, "Young's modulus; the paper's text: 17e6, figures: 0.9e6" },
        { "density", EX_REAL, &p.density, "kg/m^3", NULL, 1, 1e5, "the paper's text: 1100, figures: 1000" },
        { "start-time", EX_REAL, &p.start_time, "s", NULL, 0, 1, "of the paper's clock; before 0.008 s the end moves 22 um" },
        { "nu", EX_REAL, &p.nu, NULL, NULL, -0.9, 0.5, "Poisson's ratio; 0.5 itself needs --scheme incompressible" } };
    stent_default(&p);
    driver_arguments(argc, argv, "stent", "perforated tube pushed together (001 section 7.3.2)", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    if (!(p.start_time < 0.6 * p.options.end_time)) {
        fprintf(stderr, "stent: --start-time must be less than 0.6 of --end-time\n");
        return 2;
    }
    if (p.around % 4) {
        fprintf(stderr, "stent: --around must be a multiple of 4, found %d\n", p.around);
        return 2;
    }
    return run_stent(&p);
}
