/*
twisting_limits.c - how long schemes survive a column thrown into torsion at 105, 300 and 400 rad/s: 002 section 5.5

The library's own scheme, the same as it should be set for such a scene (`wide`), the same with the dissipation of 002, and
the scheme of 002 with the adjoint force, with the force as printed (22), and with the paper's time step by the p speed of
the undeformed body; sizes (--n 0), materials, Courant numbers and coefficients are those of figures 23 to 25. The other runs
step by current speeds and what JST allows. Draws the shapes of all schemes at the same instants and the total energy over
time. A run is sound as long as no particle inverts and the energy stays below 102 % of the initial one: nothing feeds the
column.

Why the default is ragged at 300 and 400 rad/s. With 6 neighbours a motion that alternates from layer to layer is not seen by
F. What feeds it is the frame of the projection: the dissipation acts on velocities without the rigid motion of the body,
and the wound foot is at rest while the body as a whole turns with W. Seen from there the foot turns with -W, and where
layers alternate by z the damping pushes along W x z, as damping in the rotor makes a fast shaft whirl. With stronger, weaker
and unlimited dissipation, JST and smaller steps it stays; without projection layers alternate ten times less at 69 ms
(n = 6, 300 rad/s: 0.023 instead of 0.25 spacings), at the price of more dissipation. A clamped body has no angular momentum to
keep. At 92 ms, when the foot unwinds, it takes 26 neighbours as well: 0.013 spacings, 0.08 with 6. (A column of 3 spacings does
not resolve the winding at 400 rad/s, smooth or not.)
*/
#include "common/driver.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SCHEMES = 6, CASES = 3, SHOTS = 4 };
enum { OWN, WIDE, OWN_JST, BONDS, PRINTED, LINEAR_STEP };
enum { TWIST, HEIGHT, ENERGY, COLUMNS };

static const char *const scheme_names[SCHEMES] = { "own", "wide", "own_jst", "bonds", "bonds_printed_force",
                                                    "bonds_linear_step" };

/* Figures 23, 24, 25. The times of the last two are not told, but 92.1 ms. */
typedef struct twist_case {
    const char *name, *file, *picture;
    int n;
    double omega, nu, cfl, biharmonic, end, shots[SHOTS];
} twist_case;
static const twist_case cases[CASES] = {
    { "105", "shapes_105.png", "energy_105.png", 7, 105, 0.45, 0.9, 0.125, 0.25, { 0.05, 0.1, 0.175, 0.25 } },
    { "300", "shapes_300.png", "energy_300.png", 11, 300, 0.49, 0.5, 0.125, 0.0921, { 0.02, 0.04, 0.065, 0.0921 } },
    { "400", "shapes_400.png", "energy_400.png", 12, 400, 0.49, 0.5, 0.6, 0.1, { 0.02, 0.04, 0.065, 0.1 } } };

typedef struct study {
    twisting_column_parameters given;
    driver base;
    twisting_column column;
    twisting_column_shape shape;
    driver_history history[SCHEMES];
    driver_snapshot shots[SCHEMES * SHOTS];
    double energy0, sound_until, least_J, end, began;
    int only_case, only_scheme, scheme;
} study;

static twisting_column_parameters parameters_of(const study *s, const twist_case *c, int scheme) {
    twisting_column_parameters p = s->given;
    p.n = s->given.n ? s->given.n : c->n;
    p.omega = c->omega;
    p.nu = c->nu;
    p.options.unknowns = scheme != OWN || c->nu < 0.49 ? (int)TLSPH_PF : (int)TLSPH_PFJ;
    if (scheme == WIDE) {
        p.options.kernel = (int)TLSPH_CUBIC_SPLINE;
        p.options.support = 0.9;
        p.options.projection = 0;
    }
    if (scheme >= OWN_JST) {
        scene_options_of_002(&p.options, c->biharmonic);
        p.options.cfl = c->cfl;
        p.options.step_rule = (int)TLSPH_STEP_BY_PARTICLE;
        p.centred = 1;
    }
    if (scheme == OWN_JST) {
        const scene_options own = s->given.options;
        p.options.operator_kind = own.operator_kind;
        p.options.kernel = own.kernel;
        p.options.support = own.support;
        p.options.projection = own.projection;
        p.centred = 0;
    }
    if (scheme == PRINTED) p.options.force_form = (int)TLSPH_FORCE_AS_PRINTED;
    if (scheme == LINEAR_STEP) p.options.step_rule = (int)TLSPH_STEP_BY_PAIR_LINEAR; /* the paper's choice, section 5.3 */
    return p;
}

