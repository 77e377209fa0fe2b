/* surface.c - the surface of lattice bodies: faces that belong to one cell only, and conditions on curved parts of it. */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A face of a cell: least and largest corner tell it from all others of its axis. */
typedef struct entry { uint32_t least, most, cell; int face; } entry; /* face: 2 axis + side */

/* Corners of a cell's face, in no special order: those whose bit `axis` is `side`. */
static void corners_of(const tlsph_cloud *cloud, uint32_t cell, int face, uint32_t corner[4]) {
    const int axis = face / 2, side = face % 2;
    int found = 0;
    for (int k = 0; k < 8; k++)
        if ((k >> axis & 1) == side) corner[found++] = cloud->particles.cells[8 * (size_t)cell + (size_t)k];
}

static int compare(const void *a, const void *b) {
    const entry *l = a, *r = b;
    if (l->least != r->least) return l->least < r->least ? -1 : 1;
    if (l->most != r->most) return l->most < r->most ? -1 : 1;
    if (l->face / 2 != r->face / 2) return l->face / 2 - r->face / 2;
    return l->face - r->face;
}

static int same(const entry *a, const entry *b) {
    return a->least == b->least && a->most == b->most && a->face / 2 == b->face / 2;
}

static scene_face describe(const tlsph_cloud *cloud, const entry *e) {
    const tlsph_real *X = cloud->particles.positions;
    const size_t axis = (size_t)e->face / 2, next = (axis + 1) % 3, last = (axis + 2) % 3;
    double low[3], high[3];
    scene_face face;
    memset(&face, 0, sizeof face);
    corners_of(cloud, e->cell, e->face, face.corner);
    for (size_t k = 0; k < 3; k++) {
        low[k] = HUGE_VAL; high[k] = -HUGE_VAL;
        for (int i = 0; i < 4; i++) {
            low[k] = fmin(low[k], (double)X[3 * face.corner[i] + k]);
            high[k] = fmax(high[k], (double)X[3 * face.corner[i] + k]);
        }
        face.middle[k] = (low[k] + high[k]) / 2;
    }
    face.area[axis] = (e->face % 2 ? 1 : -1) * (high[next] - low[next]) * (high[last] - low[last]);
    return face;
}

tlsph_result scene_surface(const tlsph_cloud *cloud, scene_face_fn visit, void *user) {
    const size_t count = 6 * cloud->particles.cell_count;
    entry *list = malloc((count + 1) * sizeof *list);
    if (!list) return TLSPH_ERROR_MEMORY;
    for (size_t i = 0; i < count; i++) {
        uint32_t corner[4];
        entry e = { UINT32_MAX, 0, (uint32_t)(i / 6), (int)(i % 6) };
        corners_of(cloud, e.cell, e.face, corner);
        for (int k = 0; k < 4; k++) {
            if (corner[k] < e.least) e.least = corner[k];
            if (corner[k] > e.most) e.most = corner[k];
        }
        list[i] = e;
    }
    qsort(list, count, sizeof *list, compare);
    for (size_t i = 0; i < count; i++) {
        if (i + 1 < count && same(&list[i], &list[i + 1])) { i++; continue; } /* between two cells */
        const scene_face face = describe(cloud, &list[i]);
        visit(user, &face);
    }
    free(list);
    return TLSPH_OK;
}

/* ---- conditions -------------------------------------------------------------------------------------------------- */

typedef struct sharing { scene_share_fn share; void *user; double *areas; double sum; } sharing;

static void share_face(void *user, const scene_face *face) {
    sharing *s = user;
    const double part = s->share(s->user, face);
    if (!(part > 0)) return;
    s->sum += part;
    for (int i = 0; i < 4; i++) s->areas[face->corner[i]] += part / 4;
}

/* On a cloud each particle's own area stands for the face; those that look sideways are none of it. */
static void share_cloud(const tlsph_particles *particles, sharing *s) {
    for (size_t a = 0; a < particles->count; a++) {
        scene_face face;
        double size = 0;
        memset(&face, 0, sizeof face);
        for (size_t k = 0; k < 3; k++) {
            face.middle[k] = (double)particles->positions[3 * a + k];
            face.area[k] = (double)particles->areas[3 * a + k];
            size += face.area[k] * face.area[k];
        }
        const double share = size > 0 ? s->share(s->user, &face) : 0;
        if (!(share > 0.2 * sqrt(size))) continue;
        s->areas[a] = share;
        s->sum += share;
    }
}

tlsph_condition *scene_add_surface(scene_setup *setup, tlsph_condition_kind kind, scene_share_fn share, void *user,
                                   double area) {
    const size_t count = setup->body.cloud.particles.count;
    tlsph_condition *condition = scene_add(setup, kind);
    uint32_t *list = scene_keep(setup, count * sizeof *list);
    tlsph_real *areas = scene_keep(setup, count * sizeof *areas);
    double *sums = scene_keep(setup, count * sizeof *sums);
    sharing s = { share, user, sums, 0 };
    if (!list || !areas || !sums) return condition;
    memset(sums, 0, count * sizeof *sums);
    if (setup->body.cloud.particles.areas) share_cloud(&setup->body.cloud.particles, &s);
    else setup->result = scene_surface(&setup->body.cloud, share_face, &s);
    for (size_t a = 0; a < count && s.sum > 0; a++) {
        if (!(sums[a] > 0)) continue;
        list[condition->count] = (uint32_t)a;
        areas[condition->count++] = (tlsph_real)(sums[a] * (area > 0 ? area / s.sum : 1));
    }
    condition->particles = list;
    condition->areas = areas;
    return condition;
}
