/*
tests/extremes.c - how far the solver goes, one row for each extreme: what was measured, what is asked for, pass or FAIL

  build/extremes_double [--quick] [filter...]     also build/extremes_float;  make extremes runs both
    --quick   rows of a second or less only.      A filter is a part of a group's name; --list shows them.

Bodies are tiny, so that all of it takes minutes on one core. A row that breaks says where. The last line is the summary,
the exit code 1 if a row failed. Lengths, densities and moduli are of order 1 unless a row is about them.
*/
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include "../examples/scenes/scenes.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define R(x) ((tlsph_real)(x))
#define PI 3.14159265358979323846
#ifdef TLSPH_REAL_FLOAT
enum { IS_FLOAT = 1 };
#define EPSILON ((double)FLT_EPSILON)
#else
enum { IS_FLOAT = 0 };
#define EPSILON DBL_EPSILON
#endif

/* ---- rows -------------------------------------------------------------------------------------------------------- */

static struct { int passed, failed; } tally;

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* One line of the table; `note` tells the rest of what was seen. */
static void row(const char *name, int holds, double value, const char *relation, double bound, const char *unit,
                const char *note) {
    if (holds) tally.passed++;
    else tally.failed++;
    printf("  %s  %-58s %11.4g %s %-9.4g %-5s %s\n", holds ? "pass" : "FAIL", name, value, relation, bound, unit, note);
    fflush(stdout);
}
static void at_least(const char *name, double value, double bound, const char *unit, const char *note) {
    row(name, value >= bound, value, ">=", bound, unit, note);
}
static void at_most(const char *name, double value, double bound, const char *unit, const char *note) {
    row(name, value <= bound, value, "<=", bound, unit, note);
}
/* Something that is true or not: 1 where it should be 1. */
static void holds(const char *name, int is, const char *note) { row(name, is, is, "==", 1, "", note); }

/* A short text; a few live at a time. */
static const char *text(const char *format, ...) {
    static char ring[8][400];
    static int at;
    va_list list;
    char *out = ring[at = (at + 1) % 8];
    va_start(list, format);
    vsnprintf(out, sizeof ring[0], format, list);
    va_end(list);
    return out;
}

/* ---- a scene under construction ---------------------------------------------------------------------------------- */

/* Everything of a description within reach, so that rows can change what they are about. */
#define RIG_CONDITIONS 8
typedef struct rig {
    tlsph_fill fill;
    tlsph_desc desc;
    tlsph_material materials[2];
    tlsph_condition conditions[RIG_CONDITIONS];
    uint32_t *lists[RIG_CONDITIONS];
    scene_body body; /* cloud and solver */
    tlsph_result result;
    tlsph_error error;
} rig;

/* The small bodies here run best without threads. */
static void serial(void *user, tlsph_task_fn task, void *arg, size_t count) {
    (void)user;
    for (size_t i = 0; i < count; i++) task(arg, i);
}

/* A box of nx x ny x nz cells of `spacing` in the positive octant (nz = 0: plane strain) of a neo-Hookean material with
   density, Young's modulus and thermal constants of 1 (theta_R = 300). */
static void rig_begin(rig *r, int nx, int ny, int nz, double spacing) {
    const int cells[3] = { nx, ny, nz };
    tlsph_material m = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    memset(r, 0, sizeof *r);
    m.density = m.young = m.specific_heat = 1;
    m.poisson = R(0.3);
    m.reference_temperature = 300;
    r->materials[0] = r->materials[1] = m;
    r->fill = tlsph_fill_default(nz ? 3 : 2);
    r->fill.spacing = R(spacing);
    for (int i = 0; i < r->fill.dimension; i++) r->fill.size[i] = R(cells[i] * spacing);
    r->desc = tlsph_desc_default(nz ? 3 : 2);
    r->desc.run = serial;
}
static void rig_fill(rig *r) { r->result = tlsph_cloud_create(&r->fill, &r->body.cloud, &r->error); }

typedef struct plane { int axis; double value, tolerance; } plane;
static int on_plane(void *user, const tlsph_real X[3]) {
    const plane *p = user;
    return fabs((double)X[p->axis] - p->value) <= p->tolerance;
}
/* A condition on the particles with X[axis] = value, or on all (axis < 0). */
static tlsph_condition *rig_add(rig *r, tlsph_condition_kind kind, int axis, double value) {
    const tlsph_particles *particles = &r->body.cloud.particles;
    const size_t i = r->desc.condition_count++;
    tlsph_condition *c = r->conditions + i;
    *c = tlsph_condition_default(kind);
    if (axis < 0) return c;
    plane p = { axis, value, 1e-3 * (double)r->body.cloud.cell_size[axis] };
    r->lists[i] = malloc((particles->count + 1) * sizeof **r->lists);
    if (!r->lists[i]) abort();
    c->count = tlsph_select(particles, on_plane, &p, r->lists[i], particles->count);
    c->particles = r->lists[i];
    c->normal[axis] = 1;
    return c;
}
/* The second material for X > 1/2; the list must live until rig_create and is the caller's. */
static uint8_t *rig_two_materials(rig *r) {
    tlsph_particles *p = &r->body.cloud.particles;
    uint8_t *materials = calloc(p->count + 1, 1);
    if (!materials) abort();
    for (size_t a = 0; a < p->count; a++) materials[a] = (double)p->positions[3 * a] > 0.5;
    p->materials = materials;
    return materials;
}
static tlsph_result rig_create(rig *r) {
    if (!r->body.cloud.particles.count && !r->result) rig_fill(r);
    r->desc.particles = r->body.cloud.particles;
    r->desc.materials = r->materials;
    r->desc.material_count = 2;
    r->desc.conditions = r->conditions;
    r->body.material = r->materials[0];
    if (!r->result) r->result = tlsph_create(&r->desc, &r->body.solver, &r->error);
    return r->result;
}
static void rig_state(rig *r, const void *scene, scene_state_fn state) {
    if (!r->result) r->result = scene_set_state(&r->body, scene, state);
}
static void rig_end(rig *r) {
    for (size_t i = 0; i < RIG_CONDITIONS; i++) free(r->lists[i]);
    scene_destroy(&r->body);
}
static tlsph_result rig_steps(rig *r, long count) {
    for (long i = 0; i < count && !r->result; i++) r->result = tlsph_step(r->body.solver, R(HUGE_VAL));
    return r->result;
}
static tlsph_ledger rig_ledger(const rig *r) {
    tlsph_ledger l;
    memset(&l, 0, sizeof l);
    l.total_energy = l.energy_residual = NAN;
    if (r->body.solver) tlsph_ledger_read(r->body.solver, &l);
    return l;
}
static const char *rig_message(const rig *r) {
    if (r->result && r->body.solver && tlsph_last_error(r->body.solver)->result)
        return tlsph_last_error(r->body.solver)->message;
    return r->result ? r->error.message : "";
}
static double rig_read(const rig *r, tlsph_field field, tlsph_real **values) {
    *values = r->body.solver ? scene_read(r->body.solver, field) : NULL;
    return *values ? 0 : NAN;
}

/* A smooth motion that is no rigid one, with spin; scene points at its speed over the size of the body. */
static void lively(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double speed = *(const double *)scene, x = (double)X[0], y = (double)X[1], z = (double)X[2];
    state->v[0] = speed * (-y + 0.5 * sin(2 * x) - 0.3 * z);
    state->v[1] = speed * (x + 0.4 * cos(3 * z) + 0.2 * y * z);
    state->v[2] = speed * (0.7 * sin(2 * y) - 0.2 * x * x);
}