static void after_step(driver *d) {
    study *s = d->user;
    const double share = d->now.total_energy / s->energy0;
    double row[COLUMNS];
    twisting_column_read(&s->column, &s->shape);
    row[TWIST] = s->shape.tip_twist / (2 * SCENE_PI);
    row[HEIGHT] = s->shape.tip_height;
    row[ENERGY] = fmin(share, 2);
    driver_history_add(&s->history[s->scheme], d->now.time, row);
    s->least_J = fmin(s->least_J, d->now.jacobian_least);
    if (share > 1.02 && s->sound_until >= s->end) s->sound_until = d->now.time; /* the first rise above 102 % */
}

/* A picture of the present state; where the run has ended, the same again for all later instants. */
static void snap(study *s, int shot) {
    driver_snapshot *out = &s->shots[SHOTS * s->scheme + shot];
    if (driver_snap(&s->column.body, TLSPH_FIELD_VON_MISES, 0, 1e-6, out)) return;
    snprintf(out->title, sizeof out->title, "%s, %s%.1f ms", scheme_names[s->scheme],
             s->base.result == TLSPH_OK ? "" : "ended at ", 1e3 * out->time);
}

static void report(study *s, const twist_case *c) {
    char key[96];
    const char *name = scheme_names[s->scheme];
    if (s->base.result != TLSPH_OK) s->sound_until = fmin(s->sound_until, s->base.now.time);
#define RESULT(what, value, unit) (snprintf(key, sizeof key, "%s_%s_%s", c->name, name, what), ex_result(key, value, unit))
    RESULT("time", 1e3 * s->base.now.time, "ms");
    RESULT("sound_until", 1e3 * s->sound_until, "ms");
    RESULT("energy_ratio", s->base.now.total_energy / s->energy0, "1");
    RESULT("turns", s->shape.tip_twist / (2 * SCENE_PI), "1");
    RESULT("tip_height", s->shape.tip_height, "m");
    RESULT("minimum_J", s->least_J, "1");
    /* of neighbours at the end: what the sum of energies does not show, a foot wound beyond what its particles resolve */
    RESULT("pressure_oscillation", scene_oscillation(s->column.body.solver, TLSPH_FIELD_PRESSURE), "1");
    RESULT("alternation", scene_alternation(&s->column.body, 1), "spacings"); /* of layers: ragged shapes */
    RESULT("steps", (double)s->base.now.step, "1");
    if (!s->given.options.quiet) fprintf(stderr, "%s, %s: %.0f s\n", c->name, name, ex_cpu_seconds() - s->began);
#undef RESULT
    if (s->scheme > WIDE) return;
    snprintf(key, sizeof key, "%s_%s_is_sound", c->name, name);
    ex_check_true(key, s->base.result == TLSPH_OK && s->sound_until >= s->end);
    snprintf(key, sizeof key, "%s_%s_is_smooth", c->name, name);
    if (s->scheme == WIDE && (c->omega < 350 || s->column.parameters.n >= 5)) ex_check_below(key, scene_alternation(&s->column.body, 1), 0.06);
}

