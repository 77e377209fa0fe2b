/* tlsph_preflight: its figures are those of the run, and each hint appears for its reason and not without. */
#include "support.h"

#define BIT(hint) (1u << (hint))

/* A block under one load; 0 stands for the usual value. */
typedef struct trial {
    int cells[3], dimension;             /* 5, 5, 5; 3 */
    double jitter, poisson, end_time;    /* 0, 0.3, 0 */
    tlsph_operator_kind kind;            /* TLSPH_CORRECTED_KERNEL */
    double support, cfl;                 /* 0.6, 0.3 */
    tlsph_unknowns unknowns;
    tlsph_condition_kind condition;      /* TLSPH_PRESSURE */
    double load, conductivity;
    tlsph_integrator integrator;
    tlsph_dissipation dissipation;
    tlsph_scheme scheme;
} trial;

static double or_usual(double value, double usual) { return value > 0 ? value : usual; }

static int report_of(const trial *t, tlsph_preflight_report *report)
{
    tlsph_material material = soft_material(t->scheme ? TLSPH_NEO_HOOKEAN : TLSPH_MIE_GRUNEISEN);
    tlsph_condition load = tlsph_condition_default(t->condition ? t->condition : TLSPH_PRESSURE);
    const int cells[3] = {5, 5, 5}, dimension = t->dimension ? t->dimension : 3;
    tlsph_desc desc = tlsph_desc_default(dimension);
    tlsph_solver *solver = NULL;
    tlsph_error error;
    own_cloud cloud;
    if (!CHECK(own_box(&cloud, dimension, t->cells[0] ? t->cells : cells, 0.2, t->jitter))) return 0;
    material.poisson = R(or_usual(t->poisson, 0.3));
    material.conductivity = R(t->conductivity);
    load.value[0] = R(t->load);
    desc.particles = cloud.particles;
    desc.materials = &material;
    desc.material_count = 1;
    desc.conditions = &load;
    desc.condition_count = 1;
    desc.thermal = t->conductivity > 0 ? TLSPH_ENERGY : TLSPH_ISOTHERMAL;
    desc.operator_kind = t->kind;
    desc.support = R(or_usual(t->support, 0.6));
    desc.unknowns = t->unknowns;
    desc.cfl = R(or_usual(t->cfl, 0.3));
    desc.integrator = t->integrator;
    desc.dissipation = t->dissipation;
    desc.scheme = t->scheme;
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

/* ---- multi-rate steps ---- */

/* A stress-free material that counts how often each particle is evaluated. */
typedef struct counted { tlsph_real modulus; int *calls; } counted;

static void count_calls(void *user, size_t count, const uint32_t *particle, const tlsph_real *F, const tlsph_real *J,
                        tlsph_response *out)
{
    const counted *c = user;
    (void)F, (void)J;
    memset(out, 0, count * sizeof *out);
    for (size_t i = 0; i < count; i++) {
        out[i].p_modulus[0] = out[i].s_modulus[0] = c->modulus;
        c->calls[particle[i]]++;
    }
}
/* Visits of pairs by a step in which particle a is evaluated for calls[a] - 1 passes, and once at the end: each takes
   part in its own passes and in those of levels that its neighbours have. */
static double visits_of(const tlsph_operator *view, const int *calls)
{
    double visits = 0;
    for (size_t a = 0; a < view->count; a++) {
        int passes = calls[view->host[a]] - 1, seen[16] = {0}, sum = passes;
        seen[passes] = 1;
        for (size_t k = view->first[a]; k < view->first[a + 1]; k++) {
            passes = calls[view->host[view->neighbours[k]]] - 1;
            sum += seen[passes] ? 0 : passes;
            seen[passes] = 1;
        }
        visits += (double)(view->first[a + 1] - view->first[a]) * sum;
    }
    return visits;
}
/* A layer whose sound is 4 times as fast between two others, or all the same. One level beside particles, not two: blocks
   may hold particles beside either, and visit for all what one of them needs. */
static void check_visits(int layered, int levels)
{
    const int cells[3] = {11, 3, 3}, n = 12 * 4 * 4;
    int calls[12 * 4 * 4] = {0}, least = 100, most = 0;
    uint8_t of[12 * 4 * 4];
    counted count[2];
    tlsph_material materials[2];
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_preflight_report r = {0};
    tlsph_operator view;
    tlsph_solver *solver;
    own_cloud cloud;
    if (!CHECK(own_box(&cloud, 3, cells, 0.1, 0))) return;
    for (int m = 0; m < 2; m++) {
        materials[m] = soft_material(TLSPH_USER);
        materials[m].young *= R(m && layered ? 16 : 1);
        materials[m].response = count_calls;
        materials[m].response_user = count + m;
        count[m].modulus = materials[m].young;
        count[m].calls = calls;
    }
    for (int a = 0; a < n; a++) of[a] = fabs((double)cloud.particles.positions[3 * a] - 0.6) < 0.25;
    desc.particles = cloud.particles;
    desc.particles.materials = of;
    desc.materials = materials;
    desc.material_count = 2;
    desc.integrator = TLSPH_LEAPFROG;
    desc.rates = 8;
    desc.keep_pairs = 1;
    if (CHECK_RESULT(tlsph_create(&desc, &solver, NULL), TLSPH_OK)) {
        const double dt = (double)tlsph_stable_time_step(solver);
        tlsph_preflight(solver, R(0.5 * dt), &r);
        tlsph_operator_view(solver, &view);
        memset(calls, 0, sizeof calls);
        CHECK_RESULT(tlsph_step(solver, R(dt)), TLSPH_OK);
        for (int a = 0; a < n; a++) {
            least = calls[a] < least ? calls[a] : least;
            most = calls[a] > most ? calls[a] : most;
        }
        CHECK_SAME(least, 2);
        CHECK_SAME(most, (1 << (levels - 1)) + 1);
        CHECK_SAME(r.pair_visits, visits_of(&view, calls));
        CHECK_SAME(r.steps, 1);
        tlsph_destroy(solver);
    }
    own_cloud_destroy(&cloud);
}
TEST(visits_of_multi_rate_steps)
{
    check_visits(0, 1);
    check_visits(1, 3);
}

TEST(every_hint_has_its_reason)
{
    const struct { trial t; unsigned expected; } rows[] = {
        {{.kind = TLSPH_CELLS}, 0},
        {{.kind = TLSPH_CELLS, .dimension = 2}, 0},
        {{.kind = TLSPH_CELLS, .cells = {5, 5, 1}}, BIT(TLSPH_HINT_THIN)},
        {{.kind = TLSPH_CELLS, .cells = {5, 5, 2}}, 0},
        {{.cells = {6, 6, 6}, .jitter = 0.3, .support = 0.9}, BIT(TLSPH_HINT_IRREGULAR)},
        {{.cells = {6, 6, 6}, .support = 0.9}, 0},
        {{.poisson = 0.495}, BIT(TLSPH_HINT_INCOMPRESSIBLE)},
        {{.poisson = 0.495, .unknowns = TLSPH_PFJ}, 0},
        {{.cfl = 0.6}, BIT(TLSPH_HINT_CFL)},
        /* c_s/c_p = 0.707 at nu = 0: shortest waves decay at 4.83/tau, within 2.61 of three stages up to 0.54, of two 0.43 */
        {{.cfl = 0.53, .poisson = 1e-9, .integrator = TLSPH_SSP_RK3}, 0},
        {{.cfl = 0.56, .poisson = 1e-9, .integrator = TLSPH_SSP_RK3}, BIT(TLSPH_HINT_CFL)},
        {{.cfl = 0.45, .poisson = 1e-9, .integrator = TLSPH_RK3_FROZEN}, BIT(TLSPH_HINT_CFL)},
        {{.cfl = 0.45, .poisson = 1e-9, .integrator = TLSPH_RK3_FROZEN, .dissipation = TLSPH_NO_DISSIPATION}, 0},
        {{.load = 1e12}, BIT(TLSPH_HINT_UNITS_LOAD)},
        {{.load = 1e12, .condition = TLSPH_TRACTION}, BIT(TLSPH_HINT_UNITS_LOAD)},
        {{.load = 1e12, .condition = TLSPH_VELOCITY}, BIT(TLSPH_HINT_UNITS_LOAD)},
        {{.load = 1e12, .condition = TLSPH_BODY_FORCE}, BIT(TLSPH_HINT_UNITS_LOAD)},
        {{.load = 1e12, .condition = TLSPH_ACCELERATION}, BIT(TLSPH_HINT_UNITS_LOAD)},
        {{.load = 1e12, .condition = TLSPH_FORCE}, 0}, /* no stress follows from it */
        {{.load = 0.01, .condition = TLSPH_VELOCITY}, 0},
        {{.end_time = 1e9}, BIT(TLSPH_HINT_UNITS_TIME)},
        {{.end_time = 1e-12}, BIT(TLSPH_HINT_UNITS_TIME)},
        {{.conductivity = 1e9}, BIT(TLSPH_HINT_DIFFUSION)},
        {{.scheme = TLSPH_INCOMPRESSIBLE}, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        tlsph_preflight_report r;
        if (!report_of(&rows[i].t, &r)) continue;
        if (!CHECK_SAME(r.hints, rows[i].expected)) printf("    row %d\n", (int)i);
        CHECK(r.support > 0.3 && r.support < 1.5); /* a corner's neighbours lie at right angles */
        if (rows[i].t.scheme == TLSPH_INCOMPRESSIBLE) CHECK(r.crossings == 0); /* there is no sound to cross it */
    }
}
/* Blocks of 8 and 27 particles far from each other. */
TEST(bodies_are_told_apart)
{
    tlsph_real X[3 * 35], V[35];
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_material material = soft_material(TLSPH_NEO_HOOKEAN);
    tlsph_preflight_report r;
    tlsph_solver *solver;
    for (int a = 0; a < 35; a++) {
        const int side = a < 8 ? 2 : 3, i = a < 8 ? a : a - 8, at[3] = {i % side, i / side % side, i / side / side};
        for (int k = 0; k < 3; k++) X[3 * a + k] = R(0.1 * at[k] + (a < 8 ? 0 : 10));
        V[a] = R(1e-3);
    }
    desc.particles.count = 35;
    desc.particles.positions = X;
    desc.particles.volumes = V;
    desc.particles.spacing = R(0.1);
    desc.materials = &material;
    desc.material_count = 1;
    REQUIRE_OK(tlsph_create(&desc, &solver, NULL));
    tlsph_preflight(solver, 0, &r);
    CHECK_SAME(r.bodies, 2);
    CHECK_SAME(r.smallest_body, 8);
    CHECK_SAME(r.particles, 35);
    CHECK_SAME(tlsph_body_count(solver), 2);
    tlsph_destroy(solver);
}

TEST(weak_support_is_named)
{
    tlsph_preflight_report r;
    const trial block = {.kind = TLSPH_CELLS};
    REQUIRE(report_of(&block, &r));
    CHECK_CLOSE(r.support, 1, 0.5); /* a corner has three neighbours at right angles */
    CHECK(r.weakest < r.particles);
    CHECK(strstr(tlsph_hint_text(TLSPH_HINT_CFL), "cfl") != NULL);
    CHECK(!strcmp(tlsph_hint_text((tlsph_hint)TLSPH_HINT_COUNT), "no such hint"));
}

SUITE(preflight, ENTRY(figures_of_a_block), ENTRY(visits_of_multi_rate_steps), ENTRY(every_hint_has_its_reason),
      ENTRY(bodies_are_told_apart), ENTRY(weak_support_is_named))
