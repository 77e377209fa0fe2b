/* What the scenes share beside the solver: the measure of checkerboards, the surface of lattice bodies. */
#include "../examples/scenes/scenes.h"
#include "support.h"

/* A box of 9 x 8 x 7 cells of spacing 0.1 m; jitter makes it a cloud, whose neighbours a wider support finds. */
static tlsph_solver *box(int dimension, double jitter, tlsph_cloud *cloud) {
    const tlsph_material material = soft_material(TLSPH_NEO_HOOKEAN);
    tlsph_fill fill = tlsph_fill_default(dimension);
    tlsph_desc desc = tlsph_desc_default(dimension);
    tlsph_solver *solver = NULL;
    fill.spacing = R(0.1);
    fill.size[0] = R(0.9); fill.size[1] = R(0.8); fill.size[2] = R(0.7);
    fill.jitter = R(jitter);
    if (!CHECK_RESULT(tlsph_cloud_create(&fill, cloud, NULL), TLSPH_OK)) return NULL;
    desc.particles = cloud->particles;
    desc.materials = &material;
    desc.material_count = 1;
    if (jitter > 0) desc.support = R(0.9);
    desc.keep_pairs = 1;
    CHECK_RESULT(tlsph_create(&desc, &solver, NULL), TLSPH_OK);
    return solver;
}

/* a + b (X + 2 Y - Z) + checkerboard of +-c. */
static double oscillation(int dimension, double jitter, double slope, double checker, int axes) {
    tlsph_cloud cloud;
    tlsph_solver *solver = box(dimension, jitter, &cloud);
    tlsph_real *values = solver ? malloc(cloud.particles.count * sizeof *values) : NULL;
    double out = -1;
    for (size_t i = 0; values && i < cloud.particles.count; i++) {
        const tlsph_real *X = cloud.particles.positions + 3 * i;
        long parity = 0;
        for (int k = 0; k < axes; k++) parity += lround((double)X[k] / 0.1);
        values[i] = R(7 + slope * ((double)X[0] + 2 * (double)X[1] - (dimension == 3 ? (double)X[2] : 0)) +
                      (parity % 2 ? -checker : checker));
    }
    if (values) out = scene_oscillation_of(solver, values);
    free(values);
    if (solver) { tlsph_destroy(solver); tlsph_cloud_destroy(&cloud); }
    return out;
}

TEST(oscillation_of_linear_fields) {
    CHECK_BELOW(fabs(oscillation(2, 0, 3, 0, 0)), 100 * EPSILON);
    CHECK_BELOW(fabs(oscillation(3, 0, 3, 0, 0)), 100 * EPSILON);
    CHECK_BELOW(fabs(oscillation(3, 0.2, 3, 0, 0)), 1e4 * EPSILON);
    CHECK_BELOW(fabs(oscillation(2, 0.2, 3, 0, 0)), 1e4 * EPSILON);
}

/* Deviations of X + 2 Y - Z over particles that have lines (all but the corners): 0.6612 m in this box, whose
   checkerboard the smoothing removes wholly. */
TEST(oscillation_of_checkerboards) {
    double sum = 0, squares = 0, deviation;
    int count = 0;
    for (int x = 0; x <= 9; x++)
        for (int y = 0; y <= 8; y++)
            for (int z = 0; z <= 7; z++) {
                const double f = 0.1 * (x + 2 * y - z);
                if ((x % 9 == 0) && (y % 8 == 0) && (z % 7 == 0)) continue;
                sum += f; squares += f * f; count++;
            }
    deviation = sqrt(squares / count - sum * sum / count / count);
    CHECK_CLOSE(oscillation(3, 0, 1, 0.5, 3), 2 * 0.5 / deviation, 3e-3);
    CHECK_CLOSE(oscillation(3, 0, 1, 5, 3), 20 * 0.5 / deviation, 3e-2);
    CHECK(oscillation(3, 0, 1, 0.5, 1) > 0.4 * 2 * 0.5 / deviation);  /* layers: 2A/(S sqrt 3) */
    CHECK(oscillation(3, 0.2, 1, 0.5, 3) > 0.3 * 2 * 0.5 / deviation); /* a cloud sees diagonal neighbours too */
    CHECK(oscillation(3, 0, 0, 0.5, 3) > 100);                         /* nothing smooth beside it */
}

