/* Operators of 002: corrected kernels of order 0 and 1, bond-based gradients, their forces; JST dissipation; pairwise time
   step. The oracle differentiates the corrected kernel numerically and sums the bonds one by one, as (39) is written. */
#include "support.h"

static const tlsph_operator_kind kinds[4] = {TLSPH_ZEROTH_KERNEL, TLSPH_FIRST_KERNEL, TLSPH_ZEROTH_BOND, TLSPH_BOND};

typedef struct sample {
    int dimension;
    double support, jitter;
    tlsph_operator_kind kind;
    tlsph_force_form form;
    tlsph_thermal thermal;
    tlsph_dissipation dissipation;
    int projection;
} sample;

static tlsph_material rubber(void) {
    tlsph_material m = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    m.density = 1100;
    m.young = R(17e6);
    m.poisson = R(0.3);
    m.specific_heat = 1500;
    m.conductivity = 200;
    return m;
}

static tlsph_solver *make(const sample *q, own_cloud *cloud) {
    const int cells[3] = {5, 4, 3};
    const tlsph_material m = rubber();
    tlsph_desc desc = tlsph_desc_default(q->dimension);
    tlsph_solver *solver = NULL;
    tlsph_error error;
    if (!own_box(cloud, q->dimension, cells, 0.25, q->jitter)) return NULL;
    desc.particles = cloud->particles;
    desc.materials = &m;
    desc.material_count = 1;
    desc.kernel = TLSPH_CUBIC_SPLINE;
    desc.operator_kind = q->kind;
    desc.force_form = q->form;
    desc.support = R(q->support);
    desc.thermal = q->thermal;
    desc.dissipation = q->dissipation;
    desc.projection = q->projection;
    desc.threads = 1;
    desc.keep_pairs = 1;
    if (!CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_OK)) printf("    %s\n", error.message);
    return solver;
}

static sample free_sample(int dimension, tlsph_operator_kind kind) {
    sample q = {3, 1.0, 0.2, TLSPH_BOND, TLSPH_ADJOINT, TLSPH_ISOTHERMAL, TLSPH_NO_DISSIPATION, 0};
    q.dimension = dimension;
    q.kind = kind;
    return q;
}

/* ---- the oracle ---- */

static int is_first(tlsph_operator_kind kind) { return kind == TLSPH_FIRST_KERNEL || kind == TLSPH_BOND; }

/* Solves A x = b of size n <= 4 by elimination with pivots. */
static void solve(int n, double A[4][4], double b[4], double x[4]) {
    for (int c = 0; c < n; c++) {
        int pivot = c;
        for (int r = c; r < n; r++)
            if (fabs(A[r][c]) > fabs(A[pivot][c])) pivot = r;
        for (int k = 0; k < n; k++) { const double t = A[c][k]; A[c][k] = A[pivot][k]; A[pivot][k] = t; }
        { const double t = b[c]; b[c] = b[pivot]; b[pivot] = t; }
        for (int r = 0; r < n; r++) {
            const double f = A[r][c] / A[c][c];
            for (int k = 0; r != c && k < n; k++) A[r][k] -= f * A[c][k];
            if (r != c) b[r] -= f * b[c];
        }
    }
    for (int c = 0; c < n; c++) x[c] = b[c] / A[c][c];
}

static double plain_kernel(const own_cloud *cloud, int dimension, const double x[3], size_t b, double h, double d[3]) {
    double square = 0;
    tlsph_real W, dW;
    for (int i = 0; i < 3; i++) {
        d[i] = i < dimension ? (double)cloud->positions[3 * b + (size_t)i] - x[i] : 0;
        square += d[i] * d[i];
    }
    tlsph_kernel_evaluate(TLSPH_CUBIC_SPLINE, dimension, R(sqrt(square)), R(h), &W, &dW);
    return (double)W;
}

/* w_b W~_b(x) for all b: reproduces constants, and with `first` linear functions, at any place x. */
static void corrected(const own_cloud *cloud, int dimension, const double x[3], double h, int first, double *out) {
    const int n = first ? 1 + dimension : 1;
    const size_t count = cloud->particles.count;
    double A[4][4] = {{0}}, b[4] = {1, 0, 0, 0}, c[4], d[3];
    for (size_t k = 0; k < count; k++) {
        const double W = plain_kernel(cloud, dimension, x, k, h, d) * (double)cloud->weights[k];
        const double base[4] = {1, d[0], d[1], d[2]};
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) A[i][j] += W * base[i] * base[j];
    }
    solve(n, A, b, c);
    for (size_t k = 0; k < count; k++) {
        out[k] = c[0] * plain_kernel(cloud, dimension, x, k, h, d) * (double)cloud->weights[k];
        for (int i = 1; i < n; i++) out[k] *= i == 1 ? 1 + (c[1] * d[0] + (n > 2 ? c[2] * d[1] : 0) + (n > 3 ? c[3] * d[2] : 0)) / c[0] : 1;
    }
}

