/* Operators of 002 in motion: derivatives in one dimension, orders on the swinging plate, momenta of spinning bodies,
   energy of the bending column. */
#include "physics.h"

/* ---- one dimension: figures 4 to 6 ---- */

static double line(double X) { return X + 1; }
static double line_slope(double X) { (void)X; return 1; }
static double cube(double X) { return X * X * X + 1; }
static double cube_slope(double X) { return 3 * X * X; }

TEST(bonds_need_the_particle_itself) {
    const gradient_field field = {line, line_slope};
    CHECK_BELOW(gradient_study_error(GRADIENT_STANDARD, &field, 5, 40, 0.5), 1e-12);
    CHECK_BELOW(gradient_study_error(GRADIENT_BOND_FIRST, &field, 5, 40, 0.5), 1e-12);
    CHECK_BELOW(gradient_study_error(GRADIENT_BOND_ZEROTH, &field, 5, 40, 0.5), 1e-12);
    /* the kernel's weight of the particle itself, 1/(1.5 x 2) inside */
    CHECK_CLOSE(gradient_study_error(GRADIENT_BOND_ONLY, &field, 5, 4000, 0.005), 1.0 / 3, 0.01);
}

/* Fixed support: figure 6 (METHOD section 8: 0.45 against 0.037 at 640 particles). A support that shrinks with the spacing
   makes all forms converge alike. */
TEST(bonds_lower_the_plateau_of_a_fixed_support) {
    const gradient_field field = {cube, cube_slope};
    const double standard = gradient_study_error(GRADIENT_STANDARD, &field, 5, 640, 0.5);
    const double bonds = gradient_study_error(GRADIENT_BOND_FIRST, &field, 5, 640, 0.5);
    double e[3];
    CHECK_CLOSE(standard, 0.45, 0.01);
    CHECK_CLOSE(bonds, 0.037, 0.002);
    for (int i = 0; i < 3; i++) e[i] = gradient_study_error(GRADIENT_STANDARD, &field, 5, 80 << i, 20.0 / (80 << i));
    CHECK_CLOSE(observed_order(e, 3), 1.5, 0.05); /* order 2 inside, order 1 at the two ends */
    for (int i = 0; i < 3; i++) e[i] = gradient_study_error(GRADIENT_BOND_FIRST, &field, 5, 80 << i, 20.0 / (80 << i));
    CHECK_CLOSE(observed_order(e, 3), 1.5, 0.05);
}

/* ---- plate ---- */

static void plate_orders(tlsph_operator_kind kind, double support, int coarsest, plate_errors e[3]) {
    for (int i = 0; i < 3; i++) {
        swinging_plate_parameters p;
        swinging_plate plate;
        swinging_plate_default(&p);
        scene_options_of_002(&p.options, 0.125);
        p.options.threads = 1;
        p.options.operator_kind = (int)kind;
        p.options.support = support;
        p.options.projection = 1;
        p.n = coarsest << i; /* 10, 20, 40: spacings of the paper */
        REQUIRE_OK(swinging_plate_create(&p, &plate, NULL));
        if (CHECK_RESULT(tlsph_advance(plate.body.solver, R(SCENE_PI / 2 / plate.omega)), TLSPH_OK))
            swinging_plate_errors(&plate, 1, &e[i]);
        scene_destroy(&plate.body);
    }
}

/* 002 figure 9: order 2 in L2, 0.9 to 1.2 in H1. Over three levels: between 20 and 40 the first-order kernel has 0.96 left,
   its one-sided gradients at the rollers being of first order. */
static void check_orders(tlsph_operator_kind kind, double support, int coarsest) {
    plate_errors e[3];
    double L2[3], H1[3];
    memset(e, 0, sizeof e);
    plate_orders(kind, support, coarsest, e);
    for (int i = 0; i < 3; i++) { L2[i] = e[i].L2; H1[i] = e[i].H1; }
    REPORT(" L2 %.1e order %.2f, H1 %.1e order %.2f;", L2[2], observed_order(L2, 3), H1[2], observed_order(H1, 3));
    CHECK(observed_order(L2, 3) >= 1.9);
    CHECK(observed_order(H1, 3) >= 1.0);
}

