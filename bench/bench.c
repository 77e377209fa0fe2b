/*
bench.c - what a right-hand side costs, in ns per particle (a step has two of them)

  build/bench [--quick] [--threads N] [--output FOLDER]

  A free box on a lattice does a smooth small motion: no conditions, no loads, so that only the method's own sums are
  timed. All cases are timed in turn, round after round, and each keeps its least time: what else runs on the machine
  comes and goes between rounds, and can only add. One thread is timed by its processor time, several by the wall clock.
  Every time stands beside the energy balance of the very steps that were timed: a fast wrong step is worth nothing.
  Beside it, too, stands the least time that the machine allows: bytes that must move over the triad's bandwidth, or
  flops over the peak of multiply-adds, whichever is longer (bound.c). Bodies that fit into a cache may be faster than
  the first; aim of the large ones: 60 % of the bound.
*/
#include "bound.h"
#include "machine.h"
#include "tlsph.h"

#include "examples/common/common.h"
#include "examples/scenes/scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef TLSPH_REAL_FLOAT
#define PRECISION "float"
#define BALANCE 5e-3 /* of the kinetic energy: rounding of E, which is stored as float */
#else
#define PRECISION "double"
#define BALANCE 1e-10
#endif
#define TIME_SCHEME 2e-3 /* isothermal scenes do not carry E: their balance is as good as RK2 follows it */

enum { CASES_MOST = 32, STAGES = 2 /* right-hand sides a step */ };

typedef struct {
    int dimension, neighbours, sharp, projection, metal;
    tlsph_operator_kind kind;
    tlsph_unknowns unknowns;
    tlsph_thermal thermal;
    tlsph_dissipation dissipation;
    const char *variant;      /* "", or what differs from the default, as part of the keys */
    tlsph_solver *solver;     /* while it lives */
    int failed;
    tlsph_size size;
    double count, kinetic;    /* particles; kinetic energy at the start, J */
    double creation, step;    /* least, s */
    double residual;          /* largest |energy residual| / kinetic */
    double bytes, flops;      /* a particle and right-hand side at least; 0: unknown */
} bench_case;

typedef struct {
    int threads, case_count;
    bench_case cases[CASES_MOST];
    tlsph_cloud clouds[2];    /* 2-D, 3-D */
    double triad, peak;       /* GB/s, Gflop/s of all threads */
    ex_csv csv;
} bench;

/* How much is timed. */
typedef struct {
    const char *suffix;    /* of the keys */
    int cells[2];          /* a side in 2-D and 3-D: neither a power of two, which would make caches collide */
    int least, most;       /* rounds, each visits every case */
    int steps;             /* a visit */
    int keep;              /* solvers live through the rounds; large ones would not fit into memory together */
    double seconds;        /* after which no round begins, once the least number is done */
} bench_scale;

/* ---- the machine ---- */

static void show_machine(bench *b) {
#ifndef _OPENMP
    if (b->threads > 1) fprintf(stderr, "bench: built without OpenMP, so one thread it is\n");
    b->threads = 1;
#endif
    machine_print();
    printf(PRECISION ", %d thread%s\n", b->threads, b->threads > 1 ? "s, wall clock" : ", processor time");
    b->triad = machine_triad(b->threads);
    ex_result("threads", b->threads, "");
    ex_result("triad_bandwidth", b->triad, "GB/s");
    b->peak = machine_fma_peak();
    ex_result("double_fma_peak_one_thread", b->peak, "Gflop/s");
    b->peak *= b->threads * (8.0 / sizeof(tlsph_real));
}

/* ---- the cases ---- */

static const char *unknowns_name(tlsph_unknowns unknowns) {
    static const char *const names[] = { "pF", "pFJ", "pFHJ", "pFH" };
    return names[unknowns];
}

static bench_case *add_case(bench *b, tlsph_unknowns unknowns, int neighbours, const char *variant) {
    bench_case *c = b->cases + b->case_count++;
    memset(c, 0, sizeof *c);
    c->dimension = 3;
    c->neighbours = neighbours;
    c->projection = 1;
    c->unknowns = unknowns;
    c->thermal = TLSPH_ISOTHERMAL;
    c->dissipation = TLSPH_LIMITED;
    c->variant = variant;
    return c;
}

