/* What lies at the edges of the contract: calls without arguments, constants outside their lists, materials and scenes at the
   ends of their ranges, options that change nothing where they do not apply. */
#include "support.h"

static const tlsph_real one[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

typedef struct small { own_cloud cloud; tlsph_material material; tlsph_condition conditions[2]; tlsph_desc desc; } small;

/* A cube of 4 cells a side, 1 m, neo-Hookean, without conditions. */
static int small_make(small *s, int dimension)
{
    const int cells[3] = {4, 4, 4};
    memset(s, 0, sizeof *s);
    if (!CHECK(own_box(&s->cloud, dimension, cells, 0.25, 0))) return 0;
    s->material = soft_material(TLSPH_NEO_HOOKEAN);
    s->desc = tlsph_desc_default(dimension);
    s->desc.keep_pairs = 1;
    s->desc.particles = s->cloud.particles;
    s->desc.materials = &s->material;
    s->desc.material_count = 1;
    s->desc.conditions = s->conditions;
    s->desc.threads = 1;
    return 1;
}

/* ---- calls ---- */

TEST(calls_without_arguments)
{
    small s;
    tlsph_solver *solver = (tlsph_solver *)&s;
    tlsph_error error;
    tlsph_material_state state;
    tlsph_real spoilt[9];
    REQUIRE(small_make(&s, 3));
    CHECK_RESULT(tlsph_create(NULL, &solver, &error), TLSPH_ERROR_ARGUMENT);
    CHECK(!solver && error.message[0]);
    CHECK_RESULT(tlsph_measure(NULL, NULL, NULL), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_measure(&s.desc, NULL, NULL), TLSPH_OK);
    REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
    const uint64_t hash = state_hash(solver);
    CHECK_RESULT(tlsph_restore(solver, NULL, 1000000), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_save(solver, NULL, 1000000), TLSPH_ERROR_ARGUMENT);
    CHECK(state_hash(solver) == hash);
    tlsph_destroy(solver);
    own_cloud_destroy(&s.cloud);
    CHECK_RESULT(tlsph_material_evaluate(NULL, one, 300, &state), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_material_evaluate(&s.material, NULL, 300, &state), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_material_evaluate(&s.material, one, 300, NULL), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_material_evaluate(&s.material, one, R(NAN), &state), TLSPH_ERROR_NOT_FINITE);
    for (int i = 0; i < 9; i++) {
        memcpy(spoilt, one, sizeof spoilt);
        spoilt[i] = R(i % 2 ? NAN : INFINITY);
        CHECK_RESULT(tlsph_material_evaluate(&s.material, spoilt, 300, &state), TLSPH_ERROR_NOT_FINITE);
    }
}
TEST(constants_outside_their_lists)
{
    for (int i = 0; i < 2; i++) {
        const int no = i ? -1 : 1000;
        CHECK(tlsph_cfl_limit((tlsph_integrator)no) == 0);
        CHECK_SAME(tlsph_field_components((tlsph_field)no), 0);
        CHECK(tlsph_field_unit((tlsph_field)no)[0] == 0 && tlsph_field_name((tlsph_field)no)[0] == 0);
    }
    CHECK_CLOSE(tlsph_cfl_limit(TLSPH_RK2), 0.4, 1e-6);
}
/* Without an area between them, or without a distance, two particles have nothing to dissipate. */
TEST(no_dissipation_without_area_or_distance)
{
    static const tlsph_real x[3] = {1, 0, 0}, none[3] = {0, 0, 0};
    tlsph_pair_side a, b;
    tlsph_pair_flux flux;
    memset(&a, 0, sizeof a);
    a.density = a.c_p = a.c_s = a.theta = a.theta_R = 1;
    b = a;
    b.velocity[0] = 1;
    for (int i = 0; i < 3; i++) {
        memset(&flux, 0x55, sizeof flux);
        tlsph_pair_dissipation(TLSPH_FIRST_ORDER, &a, &b, i == 1 ? none : x, i == 2 ? none : x, x, 1, &flux);
        CHECK(i ? flux.D_p[0] == 0 && flux.production == 0 : fabs((double)flux.D_p[0]) > 0.1 && flux.production > 0);
    }
}
/* Half an allocator counts as none; nodes may leave out any result. */
static void *never(void *user, size_t size) { (void)size; *(int *)user = 1; return NULL; }
TEST(parts_that_may_be_missing)
{
    static const tlsph_real square[24] = {0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 1, 0, 1, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0};
    static const tlsph_real X[3] = {R(0.5), R(0.5), 0}, nodes_at[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, radii[3] = {3, 3, 3};
    const tlsph_nodes nodes = {2, 1, TLSPH_QUADRATIC, 3, nodes_at, radii};
    tlsph_shape_functions out = {NULL, NULL, NULL, NULL};
    tlsph_surface surface = {4, square};
    tlsph_particles p;
    tlsph_real V[1], B[3], gradient[9];
    int called = 0;
    const tlsph_allocator half = {never, NULL, &called};
    memset(&p, 0, sizeof p);
    p.count = 1;
    p.positions = X;
    p.spacing = 1;
    CHECK_RESULT(tlsph_voronoi(2, &p, &surface, &half, V, B, NULL, NULL), TLSPH_OK);
    CHECK(!called);
    CHECK_CLOSE(V[0], 1, 100 * EPSILON);
    surface.count = 0;
    CHECK_RESULT(tlsph_voronoi(2, &p, &surface, NULL, V, B, NULL, NULL), TLSPH_ERROR_SURFACE);
    surface.corners = NULL;
    surface.count = 4;
    CHECK_RESULT(tlsph_voronoi(2, &p, &surface, NULL, V, B, NULL, NULL), TLSPH_ERROR_SURFACE);
    out.gradient = gradient; /* linear: that of x is (1, 0) */
    CHECK_RESULT(tlsph_reproduce(&nodes, X, &out, NULL), TLSPH_OK);
    CHECK_CLOSE(gradient[0] * nodes_at[0] + gradient[3] * nodes_at[3] + gradient[6] * nodes_at[6], 1, 100 * EPSILON);
}

/* ---- materials ---- */

/* At q = 0 the reference entropy is beta ln J, beta = 3 kappa alpha, with k = kappa - beta theta_R > 0 left (000-30 to 32). */
TEST(entropy_at_gruneisen_exponent_0)
{
    tlsph_material m = soft_material(TLSPH_MIE_GRUNEISEN);
    tlsph_material_state state;
    tlsph_material_report report;
    const tlsph_real F[9] = {R(1.2), 0, 0, 0, 1, 0, 0, 0, 1};
    m.gruneisen_exponent = 0;
    const double kappa = (double)m.young / (3 - 6 * (double)m.poisson);
    for (int i = 0; i < 2; i++) {
        m.expansion = R(i ? 1e-4 : 0);
        REQUIRE_OK(tlsph_material_evaluate(&m, F, m.reference_temperature, &state));
        const double eta = 3 * kappa * (double)m.expansion * log(1.2);
        CHECK_CLOSE(state.eta, eta, 100 * EPSILON * (eta + 1));
        CHECK_RESULT(tlsph_material_check(&m, 0.3, 1, &report, NULL), TLSPH_OK);
    }
}
/* Far out, where squares leave the numbers, a step ends with a code and the state before. */
TEST(strains_beyond_the_numbers)
{
    static const double far[2] = {1e110, 1e170}; /* det F, or F:F alone, overflows */
    DOUBLE_ONLY();
    for (int k = 0; k < 2; k++) {
        small s;
        tlsph_solver *solver;
        tlsph_real *F;
        REQUIRE(small_make(&s, 3));
        REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
        REQUIRE((F = read_field(solver, TLSPH_FIELD_F)) != NULL);
        const uint64_t hash = state_hash(solver);
        for (int i = 0; i < 3; i++) F[9 * 7 + 4 * i] = R(k ? (i == 1 ? 1 / far[k] : i ? 1 : far[k]) : far[k]);
        CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_F, F), TLSPH_ERROR_NOT_FINITE);
        CHECK(state_hash(solver) == hash);
        CHECK_RESULT(take_steps(solver, 2), TLSPH_OK);
        free(F);
        tlsph_destroy(solver);
        own_cloud_destroy(&s.cloud);
    }
}