TEST(plate_orders_of_bonds) {
    DOUBLE_ONLY();
    check_orders(TLSPH_BOND, 0.9, 5);
    check_orders(TLSPH_ZEROTH_BOND, 0.9, 5);
}
TEST(slow_plate_orders_at_the_spacings_of_the_paper) {
    DOUBLE_ONLY();
    check_orders(TLSPH_BOND, 0.9, 10);
    check_orders(TLSPH_ZEROTH_BOND, 0.9, 10);
    check_orders(TLSPH_FIRST_KERNEL, 1.2, 10);
}

/* With a support of 1.2 spacings (44) and (45) measure how the kernels interpolate between particles, whatever the scheme. */
TEST(narrow_supports_measure_their_interpolation) {
    DOUBLE_ONLY();
    for (int first = 0; first < 2; first++) {
        swinging_plate_parameters p;
        swinging_plate plate;
        plate_errors e;
        swinging_plate_default(&p);
        scene_options_of_002(&p.options, 0.125);
        p.options.operator_kind = (int)(first ? TLSPH_BOND : TLSPH_ZEROTH_BOND);
        p.options.support = 0.6;
        p.options.projection = 1;
        REQUIRE_OK(swinging_plate_create(&p, &plate, NULL));
        CHECK_RESULT(tlsph_advance(plate.body.solver, R(SCENE_PI / 2 / plate.omega)), TLSPH_OK);
        swinging_plate_errors(&plate, 1, &e);
        scene_destroy(&plate.body);
        CHECK_CLOSE(e.H1 / e.H1_exact, 1, 0.05);
        CHECK(e.H1_particles < e.H1 / 5);
        if (!first) CHECK_CLOSE(e.L2 / e.L2_exact, 1, 0.05);
    }
}

/* ---- momenta of free bodies ---- */

static double angular_loss(int dimension, int n, int projection, double end, double *linear) {
    spinning_box_parameters p;
    spinning_box box;
    tlsph_ledger before, after;
    spinning_box_default(&p, dimension);
    p.options.threads = 1;
    p.options.projection = projection;
    p.n = n;
    if (!CHECK_RESULT(spinning_box_create(&p, &box, NULL), TLSPH_OK)) return HUGE_VAL;
    tlsph_ledger_read(box.body.solver, &before);
    CHECK_RESULT(tlsph_advance(box.body.solver, R(end)), TLSPH_OK);
    tlsph_ledger_read(box.body.solver, &after);
    scene_destroy(&box.body);
    *linear = length3(after.linear_momentum) / (before.mass * p.spin / 4);
    return fabs(1 - after.angular_momentum[2] / before.angular_momentum[2]);
}

TEST(spinning_bodies_keep_their_momenta) {
    DOUBLE_ONLY();
    double linear, loss[2];
    CHECK_BELOW(angular_loss(2, 8, 1, 0.05, &linear), 1e-12);
    CHECK_BELOW(linear, 1e-12);
    for (int i = 0; i < 2; i++) {
        loss[i] = angular_loss(2, 6 << i, 0, 0.05, &linear);
        CHECK_BELOW(linear, 1e-12);
    }
    REPORT("%.1e, finer %.1e", loss[0], loss[1]);
    CHECK_BELOW(loss[0], 0.01); /* the paper loses 6 % on its coarsest plate by 2 s */
    CHECK_BELOW(loss[1], loss[0] / 4);
    CHECK_BELOW(angular_loss(3, 4, 1, 0.02, &linear), 1e-12);
    CHECK_BELOW(linear, 1e-12);
}

/* ---- bending column ---- */

static double column_change(tlsph_operator_kind kind, tlsph_force_form form, double cfl, double *unaccounted) {
    bending_column_parameters p;
    static bending_column column;
    tlsph_ledger before, after;
    bending_column_default(&p);
    p.options.threads = 1;
    p.options.operator_kind = (int)kind;
    p.options.force_form = (int)form;
    p.options.step_rule = (int)TLSPH_STEP_BY_PAIR;
    p.options.cfl = cfl;
    p.n = 3;
    if (!CHECK_RESULT(bending_column_create(&p, &column, NULL), TLSPH_OK)) return HUGE_VAL;
    tlsph_ledger_read(column.body.solver, &before);
    CHECK_RESULT(tlsph_advance(column.body.solver, R(0.06)), TLSPH_OK);
    tlsph_ledger_read(column.body.solver, &after);
    scene_destroy(&column.body);
    *unaccounted = after.energy_residual / before.total_energy;
    return after.total_energy / before.total_energy - 1;
}

