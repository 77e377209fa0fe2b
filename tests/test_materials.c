/*
Materials against exact states, against derivatives of their own energies, and against the energies of paper 000.

references/homogeneous_states.csv: E = 50.05 kPa, nu = 0.3, rho = 1000 kg/m^3, alpha = 2.223e-4 1/K, theta_R = 293.15 K,
C_v = 1 J/(kg K) (c_v = rho C_v = 1000 J/(m^3 K)); `frac_mooney` is the share of mu carried by the Mooney term, `q` the
exponent of the Mie-Grueneisen entropy. MEE and Mie-Grueneisen (MG) rows are thermal; neo-Hookean (NH) rows are
isothermal: their theta column means nothing, they are evaluated at theta_R.
*/
#include "support.h"

enum { COLUMN_F = 6, COLUMN_THETA = 15, COLUMN_P = 16, COLUMN_ETA = 25, COLUMN_E, COLUMN_PSI, COLUMN_SF = 28,
       COLUMN_SH = 37, COLUMN_SJ = 46, COLUMN_SPEEDS = 47, SPEEDS = 12, COLUMNS = 60 };
#define MOST_ROWS 100

typedef struct row {
    tlsph_material material;
    double value[COLUMNS]; /* 0 in the columns of text */
    tlsph_real F[9], theta;
} row;

static const tlsph_material_kind nonlinear[3] = {TLSPH_NEO_HOOKEAN, TLSPH_MEE, TLSPH_MIE_GRUNEISEN};

/* ---- the table ---- */

static tlsph_material row_material(const char *model, double mooney, double q)
{
    tlsph_material m = soft_material(!strcmp(model, "MEE")  ? TLSPH_MEE
                                     : !strcmp(model, "MG") ? TLSPH_MIE_GRUNEISEN
                                                            : TLSPH_NEO_HOOKEAN);
    m.mooney_fraction = R(mooney);
    m.gruneisen_exponent = R(q);
    return m;
}

static void read_row(char *line, row *out)
{
    char *cell[COLUMNS], *at = line;
    int i;
    memset(out, 0, sizeof *out);
    for (i = 0; i < COLUMNS; i++) {
        cell[i] = at;
        at += strcspn(at, ",\n");
        if (*at) *at++ = 0;
        out->value[i] = strtod(cell[i], NULL);
    }
    out->material = row_material(cell[0], out->value[2], out->value[3]);
    for (i = 0; i < 9; i++) out->F[i] = R(out->value[COLUMN_F + i]);
    out->theta = out->material.kind == TLSPH_NEO_HOOKEAN ? out->material.reference_temperature
                                                         : R(out->value[COLUMN_THETA]);
}

static int read_rows(row rows[MOST_ROWS])
{
    FILE *file = fopen(REFERENCES "/homogeneous_states.csv", "r");
    char line[4096];
    int count = 0, number = 0;
    if (!file) return 0;
    while (fgets(line, sizeof line, file) && count < MOST_ROWS)
        if (number++ > 0) read_row(line, &rows[count++]);
    fclose(file);
    return count;
}

/* The columns [first, first + count) against `found`; `part` scales the rounding: the largest term of the sums. */
static void compare(const row *r, int first, int count, const tlsph_real *found, double part)
{
    double scale = 0;
    int i;
    for (i = 0; i < count; i++) scale = fmax(scale, fabs(r->value[first + i]));
    for (i = 0; i < count; i++) CHECK_CLOSE(found[i], r->value[first + i], 1e-10 * scale + 50 * EPSILON * part);
}

