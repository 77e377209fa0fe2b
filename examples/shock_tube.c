/*
shock_tube.c - two halves of a bar run into each other: the state between the shocks against the jump conditions

Uniaxial strain, material of 000 section 7.1, no conduction. The exact star state follows from mass, momentum and energy
alone (scenes/impact.c). Means are read where the plateau is clean, from 0.4 to 0.8 of the shock's path: beside X = 0
the start, in which the shock is not yet as wide as the scheme makes it, leaves heat behind (at X = 0 some tens of
percent of the warming, falling as 1/X); near the shock is its tail.
*/
#include "common/driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct run { driver base; impact bar; impact_star exact; double shock; } run;

#define COLUMNS 4 /* stress, J, theta, velocity */

/* What is computed on the edge Y = Z = 0, by X, and what is exact there. */
typedef struct profile { size_t count; double *X, *is[COLUMNS], *should[COLUMNS]; } profile;

static void exact_at(const run *r, double X, double t, double out[COLUMNS]) {
    const int inside = fabs(X) < r->shock * t;
    const double theta_R = (double)r->bar.body.material.reference_temperature, v = r->bar.parameters.speed;
    out[0] = inside ? r->exact.stress * 1e-3 : 0;
    out[1] = inside ? r->exact.jacobian : 1;
    out[2] = inside ? r->exact.temperature : theta_R;
    out[3] = inside ? 0 : X < 0 ? v : -v;
}

static void profile_free(profile *p) {
    free(p->X);
    for (int i = 0; i < COLUMNS; i++) { free(p->is[i]); free(p->should[i]); }
}

/* The cloud of a box is numbered with X fastest, so that the edge comes in order. 0 on success. */
static int profile_read(const run *r, profile *p) {
    static const tlsph_field fields[COLUMNS] = { TLSPH_FIELD_STRESS, TLSPH_FIELD_J, TLSPH_FIELD_TEMPERATURE,
                                                 TLSPH_FIELD_VELOCITY };
    const tlsph_particles *particles = &r->bar.body.cloud.particles;
    const double t = r->base.now.time, close = 1e-3 * r->bar.parameters.length / r->bar.parameters.n;
    double *read[COLUMNS];
    int bad = 0;
    memset(p, 0, sizeof *p);
    p->X = malloc(particles->count * sizeof *p->X);
    for (int i = 0; i < COLUMNS; i++) {
        read[i] = driver_read(&r->bar.body, fields[i]);
        p->is[i] = malloc(particles->count * sizeof *p->X);
        p->should[i] = malloc(particles->count * sizeof *p->X);
        bad |= !read[i] || !p->is[i] || !p->should[i];
    }
    for (size_t a = 0; !bad && p->X && a < particles->count; a++) {
        const tlsph_real *X = particles->positions + 3 * a;
        double exact[COLUMNS];
        if ((double)X[1] > close || (double)X[2] > close) continue;
        exact_at(r, (double)X[0], t, exact);
        p->X[p->count] = (double)X[0];
        for (int i = 0; i < COLUMNS; i++) {
            p->is[i][p->count] = read[i][a * (size_t)tlsph_field_components(fields[i])] * (i == 0 ? 1e-3 : 1);
            p->should[i][p->count] = exact[i];
        }
        p->count++;
    }
    for (int i = 0; i < COLUMNS; i++) free(read[i]);
    return bad || !p->X;
}

static void draw_profile(run *r) {
    static const char *const titles[COLUMNS] = { "stress P_xX", "Jacobian", "temperature", "velocity" };
    static const char *const units[COLUMNS] = { "[kPa]", "[1]", "[K]", "[m/s]" };
    static const char header[] = "X [m],P_xX [kPa],J,theta [K],v [m/s],exact P_xX,exact J,exact theta,exact v";
    ex_axes axes[COLUMNS];
    ex_curve curves[COLUMNS][2];
    const ex_curve *of[COLUMNS];
    int counts[COLUMNS];
    profile p;
    ex_csv csv;
    memset(axes, 0, sizeof axes);
    if (profile_read(r, &p)) { profile_free(&p); return; }
    for (int i = 0; i < COLUMNS; i++) {
        const ex_curve computed = { "computed", p.X, p.is[i], p.count, 0, 0 },
                       exact = { "exact", p.X, p.should[i], p.count, 1, 1 };
        curves[i][0] = computed; curves[i][1] = exact;
        axes[i].title = titles[i]; axes[i].x_label = "X [m]"; axes[i].y_label = units[i];
        of[i] = curves[i];
        counts[i] = 2;
    }
    ex_plot_grid(driver_path(&r->base, "profile.png"), 640, 420, axes, of, counts, COLUMNS, 2);
    if (ex_csv_open(&csv, r->base.folder, "profile.csv", header) == 0) {
        for (size_t a = 0; a < p.count; a++) {
            double row[1 + 2 * COLUMNS] = { p.X[a] };
            for (int i = 0; i < COLUMNS; i++) { row[1 + i] = p.is[i][a]; row[1 + COLUMNS + i] = p.should[i][a]; }
            ex_csv_row(&csv, row);
        }
        ex_csv_close(&csv);
    }
    profile_free(&p);
}

