/* Features of the header that the scenes do not use: user materials, several materials, given pair vectors, and every
   choice that a description offers. */
#include "support.h"

/* ---- a small body ---- */

/* A box of cells of 1/4 m; the test alters desc and materials before `start`. Must stay where it is: desc points into it. */
typedef struct body {
    own_cloud cloud;
    tlsph_material materials[2];
    tlsph_desc desc;
    tlsph_solver *solver;
    double kinetic; /* J, right after the start */
} body;

static int body_make(body *b, int dimension, int nx, int ny, int nz)
{
    int cells[3];
    cells[0] = nx;
    cells[1] = ny;
    cells[2] = nz;
    memset(b, 0, sizeof *b);
    if (!CHECK(own_box(&b->cloud, dimension, cells, 0.25, 0))) return 0;
    b->materials[0] = b->materials[1] = soft_material(TLSPH_NEO_HOOKEAN);
    b->desc = tlsph_desc_default(dimension);
    b->desc.particles = b->cloud.particles;
    b->desc.materials = b->materials;
    b->desc.material_count = 1;
    b->desc.threads = 1;
    return 1;
}

static void body_destroy(body *b)
{
    tlsph_destroy(b->solver);
    own_cloud_destroy(&b->cloud);
}

/* Writes a smooth velocity with spin and no mean, a finite stretch that varies, and a warm side. */
static tlsph_result write_state(body *b, double speed, double stretch)
{
    size_t a, n = b->cloud.particles.count;
    tlsph_real *v = calloc(3 * n, sizeof *v), *F = calloc(9 * n, sizeof *F), *theta = calloc(n, sizeof *theta);
    tlsph_result result = TLSPH_OK;
    for (a = 0; a < n; a++) {
        const tlsph_real *X = b->cloud.positions + 3 * a;
        double x = (double)X[0], y = (double)X[1], z = b->desc.dimension == 3 ? (double)X[2] : 0;
        v[3 * a] = R(speed * (0.5 * sin(3 * x) - 0.4 * y));
        v[3 * a + 1] = R(speed * (0.6 * cos(2 * y + z) + 0.3 * x));
        v[3 * a + 2] = b->desc.dimension == 3 ? R(speed * 0.5 * sin(2 * x + z)) : 0;
        F[9 * a] = R(1 + stretch * (1 + 0.2 * sin(2 * y)));
        F[9 * a + 1] = R(0.5 * stretch);
        F[9 * a + 4] = R(1 - 0.5 * stretch);
        F[9 * a + 8] = 1;
        theta[a] = R(293.15 + 10 * sin(1.5 * x + y));
    }
    if (stretch > 0) result = tlsph_write(b->solver, TLSPH_FIELD_F, F);
    if (!result) result = tlsph_write(b->solver, TLSPH_FIELD_VELOCITY, v);
    if (!result && b->desc.thermal != TLSPH_ISOTHERMAL) result = tlsph_write(b->solver, TLSPH_FIELD_TEMPERATURE, theta);
    free(v);
    free(F);
    free(theta);
    return result;
}

/* Creates the solver and gives it the state; the ledger counts from there. */
static int body_start(body *b, double speed, double stretch)
{
    tlsph_error error;
    tlsph_ledger l;
    if (!CHECK_RESULT(tlsph_create(&b->desc, &b->solver, &error), TLSPH_OK)) { printf("    %s\n", error.message); return 0; }
    if (!CHECK_RESULT(write_state(b, speed, stretch), TLSPH_OK)) return 0;
    tlsph_ledger_reset(b->solver);
    tlsph_ledger_read(b->solver, &l);
    b->kinetic = l.kinetic_energy;
    return 1;
}

static tlsph_result steps_of(tlsph_solver *solver, double dt, int count)
{
    tlsph_result result = TLSPH_OK;
    while (count-- > 0 && !result) result = tlsph_step(solver, R(dt));
    return result;
}

/* Largest difference of a field between two solvers over its largest value. */
static double difference(const body *one, const body *other, tlsph_field field)
{
    size_t i, count = tlsph_count(one->solver) * (size_t)tlsph_field_components(field);
    tlsph_real *f = read_field(one->solver, field), *g = read_field(other->solver, field);
    double size = f ? largest(f, count) : 0, worst = f && g ? 0 : HUGE_VAL;
    for (i = 0; f && g && i < count; i++) {
        double off = fabs((double)f[i] - (double)g[i]);
        if (!(off <= worst)) worst = off; /* a NaN comes through */
    }
    free(f);
    free(g);
    return worst / (size > 0 ? size : 1);
}

