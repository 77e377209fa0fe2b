/*
study.c - accuracy against price: which choices are worth their time

  build/study [--full] [--scene NAME] [--output FOLDER]     one pass: runs every case once, adds a line each to runs.csv
  build/study_float ...                                     the same in float, into the same file
  build/study --report                                      reads runs.csv: study.csv, prices.csv, tables, pictures, checks
  build/study --references                                  converged runs for the scenes without an exact solution (minutes)

bench/study.sh alternates passes of both precisions and reports. A case keeps its least time of all passes, so that what
else runs on the machine, which comes and goes, cancels; its results must be the same to the last bit in each of them.
Times are processor times of one thread. A run counts only if its physics is right: balances of the ledger, det F > 0,
error below a bound (see runs.c for scenes and errors).
*/
#include "study.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define REFERENCES "bench/references.csv"

/* ---- what is compared -------------------------------------------------------------------------------------------- */

enum { ON_THERMAL = 1, ON_ISOTHERMAL = 2, ON_ALL = 3, NOT_BLOCK = 4 };

/* A row of the price table: a configuration against another that lacks one thing. */
typedef struct choice { const char *configuration, *base, *text; int where; } choice;
static const choice choices[] = {
    { "J", "", "J", ON_ALL }, { "H", "", "H", ON_ALL }, { "HJ", "", "H and J", ON_ALL },
    { "E", "", "E", ON_ISOTHERMAL }, { "eta", "", "entropy instead of E", ON_THERMAL },
    { "unprojected", "", "no projection", ON_ALL },
    { "first", "", "no reconstruction", ON_ALL }, { "unlimited", "", "no limiter", ON_ALL },
    { "adjoint", "", "self-adjoint reconstruction", ON_ALL },
    { "ssprk3 adjoint", "ssprk3", "self-adjoint, SSP RK3", ON_ALL },
    { "undamped", "", "no dissipation", ON_ALL }, { "jst", "", "JST dissipation", ON_ALL },
    { "26", "", "26 neighbours, quadratic kernel", ON_ALL },
    { "26 cubic", "26", "cubic for quadratic kernel", ON_ALL }, { "26 wendland", "26", "Wendland C2 for quadratic kernel", ON_ALL },
    { "26 W1", "26", "kernel corrected to order 1", ON_ALL | NOT_BLOCK }, { "26 bond", "26 W1", "bond-based gradient", ON_ALL | NOT_BLOCK },
    { "cells", "", "cells for the corrected kernel", ON_ALL | NOT_BLOCK },
    { "sharp", "", "sharp gradients", ON_ALL }, { "sharp rk3", "rk3", "sharp gradients with rk3", ON_ALL },
    { "cells4 rk3", "rk3", "cells of order 4 with rk3", ON_ALL },
    { "cfl0.4", "", "CFL 0.4 for 0.3", ON_ALL }, { "ssprk3", "", "SSP RK3 at CFL 0.5", ON_ALL },
    { "rk3", "", "rk3: dissipation once, CFL 0.5", ON_ALL }, { "rk4", "", "rk4: dissipation once, CFL 0.5", ON_ALL },
    { "leapfrog", "", "leapfrog, CFL 0.5", ON_ALL },
    { "double", "", "double-gradient conduction", ON_THERMAL }, { "split", "", "conduction in 9 stages of its own", ON_THERMAL } };
static const choice in_float[] = { { "", "", "float", ON_ALL }, { "26", "26", "float with 26 neighbours", ON_ALL },
                                   { "sharp rk3", "sharp rk3", "float with sharp rk3", ON_ALL } };
enum { CHOICES = sizeof choices / sizeof *choices, IN_FLOAT = sizeof in_float / sizeof *in_float };

/* Run at several resolutions for the fronts; the full study crosses operators, steps, dissipation and unknowns. */
static const char *const candidates[] = { "", "fast", "balanced", "accurate", "sharp rk3 split", "sharp rk4 split",
                                          "adjoint", "ssprk3 adjoint" };
enum { CANDIDATES = sizeof candidates / sizeof *candidates };
static const char *const operators[] = { "", "sharp", "cells4", "26", "26 cubic" };
static const char *const integrators[] = { "", "ssprk3", "rk3", "rk4", "leapfrog" };
static const char *const dissipations[] = { "", "unlimited", "first", "adjoint" };
static const char *const unknowns[] = { "", "J", "HJ" };

