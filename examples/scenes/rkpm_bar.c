/*
rkpm_bar.c - thermo-elastic bar by the reproducing-kernel particle method with nodal integration, implicit (paper 003)

  u = sum Psi_I u_I and theta = sum Psi_I theta_I in the weak form (14), in the units of the half space:
      M u'' + Kuu u + Kut theta = F,      Ctu u' + Ctt theta' + Ktt theta = Q,
      Kuu = sum_L W Bc^T B + M2 D^T D,    Kut = -sum_L W Bc^T Psi,    Ktt like Kuu,
      Ctu = + delta sum_L W Psi^T B,      Ctt, M = sum_L W Psi^T Psi
  with the sums over nodes L or Gauss points, B the slopes, D the derivatives of the implicit gradients (28) for the
  stabilisation (34, 44) and Bc the test functions' slopes, corrected (63 to 67) in the VC methods. Ctu has the slope of
  the TRIAL function: with the transpose of Kut, as (76b) prints it, coupling is not that of the strong form. Values at
  the ends are set by the transformation of the boundary rows: test functions are combined so that they vanish there.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const rkpm_names[RKPM_METHODS] = { "DNI", "VC-DNI", "NSNI", "VC-NSNI", "GI" };

#define REACH 24 /* most shape functions at one place */
#define GAUSS 5

/* Shape functions at one place: those of the nodes first, ..., first + count - 1. */
typedef struct point {
    double y, weight, second;
    size_t first, count;
    double psi[REACH], slope[REACH], curve[REACH], test[REACH];
} point;

/* A matrix between nodes, or between unknowns, by diagonals: (i, j) at a[i width + j - i + reach]. */
typedef struct band { size_t n, reach, width; double *a; size_t *pivot; } band;

typedef struct boundary { const point *at; size_t node; int field; double value; } boundary; /* field 0: u, 1: theta */

struct rkpm_bar {
    rkpm_parameters p;
    double modulus, beta;     /* 1 and 1 in the units of the half space */
    size_t nodes, points, span;
    double *y, *radius;
    tlsph_real *X, *R;        /* the same for the library */
    point *node, *quadrature, ends[2];
    band M, Kuu, Kut, Ktt, Ctu, Ctt, system;
    boundary held[4];
    int held_count, steps, factored; /* factored: 1 + whether with Crank-Nicolson */
    double *u, *v, *acceleration, *theta, *right, time;
    danilovskaya_state *state;
};

/* ---- banded matrices --------------------------------------------------------------------------------------------- */

static int band_create(band *m, size_t n, size_t reach, int pivots) {
    m->n = n;
    m->reach = reach;
    m->width = (pivots ? 3 : 2) * reach + 1;
    m->a = calloc(n * m->width, sizeof *m->a);
    m->pivot = calloc(n, sizeof *m->pivot);
    return !m->a || !m->pivot;
}
static void band_destroy(band *m) { free(m->a); free(m->pivot); }
static double *band_at(const band *m, size_t i, size_t j) { return m->a + i * m->width + (j + m->reach - i); }

static void band_multiply_add(const band *m, double factor, const double *x, double *y) {
    for (size_t i = 0; i < m->n; i++) {
        const size_t low = i > m->reach ? i - m->reach : 0, high = i + m->reach < m->n ? i + m->reach : m->n - 1;
        for (size_t j = low; j <= high; j++) y[i] += factor * *band_at(m, i, j) * x[j];
    }
}