/* ---- options where they do not apply ---- */

/* State after some steps of a body with a smooth motion. */
static uint64_t moved(small *s, double speed, tlsph_ledger *first, tlsph_ledger *last)
{
    tlsph_solver *solver;
    uint64_t hash = 0;
    if (!CHECK_RESULT(tlsph_create(&s->desc, &solver, NULL), TLSPH_OK)) return 0;
    CHECK_RESULT(moving_block_kick(solver, speed), TLSPH_OK);
    tlsph_ledger_read(solver, first);
    for (int i = 0; i < 10; i++) CHECK_RESULT(tlsph_step(solver, R(1e-4)), TLSPH_OK);
    tlsph_ledger_read(solver, last);
    hash = state_hash(solver);
    tlsph_destroy(solver);
    return hash;
}
/* Stages for conduction where nothing conducts, freezing of a dissipation that is none, relaxation of a J that is not there. */
TEST(options_without_an_object_change_nothing)
{
    for (int i = 0; i < 3; i++) {
        small s;
        tlsph_ledger first, last;
        REQUIRE(small_make(&s, 3));
        s.desc.thermal = i == 1 ? TLSPH_ISOTHERMAL : TLSPH_ENTROPY;
        s.material.conductivity = 0;
        if (i == 1) s.desc.dissipation = TLSPH_NO_DISSIPATION, s.desc.integrator = TLSPH_RK3_FROZEN;
        const uint64_t without = moved(&s, 0.3, &first, &last);
        if (i == 0) s.desc.conduction_stages = 9;
        if (i == 1) s.desc.harmonic = R(0.3);
        if (i == 2) s.desc.drift_relaxation = R(0.5);
        CHECK(moved(&s, 0.3, &first, &last) == without);
        own_cloud_destroy(&s.cloud);
    }
}
/* Where dissipation does not heat and nothing conducts, no particle's entropy may change; where it does, all of it counts. */
TEST(entropy_without_the_heat_of_dissipation)
{
    for (int heats = 0; heats < 2; heats++) {
        small s;
        tlsph_ledger first, last;
        REQUIRE(small_make(&s, 3));
        s.desc.thermal = TLSPH_ENTROPY;
        s.desc.dissipation_heats = heats;
        s.material.conductivity = 0;
        moved(&s, 2, &first, &last);
        if (heats) CHECK(last.entropy > first.entropy && last.dissipation > 0);
        else CHECK_CLOSE(last.entropy, first.entropy, 100 * EPSILON * fabs(first.entropy));
        own_cloud_destroy(&s.cloud);
    }
}
/* Volumes of cells are theirs, whether given or not. */
TEST(cells_bring_their_volumes)
{
    for (int dimension = 2; dimension <= 3; dimension++) {
        small s;
        tlsph_ledger first, last;
        REQUIRE(small_make(&s, dimension));
        s.desc.operator_kind = TLSPH_CELLS;
        const uint64_t given = moved(&s, 0.3, &first, &last);
        s.desc.particles.volumes = s.desc.particles.weights = NULL;
        s.desc.particles.spacing = 0; /* follows from the volumes */
        CHECK(moved(&s, 0.3, &first, &last) == given);
        CHECK_CLOSE(last.mass, s.material.density, 100 * EPSILON * (double)s.material.density);
        own_cloud_destroy(&s.cloud);
    }
}