static int applies(const choice *c, study_scene scene) {
    if (scene == STUDY_BLOCK && c->where & NOT_BLOCK) return 0;
    return c->where & (study_scenes[scene].thermal ? ON_THERMAL : ON_ISOTHERMAL);
}

/* ---- one pass ---------------------------------------------------------------------------------------------------- */

static const char row_heading[] = "scene,n,configuration,precision,particles,steps,cpu_s,error,momentum,angular,energy,oscillation,ok\n";

static void write_row(FILE *file, const study_run *r) {
    fprintf(file, "%s,%d,%s,%s,%.0f,%.0f,%.6g,%.17g,", study_scenes[r->scene].name, r->n,
            r->configuration[0] ? r->configuration : "base", r->precision, r->particles, r->steps, r->cpu, r->error);
    fprintf(file, "%.3g,%.3g,%.3g,%.4g,%d\n", r->momentum, r->angular, r->energy, r->oscillation, r->ok);
}

/* Short runs are repeated for their least time; times under a millisecond or so would be the clock's. */
static void visit(FILE *file, study_scene scene, int n, const char *configuration) {
    study_run best, again;
    double spent;
    study_measure(scene, n, configuration, &best);
    spent = best.cpu;
    for (int i = 0; i < 4 && spent < 0.1; i++) {
        study_measure(scene, n, configuration, &again);
        best.cpu = fmin(best.cpu, again.cpu);
        spent += again.cpu;
    }
    write_row(file, &best);
    fflush(file);
}

static void visit_cross(FILE *file, study_scene scene, int n) {
    const int all = scene == STUDY_CUBE && n < study_scenes[scene].n[2]; /* elsewhere the dissipation is left limited */
    for (int o = 0; o < 5; o++)
        for (int i = 0; i < 5; i++)
            for (int d = 0; d < (all ? 4 : 1); d++)
                for (int u = 0; u < 3; u++) {
                    char text[64];
                    if (!strcmp(operators[o], "cells4") && i < 1) continue; /* two stages amplify it */
                    if (d == 3 && (i > 1 || o == 1 || o == 2)) continue; /* refused, see tlsph_dissipation */
                    if (!all && u == 1) continue;
                    snprintf(text, sizeof text, "%s %s %s %s", operators[o], integrators[i], dissipations[d], unknowns[u]);
                    for (char *at = text; *at;) /* single blanks between words, none at the ends */
                        if (*at == ' ' && (at == text || at[1] == ' ' || !at[1])) memmove(at, at + 1, strlen(at));
                        else at++;
                    visit(file, scene, n, text);
                }
}

static void pass_scene(FILE *file, study_scene scene, int full) {
    const study_info *info = &study_scenes[scene];
    const int in_double = sizeof(tlsph_real) == 8, count = in_double ? CHOICES : IN_FLOAT;
    for (int i = 0; i < count; i++) {
        const choice *c = in_double ? &choices[i] : &in_float[i];
        if (applies(c, scene)) visit(file, scene, info->n[0], c->configuration);
    }
    for (int k = 0; k < (full ? 3 : 2); k++)
        for (int i = 0; i < CANDIDATES; i++) visit(file, scene, info->n[k], candidates[i]);
    for (int k = 0; full && k < 3; k++) visit_cross(file, scene, info->n[k]);
}

static int pass(const char *folder, int full, int only) {
    char path[512];
    FILE *file;
    long end;
    snprintf(path, sizeof path, "%s/runs.csv", folder);
    if (study_references_read(REFERENCES)) { fprintf(stderr, "study: cannot read " REFERENCES "\n"); return 1; }
    if (ex_make_directory(folder) || !(file = fopen(path, "a"))) { fprintf(stderr, "study: cannot write %s\n", path); return 1; }
    fseek(file, 0, SEEK_END);
    end = ftell(file);
    if (end <= 0) fputs(row_heading, file);
    for (int i = 0; i < STUDY_SCENES; i++)
        if (only == 0 || only == i + 1) pass_scene(file, (study_scene)i, full);
    return fclose(file);
}

/* ---- merged runs ------------------------------------------------------------------------------------------------- */

enum { RUNS_MOST = 8192 };
typedef struct table { study_run run[RUNS_MOST]; int count, passes[RUNS_MOST], front[RUNS_MOST], unlike; } table;