static void check_same_state(const body *one, const body *other, double tolerance)
{
    CHECK_BELOW(difference(one, other, TLSPH_FIELD_POSITION), tolerance);
    CHECK_BELOW(difference(one, other, TLSPH_FIELD_VELOCITY), tolerance);
    CHECK_BELOW(difference(one, other, TLSPH_FIELD_F), tolerance);
    CHECK_BELOW(difference(one, other, TLSPH_FIELD_J), tolerance);
    CHECK_BELOW(difference(one, other, TLSPH_FIELD_TEMPERATURE), tolerance);
    CHECK_BELOW(difference(one, other, TLSPH_FIELD_STRESS), tolerance);
    CHECK_BELOW(difference(one, other, TLSPH_FIELD_P_WAVE_SPEED), tolerance);
}

/* Largest component of what linear momentum has changed, over mass x velocity. */
static double momentum_lost(const body *b)
{
    tlsph_ledger l;
    tlsph_ledger_read(b->solver, &l);
    return fmax(fabs(l.linear_residual[0]), fmax(fabs(l.linear_residual[1]), fabs(l.linear_residual[2]))) /
           sqrt(2 * l.mass * b->kinetic);
}

/* ---- user materials ---- */

/* The built-in laws once more, by hand; `all_in_F` puts the volumetric part into e_F, eta_F as well (J is det F then). */
typedef struct twin {
    tlsph_material model;
    int all_in_F;
    size_t largest_batch, wrong, seen_count;
    const tlsph_real *expected; /* F[0] of each host particle at the next evaluation, or NULL */
    uint8_t *seen;              /* only the first evaluation of each */
} twin;

static void twin_watch(twin *t, size_t count, const uint32_t *particle, const tlsph_real *F)
{
    size_t i;
    if (count > t->largest_batch) t->largest_batch = count;
    for (i = 0; t->expected && i < count; i++) {
        if (t->seen[particle[i]]) continue;
        t->seen[particle[i]] = 1;
        t->seen_count++;
        t->wrong += !(F[9 * i] == t->expected[particle[i]]);
    }
}

/* The wave speeds are bounds and no physics, so they may be asked of the library: rho c^2 at two temperatures. */
static void twin_moduli(const twin *t, const tlsph_real *F, tlsph_response *out)
{
    const tlsph_real low = t->model.reference_temperature, rho = t->model.density;
    tlsph_material_state cold, hot;
    memset(&cold, 0, sizeof cold);
    memset(&hot, 0, sizeof hot);
    tlsph_material_evaluate(&t->model, F, low, &cold);
    tlsph_material_evaluate(&t->model, F, 2 * low, &hot);
    out->p_modulus[1] = rho * (hot.c_p * hot.c_p - cold.c_p * cold.c_p) / low;
    out->p_modulus[0] = rho * cold.c_p * cold.c_p - low * out->p_modulus[1];
    out->s_modulus[0] = rho * cold.c_s * cold.c_s;
    out->s_modulus[1] = 0;
}

/* psi = mu/2 (d^-2/3 F:F - 3) with d = det F, u = kappa/2 (J-1)^2, eta_R = beta (J-1), e_R = psi + u + beta theta_R (J-1). */
static void twin_one(const twin *t, const tlsph_real *F, tlsph_real J, tlsph_response *out)
{
    const tlsph_material *m = &t->model;
    const double mu = (double)m->young / (2 * (1 + (double)m->poisson));
    const double kappa = (double)m->young / (3 * (1 - 2 * (double)m->poisson)), theta_R = (double)m->reference_temperature;
    const double beta = m->kind == TLSPH_MIE_GRUNEISEN ? 3 * kappa * (double)m->expansion : 0;
    const double d = (double)tlsph_determinant(F), j = (double)J - 1, slope = kappa * j + beta * theta_R;
    const double a = mu * pow(d, -2.0 / 3);
    tlsph_real H[9];
    double I1 = 0;
    int i;
    tlsph_cofactor(F, H);
    for (i = 0; i < 9; i++) I1 += (double)F[i] * (double)F[i];
    out->energy = R(a * I1 / 2 - 1.5 * mu + kappa / 2 * j * j + beta * theta_R * j);
    out->entropy = R(beta * j);
    for (i = 0; i < 9; i++) {
        out->e_F[i] = R(a * ((double)F[i] - I1 / (3 * d) * (double)H[i]) + (t->all_in_F ? slope * (double)H[i] : 0));
        out->eta_F[i] = R(t->all_in_F ? beta * (double)H[i] : 0);
    }
    out->e_J = R(t->all_in_F ? 0 : slope);
    out->eta_J = R(t->all_in_F ? 0 : beta);
}

static void twin_response(void *user, size_t count, const uint32_t *particle, const tlsph_real *F, const tlsph_real *J,
                          tlsph_response *out)
{
    twin *t = user;
    size_t i;
    twin_watch(t, count, particle, F);
    for (i = 0; i < count; i++) {
        twin_one(t, F + 9 * i, J[i], &out[i]);
        twin_moduli(t, F + 9 * i, &out[i]);
    }
}

