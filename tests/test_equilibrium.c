/* States that must not move: uniform stress under its own boundary tractions, and rigid rotations. */
#include "support.h"

/* A uniform deformation with a rotation in it, plane in 2-D. */
static void uniform_deformation(int dimension, tlsph_real F[9])
{
    static const double plane[9] = {1.15, 0.2, 0, -0.1, 0.9, 0, 0, 0, 1};
    static const double space[9] = {1.15, 0.2, 0.05, -0.1, 0.9, 0.1, 0.02, -0.15, 1.05};
    int i;
    for (i = 0; i < 9; i++) F[i] = R(dimension == 2 ? plane[i] : space[i]);
}

/* Writes the same F to all particles and the positions x = F X that belong to it. */
static tlsph_result write_uniform(tlsph_solver *solver, const tlsph_real F[9])
{
    size_t a, n = tlsph_count(solver);
    int i;
    tlsph_real *X = read_field(solver, TLSPH_FIELD_REFERENCE_POSITION), *x = malloc(3 * n * sizeof *x);
    tlsph_real *all = malloc(9 * n * sizeof *all);
    tlsph_result result;
    for (a = 0; a < n; a++) {
        memcpy(all + 9 * a, F, 9 * sizeof *F);
        for (i = 0; i < 3; i++)
            x[3 * a + (size_t)i] = F[3 * i] * X[3 * a] + F[3 * i + 1] * X[3 * a + 1] + F[3 * i + 2] * X[3 * a + 2];
    }
    result = tlsph_write(solver, TLSPH_FIELD_F, all);
    if (!result) result = tlsph_write(solver, TLSPH_FIELD_POSITION, x);
    free(X);
    free(x);
    free(all);
    return result;
}

/* ---- uniform stress ---- */

typedef struct body {
    own_cloud cloud;
    int dimension;
    tlsph_operator_kind kind;
    tlsph_kernel kernel;
    double support;
} body;

/* Force of each particle, filled once the operator is known: the solver asks for it in every stage. */
typedef struct loads { const tlsph_real *P, *B; } loads;

static void balancing_force(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                            const tlsph_real *x, tlsph_real *values)
{
    const loads *l = user;
    size_t a;
    int i, j;
    (void)time; (void)X; (void)x;
    for (a = 0; a < count; a++)
        for (i = 0; i < 3; i++) {
            values[3 * a + (size_t)i] = 0;
            for (j = 0; l->B && j < 3; j++) values[3 * a + (size_t)i] += l->P[3 * i + j] * l->B[3 * particle[a] + (size_t)j];
        }
}

static tlsph_desc body_desc(const body *b, const tlsph_material *material)
{
    tlsph_desc desc = tlsph_desc_default(b->dimension);
    desc.particles = b->cloud.particles;
    desc.materials = material;
    desc.material_count = 1;
    desc.operator_kind = b->kind;
    desc.kernel = b->kernel;
    desc.support = R(b->support);
    desc.threads = 1;
    return desc;
}

/* What a step does to a body at rest, relative to the stress as a velocity P / (rho c). */
static void check_at_rest(tlsph_solver *solver, const tlsph_material *m, const tlsph_material_state *s)
{
    tlsph_real *v;
    double scale = largest(s->P, 9) / ((double)m->density * (double)s->c_p);
    int step;
    for (step = 0; step < 3; step++) CHECK_RESULT(tlsph_step(solver, 1), TLSPH_OK);
    v = read_field(solver, TLSPH_FIELD_VELOCITY);
    CHECK_BELOW(largest(v, 3 * tlsph_count(solver)) / scale, ROUNDED(1e-10, 1000));
    free(v);
}

static void check_balanced_force(const body *b)
{
    tlsph_material m = soft_material(TLSPH_NEO_HOOKEAN);
    tlsph_material_state s;
    tlsph_condition force = tlsph_condition_default(TLSPH_FORCE);
    tlsph_desc desc = body_desc(b, &m);
    tlsph_solver *solver;
    tlsph_real F[9], *B;
    loads l = {NULL, NULL};
    uniform_deformation(b->dimension, F);
    REQUIRE_OK(tlsph_material_evaluate(&m, F, m.reference_temperature, &s));
    force.values = balancing_force;
    force.values_user = &l;
    desc.conditions = &force;
    desc.condition_count = 1;
    REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
    B = read_field(solver, TLSPH_FIELD_BOUNDARY_AREA);
    l.P = s.P;
    l.B = B;
    CHECK_RESULT(write_uniform(solver, F), TLSPH_OK);
    check_at_rest(solver, &m, &s);
    tlsph_destroy(solver);
    free(B);
}

