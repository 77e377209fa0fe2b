/* Irregular clouds in boxes, in bodies by signed distance and in closed surfaces. */
#include "physics.h"
#include "support.h"

typedef struct body { double area, volume; tlsph_length_fn distance; } body;

static const tlsph_real origin[3] = { 0, 0, 0 }, axis[3] = { 0, 0, 1 };

static tlsph_real ball(void *user, const tlsph_real X[3])
{
    (void)user;
    return tlsph_distance_sphere(X, origin, R(0.9));
}

static tlsph_real ring(void *user, const tlsph_real X[3])
{
    (void)user;
    return tlsph_distance_torus(X, origin, axis, R(0.65), R(0.25));
}

/* A plate with a hole: a sharp rim on both sides. */
static tlsph_real plate(void *user, const tlsph_real X[3])
{
    const tlsph_real low[3] = { R(-0.9), R(-0.7), R(-0.3) }, high[3] = { R(0.9), R(0.7), R(0.3) };
    const tlsph_real outside = tlsph_distance_box(X, low, high), hole = -tlsph_distance_cylinder(X, origin, axis, R(0.4), 4);
    (void)user;
    return outside > hole ? outside : hole;
}

static tlsph_real finer_to_the_left(void *user, const tlsph_real X[3])
{
    return *(const tlsph_real *)user * (1 + R(1.5) * (X[0] + 1)); /* 1 : 4 from X = -1 to 1 */
}

static tlsph_real slowly_finer(void *user, const tlsph_real X[3])
{
    return *(const tlsph_real *)user * (1 + R(0.5) * (X[0] + 1)); /* 1 : 2; support 0.825 closes no 1 : 4 in 3-D */
}
static tlsph_fill scattered(int dimension, tlsph_length_fn distance, double spacing)
{
    tlsph_fill fill = tlsph_fill_default(dimension);
    for (int k = 0; k < 3; k++) { fill.origin[k] = -1; fill.size[k] = 2; }
    fill.shape = distance ? TLSPH_DISTANCE : TLSPH_BOX;
    fill.distance = distance;
    fill.placement = TLSPH_SCATTERED;
    fill.spacing = R(spacing);
    fill.seed = 3;
    return fill;
}

/* Volume and area of the body, a closed surface, cells of about the spacing's size, and an operator that can be closed. */
static void check_cloud(const tlsph_fill *fill, double volume, double area, double tolerance)
{
    tlsph_material material = scene_paper_material(TLSPH_NEO_HOOKEAN);
    tlsph_desc desc = tlsph_desc_default(fill->dimension);
    double V = 0, A = 0, B[3] = { 0 }, most = 0, inner = 0;
    size_t inside = 0;
    tlsph_solver *solver;
    tlsph_cloud cloud;
    tlsph_error error;
    if (!CHECK_RESULT(tlsph_cloud_create(fill, &cloud, &error), TLSPH_OK)) { REPORT("%s", error.message); return; }
    for (size_t a = 0; a < cloud.particles.count; a++) {
        const tlsph_real *b = cloud.particles.areas + 3 * a;
        const double size = sqrt((double)(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]));
        const double share = (double)(cloud.particles.volumes[a] / cloud.particles.weights[a]);
        V += (double)cloud.particles.volumes[a];
        A += size;
        for (int k = 0; k < 3; k++) B[k] += (double)b[k];
        most = fmax(most, share);
        if (size > 0) continue;
        inner += share;
        inside++;
    }
    CHECK_CLOSE(V, volume, tolerance * volume);
    CHECK(A < 1.001 * area && A > (1 - 2 * (double)fill->spacing) * area); /* vectors at edges are shorter than their faces */
    for (int k = 0; k < 3; k++) CHECK_CLOSE(B[k], 0, 1000 * EPSILON * area);
    CHECK(most < 2 && inside > 0 && fabs(inner / (double)inside - 1) < 0.25);
    desc.particles = cloud.particles;
    desc.materials = &material;
    desc.material_count = 1;
    closed_operator(&desc);
    desc.threads = 1;
    if (!CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_OK)) REPORT("%s", error.message);
    else tlsph_destroy(solver);
    tlsph_cloud_destroy(&cloud);
}

TEST(boxes)
{
    tlsph_fill fill = scattered(3, NULL, 0.25);
    check_cloud(&fill, 8, 24, 1000 * EPSILON);
    fill.dimension = 2;
    check_cloud(&fill, 4, 8, 1000 * EPSILON);
    fill.shape = TLSPH_L_SHAPE;
    fill.notch[0] = fill.notch[1] = 1;
    check_cloud(&fill, 3, 8, 1000 * EPSILON);
    fill.dimension = 3;
    check_cloud(&fill, 6, 22, 1000 * EPSILON);
}

TEST(distances)
{
    tlsph_fill fill = scattered(3, ball, 0.2);
    check_cloud(&fill, 4.0 / 3 * SCENE_PI * 0.729, 4 * SCENE_PI * 0.81, 0.01);
    fill.distance = ring;
    fill.spacing = R(0.14);
    check_cloud(&fill, 2 * SCENE_PI * SCENE_PI * 0.65 * 0.0625, 4 * SCENE_PI * SCENE_PI * 0.65 * 0.25, 0.02);
    fill.distance = plate;
    check_cloud(&fill, 0.6 * (2.52 - SCENE_PI * 0.16), 2 * (2.52 - SCENE_PI * 0.16) + 0.6 * (6.4 + 0.8 * SCENE_PI), 0.01);
    fill.dimension = 2;
    check_cloud(&fill, 2.52 - SCENE_PI * 0.16, 6.4 + 0.8 * SCENE_PI, 0.01);
}

