/*
conduction.c - a hot spot in a resting, a stretched and a turning body, and temperatures that alternate from particle to
particle: conduction alone against exact solutions (000-13, 56; see scenes/conduction.c)
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEVELS 3
#define MOTIONS 3
#define PANELS (MOTIONS + 1)

static const char *const motions[MOTIONS] = { "resting", "stretched", "turning" };

typedef struct run { driver base; driver_snapshot shots[PANELS]; } run;

static void keep_shot(driver_snapshot *shot, const conducting_body *body, const char *title) {
    if (driver_snap(&body->body, TLSPH_FIELD_TEMPERATURE, 0, 1, shot)) return;
    snprintf(shot->title, sizeof shot->title, "%s", title);
}

/* One spot; the finest turning one with frames and ledger. Returns an exit code. */
static int run_spot(run *r, const conduction_parameters *p, int finest, double *error) {
    static conducting_body body; /* the drive points into it */
    const int shown = finest && p->motion == CONDUCTION_TURNING;
    tlsph_error failure;
    tlsph_result result;
    int code = 0;
    if (conduction_create(p, &body, &failure) != TLSPH_OK) return driver_error(&failure);
    if (finest && p->motion == CONDUCTION_RESTING) keep_shot(&r->shots[0], &body, "start, resting");
    if (shown && driver_begin(&r->base, "conduction", &p->options, &body.body, p->options.end_time)) return 1;
    result = shown ? driver_run_to(&r->base, p->options.end_time)
                   : tlsph_advance(body.body.solver, (tlsph_real)p->options.end_time);
    *error = conduction_error(&body);
    if (finest) keep_shot(&r->shots[1 + (int)p->motion], &body, motions[p->motion]);
    if (shown) code = driver_end(&r->base);
    else if (result != TLSPH_OK) code = driver_error(tlsph_last_error(body.body.solver));
    scene_destroy(&body.body);
    return code == 3 ? 3 : 0;
}

static int run_spots(run *r, const conduction_parameters *base) {
    for (int motion = 0; motion < MOTIONS; motion++) {
        double errors[LEVELS], order;
        char key[64];
        for (int i = 0; i < LEVELS; i++) {
            conduction_parameters p = *base;
            int code;
            p.motion = (conduction_motion)motion;
            p.n = base->n >> (LEVELS - 1 - i);
            code = run_spot(r, &p, i == LEVELS - 1, &errors[i]);
            if (code) return code;
        }
        order = log2(errors[0] / errors[LEVELS - 1]) / (LEVELS - 1);
        printf("%s: relative L2 errors %.2e %.2e %.2e\n", motions[motion], errors[0], errors[1], errors[2]);
        snprintf(key, sizeof key, "%s_error", motions[motion]);
        ex_result(key, errors[LEVELS - 1], "1");
        snprintf(key, sizeof key, "%s_order", motions[motion]);
        ex_result(key, order, "1");
        if (base->jitter <= 0) ex_check(key, fmin(order, 2), 2, 0.1);
    }
    return 0;
}

static void draw_spots(run *r, const conduction_parameters *p) {
    ex_view view;
    memset(&view, 0, sizeof view);
    view.panel_width = 420; view.panel_height = 420;
    view.camera.azimuth = -90;
    view.camera.elevation = p->dimension == 2 ? 90 : 40;
    view.camera.up_axis = 2;
    view.camera.zoom = 1;
    view.map = EX_MAP_HEAT;
    view.low = (double)p->material.reference_temperature; view.high = view.low + 0.7 * p->amplitude;
    view.label = "temperature [K]";
    view.heading = "hot spot at the start, and at the end in a resting, a stretched and a turning body";
    view.common_scale = 1;
    driver_render(&r->base, "spots.png", &view, r->shots, PANELS, PANELS, 0.5 / p->n);
    for (int i = 0; i < PANELS; i++) driver_snapshot_free(&r->shots[i]);
}

/* -- decay curves: of the alternating state with both fluxes, and of the mode -- */

#define SAMPLES 60

static int run_decay(const conduction_parameters *p, double end, double *share) {
    static conducting_body body;
    tlsph_error failure;
    tlsph_result result = conduction_create(p, &body, &failure);
    int code = 0;
    if (result != TLSPH_OK) return driver_error(&failure);
    for (int i = 0; i <= SAMPLES && result == TLSPH_OK; i++) {
        result = tlsph_advance(body.body.solver, (tlsph_real)(end * i / SAMPLES));
        share[i] = conduction_amplitude(&body);
    }
    if (result != TLSPH_OK) code = driver_error(tlsph_last_error(body.body.solver));
    scene_destroy(&body.body);
    return code;
}