/* Gaussian elimination with row exchanges, which the non-symmetric and nearly singular matrices here need. */
static int band_factor(band *m) {
    for (size_t k = 0; k < m->n; k++) {
        const size_t low = k + m->reach < m->n ? k + m->reach : m->n - 1;
        const size_t right = k + 2 * m->reach < m->n ? k + 2 * m->reach : m->n - 1;
        size_t best = k;
        for (size_t i = k + 1; i <= low; i++)
            if (fabs(*band_at(m, i, k)) > fabs(*band_at(m, best, k))) best = i;
        m->pivot[k] = best;
        if (!(fabs(*band_at(m, best, k)) > 0)) return 1;
        for (size_t j = k; best != k && j <= right; j++) {
            const double swap = *band_at(m, k, j);
            *band_at(m, k, j) = *band_at(m, best, j);
            *band_at(m, best, j) = swap;
        }
        for (size_t i = k + 1; i <= low; i++) {
            const double factor = *band_at(m, i, k) / *band_at(m, k, k);
            *band_at(m, i, k) = factor;
            for (size_t j = k + 1; factor != 0 && j <= right; j++) *band_at(m, i, j) -= factor * *band_at(m, k, j);
        }
    }
    return 0;
}
static void band_solve(const band *m, double *b) {
    for (size_t k = 0; k < m->n; k++) {
        const size_t low = k + m->reach < m->n ? k + m->reach : m->n - 1;
        const double swap = b[m->pivot[k]];
        b[m->pivot[k]] = b[k];
        b[k] = swap;
        for (size_t i = k + 1; i <= low; i++) b[i] -= *band_at(m, i, k) * b[k];
    }
    for (size_t i = m->n; i-- > 0;) {
        const size_t right = i + 2 * m->reach < m->n ? i + 2 * m->reach : m->n - 1;
        for (size_t j = i + 1; j <= right; j++) b[i] -= *band_at(m, i, j) * b[j];
        b[i] /= *band_at(m, i, i);
    }
}

/* ---- nodes and shape functions ----------------------------------------------------------------------------------- */

static double uniform(unsigned long *state) { /* in (-1, 1); the same on every machine */
    *state = (*state * 1664525ul + 1013904223ul) & 0xfffffffful;
    return ((double)(*state >> 8) + 0.5) / 8388608.0 - 1;
}

static void place_nodes(rkpm_bar *bar) {
    const double h = bar->p.length / (double)(bar->nodes - 1);
    unsigned long state = bar->p.seed * 2654435761ul + 12345ul;
    for (int i = 0; i < 8; i++) uniform(&state);
    for (size_t i = 0; i < bar->nodes; i++) {
        const int inner = i > 0 && i + 1 < bar->nodes;
        bar->y[i] = h * ((double)i + (inner ? bar->p.jitter * uniform(&state) : 0));
        bar->X[3 * i] = (tlsph_real)bar->y[i];
    }
    for (size_t i = 0; i < bar->nodes; i++) {
        const double left = i ? bar->y[i] - bar->y[i - 1] : 0;
        const double right = i + 1 < bar->nodes ? bar->y[i + 1] - bar->y[i] : 0;
        bar->radius[i] = 2 * fmax(left, right);
        bar->R[i] = (tlsph_real)bar->radius[i];
    }
}

/* Shape functions at y. 0 on success. */
static int shape(const rkpm_bar *bar, double y, point *out) {
    tlsph_real value[REACH], gradient[3 * REACH], second[9 * REACH];
    const tlsph_real x[3] = { (tlsph_real)y, 0, 0 };
    const tlsph_shape_functions into = { value, gradient, NULL, second };
    tlsph_nodes nodes = { 1, 1, TLSPH_CUBIC_SPLINE, 0, NULL, NULL };
    size_t last = 0;
    memset(out, 0, sizeof *out);
    out->y = y;
    out->first = bar->nodes;
    for (size_t i = 0; i < bar->nodes; i++) {
        if (!(fabs(y - bar->y[i]) < bar->radius[i])) continue;
        if (i < out->first) out->first = i;
        last = i;
    }
    if (out->first > last || last - out->first + 1 > REACH) return 1;
    nodes.count = out->count = last - out->first + 1;
    nodes.positions = bar->X + 3 * out->first;
    nodes.radii = bar->R + out->first;
    if (tlsph_reproduce(&nodes, x, &into, NULL) != TLSPH_OK) return 1;
    for (size_t i = 0; i < out->count; i++) {
        out->psi[i] = (double)value[i];
        out->slope[i] = out->test[i] = (double)gradient[3 * i];
        out->curve[i] = (double)second[9 * i];
    }
    return 0;
}