static double curved(const double X[3]) { return sin(1.3 * X[0] + 0.4) + X[1] * X[1] - 0.7 * X[0] * X[2] + cos(X[2]); }

static void position_of(const own_cloud *cloud, int dimension, size_t a, double X[3]) {
    for (int i = 0; i < 3; i++) X[i] = i < dimension ? (double)cloud->positions[3 * a + (size_t)i] : 0;
}

/* F^c of a scalar field at particle a, by (39), from a numerical derivative of the kernel. work: 3 x count. */
static void oracle(const own_cloud *cloud, const sample *q, size_t a, double out[3], double *work) {
    const size_t n = cloud->particles.count;
    const double h = 0.25 * q->support, step = 1e-5;
    double X[3], grad[3] = {0}, moment[4][4] = {{0}}, *up = work, *down = work + n, *W = work + 2 * n, x[3], d[3];
    position_of(cloud, q->dimension, a, X);
    for (int i = 0; i < q->dimension; i++) {
        for (int j = 0; j < 3; j++) x[j] = X[j] + (j == i ? step : 0);
        corrected(cloud, q->dimension, x, h, is_first(q->kind), up);
        x[i] -= 2 * step;
        corrected(cloud, q->dimension, x, h, is_first(q->kind), down);
        for (size_t b = 0; b < n; b++) {
            const double slope = (up[b] - down[b]) / (2 * step);
            position_of(cloud, q->dimension, b, x);
            grad[i] += slope * (curved(x) - curved(X));
            for (int j = 0; j < q->dimension; j++) moment[i][j] += slope * (x[j] - X[j]);
        }
    }
    if (!is_first(q->kind)) { /* L of (11) */
        double c[4], b[4] = {grad[0], grad[1], grad[2], 0};
        solve(q->dimension, moment, b, c);
        for (int i = 0; i < q->dimension; i++) grad[i] = c[i];
    }
    for (int i = 0; i < 3; i++) out[i] = grad[i];
    if (q->kind != TLSPH_BOND && q->kind != TLSPH_ZEROTH_BOND) return;
    corrected(cloud, q->dimension, X, h, is_first(q->kind), W);
    for (int i = 0; i < 3; i++) out[i] = W[a] * grad[i];
    for (size_t b = 0; b < n; b++) {
        double r = 0, along = 0;
        if (b == a) continue;
        position_of(cloud, q->dimension, b, x);
        for (int i = 0; i < 3; i++) { d[i] = x[i] - X[i]; r += d[i] * d[i]; }
        r = sqrt(r);
        for (int i = 0; i < 3; i++) along += grad[i] * d[i] / r;
        for (int i = 0; i < 3; i++) out[i] += W[b] * (grad[i] - along * d[i] / r + (curved(x) - curved(X)) / r * d[i] / r);
    }
}

/* Gradient of f at every particle by the solver's operator. */
static void by_operator(const tlsph_solver *solver, const own_cloud *cloud, int dimension, double (*f)(const double *),
                        double *out) {
    tlsph_operator view;
    tlsph_operator_view(solver, &view);
    for (size_t a = 0; a < view.count; a++) {
        double *grad = out + 3 * view.host[a], A[3], B[3];
        grad[0] = grad[1] = grad[2] = 0;
        position_of(cloud, dimension, view.host[a], A);
        for (size_t k = view.first[a]; k < view.first[a + 1]; k++) {
            position_of(cloud, dimension, view.host[view.neighbours[k]], B);
            for (int i = 0; i < dimension; i++) {
                const size_t at = (size_t)dimension * k + (size_t)i;
                grad[i] += (f(B) - f(A)) * (double)(view.vectors[at] + view.rests[at]) / (2 * (double)view.volumes[a]);
            }
        }
    }
}