static void list_cases(bench *b) {
    static const tlsph_unknowns unknowns[] = { TLSPH_PF, TLSPH_PFJ, TLSPH_PFHJ };
    b->case_count = 0;
    for (int i = 0; i < 3; i++)
        for (int neighbours = 6; neighbours <= 26; neighbours += 20) {
            add_case(b, unknowns[i], neighbours, "");
            add_case(b, unknowns[i], neighbours, "_energy")->thermal = TLSPH_ENERGY;
        }
    add_case(b, TLSPH_PFHJ, 6, "_first_order")->dissipation = TLSPH_FIRST_ORDER;
    add_case(b, TLSPH_PFHJ, 6, "_no_dissipation")->dissipation = TLSPH_NO_DISSIPATION;
    add_case(b, TLSPH_PFHJ, 6, "_self_adjoint")->dissipation = TLSPH_SELF_ADJOINT;
    add_case(b, TLSPH_PFHJ, 6, "_jst")->dissipation = TLSPH_JST;
    add_case(b, TLSPH_PF, 6, "_metal")->metal = 1;
    add_case(b, TLSPH_PF, 26, "_metal")->metal = 1;
    add_case(b, TLSPH_PF, 26, "_kernel_1")->kind = TLSPH_FIRST_KERNEL;
    add_case(b, TLSPH_PFHJ, 6, "_sharp")->sharp = 1;
    add_case(b, TLSPH_PFHJ, 6, "_no_projection")->projection = 0;
    add_case(b, TLSPH_PFHJ, 4, "_2d")->dimension = 2; /* the same supports as 6 and 26 neighbours in 3-D */
    add_case(b, TLSPH_PFHJ, 8, "_2d")->dimension = 2;
}

static const bench_case *find_case(const bench *b, int neighbours, const char *variant) {
    for (int i = 0; i < b->case_count; i++) {
        const bench_case *c = b->cases + i;
        if (c->unknowns == TLSPH_PFHJ && c->neighbours == neighbours && strcmp(c->variant, variant) == 0) return c;
    }
    return NULL;
}

/* ---- one scene ---- */

static void fail(bench_case *c, const char *message) {
    printf("%s %d%s: %s\n", unknowns_name(c->unknowns), c->neighbours, c->variant, message);
    c->failed = 1;
}

/* v_i = 0.01 c_p sin(pi X_i) cos(pi X_j) cos(pi X_k). Smooth, and in motion nearly everywhere, so
   that no branch is taken more often than in a real scene. */
static tlsph_result set_motion(const bench_case *c, const tlsph_cloud *cloud, const tlsph_material *material) {
    double p_wave, bulk, shear;
    tlsph_real *v = calloc(3 * cloud->particles.count, sizeof *v);
    tlsph_result result;
    if (!v) return TLSPH_ERROR_MEMORY;
    scene_moduli(material, &p_wave, &bulk, &shear);
    for (size_t i = 0; i < 3 * cloud->particles.count; i++) {
        const tlsph_real *X = cloud->particles.positions + i / 3 * 3;
        double value = 0.01 * sqrt(p_wave / (double)material->density);
        for (size_t k = 0; k < (size_t)c->dimension; k++)
            value *= k == i % 3 ? sin(SCENE_PI * (double)X[k]) : cos(SCENE_PI * (double)X[k]);
        if ((int)(i % 3) < c->dimension) v[i] = (tlsph_real)value;
    }
    result = tlsph_write(c->solver, TLSPH_FIELD_VELOCITY, v);
    free(v);
    return result;
}

static tlsph_desc describe(const bench_case *c, const tlsph_cloud *cloud, const tlsph_material *material, int threads) {
    tlsph_desc desc = tlsph_desc_default(c->dimension);
    desc.particles = cloud->particles;
    desc.materials = material;
    desc.material_count = 1;
    desc.unknowns = c->unknowns;
    desc.thermal = c->thermal;
    desc.dissipation = c->dissipation;
    desc.sharp_gradients = c->sharp;
    desc.operator_kind = c->kind;
    desc.projection = c->projection;
    desc.support = (tlsph_real)(c->neighbours > 2 * c->dimension ? 0.9 : 0.6); /* within 1.8 or 1.2 spacings */
    desc.threads = threads;
    return desc;
}

