/* Loads, walls, conduction and a tension test, each against a result that one can work out by hand. */
#include "physics.h"

/* ---- conduction -------------------------------------------------------------------------------------------------- */

/* Temperatures that alternate from particle to particle; the spacing is 1/4 m. */
static void odd_even(const void *scene, const tlsph_real X[3], scene_state *state) {
    const int sum = (int)(4 * (double)X[0] + 0.5) + (int)(4 * (double)X[1] + 0.5) + (int)(4 * (double)X[2] + 0.5);
    (void)scene;
    state->theta += sum % 2 ? -1 : 1;
}

/* Share of the odd-even part that is left after a tenth of the time in which conduction crosses a spacing. */
static double odd_even_left(tlsph_conduction conduction) {
    tlsph_material material = scene_paper_material(TLSPH_LINEAR);
    scene_options options = physics_options(TLSPH_PF, TLSPH_ENERGY);
    double sum = 0;
    scene_setup setup;
    scene_body body;
    tlsph_real *theta;
    options.conduction = (int)conduction;
    material.expansion = 0;      /* heat only */
    material.conductivity = 1000; /* D = 1 m^2/s */
    box_begin(&setup, 4, 4, 4, &material);
    for (int axis = 0; axis < 3; axis++) scene_add_rollers(&setup, axis); /* mirrors: gradients vanish at faces too */
    if (!CHECK_RESULT(scene_end(&setup, &options, &body, NULL), TLSPH_OK)) return HUGE_VAL;
    CHECK_RESULT(scene_set_state(&body, NULL, odd_even), TLSPH_OK);
    CHECK_RESULT(tlsph_advance(body.solver, R(0.1)), TLSPH_OK);
    theta = scene_read(body.solver, TLSPH_FIELD_TEMPERATURE);
    for (size_t i = 0; theta && i < tlsph_count(body.solver); i++) {
        scene_state state = { { 0 }, { 0 }, { 0 }, 0 };
        odd_even(NULL, body.cloud.particles.positions + 3 * i, &state);
        sum += state.theta * ((double)theta[i] - (double)material.reference_temperature);
    }
    sum /= (double)tlsph_count(body.solver);
    free(theta);
    scene_destroy(&body);
    return sum;
}

TEST(odd_even_temperature_decays_with_compact_conduction) {
    const double left = odd_even_left(TLSPH_COMPACT);
    REPORT("left %.1e", left);
    CHECK_BELOW(fabs(left), 0.01); /* rate 12 D / spacing^2 of the two-point stencil: e^-19 if it acts in full */
}

TEST(odd_even_temperature_stays_with_double_gradient) {
    CHECK_CLOSE(odd_even_left(TLSPH_DOUBLE_GRADIENT), 1, 1e3 * EPSILON);
}

/* ---- free fall --------------------------------------------------------------------------------------------------- */

TEST(free_fall_is_exact) {
    const tlsph_material material = scene_paper_material(TLSPH_NEO_HOOKEAN);
    const scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
    const double g = 9.81, t = 0.5;
    scene_setup setup;
    scene_body body;
    tlsph_real *u, *v;
    tlsph_ledger l;
    box_begin(&setup, 3, 3, 3, &material);
    scene_add(&setup, TLSPH_ACCELERATION)->value[1] = R(-g);
    REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
    CHECK_RESULT(tlsph_advance(body.solver, R(t)), TLSPH_OK);
    u = scene_read(body.solver, TLSPH_FIELD_DISPLACEMENT);
    v = scene_read(body.solver, TLSPH_FIELD_VELOCITY);
    for (size_t i = 0; i < tlsph_count(body.solver); i++) { /* the two-stage scheme is exact for parabolas */
        CHECK_CLOSE(u[3 * i + 1], -g * t * t / 2, 1e3 * EPSILON);
        CHECK_CLOSE(v[3 * i + 1], -g * t, 1e3 * EPSILON);
        CHECK_CLOSE(u[3 * i], 0, 1e3 * EPSILON);
    }
    tlsph_ledger_read(body.solver, &l);
    CHECK_CLOSE(l.external_work, l.kinetic_energy, 1e4 * EPSILON * l.kinetic_energy);
    CHECK_CLOSE(l.impulse[1], -l.mass * g * t, 1e4 * EPSILON * l.mass);
    free(u); free(v);
    scene_destroy(&body);
}