static void compare_row(const row *r)
{
    tlsph_material_state s;
    tlsph_result result = tlsph_material_evaluate(&r->material, r->F, r->theta, &s);
    double stress = 0, energy = fmax(fabs(r->value[COLUMN_E]), 300.0 * fabs(r->value[COLUMN_ETA])) + 5e4;
    int i;
    if (!CHECK_RESULT(result, TLSPH_OK)) return;
    for (i = COLUMN_SF; i <= COLUMN_SJ; i++) stress = fmax(stress, fabs(r->value[i]));
    compare(r, COLUMN_P, 9, s.P, stress);
    compare(r, COLUMN_SF, 9, s.Sigma_F, stress);
    compare(r, COLUMN_SH, 9, s.Sigma_H, stress);
    compare(r, COLUMN_SJ, 1, &s.Sigma_J, stress);
    compare(r, COLUMN_ETA, 1, &s.eta, energy / 293);
    compare(r, COLUMN_E, 1, &s.internal_energy, energy);
    compare(r, COLUMN_PSI, 1, &s.helmholtz, energy);
    CHECK_CLOSE(s.theta, r->theta, 2 * EPSILON * (double)r->theta);
}

TEST(exact_states)
{
    static row rows[MOST_ROWS];
    int i, count = read_rows(rows);
    CHECK_SAME(count, 75);
    for (i = 0; i < count; i++) compare_row(&rows[i]);
}

/* ---- wave speeds ---- */

/* P at fixed entropy: the temperature follows from eta = eta_R(F) + c_v ln(theta / theta_R). */
static int isentropic_stress(const tlsph_material *m, const tlsph_real F[9], tlsph_real theta, double eta, tlsph_real P[9])
{
    tlsph_material_state s;
    double c_v = (double)m->density * (double)m->specific_heat;
    if (tlsph_material_evaluate(m, F, theta, &s)) return 0;
    if (m->kind != TLSPH_NEO_HOOKEAN) {
        theta = R((double)theta * exp((eta - (double)s.eta) / c_v));
        if (tlsph_material_evaluate(m, F, theta, &s)) return 0;
    }
    memcpy(P, s.P, sizeof s.P);
    return 1;
}

/* A[iI][kK] = dP_iI / dF_kK at fixed entropy by fourth-order differences. */
static int acoustic_tangent(const tlsph_material *m, const tlsph_real F[9], tlsph_real theta, double A[9][9])
{
    static const double weight[4] = {1.0 / 12, -2.0 / 3, 2.0 / 3, -1.0 / 12};
    double step = 1e-3;
    tlsph_material_state s;
    int k, point, i;
    if (tlsph_material_evaluate(m, F, theta, &s)) return 0;
    memset(A, 0, 81 * sizeof(double));
    for (k = 0; k < 9; k++)
        for (point = 0; point < 4; point++) {
            tlsph_real G[9], P[9];
            memcpy(G, F, sizeof G);
            G[k] += R(step * (point < 2 ? point - 2 : point - 1));
            if (!isentropic_stress(m, G, theta, (double)s.eta, P)) return 0;
            for (i = 0; i < 9; i++) A[i][k] += weight[point] * (double)P[i] / step;
        }
    return 1;
}

static double norm3(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/* Largest eigenvalue of the symmetric matrix Q by power iterations on Q + shift (positive definite); n: its vector. */
static double largest_eigenvalue(double Q[3][3], double n[3])
{
    double shift = 0, length = 1;
    int i, k, round;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) shift += fabs(Q[i][k]) / 3;
    for (round = 0; round < 60; round++) {
        double m[3];
        for (i = 0; i < 3; i++) m[i] = Q[i][0] * n[0] + Q[i][1] * n[1] + Q[i][2] * n[2] + shift * n[i];
        length = norm3(m);
        for (i = 0; i < 3; i++) n[i] = m[i] / length;
    }
    return length - shift;
}

/* Largest of n.Q(N).n over the polarisation n for the direction N; with `by_direction` the roles change. */
static double largest_over(double A[9][9], const double fixed[3], double free_vector[3], int by_direction)
{
    double Q[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    int i, k, I, K;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++)
            for (I = 0; I < 3; I++)
                for (K = 0; K < 3; K++)
                    Q[i][k] += by_direction ? A[3 * I + i][3 * K + k] * fixed[I] * fixed[K]
                                            : A[3 * i + I][3 * k + K] * fixed[I] * fixed[K];
    for (i = 0; i < 3; i++)
        for (k = 0; k < i; k++) Q[i][k] = Q[k][i] = 0.5 * (Q[i][k] + Q[k][i]);
    return largest_eigenvalue(Q, free_vector);
}

