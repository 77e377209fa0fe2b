/*
textbook.c - a plain total Lagrangian loop as one would write it first, beside the header

  build/textbook [--n N] [--rounds N]

  Structures of particles, a list of neighbours each, the kernel's gradient stored a pair and corrected in the pair loop.
  Physics: isothermal neo-Hookean {p,F,H,J} with reconstruction and limiter in a free box, 6 and 26 neighbours, two-stage
  Runge-Kutta; without projection, and in motion too gentle for fronts, which it does not know. Both codes take the same
  steps from the same state and are compared there; their steps are timed in alternation by processor time, least of all.
*/
#include "machine.h"
#include "tlsph.h"

#include "examples/common/common.h"
#include "examples/scenes/scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef tlsph_real real;

typedef struct pair { uint32_t b; real gradient[3]; } pair; /* of W_b at X_a, 1/m^4 */
typedef struct particle {
    real X[3], V, w, L[9];                 /* place, mass volume, kernel weight, correction */
    real x[3], v[3], F[9], H[9], J;        /* state */
    real x0[3], v0[3], F0[9], H0[9], J0;   /* at the beginning of the step */
    real P[9], S, k, c_p, c_s;             /* stress, Sigma_J, drift ratio, wave speeds */
    real grad_v[9], grad_S[3];
    real force[3], D_J;                    /* N, m^3/s */
    pair *pairs;
    int count;
} particle;

typedef struct book {
    particle *p;
    pair *pairs;
    size_t n, pair_count;
    real rho, mu, kappa, b0, phi_c, a_J;
} book;

static real dot(const real *a, const real *b, int n) {
    real s = 0;
    for (int i = 0; i < n; i++) s += a[i] * b[i];
    return s;
}
static void multiply(const real *A, const real *x, real *y) {
    for (int i = 0; i < 3; i++) y[i] = dot(A + 3 * i, x, 3);
}

/* ---- construction ------------------------------------------------------------------------------------------------ */

static void invert(const real *A, real *out) {
    real cofactor[9], det;
    tlsph_cofactor(A, cofactor);
    det = tlsph_determinant(A);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[3 * i + j] = cofactor[3 * j + i] / det;
}

/* Neighbours by the lattice's own numbering would be faster to find; a plain search in a window of it does. */
static int book_create(book *k, const tlsph_cloud *cloud, int cells, const tlsph_desc *desc) {
    const tlsph_particles *c = &cloud->particles;
    const real h = desc->support / (real)cells;
    const long side = cells + 1;
    memset(k, 0, sizeof *k);
    k->n = c->count;
    k->p = calloc(k->n, sizeof *k->p);
    k->pairs = calloc(27 * k->n, sizeof *k->pairs);
    if (!k->p || !k->pairs) return 1;
    k->rho = desc->materials->density;
    k->mu = desc->materials->young / (2 * (1 + desc->materials->poisson));
    k->kappa = desc->materials->young / (3 * (1 - 2 * desc->materials->poisson));
    k->b0 = desc->drift_stiffness; k->phi_c = desc->drift_scale; k->a_J = desc->jump_share;
    for (size_t a = 0; a < k->n; a++) {
        particle *p = &k->p[a];
        real A[9] = { 0 };
        memcpy(p->X, c->positions + 3 * a, sizeof p->X);
        memcpy(p->x, p->X, sizeof p->x);
        for (int i = 0; i < 9; i += 4) p->F[i] = p->H[i] = 1;
        p->J = 1;
        p->V = c->volumes[a];
        p->w = c->weights[a];
        p->pairs = k->pairs + k->pair_count;
        for (long z = -1; z <= 1; z++)
            for (long y = -1; y <= 1; y++)
                for (long x = -1; x <= 1; x++) {
                    const long b = (long)a + x + side * (y + side * z);
                    real d[3], r, W, dW;
                    if (b < 0 || b >= (long)k->n || b == (long)a) continue;
                    for (int i = 0; i < 3; i++) d[i] = c->positions[3 * b + i] - p->X[i];
                    r = (real)sqrt((double)dot(d, d, 3));
                    if (r >= 2 * h) continue;
                    tlsph_kernel_evaluate(desc->kernel, 3, r, h, &W, &dW);
                    p->pairs[p->count].b = (uint32_t)b;
                    for (int i = 0; i < 3; i++) p->pairs[p->count].gradient[i] = -dW * d[i] / r;
                    for (int i = 0; i < 9; i++) A[i] += c->weights[b] * p->pairs[p->count].gradient[i / 3] * d[i % 3];
                    p->count++;
                }
        invert(A, p->L);
        k->pair_count += (size_t)p->count;
    }
    return 0;
}