TEST(body_force_moves_the_centre_as_a_point) {
    const tlsph_material material = scene_paper_material(TLSPH_NEO_HOOKEAN);
    const scene_options options = physics_options(TLSPH_PFHJ, TLSPH_ISOTHERMAL);
    scene_setup setup;
    scene_body body;
    tlsph_ledger l;
    box_begin(&setup, 3, 3, 3, &material);
    scene_add(&setup, TLSPH_BODY_FORCE)->value[0] = 5000; /* N/m^3: 5 m/s^2 */
    REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
    CHECK_RESULT(tlsph_advance(body.solver, R(0.4)), TLSPH_OK);
    tlsph_ledger_read(body.solver, &l);
    CHECK_CLOSE(l.centre[0], 0.375 + 0.5 * 5 * 0.16, 1e3 * EPSILON);
    CHECK_CLOSE(l.linear_momentum[0], l.mass * 5 * 0.4, 1e4 * EPSILON * l.mass);
    scene_destroy(&body);
}

/* ---- pressure ---------------------------------------------------------------------------------------------------- */

/* A quarter turn about Z. */
static void quarter_turn(const void *scene, const tlsph_real X[3], scene_state *state) {
    static const double F[9] = { 0, -1, 0, 1, 0, 0, 0, 0, 1 };
    (void)scene;
    memcpy(state->F, F, sizeof F);
    state->x[0] = -(double)X[1];
    state->x[1] = (double)X[0];
}

TEST(pressure_follows_the_turned_normal) {
    const tlsph_material material = scene_paper_material(TLSPH_NEO_HOOKEAN);
    const scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
    const double p = 400, dt = 1e-3, area = 0.75 * 0.75;
    tlsph_real outward[3 * 64];
    tlsph_condition *face;
    scene_setup setup;
    scene_body body;
    tlsph_ledger l;
    box_begin(&setup, 3, 3, 3, &material);
    face = scene_add_plane(&setup, TLSPH_PRESSURE, 0, 0.75); /* X = 0.75 with outward normal +X */
    scene_share_area(&setup, face, area);
    REQUIRE(face->count <= 64);
    memset(outward, 0, sizeof outward);
    for (size_t i = 0; i < face->count; i++) outward[3 * i] = face->areas[i];
    face->areas = outward;
    face->value[0] = R(p);
    REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
    REQUIRE_OK(scene_set_state(&body, NULL, quarter_turn));
    CHECK_RESULT(fixed_steps(body.solver, dt, 1), TLSPH_OK);
    tlsph_ledger_read(body.solver, &l);
    CHECK_CLOSE(l.impulse[1], -p * area * dt, 1e-3 * p * area * dt); /* the face now looks along +y; it moves a little */
    CHECK_CLOSE(l.impulse[0], 0, 1e-3 * p * area * dt);
    CHECK_CLOSE(l.linear_momentum[1], l.impulse[1], 1e5 * EPSILON * p * area * dt);
    scene_destroy(&body);
}

/* ---- wall -------------------------------------------------------------------------------------------------------- */

static void towards_the_wall(const void *scene, const tlsph_real X[3], scene_state *state) {
    (void)X;
    state->v[0] = -*(const double *)scene;
}

/* A bar of 2 m in uniaxial strain hits a wall at X = -0.05 m at 1 % of its wave speed: by the one-dimensional theory it
   leaves after one echo, 2 L / c, with its speed turned round. */
static void bounce(tlsph_thermal thermal) {
    const tlsph_material material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    const scene_options options = physics_options(TLSPH_PF, thermal);
    const double speed = 0.08, c = 8.2, gap = 0.05, end = gap / speed + 2 * 2 / c + 0.3;
    double deepest = 0;
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_condition *wall;
    scene_setup setup;
    scene_body body;
    tlsph_ledger l;
    tlsph_real *x;
    fill.spacing = R(0.05);
    fill.size[0] = 2; fill.size[1] = fill.size[2] = R(0.1);
    scene_begin(&setup, &fill, &material, NULL);
    scene_add_rollers(&setup, 1);
    scene_add_rollers(&setup, 2);
    wall = scene_add(&setup, TLSPH_WALL);
    wall->point[0] = R(-gap);
    wall->normal[0] = 1;
    REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
    REQUIRE_OK(scene_set_state(&body, &speed, towards_the_wall));
    while ((double)tlsph_time(body.solver) < end) {
        REQUIRE_OK(tlsph_step(body.solver, R(end)));
        x = scene_read(body.solver, TLSPH_FIELD_POSITION);
        for (size_t i = 0; x && i < tlsph_count(body.solver); i++) deepest = fmax(deepest, -gap - (double)x[3 * i]);
        free(x);
    }
    tlsph_ledger_read(body.solver, &l);
    REPORT("speed after %.3f of that before, depth %.1e spacings, contact loss %.1e of the kinetic energy",
           l.linear_momentum[0] / (l.mass * speed), deepest / 0.05, l.contact_loss / (0.5 * l.mass * speed * speed));
    CHECK(l.linear_momentum[0] > 0.9 * l.mass * speed);
    CHECK_BELOW(l.linear_momentum[0], l.mass * speed * (1 + 1e-9));
    CHECK_BELOW(deepest, 0.01 * 0.05);
    CHECK_CLOSE(l.energy_residual, 0, (thermal == TLSPH_ENERGY ? 1e-9 : 0.05) * 0.5 * l.mass * speed * speed);
    scene_destroy(&body);
}

