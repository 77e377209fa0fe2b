/* Voronoi volumes and areas, surfaces, and the closed operator for irregular clouds. */
#include "physics.h"
#include "support.h"

static tlsph_fill cloud_fill(int dimension, tlsph_shape shape, double cells, double jitter)
{
    tlsph_fill fill = tlsph_fill_default(dimension);
    fill.shape = shape;
    fill.size[0] = 1; fill.size[1] = R(0.75); fill.size[2] = R(0.5);
    fill.notch[0] = R(0.5); fill.notch[1] = R(0.5);
    fill.spacing = R(1 / cells);
    fill.jitter = R(jitter);
    fill.seed = 7;
    fill.voronoi = 1;
    return fill;
}

static tlsph_desc closed_desc(int dimension, const tlsph_particles *particles, const tlsph_material *material)
{
    tlsph_desc desc = tlsph_desc_default(dimension);
    desc.particles = *particles;
    desc.materials = material;
    desc.material_count = 1;
    closed_operator(&desc);
    desc.keep_pairs = 1;
    desc.threads = 1;
    return desc;
}

#define ROUNDED(relative, epsilons) fmax((relative), (epsilons) * EPSILON)

static tlsph_material closed_material(void)
{
    tlsph_material m = scene_paper_material(TLSPH_NEO_HOOKEAN);
    return m;
}

/* ---- Voronoi cells ---- */

static void check_cells(int dimension, tlsph_shape shape, double jitter, double volume, double area,
                        const double centre[3])
{
    const tlsph_fill fill = cloud_fill(dimension, shape, 8, jitter);
    tlsph_cloud cloud;
    double sum = 0, size = 0, B[3] = { 0 }, X[3] = { 0 };
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    for (size_t a = 0; a < cloud.particles.count; a++) {
        const double V = (double)cloud.particles.volumes[a];
        double norm = 0;
        sum += V;
        for (size_t k = 0; k < 3; k++) {
            const double b = (double)cloud.particles.areas[3 * a + k];
            norm += fabs(b); /* all faces are across an axis */
            B[k] += b;
            X[k] += V * (double)cloud.particles.positions[3 * a + k];
        }
        size += norm;
    }
    CHECK_CLOSE(sum, volume, 1000 * EPSILON * volume);
    CHECK_CLOSE(size, area, ROUNDED(1e-9, 1000) * area);
    for (int k = 0; k < 3; k++) CHECK_CLOSE(B[k], 0, 1000 * EPSILON * area);
    for (int k = 0; k < dimension; k++) CHECK_CLOSE(X[k] / sum, centre[k], 1000 * EPSILON);
    tlsph_cloud_destroy(&cloud);
}

TEST(cells_fill_the_body)
{
    /* the L lacks [0.5,1] x [0.5,0.75]; its centroid from the two boxes */
    const double box[3] = { 0.5, 0.375, 0.25 }, x = (0.5 * 0.75 - 0.125 * 0.75) / 0.625, y = (0.75 * 0.375 - 0.125 * 0.625) / 0.625;
    const double corner[3] = { x, y, 0.25 };
    for (int i = 0; i < 3; i++) {
        const double jitter = 0.2 * i;
        check_cells(3, TLSPH_BOX, jitter, 0.375, 2 * (0.75 + 0.5 + 0.375), box);
        check_cells(2, TLSPH_BOX, jitter, 0.75, 3.5, box);
        check_cells(3, TLSPH_L_SHAPE, jitter, 0.625 * 0.5, 2 * 0.625 + 3.5 * 0.5, corner);
        check_cells(2, TLSPH_L_SHAPE, jitter, 0.625, 3.5, corner);
    }
}

/* On a lattice the cells are known: V_a is the tributary volume, also beside the re-entrant edge. */
TEST(cells_of_a_lattice)
{
    for (int dimension = 2; dimension <= 3; dimension++) {
        tlsph_fill fill = cloud_fill(dimension, TLSPH_L_SHAPE, 8, 0);
        tlsph_cloud cells, lattice;
        REQUIRE_OK(tlsph_cloud_create(&fill, &cells, NULL));
        fill.voronoi = 0;
        REQUIRE_OK(tlsph_cloud_create(&fill, &lattice, NULL));
        for (size_t a = 0; a < cells.particles.count; a++)
            CHECK_CLOSE(cells.particles.volumes[a] / lattice.particles.volumes[a], 1, ROUNDED(1e-6, 100));
        tlsph_cloud_destroy(&cells);
        tlsph_cloud_destroy(&lattice);
    }
}