TEST(uniform_stress_on_lattices)
{
    static const int cells[3] = {4, 3, 3};
    int dimension;
    for (dimension = 2; dimension <= 3; dimension++) {
        body b;
        b.dimension = dimension;
        b.kind = TLSPH_CORRECTED_KERNEL;
        b.kernel = TLSPH_QUADRATIC;
        b.support = 0.6;
        REQUIRE(own_box(&b.cloud, dimension, cells, 0.25, 0));
        check_balanced_force(&b);
        b.kind = TLSPH_CELLS;
        check_balanced_force(&b);
        own_cloud_destroy(&b.cloud);
    }
}

/* The same must hold on any cloud, since B_a is defined by the pair vectors. */
TEST(uniform_stress_on_irregular_clouds)
{
    static const int cells[3] = {4, 3, 3};
    int dimension, kernel;
    for (dimension = 2; dimension <= 3; dimension++)
        for (kernel = 0; kernel < 2; kernel++) {
            body b;
            b.dimension = dimension;
            b.kind = TLSPH_CORRECTED_KERNEL;
            b.kernel = kernel ? TLSPH_QUADRATIC : TLSPH_CUBIC_SPLINE;
            b.support = 0.9 + 0.3 * kernel;
            REQUIRE(own_box(&b.cloud, dimension, cells, 0.25, 0.2));
            check_balanced_force(&b);
            own_cloud_destroy(&b.cloud);
        }
}

TEST(uniform_stress_on_l_shaped_cells)
{
    int dimension;
    for (dimension = 2; dimension <= 3; dimension++) {
        tlsph_fill fill = tlsph_fill_default(dimension);
        tlsph_cloud cloud;
        body b;
        fill.shape = TLSPH_L_SHAPE;
        fill.size[0] = fill.size[1] = fill.size[2] = 1;
        fill.notch[0] = fill.notch[1] = R(0.5);
        fill.spacing = R(0.25);
        REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
        b.dimension = dimension;
        b.kind = TLSPH_CELLS;
        b.kernel = TLSPH_QUADRATIC;
        b.support = 0.6;
        REQUIRE(own_copy(&b.cloud, &cloud.particles, dimension));
        check_balanced_force(&b);
        own_cloud_destroy(&b.cloud);
        tlsph_cloud_destroy(&cloud);
    }
}

/* TLSPH_TRACTION without areas on the six faces: t = P N on the operator's own area along N. */
static void check_balanced_traction(int dimension)
{
    static const int cells[3] = {4, 3, 3};
    tlsph_material m = soft_material(TLSPH_NEO_HOOKEAN);
    tlsph_material_state s;
    tlsph_condition faces[6];
    uint32_t chosen[6][100];
    body b;
    tlsph_desc desc;
    tlsph_solver *solver = NULL;
    tlsph_real F[9];
    int f, i;
    b.dimension = dimension;
    b.kind = TLSPH_CORRECTED_KERNEL;
    b.kernel = TLSPH_QUADRATIC;
    b.support = 0.6;
    REQUIRE(own_box(&b.cloud, dimension, cells, 0.25, 0));
    uniform_deformation(dimension, F);
    REQUIRE_OK(tlsph_material_evaluate(&m, F, m.reference_temperature, &s));
    for (f = 0; f < 2 * dimension; f++) {
        double sign = f % 2 ? 1 : -1, plane = f % 2 ? cells[f / 2] * 0.25 : 0;
        faces[f] = tlsph_condition_default(TLSPH_TRACTION);
        faces[f].particles = chosen[f];
        faces[f].count = tlsph_select_plane(&b.cloud.particles, f / 2, R(plane), R(1e-4), chosen[f], 100);
        CHECK(faces[f].count > 0 && faces[f].count <= 100);
        faces[f].normal[f / 2] = R(sign);
        for (i = 0; i < 3; i++) faces[f].value[i] = R(sign) * s.P[3 * i + f / 2];
        if (dimension == 2) faces[f].value[2] = 0;
    }
    desc = body_desc(&b, &m);
    desc.conditions = faces;
    desc.condition_count = 2 * (size_t)dimension;
    CHECK_RESULT(tlsph_create(&desc, &solver, NULL), TLSPH_OK);
    if (solver) {
        CHECK_RESULT(write_uniform(solver, F), TLSPH_OK);
        check_at_rest(solver, &m, &s);
    }
    tlsph_destroy(solver);
    own_cloud_destroy(&b.cloud);
}

