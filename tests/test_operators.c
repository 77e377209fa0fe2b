/* The discrete operator: neighbours, antisymmetry, boundary vectors, linear exactness. */
#include "support.h"

/* One cloud with one operator, and a material so soft that a tiny step changes no velocity. */
typedef struct setup {
    int dimension, cells[3];
    double spacing, jitter, support;
    int uneven; /* volumes varied by 20 %, and no weights of their own */
    tlsph_kernel kernel;
    tlsph_operator_kind kind;
} setup;

static tlsph_material softest(void)
{
    tlsph_material m = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    m.density = 1;
    m.young = 1;
    m.poisson = R(0.3);
    return m;
}

static tlsph_solver *make(const setup *s, own_cloud *cloud)
{
    tlsph_desc desc = tlsph_desc_default(s->dimension);
    tlsph_material m = softest();
    tlsph_solver *solver = NULL;
    tlsph_error error;
    uint64_t seed = 3;
    size_t a;
    if (!own_box(cloud, s->dimension, s->cells, s->spacing, s->jitter)) return NULL;
    for (a = 0; s->uneven && a < cloud->particles.count; a++) cloud->volumes[a] *= R(random_between(&seed, 0.8, 1.2));
    if (s->uneven) cloud->particles.weights = NULL;
    desc.particles = cloud->particles;
    desc.materials = &m;
    desc.material_count = 1;
    desc.kernel = s->kernel;
    desc.operator_kind = s->kind;
    desc.support = R(s->support);
    desc.threads = 1;
    desc.keep_pairs = 1;
    if (!CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_OK)) printf("    %s\n", error.message);
    return solver;
}

/* Calls `check` for the lattices and irregular clouds that the operator must serve, in both dimensions and kernels. */
static void for_all_setups(void (*check)(const setup *, const own_cloud *, tlsph_solver *))
{
    static const double supports[4] = {0.6, 0.9, 1.2, 1.5};
    int dimension, kernel, i;
    for (dimension = 2; dimension <= 3; dimension++)
        for (kernel = 0; kernel < 2; kernel++)
            for (i = 0; i < 4; i++) {
                setup s = {0, {6, 5, 4}, 0.25, 0, 0, 0, TLSPH_CUBIC_SPLINE, TLSPH_CORRECTED_KERNEL};
                own_cloud cloud;
                tlsph_solver *solver;
                s.dimension = dimension;
                s.kernel = kernel ? TLSPH_QUADRATIC : TLSPH_CUBIC_SPLINE;
                s.support = supports[i];
                s.jitter = i ? 0.2 : 0;
                s.uneven = i > 0;
                solver = make(&s, &cloud);
                if (!solver) return;
                check(&s, &cloud, solver);
                tlsph_destroy(solver);
                own_cloud_destroy(&cloud);
            }
}

/* ---- neighbours ---- */

static double distance(const own_cloud *cloud, int dimension, size_t a, size_t b)
{
    double sum = 0;
    int i;
    for (i = 0; i < dimension; i++) {
        double d = (double)cloud->positions[3 * a + (size_t)i] - (double)cloud->positions[3 * b + (size_t)i];
        sum += d * d;
    }
    return sqrt(sum);
}

/* The definition of h in the header: support x spacing, where spacing 0 means (mean weight)^(1/dimension). */
static double smoothing_length(const setup *s, const own_cloud *cloud)
{
    const tlsph_real *w = cloud->particles.weights ? cloud->particles.weights : cloud->particles.volumes;
    double sum = 0;
    size_t a;
    if (cloud->particles.spacing > 0) return s->support * (double)cloud->particles.spacing;
    for (a = 0; a < cloud->particles.count; a++) sum += (double)w[a];
    return s->support * pow(sum / (double)cloud->particles.count, 1.0 / s->dimension);
}