/* Largest wave speed over all directions: a scan of the half sphere, each direction improved by turns of N and n. */
static double exact_speed(double A[9][9], double rho)
{
    double most = 0;
    int i, j, turn;
    for (i = 0; i < 8; i++)
        for (j = 0; j < 12; j++) {
            double polar = PI / 2 * (i + 0.5) / 8, turned = 2 * PI * j / 12, value = 0;
            double N[3], n[3] = {0.6, 0.5, 0.4};
            N[0] = sin(polar) * cos(turned);
            N[1] = sin(polar) * sin(turned);
            N[2] = cos(polar);
            memcpy(n, N, sizeof n); /* longitudinal at first */
            n[0] += 0.1;
            for (turn = 0; turn < 4; turn++) {
                (void)largest_over(A, N, n, 0);
                value = largest_over(A, n, N, 1);
            }
            most = fmax(most, value);
        }
    return sqrt(most / rho);
}

TEST(wave_speed_bounds_tabulated_speeds)
{
    static row rows[MOST_ROWS];
    int i, k, count = read_rows(rows);
    CHECK_SAME(count, 75);
    for (i = 0; i < count; i++) {
        tlsph_material_state s;
        REQUIRE_OK(tlsph_material_evaluate(&rows[i].material, rows[i].F, rows[i].theta, &s));
        for (k = 0; k < SPEEDS; k++) CHECK_BELOW(rows[i].value[COLUMN_SPEEDS + k], (double)s.c_p * (1 + 10 * EPSILON));
        CHECK(s.c_s > 0 && s.c_s <= s.c_p);
    }
}

/* The scan must find the tabulated speeds (it is the judge of the next test). */
TEST(scan_finds_tabulated_speeds)
{
    static row rows[MOST_ROWS];
    int i, count;
    DOUBLE_ONLY();
    count = read_rows(rows);
    for (i = 0; i < count; i++) {
        double A[9][9], speed, tabulated = 0;
        double N[3] = {1, 0, 0}, n[3] = {0.9, 0.3, 0.2};
        int k;
        for (k = 3; k < 6; k++) tabulated = fmax(tabulated, rows[i].value[COLUMN_SPEEDS + k]); /* E1, isentropic */
        REQUIRE(acoustic_tangent(&rows[i].material, rows[i].F, rows[i].theta, A));
        speed = sqrt(largest_over(A, N, n, 0) / (double)rows[i].material.density);
        CHECK_CLOSE(speed, tabulated, 1e-6 * tabulated);
    }
}

TEST(wave_speed_bound_is_sharp)
{
    static row rows[MOST_ROWS];
    int i, count;
    double sum = 0, least = 1e9, most = 0;
    DOUBLE_ONLY();
    count = read_rows(rows);
    CHECK_SAME(count, 75);
    for (i = 0; i < count; i++) {
        double A[9][9], ratio;
        tlsph_material_state s;
        REQUIRE(acoustic_tangent(&rows[i].material, rows[i].F, rows[i].theta, A));
        REQUIRE_OK(tlsph_material_evaluate(&rows[i].material, rows[i].F, rows[i].theta, &s));
        ratio = (double)s.c_p / exact_speed(A, (double)rows[i].material.density);
        CHECK(ratio >= 1 - 1e-6);
        sum += ratio;
        least = fmin(least, ratio);
        most = fmax(most, ratio);
    }
    REPORT("c_p / exact: mean %.4f, least %.4f, most %.4f", sum / count, least, most);
    CHECK_CLOSE(sum / count, 1, 0.15);
}

