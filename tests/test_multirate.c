/* Steps of their own for stiff parts (desc.rates): balances, order, choice of levels, what is refused. */
#include "support.h"

/* A box of soft material with a stiff corner that spins, bends and stretches; conditions and options may be set before. */
typedef struct two_parts {
    tlsph_cloud cloud;
    tlsph_material materials[2];
    tlsph_condition conditions[2];
    uint32_t list[2][256];
    uint8_t *of;
    tlsph_desc desc;
    tlsph_solver *solver;
    tlsph_error error;
} two_parts;

static int parts_begin(two_parts *s, int dimension, double ratio)
{
    tlsph_fill fill = tlsph_fill_default(dimension);
    memset(s, 0, sizeof *s);
    for (int i = 0; i < dimension; i++) fill.size[i] = R(i == 1 ? 1.5 : 1);
    fill.spacing = R(0.125);
    if (!CHECK_RESULT(tlsph_cloud_create(&fill, &s->cloud, &s->error), TLSPH_OK)) return 0;
    s->of = calloc(s->cloud.particles.count, 1);
    for (size_t a = 0; a < s->cloud.particles.count; a++) {
        s->of[a] = 1;
        for (int i = 0; i < dimension; i++)
            if (s->cloud.particles.positions[3 * a + (size_t)i] > R(0.4)) s->of[a] = 0;
    }
    s->materials[0] = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    s->materials[0].density = 1000; s->materials[0].young = R(1e5); s->materials[0].poisson = R(0.3);
    s->materials[1] = s->materials[0];
    s->materials[1].young *= R(ratio * ratio);
    s->desc = tlsph_desc_default(dimension);
    s->desc.particles = s->cloud.particles;
    s->desc.particles.materials = s->of;
    s->desc.materials = s->materials; s->desc.material_count = 2;
    s->desc.conditions = s->conditions;
    s->desc.integrator = TLSPH_LEAPFROG;
    s->desc.rates = 8;
    s->desc.threads = 1;
    return 1;
}
static void parts_push(two_parts *s, tlsph_condition_kind kind, int axis, double where, double value)
{
    const size_t k = s->desc.condition_count++;
    s->conditions[k] = tlsph_condition_default(kind);
    s->conditions[k].particles = s->list[k];
    s->conditions[k].count = tlsph_select_plane(&s->cloud.particles, axis, R(where), R(1e-6), s->list[k], 256);
    s->conditions[k].normal[axis] = 1;
    s->conditions[k].value[0] = R(value);
    s->conditions[k].value[2] = R(kind == TLSPH_PRESSURE ? 0 : value / 2);
}
static int parts_create(two_parts *s)
{
    if (s->solver) tlsph_destroy(s->solver);
    if (CHECK_RESULT(tlsph_create(&s->desc, &s->solver, &s->error), TLSPH_OK)) return 1;
    printf("    %s\n", s->error.message);
    return 0;
}
static int parts_kick(two_parts *s, double speed)
{
    const size_t n = s->cloud.particles.count;
    tlsph_real *v = malloc(3 * n * sizeof *v);
    for (size_t a = 0; a < n; a++) {
        const tlsph_real *X = s->cloud.particles.positions + 3 * a;
        const double x = (double)X[0], y = (double)X[1], z = (double)X[2];
        v[3 * a] = R(speed * (0.4 - y + 0.5 * sin(2 * x) - 0.3 * z));
        v[3 * a + 1] = R(speed * (x + 0.4 * cos(2 * y)));
        v[3 * a + 2] = R(s->desc.dimension == 3 ? speed * (0.3 * x + 0.3 * sin(z + y)) : 0);
    }
    const int good = CHECK_RESULT(tlsph_write(s->solver, TLSPH_FIELD_VELOCITY, v), TLSPH_OK);
    free(v);
    return good;
}
static void parts_end(two_parts *s)
{
    tlsph_destroy(s->solver);
    tlsph_cloud_destroy(&s->cloud);
    free(s->of);
}
static int levels_of(const tlsph_solver *solver)
{
    tlsph_size size;
    tlsph_size_read(solver, &size);
    return size.rates;
}
static tlsph_result steps_of(tlsph_solver *solver, double dt, int count)
{
    tlsph_result result = TLSPH_OK;
    for (int i = 0; i < count && !result; i++) result = tlsph_step(solver, R(dt));
    return result;
}
static double length(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/* ---- balances ---------------------------------------------------------------------------------------------------- */

static void balance(int dimension, tlsph_unknowns unknowns, tlsph_material_kind kind, tlsph_condition_kind load)
{
    two_parts s;
    tlsph_ledger l;
    if (!parts_begin(&s, dimension, 7)) return;
    s.materials[0].kind = s.materials[1].kind = kind;
    s.desc.unknowns = unknowns;
    if (load != TLSPH_CLAMPED) parts_push(&s, load, 1, 0, 300);
    if (parts_create(&s) && parts_kick(&s, 1.5) && CHECK_RESULT(take_steps(s.solver, 40), TLSPH_OK)) {
        tlsph_ledger_read(s.solver, &l);
        REPORT(" %d-D, %d levels: linear %.0e, angular %.0e", dimension, levels_of(s.solver),
               length(l.linear_residual) / length(l.linear_momentum),
               length(l.angular_residual) / length(l.angular_momentum));
        CHECK(levels_of(s.solver) > 2);
        CHECK(load == TLSPH_CLAMPED || length(l.impulse) > 1e-3 * length(l.linear_momentum));
        CHECK_BELOW(length(l.linear_residual), ROUNDED(1e-13, 1000) * length(l.linear_momentum));
        CHECK_BELOW(length(l.angular_residual), ROUNDED(1e-13, 1000) * length(l.angular_momentum));
    }
    parts_end(&s);
}
TEST(momenta)
{
    balance(3, TLSPH_PF, TLSPH_NEO_HOOKEAN, TLSPH_CLAMPED);
    balance(3, TLSPH_PFJ, TLSPH_NEO_HOOKEAN, TLSPH_TRACTION);
    balance(3, TLSPH_PFHJ, TLSPH_MIE_GRUNEISEN, TLSPH_PRESSURE);
    balance(2, TLSPH_PFH, TLSPH_NEO_HOOKEAN, TLSPH_ACCELERATION);
    balance(2, TLSPH_PFJ, TLSPH_LINEAR, TLSPH_CLAMPED);
}

/* Displacements after 0.02 s by `count` steps; energy: its residual over the total. */
static tlsph_real *moved(two_parts *s, int rates, int count, double *energy)
{
    tlsph_ledger l;
    s->desc.rates = rates;
    if (!parts_create(s) || !parts_kick(s, 1.5)) return NULL;
    if (!CHECK_RESULT(steps_of(s->solver, 0.02 / count, count), TLSPH_OK)) return NULL;
    CHECK_CLOSE(tlsph_time(s->solver), 0.02, 1e-12);
    tlsph_ledger_read(s->solver, &l);
    *energy = fabs(l.energy_residual) / l.total_energy;
    return read_field(s->solver, TLSPH_FIELD_DISPLACEMENT);
}
static double difference(const tlsph_real *a, const tlsph_real *b, size_t count)
{
    double sum = 0, square = 0;
    for (size_t i = 0; a && b && i < count; i++) {
        sum += pow((double)(a[i] - b[i]), 2);
        square += pow((double)b[i], 2);
    }
    return sqrt(sum / square);
}
/* Against the plain leapfrog with a small step: both are the same semi-discrete body. Second order without dissipation, and
   in the energy balance (that of the loads' work included) in any case; with dissipation first. */
static void order(tlsph_unknowns unknowns, tlsph_dissipation dissipation, double expected, double of_energy)
{
    two_parts s;
    double error[3] = {0}, energy[3] = {0}, ignored;
    if (!parts_begin(&s, 3, 6)) return;
    s.desc.unknowns = unknowns;
    s.desc.dissipation = dissipation;
    parts_push(&s, TLSPH_TRACTION, 1, 0, 2000);
    parts_push(&s, TLSPH_ROLLER, 2, 0, 0);
    const size_t reals = 3 * s.cloud.particles.count;
    tlsph_real *exact = moved(&s, 1, 400, &ignored);
    for (int i = 0; i < 3; i++) {
        tlsph_real *u = moved(&s, 8, 12 << i, energy + i);
        error[i] = difference(u, exact, reals);
        free(u);
    }
    REPORT(" %.1e %.1e %.1e, energy %.1e %.1e %.1e", error[0], error[1], error[2], energy[0], energy[1], energy[2]);
    CHECK(levels_of(s.solver) > 2);
    CHECK_BELOW(error[0], 0.02);
    CHECK(log2(error[0] / error[2]) / 2 > expected);
    CHECK(log2(energy[0] / energy[2]) / 2 > of_energy);
    free(exact);
    parts_end(&s);
}
TEST(order_in_the_step)
{
    DOUBLE_ONLY();
    order(TLSPH_PF, TLSPH_NO_DISSIPATION, 1.8, 1.8);
    order(TLSPH_PFHJ, TLSPH_NO_DISSIPATION, 1.8, 1.8);
    order(TLSPH_PF, TLSPH_LIMITED, 0.8, 1.7);
    order(TLSPH_PFJ, TLSPH_LIMITED, 0.8, 0.8);
}

/* Noise at the CFL limit, some hundred steps: kinetic and strain energy go away, as they do with small steps. */
TEST(noise_dies)
{
    static const double ratio[3] = {2.5, 5.5, 8};
    for (int i = 0; i < 3; i++) {
        two_parts s;
        tlsph_ledger l;
        uint64_t seed = 7;
        double was;
        if (!parts_begin(&s, 3, ratio[i])) return;
        s.desc.cfl = tlsph_cfl_limit(TLSPH_LEAPFROG);
        const size_t reals = 3 * s.cloud.particles.count;
        tlsph_real *v = malloc(reals * sizeof *v);
        for (size_t k = 0; k < reals; k++) v[k] = R(random_between(&seed, -0.5, 0.5));
        if (parts_create(&s) && CHECK_RESULT(tlsph_write(s.solver, TLSPH_FIELD_VELOCITY, v), TLSPH_OK)) {
            tlsph_ledger_read(s.solver, &l);
            was = l.total_energy;
            CHECK_RESULT(take_steps(s.solver, 150), TLSPH_OK);
            tlsph_ledger_read(s.solver, &l);
            REPORT(" ratio %.1f: %.1e of the energy is left", ratio[i], l.total_energy / was);
            CHECK_BELOW(l.total_energy, 0.03 * was);
        }
        free(v);
        parts_end(&s);
    }
}

/* The same motion seen from a frame that flies by: at 1000 times the speed of the motion it differs by round-off. */
TEST(flying_by)
{
    tlsph_real *u[2] = {NULL, NULL}, *v;
    double lost[2] = {0, 0};
    two_parts s;
    DOUBLE_ONLY();
    if (!parts_begin(&s, 3, 7)) return;
    const size_t reals = 3 * s.cloud.particles.count;
    for (int i = 0; i < 2; i++) {
        tlsph_ledger l;
        if (!parts_create(&s) || !parts_kick(&s, 1.5)) break;
        v = read_field(s.solver, TLSPH_FIELD_VELOCITY);
        for (size_t k = 0; i && k < reals; k += 3) v[k] += 1000;
        CHECK_RESULT(tlsph_write(s.solver, TLSPH_FIELD_VELOCITY, v), TLSPH_OK);
        CHECK_RESULT(steps_of(s.solver, 0.001, 20), TLSPH_OK);
        u[i] = read_field(s.solver, TLSPH_FIELD_DISPLACEMENT);
        for (size_t k = 0; i && k < reals; k += 3) u[1][k] -= 1000 * tlsph_time(s.solver);
        tlsph_ledger_read(s.solver, &l);
        lost[i] = l.dissipation;
        free(v);
    }
    REPORT(" displacements %.0e, dissipation %.0e", difference(u[1], u[0], reals), lost[1] / lost[0] - 1);
    CHECK_BELOW(difference(u[1], u[0], reals), 1e-9);
    CHECK_CLOSE(lost[1] / lost[0], 1, 1e-6);
    free(u[0]);
    free(u[1]);
    parts_end(&s);
}

/* ---- levels ------------------------------------------------------------------------------------------------------ */

/* With one material there is nothing to gain: the plain leapfrog, bitwise. */
TEST(equal_steps)
{
    uint64_t hash[2] = {0, 1};
    two_parts s;
    if (!parts_begin(&s, 3, 1)) return;
    for (int i = 0; i < 2; i++) {
        s.desc.rates = i ? 8 : 1;
        if (!parts_create(&s) || !parts_kick(&s, 1.5)) break;
        CHECK_SAME(levels_of(s.solver), 1);
        CHECK_RESULT(take_steps(s.solver, 10), TLSPH_OK);
        hash[i] = state_hash(s.solver);
    }
    CHECK(hash[0] == hash[1]);
    parts_end(&s);
}
/* The whole step is 2^(levels - 1) times the plain one, and shrinks as that does when the stiff part is squeezed. */
TEST(whole_step)
{
    double step[2][2] = {{0}};
    int levels = 1;
    two_parts s;
    if (!parts_begin(&s, 3, 7)) return;
    const size_t n = s.cloud.particles.count;
    tlsph_real *F = calloc(9 * n, sizeof *F);
    for (size_t a = 0; a < n; a++)
        for (size_t i = 0; i < 3; i++) F[9 * a + 4 * i] = s.of[a] ? R(0.6) : 1;
    for (int i = 0; i < 2; i++) {
        s.desc.rates = i ? 8 : 1;
        if (!parts_create(&s)) break;
        levels = levels_of(s.solver);
        step[i][0] = (double)tlsph_stable_time_step(s.solver);
        CHECK_RESULT(tlsph_write(s.solver, TLSPH_FIELD_F, F), TLSPH_OK);
        step[i][1] = (double)tlsph_stable_time_step(s.solver);
    }
    REPORT(" %d levels, undeformed %.3g, squeezed %.3g", levels, step[1][0] / step[0][0], step[1][1] / step[0][1]);
    CHECK_CLOSE(step[1][0] / step[0][0], 1 << (levels - 1), 1e-4);
    CHECK_CLOSE(step[1][1] / step[0][1], 1 << (levels - 1), 1e-4);
    CHECK(step[0][1] < 0.95 * step[0][0]);
    free(F);
    parts_end(&s);
}

/* ---- determinism, failures, refusals ----------------------------------------------------------------------------- */

/* The host's tasks backwards, and counted. */
static void backwards(void *user, tlsph_task_fn task, void *arg, size_t count)
{
    ++*(size_t *)user;
    while (count--) task(arg, count);
}
TEST(threads_and_checkpoints)
{
    uint64_t hash[3] = {0};
    size_t calls = 0, size = 0;
    unsigned char *saved = NULL;
    two_parts s;
    if (!parts_begin(&s, 3, 7)) return;
    s.desc.unknowns = TLSPH_PFJ;
    parts_push(&s, TLSPH_TRACTION, 1, 0, 300);
    for (int i = 0; i < 3; i++) {
        s.desc.run = i == 1 ? backwards : NULL;
        s.desc.run_user = &calls;
        if (!parts_create(&s) || (i < 2 && !parts_kick(&s, 1.5))) break;
        if (i < 2) CHECK_RESULT(take_steps(s.solver, 5), TLSPH_OK);
        if (i == 0) saved = save_state(s.solver, &size);
        if (i == 2) CHECK_RESULT(tlsph_restore(s.solver, saved, size), TLSPH_OK);
        CHECK_RESULT(take_steps(s.solver, 5), TLSPH_OK);
        hash[i] = state_hash(s.solver);
    }
    CHECK(calls > 0 && hash[0] != 0);
    CHECK(hash[0] == hash[1]);
    CHECK(hash[0] == hash[2]);
    free(saved);
    parts_end(&s);
}
/* A step that turns particles inside out leaves the state before it; with retries it is taken in smaller ones. */
TEST(failures)
{
    uint64_t before;
    tlsph_ledger l;
    two_parts s;
    if (!parts_begin(&s, 3, 7)) return;
    parts_push(&s, TLSPH_FORCE, 1, 0, 1e5);
    for (int retries = 0; retries < 12; retries += 11) {
        s.desc.retries = retries;
        if (!parts_create(&s) || !parts_kick(&s, 1.5)) break;
        before = state_hash(s.solver);
        const tlsph_result result = tlsph_step(s.solver, R(1e30));
        tlsph_ledger_read(s.solver, &l);
        REPORT(" of %d retries: %d", retries, (int)l.retries);
        if (retries) {
            CHECK_RESULT(result, TLSPH_OK);
            CHECK(l.retries > 0);
            continue;
        }
        CHECK_RESULT(result, TLSPH_ERROR_INVERSION);
        CHECK(tlsph_last_error(s.solver)->particle < s.cloud.particles.count);
        CHECK(strlen(tlsph_last_error(s.solver)->cause) > 0);
        CHECK(state_hash(s.solver) == before);
    }
    parts_end(&s);
}
static void refuse(two_parts *s, const char *says)
{
    tlsph_solver *none = NULL;
    CHECK_RESULT(tlsph_create(&s->desc, &none, &s->error), TLSPH_ERROR_DESCRIPTION);
    CHECK(none == NULL);
    CHECK(strcmp(s->error.field, "rates") == 0);
    if (!CHECK(strstr(s->error.message, says) != NULL)) printf("    %s\n", s->error.message);
}
TEST(refusals)
{
    two_parts s;
    if (!parts_begin(&s, 3, 7)) return;
    const tlsph_desc good = s.desc;
#define REFUSED(change, says) do { s.desc = good; change; refuse(&s, says); } while (0)
    REFUSED(s.desc.rates = 0, "to 8 with");
    REFUSED(s.desc.rates = 9, "to 8 with");
    REFUSED(s.desc.integrator = TLSPH_RK2, "LEAPFROG");
    REFUSED(s.desc.thermal = TLSPH_ENERGY, "evolved");
    REFUSED(s.desc.thermal = TLSPH_ENTROPY, "evolved");
    REFUSED(s.desc.sharp_gradients = 1, "sharp");
    REFUSED(s.desc.operator_kind = TLSPH_CELLS_4, "CELLS_4");
    REFUSED(s.desc.operator_kind = TLSPH_ZEROTH_BOND, "BONDS");
    REFUSED(s.desc.dissipation = TLSPH_JST, "JST");
    REFUSED(s.desc.audit = 1, "audit");
    REFUSED(s.desc.step_rule = TLSPH_STEP_BY_PAIR, "step_rule");
    REFUSED(s.desc.drift_relaxation = 1, "relaxation");
    REFUSED(s.materials[1].kind = TLSPH_VON_MISES, "VON_MISES");
    s.materials[1].kind = TLSPH_NEO_HOOKEAN;
    REFUSED(parts_push(&s, TLSPH_VELOCITY, 1, 0, 1), "VELOCITY");
    REFUSED(parts_push(&s, TLSPH_WALL, 1, 0, 1), "WALL");
    s.desc = good;
    CHECK(parts_create(&s));
    parts_end(&s);
}

SUITE(multirate, ENTRY(momenta), ENTRY(order_in_the_step), ENTRY(noise_dies), ENTRY(flying_by), ENTRY(equal_steps),
      ENTRY(whole_step), ENTRY(threads_and_checkpoints), ENTRY(failures), ENTRY(refusals))