static void make_twin(twin *t, tlsph_material *m, int all_in_F)
{
    memset(t, 0, sizeof *t);
    t->model = *m;
    t->all_in_F = all_in_F;
    m->kind = TLSPH_USER;
    m->response = twin_response;
    m->response_user = t;
}

/* Host numbers that are no order in space: particle i becomes 7 i mod n. */
static void shuffle(own_cloud *cloud)
{
    size_t i, n = cloud->particles.count;
    own_cloud old;
    if (!CHECK(own_copy(&old, &cloud->particles, 3))) return;
    for (i = 0; i < n; i++) {
        size_t to = 7 * i % n;
        memcpy(cloud->positions + 3 * to, old.positions + 3 * i, 3 * sizeof *old.positions);
        cloud->volumes[to] = old.volumes[i];
        if (cloud->weights) cloud->weights[to] = old.weights[i];
    }
    own_cloud_destroy(&old);
}

typedef struct law { tlsph_material_kind kind; tlsph_unknowns unknowns; tlsph_thermal thermal; int all_in_F; } law;

/* 6 x 5 x 4 = 120 particles: no multiple of the 32 that a call takes at most, and coprime to 7. */
static int twin_pair(const law *l, body *builtin, body *user, twin *t)
{
    body *both[2];
    int i;
    both[0] = builtin;
    both[1] = user;
    memset(user, 0, sizeof *user);
    memset(builtin, 0, sizeof *builtin);
    for (i = 0; i < 2; i++) {
        if (!body_make(both[i], 3, 5, 4, 3)) return 0;
        shuffle(&both[i]->cloud);
        both[i]->materials[0] = soft_material(l->kind);
        if (i) make_twin(t, &both[i]->materials[0], l->all_in_F);
        both[i]->desc.unknowns = l->unknowns;
        both[i]->desc.thermal = l->thermal;
        if (!body_start(both[i], 3, 0.15)) return 0;
    }
    return 1;
}

static void check_twin(const law *l)
{
    const double tolerance = ROUNDED(1e-10, 4e3);
    body builtin, user;
    twin t;
    if (twin_pair(l, &builtin, &user, &t)) {
        double dt = 0.7 * (double)tlsph_stable_time_step(builtin.solver);
        tlsph_real *F;
        CHECK_RESULT(steps_of(builtin.solver, dt, 30), TLSPH_OK);
        CHECK_RESULT(steps_of(user.solver, dt, 30), TLSPH_OK);
        check_same_state(&builtin, &user, tolerance);
        CHECK(t.largest_batch > 1);
        F = read_field(user.solver, TLSPH_FIELD_F);
        CHECK(F && largest(F, 9 * tlsph_count(user.solver)) > 1.2); /* a large strain */
        free(F);
    }
    body_destroy(&builtin);
    body_destroy(&user);
}

TEST(user_neo_hookean_is_the_built_in_one)
{
    static const law split = {TLSPH_NEO_HOOKEAN, TLSPH_PF, TLSPH_ISOTHERMAL, 0};
    static const law joint = {TLSPH_NEO_HOOKEAN, TLSPH_PF, TLSPH_ISOTHERMAL, 1};
    check_twin(&split);
    check_twin(&joint);
}

TEST(user_mie_gruneisen_is_the_built_in_one)
{
    static const law split = {TLSPH_MIE_GRUNEISEN, TLSPH_PF, TLSPH_ENERGY, 0};
    static const law joint = {TLSPH_MIE_GRUNEISEN, TLSPH_PF, TLSPH_ENERGY, 1};
    static const law entropy = {TLSPH_MIE_GRUNEISEN, TLSPH_PF, TLSPH_ENTROPY, 0};
    static const law evolved = {TLSPH_MIE_GRUNEISEN, TLSPH_PFJ, TLSPH_ENERGY, 0};
    check_twin(&split);
    check_twin(&joint);
    check_twin(&entropy);
    check_twin(&evolved);
}

/* Every particle carries its own F; the callback must find it under the host's number. */
TEST(user_material_gets_host_numbers_in_batches)
{
    static const law l = {TLSPH_NEO_HOOKEAN, TLSPH_PF, TLSPH_ISOTHERMAL, 0};
    body builtin, user;
    twin t;
    if (twin_pair(&l, &builtin, &user, &t)) {
        size_t a, n = tlsph_count(user.solver);
        tlsph_real *F = calloc(9 * n, sizeof *F), *first = calloc(n, sizeof *first);
        for (a = 0; a < n; a++) {
            F[9 * a] = first[a] = R(1 + 1e-4 * (double)(a + 1));
            F[9 * a + 4] = F[9 * a + 8] = 1;
        }
        CHECK_RESULT(tlsph_write(user.solver, TLSPH_FIELD_F, F), TLSPH_OK);
        t.seen = calloc(n, 1);
        t.expected = first;
        t.largest_batch = 0;
        CHECK_RESULT(tlsph_step(user.solver, R(1e-4)), TLSPH_OK);
        CHECK_SAME(t.seen_count, n);
        CHECK_SAME(t.wrong, 0);
        CHECK(t.largest_batch > 1 && t.largest_batch <= n);
        t.expected = NULL;
        free(t.seen);
        free(F);
        free(first);
    }
    body_destroy(&builtin);
    body_destroy(&user);
}