TEST(bar_bounces_off_a_wall_isothermal) { DOUBLE_ONLY(); bounce(TLSPH_ISOTHERMAL); }
TEST(bar_bounces_off_a_wall_energy) { DOUBLE_ONLY(); bounce(TLSPH_ENERGY); }

/* ---- tension test ------------------------------------------------------------------------------------------------ */

/* Axial stress of a bar with free sides at stretch l: lateral stretch found by bisection on the lateral stress. */
static double uniaxial_stress(const tlsph_material *material, double l) {
    double low = 0.5, high = 1.5;
    tlsph_material_state state;
    memset(&state, 0, sizeof state);
    for (int i = 0; i < 60; i++) {
        const double side = (low + high) / 2;
        const tlsph_real F[9] = { R(l), 0, 0, 0, R(side), 0, 0, 0, R(side) };
        tlsph_material_evaluate(material, F, material->reference_temperature, &state);
        if ((double)state.P[4] > 0) high = side; else low = side;
    }
    return (double)state.P[0];
}

static void pull(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                 const tlsph_real *x, tlsph_real *values) {
    /* smooth start over the pulling time T, so that the bar is never rung: s(t) = 6t^5 - 15t^4 + 10t^3 */
    const double T = 8, t = fmin((double)time / T, 1), amount = *(const double *)user;
    (void)particle; (void)X; (void)x;
    for (size_t i = 0; i < count; i++) values[3 * i] = R(amount * 30 * t * t * (t - 1) * (t - 1) / T);
}

static void tension(tlsph_unknowns unknowns) {
    const tlsph_material material = scene_paper_material(TLSPH_NEO_HOOKEAN);
    const scene_options options = physics_options(unknowns, TLSPH_ISOTHERMAL);
    double amount = 0.4, stress, exact; /* m, of 2 m */
    tlsph_condition *end;
    scene_setup setup;
    scene_body body;
    tlsph_real *P;
    size_t middle;
    box_begin(&setup, 8, 2, 2, &material);
    scene_add_plane(&setup, TLSPH_ROLLER, 0, 0);
    scene_add_plane(&setup, TLSPH_ROLLER, 1, 0);
    scene_add_plane(&setup, TLSPH_ROLLER, 2, 0);
    end = scene_add_plane(&setup, TLSPH_VELOCITY, 0, 2); /* its normal: only the axial velocity is driven */
    end->values = pull;
    end->values_user = &amount;
    REQUIRE_OK(scene_end(&setup, &options, &body, NULL));
    CHECK_RESULT(tlsph_advance(body.solver, 8), TLSPH_OK);
    P = scene_read(body.solver, TLSPH_FIELD_STRESS);
    middle = scene_nearest(&body.cloud.particles, 1, 0.25, 0.25);
    stress = (double)P[9 * middle];
    exact = uniaxial_stress(&material, 1.2);
    REPORT("stress %.1f Pa, exact %.1f Pa, %.2f %%", stress, exact, 100 * (stress / exact - 1));
    CHECK_CLOSE(stress, exact, 0.02 * exact);
    free(P);
    scene_destroy(&body);
}

TEST(tension_test_pF) { DOUBLE_ONLY(); tension(TLSPH_PF); }
TEST(tension_test_pFHJ) { DOUBLE_ONLY(); tension(TLSPH_PFHJ); }

SUITE(physics_loads, ENTRY(odd_even_temperature_decays_with_compact_conduction),
      ENTRY(odd_even_temperature_stays_with_double_gradient), ENTRY(free_fall_is_exact),
      ENTRY(body_force_moves_the_centre_as_a_point), ENTRY(pressure_follows_the_turned_normal),
      ENTRY(bar_bounces_off_a_wall_isothermal), ENTRY(bar_bounces_off_a_wall_energy), ENTRY(tension_test_pF),
      ENTRY(tension_test_pFHJ))