/* Triangles of the unit tetrahedron. */
static const tlsph_real tetrahedron[36] = { 0, 0, 0, 0, 1, 0, 1, 0, 0,  0, 0, 0, 1, 0, 0, 0, 0, 1,
                                            0, 0, 0, 0, 0, 1, 0, 1, 0,  1, 0, 0, 0, 1, 0, 0, 0, 1 };

TEST(surfaces_are_checked)
{
    const tlsph_real X[12] = { R(0.1), R(0.1), R(0.1), R(0.5), R(0.2), R(0.1), R(0.2), R(0.5), R(0.1), R(0.1), R(0.2), R(0.5) };
    tlsph_real corners[36], V[4], B[12];
    tlsph_particles particles;
    tlsph_surface surface;
    tlsph_error error;
    memset(&particles, 0, sizeof particles);
    particles.count = 4;
    particles.positions = X;
    particles.spacing = R(0.7);
    surface.count = 4;
    surface.corners = corners;
    memcpy(corners, tetrahedron, sizeof corners);
    CHECK_RESULT(tlsph_voronoi(3, &particles, &surface, NULL, V, B, NULL, &error), TLSPH_OK);
    CHECK_CLOSE(V[0] + V[1] + V[2] + V[3], 1.0 / 6, 100 * EPSILON);
    surface.count = 3; /* the slanting face is missing: a leak along its edges */
    particles.count = 1;
    for (int i = 0; i < 9; i++) corners[i] = tetrahedron[27 + i];
    for (int i = 0; i < 18; i++) corners[9 + i] = tetrahedron[9 + i];
    CHECK_RESULT(tlsph_voronoi(3, &particles, &surface, NULL, V, B, NULL, &error), TLSPH_ERROR_SURFACE);
    CHECK(strstr(error.message, "leak") != NULL && strstr(error.message, "at (") != NULL);
    CHECK_CLOSE(error.position[2], 0, EPSILON); /* the hole is the face Z = 0 */
    memcpy(corners, tetrahedron, sizeof corners);
    surface.count = 4;
    for (int k = 0; k < 3; k++) { corners[3 + k] = tetrahedron[6 + k]; corners[6 + k] = tetrahedron[3 + k]; }
    CHECK_RESULT(tlsph_voronoi(3, &particles, &surface, NULL, V, B, NULL, &error), TLSPH_ERROR_SURFACE);
    CHECK(strstr(error.message, "flipped") != NULL);
    for (int f = 0; f < 4; f++) /* all of them: inside out */
        for (int k = 0; k < 3; k++) {
            corners[9 * f + 3 + k] = tetrahedron[9 * f + 6 + k];
            corners[9 * f + 6 + k] = tetrahedron[9 * f + 3 + k];
        }
    CHECK_RESULT(tlsph_voronoi(3, &particles, &surface, NULL, V, B, NULL, &error), TLSPH_ERROR_SURFACE);
    for (int i = 0; i < 3; i++) { /* no number; too large for a volume; far more facets than memory can hold */
        memcpy(corners, tetrahedron, sizeof corners);
        for (int c = 0; c < 36 && i < 2; c++)
            if (tetrahedron[c] > 0) corners[c] = i ? R(HUGE_VAL) : R(NAN);
        surface.count = i == 2 ? 2000000000u : 4;
        CHECK(tlsph_voronoi(3, &particles, &surface, NULL, V, B, NULL, &error) != TLSPH_OK);
        CHECK(error.message[0] != 0);
    }
}
/* Two bodies in one surface, apart or through each other: the second has no meaning. */
TEST(surfaces_through_each_other)
{
    for (int i = 0; i < 2; i++) {
        const double shift = i ? 0.2 : 2;
        const tlsph_real X[6] = { R(0.2), R(0.2), R(0.2), R(0.2 + shift), R(0.2), R(0.2) };
        tlsph_real corners[72], V[2], B[6], spacings[2] = { R(0.7), R(0.7) };
        tlsph_particles particles;
        const tlsph_surface surface = { 8, corners };
        memset(&particles, 0, sizeof particles);
        particles.count = 2;
        particles.positions = X;
        particles.spacings = spacings; /* local ones do without a common one */
        memcpy(corners, tetrahedron, sizeof tetrahedron);
        for (int c = 0; c < 36; c++) corners[36 + c] = tetrahedron[c] + R(c % 3 ? 0 : shift);
        CHECK_RESULT(tlsph_voronoi(3, &particles, &surface, NULL, V, B, NULL, NULL), i ? TLSPH_ERROR_SURFACE : TLSPH_OK);
        if (!i) CHECK_CLOSE(V[0] + V[1], 1.0 / 3, 100 * EPSILON);
    }
}