/* Nodal cells end half-way between nodes. */
static int make_nodal_points(rkpm_bar *bar) {
    for (size_t i = 0; i < bar->nodes; i++) {
        point *at = bar->node + i;
        const tlsph_real low[3] = { (tlsph_real)(i ? (bar->y[i - 1] + bar->y[i]) / 2 : bar->y[0]), 0, 0 };
        const double end = i + 1 < bar->nodes ? (bar->y[i] + bar->y[i + 1]) / 2 : bar->y[i];
        const tlsph_real high[3] = { (tlsph_real)end, 0, 0 };
        tlsph_real weight, second[3];
        if (shape(bar, bar->y[i], at)) return 1;
        tlsph_nodal_weight(1, low, high, bar->X + 3 * i, &weight, second);
        at->weight = (double)weight;
        at->second = bar->p.method == RKPM_NSNI || bar->p.method == RKPM_VC_NSNI ? (double)second[0] : 0;
        if (at->count > bar->span) bar->span = at->count;
    }
    bar->ends[0] = bar->node[0];
    bar->ends[1] = bar->node[bar->nodes - 1];
    return 0;
}
static int make_gauss_points(rkpm_bar *bar) {
    static const double x[GAUSS] = { -0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831,
                                     0.9061798459386640 };
    static const double w[GAUSS] = { 0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                                     0.2369268850561891 };
    for (size_t i = 0; i + 1 < bar->nodes; i++)
        for (size_t k = 0; k < GAUSS; k++) {
            const double half = (bar->y[i + 1] - bar->y[i]) / 2;
            point *at = bar->quadrature + GAUSS * i + k;
            if (shape(bar, bar->y[i] + half * (1 + x[k]), at)) return 1;
            at->weight = half * w[k];
            if (at->count > bar->span) bar->span = at->count;
        }
    return 0;
}

static double of_node(const point *at, const double *values, size_t node) {
    return node >= at->first && node < at->first + at->count ? values[node - at->first] : 0;
}

/* Corrects the test functions' slopes so that constant and linear fields are integrated exactly (63 to 67). */
static void correct_tests(rkpm_bar *bar) {
    for (size_t i = 0; i < bar->nodes; i++) {
        const double y = bar->y[i], L = bar->p.length;
        const double low = of_node(&bar->ends[0], bar->ends[0].psi, i);
        const double high = of_node(&bar->ends[1], bar->ends[1].psi, i);
        double A[3] = { 0, 0, 0 }, r[2] = { high - low, high * (L - y) + low * y }, zeta[2];
        for (size_t k = 0; k < bar->points; k++) {
            const point *at = bar->quadrature + k;
            const double z = at->y - y, w = at->weight, slope = of_node(at, at->slope, i);
            if (!(fabs(z) < bar->radius[i])) continue; /* R_I: where the kernel is positive */
            A[0] += w; A[1] += w * z; A[2] += w * z * z;
            r[0] -= w * slope;
            r[1] -= w * (slope * z + of_node(at, at->psi, i));
        }
        const double determinant = A[0] * A[2] - A[1] * A[1];
        zeta[0] = (A[2] * r[0] - A[1] * r[1]) / determinant;
        zeta[1] = (A[0] * r[1] - A[1] * r[0]) / determinant;
        for (size_t k = 0; k < bar->points; k++) {
            point *at = bar->quadrature + k;
            const double z = at->y - y;
            if (fabs(z) < bar->radius[i] && i >= at->first && i < at->first + at->count)
                at->test[i - at->first] += zeta[0] + zeta[1] * z;
        }
    }
}

/* ---- matrices ---------------------------------------------------------------------------------------------------- */