static void check_neighbours(const setup *s, const own_cloud *cloud, tlsph_solver *solver)
{
    tlsph_operator view;
    size_t a, b, k, n = cloud->particles.count;
    double radius = 2 * smoothing_length(s, cloud);
    tlsph_real *counts = read_field(solver, TLSPH_FIELD_NEIGHBOURS);
    unsigned char *found = calloc(n, 1), *hosts = calloc(n, 1);
    tlsph_operator_view(solver, &view);
    CHECK_SAME(view.count, n);
    CHECK_SAME(view.dimension, s->dimension);
    CHECK_SAME(view.first[n], view.pairs);
    for (a = 0; a < n; a++) { /* a in the solver's order */
        size_t expected = 0;
        memset(found, 0, n);
        hosts[view.host[a]]++;
        for (k = view.first[a]; k < view.first[a + 1]; k++) found[view.host[view.neighbours[k]]]++;
        for (b = 0; b < n; b++) {
            int near = b != view.host[a] && distance(cloud, s->dimension, view.host[a], b) < radius;
            expected += near ? 1 : 0;
            CHECK_SAME(found[b], near);
        }
        CHECK_SAME(view.first[a + 1] - view.first[a], expected);
        if (counts) CHECK_SAME(counts[view.host[a]], expected);
    }
    for (a = 0; a < n; a++) CHECK_SAME(hosts[a], 1); /* a permutation */
    CHECK(counts != NULL);
    free(counts);
    free(found);
    free(hosts);
}

TEST(neighbours_match_brute_force) { for_all_setups(check_neighbours); }

/* ---- pair vectors ---- */

/* The pair (b, a) for the pair k = (a, b); `pairs` if there is none. */
static size_t reverse_pair(const tlsph_operator *view, size_t a, size_t k)
{
    size_t b = view->neighbours[k], j;
    for (j = view->first[b]; j < view->first[b + 1]; j++)
        if (view->neighbours[j] == a) return j;
    return view->pairs;
}

static void check_antisymmetry(const setup *s, const own_cloud *cloud, tlsph_solver *solver)
{
    tlsph_operator view;
    size_t a, k, j, d = (size_t)s->dimension, i;
    double scale;
    (void)cloud;
    tlsph_operator_view(solver, &view);
    scale = largest(view.vectors, view.pairs * d);
    CHECK(scale > 0);
    for (a = 0; a < view.count; a++)
        for (k = view.first[a]; k < view.first[a + 1]; k++) {
            j = reverse_pair(&view, a, k);
            if (!CHECK(j < view.pairs)) continue;
            for (i = 0; i < d; i++) CHECK_CLOSE(view.vectors[k * d + i], -view.vectors[j * d + i], 2 * EPSILON * scale);
        }
}

TEST(pair_vectors_are_antisymmetric) { for_all_setups(check_antisymmetry); }

/* out = M_a g */
static void corrected(const tlsph_solver *solver, size_t d, size_t a, const tlsph_real *g, double out[3])
{
    tlsph_real M[9];
    tlsph_correction_read(solver, a, M);
    for (size_t i = 0; i < d; i++) {
        out[i] = 0;
        for (size_t j = 0; j < d; j++) out[i] += (double)M[3 * i + j] * (double)g[j];
    }
}

/* B_a = -sum_b (C_ab - C_ba) / 2 with C_ba = -M_b g_ab */
static void boundary_by_definition(const tlsph_solver *solver, const tlsph_operator *view, size_t a, double B[3])
{
    size_t k, i, d = (size_t)view->dimension;
    B[0] = B[1] = B[2] = 0;
    for (k = view->first[a]; k < view->first[a + 1]; k++) {
        double mine[3], its[3];
        corrected(solver, d, a, view->vectors + k * d, mine);
        corrected(solver, d, view->neighbours[k], view->vectors + k * d, its);
        for (i = 0; i < d; i++) B[i] -= 0.5 * (mine[i] + its[i]);
    }
}

static void check_boundary(const setup *s, const own_cloud *cloud, tlsph_solver *solver)
{
    tlsph_operator view;
    tlsph_real *field = read_field(solver, TLSPH_FIELD_BOUNDARY_AREA);
    size_t a, i, d = (size_t)s->dimension;
    double face = pow(s->spacing, s->dimension - 1), sum[3] = {0, 0, 0};
    (void)cloud;
    REQUIRE(field);
    tlsph_operator_view(solver, &view);
    for (a = 0; a < view.count; a++) {
        double B[3];
        boundary_by_definition(solver, &view, a, B);
        for (i = 0; i < d; i++) {
            CHECK_CLOSE(field[3 * view.host[a] + i], B[i], 300 * EPSILON * face);
            sum[i] += B[i];
        }
        if (d == 2) CHECK(field[3 * view.host[a] + 2] == 0);
    }
    for (i = 0; i < d; i++) CHECK_CLOSE(sum[i], 0, 300 * EPSILON * face * (double)view.count); /* closed surface */
    free(field);
}

TEST(boundary_vectors_close_the_sums) { for_all_setups(check_boundary); }

