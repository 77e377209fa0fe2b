/* Clouds whose particles lie behind their surface: the cells' moments, balances with every condition, convergence. */
#include "physics.h"
#include "support.h"

/* ---- the cells ---- */

static int in_ball(tlsph_fill *fill) { return fill->shape == TLSPH_SPHERE; }

/* By the divergence theorem sum B_a (x) X_a + T_a is the volume times I, and sum B_a is 0. */
static void check_moments(int dimension, tlsph_shape shape, tlsph_placement placement, double volume)
{
    tlsph_fill fill = tlsph_fill_default(dimension);
    tlsph_cloud cloud;
    double B[3] = { 0 }, moment[9] = { 0 }, sum = 0, deepest = 0;
    fill.shape = shape;
    fill.size[0] = 1; fill.size[1] = R(0.75); fill.size[2] = R(0.5);
    if (in_ball(&fill)) fill.size[1] = fill.size[2] = 1;
    fill.notch[0] = R(0.5); fill.notch[1] = R(0.5);
    fill.spacing = R(0.125);
    fill.placement = placement;
    fill.jitter = R(0.2);
    fill.seed = 7;
    fill.voronoi = 1;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    const tlsph_particles *p = &cloud.particles;
    REQUIRE(p->moments != NULL);
    for (size_t a = 0; a < p->count; a++) {
        double share = 0, depth = 0;
        sum += (double)p->volumes[a];
        for (size_t i = 0; i < 9; i++) {
            const double T = (double)p->moments[9 * a + i];
            moment[i] += (double)p->areas[3 * a + i / 3] * (double)p->positions[3 * a + i % 3] + T;
            if (i % 4 == 0) depth += T;
        }
        for (size_t i = 0; i < 3; i++) {
            B[i] += (double)p->areas[3 * a + i];
            share += fabs((double)p->areas[3 * a + i]);
        }
        if (!(share > 0)) CHECK(!(fabs(depth) > 0));
        else { CHECK(depth > 0); deepest = fmax(deepest, depth / share); }
    }
    for (int i = 0; i < dimension; i++) CHECK_CLOSE(B[i], 0, 1000 * EPSILON);
    for (int i = 0; i < 3 * dimension; i++)
        if (i % 3 < dimension) CHECK_CLOSE(moment[i], i % 4 ? 0 : sum, (in_ball(&fill) ? 1e-3 : 2000 * EPSILON) * sum);
    CHECK_CLOSE(sum, volume, (in_ball(&fill) ? 0.02 : 1000 * EPSILON) * volume);
    CHECK(deepest < 1.2 * 0.125); /* no particle is deeper behind its share */
    tlsph_cloud_destroy(&cloud);
}
TEST(moments_add_up)
{
    for (int k = 0; k < 2; k++) {
        const tlsph_placement placement = k ? TLSPH_SCATTERED_INSIDE : TLSPH_CELL_CENTRED;
        check_moments(3, TLSPH_BOX, placement, 0.375);
        check_moments(2, TLSPH_BOX, placement, 0.75);
        check_moments(3, TLSPH_L_SHAPE, placement, 0.625 * 0.5);
        check_moments(2, TLSPH_L_SHAPE, placement, 0.625);
    }
    check_moments(3, TLSPH_SPHERE, TLSPH_SCATTERED_INSIDE, SCENE_PI / 6);
}

/* Shares of a face: selected by their middles, each once, with all of its area. */
TEST(faces_are_selected)
{
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_cloud cloud;
    uint32_t list[512];
    fill.size[0] = fill.size[1] = fill.size[2] = 1;
    fill.spacing = R(0.25);
    fill.jitter = R(0.2);
    fill.placement = TLSPH_CELL_CENTRED;
    fill.voronoi = 1;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    for (int axis = 0; axis < 3; axis++)
        for (int side = 0; side < 2; side++) {
            double area = 0;
            const size_t found = tlsph_select_plane(&cloud.particles, axis, R(side), R(1e-5), list, 512);
            for (size_t i = 0; i < found; i++) area += (double)cloud.particles.areas[3 * list[i] + (uint32_t)axis];
            CHECK_CLOSE(area, side ? 1 : -1, 1e3 * EPSILON);
        }
    CHECK_SAME(tlsph_select_plane(&cloud.particles, 0, R(0.5), R(1e-3), list, 512), 0);
    tlsph_cloud_destroy(&cloud);
}

/* ---- balances ---- */

typedef struct motion { double speed, rate; } motion;

