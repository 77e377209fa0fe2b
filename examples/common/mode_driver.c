/* mode_driver.c - the program around breathing_ball and lame_mode: a free body in an exact mode, on an irregular cloud */
#include "driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct run { driver base; cloud_mode mode; driver_history history; } run;

static void record(run *r) {
    const double scale = r->mode.parameters.amplitude * r->mode.omega;
    double row[2];
    row[0] = cloud_mode_amplitude(&r->mode) / scale;
    row[1] = cos(r->mode.omega * r->base.now.time);
    driver_history_add(&r->history, r->base.now.time, row);
}

static void after_sample(void *user) {
    run *r = user;
    driver_stepped(&r->base);
    record(r);
}

static void draw(run *r) {
    static const driver_chart charts[] = { { "velocity along the mode over its first value", "", 0, 2, { "computed", "exact" } } };
    const cloud_mode_parameters *p = &r->mode.parameters;
    const double exaggeration = 0.15 / p->amplitude;
    driver_snapshot shot;
    ex_view view;
    memset(&view, 0, sizeof view);
    view.panel_width = 640; view.panel_height = 560;
    view.camera.azimuth = 215; view.camera.elevation = 25; view.camera.up_axis = 2; view.camera.zoom = 1;
    view.map = EX_MAP_VIRIDIS;
    view.label = p->ball ? "pressure [Pa], tension positive" : "von Mises stress [Pa]";
    view.heading = "displacement enlarged to 0.15 m";
    driver_plot(&r->base, "amplitude.png", &r->history, charts, 1, 1);
    if (driver_snap(&r->mode.body, p->ball ? TLSPH_FIELD_PRESSURE : TLSPH_FIELD_VON_MISES, 0, 1, &shot)) return;
    for (size_t i = 0; i < shot.count; i++) {
        const tlsph_real *X = r->mode.body.cloud.particles.positions + 3 * i;
        for (size_t j = 0; j < 3; j++)
            shot.positions[3 * i + j] = (double)X[j] + exaggeration * (shot.positions[3 * i + j] - (double)X[j]);
        for (size_t j = 0; j < 9; j++) shot.F[9 * i + j] = (j % 4 == 0) + exaggeration * (shot.F[9 * i + j] - (j % 4 == 0));
    }
    driver_render(&r->base, "mode.png", &view, &shot, 1, 1, 0.4 / p->n);
    driver_snapshot_free(&shot);
}

static void report_closure(const tlsph_solver *solver) {
    tlsph_closure closure;
    tlsph_closure_read(solver, &closure);
    ex_result("closure_iterations", closure.iterations, "1");
    ex_result("closure_linear", closure.linear, "1");
    ex_result("closure_change", closure.change_mean, "1");
}

/* Frequency errors on clouds fall with n^2: 3.2, 1.4, 0.8 % (ball, n = 4, 6, 8), 6.5, 2.5 % (cube, n = 4, 8), and a quarter more. */
static int run_mode(const char *name, const cloud_mode_parameters *p) {
    static run r;
    tlsph_error error;
    double frequency_error = HUGE_VAL, error_p, error_P;
    int code;
    if (cloud_mode_create(p, &r.mode, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&r.base, name, &p->options, &r.mode.body, p->periods * cloud_mode_period(&r.mode))) return 1;
    r.history.columns = 2;
    record(&r);
    r.base.result = cloud_mode_measure(&r.mode, &frequency_error, after_sample, &r);
    draw(&r);
    if (r.base.result == TLSPH_OK) {
        cloud_mode_errors(&r.mode, &error_p, &error_P);
        ex_result("particles", (double)r.mode.body.cloud.particles.count, "1");
        ex_result("frequency", r.mode.omega * (1 + frequency_error), "rad/s");
        ex_result("frequency_error", frequency_error, "1");
        report_closure(r.mode.body.solver);
        ex_check_below("frequency_error_size", fabs(frequency_error), (p->ball ? 0.64 : 2.0) / (p->n * p->n));
    }
    code = driver_end(&r.base);
    driver_history_free(&r.history);
    scene_destroy(&r.mode.body);
    return code;
}

int driver_cloud_mode(int argc, char **argv, const char *name, const char *summary, cloud_mode_parameters *p) {
    const ex_option own[] = {
        { "n", EX_INT, &p->n, NULL, NULL, 2, 128, p->ball ? "spacings a radius" : "spacings a side" },
        { "jitter", EX_REAL, &p->jitter, "spacings", NULL, 0, 0.45, "moves the particles of the lattice; 0: lattice" },
        { "scattered", EX_INT, &p->scattered, NULL, NULL, 0, 1, "1: a sampled cloud; always so for the ball" },
        { "seed", EX_INT, &p->seed, NULL, NULL, 0, 1e9, "of the cloud" },
        { "periods", EX_REAL, &p->periods, NULL, NULL, 0.5, 1000, "over which the frequency is measured" },
        { "nu", EX_REAL, &p->poisson, NULL, NULL, -0.9, 0.499, "Poisson's ratio" } };
    driver_arguments(argc, argv, name, summary, &p->options, own, (int)(sizeof own / sizeof *own));
    return run_mode(name, p);
}
