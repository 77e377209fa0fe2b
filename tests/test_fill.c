/* Shapes filled with particles: volumes, counts, jitter, selection, refusals. */
#include "support.h"

static double total(const tlsph_real *values, size_t count)
{
    double sum = 0;
    size_t i;
    for (i = 0; i < count; i++) sum += (double)values[i];
    return sum;
}

static tlsph_fill box(int dimension, double spacing)
{
    tlsph_fill fill = tlsph_fill_default(dimension);
    fill.origin[0] = R(-0.5);
    fill.origin[1] = 2;
    fill.origin[2] = 1;
    fill.size[0] = 4;
    fill.size[1] = 1;
    fill.size[2] = R(1.5);
    fill.spacing = R(spacing);
    return fill;
}

static tlsph_fill l_shape(int dimension)
{
    tlsph_fill fill = tlsph_fill_default(dimension);
    fill.shape = TLSPH_L_SHAPE;
    fill.size[0] = 6;
    fill.size[1] = 10;
    fill.size[2] = 3;
    fill.notch[0] = 3;
    fill.notch[1] = 4;
    fill.spacing = R(0.5);
    return fill;
}

/* Volume and centroid; every volume positive, every particle inside the box. */
static void check_volume(const tlsph_fill *fill, int dimension, double volume, double relative)
{
    tlsph_cloud cloud;
    size_t a;
    int i;
    if (!CHECK_RESULT(tlsph_cloud_create(fill, &cloud, NULL), TLSPH_OK)) return;
    CHECK(cloud.particles.count > 0);
    CHECK_CLOSE(total(cloud.particles.volumes, cloud.particles.count), volume, relative * volume);
    for (a = 0; a < cloud.particles.count; a++) {
        CHECK(cloud.particles.volumes[a] > 0);
        for (i = 0; i < dimension; i++) {
            double x = (double)cloud.particles.positions[3 * a + (size_t)i] - (double)fill->origin[i];
            CHECK(x >= -1e-5 && x <= (double)fill->size[i] + 1e-5);
        }
    }
    tlsph_cloud_destroy(&cloud);
}

static void check_both_placements(tlsph_fill fill, int dimension, double volume, double relative)
{
    fill.placement = TLSPH_ON_FACES;
    check_volume(&fill, dimension, volume, relative);
    fill.placement = TLSPH_CELL_CENTRED;
    check_volume(&fill, dimension, volume, relative);
}

TEST(volume_of_boxes)
{
    check_both_placements(box(3, 0.25), 3, 6, 1000 * EPSILON);
    check_both_placements(box(2, 0.25), 2, 4, 1000 * EPSILON);
    check_both_placements(box(3, 0.17), 3, 6, 1000 * EPSILON); /* rounded to whole cells */
}

TEST(volume_of_l_shapes)
{
    check_both_placements(l_shape(3), 3, (60 - 3 * 6) * 3, 1000 * EPSILON);
    check_both_placements(l_shape(2), 2, 60 - 3 * 6, 1000 * EPSILON);
}

/* Cells at the rim are in or out: the error of the area falls like the cell size, far below cells x perimeter. */
TEST(volume_of_round_bodies)
{
    tlsph_fill fill = tlsph_fill_default(3);
    int axis;
    fill.shape = TLSPH_CYLINDER;
    fill.spacing = R(1.0 / 24);
    for (axis = 0; axis < 3; axis++) {
        fill.axis = axis;
        fill.size[0] = fill.size[1] = fill.size[2] = 1;
        fill.size[axis] = 2;
        fill.inner_radius = 0;
        check_both_placements(fill, 3, 2 * PI / 4, 0.03);
        fill.inner_radius = R(0.25);
        check_both_placements(fill, 3, 2 * PI / 4 * 0.75, 0.03);
    }
    fill.size[2] = 1;
    fill.shape = TLSPH_SPHERE;
    fill.inner_radius = 0;
    check_both_placements(fill, 3, PI / 6, 0.03);
    fill.inner_radius = R(0.25);
    check_both_placements(fill, 3, PI / 6 * 0.875, 0.04);
}

