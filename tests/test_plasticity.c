/* Von Mises plasticity (001 Algorithm 2): the return map on homogeneous paths against closed forms and an integrated
   flow rule, the elastic law by differences, balances of moving bodies, checkpoints and threads. */
#include "support.h"

typedef struct path {
    tlsph_material material;
    tlsph_solver *solver;
    double mu, kappa;
} path;

/* A cube of 8 particles, to be deformed by writing F; it needs no step. */
static int path_begin(path *p, int dimension, tlsph_unknowns unknowns, tlsph_thermal thermal)
{
    const int cells[3] = {1, 1, 1};
    own_cloud cloud;
    tlsph_desc desc = tlsph_desc_default(dimension);
    p->material = soft_material(TLSPH_VON_MISES);
    p->material.poisson = R(0.35);
    if (!thermal) p->material.expansion = 0;
    p->mu = (double)p->material.young / 2.7;
    p->kappa = (double)p->material.young / 0.9;
    p->solver = NULL;
    if (!own_box(&cloud, dimension, cells, 1, 0)) return 0;
    desc.particles = cloud.particles;
    desc.materials = &p->material;
    desc.material_count = 1;
    desc.unknowns = unknowns;
    desc.thermal = thermal;
    CHECK_RESULT(tlsph_create(&desc, &p->solver, NULL), TLSPH_OK);
    own_cloud_destroy(&cloud);
    return p->solver != NULL;
}
static void path_set(const path *p, const double F[9])
{
    tlsph_real all[8 * 9];
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) all[i] = (tlsph_real)F[i % 9];
    CHECK_RESULT(tlsph_write(p->solver, TLSPH_FIELD_F, all), TLSPH_OK);
}
static double path_get(const path *p, tlsph_field field, int component)
{
    tlsph_real all[8 * 9];
    CHECK_RESULT(tlsph_read(p->solver, field, all), TLSPH_OK);
    return (double)all[component];
}
static void diagonal(double a, double b, double c, double F[9])
{
    for (int i = 0; i < 9; i++) F[i] = 0;
    F[0] = exp(a);
    F[4] = exp(b);
    F[8] = exp(c);
}

/* Stretch exp(s) along X, exp(-s/2) across, volume exp(3 v): tau = 3 mu (s - plastic strain), mean 3 kappa v, so that
   tau = yield + H (3 mu s - yield)/(3 mu + H) while it flows, whatever the size of the steps. */
static void check_stretching(tlsph_unknowns unknowns, int steps)
{
    const double v = 0.01, s = 0.6;
    path p;
    double F[9];
    REQUIRE(path_begin(&p, 3, unknowns, TLSPH_ISOTHERMAL));
    const double y = (double)p.material.yield_stress, h = (double)p.material.hardening, mu3 = 3 * p.mu;
    const double scale = ROUNDED(1e-12, 50) * mu3;
    diagonal(v + y / mu3 * 0.999, v - y / mu3 * 0.4995, v - y / mu3 * 0.4995, F);
    path_set(&p, F);
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_PLASTIC_STRAIN, 0), 0, EPSILON);
    for (int k = 1; k <= steps; k++) {
        diagonal(v + s * k / steps, v - s * k / steps / 2, v - s * k / steps / 2, F);
        path_set(&p, F);
    }
    const double strain = (mu3 * s - y) / (mu3 + h), tau = y + h * strain, J = exp(3 * v);
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_PLASTIC_STRAIN, 0), strain, ROUNDED(1e-12, 50));
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_VON_MISES, 0), tau / J, scale);
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_PRESSURE, 0), p.kappa * 3 * v / J, scale);
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_STRESS, 0), (2 * tau / 3 + p.kappa * 3 * v) / F[0], scale);
    /* unloading is elastic; yield on the other side when tau has changed by twice its size */
    const double back = s - 1.99 * tau / mu3, beyond = s - 0.3;
    diagonal(v + back, v - back / 2, v - back / 2, F);
    path_set(&p, F);
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_PLASTIC_STRAIN, 0), strain, ROUNDED(1e-12, 50));
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_VON_MISES, 0), 0.99 * tau / J, scale);
    diagonal(v + beyond, v - beyond / 2, v - beyond / 2, F);
    path_set(&p, F);
    const double more = (mu3 * 0.3 - 2 * tau) / (mu3 + h);
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_PLASTIC_STRAIN, 0), strain + more, ROUNDED(1e-12, 100));
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_VON_MISES, 0), (tau + h * more) / J, scale);
    tlsph_destroy(p.solver);
}
TEST(stretching_in_one_step) { check_stretching(TLSPH_PF, 1); }
TEST(stretching_in_many_steps) { check_stretching(TLSPH_PF, 200); }
TEST(stretching_in_all_unknowns) { for (int u = 0; u < 4; u++) check_stretching((tlsph_unknowns)u, 10); }