TEST(agrees_with_the_sum_over_bonds) {
    DOUBLE_ONLY();
    for (int i = 0; i < 8; i++) {
        const sample q = free_sample(2 + i / 4, kinds[i % 4]);
        own_cloud cloud;
        tlsph_solver *solver = make(&q, &cloud);
        double worst = 0;
        REQUIRE(solver != NULL);
        const size_t n = cloud.particles.count;
        double *grad = malloc(6 * n * sizeof *grad), expected[3];
        REQUIRE(grad != NULL);
        by_operator(solver, &cloud, q.dimension, curved, grad);
        for (size_t a = 0; a < n; a += q.dimension == 3 ? 7 : 1) {
            oracle(&cloud, &q, a, expected, grad + 3 * n);
            for (int k = 0; k < q.dimension; k++) worst = fmax(worst, fabs(grad[3 * a + (size_t)k] - expected[k]));
        }
        CHECK_BELOW(worst, 2e-7);
        free(grad);
        tlsph_destroy(solver);
        own_cloud_destroy(&cloud);
    }
}

static double linear(const double X[3]) { return 2 + 3 * X[0] - 0.5 * X[1] + 1.5 * X[2]; }

TEST(linear_fields_are_exact) {
    for (int i = 0; i < 16; i++) {
        sample q = free_sample(2 + i / 4 % 2, kinds[i % 4]);
        const double slope[3] = {3, -0.5, 1.5};
        own_cloud cloud;
        tlsph_solver *solver;
        double worst = 0;
        if (i >= 8) { q.support = 0.6; q.jitter = 0; }
        solver = make(&q, &cloud);
        REQUIRE(solver != NULL);
        double *grad = malloc(3 * cloud.particles.count * sizeof *grad);
        REQUIRE(grad != NULL);
        by_operator(solver, &cloud, q.dimension, linear, grad);
        for (size_t k = 0; k < 3 * cloud.particles.count; k++)
            worst = fmax(worst, (int)(k % 3) < q.dimension ? fabs(grad[k] - slope[k % 3]) : 0);
        CHECK_BELOW(worst, ROUNDED(1e-11, 3e3));
        free(grad);
        tlsph_destroy(solver);
        own_cloud_destroy(&cloud);
    }
}

/* ---- forces ---- */

/* A free body that bends, stretches and turns; returns the change of energy over `count` steps by the initial one. */
static void kick(const own_cloud *cloud, tlsph_solver *solver, double speed) {
    const size_t n = cloud->particles.count;
    tlsph_real *v = malloc(3 * n * sizeof *v);
    for (size_t a = 0; v && a < n; a++) {
        const double x = (double)cloud->positions[3 * a], y = (double)cloud->positions[3 * a + 1];
        v[3 * a] = R(speed * (sin(2 * y) - 0.5 * x));
        v[3 * a + 1] = R(speed * (cos(3 * x) + y * x));
        v[3 * a + 2] = 0;
    }
    if (v) tlsph_write(solver, TLSPH_FIELD_VELOCITY, v);
    tlsph_ledger_reset(solver);
    free(v);
}

static double energy_drift(tlsph_operator_kind kind, tlsph_force_form form, double *momentum) {
    sample q = free_sample(2, kind);
    own_cloud cloud;
    tlsph_ledger before, after;
    tlsph_solver *solver;
    q.form = form;
    solver = make(&q, &cloud);
    if (!solver) return HUGE_VAL;
    kick(&cloud, solver, 3);
    tlsph_ledger_read(solver, &before);
    { /* an eighth of the stable step: what Runge-Kutta adds falls with the cube */
        const tlsph_real dt = tlsph_stable_time_step(solver) / 8;
        for (int i = 0; i < 400; i++) CHECK_RESULT(tlsph_step(solver, dt), TLSPH_OK);
    }
    tlsph_ledger_read(solver, &after);
    *momentum = fabs(after.linear_momentum[0] - before.linear_momentum[0]) / (before.mass * 3);
    tlsph_destroy(solver);
    own_cloud_destroy(&cloud);
    return (after.total_energy - before.total_energy) / before.total_energy;
}

/* The adjoint force keeps the energy as well as the time step allows, the printed one (002-22) does not; both keep linear
   momentum. */
