/*
gradient_study.c - derivatives of a function by kernels in one dimension: 002 section 4.1

The corrected kernel about x is c_0 + c_1 (x - X_j) times the cubic spline, with c such that constants (and, first order,
linear functions) are reproduced. Its derivative is taken from that of c, as in [BONDS] of tlsph.h for one dimension.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>

static void cubic_spline(double x, double h, double *W, double *slope) {
    const double s = fabs(x) / h, w = 2 / (3 * h), t = 2 - s;
    *W = s < 1 ? w * (1 - 1.5 * s * s + 0.75 * s * s * s) : s < 2 ? w * 0.25 * t * t * t : 0;
    *slope = (s < 1 ? w * (-3 * s + 2.25 * s * s) : s < 2 ? -w * 0.75 * t * t : 0) / h * (x < 0 ? -1 : 1);
}

/* First and one past the last particle within the support of particle i. */
static int first_near(int i, double spacing, double h) { const int j = i - (int)(2 * h / spacing) - 1; return j > 0 ? j : 0; }
static int end_near(int i, int n, double spacing, double h) { const int j = i + (int)(2 * h / spacing) + 2; return j < n ? j : n; }

/* Moments of the kernel at particle i and their derivatives: m[k] = sum w x^k W, x = X_i - X_j. */
static void moments(int i, int n, double spacing, double h, double m[3], double dm[3]) {
    for (int k = 0; k < 3; k++) m[k] = dm[k] = 0;
    for (int j = first_near(i, spacing, h); j < end_near(i, n, spacing, h); j++) {
        const double x = (i - j) * spacing;
        double W, slope;
        cubic_spline(x, h, &W, &slope);
        const double power[3] = { 1, x, x * x }, rate[3] = { 0, 1, 2 * x };
        for (int k = 0; k < 3; k++) {
            m[k] += spacing * power[k] * W;
            dm[k] += spacing * (power[k] * slope + rate[k] * W);
        }
    }
}

typedef struct correction { double alpha, beta, d_alpha, d_beta, L; } correction;

static correction correct(int first, int i, int n, double spacing, double h) {
    double m[3], dm[3], moment = 0;
    correction c = { 0, 0, 0, 0, 1 };
    moments(i, n, spacing, h, m, dm);
    if (first) { /* (002-51), (54) */
        c.beta = -m[1] / m[2];
        c.d_beta = -dm[1] / m[2] + m[1] * dm[2] / (m[2] * m[2]);
    }
    c.alpha = 1 / (m[0] + c.beta * m[1]);
    c.d_alpha = -c.alpha * c.alpha * (dm[0] + c.d_beta * m[1] + c.beta * dm[1]);
    for (int j = first_near(i, spacing, h); j < end_near(i, n, spacing, h) && !first; j++) { /* (002-12) */
        const double x = (i - j) * spacing;
        double W, slope;
        cubic_spline(x, h, &W, &slope);
        moment -= spacing * x * (c.alpha * slope + c.d_alpha * W);
    }
    if (!first) c.L = 1 / moment;
    return c;
}

static double derivative(gradient_form form, const gradient_field *f, int i, int n, double spacing, double h) {
    const int first = form != GRADIENT_BOND_ZEROTH;
    const correction c = correct(first, i, n, spacing, h);
    const double X = (i + 0.5) * spacing, value = f->value(X);
    double standard = 0, bonds = 0, self = 0, others = 0; /* the last two: weights of the kernel */
    for (int j = first_near(i, spacing, h); j < end_near(i, n, spacing, h); j++) {
        const double x = (i - j) * spacing, shape = 1 + c.beta * x;
        double W, slope;
        cubic_spline(x, h, &W, &slope);
        const double weight = spacing * c.alpha * shape * W;
        const double jump = f->value(X - x) - value;
        standard += spacing * c.L * jump *
                    (c.alpha * shape * slope + (c.d_alpha * shape + c.alpha * (c.d_beta * x + c.beta)) * W);
        if (j == i) self = weight;
        else {
            bonds -= weight * jump / x;
            others += weight;
        }
    }
    if (form == GRADIENT_OPERATOR) return (1 - others) * standard + bonds; /* A G + w n/r with A = 1 - sum w */
    return form == GRADIENT_STANDARD ? standard : form == GRADIENT_BOND_ONLY ? bonds : bonds + self * standard;
}

void gradient_study_derivative(gradient_form form, const gradient_field *field, double length, int n, double radius,
                               double *out) {
    for (int i = 0; i < n; i++) out[i] = derivative(form, field, i, n, length / n, radius / 2);
}

double gradient_study_error(gradient_form form, const gradient_field *field, double length, int n, double radius) {
    double *slope = malloc((size_t)n * sizeof *slope), sum = 0;
    if (!slope) return HUGE_VAL;
    gradient_study_derivative(form, field, length, n, radius, slope);
    for (int i = 0; i < n; i++) sum += pow(slope[i] - field->slope((i + 0.5) * length / n), 2);
    free(slope);
    return sqrt(sum / n);
}
