/*
l_block.c - L-shaped block, loaded for 5 s and then flying free with warm and cold ends: 000 section 7.2

Draws the paper's figures 5 (pressure at 7.7 s; four resolutions with --study), 6 (11 s), 7 (velocity and displacement
at X = (0, 10, 0) m), 8 (momenta, energies, entropy) and 9 (sequence), and checks what the section claims: both momenta
conserved, total energy constant, entropy growing and ballistic energy falling after the loading.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- what is kept at which time ---------------------------------------------------------------------------------- */

enum { FIGURE_5, FIGURE_6A, FIGURE_6B, FIGURE_9A, FIGURE_9B = FIGURE_9A + 5, SNAPSHOTS = FIGURE_9B + 5 };

typedef struct moment { double time; tlsph_field field; double scale; } moment;

#define PRESSURE TLSPH_FIELD_PRESSURE, 1e-3 /* kPa, tension positive as in the paper */
#define TEMPERATURE TLSPH_FIELD_TEMPERATURE, 1
static const moment moments[SNAPSHOTS] = {
    { 7.7, PRESSURE }, { 11, PRESSURE }, { 11, TEMPERATURE },                                              /* 5, 6 */
    { 0, TEMPERATURE }, { 10, TEMPERATURE }, { 20, TEMPERATURE }, { 25, TEMPERATURE }, { 30, TEMPERATURE }, /* 9 */
    { 0, PRESSURE }, { 8, PRESSURE }, { 18, PRESSURE }, { 28, PRESSURE }, { 38, PRESSURE } };

/* Extremes over the run: what the checks need. */
typedef struct extremes {
    double linear;                     /* |p| */
    double angular, energy;            /* deviation from the values at the end of the loading */
    double entropy_step, ballistic_step; /* least change of entropy, largest of ballistic energy (after loading) in a step */
    double drift;
} extremes;

typedef struct run {
    driver base;
    l_block block;
    driver_history history;            /* 3 velocities, 3 displacements, 3 + 3 momenta, 4 energies, entropy */
    ex_csv probe;
    driver_snapshot snapshots[SNAPSHOTS];
    tlsph_ledger start, before, released; /* at t = 0; of the step before; at the end of the loading */
    extremes worst;
} run;

#define HISTORY_COLUMNS 17