/* Plane strain: the thickness does not change, the elastic and plastic parts of its stretch do. */
TEST(plane_strain)
{
    path p, q;
    double F[9], G[9];
    REQUIRE(path_begin(&p, 2, TLSPH_PF, TLSPH_ISOTHERMAL) && path_begin(&q, 3, TLSPH_PF, TLSPH_ISOTHERMAL));
    for (int k = 1; k <= 20; k++) {
        diagonal(0.02 * k, -0.015 * k, 0, F);
        F[1] = 0.01 * k;
        memcpy(G, F, sizeof G);
        path_set(&p, F);
        path_set(&q, G);
    }
    for (int i = 0; i < 9; i++)
        CHECK_CLOSE(path_get(&p, TLSPH_FIELD_STRESS, i), path_get(&q, TLSPH_FIELD_STRESS, i),
                    ROUNDED(1e-12, 100) * p.mu);
    CHECK_CLOSE(path_get(&p, TLSPH_FIELD_PLASTIC_STRAIN, 0), path_get(&q, TLSPH_FIELD_PLASTIC_STRAIN, 0),
                ROUNDED(1e-12, 50));
    tlsph_destroy(p.solver);
    tlsph_destroy(q.solver);
}

/* ---- simple shear: the flow rule as an ordinary differential equation ---- */

/* b' = L b + b L^T - 3 rate tau'/tau b with L = e1 (x) e2, in the plane; b33 apart; rate = 3 mu tau':L/(tau (3 mu + H)). */
typedef struct shear { double b[4], strain; } shear; /* b11, b12, b22, b33 */

