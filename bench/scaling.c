/*
scaling.c - memory and time by size: which arrays make up a particle, how large a body fits, what a step costs

  build/scaling [--quick] [--large]   double; build/scaling_float --memory    the memory of float

  The arrays are those of a solver that was really created, found by their addresses in its one block: what lies between
  one array and the next is its size. cost = a + b N + c pairs is fitted to the time of a step by least squares of the
  relative misfit, over bodies of several sizes with 6, 18 and 26 neighbours.
  --large: a body of 4 million particles beside those of 20 and 512 thousand, {p,F,H,J} and {p,F}, 6 neighbours, in
  smooth motion: does a particle cost the same where nothing fits into a cache? Takes 5 GB, and is skipped without;
  Linux is asked beforehand.
*/
#define TLSPH_IMPLEMENTATION
#define TLSPH_STATIC
#include "tlsph.h"

#include "examples/common/common.h"
#include "machine.h"

#ifdef TLSPH_REAL_FLOAT
#define PRECISION "float"
#else
#define PRECISION "double"
#endif
#define GIBIBYTE 1073741824.0

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

typedef struct body { tlsph_cloud cloud; tlsph_material material; tlsph_desc desc; } body;

/* Scratch memory at creation is counted here. */
typedef struct meter { size_t now, most; } meter;
static void *metered_allocate(void *user, size_t size) {
    meter *m = user;
    m->now += size;
    if (m->now > m->most) m->most = m->now;
    return malloc(size);
}
static void metered_release(void *user, void *memory, size_t size) {
    ((meter *)user)->now -= size;
    free(memory);
}

/* A cube of n cells a side; support 0.6, 0.75, 0.9: 6, 18, 26 neighbours. */
static int make_body(body *b, int n, tlsph_unknowns unknowns, tlsph_thermal thermal, double support) {
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_error error;
    for (int i = 0; i < 3; i++) fill.size[i] = 1;
    fill.spacing = 1 / (tlsph_real)n;
    if (tlsph_cloud_create(&fill, &b->cloud, &error)) { puts(error.message); return 1; }
    b->material = tlsph_material_default(thermal ? TLSPH_MIE_GRUNEISEN : TLSPH_NEO_HOOKEAN);
    b->material.density = 1000; b->material.young = 50050; b->material.poisson = (tlsph_real)0.3;
    b->material.specific_heat = 1; b->material.expansion = (tlsph_real)2.223e-4; b->material.conductivity = 10;
    b->desc = tlsph_desc_default(3);
    b->desc.particles = b->cloud.particles;
    b->desc.materials = &b->material; b->desc.material_count = 1;
    b->desc.unknowns = unknowns; b->desc.thermal = thermal;
    b->desc.support = (tlsph_real)support;
    b->desc.threads = 1;
    return 0;
}

static tlsph_solver *make_solver(body *b) {
    tlsph_solver *solver;
    tlsph_error error;
    if (tlsph_create(&b->desc, &solver, &error) == TLSPH_OK) return solver;
    puts(error.message);
    return NULL;
}

/* ---- memory of a configuration ----------------------------------------------------------------------------------- */

typedef struct memory { double block, peak, particles, pairs; } memory;

static memory weigh(body *b) {
    meter m = { 0, 0 };
    memory out = { 0, 0, 0, 0 };
    tlsph_size size;
    tlsph_error error;
    b->desc.allocator.allocate = metered_allocate;
    b->desc.allocator.release = metered_release;
    b->desc.allocator.user = &m;
    if (tlsph_measure(&b->desc, &size, &error)) { puts(error.message); return out; }
    m.now = m.most = 0;
    tlsph_solver *solver = make_solver(b);
    if (!solver) return out;
    out.block = (double)size.bytes;
    out.peak = (double)m.most;
    out.particles = (double)b->desc.particles.count;
    out.pairs = (double)size.pairs;
    tlsph_destroy(solver);
    memset(&b->desc.allocator, 0, sizeof b->desc.allocator);
    return out;
}

