/* Twisting column (001 section 7.3.1): survival, energy, axis, independence of the resolution. */
#include "physics.h"

typedef struct outcome {
    twisting_column_shape shape;
    double energy_ratio, gains, least_J, offset, drift, oscillation, alternation;
    tlsph_result result;
} outcome;

static outcome twist(const twisting_column_parameters *p) {
    twisting_column column;
    tlsph_ledger ledger;
    outcome out;
    double start, before;
    memset(&out, 0, sizeof out);
    out.result = twisting_column_create(p, &column, NULL);
    if (out.result != TLSPH_OK) return out;
    tlsph_ledger_read(column.body.solver, &ledger);
    start = before = ledger.total_energy;
    out.least_J = 1;
    while (out.result == TLSPH_OK && (double)tlsph_time(column.body.solver) < p->options.end_time) {
        out.result = tlsph_step(column.body.solver, R(p->options.end_time) - tlsph_time(column.body.solver));
        tlsph_ledger_read(column.body.solver, &ledger);
        twisting_column_read(&column, &out.shape);
        out.gains += fmax(0, ledger.total_energy - before) / start;
        before = ledger.total_energy;
        out.least_J = fmin(out.least_J, ledger.jacobian_least);
        out.drift = fmax(out.drift, ledger.drift_largest);
        out.offset = fmax(out.offset, hypot(out.shape.axis[0], out.shape.axis[1]));
    }
    out.energy_ratio = before / start;
    out.oscillation = scene_oscillation(column.body.solver, TLSPH_FIELD_PRESSURE);
    out.alternation = scene_alternation(&column.body, 1);
    scene_destroy(&column.body);
    return out;
}

static twisting_column_parameters column_of(int n, double nu, double omega, double end_time, int unknowns) {
    twisting_column_parameters p;
    twisting_column_default(&p);
    p.n = n;
    p.nu = nu;
    p.omega = omega;
    p.options.end_time = end_time;
    p.options.unknowns = unknowns;
    p.options.threads = 1;
    return p;
}

static void check_sound(const outcome *o, double least_J) {
    CHECK_RESULT(o->result, TLSPH_OK);
    CHECK(o->least_J > least_J);
    CHECK_BELOW(o->gains, 1e-4);
    CHECK_BELOW(o->offset, 1e-9);
    REPORT("turns %.3f, height %.3f m, energy %.3f, least J %.3f, drift %.3f, oscillation %.3f", o->shape.tip_twist / 6.2831853,
           o->shape.tip_height, o->energy_ratio, o->least_J, o->drift, o->oscillation);
}

TEST(column_keeps_its_axis_and_only_loses_energy) {
    const twisting_column_parameters p = column_of(3, 0.495, 105, 0.03, TLSPH_PFJ);
    outcome o;
    DOUBLE_ONLY();
    o = twist(&p);
    check_sound(&o, 0.9);
    CHECK_CLOSE(o.shape.tip_twist, 2.85, 0.06); /* 2.840 at n = 5, 2.849 at n = 7 */
}

TEST(slow_column_turns_alike_at_three_resolutions) {
    double turns[3];
    DOUBLE_ONLY();
    for (int i = 0; i < 3; i++) {
        const twisting_column_parameters p = column_of(3 + i, 0.495, 105, 0.1, TLSPH_PFHJ);
        const outcome o = twist(&p);
        check_sound(&o, 0.8);
        turns[i] = o.shape.tip_twist;
    }
    CHECK_CLOSE(turns[1] / turns[0], 1, 0.1);
    CHECK_CLOSE(turns[2] / turns[1], 1, 0.05);
}

TEST(slow_column_survives_400_radians_per_second) {
    const twisting_column_parameters p = column_of(4, 0.45, 400, 0.2, TLSPH_PF);
    outcome o;
    DOUBLE_ONLY();
    o = twist(&p);
    check_sound(&o, 0.2);
}

/* A field of positions that alternates along one axis by a tenth of a spacing on top of a smooth bend. */
TEST(alternation_measures_what_alternates) {
    twisting_column_parameters p = column_of(2, 0.45, 0, 1, TLSPH_PF);
    twisting_column column;
    REQUIRE_OK(twisting_column_create(&p, &column, NULL));
    const size_t count = tlsph_count(column.body.solver);
    tlsph_real *x = scene_read(column.body.solver, TLSPH_FIELD_POSITION);
    for (size_t a = 0; a < count; a++) {
        const tlsph_real Y = column.body.cloud.particles.positions[3 * a + 1];
        x[3 * a] += R(0.01) * Y * Y + R(0.05) * (lround((double)Y / 0.5) % 2 ? R(1) : -R(1)); /* spacing 0.5 m */
    }
    CHECK_RESULT(tlsph_write(column.body.solver, TLSPH_FIELD_POSITION, x), TLSPH_OK);
    CHECK_CLOSE(scene_alternation(&column.body, 1), 0.1, 1e-5);
    free(x);
    scene_destroy(&column.body);
}

/* Thrown fast, a clamped column keeps its layers in line without the rotating frame of the projection. */
TEST(slow_wide_column_is_smooth) {
    twisting_column_parameters p = column_of(5, 0.49, 300, 0.0921, TLSPH_PF);
    outcome o;
    double smooth;
    DOUBLE_ONLY();
    o = twist(&p);
    CHECK_RESULT(o.result, TLSPH_OK);
    p.options.kernel = TLSPH_CUBIC_SPLINE;
    p.options.support = 0.9;
    p.options.projection = 0;
    smooth = twist(&p).alternation;
    REPORT("alternation %.4f by default, %.4f wide", o.alternation, smooth);
    CHECK_BELOW(smooth, o.alternation / 2);
    CHECK_BELOW(smooth, 0.04);
}

SUITE(physics_twist, ENTRY(column_keeps_its_axis_and_only_loses_energy), ENTRY(slow_column_turns_alike_at_three_resolutions),
      ENTRY(slow_column_survives_400_radians_per_second),
      ENTRY(alternation_measures_what_alternates),
      ENTRY(slow_wide_column_is_smooth))