TEST(volume_of_disks_and_rings)
{
    tlsph_fill fill = tlsph_fill_default(2);
    fill.shape = TLSPH_CYLINDER;
    fill.size[0] = fill.size[1] = 2;
    fill.spacing = R(1.0 / 32);
    check_both_placements(fill, 2, PI, 0.02);
    fill.inner_radius = R(0.5);
    check_both_placements(fill, 2, PI * 0.75, 0.02);
}

static int below_diagonal(void *user, const tlsph_real X[3])
{
    ++*(size_t *)user;
    return X[0] + X[1] < 1;
}

TEST(volume_of_a_predicate)
{
    size_t calls = 0;
    tlsph_fill fill = tlsph_fill_default(2);
    fill.shape = TLSPH_PREDICATE;
    fill.size[0] = fill.size[1] = 1;
    fill.spacing = R(1.0 / 40);
    fill.inside = below_diagonal;
    fill.inside_user = &calls;
    check_both_placements(fill, 2, 0.5, 0.03);
    CHECK(calls >= 1600);
}

TEST(counts_on_lattices)
{
    tlsph_fill fill = box(3, 0.25);
    tlsph_cloud cloud;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    CHECK_SAME(cloud.particles.count, 17 * 5 * 7);
    CHECK_SAME(cloud.particles.cell_count, 16 * 4 * 6);
    tlsph_cloud_destroy(&cloud);
    fill.placement = TLSPH_CELL_CENTRED;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    CHECK_SAME(cloud.particles.count, 16 * 4 * 6);
    tlsph_cloud_destroy(&cloud);
    fill = l_shape(2);
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    CHECK_SAME(cloud.particles.count, 13 * 21 - 6 * 12);
    CHECK_SAME(cloud.particles.cell_count, 12 * 20 - 6 * 12);
    tlsph_cloud_destroy(&cloud);
}

TEST(spacing_is_rounded_to_whole_cells)
{
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_cloud cloud;
    int i;
    for (i = 0; i < 3; i++) fill.size[i] = 1;
    fill.spacing = R(0.3);
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    for (i = 0; i < 3; i++) CHECK_CLOSE(cloud.cell_size[i], 1.0 / 3, 10 * EPSILON);
    CHECK_SAME(cloud.particles.count, 64);
    tlsph_cloud_destroy(&cloud);
}

/* Tributary volumes: half, quarter and eighth of a cell on faces, edges and corners; full kernel weights. */
TEST(tributary_volumes)
{
    tlsph_fill fill = box(3, 0.25);
    tlsph_cloud cloud;
    size_t a;
    double cell = 0.25 * 0.25 * 0.25;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    for (a = 0; a < cloud.particles.count; a++) {
        double share = 1;
        int i;
        for (i = 0; i < 3; i++) {
            double x = (double)cloud.particles.positions[3 * a + (size_t)i] - (double)fill.origin[i];
            if (x < 1e-4 || x > (double)fill.size[i] - 1e-4) share /= 2;
        }
        CHECK_CLOSE(cloud.particles.volumes[a], share * cell, 50 * EPSILON * cell);
        if (cloud.particles.weights) CHECK_CLOSE(cloud.particles.weights[a], cell, 50 * EPSILON * cell);
    }
    CHECK(cloud.particles.weights != NULL);
    tlsph_cloud_destroy(&cloud);
}

/* ---- jitter ---- */

static int same_positions(const tlsph_cloud *one, const tlsph_cloud *two)
{
    return one->particles.count == two->particles.count &&
           memcmp(one->particles.positions, two->particles.positions, 3 * one->particles.count * sizeof(tlsph_real)) == 0;
}

