/* L-block of 000 section 7.2 in all sets of unknowns: what the section claims, coarse and short; long runs are slow_. */
#include "physics.h"

typedef struct outcome {
    double linear, angular, energy, entropy_fall, ballistic_rise, drift; /* worst over the run, relative as below */
    double u[3];                                                         /* probe's displacement at the end, m */
} outcome;

/* The ledger at the end of the loading is what the conserved quantities are compared with; the entropy form's energy is
   conserved to the order of the time scheme only, so that its caller judges `energy` by another measure. */
static void observe(tlsph_solver *solver, const l_block_parameters *p, double end, outcome *o) {
    const double impulse = l_block_impulse(p);
    tlsph_ledger now, before, released;
    double change[3];
    memset(o, 0, sizeof *o);
    CHECK_RESULT(tlsph_advance(solver, R(2 * p->ramp)), TLSPH_OK);
    tlsph_ledger_read(solver, &released);
    before = released;
    while ((double)tlsph_time(solver) < end) {
        REQUIRE_OK(tlsph_step(solver, R(end)));
        tlsph_ledger_read(solver, &now);
        for (int i = 0; i < 3; i++) change[i] = now.angular_momentum[i] - released.angular_momentum[i];
        o->linear = fmax(o->linear, length3(now.linear_momentum) / impulse);
        o->angular = fmax(o->angular, length3(change) / length3(released.angular_momentum));
        o->energy = fmax(o->energy, fabs(now.total_energy - released.total_energy) / released.external_work);
        o->entropy_fall = fmax(o->entropy_fall, before.entropy - now.entropy);
        o->ballistic_rise = fmax(o->ballistic_rise, now.ballistic_energy - before.ballistic_energy);
        o->drift = fmax(o->drift, now.drift_largest);
        before = now;
    }
}

static outcome block_run(tlsph_unknowns unknowns, tlsph_thermal thermal, double spacing, double end) {
    l_block_parameters p;
    l_block block;
    tlsph_real *u;
    outcome o;
    memset(&o, 0, sizeof o);
    o.drift = HUGE_VAL;
    l_block_default(&p);
    p.options.threads = 1;
    p.spacing = spacing;
    p.options.unknowns = (int)unknowns;
    p.options.thermal = (int)thermal;
    if (!CHECK_RESULT(l_block_create(&p, &block, NULL), TLSPH_OK)) return o;
    observe(block.body.solver, &p, end, &o);
    u = scene_read(block.body.solver, TLSPH_FIELD_DISPLACEMENT);
    for (size_t i = 0; u && i < 3; i++) o.u[i] = (double)u[3 * block.probe + i];
    free(u);
    scene_destroy(&block.body);
    return o;
}

/* Entropy and ballistic energy are monotone up to round-off of sums over 1e5 J/K and 1e7 J. */
static void check_outcome(const outcome *o, tlsph_thermal thermal) {
    CHECK_BELOW(o->linear, 1e-11);
    CHECK_BELOW(o->angular, 1e-8);
    if (thermal == TLSPH_ENERGY) CHECK_BELOW(o->energy, 1e-8);
    CHECK_BELOW(o->entropy_fall, 1e-9);
    CHECK_BELOW(o->ballistic_rise, 1e-6);
    CHECK_BELOW(o->drift, 0.02);
}

/* All sets solve the same problem: at 1 m spacing the tip must agree within 5 % of the way it went. */
static void one_set(tlsph_unknowns unknowns, tlsph_thermal thermal) {
    const outcome full = block_run(TLSPH_PFHJ, TLSPH_ENERGY, 1, 8), o = block_run(unknowns, thermal, 1, 8);
    const double difference[3] = { o.u[0] - full.u[0], o.u[1] - full.u[1], o.u[2] - full.u[2] };
    REPORT("energy %.1e, drift %.4f, tip %.2f %% off the full set", o.energy, o.drift,
           100 * length3(difference) / length3(full.u));
    check_outcome(&o, thermal);
    CHECK_BELOW(length3(difference), 0.05 * length3(full.u));
}

