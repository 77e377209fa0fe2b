/*
danilovskaya_exact.c - exact solutions of the thermo-elastic half space by numerical inversion of the Laplace transform

  In the variables of paper 003 (11), with the temperature scaled by the applied one, the linear equations are
      sigma = u_y - theta,   u_tt = sigma_y,   theta_t + delta u_yt = theta_yy,   sigma(0) = 0, all zero at t = 0.
  Their transforms are sums of exp(-lambda y) over the two roots with positive real part of
      lambda^4 - lambda^2 (p^2 + p (1 + delta)) + p^3 = 0:
      theta = A ((p^2 - l1^2) e1 - (p^2 - l2^2) e2),   u = A (l1 e1 - l2 e2),   sigma = -A p^2 (e1 - e2),
  where A follows from the temperature or the heat flux at y = 0. l1 ~ sqrt p diffuses, l2 ~ p + delta/2 is the wave
  that runs with speed 1 and carries the front. Each part is inverted for itself: the wave part is zero before t = y and
  has its argument shifted by y exactly, so that the front stays a jump. The two parts have branch points at
  1 - delta +- 2 i sqrt(delta) that cancel in the sum only; the contour goes round them.
*/
#include "scenes.h"

#include <complex.h>
#include <math.h>

#define NODES 64 /* of the contour: more change nothing beyond 1e-11 */

typedef double complex number;

static number complex_of(double re, double im) { return re + im * (number)I; }

typedef struct roots { number l1, l2, excess1, excess2, shift, root; } roots; /* excess = p^2 - l^2, shift = l2 - p */

/* All differences are formed without cancellation, from l1^2 l2^2 = p^3 and l1^2 + l2^2 = p^2 + p (1 + delta). The cuts
   of `root` run from the branch points to the left, so that l1 and l2 keep their meaning on the contour. */
static roots find_roots(double delta, number p) {
    const double centre = 1 - delta, height = 2 * sqrt(delta);
    const number root = csqrt(p - complex_of(centre, height)) * csqrt(p - complex_of(centre, -height));
    const number ratio = (p + 1 + delta + root) / (2 * p), factor = csqrt(ratio); /* l2^2 / p^2 */
    roots r;
    r.root = root; /* l2^2 - l1^2 = p root */
    r.l1 = csqrt(p) / factor;
    r.l2 = p * factor;
    r.excess1 = p * (p - 1 / ratio);
    r.excess2 = p * (1 / ratio - 1 - delta);
    r.shift = -r.excess2 / (r.l2 + p);
    return r;
}

typedef struct source { danilovskaya_problem problem; double delta, transfer; } source;

static number amplitude(const source *s, const roots *r, number p) {
    if (s->problem == DANILOVSKAYA_SECOND) /* -theta_y + m theta = m/p at y = 0 */
        return s->transfer / p / (r->excess1 * (r->l1 + s->transfer) - r->excess2 * (r->l2 + s->transfer));
    if (s->problem == STERNBERG_CHAKRAVORTY) return 1 / (p * p * p * r->root); /* theta = t at y = 0 */
    return 1 / (p * p * r->root);                                             /* theta = 1 at y = 0 */
}

/* Adds weight times the transform of the diffusive part at p, or of the wave part without its delay. */
static void add_transform(const source *s, int wave, double y, number p, number weight, danilovskaya_state *sum) {
    const roots r = find_roots(s->delta, p);
    const number e = weight * amplitude(s, &r, p) * (wave ? -cexp(-r.shift * y) : cexp(-r.l1 * y));
    sum->theta += creal(e * (wave ? r.excess2 : r.excess1));
    sum->u += creal(e * (wave ? r.l2 : r.l1));
    sum->sigma -= creal(e * p * p);
}

/* Talbot's contour p = r a (cot a + i), -pi < a < pi, trapezoidal. It crosses the axis at r; the branch point at the
   angle a0 lies on it when r = height/a0. */
static double contour_radius(double delta, double t) {
    const double height = 2 * sqrt(delta), angle = atan2(height, 1 - delta);
    const double branch = angle > 1e-6 ? height / angle : 1 - delta;
    return fmax(9 / t, 1.4 * branch);
}

static void add_inverse(const source *s, int wave, double y, double t, danilovskaya_state *sum) {
    const double r = contour_radius(s->delta, t);
    if (!(t > 0)) return;
    add_transform(s, wave, y, complex_of(r, 0), r * exp(r * t) / (2 * NODES), sum);
    for (int k = 1; k < NODES; k++) {
        const double a = SCENE_PI * k / NODES, cot = cos(a) / sin(a);
        const number p = r * a * complex_of(cot, 1), slope = complex_of(1, a + (a * cot - 1) * cot);
        add_transform(s, wave, y, p, r / NODES * cexp(p * t) * slope, sum);
    }
}

/* At the front itself the mean of both sides. */
static danilovskaya_state inverse(const source *s, double y, double t) {
    const double late = t - y, small = 1e-12 * (y + t);
    danilovskaya_state sum = { 0, 0, 0 };
    if (!(t > 0)) return sum;
    add_inverse(s, 0, y, t, &sum);
    if (late > small) {
        add_inverse(s, 1, y, late, &sum);
    } else if (late >= -small) {
        const danilovskaya_state before = sum;
        add_inverse(s, 1, y, 1e-11 * t, &sum);
        sum.theta = (sum.theta + before.theta) / 2;
        sum.u = (sum.u + before.u) / 2;
        sum.sigma = (sum.sigma + before.sigma) / 2;
    }
    return sum;
}

danilovskaya_state danilovskaya_exact(danilovskaya_problem problem, double delta, double y, double t) {
    const source s = { problem, delta, DANILOVSKAYA_TRANSFER };
    danilovskaya_state now = inverse(&s, y, t), before;
    if (problem != STERNBERG_CHAKRAVORTY) return now;
    before = inverse(&s, y, t - DANILOVSKAYA_RAMP); /* the ramp ends: (ramp now - ramp then) / its length */
    now.theta = (now.theta - before.theta) / DANILOVSKAYA_RAMP;
    now.u = (now.u - before.u) / DANILOVSKAYA_RAMP;
    now.sigma = (now.sigma - before.sigma) / DANILOVSKAYA_RAMP;
    return now;
}

/* Without inertia sigma = 0 and u_y = theta, so theta diffuses with 1/(1 + delta). */
danilovskaya_state danilovskaya_quasi_static(double delta, double y, double t) {
    const double reach = 2 * sqrt(t / (1 + delta)), x = y / reach;
    danilovskaya_state out = { 0, 0, 0 };
    if (!(t > 0)) return out;
    out.theta = erfc(x);
    out.u = -reach * (exp(-x * x) / sqrt(SCENE_PI) - x * erfc(x));
    return out;
}
