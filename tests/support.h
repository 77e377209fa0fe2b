/* What several test files need: random numbers, a counting allocator, small scenes, comparisons of states. */
#ifndef SUPPORT_H
#define SUPPORT_H

#include "harness.h"

#define R(x) ((tlsph_real)(x))
#define PI 3.14159265358979323846

/* A tolerance `relative` in double, and `epsilons` machine epsilons where these are more (in float). */
#define ROUNDED(relative, epsilons) fmax((relative), (epsilons) * EPSILON)

/* The library's own flags (implementation.c): -ffast-math lets the compiler reorder. */
int reorders(void);
/* Numbers on the way to a result have more digits than their type: x87. */
#ifdef FLT_EVAL_METHOD
#define MORE_DIGITS (FLT_EVAL_METHOD == 2)
#else
#define MORE_DIGITS 0
#endif
/* A tolerance for what depends on wave speeds. Their bounds are roots of differences that vanish where F is a rotation: to
   the last digit by one order of operations, to half of the digits by any other, or where more digits are kept. */
#define BOUNDED(tolerance) (reorders() || MORE_DIGITS ? fmax((tolerance), 4 * sqrt(EPSILON)) : (tolerance))

/* Deterministic random numbers; any seed. */
double random_between(uint64_t *state, double low, double high);
/* F = I + entries up to `amount`, with a positive determinant; a rotation about a random axis. */
void random_deformation(uint64_t *state, double amount, tlsph_real F[9]);
void random_rotation(uint64_t *state, tlsph_real Q[9]);
void multiply(const tlsph_real A[9], const tlsph_real B[9], tlsph_real C[9]);
double largest(const tlsph_real *values, size_t count);

/* Counts what is allocated and not released; can make one allocation fail. */
typedef struct tally {
    size_t calls, live, live_bytes, most_bytes, most_live;
    size_t fail_at; /* the number of the call that fails, from 1; 0: none */
    int wrong_size; /* a release named another size than its allocation */
} tally;
tlsph_allocator tally_allocator(tally *counts);

/* A cloud whose arrays the test may spoil; freed by own_cloud_destroy. */
typedef struct own_cloud {
    tlsph_particles particles; /* points at the arrays below */
    tlsph_real *positions, *volumes, *weights;
    uint8_t *materials;
    uint32_t *cells;
} own_cloud;
/* A box with cells[i] cubic cells of edge `spacing` from the origin; jitter as in tlsph_fill. 0 on failure. */
int own_box(own_cloud *cloud, int dimension, const int cells[3], double spacing, double jitter);
int own_copy(own_cloud *cloud, const tlsph_particles *particles, int dimension);
void own_cloud_destroy(own_cloud *cloud);

/* A scene in which everything moves: a block of n cells an edge (1 m), clamped at X = 0, gravity, and in thermal scenes
   a heat source, a prescribed temperature at X = 1 and conduction. The solver copies all, the caller destroys it. */
typedef struct moving_block {
    int dimension, cells;
    tlsph_unknowns unknowns;
    tlsph_thermal thermal;
    tlsph_material_kind material;
    double jitter, mooney; /* share of the Mooney terms in mu */
    tlsph_integrator integrator;
    tlsph_dissipation dissipation;
    int threads, audit;
    int sharp;               /* sharp gradients, by cells */
    tlsph_operator_kind kind; /* if not 0 */
    tlsph_force_form force_form;
    int insulated;            /* 1: no conduction */
    int slides;              /* 1: along a roller at X = 0, not clamped */
    int unloaded;            /* 1: only clamped; 2: and above a wall out of reach */
    tlsph_run_fn run; void *run_user;
    tlsph_allocator allocator;
} moving_block;
moving_block moving_block_default(void);
tlsph_result moving_block_create(const moving_block *s, tlsph_solver **solver, tlsph_error *error);
/* Writes a smooth initial velocity, `speed` m/s at most. */
tlsph_result moving_block_kick(tlsph_solver *solver, double speed);
/* The closed operator with the kernel and support that suit irregular clouds. */
void closed_operator(tlsph_desc *desc);
/* A rubber-like material with all thermal constants set. */
tlsph_material soft_material(tlsph_material_kind kind);

/* A field in the host's order, from malloc; NULL where the scene has no such field. */
tlsph_real *read_field(const tlsph_solver *solver, tlsph_field field);
/* Hash of the bits of the time and of all readable fields but the velocity gradient, which is "of the last stage" that
   was evaluated: a failed step leaves its own there, a checkpoint holds none. */
uint64_t state_hash(const tlsph_solver *solver);
/* 1 if every readable field is finite. */
int state_finite(const tlsph_solver *solver);
/* Steps `count` times; the first error ends it. */
tlsph_result take_steps(tlsph_solver *solver, int count);

/* A checkpoint from malloc, of *size bytes. */
unsigned char *save_state(const tlsph_solver *solver, size_t *size);

#endif