/* Two materials without a list: all particles are of the first. With one: steel flows in its half only. */
TEST(materials_keep_to_their_particles)
{
    small s;
    tlsph_ledger first, last;
    tlsph_material both[2];
    tlsph_solver *solver;
    tlsph_real *strain;
    REQUIRE(small_make(&s, 3));
    both[0] = s.material;
    both[1] = soft_material(TLSPH_VON_MISES);
    both[1].yield_stress = 1;
    both[1].density = 3 * both[0].density;
    s.desc.particles.materials = NULL;
    s.desc.materials = both;
    s.desc.material_count = 2;
    moved(&s, 0.3, &first, &last);
    CHECK_CLOSE(last.mass, both[0].density, 100 * EPSILON * (double)both[0].density);
    for (size_t a = 0; a < s.cloud.particles.count; a++) s.cloud.materials[a] = (double)s.cloud.positions[3 * a] > 0.4;
    s.desc.particles.materials = s.cloud.materials;
    REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
    CHECK_RESULT(moving_block_kick(solver, 5), TLSPH_OK);
    CHECK_RESULT(take_steps(solver, 10), TLSPH_OK);
    REQUIRE((strain = read_field(solver, TLSPH_FIELD_PLASTIC_STRAIN)) != NULL);
    int flowed = 0;
    for (size_t a = 0; a < s.cloud.particles.count; a++) {
        if (!s.cloud.materials[a]) CHECK(strain[a] == 0);
        flowed += strain[a] > 0;
    }
    CHECK(flowed > 25);
    free(strain);
    tlsph_destroy(solver);
    own_cloud_destroy(&s.cloud);
}
/* A load on areas without a normal: each particle's whole area vector counts. */
TEST(heat_through_whole_area_vectors)
{
    small s;
    tlsph_solver *solver;
    tlsph_ledger first, last;
    uint32_t face[25];
    double area = 0;
    REQUIRE(small_make(&s, 3));
    s.desc.thermal = TLSPH_ENERGY;
    s.material.conductivity = 0;
    s.conditions[0] = tlsph_condition_default(TLSPH_HEAT_FLUX);
    s.conditions[0].particles = face;
    s.conditions[0].count = tlsph_select_plane(&s.cloud.particles, 0, 0, R(1e-6), face, 25);
    s.conditions[0].value[0] = -100; /* into the body */
    s.desc.condition_count = 1;
    REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
    tlsph_real *areas = read_field(solver, TLSPH_FIELD_BOUNDARY_AREA);
    REQUIRE(areas);
    for (size_t a = 0; a < tlsph_count(solver); a++) {
        const tlsph_real *B = areas + 3 * a;
        if (s.cloud.positions[3 * a] < R(1e-6)) area += sqrt((double)(B[0] * B[0] + B[1] * B[1] + B[2] * B[2]));
    }
    CHECK(area > 1 && area < 2); /* the face has 1 m^2, the vectors at its edges reach around them */
    tlsph_ledger_read(solver, &first);
    CHECK_RESULT(tlsph_step(solver, R(1e-4)), TLSPH_OK);
    tlsph_ledger_read(solver, &last);
    CHECK_CLOSE(last.external_heat, 100 * area * last.time, ROUNDED(1e-12, 100) * 100 * area * last.time);
    CHECK_CLOSE(last.thermal_energy - first.thermal_energy, last.external_heat, ROUNDED(1e-6, 1e7) * last.external_heat + 10 * EPSILON * last.thermal_energy);
    free(areas);
    tlsph_destroy(solver);
    own_cloud_destroy(&s.cloud);
}
/* A sphere of many more facets than its particles can see one by one. */
static void facet(tlsph_real *corner, size_t *at, const double a[3], const double b[3], const double c[3], int level)
{
    double m[3][3];
    if (level == 0) {
        for (int k = 0; k < 9; k++) corner[*at + (size_t)k] = R((k < 3 ? a : k < 6 ? b : c)[k % 3]);
        *at += 9;
        return;
    }
    for (int i = 0; i < 3; i++) {
        const double *p = i == 0 ? a : i == 1 ? b : c, *q = i == 0 ? b : i == 1 ? c : a;
        for (int k = 0; k < 3; k++) m[i][k] = p[k] + q[k]; /* the same sum from either side */
        const double size = sqrt(m[i][0] * m[i][0] + m[i][1] * m[i][1] + m[i][2] * m[i][2]);
        for (int k = 0; k < 3; k++) m[i][k] /= size;
    }
    facet(corner, at, a, m[0], m[2], level - 1);
    facet(corner, at, m[0], b, m[1], level - 1);
    facet(corner, at, m[2], m[1], c, level - 1);
    facet(corner, at, m[0], m[1], m[2], level - 1);
}
TEST(a_surface_finer_than_the_particles)
{
    enum { LEVEL = 5, FACETS = 8 << (2 * LEVEL) };
    tlsph_real *corners, X[3 * 33], V[33], B[3 * 33];
    tlsph_surface surface = {FACETS, NULL};
    tlsph_particles p;
    size_t at = 0;
    double total = 0, open[3] = {0};
    tlsph_error error;
    DOUBLE_ONLY();
    corners = malloc(9 * FACETS * sizeof *corners);
    surface.corners = corners;
    REQUIRE(corners);
    memset(&p, 0, sizeof p);
    for (int i = 0; i < 8; i++) {
        const double x[3] = {i & 1 ? -1 : 1, 0, 0}, y[3] = {0, i & 2 ? -1 : 1, 0}, z[3] = {0, 0, i & 4 ? -1 : 1};
        const int turned = ((i & 1) + (i >> 1 & 1) + (i >> 2)) % 2;
        facet(corners, &at, x, turned ? z : y, turned ? y : z, LEVEL);
    }
    for (int i = 0; i < 125; i++) { /* a lattice of spacing 0.5 inside */
        const double x[3] = {0.5 * (i % 5 - 2), 0.5 * (i / 5 % 5 - 2), 0.5 * (i / 25 - 2)};
        if (x[0] * x[0] + x[1] * x[1] + x[2] * x[2] > 0.9) continue;
        for (int k = 0; k < 3; k++) X[3 * p.count + (size_t)k] = R(x[k]);
        p.count++;
    }
    p.positions = X;
    p.spacing = R(0.5);
    if (CHECK_RESULT(tlsph_voronoi(3, &p, &surface, NULL, V, B, NULL, &error), TLSPH_OK)) {
        for (size_t a = 0; a < p.count; a++) {
            CHECK(V[a] > R(0.5 * 0.125) && V[a] < R(3 * 0.125));
            total += (double)V[a];
            for (int k = 0; k < 3; k++) open[k] += (double)B[3 * a + (size_t)k];
        }
        CHECK_CLOSE(total, 4 * PI / 3, 2e-3 * 4 * PI / 3); /* that of the facets */
        for (int k = 0; k < 3; k++) CHECK_CLOSE(open[k], 0, 1e4 * EPSILON);
    } else printf("    %s\n", error.message);
    REPORT("%d particles, volume %+.1e", (int)p.count, total / (4 * PI / 3) - 1);
    free(corners);
}