/* ---- surfaces ---------------------------------------------------------------------------------------------------- */

typedef struct tally_of_faces { double sum[3], size; int count; } tally_of_faces;

static void count_face(void *user, const scene_face *face) {
    tally_of_faces *t = user;
    for (int i = 0; i < 3; i++) {
        t->sum[i] += face->area[i];
        t->size += fabs(face->area[i]);
    }
    t->count++;
}

/* An L of 0.6 x 0.6 x 0.2 m and cells of 0.1 m: the surface is closed, 108 faces of 0.01 m^2. */
TEST(surface_of_an_L) {
    tlsph_fill fill = tlsph_fill_default(3);
    tally_of_faces t = { { 0, 0, 0 }, 0, 0 };
    tlsph_cloud cloud;
    fill.shape = TLSPH_L_SHAPE;
    fill.spacing = R(0.1);
    fill.size[0] = fill.size[1] = R(0.6); fill.size[2] = R(0.2);
    fill.notch[0] = fill.notch[1] = R(0.3);
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    CHECK_RESULT(scene_surface(&cloud, count_face, &t), TLSPH_OK);
    CHECK_SAME(t.count, 2 * 27 + 24 * 2);
    CHECK_CLOSE(t.size, 0.01 * (2 * 27 + 24 * 2), 100 * EPSILON);
    for (int i = 0; i < 3; i++) CHECK_CLOSE(t.sum[i], 0, 10 * EPSILON);
    tlsph_cloud_destroy(&cloud);
}

/* The staircase of a ball has one and a half times its area; along the true normal it has the right one. */
static double along_radius(void *user, const scene_face *face) {
    const double *m = face->middle, r = sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    (void)user;
    return (face->area[0] * m[0] + face->area[1] * m[1] + face->area[2] * m[2]) / r;
}

TEST(surface_of_a_ball) {
    const tlsph_material material = soft_material(TLSPH_MIE_GRUNEISEN);
    tlsph_fill fill = tlsph_fill_default(3);
    tally_of_faces t = { { 0, 0, 0 }, 0, 0 };
    tlsph_condition *c[2];
    scene_setup setup;
    double sum[2] = { 0, 0 };
    fill.shape = TLSPH_SPHERE;
    for (int i = 0; i < 3; i++) { fill.origin[i] = -1; fill.size[i] = 2; }
    fill.spacing = R(0.1);
    scene_begin(&setup, &fill, &material, NULL);
    scene_surface(&setup.body.cloud, count_face, &t);
    c[0] = scene_add_surface(&setup, TLSPH_HEAT_FLUX, along_radius, NULL, 0);
    c[1] = scene_add_surface(&setup, TLSPH_HEAT_FLUX, along_radius, NULL, 12.5);
    CHECK_RESULT(setup.result, TLSPH_OK);
    for (int i = 0; i < 2; i++)
        for (size_t k = 0; k < c[i]->count; k++) sum[i] += (double)c[i]->areas[k];
    CHECK_CLOSE(t.size, 1.5 * 4 * PI, 0.05 * 4 * PI);
    CHECK_CLOSE(sum[0], 4 * PI, 0.02 * 4 * PI);
    CHECK_CLOSE(sum[1], 12.5, 100 * EPSILON * 12.5);
    CHECK(c[0]->count > 0 && c[0]->count < setup.body.cloud.particles.count);
    for (size_t i = 0; i < setup.list_count; i++) free(setup.lists[i]);
    tlsph_cloud_destroy(&setup.body.cloud);
}

SUITE(scenes, ENTRY(oscillation_of_linear_fields), ENTRY(oscillation_of_checkerboards), ENTRY(surface_of_an_L),
      ENTRY(surface_of_a_ball))
