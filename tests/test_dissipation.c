/* The dissipation of one pair: METHOD's formula, and what every form must keep (symmetry, invariance, the second law). */
#include "support.h"

typedef struct pair {
    tlsph_pair_side a, b;
    tlsph_real C[3], c[3], d[3], a_J;
} pair;

static void random_side(uint64_t *seed, tlsph_pair_side *side)
{
    int i;
    memset(side, 0, sizeof *side);
    for (i = 0; i < 3; i++) {
        side->velocity[i] = R(random_between(seed, -1, 1));
        side->Sigma_J_gradient[i] = R(random_between(seed, -1000, 1000));
    }
    for (i = 0; i < 9; i++) side->velocity_gradient[i] = R(random_between(seed, -2, 2));
    side->Sigma_J = R(random_between(seed, -1000, 1000));
    side->theta = R(random_between(seed, 250, 350));
    side->theta_R = R(293.15);
    side->density = 1000;
    side->c_p = R(random_between(seed, 8, 12));
    side->c_s = R(random_between(seed, 3, 6));
    side->drift_ratio = R(random_between(seed, 0, 2));
}

static pair random_pair(uint64_t *seed)
{
    pair p;
    int i;
    random_side(seed, &p.a);
    random_side(seed, &p.b);
    for (i = 0; i < 3; i++) {
        p.d[i] = R(random_between(seed, -1, 1));
        p.C[i] = R(0.3 * (double)p.d[i] + random_between(seed, -0.05, 0.05));
        p.c[i] = R((double)p.C[i] + random_between(seed, -0.05, 0.05));
    }
    p.a_J = R(0.5);
    return p;
}

static tlsph_pair_flux flux_of(tlsph_dissipation kind, const pair *p)
{
    tlsph_pair_flux out;
    memset(&out, 0xA5, sizeof out);
    tlsph_pair_dissipation(kind, &p->a, &p->b, p->C, p->c, p->d, p->a_J, &out);
    return out;
}

static double dot(const double u[3], const double v[3]) { return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]; }

/* ---- METHOD, "Dissipation", by hand ---- */

typedef struct jumps { double Dv[3], Dr[3], DS, DSr; } jumps;

static jumps jumps_of(const pair *p, int reconstruct)
{
    jumps j;
    int i, k;
    j.DS = j.DSr = (double)p->b.Sigma_J - (double)p->a.Sigma_J;
    for (i = 0; i < 3; i++) {
        j.Dv[i] = j.Dr[i] = (double)p->b.velocity[i] - (double)p->a.velocity[i];
        for (k = 0; reconstruct && k < 3; k++)
            j.Dr[i] -= 0.5 * (double)p->d[k] *
                       ((double)p->a.velocity_gradient[3 * i + k] + (double)p->b.velocity_gradient[3 * i + k]);
        if (reconstruct)
            j.DSr -= 0.5 * (double)p->d[i] * ((double)p->a.Sigma_J_gradient[i] + (double)p->b.Sigma_J_gradient[i]);
    }
    return j;
}

/* The share of the reconstructed jump that the limiter lets through: the raw jump along it, but neither less than none of it
   nor more than all. */
static double share(double raw, double reconstructed)
{
    return reconstructed > 0 ? fmin(1, fmax(0, raw / reconstructed)) : 0;
}

/* D_p = rho/2 |C| (c_p nr n + c_s tr), each part times its share where there is a limiter. */
static void expected_force(const pair *p, const jumps *j, int limit, double D_p[3])
{
    double n[3], c[3], C[3], t[3], raw[3], nr, area, rho = 0.5 * ((double)p->a.density + (double)p->b.density);
    double c_p = 0.5 * ((double)p->a.c_p + (double)p->b.c_p), c_s = 0.5 * ((double)p->a.c_s + (double)p->b.c_s);
    int i;
    for (i = 0; i < 3; i++) { c[i] = (double)p->c[i]; C[i] = (double)p->C[i]; }
    for (i = 0; i < 3; i++) n[i] = c[i] / sqrt(dot(c, c));
    area = sqrt(dot(C, C));
    nr = dot(n, j->Dr);
    for (i = 0; i < 3; i++) {
        t[i] = j->Dr[i] - nr * n[i];
        raw[i] = j->Dv[i] - dot(n, j->Dv) * n[i];
    }
    if (limit) c_s *= share(dot(t, raw), dot(t, t));
    if (limit) nr *= share(nr * dot(n, j->Dv), nr * nr);
    for (i = 0; i < 3; i++) D_p[i] = 0.5 * rho * area * (c_p * nr * n[i] + c_s * t[i]);
}

