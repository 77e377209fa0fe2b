/* Symmetric impact: the solver of the jump conditions, and the plateau between the shocks at speeds and materials that
   riemann_star_states.csv does not have. */
#include "physics.h"

/* All rows: both couplings, with and without Mooney terms. */
TEST(jump_conditions_give_the_table) {
    static table t;
    DOUBLE_ONLY();
    REQUIRE(table_read(&t, REFERENCES "/riemann_star_states.csv") == 0);
    CHECK_SAME(t.rows, 8);
    for (size_t row = 0; row < t.rows; row++) {
        impact_parameters p;
        impact_star star;
        double speed;
        impact_default(&p);
        p.material = table_material(&t, row, "frac");
        p.material.expansion =
            R(table_number(&t, row, "cv") * table_number(&t, row, "G0") / (3 * 50050 / (3 * (1 - 0.6))));
        p.speed = table_number(&t, row, "vL");
        speed = impact_exact(&p, &star);
        CHECK_CLOSE(star.stress, table_number(&t, row, "P_star"), 1e-12 * fabs(star.stress));
        CHECK_CLOSE(star.jacobian, table_number(&t, row, "J_starL"), 1e-12);
        CHECK_CLOSE(star.temperature, table_number(&t, row, "th_starL"), 1e-12 * star.temperature);
        CHECK_CLOSE(speed, table_number(&t, row, "speedR_head"), 1e-12 * speed);
    }
    free(t.text);
}

/* Stress, compression and warming within 1 % each, where the plateau is clean: 0.4 to 0.8 of the shock's path. */
static void plateau(tlsph_material_kind kind, double fraction) {
    impact_parameters p;
    impact_star exact, mean;
    impact bar;
    double speed, overshoot, warming;
    DOUBLE_ONLY();
    impact_default(&p);
    p.material = scene_paper_material(kind);
    p.material.conductivity = 0;
    p.n = 300;
    p.across = 1;
    p.speed = fraction * impact_p_speed(&p.material);
    speed = impact_exact(&p, &exact);
    REQUIRE_OK(impact_create(&p, &bar, NULL));
    CHECK_RESULT(tlsph_advance(bar.body.solver, R(0.34 / speed)), TLSPH_OK);
    impact_read(&bar, speed, 0.4, 0.8, &exact, &mean, &overshoot);
    warming = (mean.temperature - 293.15) / (exact.temperature - 293.15) - 1;
    CHECK_CLOSE(mean.stress / exact.stress - 1, 0, 0.002);
    CHECK_CLOSE((1 - mean.jacobian) / (1 - exact.jacobian) - 1, 0, 0.002);
    CHECK_CLOSE(warming, 0, 0.01);
    REPORT("stress %+.2f %%, warming %+.2f %%", 100 * (mean.stress / exact.stress - 1), 100 * warming);
    scene_destroy(&bar.body);
}

TEST(plateau_mg_weak) { plateau(TLSPH_MIE_GRUNEISEN, 0.05); }
TEST(plateau_mg_strong) { plateau(TLSPH_MIE_GRUNEISEN, 0.5); }
TEST(plateau_mee) { plateau(TLSPH_MEE, 0.3); }

SUITE(physics_impact, ENTRY(jump_conditions_give_the_table), ENTRY(plateau_mg_weak), ENTRY(plateau_mg_strong),
      ENTRY(plateau_mee))
