/* The same bits for any number of threads, any order of tasks, run after run. */
#include "support.h"

#define STEPS 20

/* A run hook that does the host's tasks in some order on one thread: what matters is that results do not know it. */
typedef struct order {
    int threads;  /* tasks are dealt out to so many in turn, then done thread by thread */
    int reversed, shuffled;
    size_t most, calls; /* seen */
} order;

static void run_in_order(void *user, tlsph_task_fn task, void *arg, size_t count)
{
    order *o = user;
    size_t i, t, step = (size_t)o->threads, *sequence = malloc((count + 1) * sizeof *sequence), n = 0;
    uint64_t seed = o->calls;
    for (t = 0; t < step; t++)
        for (i = t; i < count; i += step) sequence[n++] = i;
    for (i = count; o->shuffled && i > 1; i--) {
        size_t j = (size_t)random_between(&seed, 0, (double)i), kept = sequence[i - 1];
        sequence[i - 1] = sequence[j];
        sequence[j] = kept;
    }
    for (i = 0; i < count; i++) task(arg, sequence[o->reversed ? count - 1 - i : i]);
    if (count > o->most) o->most = count;
    o->calls++;
    free(sequence);
}

/* Hash after STEPS steps; 0 on an error. */
static uint64_t hash_of(const moving_block *s)
{
    tlsph_solver *solver = NULL;
    uint64_t hash = 0;
    tlsph_error error;
    if (!CHECK_RESULT(moving_block_create(s, &solver, &error), TLSPH_OK)) { printf("    %s\n", error.message); return 0; }
    CHECK_RESULT(moving_block_kick(solver, 0.3), TLSPH_OK);
    if (CHECK_RESULT(take_steps(solver, STEPS), TLSPH_OK)) hash = state_hash(solver);
    CHECK(state_finite(solver));
    tlsph_destroy(solver);
    return hash;
}

static moving_block large_block(void)
{
    moving_block s = moving_block_default();
    s.cells = 12; /* more particles than one block of the reductions holds */
    return s;
}

static void check_orders(const moving_block *base)
{
    static const order orders[7] = {{1, 0, 0, 0, 0}, {1, 1, 0, 0, 0}, {2, 0, 0, 0, 0}, {3, 0, 0, 0, 0},
                                    {3, 1, 0, 0, 0}, {7, 0, 0, 0, 0}, {1, 0, 1, 0, 0}};
    uint64_t expected = hash_of(base);
    int i;
    CHECK(expected != 0);
    for (i = 0; i < 7; i++) {
        moving_block s = *base;
        order o = orders[i];
        s.run = run_in_order;
        s.run_user = &o;
        CHECK(hash_of(&s) == expected);
        CHECK(o.calls > 0);
        if (base->cells > 6) CHECK(o.most > 1); /* else the test tests nothing */
    }
}

TEST(order_of_tasks_does_not_matter)
{
    moving_block s = large_block();
    check_orders(&s);
    s.dimension = 2;
    s.cells = 40;
    s.unknowns = TLSPH_PF;
    s.thermal = TLSPH_ISOTHERMAL;
    check_orders(&s);
    s.dimension = 3;
    s.cells = 8;
    s.jitter = 0.2;
    s.unknowns = TLSPH_PFJ;
    s.thermal = TLSPH_ENTROPY;
    check_orders(&s);
    s.integrator = TLSPH_LEAPFROG;
    check_orders(&s);
}

TEST(number_of_threads_does_not_matter)
{
    static const int threads[5] = {1, 2, 3, 7, 0};
    moving_block s = large_block();
    uint64_t expected;
    int i;
    s.threads = 1;
    expected = hash_of(&s);
    for (i = 0; i < 5; i++) {
        s.threads = threads[i];
        CHECK(hash_of(&s) == expected);
    }
}

TEST(run_after_run)
{
    moving_block s = large_block();
    uint64_t expected;
    s.cells = 6;
    expected = hash_of(&s);
    CHECK(hash_of(&s) == expected);
    CHECK(hash_of(&s) == expected);
}