/* Small random states beyond the table: the bound must hold there, too. */
TEST(wave_speed_bounds_random_states)
{
    uint64_t seed = 11;
    int trial, kind;
    DOUBLE_ONLY();
    for (trial = 0; trial < 20; trial++)
        for (kind = 0; kind < 3; kind++) {
            tlsph_material m = soft_material(nonlinear[kind]);
            tlsph_material_state s;
            tlsph_real F[9], theta = R(random_between(&seed, 200, 500));
            double A[9][9];
            m.poisson = R(trial % 2 ? 0.3 : 0.49);
            m.mooney_fraction = R(trial % 3 * 0.5);
            random_deformation(&seed, 0.5, F);
            REQUIRE(acoustic_tangent(&m, F, theta, A));
            REQUIRE_OK(tlsph_material_evaluate(&m, F, theta, &s));
            CHECK_BELOW(exact_speed(A, (double)m.density), (double)s.c_p * (1 + 1e-6));
        }
}

/* ---- derivatives ---- */

static double helmholtz(const tlsph_material *m, const tlsph_real F[9], double theta)
{
    tlsph_material_state s;
    return tlsph_material_evaluate(m, F, R(theta), &s) ? (double)NAN : (double)s.helmholtz;
}

static double helmholtz_slope(const tlsph_material *m, const tlsph_real F[9], double theta, int k)
{
    double step = 2e-3, psi[4];
    int point;
    for (point = 0; point < 4; point++) {
        tlsph_real G[9];
        memcpy(G, F, sizeof G);
        G[k] += R(step * (point < 2 ? point - 2 : point - 1));
        psi[point] = helmholtz(m, G, theta);
    }
    return (psi[0] - 8 * psi[1] + 8 * psi[2] - psi[3]) / (12 * step);
}

TEST(stress_is_the_derivative_of_helmholtz_energy)
{
    static const tlsph_material_kind kinds[4] = {TLSPH_LINEAR, TLSPH_NEO_HOOKEAN, TLSPH_MEE, TLSPH_MIE_GRUNEISEN};
    uint64_t seed = 5;
    int kind, trial, k;
    DOUBLE_ONLY();
    for (kind = 0; kind < 4; kind++)
        for (trial = 0; trial < 10; trial++) {
            tlsph_material m = soft_material(kinds[kind]);
            tlsph_material_state s;
            tlsph_real F[9];
            double theta = random_between(&seed, 250, 350);
            m.mooney_fraction = R(0.1 * trial);
            m.gruneisen_exponent = R(trial % 4 ? 0.3 * (trial % 4) : 0); /* q = 0: the logarithm */
            random_deformation(&seed, 0.2, F);
            REQUIRE_OK(tlsph_material_evaluate(&m, F, R(theta), &s));
            for (k = 0; k < 9; k++) CHECK_CLOSE(s.P[k], helmholtz_slope(&m, F, theta, k), 1e-7 * (double)m.young);
        }
}

/* eta = -d psi / d theta, psi = e - theta eta, c_v = d e / d theta */
TEST(thermal_relations)
{
    static const tlsph_material_kind kinds[3] = {TLSPH_LINEAR, TLSPH_MEE, TLSPH_MIE_GRUNEISEN};
    uint64_t seed = 6;
    int kind, trial;
    DOUBLE_ONLY();
    for (kind = 0; kind < 3; kind++)
        for (trial = 0; trial < 10; trial++) {
            tlsph_material m = soft_material(kinds[kind]);
            tlsph_material_state s, warm;
            tlsph_real F[9];
            double theta = random_between(&seed, 250, 350), step = 0.5, slope;
            random_deformation(&seed, 0.2, F);
            REQUIRE_OK(tlsph_material_evaluate(&m, F, R(theta), &s));
            REQUIRE_OK(tlsph_material_evaluate(&m, F, R(theta + 10), &warm));
            slope = (helmholtz(&m, F, theta - 2 * step) - 8 * helmholtz(&m, F, theta - step) +
                     8 * helmholtz(&m, F, theta + step) - helmholtz(&m, F, theta + 2 * step)) / (12 * step);
            CHECK_CLOSE(s.eta, -slope, 1e-6 * fabs(slope) + 1e-6);
            CHECK_CLOSE(s.helmholtz, s.internal_energy - s.theta * s.eta, 1e-9 * fabs((double)s.internal_energy));
            CHECK_CLOSE(warm.internal_energy - s.internal_energy, 1000.0 * 10, 1e-6 * 1e4);
        }
}