static void assemble_point(rkpm_bar *bar, const point *at) {
    for (size_t a = 0; a < at->count; a++)
        for (size_t b = 0; b < at->count; b++) {
            const size_t i = at->first + a, j = at->first + b;
            const double stiffness = at->weight * at->test[a] * at->slope[b] + at->second * at->curve[a] * at->curve[b];
            const double mass = at->weight * at->psi[a] * at->psi[b];
            *band_at(&bar->Kuu, i, j) += bar->modulus * stiffness;
            *band_at(&bar->Ktt, i, j) += stiffness;
            *band_at(&bar->Kut, i, j) -= bar->beta * at->weight * at->test[a] * at->psi[b];
            *band_at(&bar->Ctu, i, j) += bar->p.delta * at->weight * at->psi[a] * at->slope[b];
            *band_at(&bar->Ctt, i, j) += mass;
            *band_at(&bar->M, i, bar->p.lumped ? i : j) += mass;
        }
}
static void make_symmetric(band *m) {
    for (size_t i = 0; i < m->n; i++)
        for (size_t j = i + 1; j < m->n && j <= i + m->reach; j++)
            *band_at(m, i, j) = *band_at(m, j, i) = (*band_at(m, i, j) + *band_at(m, j, i)) / 2;
}
static void assemble(rkpm_bar *bar) {
    for (size_t k = 0; k < bar->points; k++) assemble_point(bar, bar->quadrature + k);
    if (bar->p.symmetric) make_symmetric(&bar->Kuu);
    if (bar->p.problem != DANILOVSKAYA_SECOND) return;
    for (size_t a = 0; a < bar->ends[0].count; a++) /* heat m (1 - theta) enters at y = 0 */
        for (size_t b = 0; b < bar->ends[0].count; b++)
            *band_at(&bar->Ktt, bar->ends[0].first + a, bar->ends[0].first + b) +=
                DANILOVSKAYA_TRANSFER * bar->ends[0].psi[a] * bar->ends[0].psi[b];
}

static void hold(rkpm_bar *bar, int end, int field, double value) {
    const boundary b = { &bar->ends[end], end ? bar->nodes - 1 : 0, field, value };
    bar->held[bar->held_count++] = b;
}

/* The rows near a held end lose their share of the boundary row, so that test functions vanish at the end; the boundary
   row itself becomes the condition sum Psi_J(end) d_J = value. `matrix` 0: the right-hand side alone. */
static void transform(rkpm_bar *bar, int matrix) {
    for (int k = 0; k < bar->held_count; k++) {
        const boundary *b = &bar->held[k];
        const size_t row = 2 * b->node + (size_t)b->field, reach = bar->system.reach;
        const size_t low = row > reach ? row - reach : 0;
        const size_t high = row + reach < bar->system.n ? row + reach : bar->system.n - 1;
        for (size_t a = 0; a < b->at->count; a++) {
            const size_t i = 2 * (b->at->first + a) + (size_t)b->field;
            const double share = b->at->psi[a] / of_node(b->at, b->at->psi, b->node);
            if (i == row) continue;
            bar->right[i] -= share * bar->right[row];
            for (size_t j = low; matrix && j <= high; j++)
                if (*band_at(&bar->system, row, j) != 0)
                    *band_at(&bar->system, i, j) -= share * *band_at(&bar->system, row, j);
        }
        bar->right[row] = b->value;
        for (size_t j = low; matrix && j <= high; j++) *band_at(&bar->system, row, j) = 0;
        for (size_t a = 0; matrix && a < b->at->count; a++)
            *band_at(&bar->system, row, 2 * (b->at->first + a) + (size_t)b->field) = b->at->psi[a];
    }
}

/* System of one step: inertia / dt^2 of u, theta implicit with `weight`; rate 0: statics. */
static int factor_system(rkpm_bar *bar, double inertia, double rate, double weight) {
    memset(bar->system.a, 0, bar->system.n * bar->system.width * sizeof *bar->system.a);
    for (size_t i = 0; i < bar->nodes; i++) {
        const size_t low = i > bar->span ? i - bar->span : 0;
        for (size_t j = low; j < bar->nodes && j <= i + bar->span; j++) {
            *band_at(&bar->system, 2 * i, 2 * j) = inertia * *band_at(&bar->M, i, j) + *band_at(&bar->Kuu, i, j);
            *band_at(&bar->system, 2 * i, 2 * j + 1) = *band_at(&bar->Kut, i, j);
            *band_at(&bar->system, 2 * i + 1, 2 * j) = rate * *band_at(&bar->Ctu, i, j);
            *band_at(&bar->system, 2 * i + 1, 2 * j + 1) =
                rate * *band_at(&bar->Ctt, i, j) + weight * *band_at(&bar->Ktt, i, j);
        }
    }
    transform(bar, 1);
    return band_factor(&bar->system);
}