TEST(jitter_follows_the_seed)
{
    tlsph_fill fill = box(3, 0.25);
    tlsph_cloud one, again, other;
    fill.jitter = R(0.2);
    fill.seed = 42;
    REQUIRE_OK(tlsph_cloud_create(&fill, &one, NULL));
    REQUIRE_OK(tlsph_cloud_create(&fill, &again, NULL));
    fill.seed = 43;
    REQUIRE_OK(tlsph_cloud_create(&fill, &other, NULL));
    CHECK(same_positions(&one, &again));
    CHECK(!same_positions(&one, &other));
    CHECK_CLOSE(total(one.particles.volumes, one.particles.count), 6, 1000 * EPSILON * 6);
    tlsph_cloud_destroy(&one);
    tlsph_cloud_destroy(&again);
    tlsph_cloud_destroy(&other);
}

/* Is coordinate i of the lattice point X on a face of the L (or box, where the notch has no size)? */
static int on_face(const tlsph_fill *fill, const tlsph_real *X, int i)
{
    double x = (double)X[i] - (double)fill->origin[i], other;
    if (x < 1e-4 || x > (double)fill->size[i] - 1e-4) return 1;
    if (fill->shape != TLSPH_L_SHAPE || i > 1 || fabs(x - (double)fill->notch[i]) > 1e-4) return 0;
    other = (double)X[1 - i] - (double)fill->origin[1 - i];
    return other > (double)fill->notch[1 - i] - 1e-4;
}

static void check_jitter_keeps_faces(tlsph_fill fill, int dimension)
{
    tlsph_cloud plain, moved;
    size_t a, changed = 0;
    int i;
    if (!CHECK_RESULT(tlsph_cloud_create(&fill, &plain, NULL), TLSPH_OK)) return;
    fill.jitter = R(0.2);
    if (!CHECK_RESULT(tlsph_cloud_create(&fill, &moved, NULL), TLSPH_OK)) return;
    CHECK_SAME(moved.particles.count, plain.particles.count);
    for (a = 0; a < plain.particles.count; a++)
        for (i = 0; i < dimension; i++) {
            const tlsph_real *X = plain.particles.positions + 3 * a;
            double shift = fabs((double)moved.particles.positions[3 * a + (size_t)i] - (double)X[i]);
            CHECK_BELOW(shift, 0.2001 * (double)fill.spacing);
            if (on_face(&fill, X, i)) CHECK(shift == 0);
            changed += shift > 0;
        }
    CHECK(changed > plain.particles.count / 2);
    tlsph_cloud_destroy(&plain);
    tlsph_cloud_destroy(&moved);
}

TEST(jitter_keeps_faces)
{
    check_jitter_keeps_faces(box(3, 0.25), 3);
    check_jitter_keeps_faces(box(2, 0.25), 2);
    check_jitter_keeps_faces(l_shape(3), 3);
    check_jitter_keeps_faces(l_shape(2), 2);
}

/* Cell-centred particles all move, within their share and by the seed; those on the faces of round bodies stay. */
TEST(jitter_of_other_fills)
{
    tlsph_fill fill = box(3, 0.25);
    tlsph_cloud plain, moved;
    for (int i = 0; i < 2; i++) {
        size_t stayed = 0;
        fill.placement = i ? TLSPH_ON_FACES : TLSPH_CELL_CENTRED;
        fill.shape = i ? TLSPH_CYLINDER : TLSPH_BOX;
        fill.jitter = 0;
        REQUIRE_OK(tlsph_cloud_create(&fill, &plain, NULL));
        fill.jitter = R(0.2);
        REQUIRE_OK(tlsph_cloud_create(&fill, &moved, NULL));
        CHECK_SAME(moved.particles.count, plain.particles.count);
        for (size_t a = 0; a < plain.particles.count; a++) {
            double shift = 0;
            for (size_t k = 3 * a; k < 3 * a + 3; k++)
                shift = fmax(shift, fabs((double)moved.particles.positions[k] - (double)plain.particles.positions[k]));
            CHECK_BELOW(shift, 0.2001 * (double)fill.spacing);
            stayed += !(shift > 0);
        }
        CHECK(i ? stayed > plain.particles.count / 4 && stayed < plain.particles.count : stayed == 0);
        CHECK_CLOSE(total(moved.particles.volumes, moved.particles.count),
                    total(plain.particles.volumes, plain.particles.count), 1000 * EPSILON * 6);
        tlsph_cloud_destroy(&plain);
        tlsph_cloud_destroy(&moved);
    }
}