TEST(uniform_stress_under_tractions)
{
    check_balanced_traction(2);
    check_balanced_traction(3);
}

/* A hydrostatic state p H A: TLSPH_PRESSURE without areas on all particles. */
TEST(uniform_pressure)
{
    static const int cells[3] = {3, 3, 3};
    static const tlsph_real F[9] = {R(0.95), 0, 0, 0, R(0.95), 0, 0, 0, R(0.95)};
    tlsph_material m = soft_material(TLSPH_NEO_HOOKEAN);
    tlsph_material_state s;
    tlsph_condition pressure = tlsph_condition_default(TLSPH_PRESSURE);
    body b = {{{0}, NULL, NULL, NULL, NULL, NULL}, 3, TLSPH_CORRECTED_KERNEL, TLSPH_QUADRATIC, 0.6};
    tlsph_desc desc;
    tlsph_solver *solver = NULL;
    REQUIRE(own_box(&b.cloud, 3, cells, 0.25, 0));
    REQUIRE_OK(tlsph_material_evaluate(&m, F, m.reference_temperature, &s));
    pressure.value[0] = R(-(double)s.P[0] / (0.95 * 0.95)); /* P = -p H, H = 0.95^2 I */
    desc = body_desc(&b, &m);
    desc.conditions = &pressure;
    desc.condition_count = 1;
    REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
    CHECK_RESULT(write_uniform(solver, F), TLSPH_OK);
    check_at_rest(solver, &m, &s);
    tlsph_destroy(solver);
    own_cloud_destroy(&b.cloud);
}

/* ---- rotations ---- */

static void rotation(int dimension, uint64_t *seed, tlsph_real Q[9])
{
    double angle = random_between(seed, 0, 2 * PI);
    static const tlsph_real I[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (dimension == 3) { random_rotation(seed, Q); return; }
    memcpy(Q, I, sizeof I);
    Q[0] = Q[4] = R(cos(angle));
    Q[3] = R(sin(angle));
    Q[1] = -Q[3];
}

static void check_rotation(tlsph_solver *solver, const tlsph_material *m, const tlsph_real Q[9])
{
    tlsph_real *P, *v;
    CHECK_RESULT(write_uniform(solver, Q), TLSPH_OK);
    P = read_field(solver, TLSPH_FIELD_STRESS);
    CHECK_BELOW(largest(P, 9 * tlsph_count(solver)), 200 * EPSILON * (double)m->young);
    CHECK_RESULT(take_steps(solver, 3), TLSPH_OK);
    v = read_field(solver, TLSPH_FIELD_VELOCITY);
    CHECK_BELOW(largest(v, 3 * tlsph_count(solver)), 1000 * EPSILON * 7); /* c = 7 m/s */
    free(P);
    free(v);
}

TEST(rigid_rotations_are_free_of_stress)
{
    static const tlsph_unknowns sets[4] = {TLSPH_PF, TLSPH_PFJ, TLSPH_PFHJ, TLSPH_PFH};
    static const int cells[3] = {3, 3, 3};
    uint64_t seed = 4;
    int dimension, set, trial;
    for (dimension = 2; dimension <= 3; dimension++)
        for (set = 0; set < 4; set++) {
            body b;
            tlsph_material m = soft_material(TLSPH_NEO_HOOKEAN);
            tlsph_desc desc;
            tlsph_solver *solver = NULL;
            b.dimension = dimension;
            b.kind = TLSPH_CORRECTED_KERNEL;
            b.kernel = TLSPH_QUADRATIC;
            b.support = 0.9;
            REQUIRE(own_box(&b.cloud, dimension, cells, 0.25, 0.2));
            desc = body_desc(&b, &m);
            desc.unknowns = sets[set];
            REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
            for (trial = 0; trial < 5; trial++) {
                tlsph_real Q[9], zero[3 * 64];
                memset(zero, 0, sizeof zero);
                rotation(dimension, &seed, Q);
                CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_VELOCITY, zero), TLSPH_OK);
                check_rotation(solver, &m, Q);
            }
            tlsph_destroy(solver);
            own_cloud_destroy(&b.cloud);
        }
}

