/*
stent.c - one eighth of a perforated tube that is pushed together along its axis: 001 section 7.3.2

The paper's drawing is not at hand: here a tube of outer diameter 20 mm, wall 0.5 mm and length 20 mm has rows of round holes
of 2 mm, centred between the symmetry planes X = 0, Y = 0 and Z = 0. The cloud is a structured grid in radius, angle and Z
from which the cells in the holes are left out; the nodes around a hole are moved towards its circle. Volumes and areas come
from Voronoi cells in the polyhedron that the remaining cells make up.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double outer = 0.010, wall = 0.0005, half_length = 0.010, hole = 0.001; /* m; hole: radius */

void stent_default(stent_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.end_time = 0.0216; /* figure 29 */
    p->options.cfl = 0.4;
    p->start_time = 0.008;
    p->spacing = 0.0005;          /* two particles across the wall, the least that the paper speaks of */
    p->around = 16;
    p->rows = 3;
    p->young = 0.9e6; p->density = 1000; p->nu = 0.45; /* captions of figures 29, 30; the text has 17 MPa, 1100 kg/m^3 */
}

/* Times count from the paper's t = 0, the solver's from `start_time`. */
double stent_speed(double t) { /* (60), towards the middle */
    const double gamma = exp(800 * (0.015 - t));
    return t <= 0.03 ? 800 * 0.006 * gamma / ((gamma + 1) * (gamma + 1)) : 0;
}
double stent_shortening(double t) { /* its integral, from minus infinity */
    return 0.006 / (1 + exp(800 * (0.015 - fmin(t, 0.03))));
}

/* ---- grid -------------------------------------------------------------------------------------------------------- */

typedef struct grid {
    const stent_parameters *p;
    size_t n[3];          /* cells along the radius, the quarter's angle and Z */
    double *node;         /* angle and Z of the nodes in the middle surface: (n[1] + 1)(n[2] + 1) pairs */
    unsigned char *keep;  /* a cell of the middle surface is part of the body */
    uint32_t *number;     /* of a node, or none */
    size_t count;
} grid;

#define NONE 0xffffffffu

/* Distance from the nearest hole's centre on the middle surface; away: the direction away from it. */
static double from_hole(const stent_parameters *p, double angle, double z, double away[2]) {
    const double radius = outer - wall / 2, pitch = 2 * SCENE_PI / p->around, row = half_length / p->rows;
    const double at = (floor(angle / pitch) + 0.5) * pitch, up = (fmin(floor(z / row), p->rows - 1.0) + 0.5) * row;
    const double a = radius * (angle - at), b = z - up, distance = hypot(a, b);
    away[0] = distance > 0 ? a / distance : 1;
    away[1] = distance > 0 ? b / distance : 0;
    return distance;
}
static size_t plane_node(const grid *g, size_t j, size_t k) { return k * (g->n[1] + 1) + j; }
static size_t node_of(const grid *g, size_t i, size_t j, size_t k) {
    return plane_node(g, j, k) * (g->n[0] + 1) + i;
}
static int kept(const grid *g, size_t j, size_t k) { /* wraps below 0 to a large number, which is outside */
    return j < g->n[1] && k < g->n[2] && g->keep[k * g->n[1] + j];
}

/* Nodes at the edge of a hole go towards its circle, by at most a third of a spacing; those in the symmetry planes stay. */
static void fit_holes(grid *g) {
    const double radius = outer - wall / 2, most = 0.33 * g->p->spacing;
    double away[2];
    for (size_t k = 0; k < g->n[2]; k++)
        for (size_t j = 0; j < g->n[1]; j++)
            g->keep[k * g->n[1] + j] = from_hole(g->p, ((double)j + 0.5) * SCENE_PI / 2 / (double)g->n[1],
                                                 ((double)k + 0.5) * half_length / (double)g->n[2], away) > hole;
    for (size_t k = 0; k <= g->n[2]; k++)
        for (size_t j = 0; j <= g->n[1]; j++) {
            double *at = g->node + 2 * plane_node(g, j, k);
            const int cells = kept(g, j, k) + kept(g, j - 1, k) + kept(g, j, k - 1) + kept(g, j - 1, k - 1);
            const int inside = j > 0 && k > 0 && j < g->n[1] && k < g->n[2];
            at[0] = (double)j * SCENE_PI / 2 / (double)g->n[1];
            at[1] = (double)k * half_length / (double)g->n[2];
            if (!inside || cells == 0 || cells == 4) continue;
            const double move = fmax(-most, fmin(most, hole - from_hole(g->p, at[0], at[1], away)));
            at[0] += move * away[0] / radius;
            at[1] += move * away[1];
        }
}
static void place(const grid *g, size_t i, size_t j, size_t k, tlsph_real *X) {
    const double *at = g->node + 2 * plane_node(g, j, k), r = outer - wall * (1 - (double)i / (double)g->n[0]);
    X[0] = j == g->n[1] ? 0 : (tlsph_real)(r * cos(at[0]));
    X[1] = (tlsph_real)(r * sin(at[0]));
    X[2] = (tlsph_real)at[1];
}

