/* machine.h - what the machine can do at best (machine.c). */
#ifndef BENCH_MACHINE_H
#define BENCH_MACHINE_H

void machine_print(void);          /* compiler and word size */
double machine_clock(int threads); /* s: processor time of one thread, wall clock of several */
double machine_triad(int threads); /* GB/s; 0 without memory */
double machine_fma_peak(void);     /* Gflop/s of one thread, double */

#endif