/* ---- selection ---- */

TEST(select_plane)
{
    tlsph_fill fill = box(3, 0.25);
    tlsph_cloud cloud;
    uint32_t chosen[40];
    size_t i;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    chosen[35] = 777;
    CHECK_SAME(tlsph_select_plane(&cloud.particles, 0, R(-0.5), R(1e-4), chosen, 35), 35);
    CHECK_SAME(chosen[35], 777);
    for (i = 0; i < 35; i++) CHECK_CLOSE(cloud.particles.positions[3 * chosen[i]], -0.5, 1e-4);
    for (i = 1; i < 35; i++) CHECK(chosen[i] > chosen[i - 1]);
    chosen[3] = 777;
    CHECK_SAME(tlsph_select_plane(&cloud.particles, 0, R(-0.5), R(1e-4), chosen, 3), 35);
    CHECK_SAME(chosen[3], 777);
    CHECK_SAME(tlsph_select_plane(&cloud.particles, 2, R(2.5), R(1e-4), NULL, 0), 17 * 5);
    CHECK_SAME(tlsph_select_plane(&cloud.particles, 1, R(2.1), R(0.01), NULL, 0), 0);
    CHECK_SAME(tlsph_select_plane(&cloud.particles, 1, R(2.1), R(0.2), NULL, 0), 2 * 17 * 7);
    tlsph_cloud_destroy(&cloud);
}

static int in_first_metre(void *user, const tlsph_real X[3]) { return user == NULL && X[0] < R(0.51); }

TEST(select_by_predicate)
{
    tlsph_fill fill = box(3, 0.25);
    tlsph_cloud cloud;
    uint32_t chosen[6];
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    chosen[5] = 777;
    CHECK_SAME(tlsph_select(&cloud.particles, in_first_metre, NULL, chosen, 5), 5 * 5 * 7);
    CHECK_SAME(chosen[5], 777);
    tlsph_cloud_destroy(&cloud);
}

/* ---- refusals ---- */

static void check_refused(const tlsph_fill *fill, tlsph_result expected, int line)
{
    tally counts;
    tlsph_fill with = *fill;
    tlsph_cloud cloud;
    tlsph_error error;
    tlsph_result result;
    memset(&counts, 0, sizeof counts);
    memset(&cloud, 0xAA, sizeof cloud);
    memset(&error, 0, sizeof error);
    with.allocator = tally_allocator(&counts);
    result = tlsph_cloud_create(&with, &cloud, &error);
    if (!CHECK_RESULT(result, expected)) printf("    the refusal of line %d\n", line);
    CHECK_RESULT(error.result, result);
    if (!CHECK(error.message[0] != 0)) printf("    the refusal of line %d\n", line);
    CHECK_SAME(counts.live, 0);
    CHECK_SAME(cloud.particles.count, 0);
    tlsph_cloud_destroy(&cloud);
}
#define REFUSED(statement, expected) do { tlsph_fill f = box(3, 0.25); statement; check_refused(&f, expected, __LINE__); } while (0)

