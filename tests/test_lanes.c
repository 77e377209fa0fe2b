/* The loops over lanes and the plain loops, pair by pair, are the same method: `audit` takes the plain ones. They differ
   by round-off only, in every combination of dimension, unknowns, thermal form, material, lattice or cloud, for tiles that
   a body fills in part, with fronts and without. */
#include "support.h"

/* After three steps, relative to the largest value. Temperatures come from E, whose last digit is far more in these small
   stresses: as float nothing could be compared. */
static double tolerance(void) { return sizeof(tlsph_real) == 4 ? 2e-3 : BOUNDED(2e-11); }

static const tlsph_field compared[] = { TLSPH_FIELD_VELOCITY, TLSPH_FIELD_F, TLSPH_FIELD_H, TLSPH_FIELD_J,
                                        TLSPH_FIELD_TEMPERATURE, TLSPH_FIELD_STRESS };

static double most_of(const tlsph_real *x, size_t n)
{
    double most = 0;
    for (size_t i = 0; i < n; i++) most = fmax(most, fabs((double)x[i]));
    return most;
}

/* Largest difference of a field over its largest value. */
static double difference(const tlsph_solver *a, const tlsph_solver *b, tlsph_field field)
{
    const size_t n = tlsph_count(a) * (size_t)tlsph_field_components(field);
    tlsph_real *x = read_field(a, field), *y = read_field(b, field);
    double most = 0;
    const double size = x ? most_of(x, n) : 0;
    if (!CHECK(!x == !y) || !x) return 0;
    for (size_t i = 0; i < n; i++) x[i] -= y[i];
    most = most_of(x, n);
    free(x);
    free(y);
    return size > 0 ? most / size : most;
}

/* Of two sums. */
static double apart(double a, double b) { return a == b ? 0 : fabs(a - b) / fmax(fabs(a), fabs(b)); }

static double compare_states(tlsph_solver *const solver[2])
{
    tlsph_ledger ledger[2];
    double worst;
    for (int i = 0; i < 2; i++) tlsph_ledger_read(solver[i], ledger + i);
    worst = fmax(apart(ledger[0].dissipation, ledger[1].dissipation),
                 apart(ledger[0].dissipation_entropy, ledger[1].dissipation_entropy));
    for (size_t f = 0; f < sizeof compared / sizeof *compared; f++)
        worst = fmax(worst, difference(solver[0], solver[1], compared[f]));
    return worst;
}
static double compare(moving_block s, double speed, int steps)
{
    tlsph_solver *solver[2] = { NULL, NULL };
    for (int i = 0; i < 2; i++) {
        s.audit = i;
        if (!CHECK_RESULT(moving_block_create(&s, solver + i, NULL), TLSPH_OK)) return 0;
        CHECK_RESULT(moving_block_kick(solver[i], speed), TLSPH_OK);
        CHECK_RESULT(take_steps(solver[i], steps), TLSPH_OK);
    }
    const double worst = compare_states(solver);
    for (int i = 0; i < 2; i++) tlsph_destroy(solver[i]);
    return worst;
}

static moving_block body(int dimension, double jitter)
{
    moving_block s = moving_block_default();
    s.dimension = dimension;
    s.cells = dimension == 3 ? 5 : 13; /* rows of 6 and 14 particles: tiles lie across their ends */
    s.jitter = jitter;
    return s;
}

/* In all unknowns, thermal forms and materials. */
static void compare_all(moving_block s, double speed)
{
    static const tlsph_material_kind materials[] = { TLSPH_NEO_HOOKEAN, TLSPH_MEE, TLSPH_MIE_GRUNEISEN };
    double worst = 0;
    for (int u = 0; u < 4; u++)
        for (int t = 0; t < (sizeof(tlsph_real) == 4 ? 1 : 3); t++)
            for (int m = 0; m < 3; m++) {
                s.unknowns = (tlsph_unknowns)u;
                s.thermal = (tlsph_thermal)t;
                s.material = materials[m];
                const double one = compare(s, speed, 3);
                if (!CHECK(one < tolerance())) printf("    unknowns %d, thermal %d, material %d: %.1e\n", u, t, m, one);
                worst = fmax(worst, one);
            }
    REPORT(" %.1e", worst);
}