static void pull(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X, const tlsph_real *x,
                 tlsph_real *values)
{
    const motion *m = user;
    (void)particle; (void)x;
    for (size_t i = 0; i < count; i++) {
        values[3 * i] = R(m->speed * sin(m->rate * (double)time));
        values[3 * i + 1] = R(m->speed * ((double)X[3 * i + 2] - 0.4) * sin(m->rate * (double)time));
        values[3 * i + 2] = 0;
    }
}

/* kind 0: free; 1: clamped, driven, roller, traction and pressure; 2: roller, tangent, temperature and flux. */
static int behind_body(int kind, tlsph_unknowns unknowns, tlsph_thermal thermal, motion *m, scene_body *body)
{
    tlsph_material material = scene_paper_material(thermal == TLSPH_ISOTHERMAL ? TLSPH_NEO_HOOKEAN : TLSPH_MIE_GRUNEISEN);
    scene_options options = physics_options(unknowns, thermal);
    tlsph_fill fill = tlsph_fill_default(3);
    scene_setup setup;
    for (int i = 0; i < 3; i++) fill.size[i] = R(0.25 * (5 - i));
    fill.spacing = R(0.25);
    fill.jitter = R(0.2);
    fill.seed = 3;
    options.placement = 1;
    scene_options_cloud(&options, &fill);
    scene_begin(&setup, &fill, &material, NULL);
    if (kind == 1) {
        scene_add_plane(&setup, TLSPH_CLAMPED, 0, 0);
        tlsph_condition *c = scene_add_plane(&setup, TLSPH_VELOCITY, 0, 1.25);
        c->normal[0] = 0; /* all components, on this face */
        c->values = pull;
        c->values_user = m;
        scene_add_plane(&setup, TLSPH_ROLLER, 1, 0);
        scene_add_plane(&setup, TLSPH_TRACTION, 1, 1)->value[2] = R(2e-3) * material.young;
        scene_add_plane(&setup, TLSPH_PRESSURE, 2, 0.75)->value[0] = R(5e-3) * material.young;
    }
    if (kind == 2) {
        scene_add_plane(&setup, TLSPH_ROLLER, 0, 0);
        scene_add_plane(&setup, TLSPH_TANGENT, 1, 1);
        scene_add_plane(&setup, TLSPH_TEMPERATURE, 2, 0)->value[0] = material.reference_temperature + 10;
        scene_add_plane(&setup, TLSPH_HEAT_FLUX, 2, 0.75)->value[0] = R(-1e5);
    }
    return CHECK_RESULT(scene_end(&setup, &options, body, NULL), TLSPH_OK);
}

TEST(balances_behind_the_surface)
{
    static const tlsph_unknowns unknowns[2] = { TLSPH_PF, TLSPH_PFJ };
    static const tlsph_thermal thermal[3] = { TLSPH_ISOTHERMAL, TLSPH_ENERGY, TLSPH_ENTROPY };
    double worst[3] = { 0 }, least = 1, entropy = 0;
    DOUBLE_ONLY();
    for (int k = 0; k < 12; k++) {
        const int free_body = k < 6, which = k % 6;
        scene_body body;
        tlsph_ledger start, end;
        motion m = { 4, 30 };
        double speed = 5;
        if (!behind_body(free_body ? 0 : 1, unknowns[which % 2], thermal[which / 2], &m, &body)) return;
        if (free_body && !CHECK_RESULT(scene_set_state(&body, &speed, lively_state), TLSPH_OK)) return;
        tlsph_ledger_read(body.solver, &start);
        double size = start.kinetic_energy;
        for (int i = 0; i < 120; i++) {
            if (!CHECK_RESULT(tlsph_step(body.solver, R(1e9)), TLSPH_OK)) { REPORT("%s", tlsph_last_error(body.solver)->message); return; }
            tlsph_ledger_read(body.solver, &end);
            least = fmin(least, end.jacobian_least);
            size = fmax(size, end.kinetic_energy);
        }
        const double momentum = sqrt(2 * end.mass * size);
        if (free_body) {
            worst[0] = fmax(worst[0], length3(end.linear_residual) / momentum);
            worst[1] = fmax(worst[1], length3(end.angular_residual) / momentum);
        }
        if (thermal[which / 2] == TLSPH_ENERGY) worst[2] = fmax(worst[2], fabs(end.energy_residual) / size);
        CHECK(end.dissipation >= 0);
        if (free_body && thermal[which / 2] == TLSPH_ISOTHERMAL) CHECK(end.total_energy < start.total_energy * (1 + 1e-6));
        if (thermal[which / 2] == TLSPH_ENTROPY) entropy = fmax(entropy, fabs(end.entropy_residual) / end.dissipation_entropy);
        scene_destroy(&body);
    }
    CHECK_BELOW(worst[0], 1e-12);
    CHECK_BELOW(worst[1], 1e-12);
    CHECK_BELOW(worst[2], 1e-11);
    CHECK_BELOW(entropy, 1e-6);
    CHECK(least > 0.2 && least < 0.97);
    REPORT("linear %.0e, angular %.0e, energy %.0e, entropy %.0e, least J %.2f", worst[0], worst[1], worst[2], entropy, least);
}