/* With the adjoint force what is lost is what the ledger calls dissipation; the printed force wins energy beside it. */
TEST(bending_column_loses_what_jst_takes) {
    DOUBLE_ONLY();
    double rest, rest_printed;
    const double bonds = column_change(TLSPH_BOND, TLSPH_ADJOINT, 0.6, &rest);
    const double printed = column_change(TLSPH_FIRST_KERNEL, TLSPH_FORCE_AS_PRINTED, 0.6, &rest_printed);
    REPORT("%.2f %%, printed %.2f %%, unaccounted %.1e and %.1e", 100 * bonds, 100 * printed, rest, rest_printed);
    CHECK(bonds < 0 && bonds > -0.015);
    CHECK_BELOW(fabs(rest), 1e-5);
    CHECK(rest_printed > 1e-3);
}

/* The step of bonds with JST is bounded by the fastest decay of the biharmonic term, 57 eta4 c/d, of which three stages allow
   2.51: Courant number 0.35 at 1/8. At 1/64 the fastest vibration, 2.73 c/d at the edges, bounds it: 0.71. */
static double energy_by_courant(double biharmonic, double cfl) {
    bending_column_parameters p;
    static bending_column column;
    tlsph_ledger before, now;
    double share = 1;
    bending_column_default(&p);
    p.options.biharmonic = biharmonic;
    p.options.step_rule = (int)TLSPH_STEP_BY_PAIR;
    p.options.cfl = cfl;
    p.n = 3;
    if (!CHECK_RESULT(bending_column_create(&p, &column, NULL), TLSPH_OK)) return HUGE_VAL;
    tlsph_ledger_read(column.body.solver, &before);
    while (share < 10 && (double)tlsph_time(column.body.solver) < 0.02) {
        if (tlsph_step(column.body.solver, 1) != TLSPH_OK) break;
        tlsph_ledger_read(column.body.solver, &now);
        share = now.total_energy / before.total_energy;
    }
    if ((double)tlsph_time(column.body.solver) < 0.02) share = HUGE_VAL;
    scene_destroy(&column.body);
    return share;
}

TEST(jst_bounds_the_step) {
    DOUBLE_ONLY();
    CHECK_CLOSE(energy_by_courant(0.125, 0.3), 1, 0.02);
    CHECK(energy_by_courant(0.125, 0.45) > 2);
    CHECK_CLOSE(energy_by_courant(1.0 / 64, 0.7), 1, 0.02);
    CHECK(energy_by_courant(1.0 / 64, 0.95) > 2);
}

/* ---- pulled column ---- */

/* 002 section 5.4 asks how far the column goes. With its own time step, by the p speed of the undeformed body, bonds with
   JST fail early; with the bound of the current speed the same scheme at the same Courant number goes on. */
TEST(pulled_column_fails_by_the_linear_step) {
    DOUBLE_ONLY();
    double reached[2];
    for (int i = 0; i < 2; i++) {
        pulled_column_parameters p;
        static pulled_column column;
        pulled_column_default(&p);
        scene_options_of_002(&p.options, 1.0 / 64);
        p.options.cfl = 0.8;
        p.options.step_rule = (int)(i ? TLSPH_STEP_BY_PARTICLE : TLSPH_STEP_BY_PAIR_LINEAR);
        p.centred = 1;
        p.n = 2;
        p.elongation = 200;
        REQUIRE_OK(pulled_column_create(&p, &column, NULL));
        CHECK_RESULT(tlsph_advance(column.body.solver, R(pulled_column_end(&p))), i ? TLSPH_OK : TLSPH_ERROR_INVERSION);
        reached[i] = pulled_column_elongation(&column);
        scene_destroy(&column.body);
    }
    REPORT("%.0f %%, by the current speed more than %.0f %%", reached[0], reached[1]);
    CHECK_BELOW(reached[0], 190);
    CHECK(reached[1] >= 200);
}

SUITE(physics_bonds, ENTRY(pulled_column_fails_by_the_linear_step), ENTRY(bonds_need_the_particle_itself), ENTRY(bonds_lower_the_plateau_of_a_fixed_support),
      ENTRY(narrow_supports_measure_their_interpolation), ENTRY(jst_bounds_the_step),
      ENTRY(plate_orders_of_bonds), ENTRY(slow_plate_orders_at_the_spacings_of_the_paper), ENTRY(spinning_bodies_keep_their_momenta),
      ENTRY(bending_column_loses_what_jst_takes))