static double shear_stress(double mu, const shear *s, double dev[4])
{
    const double mean = (s->b[0] + s->b[2]) / 2, half = (s->b[0] - s->b[2]) / 2;
    const double root = sqrt(half * half + s->b[1] * s->b[1]), angle = atan2(s->b[1], half) / 2;
    const double e1 = log(mean + root) / 2, e2 = log(mean - root) / 2, e3 = log(s->b[3]) / 2, m = (e1 + e2 + e3) / 3;
    const double c = cos(angle), n = sin(angle), t1 = 2 * mu * (e1 - m), t2 = 2 * mu * (e2 - m), t3 = 2 * mu * (e3 - m);
    dev[0] = t1 * c * c + t2 * n * n;
    dev[1] = (t1 - t2) * c * n;
    dev[2] = t1 * n * n + t2 * c * c;
    dev[3] = t3;
    return sqrt(1.5 * (t1 * t1 + t2 * t2 + t3 * t3));
}
static shear shear_rate(const path *p, const shear *s, int plastic)
{
    shear r;
    double d[4];
    const double tau = shear_stress(p->mu, s, d);
    const double rate = plastic ? 3 * p->mu * d[1] / (tau * (3 * p->mu + (double)p->material.hardening)) : 0;
    const double f = plastic ? 3 * rate / tau : 0;
    r.b[0] = 2 * s->b[1] - f * (d[0] * s->b[0] + d[1] * s->b[1]);
    r.b[1] = s->b[2] - f * (d[0] * s->b[1] + d[1] * s->b[2]);
    r.b[2] = -f * (d[1] * s->b[1] + d[2] * s->b[2]);
    r.b[3] = -f * d[3] * s->b[3];
    r.strain = rate;
    return r;
}
static shear shear_moved(const shear *s, const shear *r, double h)
{
    shear out;
    for (int i = 0; i < 4; i++) out.b[i] = s->b[i] + h * r->b[i];
    out.strain = s->strain + h * r->strain;
    return out;
}
/* Up to the shear `end`; the elastic part ends where tau meets the yield stress (b = F F^T until then). */
static shear shear_exact(const path *p, double end)
{
    double low = 0, high = 1, dev[4];
    shear s;
    for (int k = 0; k < 200; k++) {
        const double g = (low + high) / 2;
        const shear trial = {{1 + g * g, g, 1, 1}, 0};
        if (shear_stress(p->mu, &trial, dev) < (double)p->material.yield_stress) low = g;
        else high = g;
    }
    const shear start = {{1 + low * low, low, 1, 1}, 0};
    const double h = (end - low) / 4000;
    s = start;
    for (int k = 0; k < 4000; k++) {
        const shear r1 = shear_rate(p, &s, 1), m1 = shear_moved(&s, &r1, h / 2), r2 = shear_rate(p, &m1, 1);
        const shear m2 = shear_moved(&s, &r2, h / 2), r3 = shear_rate(p, &m2, 1), m3 = shear_moved(&s, &r3, h);
        const shear r4 = shear_rate(p, &m3, 1);
        s = shear_moved(&s, &r1, h / 6);
        s = shear_moved(&s, &r2, h / 3);
        s = shear_moved(&s, &r3, h / 3);
        s = shear_moved(&s, &r4, h / 6);
    }
    return s;
}
/* Errors of the shear stress and of the plastic strain at the shear 1, relative. */
static void shear_errors(int steps, double *stress, double *strain)
{
    path p;
    double F[9], dev[4];
    *stress = *strain = 1;
    REQUIRE(path_begin(&p, 3, TLSPH_PF, TLSPH_ISOTHERMAL));
    const shear exact = shear_exact(&p, 1);
    shear_stress(p.mu, &exact, dev);
    diagonal(0, 0, 0, F);
    for (int k = 1; k <= steps; k++) {
        F[1] = (double)k / steps;
        path_set(&p, F);
    }
    *stress = fabs(path_get(&p, TLSPH_FIELD_STRESS, 1) / dev[1] - 1); /* P_12 = tau_12 here */
    *strain = fabs(path_get(&p, TLSPH_FIELD_PLASTIC_STRAIN, 0) / exact.strain - 1);
    tlsph_destroy(p.solver);
}
TEST(simple_shear_meets_the_flow_rule)
{
    double stress[3], strain[3];
    DOUBLE_ONLY();
    for (int k = 0; k < 3; k++) shear_errors(50 << (2 * k), stress + k, strain + k);
    REPORT("stress %.1e %.1e %.1e, strain %.1e %.1e %.1e", stress[0], stress[1], stress[2], strain[0], strain[1],
           strain[2]);
    CHECK_BELOW(stress[2], 1e-4);
    CHECK_BELOW(strain[2], 1e-4);
    for (int k = 0; k < 2; k++) { /* first order: four times the steps */
        CHECK_CLOSE(stress[k] / stress[k + 1], 4, 0.8);
        CHECK_CLOSE(strain[k] / strain[k + 1], 4, 0.8);
    }
}

/* A rotation that is superposed on the path turns the stress and changes nothing else. */
TEST(objective)
{
    uint64_t seed = 3;
    path p, q;
    tlsph_real Q[9];
    double F[9], QF[9];
    REQUIRE(path_begin(&p, 3, TLSPH_PF, TLSPH_ISOTHERMAL) && path_begin(&q, 3, TLSPH_PF, TLSPH_ISOTHERMAL));
    diagonal(0, 0, 0, F);
    for (int k = 1; k <= 10; k++) {
        random_rotation(&seed, Q);
        F[1] = 0.1 * k;
        F[0] = 1 + 0.02 * k;
        F[6] = -0.03 * k;
        for (int i = 0; i < 9; i++)
            QF[i] = (double)Q[i / 3 * 3] * F[i % 3] + (double)Q[i / 3 * 3 + 1] * F[3 + i % 3] +
                    (double)Q[i / 3 * 3 + 2] * F[6 + i % 3];
        path_set(&p, F);
        path_set(&q, QF);
    }
    CHECK(path_get(&p, TLSPH_FIELD_PLASTIC_STRAIN, 0) > 0.3);
    CHECK_CLOSE(path_get(&q, TLSPH_FIELD_PLASTIC_STRAIN, 0), path_get(&p, TLSPH_FIELD_PLASTIC_STRAIN, 0),
                ROUNDED(1e-12, 100));
    for (int i = 0; i < 9; i++) {
        double turned = 0;
        for (int k = 0; k < 3; k++) turned += (double)Q[i / 3 * 3 + k] * path_get(&p, TLSPH_FIELD_STRESS, 3 * k + i % 3);
        CHECK_CLOSE(path_get(&q, TLSPH_FIELD_STRESS, i), turned, ROUNDED(1e-11, 1000) * p.mu);
    }
    tlsph_destroy(p.solver);
    tlsph_destroy(q.solver);
}