TEST(adjoint_forces_keep_the_energy) {
    DOUBLE_ONLY();
    for (int i = 0; i < 4; i++) {
        double momentum[2];
        const double adjoint = energy_drift(kinds[i], TLSPH_ADJOINT, &momentum[0]);
        const double printed = energy_drift(kinds[i], TLSPH_FORCE_AS_PRINTED, &momentum[1]);
        CHECK_BELOW(fabs(adjoint), 1e-3);
        CHECK(fabs(printed) > 20 * fabs(adjoint));
        CHECK_BELOW(momentum[0], 1e-12);
        CHECK_BELOW(momentum[1], 1e-12);
        REPORT(" %d: %.1e, printed %.1e;", i, adjoint, printed);
    }
}

/* With heat and conduction: total energy to round-off, entropy never falls. */
static void thermal_balance(tlsph_dissipation dissipation) {
    sample q = free_sample(3, TLSPH_BOND);
    own_cloud cloud;
    tlsph_ledger a, b;
    tlsph_solver *solver;
    q.thermal = TLSPH_ENERGY;
    q.dissipation = dissipation;
    q.projection = 1;
    solver = make(&q, &cloud);
    REQUIRE(solver != NULL);
    tlsph_real *theta = read_field(solver, TLSPH_FIELD_TEMPERATURE);
    REQUIRE(theta != NULL);
    for (size_t k = 0; k < cloud.particles.count; k++) theta[k] += R(40) * cloud.positions[3 * k];
    REQUIRE_OK(tlsph_write(solver, TLSPH_FIELD_TEMPERATURE, theta));
    kick(&cloud, solver, 10);
    tlsph_ledger_read(solver, &a);
    CHECK_RESULT(take_steps(solver, 60), TLSPH_OK);
    tlsph_ledger_read(solver, &b);
    CHECK_CLOSE(b.total_energy, a.total_energy, 1e-12 * (fabs(a.total_energy) + a.kinetic_energy + a.thermal_energy));
    CHECK(b.conduction_entropy > 0);
    CHECK(b.dissipation_entropy > 0);
    CHECK(b.entropy > a.entropy);
    free(theta);
    tlsph_destroy(solver);
    own_cloud_destroy(&cloud);
}

TEST(bonds_keep_the_energy_of_thermal_scenes) {
    DOUBLE_ONLY();
    thermal_balance(TLSPH_LIMITED);
    thermal_balance(TLSPH_JST);
}

/* ---- JST ---- */

/* One small step of a 2-D lattice at support 0.6, or of a cloud; v = f(X) along x. Returns the dissipated energy by time, W. */
static double jst_power(double (*f)(const double *), double jitter, int thermal, double *entropy_rate) {
    sample q = free_sample(2, TLSPH_CORRECTED_KERNEL);
    own_cloud cloud;
    tlsph_ledger ledger;
    tlsph_solver *solver;
    const double dt = 1e-9;
    q.support = jitter > 0 ? 0.9 : 0.6;
    q.jitter = jitter;
    q.dissipation = TLSPH_JST;
    q.thermal = thermal ? TLSPH_ENERGY : TLSPH_ISOTHERMAL;
    solver = make(&q, &cloud);
    if (!solver) return HUGE_VAL;
    tlsph_real *v = read_field(solver, TLSPH_FIELD_VELOCITY);
    for (size_t a = 0; v && a < cloud.particles.count; a++) {
        double X[3];
        position_of(&cloud, 2, a, X);
        v[3 * a] = R(f(X));
    }
    if (v) tlsph_write(solver, TLSPH_FIELD_VELOCITY, v);
    tlsph_ledger_reset(solver);
    CHECK_RESULT(tlsph_step(solver, R(dt)), TLSPH_OK);
    tlsph_ledger_read(solver, &ledger);
    *entropy_rate = ledger.dissipation_entropy / dt;
    free(v);
    tlsph_destroy(solver);
    own_cloud_destroy(&cloud);
    return ledger.dissipation / dt;
}

static double checkerboard(const double X[3]) { return (int)(floor(X[0] / 0.25 + 0.5) + floor(X[1] / 0.25 + 0.5)) % 2 ? -1 : 1; }

/* A checkerboard is an eigenvector of the Laplacian inside, -8/d^2; the work of the biharmonic term follows from the
   definition, with its linear correction at the faces, by hand: sum of l_ab Dw.D(Lp) over the pairs. */