typedef struct configuration { const char *name; tlsph_unknowns unknowns; tlsph_thermal thermal; double support, aim; } configuration;
static const configuration configurations[] = {
    { "pF_6", TLSPH_PF, TLSPH_ISOTHERMAL, 0.6, 0 },     { "pF_26", TLSPH_PF, TLSPH_ISOTHERMAL, 0.9, 550 },
    { "pFJ_26", TLSPH_PFJ, TLSPH_ISOTHERMAL, 0.9, 0 },  { "pFHJ_6", TLSPH_PFHJ, TLSPH_ISOTHERMAL, 0.6, 0 },
    { "pFHJ_26", TLSPH_PFHJ, TLSPH_ISOTHERMAL, 0.9, 900 }, { "pFE_26", TLSPH_PF, TLSPH_ENERGY, 0.9, 0 },
    { "pFHJE_6", TLSPH_PFHJ, TLSPH_ENERGY, 0.6, 0 },    { "pFHJE_26", TLSPH_PFHJ, TLSPH_ENERGY, 0.9, 0 } };

static void weigh_all(int n, FILE *csv) {
    printf("\nmemory, " PRECISION ", cube of %d cells a side\n%-10s %10s %10s %8s %12s %14s %12s\n", n, "unknowns", "B/particle",
           "of pairs", "aim", "peak at cr.", "in 16 GiB [1e6]", "at creation");
    fprintf(csv, "configuration,bytes_per_particle,bytes_of_pairs,aim,peak_per_particle,particles_in_16GiB\n");
    for (size_t i = 0; i < sizeof configurations / sizeof *configurations; i++) {
        const configuration *c = &configurations[i];
        const double aim = c->aim * (double)sizeof(tlsph_real) / 8;
        body b;
        memory m;
        char key[64];
        tlsph_size size;
        if (make_body(&b, n, c->unknowns, c->thermal, c->support)) return;
        m = weigh(&b);
        tlsph_measure(&b.desc, &size, NULL);
        const double each = m.block / m.particles, pairs = (double)size.bytes_per_pair * m.pairs / m.particles;
        printf("%-10s %10.0f %10.0f %8.0f %12.0f %14.1f %12.1f\n", c->name, each, pairs, aim, m.peak / m.particles,
               16e-6 * GIBIBYTE / each, 16e-6 * GIBIBYTE * m.particles / m.peak);
        fprintf(csv, "%s,%.1f,%.1f,%.0f,%.1f,%.0f\n", c->name, each, pairs, aim, m.peak / m.particles, 16 * GIBIBYTE / each);
        snprintf(key, sizeof key, "memory_%s_%s_per_particle", c->name, PRECISION);
        ex_result(key, each, "B");
        tlsph_cloud_destroy(&b.cloud);
    }
}

/* ---- array by array ---------------------------------------------------------------------------------------------- */

typedef struct array { const char *name; const void *at; int place; } array;

static int by_address(const void *a, const void *b) {
    const char *x = ((const array *)a)->at, *y = ((const array *)b)->at;
    return x < y ? -1 : x > y ? 1 : ((const array *)a)->place - ((const array *)b)->place;
}

/* Of names for one array the last counts. */
#define ARRAYS(EACH)                                                                                                  \
    EACH(materials) EACH(material_of) EACH(beside) EACH(block) EACH(body) EACH(host) EACH(inner) EACH(V) EACH(B_of)   \
    EACH(B) EACH(tau) EACH(now_memory) EACH(old_memory) EACH(rate_p) EACH(row) EACH(rate_F) EACH(rate_J)              \
    EACH(rate_E) EACH(held) EACH(M_of) EACH(M) EACH(fix) EACH(mirror) EACH(mirror_of) EACH(load)                      \
    EACH(found) EACH(damped_first) EACH(first) EACH(damped_neighbour) EACH(neighbour) EACH(damped_g) EACH(g)          \
    EACH(image) EACH(graph.first) EACH(graph.slot) EACH(graph.gathered) EACH(graph.pattern)