/* Equal and nearly equal stretches, turned out of the axes: stress along the axes of the stretch, tau(e) smooth in e. */
TEST(repeated_stretches)
{
    static const double gaps[6] = {0, 1e-16, 1e-12, 1e-9, 1e-6, 1e-3};
    uint64_t seed = 8;
    for (int trial = 0; trial < 30; trial++) {
        const double gap = gaps[trial % 6];
        path p;
        tlsph_real Q[9];
        double U[9], F[9], e[3] = {0.3, -0.15 + gap, -0.15 - gap};
        if (trial % 5 == 4) e[0] = e[1] = e[2] = 0.1; /* all equal */
        REQUIRE(path_begin(&p, 3, TLSPH_PF, TLSPH_ISOTHERMAL));
        random_rotation(&seed, Q);
        for (int i = 0; i < 9; i++) {
            U[i] = F[i] = 0;
            for (int k = 0; k < 3; k++) {
                U[i] += (double)Q[i / 3 * 3 + k] * exp(e[k]) * (double)Q[i % 3 * 3 + k];
                F[i] = U[i];
            }
        }
        path_set(&p, F);
        const double mean = (e[0] + e[1] + e[2]) / 3;
        double size = 0, tau, factor = 1;
        for (int k = 0; k < 3; k++) size += (e[k] - mean) * (e[k] - mean);
        tau = 2 * p.mu * sqrt(1.5 * size);
        const double y = (double)p.material.yield_stress, h = (double)p.material.hardening;
        if (tau > y) factor = (y + h * (tau - y) / (3 * p.mu + h)) / tau;
        for (int i = 0; i < 9; i++) {
            double P = 0;
            for (int k = 0; k < 3; k++)
                P += (double)Q[i / 3 * 3 + k] * (double)Q[i % 3 * 3 + k] * exp(-e[k]) *
                     (2 * p.mu * factor * (e[k] - mean) + p.kappa * 3 * mean);
            CHECK_CLOSE(path_get(&p, TLSPH_FIELD_STRESS, i), P, ROUNDED(1e-13, 30) * (p.mu + p.kappa));
        }
        tlsph_destroy(p.solver);
    }
}

/* ---- the elastic law ---- */