static void check_volumes(const setup *s, const own_cloud *cloud, tlsph_solver *solver)
{
    tlsph_operator view;
    tlsph_real *V = read_field(solver, TLSPH_FIELD_VOLUME), *mass = read_field(solver, TLSPH_FIELD_MASS);
    size_t a;
    (void)s;
    REQUIRE(V && mass);
    tlsph_operator_view(solver, &view);
    for (a = 0; a < view.count; a++) {
        double volume = (double)cloud->volumes[view.host[a]];
        CHECK_CLOSE(view.volumes[a], volume, 2 * EPSILON * volume);
        CHECK_CLOSE(V[view.host[a]], volume, 2 * EPSILON * volume);
        CHECK_CLOSE(mass[view.host[a]], volume, 4 * EPSILON * volume); /* density 1 */
        CHECK(view.spacing[a] > 0);
    }
    free(V);
    free(mass);
}

TEST(volumes_are_kept) { for_all_setups(check_volumes); }

/* On a lattice with particles on the faces the boundary vector is the outward area of the particle's part of the surface. */
static void check_lattice_areas(int dimension, tlsph_operator_kind kind)
{
    setup s = {0, {4, 3, 3}, 0.25, 0, 0.6, 0, TLSPH_QUADRATIC, TLSPH_CORRECTED_KERNEL};
    own_cloud cloud;
    tlsph_solver *solver;
    tlsph_real *B;
    size_t a;
    int i, j;
    s.dimension = dimension;
    s.kind = kind;
    solver = make(&s, &cloud);
    REQUIRE(solver);
    B = read_field(solver, TLSPH_FIELD_BOUNDARY_AREA);
    for (a = 0; a < cloud.particles.count; a++)
        for (i = 0; i < dimension; i++) {
            double area = 1, outward = 0;
            for (j = 0; j < dimension; j++) {
                double x = (double)cloud.positions[3 * a + (size_t)j];
                int side = x < 1e-4 ? -1 : x > s.cells[j] * s.spacing - 1e-4 ? 1 : 0;
                if (j == i) outward = side;
                else area *= side ? s.spacing / 2 : s.spacing;
            }
            CHECK_CLOSE(B[3 * a + (size_t)i], outward * area, 100 * EPSILON * area);
        }
    free(B);
    tlsph_destroy(solver);
    own_cloud_destroy(&cloud);
}

TEST(boundary_vectors_of_lattices_are_areas)
{
    int dimension;
    for (dimension = 2; dimension <= 3; dimension++) {
        check_lattice_areas(dimension, TLSPH_CORRECTED_KERNEL);
        check_lattice_areas(dimension, TLSPH_CELLS);
    }
}

/* ---- linear exactness ---- */

static void affine_field(int dimension, const own_cloud *cloud, tlsph_real A[9], tlsph_real *v)
{
    uint64_t seed = 21;
    size_t a;
    int i, j;
    for (i = 0; i < 9; i++) A[i] = i / 3 < dimension && i % 3 < dimension ? R(random_between(&seed, -1, 1)) : 0;
    for (a = 0; a < cloud->particles.count; a++)
        for (i = 0; i < 3; i++) {
            v[3 * a + (size_t)i] = i < dimension ? R(0.3) : 0;
            for (j = 0; j < dimension; j++)
                v[3 * a + (size_t)i] += A[3 * i + j] * cloud->positions[3 * a + (size_t)j];
        }
}