/* D_J = S_J DS, S_J = a_J |c|^2 / (2 rho c_p |C|) / (1 + (k_a + k_b)/2) */
static double expected_D_J(const pair *p, const jumps *j, int limit)
{
    double c[3], C[3], S_J, rho = 0.5 * ((double)p->a.density + (double)p->b.density);
    int i;
    for (i = 0; i < 3; i++) { c[i] = (double)p->c[i]; C[i] = (double)p->C[i]; }
    S_J = (double)p->a_J * dot(c, c) / (rho * ((double)p->a.c_p + (double)p->b.c_p) * sqrt(dot(C, C)));
    S_J /= 1 + 0.5 * ((double)p->a.drift_ratio + (double)p->b.drift_ratio);
    return S_J * j->DSr * (limit ? share(j->DSr * j->DS, j->DSr * j->DSr) : 1);
}

/* n . Dv over the p speed: below zero the particles approach each other. */
static double approach(const pair *p, const jumps *j)
{
    double c[3] = {(double)p->c[0], (double)p->c[1], (double)p->c[2]};
    return dot(c, j->Dv) / sqrt(dot(c, c)) / (0.5 * ((double)p->a.c_p + (double)p->b.c_p));
}

static void check_formula(tlsph_dissipation kind, int reconstruct, int limit)
{
    uint64_t seed = 1;
    int trial, i;
    for (trial = 0; trial < 200; trial++) {
        pair p = random_pair(&seed);
        jumps j = jumps_of(&p, reconstruct);
        tlsph_pair_flux f = flux_of(kind, &p);
        double D_p[3], D_J, D_E, production, scale = 1000 * 12 * 2, v;
        if (limit && approach(&p, &j) < -0.0015) continue; /* may be a front: the next test */
        expected_force(&p, &j, limit, D_p);
        D_J = expected_D_J(&p, &j, limit);
        D_E = 0.5 * ((double)p.a.Sigma_J + (double)p.b.Sigma_J) * D_J;
        for (i = 0; i < 3; i++) {
            v = 0.5 * ((double)p.a.velocity[i] + (double)p.b.velocity[i]);
            D_E += v * D_p[i];
            CHECK_CLOSE(f.D_p[i], D_p[i], 100 * EPSILON * scale);
        }
        production = dot(j.Dv, D_p) + j.DS * D_J;
        CHECK_CLOSE(f.D_J, D_J, 100 * EPSILON * (fabs(D_J) + 0.1));
        CHECK_CLOSE(f.D_E, D_E, 200 * EPSILON * scale);
        CHECK_CLOSE(f.production, production, 400 * EPSILON * scale);
    }
}

TEST(first_order_is_the_formula) { check_formula(TLSPH_FIRST_ORDER, 0, 0); }
TEST(reconstructed_is_the_formula) { check_formula(TLSPH_RECONSTRUCTED, 1, 0); }
TEST(limited_is_the_formula) { check_formula(TLSPH_LIMITED, 1, 1); }

/* At fronts, where particles approach by more than 0.0015 of the p speed, the limited form gives back a share in [0, 1] of
   the raw normal jump: between its own formula and the first order's, with the tangential part untouched. */