static void book_destroy(book *k) { free(k->p); free(k->pairs); }

/* ---- right-hand side --------------------------------------------------------------------------------------------- */

static real largest(real trace, real square) { return trace / 3 + (real)sqrt(2.0 / 3 * fmax(0, (double)(square - trace * trace / 3))); }

/* P = a F + (c + p) H, p = kappa (J - 1), Sigma_J = p + W'; speeds: the header's bound of the acoustic tensor. */
static void stress(const book *k, particle *p) {
    const real d = tlsph_determinant(p->F), I1 = dot(p->F, p->F, 9), I2 = dot(p->H, p->H, 9), phi = p->J - d;
    const real a = k->mu * (real)pow((double)d, -2.0 / 3), pressure = k->kappa * (p->J - 1), c = -a * I1 / (3 * d) + pressure;
    const real s2 = phi * phi / (k->phi_c * k->phi_c);
    const real L1 = largest(I1, I1 * I1 - 2 * I2), LH = largest(I2, I2 * I2 - 2 * d * d * I1), ratio = (real)sqrt((double)(L1 * LH)) / d;
    const real along = a * (5 * I1 * LH / (9 * d * d) - (real)(1.0 / 3)) + k->kappa * LH, mixed = a * (ratio - 1 / ratio) / 3;
    for (int i = 0; i < 9; i++) p->P[i] = a * p->F[i] + c * p->H[i];
    p->S = pressure + k->b0 * k->mu * phi * (1 + s2);
    p->k = k->b0 * k->mu * (1 + 3 * s2) / k->kappa;
    p->c_p = (real)sqrt((double)((along + a + (real)sqrt((double)((along - a) * (along - a) + 4 * mixed * mixed))) / (2 * k->rho)));
    p->c_s = (real)sqrt((double)(a / k->rho));
}

/* C_ab = 2 V_a w_b L_a grad W (000-52) and C_ba. */
static void vectors(const particle *a, const particle *b, const pair *q, real *C_ab, real *C_ba) {
    multiply(a->L, q->gradient, C_ab);
    multiply(b->L, q->gradient, C_ba);
    for (int i = 0; i < 3; i++) { C_ab[i] *= 2 * a->V * b->w; C_ba[i] *= -2 * b->V * a->w; }
}

static void gradients(const book *k, particle *a) {
    memset(a->grad_v, 0, sizeof a->grad_v);
    memset(a->grad_S, 0, sizeof a->grad_S);
    for (int q = 0; q < a->count; q++) {
        const particle *b = &k->p[a->pairs[q].b];
        real G[3];
        multiply(a->L, a->pairs[q].gradient, G);
        for (int j = 0; j < 3; j++) {
            G[j] *= b->w;
            for (int i = 0; i < 3; i++) a->grad_v[3 * i + j] += (b->v[i] - a->v[i]) * G[j];
            a->grad_S[j] += (b->S - a->S) * G[j];
        }
    }
}

/* How much of a reconstructed jump the limiter lets through: product with the raw jump, square of itself. */
static real share(real product, real square) {
    return product > square ? 1 : product > 0 ? product / square : 0;
}

