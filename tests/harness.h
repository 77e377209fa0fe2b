/*
tests/harness.h - the whole test framework

HOW TO ADD TESTS
  1. Make a file tests/test_<topic>.c: the Makefile finds it by its name, no list has to be edited.
  2. Include "harness.h" (it includes tlsph.h) and write static functions with the macro TEST:
         TEST(volume_of_a_box) { CHECK_CLOSE(volume, 1, 10 * EPSILON); }
  3. List them once at the end of the file; <topic> must be that of the file's name:
         SUITE(<topic>, ENTRY(volume_of_a_box), ENTRY(slow_long_spin))
  Tests whose name starts with slow_ run with `make check` only, all others with `make test`, in double and in float.
  A test that makes sense in one precision only begins with `DOUBLE_ONLY();`. Tests share no state.

  Every file is compiled twice, for double and for float, under -Wconversion -Wdouble-promotion: write (tlsph_real)0.1.
  Paths to data: REFERENCES "/name.csv".

RUN
  build/test_double [--list] [--slow] [--all] [filter...]
    --slow, --all   the slow tests only; the slow ones too. A filter is a part of "<topic>/<name>"; one that contains
                    slow_ chooses slow tests without these options.
*/
#ifndef HARNESS_H
#define HARNESS_H

#include "../tlsph.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef TLSPH_REAL_FLOAT
#define EPSILON ((double)FLT_EPSILON)
#define DOUBLE_ONLY() SKIP("double only")
#else
#define EPSILON DBL_EPSILON
#define DOUBLE_ONLY() ((void)0)
#endif

#ifndef REFERENCES
#define REFERENCES "tests/references" /* from the repository's root; the Makefile passes the full path */
#endif

typedef struct test_entry { const char *name; void (*run)(void); } test_entry;
typedef struct test_suite { const char *topic; const test_entry *entries; size_t count; } test_suite;

#define TEST(name) static void name(void)
#define ENTRY(name) { #name, name }
#define SUITE(topic, ...)                                                          \
    static const test_entry suite_entries[] = { __VA_ARGS__ };                     \
    extern const test_suite suite_##topic;                                         \
    const test_suite suite_##topic = { #topic, suite_entries, sizeof suite_entries / sizeof *suite_entries };

/* Each CHECK notes a failure and goes on; its value says whether it held. */
#define CHECK(condition) check_true((condition) ? 1 : 0, #condition, __FILE__, __LINE__)
/* |value - reference| <= tolerance, absolute; a value that is not a number fails. */
#define CHECK_CLOSE(value, reference, tolerance)                                   \
    check_close((double)(value), (double)(reference), (double)(tolerance), #value, __FILE__, __LINE__)
#define CHECK_BELOW(value, limit) check_below((double)(value), (double)(limit), #value, __FILE__, __LINE__)
#define CHECK_SAME(value, reference) check_same((long long)(value), (long long)(reference), #value, __FILE__, __LINE__)
/* A result code against the expected one, with both names in the message. */
#define CHECK_RESULT(value, expected) check_result((value), (expected), #value, __FILE__, __LINE__)

/* Ends the test where going on makes no sense. Memory in use then leaks: the test has failed already. */
#define REQUIRE(condition) do { if (!CHECK(condition)) return; } while (0)
#define REQUIRE_OK(result) do { if (!CHECK_RESULT((result), TLSPH_OK)) return; } while (0)
#define SKIP(reason) do { check_skip(reason); return; } while (0)

/* A figure worth seeing beside the test's name, for instance an average error. */
#define REPORT(...) check_report(__VA_ARGS__)

int check_true(int holds, const char *text, const char *file, int line);
int check_close(double value, double reference, double tolerance, const char *text, const char *file, int line);
int check_below(double value, double limit, const char *text, const char *file, int line);
int check_same(long long value, long long reference, const char *text, const char *file, int line);
int check_result(tlsph_result value, tlsph_result expected, const char *text, const char *file, int line);
void check_skip(const char *reason);
void check_report(const char *format, ...);

#endif