static double length3(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static void read_probe(const l_block *block, double values[6]) {
    tlsph_real *v = scene_read(block->body.solver, TLSPH_FIELD_VELOCITY);
    tlsph_real *u = scene_read(block->body.solver, TLSPH_FIELD_DISPLACEMENT);
    for (size_t i = 0; v && u && i < 3; i++) {
        values[i] = (double)v[3 * block->probe + i];
        values[3 + i] = (double)u[3 * block->probe + i];
    }
    free(v); free(u);
}

static void record(run *r) {
    const tlsph_ledger *l = &r->base.now;
    double row[HISTORY_COLUMNS] = { 0 }, probe[7];
    read_probe(&r->block, row);
    memcpy(row + 6, l->linear_momentum, 3 * sizeof *row);
    memcpy(row + 9, l->angular_momentum, 3 * sizeof *row);
    /* changes since t = 0: the warm and cold ends alone put total and internal energy some 5e4 J off zero */
    row[12] = l->kinetic_energy;
    row[13] = l->strain_energy + l->thermal_energy - r->start.strain_energy - r->start.thermal_energy;
    row[14] = l->total_energy - r->start.total_energy;
    row[15] = l->ballistic_energy - r->start.ballistic_energy;
    row[16] = l->entropy - r->start.entropy;
    driver_history_add(&r->history, l->time, row);
    probe[0] = l->time;
    memcpy(probe + 1, row, 6 * sizeof *row);
    ex_csv_row(&r->probe, probe);
}

static void track(run *r) {
    const tlsph_ledger *l = &r->base.now;
    extremes *w = &r->worst;
    double change[3];
    w->linear = fmax(w->linear, length3(l->linear_momentum));
    w->drift = fmax(w->drift, l->drift_largest);
    w->entropy_step = fmin(w->entropy_step, l->entropy - r->before.entropy);
    if (r->released.time > 0) {
        for (int i = 0; i < 3; i++) change[i] = l->angular_momentum[i] - r->released.angular_momentum[i];
        w->angular = fmax(w->angular, length3(change));
        w->energy = fmax(w->energy, fabs(l->total_energy - r->released.total_energy));
        w->ballistic_step = fmax(w->ballistic_step, l->ballistic_energy - r->before.ballistic_energy);
    } else if (l->time >= 2 * r->block.parameters.ramp * (1 - 1e-9)) {
        r->released = *l;
    }
    r->before = *l;
}

static void after_step(driver *d) {
    run *r = d->user;
    record(r);
    track(r);
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

static int snap_due(run *r, double time) {
    int bad = 0;
    for (int i = 0; i < SNAPSHOTS; i++)
        if (moments[i].time <= time && moments[i].time >= time)
            bad |= driver_snap(&r->block.body, moments[i].field, 0, moments[i].scale, &r->snapshots[i]);
    return bad;
}

/* The next instant after t that must be met exactly: kinks of the load and times of pictures. */
static double next_stop(const run *r, double t) {
    const double ramp = r->block.parameters.ramp;
    double stop = r->block.parameters.options.end_time;
    for (int i = 0; i < SNAPSHOTS; i++) if (moments[i].time > t) stop = fmin(stop, moments[i].time);
    for (int i = 1; i < 3; i++) if (i * ramp > t) stop = fmin(stop, i * ramp);
    return stop;
}

static void simulate(run *r) {
    const double end = r->block.parameters.options.end_time;
    double t = 0;
    r->start = r->before = r->base.now;
    record(r);
    if (r->block.parameters.options.thermal != TLSPH_ISOTHERMAL) snap_due(r, 0);
    while (t < end) {
        t = next_stop(r, t);
        if (driver_run_to(&r->base, t) != TLSPH_OK) return;
        snap_due(r, t);
    }
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

static ex_view make_view(const char *label, const char *heading, ex_map map) {
    /* from the front, with the cold face X = 6 m in sight */
    return driver_view(380, 460, 30, 15, 1, map, label, heading);
}

static const char pressure_label[] = "pressure [kPa], tension positive", temperature_label[] = "temperature [K]";

static void draw_bodies(run *r) {
    const double radius = r->block.parameters.spacing / 2;
    ex_view view = make_view(pressure_label, "L-block, pressure at 7.7 s (000 figure 5)", EX_MAP_DIVERGING);
    driver_render(&r->base, "figure5_pressure.png", &view, &r->snapshots[FIGURE_5], 1, 1, radius);
    view = make_view(pressure_label, "L-block, pressure at 11 s (000 figure 6)", EX_MAP_DIVERGING);
    driver_render(&r->base, "figure6_pressure.png", &view, &r->snapshots[FIGURE_6A], 1, 1, radius);
    view = make_view(temperature_label, "L-block, temperature at 11 s (000 figure 6)", EX_MAP_HEAT);
    view.low = 270; view.high = 300;
    driver_render(&r->base, "figure6_temperature.png", &view, &r->snapshots[FIGURE_6B], 1, 1, radius);
    view = make_view(temperature_label, "L-block, temperature (000 figure 9)", EX_MAP_HEAT);
    view.low = 270; view.high = 300;
    driver_render(&r->base, "figure9_temperature.png", &view, &r->snapshots[FIGURE_9A], 5, 5, radius);
    view = make_view(pressure_label, "L-block, pressure (000 figure 9)", EX_MAP_DIVERGING);
    driver_render(&r->base, "figure9_pressure.png", &view, &r->snapshots[FIGURE_9B], 5, 5, radius);
}

static void draw_curves(run *r) {
    static const driver_chart at_probe[] = {
        { "velocity at X = (0, 10, 0) m (000 figure 7a)", "v [m/s]", 0, 3, { "v_x", "v_y", "v_z" } },
        { "displacement at X = (0, 10, 0) m (000 figure 7b)", "u [m]", 3, 3, { "u_x", "u_y", "u_z" } } };
    static const driver_chart balances[] = {
        { "linear momentum (000 figure 8a)", "[kg m/s]", 6, 3, { "x", "y", "z" } },
        { "angular momentum (000 figure 8b)", "[kg m2/s]", 9, 3, { "x", "y", "z" } },
        { "energies since t = 0 (000 figure 8c)", "[J]", 12, 4, { "kinetic", "internal", "total", "ballistic" } },
        { "entropy since t = 0 (000 figure 8d)", "[J/K]", 16, 1, { "entropy" } } };
    driver_plot(&r->base, "figure7_probe.png", &r->history, at_probe, 2, 2);
    driver_plot(&r->base, "figure8_balances.png", &r->history, balances, 4, 2);
}

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static void check(const run *r) {
    const double impulse = l_block_impulse(&r->block.parameters), angular = length3(r->released.angular_momentum);
    const double work = r->released.external_work, entropy_scale = 1e-12 * fmax(1, fabs(r->base.now.entropy));
    const int thermal = r->block.parameters.options.thermal != TLSPH_ISOTHERMAL;
    ex_result("particles", (double)tlsph_count(r->block.body.solver), "1");
    ex_result("steps", (double)r->base.now.step, "1");
    ex_result("time", r->base.now.time, "s");
    ex_result("loading_work", work, "J");
    ex_result("loading_impulse", impulse, "N s");
    ex_result("angular_momentum", angular, "kg m2/s");
    ex_check_below("linear_momentum_by_impulse", r->worst.linear / impulse, 1e-11);
    ex_check_below("jacobian_drift", r->worst.drift, 0.02);
    if (!(r->released.time > 0)) return; /* stopped while the loads act */
    ex_check_below("angular_momentum_change", r->worst.angular / angular, 1e-8);
    if (r->block.parameters.options.thermal == TLSPH_ENERGY) /* the entropy form balances energy to the step's order only */
        ex_check_below("total_energy_change_by_work", r->worst.energy / work, 1e-8);
    if (!thermal) return;
    ex_result("entropy_gain", r->base.now.entropy - r->start.entropy, "J/K");
    ex_check_below("entropy_largest_fall", 0 - r->worst.entropy_step, entropy_scale);
    ex_check_below("ballistic_largest_rise", r->worst.ballistic_step, 293.15 * entropy_scale);
}

/* ---- study of four resolutions: figure 5 and the costs ----------------------------------------------------------- */

#define STUDIES 4
#define SAMPLE 0.1 /* s between samples of the velocity at the probe */

typedef struct study {
    double spacing, particles, steps, cpu;
    driver_history history; /* velocity and displacement at the probe */
    driver_snapshot snapshot;
} study;

static tlsph_result study_run(const l_block_parameters *base, double end, study *s, tlsph_error *error) {
    l_block_parameters p = *base;
    l_block block;
    tlsph_result result;
    double began;
    p.spacing = s->spacing;
    s->history.columns = 6;
    result = l_block_create(&p, &block, error);
    if (result != TLSPH_OK) return result;
    began = ex_cpu_seconds();
    for (int i = 1; result == TLSPH_OK && i * SAMPLE < end * (1 + 1e-9); i++) {
        double values[6] = { 0 };
        result = tlsph_advance(block.body.solver, (tlsph_real)(i * SAMPLE));
        read_probe(&block, values);
        driver_history_add(&s->history, i * SAMPLE, values);
        if (i == 77) driver_snap(&block.body, TLSPH_FIELD_PRESSURE, 0, 1e-3, &s->snapshot); /* 7.7 s, figure 5 */
    }
    s->cpu = ex_cpu_seconds() - began;
    s->particles = (double)tlsph_count(block.body.solver);
    s->steps = (double)tlsph_step_count(block.body.solver);
    if (result != TLSPH_OK) *error = *tlsph_last_error(block.body.solver);
    snprintf(s->snapshot.title, sizeof s->snapshot.title, "%g particles", s->particles);
    scene_destroy(&block.body);
    return result;
}

/* Root mean square over time of the difference of a vector of the histories: velocity from 0, displacement from 3. */
static double difference_of(const study *a, const study *b, size_t from) {
    double sum = 0;
    size_t i;
    for (i = 0; i < a->history.count && i < b->history.count; i++)
        for (size_t j = from; j < from + 3; j++) sum += pow(a->history.values[6 * i + j] - b->history.values[6 * i + j], 2);
    return i ? sqrt(sum / (double)i) : HUGE_VAL;
}

/* Least-squares slope of log cpu over log (particles x steps). */
static double cost_exponent(const study *s) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int i = 0; i < STUDIES; i++) {
        const double x = log(s[i].particles * s[i].steps), y = log(s[i].cpu);
        sx += x; sy += y; sxx += x * x; sxy += x * y;
    }
    return (STUDIES * sxy - sx * sy) / (STUDIES * sxx - sx * sx);
}

static void draw_study(driver *d, const study *s) {
    ex_view view = make_view(pressure_label, "L-block, pressure at 7.7 s, four resolutions (000 figure 5)", EX_MAP_DIVERGING);
    ex_panel panels[STUDIES];
    ex_curve curves[3][STUDIES];
    const ex_curve *of[3] = { curves[0], curves[1], curves[2] };
    ex_axes axes[3];
    char names[STUDIES][32];
    const int counts[3] = { STUDIES, STUDIES, STUDIES };
    const char *titles[3] = { "v_x at X = (0, 10, 0) m", "v_y", "v_z" };
    memset(axes, 0, sizeof axes);
    for (int i = 0; i < STUDIES; i++) {
        const driver_snapshot *shot = &s[i].snapshot;
        ex_panel panel = { shot->title, shot->positions, shot->values, shot->count, s[i].spacing / 2, shot->F };
        panels[i] = panel;
        snprintf(names[i], sizeof names[i], "%g particles", s[i].particles);
        for (int j = 0; j < 3; j++) {
            ex_curve curve = { names[i], s[i].history.time, driver_column(&s[i].history, j), s[i].history.count, 0, i };
            curves[j][i] = curve;
        }
    }
    for (int j = 0; j < 3; j++) { axes[j].title = titles[j]; axes[j].x_label = "t [s]"; axes[j].y_label = "[m/s]"; }
    if (s[0].snapshot.count) ex_render(driver_path(d, "figure5_resolutions.png"), &view, panels, STUDIES, STUDIES);
    ex_plot_grid(driver_path(d, "figure7_resolutions.png"), 560, 400, axes, of, counts, 3, 3);
    for (int j = 0; j < 3; j++) for (int i = 0; i < STUDIES; i++) free((void *)curves[j][i].y);
}

static void print_study(const study *s) {
    double velocity[STUDIES] = { 0 }, displacement[STUDIES] = { 0 };
    printf("%8s %10s %8s %9s %28s %28s\n", "spacing", "particles", "steps", "cpu [s]", "|v - v of the coarser| [m/s]",
           "|u - u of the coarser| [m]");
    for (int i = 0; i < STUDIES; i++) {
        printf("%8g %10g %8g %9.2f", s[i].spacing, s[i].particles, s[i].steps, s[i].cpu);
        if (i > 0) {
            velocity[i] = difference_of(&s[i], &s[i - 1], 0);
            displacement[i] = difference_of(&s[i], &s[i - 1], 3);
            printf(" %28.3g %28.3g", velocity[i], displacement[i]);
        }
        printf("\n");
    }
    ex_check_below("velocity_difference_2_by_1", velocity[2] / velocity[1], 1);
    ex_check_below("velocity_difference_3_by_2", velocity[3] / velocity[2], 1);
    ex_check_below("displacement_difference_2_by_1", displacement[2] / displacement[1], 1);
    ex_check_below("displacement_difference_3_by_2", displacement[3] / displacement[2], 1);
    ex_result("cost_exponent", cost_exponent(s), "1"); /* "linear computational cost", section 7.2: a speed, so no check */
}

static int run_studies(driver *d, const l_block_parameters *p) {
    static const double spacings[STUDIES] = { 0.64, 0.46, 0.3, 0.195 };
    const double end = fmin(p->options.end_time, 11);
    study s[STUDIES];
    tlsph_error error;
    int code = 0;
    memset(s, 0, sizeof s);
    memset(&error, 0, sizeof error);
    for (int i = 0; i < STUDIES && !code; i++) {
        s[i].spacing = spacings[i];
        if (study_run(p, end, &s[i], &error) != TLSPH_OK) code = driver_error(&error);
        else if (!p->options.quiet) fprintf(stderr, "study: spacing %g m done in %.1f s\n", s[i].spacing, s[i].cpu);
    }
    if (!code) { print_study(s); draw_study(d, s); code = ex_exit_code(); }
    for (int i = 0; i < STUDIES; i++) { driver_history_free(&s[i].history); driver_snapshot_free(&s[i].snapshot); }
    return code;
}

/* ---- main -------------------------------------------------------------------------------------------------------- */

static int run_block(const l_block_parameters *p) {
    static run r; /* the block's loads point into it, and it is large */
    tlsph_error error;
    int code;
    if (l_block_create(p, &r.block, &error) != TLSPH_OK) return driver_error(&error);
    r.history.columns = HISTORY_COLUMNS;
    if (driver_begin(&r.base, "l_block", &p->options, &r.block.body, p->options.end_time) ||
        ex_csv_open(&r.probe, r.base.folder, "probe.csv", "time [s],v_x [m/s],v_y,v_z,u_x [m],u_y,u_z")) return 1;
    r.base.step = after_step;
    r.base.user = &r;
    simulate(&r);
    draw_bodies(&r);
    draw_curves(&r);
    check(&r);
    code = driver_end(&r.base);
    ex_csv_close(&r.probe);
    driver_history_free(&r.history);
    for (int i = 0; i < SNAPSHOTS; i++) driver_snapshot_free(&r.snapshots[i]);
    scene_destroy(&r.block.body);
    return code;
}

int main(int argc, char **argv) {
    l_block_parameters p;
    int study_only = 0;
    const ex_option own[] = {
        { "spacing", EX_REAL, &p.spacing, "m", NULL, 0.05, 1.5, "distance of particles; 0.3 gives 5324 of them" },
        { "jitter", EX_REAL, &p.jitter, "spacings", NULL, 0, 0.45, "irregular cloud, closed operator; 0: lattice" },
        { "hot", EX_REAL, &p.hot, "K", NULL, 1, 1e4, "temperature of the face Y = 10 m at the start" },
        { "cold", EX_REAL, &p.cold, "K", NULL, 1, 1e4, "temperature of the face X = 6 m at the start" },
        { "study", EX_FLAG, &study_only, NULL, NULL, 0, 0, "four resolutions to 11 s instead of one run" } };
    l_block_default(&p);
    driver_arguments(argc, argv, "l_block", "L-shaped block in free flight, heated and cooled (000 section 7.2)",
                     &p.options, own, (int)(sizeof own / sizeof *own));
    if (study_only) {
        driver d;
        memset(&d, 0, sizeof d);
        snprintf(d.folder, sizeof d.folder, "%s", p.options.output[0] ? p.options.output : "out/l_block");
        if (ex_make_directory(d.folder)) { fprintf(stderr, "error: cannot write to %s\n", d.folder); return 1; }
        return run_studies(&d, &p);
    }
    return run_block(&p);
}