static int run_decays(run *r, const conduction_parameters *base) {
    const double D =
        (double)base->material.conductivity / (double)(base->material.density * base->material.specific_heat);
    const double fast = 4 * base->dimension * D * 16 * 16, slow = SCENE_PI * SCENE_PI * base->dimension * D;
    double time[2][SAMPLES + 1], share[3][SAMPLES + 1], exact[2][SAMPLES + 1];
    conduction_parameters p = *base;
    int code;
    p.n = 16;
    p.motion = CONDUCTION_RESTING;
    p.state = CONDUCTION_ALTERNATING;
    p.options.conduction = TLSPH_COMPACT;
    code = run_decay(&p, 6 / fast, share[0]);
    p.options.conduction = TLSPH_DOUBLE_GRADIENT;
    if (!code) code = run_decay(&p, 6 / fast, share[1]);
    p.n = 32;
    p.state = CONDUCTION_MODE;
    p.options.conduction = base->options.conduction;
    if (!code) code = run_decay(&p, 2 / slow, share[2]);
    if (code) return code;
    for (int i = 0; i <= SAMPLES; i++) {
        const double x = (double)i / SAMPLES;
        time[0][i] = 6 / fast * x; time[1][i] = 2 / slow * x;
        exact[0][i] = exp(-6 * x); exact[1][i] = exp(-2 * x);
    }
    {
        const ex_curve odd[3] = { { "compact", time[0], share[0], SAMPLES + 1, 0, 0 },
                                  { "double gradient (56)", time[0], share[1], SAMPLES + 1, 0, 1 },
                                  { "two-point flux, exact", time[0], exact[0], SAMPLES + 1, 1, 2 } };
        const ex_curve mode[2] = { { "computed", time[1], share[2], SAMPLES + 1, 0, 0 },
                                   { "exact", time[1], exact[1], SAMPLES + 1, 1, 1 } };
        const ex_curve *of[2] = { odd, mode };
        const int counts[2] = { 3, 2 };
        ex_axes axes[2];
        memset(axes, 0, sizeof axes);
        axes[0].title = "temperatures that alternate, 16 spacings: share left";
        axes[1].title = "cosine mode, 32 spacings: share left";
        for (int i = 0; i < 2; i++) { axes[i].x_label = "t [s]"; axes[i].y_label = "[1]"; }
        ex_plot_grid(driver_path(&r->base, "decay.png"), 640, 420, axes, of, counts, 2, 2);
    }
    ex_result("alternating_left_compact", share[0][SAMPLES], "1");
    ex_result("alternating_left_double_gradient", share[1][SAMPLES], "1");
    ex_result("mode_left", share[2][SAMPLES], "1");
    if (base->jitter > 0) return 0;
    ex_check_below("alternating_left_compact", fabs(share[0][SAMPLES]), 0.05);
    ex_check("alternating_left_double_gradient", share[1][SAMPLES], 1, 0.1);
    ex_check("mode_left", share[2][SAMPLES], exp(-2), 0.01 * exp(-2));
    return 0;
}

int main(int argc, char **argv) {
    static run r;
    conduction_parameters p;
    int code;
    const ex_option own[] = { { "n", EX_INT, &p.n, NULL, NULL, 16, 1024,
                                "spacings a side of the finest body; two more have n/2 and n/4" },
                              { "dimension", EX_INT, &p.dimension, NULL, NULL, 2, 3, "2: plane strain" },
                              { "amplitude", EX_REAL, &p.amplitude, "K", NULL, 1e-6, 250, "of the spot" },
                              { "jitter", EX_REAL, &p.jitter, "spacings", NULL, 0, 0.45,
                                "moves inner particles; then the closed operator stands in for corrected kernels" } };
    conduction_default(&p);
    p.n = 96;
    driver_arguments(argc, argv, "conduction", "conduction alone: spots and decays against exact solutions", &p.options,
                     own, (int)(sizeof own / sizeof *own));
    if (p.options.thermal == TLSPH_ISOTHERMAL) {
        fprintf(stderr, "error: --thermal must be energy or entropy here\n");
        return 2;
    }
    p.omega = SCENE_PI / 3 / p.options.end_time;
    code = run_spots(&r, &p);
    if (!code) { draw_spots(&r, &p); code = run_decays(&r, &p); }
    return code ? code : ex_exit_code();
}