TEST(limited_at_fronts_lies_between)
{
    uint64_t seed = 8;
    int trial, i, fronts = 0;
    for (trial = 0; trial < 400; trial++) {
        pair p = random_pair(&seed);
        jumps smooth = jumps_of(&p, 1), raw = smooth;
        tlsph_pair_flux f = flux_of(TLSPH_LIMITED, &p);
        double low[3], high[3], part, rest = 0, way = 0, size = 0;
        double n[3] = {(double)p.c[0], (double)p.c[1], (double)p.c[2]}, length = sqrt(dot(n, n));
        if (approach(&p, &smooth) > -0.0015) continue;
        /* the jump with its normal part replaced by the raw one */
        for (i = 0; i < 3; i++) n[i] /= length;
        for (i = 0; i < 3; i++) raw.Dr[i] += (dot(n, smooth.Dv) - dot(n, smooth.Dr)) * n[i];
        expected_force(&p, &smooth, 1, low);
        expected_force(&p, &raw, 1, high);
        for (i = 0; i < 3; i++) { way += ((double)f.D_p[i] - low[i]) * (high[i] - low[i]); size += (high[i] - low[i]) * (high[i] - low[i]); }
        part = sqrt(size) > 200 * EPSILON * 24000 ? way / size : 0; /* else both are the same but for round-off */
        CHECK(part >= -1000 * EPSILON && part <= 1 + 1000 * EPSILON);
        for (i = 0; i < 3; i++) rest = fmax(rest, fabs((double)f.D_p[i] - low[i] - part * (high[i] - low[i])));
        CHECK_BELOW(rest, 200 * EPSILON * 24000);
        fronts += part > 0.5;
    }
    CHECK(fronts > 10);
}

TEST(none_is_nothing)
{
    uint64_t seed = 2;
    pair p = random_pair(&seed);
    tlsph_pair_flux f = flux_of(TLSPH_NO_DISSIPATION, &p);
    CHECK(f.D_p[0] == 0 && f.D_p[1] == 0 && f.D_p[2] == 0 && f.D_J == 0 && f.D_E == 0 && f.production == 0);
}

/* ---- properties ---- */

static const tlsph_dissipation ours[3] = {TLSPH_LIMITED, TLSPH_RECONSTRUCTED, TLSPH_FIRST_ORDER};

/* What enters a leaves b: swapping the sides (C, c, d turn round) changes the sign of all fluxes, not the production. */
TEST(fluxes_are_antisymmetric)
{
    uint64_t seed = 3;
    int kind, trial, i;
    for (kind = 0; kind < 3; kind++)
        for (trial = 0; trial < 100; trial++) {
            pair p = random_pair(&seed), q = p;
            tlsph_pair_flux f, g;
            q.a = p.b;
            q.b = p.a;
            for (i = 0; i < 3; i++) { q.C[i] = -p.C[i]; q.c[i] = -p.c[i]; q.d[i] = -p.d[i]; }
            f = flux_of(ours[kind], &p);
            g = flux_of(ours[kind], &q);
            for (i = 0; i < 3; i++) CHECK_CLOSE(g.D_p[i], -f.D_p[i], 20 * EPSILON * 24000);
            CHECK_CLOSE(g.D_J, -f.D_J, 20 * EPSILON * (fabs((double)f.D_J) + 0.01));
            CHECK_CLOSE(g.D_E, -f.D_E, 50 * EPSILON * 24000);
            CHECK_CLOSE(g.production, f.production, 100 * EPSILON * 24000);
        }
}

TEST(galilean_invariance)
{
    uint64_t seed = 4;
    int kind, trial, i;
    for (kind = 0; kind < 3; kind++)
        for (trial = 0; trial < 100; trial++) {
            pair p = random_pair(&seed), q = p;
            tlsph_pair_flux f, g;
            for (i = 0; i < 3; i++) { q.a.velocity[i] += 8; q.b.velocity[i] += 8; }
            f = flux_of(ours[kind], &p);
            g = flux_of(ours[kind], &q);
            for (i = 0; i < 3; i++) CHECK_CLOSE(g.D_p[i], f.D_p[i], 100 * EPSILON * 24000);
            CHECK_CLOSE(g.D_J, f.D_J, 20 * EPSILON * (fabs((double)f.D_J) + 0.01));
            CHECK_CLOSE(g.production, f.production, 400 * EPSILON * 24000);
        }
}

/* The second law, pair by pair; below zero by round-off of the terms' own size only. */
TEST(production_is_not_negative)
{
    static const tlsph_dissipation stable[2] = {TLSPH_LIMITED, TLSPH_FIRST_ORDER};
    uint64_t seed = 5;
    int kind, trial;
    for (kind = 0; kind < 2; kind++)
        for (trial = 0; trial < 5000; trial++) {
            pair p = random_pair(&seed);
            tlsph_pair_flux f = flux_of(stable[kind], &p);
            CHECK(f.production >= R(-10 * EPSILON * 24000));
        }
}

/* The limiter is no switch: a jump that changes by a trifle changes the flux by a trifle, also where signs change. On the way
   from one state to another the largest step of the flux falls with the number of steps. */