static study_run *find(table *t, study_scene scene, int n, const char *configuration, const char *precision) {
    for (int i = 0; i < t->count; i++) {
        study_run *r = &t->run[i];
        if (r->scene == scene && r->n == n && !strcmp(r->configuration, configuration) && !strcmp(r->precision, precision))
            return r;
    }
    return NULL;
}

static void merge(table *t, const study_run *r) {
    study_run *same = find(t, r->scene, r->n, r->configuration, r->precision);
    if (!same) {
        if (t->count == RUNS_MOST) return;
        t->run[t->count] = *r;
        t->passes[t->count++] = 1;
        return;
    }
    t->passes[same - t->run]++;
    if (same->error < r->error || same->error > r->error) t->unlike++;
    same->cpu = fmin(same->cpu, r->cpu);
}

static int read_runs(const char *folder, table *t) {
    char path[512], line[512];
    FILE *file;
    snprintf(path, sizeof path, "%s/runs.csv", folder);
    if (!(file = fopen(path, "r"))) { fprintf(stderr, "study: cannot read %s\n", path); return 1; }
    while (fgets(line, sizeof line, file)) {
        study_run r;
        char scene[32];
        memset(&r, 0, sizeof r);
        if (sscanf(line, "%31[^,],%d,%47[^,],%7[^,],%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%d", scene, &r.n, r.configuration,
                   r.precision, &r.particles, &r.steps, &r.cpu, &r.error, &r.momentum, &r.angular, &r.energy,
                   &r.oscillation, &r.ok) != 13) continue; /* the heading */
        if (!strcmp(r.configuration, "base")) r.configuration[0] = 0;
        for (int i = 0; i < STUDY_SCENES; i++)
            if (!strcmp(study_scenes[i].name, scene)) { r.scene = (study_scene)i; merge(t, &r); }
    }
    fclose(file);
    return 0;
}

static int has_word(const study_run *r, const char *word) { return strstr(r->configuration, word) != NULL; }

/* On the front: no other run that counts is faster and as accurate within 2 %. Without dissipation nothing is a choice: a
   longer run would end. */
static void mark_front(table *t) {
    for (int i = 0; i < t->count; i++) {
        t->front[i] = t->run[i].ok && !has_word(&t->run[i], "undamped");
        for (int k = 0; k < t->count && t->front[i]; k++) {
            const study_run *a = &t->run[i], *b = &t->run[k];
            if (b->scene == a->scene && b->ok && !has_word(b, "undamped") && b->cpu < a->cpu && b->error <= 1.02 * a->error)
                t->front[i] = 0;
        }
    }
}

static int by_time(const void *a, const void *b) {
    const double x = (*(const study_run *const *)a)->cpu, y = (*(const study_run *const *)b)->cpu;
    return x < y ? -1 : x > y;
}

/* Runs of a scene that count, in order of their time; only those on the front if asked. Returns how many. */
static int sorted(table *t, study_scene scene, int front, study_run **out) {
    int count = 0;
    for (int i = 0; i < t->count; i++)
        if (t->run[i].scene == scene && t->run[i].ok && (!front || t->front[i])) out[count++] = &t->run[i];
    qsort(out, (size_t)count, sizeof *out, by_time);
    return count;
}

static const char *label(const study_run *r) {
    static char text[96];
    snprintf(text, sizeof text, "%s%s%s, n = %d", r->configuration[0] ? r->configuration : "base",
             r->precision[0] == 'f' ? " " : "", r->precision[0] == 'f' ? "float" : "", r->n);
    return text;
}

/* ---- tables ------------------------------------------------------------------------------------------------------ */

static void write_table(const char *folder, const table *t) {
    char path[512];
    FILE *file;
    snprintf(path, sizeof path, "%s/study.csv", folder);
    if (!(file = fopen(path, "w"))) return;
    fprintf(file, "front,passes,%s", row_heading);
    for (int i = 0; i < t->count; i++) {
        fprintf(file, "%d,%d,", t->front[i], t->passes[i]);
        write_row(file, &t->run[i]);
    }
    fclose(file);
}