/* grad f_a = 1/V_a sum_b (f_b - f_a)/2 (x) C_ab, from the view. */
static void check_view_gradient(const setup *s, const own_cloud *cloud, tlsph_solver *solver)
{
    tlsph_operator view;
    tlsph_real A[9], *v = calloc(3 * cloud->particles.count, sizeof *v);
    size_t a, k, i, j, d = (size_t)s->dimension;
    affine_field(s->dimension, cloud, A, v);
    tlsph_operator_view(solver, &view);
    for (a = 0; a < view.count; a++) {
        double G[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
        const tlsph_real *mine = v + 3 * view.host[a];
        for (k = view.first[a]; k < view.first[a + 1]; k++) {
            const tlsph_real *its = v + 3 * view.host[view.neighbours[k]];
            double C[3];
            corrected(solver, d, a, view.vectors + k * d, C);
            for (i = 0; i < d; i++)
                for (j = 0; j < d; j++) G[3 * i + j] += ((double)its[i] - (double)mine[i]) / 2 * C[j] / (double)view.volumes[a];
        }
        for (i = 0; i < 9; i++) CHECK_CLOSE(G[i], A[i], 2000 * EPSILON);
    }
    free(v);
}

TEST(view_differentiates_affine_fields_exactly) { for_all_setups(check_view_gradient); }

/* The solver's own gradient, after a step so short that velocities keep all their digits. */
static void check_solver_gradient(const setup *s, const own_cloud *cloud, tlsph_solver *solver)
{
    tlsph_real A[9], *v = calloc(3 * cloud->particles.count, sizeof *v), *G, *F;
    size_t a, i;
    double dt = 1e-9;
    affine_field(s->dimension, cloud, A, v);
    if (!CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_VELOCITY, v), TLSPH_OK)) { free(v); return; }
    CHECK_RESULT(tlsph_step(solver, R(dt)), TLSPH_OK);
    G = read_field(solver, TLSPH_FIELD_VELOCITY_GRADIENT);
    F = read_field(solver, TLSPH_FIELD_F);
    for (a = 0; G && F && a < cloud->particles.count; a++)
        for (i = 0; i < 9; i++) {
            CHECK_CLOSE(G[9 * a + i], A[i], 2000 * EPSILON);
            CHECK_CLOSE(F[9 * a + i], (i % 4 == 0) + dt * (double)A[i], 4 * EPSILON);
        }
    CHECK(G && F);
    free(v);
    free(G);
    free(F);
}

TEST(solver_differentiates_affine_fields_exactly) { for_all_setups(check_solver_gradient); }

/* Cells and the host's own pair vectors go through the same code; the operator of cells is given back as pair vectors. */
static tlsph_solver *make_given(const own_cloud *cloud, const tlsph_operator *view, tlsph_error *error)
{
    tlsph_desc desc = tlsph_desc_default(view->dimension);
    tlsph_material m = softest();
    tlsph_solver *solver = NULL;
    size_t n = view->count, a, k, i, d = (size_t)view->dimension, at = 0;
    size_t *inverse = calloc(n, sizeof *inverse), *first = calloc(n + 1, sizeof *first);
    uint32_t *neighbours = calloc(view->pairs, sizeof *neighbours);
    tlsph_real *C = calloc(3 * view->pairs, sizeof *C);
    for (a = 0; a < n; a++) inverse[view->host[a]] = a;
    for (a = 0; a < n; a++) { /* a: host number */
        first[a] = at;
        for (k = view->first[inverse[a]]; k < view->first[inverse[a] + 1]; k++, at++) {
            neighbours[at] = view->host[view->neighbours[k]];
            for (i = 0; i < d; i++) C[3 * at + i] = view->vectors[k * d + i];
        }
    }
    first[n] = at;
    desc.particles = cloud->particles;
    desc.particles.first = first;
    desc.particles.neighbours = neighbours;
    desc.particles.pair_vectors = C;
    desc.operator_kind = TLSPH_GIVEN;
    desc.keep_pairs = 1;
    desc.materials = &m;
    desc.material_count = 1;
    CHECK_RESULT(tlsph_create(&desc, &solver, error), TLSPH_OK);
    free(inverse);
    free(first);
    free(neighbours);
    free(C);
    return solver;
}

static void check_cells_and_given(int dimension)
{
    setup s = {0, {5, 4, 3}, 0.25, 0, 0.6, 0, TLSPH_QUADRATIC, TLSPH_CELLS};
    own_cloud cloud;
    tlsph_solver *solver, *given;
    tlsph_operator view;
    tlsph_error error;
    s.dimension = dimension;
    solver = make(&s, &cloud);
    REQUIRE(solver);
    check_antisymmetry(&s, &cloud, solver);
    check_view_gradient(&s, &cloud, solver);
    tlsph_operator_view(solver, &view);
    CHECK(!view.corrected);
    given = make_given(&cloud, &view, &error);
    if (CHECK(given != NULL)) {
        check_view_gradient(&s, &cloud, given);
        check_solver_gradient(&s, &cloud, given);
        tlsph_destroy(given);
    } else printf("    %s\n", error.message);
    check_solver_gradient(&s, &cloud, solver);
    tlsph_destroy(solver);
    own_cloud_destroy(&cloud);
}

TEST(cells_and_given_pair_vectors)
{
    check_cells_and_given(2);
    check_cells_and_given(3);
}