/* Linearised: J is tr F - 2, and follows an F that the host writes. */
TEST(jacobian_of_the_linear_material)
{
    small s;
    tlsph_solver *solver;
    tlsph_real *F, *J;
    REQUIRE(small_make(&s, 3));
    s.material.kind = TLSPH_LINEAR;
    s.desc.unknowns = TLSPH_PFJ;
    REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
    REQUIRE((F = read_field(solver, TLSPH_FIELD_F)) != NULL);
    for (size_t i = 0; i < 9 * s.cloud.particles.count; i++) F[i] += R(0.01 * (double)(i % 9));
    CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_F, F), TLSPH_OK);
    REQUIRE((J = read_field(solver, TLSPH_FIELD_J)) != NULL);
    for (size_t a = 0; a < s.cloud.particles.count; a++) CHECK_CLOSE(J[a], 1.12, 10 * EPSILON);
    free(F);
    free(J);
    tlsph_destroy(solver);
    own_cloud_destroy(&s.cloud);
}
/* The printed forces of plain corrected kernels sum over the kernel's own gradient: they keep the linear momentum. */
TEST(printed_forces_keep_the_momentum)
{
    small s;
    tlsph_ledger first, last;
    REQUIRE(small_make(&s, 3));
    s.desc.force_form = TLSPH_FORCE_AS_PRINTED;
    s.desc.support = R(0.9);
    s.desc.projection = 0;
    moved(&s, 2, &first, &last);
    for (int i = 0; i < 3; i++) CHECK_CLOSE(last.linear_momentum[i], first.linear_momentum[i], 100 * EPSILON * last.mass * 2);
    CHECK(fabs(last.kinetic_energy - first.kinetic_energy) > 1e-6 * first.kinetic_energy);
    own_cloud_destroy(&s.cloud);
}

