/*
runs.c - scenes and choices of the study (study.h)

  cube           swinging cube, 9/8 periods, linear: relative L2 errors of p_x and P_xX (exact solution), their rms
  wave           thermo-elastic standing wave, 2 periods: errors of displacement and temperature by the amplitudes, rms
  manufactured   finite strain and heat with exact sources: errors of p, P, theta - theta_R over five instants, rms
  column         twisting column, nu = 0.49: displacement of 4 edge points at 5 instants, against a converged run
  block          L-shaped block, not heated: displacement of 6 corners at 3 instants, against a converged run (two runs, extrapolated)
*/
#include "study.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

const study_info study_scenes[STUDY_SCENES] = {
    { "cube", "swinging cube", "p_x and P_xX against the exact solution", { 8, 12, 16, 0 }, 0, 0.2 },
    { "wave", "thermo-elastic standing wave", "u and theta against the exact solution", { 16, 32, 64, 0 }, 1, 0.5 },
    { "manufactured", "manufactured problem", "p, P and theta against the exact solution", { 8, 12, 16, 0 }, 1, 0.2 },
    { "column", "twisting column", "displacements against a converged run", { 4, 6, 8, 0 }, 0, 0.5 },
    { "block", "L-block", "displacements against a converged run", { 2, 3, 4, 0 }, 1, 0.5 } };

/* ---- configurations ---------------------------------------------------------------------------------------------- */

const study_word study_words[] = {
    { "J", "{p,F,J}" }, { "HJ", "{p,F,H,J}" }, { "H", "{p,F,H}" }, { "E", "with energy" }, { "eta", "entropy for E" },
    { "isothermal", "no thermal unknown" }, { "26", "26 neighbours, quadratic kernel" }, { "cubic", "cubic spline" },
    { "wendland", "Wendland C2 kernel" }, { "W0", "kernel of order 0 (002)" }, { "W1", "kernel of order 1 (002)" },
    { "bond", "bond-based gradient (002)" }, { "cells", "dual faces of cells" }, { "cells4", "cells of order 4" },
    { "sharp", "sharp gradients" }, { "first", "no reconstruction" }, { "unlimited", "no limiter" },
    { "adjoint", "self-adjoint reconstruction; 2 or 3 full stages, not with sharp, cells4, bond" },
    { "undamped", "no dissipation" }, { "jst", "JST dissipation (002)" }, { "unprojected", "no projection" },
    { "double", "double-gradient conduction" }, { "split", "conduction in 9 stages of its own" },
    { "cfl0.4", "CFL 0.4" }, { "ssprk3", "3 stages, CFL 0.5" }, { "rk3", "3 stages, dissipation once, CFL 0.5" },
    { "rk4", "4 stages, dissipation once, CFL 0.5" }, { "leapfrog", "forces once a step, CFL 0.5" },
    { "fast", "preset" }, { "balanced", "preset" },
    { "accurate", "preset" }, { NULL, NULL } };

typedef struct setting { const char *word; size_t offset; int value; } setting;
#define SET(word, field, value) { word, offsetof(scene_options, field), value }
static const setting settings[] = {
    SET("J", unknowns, TLSPH_PFJ), SET("HJ", unknowns, TLSPH_PFHJ), SET("H", unknowns, TLSPH_PFH),
    SET("E", thermal, TLSPH_ENERGY), SET("eta", thermal, TLSPH_ENTROPY), SET("isothermal", thermal, TLSPH_ISOTHERMAL),
    SET("26", operator_kind, TLSPH_CORRECTED_KERNEL), SET("cubic", kernel, TLSPH_CUBIC_SPLINE),
    SET("wendland", kernel, TLSPH_WENDLAND_C2), SET("W0", operator_kind, TLSPH_ZEROTH_KERNEL),
    SET("W1", operator_kind, TLSPH_FIRST_KERNEL), SET("bond", operator_kind, TLSPH_BOND),
    SET("cells", operator_kind, TLSPH_CELLS), SET("cells4", operator_kind, TLSPH_CELLS_4), SET("sharp", sharp, 1),
    SET("first", dissipation, TLSPH_FIRST_ORDER), SET("unlimited", dissipation, TLSPH_RECONSTRUCTED),
    SET("adjoint", dissipation, TLSPH_SELF_ADJOINT), SET("undamped", dissipation, TLSPH_NO_DISSIPATION),
    SET("jst", dissipation, TLSPH_JST),
    SET("unprojected", projection, 0), SET("double", conduction, TLSPH_DOUBLE_GRADIENT),
    SET("split", conduction_stages, 9), SET("ssprk3", integrator, TLSPH_SSP_RK3),
    SET("rk3", integrator, TLSPH_RK3_FROZEN), SET("rk4", integrator, TLSPH_RK4_FROZEN),
    SET("leapfrog", integrator, TLSPH_LEAPFROG) };