TEST(lattices)
{
    moving_block flat = body(2, 0);
    flat.mooney = 0.25;
    compare_all(body(3, 0), 0.5);
    compare_all(flat, 0.5);
}
TEST(clouds)
{
    compare_all(body(3, 0.2), 0.5);
    compare_all(body(2, 0.2), 0.5);
}
TEST(mirrors)
{
    moving_block s = body(3, 0), flat = body(2, 0.2);
    s.slides = flat.slides = 1;
    compare_all(s, 0.5);
    compare_all(flat, 0.5);
}
TEST(fronts) /* faster than TLSPH_FRONT_LOW of the p speed between neighbours */
{
    moving_block s = body(3, 0);
    s.mooney = 0.25;
    compare_all(s, 20);
}
/* A tile looks for fronts where it had one last time. A solver that knows of none, as after a checkpoint, takes them the
   other way, and gets the same bits. */
TEST(fronts_that_were_not_known)
{
    moving_block s = body(3, 0);
    tlsph_solver *one = NULL;
    s.unknowns = TLSPH_PFHJ;
    REQUIRE_OK(moving_block_create(&s, &one, NULL));
    CHECK_RESULT(moving_block_kick(one, 20), TLSPH_OK);
    for (int step = 0; step < 10; step++) {
        tlsph_solver *other = NULL;
        size_t size = 0;
        unsigned char *saved = save_state(one, &size);
        REQUIRE_OK(moving_block_create(&s, &other, NULL));
        CHECK_RESULT(tlsph_restore(other, saved, size), TLSPH_OK);
        CHECK_RESULT(take_steps(one, 1), TLSPH_OK);
        CHECK_RESULT(take_steps(other, 1), TLSPH_OK);
        CHECK(state_hash(one) == state_hash(other));
        free(saved);
        tlsph_destroy(other);
    }
    tlsph_destroy(one);
}
TEST(leapfrog)
{
    moving_block s = body(3, 0);
    s.integrator = TLSPH_LEAPFROG;
    compare_all(s, 0.5);
}
TEST(frozen_dissipation)
{
    moving_block s = body(3, 0), flat = body(2, 0.2);
    s.integrator = flat.integrator = TLSPH_RK3_FROZEN;
    compare_all(s, 0.5);
    compare_all(flat, 0.5);
}
TEST(sharp_gradients)
{
    for (int i = 0; i < 4; i++) {
        moving_block s = body(2 + i % 2, 0);
        s.sharp = 1;
        s.slides = i < 2;
        if (i > 1) s.integrator = TLSPH_LEAPFROG;
        compare_all(s, 0.5);
    }
}
/* Pairs in all directions, whose vectors are antisymmetric. */
TEST(sharp_gradients_of_clouds)
{
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_material material = soft_material(TLSPH_NEO_HOOKEAN);
    tlsph_solver *solver[2] = { NULL, NULL };
    tlsph_cloud cloud;
    for (int i = 0; i < 3; i++) fill.size[i] = 1;
    fill.spacing = R(0.2);
    fill.placement = TLSPH_SCATTERED;
    fill.jitter = R(0.1);
    REQUIRE_OK(tlsph_cloud_create(&fill, &cloud, NULL));
    for (int i = 0; i < 2; i++) {
        tlsph_desc desc = tlsph_desc_default(3);
        desc.particles = cloud.particles;
        desc.materials = &material;
        desc.material_count = 1;
        desc.unknowns = TLSPH_PFHJ;
        desc.sharp_gradients = 1;
        desc.threads = 1;
        desc.audit = i;
        closed_operator(&desc);
        if (!CHECK_RESULT(tlsph_create(&desc, solver + i, NULL), TLSPH_OK)) break;
        CHECK_RESULT(moving_block_kick(solver[i], 0.5), TLSPH_OK);
        CHECK_RESULT(take_steps(solver[i], 3), TLSPH_OK);
    }
    if (solver[1]) {
        const double worst = compare_states(solver);
        CHECK(worst < tolerance());
        REPORT(" %.1e", worst);
    }
    for (int i = 0; i < 2; i++) tlsph_destroy(solver[i]);
    tlsph_cloud_destroy(&cloud);
}
/* J follows det F: both change by the sharp gradient, and only the steps are finite. */
TEST(sharp_gradients_of_J)
{
    double drift[2] = { 0, 0 };
    for (int i = 0; i < 2; i++) {
        moving_block s = body(3, 0);
        tlsph_solver *solver;
        s.sharp = 1;
        s.unknowns = TLSPH_PFJ;
        s.thermal = TLSPH_ISOTHERMAL;
        s.dissipation = TLSPH_NO_DISSIPATION;
        REQUIRE_OK(moving_block_create(&s, &solver, NULL));
        CHECK_RESULT(moving_block_kick(solver, 0.5), TLSPH_OK);
        const tlsph_real dt = tlsph_stable_time_step(solver) / R(1 << i) / 2;
        for (int k = 0; k < 4 << i; k++) CHECK_RESULT(tlsph_step(solver, dt), TLSPH_OK);
        tlsph_real *J = read_field(solver, TLSPH_FIELD_J), *F = read_field(solver, TLSPH_FIELD_F);
        for (size_t a = 0; a < tlsph_count(solver); a++)
            drift[i] = fmax(drift[i], fabs((double)(J[a] - tlsph_determinant(F + 9 * a))));
        free(J);
        free(F);
        tlsph_destroy(solver);
    }
    REPORT(" %.1e, half the step: %.1e", drift[0], drift[1]);
    CHECK_BELOW(drift[1], fmax(0.3 * drift[0], 20 * EPSILON));
}
/* Operators whose C_ab are no M_a times an antisymmetric vector, with both forms of the force. */
TEST(bonds)
{
    static const tlsph_operator_kind kinds[] = { TLSPH_ZEROTH_KERNEL, TLSPH_FIRST_KERNEL, TLSPH_ZEROTH_BOND, TLSPH_BOND };
    for (int i = 0; i < 8; i++) {
        moving_block s = body(2 + i % 2, i % 3 ? 0.1 : 0.001); /* support 0.9 either way */
        s.kind = kinds[i / 2];
        s.insulated = 1; /* with conduction both go pair by pair */
        s.force_form = i == 5 ? TLSPH_FORCE_AS_PRINTED : TLSPH_ADJOINT;
        s.integrator = i == 6 ? TLSPH_LEAPFROG : i == 7 ? TLSPH_RK3_FROZEN : TLSPH_RK2;
        compare_all(s, 0.5);
    }
}

