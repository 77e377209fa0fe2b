/* oscillation.c - how much of a field alternates from particle to particle: the measure of checkerboards. */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* One particle with its neighbours: offsets X_b - X_a and values. */
typedef struct star {
    double (*offset)[3], *value;
    size_t count;
    int dimension;
    double centre; /* value of the particle itself */
} star;

/* Moments of a sample. */
typedef struct moments { double count, sum, squares; } moments;

static void moments_add(moments *m, double x) { m->count++; m->sum += x; m->squares += x * x; }
static double deviation(const moments *m) {
    const double mean = m->count > 0 ? m->sum / m->count : 0;
    return m->count > 0 ? sqrt(fmax(0, m->squares / m->count - mean * mean)) : 0;
}

/* Is d along the axis? Lattices have such pairs to round-off, clouds none. */
static int along(const double d[3], int axis) {
    double across = 0;
    for (int k = 0; k < 3; k++) if (k != axis) across = fmax(across, fabs(d[k]));
    return across <= 1e-5 * fabs(d[axis]);
}

/* Value less the one interpolated between the next particles on both sides along the axis. 1 where both exist. */
static int line_difference(const star *s, int axis, double *out) {
    double reach[2] = { HUGE_VAL, HUGE_VAL }, f[2] = { 0, 0 };
    for (size_t i = 0; i < s->count; i++) {
        const double d = s->offset[i][axis];
        const int side = d > 0;
        if (!along(s->offset[i], axis) || fabs(d) >= reach[side]) continue;
        reach[side] = fabs(d);
        f[side] = s->value[i];
    }
    if (reach[0] >= HUGE_VAL || reach[1] >= HUGE_VAL) return 0;
    *out = s->centre - (f[0] * reach[1] + f[1] * reach[0]) / (reach[0] + reach[1]);
    return 1;
}

