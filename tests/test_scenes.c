/* What the scenes share beside the solver: the measure of checkerboards. */
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

SUITE(scenes, ENTRY(oscillation_of_linear_fields), ENTRY(oscillation_of_checkerboards))