/* Closed and exact on an L: sum_a B_a = 0, sum_a B_a (x) X_a = V I, zero inside. */
static void check_l_cells(int dimension)
{
    tlsph_fill fill = tlsph_fill_default(dimension);
    tlsph_cloud cloud;
    tlsph_desc desc = tlsph_desc_default(dimension);
    tlsph_material m = softest();
    tlsph_solver *solver = NULL;
    tlsph_real *B;
    double moment[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0}, sum[3] = {0, 0, 0};
    double volume = dimension == 3 ? 126 : 42;
    size_t a;
    int i, j;
    fill.shape = TLSPH_L_SHAPE;
    fill.size[0] = 6;
    fill.size[1] = 10;
    fill.size[2] = 3;
    fill.notch[0] = 3;
    fill.notch[1] = 4;
    fill.spacing = 1;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    desc.particles = cloud.particles;
    desc.materials = &m;
    desc.material_count = 1;
    desc.operator_kind = TLSPH_CELLS;
    REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
    B = read_field(solver, TLSPH_FIELD_BOUNDARY_AREA);
    for (a = 0; a < cloud.particles.count; a++)
        for (i = 0; i < dimension; i++) {
            sum[i] += (double)B[3 * a + (size_t)i];
            for (j = 0; j < dimension; j++)
                moment[3 * i + j] += (double)B[3 * a + (size_t)i] * (double)cloud.particles.positions[3 * a + (size_t)j];
        }
    for (i = 0; i < dimension; i++) {
        CHECK_CLOSE(sum[i], 0, 1000 * EPSILON);
        for (j = 0; j < dimension; j++) CHECK_CLOSE(moment[3 * i + j], i == j ? volume : 0, 1000 * EPSILON * volume);
    }
    free(B);
    tlsph_destroy(solver);
    tlsph_cloud_destroy(&cloud);
}

TEST(boundary_of_an_l_shape_is_closed)
{
    check_l_cells(2);
    check_l_cells(3);
}

/* ---- evolved measures ---- */

/* H and J have equations of their own, but must follow F: over a few steps to the order of the time scheme. */
static void check_followers(int dimension, tlsph_unknowns unknowns)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver = NULL;
    tlsph_real *F, *H, *J, cofactor[9];
    double strain = 0, off_H = 0, off_J = 0;
    size_t a, i;
    s.dimension = dimension;
    s.unknowns = unknowns;
    REQUIRE_OK(moving_block_create(&s, &solver, NULL));
    REQUIRE_OK(moving_block_kick(solver, 0.3));
    REQUIRE_OK(take_steps(solver, 20));
    F = read_field(solver, TLSPH_FIELD_F);
    H = read_field(solver, TLSPH_FIELD_H);
    J = read_field(solver, TLSPH_FIELD_J);
    for (a = 0; a < tlsph_count(solver); a++) {
        tlsph_cofactor(F + 9 * a, cofactor);
        off_J = fmax(off_J, fabs((double)J[a] - (double)tlsph_determinant(F + 9 * a)));
        for (i = 0; i < 9; i++) {
            strain = fmax(strain, fabs((double)F[9 * a + i] - (i % 4 == 0)));
            off_H = fmax(off_H, fabs((double)H[9 * a + i] - (double)cofactor[i]));
        }
    }
    CHECK(strain > 0.01);
    CHECK_BELOW(off_H, 0.01 * strain);
    CHECK_BELOW(off_J, 0.05 * strain); /* J drifts by its dissipation, too */
    free(F);
    free(H);
    free(J);
    tlsph_destroy(solver);
}

TEST(cofactor_and_jacobian_follow_F)
{
    int dimension;
    for (dimension = 2; dimension <= 3; dimension++) {
        check_followers(dimension, TLSPH_PF);
        check_followers(dimension, TLSPH_PFJ);
        check_followers(dimension, TLSPH_PFH);
        check_followers(dimension, TLSPH_PFHJ);
    }
}

SUITE(operators, ENTRY(neighbours_match_brute_force), ENTRY(pair_vectors_are_antisymmetric),
      ENTRY(boundary_vectors_close_the_sums), ENTRY(volumes_are_kept), ENTRY(boundary_vectors_of_lattices_are_areas),
      ENTRY(view_differentiates_affine_fields_exactly), ENTRY(solver_differentiates_affine_fields_exactly),
      ENTRY(cells_and_given_pair_vectors), ENTRY(boundary_of_an_l_shape_is_closed),
      ENTRY(cofactor_and_jacobian_follow_F))