static double helmholtz(const tlsph_material *m, const tlsph_real *F, double theta)
{
    tlsph_material_state s;
    CHECK_RESULT(tlsph_material_evaluate(m, F, R(theta), &s), TLSPH_OK);
    return (double)s.helmholtz;
}
TEST(stress_and_entropy_are_derivatives)
{
    uint64_t seed = 5;
    DOUBLE_ONLY();
    for (int trial = 0; trial < 20; trial++) {
        const tlsph_material m = soft_material(TLSPH_VON_MISES);
        const double theta = random_between(&seed, 250, 350), h = 1e-4;
        tlsph_material_state s;
        tlsph_real F[9];
        random_deformation(&seed, 0.3, F);
        REQUIRE_OK(tlsph_material_evaluate(&m, F, R(theta), &s));
        for (int k = 0; k < 9; k++) {
            double psi[4];
            for (int i = 0; i < 4; i++) {
                tlsph_real G[9];
                memcpy(G, F, sizeof G);
                G[k] += R(h * (i < 2 ? i - 2 : i - 1));
                psi[i] = helmholtz(&m, G, theta);
            }
            CHECK_CLOSE(s.P[k], (psi[0] - 8 * psi[1] + 8 * psi[2] - psi[3]) / (12 * h), 1e-7 * (double)m.young);
        }
        CHECK_CLOSE(s.eta, -(helmholtz(&m, F, theta + 0.01) - helmholtz(&m, F, theta - 0.01)) / 0.02, 1e-4);
    }
}
/* Without stress the body is as large as J = exp(3 alpha (theta - theta_R)). */
TEST(free_expansion)
{
    const tlsph_material m = soft_material(TLSPH_VON_MISES);
    tlsph_material_state s;
    tlsph_real F[9] = {0};
    F[0] = F[4] = F[8] = R(exp((double)m.expansion * 50));
    REQUIRE_OK(tlsph_material_evaluate(&m, F, R(343.15), &s));
    for (int i = 0; i < 9; i++) CHECK_CLOSE(s.P[i], 0, ROUNDED(1e-12, 20) * (double)m.young);
}
/* Largest eigenvalue of the symmetric 3x3 A, from x^T A x at the end of power iterations. */
static double largest_eigenvalue(double A[9])
{
    double x[3] = {0.6, 0.5, 0.62}, value = 0;
    for (int k = 0; k < 3; k++) A[4 * k] += 1e9; /* the largest, not the one of largest size */
    for (int round = 0; round < 3000; round++) {
        double y[3];
        for (int i = 0; i < 3; i++) y[i] = A[3 * i] * x[0] + A[3 * i + 1] * x[1] + A[3 * i + 2] * x[2];
        value = sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
        for (int i = 0; i < 3; i++) x[i] = y[i] / value;
    }
    return value - 1e9;
}
/* rho c^2 of the fastest wave with normal N, isothermal, by differences of P; isentropic speeds are checked as beta^2. */
static double fastest(const tlsph_material *m, const tlsph_real F[9], const double N[3])
{
    double A[9];
    const double h = 1e-5;
    for (int k = 0; k < 3; k++) {
        tlsph_material_state s[2];
        for (int side = 0; side < 2; side++) {
            tlsph_real G[9];
            memcpy(G, F, sizeof G);
            for (int I = 0; I < 3; I++) G[3 * k + I] += R((side ? h : -h) * N[I]);
            CHECK_RESULT(tlsph_material_evaluate(m, G, m->reference_temperature, s + side), TLSPH_OK);
        }
        for (int i = 0; i < 3; i++) {
            A[3 * i + k] = 0;
            for (int I = 0; I < 3; I++)
                A[3 * i + k] += (double)(s[1].P[3 * i + I] - s[0].P[3 * i + I]) / (2 * h) * N[I];
        }
    }
    return largest_eigenvalue(A);
}
TEST(wave_speeds_are_bounds)
{
    uint64_t seed = 11;
    double tightest = 1e9;
    DOUBLE_ONLY();
    for (int trial = 0; trial < 200; trial++) {
        tlsph_material m = soft_material(TLSPH_VON_MISES);
        tlsph_material_state s;
        tlsph_real F[9];
        double N[3], norm = 0;
        m.expansion = m.specific_heat = 0;
        m.poisson = R(random_between(&seed, -0.2, 0.49));
        random_deformation(&seed, trial < 100 ? 0.02 : 0.4, F);
        for (int i = 0; i < 3; i++) N[i] = random_between(&seed, -1, 1);
        for (int i = 0; i < 3; i++) norm += N[i] * N[i];
        for (int i = 0; i < 3; i++) N[i] /= sqrt(norm);
        REQUIRE_OK(tlsph_material_evaluate(&m, F, m.reference_temperature, &s));
        const double bound = (double)(m.density * s.c_p * s.c_p), exact = fastest(&m, F, N);
        CHECK_BELOW(exact, bound * (1 + 1e-6));
        if (trial < 100) tightest = fmin(tightest, bound / exact);
    }
    REPORT("tightest bound/exact - 1 = %.1e", tightest - 1);
    tlsph_material m = soft_material(TLSPH_VON_MISES);
    tlsph_material_state s;
    const tlsph_real I[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double kappa = (double)m.young / 1.2, mu = (double)m.young / 2.6, beta = 3 * kappa * (double)m.expansion;
    REQUIRE_OK(tlsph_material_evaluate(&m, I, m.reference_temperature, &s)); /* exact at rest, isentropic */
    CHECK_CLOSE(1000 * s.c_p * s.c_p, kappa + 4 * mu / 3 + beta * beta * 293.15 / 1000, BOUNDED(1e-9) * kappa);
    CHECK_CLOSE(1000 * s.c_s * s.c_s, mu, BOUNDED(1e-9) * mu);
}
TEST(faults)
{
    tlsph_material m = soft_material(TLSPH_VON_MISES);
    tlsph_material_state s;
    const tlsph_real I[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    m.yield_stress = 0;
    CHECK_RESULT(tlsph_material_evaluate(&m, I, 300, &s), TLSPH_ERROR_MATERIAL);
    m.yield_stress = 1;
    m.hardening = -1;
    CHECK_RESULT(tlsph_material_evaluate(&m, I, 300, &s), TLSPH_ERROR_MATERIAL);
    m.hardening = 0;
    m.plastic_heat = R(1.5);
    CHECK_RESULT(tlsph_material_evaluate(&m, I, 300, &s), TLSPH_ERROR_MATERIAL);
    m.plastic_heat = 1;
    CHECK_RESULT(tlsph_material_evaluate(&m, I, 300, &s), TLSPH_OK);
}

/* ---- moving bodies ---- */

static moving_block plastic_block(tlsph_unknowns unknowns, tlsph_thermal thermal)
{
    moving_block s = moving_block_default();
    s.material = TLSPH_VON_MISES;
    s.unknowns = unknowns;
    s.thermal = thermal;
    return s;
}
static double most_strain(const tlsph_solver *solver)
{
    tlsph_real *e = read_field(solver, TLSPH_FIELD_PLASTIC_STRAIN);
    const double most = e ? largest(e, tlsph_count(solver)) : 0;
    free(e);
    return most;
}
TEST(field_needs_the_material)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver;
    tlsph_real all[64];
    REQUIRE_OK(moving_block_create(&s, &solver, NULL));
    CHECK_RESULT(tlsph_read(solver, TLSPH_FIELD_PLASTIC_STRAIN, all), TLSPH_ERROR_FIELD);
    tlsph_destroy(solver);
}
TEST(checkpoint_continues_bitwise)
{
    for (int k = 0; k < 24; k++) {
        moving_block s = plastic_block((tlsph_unknowns)(k % 4), (tlsph_thermal)(k / 4 % 3));
        tlsph_solver *whole, *resumed;
        size_t size;
        s.dimension = k < 12 ? 3 : 2;
        REQUIRE_OK(moving_block_create(&s, &whole, NULL));
        REQUIRE_OK(moving_block_kick(whole, 0.3));
        REQUIRE_OK(take_steps(whole, 15));
        CHECK(most_strain(whole) > 1e-3);
        unsigned char *saved = save_state(whole, &size);
        REQUIRE(saved);
        REQUIRE_OK(take_steps(whole, 15));
        REQUIRE_OK(moving_block_create(&s, &resumed, NULL));
        REQUIRE_OK(tlsph_restore(resumed, saved, size));
        REQUIRE_OK(take_steps(resumed, 15));
        CHECK(state_hash(whole) == state_hash(resumed));
        free(saved);
        tlsph_destroy(whole);
        tlsph_destroy(resumed);
    }
}
TEST(threads_do_not_matter)
{
    uint64_t hash[2];
    for (int k = 0; k < 2; k++) {
        moving_block s = plastic_block(TLSPH_PFJ, TLSPH_ENTROPY);
        tlsph_solver *solver;
        s.cells = 6;
        s.threads = k ? 3 : 1;
        REQUIRE_OK(moving_block_create(&s, &solver, NULL));
        REQUIRE_OK(moving_block_kick(solver, 0.3));
        REQUIRE_OK(take_steps(solver, 10));
        hash[k] = state_hash(solver);
        tlsph_destroy(solver);
    }
    CHECK(hash[0] == hash[1]);
}
/* The flow of a step starts from its beginning, whatever the stages in between were: the same F, written one after the
   other into a second body, give the same plastic strain to the last bit. */
TEST(stages_do_not_add_up)
{
    moving_block s = plastic_block(TLSPH_PF, TLSPH_ISOTHERMAL);
    tlsph_solver *moving, *still;
    REQUIRE_OK(moving_block_create(&s, &moving, NULL));
    REQUIRE_OK(moving_block_create(&s, &still, NULL));
    REQUIRE_OK(moving_block_kick(moving, 0.3));
    for (int step = 0; step < 60; step++) {
        REQUIRE_OK(take_steps(moving, 1));
        tlsph_real *F = read_field(moving, TLSPH_FIELD_F);
        REQUIRE(F);
        REQUIRE_OK(tlsph_write(still, TLSPH_FIELD_F, F));
        free(F);
        CHECK(most_strain(moving) == most_strain(still));
    }
    tlsph_destroy(moving);
    tlsph_destroy(still);
}
/* A step that turns particles inside out has let others flow before it is given up. */
TEST(failed_step_leaves_the_last_good_state)
{
    moving_block s = plastic_block(TLSPH_PF, TLSPH_ISOTHERMAL);
    tlsph_solver *solver;
    REQUIRE_OK(moving_block_create(&s, &solver, NULL));
    REQUIRE_OK(moving_block_kick(solver, 0.3));
    REQUIRE_OK(take_steps(solver, 15));
    REQUIRE_OK(moving_block_kick(solver, 400));
    const double strain = most_strain(solver);
    const uint64_t hash = state_hash(solver);
    CHECK_RESULT(tlsph_step(solver, 1), TLSPH_ERROR_INVERSION);
    CHECK(strain > 1e-3 && most_strain(solver) == strain);
    CHECK(state_hash(solver) == hash);
    tlsph_destroy(solver);
}

/* A block of 3 x 3 x 3 cells whose particles all follow v = G x: homogeneous, so that the thermal energy and the
   entropy are known from the plastic strain. */
static tlsph_real stretching_rate = R(2);
static void stretching_velocity(void *user, tlsph_real time, size_t count, const uint32_t *particle,
                                const tlsph_real *X, const tlsph_real *x, tlsph_real *values)
{
    (void)user, (void)time, (void)particle, (void)X;
    for (size_t i = 0; i < count; i++) {
        values[3 * i] = stretching_rate * x[3 * i];
        values[3 * i + 1] = -stretching_rate / 2 * x[3 * i + 1];
        values[3 * i + 2] = -stretching_rate / 2 * x[3 * i + 2];
    }
}
static tlsph_solver *driven_block(tlsph_unknowns unknowns, tlsph_thermal thermal, double share)
{
    const int cells[3] = {3, 3, 3};
    own_cloud cloud;
    tlsph_material material = soft_material(TLSPH_VON_MISES);
    tlsph_condition drive = tlsph_condition_default(TLSPH_VELOCITY);
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_solver *solver = NULL;
    material.plastic_heat = R(share);
    material.expansion = 0;
    material.conductivity = 0;
    material.specific_heat = R(0.01); /* 10 J/(m^3 K): some tens of degrees */
    drive.values = stretching_velocity;
    if (!own_box(&cloud, 3, cells, 0.1, 0)) return NULL;
    desc.particles = cloud.particles;
    desc.materials = &material;
    desc.material_count = 1;
    desc.threads = 1;
    desc.conditions = &drive;
    desc.condition_count = 1;
    desc.unknowns = unknowns;
    desc.thermal = thermal;
    CHECK_RESULT(tlsph_create(&desc, &solver, NULL), TLSPH_OK);
    own_cloud_destroy(&cloud);
    return solver;
}
static void check_heat(tlsph_unknowns unknowns, tlsph_thermal thermal, double share)
{
    tlsph_solver *solver = driven_block(unknowns, thermal, share);
    tlsph_ledger l;
    REQUIRE(solver);
    while (tlsph_time(solver) < R(0.1)) REQUIRE_OK(tlsph_step(solver, R(2e-4))); /* a ninth of the yield strain */
    tlsph_ledger_read(solver, &l);
    const double volume = 0.027, strain = most_strain(solver), work = 200 * strain + 1000 * strain * strain;
    CHECK_CLOSE(l.plastic_work, work * volume, 1e-12 * work);
    CHECK(strain > 0.1);
    CHECK_BELOW(fabs(l.energy_residual), (thermal == TLSPH_ENERGY ? 1e-12 : 1e-4) * work * volume);
    if (thermal) { /* adiabatic: the share of the plastic work heats, and makes entropy */
        const double rise = share * work / 10, made = 10 * log(1 + rise / 293.15) * volume;
        CHECK_CLOSE(l.temperature_largest - 293.15, rise, 1e-3 * work / 10);
        CHECK_CLOSE(l.plastic_entropy, made, 1e-3 * made + 1e-15);
        CHECK_CLOSE(l.entropy_residual, 0, thermal == TLSPH_ENTROPY ? 1e-12 : 1e-3 * (made + 0.1));
    }
    REPORT("energy %.1e of the plastic work", l.energy_residual / l.plastic_work);
    tlsph_destroy(solver);
}
TEST(heat_isothermal) { DOUBLE_ONLY(); check_heat(TLSPH_PF, TLSPH_ISOTHERMAL, 0); }
TEST(heat_energy) { DOUBLE_ONLY(); check_heat(TLSPH_PF, TLSPH_ENERGY, 0.9); }
TEST(heat_energy_stored) { DOUBLE_ONLY(); check_heat(TLSPH_PF, TLSPH_ENERGY, 0); }
TEST(heat_energy_all_unknowns) { DOUBLE_ONLY(); check_heat(TLSPH_PFHJ, TLSPH_ENERGY, 1); }
TEST(heat_entropy) { DOUBLE_ONLY(); check_heat(TLSPH_PF, TLSPH_ENTROPY, 0.9); }
TEST(heat_entropy_all_unknowns) { DOUBLE_ONLY(); check_heat(TLSPH_PFHJ, TLSPH_ENTROPY, 1); }

/* A free block that was kicked: energy leaves only by plastic work and dissipation; what the time scheme leaves
   falls with the step. */
TEST(energy_balance_converges)
{
    double rest[2];
    DOUBLE_ONLY();
    for (int k = 0; k < 2; k++) {
        moving_block s = plastic_block(TLSPH_PF, TLSPH_ISOTHERMAL);
        tlsph_solver *solver;
        tlsph_ledger l;
        REQUIRE_OK(moving_block_create(&s, &solver, NULL));
        REQUIRE_OK(moving_block_kick(solver, 0.3));
        while (tlsph_time(solver) < R(0.4999)) REQUIRE_OK(tlsph_step(solver, R(k ? 1e-3 : 2e-3)));
        tlsph_ledger_read(solver, &l);
        CHECK(l.plastic_work > 0.3 * l.dissipation);
        rest[k] = fabs(l.energy_residual) / (l.plastic_work + l.dissipation);
        tlsph_destroy(solver);
    }
    REPORT("%.1e, %.1e of what was lost", rest[0], rest[1]);
    CHECK_BELOW(rest[1], 1e-3);
    CHECK_BELOW(rest[1], rest[0] / 2.5);
}
/* No entropy is destroyed, with plastic heat and conduction. */
TEST(entropy_grows)
{
    for (int k = 0; k < 2; k++) {
        tlsph_solver *solver = driven_block(TLSPH_PFJ, k ? TLSPH_ENERGY : TLSPH_ENTROPY, 0.9);
        double before = 0;
        REQUIRE(solver);
        for (int step = 0; step < 40; step++) {
            tlsph_ledger l;
            REQUIRE_OK(tlsph_step(solver, 1));
            tlsph_ledger_read(solver, &l);
            CHECK(l.plastic_entropy >= before);
            before = l.plastic_entropy;
        }
        CHECK(before > 0);
        tlsph_destroy(solver);
    }
}

SUITE(plasticity, ENTRY(stretching_in_one_step), ENTRY(stretching_in_many_steps), ENTRY(stretching_in_all_unknowns),
      ENTRY(plane_strain), ENTRY(simple_shear_meets_the_flow_rule), ENTRY(objective), ENTRY(repeated_stretches),
      ENTRY(stress_and_entropy_are_derivatives), ENTRY(free_expansion), ENTRY(wave_speeds_are_bounds), ENTRY(faults),
      ENTRY(field_needs_the_material), ENTRY(checkpoint_continues_bitwise), ENTRY(threads_do_not_matter),
      ENTRY(stages_do_not_add_up), ENTRY(failed_step_leaves_the_last_good_state), ENTRY(heat_isothermal), ENTRY(heat_energy),
      ENTRY(heat_energy_stored), ENTRY(heat_energy_all_unknowns), ENTRY(heat_entropy),
      ENTRY(heat_entropy_all_unknowns), ENTRY(energy_balance_converges), ENTRY(entropy_grows))
