/*
bound.c - what a right-hand side moves and calculates at least, to judge its time by

  Bytes are counted by the solver's own arrays, in reals a particle: each array that a pass reads or writes once, as if
  nothing stayed in a cache from one pass to the next and all of a neighbour's did within a pass. As STREAM does, this
  leaves out that a line is read before it is written. Two-stage schemes; other passes (sharp gradients, bonds, metals,
  the adjoint dissipation, JST) are not counted.
*/
#define TLSPH_IMPLEMENTATION /* for the solver's insides; the solvers are those of the library */
#define TLSPH_STATIC
#include "bound.h"

static double tensor(const tlsph_solver *s) { return s->dim * s->dim; }

/* The stage: state, rates and v in, the new state out, and in the same pass the rows that it gives. The first stage
   reads one state, the second two. The projection's correction of rate_p and the kinetic part of rate_E are written
   back. */
static double of_update(const tlsph_solver *s) {
    const double D = s->dim, DD = tensor(s), J = s->has_J, E = s->thermal != TLSPH_ISOTHERMAL;
    const double state = 2.5 * (double)s->state_reals / (double)s->n;
    const double rates = D + DD + J + E + (s->projection ? D : 0) + (s->thermal == TLSPH_ENERGY);
    const double rows = (s->projection ? D : 2 * D) + 2 * DD + 2 + 2 * J + E + s->conducts; /* v, w; P, A; wave; ... */
    return state + rates + rows + D + 2; /* v; V, tau */
}
/* The rigid motion, from x, v, V; with w gathered from the rows, the pass that makes it. */
static double of_moments(const tlsph_solver *s) {
    const double D = s->dim;
    return s->projection ? 2 * D + 1 + (s->gathers_w ? 3 * D + 1 : 0) : 0;
}
/* Gradients and fluxes as one: all rows, each of which is either read or written first; V; slots; the rates out; x for
   torques, F for grad w. */
static double of_sums(const tlsph_solver *s) {
    const double D = s->dim, DD = tensor(s), J = s->has_J, E = s->thermal != TLSPH_ISOTHERMAL;
    const tlsphi_graph *graph = &s->graph;
    const double slots = (double)(graph->slots * sizeof *graph->slot + graph->gathers * sizeof *graph->gathered);
    const double rates = D + J + E + (s->keeps_rate ? DD : 0);
    const double turn = s->projection ? D + (s->gathers_w ? 0 : DD) : 0;
    return s->rows.count + 1 + rates + turn + slots / (double)sizeof(tlsph_real) / (double)s->n;
}
static int counted(const tlsph_solver *s) {
    return !s->sharp && !s->metal && !s->bonds && s->dissipation != TLSPH_SELF_ADJOINT && s->dissipation != TLSPH_JST;
}
double bound_bytes(const tlsph_solver *s) {
    return counted(s) ? (double)sizeof(tlsph_real) * (of_update(s) + of_moments(s) + of_sums(s)) : 0;
}

/* Sums, products, quotients and roots of a pair whose vectors have w components, as the header's loops have them:
   slopes, stress, dissipation, Sigma_J, heat. Slopes and heat take all components of vectors with more than one. */
static double of_pair(const tlsph_solver *s, double w) {
    const double D = s->dim, all = w > 1 ? D : 1, J = s->has_J, damps = s->dissipation != TLSPH_NO_DISSIPATION;
    const double slopes = (D * (s->gathers_w ? 2 : 1) + J + s->conducts) * (1 + 2 * all);
    const double damping = (6 * D + 3) * w + 18 * D + 24 + J * (3 * w + 17);
    return slopes + D * (3 * w + 1) + damps * damping + s->conducts * (22 * all + 30);
}
/* Pairs have vectors along an axis, in a plane or in space as on a lattice. What a particle takes beside them is
   counted: the scalar instructions that a body of 16^3 executes, less those of its pairs. The whole is up to a fifth
   below such counts, as lanes without a pair calculate, too. */
double bound_flops(const tlsph_solver *s) {
    const double each = (double)s->pairs / (double)s->n, D = s->dim;
    const int wide = s->size.neighbours_most > 2 * (size_t)s->dim;
    const double heats = s->thermal != TLSPH_ISOTHERMAL, solid = 750 + 60 * s->has_J + 85 * s->has_H + 160 * heats;
    double pair = of_pair(s, 1);
    if (wide && D == 3) pair = (6 * of_pair(s, 1) + 12 * of_pair(s, 2) + 8 * of_pair(s, 3)) / 26;
    if (wide && D < 3) pair = (of_pair(s, 1) + of_pair(s, 2)) / 2;
    return counted(s) ? (D < 3 ? 0.7 : 1) * solid + each * pair : 0;
}