/* ---- the energies of 000 (26)-(32) with independent F, H, J ---- */

typedef struct constants { double mu, kappa, zeta, xi, chi, cG, theta_R, q; } constants;

static constants constants_of(const tlsph_material *m)
{
    constants c;
    double E = (double)m->young, nu = (double)m->poisson;
    c.mu = E / (2 * (1 + nu));
    c.kappa = E / (3 * (1 - 2 * nu));
    c.xi = (double)m->mooney_fraction * c.mu / (3 * sqrt(3.0));
    c.zeta = (1 - (double)m->mooney_fraction) * c.mu / 2;
    c.cG = 3 * c.kappa * (double)m->expansion; /* c_v Gamma_0 */
    c.theta_R = (double)m->reference_temperature;
    c.q = (double)m->gruneisen_exponent;
    c.chi = m->kind == TLSPH_MIE_GRUNEISEN ? c.kappa - c.cG * c.theta_R * (1 - c.q) : c.kappa;
    return c;
}

static double square_sum(const double T[9])
{
    double sum = 0;
    int i;
    for (i = 0; i < 9; i++) sum += T[i] * T[i];
    return sum;
}

/* psi_R of (28), which is also the elastic part of (30) and of the neo-Hookean material */
static double elastic_energy(const constants *c, const double X[19])
{
    double J = X[18];
    return c->zeta * (pow(J, -2.0 / 3) * square_sum(X) - 3) + c->xi * (pow(square_sum(X + 9), 1.5) / (J * J) - 3 * sqrt(3.0)) +
           c->chi / 2 * (J - 1) * (J - 1);
}

/* psi(X, theta) = e_R - theta eta_R + thermal terms; at fixed X the derivative by F, H, J at fixed theta is that of
   the internal energy at fixed entropy, Sigma. X: F, H, J. */
static double paper_helmholtz(const tlsph_material *m, const constants *c, const double X[19], double theta)
{
    double J = X[18], elastic = elastic_energy(c, X), volume = c->cG * c->theta_R * (J - 1);
    if (m->kind == TLSPH_NEO_HOOKEAN) return elastic;
    if (m->kind == TLSPH_MEE) return volume - theta / c->theta_R * (volume - elastic);
    return elastic + volume - theta * c->cG * (c->q > 0 ? (pow(J, c->q) - 1) / c->q : log(J));
}

static double paper_slope(const tlsph_material *m, const constants *c, const double X[19], double theta, int k)
{
    double Y[19], step = 2e-3, psi[4];
    int point;
    for (point = 0; point < 4; point++) {
        memcpy(Y, X, sizeof Y);
        Y[k] += step * (point < 2 ? point - 2 : point - 1);
        psi[point] = paper_helmholtz(m, c, Y, theta);
    }
    return (psi[0] - 8 * psi[1] + 8 * psi[2] - psi[3]) / (12 * step);
}

static void check_conjugates(const tlsph_material *m, const tlsph_real F[9], double theta)
{
    constants c = constants_of(m);
    tlsph_material_state s;
    tlsph_real H[9];
    double X[19], tolerance = 1e-7 * (double)m->young;
    int k;
    if (!CHECK_RESULT(tlsph_material_evaluate(m, F, R(theta), &s), TLSPH_OK)) return;
    tlsph_cofactor(F, H);
    for (k = 0; k < 9; k++) { X[k] = (double)F[k]; X[9 + k] = (double)H[k]; }
    X[18] = (double)tlsph_determinant(F);
    for (k = 0; k < 9; k++) {
        CHECK_CLOSE(s.Sigma_F[k], paper_slope(m, &c, X, theta, k), tolerance);
        CHECK_CLOSE(s.Sigma_H[k], paper_slope(m, &c, X, theta, 9 + k), tolerance);
    }
    CHECK_CLOSE(s.Sigma_J, paper_slope(m, &c, X, theta, 18), tolerance);
}