/* Ledger entries are reductions: they, too, may not depend on threads. */
TEST(ledger_does_not_depend_on_threads)
{
    moving_block s = large_block();
    tlsph_ledger ledgers[2];
    int i;
    memset(ledgers, 0, sizeof ledgers);
    for (i = 0; i < 2; i++) {
        tlsph_solver *solver = NULL;
        order o = {5, 1, 0, 0, 0};
        if (i) { s.run = run_in_order; s.run_user = &o; }
        REQUIRE_OK(moving_block_create(&s, &solver, NULL));
        CHECK_RESULT(moving_block_kick(solver, 0.3), TLSPH_OK);
        CHECK_RESULT(take_steps(solver, STEPS), TLSPH_OK);
        tlsph_ledger_read(solver, &ledgers[i]);
        tlsph_destroy(solver);
    }
    CHECK(ledgers[0].kinetic_energy > 0);
    CHECK(memcmp(&ledgers[0], &ledgers[1], sizeof ledgers[0]) == 0);
}

/* ---- the host's numbering ---- */

typedef struct twin { own_cloud cloud; tlsph_solver *solver; uint32_t *of; } twin; /* of[new number] = old number */

static void shuffle(twin *t, const own_cloud *source, uint64_t seed)
{
    size_t a, n = source->particles.count;
    t->of = malloc(n * sizeof *t->of);
    for (a = 0; a < n; a++) t->of[a] = (uint32_t)a;
    for (a = n; seed && a > 1; a--) {
        size_t j = (size_t)random_between(&seed, 0, (double)a);
        uint32_t kept = t->of[a - 1];
        t->of[a - 1] = t->of[j];
        t->of[j] = kept;
    }
    for (a = 0; a < n; a++) {
        memcpy(t->cloud.positions + 3 * a, source->positions + 3 * t->of[a], 3 * sizeof(tlsph_real));
        t->cloud.volumes[a] = source->volumes[t->of[a]];
        if (source->weights) t->cloud.weights[a] = source->weights[t->of[a]];
    }
}

static int twin_make(twin *t, const own_cloud *source, uint64_t seed)
{
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_material m = soft_material(TLSPH_MIE_GRUNEISEN);
    t->solver = NULL;
    if (!own_copy(&t->cloud, &source->particles, 3)) return 0;
    shuffle(t, source, seed);
    desc.particles = t->cloud.particles;
    desc.materials = &m;
    desc.material_count = 1;
    desc.support = R(0.9);
    desc.unknowns = TLSPH_PFHJ;
    desc.thermal = TLSPH_ENERGY;
    desc.threads = 1;
    if (tlsph_create(&desc, &t->solver, NULL)) return 0;
    return moving_block_kick(t->solver, 0.3) == TLSPH_OK && take_steps(t->solver, STEPS) == TLSPH_OK;
}

static void twin_destroy(twin *t)
{
    tlsph_destroy(t->solver);
    own_cloud_destroy(&t->cloud);
    free(t->of);
}

static void compare_twins(const twin *one, const twin *two, tlsph_field field, double tolerance)
{
    tlsph_real *a = read_field(one->solver, field), *b = read_field(two->solver, field);
    size_t i, k, components = (size_t)tlsph_field_components(field);
    double scale = largest(a, one->cloud.particles.count * components);
    for (i = 0; i < one->cloud.particles.count; i++)
        for (k = 0; k < components; k++)
            CHECK_CLOSE(b[i * components + k], a[two->of[i] * components + k], tolerance * scale);
    free(a);
    free(b);
}

TEST(host_numbering_does_not_matter)
{
    static const int cells[3] = {5, 4, 4};
    own_cloud cloud;
    twin one, two;
    REQUIRE(own_box(&cloud, 3, cells, 0.25, 0.2));
    REQUIRE(twin_make(&one, &cloud, 0));
    REQUIRE(twin_make(&two, &cloud, 99));
    compare_twins(&one, &two, TLSPH_FIELD_POSITION, 1000 * EPSILON);
    compare_twins(&one, &two, TLSPH_FIELD_VELOCITY, 10000 * EPSILON);
    compare_twins(&one, &two, TLSPH_FIELD_F, 1000 * EPSILON);
    compare_twins(&one, &two, TLSPH_FIELD_TEMPERATURE, 1000 * EPSILON);
    twin_destroy(&one);
    twin_destroy(&two);
    own_cloud_destroy(&cloud);
}