/* ---- a spin of a thousand turns ---- */

static tlsph_result write_spin(tlsph_solver *solver, double omega, double centre)
{
    size_t a, n = tlsph_count(solver);
    tlsph_real *X = read_field(solver, TLSPH_FIELD_REFERENCE_POSITION), *v = calloc(3 * n, sizeof *v);
    tlsph_result result;
    for (a = 0; a < n; a++) {
        v[3 * a] = R(-omega * ((double)X[3 * a + 1] - centre));
        v[3 * a + 1] = R(omega * ((double)X[3 * a] - centre));
    }
    result = tlsph_write(solver, TLSPH_FIELD_VELOCITY, v);
    free(X);
    free(v);
    return result;
}

static double stress_now(const tlsph_solver *solver)
{
    tlsph_real *P = read_field(solver, TLSPH_FIELD_STRESS);
    double most = largest(P, 9 * tlsph_count(solver));
    free(P);
    return most;
}

/* A free block spins at a fifth of the wave speed. Its stress is that of the centrifugal load,
   about rho omega^2 R^2 / 2, and must stay there: what a rotation makes of round-off may not accumulate. */
TEST(slow_thousand_turns)
{
    static const int cells[3] = {3, 3, 3};
    tlsph_material m = soft_material(TLSPH_NEO_HOOKEAN);
    body b = {{{0}, NULL, NULL, NULL, NULL, NULL}, 3, TLSPH_CORRECTED_KERNEL, TLSPH_QUADRATIC, 0.6};
    double omega = 3, radius = 0.53, early = 0, late = 0, spin;
    tlsph_desc desc;
    tlsph_solver *solver = NULL;
    tlsph_ledger first, last;
    DOUBLE_ONLY();
    REQUIRE(own_box(&b.cloud, 3, cells, 0.25, 0));
    desc = body_desc(&b, &m);
    REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
    REQUIRE_OK(write_spin(solver, omega, 0.375));
    tlsph_ledger_reset(solver);
    tlsph_ledger_read(solver, &first);
    while ((double)tlsph_time(solver) < 20 * 2 * PI / omega) {
        REQUIRE_OK(tlsph_step(solver, 1));
        early = fmax(early, stress_now(solver));
    }
    REQUIRE_OK(tlsph_advance(solver, R(1000 * 2 * PI / omega)));
    late = stress_now(solver);
    tlsph_ledger_read(solver, &last);
    spin = fabs(last.angular_momentum[2] - first.angular_momentum[2]) / fabs(first.angular_momentum[2]);
    REPORT("stress %.3g then %.3g Pa, %.0f steps, spin off by %.2g", early, late, (double)tlsph_step_count(solver), spin);
    CHECK_BELOW(early, 4 * 1000 * omega * omega * radius * radius);
    CHECK_BELOW(late, early);
    CHECK_BELOW(spin, 1e-9);
    CHECK(last.total_energy <= first.total_energy * (1 + 1e-12));
    tlsph_destroy(solver);
    own_cloud_destroy(&b.cloud);
}

SUITE(equilibrium, ENTRY(uniform_stress_on_lattices), ENTRY(uniform_stress_on_irregular_clouds),
      ENTRY(uniform_stress_on_l_shaped_cells), ENTRY(uniform_stress_under_tractions), ENTRY(uniform_pressure),
      ENTRY(rigid_rotations_are_free_of_stress), ENTRY(slow_thousand_turns))
