/* spinning.c - loss of angular momentum against resolution, with and without the projection */
#include "spinning.h"
#include "driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEVELS = 4, PANELS = 4 };

typedef struct study {
    spinning_box_parameters p;
    driver base;
    spinning_box box;
    driver_history history; /* of the finest level: linear momentum (3), angular momentum, energy change */
    int levels, finest_run;
    double n[LEVELS], loss[2][LEVELS]; /* angular momentum lost, share: without and with projection */
    double spin0, energy0, scale;      /* of the run: angular momentum, energy, momentum of a quarter of the body */
    driver_snapshot shots[PANELS];
} study;

static const char *name_of(const study *s) { return s->p.dimension == 2 ? "spinning_plate" : "spinning_cube"; }

static void record(study *s) {
    const tlsph_ledger *now = &s->base.now;
    const double row[5] = { now->linear_momentum[0], now->linear_momentum[1], now->linear_momentum[2],
                            now->angular_momentum[2], 100 * (now->total_energy / s->energy0 - 1) };
    if (s->finest_run) driver_history_add(&s->history, now->time, row);
}
static void after_step(driver *d) { record(d->user); }

static void begin_run(study *s) {
    s->spin0 = s->base.now.angular_momentum[2];
    s->energy0 = s->base.now.total_energy;
    s->scale = s->base.now.mass * s->p.spin / 4;
    s->history.columns = 5;
    s->base.step = after_step;
    s->base.user = s;
    record(s);
}

static int run_level(study *s, int level, int projection) {
    spinning_box_parameters p = s->p;
    tlsph_error error;
    char key[64];
    p.n = s->p.n >> (s->levels - 1 - level);
    p.options.projection = projection;
    s->finest_run = level == s->levels - 1 && !projection;
    if (spinning_box_create(&p, &s->box, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&s->base, name_of(s), &s->p.options, &s->box.body, p.options.end_time)) return 1;
    begin_run(s);
    for (int i = 0; i < PANELS; i++) {
        driver_run_to(&s->base, p.options.end_time * (i + 1) / PANELS);
        if (s->finest_run) driver_snap(&s->box.body, TLSPH_FIELD_VON_MISES, 0, 1e-6, &s->shots[i]);
    }
    s->n[level] = p.n;
    s->loss[projection][level] = 1 - s->base.now.angular_momentum[2] / s->spin0;
    snprintf(key, sizeof key, "angular_loss_n%d%s", p.n, projection ? "_projected" : "");
    ex_result(key, 100 * s->loss[projection][level], "%");
    snprintf(key, sizeof key, "energy_change_n%d%s", p.n, projection ? "_projected" : "");
    ex_result(key, 100 * (s->base.now.total_energy / s->energy0 - 1), "%");
    snprintf(key, sizeof key, "linear_momentum_n%d%s", p.n, projection ? "_projected" : "");
    ex_check_below(key, hypot(s->base.now.linear_momentum[0], s->base.now.linear_momentum[1]) / s->scale, 1e-10);
    if (projection) {
        snprintf(key, sizeof key, "angular_loss_n%d_is_round_off", p.n);
        ex_check_below(key, fabs(s->loss[1][level]), 1e-10);
    }
    snprintf(key, sizeof key, "pressure_oscillation_n%d%s", p.n, projection ? "_projected" : "");
    if (s->base.result == TLSPH_OK) ex_result(key, scene_oscillation(s->box.body.solver, TLSPH_FIELD_PRESSURE), "1");
    const int code = driver_end(&s->base);
    scene_destroy(&s->box.body);
    return code == 3 ? 3 : 0;
}

static void draw(study *s) {
    static const driver_chart charts[] = { { "linear momentum", "[kg m/s]", 0, 3, { "x", "y", "z" } },
                                           { "angular momentum about z", "[kg m2/s]", 3, 1, { "without projection" } },
                                           { "change of the energy", "[%]", 4, 1, { "without projection" } } };
    double lost[LEVELS];
    ex_view view;
    ex_axes axes;
    const ex_curve curve = { "without projection", s->n, lost, (size_t)s->levels, 3, 0 };
    for (int i = 0; i < s->levels; i++) lost[i] = 100 * fabs(s->loss[0][i]);
    memset(&axes, 0, sizeof axes);
    axes.title = "angular momentum lost by the end"; axes.x_label = "particles a side"; axes.y_label = "[%]";
    axes.log_x = axes.log_y = 1;
    ex_plot(driver_path(&s->base, "loss.png"), 640, 420, &axes, &curve, 1);
    driver_plot(&s->base, "momenta.png", &s->history, charts, 3, 3);
    memset(&view, 0, sizeof view);
    view.panel_width = 380; view.panel_height = 380;
    view.camera.up_axis = 2; view.camera.zoom = 1;
    view.camera.azimuth = s->p.dimension == 2 ? -90 : 30; view.camera.elevation = s->p.dimension == 2 ? 90 : 25;
    view.map = EX_MAP_VIRIDIS;
    view.label = "von Mises stress [MPa]";
    view.common_scale = 1;
    driver_render(&s->base, "stress.png", &view, s->shots, PANELS, PANELS, 0.5 / s->p.n);
}

static int run_study(study *s) {
    int failed = run_level(s, 0, 1); /* with projection: on the coarsest level, where most would be lost */
    for (int level = 0; level < s->levels && !failed; level++) failed = run_level(s, level, 0);
    if (failed) return failed;
    draw(s);
    for (int i = 0; i < PANELS; i++) driver_snapshot_free(&s->shots[i]);
    driver_history_free(&s->history);
    if (s->levels > 1) ex_check_true("finer_bodies_lose_less", fabs(s->loss[0][s->levels - 1]) < fabs(s->loss[0][0]));
    return ex_exit_code();
}

int spinning_main(int argc, char **argv, int dimension) {
    static study s;
    spinning_box_parameters *p = &s.p;
    const ex_option own[] = {
        { "n", EX_INT, &p->n, NULL, NULL, 4, 400, "particles a side at the finest level (paper: 200, cube 50)" },
        { "levels", EX_INT, &s.levels, NULL, NULL, 1, LEVELS, "each has half the particles a side of the next" },
        { "omega", EX_REAL, &p->spin, "rad/s", NULL, 0, 1000, "initial spin" },
        { "nu", EX_REAL, &p->poisson, NULL, NULL, -0.9, 0.4999, "Poisson's ratio" } };
    spinning_box_default(p, dimension);
    s.levels = dimension == 2 ? 3 : 2;
    driver_arguments(argc, argv, name_of(&s), "momenta of a free spinning body (002 section 5.2)", &p->options, own,
                     (int)(sizeof own / sizeof *own));
    return run_study(&s);
}