/* ---- the audit ---- */

/* With the audit on, the general pair loop runs instead of those made for each combination of unknowns: a plain
   reference for all of them, with the same result but for the order of operations. */
static void check_audit(moving_block s)
{
    static const tlsph_field fields[4] = {TLSPH_FIELD_POSITION, TLSPH_FIELD_VELOCITY, TLSPH_FIELD_F, TLSPH_FIELD_J};
    tlsph_solver *fast = NULL, *general = NULL;
    tlsph_ledger ledger;
    size_t i, k;
    REQUIRE_OK(moving_block_create(&s, &fast, NULL));
    s.audit = 1;
    REQUIRE_OK(moving_block_create(&s, &general, NULL));
    CHECK_RESULT(moving_block_kick(fast, 0.3), TLSPH_OK);
    CHECK_RESULT(moving_block_kick(general, 0.3), TLSPH_OK);
    CHECK_RESULT(take_steps(fast, STEPS), TLSPH_OK);
    CHECK_RESULT(take_steps(general, STEPS), TLSPH_OK);
    for (k = 0; k < 4; k++) {
        tlsph_real *a = read_field(fast, fields[k]), *b = read_field(general, fields[k]);
        size_t count = tlsph_count(fast) * (size_t)tlsph_field_components(fields[k]);
        for (i = 0; i < count; i++) CHECK_CLOSE(b[i], a[i], BOUNDED(2000 * EPSILON) * largest(a, count));
        free(a);
        free(b);
    }
    tlsph_ledger_read(general, &ledger);
    CHECK(ledger.least_pair_production >= -5000 * EPSILON);
    tlsph_destroy(fast);
    tlsph_destroy(general);
}

TEST(audit_changes_nothing)
{
    static const tlsph_unknowns sets[4] = {TLSPH_PF, TLSPH_PFJ, TLSPH_PFH, TLSPH_PFHJ};
    static const tlsph_thermal thermals[3] = {TLSPH_ISOTHERMAL, TLSPH_ENERGY, TLSPH_ENTROPY};
    int dimension, u, t;
    for (dimension = 2; dimension <= 3; dimension++)
        for (u = 0; u < 4; u++)
            for (t = 0; t < 3; t++) {
                moving_block s = moving_block_default();
                s.dimension = dimension;
                s.unknowns = sets[u];
                s.thermal = thermals[t];
                check_audit(s);
            }
}

/* Without loads and walls a block of particles is corrected, moved, constrained and evaluated in one go; the same in phases
   of all blocks where a wall might ask for it. */
TEST(phases_or_blocks)
{
    static const tlsph_integrator schemes[4] = {TLSPH_RK2, TLSPH_SSP_RK3, TLSPH_RK4_FROZEN, TLSPH_LEAPFROG};
    int dimension, k, i;
    for (dimension = 2; dimension <= 3; dimension++)
        for (k = 0; k < 4; k++) {
            uint64_t hash[2] = {0, 1};
            for (i = 0; i < 2; i++) {
                moving_block s = moving_block_default();
                tlsph_solver *solver;
                s.dimension = dimension;
                s.cells = dimension == 3 ? 8 : 24; /* several blocks */
                s.integrator = schemes[k];
                s.unloaded = 1 + i;
                if (!CHECK_RESULT(moving_block_create(&s, &solver, NULL), TLSPH_OK)) return;
                CHECK_RESULT(moving_block_kick(solver, 5), TLSPH_OK);
                CHECK_RESULT(take_steps(solver, 5), TLSPH_OK);
                hash[i] = state_hash(solver);
                tlsph_destroy(solver);
            }
            if (!CHECK(hash[0] == hash[1])) printf("    %d-D, scheme %d\n", dimension, (int)schemes[k]);
        }
}

SUITE(determinism, ENTRY(order_of_tasks_does_not_matter), ENTRY(number_of_threads_does_not_matter),
      ENTRY(run_after_run), ENTRY(audit_changes_nothing), ENTRY(ledger_does_not_depend_on_threads), ENTRY(host_numbering_does_not_matter),
      ENTRY(phases_or_blocks))