TEST(conjugates_are_derivatives_of_the_papers_energies)
{
    uint64_t seed = 8;
    int kind, trial;
    DOUBLE_ONLY();
    for (kind = 0; kind < 3; kind++)
        for (trial = 0; trial < 10; trial++) {
            tlsph_material m = soft_material(nonlinear[kind]);
            tlsph_real F[9];
            m.mooney_fraction = R(0.1 * trial);
            m.gruneisen_exponent = R(trial % 4 ? 0.3 * (trial % 4) : 0);
            random_deformation(&seed, 0.2, F);
            check_conjugates(&m, F, random_between(&seed, 250, 350));
        }
}

/* P = Sigma_F + Sigma_H x F + Sigma_J H (000-12) */
TEST(stress_is_made_of_conjugates)
{
    uint64_t seed = 9;
    int kind, trial, k;
    for (kind = 0; kind < 3; kind++)
        for (trial = 0; trial < 10; trial++) {
            tlsph_material m = soft_material(nonlinear[kind]);
            tlsph_material_state s;
            tlsph_real F[9], H[9], crossed[9];
            m.mooney_fraction = R(0.5);
            random_deformation(&seed, 0.3, F);
            REQUIRE_OK(tlsph_material_evaluate(&m, F, 320, &s));
            tlsph_cofactor(F, H);
            tlsph_cross(s.Sigma_H, F, crossed);
            for (k = 0; k < 9; k++)
                CHECK_CLOSE(s.P[k], s.Sigma_F[k] + crossed[k] + s.Sigma_J * H[k],
                            100 * EPSILON * ((double)m.young + fabs((double)s.Sigma_J) + largest(s.Sigma_F, 9)));
        }
}

/* ---- invariance ---- */

static void check_invariance(const tlsph_material *m, const tlsph_real F[9], const tlsph_real Q[9])
{
    tlsph_material_state s, turned;
    tlsph_real QF[9], QP[9];
    double scale;
    int i, j, k;
    multiply(Q, F, QF);
    if (!CHECK_RESULT(tlsph_material_evaluate(m, F, 310, &s), TLSPH_OK)) return;
    if (!CHECK_RESULT(tlsph_material_evaluate(m, QF, 310, &turned), TLSPH_OK)) return;
    scale = (double)m->young + fabs((double)s.Sigma_J) + largest(s.P, 9);
    multiply(Q, s.P, QP);
    for (i = 0; i < 9; i++) CHECK_CLOSE(turned.P[i], QP[i], 200 * EPSILON * scale);
    CHECK_CLOSE(turned.helmholtz, s.helmholtz, 200 * EPSILON * (scale + fabs((double)s.internal_energy) + 1e5));
    CHECK_CLOSE(turned.c_p, s.c_p, 100 * EPSILON * (double)s.c_p);
    for (i = 0; i < 3; i++)
        for (j = 0; j < i; j++) {
            double skew = 0; /* of P F^T */
            for (k = 0; k < 3; k++)
                skew += (double)s.P[3 * i + k] * (double)F[3 * j + k] - (double)s.P[3 * j + k] * (double)F[3 * i + k];
            CHECK_CLOSE(skew, 0, 200 * EPSILON * scale);
        }
}

