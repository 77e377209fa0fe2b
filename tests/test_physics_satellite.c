/* 001 section 7.1.2: momenta, and the sums of internal and dissipative forces, at round-off (figures 8 and 9). */
#include "physics.h"

TEST(satellite_keeps_its_momenta) {
    satellite_parameters p;
    satellite craft;
    tlsph_ledger l;
    double force[3], dissipation[3], size[2];
    DOUBLE_ONLY();
    satellite_default(&p);
    p.spacing = 0.5;
    p.options.threads = 1;
    REQUIRE_OK(satellite_create(&p, &craft, NULL));
    REQUIRE_OK(tlsph_advance(craft.body.solver, R(1.5)));
    tlsph_ledger_read(craft.body.solver, &l);
    REQUIRE_OK(satellite_resultants(&craft, force, dissipation, size));
    REPORT("angular %.0e, linear %.0e, forces %.0e, dissipation %.0e", length3(l.angular_residual) / l.angular_momentum[2],
           length3(l.linear_momentum) / l.angular_momentum[2], length3(force) / size[0], length3(dissipation) / size[1]);
    CHECK_BELOW(length3(l.angular_residual), 1e-13 * l.angular_momentum[2]);
    CHECK_BELOW(length3(l.linear_momentum), 1e-13 * l.angular_momentum[2]);
    CHECK_BELOW(length3(force), 1e-13 * size[0]);
    CHECK_BELOW(length3(dissipation), 1e-13 * size[1]);
    CHECK(size[1] > 0 && l.jacobian_least < 0.99); /* it does deform */
    scene_destroy(&craft.body);
}

SUITE(physics_satellite, ENTRY(satellite_keeps_its_momenta))