/* ---- life of a bar ----------------------------------------------------------------------------------------------- */

void rkpm_default(rkpm_parameters *p) {
    memset(p, 0, sizeof *p);
    p->method = RKPM_VC_NSNI;
    p->newmark = 1;
    p->delta = 1;
    p->spacing = 0.02;
    p->length = 8;
    p->time_step = 0.01;
    p->seed = 1;
}

static int allocate(rkpm_bar *bar) {
    const size_t n = bar->nodes;
    bar->points = bar->p.method == RKPM_GAUSS ? GAUSS * (n - 1) : n;
    bar->y = calloc(2 * n, sizeof *bar->y);
    bar->X = calloc(4 * n, sizeof *bar->X);
    bar->node = calloc(n, sizeof *bar->node);
    bar->quadrature = bar->p.method == RKPM_GAUSS ? calloc(bar->points, sizeof *bar->quadrature) : bar->node;
    bar->u = calloc(6 * n, sizeof *bar->u);
    bar->state = calloc(n, sizeof *bar->state);
    if (!bar->y || !bar->X || !bar->node || !bar->quadrature || !bar->u || !bar->state) return 1;
    bar->radius = bar->y + n;
    bar->R = bar->X + 3 * n;
    bar->v = bar->u + n;
    bar->acceleration = bar->u + 2 * n;
    bar->theta = bar->u + 3 * n;
    bar->right = bar->u + 4 * n;
    return 0;
}
static int allocate_matrices(rkpm_bar *bar) {
    band *const all[6] = { &bar->M, &bar->Kuu, &bar->Kut, &bar->Ktt, &bar->Ctu, &bar->Ctt };
    int bad = band_create(&bar->system, 2 * bar->nodes, 2 * bar->span + 1, 1);
    for (int i = 0; i < 6; i++) bad |= band_create(all[i], bar->nodes, bar->span, 0);
    return bad;
}

static rkpm_bar *create(const rkpm_parameters *p, double modulus, double beta) {
    rkpm_bar *bar = calloc(1, sizeof *bar);
    if (!bar) return NULL;
    bar->p = *p;
    bar->modulus = modulus;
    bar->beta = beta;
    bar->nodes = (size_t)(p->length / p->spacing + 0.5) + 1;
    if (allocate(bar)) { rkpm_destroy(bar); return NULL; }
    place_nodes(bar);
    if (make_nodal_points(bar) || (p->method == RKPM_GAUSS && make_gauss_points(bar)) || allocate_matrices(bar)) {
        rkpm_destroy(bar);
        return NULL;
    }
    if (p->method == RKPM_VC_DNI || p->method == RKPM_VC_NSNI) correct_tests(bar);
    assemble(bar);
    return bar;
}

rkpm_bar *rkpm_create(const rkpm_parameters *p) {
    rkpm_bar *bar = create(p, 1, 1);
    if (!bar) return NULL;
    hold(bar, 1, 0, 0); /* u = 0 at the far end, which is insulated */
    if (p->problem != DANILOVSKAYA_SECOND) hold(bar, 0, 1, 1);
    return bar;
}

void rkpm_destroy(rkpm_bar *bar) {
    band *all[7];
    if (!bar) return;
    all[0] = &bar->M; all[1] = &bar->Kuu; all[2] = &bar->Kut; all[3] = &bar->Ktt; all[4] = &bar->Ctu;
    all[5] = &bar->Ctt; all[6] = &bar->system;
    for (int i = 0; i < 7; i++) band_destroy(all[i]);
    if (bar->quadrature != bar->node) free(bar->quadrature);
    free(bar->y); free(bar->X); free(bar->node); free(bar->u); free(bar->state);
    free(bar);
}

/* ---- time -------------------------------------------------------------------------------------------------------- */

#define STARTUP 4 /* fully implicit steps before Crank-Nicolson, which would carry the first jump along for ever */