/* ---- deformation ------------------------------------------------------------------------------------------------- */

/* Elongation (%) of a clamped column of 2 x 2 x 12 cells at which the pull fails, or ends: `most`. */
static double pulled_until(tlsph_unknowns unknowns, tlsph_dissipation dissipation, double nu, double most) {
    pulled_column_parameters p;
    pulled_column column;
    pulled_column_default(&p);
    p.n = 2;
    p.poisson = nu;
    p.elongation = most;
    p.options.unknowns = (int)unknowns;
    p.options.dissipation = (int)dissipation;
    if (pulled_column_create(&p, &column, NULL)) return 0;
    tlsph_result result = TLSPH_OK;
    while (!result && (double)tlsph_time(column.body.solver) < pulled_column_end(&p))
        result = tlsph_step(column.body.solver, R(HUGE_VAL));
    const double reached = pulled_column_elongation(&column);
    scene_destroy(&column.body);
    return reached;
}
static void pull(void) {
    static const struct { const char *name; tlsph_unknowns unknowns; tlsph_dissipation dissipation; double nu, most, least; } rows[] = {
        { "{p,F}, nu 0.45", TLSPH_PF, TLSPH_LIMITED, 0.45, 1060, 2 * 526.8 },
        { "{p,F,J}, nu 0.495", TLSPH_PFJ, TLSPH_LIMITED, 0.495, 935, 2 * 464.5 },
        { "{p,F,J}, nu 0.45", TLSPH_PFJ, TLSPH_LIMITED, 0.45, 1060, 2 * 526.8 },
        { "{p,F,H}, nu 0.45", TLSPH_PFH, TLSPH_LIMITED, 0.45, 1060, 2 * 526.8 },
        { "{p,F,H,J}, nu 0.45", TLSPH_PFHJ, TLSPH_LIMITED, 0.45, 1060, 2 * 526.8 },
        { "{p,F}, nu 0.495", TLSPH_PF, TLSPH_LIMITED, 0.495, 935, 2 * 464.5 },
        { "{p,F,H,J}, nu 0.495", TLSPH_PFHJ, TLSPH_LIMITED, 0.495, 935, 2 * 464.5 },
        { "{p,F}, nu 0.45, no limiter", TLSPH_PF, TLSPH_RECONSTRUCTED, 0.45, 1060, 2 * 526.8 },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        at_least(text("column pulled, %s", rows[i].name),
                 pulled_until(rows[i].unknowns, rows[i].dissipation, rows[i].nu, rows[i].most), rows[i].least, "%",
                 rows[i].nu > 0.46 ? "papers: 428 to 465" : "papers: 422 to 527");
}

/* 1 if the column that starts to twist at omega is whole and without gain of energy at t = 0.1 s. */
static int twist_holds(tlsph_unknowns unknowns, double nu, double omega) {
    twisting_column_parameters p;
    twisting_column column;
    tlsph_ledger first, last;
    twisting_column_default(&p);
    p.n = 2;
    p.nu = nu;
    p.omega = omega;
    p.options.unknowns = (int)unknowns;
    p.options.threads = 1;
    if (twisting_column_create(&p, &column, NULL)) return 0;
    tlsph_ledger_read(column.body.solver, &first);
    const tlsph_result result = tlsph_advance(column.body.solver, R(0.1));
    tlsph_ledger_read(column.body.solver, &last);
    scene_destroy(&column.body);
    return !result && last.total_energy <= first.total_energy * (1 + 100 * EPSILON);
}
static void twist_row(const char *name, tlsph_unknowns unknowns, double nu, double least) {
    static const double omegas[] = { 105, 200, 400, 800, 1600, 3200, 6400 };
    double most = 0;
    for (size_t i = 0; i < sizeof omegas / sizeof *omegas && twist_holds(unknowns, nu, omegas[i]); i++) most = omegas[i];
    at_least(name, most, least, "rad/s", "initial spin of the top, up to which it survives");
}
static void twist(void) {
    twist_row("column twisted, {p,F}, nu 0.45", TLSPH_PF, 0.45, 800);
    twist_row("column twisted, {p,F,J}, nu 0.495", TLSPH_PFJ, 0.495, 800);
}

/* The height (%) below which a homogeneous neo-Hookean block with free sides has no equilibrium: U = kappa/2 (J - 1)^2 holds a
   finite energy at J = 0, so that pressed hard enough it collapses sideways, whatever the scheme. */
static double fold_of(double nu) {
    tlsph_material m = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    tlsph_material_state state;
    m.density = m.young = 1;
    m.poisson = R(nu);
    for (double height = 1; height > 0.01; height -= 0.001) {
        int held = 0;
        for (double side = 1.5; side > 0.3 && !held; side -= 0.001) {
            const tlsph_real F[9] = { R(side), 0, 0, 0, R(side), 0, 0, 0, R(height) };
            held = tlsph_material_evaluate(&m, F, 1, &state) == TLSPH_OK && state.P[0] < 0;
        }
        if (!held) return 100 * height;
    }
    return 1;
}
/* Height (%) down to which a cube of 4^3 cells can be pressed at a tenth of the shear speed between plates that hold its
   faces (`held`) or let them slide. */
static double pressed_until(tlsph_material_kind kind, tlsph_unknowns unknowns, double nu, int held, double least, const char **note) {
    rig r;
    rig_begin(&r, 4, 4, 4, 0.25);
    r.materials[0].kind = kind;
    r.materials[0].poisson = R(nu);
    r.materials[0].yield_stress = 1000000; /* TLSPH_VON_MISES: Hencky's elasticity, U = kappa/2 ln^2 J */
    r.desc.unknowns = unknowns;
    rig_fill(&r);
    tlsph_condition *top = rig_add(&r, TLSPH_VELOCITY, 2, 1);
    top->value[2] = R(-0.06);
    if (held) top->normal[2] = 0;
    rig_add(&r, held ? TLSPH_CLAMPED : TLSPH_ROLLER, 2, 0);
    rig_create(&r);
    /* towards the law's own collapse steps shrink for ever, in float without an end */
    while (!r.result && (double)tlsph_time(r.body.solver) * 0.06 < 1 - least && tlsph_step_count(r.body.solver) < 100000)
        rig_steps(&r, 1);
    const double height = r.body.solver ? 100 * (1 - 0.06 * (double)tlsph_time(r.body.solver)) : 100;
    *note = text("%s", rig_message(&r));
    rig_end(&r);
    return height;
}
static void press(void) {
    const char *note;
    double height = pressed_until(TLSPH_NEO_HOOKEAN, TLSPH_PF, 0.3, 0, 0.02, &note);
    at_most("cube pressed, sliding plates, nu 0.3: the law's own limit", height, fold_of(0.3), "%", "");
    height = pressed_until(TLSPH_VON_MISES, TLSPH_PF, 0.3, 0, 0.05, &note);
    at_most("the same with Hencky's law", height, 10, "%", note);
    height = pressed_until(TLSPH_NEO_HOOKEAN, TLSPH_PF, 0.3, 1, 0.05, &note);
    at_most("cube pressed, holding plates, nu 0.3", height, 10, "%", note);
    height = pressed_until(TLSPH_NEO_HOOKEAN, TLSPH_PF, 0.45, 1, 0.05, &note);
    at_most("cube pressed, holding plates, nu 0.45", height, 10, "%", note);
    height = pressed_until(TLSPH_NEO_HOOKEAN, TLSPH_PFJ, 0.495, 0, 0.05, &note);
    at_most("cube pressed, sliding plates, nu 0.495, {p,F,J}", height, 10, "%", note);
}

/* Strong free motion at one Poisson's ratio: largest energy over that at the beginning. */
static double free_motion(tlsph_unknowns unknowns, double nu, double speed, const char **note) {
    rig r;
    rig_begin(&r, 4, 4, 4, 0.25);
    r.materials[0].poisson = R(nu);
    r.desc.unknowns = unknowns;
    rig_create(&r);
    rig_state(&r, &speed, lively);
    const double first = rig_ledger(&r).total_energy;
    double most = 0;
    for (int i = 0; i < 20 && !r.result; i++) {
        rig_steps(&r, 50);
        most = fmax(most, rig_ledger(&r).total_energy);
    }
    const tlsph_ledger l = rig_ledger(&r);
    *note = text("least J %.2f, %.0f %% of the energy left; %s", l.jacobian_least, 100 * l.total_energy / first,
                 rig_message(&r));
    rig_end(&r);
    return r.result ? HUGE_VAL : most / first;
}
static void poisson(void) {
    static const double nus[] = { -0.99, -0.5, 0, 0.3, 0.45, 0.4999 };
    for (size_t i = 0; i < sizeof nus / sizeof *nus; i++) {
        const char *note;
        const tlsph_unknowns unknowns = nus[i] > 0.49 ? TLSPH_PFJ : TLSPH_PF;
        const double gain = free_motion(unknowns, nus[i], 0.4, &note);
        at_most(text("free motion, nu %g, energy over the first", nus[i]), gain, 1 + 1e3 * EPSILON, "", note);
    }
}

/* ---- long runs --------------------------------------------------------------------------------------------------- */

/* A rigid turn about Z through the middle of the box at omega = *scene, which is at 1 in each direction. */
static void turning(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double omega = *(const double *)scene;
    state->v[0] = -omega * ((double)X[1] - 1);
    state->v[1] = omega * ((double)X[0] - 1);
}
/* Revolutions of a free body whose rim moves at two thirds of the shear speed. */
static void spin_row(const char *name, int dimension, int n, tlsph_shape shape, tlsph_integrator integrator) {
    const double omega = 0.4, turns = 1000;
    rig r;
    rig_begin(&r, n, n, dimension == 3 ? n : 0, 2.0 / n);
    r.fill.shape = shape;
    r.fill.axis = 2;
    r.desc.integrator = integrator;
    if (integrator != TLSPH_RK2) r.desc.cfl = R(0.45);
    rig_create(&r);
    rig_state(&r, &omega, turning);
    const tlsph_ledger first = rig_ledger(&r);
    if (!r.result) r.result = tlsph_advance(r.body.solver, R(2 * PI / omega * turns));
    const tlsph_ledger last = rig_ledger(&r);
    /* the body has widened, so that it turns more slowly than at the start */
    const double spin = last.angular_momentum[2] / first.angular_momentum[2];
    at_least(text("%s: revolutions", name), r.result ? (double)last.time * omega / 2 / PI : turns, turns, "",
             text("%lu steps; %.2f %% of the energy lost; %s", (unsigned long)last.step,
                  100 * (1 - last.total_energy / first.total_energy), rig_message(&r)));
    at_most(text("%s: angular momentum, change", name), fabs(spin - 1), IS_FLOAT ? 1e-3 : 1e-10, "", "");
    at_most(text("%s: energy, gain", name), last.total_energy / first.total_energy - 1, 1e3 * EPSILON, "", "");
    rig_end(&r);
}
static void spin(void) {
    spin_row("spinning disk", 2, 8, TLSPH_CYLINDER, TLSPH_RK3_FROZEN);
    spin_row("spinning cube", 3, 3, TLSPH_BOX, TLSPH_RK3_FROZEN);
}

static void lively_plane(const void *scene, const tlsph_real X[3], scene_state *state) {
    lively(scene, X, state);
    state->v[2] = 0;
    state->theta += 20 * sin(1.5 * (double)X[0] + (double)X[1]);
}
static double length2(const double x[2]) { return sqrt(x[0] * x[0] + x[1] * x[1]); }
/* Angular momentum about the centre of mass. */
static double own_spin(const tlsph_ledger *l) {
    return l->angular_momentum[2] - l->centre[0] * l->linear_momentum[1] + l->centre[1] * l->linear_momentum[0];
}
/* A thermoelastic body with J that vibrates and turns, and flies off by ten thousand of its sizes in a million steps, where
   float rounds each step of x and p by up to an epsilon. A common drift of all J is no jump that the dissipation sees: it
   stays, unless drift_relaxation takes it away. */
static void million_row(const char *name, double speed, double relaxation, double drift, tlsph_integrator integrator,
                        long steps) {
    rig r;
    const int cells = speed > 0 ? 3 : 2;
    rig_begin(&r, cells, cells, 0, 0.25);
    r.materials[0].kind = TLSPH_MIE_GRUNEISEN;
    r.materials[0].expansion = R(1e-3);
    r.materials[0].conductivity = R(1e-4);
    r.desc.unknowns = TLSPH_PFJ;
    r.desc.thermal = TLSPH_ENERGY;
    r.desc.integrator = integrator;
    r.desc.drift_relaxation = R(relaxation);
    rig_create(&r);
    if (speed > 0) rig_state(&r, &speed, lively_plane);
    const tlsph_ledger first = rig_ledger(&r);
    rig_steps(&r, steps);
    const tlsph_ledger last = rig_ledger(&r);
    const double scale = first.mass * (speed > 0 ? speed : 1), heat = 300 * first.mass;
    double momentum = fabs(own_spin(&last) - own_spin(&first));
    for (int i = 0; i < 2; i++) momentum = fmax(momentum, fabs(last.linear_momentum[i] - first.linear_momentum[i]));
    at_least(text("%s: steps", name), (double)last.step, (double)steps, "", rig_message(&r));
    at_most(text("%s: energy, change by c_v theta", name), fabs(last.energy_residual) / heat, IS_FLOAT ? 1e-3 : 1e-11, "",
            text("kinetic %.2g of %.2g left", last.kinetic_energy, first.kinetic_energy));
    at_most(text("%s: momenta, change by m v", name), momentum / scale, IS_FLOAT ? (double)steps * EPSILON : 1e-11, "", "");
    at_most(text("%s: J / det F - 1", name), last.drift_largest, drift, "",
            text("%.0f body sizes away", length2(last.centre) / 0.75));
    rig_end(&r);
}
static void million(void) {
    million_row("a million steps at rest", 0, 0, 10 * EPSILON, TLSPH_RK2, 1000000);
    million_row("a million steps of vibration", 0.2, 0, IS_FLOAT ? 0.05 : 0.02, TLSPH_RK3_FROZEN, 1000000);
}
static void thousands(void) {
    million_row("ten thousand steps at rest", 0, 0, 10 * EPSILON, TLSPH_RK2, 10000);
    million_row("ten thousand steps of vibration", 0.2, 0, 0.01, TLSPH_RK3_FROZEN, 10000);
    million_row("ten thousand, drift_relaxation 0.5", 0.2, 0.5, 2e-3, TLSPH_RK3_FROZEN, 10000);
}

/* ---- time step --------------------------------------------------------------------------------------------------- */

static void noise(const void *scene, const tlsph_real X[3], scene_state *state) {
    (void)scene;
    for (int i = 0; i < 3; i++) /* sines of large arguments: as good as random, and the same everywhere */
        state->v[i] = 1e-3 * sin(1e3 * (double)X[i] + 2e3 * (double)X[(i + 1) % 3] + 3e3 * (double)X[(i + 2) % 3]);
}
static int noise_grows(tlsph_integrator integrator, double nu, double cfl) {
    rig r;
    rig_begin(&r, 8, 8, 8, 0.125);
    r.materials[0].kind = TLSPH_LINEAR;
    r.materials[0].poisson = R(nu);
    r.desc.integrator = integrator;
    r.desc.cfl = R(cfl);
    rig_create(&r);
    rig_state(&r, NULL, noise);
    const double first = rig_ledger(&r).total_energy;
    const int grows = rig_steps(&r, 200) || !(rig_ledger(&r).total_energy < first);
    rig_end(&r);
    return grows;
}
/* The shortest waves of a lattice feel the raw jumps: their velocity decays at 2 (c_p + 2 c_s)/h (three axes, of which one
   is along the motion), and no central difference acts on them. So in a large body the CFL number is limited by where the
   scheme's region of stability ends on the real axis: 2 for RK2 and frozen dissipation, 2.5127 for three full stages. */
static void cfl_row(const char *name, tlsph_integrator integrator, double nu, double reach) {
    const double ratio = sqrt((1 - 2 * nu) / (2 - 2 * nu)), theory = reach / (2 + 4 * ratio);
    const double promised = fmin((double)tlsph_cfl_limit(integrator), theory);
    double stable = 0.1, unstable = 1;
    if (noise_grows(integrator, nu, stable)) unstable = stable;
    while (unstable - stable > 0.02) {
        const double middle = (stable + unstable) / 2;
        if (noise_grows(integrator, nu, middle)) unstable = middle;
        else stable = middle;
    }
    at_least(text("CFL number, %s, nu %g", name, nu), stable, promised, "", text("theory for the shortest waves: %.3f", theory));
}
static void cfl(void) {
    static const char *const names[] = { "RK2", "SSP RK3", "RK3 frozen", "RK4 frozen", "leapfrog" };
    static const double reach[] = { 2, 2.5127, 2, 2, 2 };
    for (int i = 0; i < 5; i++) cfl_row(names[i], (tlsph_integrator)i, 0.3, reach[i]);
    cfl_row(names[0], TLSPH_RK2, -0.5, reach[0]);
    cfl_row(names[2], TLSPH_RK3_FROZEN, 0, reach[2]);
}

/* ---- units ------------------------------------------------------------------------------------------------------- */

/* What a unit of length, mass, time and temperature counts in those of the scene, as powers of two. */
typedef struct units { int length, mass, time, theta; } units;

static double power(int exponent) { return ldexp(1, exponent); }

/* A scene with most features: heat, J, walls, rollers, loads of every kind; clouds with the closed operator. */
static void everything(rig *r, const units *u, int cloud, tlsph_thermal thermal) {
    const int L = u->length, M = u->mass, T = u->time, K = u->theta;
    tlsph_material *m = r->materials;
    rig_begin(r, 3, 3, 3, 0.25 * power(L));
    for (int i = 0; i < 2; i++) {
        m[i].kind = TLSPH_MIE_GRUNEISEN;
        m[i].density = R(power(M - 3 * L));
        m[i].young = R((1 + i) * power(M - L - 2 * T));
        m[i].specific_heat = R(power(2 * L - 2 * T - K));
        m[i].conductivity = R(1e-3 * power(M + L - 3 * T - K));
        m[i].reference_temperature = R(300 * power(K));
        m[i].expansion = R(1e-3 * power(-K));
        m[i].gruneisen_exponent = R(0.5);
        m[i].mooney_fraction = R(0.25);
    }
    r->desc.unknowns = TLSPH_PFHJ;
    r->desc.thermal = thermal;
    if (cloud) {
        r->fill.jitter = R(0.3);
        r->fill.voronoi = 1;
        r->desc.operator_kind = TLSPH_CLOSED;
        r->desc.kernel = TLSPH_WENDLAND_C2;
        r->desc.support = R(0.825);
    }
    rig_fill(r);
    rig_add(r, TLSPH_ROLLER, 0, 0);
    rig_add(r, TLSPH_ACCELERATION, -1, 0)->value[2] = R(-0.1 * power(L - 2 * T));
    rig_add(r, TLSPH_TRACTION, 0, 0.75 * power(L))->value[0] = R(0.02 * power(M - L - 2 * T));
    rig_add(r, TLSPH_PRESSURE, 1, 0.75 * power(L))->value[0] = R(0.02 * power(M - L - 2 * T));
    rig_add(r, TLSPH_HEAT_FLUX, 2, 0)->value[0] = R(power(M - 3 * T));
    tlsph_condition *wall = rig_add(r, TLSPH_WALL, -1, 0);
    wall->normal[2] = 1;
    wall->point[2] = R(-0.001 * power(L));
    rig_create(r);
}
/* 1 if the fields of two solvers agree to the last bit once the units are taken off. */
static int same_field(const rig *a, const rig *b, tlsph_field field, int exponent) {
    tlsph_real *x, *y;
    const size_t count = tlsph_count(a->body.solver) * (size_t)tlsph_field_components(field);
    rig_read(a, field, &x);
    rig_read(b, field, &y);
    int same = x && y;
    for (size_t i = 0; same && i < count; i++) same = ldexp((double)x[i], exponent) == (double)y[i];
    free(x);
    free(y);
    return same;
}
static int same_in_units(const units *u, int cloud, tlsph_thermal thermal, int steps) {
    const units none = { 0, 0, 0, 0 };
    rig a, b;
    everything(&a, &none, cloud, thermal);
    everything(&b, u, cloud, thermal);
    rig_steps(&a, steps);
    rig_steps(&b, steps);
    const int same = !a.result && !b.result && same_field(&a, &b, TLSPH_FIELD_POSITION, u->length) &&
                     same_field(&a, &b, TLSPH_FIELD_VELOCITY, u->length - u->time) &&
                     same_field(&a, &b, TLSPH_FIELD_F, 0) && same_field(&a, &b, TLSPH_FIELD_J, 0) &&
                     same_field(&a, &b, TLSPH_FIELD_TEMPERATURE, u->theta) &&
                     same_field(&a, &b, TLSPH_FIELD_STRESS, u->mass - u->length - 2 * u->time);
    if (a.result || b.result) printf("        %s %s\n", rig_message(&a), rig_message(&b));
    rig_end(&a);
    rig_end(&b);
    return same;
}
/* The largest power of two up to `most`, in steps of `step`, by which a unit may be scaled up and down. */
static double scaled_until(int which, int cloud, tlsph_thermal thermal, int most, int step, int steps) {
    int good = 0;
    for (int power_of_two = step; power_of_two <= most; power_of_two += step) {
        for (int sign = -1; sign <= 1; sign += 2) {
            units u = { 0, 0, 0, 0 };
            if (which == 0 || which == 4) u.length = sign * power_of_two;
            if (which == 1 || which == 4) u.mass = sign * power_of_two;
            if (which == 2 || which == 4) u.time = -sign * power_of_two;
            if (which == 3 || which == 4) u.theta = sign * power_of_two;
            if (!same_in_units(&u, cloud, thermal, steps)) return good;
        }
        good = power_of_two;
    }
    return good;
}
static void scaling(void) {
    static const char *const names[] = { "length", "mass", "time", "temperature", "all four at once" };
    const int most = IS_FLOAT ? 8 : 40; /* 2^40 is 1.1e12; float holds no energies beyond */
    for (int i = 0; i < 5; i++)
        at_least(text("lattice, energy form: unit of %s, bitwise up to 2^+-", names[i]),
                 scaled_until(i, 0, TLSPH_ENERGY, most, most, 30), most, "", "");
    for (int i = 0; i < 5; i++)
        at_least(text("cloud, entropy form: unit of %s, bitwise up to 2^+-", names[i]),
                 scaled_until(i, 1, TLSPH_ENTROPY, most, most, 10), most, "", "");
}

/* ---- places ------------------------------------------------------------------------------------------------------ */

/* Largest difference of F between a body at the origin and one `offset` of its sizes away, both moving alike. */
static double offset_error(double offset, const char **note) {
    tlsph_real *F[2] = { NULL, NULL };
    double worst = 0;
    for (int i = 0; i < 2; i++) {
        const double speed = 0.3;
        rig r;
        rig_begin(&r, 4, 4, 4, 0.25);
        rig_fill(&r);
        tlsph_real *X = malloc(3 * r.body.cloud.particles.count * sizeof *X);
        if (!X) abort();
        rig_create(&r);
        rig_state(&r, &speed, lively);
        tlsph_real *v;
        rig_read(&r, TLSPH_FIELD_VELOCITY, &v);
        tlsph_destroy(r.body.solver);
        r.body.solver = NULL;
        for (size_t k = 0; k < 3 * r.body.cloud.particles.count; k++)
            X[k] = r.body.cloud.particles.positions[k] + R(i * offset);
        r.desc.particles = r.body.cloud.particles;
        r.desc.particles.positions = X;
        r.result = tlsph_create(&r.desc, &r.body.solver, &r.error);
        if (!r.result) r.result = tlsph_write(r.body.solver, TLSPH_FIELD_VELOCITY, v);
        rig_steps(&r, 50);
        rig_read(&r, TLSPH_FIELD_F, F + i);
        for (size_t k = 0; i && F[0] && F[1] && k < 9 * r.body.cloud.particles.count; k++)
            worst = fmax(worst, fabs((double)(F[1][k] - F[0][k])));
        if (r.result || !F[i]) worst = HUGE_VAL;
        *note = text("%s", rig_message(&r));
        free(X);
        free(v);
        rig_end(&r);
    }
    free(F[0]);
    free(F[1]);
    return worst;
}
static void places(void) {
    const char *note;
    double most = 0;
    for (double offset = 10; offset < 1e17 && offset_error(offset, &note) < 1e-2; offset *= 10) most = offset;
    at_least("offset of the body in its sizes, F within 1 %", most, IS_FLOAT ? 1e3 : 1e6, "",
             text("then: %s", note));
    const double offset = IS_FLOAT ? 1e3 : 1e6;
    at_most(text("difference of F at an offset of %g sizes", offset), offset_error(offset, &note), 100 * offset * EPSILON, "",
            "");
}

/* ---- heat -------------------------------------------------------------------------------------------------------- */

/* Cold where X < 1/2, hot beyond; scene points at both temperatures. */
static void two_temperatures(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double *theta = scene;
    state->theta = theta[(double)X[0] > 0.5];
}
static void thermal_rig(rig *r, tlsph_material_kind kind, tlsph_thermal thermal, double expansion, double h) {
    rig_begin(r, 4, 4, 4, 0.25);
    r->materials[0].kind = kind;
    r->materials[0].expansion = R(expansion);
    r->materials[0].conductivity = R(h);
    r->desc.thermal = thermal;
}
/* Conduction alone between 1 and `ratio` times 0.3 K in a held body, the hot half of which conducts `contrast` times as well and
   holds a `contrast`-th of the heat: temperatures must stay between these. */
static void heat_jump(const char *name, double ratio, double contrast, int stages) {
    const double theta[2] = { 0.3, 0.3 * ratio };
    rig r;
    thermal_rig(&r, TLSPH_MIE_GRUNEISEN, TLSPH_ENERGY, 0, 0.05);
    r.materials[1] = r.materials[0];
    r.materials[1].conductivity *= R(contrast);
    r.materials[1].specific_heat /= R(contrast);
    r.desc.conduction_stages = stages;
    rig_fill(&r);
    uint8_t *materials = rig_two_materials(&r);
    rig_add(&r, TLSPH_CLAMPED, -1, 0);
    rig_create(&r);
    r.body.cloud.particles.materials = NULL;
    free(materials);
    rig_state(&r, theta, two_temperatures);
    double beyond = 0;
    for (int i = 0; i < 200 && !r.result; i++) {
        rig_steps(&r, 1);
        const tlsph_ledger l = rig_ledger(&r);
        beyond = fmax(beyond, fmax(theta[0] - l.temperature_least, l.temperature_largest - theta[1]) / theta[1]);
    }
    const tlsph_ledger l = rig_ledger(&r);
    at_most(text("%s: beyond the extremes", name), r.result ? HUGE_VAL : beyond, 1e2 * EPSILON, "",
            text("%.4g to %.4g K after 200 steps; %s", l.temperature_least, l.temperature_largest, rig_message(&r)));
    at_most(text("%s: energy, change", name), fabs(l.energy_residual) / (300 * l.mass), 1e3 * EPSILON, "", "");
    rig_end(&r);
}
/* Free thermoelastic motion that starts with a jump of 1 : 1000 about theta_R = 300 K. */
static void hot_and_cold(const char *name, tlsph_material_kind kind, tlsph_thermal thermal, double expansion) {
    const double theta[2] = { 1, 1000 };
    rig r;
    thermal_rig(&r, kind, thermal, expansion, 1e-3);
    rig_create(&r);
    rig_state(&r, theta, two_temperatures);
    const tlsph_ledger first = rig_ledger(&r);
    rig_steps(&r, 500);
    const tlsph_ledger l = rig_ledger(&r);
    at_least(text("%s: steps", name), (double)l.step, 500, "", rig_message(&r));
    at_most(text("%s: energy, change", name), r.result ? HUGE_VAL : fabs(l.energy_residual) / first.thermal_energy,
            thermal == TLSPH_ENERGY ? 1e4 * EPSILON : 2e-3, "",
            text("%.3g to %.4g K, J from %.2f", l.temperature_least, l.temperature_largest, l.jacobian_least));
    rig_end(&r);
}
static void cold_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double speed = 0.1;
    lively(&speed, X, state);
    state->theta = *(const double *)scene;
}
/* The least share of theta_R at which a body that vibrates with 2e-3 J/m^3 keeps its temperature. The energy form's heat is
   what is left of E, so it holds the scheme's error of the mechanical energy, some percent of that: below, theta turns
   negative. The entropy form divides the heat of dissipation by theta: below, one step heats by more than theta, and the
   exponential runs away. */