/* The bar is so thin that it is drawn widened to an eighth of its length. */
static void draw_bar(run *r) {
    const impact_parameters *q = &r->bar.parameters;
    const double h = q->length / q->n, widen = q->length / (8 * h * q->across);
    ex_view view;
    driver_snapshot shot;
    memset(&view, 0, sizeof view);
    view.panel_width = 1000; view.panel_height = 260;
    view.camera.azimuth = -70; view.camera.elevation = 25; view.camera.up_axis = 2; view.camera.zoom = 1;
    view.map = EX_MAP_VIRIDIS;
    view.label = "P_xX [kPa]";
    view.heading = "impact: stress, bar widened to 1/8 of its length";
    if (driver_snap(&r->bar.body, TLSPH_FIELD_STRESS, 0, 1e-3, &shot)) return;
    for (size_t a = 0; a < shot.count; a++)
        for (size_t i = 1; i < 3; i++) {
            shot.positions[3 * a + i] *= widen;
            for (size_t j = 0; j < 3; j++) shot.F[9 * a + 3 * i + j] *= widen;
        }
    driver_render(&r->base, "bar.png", &view, &shot, 1, 1, h / 2);
    driver_snapshot_free(&shot);
}

static void report(const run *r) {
    const impact_star *exact = &r->exact;
    const double warming = exact->temperature - (double)r->bar.body.material.reference_temperature;
    impact_star mean;
    double overshoot;
    impact_read(&r->bar, r->shock, 0.4, 0.8, exact, &mean, &overshoot);
    ex_result("star_stress", mean.stress, "Pa");
    ex_result("star_jacobian", mean.jacobian, "1");
    ex_result("star_temperature", mean.temperature, "K");
    ex_result("overshoot", overshoot, "1");
    ex_result("shock_speed_exact", r->shock, "m/s");
    ex_check("star_stress", mean.stress, exact->stress, 0.01 * fabs(exact->stress));
    ex_check("star_jacobian", mean.jacobian, exact->jacobian, 0.01 * (1 - exact->jacobian));
    ex_check("star_temperature", mean.temperature, exact->temperature, 0.01 * warming);
}

static int run_bar(const impact_parameters *p) {
    static run r;
    tlsph_error error;
    impact_parameters q = *p;
    int code;
    r.shock = impact_exact(&q, &r.exact);
    if (!(q.options.end_time > 0)) q.options.end_time = 0.34 * q.length / r.shock; /* the free ends are still unaware */
    if (q.options.end_time * r.shock > 0.5 * q.length) {
        fprintf(stderr, "error: --end-time must be at most %g s, when the shocks reach the ends\n",
                0.5 * q.length / r.shock);
        return 2;
    }
    if (impact_create(&q, &r.bar, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&r.base, "shock_tube", &r.bar.parameters.options, &r.bar.body, q.options.end_time)) return 1;
    driver_run_to(&r.base, q.options.end_time);
    draw_profile(&r);
    draw_bar(&r);
    if (r.base.result == TLSPH_OK) report(&r);
    code = driver_end(&r.base);
    scene_destroy(&r.bar.body);
    return code;
}

int main(int argc, char **argv) {
    impact_parameters p;
    int material = 0;
    double fraction = 0.3;
    const ex_option own[] = {
        { "n", EX_INT, &p.n, NULL, NULL, 50, 20000, "spacings along the bar of 1 m" },
        { "across", EX_INT, &p.across, NULL, NULL, 1, 16, "spacings across" },
        { "material", EX_CHOICE, &material, NULL, "mg|mee", 0, 0, "Mie-Grueneisen or modified entropic elasticity" },
        { "impact", EX_REAL, &fraction, "c_p", NULL, 1e-3, 0.8, "speed of each half, as a share of the p speed" } };
    impact_default(&p);
    p.n = 400;
    p.across = 1;
    p.options.end_time = 0;
    driver_arguments(argc, argv, "shock_tube", "symmetric impact of two halves of a bar, against the jump conditions",
                     &p.options, own, (int)(sizeof own / sizeof *own));
    if (p.options.thermal != TLSPH_ENERGY)
        fprintf(stderr, "note: only --thermal energy conserves what a shock conserves\n");
    if (p.options.thermal == TLSPH_ISOTHERMAL) return 2;
    p.material = scene_paper_material(material ? TLSPH_MEE : TLSPH_MIE_GRUNEISEN);
    p.material.conductivity = 0;
    p.speed = fraction * impact_p_speed(&p.material);
    return run_bar(&p);
}
