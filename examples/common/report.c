/* report.c - progress on stderr, results on stdout, clocks, directories. */
#ifndef _POSIX_C_SOURCE
#define _POSIX_C_SOURCE 200809L /* isatty, mkdir, clock_gettime */
#endif
#include "common.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static int failed_checks;

double ex_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double ex_cpu_seconds(void) { return (double)clock() / CLOCKS_PER_SEC; }

void ex_progress_begin(ex_progress *p, const char *label, double t_end, int quiet) {
    p->label = label;
    p->t_end = t_end;
    p->quiet = quiet;
    p->terminal = isatty(fileno(stderr));
    p->began = ex_seconds();
    p->last_shown = -1.0;
    p->next_percent = 10;
}

static double done_fraction(const ex_progress *p, double t) {
    double fraction = p->t_end > 0.0 ? t / p->t_end : 1.0;
    return fraction > 0.0 ? fmin(fraction, 1.0) : 0.0;
}

/* The line is padded so that a shorter one covers the end of a longer one. */
static void show_line(ex_progress *p, double fraction, long step, double now) {
    double spent = now - p->began;
    double left = fraction > 0.0 ? spent * (1.0 - fraction) / fraction : 0.0;
    fprintf(stderr, "%s%s: %5.1f %%, %ld steps, %.1f s, %.1f s left%s", p->terminal ? "\r" : "", p->label,
            100.0 * fraction, step, spent, left, p->terminal ? "      " : "\n");
    fflush(stderr);
    p->last_shown = now;
}

void ex_progress_update(ex_progress *p, double t, long step) {
    double fraction = done_fraction(p, t);
    double now;
    if (p->quiet) return;
    if (!p->terminal && 100.0 * fraction < p->next_percent) return;
    now = ex_seconds();
    if (p->terminal && now - p->last_shown < 0.1) return;
    show_line(p, fraction, step, now);
    while (p->next_percent <= 100.0 * fraction) p->next_percent += 10;
}

void ex_progress_end(ex_progress *p, double t, long step) {
    if (p->quiet) return;
    if (p->terminal || p->next_percent <= 100) show_line(p, done_fraction(p, t), step, ex_seconds());
    if (p->terminal) fprintf(stderr, "\n");
    p->next_percent = 110;
}

void ex_result(const char *key, double value, const char *unit) {
    printf("result %s %.10g %s\n", key, value, unit && unit[0] ? unit : "-");
    fflush(stdout);
}

void ex_check(const char *key, double value, double reference, double tolerance) {
    /* Written so that a NaN on either side fails. */
    int ok = fabs(value - reference) <= tolerance;
    if (!ok) failed_checks++;
    printf("check %s %.10g %.10g %.10g %s\n", key, value, reference, tolerance, ok ? "pass" : "FAIL");
    fflush(stdout);
}

void ex_check_below(const char *key, double value, double limit) { ex_check(key, value, 0.0, limit); }

void ex_check_true(const char *key, int ok) { ex_check(key, ok ? 1.0 : 0.0, 1.0, 0.0); }

int ex_exit_code(void) { return failed_checks > 0; }

static int make_one(const char *path) {
    struct stat info;
    if (mkdir(path, 0777) == 0) return 0;
    if (errno != EEXIST || stat(path, &info) != 0) return 1;
    return !S_ISDIR(info.st_mode);
}

int ex_make_directory(const char *path) {
    size_t length = strlen(path);
    char *part = malloc(length + 1);
    int bad = 0;
    if (!part) return 1;
    memcpy(part, path, length + 1);
    for (size_t i = 1; i < length && !bad; i++) {
        if (part[i] != '/') continue;
        part[i] = '\0';
        bad = make_one(part);
        part[i] = '/';
    }
    if (!bad && length > 0) bad = make_one(part);
    free(part);
    return bad;
}
