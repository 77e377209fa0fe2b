/* Dissipation with its own adjoint: balances, entropy, and what it spares clouds. */
#include "physics.h"
#include "support.h"

/* A column in torsion at 400 rad/s, lattice (jitter 0) or cloud; the share of the energy that is left at `end`. */
static double energy_left(tlsph_dissipation kind, double jitter, int n, double end, double *height)
{
    twisting_column_parameters p;
    twisting_column column;
    twisting_column_shape shape;
    tlsph_ledger before, after;
    memset(&shape, 0, sizeof shape);
    twisting_column_default(&p);
    p.n = n;
    p.jitter = jitter;
    p.omega = 400;
    p.options.dissipation = (int)kind;
    p.options.threads = 1;
    if (!CHECK_RESULT(twisting_column_create(&p, &column, NULL), TLSPH_OK)) return HUGE_VAL;
    tlsph_ledger_read(column.body.solver, &before);
    CHECK_RESULT(tlsph_advance(column.body.solver, R(end)), TLSPH_OK);
    tlsph_ledger_read(column.body.solver, &after);
    twisting_column_read(&column, &shape);
    *height = shape.tip_height;
    scene_destroy(&column.body);
    return after.total_energy / before.total_energy;
}

/* The limiter takes the random errors of a cloud's gradients for jumps; here a cloud keeps what a lattice does. */
TEST(clouds_keep_the_energy_of_lattices)
{
    double left[3], height[3];
    DOUBLE_ONLY();
    left[0] = energy_left(TLSPH_LIMITED, 0.2, 3, 0.02, &height[0]);
    left[1] = energy_left(TLSPH_SELF_ADJOINT, 0.2, 3, 0.02, &height[1]);
    left[2] = energy_left(TLSPH_SELF_ADJOINT, 0, 3, 0.02, &height[2]);
    REPORT("energy left %.3f limited, %.3f, lattice %.3f; height %.3f %.3f %.3f m", left[0], left[1], left[2], height[0],
           height[1], height[2]);
    CHECK_BELOW(1 - left[1], (1 - left[0]) / 2);
    CHECK_BELOW(fabs(height[1] - height[2]), 0.03 * height[2]);
    CHECK_BELOW(left[1], 1);
}

/* A free cube that turns and swings, a lattice or a cloud: E to round-off, no entropy destroyed, no pair that feeds, momenta. */
static void balances(double jitter, tlsph_thermal thermal, tlsph_unknowns unknowns)
{
    const tlsph_material material = soft_material(TLSPH_MIE_GRUNEISEN);
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_solver *solver = NULL;
    tlsph_cloud cloud;
    tlsph_ledger before, after;
    fill.size[0] = fill.size[1] = fill.size[2] = 1;
    fill.spacing = R(0.2);
    fill.jitter = R(jitter);
    fill.voronoi = jitter > 0;
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    desc.particles = cloud.particles;
    desc.materials = &material;
    desc.material_count = 1;
    desc.thermal = thermal;
    desc.unknowns = unknowns;
    desc.dissipation = TLSPH_SELF_ADJOINT;
    desc.audit = 1;
    if (jitter > 0) {
        closed_operator(&desc);
    }
    REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
    const size_t n = tlsph_count(solver);
    tlsph_real *v = malloc(3 * n * sizeof *v);
    for (size_t i = 0; v && i < n; i++) {
        const tlsph_real *X = cloud.particles.positions + 3 * i;
        v[3 * i] = R(1 - 3 * (double)X[1] + sin(3 * (double)X[2]));
        v[3 * i + 1] = R(3 * (double)X[0] + sin(5 * (double)X[1]));
        v[3 * i + 2] = R(cos(4 * (double)X[0]));
    }
    REQUIRE_OK(tlsph_write(solver, TLSPH_FIELD_VELOCITY, v));
    free(v);
    tlsph_ledger_read(solver, &before);
    for (int i = 0; i < 60; i++) REQUIRE_OK(tlsph_step(solver, R(HUGE_VAL)));
    tlsph_ledger_read(solver, &after);
    const double kinetic = before.kinetic_energy, momentum = before.linear_momentum[0];
    REPORT(" %.0e", after.energy_residual / kinetic);
    CHECK(after.dissipation > 1e-3 * kinetic);
    CHECK(after.least_pair_production >= -1e-12);
    CHECK_BELOW(fabs(after.energy_residual), thermal == TLSPH_ENERGY ? 1e-11 * kinetic : 5e-3 * kinetic);
    if (thermal) CHECK(after.entropy > before.entropy);
    for (int i = 0; i < 3; i++) {
        CHECK_BELOW(fabs(after.linear_momentum[i] - before.linear_momentum[i]), 1e-12 * momentum);
        CHECK_BELOW(fabs(after.angular_momentum[i] - before.angular_momentum[i]), 1e-12 * momentum);
    }
    tlsph_destroy(solver);
    tlsph_cloud_destroy(&cloud);
}
TEST(energy_entropy_and_momenta)
{
    DOUBLE_ONLY();
    for (int k = 0; k < 2; k++)
        for (int t = 0; t < 3; t++) balances(k ? 0.2 : 0, (tlsph_thermal)t, t == 1 ? TLSPH_PFHJ : TLSPH_PF);
}

/* What its two parts cannot follow is refused. */
TEST(refusals)
{
    for (int i = 0; i < 5; i++) {
        tlsph_fill fill = tlsph_fill_default(3);
        tlsph_desc desc = tlsph_desc_default(3);
        tlsph_solver *solver = NULL;
        tlsph_cloud cloud;
        tlsph_error error;
        const tlsph_material material = soft_material(i == 4 ? TLSPH_VON_MISES : TLSPH_NEO_HOOKEAN);
        fill.size[0] = fill.size[1] = fill.size[2] = 1;
        fill.spacing = R(0.25);
        REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
        desc.particles = cloud.particles;
        desc.materials = &material;
        desc.material_count = 1;
        desc.dissipation = TLSPH_SELF_ADJOINT;
        if (i == 0) desc.integrator = TLSPH_LEAPFROG;
        if (i == 1) desc.integrator = TLSPH_RK3_FROZEN;
        if (i == 2) desc.sharp_gradients = 1;
        if (i == 3) desc.operator_kind = TLSPH_CELLS_4;
        CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_ERROR_DESCRIPTION);
        CHECK(strcmp(error.field, "dissipation") == 0);
        tlsph_destroy(solver);
        tlsph_cloud_destroy(&cloud);
    }
}

SUITE(physics_adjoint, ENTRY(clouds_keep_the_energy_of_lattices), ENTRY(energy_entropy_and_momenta), ENTRY(refusals))