/* ---- mirrors of the operator of order 4 ---- */

static uint64_t operator_hash(small *s)
{
    tlsph_solver *solver;
    tlsph_operator o;
    uint64_t hash = 0xcbf29ce484222325u;
    tlsph_error error;
    if (!CHECK_RESULT(tlsph_create(&s->desc, &solver, &error), TLSPH_OK)) { printf("    %s\n", error.message); return 0; }
    tlsph_operator_view(solver, &o);
    const unsigned char *bytes = (const unsigned char *)o.vectors;
    for (size_t i = 0; i < o.pairs * 3 * sizeof(tlsph_real); i++) hash = (hash ^ bytes[i]) * 0x100000001B3u;
    tlsph_destroy(solver);
    return hash;
}
/* A roller mirrors unless heat crosses it; a tangent plane mirrors where no scalar needs a gradient; each can be turned off.
   A slanted one is no mirror of the lattice. */
TEST(which_conditions_mirror)
{
    const struct {
        tlsph_condition_kind kind;
        tlsph_thermal thermal;
        tlsph_unknowns unknowns;
        int conducts, off, slanted, mirrors;
    } rows[] = {
        {TLSPH_ROLLER, TLSPH_ISOTHERMAL, TLSPH_PF, 0, 0, 0, 1},   {TLSPH_ROLLER, TLSPH_ENERGY, TLSPH_PF, 0, 0, 0, 1},
        {TLSPH_ROLLER, TLSPH_ENERGY, TLSPH_PF, 1, 0, 0, 0},       {TLSPH_ROLLER, TLSPH_ISOTHERMAL, TLSPH_PF, 0, 1, 0, 0},
        {TLSPH_ROLLER, TLSPH_ISOTHERMAL, TLSPH_PFJ, 0, 0, 1, 0},  {TLSPH_TANGENT, TLSPH_ISOTHERMAL, TLSPH_PF, 0, 0, 0, 1},
        {TLSPH_TANGENT, TLSPH_ISOTHERMAL, TLSPH_PFH, 0, 0, 0, 1}, {TLSPH_TANGENT, TLSPH_ISOTHERMAL, TLSPH_PFJ, 0, 0, 0, 0},
        {TLSPH_TANGENT, TLSPH_ISOTHERMAL, TLSPH_PFHJ, 0, 0, 0, 0}, {TLSPH_TANGENT, TLSPH_ENTROPY, TLSPH_PF, 0, 0, 0, 0},
        {TLSPH_CLAMPED, TLSPH_ISOTHERMAL, TLSPH_PF, 0, 0, 0, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        small s;
        uint32_t face[25];
        tlsph_condition *c = s.conditions;
        REQUIRE(small_make(&s, 3));
        s.desc.operator_kind = TLSPH_CELLS_4;
        s.desc.integrator = TLSPH_SSP_RK3;
        s.desc.unknowns = rows[i].unknowns;
        s.desc.thermal = rows[i].thermal;
        const uint64_t bare = operator_hash(&s);
        *c = tlsph_condition_default(rows[i].kind);
        c->count = tlsph_select_plane(&s.cloud.particles, 0, 0, R(1e-6), face, 25);
        c->particles = face;
        c->normal[0] = 1;
        c->normal[1] = R(rows[i].slanted);
        c->conducts = rows[i].conducts;
        s.desc.mirror_gradients = !rows[i].off;
        s.desc.condition_count = 1;
        if (!CHECK_SAME(operator_hash(&s) != bare, rows[i].mirrors)) printf("    row %d\n", (int)i);
        own_cloud_destroy(&s.cloud);
    }
}
/* Lattices whose layers change in thickness: another interval begins there, and linear fields stay exact. */
TEST(layers_of_two_sizes)
{
    small s;
    tlsph_solver *solver;
    tlsph_operator o;
    double worst = 0;
    const int cells[3] = {16, 7, 7};
    memset(&s, 0, sizeof s);
    REQUIRE(small_make(&s, 3));
    own_cloud_destroy(&s.cloud);
    REQUIRE(own_box(&s.cloud, 3, cells, 0.25, 0));
    s.desc.particles = s.cloud.particles;
    for (size_t a = 0; a < s.cloud.particles.count; a++) {
        tlsph_real *x = s.cloud.positions + 3 * a;
        if (*x > 2) *x += *x - 2;
    }
    s.desc.operator_kind = TLSPH_CELLS_4;
    s.desc.integrator = TLSPH_SSP_RK3;
    s.desc.particles.volumes = s.desc.particles.weights = NULL;
    REQUIRE_OK(tlsph_create(&s.desc, &solver, NULL));
    tlsph_operator_view(solver, &o);
    for (size_t a = 0; a < o.count; a++) {
        double slope = 0;
        for (size_t k = o.first[a]; k < o.first[a + 1]; k++)
            slope += (double)(o.vectors[3 * k] * (s.cloud.positions[3 * o.host[o.neighbours[k]]] -
                                                  s.cloud.positions[3 * o.host[a]]) / (2 * o.volumes[a]));
        worst = fmax(worst, fabs(slope - 1));
    }
    CHECK_BELOW(worst, 3e2 * EPSILON);
    tlsph_destroy(solver);
    own_cloud_destroy(&s.cloud);
}

SUITE(edges, ENTRY(calls_without_arguments), ENTRY(constants_outside_their_lists),
      ENTRY(no_dissipation_without_area_or_distance), ENTRY(parts_that_may_be_missing),
      ENTRY(entropy_at_gruneisen_exponent_0), ENTRY(strains_beyond_the_numbers),
      ENTRY(options_without_an_object_change_nothing), ENTRY(entropy_without_the_heat_of_dissipation),
      ENTRY(cells_bring_their_volumes),
      ENTRY(materials_keep_to_their_particles), ENTRY(heat_through_whole_area_vectors),
      ENTRY(a_surface_finer_than_the_particles), ENTRY(jacobian_of_the_linear_material),
      ENTRY(printed_forces_keep_the_momentum), ENTRY(which_conditions_mirror), ENTRY(layers_of_two_sizes))