static double coldest(tlsph_thermal thermal, const char **note) {
    double good = 1;
    for (double share = 1e-1; share > 1e-13; share /= 10) {
        const double theta = 300 * share;
        rig r;
        thermal_rig(&r, TLSPH_MIE_GRUNEISEN, thermal, 0, 0.01);
        rig_create(&r);
        rig_state(&r, &theta, cold_state);
        rig_steps(&r, 200);
        const tlsph_ledger l = rig_ledger(&r);
        const int kept = !r.result && l.temperature_least > 0.5 * theta;
        *note = text("then: %s", r.result ? rig_message(&r) : text("least temperature %.3g of %.3g K", l.temperature_least, theta));
        rig_end(&r);
        if (!kept) return good;
        good = share;
    }
    *note = "";
    return good;
}
static void alternating(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double i = round(4 * ((double)X[0] + (double)X[1] + (double)X[2]));
    state->theta += *(const double *)scene * (fmod(i, 2) != 0 ? -1 : 1);
}
/* Conductivity `h` in a held body; steps that sound would take in this time, and the spread of temperature that is left. */
static void conduction_row(const char *name, double h, int stages, double most) {
    const double amplitude = 100;
    rig r;
    thermal_rig(&r, TLSPH_MIE_GRUNEISEN, TLSPH_ENERGY, 0, h);
    r.desc.conduction_stages = stages;
    rig_fill(&r);
    rig_add(&r, TLSPH_CLAMPED, -1, 0);
    rig_create(&r);
    rig_state(&r, &amplitude, alternating);
    rig_steps(&r, 20);
    const tlsph_ledger l = rig_ledger(&r);
    const double spread = (l.temperature_largest - l.temperature_least) / (2 * amplitude);
    at_most(text("%s: spread left after 20 steps", name), r.result ? HUGE_VAL : h > 0 ? spread : fabs(spread - 1), most, "",
            text("h = %g, t = %.3g; %s", h, l.time, rig_message(&r)));
    rig_end(&r);
}
static void heat(void) {
    const char *note;
    heat_jump("heat between 1 : 1000", 1000, 1, 0);
    heat_jump("heat between 1 : 1000, own stages", 1000, 1, 50);
    heat_jump("heat between 1 : 1000, conductivity 1 : 1e3, c_v 1e3 : 1", 1000, 1e3, 0);
    heat_jump("heat between 1 : 1000, conductivity 1 : 1e6, c_v 1e6 : 1", 1000, 1e6, 0);
    hot_and_cold("free body of 1 and 1000 K, energy", TLSPH_MIE_GRUNEISEN, TLSPH_ENERGY, 3e-4);
    hot_and_cold("free body of 1 and 1000 K, entropy", TLSPH_MIE_GRUNEISEN, TLSPH_ENTROPY, 3e-4);
    /* its stiffness is proportional to theta: a cold half has a 300th of it and could not bear what the hot one expands by */
    hot_and_cold("free body of 1 and 1000 K, MEE", TLSPH_MEE, TLSPH_ENERGY, 1e-5);
    double least = coldest(TLSPH_ENERGY, &note);
    at_most("coldest vibrating body by theta_R, energy form", least, 1.1e-5, "", note);
    least = coldest(TLSPH_ENTROPY, &note);
    at_most("coldest vibrating body by theta_R, entropy form", least, 1e-7, "", note);
    conduction_row("conduction 0, alternating temperatures", 0, 0, IS_FLOAT ? 1e-5 : 1e-13);
    conduction_row("conduction 1e3, alternating temperatures", 1e3, 0, 1);
    conduction_row("conduction 10 in 200 stages of its own", 10, 200, 1e-3);
    conduction_row("conduction 1e3 in 1000 stages of its own", 1e3, 1000, 1e-3);
}

