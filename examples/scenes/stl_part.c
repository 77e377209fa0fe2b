/* stl_part.c - a free part given by a closed triangle surface, sampled as a cloud, pushed on one face. */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void stl_part_default(stl_part_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.integrator = TLSPH_RK3_FROZEN;
    p->options.threads = 1; /* a small scene runs best on one */
    p->options.end_time = 0.015;
    p->spacing = 0.006;
    p->seed = 1;
    p->push[1] = -6e4; p->push[2] = 1e4;
    p->duration = 0.005;
}

/* ---- the bracket ------------------------------------------------------------------------------------------------- */

enum { ROUND = 48, OUTER = 6, RAYS = ROUND + OUTER };
static const double arm = 0.1, width = 0.04, thickness = 0.02, hole = 0.012;

static int by_size(const void *a, const void *b) {
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/* Distance from the middle of the corner to the L's outline: all of it is seen from there. */
static double outline(double angle) {
    const double middle = width / 2, c = cos(angle), s = sin(angle);
    const double x = c > 0 ? (arm - middle) / c : middle / fmax(-c, 1e-12);
    const double y = s > 0 ? (arm - middle) / s : middle / fmax(-s, 1e-12);
    double r = fmin(x, y);
    if (c > 0 && s > 0) r = fmin(r, fmax(middle / c, middle / s)); /* the inner corner */
    return r;
}
static void add(ex_triangles *t, const float *a, const float *b, const float *c) {
    const float *const corner[3] = { a, b, c };
    for (int i = 0; i < 9; i++) t->corners[9 * t->count + (size_t)i] = (double)corner[i / 3][i % 3];
    t->count++;
}
static void add_quad(ex_triangles *t, const float *a, const float *b, const float *c, const float *d) {
    add(t, a, b, c);
    add(t, a, c, d);
}

/* Rays from the middle of the hole, through all corners of the L, make strips between hole and outline. */
int stl_part_bracket(ex_triangles *out) {
    const double m = width / 2, far = arm - m;
    const double corner[OUTER][2] = { { -m, -m }, { far, -m }, { far, m }, { m, m }, { m, far }, { -m, far } };
    double angle[RAYS];
    float at[RAYS][2][2][3]; /* ray, hole or outline, bottom or top */
    out->count = 0;
    out->corners = malloc(9 * 8 * RAYS * sizeof *out->corners);
    if (!out->corners) return 1;
    for (int i = 0; i < ROUND; i++) angle[i] = (2 * (i + 0.37) / ROUND - 1) * SCENE_PI; /* none meets a corner */
    for (int i = 0; i < OUTER; i++) angle[ROUND + i] = atan2(corner[i][1], corner[i][0]);
    qsort(angle, RAYS, sizeof *angle, by_size);
    for (int i = 0; i < RAYS; i++)
        for (int k = 0; k < 4; k++) {
            const double r = k / 2 ? outline(angle[i]) : hole;
            at[i][k / 2][k % 2][0] = (float)(m + r * cos(angle[i]));
            at[i][k / 2][k % 2][1] = (float)(m + r * sin(angle[i]));
            at[i][k / 2][k % 2][2] = k % 2 ? (float)thickness : 0;
        }
    for (int i = 0; i < RAYS; i++) {
        const int j = (i + 1) % RAYS;
        add_quad(out, at[i][0][1], at[i][1][1], at[j][1][1], at[j][0][1]); /* top */
        add_quad(out, at[i][0][0], at[j][0][0], at[j][1][0], at[i][1][0]); /* bottom */
        add_quad(out, at[i][1][0], at[j][1][0], at[j][1][1], at[i][1][1]); /* outline */
        add_quad(out, at[i][0][0], at[i][0][1], at[j][0][1], at[j][0][0]); /* hole */
    }
    return 0;
}

/* ---- scene ------------------------------------------------------------------------------------------------------- */

/* Volume, area and centroid by the divergence theorem. */
static void measure(const ex_triangles *t, stl_part *out) {
    for (size_t f = 0; f < t->count; f++) {
        const double *a = t->corners + 9 * f, *b = a + 3, *c = a + 6;
        const double n[3] = { (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]),
                              (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2]),
                              (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) };
        const double six = n[0] * a[0] + n[1] * a[1] + n[2] * a[2]; /* volumes of the tetrahedron over the origin */
        out->area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
        out->volume += six / 6;
        for (int k = 0; k < 3; k++) out->centre[k] += six / 24 * (a[k] + b[k] + c[k]);
    }
    for (int k = 0; k < 3; k++) out->centre[k] /= out->volume;
}

static void pushed(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                   const tlsph_real *x, tlsph_real *values) {
    const stl_part_parameters *p = &((const stl_part *)user)->parameters;
    const double t = (double)time / p->duration, share = t < 1 ? sin(SCENE_PI * t) : 0;
    (void)particle; (void)X; (void)x;
    for (size_t i = 0; i < 3 * count; i++) values[i] = (tlsph_real)(share * p->push[i % 3]);
}

typedef struct end { double beyond; } end;
static int at_end(void *user, const tlsph_real X[3]) { return (double)X[0] >= ((const end *)user)->beyond; }

tlsph_result stl_part_create(const stl_part_parameters *p, stl_part *out, tlsph_error *error) {
    tlsph_material rubber = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_real *corners = malloc((9 * p->surface.count + 1) * sizeof *corners);
    scene_options options = p->options;
    scene_setup setup;
    tlsph_condition *push;
    end tip = { -HUGE_VAL };
    memset(out, 0, sizeof *out);
    if (error) memset(error, 0, sizeof *error);
    if (!corners) return TLSPH_ERROR_MEMORY;
    out->parameters = *p;
    measure(&p->surface, out);
    for (size_t i = 0; i < 9 * p->surface.count; i++) {
        corners[i] = (tlsph_real)p->surface.corners[i];
        if (i % 3 == 0) tip.beyond = fmax(tip.beyond, p->surface.corners[i]);
    }
    tip.beyond -= 1e-3 * p->spacing;
    rubber.density = 1100; rubber.young = (tlsph_real)5e6; rubber.poisson = (tlsph_real)0.4;
    fill.shape = TLSPH_TRIANGLES;
    fill.placement = TLSPH_SCATTERED;
    fill.spacing = (tlsph_real)p->spacing;
    fill.seed = (uint64_t)p->seed;
    fill.surface.count = p->surface.count;
    fill.surface.corners = corners;
    scene_options_cloud(&options, &fill);
    scene_begin(&setup, &fill, &rubber, error);
    free(corners);
    push = scene_add_where(&setup, TLSPH_TRACTION, at_end, &tip);
    push->normal[0] = 1;
    push->values = pushed;
    push->values_user = out;
    for (size_t i = 0; i < push->count; i++)
        out->face += fmax(0, (double)setup.body.cloud.particles.areas[3 * push->particles[i]]);
    if (push->count) out->tip = push->particles[push->count / 2];
    return scene_end(&setup, &options, &out->body, error);
}