static void forces(const book *k, particle *a) {
    memset(a->force, 0, sizeof a->force);
    a->D_J = 0;
    for (int q = 0; q < a->count; q++) {
        const particle *b = &k->p[a->pairs[q].b];
        real C_ab[3], C_ba[3], C[3], c[3], n[3], d[3], Dv[3], Dr[3], t[3], PC_a[3], PC_b[3], c_a[3], c_b[3], Ga[3], Gb[3];
        real CC, cc, normal, raw, along, across, S_J, DS, slope;
        vectors(a, b, &a->pairs[q], C_ab, C_ba);
        multiply(a->P, C_ab, PC_a); multiply(b->P, C_ba, PC_b);
        multiply(a->H, C_ab, c_a);  multiply(b->H, C_ba, c_b);
        for (int i = 0; i < 3; i++) {
            a->force[i] += (PC_a[i] - PC_b[i]) / 2; /* (000-55) */
            C[i] = (C_ab[i] - C_ba[i]) / 2;
            c[i] = (c_a[i] - c_b[i]) / 2;
            d[i] = b->X[i] - a->X[i];
            Dv[i] = b->v[i] - a->v[i];
        }
        CC = (real)sqrt((double)dot(C, C, 3));
        cc = dot(c, c, 3);
        multiply(a->grad_v, d, Ga); multiply(b->grad_v, d, Gb);
        for (int i = 0; i < 3; i++) { n[i] = c[i] / (real)sqrt((double)cc); Dr[i] = Dv[i] - (Ga[i] + Gb[i]) / 2; }
        normal = dot(n, Dr, 3);
        raw = dot(n, Dv, 3);
        for (int i = 0; i < 3; i++) t[i] = Dr[i] - normal * n[i];
        along = (a->c_p + b->c_p) / 2 * share(normal * raw, normal * normal) * normal;
        across = (a->c_s + b->c_s) / 2 * share(dot(t, Dv, 3), dot(t, t, 3));
        for (int i = 0; i < 3; i++) a->force[i] += k->rho * CC / 2 * (along * n[i] + across * t[i]);
        DS = b->S - a->S;
        slope = DS - (dot(a->grad_S, d, 3) + dot(b->grad_S, d, 3)) / 2;
        S_J = k->a_J * cc / (2 * k->rho * (a->c_p + b->c_p) / 2 * CC * (1 + (a->k + b->k) / 2));
        a->D_J += S_J * share(DS * slope, slope * slope) * slope;
    }
}

static void right_hand_side(book *k) {
    for (size_t a = 0; a < k->n; a++) stress(k, &k->p[a]);
    for (size_t a = 0; a < k->n; a++) gradients(k, &k->p[a]);
    for (size_t a = 0; a < k->n; a++) forces(k, &k->p[a]);
}

/* u = B u0 + (1 - B) (u + dt L(u)): 0 and 1/2 make the two stages of (000-77). */
static void evolve(book *k, real B, real dt) {
    for (size_t a = 0; a < k->n; a++) {
        particle *p = &k->p[a];
        real H_rate[9];
        const real A = 1 - B, J_rate = dot(p->H, p->grad_v, 9) + p->D_J / p->V;
        tlsph_cross(p->F, p->grad_v, H_rate);
        for (int i = 0; i < 3; i++) {
            p->x[i] = B * p->x0[i] + A * (p->x[i] + dt * p->v[i]);
            p->v[i] = B * p->v0[i] + A * (p->v[i] + dt * p->force[i] / (p->V * k->rho));
        }
        for (int i = 0; i < 9; i++) {
            p->F[i] = B * p->F0[i] + A * (p->F[i] + dt * p->grad_v[i]);
            p->H[i] = B * p->H0[i] + A * (p->H[i] + dt * H_rate[i]);
        }
        p->J = B * p->J0 + A * (p->J + dt * J_rate);
    }
}

static void book_step(book *k, real dt) {
    for (size_t a = 0; a < k->n; a++) {
        particle *p = &k->p[a];
        memcpy(p->x0, p->x, sizeof p->x); memcpy(p->v0, p->v, sizeof p->v);
        memcpy(p->F0, p->F, sizeof p->F); memcpy(p->H0, p->H, sizeof p->H);
        p->J0 = p->J;
    }
    right_hand_side(k);
    evolve(k, 0, dt);
    right_hand_side(k);
    evolve(k, (real)0.5, dt);
}

/* ---- comparison -------------------------------------------------------------------------------------------------- */

/* Largest difference of a field to the header's, by its largest change since the start. */
static double difference(const book *k, const tlsph_solver *solver, tlsph_field field, size_t offset, int components) {
    tlsph_real *there = scene_read(solver, field);
    double worst = 0, size = 0;
    for (size_t a = 0; there && a < k->n; a++)
        for (int i = 0; i < components; i++) {
            const double here = (double)((const real *)((const char *)&k->p[a] + offset))[i], rest = components == 3 ? 0 : i % 4 == 0;
            worst = fmax(worst, fabs(here - (double)there[a * (size_t)components + (size_t)i]));
            size = fmax(size, fabs(here - rest));
        }
    free(there);
    return worst / size;
}