TEST(the_limiter_is_continuous)
{
    uint64_t seed = 9;
    int trial, steps, i, k;
    for (trial = 0; trial < 100; trial++) {
        pair from = random_pair(&seed), to = from;
        double most[2] = {0, 0};
        for (k = 0; k < 3; k++) to.a.velocity[k] = 2 * from.b.velocity[k] - from.a.velocity[k]; /* the jump turns round */
        for (k = 0; k < 2; k++) {
            tlsph_pair_flux last = flux_of(TLSPH_LIMITED, &from);
            steps = k ? 4000 : 1000;
            for (i = 1; i <= steps; i++) {
                pair p = from;
                tlsph_pair_flux f;
                double t = (double)i / steps, size = 0;
                int j;
                for (j = 0; j < 3; j++) p.a.velocity[j] = R((1 - t) * (double)from.a.velocity[j] + t * (double)to.a.velocity[j]);
                p.a.Sigma_J = R((1 - t) * (double)from.a.Sigma_J + t * (2 * (double)from.b.Sigma_J - (double)from.a.Sigma_J));
                f = flux_of(TLSPH_LIMITED, &p);
                for (j = 0; j < 3; j++) size += fabs((double)f.D_p[j] - (double)last.D_p[j]);
                most[k] = fmax(most[k], fmax(size, 1e3 * fabs((double)f.D_J - (double)last.D_J)));
                last = f;
            }
        }
        CHECK_BELOW(most[1], 0.5 * most[0]);
    }
}

/* Linear fields are no jumps: no dissipation, which is what makes the scheme second order. */
TEST(linear_fields_do_not_dissipate)
{
    uint64_t seed = 6;
    int kind, trial, i, k;
    for (kind = 0; kind < 2; kind++)
        for (trial = 0; trial < 100; trial++) {
            pair p = random_pair(&seed);
            tlsph_pair_flux f;
            double S = (double)p.a.Sigma_J;
            memcpy(p.b.velocity_gradient, p.a.velocity_gradient, sizeof p.a.velocity_gradient);
            memcpy(p.b.Sigma_J_gradient, p.a.Sigma_J_gradient, sizeof p.a.Sigma_J_gradient);
            for (i = 0; i < 3; i++) {
                double v = (double)p.a.velocity[i];
                for (k = 0; k < 3; k++) v += (double)p.a.velocity_gradient[3 * i + k] * (double)p.d[k];
                p.b.velocity[i] = R(v);
                S += (double)p.a.Sigma_J_gradient[i] * (double)p.d[i];
            }
            p.b.Sigma_J = R(S);
            f = flux_of(ours[kind], &p);
            for (i = 0; i < 3; i++) CHECK_CLOSE(f.D_p[i], 0, 100 * EPSILON * 24000);
            CHECK_CLOSE(f.D_J, 0, 100 * EPSILON);
        }
}

/* The papers' form divides by (1/Xi_a - 1/Xi_b)^2: equal temperatures must not give infinities. */
TEST(printed_form_is_guarded)
{
    uint64_t seed = 7;
    int trial;
    for (trial = 0; trial < 100; trial++) {
        pair p = random_pair(&seed);
        tlsph_pair_flux f;
        if (trial % 2) p.b.theta = p.a.theta;
        if (trial % 3 == 0) p.a.theta = p.b.theta = p.a.theta_R;
        f = flux_of(TLSPH_AS_PRINTED, &p);
        CHECK(isfinite((double)f.D_p[0]) && isfinite((double)f.D_p[1]) && isfinite((double)f.D_p[2]));
        CHECK(isfinite((double)f.D_J) && isfinite((double)f.D_E) && isfinite((double)f.production));
    }
}

SUITE(dissipation, ENTRY(first_order_is_the_formula), ENTRY(reconstructed_is_the_formula), ENTRY(limited_is_the_formula),
      ENTRY(limited_at_fronts_lies_between),
      ENTRY(none_is_nothing), ENTRY(fluxes_are_antisymmetric), ENTRY(galilean_invariance),
      ENTRY(production_is_not_negative), ENTRY(the_limiter_is_continuous), ENTRY(linear_fields_do_not_dissipate), ENTRY(printed_form_is_guarded))
