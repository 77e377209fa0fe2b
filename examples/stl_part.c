/*
stl_part.c - a part from an STL file, binary or ASCII, sampled as a cloud: pushed on one face, it flies, bends and turns

Without --file it writes a bracket with a hole to out/stl_part/bracket.stl and bracket_ascii.stl, and reads both. Checks
volume and centroid of the cloud against the exact ones of the triangles, the impulse, momenta and energy. Draws the von
Mises stress at four times, and energies and the way of the pushed end as curves.
*/
#include "common/driver.h"

#include <math.h>
#include <string.h>

enum { SHOTS = 4 };

typedef struct run {
    driver base;
    stl_part part;
    driver_snapshot shots[SHOTS];
    driver_history history;
    double linear, angular, energy, rise, least, impulse, work; /* largest of the run */
} run;

static double length3(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static void after_step(driver *d) {
    run *r = d->user;
    const tlsph_ledger *l = &d->now;
    double row[6] = { l->kinetic_energy, l->strain_energy, l->external_work, 0, 0, 0 };
    for (int k = 0; k < 3; k++)
        row[3 + k] = 1e3 * scene_value(d->body->solver, TLSPH_FIELD_DISPLACEMENT, r->part.tip, k);
    r->linear = fmax(r->linear, length3(l->linear_residual));
    r->angular = fmax(r->angular, length3(l->angular_residual));
    r->impulse = fmax(r->impulse, length3(l->impulse));
    r->work = fmax(r->work, l->external_work);
    r->energy = fmax(r->energy, fabs(l->energy_residual)); /* with the heat of the dissipation: isothermal */
    if (l->time > r->part.parameters.duration) {
        r->rise = fmax(r->rise, l->total_energy - r->least);
        r->least = fmin(r->least, l->total_energy);
    }
    driver_history_add(&r->history, l->time, row);
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

static int read_part(const char *path, double scale, ex_triangles *out) {
    char why[EX_WHY];
    if (!ex_stl_read(path, scale, out, why)) return 0;
    fprintf(stderr, "stl_part: %s: %s\n", path, why);
    return 2;
}

/* Writes the bracket in both formats and reads it back; both must hold the same triangles. */
static int make_bracket(const char *folder, ex_triangles *out) {
    char path[2][600];
    ex_triangles made, ascii;
    int code = 1;
    if (stl_part_bracket(&made)) return 1;
    for (int i = 0; i < 2; i++) snprintf(path[i], sizeof path[i], "%s/bracket%s.stl", folder, i ? "_ascii" : "");
    if (ex_make_directory(folder) || ex_stl_write(path[0], &made, 0) || ex_stl_write(path[1], &made, 1))
        fprintf(stderr, "stl_part: cannot write to %s\n", folder);
    else if (!(code = read_part(path[0], 1, out)) && !(code = read_part(path[1], 1, &ascii))) {
        const size_t size = 9 * out->count * sizeof *out->corners;
        ex_check_true("binary_as_written", made.count == out->count && !memcmp(made.corners, out->corners, size));
        ex_check_true("ascii_as_written", made.count == ascii.count && !memcmp(made.corners, ascii.corners, size));
        ex_stl_free(&ascii);
    }
    ex_stl_free(&made);
    return code;
}

/* ---- output ------------------------------------------------------------------------------------------------------ */

static void draw(run *r) {
    static const driver_chart charts[2] = {
        { "energies", "[J]", 0, 3, { "kinetic", "strain", "work" } },
        { "displacement of the pushed end", "[mm]", 3, 3, { "u_x", "u_y", "u_z" } } };
    ex_view view = driver_view(460, 400, -80, 68, 2, EX_MAP_HEAT, "von Mises stress [kPa]",
                              "part from an STL file, pushed on its end");
    view.common_scale = 1;
    driver_render(&r->base, "von_mises.png", &view, r->shots, SHOTS, 2, 0.42 * r->part.parameters.spacing);
    driver_plot(&r->base, "histories.png", &r->history, charts, 2, 2);
}

static void report(const run *r, const ex_triangles *surface) {
    const stl_part *part = &r->part;
    const tlsph_particles *particles = &part->body.cloud.particles;
    double volume = 0, centre[3] = { 0 }, open[3] = { 0 }, off = 0;
    tlsph_closure closure;
    tlsph_closure_read(part->body.solver, &closure);
    for (size_t a = 0; a < particles->count; a++) {
        volume += (double)particles->volumes[a];
        for (size_t k = 0; k < 3; k++) {
            centre[k] += (double)(particles->volumes[a] * particles->positions[3 * a + k]);
            open[k] += (double)particles->areas[3 * a + k];
        }
    }
    const double size = cbrt(part->volume), bits = sizeof(tlsph_real) == 4 ? 1e-4 : 1e-9;
    for (int k = 0; k < 3; k++) off = fmax(off, fabs(centre[k] / volume - part->centre[k]) / size);
    ex_result("facets", (double)surface->count, "1");
    ex_result("particles", (double)particles->count, "1");
    ex_result("steps", (double)r->base.now.step, "1");
    ex_result("surface_area", part->area, "m^2");
    ex_result("closure_linear", closure.linear, "1");
    ex_check("volume", volume, part->volume, bits * part->volume);
    ex_check_below("centroid_by_size", off, bits);
    ex_check_below("sum_of_areas", length3(open) / part->area, bits);
    if (!part->parameters.options.check && r->base.now.time > part->parameters.duration) {
        const double exact = length3(part->parameters.push) * part->face * 2 / SCENE_PI * part->parameters.duration;
        ex_check("impulse", r->impulse, exact, 5e-3 * exact); /* the closure changes areas a little */
    }
    ex_result("work", r->work, "J");
    ex_check_below("linear_momentum_residual", r->linear / r->impulse, 1e3 * bits);
    ex_check_below("angular_momentum_residual", r->angular / (r->impulse * size), 1e3 * bits);
    ex_check_below("energy_residual_by_work", r->energy / r->work, 0.05);
    ex_check_below("energy_rise_after_push", r->rise / r->work, 1e-3);
}

static int run_part(const stl_part_parameters *p) {
    static run r;
    tlsph_error error;
    int code;
    if (stl_part_create(p, &r.part, &error) != TLSPH_OK) return driver_error(&error);
    if (driver_begin(&r.base, "stl_part", &p->options, &r.part.body, p->options.end_time)) return 1;
    r.history.columns = 6;
    r.least = HUGE_VAL;
    r.base.step = after_step;
    r.base.user = &r;
    for (int i = 0; i < SHOTS && r.base.result == TLSPH_OK; i++) {
        const double time = p->options.end_time * i / (SHOTS - 1);
        if (i && driver_run_to(&r.base, time) != TLSPH_OK) break;
        driver_snap(&r.part.body, TLSPH_FIELD_VON_MISES, 0, 1e-3, &r.shots[i]);
        snprintf(r.shots[i].title, sizeof r.shots[i].title, "t = %.4g ms", 1e3 * time);
    }
    draw(&r);
    if (r.base.result == TLSPH_OK) report(&r, &p->surface);
    code = driver_end(&r.base);
    driver_history_free(&r.history);
    for (int i = 0; i < SHOTS; i++) driver_snapshot_free(&r.shots[i]);
    scene_destroy(&r.part.body);
    return code;
}

int main(int argc, char **argv) {
    stl_part_parameters p;
    const char *file = "";
    double scale = 1;
    int code;
    const ex_option own[] = {
        { "file", EX_TEXT, &file, NULL, NULL, 0, 0, "STL file, binary or ASCII; none: a bracket of our own" },
        { "scale", EX_REAL, &scale, "m", NULL, 1e-9, 1e9, "length of the file's unit" },
        { "spacing", EX_REAL, &p.spacing, "m", NULL, 1e-9, 1e9, "distance of particles" },
        { "seed", EX_INT, &p.seed, NULL, NULL, 0, 1e9, "of the cloud" },
        { "push-y", EX_REAL, &p.push[1], "Pa", NULL, -1e9, 1e9, "on the face farthest along X, peak of half a sine" },
        { "push-z", EX_REAL, &p.push[2], "Pa", NULL, -1e9, 1e9, "" },
        { "duration", EX_REAL, &p.duration, "s", NULL, 1e-9, 1e9, "of the push" } };
    stl_part_default(&p);
    driver_arguments(argc, argv, "stl_part", "a part from an STL file as a cloud, pushed on one face", &p.options,
                     own, (int)(sizeof own / sizeof *own));
    code = file[0] ? read_part(file, scale, &p.surface)
                   : make_bracket(p.options.output[0] ? p.options.output : "out/stl_part", &p.surface);
    if (!code) code = run_part(&p);
    ex_stl_free(&p.surface);
    return code;
}
