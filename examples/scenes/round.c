/*
round.c - round bars whose particles lie on the surface: a meshed quarter of a disc, drawn out along Y

A lattice makes a staircase of a circle. Here an inner square block and two blocks between it and the arc are meshed with
quadrilaterals (an "O-grid"); the nodes are the particles. C_ab is the area of the dual face of the edge ab, from the
middles of the edges to those of the cells: antisymmetric and closed by construction, with the true outward boundary
vectors. On bent meshes it is not quite exact for linear fields; the smallest change of C that makes it so, antisymmetric
and closed as before, is found once (METHOD section 7, in the plane and per component):
    dC_ab = (l_a - l_b) + (m_a + m_b).d_ab / 2,   sum_b dC_ab = -dB_a,   sum_b dC_ab d_ab / 2 = what is missing at a.
Two edges a node cannot meet three conditions, so the diagonals of the cells are pairs too, with C_ab = 0 at first. The
boundary vectors may change a little along their own direction, dB_a,i = s (B_i/|B|)^2 l_a: no polygon's are exact.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The plane mesh: nodes (x, z), quadrilaterals, and edges a < b with their dual vectors. */
typedef struct mesh {
    size_t nodes, cells, edges;
    double (*X)[2], *area;
    uint32_t (*cell)[4], (*edge)[2];
    double (*S)[2];     /* of the edge, from edge[0] to edge[1] */
    uint32_t *grid[3];  /* node numbers of the blocks: (m + 1) x (m + 1), then (m + 1) x (rings + 1) twice */
    int m, rings;
} mesh;

static void mesh_free(mesh *q) {
    free(q->X); free(q->area); free(q->cell); free(q->edge); free(q->S);
    for (int i = 0; i < 3; i++) free(q->grid[i]);
    memset(q, 0, sizeof *q);
}

/* Numbers of the nodes: the square row by row; block 1 leaves its right side towards the arc, block 2 its upper side. The
   two share the diagonal. */
static void number_nodes(mesh *q) {
    const size_t m = (size_t)q->m, k = (size_t)q->rings;
    uint32_t next = 0;
    for (size_t i = 0; i < (m + 1) * (m + 1); i++) q->grid[0][i] = next++;
    for (size_t j = 0; j <= m; j++)
        for (size_t ring = 0; ring <= k; ring++) {
            uint32_t *one = q->grid[1] + j * (k + 1) + ring;
            if (ring == 0) *one = q->grid[0][j * (m + 1) + m];
            else *one = next++;
        }
    for (size_t j = 0; j <= m; j++) /* from the diagonal towards the z axis */
        for (size_t ring = 0; ring <= k; ring++) {
            uint32_t *one = q->grid[2] + j * (k + 1) + ring;
            if (ring == 0) *one = q->grid[0][m * (m + 1) + m - j];
            else *one = j == 0 ? q->grid[1][m * (k + 1) + ring] : next++;
        }
    q->nodes = next;
}
static void add_cells(mesh *q, const uint32_t *grid, size_t rows, size_t columns) {
    for (size_t j = 0; j < rows; j++)
        for (size_t i = 0; i < columns; i++) {
            const uint32_t *at = grid + j * (columns + 1) + i;
            uint32_t *c = q->cell[q->cells++];
            c[0] = at[0];
            c[1] = at[1];
            c[2] = at[columns + 2];
            c[3] = at[columns + 1];
        }
}
/* First places: the square in its own lattice, the rings between it and the arc, even in angle. */
static void place_nodes(mesh *q, double radius) {
    const int m = q->m, k = q->rings;
    const double side = radius * m / (m + k), step = SCENE_PI / 4 / m;
    /* the polygon through the arc's nodes has the area of the disc */
    const double outside = radius * sqrt(step / sin(step));
    for (int j = 0; j <= m; j++)
        for (int i = 0; i <= m; i++) {
            double *X = q->X[q->grid[0][j * (m + 1) + i]];
            const double u = (double)i / m, v = (double)j / m, bulge = 1 - 0.15 * u * v;
            X[0] = side * u * bulge;
            X[1] = side * v * bulge;
        }
    for (int block = 1; block <= 2; block++)
        for (int j = 0; j <= m; j++) {
            const double angle = step * (j + (block - 1) * m);
            const double *inner = q->X[q->grid[block][j * (k + 1)]];
            const double x = inner[0], z = inner[1];
            for (int ring = 1; ring <= k; ring++) {
                double *X = q->X[q->grid[block][j * (k + 1) + ring]];
                const double t = (double)ring / k;
                X[0] = (1 - t) * x + t * outside * cos(angle);
                X[1] = (1 - t) * z + t * outside * sin(angle);
            }
        }
    for (int j = 0; j <= m; j++) { /* exactly on the planes of symmetry */
        for (int ring = 0; ring <= k; ring++) {
            q->X[q->grid[1][ring]][1] = 0;
            q->X[q->grid[2][m * (k + 1) + ring]][0] = 0;
        }
    }
}
/* Moves inner nodes towards the mean of their neighbours, nodes on the axes along them; the arc stays. */
static void smooth_nodes(mesh *q, double radius) {
    double (*sum)[3] = malloc(q->nodes * sizeof *sum);
    for (int round = 0; sum && round < 40; round++) {
        memset(sum, 0, q->nodes * sizeof *sum);
        for (size_t e = 0; e < q->edges; e++)
            for (int end = 0; end < 2; end++) {
                const uint32_t a = q->edge[e][end], b = q->edge[e][1 - end];
                const double *A = q->X[a], *B = q->X[b]; /* on an axis, a neighbour beside it stands for its mirror image too */
                const double weight = (A[0] == 0 && B[0] > 0) || (A[1] == 0 && B[1] > 0) ? 2 : 1;
                for (int i = 0; i < 2; i++) sum[a][i] += weight * B[i];
                sum[a][2] += weight;
            }
        for (size_t a = 0; a < q->nodes; a++) {
            double *X = q->X[a];
            const int on_x = X[1] == 0, on_z = X[0] == 0;
            if (hypot(X[0], X[1]) > radius * (1 - 1e-9)) continue;
            if (!on_z) X[0] = sum[a][0] / sum[a][2];
            if (!on_x) X[1] = sum[a][1] / sum[a][2];
        }
    }
    free(sum);
}