static void print_front(table *t, study_scene scene) {
    static study_run *list[RUNS_MOST];
    const int count = sorted(t, scene, 1, list);
    printf("\n%s: front of error (%s) against time\n%12s %12s %10s  %s\n", study_scenes[scene].title,
           study_scenes[scene].measure, "cpu [s]", "error", "energy", "run");
    for (int i = 0; i < count; i++)
        printf("%12.4g %12.3e %10.1e  %s\n", list[i]->cpu, list[i]->error, list[i]->energy, label(list[i]));
}

/* Time and error of `configuration` by those of `base`; 0 where one is missing or does not count. */
static int compare(table *t, study_scene scene, const char *configuration, const char *base, const char *precision,
                   double out[3]) {
    const int n = study_scenes[scene].n[0];
    const study_run *a = find(t, scene, n, configuration, precision), *b = find(t, scene, n, base, "double");
    if (!a || !b || !(a->error < HUGE_VAL) || !(b->error > 0)) return 0;
    out[0] = a->cpu / b->cpu;
    out[1] = a->error / b->error;
    out[2] = a->oscillation / b->oscillation;
    return a->ok ? 1 : 2;
}

static void price_row(table *t, FILE *csv, const choice *c, const char *precision) {
    printf("%-34s", c->text);
    fprintf(csv, "%s,%s,%s", c->text, c->configuration[0] ? c->configuration : "base", c->base[0] ? c->base : "base");
    for (int s = 0; s < STUDY_SCENES; s++) {
        double r[3];
        const int found = applies(c, (study_scene)s) ? compare(t, (study_scene)s, c->configuration, c->base, precision, r) : 0;
        if (!found) { printf("  %14s", "-"); fprintf(csv, ",,,"); continue; }
        printf("  %5.2f %7.3g%c", r[0], r[1], found == 2 ? '*' : ' ');
        fprintf(csv, ",%.4g,%.4g,%.4g", r[0], r[1], r[2]);
    }
    printf("\n");
    fprintf(csv, "\n");
}