TEST(set_pF_energy) { DOUBLE_ONLY(); one_set(TLSPH_PF, TLSPH_ENERGY); }
TEST(set_pF_entropy) { DOUBLE_ONLY(); one_set(TLSPH_PF, TLSPH_ENTROPY); }
TEST(set_pFJ_energy) { DOUBLE_ONLY(); one_set(TLSPH_PFJ, TLSPH_ENERGY); }
TEST(set_pFJ_entropy) { DOUBLE_ONLY(); one_set(TLSPH_PFJ, TLSPH_ENTROPY); }
TEST(set_pFHJ_energy) { DOUBLE_ONLY(); one_set(TLSPH_PFHJ, TLSPH_ENERGY); }
TEST(set_pFHJ_entropy) { DOUBLE_ONLY(); one_set(TLSPH_PFHJ, TLSPH_ENTROPY); }
TEST(set_pFH_energy) { DOUBLE_ONLY(); one_set(TLSPH_PFH, TLSPH_ENERGY); }

TEST(forces_cancel) {
    l_block_parameters p;
    l_block block;
    tlsph_ledger l;
    l_block_default(&p);
    p.options.threads = 1;
    p.spacing = 1;
    REQUIRE_OK(l_block_create(&p, &block, NULL));
    CHECK_RESULT(tlsph_advance(block.body.solver, 2), TLSPH_OK);
    tlsph_ledger_read(block.body.solver, &l);
    CHECK_BELOW(length3(l.impulse), 1e3 * EPSILON * l_block_impulse(&p));
    CHECK(length3(l.angular_impulse) > l_block_impulse(&p));
    scene_destroy(&block.body);
}

static void long_run(tlsph_unknowns unknowns, tlsph_thermal thermal) {
    const outcome o = block_run(unknowns, thermal, 0.64, 200); /* 792 particles */
    REPORT("energy %.1e, angular %.1e, drift %.4f", o.energy, o.angular, o.drift);
    check_outcome(&o, thermal);
}

TEST(slow_set_pF_energy_to_200_s) { DOUBLE_ONLY(); long_run(TLSPH_PF, TLSPH_ENERGY); }
TEST(slow_set_pF_entropy_to_200_s) { DOUBLE_ONLY(); long_run(TLSPH_PF, TLSPH_ENTROPY); }
TEST(slow_set_pFJ_energy_to_200_s) { DOUBLE_ONLY(); long_run(TLSPH_PFJ, TLSPH_ENERGY); }
TEST(slow_set_pFJ_entropy_to_200_s) { DOUBLE_ONLY(); long_run(TLSPH_PFJ, TLSPH_ENTROPY); }
TEST(slow_set_pFHJ_energy_to_200_s) { DOUBLE_ONLY(); long_run(TLSPH_PFHJ, TLSPH_ENERGY); }
TEST(slow_set_pFHJ_entropy_to_200_s) { DOUBLE_ONLY(); long_run(TLSPH_PFHJ, TLSPH_ENTROPY); }
TEST(slow_set_pFH_energy_to_200_s) { DOUBLE_ONLY(); long_run(TLSPH_PFH, TLSPH_ENERGY); }

SUITE(physics_l_block, ENTRY(set_pF_energy), ENTRY(set_pF_entropy), ENTRY(set_pFJ_energy), ENTRY(set_pFJ_entropy),
      ENTRY(set_pFHJ_energy), ENTRY(set_pFHJ_entropy), ENTRY(set_pFH_energy), ENTRY(forces_cancel),
      ENTRY(slow_set_pF_energy_to_200_s), ENTRY(slow_set_pF_entropy_to_200_s), ENTRY(slow_set_pFJ_energy_to_200_s),
      ENTRY(slow_set_pFJ_entropy_to_200_s), ENTRY(slow_set_pFHJ_energy_to_200_s),
      ENTRY(slow_set_pFHJ_entropy_to_200_s), ENTRY(slow_set_pFH_energy_to_200_s))