/* Tubes and shells: the built-in round bodies, scattered. */
TEST(round_bodies)
{
    tlsph_fill fill = scattered(3, NULL, 0.25);
    fill.shape = TLSPH_CYLINDER;
    fill.axis = 1;
    fill.inner_radius = R(0.4);
    check_cloud(&fill, 2 * SCENE_PI * 0.84, 2 * SCENE_PI * 0.84 + 4 * SCENE_PI * 1.4, 0.02);
    fill.dimension = 2;
    fill.spacing = R(0.1);
    check_cloud(&fill, SCENE_PI * 0.84, 2 * SCENE_PI * 1.4, 0.01);
}
static tlsph_real not_a_spacing(void *user, const tlsph_real X[3])
{
    (void)X;
    return *(const tlsph_real *)user;
}
/* A local spacing that cannot be meant stands for the plain one. */
TEST(impossible_spacings)
{
    const tlsph_real wrong[4] = { 0, -1, R(NAN), R(1e30) };
    tlsph_fill fill = scattered(2, plate, 0.2);
    tlsph_cloud plain, cloud;
    REQUIRE_OK(tlsph_cloud_create(&fill, &plain, NULL));
    for (int i = 0; i < 4; i++) {
        fill.spacing_at = not_a_spacing;
        fill.spacing_user = (void *)(size_t)(wrong + i);
        if (!CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, NULL), TLSPH_OK)) continue;
        for (size_t a = 0; cloud.particles.spacings && a < cloud.particles.count; a++)
            CHECK_CLOSE(cloud.particles.spacings[a], 0.2, 0.02);
        CHECK(fabs((double)cloud.particles.count / (double)plain.particles.count - 1) < 0.15);
        tlsph_cloud_destroy(&cloud);
    }
    tlsph_cloud_destroy(&plain);
}

TEST(varying_spacing)
{
    tlsph_real least = R(0.06);
    tlsph_fill fill = scattered(2, plate, 0.06);
    fill.spacing_at = finer_to_the_left;
    fill.spacing_user = &least;
    check_cloud(&fill, 2.52 - SCENE_PI * 0.16, 6.4 + 0.8 * SCENE_PI, 0.01);
    least = R(0.15);
    fill = scattered(3, NULL, 0.15);
    fill.spacing_at = slowly_finer;
    fill.spacing_user = &least;
    check_cloud(&fill, 8, 24, 1000 * EPSILON);
}

TEST(the_seed_decides)
{
    const tlsph_fill fill = scattered(3, plate, 0.25);
    tlsph_cloud a, b;
    REQUIRE_OK(tlsph_cloud_create(&fill, &a, NULL));
    REQUIRE_OK(tlsph_cloud_create(&fill, &b, NULL));
    CHECK_SAME(a.particles.count, b.particles.count);
    CHECK(memcmp(a.particles.positions, b.particles.positions, 3 * a.particles.count * sizeof(tlsph_real)) == 0);
    CHECK(memcmp(a.particles.areas, b.particles.areas, 3 * a.particles.count * sizeof(tlsph_real)) == 0);
    tlsph_cloud_destroy(&a);
    tlsph_cloud_destroy(&b);
}

/* A surface of triangles gives what the same body by distance gives. */
TEST(triangles)
{
    static const tlsph_real tetrahedron[36] = { 0, 0, 0, 0, 1, 0, 1, 0, 0,  0, 0, 0, 1, 0, 0, 0, 0, 1,
                                                0, 0, 0, 0, 0, 1, 0, 1, 0,  1, 0, 0, 0, 1, 0, 0, 0, 1 };
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_cloud refused;
    fill.shape = TLSPH_TRIANGLES;
    fill.placement = TLSPH_SCATTERED;
    fill.surface.count = 4;
    fill.surface.corners = tetrahedron;
    fill.spacing = R(0.125);
    check_cloud(&fill, 1.0 / 6, 1.5 + sqrt(3) / 2, 1000 * EPSILON);
    fill.surface.count = 3;
    CHECK_RESULT(tlsph_cloud_create(&fill, &refused, NULL), TLSPH_ERROR_SURFACE);
}

TEST(body_beyond_its_box)
{
    tlsph_fill fill = scattered(3, ball, 0.2);
    tlsph_cloud cloud;
    fill.size[0] = 1;
    CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, NULL), TLSPH_ERROR_SURFACE);
    fill = scattered(3, NULL, 0.2);
    fill.shape = TLSPH_PREDICATE;
    CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, NULL), TLSPH_ERROR_DESCRIPTION);
}

SUITE(shapes, ENTRY(boxes), ENTRY(distances), ENTRY(round_bodies), ENTRY(impossible_spacings), ENTRY(varying_spacing), ENTRY(the_seed_decides), ENTRY(triangles),
      ENTRY(body_beyond_its_box))