/* The metal does not yield here: whether it does changes its time by a tenth, but its balance of energy altogether. */
static tlsph_material material_of(const bench_case *c) {
    tlsph_material m = scene_paper_material(c->metal ? TLSPH_VON_MISES : TLSPH_MEE);
    m.yield_stress = m.young;
    return m;
}

static void create_scene(bench_case *c, const tlsph_cloud *cloud, int threads) {
    const tlsph_material material = material_of(c);
    const tlsph_desc desc = describe(c, cloud, &material, threads);
    const double begin = machine_clock(threads);
    tlsph_ledger ledger;
    tlsph_error error;
    if (tlsph_create(&desc, &c->solver, &error) != TLSPH_OK) { fail(c, error.message); return; }
    c->creation = fmin(c->creation, machine_clock(threads) - begin);
    c->count = (double)tlsph_count(c->solver);
    tlsph_size_read(c->solver, &c->size);
    c->bytes = bound_bytes(c->solver);
    c->flops = bound_flops(c->solver);
    if (set_motion(c, cloud, &material) != TLSPH_OK) fail(c, "could not set the motion");
    tlsph_ledger_reset(c->solver);
    tlsph_ledger_read(c->solver, &ledger);
    c->kinetic = ledger.kinetic_energy;
}

static void time_steps(bench_case *c, int steps, int threads) {
    for (int i = 0; i < steps && !c->failed; i++) {
        const double begin = machine_clock(threads);
        if (tlsph_step(c->solver, (tlsph_real)HUGE_VAL) != TLSPH_OK) fail(c, tlsph_last_error(c->solver)->message);
        else c->step = fmin(c->step, machine_clock(threads) - begin);
    }
}

static void read_balance(bench_case *c) {
    tlsph_ledger ledger;
    tlsph_ledger_read(c->solver, &ledger);
    c->residual = fmax(c->residual, fabs(ledger.energy_residual) / c->kinetic);
    if (!isfinite(ledger.energy_residual)) fail(c, "the energy is not finite");
}

static void visit(bench *b, bench_case *c, int steps, int keep) {
    if (c->failed) return;
    if (!c->solver) create_scene(c, b->clouds + (c->dimension - 2), b->threads);
    if (!c->failed) time_steps(c, steps, b->threads);
    if (!c->failed) read_balance(c);
    if (keep && !c->failed) return;
    tlsph_destroy(c->solver);
    c->solver = NULL;
}

/* ---- all scenes of one scale ---- */

static int create_clouds(bench *b, const bench_scale *scale) {
    for (int i = 0; i < 2; i++) {
        tlsph_fill fill = tlsph_fill_default(i + 2);
        tlsph_error error;
        for (int k = 0; k < i + 2; k++) fill.size[k] = 1;
        fill.spacing = (tlsph_real)(1.0 / scale->cells[i]);
        if (tlsph_cloud_create(&fill, b->clouds + i, &error) == TLSPH_OK) continue;
        puts(error.message);
        return 1;
    }
    return 0;
}

static int run_rounds(bench *b, const bench_scale *scale) {
    const double deadline = ex_seconds() + scale->seconds;
    int round = 0;
    for (int i = 0; i < b->case_count; i++) b->cases[i].creation = b->cases[i].step = HUGE_VAL;
    for (; round < scale->least || (round < scale->most && ex_seconds() < deadline); round++)
        for (int i = 0; i < b->case_count; i++) visit(b, b->cases + i, scale->steps, scale->keep);
    for (int i = 0; i < b->case_count; i++) tlsph_destroy(b->cases[i].solver);
    return round;
}

/* ---- figures ---- */