static int compare_edges(const void *a, const void *b) {
    const uint32_t *l = a, *r = b;
    if (l[0] != r[0]) return l[0] < r[0] ? -1 : 1;
    return l[1] < r[1] ? -1 : l[1] > r[1];
}
/* Sides and diagonals of the cells. */
static void find_edges(mesh *q) {
    static const int ends[6][2] = { { 0, 1 }, { 1, 2 }, { 2, 3 }, { 3, 0 }, { 0, 2 }, { 1, 3 } };
    size_t count = 0, kept = 0;
    for (size_t c = 0; c < q->cells; c++)
        for (int i = 0; i < 6; i++) {
            const uint32_t a = q->cell[c][ends[i][0]], b = q->cell[c][ends[i][1]];
            q->edge[count][0] = a < b ? a : b;
            q->edge[count++][1] = a < b ? b : a;
        }
    qsort(q->edge, count, sizeof *q->edge, compare_edges);
    for (size_t i = 0; i < count; i++) {
        if (kept && compare_edges(q->edge[kept - 1], q->edge[i]) == 0) continue;
        memmove(q->edge[kept++], q->edge[i], sizeof *q->edge);
    }
    q->edges = kept;
}
static size_t edge_between(const mesh *q, uint32_t a, uint32_t b) {
    const uint32_t key[2] = { a < b ? a : b, a < b ? b : a };
    const uint32_t (*found)[2] = bsearch(key, q->edge, q->edges, sizeof key, compare_edges);
    return (size_t)(found - (const uint32_t (*)[2])q->edge);
}
/* Dual areas and dual faces of the median dual: from the middle of an edge to the centre of the cell. */
static void dual(mesh *q) {
    for (size_t c = 0; c < q->cells; c++) {
        const uint32_t *corner = q->cell[c];
        double centre[2] = { 0, 0 };
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 2; k++) centre[k] += q->X[corner[i]][k] / 4;
        for (int i = 0; i < 4; i++) {
            const uint32_t a = corner[i], b = corner[(i + 1) % 4];
            const double *A = q->X[a], *B = q->X[b], middle[2] = { (A[0] + B[0]) / 2, (A[1] + B[1]) / 2 };
            const double along[2] = { centre[0] - middle[0], centre[1] - middle[1] };
            const size_t e = edge_between(q, a, b);
            /* both triangles beside this face have the same area */
            const double triangle = 0.5 * fabs((B[0] - A[0]) / 2 * along[1] - (B[1] - A[1]) / 2 * along[0]);
            double normal[2] = { along[1], -along[0] };
            if (normal[0] * (B[0] - A[0]) + normal[1] * (B[1] - A[1]) < 0) { normal[0] *= -1; normal[1] *= -1; }
            q->area[a] += triangle;
            q->area[b] += triangle;
            for (int k = 0; k < 2; k++) q->S[e][k] += q->edge[e][0] == a ? normal[k] : -normal[k];
        }
    }
}