/* Noise dies at each scheme's limit, in a free body and in one with all of its corners held. */
static tlsph_real noise(uint64_t *state) { return R(1e-3 * ((double)((*state = *state * 6364136223846793005u + 1) >> 40) / 16777216 - 0.5)); }
TEST(noise_dies_behind_the_surface)
{
    const tlsph_material material = scene_paper_material(TLSPH_NEO_HOOKEAN);
    DOUBLE_ONLY();
    for (int k = 0; k < 8; k++) {
        scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
        tlsph_fill fill = tlsph_fill_default(3);
        scene_setup setup;
        scene_body body;
        tlsph_ledger start, end;
        uint64_t state = 3;
        fill.size[0] = fill.size[1] = fill.size[2] = 1;
        fill.spacing = R(0.2);
        fill.jitter = R(0.2);
        fill.seed = k % 4 / 2 ? 1 : 5;
        options.placement = 1;
        options.integrator = k % 2 ? TLSPH_SSP_RK3 : TLSPH_RK2;
        options.cfl = (double)tlsph_cfl_limit((tlsph_integrator)options.integrator);
        scene_options_cloud(&options, &fill);
        scene_begin(&setup, &fill, &material, NULL);
        for (int face = 0; face < 6 && k > 3; face++) scene_add_plane(&setup, TLSPH_CLAMPED, face / 2, face % 2);
        if (!CHECK_RESULT(scene_end(&setup, &options, &body, NULL), TLSPH_OK)) return;
        tlsph_real *v = scene_read(body.solver, TLSPH_FIELD_VELOCITY);
        for (size_t i = 0; v && i < 3 * body.cloud.particles.count; i++) v[i] = noise(&state);
        if (!v || !CHECK_RESULT(tlsph_write(body.solver, TLSPH_FIELD_VELOCITY, v), TLSPH_OK)) return;
        tlsph_ledger_read(body.solver, &start);
        for (int i = 0; i < 300; i++)
            if (!CHECK_RESULT(tlsph_step(body.solver, R(1e9)), TLSPH_OK)) return;
        tlsph_ledger_read(body.solver, &end);
        CHECK_BELOW(end.total_energy, 0.1 * start.total_energy);
        free(v);
        scene_destroy(&body);
    }
}

/* Loads push and turn a free body by what the ledger books; heat goes where it should. */
TEST(loads_behind_the_surface)
{
    tlsph_material material = scene_paper_material(TLSPH_NEO_HOOKEAN);
    DOUBLE_ONLY();
    for (int kind = 0; kind < 2; kind++) {
        scene_options options = physics_options(TLSPH_PF, TLSPH_ISOTHERMAL);
        tlsph_fill fill = tlsph_fill_default(3);
        scene_setup setup;
        scene_body body;
        tlsph_ledger end;
        fill.size[0] = fill.size[1] = fill.size[2] = 1;
        fill.spacing = R(0.25);
        fill.jitter = R(0.3);
        options.placement = 1;
        scene_options_cloud(&options, &fill);
        scene_begin(&setup, &fill, &material, NULL);
        tlsph_condition *c = scene_add_plane(&setup, kind ? TLSPH_PRESSURE : TLSPH_TRACTION, 0, 1);
        c->value[0] = R(kind ? 0.02 : 0) * material.young;
        c->value[1] = R(0.02) * material.young;
        if (!CHECK_RESULT(scene_end(&setup, &options, &body, NULL), TLSPH_OK)) return;
        CHECK_RESULT(tlsph_advance(body.solver, R(0.01)), TLSPH_OK);
        tlsph_ledger_read(body.solver, &end);
        const double impulse = 0.01 * 0.02 * (double)material.young; /* on an area of 1 m^2 */
        CHECK_BELOW(length3(end.linear_residual), 1e-12 * impulse);
        CHECK_BELOW(length3(end.angular_residual), 1e-12 * impulse);
        CHECK_CLOSE(end.impulse[kind ? 0 : 1], kind ? -impulse : impulse, (kind ? 0.05 : 0.01) * impulse); /* slack of the lengths of B */
        /* the traction acts at the face's middle (1, 1/2, 1/2): so the torque about the origin */
        if (!kind) CHECK_CLOSE(end.angular_impulse[2], impulse, 0.01 * impulse);
        if (!kind) CHECK_CLOSE(end.angular_impulse[0], -impulse / 2, 0.01 * impulse);
        scene_destroy(&body);
    }
}

