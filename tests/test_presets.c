/* Presets: what they set, what they leave alone, and that each is worth its place. */
#include "../examples/scenes/scenes.h"
#include "support.h"

static tlsph_desc preset_of(tlsph_preset_name name, tlsph_operator_kind kind, size_t cells) {
    tlsph_desc desc = tlsph_desc_default(3);
    desc.operator_kind = kind;
    desc.particles.cell_count = cells;
    desc.unknowns = TLSPH_PFJ;
    tlsph_preset(&desc, name);
    return desc;
}

TEST(set_what_they_promise) {
    for (int i = 0; i <= TLSPH_PRESET_ACCURATE; i++) {
        const tlsph_desc lattice = preset_of((tlsph_preset_name)i, TLSPH_CORRECTED_KERNEL, 1);
        const tlsph_desc cloud = preset_of((tlsph_preset_name)i, TLSPH_CLOSED, 0);
        const tlsph_desc cells = preset_of((tlsph_preset_name)i, TLSPH_CELLS, 1);
        const tlsph_desc again = preset_of((tlsph_preset_name)i, TLSPH_CELLS_4, 1);
        CHECK(cells.operator_kind == again.operator_kind && cells.operator_kind == lattice.operator_kind);
        const tlsph_desc loose = preset_of((tlsph_preset_name)i, TLSPH_CORRECTED_KERNEL, 0);
        CHECK_SAME(lattice.operator_kind, i > 0 ? TLSPH_CELLS_4 : TLSPH_CELLS);
        CHECK_SAME(lattice.sharp_gradients, 0);
        CHECK_SAME(lattice.integrator, i == 0 ? TLSPH_LEAPFROG : i == 1 ? TLSPH_RK3_FROZEN : TLSPH_RK4_FROZEN);
        CHECK_CLOSE(lattice.cfl, i > 0 ? R(0.45) : tlsph_cfl_limit(lattice.integrator), 0);
        CHECK_CLOSE(cloud.cfl, tlsph_cfl_limit(cloud.integrator), 0);
        CHECK_SAME(lattice.unknowns, TLSPH_PFJ);
        CHECK_SAME(cloud.operator_kind, TLSPH_CLOSED);
        CHECK_SAME(loose.operator_kind, TLSPH_CORRECTED_KERNEL);
        CHECK_SAME(lattice.conduction_stages, 9);
    }
}

TEST(leave_the_rest_alone) {
    tlsph_desc desc = tlsph_desc_default(3);
    desc.operator_kind = TLSPH_CELLS;
    desc.dissipation = TLSPH_JST; /* not with order 4 */
    tlsph_preset(&desc, TLSPH_PRESET_ACCURATE);
    CHECK_SAME(desc.operator_kind, TLSPH_CELLS);
    desc = tlsph_desc_default(3);
    desc.support = R(0.9);
    desc.particles.cell_count = 1; /* a lattice with more than 6 neighbours stays what it is */
    tlsph_preset(&desc, TLSPH_PRESET_FAST);
    CHECK_SAME(desc.operator_kind, TLSPH_CORRECTED_KERNEL);
    desc = tlsph_desc_default(3);
    tlsph_preset(&desc, (tlsph_preset_name)7);
    CHECK_SAME(desc.integrator, TLSPH_RK2);
    desc.scheme = TLSPH_INCOMPRESSIBLE; /* needs two stages */
    tlsph_preset(&desc, TLSPH_PRESET_ACCURATE);
    CHECK_SAME(desc.integrator, TLSPH_RK2);
    CHECK_SAME(desc.sharp_gradients, 0);
}

/* Error of p_x on the swinging cube after 9/8 periods. */
static double cube_error(const char *preset, double jitter) {
    swinging_cube_parameters p;
    swinging_cube cube;
    double error_p = HUGE_VAL, error_P;
    swinging_cube_default(&p);
    p.options.operator_kind = TLSPH_CORRECTED_KERNEL;
    p.options.integrator = TLSPH_RK2;
    p.options.cfl = 0.3;
    p.options.end_time = 0.018; /* 9/8 periods */
    p.options.threads = 1; /* threads would wait for each other */
    p.options.preset = preset[0] != 0;
    p.n = 5;
    p.jitter = jitter;
    p.amplitude = 5e-4;
    CHECK_SAME(scene_options_preset(&p.options, preset), preset[0] != 0);
    if (!CHECK_RESULT(swinging_cube_create(&p, &cube, NULL), TLSPH_OK)) return error_p;
    if (CHECK_RESULT(tlsph_advance(cube.body.solver, R(p.options.end_time)), TLSPH_OK))
        swinging_cube_errors(&cube, &error_p, &error_P);
    scene_destroy(&cube.body);
    return error_p;
}

TEST(errors_fall_from_preset_to_preset) {
    const double base = cube_error("", 0), fast = cube_error("fast", 0), balanced = cube_error("balanced", 0),
                 accurate = cube_error("accurate", 0);
    REPORT("base %.2e, fast %.2e, balanced %.2e, accurate %.2e", base, fast, balanced, accurate);
    CHECK_BELOW(fast, 1.5 * base);
    CHECK_BELOW(balanced, fast / 8);
    CHECK_BELOW(accurate, balanced / 1.2);
    CHECK_BELOW(cube_error("accurate", 0.2), 1.3 * cube_error("", 0.2)); /* irregular: the closed operator */
}

SUITE(presets, ENTRY(set_what_they_promise), ENTRY(leave_the_rest_alone), ENTRY(errors_fall_from_preset_to_preset))
