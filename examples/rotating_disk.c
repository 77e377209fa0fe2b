/*
rotating_disk.c - a free disk with a hole that spins, heated and then cooled on a quarter of its rim: 000 section 7.3

Draws the paper's figures 11 (pressure at 1.35 s; four resolutions with --study), 12 (velocity and temperature at X = (2,
4, 0) m with the total energy and with the entropy as unknown; three resolutions with --study), 13 (momenta, energies,
entropy) and 14 (sequences), and checks what the section claims: both momenta conserved, the total energy follows the heat,
and once the heat is off entropy grows and ballistic energy falls.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- what is kept ------------------------------------------------------------------------------------------------ */

#define PRESSURE TLSPH_FIELD_PRESSURE, 0, 1 /* Pa, tension positive as in the paper */
#define TEMPERATURE TLSPH_FIELD_TEMPERATURE, 0, 1
enum { FIGURE_11, FIGURE_14A, FIGURE_14B = FIGURE_14A + 4, SWITCH_OFF = FIGURE_14B + 4, SNAPSHOTS };

static const driver_moment moments[SNAPSHOTS] = {
    { 1.35, PRESSURE },                                                                  /* figure 11 */
    { 0, TEMPERATURE }, { 2, TEMPERATURE }, { 4.5, TEMPERATURE }, { 7, TEMPERATURE },    /* 14 */
    { 0, PRESSURE }, { 3.3, PRESSURE }, { 6.6, PRESSURE }, { 9.9, PRESSURE },
    { 4, PRESSURE } };                                                                   /* met for the kink of the heat */

typedef struct extremes {
    double linear;                       /* |p| */
    double angular;                      /* change from the start */
    double energy;                       /* total energy - start - exact heat */
    double entropy_step, ballistic_step; /* least change of entropy, largest of ballistic energy in a step, heat off */
    double drift, oscillation;
} extremes;

typedef struct run {
    driver base;
    rotating_disk disk;
    driver_history balances, probe[2];   /* probe: this run, and the same with eta */
    driver_snapshot snapshots[SNAPSHOTS];
    tlsph_ledger start, before;
    extremes worst;
} run;

#define BALANCES 12