TEST(heat_behind_the_surface)
{
    DOUBLE_ONLY();
    for (int k = 0; k < 2; k++) {
        scene_body body;
        tlsph_ledger end;
        if (!behind_body(2, TLSPH_PF, k ? TLSPH_ENTROPY : TLSPH_ENERGY, NULL, &body)) return;
        CHECK_RESULT(tlsph_advance(body.solver, R(0.02)), TLSPH_OK);
        tlsph_ledger_read(body.solver, &end);
        CHECK(end.external_heat > 0 && end.temperature_largest < 1.1 * (double)body.material.reference_temperature);
        if (!k) CHECK_BELOW(fabs(end.energy_residual), 1e-11 * end.external_heat);
        CHECK_BELOW(fabs(end.entropy_residual), (k ? 1e-6 : 1e-3) * end.external_entropy);
        scene_destroy(&body);
    }
}

/* ---- what is refused ---- */

TEST(refusals_behind_the_surface)
{
    const tlsph_material material = scene_paper_material(TLSPH_NEO_HOOKEAN);
    tlsph_fill fill = tlsph_fill_default(2);
    tlsph_cloud cloud;
    fill.size[0] = fill.size[1] = 1;
    fill.spacing = R(0.125);
    fill.jitter = R(0.2);
    fill.placement = TLSPH_CELL_CENTRED;
    fill.voronoi = 1;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    uint32_t left[64], inner = 36;
    const size_t count = tlsph_select_plane(&cloud.particles, 0, 0, R(1e-6), left, 64);
    for (int k = 0; k < 9; k++) {
        static const tlsph_result expected[9] = { TLSPH_OK, TLSPH_ERROR_DESCRIPTION, TLSPH_ERROR_DESCRIPTION,
                                                  TLSPH_ERROR_DESCRIPTION, TLSPH_ERROR_CONDITION, TLSPH_ERROR_CONDITION, TLSPH_OK,
                                                  TLSPH_ERROR_DESCRIPTION, TLSPH_ERROR_NOT_FINITE };
        tlsph_desc desc = tlsph_desc_default(2);
        tlsph_condition condition = tlsph_condition_default(k == 4 ? TLSPH_WALL : TLSPH_CLAMPED);
        tlsph_real *const moments = (tlsph_real *)cloud.particles.moments;
        tlsph_solver *solver = NULL;
        tlsph_error error;
        desc.particles = cloud.particles;
        desc.materials = &material;
        desc.material_count = 1;
        closed_operator(&desc);
        desc.threads = 1;
        desc.conditions = &condition;
        desc.condition_count = 1;
        condition.particles = k == 6 ? &inner : left;
        condition.count = k == 6 ? 1 : count;
        condition.face[0] = k != 5;
        condition.face[1] = k == 5; /* the left face has no share across Y */
        condition.normal[0] = k == 4;
        if (k == 1) desc.integrator = TLSPH_LEAPFROG;
        if (k == 2) desc.scheme = TLSPH_INCOMPRESSIBLE;
        if (k == 3) desc.sharp_gradients = 1;
        if (k == 7) desc.conduction_stages = 5;
        const tlsph_real kept = moments[0];
        if (k == 8) moments[0] = R(NAN);
        CHECK_RESULT(tlsph_create(&desc, &solver, &error), expected[k]);
        CHECK(expected[k] == TLSPH_OK || error.message[0] != 0);
        moments[0] = kept;
        tlsph_destroy(solver);
    }
    tlsph_cloud_destroy(&cloud);
    fill.size[1] = R(0.125); /* one particle across: no gradient can be found across it */
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    tlsph_desc desc = tlsph_desc_default(2);
    tlsph_solver *solver = NULL;
    desc.particles = cloud.particles;
    desc.materials = &material;
    desc.material_count = 1;
    closed_operator(&desc);
    CHECK(tlsph_create(&desc, &solver, NULL) != TLSPH_OK);
    tlsph_destroy(solver);
    tlsph_cloud_destroy(&cloud);
}