static double ns_per_particle(const bench_case *c) { return 1e9 * c->step / STAGES / c->count; }
static double ns_per_pair(const bench_case *c) { return 1e9 * c->step / STAGES / (double)c->size.pairs; }
/* ns that the bytes and the flops take at least, and the share of the longer in the time. */
static double bound_memory(const bench *b, const bench_case *c) { return c->bytes / b->triad; }
static double bound_arithmetic(const bench *b, const bench_case *c) { return c->flops / b->peak; }
static double bound_share(const bench *b, const bench_case *c) {
    return fmax(bound_memory(b, c), bound_arithmetic(b, c)) / ns_per_particle(c);
}
static const char *label(const bench_case *c) { return c->variant[0] ? c->variant + 1 : "-"; }

static void show_table(const bench *b, const bench_scale *scale, int rounds) {
    printf("\nunknowns nb. %-15s particles ns/part. ns/pair  B/part. B/pair creation   energy", "variant");
    printf("   moved flops  bound share\n");
    for (int i = 0; i < b->case_count; i++) {
        const bench_case *c = b->cases + i;
        const double bytes = (double)c->size.bytes / c->count;
        if (c->failed) continue;
        printf("%-8s %3d %-15s %9.0f %8.1f %7.2f ", unknowns_name(c->unknowns), c->neighbours, label(c), c->count,
               ns_per_particle(c), ns_per_pair(c));
        printf("%8.0f %6d %8.1f %8.1e", bytes, (int)c->size.bytes_per_pair, c->creation / c->step, c->residual);
        if (c->bytes > 0)
            printf(" %7.0f %5.0f %5.0f %c %4.0f%%", c->bytes, c->flops, bound_share(b, c) * ns_per_particle(c),
                   bound_memory(b, c) > bound_arithmetic(b, c) ? 'm' : 'f', 100 * bound_share(b, c));
        puts("");
    }
    printf("ns: of one right-hand side, least of %d rounds of %d steps. B/part.: memory of the solver with pairs.\n"
           "creation: in steps. energy: residual / kinetic. moved, flops: bytes and operations of one right-hand side\n"
           "at least; bound: the ns of the slower at %.1f GB/s (m) or %.0f Gflop/s (f). share: bound / ns.\n\n",
           rounds, scale->steps, b->triad, b->peak);
}

static void case_result(const bench_case *c, const char *begin, const char *suffix, const char *end, double value,
                        const char *unit) {
    char key[128];
    snprintf(key, sizeof key, "%s_%s_" PRECISION "_%d%s%s%s", begin, unknowns_name(c->unknowns), c->neighbours,
             c->variant, suffix, end);
    ex_result(key, value, unit);
}

/* Memory, creation and bounds for the plain cases only; the table has the others, too. */
static void show_results(const bench *b, const char *suffix) {
    for (int i = 0; i < b->case_count; i++) {
        const bench_case *c = b->cases + i;
        if (!c->failed) case_result(c, "rhs", suffix, "_ns_per_particle", ns_per_particle(c), "ns");
    }
    for (int i = 0; i < b->case_count; i++) {
        const bench_case *c = b->cases + i;
        if (c->failed || (c->variant[0] && c->dimension == 3)) continue;
        case_result(c, "bytes", suffix, "_per_particle", (double)c->size.bytes_per_particle, "B");
        case_result(c, "bytes", suffix, "_per_pair", (double)c->size.bytes_per_pair, "B");
        case_result(c, "creation", suffix, "_steps", c->creation / c->step, "steps");
        case_result(c, "bound", suffix, "_reached", 100 * bound_share(b, c), "%");
    }
}

/* A particle in 2-D against one in 3-D with the same support. */
static void show_dimensions(const bench *b, const char *suffix) {
    for (int wide = 0; wide < 2; wide++) {
        const bench_case *flat = find_case(b, wide ? 8 : 4, "_2d"), *solid = find_case(b, wide ? 26 : 6, "");
        if (!flat || !solid || flat->failed || solid->failed) continue;
        case_result(flat, "cost", suffix, wide ? "_over_3d_26" : "_over_3d_6",
                    ns_per_particle(flat) / ns_per_particle(solid), "");
    }
}