#undef SET

/* Words that set more than one integer. */
static int apply_word(const char *word, scene_options *o) {
    int known = 0;
    for (size_t i = 0; i < sizeof settings / sizeof *settings; i++) {
        if (strcmp(settings[i].word, word)) continue;
        memcpy((char *)o + settings[i].offset, &settings[i].value, sizeof settings[i].value);
        known = 1;
    }
    if (!strcmp(word, "26")) o->support = 0.9; /* neighbours within 1.8 spacings */
    if (!strcmp(word, "ssprk3") || !strcmp(word, "rk3") || !strcmp(word, "rk4") || !strcmp(word, "leapfrog"))
        o->cfl = 0.5;
    if (!strcmp(word, "cfl0.4")) { o->cfl = 0.4; known = 1; }
    return known || scene_options_preset(o, word);
}

int study_options(study_scene scene, const char *configuration, scene_options *o) {
    char words[48], *word;
    scene_options_default(o);
    o->threads = 1;
    o->thermal = study_scenes[scene].thermal ? TLSPH_ENERGY : TLSPH_ISOTHERMAL;
    if (scene == STUDY_BLOCK) o->operator_kind = TLSPH_CELLS; /* corrected kernels are not exact at its re-entrant edge */
    snprintf(words, sizeof words, "%s", configuration);
    for (word = strtok(words, " "); word; word = strtok(NULL, " "))
        if (!apply_word(word, o)) return 0;
    return 1;
}

/* ---- running ----------------------------------------------------------------------------------------------------- */

/* A run in progress: time of the steps; largest kinetic energy, and heat in the spread of temperatures, as scales. */
typedef struct course { tlsph_solver *solver; double cpu, kinetic, heat; tlsph_result result; } course;

static void look(course *c) {
    tlsph_ledger ledger;
    tlsph_ledger_read(c->solver, &ledger);
    c->kinetic = fmax(c->kinetic, ledger.kinetic_energy);
    c->heat = fmax(c->heat, ledger.mass * 1 * (ledger.temperature_largest - ledger.temperature_least)); /* all have C_v = 1 */
}

static void advance(course *c, double time) {
    const double begin = ex_cpu_seconds();
    if (c->result != TLSPH_OK) return;
    c->result = tlsph_advance(c->solver, (tlsph_real)time);
    c->cpu += ex_cpu_seconds() - begin;
    look(c);
}

