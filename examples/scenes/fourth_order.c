/*
fourth_order.c - pairs of fourth order along the lines of a box lattice, for TLSPH_GIVEN

  Summation by parts 4-2 (METHOD section 6): a line of N + 1 points has the volumes h w_i and antisymmetric weights Q_ij
  with sum_j Q_ij (x_j - x_i) = h w_i; inside, Q is the central stencil 2/3, -1/12. Times the area A that belongs to the
  line, C_ij = 2 Q_ij A e is antisymmetric, closes at both ends and is exact for linear fields.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { REACH = 3, MOST_PAIRS = 2 * REACH + 4 };

/* w_i of a line whose last point has the number `last`. */
static double line_weight(size_t i, size_t last) {
    static const double ends[4] = { 17.0 / 48, 59.0 / 48, 43.0 / 48, 49.0 / 48 };
    const size_t m = i < last - i ? i : last - i;
    return m < 4 ? ends[m] : 1;
}

/* Q_ij for j = i + offset > i; the other end of the line is the mirror image. */
static double line_pair(size_t i, size_t offset, size_t last) {
    static const double ends[4][REACH] = {
        { 59.0 / 96, -1.0 / 12, -1.0 / 32 }, { 59.0 / 96, 0, 0 }, { 59.0 / 96, -1.0 / 12, 0 }, { 2.0 / 3, -1.0 / 12, 0 } };
    static const double inside[REACH] = { 2.0 / 3, -1.0 / 12, 0 };
    const size_t mirrored = last - i - offset;
    if (i < 4) return ends[i][offset - 1];
    return mirrored < 4 ? ends[mirrored][offset - 1] : inside[offset - 1];
}

/* A box lattice: points n[i], steps h[i] and first coordinates low[i] along the axes; particle numbers by place. */
typedef struct lattice { size_t n[3]; double h[3], low[3]; size_t *particle; int dimension, axis; } lattice;

static void measure(const tlsph_cloud *cloud, lattice *l) {
    const tlsph_particles *p = &cloud->particles;
    for (int i = 0; i < 3; i++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (size_t a = 0; a < p->count; a++) {
            low = fmin(low, (double)p->positions[3 * a + (size_t)i]);
            high = fmax(high, (double)p->positions[3 * a + (size_t)i]);
        }
        l->low[i] = low;
        l->h[i] = i < l->dimension ? (double)cloud->cell_size[i] : 1;
        l->n[i] = i < l->dimension ? (size_t)((high - low) / l->h[i] + 0.5) + 1 : 1;
    }
}

static void place_of(const lattice *l, const tlsph_real *X, size_t place[3]) {
    for (int i = 0; i < 3; i++)
        place[i] = i < l->dimension ? (size_t)(((double)X[i] - l->low[i]) / l->h[i] + 0.5) : 0;
}

static size_t number_at(const lattice *l, const size_t place[3]) {
    return l->particle[place[0] + l->n[0] * (place[1] + l->n[1] * place[2])];
}

/* Length along axis i that belongs to a point there: by summation by parts on the lines, trapezia across. */
static double share(const lattice *l, int i, size_t at) {
    if (i >= l->dimension) return 1;
    if (i == l->axis) return l->h[i] * line_weight(at, l->n[i] - 1);
    return l->h[i] * (at == 0 || at + 1 == l->n[i] ? 0.5 : 1);
}

typedef struct pairs { tlsph_real *volumes, *vectors; size_t *first; uint32_t *neighbours; size_t count; } pairs;

static void add_pair(const lattice *l, const size_t place[3], int axis, int offset, double C, pairs *out) {
    size_t other[3] = { place[0], place[1], place[2] };
    tlsph_real *vector = out->vectors + 3 * out->count;
    other[axis] = (size_t)((ptrdiff_t)other[axis] + offset);
    out->neighbours[out->count++] = (uint32_t)number_at(l, other);
    memset(vector, 0, 3 * sizeof *vector);
    vector[axis] = (tlsph_real)C;
}

static void add_line(const lattice *l, const size_t place[3], int axis, double area, pairs *out) {
    const size_t at = place[axis], last = l->n[axis] - 1;
    const size_t reach = axis == l->axis ? REACH : 1;
    for (size_t offset = 1; offset <= reach; offset++) {
        const double up = axis != l->axis ? 0.5 : at + offset <= last ? line_pair(at, offset, last) : 0;
        const double down = axis != l->axis ? 0.5 : at >= offset ? line_pair(at - offset, offset, last) : 0;
        if (at + offset <= last && fabs(up) > 0) add_pair(l, place, axis, (int)offset, 2 * up * area, out);
        if (at >= offset && fabs(down) > 0) add_pair(l, place, axis, -(int)offset, -2 * down * area, out);
    }
}

static void fill_pairs(const tlsph_particles *p, const lattice *l, pairs *out) {
    for (size_t a = 0; a < p->count; a++) {
        size_t place[3];
        double shares[3];
        place_of(l, p->positions + 3 * a, place);
        for (int i = 0; i < 3; i++) shares[i] = share(l, i, place[i]);
        out->volumes[a] = (tlsph_real)(shares[0] * shares[1] * shares[2]);
        out->first[a] = out->count;
        for (int i = 0; i < l->dimension; i++)
            add_line(l, place, i, shares[(i + 1) % 3] * shares[(i + 2) % 3], out);
    }
    out->first[p->count] = out->count;
}

/* One block for all that the description points to until the solver is made, and the volumes for as long as the body. */
void scene_fourth_order(scene_setup *setup, int dimension, int axis) {
    tlsph_particles *p = &setup->body.cloud.particles;
    const size_t n = p->count;
    lattice l = { { 0 }, { 0 }, { 0 }, NULL, dimension, axis };
    pairs out = { NULL, NULL, NULL, NULL, 0 };
    char *memory;
    if (setup->result != TLSPH_OK) return;
    measure(&setup->body.cloud, &l);
    if (l.n[axis] < 9 || l.n[0] * l.n[1] * l.n[2] != n) { setup->result = TLSPH_ERROR_SIZE; return; }
    memory = malloc(n * (sizeof *l.particle + MOST_PAIRS * (3 * sizeof *out.vectors + sizeof *out.neighbours) +
                         sizeof *out.volumes) + (n + 1) * sizeof *out.first);
    if (!memory) { setup->result = TLSPH_ERROR_MEMORY; return; }
    setup->body.operator_memory = memory;
    l.particle = (size_t *)(void *)memory;
    out.first = l.particle + n;
    out.volumes = (tlsph_real *)(void *)(out.first + n + 1);
    out.vectors = out.volumes + n;
    out.neighbours = (uint32_t *)(void *)(out.vectors + 3 * MOST_PAIRS * n);
    for (size_t a = 0; a < n; a++) {
        size_t place[3];
        place_of(&l, p->positions + 3 * a, place);
        l.particle[place[0] + l.n[0] * (place[1] + l.n[1] * place[2])] = a;
    }
    fill_pairs(p, &l, &out);
    p->volumes = out.volumes;
    p->weights = NULL;
    p->first = out.first;
    p->neighbours = out.neighbours;
    p->pair_vectors = out.vectors;
}