/* Von Mises, whose dissipation takes other speeds. */
TEST(metals)
{
    double worst = 0;
    for (int i = 0; i < 12; i++) {
        moving_block s = body(2 + i % 2, i < 6 ? 0 : 0.1);
        s.material = TLSPH_VON_MISES;
        s.unknowns = i % 4 < 2 ? TLSPH_PF : TLSPH_PFHJ;
        s.thermal = sizeof(tlsph_real) == 4 ? TLSPH_ISOTHERMAL : (tlsph_thermal)(i % 3);
        const double one = compare(s, 0.5, 3);
        if (!CHECK(one < tolerance())) printf("    case %d: %.1e\n", i, one);
        worst = fmax(worst, one);
    }
    REPORT(" %.1e", worst);
}

/* Harmonic and biharmonic, on lattices, clouds and bonds. */
TEST(jst)
{
    for (int i = 0; i < 6; i++) {
        moving_block s = body(2 + i % 2, i < 2 ? 0 : 0.1);
        s.dissipation = TLSPH_JST;
        s.kind = i < 4 ? (tlsph_operator_kind)0 : TLSPH_FIRST_KERNEL;
        s.insulated = i >= 4;
        s.integrator = i == 3 ? TLSPH_LEAPFROG : TLSPH_RK2;
        compare_all(s, 0.5);
    }
}