TEST(objective_with_symmetric_cauchy_stress)
{
    uint64_t seed = 10;
    int kind, trial;
    for (kind = 0; kind < 3; kind++)
        for (trial = 0; trial < 20; trial++) {
            tlsph_material m = soft_material(nonlinear[kind]);
            tlsph_real F[9], Q[9];
            m.mooney_fraction = R(trial % 2 * 0.4);
            m.gruneisen_exponent = R(trial % 3 * 0.5);
            random_deformation(&seed, 0.4, F);
            random_rotation(&seed, Q);
            check_invariance(&m, F, Q);
        }
}

TEST(reference_state)
{
    static const tlsph_material_kind kinds[4] = {TLSPH_LINEAR, TLSPH_NEO_HOOKEAN, TLSPH_MEE, TLSPH_MIE_GRUNEISEN};
    static const tlsph_real I[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    int kind;
    for (kind = 0; kind < 4; kind++) {
        tlsph_material m = soft_material(kinds[kind]);
        tlsph_material_state s;
        double mu = (double)m.young / 2.6, lambda_2mu = mu * 3.5;
        m.mooney_fraction = R(0.3);
        m.gruneisen_exponent = R(0.7);
        REQUIRE_OK(tlsph_material_evaluate(&m, I, m.reference_temperature, &s));
        CHECK_BELOW(largest(s.P, 9), 50 * EPSILON * (double)m.young);
        CHECK_CLOSE(s.eta, 0, 100 * EPSILON * 1000);
        CHECK_CLOSE(s.helmholtz, 0, 100 * EPSILON * (double)m.young);
        CHECK_BELOW(sqrt(lambda_2mu / 1000), (double)s.c_p * (1 + 10 * EPSILON));
        CHECK_BELOW(s.c_p, 1.25 * sqrt(lambda_2mu / 1000));
        CHECK_CLOSE(s.c_s, sqrt(mu / 1000), 0.1 * sqrt(mu / 1000));
    }
}

/* ---- linear material ---- */

TEST(linear_material_is_hookes_law)
{
    uint64_t seed = 12;
    int trial, i, j;
    for (trial = 0; trial < 20; trial++) {
        tlsph_material m = soft_material(TLSPH_LINEAR);
        tlsph_material_state s;
        tlsph_real F[9], theta = R(random_between(&seed, 200, 400));
        double mu = (double)m.young / 2.6, lambda = mu * 1.5, heat, trace;
        random_deformation(&seed, 0.1, F);
        REQUIRE_OK(tlsph_material_evaluate(&m, F, theta, &s));
        trace = (double)F[0] + (double)F[4] + (double)F[8] - 3;
        heat = (3 * lambda + 2 * mu) * (double)m.expansion * ((double)theta - 293.15);
        for (i = 0; i < 3; i++)
            for (j = 0; j < 3; j++) {
                double strain = 0.5 * ((double)F[3 * i + j] + (double)F[3 * j + i]) - (i == j);
                CHECK_CLOSE(s.P[3 * i + j], 2 * mu * strain + (i == j ? lambda * trace - heat : 0),
                            50 * EPSILON * (double)m.young);
            }
    }
}

/* ---- the host's own material ---- */

/* Compressible neo-Hookean with thermal pressure, P = mu (F - H/J) + (kappa (J - 1) - b (theta - theta_R)) H, once with
   the volumetric part in e_J, once with all in e_F (then `user` is not NULL). */
static void user_response(void *user, size_t count, const uint32_t *particle, const tlsph_real *F, const tlsph_real *J,
                          tlsph_response *out)
{
    size_t a;
    int i;
    (void)particle;
    for (a = 0; a < count; a++) {
        tlsph_real H[9], d = J[a], slope = 40000 * (d - 1) + 27 * 300 - 19000 / d, I1 = 0;
        memset(&out[a], 0, sizeof out[a]);
        tlsph_cofactor(F + 9 * a, H);
        for (i = 0; i < 9; i++) I1 += F[9 * a + (size_t)i] * F[9 * a + (size_t)i];
        out[a].energy = R(9500) * (I1 - 3) - 19000 * R(log((double)d)) + 20000 * (d - 1) * (d - 1) + 27 * 300 * (d - 1);
        out[a].entropy = 27 * (d - 1);
        for (i = 0; i < 9; i++) {
            out[a].e_F[i] = 19000 * F[9 * a + (size_t)i] + (user ? slope * H[i] : 0);
            out[a].eta_F[i] = user ? 27 * H[i] : 0;
        }
        out[a].e_J = user ? 0 : slope;
        out[a].eta_J = user ? 0 : 27;
        out[a].p_modulus[0] = 200000;
        out[a].s_modulus[0] = 50000;
    }
}

static void check_user_material(int all_in_F)
{
    static const tlsph_real F[9] = {R(1.1), R(0.05), 0, R(-0.1), R(0.9), R(0.02), R(0.03), 0, R(1.05)};
    tlsph_material m = soft_material(TLSPH_USER);
    tlsph_material_state s;
    tlsph_real H[9];
    double J = (double)tlsph_determinant(F);
    int i;
    m.reference_temperature = 300;
    m.response = user_response;
    m.response_user = all_in_F ? &m : NULL;
    if (!CHECK_RESULT(tlsph_material_evaluate(&m, F, 330, &s), TLSPH_OK)) return;
    tlsph_cofactor(F, H);
    for (i = 0; i < 9; i++) {
        double p = 40000 * (J - 1) - 19000 / J - 27.0 * 30;
        CHECK_CLOSE(s.P[i], 19000 * (double)F[i] + p * (double)H[i], 200 * EPSILON * 5e4);
    }
    CHECK_CLOSE(s.eta, 27 * (J - 1) + 1000 * log(1.1), 200 * EPSILON * 100);
    CHECK_CLOSE(s.c_p, sqrt(200.0), 1e-5 * sqrt(200.0));
}

TEST(user_material)
{
    check_user_material(0);
    check_user_material(1);
}

/* ---- refusals ---- */

static tlsph_result evaluate_with(void (*spoil)(tlsph_material *), tlsph_real theta, tlsph_real first)
{
    tlsph_real F[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    tlsph_material m = soft_material(TLSPH_MIE_GRUNEISEN);
    tlsph_material_state s;
    F[0] = first;
    if (spoil) spoil(&m);
    return tlsph_material_evaluate(&m, F, theta, &s);
}
static void no_stiffness(tlsph_material *m) { m->young = 0; }
static void too_incompressible(tlsph_material *m) { m->poisson = R(0.5); }

TEST(refusals)
{
    CHECK_RESULT(evaluate_with(NULL, 300, 1), TLSPH_OK);
    CHECK_RESULT(evaluate_with(no_stiffness, 300, 1), TLSPH_ERROR_MATERIAL);
    CHECK_RESULT(evaluate_with(too_incompressible, 300, 1), TLSPH_ERROR_MATERIAL);
    CHECK_RESULT(evaluate_with(NULL, 300, -1), TLSPH_ERROR_INVERSION);
    CHECK_RESULT(evaluate_with(NULL, 300, 0), TLSPH_ERROR_INVERSION);
    CHECK_RESULT(evaluate_with(NULL, 0, 1), TLSPH_ERROR_TEMPERATURE);
    CHECK_RESULT(evaluate_with(NULL, -5, 1), TLSPH_ERROR_TEMPERATURE);
}

SUITE(materials, ENTRY(exact_states), ENTRY(wave_speed_bounds_tabulated_speeds), ENTRY(scan_finds_tabulated_speeds),
      ENTRY(wave_speed_bound_is_sharp), ENTRY(wave_speed_bounds_random_states),
      ENTRY(stress_is_the_derivative_of_helmholtz_energy), ENTRY(thermal_relations),
      ENTRY(conjugates_are_derivatives_of_the_papers_energies), ENTRY(stress_is_made_of_conjugates),
      ENTRY(objective_with_symmetric_cauchy_stress), ENTRY(reference_state), ENTRY(linear_material_is_hookes_law),
      ENTRY(user_material), ENTRY(refusals))