TEST(refusals)
{
    REFUSED(f.size[0] = -1, TLSPH_ERROR_DESCRIPTION);
    REFUSED(f.size[1] = 0, TLSPH_ERROR_DESCRIPTION);
    REFUSED(f.size[2] = R(INFINITY), TLSPH_ERROR_NOT_FINITE);
    REFUSED(f.origin[1] = R(NAN), TLSPH_ERROR_NOT_FINITE);
    REFUSED(f.spacing = 0, TLSPH_ERROR_DESCRIPTION);
    REFUSED(f.spacing = R(NAN), TLSPH_ERROR_NOT_FINITE);
    REFUSED(f.jitter = R(0.46), TLSPH_ERROR_DESCRIPTION);
    REFUSED(f.jitter = R(-0.1), TLSPH_ERROR_DESCRIPTION);
    REFUSED(f.dimension = 4, TLSPH_ERROR_DESCRIPTION);
    REFUSED(f.shape = TLSPH_PREDICATE, TLSPH_ERROR_DESCRIPTION);
    REFUSED((f.shape = TLSPH_CYLINDER, f.axis = 3), TLSPH_ERROR_DESCRIPTION);
    REFUSED((f.shape = TLSPH_CYLINDER, f.inner_radius = 5), TLSPH_ERROR_SIZE); /* nothing is left */
    REFUSED((f.shape = TLSPH_CYLINDER, f.inner_radius = -1), TLSPH_ERROR_DESCRIPTION);
    REFUSED((f.shape = TLSPH_L_SHAPE, f.notch[0] = 9), TLSPH_ERROR_DESCRIPTION);
    REFUSED((f.shape = TLSPH_L_SHAPE, f.notch[0] = -1), TLSPH_ERROR_DESCRIPTION);
    REFUSED((f.shape = TLSPH_TRIANGLES, f.placement = TLSPH_SCATTERED, f.surface.count = 4, f.spacing = 0), TLSPH_ERROR_DESCRIPTION);
    REFUSED(f.spacing = R(1e-7), TLSPH_ERROR_DESCRIPTION);
    REFUSED(f.cookie = 0, TLSPH_ERROR_DESCRIPTION);
    REFUSED(f.cookie ^= 0x5A5A5A5Au, TLSPH_ERROR_DESCRIPTION);
}

TEST(uninitialised)
{
    tlsph_fill fill;
    tlsph_cloud cloud;
    tlsph_error error;
    memset(&fill, 0, sizeof fill);
    CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, &error), TLSPH_ERROR_DESCRIPTION);
    CHECK(error.message[0] != 0);
    memset(&fill, 0xAA, sizeof fill);
    CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, NULL), TLSPH_ERROR_DESCRIPTION);
    CHECK(tlsph_cloud_create(NULL, &cloud, &error) != TLSPH_OK);
}

TEST(failing_allocations)
{
    tlsph_fill fill = box(3, 0.25);
    tally counts;
    tlsph_cloud cloud;
    size_t n;
    for (n = 1; n < 50; n++) {
        tlsph_result result;
        memset(&counts, 0, sizeof counts);
        counts.fail_at = n;
        fill.allocator = tally_allocator(&counts);
        result = tlsph_cloud_create(&fill, &cloud, NULL);
        if (result == TLSPH_OK) break;
        CHECK_RESULT(result, TLSPH_ERROR_MEMORY);
        CHECK_SAME(counts.live, 0);
    }
    CHECK(n > 1 && n < 50);
    tlsph_cloud_destroy(&cloud);
    CHECK_SAME(counts.live, 0);
    CHECK(!counts.wrong_size);
}

SUITE(fill, ENTRY(volume_of_boxes), ENTRY(volume_of_l_shapes), ENTRY(volume_of_round_bodies),
      ENTRY(volume_of_disks_and_rings), ENTRY(volume_of_a_predicate), ENTRY(counts_on_lattices),
      ENTRY(spacing_is_rounded_to_whole_cells), ENTRY(tributary_volumes), ENTRY(jitter_follows_the_seed),
      ENTRY(jitter_keeps_faces), ENTRY(jitter_of_other_fills), ENTRY(select_plane), ENTRY(select_by_predicate), ENTRY(refusals), ENTRY(uninitialised),
      ENTRY(failing_allocations))