/* ---- exactness for linear fields --------------------------------------------------------------------------------- */

/* dC of a pair. */
static double change_of(const mesh *q, size_t e, const double *x) {
    const uint32_t a = q->edge[e][0], b = q->edge[e][1];
    return x[3 * a] - x[3 * b] + ((x[3 * a + 1] + x[3 * b + 1]) * (q->X[b][0] - q->X[a][0]) +
                                  (x[3 * a + 2] + x[3 * b + 2]) * (q->X[b][1] - q->X[a][1])) / 2;
}
/* y = A x for one component: x and y hold l and m[2] of each node; slack: s (B_i/|B|)^2 of each node. */
static void apply(const mesh *q, const double *slack, const double *x, double *y) {
    for (size_t i = 0; i < 3 * q->nodes; i++) y[i] = i % 3 ? 0 : slack[i / 3] * x[i];
    for (size_t e = 0; e < q->edges; e++) {
        const uint32_t a = q->edge[e][0], b = q->edge[e][1];
        const double change = change_of(q, e, x);
        y[3 * a] += change;
        y[3 * b] -= change;
        for (uint32_t k = 0; k < 2; k++) {
            const double d = q->X[b][k] - q->X[a][k];
            y[3 * a + 1 + k] += change * d / 2;
            y[3 * b + 1 + k] += change * d / 2;
        }
    }
}
static double product(size_t n, const double *a, const double *b) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}
/* Conjugate gradients for A x = r, from x = 0. r, p and y are used up. */
static void solve(const mesh *q, const double *slack, double *x, double *r, double *p, double *y) {
    const size_t n = 3 * q->nodes;
    double rr = product(n, r, r);
    const double enough = 1e-26 * rr;
    memset(x, 0, n * sizeof *x);
    memcpy(p, r, n * sizeof *p);
    for (int round = 0; round < 20000 && rr > enough; round++)  {
        apply(q, slack, p, y);
        const double step = rr / product(n, p, y), before = rr;
        for (size_t i = 0; i < n; i++) { x[i] += step * p[i]; r[i] -= step * y[i]; }
        rr = product(n, r, r);
        for (size_t i = 0; i < n; i++) p[i] = r[i] + rr / before * p[i];
    }
}
/* What is missing to V I in row i of sum_b C_ab (x) d_ab / 2, into r (3 a node, the first 0). */
static void defect(const mesh *q, int i, double *r) {
    for (size_t a = 0; a < q->nodes; a++) {
        r[3 * a] = 0;
        for (int k = 0; k < 2; k++) r[3 * a + 1 + (size_t)k] = i == k ? q->area[a] : 0;
    }
    for (size_t e = 0; e < q->edges; e++)
        for (int k = 0; k < 2; k++) {
            const uint32_t a = q->edge[e][0], b = q->edge[e][1];
            const double part = q->S[e][i] * (q->X[b][k] - q->X[a][k]) / 2;
            r[3 * a + 1 + (uint32_t)k] -= part;
            r[3 * b + 1 + (uint32_t)k] -= part;
        }
}
static void boundary_slack(const mesh *q, int i, double (*B)[2], double *slack) {
    memset(B, 0, q->nodes * sizeof *B);
    for (size_t e = 0; e < q->edges; e++)
        for (int k = 0; k < 2; k++) {
            B[q->edge[e][0]][k] -= q->S[e][k];
            B[q->edge[e][1]][k] += q->S[e][k];
        }
    for (size_t a = 0; a < q->nodes; a++) {
        const double length = hypot(B[a][0], B[a][1]);
        slack[a] = length > 1e-9 * sqrt(q->area[a]) ? 0.1 * pow(B[a][i] / length, 2) : 0;
    }
}
static int make_exact(mesh *q) {
    const size_t n = 3 * q->nodes;
    double *memory = malloc((4 * n + q->nodes) * sizeof *memory), *x = memory, *r = x + n, *p = r + n, *y = p + n;
    double (*B)[2] = malloc(q->nodes * sizeof *B), *slack = y + n;
    for (int i = 0; memory && B && i < 2; i++) {
        boundary_slack(q, i, B, slack);
        defect(q, i, r);
        solve(q, slack, x, r, p, y);
        for (size_t e = 0; e < q->edges; e++) q->S[e][i] += change_of(q, e, x);
    }
    const int bad = !memory || !B;
    free(memory); free(B);
    return bad;
}