TEST(particles_outside_are_refused)
{
    const tlsph_real X[6] = { R(0.1), R(0.1), R(0.1), 4, 4, 4 };
    tlsph_real V[2], B[6];
    tlsph_particles particles;
    tlsph_surface surface;
    tlsph_error error;
    memset(&particles, 0, sizeof particles);
    particles.count = 2;
    particles.positions = X;
    particles.spacing = R(0.7);
    surface.count = 4;
    surface.corners = tetrahedron;
    CHECK_RESULT(tlsph_voronoi(3, &particles, &surface, NULL, V, B, NULL, &error), TLSPH_ERROR_VOLUME);
    CHECK_SAME(error.particle, 1);
}

/* ---- the closed operator ---- */

static void check_operator(const tlsph_operator *o, double linear)
{
    const size_t D = (size_t)o->dimension;
    double worst = 0, largest = 0;
    CHECK(!o->corrected);
    for (size_t a = 0; a < o->count; a++)
        for (size_t k = o->first[a]; k < o->first[a + 1]; k++) {
            const size_t b = o->neighbours[k];
            size_t back = o->first[b];
            while (back < o->first[b + 1] && o->neighbours[back] != a) back++;
            REQUIRE(back < o->first[b + 1]);
            for (size_t i = 0; i < D; i++) {
                worst = fmax(worst, fabs((double)(o->vectors[D * k + i] + o->vectors[D * back + i])));
                largest = fmax(largest, fabs((double)o->vectors[D * k + i]));
            }
        }
    CHECK(worst <= 4 * EPSILON * largest);
    CHECK_BELOW(linear, 0.055); /* above 5 % a second solution is made */
}

TEST(closed_antisymmetric_exact)
{
    const tlsph_material material = closed_material();
    for (int dimension = 2; dimension <= 3; dimension++)
        for (int shape = 0; shape < 2; shape++) {
            const tlsph_fill fill = cloud_fill(dimension, shape ? TLSPH_L_SHAPE : TLSPH_BOX, 8, 0.2);
            tlsph_cloud cloud;
            tlsph_solver *solver;
            tlsph_closure report;
            tlsph_operator view;
            tlsph_desc desc;
            tlsph_error error;
            REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
            desc = closed_desc(dimension, &cloud.particles, &material);
            if (!CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_OK)) { REPORT("%s", error.message); return; }
            tlsph_closure_read(solver, &report);
            tlsph_operator_view(solver, &view);
            check_operator(&view, report.linear);
            CHECK(report.iterations > 0 && report.residual <= 2e-2 && report.change_mean > 0);
            tlsph_destroy(solver);
            tlsph_cloud_destroy(&cloud);
        }
}

/* Particles behind the surface need its moments. */
TEST(closed_refuses_centred_cells)
{
    const tlsph_material material = closed_material();
    for (int dimension = 2; dimension <= 3; dimension++)
        for (int cells = 4; cells <= 16; cells *= 2) {
            tlsph_fill fill = cloud_fill(dimension, TLSPH_BOX, cells, 0.2);
            tlsph_cloud cloud;
            tlsph_solver *solver;
            tlsph_error error;
            fill.placement = TLSPH_CELL_CENTRED;
            REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
            tlsph_desc desc = closed_desc(dimension, &cloud.particles, &material);
            desc.particles.moments = NULL;
            CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_ERROR_SURFACE);
            CHECK(strstr(error.message, "particles on the surface") != NULL);
            tlsph_cloud_destroy(&cloud);
        }
}