/* Of the whole tiles, the share whose state is evaluated by lanes. Were it less than 1 on a lattice, results would be right
   all the same, and slow. */
static double share_by_lanes(tlsph_solver *s) {
    size_t whole = 0, by_lanes = 0;
    for (size_t i = 0; i < s->blocks; i++)
        for (size_t begin = s->block[i].begin, end; begin < s->block[i].end; begin = end) {
            end = tlsphi_tile_end(s->block + i, begin);
            whole += end - begin == TLSPHI_LANES;
            by_lanes += tlsphi_count_tiles(s, s->block + i, begin) > 0;
        }
    return (double)by_lanes / (double)whole;
}

static void list_arrays(int n, tlsph_unknowns unknowns, tlsph_thermal thermal, const char *name, FILE *csv) {
    body b;
    tlsph_solver *s;
    array all[64];
    int count = 0;
    if (make_body(&b, n, unknowns, thermal, 0.9) || !(s = make_solver(&b))) return;
#define ADD(field) all[count].name = #field; all[count].place = count; all[count++].at = s->field;
    ARRAYS(ADD)
#undef ADD
    all[count].name = "end"; all[count].place = count;
    all[count++].at = (const char *)s->memory + s->memory_size;
    qsort(all, (size_t)count, sizeof *all, by_address);
    printf("\n%s, 26 neighbours, bytes a particle:", name);
    for (int i = 0; i + 1 < count; i++) {
        double bytes;
        if (!all[i].at || all[i].at == all[i + 1].at) continue; /* absent, or another name of the next */
        bytes = (double)((const char *)all[i + 1].at - (const char *)all[i].at) / (double)s->n;
        if (bytes < 0.5) continue;
        printf(" %s %.0f,", all[i].name, bytes);
        fprintf(csv, "%s,%s,%.2f\n", name, all[i].name, bytes);
    }
    printf(" in all %.0f\n", (double)s->size.bytes / (double)s->n);
    ex_check("tiles_by_lanes", share_by_lanes(s), 1, 0);
    tlsph_destroy(s);
    tlsph_cloud_destroy(&b.cloud);
}

/* ---- time: a + b N + c pairs ------------------------------------------------------------------------------------- */

enum { SIZES = 6, SUPPORTS = 3, SAMPLES = SIZES * SUPPORTS };
typedef struct sample { double particles, pairs, step, creation; tlsph_solver *solver; body b; } sample;

static int create_sample(sample *s, int n, double support) {
    double begin;
    if (make_body(&s->b, n, TLSPH_PFHJ, TLSPH_ISOTHERMAL, support)) return 1;
    begin = ex_cpu_seconds();
    s->solver = make_solver(&s->b);
    s->creation = ex_cpu_seconds() - begin;
    s->step = HUGE_VAL;
    s->particles = (double)s->b.desc.particles.count;
    if (s->solver) s->pairs = (double)s->solver->pairs;
    return !s->solver;
}

/* Several steps where one is shorter than the clock can tell. */
static void time_sample(sample *s) {
    const int steps = 1 + (int)(2e4 / s->particles);
    const double begin = ex_cpu_seconds();
    for (int i = 0; i < steps; i++) tlsph_step(s->solver, (tlsph_real)HUGE_VAL);
    s->step = fmin(s->step, (ex_cpu_seconds() - begin) / steps);
}

/* Weighted normal equations of a + b N + c pairs, by Cramer's rule. */
static void fit(const sample *s, int count, double x[3]) {
    double A[9] = { 0 }, r[3] = { 0 }, unit[3] = { 1, 1e4, 1e5 }, det;
    for (int i = 0; i < count; i++) {
        const double f[3] = { 1 / s[i].step, s[i].particles / unit[1] / s[i].step, s[i].pairs / unit[2] / s[i].step };
        for (int j = 0; j < 3; j++) {
            r[j] += f[j];
            for (int k = 0; k < 3; k++) A[3 * j + k] += f[j] * f[k];
        }
    }
    tlsph_real full[9], part[9];
    for (int i = 0; i < 9; i++) full[i] = (tlsph_real)A[i];
    det = (double)tlsph_determinant(full);
    for (int c = 0; c < 3; c++) {
        memcpy(part, full, sizeof part);
        for (int j = 0; j < 3; j++) part[3 * j + c] = (tlsph_real)r[j];
        x[c] = (double)tlsph_determinant(part) / det / unit[c];
    }
}