/* A quarter of a disc of radius n: the spacing is 1, and so l and m of the correction are of like size. */
static int mesh_make(mesh *q, int n) {
    memset(q, 0, sizeof *q);
    q->m = n > 2 ? (int)(0.6 * n + 0.5) : 1;
    q->rings = n - q->m > 0 ? n - q->m : 1;
    const size_t m = (size_t)q->m, k = (size_t)q->rings, cells = m * m + 2 * m * k;
    const size_t most = (m + 1) * (m + 1) + 2 * (m + 1) * (k + 1);
    q->grid[0] = malloc((m + 1) * (m + 1) * sizeof *q->grid[0]);
    for (int i = 1; i < 3; i++) q->grid[i] = malloc((m + 1) * (k + 1) * sizeof *q->grid[i]);
    q->X = calloc(most, sizeof *q->X);
    q->area = calloc(most, sizeof *q->area);
    q->cell = calloc(cells, sizeof *q->cell);
    q->edge = calloc(6 * cells, sizeof *q->edge);
    q->S = calloc(6 * cells, sizeof *q->S);
    if (!q->grid[0] || !q->grid[1] || !q->grid[2] || !q->X || !q->area || !q->cell || !q->edge || !q->S) return 1;
    number_nodes(q);
    add_cells(q, q->grid[0], m, m);
    add_cells(q, q->grid[1], m, k);
    add_cells(q, q->grid[2], m, k);
    find_edges(q);
    place_nodes(q, n);
    smooth_nodes(q, n);
    dual(q);
    return make_exact(q);
}
static void mesh_scale(mesh *q, double factor) {
    for (size_t a = 0; a < q->nodes; a++) {
        q->area[a] *= factor * factor;
        for (int k = 0; k < 2; k++) q->X[a][k] *= factor;
    }
    for (size_t e = 0; e < q->edges; e++)
        for (int k = 0; k < 2; k++) q->S[e][k] *= factor;
}

/* ---- the bar ----------------------------------------------------------------------------------------------------- */

typedef struct bar_arrays {
    tlsph_real *positions, *volumes, *weights, *vectors;
    uint32_t *neighbours, *cells;
    size_t *first;
} bar_arrays;

static void *allocate(void *user, size_t size) { (void)user; return malloc(size); }
static void release(void *user, void *memory, size_t size) { (void)user; (void)size; free(memory); }

