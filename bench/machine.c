/* machine.c - what the machine can do at best, to judge times by. */
#include "machine.h"

#include "examples/common/common.h"

#include <math.h>
#include <stdlib.h>

void machine_print(void) {
#ifdef __VERSION__
    printf("compiler %s, ", __VERSION__);
#endif
#if !defined(__OPTIMIZE__) && defined(__GNUC__)
    printf("NOT OPTIMISED, ");
#endif
    printf("%d-bit pointers\n", (int)(8 * sizeof(void *)));
}

double machine_clock(int threads) { return threads == 1 ? ex_cpu_seconds() : ex_seconds(); }

/* a = b + s c over arrays larger than most caches, counted as STREAM does: 24 bytes each. The first pass takes the
   pages, by the threads that use them later. */
double machine_triad(int threads) {
    const long n = 1L << 24;
    double *a = malloc(3 * (size_t)n * sizeof *a), *b, *c, best = HUGE_VAL;
    if (!a) return 0;
    b = a + n;
    c = b + n;
    for (int pass = 0; pass < 8; pass++) {
        const double begin = machine_clock(threads);
#ifdef _OPENMP
#pragma omp parallel for schedule(static) num_threads(threads)
#endif
        for (long i = 0; i < n; i++) {
            if (pass == 0) b[i] = c[i] = (double)i;
            a[i] = b[i] + 3 * c[i];
        }
        if (pass > 0) best = fmin(best, machine_clock(threads) - begin);
    }
    if (a[n / 2] < 0) puts("?"); /* so that the sums are needed */
    free(a);
    return best > 0 ? 24e-9 * (double)n / best : 0;
}

/* Independent chains of x = x a + b, enough to hide the latency and few enough for the registers: 12 or so vectors.
   ISO C mode forbids some compilers to contract a product and a sum, hence fma, but only where it is an instruction. */
#if defined(__AVX512F__)
enum { LANES = 96 };
#elif defined(__AVX__)
enum { LANES = 48 };
#else
enum { LANES = 24 };
#endif
#if defined(FP_FAST_FMA) || defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define MULTIPLY_ADD(x, a, b) fma(x, a, b)
#else
#define MULTIPLY_ADD(x, a, b) ((x) * (a) + (b))
#endif

static double burn(long rounds, double a, double b) {
    double x[LANES], sum = 0;
    for (int k = 0; k < LANES; k++) x[k] = k;
    for (long r = 0; r < rounds; r++)
        for (int k = 0; k < LANES; k++) x[k] = MULTIPLY_ADD(x[k], a, b);
    for (int k = 0; k < LANES; k++) sum += x[k];
    return sum;
}

/* Gflop/s of one thread, as this compiler makes it with these flags. */
double machine_fma_peak(void) {
    const long rounds = 200000;
    double best = HUGE_VAL, sum = 0;
    for (int i = 0; i < 10; i++) {
        const double begin = ex_cpu_seconds();
        sum += burn(rounds, 0.999999, 1e-6);
        best = fmin(best, ex_cpu_seconds() - begin);
    }
    if (sum < 0) puts("?");
    return best > 0 ? 2e-9 * LANES * (double)rounds / best : 0;
}