static void set_motion(book *k, tlsph_solver *solver, double speed) {
    tlsph_real *v = malloc(3 * k->n * sizeof *v);
    for (size_t i = 0; v && i < 3 * k->n; i++) {
        const real *X = k->p[i / 3].X;
        double value = speed;
        for (size_t j = 0; j < 3; j++)
            value *= j == i % 3 ? sin(SCENE_PI * (double)X[j]) : cos(SCENE_PI * (double)X[j]);
        v[i] = k->p[i / 3].v[i % 3] = (tlsph_real)value;
    }
    if (v) tlsph_write(solver, TLSPH_FIELD_VELOCITY, v);
    free(v);
}

static int run(int cells, int wide, int rounds) {
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_material material = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_cloud cloud;
    tlsph_solver *solver;
    tlsph_error error;
    book k;
    double plain = HUGE_VAL, header = HUGE_VAL, speed, p_wave, bulk, shear;
    char key[96];
    const int neighbours = wide ? 26 : 6;
    real dt;
    for (int i = 0; i < 3; i++) fill.size[i] = 1;
    fill.spacing = 1 / (tlsph_real)cells;
    material.density = 1100; material.young = (tlsph_real)17e6; material.poisson = (tlsph_real)0.3;
    desc.materials = &material; desc.material_count = 1;
    desc.unknowns = TLSPH_PFHJ;
    desc.projection = 0;
    desc.support = (tlsph_real)(wide ? 0.9 : 0.6);
    desc.threads = 1;
    if (tlsph_cloud_create(&fill, &cloud, &error)) { puts(error.message); return 1; }
    desc.particles = cloud.particles;
    if (tlsph_create(&desc, &solver, &error) || book_create(&k, &cloud, cells, &desc)) { puts(error.message); return 1; }
    scene_moduli(&material, &p_wave, &bulk, &shear);
    speed = sqrt(p_wave / (double)material.density);
    dt = (real)(0.2 / cells / speed);
    set_motion(&k, solver, 1e-3 * speed);
    for (int i = 0; i < rounds + 3; i++) {
        const double begin = ex_cpu_seconds();
        double middle;
        book_step(&k, dt);
        middle = ex_cpu_seconds();
        if (tlsph_step(solver, dt)) { puts(tlsph_last_error(solver)->message); return 1; }
        plain = fmin(plain, middle - begin);
        header = fmin(header, ex_cpu_seconds() - middle);
        if (i != 2) continue; /* rates, as three steps show them */
        const double tolerance = sizeof(real) == 8 ? 1e-9 : 2e-2;
        const struct { const char *name; tlsph_field field; size_t offset; int components; } fields[4] = {
            { "v", TLSPH_FIELD_VELOCITY, offsetof(particle, v), 3 }, { "F", TLSPH_FIELD_F, offsetof(particle, F), 9 },
            { "H", TLSPH_FIELD_H, offsetof(particle, H), 9 }, { "J", TLSPH_FIELD_J, offsetof(particle, J), 1 } };
        for (int f = 0; f < 4; f++) {
            snprintf(key, sizeof key, "textbook_%d_difference_%s", neighbours, fields[f].name);
            ex_check_below(key, difference(&k, solver, fields[f].field, fields[f].offset, fields[f].components), tolerance);
        }
    }
    snprintf(key, sizeof key, "textbook_pFHJ_double_%d_ns_per_particle", neighbours);
    ex_result(key, 1e9 * plain / 2 / (double)k.n, "ns");
    snprintf(key, sizeof key, "header_pFHJ_double_%d_ns_per_particle", neighbours);
    ex_result(key, 1e9 * header / 2 / (double)k.n, "ns");
    snprintf(key, sizeof key, "textbook_by_header_%d", neighbours);
    ex_result(key, plain / header, "1");
    printf("%zu particles: %zu bytes a particle in the plain code, %zu pairs\n", k.n,
           sizeof(particle) + k.pair_count / k.n * sizeof(pair), k.pair_count);
    book_destroy(&k);
    tlsph_destroy(solver);
    tlsph_cloud_destroy(&cloud);
    return 0;
}

int main(int argc, char **argv) {
    int n = 26, rounds = 30;
    const ex_option options[] = { { "n", EX_INT, &n, NULL, NULL, 4, 200, "cells a side" },
                                  { "rounds", EX_INT, &rounds, NULL, NULL, 1, 10000, "steps of each, in alternation" } };
    ex_arguments(argc, argv, "textbook", "a plain loop beside the header, same physics", options, 2);
    machine_print();
    for (int wide = 0; wide < 2; wide++)
        if (run(n, wide, rounds)) return 1;
    return ex_exit_code();
}