/* ---- neighbours that differ -------------------------------------------------------------------------------------- */

static void moving_half(const void *scene, const tlsph_real X[3], scene_state *state) {
    (void)scene;
    state->v[0] = (double)X[0] < 0.5 ? 0.1 : 0; /* the first material's half runs against the other one */
}
/* A bar of two materials, the first half of which moves towards the second: nothing may gain energy, and the light half
   must come back (its momentum turns) where the other is heavier or stiffer by 1e6. */
static void jump_row(const char *name, double density, double young, tlsph_unknowns unknowns, tlsph_integrator integrator) {
    rig r;
    rig_begin(&r, 8, 3, 3, 1.0 / 8);
    r.desc.unknowns = unknowns;
    r.desc.integrator = integrator;
    r.materials[1].density = R(density);
    r.materials[1].young = R(young);
    rig_fill(&r);
    uint8_t *materials = rig_two_materials(&r);
    rig_create(&r);
    r.body.cloud.particles.materials = NULL;
    rig_state(&r, NULL, moving_half);
    const tlsph_ledger first = rig_ledger(&r);
    /* till t = 1: a wave has run through the light half and back */
    double most = 0;
    for (int i = 1; i <= 20 && !r.result; i++) {
        r.result = tlsph_advance(r.body.solver, R(0.05 * i));
        most = fmax(most, rig_ledger(&r).total_energy);
    }
    const tlsph_ledger l = rig_ledger(&r);
    at_most(text("%s: energy over the first", name), r.result ? HUGE_VAL : most / first.total_energy, 1 + 1e4 * EPSILON, "",
            text("%lu steps, least J %.2f; %s", (unsigned long)l.step, l.jacobian_least, rig_message(&r)));
    tlsph_real *v;
    double momentum = 0, mass = 0;
    rig_read(&r, TLSPH_FIELD_VELOCITY, &v);
    for (size_t a = 0; v && a < r.body.cloud.particles.count; a++) {
        if (materials[a]) continue;
        momentum += (double)v[3 * a] * (double)r.body.cloud.particles.volumes[a];
        mass += (double)r.body.cloud.particles.volumes[a];
    }
    if (density > 1)
        at_most(text("%s: velocity of the light half, it had 0.1", name), v ? momentum / mass : HUGE_VAL, -0.05, "", "");
    free(v);
    free(materials);
    rig_end(&r);
}
static void jumps(void) {
    jump_row("density 1 : 1e6", 1e6, 1, TLSPH_PF, TLSPH_RK2);
    jump_row("density 1 : 1e6, {p,F,J}", 1e6, 1, TLSPH_PFJ, TLSPH_RK2);
    jump_row("density 1 : 1e6, frozen dissipation", 1e6, 1, TLSPH_PF, TLSPH_RK3_FROZEN);
}
/* Float holds F to 6e-8: with 1e6 times the stiffness that is the stress of a strain of 6 % in the soft half, so 1e4 there. */
static void stiff_jumps(void) {
    const double most = IS_FLOAT ? 1e4 : 1e6;
    jump_row("density 1 : 1e-6", 1e-6, 1, TLSPH_PF, TLSPH_RK2);
    jump_row(IS_FLOAT ? "stiffness 1 : 1e4" : "stiffness 1 : 1e6", 1, most, TLSPH_PF, TLSPH_RK2);
    jump_row(IS_FLOAT ? "stiffness 1 : 1e4, {p,F,J}" : "stiffness 1 : 1e6, {p,F,J}", 1, most, TLSPH_PFJ, TLSPH_RK2);
    jump_row(IS_FLOAT ? "density and stiffness 1 : 1e4" : "density and stiffness 1 : 1e6", most, most, TLSPH_PF, TLSPH_RK2);
}

