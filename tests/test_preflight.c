/* tlsph_preflight: its figures are those of the run, and each hint appears for its reason and not without. */
#include "support.h"

#define BIT(hint) (1u << (hint))

typedef struct trial {
    int cells[3];
    double spacing, jitter, poisson, end_time;
    tlsph_operator_kind kind;
    double support;
    tlsph_unknowns unknowns;
    double cfl, pressure, conductivity;
} trial;

static const trial plain = {{5, 5, 5}, 0.2, 0, 0.3, 0, TLSPH_CELLS, 0.6, TLSPH_PF, 0.3, 0, 0};

static int report_of(const trial *t, tlsph_preflight_report *report)
{
    tlsph_material material = soft_material(TLSPH_MIE_GRUNEISEN);
    tlsph_condition load = tlsph_condition_default(TLSPH_PRESSURE);
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_solver *solver = NULL;
    tlsph_error error;
    own_cloud cloud;
    if (!CHECK(own_box(&cloud, 3, t->cells, t->spacing, t->jitter))) return 0;
    material.poisson = R(t->poisson);
    material.conductivity = R(t->conductivity);
    load.value[0] = R(t->pressure);
    desc.particles = cloud.particles;
    desc.materials = &material;
    desc.material_count = 1;
    desc.conditions = &load;
    desc.condition_count = 1;
    desc.thermal = t->conductivity > 0 ? TLSPH_ENERGY : TLSPH_ISOTHERMAL;
    desc.operator_kind = t->kind;
    desc.support = R(t->support);
    desc.unknowns = t->unknowns;
    desc.cfl = R(t->cfl);
    if (!CHECK_RESULT(tlsph_create(&desc, &solver, &error), TLSPH_OK)) printf("    %s\n", error.message);
    else tlsph_preflight(solver, R(t->end_time), report);
    own_cloud_destroy(&cloud);
    tlsph_destroy(solver);
    return solver != NULL;
}

TEST(figures_of_a_block)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver = NULL;
    tlsph_preflight_report r;
    tlsph_size size;
    s.cells = 6;
    REQUIRE_OK(moving_block_create(&s, &solver, NULL));
    tlsph_size_read(solver, &size);
    const double dt = (double)tlsph_stable_time_step(solver);
    tlsph_preflight(solver, R(100.5 * dt), &r);
    CHECK_SAME(r.particles, 343);
    CHECK_SAME(r.pairs, size.pairs);
    CHECK_SAME(r.bytes, size.bytes);
    CHECK_SAME(r.bodies, 1);
    CHECK_SAME(r.smallest_body, 343);
    CHECK_SAME(r.steps, 101);
    CHECK_CLOSE(r.pair_visits, (double)size.pairs * 2 * 101, 1);
    CHECK_CLOSE(r.time_step, dt, 1e-6 * dt);
    CHECK_CLOSE(r.spacing_least, 1.0 / 6, 1e-4);
    tlsph_destroy(solver);
}

TEST(every_hint_has_its_reason)
{
    const struct { trial t; unsigned expected; } rows[] = {
        {plain, 0},
        {{{5, 5, 1}, 0.2, 0, 0.3, 0, TLSPH_CELLS, 0.6, TLSPH_PF, 0.3, 0, 0}, BIT(TLSPH_HINT_THIN)},
        {{{5, 5, 2}, 0.2, 0, 0.3, 0, TLSPH_CELLS, 0.6, TLSPH_PF, 0.3, 0, 0}, 0},
        {{{6, 6, 6}, 0.2, 0.3, 0.3, 0, TLSPH_CORRECTED_KERNEL, 0.9, TLSPH_PF, 0.3, 0, 0}, BIT(TLSPH_HINT_IRREGULAR)},
        {{{6, 6, 6}, 0.2, 0, 0.3, 0, TLSPH_CORRECTED_KERNEL, 0.9, TLSPH_PF, 0.3, 0, 0}, 0},
        {{{5, 5, 5}, 0.2, 0, 0.495, 0, TLSPH_CELLS, 0.6, TLSPH_PF, 0.3, 0, 0}, BIT(TLSPH_HINT_INCOMPRESSIBLE)},
        {{{5, 5, 5}, 0.2, 0, 0.495, 0, TLSPH_CELLS, 0.6, TLSPH_PFJ, 0.3, 0, 0}, 0},
        {{{5, 5, 5}, 0.2, 0, 0.3, 0, TLSPH_CELLS, 0.6, TLSPH_PF, 0.6, 0, 0}, BIT(TLSPH_HINT_CFL)},
        {{{5, 5, 5}, 0.2, 0, 0.3, 0, TLSPH_CELLS, 0.6, TLSPH_PF, 0.3, 1e12, 0}, BIT(TLSPH_HINT_UNITS_LOAD)},
        {{{5, 5, 5}, 0.2, 0, 0.3, 1e9, TLSPH_CELLS, 0.6, TLSPH_PF, 0.3, 0, 0}, BIT(TLSPH_HINT_UNITS_TIME)},
        {{{5, 5, 5}, 0.2, 0, 0.3, 1e-12, TLSPH_CELLS, 0.6, TLSPH_PF, 0.3, 0, 0}, BIT(TLSPH_HINT_UNITS_TIME)},
        {{{5, 5, 5}, 0.2, 0, 0.3, 0, TLSPH_CELLS, 0.6, TLSPH_PF, 0.3, 0, 1e9}, BIT(TLSPH_HINT_DIFFUSION)},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        tlsph_preflight_report r;
        if (!report_of(&rows[i].t, &r)) continue;
        if (!CHECK_SAME(r.hints, rows[i].expected)) printf("    row %d\n", (int)i);
    }
}

TEST(weak_support_is_named)
{
    tlsph_preflight_report r;
    trial flat = plain;
    REQUIRE(report_of(&flat, &r));
    CHECK_CLOSE(r.support, 1, 0.5); /* a corner has three neighbours at right angles */
    CHECK(r.weakest < r.particles);
    CHECK(strstr(tlsph_hint_text(TLSPH_HINT_CFL), "cfl") != NULL);
    CHECK(!strcmp(tlsph_hint_text((tlsph_hint)TLSPH_HINT_COUNT), "no such hint"));
}

SUITE(preflight, ENTRY(figures_of_a_block), ENTRY(every_hint_has_its_reason), ENTRY(weak_support_is_named))