static void write_rows(const bench *b) {
    for (int i = 0; i < b->case_count && b->csv.file; i++) {
        const bench_case *c = b->cases + i;
        if (c->failed) continue;
        fprintf(b->csv.file, "%s," PRECISION ",%d,%d,%.0f,%s,%d,", unknowns_name(c->unknowns), c->dimension,
                c->neighbours, c->count, label(c), b->threads);
        fprintf(b->csv.file, "%.6g,%.6g,%d,%d,", ns_per_particle(c), ns_per_pair(c), (int)c->size.bytes_per_particle,
                (int)c->size.bytes_per_pair);
        fprintf(b->csv.file, "%.0f,%.6g,%.6g,%.3g,", (double)c->size.bytes, c->creation, c->step, c->residual);
        fprintf(b->csv.file, "%.6g,%.6g\n", bound_memory(b, c), bound_arithmetic(b, c));
    }
}

static void check_below(const char *name, const char *suffix, double value, double limit) {
    char key[64];
    snprintf(key, sizeof key, "%s%s", name, suffix);
    ex_check_below(key, value, limit);
}

/* No error, the neighbours that the keys promise, and the energy in balance. */
static void check_physics(const bench *b, const char *suffix) {
    double isothermal = 0, energy = 0;
    int errors = 0, strange = 0;
    for (int i = 0; i < b->case_count; i++) {
        const bench_case *c = b->cases + i;
        double *worst = c->thermal == TLSPH_ENERGY ? &energy : &isothermal;
        *worst = fmax(*worst, c->residual);
        errors += c->failed;
        strange += c->size.neighbours_most != (size_t)c->neighbours;
    }
    check_below("failed_cases", suffix, errors, 0);
    check_below("cases_with_other_neighbours", suffix, strange, 0);
    check_below("energy_residual_isothermal", suffix, isothermal, TIME_SCHEME);
    check_below("energy_residual_energy", suffix, energy, BALANCE);
}

static int run_scale(bench *b, const bench_scale *scale) {
    int rounds;
    list_cases(b);
    if (create_clouds(b, scale)) return 1;
    rounds = run_rounds(b, scale);
    for (int i = 0; i < 2; i++) tlsph_cloud_destroy(b->clouds + i);
    show_table(b, scale, rounds);
    show_results(b, scale->suffix);
    show_dimensions(b, scale->suffix);
    write_rows(b);
    check_physics(b, scale->suffix);
    return 0;
}

int main(int argc, char **argv) {
    static bench b;
    int quick = 0;
    const char *output = "out/bench";
    const bench_scale large = { "_large", { 702, 78 }, 1, 3, 2, 0, 150 };
    bench_scale small = { "", { 140, 26 }, 2, 10, 3, 1, 25 };
    const ex_option options[] = {
        { "quick", EX_FLAG, &quick, "", NULL, 0, 0, "20 thousand particles only, in less than a minute" },
        { "threads", EX_INT, &b.threads, "", NULL, 1, 4096, "threads of the solver (several: wall clock)" },
        { "output", EX_TEXT, &output, "", NULL, 0, 0, "folder for bench.csv" },
    };
    b.threads = 1;
    ex_arguments(argc, argv, "bench", "time of a right-hand side, by unknowns and neighbours", options, 3);
    if (ex_csv_open(&b.csv, output, "bench.csv",
                    "unknowns,precision,dimension,neighbours,particles,variant,threads,ns_per_particle,ns_per_pair,"
                    "bytes_per_particle,bytes_per_pair,bytes,creation_s,step_s,energy_residual,bound_memory_ns,"
                    "bound_arithmetic_ns"))
        fprintf(stderr, "bench: cannot write %s/bench.csv\n", output);
    if (!quick) small.seconds = 60;
    show_machine(&b);
    ex_check_true("bench_scenes", run_scale(&b, &small) == 0);
    if (!quick) ex_check_true("bench_scenes_large", run_scale(&b, &large) == 0);
    ex_csv_close(&b.csv);
    printf("table in %s/bench.csv\n", output);
    return ex_exit_code();
}