static void model_time(int quick, FILE *csv) {
    static const int sizes[SIZES] = { 4, 8, 14, 24, 40, 64 };
    static const double supports[SUPPORTS] = { 0.6, 0.75, 0.9 };
    static sample s[SAMPLES];
    const int count = (quick ? SIZES - 2 : SIZES) * SUPPORTS;
    double x[3], worst = 0, begin = ex_seconds();
    for (int i = 0; i < count; i++) if (create_sample(&s[i], sizes[i / SUPPORTS], supports[i % SUPPORTS])) return;
    for (int round = 0; round < 30 && (round < 3 || ex_seconds() - begin < (quick ? 20 : 120)); round++)
        for (int i = 0; i < count; i++) time_sample(&s[i]);
    fit(s, count, x);
    printf("\n{p,F,H,J} isothermal, two-stage step, one thread\n%10s %8s %12s %14s %12s %14s\n", "particles", "pairs/p.", "step [s]",
           "ns/p. and rhs", "model", "creation/steps");
    fprintf(csv, "particles,pairs,step_s,model_s,creation_s\n");
    for (int i = 0; i < count; i++) {
        const double model = x[0] + x[1] * s[i].particles + x[2] * s[i].pairs;
        worst = fmax(worst, fabs(model / s[i].step - 1));
        printf("%10.0f %8.2f %12.4g %14.1f %11.1f%% %14.1f\n", s[i].particles, s[i].pairs / s[i].particles, s[i].step,
               5e8 * s[i].step / s[i].particles, 100 * (model / s[i].step - 1), s[i].creation / s[i].step);
        fprintf(csv, "%.0f,%.0f,%.6g,%.6g,%.6g\n", s[i].particles, s[i].pairs, s[i].step, model, s[i].creation);
        tlsph_destroy(s[i].solver);
        tlsph_cloud_destroy(&s[i].b.cloud);
    }
    ex_result("cost_a", 1e6 * x[0], "us_per_step");
    ex_result("cost_b", 5e8 * x[1], "ns_per_particle_and_rhs");
    ex_result("cost_c", 5e8 * x[2], "ns_per_pair_and_rhs");
    ex_result("cost_largest_misfit", 100 * worst, "%");
}

/* ---- time of large bodies ---------------------------------------------------------------------------------------- */

/* Bytes that a program can still have; HUGE_VAL where the system does not tell. malloc alone does not: systems lend
   more than they have. */
static double memory_left(void) {
    FILE *file = fopen("/proc/meminfo", "r");
    char line[128];
    double kibibytes = 0, left = HUGE_VAL;
    while (file && left == HUGE_VAL && fgets(line, sizeof line, file))
        if (sscanf(line, "MemAvailable: %lf", &kibibytes) == 1) left = 1024 * kibibytes;
    if (file) fclose(file);
    return left;
}

#define BYTES_LARGE 1200.0 /* a particle takes while it is created, with its place in the cloud; less in float */

/* A cube of n cells a side that swings by a thousandth of the speed of its shear waves. */
static int create_large(sample *s, int n, tlsph_unknowns unknowns) {
    if (BYTES_LARGE * pow(n + 1, 3) > memory_left() || make_body(&s->b, n, unknowns, TLSPH_ISOTHERMAL, 0.6)) return 1;
    const size_t count = s->b.desc.particles.count;
    const double speed = 1e-3 * sqrt(50050 / 2.6 / 1000), pi = 3.14159265358979324;
    tlsph_real *v = calloc(3 * count, sizeof *v);
    s->step = HUGE_VAL;
    s->particles = (double)count;
    s->solver = v ? make_solver(&s->b) : NULL;
    for (size_t i = 0; s->solver && i < 3 * count; i++) {
        const tlsph_real *X = s->b.cloud.particles.positions + i / 3 * 3;
        double value = speed;
        for (size_t k = 0; k < 3; k++) value *= k == i % 3 ? sin(pi * (double)X[k]) : cos(pi * (double)X[k]);
        v[i] = (tlsph_real)value;
    }
    if (s->solver) tlsph_write(s->solver, TLSPH_FIELD_VELOCITY, v);
    free(v);
    return !s->solver;
}