/* ---- two materials ---- */

static void stiff_half(body *b, int checkered)
{
    size_t a;
    b->desc.material_count = 2;
    b->materials[1].young *= 4;
    b->materials[1].density *= 3;
    for (a = 0; a < b->cloud.particles.count; a++) {
        const tlsph_real *X = b->cloud.positions + 3 * a;
        int sum = (int)(4 * (double)X[0] + 0.5) + (int)(4 * (double)X[1] + 0.5) + (int)(4 * (double)X[2] + 0.5);
        b->cloud.materials[a] = checkered ? (uint8_t)(sum % 2) : (double)X[0] > 0.6;
    }
}

/* sqrt((kappa + 4/3 mu)/rho) of the undeformed material */
static double p_speed(const tlsph_material *m)
{
    double nu = (double)m->poisson;
    return sqrt((double)m->young * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / (double)m->density);
}

static void check_sets(const body *b)
{
    tlsph_real *c = read_field(b->solver, TLSPH_FIELD_P_WAVE_SPEED), *M = read_field(b->solver, TLSPH_FIELD_MASS);
    double mass = 0;
    tlsph_ledger l;
    size_t a;
    for (a = 0; a < tlsph_count(b->solver); a++) {
        const tlsph_material *m = &b->materials[b->cloud.materials[a]];
        double expected = (double)m->density * (double)b->cloud.volumes[a];
        CHECK_CLOSE(c[a], p_speed(m), 100 * EPSILON * p_speed(m));
        CHECK_CLOSE(M[a], expected, 10 * EPSILON * expected);
        mass += expected;
    }
    tlsph_ledger_read(b->solver, &l);
    CHECK_CLOSE(l.mass, mass, 1e3 * EPSILON * mass);
    free(c);
    free(M);
}

TEST(two_materials)
{
    static const tlsph_unknowns unknowns[2] = {TLSPH_PF, TLSPH_PFHJ};
    int i;
    for (i = 0; i < 2; i++) {
        body b;
        tlsph_ledger l;
        REQUIRE(body_make(&b, 3, 5, 4, 3));
        stiff_half(&b, 0);
        b.desc.unknowns = unknowns[i];
        b.desc.thermal = i ? TLSPH_ENERGY : TLSPH_ISOTHERMAL;
        REQUIRE(body_start(&b, 0, 0));
        check_sets(&b);
        CHECK_RESULT(write_state(&b, 0.3, 0), TLSPH_OK);
        tlsph_ledger_reset(b.solver);
        tlsph_ledger_read(b.solver, &l);
        b.kinetic = l.kinetic_energy;
        CHECK_RESULT(take_steps(b.solver, 30), TLSPH_OK);
        CHECK_BELOW(momentum_lost(&b), 1e3 * EPSILON);
        tlsph_ledger_read(b.solver, &l);
        CHECK(state_finite(b.solver) && l.kinetic_energy > 0.01 * b.kinetic);
        CHECK_BELOW(l.energy_residual, ROUNDED(1e-11, 1e5) * b.kinetic);
        CHECK_BELOW(l.total_energy - l.energy_residual, 1e9);
        body_destroy(&b);
    }
}

/* A user's material beside a built-in one, particle by particle, is what two built-in ones give. */
TEST(user_and_built_in_materials_mix)
{
    body b[2];
    twin t;
    int i, ready = 1;
    double dt;
    memset(b, 0, sizeof b);
    for (i = 0; i < 2 && ready; i++) {
        ready = body_make(&b[i], 3, 5, 4, 3);
        if (!ready) break;
        stiff_half(&b[i], 1);
        if (i) make_twin(&t, &b[i].materials[1], 0);
        ready = body_start(&b[i], 2, 0.1);
    }
    if (ready) {
        dt = 0.7 * (double)tlsph_stable_time_step(b[0].solver);
        for (i = 0; i < 2; i++) CHECK_RESULT(steps_of(b[i].solver, dt, 30), TLSPH_OK);
        check_same_state(&b[0], &b[1], ROUNDED(1e-10, 4e3));
        CHECK_BELOW(momentum_lost(&b[1]), 1e3 * EPSILON);
    }
    body_destroy(&b[0]);
    body_destroy(&b[1]);
}