/* Corners of a cell's face across `axis`, counter-clockwise from outside. */
static void face_corners(const size_t cell[3], int axis, int upper, size_t corner[4][3]) {
    static const int step[4][2] = { { 0, 0 }, { 1, 0 }, { 1, 1 }, { 0, 1 } };
    for (int c = 0; c < 4; c++) {
        const int *s = step[upper ? c : 3 - c];
        corner[c][axis] = cell[axis] + (size_t)upper;
        corner[c][(axis + 1) % 3] = cell[(axis + 1) % 3] + (size_t)s[0];
        corner[c][(axis + 2) % 3] = cell[(axis + 2) % 3] + (size_t)s[1];
    }
}
static size_t add_face(const grid *g, const size_t cell[3], int axis, int upper, tlsph_real *triangles) {
    static const int split[6] = { 0, 1, 2, 0, 2, 3 };
    size_t corner[4][3];
    face_corners(cell, axis, upper, corner);
    for (int c = 0; triangles && c < 6; c++) {
        const size_t *at = corner[split[c]];
        place(g, at[0], at[1], at[2], triangles + 3 * c);
    }
    return 2;
}
/* The triangles of the body's surface, 9 numbers each; counts them where `triangles` is NULL. */
static size_t surface_of(const grid *g, tlsph_real *triangles) {
    size_t count = 0;
    for (size_t k = 0; k < g->n[2]; k++)
        for (size_t j = 0; j < g->n[1]; j++)
            for (size_t i = 0; kept(g, j, k) && i < g->n[0]; i++) {
                const size_t cell[3] = { i, j, k };
                const int open[3][2] = { { i == 0, i + 1 == g->n[0] },
                                         { !kept(g, j - 1, k), !kept(g, j + 1, k) },
                                         { !kept(g, j, k - 1), !kept(g, j, k + 1) } };
                for (int axis = 0; axis < 3; axis++)
                    for (int upper = 0; upper < 2; upper++)
                        if (open[axis][upper])
                            count += add_face(g, cell, axis, upper, triangles ? triangles + 9 * count : NULL);
            }
    return count;
}

static void number_nodes(grid *g) {
    for (size_t k = 0; k <= g->n[2]; k++)
        for (size_t j = 0; j <= g->n[1]; j++)
            for (size_t i = 0; i <= g->n[0]; i++) {
                const int used = kept(g, j, k) || kept(g, j - 1, k) || kept(g, j, k - 1) || kept(g, j - 1, k - 1);
                g->number[node_of(g, i, j, k)] = used ? (uint32_t)g->count++ : NONE;
            }
}

static void *cloud_allocate(void *user, size_t size) { (void)user; return malloc(size); }
static void cloud_release(void *user, void *memory, size_t size) { (void)user; (void)size; free(memory); }