/* ---- convergence ---- */

static void cube_errors(int n, double out[2])
{
    swinging_cube_parameters p;
    swinging_cube cube;
    swinging_cube_default(&p);
    p.n = n;
    p.jitter = 0.2;
    p.options.placement = 1;
    p.options.threads = 1;
    out[0] = out[1] = HUGE_VAL;
    if (!CHECK_RESULT(swinging_cube_create(&p, &cube, NULL), TLSPH_OK)) return;
    CHECK_RESULT(tlsph_advance(cube.body.solver, R(p.options.end_time)), TLSPH_OK);
    swinging_cube_errors(&cube, &out[0], &out[1]);
    scene_destroy(&cube.body);
}
/* Rollers and skew-symmetry. Surface clouds have p 4.5e-2, 1.3e-2, 3.3e-3 and P 3.8e-2, 1.5e-2, 5.6e-3 at n = 4, 8, 16. */
TEST(slow_swinging_cube_converges)
{
    double e[3][2], p[3], P[3];
    DOUBLE_ONLY();
    for (int i = 0; i < 3; i++) {
        cube_errors(4 << i, e[i]);
        p[i] = e[i][0];
        P[i] = e[i][1];
    }
    CHECK(observed_order(p, 3) > 1.9 && p[2] < 4e-3);
    CHECK(observed_order(P, 3) > 1.4 && P[2] < 7e-3);
    REPORT("p %.1e %.1e %.1e, P %.1e %.1e %.1e", p[0], p[1], p[2], P[0], P[1], P[2]);
}
/* Free surfaces. */
TEST(slow_modes_behind_the_surface)
{
    double frequency[4];
    DOUBLE_ONLY();
    for (int k = 0; k < 4; k++) {
        cloud_mode_parameters p;
        cloud_mode mode;
        if (k / 2) breathing_ball_default(&p);
        else lame_mode_default(&p);
        p.n = k % 2 ? 8 : 4;
        p.periods = 1;
        p.options.placement = 1;
        p.options.threads = 1;
        tlsph_error error;
        if (!CHECK_RESULT(cloud_mode_create(&p, &mode, &error), TLSPH_OK)) { REPORT("%d: %s", k, error.message); return; }
        CHECK_RESULT(cloud_mode_measure(&mode, &frequency[k], NULL, NULL), TLSPH_OK);
        scene_destroy(&mode.body);
    }
    REPORT("frequency of Lame's mode %.2f, %.2f %%, of the ball %.2f, %.2f %%", 100 * frequency[0], 100 * frequency[1],
           100 * frequency[2], 100 * frequency[3]);
    for (int k = 0; k < 4; k++) CHECK(fabs(frequency[k]) < (k % 2 ? 0.02 : 0.06));
}

/* Large strain: the column of 001 section 7.3.1. */
TEST(slow_column_behind_the_surface)
{
    twisting_column_shape shape[2];
    DOUBLE_ONLY();
    memset(shape, 0, sizeof shape);
    for (int k = 0; k < 2; k++) {
        twisting_column_parameters p;
        twisting_column column;
        twisting_column_default(&p);
        p.n = 4;
        p.jitter = 0.2 * k;
        p.options.placement = k;
        p.options.threads = 1;
        REQUIRE_OK(twisting_column_create(&p, &column, NULL));
        for (int i = 1; i <= 10; i++) {
            CHECK_RESULT(tlsph_advance(column.body.solver, R(0.005 * i)), TLSPH_OK);
            twisting_column_read(&column, &shape[k]);
        }
        scene_destroy(&column.body);
    }
    CHECK_CLOSE(shape[1].tip_height, shape[0].tip_height, 0.05 * shape[0].tip_height);
    REPORT("height %.3f %.3f m, twist %.3f %.3f rad", shape[0].tip_height, shape[1].tip_height, shape[0].tip_twist, shape[1].tip_twist);
}

SUITE(physics_behind, ENTRY(moments_add_up), ENTRY(faces_are_selected), ENTRY(balances_behind_the_surface),
      ENTRY(noise_dies_behind_the_surface),
      ENTRY(loads_behind_the_surface), ENTRY(heat_behind_the_surface), ENTRY(refusals_behind_the_surface),
      ENTRY(slow_swinging_cube_converges), ENTRY(slow_modes_behind_the_surface), ENTRY(slow_column_behind_the_surface))
