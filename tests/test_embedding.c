/* Hosts as they come: several solvers on several threads, an arena and a thread pool of their own, a body that is stepped
   from inside another's callback. */
#if defined(__unix__) || defined(__APPLE__)
#define _POSIX_C_SOURCE 200112L
#include <pthread.h>
#define THREADS 1
#else
#define THREADS 0
#endif
#include "support.h"

#define STEPS 12

static moving_block block_number(int i)
{
    moving_block s = moving_block_default();
    s.cells = 5 + i % 3;
    s.unknowns = i % 2 ? TLSPH_PFHJ : TLSPH_PF;
    s.thermal = i % 2 ? TLSPH_ENERGY : TLSPH_ISOTHERMAL;
    s.threads = 1;
    return s;
}
/* 0 if anything failed: no checks here, since this runs on several threads. */
static uint64_t run_block(const moving_block *s)
{
    tlsph_solver *solver = NULL;
    uint64_t hash = 0;
    if (moving_block_create(s, &solver, NULL)) return 0;
    if (moving_block_kick(solver, 0.3) == TLSPH_OK && take_steps(solver, STEPS) == TLSPH_OK) hash = state_hash(solver);
    tlsph_destroy(solver);
    return hash;
}

/* ---- threads of the host ---- */

#if THREADS
enum { SOLVERS = 6, WORKERS = 3 };

typedef struct job { int number; uint64_t hash; } job;
static void *work(void *arg)
{
    job *j = arg;
    const moving_block s = block_number(j->number);
    j->hash = run_block(&s);
    return NULL;
}
TEST(solvers_on_threads_of_their_own)
{
    pthread_t thread[SOLVERS];
    job jobs[SOLVERS];
    int started = 0;
    for (; started < SOLVERS; started++) {
        jobs[started].number = started;
        jobs[started].hash = 0;
        if (!CHECK(pthread_create(&thread[started], NULL, work, &jobs[started]) == 0)) break;
    }
    for (int i = 0; i < started; i++) {
        const moving_block s = block_number(i);
        pthread_join(thread[i], NULL);
        CHECK(jobs[i].hash != 0 && jobs[i].hash == run_block(&s));
    }
}

/* A pool as small as can be: workers take the next task from a counter. */
typedef struct pool {
    pthread_mutex_t lock;
    tlsph_task_fn task;
    void *arg;
    size_t next, count, done[WORKERS + 1];
} pool;
typedef struct worker { pool *p; int number; } worker;

static void *pool_work(void *arg)
{
    worker *w = arg;
    for (;;) {
        pthread_mutex_lock(&w->p->lock);
        const size_t i = w->p->next++;
        pthread_mutex_unlock(&w->p->lock);
        if (i >= w->p->count) return NULL;
        w->p->task(w->p->arg, i);
        w->p->done[w->number]++;
    }
}
static void pool_run(void *user, tlsph_task_fn task, void *arg, size_t count)
{
    pool *p = user;
    pthread_t thread[WORKERS];
    worker workers[WORKERS + 1];
    int started = 0;
    p->task = task;
    p->arg = arg;
    p->next = 0;
    p->count = count;
    for (; started < WORKERS; started++) {
        workers[started].p = p;
        workers[started].number = started;
        if (pthread_create(&thread[started], NULL, pool_work, &workers[started])) break;
    }
    workers[WORKERS].p = p;
    workers[WORKERS].number = WORKERS;
    pool_work(&workers[WORKERS]);
    for (int i = 0; i < started; i++) pthread_join(thread[i], NULL);
}
TEST(thread_pool_of_the_host)
{
    moving_block s = block_number(1);
    s.cells = 10; /* more than one block of particles */
    const uint64_t expected = run_block(&s);
    pool p;
    size_t tasks = 0;
    memset(&p, 0, sizeof p);
    pthread_mutex_init(&p.lock, NULL);
    s.run = pool_run;
    s.run_user = &p;
    CHECK(expected != 0 && run_block(&s) == expected);
    for (int i = 0; i <= WORKERS; i++) tasks += p.done[i];
    CHECK(tasks > STEPS);
    pthread_mutex_destroy(&p.lock);
}
#else
TEST(solvers_on_threads_of_their_own) { SKIP("no POSIX threads"); }
TEST(thread_pool_of_the_host) { SKIP("no POSIX threads"); }
#endif