static double rms2(double a, double b) { return sqrt((a * a + b * b) / 2); }
static double length3(const double a[3]) { return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

/* What balances must hold to: E is conserved by the scheme itself, isothermal energy and eta as well as time is resolved. */
static void judge(course *c, const scene_options *o, double impulse, study_run *out) {
    const double exact = sizeof(tlsph_real) == 8 ? 1e-9 : 5e-2, rounding = sizeof(tlsph_real) == 8 ? 1e-9 : 1e-3;
    tlsph_ledger l;
    double scale;
    look(c);
    tlsph_ledger_read(c->solver, &l);
    scale = c->kinetic + c->heat + fabs(l.external_work) + fabs(l.external_heat);
    out->particles = (double)tlsph_count(c->solver);
    out->steps = (double)tlsph_step_count(c->solver);
    out->cpu = c->cpu;
    out->energy = fabs(l.energy_residual) / scale;
    out->oscillation = scene_oscillation(c->solver, TLSPH_FIELD_PRESSURE);
    if (impulse > 0) {
        out->momentum = length3(l.linear_residual) / impulse;
        out->angular = length3(l.angular_residual) / (10 * impulse); /* 10 m: the block's height */
    }
    out->ok = c->result == TLSPH_OK && l.jacobian_least > 0 && l.dissipation >= -1e-12 * scale &&
              out->error < study_scenes[out->scene].bound &&
              out->energy < (o->thermal == TLSPH_ENERGY ? exact : 0.05) && out->momentum < rounding &&
              (out->angular < rounding || !o->projection);
    if (c->result != TLSPH_OK) out->error = HUGE_VAL;
}

static void run_cube(const scene_options *o, study_run *out) {
    swinging_cube_parameters p;
    swinging_cube cube;
    tlsph_error error;
    course c = { NULL, 0, 0, 0, TLSPH_OK };
    double error_p, error_P;
    swinging_cube_default(&p);
    p.options = *o;
    p.n = out->n;
    p.amplitude = 5e-4; /* 001; the material is linear */
    if (swinging_cube_create(&p, &cube, &error) != TLSPH_OK) return;
    c.solver = cube.body.solver;
    for (int i = 1; i <= 9; i++) advance(&c, i * 2 * SCENE_PI / cube.omega / 8); /* at 9/8 neither p nor P is small */
    swinging_cube_errors(&cube, &error_p, &error_P);
    out->error = rms2(error_p, error_P);
    judge(&c, o, 0, out);
    scene_destroy(&cube.body);
}

static void run_wave(const scene_options *o, study_run *out) {
    standing_wave_parameters p;
    standing_wave wave;
    tlsph_error error;
    course c = { NULL, 0, 0, 0, TLSPH_OK };
    double error_u, error_theta;
    standing_wave_default(&p);
    p.options = *o;
    p.n = out->n;
    p.amplitude = 5e-4; /* large for float, gentle for the sensor of fronts; theta moves by 1e-5 of itself */
    if (standing_wave_create(&p, &wave, &error) != TLSPH_OK) return;
    c.solver = wave.body.solver;
    for (int i = 1; i <= 8; i++) advance(&c, standing_wave_end(&wave) * i / 8);
    standing_wave_errors(&wave, &error_u, &error_theta);
    out->error = rms2(error_u, error_theta);
    judge(&c, o, 0, out);
    scene_destroy(&wave.body);
}

static void run_manufactured(const scene_options *o, study_run *out) {
    static manufactured cube; /* the solver's loads point into it */
    manufactured_parameters p;
    manufactured_errors e;
    tlsph_error error;
    course c = { NULL, 0, 0, 0, TLSPH_OK };
    double began;
    manufactured_default(&p);
    p.options = *o;
    p.n = out->n;
    manufactured_set(&p, TLSPH_MIE_GRUNEISEN, 1);
    if (manufactured_create(&p, &cube, &error) != TLSPH_OK) return;
    began = ex_cpu_seconds();
    c.result = manufactured_run(&cube, 5, NULL, NULL, &e);
    c.cpu = ex_cpu_seconds() - began - cube.load_seconds;
    c.solver = cube.body.solver;
    out->error = sqrt((e.p * e.p + e.P * e.P + e.theta * e.theta) / 3);
    judge(&c, o, 0, out);
    scene_destroy(&cube.body);
}

/* ---- scenes without an exact solution: displacements of material points at instants ------------------------------- */

enum { POINTS_MOST = 6, INSTANTS_MOST = 5, FINE_COLUMN = 12, FINE_BLOCK = 6 };
typedef struct trace { int points, instants; double X[POINTS_MOST][3], t[INSTANTS_MOST], u[INSTANTS_MOST][POINTS_MOST][3]; } trace;

static const trace column_trace = { 4, 5, { { .5, 1.5, .5 }, { .5, 3, .5 }, { .5, 4.5, .5 }, { .5, 6, .5 } },
                                    { .02, .04, .06, .08, .1 }, { { { 0 } } } };
static const trace block_trace = { 6, 3, { { 0, 0, 0 }, { 6, 0, 0 }, { 6, 3, 3 }, { 3, 3, 0 }, { 0, 10, 0 }, { 3, 10, 3 } },
                                   { 2.5, 5, 7.5 }, { { { 0 } } } };
static trace references[2];

static void follow(course *c, const tlsph_particles *particles, trace *t) {
    for (int i = 0; i < t->instants && c->result == TLSPH_OK; i++) {
        tlsph_real *u;
        advance(c, t->t[i]);
        u = scene_read(c->solver, TLSPH_FIELD_DISPLACEMENT);
        for (int k = 0; u && k < t->points; k++) {
            const size_t a = scene_nearest(particles, t->X[k][0], t->X[k][1], t->X[k][2]);
            for (size_t j = 0; j < 3; j++) t->u[i][k][j] = (double)u[3 * a + j];
        }
        free(u);
    }
}

static double distance(const trace *a, const trace *b) {
    double difference = 0, size = 0;
    for (int i = 0; i < a->instants; i++)
        for (int k = 0; k < a->points; k++)
            for (int j = 0; j < 3; j++) {
                difference += pow(a->u[i][k][j] - b->u[i][k][j], 2);
                size += pow(b->u[i][k][j], 2);
            }
    return size > 0 ? sqrt(difference / size) : HUGE_VAL;
}

static trace run_column(const scene_options *o, study_run *out) {
    twisting_column_parameters p;
    twisting_column column;
    tlsph_error error;
    course c = { NULL, 0, 0, 0, TLSPH_OK };
    trace t = column_trace;
    twisting_column_default(&p);
    p.options = *o;
    p.n = out->n;
    p.nu = 0.49;
    if (twisting_column_create(&p, &column, &error) != TLSPH_OK) return t;
    c.solver = column.body.solver;
    follow(&c, &column.body.cloud.particles, &t);
    out->error = distance(&t, &references[0]);
    judge(&c, o, 0, out);
    scene_destroy(&column.body);
    return t;
}

static trace run_block(const scene_options *o, study_run *out) {
    static l_block block; /* the solver's loads point into it */
    l_block_parameters p;
    tlsph_error error;
    course c = { NULL, 0, 0, 0, TLSPH_OK };
    trace t = block_trace;
    l_block_default(&p);
    p.options = *o;
    p.spacing = 1.0 / out->n;
    p.hot = p.cold = 293.15; /* a warm layer of one spacing would hold less heat with every refinement */
    if (l_block_create(&p, &block, &error) != TLSPH_OK) return t;
    c.solver = block.body.solver;
    follow(&c, &block.body.cloud.particles, &t);
    out->error = distance(&t, &references[1]);
    judge(&c, o, l_block_impulse(&p), out);
    scene_destroy(&block.body);
    return t;
}

void study_measure(study_scene scene, int n, const char *configuration, study_run *out) {
    scene_options options;
    memset(out, 0, sizeof *out);
    out->scene = scene;
    out->n = n;
    snprintf(out->configuration, sizeof out->configuration, "%s", configuration);
    snprintf(out->precision, sizeof out->precision, STUDY_PRECISION);
    out->error = out->cpu = HUGE_VAL;
    if (!study_options(scene, configuration, &options)) return;
    switch (scene) {
    case STUDY_CUBE: run_cube(&options, out); break;
    case STUDY_WAVE: run_wave(&options, out); break;
    case STUDY_MANUFACTURED: run_manufactured(&options, out); break;
    case STUDY_COLUMN: run_column(&options, out); break;
    default: run_block(&options, out);
    }
}

/* ---- references ---------------------------------------------------------------------------------------------------- */

static void each_value(trace *t, FILE *in, FILE *out, int *bad) {
    for (int i = 0; i < t->instants; i++)
        for (int k = 0; k < t->points; k++) {
            double *u = t->u[i][k], time;
            if (out) fprintf(out, "%g,%d,%.9g,%.9g,%.9g\n", t->t[i], k, u[0], u[1], u[2]);
            else *bad |= fscanf(in, "%lf,%*d,%lf,%lf,%lf\n", &time, &u[0], &u[1], &u[2]) != 4 || fabs(time - t->t[i]) > 1e-9;
        }
}

static const char heading[] = "time_s,point,u_x_m,u_y_m,u_z_m: twisting column, then L-block (study --references)\n";

int study_references_read(const char *path) {
    FILE *file = fopen(path, "r");
    int bad = !file, c = 0;
    references[0] = column_trace;
    references[1] = block_trace;
    while (file && c != '\n' && c != EOF) c = fgetc(file);
    for (int i = 0; i < 2 && !bad; i++) each_value(&references[i], file, NULL, &bad);
    if (file) fclose(file);
    return bad;
}

/* Errors of second order taken out of two runs whose spacings are as 3 : 2. Sharp gradients would be a poor reference: they
   err more than the plain ones where a body is clamped or cut in edges. */
static trace extrapolate(const trace *coarse, const trace *fine) {
    trace out = *fine;
    for (int i = 0; i < out.instants; i++)
        for (int k = 0; k < out.points; k++)
            for (int j = 0; j < 3; j++) out.u[i][k][j] += (fine->u[i][k][j] - coarse->u[i][k][j]) / (1.5 * 1.5 - 1);
    return out;
}

int study_references_write(const char *path) {
    FILE *file;
    for (int i = 0; i < 2; i++) {
        const int n = i ? FINE_BLOCK : FINE_COLUMN;
        study_run run;
        scene_options o;
        trace level[2];
        memset(&run, 0, sizeof run);
        run.scene = i ? STUDY_BLOCK : STUDY_COLUMN;
        study_options(run.scene, "rk3", &o);
        for (int k = 0; k < 2; k++) {
            run.n = k ? n : 2 * n / 3;
            level[k] = i ? run_block(&o, &run) : run_column(&o, &run);
        }
        references[i] = extrapolate(&level[0], &level[1]);
        printf("%s: %.0f particles, %.0f s; n = %d is %.2e, n = %d is %.2e from their extrapolation\n",
               study_scenes[run.scene].name, run.particles, run.cpu, 2 * n / 3, distance(&level[0], &references[i]), n,
               distance(&level[1], &references[i]));
        fflush(stdout);
    }
    if (!(file = fopen(path, "w"))) return 1;
    fputs(heading, file);
    for (int i = 0; i < 2; i++) each_value(&references[i], NULL, file, NULL);
    return fclose(file);
}