/* ---- clouds ------------------------------------------------------------------------------------------------------ */

/* Energy of a free body in motion over that at the beginning, largest over 1000 steps. */
static double gain_of(rig *r, int steps, const char **note) {
    const double speed = 0.2;
    if (!r->body.solver) rig_create(r);
    rig_state(r, &speed, lively);
    const double first = rig_ledger(r).total_energy;
    double most = 0;
    for (int i = 0; i < steps / 20 && !r->result; i++) {
        rig_steps(r, 20);
        most = fmax(most, rig_ledger(r).total_energy);
    }
    const tlsph_ledger l = rig_ledger(r);
    *note = text("least J %.2f, %.0f %% of the energy left; %s", l.jacobian_least, 100 * l.total_energy / first,
                 rig_message(r));
    return r->result ? HUGE_VAL : most / first;
}
static void jitter_row(double jitter, uint64_t seed) {
    const char *note;
    rig r;
    rig_begin(&r, 5, 5, 5, 0.2);
    r.fill.jitter = R(jitter);
    r.fill.seed = seed;
    r.fill.voronoi = 1;
    r.desc.operator_kind = TLSPH_CLOSED;
    r.desc.kernel = TLSPH_WENDLAND_C2;
    r.desc.support = R(0.825);
    const double gain = gain_of(&r, 1000, &note);
    at_most(text("cloud, jitter %.0f %%, seed %lu: energy over the first", 100 * jitter, (unsigned long)seed), gain,
            1 + 1e3 * EPSILON, "", note);
    rig_end(&r);
}
/* Cells that are `ratio` times as long along Z; the operator from the cells needs no isotropy. */
static void stretched_row(const char *name, double ratio, tlsph_operator_kind kind) {
    const char *note;
    rig r;
    rig_begin(&r, 4, 4, 4, 0.25);
    r.desc.operator_kind = kind;
    rig_fill(&r);
    const size_t count = r.body.cloud.particles.count;
    tlsph_real *X = malloc(3 * count * sizeof *X), *V = malloc(2 * count * sizeof *V);
    if (!X || !V) abort();
    for (size_t a = 0; a < count; a++) {
        for (size_t i = 0; i < 3; i++) X[3 * a + i] = r.body.cloud.particles.positions[3 * a + i] * (i == 2 ? R(ratio) : 1);
        V[a] = r.body.cloud.particles.volumes[a] * R(ratio);
        V[count + a] = r.body.cloud.particles.weights[a] * R(ratio);
    }
    r.body.cloud.particles.positions = X;
    r.body.cloud.particles.volumes = V;
    r.body.cloud.particles.weights = V + count;
    const double gain = gain_of(&r, 400, &note);
    at_most(text("%s: energy over the first", name), gain, 1 + 1e3 * EPSILON, "", note);
    free(X);
    free(V);
    rig_end(&r);
}
/* What creation says of bodies without physics: the code, and that the record names a particle. */
static void refusal_row(const char *name, int nx, int ny, int nz, double far) {
    rig r;
    int dimension = nz < 0 ? 2 : 3;
    const int counts[3] = { nx, ny, nz < 0 ? 1 : nz };
    const size_t count = (size_t)(counts[0] * counts[1] * counts[2]);
    tlsph_real *X = calloc(3 * (count + 1), sizeof *X), *V = malloc((count + 1) * sizeof *V);
    if (!X || !V) abort();
    rig_begin(&r, 1, 1, dimension == 3, 1);
    for (size_t a = 0; a <= count; a++) {
        X[3 * a] = (tlsph_real)(a % (size_t)nx);
        X[3 * a + 1] = (tlsph_real)(a / (size_t)nx % (size_t)ny);
        X[3 * a + 2] = (tlsph_real)(a / (size_t)(nx * ny));
        V[a] = 1;
    }
    X[3 * count] = X[3 * count + 1] = X[3 * count + 2] = R(far); /* one more, alone */
    r.desc.particles.count = count + (far > 0);
    r.desc.particles.positions = X;
    r.desc.particles.volumes = V;
    r.desc.particles.spacing = 1;
    r.desc.materials = r.materials;
    r.desc.material_count = 1;
    r.result = tlsph_create(&r.desc, &r.body.solver, &r.error);
    const int named = r.result == TLSPH_ERROR_NEIGHBOURS && r.error.particle <= count;
    holds(name, count + (far > 0) == 1 ? r.result == TLSPH_ERROR_DESCRIPTION : named && (far <= 0 || r.error.particle == count),
          rig_message(&r));
    free(X);
    free(V);
    rig_end(&r);
}
static void thin_row(const char *name, int nx, int ny, int nz, tlsph_integrator integrator) {
    const char *note;
    rig r;
    rig_begin(&r, nx, ny, nz, 0.25);
    r.desc.integrator = integrator;
    const double gain = gain_of(&r, 1000, &note);
    at_most(text("%s: energy over the first", name), gain, 1 + 1e3 * EPSILON, "", note);
    rig_end(&r);
}
static void clouds(void) {
    for (int i = 1; i <= 4; i++) jitter_row(i < 4 ? 0.15 * i : 0.45, (uint64_t)i);
    stretched_row("cells 1 : 1 : 10", 10, TLSPH_CELLS);
    stretched_row("cells 1 : 1 : 0.1", 0.1, TLSPH_CELLS);
    stretched_row("cells 1 : 1 : 100", 100, TLSPH_CELLS);
    thin_row("plate of one cell", 8, 8, 1, TLSPH_SSP_RK3);
    thin_row("filament of one cell", 12, 1, 1, TLSPH_SSP_RK3);
    refusal_row("plate of one particle is refused", 5, 5, 1, 0);
    refusal_row("filament of one particle is refused", 6, 1, 1, 0);
    refusal_row("filament in plane strain is refused", 6, 1, -1, 0);
    refusal_row("single particle is refused", 1, 1, 1, 0);
    refusal_row("isolated particle is named", 3, 3, 3, 50);
}

