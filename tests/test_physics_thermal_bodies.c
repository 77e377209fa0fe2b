/* Rotating disk, punch test, gripper and ball of 000 sections 7.3 to 7.6, coarse and short: what the sections claim. */
#include "physics.h"

/* ---- rotating disk ----------------------------------------------------------------------------------------------- */

/* To 4.5 s, half a second after the heat is off, 8 spacings across. */
TEST(disk_balances) {
    rotating_disk_parameters p;
    rotating_disk disk;
    tlsph_ledger start, before, now;
    double linear = 0, angular = 0, energy = 0, entropy_fall = 0, ballistic_rise = 0, at_4_s = 0;
    DOUBLE_ONLY();
    rotating_disk_default(&p);
    p.options.threads = 1;
    p.n = 8;
    REQUIRE_OK(rotating_disk_create(&p, &disk, NULL));
    tlsph_ledger_read(disk.body.solver, &start);
    before = now = start;
    while (now.time < 4.5) {
        double change[3];
        REQUIRE_OK(tlsph_step(disk.body.solver, R(now.time < 4 ? 4 - now.time : 4.5 - now.time)));
        tlsph_ledger_read(disk.body.solver, &now);
        for (int i = 0; i < 3; i++) change[i] = now.angular_momentum[i] - start.angular_momentum[i];
        linear = fmax(linear, length3(now.linear_momentum));
        angular = fmax(angular, length3(change));
        energy = fmax(energy, fabs(now.total_energy - start.total_energy - rotating_disk_heat(&p, now.time)));
        if (before.time >= 4) {
            entropy_fall = fmax(entropy_fall, before.entropy - now.entropy);
            ballistic_rise = fmax(ballistic_rise, now.ballistic_energy - before.ballistic_energy);
        }
        if (now.time <= 4) at_4_s = now.entropy;
        before = now;
    }
    REPORT("linear %.1e, angular %.1e, energy %.1e", linear / now.mass, angular / length3(start.angular_momentum),
           energy / rotating_disk_heat(&p, 2));
    CHECK_CLOSE(rotating_disk_heat(&p, 2), 6366, 1); /* 2 x 5 kW x 2/pi s */
    CHECK_BELOW(linear, 1e-12 * now.mass);
    CHECK_BELOW(angular, 1e-8 * length3(start.angular_momentum));
    CHECK_BELOW(energy, 1e-4 * rotating_disk_heat(&p, 2));
    CHECK_BELOW(entropy_fall, 1e-10);
    CHECK_BELOW(ballistic_rise, 3e-8);
    CHECK(now.entropy > at_4_s + 1e-3); /* J/K: conduction goes on */
    scene_destroy(&disk.body);
}

static void disk_probe(tlsph_thermal thermal, double end, double *v, double *theta) {
    rotating_disk_parameters p;
    rotating_disk disk;
    rotating_disk_default(&p);
    p.options.threads = 1;
    p.options.thermal = (int)thermal;
    p.n = 8;
    REQUIRE_OK(rotating_disk_create(&p, &disk, NULL));
    CHECK_RESULT(tlsph_advance(disk.body.solver, R(end)), TLSPH_OK);
    *v = scene_value(disk.body.solver, TLSPH_FIELD_VELOCITY, disk.probe, 2);
    *theta = scene_value(disk.body.solver, TLSPH_FIELD_TEMPERATURE, disk.probe, 0);
    CHECK_CLOSE(disk.body.cloud.particles.positions[3 * disk.probe + 1], 4, 1e-9); /* X = (2, 4, 0) m is a particle */
    scene_destroy(&disk.body);
}

/* One per cent of what figure 12 spans: 5 m/s and 40 K. */
TEST(disk_energy_against_entropy) {
    double v[2] = { 0, 1 }, theta[2] = { 0, 1 };
    DOUBLE_ONLY();
    disk_probe(TLSPH_ENERGY, 2.5, &v[0], &theta[0]);
    disk_probe(TLSPH_ENTROPY, 2.5, &v[1], &theta[1]);
    REPORT("v_z %.4f, %.4f m/s, temperature %.3f, %.3f K", v[0], v[1], theta[0], theta[1]);
    CHECK_CLOSE(v[0], v[1], 0.01 * 5);
    CHECK_CLOSE(theta[0], theta[1], 0.01 * 40);
    CHECK(theta[0] > 309);
}

SUITE(physics_thermal_bodies, ENTRY(disk_balances), ENTRY(disk_energy_against_entropy))