/* Points without their surface, areas turned inward, and a splinter beyond everybody's reach. */
TEST(closed_refusals)
{
    const tlsph_material material = closed_material();
    const tlsph_fill fill = cloud_fill(2, TLSPH_BOX, 8, 0.2);
    tlsph_real *areas, *positions;
    tlsph_cloud cloud;
    tlsph_solver *solver;
    tlsph_error error;
    tlsph_desc desc;
    size_t n;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    n = cloud.particles.count;
    desc = closed_desc(2, &cloud.particles, &material);
    desc.particles.areas = NULL;
    CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_ERROR_DESCRIPTION);
    CHECK(strstr(error.message, "areas") != NULL);
    areas = malloc(3 * n * sizeof *areas);
    positions = malloc(3 * n * sizeof *positions);
    for (size_t i = 0; i < 3 * n; i++) { areas[i] = -cloud.particles.areas[i]; positions[i] = cloud.particles.positions[i]; }
    desc.particles.areas = areas;
    CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_ERROR_VOLUME);
    for (size_t i = 0; i < 3 * n; i++) areas[i] = cloud.particles.areas[i];
    areas[0] *= 2;
    CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_ERROR_NEIGHBOURS); /* an open surface */
    CHECK(strstr(error.message, "closed surface") != NULL);
    areas[0] = cloud.particles.areas[0];
    for (size_t i = 0; i < 3 * n; i++) areas[i] = 0; /* no surface at all */
    CHECK(tlsph_create(&desc, &solver, &error) != TLSPH_OK);
    for (size_t i = 0; i < 3 * n; i++) areas[i] = cloud.particles.areas[i];
    desc.particles.positions = positions;
    memcpy(positions + 3 * 40, positions + 3 * 41, 3 * sizeof *positions);
    CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_ERROR_DUPLICATE);
    CHECK(error.particle == 40 || error.particle == 41);
    memcpy(positions + 3 * 40, cloud.particles.positions + 3 * 40, 3 * sizeof *positions);
    positions[0] = -10;
    CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_ERROR_NEIGHBOURS);
    free(areas); free(positions);
    tlsph_cloud_destroy(&cloud);
}

static void backwards(void *user, tlsph_task_fn task, void *arg, size_t count)
{
    (void)user;
    while (count-- > 0) task(arg, count);
}

TEST(closed_same_bits_for_any_threads)
{
    const tlsph_material material = closed_material();
    const tlsph_fill fill = cloud_fill(3, TLSPH_BOX, 8, 0.3);
    tlsph_cloud cloud;
    uint64_t hash[2] = { 0, 0 };
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    for (int i = 0; i < 2; i++) {
        tlsph_desc desc = closed_desc(3, &cloud.particles, &material);
        tlsph_solver *solver;
        if (i) desc.run = backwards;
        REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
        tlsph_real *velocity = scene_read(solver, TLSPH_FIELD_VELOCITY);
        for (size_t k = 0; k < 3 * cloud.particles.count; k++)
            velocity[k] = R(0.1 * sin(3 * (double)cloud.particles.positions[k]));
        REQUIRE_OK(tlsph_write(solver, TLSPH_FIELD_VELOCITY, velocity));
        REQUIRE_OK(fixed_steps(solver, 1e-3, 3));
        free(velocity);
        velocity = scene_read(solver, TLSPH_FIELD_VELOCITY);
        for (size_t k = 0; k < 3 * cloud.particles.count; k++) {
            const double x = (double)velocity[k];
            uint64_t bits;
            memcpy(&bits, &x, sizeof bits);
            hash[i] = (hash[i] ^ bits) * 0x9e3779b97f4a7c15u;
        }
        free(velocity);
        tlsph_destroy(solver);
    }
    CHECK(hash[0] == hash[1]);
    tlsph_cloud_destroy(&cloud);
}

/* ---- convergence: 001 section 7.1 on a cloud (METHOD section 7: 5.6e-2, 1.4e-2 in p, 4.8e-2, 1.6e-2 in P) ---- */

TEST(swinging_cube_jittered)
{
    static const double p_limit[2] = { 5.6e-2, 1.4e-2 }, P_limit[2] = { 4.8e-2, 1.6e-2 };
    double p[2], P[2];
    DOUBLE_ONLY();
    for (int i = 0; i < 2; i++) {
        swinging_cube_parameters parameters;
        swinging_cube cube;
        swinging_cube_default(&parameters);
        parameters.n = 4 << i;
        parameters.jitter = 0.2;
        parameters.options.threads = 1;
        REQUIRE_OK(swinging_cube_create(&parameters, &cube, NULL));
        REQUIRE_OK(tlsph_advance(cube.body.solver, R(0.002)));
        swinging_cube_errors(&cube, &p[i], &P[i]);
        CHECK_BELOW(p[i], p_limit[i]);
        CHECK_BELOW(P[i], P_limit[i]);
        scene_destroy(&cube.body);
    }
    CHECK(observed_order(p, 2) > 1.5 && observed_order(P, 2) > 1.2);
    REPORT("p %.2e %.2e, P %.2e %.2e", p[0], p[1], P[0], P[1]);
}

SUITE(closure, ENTRY(cells_fill_the_body), ENTRY(cells_of_a_lattice), ENTRY(surfaces_are_checked),
      ENTRY(surfaces_through_each_other), ENTRY(particles_outside_are_refused), ENTRY(closed_antisymmetric_exact),
      ENTRY(closed_refuses_centred_cells), ENTRY(closed_refusals), ENTRY(closed_same_bits_for_any_threads),
      ENTRY(swinging_cube_jittered))
