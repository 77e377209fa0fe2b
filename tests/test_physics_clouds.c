/* Irregular clouds in motion: exact modes of free bodies, invariance. */
#include "physics.h"
#include "support.h"

/* ---- exact modes with free surfaces ---- */

static double frequency_error(const cloud_mode_parameters *p)
{
    cloud_mode mode;
    double error = HUGE_VAL;
    if (!CHECK_RESULT(cloud_mode_create(p, &mode, NULL), TLSPH_OK)) return error;
    CHECK_RESULT(cloud_mode_measure(&mode, &error, NULL, NULL), TLSPH_OK);
    scene_destroy(&mode.body);
    return fabs(error);
}

TEST(breathing_ball)
{
    cloud_mode_parameters p;
    DOUBLE_ONLY();
    breathing_ball_default(&p);
    p.options.threads = 1;
    p.n = 4;
    const double error = frequency_error(&p);
    CHECK_BELOW(error, 0.041); /* METHOD section 7 */
    REPORT("frequency error %.4f", error);
}

TEST(slow_breathing_ball_converges)
{
    cloud_mode_parameters p;
    double error[2];
    DOUBLE_ONLY();
    breathing_ball_default(&p);
    p.options.threads = 1;
    for (int i = 0; i < 2; i++) { p.n = 4 << i; error[i] = frequency_error(&p); }
    CHECK_BELOW(error[1], 0.013);
    CHECK(observed_order(error, 2) > 1.7);
    REPORT("frequency errors %.4f %.4f", error[0], error[1]);
}

/* Errors of momentum and stress after an eighth of a period. */
static void lame_errors(int n, double jitter, int scattered, double *p, double *P)
{
    cloud_mode_parameters parameters;
    cloud_mode mode;
    lame_mode_default(&parameters);
    parameters.n = n;
    parameters.jitter = jitter;
    parameters.scattered = scattered;
    parameters.options.threads = 1;
    *p = *P = HUGE_VAL;
    REQUIRE_OK(cloud_mode_create(&parameters, &mode, NULL));
    CHECK_RESULT(tlsph_advance(mode.body.solver, R(cloud_mode_period(&mode) / 8)), TLSPH_OK);
    cloud_mode_errors(&mode, p, P);
    scene_destroy(&mode.body);
}

TEST(lame_mode)
{
    double p[2], P[2];
    DOUBLE_ONLY();
    for (int i = 0; i < 2; i++) lame_errors(4 << i, 0.2, 0, &p[i], &P[i]);
    REPORT("p %.2e %.2e, P %.2e %.2e", p[0], p[1], P[0], P[1]);
    CHECK(observed_order(p, 2) > 1.6 && observed_order(P, 2) > 1.3);
    CHECK_BELOW(p[1], 5.8e-2);
    CHECK_BELOW(P[1], 0.152);
}

/* ---- turned and renumbered ---- */

TEST(renumbered_clouds_agree)
{
    tlsph_material material = scene_paper_material(TLSPH_LINEAR);
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_cloud cloud;
    double sum[3] = { 0 };
    DOUBLE_ONLY();
    fill.size[0] = 1; fill.size[1] = R(0.75); fill.size[2] = R(0.5);
    fill.spacing = R(0.125);
    fill.jitter = R(0.2);
    fill.voronoi = 1;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    const size_t n = cloud.particles.count;
    tlsph_real *X = malloc(3 * n * sizeof *X), *B = malloc(3 * n * sizeof *B), *V = malloc(2 * n * sizeof *V);
    tlsph_real *v[3];
    /* 0: as it is, 1: in reverse order, 2: turned by the rotation Q */
    const double c = cos(0.7), s = sin(0.7);
    const double Q[9] = { c, -s, 0, s * c, c * c, -s, s * s, c * s, c };
    for (int k = 0; k < 3; k++) {
        tlsph_desc desc = tlsph_desc_default(3);
        tlsph_solver *solver;
        for (size_t a = 0; a < n; a++) {
            const size_t b = k == 1 ? n - 1 - a : a;
            V[a] = cloud.particles.volumes[b];
            V[n + a] = cloud.particles.weights[b];
            for (size_t i = 0; i < 3; i++) {
                X[3 * a + i] = cloud.particles.positions[3 * b + i];
                B[3 * a + i] = cloud.particles.areas[3 * b + i];
                if (k < 2) continue;
                X[3 * a + i] = B[3 * a + i] = 0;
                for (size_t j = 0; j < 3; j++) {
                    X[3 * a + i] += R(Q[3 * i + j]) * cloud.particles.positions[3 * b + j];
                    B[3 * a + i] += R(Q[3 * i + j]) * cloud.particles.areas[3 * b + j];
                }
            }
        }
        desc.particles = cloud.particles;
        desc.particles.positions = X;
        desc.particles.areas = B;
        desc.particles.volumes = V;
        desc.particles.weights = V + n;
        desc.materials = &material;
        desc.material_count = 1;
        closed_operator(&desc);
        desc.threads = 1;
        REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
        v[k] = scene_read(solver, TLSPH_FIELD_VELOCITY);
        for (size_t a = 0; a < n; a++) {
            const tlsph_real *Y = cloud.particles.positions + 3 * (k == 1 ? n - 1 - a : a);
            const double w[3] = { 0.01 * sin(3 * (double)Y[1]), 0.01 * cos(2 * (double)Y[0]), 0.02 * sin(4 * (double)Y[0]) };
            for (size_t i = 0; i < 3; i++) {
                v[k][3 * a + i] = R(w[i]);
                for (size_t j = 0; k == 2 && j < 3; j++) v[k][3 * a + i] = R((double)v[k][3 * a + i] * (j > 0) + Q[3 * i + j] * w[j]);
            }
        }
        REQUIRE_OK(tlsph_write(solver, TLSPH_FIELD_VELOCITY, v[k]));
        REQUIRE_OK(fixed_steps(solver, 1e-3, 40));
        free(v[k]);
        v[k] = scene_read(solver, TLSPH_FIELD_VELOCITY);
        tlsph_destroy(solver);
    }
    for (size_t a = 0; a < n; a++)
        for (size_t i = 0; i < 3; i++) {
            double back = 0;
            for (size_t j = 0; j < 3; j++) back += Q[3 * j + i] * (double)v[2][3 * a + j];
            sum[0] += pow((double)v[0][3 * a + i], 2);
            sum[1] += pow((double)(v[0][3 * a + i] - v[1][3 * (n - 1 - a) + i]), 2);
            sum[2] += pow((double)v[0][3 * a + i] - back, 2);
        }
    CHECK_BELOW(sqrt(sum[1] / sum[0]), 1e-8);
    CHECK_BELOW(sqrt(sum[2] / sum[0]), 1e-5);
    REPORT("reversed %.1e, turned %.1e", sqrt(sum[1] / sum[0]), sqrt(sum[2] / sum[0]));
    for (int k = 0; k < 3; k++) free(v[k]);
    free(X); free(B); free(V);
    tlsph_cloud_destroy(&cloud);
}

SUITE(physics_clouds, ENTRY(breathing_ball), ENTRY(slow_breathing_ball_converges), ENTRY(lame_mode),
      ENTRY(renumbered_clouds_agree))