/* Particles with positions, volumes and areas in one block, as tlsph_cloud_destroy wants it. */
static tlsph_result make_cloud(const grid *g, tlsph_cloud *cloud, tlsph_error *error) {
    const size_t triangles = surface_of(g, NULL), n = g->count;
    tlsph_real *corners = malloc(9 * triangles * sizeof *corners), *block = malloc(7 * n * sizeof *block);
    tlsph_surface surface;
    tlsph_result result = TLSPH_ERROR_MEMORY;
    memset(cloud, 0, sizeof *cloud);
    cloud->memory = block;
    cloud->memory_size = 7 * n * sizeof *block;
    cloud->allocator.allocate = cloud_allocate;
    cloud->allocator.release = cloud_release;
    for (int i = 0; i < 3; i++) cloud->cell_size[i] = (tlsph_real)g->p->spacing;
    if (corners && block) {
        for (size_t k = 0; k <= g->n[2]; k++)
            for (size_t j = 0; j <= g->n[1]; j++)
                for (size_t i = 0; i <= g->n[0]; i++) {
                    const uint32_t number = g->number[node_of(g, i, j, k)];
                    if (number != NONE) place(g, i, j, k, block + 3 * number);
                }
        cloud->particles.count = n;
        cloud->particles.positions = block;
        cloud->particles.volumes = block + 3 * n;
        cloud->particles.areas = block + 4 * n;
        cloud->particles.spacing = (tlsph_real)g->p->spacing;
        surface.count = surface_of(g, corners);
        surface.corners = corners;
        result = tlsph_voronoi(3, &cloud->particles, &surface, NULL, block + 3 * n, block + 4 * n, NULL, error);
    }
    free(corners);
    return result;
}

static tlsph_result build(const stent_parameters *p, tlsph_cloud *cloud, tlsph_error *error) {
    grid g;
    tlsph_result result = TLSPH_ERROR_MEMORY;
    memset(&g, 0, sizeof g);
    g.p = p;
    g.n[0] = (size_t)fmax(1, round(wall / p->spacing));
    g.n[1] = (size_t)round((outer - wall / 2) * SCENE_PI / 2 / p->spacing);
    g.n[2] = (size_t)round(half_length / p->spacing);
    g.node = malloc(2 * (g.n[1] + 1) * (g.n[2] + 1) * sizeof *g.node);
    g.keep = calloc(g.n[1] * g.n[2], 1);
    g.number = malloc((g.n[0] + 1) * (g.n[1] + 1) * (g.n[2] + 1) * sizeof *g.number);
    memset(cloud, 0, sizeof *cloud);
    if (g.node && g.keep && g.number) {
        fit_holes(&g);
        number_nodes(&g);
        result = make_cloud(&g, cloud, error);
    }
    free(g.node); free(g.keep); free(g.number);
    return result;
}

/* ---- scene ------------------------------------------------------------------------------------------------------- */

static void push(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                 const tlsph_real *x, tlsph_real *values) {
    const stent *tube = user;
    (void)particle; (void)X; (void)x;
    for (size_t i = 0; i < count; i++) {
        values[3 * i] = values[3 * i + 1] = 0;
        values[3 * i + 2] = (tlsph_real)-stent_speed(tube->parameters.start_time + (double)time);
    }
}

double stent_volume(const stent_parameters *p) {
    const double bore = SCENE_PI / 4 * (outer * outer - (outer - wall) * (outer - wall)) * half_length;
    return bore - p->around / 4.0 * p->rows * SCENE_PI * hole * hole * wall;
}

tlsph_result stent_create(const stent_parameters *p, stent *out, tlsph_error *error) {
    tlsph_fill fill = tlsph_fill_default(3);
    scene_options options = p->options;
    scene_setup setup;
    tlsph_condition *end;
    memset(out, 0, sizeof *out);
    memset(&setup, 0, sizeof setup);
    if (error) memset(error, 0, sizeof *error);
    out->parameters = *p;
    scene_options_cloud(&options, &fill);
    setup.body.material = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    setup.body.material.young = (tlsph_real)p->young;
    setup.body.material.density = (tlsph_real)p->density;
    setup.body.material.poisson = (tlsph_real)p->nu;
    setup.result = build(p, &setup.body.cloud, error);
    for (int axis = 0; axis < 3; axis++) scene_add_plane(&setup, TLSPH_ROLLER, axis, 0);
    end = scene_add_plane(&setup, TLSPH_VELOCITY, 2, half_length);
    end->normal[2] = 0; /* all three components are prescribed */
    end->values = push;
    end->values_user = out;
    return scene_end(&setup, &options, &out->body, error);
}