static void destroy_large(sample *s) {
    tlsph_destroy(s->solver);
    tlsph_cloud_destroy(&s->b.cloud);
}

/* In turn, the least of each. */
static void time_large(const char *name, tlsph_unknowns unknowns, FILE *csv) {
    static const int cells[3] = { 26, 79, 159 };
    sample s[3];
    char key[64];
    int count = 0;
    memset(s, 0, sizeof s);
    while (count < 3 && !create_large(&s[count], cells[count], unknowns)) count++;
    if (count < 3) {
        printf("%s: skipped, no memory for %.0f thousand particles\n", name, pow(cells[count] + 1, 3) / 1000);
        destroy_large(&s[count]);
    }
    const double begin = ex_seconds();
    for (int round = 0; count == 3 && round < 20 && (round < 3 || ex_seconds() - begin < 40); round++)
        for (int i = 0; i < count; i++) time_sample(&s[i]);
    for (int i = 0; count == 3 && i < count; i++) {
        const double each = 5e8 * s[i].step / s[i].particles;
        fprintf(csv, "%s,%.0f,%.6g\n", name, s[i].particles, each);
        snprintf(key, sizeof key, "large_%s_%s_%.0f_thousand", name, PRECISION, s[i].particles / 1000);
        ex_result(key, each, "ns_per_particle_and_rhs");
    }
    snprintf(key, sizeof key, "large_%s_%s_largest_over_smallest", name, PRECISION);
    if (count == 3) ex_result(key, s[2].step / s[2].particles / (s[0].step / s[0].particles), "1");
    for (int i = 0; i < count; i++) destroy_large(&s[i]);
}

int main(int argc, char **argv) {
    int quick = 0, only_memory = 0, large = 0;
    const char *folder = "out/bench";
    char path[512];
    FILE *csv;
    const ex_option options[] = { { "quick", EX_FLAG, &quick, NULL, NULL, 0, 0, "up to 16 thousand particles" },
                                  { "memory", EX_FLAG, &only_memory, NULL, NULL, 0, 0, "no times but those of --large" },
                                  { "large", EX_FLAG, &large, NULL, NULL, 0, 0,
                                    "4 million particles beside 20 and 512 thousand, 5 GB" },
                                  { "output", EX_TEXT, &folder, NULL, NULL, 0, 0, "folder for scaling_<precision>.csv" } };
    ex_arguments(argc, argv, "scaling", "memory and time by size", options, 4);
    snprintf(path, sizeof path, "%s/scaling_%s.csv", folder, PRECISION);
    if (ex_make_directory(folder) || !(csv = fopen(path, "w"))) { fprintf(stderr, "scaling: cannot write %s\n", path); return 1; }
    machine_print();
    weigh_all(40, csv);
    fprintf(csv, "configuration,array,bytes_per_particle\n");
    list_arrays(40, TLSPH_PF, TLSPH_ISOTHERMAL, "pF", csv);
    list_arrays(40, TLSPH_PFHJ, TLSPH_ISOTHERMAL, "pFHJ", csv);
    list_arrays(40, TLSPH_PFHJ, TLSPH_ENERGY, "pFHJE", csv);
    if (!only_memory) model_time(quick, csv);
    if (large) {
        printf("\nlarge bodies, isothermal, 6 neighbours, one thread\n");
        fprintf(csv, "unknowns,particles,ns_per_particle_and_rhs\n");
        time_large("pFHJ", TLSPH_PFHJ, csv);
        time_large("pF", TLSPH_PF, csv);
    }
    fclose(csv);
    return ex_exit_code();
}