static void print_prices(const char *folder, table *t) {
    char path[512];
    FILE *csv;
    snprintf(path, sizeof path, "%s/prices.csv", folder);
    if (!(csv = fopen(path, "w"))) return;
    printf("\nprices: time and error by those of the base ({p,F}, 6 neighbours, limited, rk2 at CFL 0.3); *: the physics is not right\n%-34s", "");
    fprintf(csv, "choice,configuration,base");
    for (int s = 0; s < STUDY_SCENES; s++) {
        printf("  %14s", study_scenes[s].name);
        fprintf(csv, ",%s_time,%s_error,%s_oscillation", study_scenes[s].name, study_scenes[s].name, study_scenes[s].name);
    }
    printf("\n");
    fprintf(csv, "\n");
    for (int i = 0; i < CHOICES; i++) price_row(t, csv, &choices[i], "double");
    for (int i = 0; i < IN_FLOAT; i++) price_row(t, csv, &in_float[i], "float");
    fclose(csv);
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

enum { GROUPS = 6, LABELS_MOST = 24 };
static const char *const groups[GROUPS] = { "6 neighbours", "26 neighbours", "sharp", "cells4", "presets", "float" };

static int group_of(const study_run *r) {
    if (r->precision[0] == 'f') return 5;
    if (has_word(r, "fast") || has_word(r, "balanced") || has_word(r, "accurate")) return 4;
    return has_word(r, "cells4") ? 3 : has_word(r, "sharp") ? 2 : has_word(r, "26") ? 1 : 0;
}

static int draw_front(const char *folder, table *t, study_scene scene) {
    static study_run *list[RUNS_MOST], *front[RUNS_MOST];
    static double x[GROUPS + 1][RUNS_MOST], y[GROUPS + 1][RUNS_MOST];
    static char texts[LABELS_MOST][96];
    const int count = sorted(t, scene, 0, list), on_front = sorted(t, scene, 1, front);
    ex_curve curves[GROUPS + 1 + LABELS_MOST];
    size_t sizes[GROUPS + 1] = { 0 };
    int used = 0;
    char path[512], title[160];
    ex_axes axes;
    memset(&axes, 0, sizeof axes);
    for (int i = 0; i < count; i++) {
        const int g = group_of(list[i]);
        x[g][sizes[g]] = list[i]->cpu;
        y[g][sizes[g]++] = list[i]->error;
    }
    for (int i = 0; i < on_front; i++) { x[GROUPS][i] = front[i]->cpu; y[GROUPS][i] = front[i]->error; sizes[GROUPS]++; }
    for (int g = 0; g <= GROUPS; g++) {
        const ex_curve curve = { g < GROUPS ? groups[g] : "front", x[g], y[g], sizes[g], g < GROUPS ? 2 : 0, g };
        if (sizes[g]) curves[used++] = curve;
    }
    for (int i = 0; i < on_front && i < LABELS_MOST; i++) {
        const ex_curve curve = { texts[i], &x[GROUPS][i], &y[GROUPS][i], 1, EX_NOTE, GROUPS };
        snprintf(texts[i], sizeof texts[i], "%s", label(front[i]));
        curves[used++] = curve;
    }
    snprintf(title, sizeof title, "%s: error against time, one thread", study_scenes[scene].title);
    axes.title = title;
    axes.x_label = "processor time [s]";
    axes.y_label = study_scenes[scene].measure;
    axes.log_x = axes.log_y = 1;
    if (count) { axes.x_low = 0.3 * list[0]->cpu; axes.x_high = 1.3 * list[count - 1]->cpu; } /* room for notes */
    snprintf(path, sizeof path, "%s/front_%s.png", folder, study_scenes[scene].name);
    return count ? ex_plot(path, 1000, 680, &axes, curves, used) : 0;
}

/* ---- report ------------------------------------------------------------------------------------------------------ */

/* Runs whose physics is not right, but for those without dissipation, which show what it is for, and cells of order 4 with
   the leapfrog, which amplifies their own modes. */
static int wrong_runs(const table *t) {
    int wrong = 0;
    for (int i = 0; i < t->count; i++) {
        const study_run *r = &t->run[i];
        if (r->ok) continue;
        printf("not right: %s %s: error %.3g, energy %.2g, momenta %.2g %.2g\n", study_scenes[r->scene].name, label(r),
               r->error, r->energy, r->momentum, r->angular);
        if (has_word(r, "undamped") || has_word(r, "first")) continue;
        wrong += !(has_word(r, "cells4") && has_word(r, "leapfrog"));
    }
    return wrong;
}

static int report(const char *folder) {
    static table t;
    if (read_runs(folder, &t)) return 1;
    mark_front(&t);
    write_table(folder, &t);
    for (int s = 0; s < STUDY_SCENES; s++) { print_front(&t, (study_scene)s); draw_front(folder, &t, (study_scene)s); }
    print_prices(folder, &t);
    printf("\n");
    ex_result("runs", t.count, "1");
    ex_check_below("runs_with_wrong_physics", wrong_runs(&t), 0);
    ex_check_below("results_that_differ_between_passes", t.unlike, 0);
    printf("tables and pictures in %s: study.csv, prices.csv, front_<scene>.png\n", folder);
    return ex_exit_code();
}

int main(int argc, char **argv) {
    int full = 0, reporting = 0, references = 0, scene = 0, n = 0;
    const char *folder = "out/bench", *configuration = NULL;
    const ex_option options[] = {
        { "full", EX_FLAG, &full, NULL, NULL, 0, 0, "crosses all choices, three resolutions" },
        { "report", EX_FLAG, &reporting, NULL, NULL, 0, 0, "tables and pictures from the runs so far" },
        { "references", EX_FLAG, &references, NULL, NULL, 0, 0, "makes " REFERENCES },
        { "scene", EX_CHOICE, &scene, NULL, "all|cube|wave|manufactured|column|block", 0, 0, "one scene only" },
        { "run", EX_TEXT, &configuration, NULL, NULL, 0, 0, "one configuration, words of bench/runs.c; with --scene and --n" },
        { "n", EX_INT, &n, NULL, NULL, 1, 512, "resolution of --run" },
        { "output", EX_TEXT, &folder, NULL, NULL, 0, 0, "folder" } };
    ex_arguments(argc, argv, "study", "error against time for every choice", options, 7);
    if (references) return study_references_write(REFERENCES);
    if (configuration && scene) {
        study_references_read(REFERENCES);
        fputs(row_heading, stdout);
        visit(stdout, (study_scene)(scene - 1), n ? n : study_scenes[scene - 1].n[0], configuration);
        return 0;
    }
    return reporting ? report(folder) : pass(folder, full, scene);
}
