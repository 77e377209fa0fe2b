/* Runs the tests of all suites; see harness.h. The last line printed is the summary. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include "harness.h"

#include <stdarg.h>
#include <time.h>

#define MOST_PRINTED 5 /* failures of one test that are printed in full */

/* suites.h is written by the Makefile: one line SUITE_NAME(topic) for every tests/test_<topic>.c. */
#define SUITE_NAME(topic) extern const test_suite suite_##topic;
#include "suites.h"
#undef SUITE_NAME
#define SUITE_NAME(topic) &suite_##topic,
static const test_suite *const suites[] = {
#include "suites.h"
    NULL};

/* Of the test that is running. */
static struct { int checks, failures, skipped; char note[160]; } current;

static struct { int list, slow, fast; char **filters; int filter_count; } options = {0, 0, 1, NULL, 0};

/* ---- checks ---- */

static int failed(const char *file, int line)
{
    if (current.failures++ == 0) printf("\n");
    if (current.failures > MOST_PRINTED) return 0;
    printf("  %s:%d: ", file, line);
    return 1;
}

int check_true(int holds, const char *text, const char *file, int line)
{
    current.checks++;
    if (!holds && failed(file, line)) printf("does not hold: %s\n", text);
    return holds;
}

int check_close(double value, double reference, double tolerance, const char *text, const char *file, int line)
{
    int holds = fabs(value - reference) <= tolerance; /* false for a NaN */
    current.checks++;
    if (!holds && failed(file, line))
        printf("%s = %.17g, expected %.17g within %.3g, off by %.3g\n", text, value, reference, tolerance,
               value - reference);
    return holds;
}

int check_below(double value, double limit, const char *text, const char *file, int line)
{
    int holds = value <= limit;
    current.checks++;
    if (!holds && failed(file, line)) printf("%s = %.6g, allowed at most %.6g\n", text, value, limit);
    return holds;
}

int check_same(long long value, long long reference, const char *text, const char *file, int line)
{
    int holds = value == reference;
    current.checks++;
    if (!holds && failed(file, line)) printf("%s = %lld, expected %lld\n", text, value, reference);
    return holds;
}

static const char *result_name(tlsph_result result)
{
#define NAME(code, text) if (result == code) return #code;
    TLSPH_RESULTS(NAME)
#undef NAME
    return "no result code";
}

int check_result(tlsph_result value, tlsph_result expected, const char *text, const char *file, int line)
{
    int holds = value == expected;
    current.checks++;
    if (!holds && failed(file, line)) printf("%s gave %s, expected %s\n", text, result_name(value), result_name(expected));
    return holds;
}

void check_skip(const char *reason)
{
    current.skipped = 1;
    check_report("%s", reason);
}

void check_report(const char *format, ...)
{
    size_t used = strlen(current.note);
    va_list values;
    va_start(values, format);
    vsnprintf(current.note + used, sizeof current.note - used, format, values);
    va_end(values);
}

/* ---- running ---- */

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int is_slow(const test_entry *entry) { return strncmp(entry->name, "slow_", 5) == 0; }

static int wanted(const char *topic, const test_entry *entry)
{
    char name[200];
    int i, matches = options.filter_count == 0, named_slow = 0;
    snprintf(name, sizeof name, "%s/%s", topic, entry->name);
    for (i = 0; i < options.filter_count; i++) {
        int match = strstr(name, options.filters[i]) != NULL;
        matches = matches || match;
        named_slow = named_slow || (match && strstr(options.filters[i], "slow_"));
    }
    if (!matches) return 0;
    return is_slow(entry) ? options.slow || named_slow : options.fast;
}

/* Returns 'p', 'f' or 's'. */
static char run_test(const char *topic, const test_entry *entry)
{
    double start = seconds();
    memset(&current, 0, sizeof current);
    printf("%s/%s ", topic, entry->name);
    fflush(stdout); /* so that a crash shows where it happened */
    entry->run();
    if (current.failures) {
        if (current.failures > MOST_PRINTED) printf("  and %d more\n", current.failures - MOST_PRINTED);
        printf("FAIL %s/%s: %d of %d checks", topic, entry->name, current.failures, current.checks);
    } else {
        printf("%s", current.skipped ? "skipped" : "ok");
    }
    printf(" (%.2f s) %s\n", seconds() - start, current.note);
    return current.failures ? 'f' : current.skipped ? 's' : 'p';
}

static void run_suites(int *passed, int *failures, int *skipped)
{
    const test_suite *const *suite;
    size_t i;
    char outcome;
    for (suite = suites; *suite; suite++)
        for (i = 0; i < (*suite)->count; i++) {
            const test_entry *entry = &(*suite)->entries[i];
            if (!wanted((*suite)->topic, entry)) continue;
            if (options.list) { printf("%s/%s\n", (*suite)->topic, entry->name); continue; }
            outcome = run_test((*suite)->topic, entry);
            *passed += outcome == 'p';
            *failures += outcome == 'f';
            *skipped += outcome == 's';
        }
}

static int read_options(int argc, char **argv)
{
    int i;
    for (i = 1; i < argc && argv[i][0] == '-'; i++) {
        if (!strcmp(argv[i], "--list")) options.list = options.slow = options.fast = 1;
        else if (!strcmp(argv[i], "--slow")) { options.slow = 1; options.fast = 0; }
        else if (!strcmp(argv[i], "--all")) options.slow = options.fast = 1;
        else return 0;
    }
    options.filters = argv + i;
    options.filter_count = argc - i;
    return 1;
}

int main(int argc, char **argv)
{
    int passed = 0, failures = 0, skipped = 0;
    if (!read_options(argc, argv)) {
        printf("usage: %s [--list] [--slow] [--all] [filter...]\n", argv[0]);
        return 2;
    }
    run_suites(&passed, &failures, &skipped);
    if (options.list) return 0;
    printf("%d passed, %d failed", passed, failures);
    if (skipped) printf(", %d skipped", skipped);
    printf("\n");
    return failures != 0;
}
