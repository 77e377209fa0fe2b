/*
standing_wave.c - thermo-elastic standing wave in a bar: frequency and damping against the exact root

The one scene in which conduction, expansion and inertia act together and the answer is known to all digits (see
scenes/standing_wave.c). By default heat diffuses over the wave as fast as the wave swings, where the damping is large,
and gradients are sharp: with --sharp 0 the central stencil alone makes the wave (kh)^2/6 too slow, 0.64 % at 32 spacings
a wavelength.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct run { driver base; standing_wave wave; driver_history history; } run;

static void record(run *r) {
    const double t = r->base.now.time, amplitude = r->wave.parameters.amplitude;
    double u, v, strain, theta, row[2];
    standing_wave_exact(&r->wave, r->wave.parameters.length / 2, t, &u, &v, &strain, &theta); /* sin kX = 1 */
    row[0] = standing_wave_amplitude(&r->wave) / amplitude;
    row[1] = v / amplitude;
    driver_history_add(&r->history, t, row);
}

static void after_step(driver *d) { record(d->user); }
static void stepped(void *user) { driver_stepped(&((run *)user)->base); }

static void draw(run *r) {
    static const driver_chart chart = { "velocity along sin kX, by the displacement amplitude", "[1/s]", 0, 2,
                                        { "computed", "exact" } };
    ex_view view;
    driver_snapshot shot;
    memset(&view, 0, sizeof view);
    view.panel_width = 900; view.panel_height = 300;
    view.camera.azimuth = 60; view.camera.elevation = 25; view.camera.up_axis = 2; view.camera.zoom = 1;
    view.map = EX_MAP_DIVERGING;
    view.label = "temperature - theta_R [mK]";
    view.heading = "thermo-elastic standing wave at the end";
    driver_plot(&r->base, "velocity.png", &r->history, &chart, 1, 1);
    if (driver_snap(&r->wave.body, TLSPH_FIELD_TEMPERATURE, 0, 1, &shot)) return;
    for (size_t i = 0; i < shot.count; i++)
        shot.values[i] = 1e3 * (shot.values[i] - (double)r->wave.body.material.reference_temperature);
    driver_render(&r->base, "temperature.png", &view, &shot, 1, 1, r->wave.parameters.length / r->wave.parameters.n);
    driver_snapshot_free(&shot);
}

/* Targets at 32 particles a wavelength: frequency within 0.5 %, damping within 10 %. Where conduction is so weak that
   the wave hardly loses anything in a period, the scheme's own loss must be small by the frequency instead. */
static void report(const standing_wave *wave, const double s[2]) {
    const double tolerance = fmax(0.1 * fabs(wave->s[0]), 1e-4 * wave->s[1]);
    double error_u, error_theta;
    standing_wave_errors(wave, &error_u, &error_theta);
    ex_result("frequency", s[1], "rad/s");
    ex_result("damping", -s[0], "1/s");
    ex_result("exact_frequency", wave->s[1], "rad/s");
    ex_result("exact_damping", -wave->s[0], "1/s");
    ex_result("error_u", error_u, "1");
    ex_result("error_theta", error_theta, "1");
    ex_check("frequency", s[1], wave->s[1], 0.005 * wave->s[1]);
    ex_check("damping", -s[0], -wave->s[0], tolerance);
}

static int run_wave(const standing_wave_parameters *p) {
    static run r;
    tlsph_error error;
    double s[2];
    int code;
    if (standing_wave_create(p, &r.wave, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&r.base, "standing_wave", &p->options, &r.wave.body, standing_wave_end(&r.wave))) return 1;
    r.history.columns = 2;
    r.base.step = after_step;
    r.base.user = &r;
    record(&r);
    r.base.result = standing_wave_measure(&r.wave, s, stepped, &r);
    draw(&r);
    if (r.base.result == TLSPH_OK) report(&r.wave, s);
    code = driver_end(&r.base);
    driver_history_free(&r.history);
    scene_destroy(&r.wave.body);
    return code;
}

int main(int argc, char **argv) {
    standing_wave_parameters p;
    const ex_option own[] = {
        { "n", EX_INT, &p.n, NULL, NULL, 8, 4096, "spacings a wavelength, even; half of them along the bar" },
        { "delta", EX_REAL, &p.delta, NULL, NULL, 0, 10, "thermo-elastic coupling" },
        { "conductivity", EX_REAL, &p.conductivity, "W/(m K)", NULL, 0, 1e9, "default: D k^2 = c k" },
        { "periods", EX_REAL, &p.periods, NULL, NULL, 0.5, 1000, "length of the run" },
        { "dimension", EX_INT, &p.dimension, NULL, NULL, 2, 3, "2: plane strain" },
        { "across", EX_INT, &p.across, NULL, NULL, 1, 100, "spacings across the bar" },
        { "amplitude", EX_REAL, &p.amplitude, "m", NULL, 1e-12, 1e-2, "of the displacement" } };
    standing_wave_default(&p);
    driver_arguments(argc, argv, "standing_wave", "thermo-elastic standing wave in a bar of 1 m", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    if (p.n % 2) {
        fprintf(stderr, "standing_wave: --n must be even, found %d\n", p.n);
        return 2;
    }
    return run_wave(&p);
}