/* Momentum's right-hand side: what M is applied to. */
static void inertia_of(const rkpm_bar *bar, double dt, double *out) {
    for (size_t i = 0; i < bar->nodes; i++)
        out[i] = bar->p.newmark ? (4 / dt * bar->u[i] + 4 * bar->v[i]) / dt + bar->acceleration[i]
                                : (bar->u[i] / dt + bar->v[i]) / dt;
}
static void right_hand_side(rkpm_bar *bar, double dt, double weight) {
    const size_t n = bar->nodes;
    double *momentum = calloc(3 * n, sizeof *momentum), *heat = momentum + n, *inertia = momentum + 2 * n;
    memset(bar->right, 0, 2 * n * sizeof *bar->right);
    if (!momentum) return;
    inertia_of(bar, dt, inertia);
    if (!bar->p.quasi_static) band_multiply_add(&bar->M, 1, inertia, momentum);
    band_multiply_add(&bar->Ctu, 1 / dt, bar->u, heat);
    band_multiply_add(&bar->Ctt, 1 / dt, bar->theta, heat);
    band_multiply_add(&bar->Ktt, weight - 1, bar->theta, heat);
    if (bar->p.problem == DANILOVSKAYA_SECOND)
        for (size_t a = 0; a < bar->ends[0].count; a++)
            heat[bar->ends[0].first + a] += DANILOVSKAYA_TRANSFER * bar->ends[0].psi[a];
    for (size_t i = 0; i < n; i++) {
        bar->right[2 * i] = momentum[i];
        bar->right[2 * i + 1] = heat[i];
    }
    free(momentum);
}

static double at_node(const point *at, const double *values, const double *coefficients) {
    double sum = 0;
    for (size_t a = 0; a < at->count; a++) sum += values[a] * coefficients[at->first + a];
    return sum;
}
static void evaluate(rkpm_bar *bar) {
    for (size_t i = 0; i < bar->nodes; i++) {
        const point *at = bar->node + i;
        bar->state[i].u = at_node(at, at->psi, bar->u);
        bar->state[i].theta = at_node(at, at->psi, bar->theta);
        bar->state[i].sigma = bar->modulus * at_node(at, at->slope, bar->u) - bar->beta * bar->state[i].theta;
    }
}
static void accept(rkpm_bar *bar, double dt) {
    for (size_t i = 0; i < bar->nodes; i++) {
        const double u = bar->right[2 * i], moved = u - bar->u[i], v = bar->v[i];
        bar->v[i] = bar->p.newmark ? 2 * moved / dt - v : moved / dt;
        bar->acceleration[i] = bar->p.newmark ? 4 * (moved / dt - v) / dt - bar->acceleration[i] : (bar->v[i] - v) / dt;
        bar->u[i] = u;
        bar->theta[i] = bar->right[2 * i + 1];
    }
    bar->time += dt;
    bar->steps++;
}

int rkpm_step(rkpm_bar *bar) {
    const double dt = bar->p.time_step, weight = bar->p.newmark && bar->steps >= STARTUP ? 0.5 : 1;
    const double inertia = bar->p.quasi_static ? 0 : (bar->p.newmark ? 4 : 1) / (dt * dt);
    const int wanted = weight < 1 ? 2 : 1;
    if (bar->factored != wanted && factor_system(bar, inertia, 1 / dt, weight)) return 1;
    bar->factored = wanted;
    for (int k = 0; k < bar->held_count; k++)
        if (bar->held[k].field == 1 && bar->p.problem == STERNBERG_CHAKRAVORTY)
            bar->held[k].value = fmin((bar->time + dt) / DANILOVSKAYA_RAMP, 1);
    right_hand_side(bar, dt, weight);
    transform(bar, 0);
    band_solve(&bar->system, bar->right);
    accept(bar, dt);
    evaluate(bar);
    return 0;
}

double rkpm_time(const rkpm_bar *bar) { return bar->time; }

size_t rkpm_read(const rkpm_bar *bar, const double **y, const danilovskaya_state **state) {
    *y = bar->y;
    *state = bar->state;
    return bar->nodes;
}

