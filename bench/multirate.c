/*
multirate.c - what desc.rates gains and costs: times, errors and balances against the leapfrog with one step

  build/multirate [--quick] [--ratio 8] [--rates 8] [--cfl 0.3]

  Scene a: a cube of soft material around a stiff cube of 7 % of its particles, whose sound is `ratio` times as fast.
  Scene b: a cube filled by a cloud whose spacing grows 1 : 4 from a corner, one material.
  Both start with the velocity of a bend and a turn, and go on for half the time that sound takes through the soft cube.
  Times are the least of several runs in alternation, errors (of displacement, by the l2 norm) are against the plain leapfrog
  with steps a quarter as long; its full step shows what the time steps alone contribute.
*/
#define TLSPH_IMPLEMENTATION
#define TLSPH_STATIC
#include "tlsph.h"

#include "examples/common/common.h"

typedef struct scene {
    const char *name;
    int graded, cells;
    tlsph_unknowns unknowns;
    double ratio, cfl;
} scene;

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static tlsph_real unit_cube(void *user, const tlsph_real X[3]) {
    static const tlsph_real low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
    (void)user;
    return tlsph_distance_box(X, low, high);
}
static tlsph_real graded_spacing(void *user, const tlsph_real X[3]) {
    const double r = sqrt((double)(X[0] * X[0] + X[1] * X[1] + X[2] * X[2])), share = 0.25 + 0.7 * r;
    return (tlsph_real)((share < 1 ? share : 1) / ((const scene *)user)->cells);
}
static tlsph_result make_cloud(const scene *s, tlsph_cloud *cloud, tlsph_error *error) {
    tlsph_fill fill = tlsph_fill_default(3);
    for (int i = 0; i < 3; i++) fill.size[i] = 1;
    fill.spacing = 1 / (tlsph_real)s->cells;
    if (s->graded) {
        fill.shape = TLSPH_DISTANCE;
        fill.distance = unit_cube;
        fill.placement = TLSPH_SCATTERED;
        fill.spacing_at = graded_spacing;
        fill.spacing_user = (void *)s;
        fill.voronoi = 1;
    }
    return tlsph_cloud_create(&fill, cloud, error);
}
/* Index of the material of each particle. */
static uint8_t *stiff_core(const tlsph_particles *particles) {
    uint8_t *out = calloc(particles->count, 1);
    for (size_t a = 0; out && a < particles->count; a++) {
        out[a] = 1;
        for (int i = 0; i < 3; i++)
            if (fabs((double)particles->positions[3 * a + (size_t)i] - 0.5) > 0.2 + 1e-6) out[a] = 0;
    }
    return out;
}
static tlsph_result kick(tlsph_solver *solver, const tlsph_particles *particles) {
    tlsph_real *v = malloc(3 * particles->count * sizeof *v);
    if (!v) return TLSPH_ERROR_MEMORY;
    for (size_t a = 0; a < particles->count; a++) {
        const tlsph_real *X = particles->positions + 3 * a;
        v[3 * a] = (tlsph_real)sin(3.14159265358979 * (double)X[0]);
        v[3 * a + 1] = (tlsph_real)cos(3.14159265358979 * (double)X[0]) * X[2];
        v[3 * a + 2] = X[0] * X[1] + (tlsph_real)0.5;
    }
    const tlsph_result result = tlsph_write(solver, TLSPH_FIELD_VELOCITY, v);
    free(v);
    return result;
}
static tlsph_result make(const scene *s, const tlsph_cloud *cloud, int rates, double cfl, tlsph_solver **solver,
                         tlsph_error *error) {
    tlsph_material material[2];
    uint8_t *core = stiff_core(&cloud->particles);
    material[0] = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    material[0].density = 1000; material[0].young = 1e6; material[0].poisson = (tlsph_real)0.3;
    material[1] = material[0];
    material[1].young *= (tlsph_real)(s->ratio * s->ratio);
    tlsph_desc desc = tlsph_desc_default(3);
    desc.particles = cloud->particles;
    if (!s->graded) desc.particles.materials = core;
    desc.materials = material; desc.material_count = s->graded ? 1 : 2;
    desc.unknowns = s->unknowns;
    desc.integrator = TLSPH_LEAPFROG;
    desc.rates = rates;
    desc.cfl = (tlsph_real)cfl;
    desc.threads = 1;
    if (s->graded) {
        desc.operator_kind = TLSPH_CLOSED;
        desc.kernel = TLSPH_WENDLAND_C2;
        desc.support = (tlsph_real)0.825;
    }
    tlsph_result result = tlsph_create(&desc, solver, error);
    if (!result) result = kick(*solver, &cloud->particles);
    free(core);
    return result;
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

/* A solver, its state at the beginning, and what came out of its runs. */
typedef struct contender {
    tlsph_solver *solver;
    void *start; size_t start_size;
    tlsph_real *u;
    double seconds;
    tlsph_ledger ledger;
} contender;

static int prepare(const scene *s, const tlsph_cloud *cloud, int rates, double cfl, contender *c) {
    tlsph_error error = {0};
    memset(c, 0, sizeof *c);
    if (make(s, cloud, rates, cfl, &c->solver, &error)) { puts(error.message); return 0; }
    c->start_size = tlsph_save_size(c->solver);
    c->start = malloc(c->start_size);
    c->u = malloc(3 * tlsph_count(c->solver) * sizeof *c->u);
    return c->start && c->u && !tlsph_save(c->solver, c->start, c->start_size);
}
/* Keeps the least time. 0 on an error. */
static int run(contender *c, double end) {
    if (tlsph_restore(c->solver, c->start, c->start_size)) return 0;
    const double start = ex_cpu_seconds();
    const tlsph_result result = tlsph_advance(c->solver, (tlsph_real)end);
    const double seconds = ex_cpu_seconds() - start;
    if (result) puts(tlsph_last_error(c->solver)->message);
    if (!(c->seconds > 0) || seconds < c->seconds) c->seconds = seconds;
    tlsph_read(c->solver, TLSPH_FIELD_DISPLACEMENT, c->u);
    tlsph_ledger_read(c->solver, &c->ledger);
    return !result;
}
static void release(contender *c) {
    tlsph_destroy(c->solver);
    free(c->start);
    free(c->u);
}
static double length(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }
static double difference(const contender *a, const contender *b) {
    double sum = 0, square = 0;
    for (size_t i = 0; i < 3 * tlsph_count(a->solver); i++) {
        sum += pow((double)(a->u[i] - b->u[i]), 2);
        square += pow((double)b->u[i], 2);
    }
    return sqrt(sum / square);
}
static int compare(const scene *s, int rates, int repeats) {
    contender exact = {0}, plain = {0}, multi = {0};
    tlsph_cloud cloud;
    tlsph_error error;
    tlsph_size size;
    const double end = 0.5 / sqrt(1e6 * 1.346 / 1000);
    if (make_cloud(s, &cloud, &error)) { puts(error.message); return 0; }
    int good = prepare(s, &cloud, 1, s->cfl / 4, &exact) && prepare(s, &cloud, 1, s->cfl, &plain) &&
               prepare(s, &cloud, rates, s->cfl, &multi) && run(&exact, end);
    for (int i = 0; i < repeats; i++) good = good && run(&plain, end) && run(&multi, end);
    if (good) {
        const tlsph_ledger *l = &multi.ledger, *p = &plain.ledger;
        tlsph_size_read(multi.solver, &size);
        printf("%-24s %6zu %6d %6d %2d %8.3f %8.3f %6.2f  %.1e  %.1e  %+.1e  %+.1e  %.0e  %.0e\n", s->name,
               tlsph_count(plain.solver), (int)p->step, (int)l->step, size.rates, plain.seconds, multi.seconds,
               plain.seconds / multi.seconds, difference(&plain, &exact), difference(&multi, &exact),
               p->energy_residual / p->total_energy, l->energy_residual / l->total_energy,
               length(l->linear_residual) / length(l->linear_momentum),
               length(l->angular_residual) / length(l->angular_momentum));
        fflush(stdout);
    }
    release(&exact); release(&plain); release(&multi);
    tlsph_cloud_destroy(&cloud);
    return good;
}

int main(int argc, char **argv) {
    double ratio = 8, cfl = 0.3;
    int rates = 8, quick = 0;
    for (int i = 1; i < argc; i++) {
        const char *value = i + 1 < argc ? argv[i + 1] : "";
        if (!strcmp(argv[i], "--quick")) quick = 1;
        else if (!strcmp(argv[i], "--ratio")) ratio = atof(value), i++;
        else if (!strcmp(argv[i], "--rates")) rates = atoi(value), i++;
        else if (!strcmp(argv[i], "--cfl")) cfl = atof(value), i++;
        else { printf("unknown option %s\n", argv[i]); return 2; }
    }
    const scene scenes[] = {{"a, {p,F}, 12 cells", 0, 12, TLSPH_PF, ratio, cfl},
                            {"a, {p,F}, 20 cells", 0, 20, TLSPH_PF, ratio, cfl},
                            {"a, {p,F,J}, 20 cells", 0, 20, TLSPH_PFJ, ratio, cfl},
                            {"a, {p,F,H,J}, 20 cells", 0, 20, TLSPH_PFHJ, ratio, cfl},
                            {"b, {p,F}, 8 cells", 1, 8, TLSPH_PF, 1, cfl},
                            {"b, {p,F}, 12 cells", 1, 12, TLSPH_PF, 1, cfl},
                            {"b, {p,F}, 16 cells", 1, 16, TLSPH_PF, 1, cfl}};
    const int last = (int)(sizeof scenes / sizeof *scenes);
    printf("%-24s %6s %6s %6s %2s %8s %8s %6s  %-7s  %-7s  %-8s  %-8s  %-5s  %-5s\n", "scene", "count", "steps", "whole",
           "of", "plain s", "rates s", "ratio", "error", "error", "energy", "energy", "p", "x x p");
    for (int i = 0; i < last; i++)
        if ((!quick || i == 0 || i == 4) && !compare(scenes + i, rates, quick ? 2 : 3)) return 1;
    return 0;
}