/* Runs to the instants of the pictures. 0, or an exit code. */
static int run_scheme(study *s, const twist_case *c, int scheme) {
    const twisting_column_parameters p = parameters_of(s, c, scheme);
    tlsph_error error;
    s->scheme = scheme;
    s->end = s->given.options.end_time > 0 ? fmin(s->given.options.end_time, c->end) : c->end;
    s->sound_until = s->end;
    s->least_J = 1;
    s->began = ex_cpu_seconds();
    memset(&s->shape, 0, sizeof s->shape);
    if (twisting_column_create(&p, &s->column, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&s->base, "twisting_limits", &s->given.options, &s->column.body, s->end)) return 1;
    s->base.step = after_step;
    s->base.stride = 5; /* at 400 rad/s the top turns by less than half a turn in five steps */
    s->base.user = s;
    s->energy0 = s->base.now.total_energy;
    s->history[scheme].columns = COLUMNS;
    after_step(&s->base);
    for (int i = 0; i < SHOTS; i++) {
        driver_run_to(&s->base, s->end * c->shots[i] / c->end);
        snap(s, i);
    }
    tlsph_ledger_read(s->column.body.solver, &s->base.now); /* the last good state, wherever the stride left off */
    after_step(&s->base);
    report(s, c);
    ex_progress_end(&s->base.progress, s->base.now.time, (long)s->base.now.step);
    ex_series_close(&s->base.series);
    ex_csv_close(&s->base.ledger);
    scene_destroy(&s->column.body);
    return 0;
}

static void draw(study *s, const twist_case *c) {
    static const driver_panel panels[COLUMNS] = { { "twist of the top", "[turns]" }, { "height of the top", "[m]" },
                                                  { "total energy over the initial one", "[1]" } };
    const driver_history *list[SCHEMES];
    const char *names[SCHEMES];
    int count = 0;
    char heading[128];
    snprintf(heading, sizeof heading, "twisting column, %g rad/s, nu = %g (002 section 5.5)", c->omega, c->nu);
    ex_view view = driver_view(230, 520, 30, 12, 1, EX_MAP_VIRIDIS, "von Mises stress [MPa]", heading);
    view.common_scale = 2;
    driver_render(&s->base, c->file, &view, s->shots, SCHEMES * SHOTS, SHOTS, 0.5 / (s->given.n ? s->given.n : c->n));
    for (int i = 0; i < SCHEMES; i++) {
        if (!s->history[i].count) continue;
        list[count] = &s->history[i];
        names[count++] = scheme_names[i];
    }
    driver_overlay(&s->base, c->picture, list, names, count, panels, COLUMNS);
}

static int run_case(study *s, const twist_case *c) {
    int code = 0;
    for (int scheme = 0; scheme < SCHEMES && !code; scheme++)
        if (!s->only_scheme || s->only_scheme == scheme + 1) code = run_scheme(s, c, scheme);
    if (!code) draw(s, c);
    for (int i = 0; i < SCHEMES * SHOTS; i++) driver_snapshot_free(&s->shots[i]);
    for (int i = 0; i < SCHEMES; i++) driver_history_free(&s->history[i]);
    memset(s->history, 0, sizeof s->history);
    return code;
}

int main(int argc, char **argv) {
    static study s;
    int code = 0;
    const ex_option own[] = {
        { "n", EX_INT, &s.given.n, NULL, NULL, 0, 40, "spacings across 1 m; 0: 7, 11 and 12, as in 002" },
        { "omega", EX_CHOICE, &s.only_case, NULL, "all|105|300|400", 0, 0, "initial angular velocity of the top, rad/s" },
        { "only", EX_CHOICE, &s.only_scheme, NULL, "all|own|wide|own_jst|bonds|bonds_printed_force|bonds_linear_step", 0, 0,
          "one of the schemes" } };
    twisting_column_default(&s.given);
    s.given.options.unknowns = (int)TLSPH_PF;
    s.given.options.end_time = 0;
    s.given.options.frames = 0;
    s.given.options.threads = 1;
    s.given.n = 3;
    driver_arguments(argc, argv, "twisting_limits", "how long schemes survive a twist (002 section 5.5)", &s.given.options, own,
                     (int)(sizeof own / sizeof *own));
    for (int i = 0; i < CASES && !code; i++)
        if (!s.only_case || s.only_case == i + 1) code = run_case(&s, &cases[i]);
    if (!code) printf("written to %s\n", s.base.folder);
    return code ? code : ex_exit_code();
}