/* Kernels with ever more neighbours: still exact for linear fields, still without gain of energy. */
static void supports(void) {
    static const double factors[] = { 0.6, 0.8, 0.9, 1.2, 1.5, 2.0, 2.55 };
    for (size_t i = 0; i < sizeof factors / sizeof *factors; i++) {
        const int n = factors[i] < 1.3 ? 4 : 10;
        const char *note;
        tlsph_size size;
        rig r;
        rig_begin(&r, n, n, n, 1.0 / n);
        r.desc.support = R(factors[i]);
        r.desc.kernel = i ? TLSPH_WENDLAND_C2 : TLSPH_QUADRATIC;
        rig_create(&r);
        memset(&size, 0, sizeof size);
        if (!r.result) tlsph_size_read(r.body.solver, &size);
        const double gain = gain_of(&r, n == 4 ? 400 : 40, &note);
        at_most(text("support %.1f, %lu to %lu neighbours: energy over the first", factors[i],
                     (unsigned long)size.neighbours_least, (unsigned long)size.neighbours_most),
                gain, 1 + 1e4 * EPSILON, "", note);
        rig_end(&r);
    }
}

/* ---- modes that the gradient does not see ------------------------------------------------------------------------ */

static double sign_of(const tlsph_real X[3]) {
    return fmod(round(4 * ((double)X[0] + (double)X[1] + (double)X[2])), 2) != 0 ? -1 : 1;
}
static void checkered_velocity(const void *scene, const tlsph_real X[3], scene_state *state) {
    for (int i = 0; i < 3; i++) state->v[i] = *(const double *)scene * sign_of(X);
}
static void checkered_jacobian(const void *scene, const tlsph_real X[3], scene_state *state) {
    for (int i = 0; i < 3; i++) state->F[4 * i] = 1 + *(const double *)scene * sign_of(X);
}
/* Mean over the particles of the alternating part of a field's component. */
static double alternating_part(const rig *r, tlsph_field field, int component) {
    const tlsph_particles *p = &r->body.cloud.particles;
    const size_t components = (size_t)tlsph_field_components(field);
    tlsph_real *values;
    double sum = 0, volume = 0;
    rig_read(r, field, &values);
    for (size_t a = 0; values && a < p->count; a++) {
        sum += sign_of(p->positions + 3 * a) * (double)values[components * a + (size_t)component] * (double)p->volumes[a];
        volume += (double)p->volumes[a];
    }
    if (!values) sum = NAN;
    free(values);
    return sum / volume;
}
/* The part of a checkerboard that is left after the time in which sound crosses the body four times. */
static void mode_row(const char *name, tlsph_unknowns unknowns, scene_state_fn state, tlsph_field field, double most,
                     const char *why) {
    const double amplitude = 1e-3;
    rig r;
    rig_begin(&r, 4, 4, 4, 0.25);
    r.materials[0].poisson = R(unknowns == TLSPH_PFJ ? 0.495 : 0.3);
    r.desc.unknowns = unknowns;
    rig_create(&r);
    rig_state(&r, &amplitude, state);
    const double first = alternating_part(&r, field, 0), energy = rig_ledger(&r).total_energy;
    rig_steps(&r, 52);
    const double left = fabs(alternating_part(&r, field, 0) / first), energy_left = rig_ledger(&r).total_energy / energy;
    at_most(text("%s: share left", name), r.result ? HUGE_VAL : left, most, "",
            text("%lu steps, %.2g of the energy; %s", (unsigned long)rig_ledger(&r).step, energy_left, why));
    rig_end(&r);
}
static void modes(void) {
    mode_row("alternating velocity, {p,F}", TLSPH_PF, checkered_velocity, TLSPH_FIELD_VELOCITY, 1e-3, "");
    mode_row("alternating velocity, {p,F,J}", TLSPH_PFJ, checkered_velocity, TLSPH_FIELD_VELOCITY, 1e-2,
             "c_s is a tenth of c_p at this nu");
    mode_row("alternating J, {p,F,J}", TLSPH_PFJ, checkered_jacobian, TLSPH_FIELD_PRESSURE, 0.1, "");
    mode_row("alternating det F, {p,F}", TLSPH_PF, checkered_jacobian, TLSPH_FIELD_PRESSURE, 1 + 1e3 * EPSILON,
             "no jump of v sees it inside: {p,F} keeps it");
}

