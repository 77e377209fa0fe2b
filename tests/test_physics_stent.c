/* Stent (001 section 7.3.2): a mapped, perforated cloud with Voronoi volumes under the closed operator. */
#include "physics.h"
#include "support.h"

static stent_parameters coarse(void) {
    stent_parameters p;
    stent_default(&p);
    p.spacing = 0.0006;
    p.options.threads = 1;
    return p;
}

/* A uniform stress is in balance with the tractions P B_a, and the volumes are those of the drilled tube. */
TEST(perforated_tube_is_closed) {
    const stent_parameters p = coarse();
    tlsph_closure closure;
    double volume = 0, sum[3] = { 0 }, size = 0;
    stent tube;
    REQUIRE_OK(stent_create(&p, &tube, NULL));
    tlsph_closure_read(tube.body.solver, &closure);
    for (size_t i = 0; i < tube.body.cloud.particles.count; i++) {
        const tlsph_real *B = tube.body.cloud.particles.areas + 3 * i;
        volume += (double)tube.body.cloud.particles.volumes[i];
        for (size_t k = 0; k < 3; k++) { sum[k] += (double)B[k]; size += fabs((double)B[k]); }
    }
    CHECK_CLOSE(volume, stent_volume(&p), 0.1 * volume);
    CHECK_BELOW(length3(sum), ROUNDED(1e-12, 100) * size);
    CHECK_BELOW(closure.closing, 0.1); /* the slack along B_a, at the sharp edges of the holes */
    CHECK_BELOW(closure.linear, 0.1);
    REPORT("%lu particles, volume %+.1f %%, closing %.1e, linear %.1e", (unsigned long)tube.body.cloud.particles.count,
           100 * (volume / stent_volume(&p) - 1), closure.closing, closure.linear);
    scene_destroy(&tube.body);
}

/* The end starts at full speed, 2 % of the wave speed: a wave runs into the tube, and the energies must add up. */
TEST(pushed_tube_keeps_its_energy_balance) {
    stent_parameters p = coarse();
    tlsph_ledger ledger;
    stent tube;
    double way = 0;
    DOUBLE_ONLY();
    p.start_time = 0.0149;
    REQUIRE_OK(stent_create(&p, &tube, NULL));
    CHECK_RESULT(tlsph_advance(tube.body.solver, R(0.0001)), TLSPH_OK);
    tlsph_ledger_read(tube.body.solver, &ledger);
    tlsph_real *x = scene_read(tube.body.solver, TLSPH_FIELD_DISPLACEMENT);
    if (x) way = -(double)x[3 * scene_nearest(&tube.body.cloud.particles, 0.01, 0, 0.01) + 2];
    CHECK_CLOSE(way, stent_shortening(0.015) - stent_shortening(0.0149), 1e-9);
    CHECK(ledger.jacobian_least > 0.8);
    CHECK(ledger.external_work > 0);
    CHECK_BELOW(fabs(ledger.energy_residual), 0.02 * ledger.external_work);
    REPORT("way %.4e m, work %.2e J, residual %.1e of it, least J %.3f", way, ledger.external_work,
           ledger.energy_residual / ledger.external_work, ledger.jacobian_least);
    free(x);
    scene_destroy(&tube.body);
}

SUITE(physics_stent, ENTRY(perforated_tube_is_closed), ENTRY(pushed_tube_keeps_its_energy_balance))