/* ---- memory of the host ---- */

/* Never gives back: what is released must be what was allocated last or is simply left. */
typedef struct bump { unsigned char *memory; size_t size, used; int full; } bump;
static void *bump_allocate(void *user, size_t size)
{
    bump *b = user;
    const size_t start = (b->used + 63) / 64 * 64;
    if (start + size > b->size) { b->full = 1; return NULL; }
    b->used = start + size;
    return b->memory + start;
}
static void bump_release(void *user, void *memory, size_t size)
{
    bump *b = user;
    if ((unsigned char *)memory + size == b->memory + b->used) b->used -= size;
}
TEST(arena_of_the_host)
{
    moving_block s = block_number(1);
    const uint64_t expected = run_block(&s);
    bump b = {NULL, (size_t)64 << 20, 0, 0};
    REQUIRE((b.memory = malloc(b.size)) != NULL);
    s.allocator.allocate = bump_allocate;
    s.allocator.release = bump_release;
    s.allocator.user = &b;
    CHECK(run_block(&s) == expected && !b.full && b.used > 0);
    b.used = 0;
    b.size = 1 << 16; /* too small: an error, and no crash */
    CHECK(run_block(&s) == 0 && b.full);
    free(b.memory);
}

/* ---- a body inside another's callback ---- */

typedef struct guest { tlsph_solver *solver; int calls; tlsph_result result; } guest;

/* The face of the outer body moves as the guest's centre of mass, and the guest is stepped on to that time. */
static void follow_guest(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                         const tlsph_real *x, tlsph_real *values)
{
    guest *g = user;
    tlsph_ledger ledger;
    (void)particle, (void)X, (void)x;
    if (time > tlsph_time(g->solver) && !g->result) g->result = tlsph_advance(g->solver, time);
    tlsph_ledger_read(g->solver, &ledger);
    for (size_t i = 0; i < count; i++) {
        values[3 * i] = R(0.01 * ledger.linear_momentum[0] / ledger.mass);
        values[3 * i + 1] = values[3 * i + 2] = 0;
    }
    g->calls++;
}
TEST(a_body_stepped_from_inside_another)
{
    static const int cells[3] = {4, 4, 4};
    moving_block inner = block_number(0);
    tlsph_material material = soft_material(TLSPH_NEO_HOOKEAN);
    tlsph_condition condition = tlsph_condition_default(TLSPH_VELOCITY);
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_solver *outer = NULL;
    guest g = {NULL, 0, TLSPH_OK};
    own_cloud cloud;
    uint32_t face[25];
    REQUIRE_OK(moving_block_create(&inner, &g.solver, NULL));
    CHECK_RESULT(moving_block_kick(g.solver, 0.3), TLSPH_OK);
    REQUIRE(own_box(&cloud, 3, cells, 0.25, 0));
    condition.particles = face;
    condition.count = tlsph_select_plane(&cloud.particles, 0, 0, R(1e-6), face, 25);
    condition.values = follow_guest;
    condition.values_user = &g;
    desc.particles = cloud.particles;
    desc.materials = &material;
    desc.material_count = 1;
    desc.conditions = &condition;
    desc.condition_count = 1;
    desc.threads = 1;
    REQUIRE_OK(tlsph_create(&desc, &outer, NULL));
    CHECK_RESULT(take_steps(outer, STEPS), TLSPH_OK);
    CHECK_RESULT(g.result, TLSPH_OK);
    REPORT("%d steps of the guest", (int)tlsph_step_count(g.solver));
    CHECK(g.calls >= STEPS && tlsph_step_count(g.solver) > 0);
    CHECK_CLOSE(tlsph_time(g.solver), tlsph_time(outer), 1e-6 * (double)tlsph_time(outer));
    CHECK(state_finite(outer) && state_finite(g.solver));
    tlsph_destroy(outer);
    tlsph_destroy(g.solver);
    own_cloud_destroy(&cloud);
}

SUITE(embedding, ENTRY(solvers_on_threads_of_their_own), ENTRY(thread_pool_of_the_host), ENTRY(arena_of_the_host),
      ENTRY(a_body_stepped_from_inside_another))
