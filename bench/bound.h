/* bound.h - what a right-hand side moves and calculates at least (bound.c). */
#ifndef BENCH_BOUND_H
#define BENCH_BOUND_H

#include "tlsph.h"

double bound_bytes(const tlsph_solver *solver); /* a particle and right-hand side; 0: not counted for this scheme */
double bound_flops(const tlsph_solver *solver);

#endif