static double length3(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static void read_probe(void *user, double *row) {
    const rotating_disk *disk = user;
    row[0] = scene_value(disk->body.solver, TLSPH_FIELD_VELOCITY, disk->probe, 2);
    row[1] = scene_value(disk->body.solver, TLSPH_FIELD_TEMPERATURE, disk->probe, 0);
}

static void record(run *r) {
    const tlsph_ledger *l = &r->base.now;
    double row[BALANCES], probe[2];
    memcpy(row, l->linear_momentum, 3 * sizeof *row);
    memcpy(row + 3, l->angular_momentum, 3 * sizeof *row);
    row[6] = l->kinetic_energy;
    row[7] = l->strain_energy + l->thermal_energy - r->start.strain_energy - r->start.thermal_energy;
    row[8] = l->total_energy - r->start.total_energy;
    row[9] = l->ballistic_energy - r->start.ballistic_energy;
    row[10] = rotating_disk_heat(&r->disk.parameters, l->time);
    row[11] = l->entropy - r->start.entropy;
    driver_history_add(&r->balances, l->time, row);
    read_probe(&r->disk, probe);
    driver_history_add(&r->probe[0], l->time, probe);
}

static void track(run *r) {
    const tlsph_ledger *l = &r->base.now;
    const double off = r->disk.parameters.switch_off * (1 + 1e-12);
    extremes *w = &r->worst;
    double change[3];
    for (int i = 0; i < 3; i++) change[i] = l->angular_momentum[i] - r->start.angular_momentum[i];
    w->linear = fmax(w->linear, length3(l->linear_momentum));
    w->angular = fmax(w->angular, length3(change));
    w->energy = fmax(w->energy, fabs(l->total_energy - r->start.total_energy -
                                     rotating_disk_heat(&r->disk.parameters, l->time)));
    w->drift = fmax(w->drift, l->drift_largest);
    if (r->before.time >= off) {
        w->entropy_step = fmin(w->entropy_step, l->entropy - r->before.entropy);
        w->ballistic_step = fmax(w->ballistic_step, l->ballistic_energy - r->before.ballistic_energy);
    }
    r->before = *l;
}

static void after_step(driver *d) {
    run *r = d->user;
    record(r);
    track(r);
    if (d->now.step % 200 == 0)
        r->worst.oscillation = fmax(r->worst.oscillation, scene_oscillation(d->body->solver, TLSPH_FIELD_PRESSURE));
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

static ex_view make_view(const char *label, const char *heading, ex_map map) {
    /* so that the heated quarter, X > 2 and Y > 2 m at the start, faces the viewer */
    return driver_view(400, 380, 35, 35, 2, map, label, heading);
}

static const char pressure_label[] = "pressure [Pa], tension positive", temperature_label[] = "temperature [K]";

static void draw_bodies(run *r) {
    const double radius = r->disk.parameters.radius / r->disk.parameters.n;
    ex_view view = make_view(pressure_label, "rotating disk, pressure at 1.35 s (000 figure 11)", EX_MAP_DIVERGING);
    driver_render(&r->base, "figure11_pressure.png", &view, &r->snapshots[FIGURE_11], 1, 1, radius);
    view = make_view(temperature_label, "rotating disk, temperature (000 figure 14)", EX_MAP_HEAT);
    driver_render(&r->base, "figure14_temperature.png", &view, &r->snapshots[FIGURE_14A], 4, 4, radius);
    view = make_view(pressure_label, "rotating disk, pressure (000 figure 14)", EX_MAP_DIVERGING);
    driver_render(&r->base, "figure14_pressure.png", &view, &r->snapshots[FIGURE_14B], 4, 4, radius);
}

static const driver_panel probe_panels[] = { { "v_z at X = (2, 4, 0) m (000 figure 12a)", "[m/s]" },
                                             { "temperature at X = (2, 4, 0) m (000 figure 12b)", "[K]" } };

static void draw_curves(run *r) {
    static const char probe_header[] = "time [s],v_z [m/s],temperature [K]";
    static const driver_chart balances[] = {
        { "linear momentum (000 figure 13a)", "[kg m/s]", 0, 3, { "x", "y", "z" } },
        { "angular momentum (000 figure 13b)", "[kg m2/s]", 3, 3, { "x", "y", "z" } },
        { "energies since t = 0 (000 figure 13c)", "[J]", 6, 4, { "kinetic", "internal", "total", "ballistic" } },
        { "entropy since t = 0 (000 figure 13d)", "[J/K]", 11, 1, { "entropy" } } };
    const driver_history *of[2] = { &r->probe[0], &r->probe[1] };
    static const char *const names[2] = { "{p,F,H,J,E}", "{p,F,H,J,eta}" };
    driver_plot(&r->base, "figure13_balances.png", &r->balances, balances, 4, 2);
    driver_table(&r->base, "probe_energy.csv", probe_header, &r->probe[0]);
    driver_table(&r->base, "probe_entropy.csv", probe_header, &r->probe[1]);
    driver_overlay(&r->base, "figure12_probe.png", of, names, r->probe[1].count ? 2 : 1, probe_panels, 2);
}

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static void check(const run *r) {
    const rotating_disk_parameters *p = &r->disk.parameters;
    const double most_heat = fabs(rotating_disk_heat(p, p->switch_off / 2));
    const double angular = length3(r->start.angular_momentum);
    const double speed = p->radius * length3(p->omega), round_off = 1e-12 * fmax(1, fabs(r->base.now.entropy));
    ex_result("particles", (double)tlsph_count(r->disk.body.solver), "1");
    ex_result("steps", (double)r->base.now.step, "1");
    ex_result("time", r->base.now.time, "s");
    ex_result("largest_heat", most_heat, "J");
    ex_result("largest_pressure_oscillation", r->worst.oscillation, "1");
    ex_check_below("linear_momentum", r->worst.linear / (r->start.mass * speed), 1e-12);
    ex_check_below("angular_momentum_change", r->worst.angular / angular, 1e-8);
    ex_check_below("jacobian_drift", r->worst.drift, 0.1); /* METHOD section 3; largest at re-entrant edges */
    if (p->options.thermal == TLSPH_ENERGY)
        ex_check_below("energy_minus_heat", r->worst.energy / most_heat, 1e-4);
    if (r->base.now.time <= p->switch_off) return;
    ex_check_below("entropy_largest_fall", 0 - r->worst.entropy_step, round_off);
    ex_check_below("ballistic_largest_rise", r->worst.ballistic_step, 308.15 * round_off);
}

static void check_forms(const driver_history probe[2]) {
    ex_check_below("velocity_E_against_eta", driver_difference(&probe[0], &probe[1], 0, NULL), 0.01);
    ex_check_below("temperature_E_against_eta", driver_difference(&probe[0], &probe[1], 1, NULL), 0.01);
}

/* ---- study: figures 11 and 12 at the paper's resolutions --------------------------------------------------------- */

#define STUDIES 4

typedef struct study { int n; size_t particles; driver_history probe[2]; driver_snapshot snapshot; } study;

/* One run, with the entropy (form 1) or the energy; the pressure is kept at 1.35 s. */
static tlsph_result study_run(const rotating_disk_parameters *base, int form, study *s, tlsph_error *error) {
    rotating_disk_parameters p = *base;
    rotating_disk disk;
    tlsph_result result;
    const double interval = 0.01, end = p.options.end_time;
    p.n = s->n;
    p.options.thermal = form ? TLSPH_ENTROPY : TLSPH_ENERGY;
    s->probe[form].columns = 2;
    result = rotating_disk_create(&p, &disk, error);
    if (result != TLSPH_OK) return result;
    result = driver_record(&disk.body, fmin(end, 1.35), interval, read_probe, &disk, &s->probe[form]);
    if (!form) driver_snap(&disk.body, PRESSURE, &s->snapshot);
    if (result == TLSPH_OK) result = driver_record(&disk.body, end, interval, read_probe, &disk, &s->probe[form]);
    if (result != TLSPH_OK) *error = *tlsph_last_error(disk.body.solver);
    s->particles = tlsph_count(disk.body.solver);
    snprintf(s->snapshot.title, sizeof s->snapshot.title, "%lu particles", (unsigned long)s->particles);
    scene_destroy(&disk.body);
    return result;
}

static void draw_study(driver *d, const study *s) {
    ex_view view = make_view(pressure_label, "rotating disk, pressure at 1.35 s (000 figure 11)", EX_MAP_DIVERGING);
    static const int shown[3] = { 0, 1, 3 }; /* as in figure 12 */
    const driver_history *histories[6];
    const char *names[6];
    char text[6][48];
    ex_panel panels[STUDIES];
    for (int i = 0; i < STUDIES; i++) {
        const driver_snapshot *shot = &s[i].snapshot;
        ex_panel panel = { shot->title, shot->positions, shot->values, shot->count, 2.0 / s[i].n, shot->F };
        panels[i] = panel;
    }
    for (int i = 0; i < 6; i++) {
        const study *of = &s[shown[i / 2]];
        snprintf(text[i], sizeof text[i], "%s, %lu", i % 2 ? "eta" : "E", (unsigned long)of->particles);
        histories[i] = &of->probe[i % 2];
        names[i] = text[i];
    }
    ex_render(driver_path(d, "figure11_resolutions.png"), &view, panels, STUDIES, STUDIES);
    driver_overlay(d, "figure12_resolutions.png", histories, names, 6, probe_panels, 2);
}

static void report_study(const study *s) {
    double to_next[STUDIES][2];
    for (int i = 0; i < STUDIES; i++) {
        const driver_history *E = &s[i].probe[0], *eta = &s[i].probe[1];
        printf("%lu particles: E against eta %.2g (v_z), %.2g (temperature) of the range",
               (unsigned long)s[i].particles, driver_difference(E, eta, 0, NULL), driver_difference(E, eta, 1, NULL));
        for (int j = 0; i + 1 < STUDIES && j < 2; j++)
            to_next[i][j] = driver_difference(&s[STUDIES - 1].probe[0], &s[i].probe[0], j, NULL);
        if (i + 1 < STUDIES) printf("; to the finest %.2g and %.2g", to_next[i][0], to_next[i][1]);
        printf("\n");
        check_forms(s[i].probe);
    }
    for (int j = 0; j < 2; j++)
        ex_check_below(j ? "temperature_to_finest_2_by_0" : "velocity_to_finest_2_by_0", to_next[2][j] / to_next[0][j], 1);
}

static int run_studies(const rotating_disk_parameters *p) {
    static const int sizes[STUDIES] = { 14, 28, 34, 44 };
    driver d;
    study s[STUDIES];
    tlsph_error error;
    int code = 0;
    memset(&d, 0, sizeof d);
    memset(s, 0, sizeof s);
    snprintf(d.folder, sizeof d.folder, "%s", p->options.output[0] ? p->options.output : "out/rotating_disk");
    if (ex_make_directory(d.folder)) { fprintf(stderr, "error: cannot write to %s\n", d.folder); return 1; }
    for (int i = 0; i < 2 * STUDIES && !code; i++) {
        s[i / 2].n = sizes[i / 2];
        if (study_run(p, i % 2, &s[i / 2], &error) != TLSPH_OK) code = driver_error(&error);
        else if (!p->options.quiet) fprintf(stderr, "study: run %d of %d done\n", i + 1, 2 * STUDIES);
    }
    if (!code) { report_study(s); draw_study(&d, s); code = ex_exit_code(); }
    for (int i = 0; i < STUDIES; i++) {
        driver_snapshot_free(&s[i].snapshot);
        for (int j = 0; j < 2; j++) driver_history_free(&s[i].probe[j]);
    }
    return code;
}

/* ---- main -------------------------------------------------------------------------------------------------------- */

/* The same disk once more with the entropy as unknown, for figure 12. */
static tlsph_result run_entropy_form(run *r, tlsph_error *error) {
    rotating_disk_parameters p = r->disk.parameters;
    rotating_disk disk;
    tlsph_result result;
    p.options.thermal = TLSPH_ENTROPY;
    result = rotating_disk_create(&p, &disk, error);
    if (result != TLSPH_OK) return result;
    result = driver_record(&disk.body, p.options.end_time, 0, read_probe, &disk, &r->probe[1]);
    if (result != TLSPH_OK) *error = *tlsph_last_error(disk.body.solver);
    scene_destroy(&disk.body);
    return result;
}

static int run_disk(const rotating_disk_parameters *p) {
    static run r; /* the disk's loads point into it, and it is large */
    tlsph_error error;
    int code;
    if (rotating_disk_create(p, &r.disk, &error) != TLSPH_OK) return driver_error(&error);
    r.balances.columns = BALANCES;
    r.probe[0].columns = r.probe[1].columns = 2;
    if (driver_begin(&r.base, "rotating_disk", &p->options, &r.disk.body, p->options.end_time)) return 1;
    r.base.step = after_step;
    r.base.user = &r;
    r.start = r.before = r.base.now;
    record(&r);
    driver_run_moments(&r.base, p->options.end_time, moments, r.snapshots, SNAPSHOTS);
    if (r.base.result == TLSPH_OK && p->options.thermal == TLSPH_ENERGY) {
        if (run_entropy_form(&r, &error) != TLSPH_OK) return driver_error(&error);
        check_forms(r.probe);
    }
    draw_bodies(&r);
    draw_curves(&r);
    check(&r);
    code = driver_end(&r.base);
    driver_history_free(&r.balances);
    for (int i = 0; i < 2; i++) driver_history_free(&r.probe[i]);
    for (int i = 0; i < SNAPSHOTS; i++) driver_snapshot_free(&r.snapshots[i]);
    scene_destroy(&r.disk.body);
    return code;
}

int main(int argc, char **argv) {
    rotating_disk_parameters p;
    int study_only = 0;
    const ex_option own[] = {
        { "n", EX_INT, &p.n, NULL, NULL, 8, 200, "spacings across the diameter of 4 m, even; paper: 14, 28, 34, 44" },
        { "heat-flux", EX_REAL, &p.heat_flux, "W/m^2", NULL, -1e6, 1e6, "amplitude; positive: leaves first" },
        { "hole", EX_REAL, &p.hole, "m", NULL, 0, 1.7, "radius of the hole" },
        { "study", EX_FLAG, &study_only, NULL, NULL, 0, 0, "four resolutions in both forms instead of one" } };
    rotating_disk_default(&p);
    driver_arguments(argc, argv, "rotating_disk", "spinning disk, heated on a quarter of its rim (000 section 7.3)",
                     &p.options, own, (int)(sizeof own / sizeof *own));
    if (p.n % 2) {
        fprintf(stderr, "rotating_disk: --n must be even, found %d\n", p.n);
        return 2;
    }
    if (p.options.thermal == TLSPH_ISOTHERMAL) {
        fprintf(stderr, "rotating_disk: --thermal must be energy or entropy\n");
        return 2;
    }
    return study_only ? run_studies(&p) : run_disk(&p);
}