/* One block for all arrays, so that tlsph_cloud_destroy gives it back. */
static int take(tlsph_cloud *cloud, bar_arrays *out, size_t count, size_t pairs, size_t cells) {
    const size_t reals = 5 * count + 3 * pairs;
    const size_t size = (count + 1) * sizeof *out->first + reals * sizeof(tlsph_real) +
                        (pairs + 8 * cells) * sizeof(uint32_t);
    cloud->allocator.allocate = allocate;
    cloud->allocator.release = release;
    cloud->memory_size = size;
    cloud->memory = calloc(1, size);
    if (!cloud->memory) return 1;
    out->first = cloud->memory;
    out->positions = (tlsph_real *)(void *)(out->first + count + 1);
    out->volumes = out->positions + 3 * count;
    out->weights = out->volumes + count;
    out->vectors = out->weights + count;
    out->neighbours = (uint32_t *)(void *)(out->vectors + 3 * pairs);
    out->cells = out->neighbours + pairs;
    return 0;
}
static void add_pair(bar_arrays *bar, size_t *at, size_t b, double x, double y, double z) {
    bar->neighbours[*at] = (uint32_t)b;
    bar->vectors[3 * *at] = (tlsph_real)x;
    bar->vectors[3 * *at + 1] = (tlsph_real)y;
    bar->vectors[3 * *at + 2] = (tlsph_real)z;
    ++*at;
}
/* Neighbours of node a in layer y: those of the plane, each dual edge as high as the layer, then above and below. */
static void add_pairs(const mesh *q, bar_arrays *bar, size_t a, size_t layer, size_t layers, double height,
                      size_t *at) {
    const double share = layer == 0 || layer == layers ? height / 2 : height;
    for (size_t e = 0; e < q->edges; e++)
        for (int end = 0; end < 2; end++)
            if (q->edge[e][end] == a)
                add_pair(bar, at, layer * q->nodes + q->edge[e][1 - end], (end ? -share : share) * q->S[e][0], 0,
                         (end ? -share : share) * q->S[e][1]);
    if (layer > 0) add_pair(bar, at, (layer - 1) * q->nodes + a, 0, -q->area[a], 0);
    if (layer < layers) add_pair(bar, at, (layer + 1) * q->nodes + a, 0, q->area[a], 0);
}
static void fill_bar(const mesh *q, double length, size_t layers, bar_arrays *bar) {
    const double height = length / (double)layers;
    size_t at = 0;
    for (size_t layer = 0; layer <= layers; layer++)
        for (size_t a = 0; a < q->nodes; a++) {
            const size_t i = layer * q->nodes + a;
            const double share = layer == 0 || layer == layers ? height / 2 : height;
            bar->positions[3 * i] = (tlsph_real)q->X[a][0];
            bar->positions[3 * i + 1] = (tlsph_real)(height * (double)layer);
            bar->positions[3 * i + 2] = (tlsph_real)q->X[a][1];
            bar->volumes[i] = bar->weights[i] = (tlsph_real)(share * q->area[a]);
            bar->first[i] = at;
            add_pairs(q, bar, a, layer, layers, height, &at);
        }
    bar->first[(layers + 1) * q->nodes] = at;
    for (size_t layer = 0; layer < layers; layer++)
        for (size_t c = 0; c < q->cells; c++)
            for (size_t k = 0; k < 8; k++) { /* x fastest, then y, then z: the quadrilateral turns from x to z */
                static const int corner[4] = { 0, 1, 3, 2 };
                const uint32_t node = q->cell[c][corner[(k & 1) + (k >> 2 & 1) * 2]];
                bar->cells[8 * (layer * q->cells + c) + k] = (uint32_t)((layer + (k >> 1 & 1)) * q->nodes + node);
            }
}

tlsph_result scene_round_bar(double radius, double length, int n, tlsph_cloud *out) {
    const size_t layers = (size_t)fmax(1, length / radius * n + 0.5);
    mesh q;
    bar_arrays bar;
    tlsph_result result = TLSPH_ERROR_MEMORY;
    memset(out, 0, sizeof *out);
    if (mesh_make(&q, n) == 0) {
        mesh_scale(&q, radius / n);
        const size_t count = q.nodes * (layers + 1), pairs = 2 * q.edges * (layers + 1) + 2 * q.nodes * layers;
        if (take(out, &bar, count, pairs, q.cells * layers) == 0) {
            tlsph_particles *p = &out->particles;
            fill_bar(&q, length, layers, &bar);
            p->count = count;
            p->positions = bar.positions; p->volumes = bar.volumes; p->weights = bar.weights;
            p->first = bar.first; p->neighbours = bar.neighbours; p->pair_vectors = bar.vectors;
            p->cells = bar.cells; p->cell_count = q.cells * layers;
            out->cell_size[0] = out->cell_size[2] = (tlsph_real)(radius / n);
            out->cell_size[1] = (tlsph_real)(length / (double)layers);
            result = TLSPH_OK;
        }
    }
    mesh_free(&q);
    return result;
}