TEST(jst_damps_what_its_formula_says) {
    DOUBLE_ONLY();
    const int nx = 6, ny = 5;
    const double d = 0.25, h = 0.6 * d, c = sqrt(17e6 * 0.7 / (1.3 * 0.4) / 1100);
    double L[6][5], power = 0, entropy;
    for (int i = 0; i < nx; i++)
        for (int j = 0; j < ny; j++) { /* beside a face the correction takes the inner neighbour's difference away */
            const double sign = (i + j) % 2 ? -1 : 1;
            L[i][j] = sign * 1100 * -2 / (d * d) * ((i > 0 && i < nx - 1 ? 2 : 0) + (j > 0 && j < ny - 1 ? 2 : 0));
        }
    for (int i = 0; i < nx; i++)
        for (int j = 0; j < ny; j++) {
            const double sign = (i + j) % 2 ? -1 : 1, half_x = i == 0 || i == nx - 1 ? 0.5 : 1, half_y = j == 0 || j == ny - 1 ? 0.5 : 1;
            if (i < nx - 1) power -= half_y * (-2 * sign) * (L[i + 1][j] - L[i][j]);
            if (j < ny - 1) power -= half_x * (-2 * sign) * (L[i][j + 1] - L[i][j]);
        }
    power *= c * h * h * h / 8;
    CHECK_CLOSE(jst_power(checkerboard, 0, 0, &entropy), power, 1e-4 * power);
    CHECK_CLOSE(jst_power(checkerboard, 0, 1, &entropy), power, 1e-4 * power);
    CHECK_CLOSE(entropy, power / 293.15, 1e-4 * power / 293.15);
}

static double sheared(const double X[3]) { return 2 * X[0] - X[1]; }

TEST(jst_leaves_linear_fields_alone) {
    DOUBLE_ONLY();
    double entropy;
    const double lively = jst_power(checkerboard, 0, 0, &entropy);
    for (int i = 0; i < 3; i++) CHECK_BELOW(fabs(jst_power(sheared, 0.1 * i, 0, &entropy)), 1e-9 * lively);
}

/* ---- pairwise time step ---- */

/* 002 table 1: 83.04 us at 0.3 and 249.1 us at 0.9, which is the initial spacing over the linear p speed. */
TEST(pairwise_step_is_that_of_table_1) {
    const int cells[3] = {5, 5, 30};
    own_cloud cloud;
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_material m = rubber();
    tlsph_solver *solver;
    m.poisson = R(0.495);
    REQUIRE(own_box(&cloud, 3, cells, 0.2, 0));
    desc.particles = cloud.particles;
    desc.materials = &m;
    desc.material_count = 1;
    desc.threads = 1;
    for (int i = 0; i < 4; i++) {
        desc.step_rule = i % 2 ? TLSPH_STEP_BY_PAIR : TLSPH_STEP_BY_PAIR_LINEAR;
        desc.cfl = R(i < 2 ? 0.3 : 0.9);
        REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
        CHECK_CLOSE(tlsph_stable_time_step(solver), i < 2 ? 83.04e-6 : 249.1e-6, i < 2 ? 5e-9 : 5e-8);
        if (i % 2) { /* stretched to 1.25 along z, 0.8 across: r = 0.8 d, least stretch 0.8 */
            tlsph_real *x = read_field(solver, TLSPH_FIELD_POSITION), *F = read_field(solver, TLSPH_FIELD_F);
            const double before = (double)tlsph_stable_time_step(solver);
            REQUIRE(x && F);
            for (size_t k = 0; k < 3 * cloud.particles.count; k++) x[k] *= R(k % 3 == 2 ? 1.25 : 0.8);
            for (size_t k = 0; k < 9 * cloud.particles.count; k++) F[k] *= R(k % 9 == 8 ? 1.25 : 0.8);
            REQUIRE_OK(tlsph_write(solver, TLSPH_FIELD_POSITION, x));
            REQUIRE_OK(tlsph_write(solver, TLSPH_FIELD_F, F));
            CHECK_CLOSE(tlsph_stable_time_step(solver), 0.64 * before, 1e-5 * before);
            free(x);
            free(F);
        }
        tlsph_destroy(solver);
    }
    own_cloud_destroy(&cloud);
}

SUITE(bonds, ENTRY(agrees_with_the_sum_over_bonds), ENTRY(linear_fields_are_exact), ENTRY(adjoint_forces_keep_the_energy),
      ENTRY(bonds_keep_the_energy_of_thermal_scenes), ENTRY(jst_damps_what_its_formula_says),
      ENTRY(jst_leaves_linear_fields_alone), ENTRY(pairwise_step_is_that_of_table_1))