/* ---- shocks ------------------------------------------------------------------------------------------------------ */

/* Two halves of a bar meet at `share` of the p speed each: error of the star pressure behind the shock. */
static double impact_error(double share, const char **note) {
    impact_parameters p;
    impact bar;
    impact_star exact, mean;
    tlsph_error error;
    double overshoot = 0;
    impact_default(&p);
    p.n = 40;
    p.across = 2;
    p.options.threads = 1;
    p.speed = share * impact_p_speed(&p.material);
    const double shock = impact_exact(&p, &exact);
    if (impact_create(&p, &bar, &error)) {
        *note = text("%s", error.message);
        return HUGE_VAL;
    }
    const tlsph_result result = tlsph_advance(bar.body.solver, R(0.3 * p.length / shock));
    if (!result) impact_read(&bar, shock, 0.2, 0.8, &exact, &mean, &overshoot);
    *note = text("exact J %.3g, theta %.0f K, overshoot %.1f %%; %s", exact.jacobian, exact.temperature, 100 * overshoot,
                 result ? tlsph_last_error(bar.body.solver)->message : "");
    scene_destroy(&bar.body);
    return result ? HUGE_VAL : fabs(mean.stress / exact.stress - 1);
}
static void shocks(void) {
    static const double shares[] = { 0.1, 0.5, 1, 2 };
    const char *note;
    for (size_t i = 0; i < sizeof shares / sizeof *shares; i++) {
        const double error = impact_error(shares[i], &note);
        at_most(text("halves of a bar meet at %g c_p each: stress, error", shares[i]), error, 0.05, "", note);
    }
}
static void meeting(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double side = (double)X[0] - 1;
    state->v[0] = fabs(side) < 1e-6 ? 0 : side < 0 ? *(const double *)scene : -*(const double *)scene;
}
/* Faster halves cross a spacing within a step: retries carry on, the limit of what a step may squeeze keeps the energy. */
static void meeting_row(double share) {
    rig r;
    rig_begin(&r, 20, 3, 3, 0.1);
    r.desc.retries = 20;
    r.desc.limit = R(0.3);
    rig_create(&r);
    const double speed = share * impact_p_speed(&r.materials[0]);
    rig_state(&r, &speed, meeting);
    const tlsph_ledger first = rig_ledger(&r);
    if (!r.result) r.result = tlsph_advance(r.body.solver, R(1 / share));
    const tlsph_ledger l = rig_ledger(&r);
    at_most(text("halves meet at %g c_p each, retries and limit: energy missed", share),
            r.result ? HUGE_VAL : fabs(l.energy_residual) / first.kinetic_energy, 0.03, "",
            text("%lu steps, %lu retries, least J %.2g; %s", (unsigned long)l.step, (unsigned long)l.retries, l.jacobian_least,
                 rig_message(&r)));
    rig_end(&r);
}
static void fast_shocks(void) {
    meeting_row(4);
    meeting_row(8);
    meeting_row(16);
}
/* A face that is hot or cold at once, and for ever. */
static void thermal_shock(const char *name, double theta, double expansion) {
    rig r;
    thermal_rig(&r, TLSPH_MIE_GRUNEISEN, TLSPH_ENERGY, expansion, 0.02);
    rig_fill(&r);
    rig_add(&r, TLSPH_TEMPERATURE, 0, 0)->value[0] = R(theta);
    rig_create(&r);
    rig_steps(&r, 1000);
    const tlsph_ledger l = rig_ledger(&r);
    at_least(text("%s: steps", name), (double)l.step, 1000, "", rig_message(&r));
    at_most(text("%s: energy, change", name), fabs(l.energy_residual) / (300 * l.mass), 1e4 * EPSILON, "",
            text("%.4g to %.4g K, J from %.2f", l.temperature_least, l.temperature_largest, l.jacobian_least));
    rig_end(&r);
}
static void thermal_shocks(void) {
    thermal_shock("face at 10 theta_R, expansion 0.27", 3000, 1e-4);
    thermal_shock("face at theta_R / 1000, contraction 0.27", 0.3, 9e-4);
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

typedef struct group { const char *name; void (*run)(void); int quick; } group;
static const group groups[] = {
    { "pull", pull, 0 },         { "twist", twist, 0 },   { "press", press, 1 },       { "poisson", poisson, 1 },
    { "spin", spin, 0 },         { "thousands", thousands, 1 },
    { "million", million, 0 },   { "cfl", cfl, 1 },       { "scaling", scaling, 1 },   { "places", places, 1 },
    { "heat", heat, 1 },         { "jumps", jumps, 1 },     { "stiff_jumps", stiff_jumps, 0 },   { "clouds", clouds, 1 },     { "supports", supports, 0 },
    { "modes", modes, 1 },       { "shocks", shocks, 1 }, { "fast_shocks", fast_shocks, 1 },
    { "thermal_shocks", thermal_shocks, 1 },
};

static int chosen(const group *g, int argc, char **argv) {
    int quick = 0, filters = 0, match = 0;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--quick") == 0) quick = 1;
        else filters++, match |= strstr(g->name, argv[i]) != NULL;
    }
    return filters ? match : !quick || g->quick;
}
int main(int argc, char **argv) {
    const double start = seconds();
    if (argc > 1 && strcmp(argv[1], "--list") == 0) {
        for (size_t i = 0; i < sizeof groups / sizeof *groups; i++) puts(groups[i].name);
        return 0;
    }
    printf("extremes in %s: row, measured, asked for\n", IS_FLOAT ? "float" : "double");
    for (size_t i = 0; i < sizeof groups / sizeof *groups; i++) {
        if (!chosen(groups + i, argc, argv)) continue;
        const double begin = seconds();
        printf("%s\n", groups[i].name);
        groups[i].run();
        printf("        %.1f s\n", seconds() - begin);
    }
    printf("%.0f s of processor time\n", seconds() - start);
    printf("%d passed, %d failed\n", tally.passed, tally.failed);
    return tally.failed > 0;
}