danilovskaya_errors rkpm_compare(const rkpm_bar *bar) {
    danilovskaya_errors out = { 0, 0, 0, 0 };
    double sum[3] = { 0, 0, 0 }, norm[3] = { 0, 0, 0 };
    for (size_t i = 0; i < bar->nodes; i++) {
        const double W = bar->node[i].weight, y = bar->y[i];
        const danilovskaya_state e = bar->p.quasi_static
            ? danilovskaya_quasi_static(bar->p.delta, y, bar->time)
            : danilovskaya_exact((danilovskaya_problem)bar->p.problem, bar->p.delta, y, bar->time);
        sum[0] += W * pow(bar->state[i].theta - e.theta, 2);
        sum[1] += W * pow(bar->state[i].u - e.u, 2);
        sum[2] += W * pow(bar->state[i].sigma - e.sigma, 2);
        norm[0] += W * e.theta * e.theta;
        norm[1] += W * e.u * e.u;
        norm[2] += W * e.sigma * e.sigma;
    }
    out.theta = sqrt(sum[0] / norm[0]);
    out.u = sqrt(sum[1] / norm[1]);
    out.sigma = norm[2] > 0 ? sqrt(sum[2] / norm[2]) : sqrt(sum[2]); /* the quasi-static stress is zero */
    return out;
}

/* ---- patch test and growth --------------------------------------------------------------------------------------- */

int rkpm_patch(rkpm_method method, int nodes, double jitter, unsigned long seed, double *error_u, double *error_theta) {
    const double young = 1, poisson = 0.3, beta = 0.05; /* 003 section 9.1 */
    rkpm_parameters p;
    rkpm_bar *bar;
    int bad;
    rkpm_default(&p);
    p.method = (int)method;
    p.length = 1;
    p.spacing = 1.0 / (nodes - 1);
    p.jitter = jitter;
    p.seed = seed;
    bar = create(&p, young / (1 - poisson * poisson), beta);
    if (!bar) return 1;
    for (int end = 0; end < 2; end++) {
        hold(bar, end, 0, end);
        hold(bar, end, 1, end);
    }
    for (size_t k = 0; k < bar->points; k++) /* body force b = beta */
        for (size_t a = 0; a < bar->quadrature[k].count; a++)
            bar->right[2 * (bar->quadrature[k].first + a)] +=
                beta * bar->quadrature[k].weight * bar->quadrature[k].psi[a];
    bad = factor_system(bar, 0, 0, 1); /* transforms the right-hand side too */
    *error_u = *error_theta = 0;
    if (!bad) {
        band_solve(&bar->system, bar->right);
        accept(bar, 1);
        evaluate(bar);
    }
    for (size_t i = 0; i < bar->nodes; i++) {
        *error_u += bar->node[i].weight * pow(bar->state[i].u - bar->y[i], 2);
        *error_theta += bar->node[i].weight * pow(bar->state[i].theta - bar->y[i], 2);
    }
    *error_u = sqrt(*error_u);
    *error_theta = sqrt(*error_theta);
    rkpm_destroy(bar);
    return bad;
}

static double amplitude(const rkpm_bar *bar) {
    double sum = 0;
    for (size_t i = 0; i < bar->nodes; i++) sum += bar->v[i] * bar->v[i];
    return sqrt(sum);
}

int rkpm_growth(const rkpm_parameters *parameters, double end, double *rate) {
    rkpm_parameters p = *parameters;
    unsigned long state = p.seed + 77;
    rkpm_bar *bar;
    double most[2] = { 0, 0 };
    int bad = 0;
    p.newmark = 1; /* keeps amplitudes where the matrices are symmetric */
    p.delta = 0;
    p.quasi_static = 0;
    bar = create(&p, 1, 0);
    if (!bar) return 1;
    hold(bar, 0, 0, 0);
    hold(bar, 1, 0, 0);
    hold(bar, 0, 1, 0);
    for (size_t i = 1; i + 1 < bar->nodes; i++) bar->v[i] = uniform(&state);
    while (!bad && bar->time < end) { /* largest amplitudes of the second and of the last quarter */
        bad = rkpm_step(bar);
        if (bar->time > 0.25 * end && bar->time <= 0.5 * end) most[0] = fmax(most[0], amplitude(bar));
        if (bar->time > 0.75 * end) most[1] = fmax(most[1], amplitude(bar));
    }
    *rate = log(most[1] / most[0]) / (0.5 * end);
    rkpm_destroy(bar);
    return bad;
}