/* Solves A y = (1, 0, ...) by elimination with pivots; 0 where A is singular. */
static int solve_first(double A[4][4], int n, double y[4]) {
    double b[4] = { 1, 0, 0, 0 };
    for (int i = 0; i < n; i++) {
        int pivot = i;
        for (int r = i + 1; r < n; r++) if (fabs(A[r][i]) > fabs(A[pivot][i])) pivot = r;
        if (fabs(A[pivot][i]) < 1e-9) return 0;
        for (int c = 0; c < n; c++) { const double t = A[i][c]; A[i][c] = A[pivot][c]; A[pivot][c] = t; }
        { const double t = b[i]; b[i] = b[pivot]; b[pivot] = t; }
        for (int r = i + 1; r < n; r++) {
            const double m = A[r][i] / A[i][i];
            for (int c = i; c < n; c++) A[r][c] -= m * A[i][c];
            b[r] -= m * b[i];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        y[i] = b[i];
        for (int c = i + 1; c < n; c++) y[i] -= A[i][c] * y[c];
        y[i] /= A[i][i];
    }
    return 1;
}

/* The same on a cloud: value less that of the linear function that fits the neighbours best (weights 1/distance^2), which
   is sum_i c_i f_i with sum c_i = 1. 0 where the neighbours are on one side: sum |c_i| > 1 means extrapolation. */
static int fit_difference(const star *s, double *out) {
    double A[4][4] = { { 0 } }, y[4] = { 0 }, fitted = 0, size = 0, scale = 0;
    const int n = s->dimension + 1;
    for (size_t i = 0; i < s->count; i++) for (int k = 0; k < 3; k++) scale += s->offset[i][k] * s->offset[i][k];
    scale = sqrt(scale / (double)(s->count ? s->count : 1));
    for (int pass = 0; pass < 2; pass++) {
        if (pass == 1 && !solve_first(A, n, y)) return 0;
        for (size_t i = 0; i < s->count; i++) {
            const double *d = s->offset[i];
            const double row[4] = { 1, d[0] / scale, d[1] / scale, d[2] / scale };
            const double w = 1 / (row[1] * row[1] + row[2] * row[2] + row[3] * row[3]);
            double c = 0;
            for (int r = 0; r < n; r++) {
                if (pass == 0) for (int k = 0; k < n; k++) A[r][k] += w * row[r] * row[k] / (double)s->count;
                c += w * row[r] * y[r] / (double)s->count;
            }
            fitted += c * s->value[i];
            size += fabs(c);
        }
    }
    *out = s->centre - fitted;
    return size <= 1.2;
}

static void gather(const tlsph_operator *view, const tlsph_real *X, const tlsph_real *values, size_t a, star *s) {
    const size_t here = view->host[a];
    s->count = 0;
    s->centre = (double)values[here];
    for (size_t i = view->first[a]; i < view->first[a + 1]; i++, s->count++) {
        const size_t there = view->host[view->neighbours[i]];
        for (size_t k = 0; k < 3; k++)
            s->offset[s->count][k] = k < (size_t)view->dimension ? (double)X[3 * there + k] - (double)X[3 * here + k] : 0;
        s->value[s->count] = (double)values[there];
    }
}

static double measure(const tlsph_operator *view, const tlsph_real *X, const tlsph_real *values, star *s) {
    moments differences = { 0, 0, 0 }, smoothed = { 0, 0, 0 };
    for (size_t a = 0; a < view->count; a++) {
        double sum = 0, difference;
        int lines = 0;
        gather(view, X, values, a, s);
        for (int axis = 0; axis < view->dimension; axis++)
            if (line_difference(s, axis, &difference)) {
                moments_add(&differences, difference);
                sum += difference;
                lines++;
            }
        if (!lines && fit_difference(s, &difference)) {
            moments_add(&differences, difference);
            sum = difference;
            lines = 1;
        }
        if (lines) moments_add(&smoothed, s->centre - sum / lines / 2);
    }
    if (!(differences.squares > 0)) return differences.squares >= 0 ? 0 : HUGE_VAL;
    return deviation(&smoothed) > 0 ? deviation(&differences) / deviation(&smoothed) : HUGE_VAL;
}

double scene_oscillation_of(const tlsph_solver *solver, const tlsph_real *values) {
    tlsph_real *X = scene_read(solver, TLSPH_FIELD_REFERENCE_POSITION);
    tlsph_operator view;
    size_t most = 1;
    double out = HUGE_VAL;
    star s;
    memset(&s, 0, sizeof s);
    tlsph_operator_view(solver, &view);
    for (size_t a = 0; a < view.count; a++)
        if (view.first[a + 1] - view.first[a] > most) most = view.first[a + 1] - view.first[a];
    s.dimension = view.dimension;
    s.offset = malloc(most * sizeof *s.offset);
    s.value = malloc(most * sizeof *s.value);
    if (X && s.offset && s.value) out = measure(&view, X, values, &s);
    free(X); free(s.offset); free(s.value);
    return out;
}

double scene_oscillation(const tlsph_solver *solver, tlsph_field field) {
    tlsph_real *values = tlsph_field_components(field) == 1 ? scene_read(solver, field) : NULL;
    const double out = values ? scene_oscillation_of(solver, values) : HUGE_VAL;
    free(values);
    return out;
}

/* The next particle on both sides along the axis, or the particle itself where there is none; solver's numbers. */
static void find_line(const tlsph_operator *view, const tlsph_real *X, int axis, size_t a, size_t next[2]) {
    double reach[2] = { HUGE_VAL, HUGE_VAL };
    next[0] = next[1] = a;
    for (size_t i = view->first[a]; i < view->first[a + 1]; i++) {
        const tlsph_real *from = X + 3 * (size_t)view->host[a], *to = X + 3 * (size_t)view->host[view->neighbours[i]];
        const double d[3] = { (double)(to[0] - from[0]), (double)(to[1] - from[1]), (double)(to[2] - from[2]) };
        const int side = d[axis] > 0;
        if (!along(d, axis) || fabs(d[axis]) >= reach[side]) continue;
        reach[side] = fabs(d[axis]);
        next[side] = view->neighbours[i];
    }
}

double scene_alternation(const scene_body *body, int axis) {
    tlsph_real *X = scene_read(body->solver, TLSPH_FIELD_REFERENCE_POSITION), *x = scene_read(body->solver, TLSPH_FIELD_POSITION);
    tlsph_operator view;
    double squares = 0, count = 0;
    tlsph_operator_view(body->solver, &view);
    size_t (*next)[2] = malloc(view.count * sizeof *next);
    for (size_t a = 0; X && next && a < view.count; a++) find_line(&view, X, axis, a, next[a]);
    for (size_t a = 0; X && x && next && a < view.count; a++) {
        const size_t down = next[a][0], up = next[a][1], far_down = next[down][0], far_up = next[up][1];
        if (down == a || up == a || far_down == down || far_up == up) continue;
        const size_t line[5] = { far_down, down, a, up, far_up };
        for (size_t i = 0; i < 3; i++) {
            static const double weights[5] = { 1, -4, 6, -4, 1 };
            double sum = 0;
            for (int k = 0; k < 5; k++) sum += weights[k] / 16 * (double)x[3 * (size_t)view.host[line[k]] + i];
            squares += sum * sum;
        }
        count++;
    }
    free(X); free(x); free(next);
    return count > 0 ? sqrt(squares / count) / (double)body->cloud.particles.spacing : 0;
}