TEST(other_dissipations)
{
    static const tlsph_dissipation kinds[] = { TLSPH_RECONSTRUCTED, TLSPH_FIRST_ORDER, TLSPH_NO_DISSIPATION,
                                               TLSPH_SELF_ADJOINT, TLSPH_SELF_ADJOINT };
    for (int i = 0; i < 5; i++) {
        moving_block s = body(2 + i % 2, 0);
        s.dissipation = kinds[i];
        compare_all(s, 0.5);
    }
}
/* The entropy of a temperature is a logarithm of libm, the temperature of an entropy our own exponential. */
TEST(temperature_of_entropy)
{
    moving_block s = body(3, 0);
    tlsph_solver *solver;
    double worst = 0;
    s.thermal = TLSPH_ENTROPY;
    s.unknowns = TLSPH_PF;
    if (!CHECK_RESULT(moving_block_create(&s, &solver, NULL), TLSPH_OK)) return;
    const size_t n = tlsph_count(solver);
    tlsph_real *given = read_field(solver, TLSPH_FIELD_TEMPERATURE), *read = NULL;
    for (size_t a = 0; a < n; a++) given[a] = R(300 * exp(12.0 * (double)a / (double)n - 6)); /* 0.7 K to 120,000 K */
    if (CHECK_RESULT(tlsph_write(solver, TLSPH_FIELD_TEMPERATURE, given), TLSPH_OK))
        read = read_field(solver, TLSPH_FIELD_TEMPERATURE);
    for (size_t a = 0; read && a < n; a++) worst = fmax(worst, fabs((double)(read[a] / given[a]) - 1));
    CHECK(read && worst < 40 * (sizeof(tlsph_real) == 4 ? 1.2e-7 : 2.3e-16)); /* entropies of some 6 c_v round by 6 eps */
    REPORT(" %.1e", worst);
    free(given);
    free(read);
    tlsph_destroy(solver);
}
/* Temperatures of the round-off of E: where lanes find them positive, the fields, which are read one by one, exist. */
static int almost_no_heat(tlsph_solver *solver)
{
    const size_t n = tlsph_count(solver);
    tlsph_real *theta = read_field(solver, TLSPH_FIELD_TEMPERATURE);
    tlsph_ledger ledger;
    int taken = 0;
    for (int i = 1; theta && i <= 500; i++) {
        for (size_t a = 0; a < n; a++) theta[a] = 300;
        theta[(size_t)i % n] *= R((sizeof(tlsph_real) == 4 ? 1.2e-7 : 2.3e-16) * i / 125);
        if (tlsph_write(solver, TLSPH_FIELD_TEMPERATURE, theta)) continue;
        taken++;
        tlsph_ledger_read(solver, &ledger);
        if (!CHECK(state_finite(solver) && isfinite(ledger.entropy) && ledger.temperature_least > 0)) break;
    }
    free(theta);
    return taken;
}
TEST(temperatures_of_round_off)
{
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_cloud cloud;
    for (int i = 0; i < 3; i++) fill.size[i] = 1;
    fill.spacing = R(0.5);
    if (!CHECK_RESULT(tlsph_cloud_create(&fill, &cloud, NULL), TLSPH_OK)) return;
    for (int i = 0; i < 4; i++) {
        tlsph_desc desc = tlsph_desc_default(3);
        tlsph_material material = tlsph_material_default(TLSPH_NEO_HOOKEAN);
        tlsph_solver *solver;
        material.density = 1100;
        material.young = R(17e6);
        material.poisson = R(0.3);
        material.specific_heat = R(38.3 + 37.3 * i);
        desc.particles = cloud.particles;
        desc.materials = &material;
        desc.material_count = 1;
        desc.unknowns = TLSPH_PF;
        desc.thermal = TLSPH_ENERGY;
        if (!CHECK_RESULT(tlsph_create(&desc, &solver, NULL), TLSPH_OK)) break;
        CHECK(almost_no_heat(solver) > 100);
        tlsph_destroy(solver);
    }
    tlsph_cloud_destroy(&cloud);
}

SUITE(lanes, ENTRY(lattices), ENTRY(clouds), ENTRY(mirrors), ENTRY(fronts), ENTRY(fronts_that_were_not_known),
      ENTRY(leapfrog), ENTRY(frozen_dissipation), ENTRY(sharp_gradients),
      ENTRY(sharp_gradients_of_clouds), ENTRY(sharp_gradients_of_J), ENTRY(bonds), ENTRY(metals),
      ENTRY(jst), ENTRY(other_dissipations),
      ENTRY(temperature_of_entropy), ENTRY(temperatures_of_round_off))
