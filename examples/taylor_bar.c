/*
taylor_bar.c - a copper bar hits a rigid wall and mushrooms: 001 section 7.2.3, figure 19, table 2

Draws plastic strain and pressure at four instants, radius, length and energies over time; checks the final radius against
table 2 (0.698 to 0.700 cm by four mesh-based methods, 0.689 by the paper's SPH) as far as the resolution goes, and the
balance of energy.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SHOTS = 4 };
enum { RADIUS, LENGTH, STRAIN, KINETIC, ELASTIC, PLASTIC, DAMPED, COLUMNS }; /* of the history */

typedef struct run {
    driver base;
    taylor_bar bar;
    driver_history history;
    driver_snapshot strain[SHOTS], pressure[SHOTS];
    taylor_bar_shape shape;
    double energy; /* J, at the start */
    long steps;
} run;

static void record(run *r) {
    const tlsph_ledger *l = &r->base.now;
    double row[COLUMNS];
    taylor_bar_read(&r->bar, &r->shape);
    row[RADIUS] = r->shape.radius * 1e3;
    row[LENGTH] = r->shape.length * 1e3;
    row[STRAIN] = r->shape.plastic_strain;
    row[KINETIC] = l->kinetic_energy;
    row[ELASTIC] = l->strain_energy;
    row[PLASTIC] = l->plastic_work;
    row[DAMPED] = l->dissipation + l->contact_loss;
    driver_history_add(&r->history, l->time * 1e6, row);
}
static void after_step(driver *d) {
    run *r = d->user;
    if (++r->steps % 20 == 0) record(r);
}

/* Two views of the quarter that is computed: the cut face Z = 0 with its mirror image would be the paper's halves. */
static void draw(run *r) {
    static const driver_chart charts[] = {
        { "radius of the foot", "[mm]", RADIUS, 1, { "radius" } },
        { "length", "[mm]", LENGTH, 1, { "length" } },
        { "largest plastic strain", "[1]", STRAIN, 1, { "plastic strain" } },
        { "energy of the quarter", "[J]", KINETIC, 4, { "kinetic", "elastic", "plastic work", "damped" } } };
    const double half = 0.5 * r->bar.parameters.radius / r->bar.parameters.n;
    ex_view view;
    memset(&view, 0, sizeof view);
    view.panel_width = 300; view.panel_height = 560;
    view.camera.azimuth = -65; view.camera.elevation = 12; view.camera.up_axis = 1; view.camera.zoom = 1;
    view.map = EX_MAP_HEAT;
    view.label = "equivalent plastic strain [1]";
    view.heading = "Taylor bar, 227 m/s (001 figure 19): plastic strain";
    view.common_scale = 2;
    driver_render(&r->base, "plastic_strain.png", &view, r->strain, SHOTS, SHOTS, half);
    view.map = EX_MAP_DIVERGING;
    view.label = "pressure [GPa], tension positive";
    view.heading = "Taylor bar, 227 m/s (001 figure 19): pressure";
    driver_render(&r->base, "pressure.png", &view, r->pressure, SHOTS, SHOTS, half);
    driver_plot(&r->base, "curves.png", &r->history, charts, 4, 2);
}

/* Measured with the lattice: 6.59 mm with 4 spacings a radius, 6.89 with 6, 7.05 with 8. Numerical damping, 8 % of the
   energy at 4 and 4 % at 8, holds coarse feet back; the sequence passes table 2 near 7 and has not come to rest. */
static double allowed(const taylor_bar_parameters *p) {
    return p->n >= 8 ? 0.01 : p->n >= 6 ? 0.02 : 0.065;
}
static void report(run *r) {
    const taylor_bar_parameters *p = &r->bar.parameters;
    const tlsph_ledger *l = &r->base.now;
    record(r);
    ex_result("particles", (double)tlsph_count(r->bar.body.solver), "1");
    ex_result("steps", (double)l->step, "1");
    ex_result("time", l->time, "s");
    ex_result("radius", r->shape.radius, "m");
    ex_result("length", r->shape.length, "m");
    ex_result("plastic_strain", r->shape.plastic_strain, "1");
    ex_result("plastic_work", l->plastic_work / r->energy, "of the energy");
    ex_result("numerical_dissipation", l->dissipation / r->energy, "of the energy");
    ex_result("pressure_oscillation", scene_oscillation(r->bar.body.solver, TLSPH_FIELD_PRESSURE), "1");
    ex_check_below("energy_residual", fabs(l->energy_residual) / r->energy, 5e-3);
    if (l->time < 79e-6 || p->speed != 227) return; /* the figures below are those of table 2 */
    ex_check("radius", r->shape.radius, 0.00700, allowed(p) * 0.00700);
    ex_check_below("rebound", r->base.now.kinetic_energy / r->energy, 0.02);
}

static int run_bar(const taylor_bar_parameters *p) {
    static run r;
    tlsph_error error;
    int code;
    if (taylor_bar_create(p, &r.bar, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&r.base, "taylor_bar", &p->options, &r.bar.body, p->options.end_time)) return 1;
    r.history.columns = COLUMNS;
    r.base.step = after_step;
    r.base.user = &r;
    r.energy = r.base.now.total_energy;
    record(&r);
    for (int i = 0; i < SHOTS && r.base.result == TLSPH_OK; i++) {
        if (driver_run_to(&r.base, p->options.end_time * (i + 1) / SHOTS) != TLSPH_OK) break;
        driver_snap(&r.bar.body, TLSPH_FIELD_PLASTIC_STRAIN, 0, 1, &r.strain[i]);
        driver_snap(&r.bar.body, TLSPH_FIELD_PRESSURE, 0, 1e-9, &r.pressure[i]);
    }
    draw(&r);
    if (r.base.result == TLSPH_OK) report(&r);
    code = driver_end(&r.base);
    driver_history_free(&r.history);
    for (int i = 0; i < SHOTS; i++) {
        driver_snapshot_free(&r.strain[i]);
        driver_snapshot_free(&r.pressure[i]);
    }
    taylor_bar_destroy(&r.bar);
    return code;
}

int main(int argc, char **argv) {
    taylor_bar_parameters p;
    const ex_option own[] = {
        { "n", EX_INT, &p.n, NULL, NULL, 4, 64, "spacings a radius" },
        { "fill", EX_CHOICE, &p.fill, NULL, "round|lattice", 0, 0, "particles on the round surface, or a lattice" },
        { "wall", EX_CHOICE, &p.wall, NULL, "contact|roller", 0, 0, "rigid wall, or foot held on it" },
        { "speed", EX_REAL, &p.speed, "m/s", NULL, 1, 1000, "of the bar" } };
    taylor_bar_default(&p);
    driver_arguments(argc, argv, "taylor_bar", "copper bar against a rigid wall (001 section 7.2.3)", &p.options, own,
                     (int)(sizeof own / sizeof *own));
    return run_bar(&p);
}
