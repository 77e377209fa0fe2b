/*
tlsph.h - large-strain, fast, thermo-elastic solids by total Lagrangian smoothed particle hydrodynamics, in one header

WHAT IT IS
  A body is a cloud of particles that keep their neighbours for ever. Each particle carries linear momentum p, the
  deformation gradient F and, if the scene asks, the cofactor H, the Jacobian J and the total energy E or the entropy
  eta. Gradients and forces are sums over neighbours; a Riemann-like dissipation keeps them stable; a two-stage
  Runge-Kutta scheme moves them in time. Sources: Ghavamian et al. 2021 ("000" in the comments) and Lee et al. 2018
  ("001"). Where the code departs from the papers, the comment there says why.

USE
  In exactly one C or C++ file:     #define TLSPH_IMPLEMENTATION
                                    #include "tlsph.h"
  In all others:                    #include "tlsph.h"
  Link with -lm; add -fopenmp for threads. A complete program (a beam that swings under its own weight):

    #define TLSPH_IMPLEMENTATION
    #include "tlsph.h"
    #include <stdio.h>
    int main(void) {
        tlsph_fill fill = tlsph_fill_default(3);    // a box of 4 m x 1 m x 1 m, particles every 0.25 m
        fill.size[0] = 4; fill.size[1] = 1; fill.size[2] = 1; fill.spacing = 0.25;
        tlsph_cloud beam; tlsph_error error;
        if (tlsph_cloud_create(&fill, &beam, &error)) { puts(error.message); return 1; }
        uint32_t root[1024];
        tlsph_condition conditions[2] = { tlsph_condition_default(TLSPH_CLAMPED),
                                          tlsph_condition_default(TLSPH_ACCELERATION) };
        conditions[0].particles = root;
        conditions[0].count = tlsph_select_plane(&beam.particles, 0, 0, 1e-6, root, 1024); // X = 0
        conditions[1].value[1] = -9.81;                      // gravity on every particle
        tlsph_material rubber = tlsph_material_default(TLSPH_NEO_HOOKEAN);
        rubber.density = 1100; rubber.young = 1e6; rubber.poisson = 0.4;
        tlsph_desc desc = tlsph_desc_default(3);
        desc.particles = beam.particles;
        desc.materials = &rubber;      desc.material_count = 1;
        desc.conditions = conditions;  desc.condition_count = 2;
        tlsph_solver *solver;
        if (tlsph_create(&desc, &solver, &error)) { puts(error.message); return 1; }
        while (tlsph_time(solver) < 1)
            if (tlsph_step(solver, 0.01)) { puts(tlsph_last_error(solver)->message); break; }
        tlsph_ledger ledger; tlsph_ledger_read(solver, &ledger);
        printf("t = %g s, kinetic energy %g J\n", ledger.time, ledger.kinetic_energy);
        tlsph_destroy(solver); tlsph_cloud_destroy(&beam); return 0;
    }

OPTIONS (define before including, the same in every file)
  TLSPH_IMPLEMENTATION   compile the code here                      TLSPH_STATIC   make every function static
  TLSPH_REAL_FLOAT       float instead of double; a file compiled with the other precision does not link
  TLSPH_ASSERT(x)        own assertion for internal invariants, default none
  TLSPH_MALLOC(n), TLSPH_FREE(p)   the default allocator (both or neither); a description may bring its own

PROMISES
  Units: any coherent set; SI in all examples. Vectors the host passes have 3 components and tensors 9, row-major, first
  index spatial, in 2-D (plane strain) too; the solver itself stores only what the dimension and the unknowns need.
  Determinism: every sum has a fixed order, so results are bitwise the same for any number of threads, run after run.
  Threads: different solvers may be used on different threads at once; one solver by one thread at a time.
  Memory: one block per solver, taken at creation; a step allocates nothing. Nothing prints, exits or keeps globals.
  Errors: every function that can fail returns a tlsph_result and says in a tlsph_error what was found and what is
  allowed; a failed creation leaves nothing behind, a failed step leaves the state of the last good step.

INDEX (search for the tag)
  [API-TYPES] [API-FUNCTIONS] [API-END] [METHOD] [SHIMS] [TENSORS] [KERNELS] [NEIGHBOURS] [OPERATORS] [BONDS]
  [CLOSURE] [MATERIALS] [PLASTICITY] [SOLVER-DATA] [EVALUATION] [PAIR-STEP] [DISSIPATION] [SURFACES] [GRADIENTS] [JST]
  [FLUXES] [CONDITIONS] [PROJECTION] [RHS] [INCOMPRESSIBLE] [SUPER-STEPS] [STEP] [LEAPFROG] [MULTI-RATE] [ALGORITHM]
  [LEDGER] [FIELDS] [CHECKPOINT] [VALIDATION] [CREATION] [TILES] [SELF-TEST] [PREFLIGHT] [VORONOI] [SHAPES] [FILL]
  [REPRODUCING] [LICENCE]
*/
#ifndef TLSPH_H
#define TLSPH_H

#include <stddef.h>
#include <stdint.h>

#define TLSPH_VERSION_MAJOR 0
#define TLSPH_VERSION_MINOR 1

#ifdef TLSPH_STATIC
#if defined(__GNUC__) || defined(__clang__)
#define TLSPH_API static __attribute__((unused))
#else
#define TLSPH_API static
#endif
#else
#define TLSPH_API extern
#endif

/* A float build renames what creates solvers and clouds, so that mixing precisions fails at link time. */
#ifdef TLSPH_REAL_FLOAT
typedef float tlsph_real;
#define tlsph_create tlsph_create_float
#define tlsph_cloud_create tlsph_cloud_create_float
#else
typedef double tlsph_real;
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ==== [API-TYPES] ================================================================================================== */

/* Every result with its text: one list makes the codes and tlsph_result_text. */
#define TLSPH_RESULTS(X)                                                                                                \
    X(TLSPH_OK, "no error")                                                                                             \
    X(TLSPH_ERROR_DESCRIPTION, "the description was not made by tlsph_..._default, or one of its values is not allowed") \
    X(TLSPH_ERROR_ARGUMENT, "an argument of the call is not allowed")                                                   \
    X(TLSPH_ERROR_SIZE, "a size or count does not fit")                                                                 \
    X(TLSPH_ERROR_NOT_FINITE, "a value is infinite or not a number")                                                    \
    X(TLSPH_ERROR_VOLUME, "a volume or kernel weight is not positive")                                                  \
    X(TLSPH_ERROR_DUPLICATE, "two particles are at the same place")                                                     \
    X(TLSPH_ERROR_NEIGHBOURS, "a particle has too few neighbours, or they lie in a plane or on a line")                 \
    X(TLSPH_ERROR_MATERIAL, "a material constant is out of its range")                                                  \
    X(TLSPH_ERROR_CONDITION, "a boundary condition or load is not allowed")                                             \
    X(TLSPH_ERROR_MEMORY, "no memory")                                                                                  \
    X(TLSPH_ERROR_INVERSION, "a particle turned inside out: its Jacobian is not positive")                              \
    X(TLSPH_ERROR_TEMPERATURE, "a temperature is not positive")                                                         \
    X(TLSPH_ERROR_TIME_STEP, "the time step is not positive or has collapsed")                                          \
    X(TLSPH_ERROR_CONVERGENCE, "the pressure iteration did not converge")                                          \
    X(TLSPH_ERROR_FIELD, "the scene has no such field, or it cannot be written")                                        \
    X(TLSPH_ERROR_SURFACE, "a surface is not closed, is turned inside out, or does not fit the particles")              \
    X(TLSPH_ERROR_CHECKPOINT, "the data is no checkpoint of this scene, or it is damaged")

typedef enum tlsph_result {
#define TLSPHI_RESULT(name, text) name,
    TLSPH_RESULTS(TLSPHI_RESULT)
#undef TLSPHI_RESULT
    TLSPH_RESULT_COUNT
} tlsph_result;

#define TLSPH_NO_PARTICLE ((size_t)-1)

/* What went wrong, and where. `particle` is the host's number or TLSPH_NO_PARTICLE. */
typedef struct tlsph_error {
    tlsph_result result;
    const char *stage;     /* what was being done, for instance "create" or "step" */
    const char *field;     /* the value concerned, for instance "volume" */
    size_t particle;
    double value, limit;   /* what was found and the bound that it broke */
    double time;           /* s, at which the last good step ended */
    uint64_t step;
    double position[3];    /* of the particle, m; in steps also: */
    double stretches[3];   /* principal stretches, largest first */
    double temperature;    /* K */
    size_t neighbours;
    const char *cause;     /* the most probable one, from what the particle and the scene show; "" where there is none */
    char message[400];     /* all of it in a sentence */
} tlsph_error;

/* Which deformation measures are evolved beside momentum p and deformation gradient F. */
typedef enum tlsph_unknowns {
    TLSPH_PF,   /* {p,F}: H and J follow from F; sturdiest and cheapest; the default, for nu below about 0.49 */
    TLSPH_PFJ,  /* {p,F,J}: smooth pressure near incompressibility */
    TLSPH_PFHJ, /* {p,F,H,J}: the papers' full set */
    TLSPH_PFH   /* {p,F,H}: for comparison (000 section 7.4) */
} tlsph_unknowns;

/* Which thermal unknown is evolved. */
typedef enum tlsph_thermal {
    TLSPH_ISOTHERMAL, /* none: no energy, entropy or temperature is stored */
    TLSPH_ENERGY,     /* total energy E per reference volume (000-54e): exact balance, right at shocks */
    TLSPH_ENTROPY     /* entropy eta per reference volume (000-57) */
} tlsph_thermal;

typedef enum tlsph_kernel { TLSPH_CUBIC_SPLINE, TLSPH_QUADRATIC, TLSPH_WENDLAND_C2, TLSPH_WENDLAND_C4 } tlsph_kernel;

/* How volumes, pair vectors C_ab and boundary area vectors B_a are made. All later code sees only these. */
typedef enum tlsph_operator_kind {
    TLSPH_CORRECTED_KERNEL, /* C_ab = 2 V_a w_b L_a grad W_ab (000-51, 52); any cloud; exact for linear fields */
    TLSPH_CELLS,            /* dual faces of box cells whose corners are the particles: antisymmetric, closed, exact */
    TLSPH_ZEROTH_KERNEL,    /* 2 V_a w_b times the corrected gradient of the zeroth-order kernel (002-10 to 14) */
    TLSPH_FIRST_KERNEL,     /* the same with the gradient of the first-order kernel (002-6 to 8, appendix A) */
    TLSPH_ZEROTH_BOND,      /* bond-based modified gradient F^c (002-37, 39) of the zeroth-order kernel, */
    TLSPH_BOND,             /* and of the first-order kernel. See [BONDS] for these four */
    TLSPH_CELLS_4,          /* cells of a lattice, fourth order inside and at mirrors, second at free faces (see "order 4");
                               with three stages or more, because TLSPH_RK2 amplifies what it damps so little */
    TLSPH_GIVEN,            /* the host's own pair vectors, antisymmetric: C_ab = -C_ba */
    TLSPH_CLOSED            /* irregular clouds: antisymmetric, closed by `areas`, exact for linear fields; solved once at
                               creation. Best with TLSPH_WENDLAND_C2 and support 0.825 (17 neighbours in 3-D) */
} tlsph_operator_kind;

typedef enum tlsph_dissipation {
    TLSPH_LIMITED,       /* linear reconstruction with a minmod limiter: second order, entropy-stable; default */
    TLSPH_RECONSTRUCTED, /* linear reconstruction, no limiter: second order, breaks the entropy inequality in places */
    TLSPH_FIRST_ORDER,   /* raw jumps: robust and very diffusive */
    TLSPH_AS_PRINTED,    /* 000 (66), (73)-(76), raw jumps of v/Xi: not Galilean invariant, singular; for comparison */
    TLSPH_JST,           /* harmonic and biharmonic dissipation of v (002-28), `harmonic` and `biharmonic`; not of J */
    TLSPH_NO_DISSIPATION,/* unstable sooner or later; for comparison */
    TLSPH_SELF_ADJOINT   /* linear reconstruction with its own adjoint: second order and entropy-stable without a limiter,
                            for one more gather; for clouds and long runs. TLSPH_RK2 and TLSPH_SSP_RK3, see [DISSIPATION] */
} tlsph_dissipation;

/* Forces where C_ab != -C_ba. On antisymmetric operators both are the same. */
typedef enum tlsph_force_form {
    TLSPH_ADJOINT,         /* sum_b (P_a C_ab - P_b C_ba)/2: no energy is lost or won; default */
    TLSPH_FORCE_AS_PRINTED /* (P_a + P_b)(C_ab - C_ba)/4 of the kernel's own gradient (002-22): wins energy at free
                              faces; for comparison */
} tlsph_force_form;

/* From what the stable time step is found. */
typedef enum tlsph_step_rule {
    TLSPH_STEP_BY_PARTICLE,   /* tau_a over the bound of the current isentropic p speed; default */
    TLSPH_STEP_BY_PAIR,       /* r_ab lambda_ab / c_lin: current distance, mean least stretch (002-31, 32); comparison */
    TLSPH_STEP_BY_PAIR_LINEAR /* r_ab / c_lin (002, table 1) */
} tlsph_step_rule;

/* How J enters the energy where it is evolved. */
typedef enum tlsph_volume_coupling {
    TLSPH_SPLIT,           /* only the volumetric energy sees J, bound to det F by a drift potential; default */
    TLSPH_JOINT_AS_PRINTED /* psi(F,H,J) with independent arguments (000-28, 30): drifts; for comparison */
} tlsph_volume_coupling;

typedef enum tlsph_conduction {
    TLSPH_COMPACT,        /* double gradient plus a two-point part that damps odd-even modes; default */
    TLSPH_DOUBLE_GRADIENT /* 000 (56): keeps odd-even temperatures for ever */
} tlsph_conduction;

/* Time schemes. All conserve linear and angular momentum and (E form) energy to round-off. The stable CFL numbers are
   tlsph_cfl_limit's. "Frozen": the dissipation, two thirds of an evaluation, is evaluated once a step. Smooth waves gain
   an order or two, the dissipation itself is first order in the step; see [STEP] for what is given up. */
typedef enum tlsph_integrator {
    TLSPH_RK2,        /* two-stage total-variation-diminishing Runge-Kutta (000-77); amplifies waves by (w dt)^4/8 a step */
    TLSPH_SSP_RK3,    /* three-stage strong-stability-preserving scheme of Shu and Osher (002-30, right stage times) */
    TLSPH_RK3_FROZEN, /* u0 + c dt (L(u) + D(u0)), c = 1/3, 1/2, 1: third order for linear problems */
    TLSPH_RK4_FROZEN, /* c = 1/4, 1/3, 1/2, 1: fourth order for linear problems */
    TLSPH_LEAPFROG    /* F by half a step, p by a whole one, F by the other half: the forces are evaluated once a step.
                         Second order; dissipation and conduction first order in the step */
} tlsph_integrator;

typedef enum tlsph_preset_name { TLSPH_PRESET_FAST, TLSPH_PRESET_BALANCED, TLSPH_PRESET_ACCURATE } tlsph_preset_name;

typedef enum tlsph_material_kind {
    TLSPH_LINEAR,      /* linear (thermo-)elasticity: geometry linearised, H = I */
    TLSPH_NEO_HOOKEAN, /* nearly incompressible neo-Hookean or Mooney-Rivlin, no thermal expansion */
    TLSPH_MEE,         /* modified entropic elasticity (000-26 to 29) */
    TLSPH_MIE_GRUNEISEN, /* (000-30 to 32) */
    TLSPH_VON_MISES,     /* Hencky hyperelastic-plastic with isotropic hardening (001 Algorithm 2) */
    TLSPH_USER         /* the host's own, by a callback over arrays */
} tlsph_material_kind;

/* What a user's material returns for one particle: reference energy e_R(F,J) and reference entropy eta_R(F,J) per
   reference volume (at reference temperature), with derivatives. Stress and temperature follow as
   P = e_F - theta eta_F + (e_J - theta eta_J) H,  Sigma_J = e_J - theta eta_J.
   In scenes that do not evolve J, J = det F; then everything may be put into e_F and e_J = eta_J = 0. */
typedef struct tlsph_response {
    tlsph_real energy, entropy;         /* J/m^3, J/(m^3 K) */
    tlsph_real e_F[9], eta_F[9];        /* derivatives by F at fixed J: Pa, Pa/K */
    tlsph_real e_J, eta_J;              /* derivatives by J at fixed F: Pa, Pa/K */
    tlsph_real p_modulus[2];            /* bound of rho c_p^2 (isentropic) = [0] + theta [1], Pa, at this F and J */
    tlsph_real s_modulus[2];            /* of rho c_s^2 */
} tlsph_response;

/* Fills out[0..count). F: 9 per particle, J: 1, particle: the host's numbers. Must be pure and thread-safe. */
typedef void (*tlsph_response_fn)(void *user, size_t count, const uint32_t *particle, const tlsph_real *F,
                                  const tlsph_real *J, tlsph_response *out);

typedef struct tlsph_material {
    tlsph_material_kind kind;
    tlsph_real density;               /* rho_R, kg/m^3, > 0 */
    tlsph_real young;                 /* E, Pa, > 0; for TLSPH_USER the scale of stiffness */
    tlsph_real poisson;               /* nu, in (-1, 0.5); 0.5 itself with TLSPH_INCOMPRESSIBLE only */
    tlsph_real expansion;             /* linear thermal expansion alpha, 1/K, >= 0 */
    tlsph_real specific_heat;         /* C_v per mass, J/(kg K), > 0 in thermal scenes */
    tlsph_real conductivity;          /* h, W/(m K), >= 0 */
    tlsph_real reference_temperature; /* theta_R, K, > 0 */
    tlsph_real gruneisen_exponent;    /* q of (000-31), in [0, 1], default 1 */
    tlsph_real mooney_fraction;       /* share of the shear modulus carried by the H term, in [0, 1], default 0 */
    tlsph_real yield_stress;          /* TLSPH_VON_MISES: Kirchhoff stress at first yield, Pa, > 0 */
    tlsph_real hardening;             /* TLSPH_VON_MISES: its growth by equivalent plastic strain, Pa, >= 0 */
    tlsph_real plastic_heat;          /* TLSPH_VON_MISES in thermal scenes: share of the plastic work that becomes heat,
                                         in [0, 1], default 0; the rest stays stored in the material */
    tlsph_response_fn response;       /* for TLSPH_USER */
    void *response_user;
} tlsph_material;

/* Everything a material gives at one state (see tlsph_material_evaluate). Tensors 3x3 row-major. */
typedef struct tlsph_material_state {
    tlsph_real P[9];                            /* first Piola-Kirchhoff stress, Pa */
    tlsph_real Sigma_F[9], Sigma_H[9], Sigma_J; /* conjugates of F, H, J at fixed entropy (000-10), Pa */
    tlsph_real theta, eta;                      /* temperature, K; entropy, J/(m^3 K) */
    tlsph_real internal_energy, helmholtz;      /* J/m^3 */
    tlsph_real c_p, c_s;                        /* bounds of the isentropic wave speeds over all directions, m/s */
} tlsph_material_state;

/* What tlsph_material_check found, largest over its samples; stresses and energies over the stiffness at the sample. */
typedef struct tlsph_material_report {
    double derivative;    /* |P - d psi/dF| */
    double entropy;       /* |eta + d psi/d theta| theta */
    double symmetry;      /* of dP/dF */
    double objectivity;   /* |P(Q F) - Q P(F)| and of the energy, Q a rotation */
    double hyperbolicity; /* least eigenvalue of an acoustic tensor: where it is negative, waves grow; not judged */
    double wave_bound;    /* least of the bound of rho c_p^2 over the true isentropic value */
    int inverted;         /* samples left out because det F was not positive */
} tlsph_material_report;

/* Boundary conditions, loads and contact. Angle brackets: what `value` means. Where particles lie behind the surface
   (`moments`), conditions on surfaces hold at the middle of the particle's share of it, X_a + o: `values` gets its place, loads
   act there, and velocities and temperatures are prescribed there, not to the particle ([SURFACES]). Particles without a
   share, and forces on volumes, are treated as ever. */
typedef enum tlsph_condition_kind {
    TLSPH_CLAMPED,       /* v = 0 */
    TLSPH_ROLLER,        /* v.N = 0: a symmetry plane; fields are mirrored across it (gradients know) */
    TLSPH_TANGENT,       /* v - (v.N) N = 0: skew-symmetry plane, free along its normal N */
    TLSPH_VELOCITY,      /* <velocity, m/s>; with a non-zero normal only the component along it */
    TLSPH_FORCE,         /* <force on each particle, N> */
    TLSPH_TRACTION,      /* <force per reference area, Pa>; see `areas` */
    TLSPH_PRESSURE,      /* <pressure, Pa, value[0]>: pushes along the deformed normal -H A; see `areas` */
    TLSPH_BODY_FORCE,    /* <force per reference volume, N/m^3> */
    TLSPH_ACCELERATION,  /* <m/s^2>, for instance gravity */
    TLSPH_TEMPERATURE,   /* <K, value[0]>, prescribed */
    TLSPH_HEAT_FLUX,     /* <W/m^2, value[0]> per reference area, positive = heat LEAVES the body; see `areas` */
    TLSPH_HEAT_SOURCE,   /* <W/m^3, value[0]> per reference volume */
    TLSPH_WALL           /* rigid frictionless wall through `point`, `normal` pointing away from the wall to the body */
} tlsph_condition_kind;

/* Called once a stage for the whole set. values: 3 per particle for vectors, 1 for scalars, filled with `value` before
   the call. X, x: reference and current positions, 3 per particle. time: of the stage, s. */
typedef void (*tlsph_values_fn)(void *user, tlsph_real time, size_t count, const uint32_t *particle,
                                const tlsph_real *X, const tlsph_real *x, tlsph_real *values);

typedef struct tlsph_condition {
    uint32_t cookie;             /* set by tlsph_condition_default */
    tlsph_condition_kind kind;
    const uint32_t *particles;   /* host numbers; NULL with count 0: all particles. Copied at creation */
    size_t count;
    tlsph_real value[3];
    tlsph_real normal[3];        /* reference normal N of the plane, need not be of unit length */
    tlsph_real face[3];          /* particles behind the surface: normal of the part of it that is meant, see [SURFACES];
                                    zero: `normal`, and where that is zero all of the particle's share */
    tlsph_real point[3];         /* TLSPH_WALL */
    const tlsph_real *areas;     /* traction, heat flux: m^2 a particle; pressure: 3 a particle, outward. Copied.
                                    NULL: the operator's boundary area vector, projected on `normal` where it is given */
    tlsph_values_fn values;      /* NULL: constant */
    void *values_user;
    int conducts;                /* TLSPH_ROLLER: 1 if heat crosses the plane, so that the temperature is not mirrored */
} tlsph_condition;

/* The particles of a body. All arrays are in the host's order and copied at creation. */
typedef struct tlsph_particles {
    size_t count;
    const tlsph_real *positions;  /* X, 3 each, m (2-D: the third is ignored) */
    const tlsph_real *volumes;    /* V_a, tributary volume, m^3 (2-D: m^2), > 0: mass, force balance, loads */
    const tlsph_real *weights;    /* w_a, kernel weight (full cell volume also at faces); NULL: volumes */
    const tlsph_real *areas;      /* TLSPH_CLOSED: B_a, 3 each, m^2 (2-D: m), outward, zero inside (see tlsph_voronoi) */
    const tlsph_real *moments;    /* TLSPH_CLOSED, particles behind the surface: T_a = integral of n (x) (x - X_a) over the
                                     particle's share of it, 9 each, m^3 (2-D: m^2); NULL: particles on the surface */
    const tlsph_real *spacings;   /* local spacing of each particle, m, where it varies; NULL: `spacing` everywhere */
    const uint8_t *materials;     /* index into the description's materials; NULL: all 0 */
    tlsph_real spacing;           /* smoothing length h = support x spacing; 0: (mean weight)^(1/dimension) */
    size_t cell_count;            /* TLSPH_CELLS: */
    const uint32_t *cells;        /* 8 corners a cell (4 in 2-D), numbered x fastest, then y, then z */
    const size_t *first;          /* TLSPH_GIVEN: count + 1 offsets into */
    const uint32_t *neighbours;   /* neighbour lists, host numbers */
    const tlsph_real *pair_vectors; /* C_ab, 3 each, m^2 (2-D: m); C_ab = -C_ba */
} tlsph_particles;

/* The host's allocator. size in release is the one asked for. */
typedef struct tlsph_allocator {
    void *(*allocate)(void *user, size_t size);
    void (*release)(void *user, void *memory, size_t size);
    void *user;
} tlsph_allocator;

/* The host's threads: call task(arg, i) once for every i in [0, count), on any threads in any order, then return. */
typedef void (*tlsph_task_fn)(void *arg, size_t i);
typedef void (*tlsph_run_fn)(void *user, tlsph_task_fn task, void *arg, size_t count);

/* How the bulk is treated. */
typedef enum tlsph_scheme {
    TLSPH_EXPLICIT,      /* pressure from the material; the step follows the p speed; poisson below 0.5; default */
    TLSPH_INCOMPRESSIBLE /* pressure solved for in each stage (001 section 5); the step follows the s speed; poisson up to
                            and including 0.5. Isothermal, linear or neo-Hookean, {p,F} or {p,F,H}, TLSPH_RK2, no walls.
                            Initial velocities should be free of divergence, and written F have determinant 1 */
} tlsph_scheme;
typedef enum tlsph_pressure_iteration {
    TLSPH_CONJUGATE_GRADIENTS, /* default */
    TLSPH_DUAL_TIME            /* pseudo-time steps (001-52, 53): some ten times as many iterations; for comparison */
} tlsph_pressure_iteration;
/* What a scene with TLSPH_INCOMPRESSIBLE may choose. Iterations beyond the limit end in ERROR_CONVERGENCE. */
typedef struct tlsph_incompressible {
    tlsph_pressure_iteration iteration;
    int laplacian_as_printed;    /* 1: plain Laplacian (001-58); default 0: of reconstructed jumps, zero for linear p */
    tlsph_real laplacian;        /* alpha of (001-54), default 0.25; 0 leaves checkerboards of p undetermined */
    tlsph_real tolerance;        /* largest volume strain a step may miss, default 1e-6 (float: 1e-5) */
    int iteration_limit;         /* a stage, default 1000 */
    tlsph_real pseudo_modulus;   /* dual time: gamma of (001-48b) over mu, default 50 */
} tlsph_incompressible;
/* How the last step's two pressure solutions went (see tlsph_pressure_report_read). */
typedef struct tlsph_pressure_report {
    int iterations[2];           /* of each stage */
    double residual[2], tolerance; /* volume strain of the step that each stage's solution misses, largest of a particle */
    uint64_t iterations_total;   /* since creation */
    double volume_error;         /* largest |det F - 1 - p/kappa| now */
} tlsph_pressure_report;

/* A scene. Make it with tlsph_desc_default, then set what differs. */
typedef struct tlsph_desc {
    uint32_t cookie;
    int dimension;                       /* 2 (plane strain) or 3 */
    tlsph_particles particles;
    const tlsph_material *materials;     size_t material_count;   /* 1 to 256; copied */
    const tlsph_condition *conditions;   size_t condition_count;  /* applied in this order; copied */
    tlsph_unknowns unknowns;             /* default TLSPH_PF */
    tlsph_thermal thermal;               /* default TLSPH_ISOTHERMAL */
    tlsph_operator_kind operator_kind;   /* default TLSPH_CORRECTED_KERNEL */
    tlsph_kernel kernel;                 /* default TLSPH_QUADRATIC */
    tlsph_real support;                  /* h / spacing, default 0.6 (6 neighbours on a lattice); neighbours within 2h */
    tlsph_dissipation dissipation;       /* default TLSPH_LIMITED */
    tlsph_real harmonic, biharmonic;     /* TLSPH_JST: eta2 and eta4 of (002-28), default 0 and 1/8 */
    tlsph_force_form force_form;         /* default TLSPH_ADJOINT */
    tlsph_volume_coupling volume_coupling; /* default TLSPH_SPLIT */
    tlsph_real drift_stiffness;          /* b0 of the drift potential W, default 1 (METHOD: J equation) */
    tlsph_real drift_scale;              /* phi_c of W, default 0.03 */
    tlsph_real jump_share;               /* a_J, factor of the dissipation of J, default 0.5 */
    tlsph_real drift_relaxation;         /* r0: relaxation of J to det F, default 0; 0.5 for long static loads */
    tlsph_conduction conduction;         /* default TLSPH_COMPACT */
    int conduction_stages;               /* 0 (default): heat moves with everything else, in steps of h^2. 3 or more: where
                                            that is shorter than the sound limit, conduction takes up to so many cheap
                                            stages of its own in each half step (see SUPER-STEPS) */
    int sharp_gradients;                 /* 1: fourth-order dispersion on lattices, twice the cost; default 0. Needs an
                                            antisymmetric operator: cells, given, or a box lattice with support 0.6 */
    int tight_closure;                   /* 1: TLSPH_CLOSED exact for linear fields to 1e-3, not 2e-2, at ten times
                                            the cost; default 0 */
    int mirror_gradients;                /* 1: gradients know rollers and tangent planes; default 1 */
    int dissipation_heats;               /* entropy form: 1 = dissipated work becomes entropy (default), 0 = S_eta = 0 */
    int projection;                      /* 1: keeps angular momentum (000-79 to 82); default 1. 0: [PROJECTION] */
    tlsph_integrator integrator;         /* default TLSPH_RK2 */
    int rates;                           /* with TLSPH_LEAPFROG: largest number of step sizes, dt, dt/2, dt/4 ..., that
                                            stiff and fine parts may take for themselves; default 1, at most 8. Chosen
                                            once, for the undeformed body; time and stable step are those of the whole.
                                            Momenta stay exact, errors are those of the longest step, see [MULTI-RATE].
                                            Isothermal; without driven velocities, walls, plastic flow, sharp gradients,
                                            TLSPH_CELLS_4 and the forms that are for comparison only */
    tlsph_scheme scheme;                 /* default TLSPH_EXPLICIT */
    tlsph_incompressible incompressible; /* for TLSPH_INCOMPRESSIBLE */
    tlsph_real cfl;                      /* alpha_CFL of (000-78), default 0.3; in (0, 1], see tlsph_cfl_limit */
    tlsph_step_rule step_rule;           /* default TLSPH_STEP_BY_PARTICLE */
    int retries;                         /* what a step does that inverts a particle or meets a temperature below zero:
                                            default 0: it ends with the error; up to 30: it is taken again with half the
                                            size, so often at most. Counted in the ledger. Helps where a load is faster
                                            than the step, not where a body has collapsed */
    tlsph_real limit;                    /* with retries: a step in which a particle loses more than this share of its
                                            volume counts as failed, too, and steps after a retry start from its size and
                                            grow by a sixteenth each. Default 0: none. With 0.3 impacts at several times c_p
                                            keep their energy to a percent or two, where retries alone may miss all of
                                            it. Nothing is given up but time; counted in the ledger */
    int audit;                           /* 1: record the least pair entropy production in the ledger; default 0 */
    int keep_pairs;                      /* 1: tlsph_operator_view shows neighbours and vectors. Default 0: only where
                                            the scene itself reads them pair by pair; else tiles of equal patterns are
                                            all that is kept of them, which halves the memory at 26 neighbours */
    int threads;                         /* OpenMP builds: number of threads, 0 = OpenMP's own choice */
    tlsph_run_fn run;                    void *run_user;          /* the host's threads; NULL: OpenMP, else serial */
    tlsph_allocator allocator;           /* zero: TLSPH_MALLOC and TLSPH_FREE */
    void *memory;                        size_t memory_size;      /* a block for the solver (tlsph_measure), or NULL */
} tlsph_desc;

/* What a solver of a description needs (see tlsph_measure). */
typedef struct tlsph_size {
    size_t bytes;              /* of the one block */
    size_t bytes_per_particle; /* of it, without pairs and what all particles share, rounded down */
    size_t bytes_per_pair;
    size_t pairs;              /* directed neighbour pairs */
    size_t neighbours_least, neighbours_most;
    int rates;                 /* step sizes that differ, 1 to desc.rates */
} tlsph_size;

/* What TLSPH_CLOSED took to make and how well it holds (see tlsph_closure_read). */
typedef struct tlsph_closure {
    int iterations;                       /* of the conjugate gradients */
    double residual;                      /* largest of the first equations, in the local spacing's area and 2 V */
    double closing, linear;               /* largest |sum C + B| / spacing's area; |sum C (x) d / 2 - V I| / V */
    double change_mean, change_largest;   /* |C - start| / mean |start|, the start being symmetrised corrected kernels */
} tlsph_closure;

/* Balances of the whole scene at the current time, J (2-D: J/m). "Cumulative": since creation, the last write before the
   first step, or tlsph_ledger_reset. */
typedef struct tlsph_ledger {
    double time; uint64_t step; double time_step;
    double mass, linear_momentum[3], angular_momentum[3]; /* x x p about the origin; linear materials only: X x p */
    double centre[3];                                     /* centre of mass */
    double kinetic_energy;
    double strain_energy;    /* e_R (thermal, with stored plastic work) or Helmholtz energy at theta_R (isothermal) */
    double thermal_energy;   /* c_v (theta - theta_R) */
    double total_energy;     /* sum of the three */
    double ballistic_energy; /* total - theta_R entropy; isothermal: total */
    double entropy;          /* J/K; 0 if isothermal */
    double dissipation;            /* cumulative work turned into heat by D_p and D_J */
    double dissipation_entropy;    /* cumulative entropy made of it */
    double conduction_entropy;     /* cumulative entropy made by heat conduction */
    double plastic_work;           /* work of plastic flow up to now; isothermal scenes: it has left total_energy */
    double plastic_entropy;        /* entropy made of the share of it that became heat */
    double external_work;          /* cumulative, of loads and driven particles */
    double external_heat;          /* cumulative, into the body: sources, fluxes, prescribed temperatures */
    double external_entropy;       /* cumulative, that came with the external heat */
    double projection_work;        /* cumulative, on the rigid motion: what the dissipation had taken from it */
    double contact_loss;           /* cumulative kinetic energy stopped by walls (thermal scenes: turned into heat) */
    uint64_t retries;              /* cumulative steps that were taken again with half the size (desc.retries) */
    uint64_t limits;               /* cumulative steps that were kept smaller after one (desc.limit) */
    double impulse[3], angular_impulse[3]; /* cumulative, of loads (not of constraint reactions) */
    double energy_residual;        /* total - initial - work - heat (+ losses where these leave the energy) */
    double linear_residual[3];     /* momentum - initial - impulse; the reactions of constraints show here */
    double angular_residual[3];
    double entropy_residual;       /* entropy - initial - the productions: the time scheme's own */
    double least_pair_production;  /* audit: least pair production since the reset / size of its terms; >= -1e-12 */
    double drift_largest;          /* largest |J / det F - 1| now */
    double jacobian_least;         /* least det F or J now */
    double temperature_least, temperature_largest;
} tlsph_ledger;

/* Fields: code, name, unit, components, whether tlsph_write takes them. One list makes codes, names and units. */
#define TLSPH_FIELDS(X)                                                                                                \
    X(TLSPH_FIELD_REFERENCE_POSITION, "reference_position", "m", 3, 0)                                                 \
    X(TLSPH_FIELD_POSITION, "position", "m", 3, 1)                                                                     \
    X(TLSPH_FIELD_DISPLACEMENT, "displacement", "m", 3, 0)                                                             \
    X(TLSPH_FIELD_VELOCITY, "velocity", "m/s", 3, 1)             /* writing keeps the temperature */                   \
    X(TLSPH_FIELD_MOMENTUM, "momentum", "kg/(m^2 s)", 3, 0)      /* p per reference volume */                          \
    X(TLSPH_FIELD_F, "deformation_gradient", "1", 9, 1)          /* writing sets H, J too, keeps the temperature;      \
                                                                    plastic flow follows at once */                    \
    X(TLSPH_FIELD_H, "cofactor", "1", 9, 0)                                                                            \
    X(TLSPH_FIELD_J, "jacobian", "1", 1, 1)                      /* writable where it is evolved */                    \
    X(TLSPH_FIELD_DRIFT, "jacobian_drift", "1", 1, 0)            /* J / det F - 1 */                                   \
    X(TLSPH_FIELD_TEMPERATURE, "temperature", "K", 1, 1)                                                               \
    X(TLSPH_FIELD_ENERGY, "total_energy", "J/m^3", 1, 0)                                                               \
    X(TLSPH_FIELD_ENTROPY, "entropy", "J/(m^3 K)", 1, 0)                                                               \
    X(TLSPH_FIELD_STRESS, "first_piola_kirchhoff_stress", "Pa", 9, 0)                                                  \
    X(TLSPH_FIELD_PRESSURE, "pressure", "Pa", 1, 0)              /* P:F/(3J), tension positive as in the papers */     \
    X(TLSPH_FIELD_VON_MISES, "von_mises_stress", "Pa", 1, 0)                                                           \
    X(TLSPH_FIELD_PLASTIC_STRAIN, "plastic_strain", "1", 1, 0)   /* equivalent; scenes with TLSPH_VON_MISES */         \
    X(TLSPH_FIELD_SIGMA_F, "sigma_F", "Pa", 9, 0)                                                                      \
    X(TLSPH_FIELD_SIGMA_H, "sigma_H", "Pa", 9, 0)                                                                      \
    X(TLSPH_FIELD_SIGMA_J, "sigma_J", "Pa", 1, 0)                                                                      \
    X(TLSPH_FIELD_INTERNAL_ENERGY, "internal_energy", "J/m^3", 1, 0)                                                   \
    X(TLSPH_FIELD_HELMHOLTZ_ENERGY, "helmholtz_energy", "J/m^3", 1, 0)                                                 \
    X(TLSPH_FIELD_P_WAVE_SPEED, "p_wave_speed", "m/s", 1, 0)                                                           \
    X(TLSPH_FIELD_S_WAVE_SPEED, "s_wave_speed", "m/s", 1, 0)                                                           \
    X(TLSPH_FIELD_VELOCITY_GRADIENT, "velocity_gradient", "1/s", 9, 0) /* by X; of the last stage, not of the state */     \
    X(TLSPH_FIELD_VOLUME, "volume", "m^3", 1, 0)                                                                       \
    X(TLSPH_FIELD_MASS, "mass", "kg", 1, 0)                                                                            \
    X(TLSPH_FIELD_BOUNDARY_AREA, "boundary_area", "m^2", 3, 0)   /* B_a = -sum_b C_ab^skew, outward */                 \
    X(TLSPH_FIELD_NEIGHBOURS, "neighbours", "1", 1, 0)                                                                 \
    X(TLSPH_FIELD_BODY, "body", "1", 1, 0)                       /* connected part that the particle belongs to */

typedef enum tlsph_field {
#define TLSPHI_FIELD(id, name, unit, components, writable) id,
    TLSPH_FIELDS(TLSPHI_FIELD)
#undef TLSPHI_FIELD
    TLSPH_FIELD_COUNT
} tlsph_field;

/* Shapes that tlsph_cloud_create fills with a lattice: a cell belongs to the body if its centre does. */
typedef enum tlsph_shape {
    TLSPH_BOX,      /* origin, size */
    TLSPH_L_SHAPE,  /* the box without the quadrant X > origin + notch in the first two directions */
    TLSPH_CYLINDER, /* in the box along `axis`, as wide as fits; hollow with inner_radius. 2-D: a disk, a ring */
    TLSPH_SPHERE,   /* in the box; hollow with inner_radius */
    TLSPH_PREDICATE, /* where inside(user, X) is not 0, within the box */
    TLSPH_DISTANCE,  /* where distance(user, X) is negative, within the box */
    TLSPH_TRIANGLES  /* in the closed `surface`; TLSPH_SCATTERED only; origin and size are not used */
} tlsph_shape;
typedef enum tlsph_placement {
    TLSPH_ON_FACES,     /* particles at cell corners, on the faces of the body, with tributary volumes; default */
    TLSPH_CELL_CENTRED, /* particles at cell centres, equal volumes */
    TLSPH_SCATTERED,    /* an irregular cloud with Voronoi volumes and areas, particles on corners, edges and faces and
                           inside (see [SHAPES]); not TLSPH_PREDICATE. For TLSPH_CLOSED */
    TLSPH_SCATTERED_INSIDE /* the same with all particles inside, some half a spacing behind the surface, and moments */
} tlsph_placement;
typedef int (*tlsph_inside_fn)(void *user, const tlsph_real X[3]);
/* A length (m) at X: distance from a body's surface, negative inside; or a spacing. */
typedef tlsph_real (*tlsph_length_fn)(void *user, const tlsph_real X[3]);

/* A closed surface: triangles of 3 corners, counter-clockwise from outside; in 2-D segments of 2, the body on the left.
   Corners have 3 reals each (m); those at the same place must be equal to the last bit. */
typedef struct tlsph_surface {
    size_t count;
    const tlsph_real *corners;
} tlsph_surface;

typedef struct tlsph_fill {
    uint32_t cookie;
    int dimension;
    tlsph_shape shape;
    tlsph_real origin[3], size[3];  /* m, of the box around the shape */
    tlsph_real notch[2];            /* TLSPH_L_SHAPE */
    tlsph_real inner_radius;        /* m; TLSPH_CYLINDER, TLSPH_SPHERE */
    int axis;                       /* TLSPH_CYLINDER: 0, 1 or 2 */
    tlsph_real spacing;             /* m; rounded in each direction so that the box holds whole cells */
    tlsph_placement placement;
    tlsph_real jitter;              /* inner particles move by up to jitter x spacing along each axis; 0 to 0.45 */
    uint64_t seed;                  /* of the jitter */
    int voronoi;                    /* 1: volumes and area vectors from Voronoi cells, for TLSPH_CLOSED; with
                                       TLSPH_CELL_CENTRED moments, too; default 0 */
    tlsph_inside_fn inside;         /* TLSPH_PREDICATE */
    void *inside_user;
    tlsph_length_fn distance;       /* TLSPH_DISTANCE: right near the surface; min joins bodies, max cuts, - turns inside out */
    void *distance_user;
    tlsph_surface surface;          /* TLSPH_TRIANGLES */
    tlsph_length_fn spacing_at;     /* TLSPH_SCATTERED: local spacing, smooth, 1 : 4 at most; 3-D: steeper than
                                       0.1 m/m needs support 0.9; NULL: `spacing` */
    void *spacing_user;
    tlsph_allocator allocator;
} tlsph_fill;

/* A cloud that owns its arrays. `particles` goes into the description as it is. */
typedef struct tlsph_cloud {
    tlsph_particles particles;
    tlsph_real cell_size[3];
    void *memory; size_t memory_size; tlsph_allocator allocator;
} tlsph_cloud;

/* A solver's discrete operator, read-only, in the solver's own order (see tlsph_operator_view).
   grad f_a = 1/V_a sum_b (f_b - f_a)/2 (x) C_ab, with C_ab = M_a g_ab + r_ab, r_ab = 0 where `rests` is NULL. */
typedef struct tlsph_operator {
    size_t count, pairs;
    int dimension, corrected;      /* 1: M_a by tlsph_correction_read, 0: M_a = I */
    /* NULL where the scene keeps no pairs (see desc.keep_pairs): */
    const size_t *first;           /* count + 1: pairs of a are first[a] ... first[a + 1] - 1 */
    const uint32_t *neighbours;    /* b, solver's order */
    const tlsph_real *vectors;     /* g_ab, `dimension` each, antisymmetric */
    const tlsph_real *rests;       /* r_ab, `dimension` each, or NULL */
    const tlsph_real *volumes;     /* V_a */
    const tlsph_real *spacing;     /* tau_a, the length that the time step sees */
    const uint32_t *host;          /* host number of each */
} tlsph_operator;

/* What tlsph_preflight may have to say: code and text. */
#define TLSPH_HINTS(X)                                                                                                 \
    X(TLSPH_HINT_WEAK_SUPPORT, "neighbours of a particle lie nearly in a plane or on a line: its gradients are poor")  \
    X(TLSPH_HINT_THIN, "a body is fewer than 3 particles thick: bending is poor, and two stages are unstable without " \
                       "loads; take a smaller spacing or TLSPH_SSP_RK3")                                               \
    X(TLSPH_HINT_IRREGULAR, "corrected kernels do not converge on an irregular cloud; TLSPH_CLOSED does")              \
    X(TLSPH_HINT_INCOMPRESSIBLE, "nearly incompressible (nu > 0.49) without J evolved: pressures will be noisy; "      \
                                 "TLSPH_PFJ smooths them")                                                             \
    X(TLSPH_HINT_CFL, "cfl is above tlsph_cfl_limit of the integrator, or above what the damping of the shortest waves "   \
                      "allows at this Poisson's ratio")                                                                \
    X(TLSPH_HINT_SMALL_PARTICLES, "the least spacing is under a tenth of the largest and sets the time step for all")  \
    X(TLSPH_HINT_DIFFUSION, "heat conduction, not sound, limits the time step")                                        \
    X(TLSPH_HINT_UNITS_TIME, "the end time is less than a step or more than 1e8 steps: are units mixed?")              \
    X(TLSPH_HINT_UNITS_LOAD, "a load or driven velocity exceeds the stiffness or sound speed: are units mixed?")

typedef enum tlsph_hint {
#define TLSPHI_HINT(id, text) id,
    TLSPH_HINTS(TLSPHI_HINT)
#undef TLSPHI_HINT
    TLSPH_HINT_COUNT
} tlsph_hint;

/* A scene before it runs (see tlsph_preflight). */
typedef struct tlsph_preflight_report {
    unsigned hints;                     /* bit 1u << hint is set for each tlsph_hint */
    size_t particles, pairs, bodies, smallest_body, bytes;
    size_t weakest; double support;     /* host number of the particle whose neighbours lie least evenly; 1: evenly, 0: in
                                           a plane */
    double spacing_least, spacing_most; /* tau, m */
    double time_step, steps;            /* s; steps to the end time if the state does not stiffen */
    double crossings;                   /* times that sound crosses the longest body till then */
    double pair_visits;                 /* pairs x stages x steps, with `rates` x passes: cost, to be multiplied by the
                                           bench's time a pair */
} tlsph_preflight_report;

/* Both sides of a pair for tlsph_pair_dissipation. 3-D; tensors row-major. */
typedef struct tlsph_pair_side {
    tlsph_real velocity[3], velocity_gradient[9];
    tlsph_real Sigma_J, Sigma_J_gradient[3];
    tlsph_real theta, theta_R;
    tlsph_real density, c_p, c_s, drift_ratio; /* k = W''(phi)/kappa */
} tlsph_pair_side;
typedef struct tlsph_pair_flux { tlsph_real D_p[3], D_J, D_E, production; } tlsph_pair_flux;

typedef struct tlsph_solver tlsph_solver;

/* Nodes around a place for tlsph_reproduce. */
typedef struct tlsph_nodes {
    int dimension, order;         /* 1 to 3; monomials that are reproduced exactly: up to order 1 or 2 */
    tlsph_kernel kernel;
    size_t count;
    const tlsph_real *positions;  /* 3 each, m */
    const tlsph_real *radii;      /* of each node's support, m, > 0 */
} tlsph_nodes;
/* Where tlsph_reproduce writes, each node's values together; an entry that is NULL is left out. */
typedef struct tlsph_shape_functions {
    tlsph_real *value;             /* Psi_I(x), 1 each (003-22) */
    tlsph_real *gradient;          /* grad Psi_I(x), 3 each, 1/m (003-23) */
    tlsph_real *implicit;          /* implicit gradient Psi^nabla_Ii(x), 3 each, 1/m (003-28) */
    tlsph_real *implicit_gradient; /* its derivatives (Psi^nabla_Ii,j + Psi^nabla_Ij,i)/2, 9 each, 1/m^2 (003-39) */
} tlsph_shape_functions;

/* ==== [API-FUNCTIONS] ==============================================================================================
   By lifetime. `error` may be NULL everywhere. Unless said otherwise a function may be called for different solvers on
   different threads at once, and costs O(count). */

/* -- describe -- */
TLSPH_API tlsph_desc tlsph_desc_default(int dimension);
/* Sets how a scene is computed, when `particles` and what is computed (unknowns, thermal, operator) are set: integrator,
   cfl, conduction_stages (9), sharp_gradients (0) and, where the operator is one of lattices with 6 neighbours, its kind.
   Points of the measured front of error against time (bench/study.c):
     TLSPH_PRESET_FAST      TLSPH_CELLS, TLSPH_LEAPFROG: the accuracy of the default in less than half of its time
     TLSPH_PRESET_BALANCED  TLSPH_CELLS_4, TLSPH_RK3_FROZEN: smooth motion some 10 times as accurate
     TLSPH_PRESET_ACCURATE  TLSPH_CELLS_4, TLSPH_RK4_FROZEN: smooth motion some 20 times
   Where bodies are only a few cells thick, or clamped edges rule the error, a finer lattice with FAST gains more. Waves in
   boxes gain most by sharp_gradients. Leaves incompressible scenes as they are. */
TLSPH_API void tlsph_preset(tlsph_desc *desc, tlsph_preset_name name);
TLSPH_API tlsph_material tlsph_material_default(tlsph_material_kind kind);
TLSPH_API tlsph_condition tlsph_condition_default(tlsph_condition_kind kind);
TLSPH_API tlsph_fill tlsph_fill_default(int dimension);

/* Fills a shape with particles. ERROR_DESCRIPTION, ERROR_ARGUMENT, ERROR_NOT_FINITE, ERROR_SIZE, ERROR_MEMORY; then
   *cloud is empty. */
TLSPH_API tlsph_result tlsph_cloud_create(const tlsph_fill *fill, tlsph_cloud *cloud, tlsph_error *error);
TLSPH_API void tlsph_cloud_destroy(tlsph_cloud *cloud);
/* Voronoi cells of the particles, cut by the body's surface: V_a (1 each), B_a (3 each) and, if not NULL, moments T_a (9
   each) for TLSPH_CLOSED. Volumes add up to the body's and have its centroid, area vectors add up to zero, B_a (x) X_a + T_a
   to the volume times I. Reads count, positions, spacing (or spacings) of
   `particles`, which must lie in the body or on its surface. allocator NULL: the default one. ERROR_SURFACE names the
   place; ERROR_VOLUME a particle outside. */
TLSPH_API tlsph_result tlsph_voronoi(int dimension, const tlsph_particles *particles, const tlsph_surface *surface,
                                     const tlsph_allocator *allocator, tlsph_real *volumes, tlsph_real *areas,
                                     tlsph_real *moments, tlsph_error *error);
/* Numbers of all particles with |X[axis] - value| <= tolerance (m); of those with moments, X is the middle of their share of
   the surface across that axis, inner ones do not count. Writes at most `capacity`, returns how many there are. */
TLSPH_API size_t tlsph_select_plane(const tlsph_particles *particles, int axis, tlsph_real value, tlsph_real tolerance,
                                    uint32_t *out, size_t capacity);
/* The same for inside(user, X) != 0. */
TLSPH_API size_t tlsph_select(const tlsph_particles *particles, tlsph_inside_fn inside, void *user, uint32_t *out,
                              size_t capacity);

/* -- measure and create -- */
/* Bytes and neighbours that tlsph_create would need; the same checks and errors. */
TLSPH_API tlsph_result tlsph_measure(const tlsph_desc *desc, tlsph_size *size, tlsph_error *error);
/* A solver at time 0: undeformed, at rest, at reference temperature, constraints applied. On error *solver is NULL and
   nothing is kept. All data of the description is copied, so the host may free its arrays. Scratch memory is taken from
   the allocator and given back before returning. */
TLSPH_API tlsph_result tlsph_create(const tlsph_desc *desc, tlsph_solver **solver, tlsph_error *error);
TLSPH_API void tlsph_destroy(tlsph_solver *solver); /* NULL is allowed */

/* -- step -- */
/* One step of the stable size, but at most dt_limit (s, > 0; infinite allowed). ERROR_INVERSION, ERROR_TEMPERATURE,
   ERROR_NOT_FINITE, ERROR_TIME_STEP: the state is that of the last good step, readable and saveable; see
   tlsph_last_error. */
TLSPH_API tlsph_result tlsph_step(tlsph_solver *solver, tlsph_real dt_limit);
/* Steps until `time` (s) is met exactly. Does nothing if it is past. */
TLSPH_API tlsph_result tlsph_advance(tlsph_solver *solver, tlsph_real time);
TLSPH_API tlsph_real tlsph_time(const tlsph_solver *solver);               /* s */
TLSPH_API uint64_t tlsph_step_count(const tlsph_solver *solver);
TLSPH_API tlsph_real tlsph_stable_time_step(const tlsph_solver *solver);   /* s, for the current state */
TLSPH_API const tlsph_error *tlsph_last_error(const tlsph_solver *solver);
/* Largest CFL number at which a scheme was stable with 6 neighbours on noise (nu = 0.3, 0.45) and twisting columns, 0 for no
   such scheme. `cfl` may be set higher, up to 1. The limit falls to 1/(1 + 2 c_s/c_p) for large bodies with nu below 0.3
   (three full stages: 1.25 times that), 0.41 at nu = 0, see tlsph_preflight; and on other operators. */
TLSPH_API tlsph_real tlsph_cfl_limit(tlsph_integrator integrator);

/* -- read and set -- */
TLSPH_API size_t tlsph_count(const tlsph_solver *solver);
/* Copies a field into out, in the host's order, `components` reals a particle. ERROR_FIELD where the scene lacks it. */
TLSPH_API tlsph_result tlsph_read(const tlsph_solver *solver, tlsph_field field, tlsph_real *out);
/* Sets a writable field from `in`, in the host's order; the old state stays if any value is not allowed. */
TLSPH_API tlsph_result tlsph_write(tlsph_solver *solver, tlsph_field field, const tlsph_real *in);
TLSPH_API const char *tlsph_field_name(tlsph_field field);
TLSPH_API const char *tlsph_field_unit(tlsph_field field);
TLSPH_API int tlsph_field_components(tlsph_field field);
/* Number of connected bodies. */
TLSPH_API size_t tlsph_body_count(const tlsph_solver *solver);
TLSPH_API void tlsph_operator_view(const tlsph_solver *solver, tlsph_operator *view);
/* M_a (9, row-major) of particle a of that view, a < count. */
TLSPH_API void tlsph_correction_read(const tlsph_solver *solver, size_t a, tlsph_real *M);
TLSPH_API void tlsph_size_read(const tlsph_solver *solver, tlsph_size *size);
/* What a created scene will cost until end_time (s) and what looks wrong about it; what is certainly wrong, tlsph_create
   has refused. */
TLSPH_API void tlsph_preflight(const tlsph_solver *solver, tlsph_real end_time, tlsph_preflight_report *report);
TLSPH_API const char *tlsph_hint_text(tlsph_hint hint);
/* All zero where the operator is not TLSPH_CLOSED. */
TLSPH_API void tlsph_closure_read(const tlsph_solver *solver, tlsph_closure *closure);
TLSPH_API void tlsph_ledger_read(const tlsph_solver *solver, tlsph_ledger *ledger);
/* ERROR_FIELD without TLSPH_INCOMPRESSIBLE. */
TLSPH_API tlsph_result tlsph_pressure_report_read(const tlsph_solver *solver, tlsph_pressure_report *report);
/* Starts the cumulative entries anew from the current state. */
TLSPH_API void tlsph_ledger_reset(tlsph_solver *solver);

/* -- save -- */
TLSPH_API size_t tlsph_save_size(const tlsph_solver *solver);
/* Writes a checkpoint of exactly tlsph_save_size bytes; ERROR_SIZE if `size` is less. */
TLSPH_API tlsph_result tlsph_save(const tlsph_solver *solver, void *buffer, size_t size);
/* Continues from a checkpoint saved by a solver of the same description, bitwise as if never interrupted.
   ERROR_CHECKPOINT for damaged or foreign data; then nothing changes. */
TLSPH_API tlsph_result tlsph_restore(tlsph_solver *solver, const void *buffer, size_t size);

/* -- low-level pieces, usable alone; thread-safe -- */
TLSPH_API const char *tlsph_result_text(tlsph_result result);
/* det F (9, row-major). */
TLSPH_API tlsph_real tlsph_determinant(const tlsph_real *F);
/* H = cof F = 1/2 F x F. */
TLSPH_API void tlsph_cofactor(const tlsph_real *F, tlsph_real *H);
/* C = A x B, tensor cross product (000, footnote 5): C_iI = e_ijk e_IJK A_jJ B_kK. */
TLSPH_API void tlsph_cross(const tlsph_real *A, const tlsph_real *B, tlsph_real *C);
/* W(r) and dW/dr of a normalised kernel of smoothing length h (m) and support radius 2h in 2 or 3 dimensions. */
TLSPH_API void tlsph_kernel_evaluate(tlsph_kernel kernel, int dimension, tlsph_real r, tlsph_real h, tlsph_real *W,
                                     tlsph_real *dW);
/* Signed distances (m, negative inside) for bodies of TLSPH_DISTANCE; axis of any length. */
TLSPH_API tlsph_real tlsph_distance_box(const tlsph_real X[3], const tlsph_real low[3], const tlsph_real high[3]);
TLSPH_API tlsph_real tlsph_distance_sphere(const tlsph_real X[3], const tlsph_real centre[3], tlsph_real radius);
TLSPH_API tlsph_real tlsph_distance_cylinder(const tlsph_real X[3], const tlsph_real centre[3], const tlsph_real axis[3],
                                             tlsph_real radius, tlsph_real length);
TLSPH_API tlsph_real tlsph_distance_torus(const tlsph_real X[3], const tlsph_real centre[3], const tlsph_real axis[3],
                                          tlsph_real radius, tlsph_real tube);
/* All a material gives at deformation gradient F (9) and temperature theta (K), with H = cof F and J = det F.
   ERROR_MATERIAL for impossible constants, ERROR_INVERSION for det F <= 0, ERROR_TEMPERATURE for theta <= 0. */
TLSPH_API tlsph_result tlsph_material_evaluate(const tlsph_material *material, const tlsph_real *F, tlsph_real theta,
                                               tlsph_material_state *out);
/* Tests a material, above all a user's, at `samples` random states F = I + entries up to `strain`, theta within a quarter
   of theta_R: is P the derivative of the energy, eta of it too, is it objective, do the moduli bound its wave speeds?
   ERROR_MATERIAL with the first property that fails; the report is filled in any case. */
TLSPH_API tlsph_result tlsph_material_check(const tlsph_material *material, double strain, int samples,
                                            tlsph_material_report *report, tlsph_error *error);
/* Dissipative fluxes into side a of one pair: C, c reference and current area vectors (C_ab^skew, c_ab^skew, m^2),
   d = X_b - X_a (m), a_J the factor of the J dissipation (0 where J is not evolved). production >= 0 is the power turned
   into heat, half of it on each side. TLSPH_SELF_ADJOINT: the pair's own part, without that of its stress. Source: METHOD
   section "Dissipation", 000 (66)-(76). */
TLSPH_API void tlsph_pair_dissipation(tlsph_dissipation kind, const tlsph_pair_side *a, const tlsph_pair_side *b,
                                      const tlsph_real C[3], const tlsph_real c[3], const tlsph_real d[3], tlsph_real a_J,
                                      tlsph_pair_flux *out);

/* -- reproducing kernels (003 section 3), usable alone; thread-safe -- */
/* Shape functions at x of all nodes given; nodes out of reach get zeros. sum_I Psi_I(x) f(X_I) = f(x) for every polynomial
   f up to the order, and its derivatives follow likewise from gradient and implicit gradient. ERROR_DESCRIPTION for an
   impossible dimension or order, ERROR_NEIGHBOURS where the nodes in reach do not determine a polynomial. */
TLSPH_API tlsph_result tlsph_reproduce(const tlsph_nodes *nodes, const tlsph_real x[3],
                                       const tlsph_shape_functions *out, tlsph_error *error);
/* Weight W = V (m^d) of a node that stands at x for the box between `low` and `high`, and its second moments
   M_i = integral of (X_i - x_i)^2 over the box (003-35). */
TLSPH_API void tlsph_nodal_weight(int dimension, const tlsph_real low[3], const tlsph_real high[3], const tlsph_real x[3],
                                  tlsph_real *weight, tlsph_real second[3]);

#ifdef __cplusplus
}
#endif
#endif /* TLSPH_H */
/* ==== [API-END] ==================================================================================================== */

#ifdef TLSPH_IMPLEMENTATION
#ifndef TLSPH_IMPLEMENTATION_DONE
#define TLSPH_IMPLEMENTATION_DONE

/* ==== [METHOD] =====================================================================================================

   CONSERVATION LAWS, per undeformed volume (000-1, 3, 14)
     dp/dt = DIV P + f      dF/dt = grad v      dH/dt = F x grad v      dJ/dt = H : grad v      dx/dt = v
     dE/dt = DIV(P^T v - Q) + f.v + s           theta deta/dt = -DIV Q + s
   with P = Sigma_F + Sigma_H x F + Sigma_J H (000-12) and Q = -h/J H^T H grad theta (000-13).

   DISCRETE OPERATOR: volumes V_a, pair vectors C_ab, boundary area vectors B_a = -sum_b C_ab^skew; d_ab = X_b - X_a
     grad f_a  = 1/V_a sum_b (f_b - f_a)/2 (x) C_ab                                             (000-53)
     T_a       = sum_b (P_a C_ab - P_b C_ba)/2 + D_p                                            (000-55)
     V_a dE_a  = sum_b ((P_a C_ab).v_b - (P_b C_ba).v_a)/2 - heat + D_E                         (000-54e)
   The force is the adjoint of the gradient, so the power of the stresses is P_a : grad v_a in each particle exactly and
   nothing is lost between momentum and energy. Every builder writes C_ab = M_a g_ab with g_ab = -g_ba, so that
   P_a C_ab - P_b C_ba = (P_a M_a + P_b M_b) g_ab needs one vector a pair; M = I where C itself is antisymmetric. Only
   the operators of 002 are not of this form and store a second vector, C_ab = g_ab + r_ab with r_ab = r_ba ([BONDS]).

   TWO VOLUMES. A particle on a face carries half a cell of mass (V_a), but counts as a whole cell in kernel sums (w_a).
   With V_a in both places C_ab != -C_ba beside faces and the errors of the swinging cube grow 10 to 100 times.

   SYMBOLS               code            meaning                                        unit
     p, v                p, v            momentum per volume, velocity                   kg/(m^2 s), m/s
     F, H, J             F, H, J         deformation gradient, cofactor, Jacobian        1
     d, phi              d, phi          det F, drift J - d                              1
     P                   P               first Piola-Kirchhoff stress                    Pa
     Sigma_J             S               conjugate of J                                  Pa
     E, eta, theta       E, E, theta     energy or entropy share one array; temperature  J/m^3, J/(m^3 K), K
     C_ab, g_ab, M_a     g, M            pair vector, its antisymmetric factor           m^2
     H_a M_a             A               area map that pushes g forward: c = A g         1
     c_p, c_s            c_p, c_s        isentropic wave speeds (bounds)                 m/s
     zeta, gamma         zeta, gamma     neo-Hookean and Mooney constants                Pa
     c_v Gamma_0         beta            thermal stress modulus, 3 kappa alpha           Pa/K

   REFERENCES
     000  Ghavamian, Lee, Gil, Bonet, Heuze, Stainier, Comput. Methods Appl. Mech. Engrg. 379 (2021) 113736
     001  Lee, Gil, Ghavamian, Bonet, Comput. Methods Appl. Mech. Engrg. 344 (2019) 209-250
     002  Wiragunarsa, Zuhal, Dirgantara, Putra, Febrianto, bond-based deformation gradient (2024) */

/* ==== [SHIMS] ====================================================================================================== */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* gcc moves what only one side of a choice needs behind the choice, lest it trap in vain, and then makes no vectors of a
   loop over lanes. As nobody here asks which exceptions of floating point were raised, all may be worked out: without
   AVX that saves a third of a step, with AVX2 half. Results do not depend on it. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize("no-trapping-math")
#endif

#ifndef TLSPH_MALLOC
#define TLSPH_MALLOC(n) malloc(n)
#define TLSPH_FREE(p) free(p)
#endif
#ifndef TLSPH_ASSERT
#define TLSPH_ASSERT(x) ((void)0)
#endif

#ifdef TLSPH_STATIC
#define TLSPHI_DEF TLSPH_API
#else
#define TLSPHI_DEF
#endif

#if defined(__GNUC__) || defined(__clang__)
#define TLSPHI_INLINE static inline __attribute__((always_inline))
#elif defined(_MSC_VER)
#define TLSPHI_INLINE static __forceinline
#else
#define TLSPHI_INLINE static inline
#endif

/* Kept out of line: rare, and with many callers. Compilers would copy it into each, at a tenth of their time. */
#if defined(__GNUC__) || defined(__clang__)
#define TLSPHI_APART static __attribute__((noinline))
#else
#define TLSPHI_APART static
#endif

/* gcc leaves loops over the 2 or 3 components rolled at -O2 unless asked; clang unrolls them by itself. */
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 8
#define TLSPHI_UNROLL _Pragma("GCC unroll 9")
#else
#define TLSPHI_UNROLL
#endif
/* Before a loop over lanes: its rounds do not depend on each other, whatever the pointers may look like. Compilers
   would unroll short ones before they look for vectors, and then find few; and clang complains where it is told not to
   optimise and so does not make vectors of them. LANE_BY_LANE: before a loop that collects lanes from anywhere, which
   gcc does by single loads if it is unrolled; those take less time than the instruction that there is for it. */
#if defined(__clang__)
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wpass-failed"
#define TLSPHI_EACH_LANE _Pragma("clang loop vectorize(assume_safety) unroll(disable)")
#define TLSPHI_LANE_BY_LANE
#elif defined(__GNUC__) && __GNUC__ >= 8
#define TLSPHI_EACH_LANE _Pragma("GCC ivdep") _Pragma("GCC unroll 1")
#define TLSPHI_LANE_BY_LANE _Pragma("GCC unroll 16")
#else
#define TLSPHI_EACH_LANE
#define TLSPHI_LANE_BY_LANE
#endif

/* Lanes on the stack begin where cache lines do: gcc sees to it wherever it makes vectors, clang only where it is
   asked, and what lies across two lines takes longer, above all if it is loaded soon after it was stored. */
#if defined(__clang__)
#define TLSPHI_ALIGNED __attribute__((aligned(64)))
#else
#define TLSPHI_ALIGNED
#endif

#ifdef TLSPH_REAL_FLOAT
#define tlsphi_sqrt sqrtf
#define tlsphi_pow powf
#define tlsphi_log logf
#define tlsphi_abs fabsf
#define tlsphi_copysign copysignf
#else
#define tlsphi_sqrt sqrt
#define tlsphi_pow pow
#define tlsphi_log log
#define tlsphi_abs fabs
#define tlsphi_copysign copysign
#endif

#define TLSPHI_COOKIE 0x544c5350u /* "TLSP" */
#define TLSPHI_NONE 0xffffffffu
#define TLSPHI_LARGEST 1e300 /* stands for "no bound" in reductions */
#ifdef TLSPH_REAL_FLOAT
typedef uint32_t tlsphi_bits;
#define TLSPHI_EXPONENT 0x7f800000u /* its bits */
#define TLSPHI_EPSILON 1.1920929e-7
#define TLSPHI_TINY 1.17549435e-38f /* smallest normal number: divisors that may be 0 where the dividend is are no less */
#else
typedef uint64_t tlsphi_bits;
#define TLSPHI_EXPONENT 0x7ff0000000000000u
#define TLSPHI_EPSILON 2.220446049250313e-16
#define TLSPHI_TINY 2.2250738585072014e-308
#endif

#define TLSPHI_R(x) ((tlsph_real)(x)) /* a constant in the precision of the build */

/* yes ? a : b, both of them worked out: so gcc, too, makes vectors of it. */
TLSPHI_INLINE tlsph_real tlsphi_choose(int yes, tlsph_real a, tlsph_real b) { return yes ? a : b; }
TLSPHI_INLINE tlsph_real tlsphi_max(tlsph_real a, tlsph_real b) { return tlsphi_choose(a > b, a, b); }
TLSPHI_INLINE tlsph_real tlsphi_min(tlsph_real a, tlsph_real b) { return tlsphi_choose(a < b, a, b); }
static double tlsphi_dmax(double a, double b) { return a > b ? a : b; }
static double tlsphi_dmin(double a, double b) { return a < b ? a : b; }

/* Finite? Asked of the bits, because -ffast-math lets a compiler assume that isfinite is always true. */
TLSPHI_INLINE int tlsphi_finite(tlsph_real x) {
    tlsphi_bits bits;
    memcpy(&bits, &x, sizeof bits);
    return (bits & TLSPHI_EXPONENT) != TLSPHI_EXPONENT;
}
/* x^(-1/3) for positive, normal x to the last digit or two: a third of the exponent, taken from the bits, is right
   within a few percent, and each Newton step 4/3 y - x/3 y^4 doubles the digits (in this form few operations wait for
   each other, and a material waits for its roots). Inlined where the materials need it, because a call of libm from code
   that has used wide registers may cost more than all the rest of a material; and the same on every machine. */
TLSPHI_INLINE tlsph_real tlsphi_inverse_cube_root(tlsph_real x) {
    tlsph_real y;
    tlsphi_bits bits;
    memcpy(&bits, &x, sizeof bits);
#ifdef TLSPH_REAL_FLOAT
    bits = 0x54a21d2au - bits / 3;
#else /* a third of the upper half, as a product, because vector units do not divide integers */
    bits = (0x553ef0ffu - ((bits >> 32) * 0x55555556u >> 32)) << 32;
#endif
    memcpy(&y, &bits, sizeof y);
    const tlsph_real third = x * TLSPHI_R(1.0 / 3.0);
    TLSPHI_UNROLL for (int i = 0; i < 5; i++) {
        const tlsph_real square = y * y;
        y = TLSPHI_R(4.0 / 3.0) * y - third * square * square;
    }
    return y;
}
/* x^(-1/2) and x^(1/2) in the same manner, for loops over lanes: sqrt must set errno, which no compiler can do for eight
   numbers at once. A huge number for x = 0, but one whose square is finite. */
TLSPHI_INLINE tlsph_real tlsphi_inverse_root(tlsph_real given) {
    const tlsph_real least = 64 * TLSPHI_TINY, x = tlsphi_max(given, least); /* half of it must not be flushed to 0 */
    tlsph_real y;
    tlsphi_bits bits;
    memcpy(&bits, &x, sizeof bits);
#ifdef TLSPH_REAL_FLOAT
    bits = 0x5f375a86u - (bits >> 1);
#else
    bits = 0x5fe6eb50c7b537a9u - (bits >> 1);
#endif
    memcpy(&y, &bits, sizeof y);
    const tlsph_real half = x / 2;
    TLSPHI_UNROLL for (int i = 0; i < 4; i++) y = TLSPHI_R(1.5) * y - half * y * (y * y);
    return y;
}
TLSPHI_INLINE tlsph_real tlsphi_square_root(tlsph_real x) { return x * tlsphi_inverse_root(x); }
/* e^x to a digit or two of the last place, for loops over lanes: 2^n through the exponent's bits times a polynomial of what
   is left of x, |r| < 0.35. For |x| beyond the range of normal numbers, and for what is not finite, that of its end; with
   two comparisons gcc would follow each of their outcomes, and make no vectors. A large number of spacing 1 rounds to n and
   has n as its last bits; the others are set again so that -ffast-math does not take it away at once. */
TLSPHI_INLINE tlsph_real tlsphi_exp(tlsph_real given) {
#ifdef TLSPH_REAL_FLOAT
    const tlsph_real most = 87, large = 12582912, high = 0.693359375f, low = -2.12194440e-4f; /* high + low = ln 2, */
    const tlsphi_bits set = 0x4b000000u, bias = 127;                                          /* n high is exact */
    enum { TERMS = 7, SHIFT = 23 };
#else
    const tlsph_real most = 708, large = 6755399441055744.0, high = 0.693145751953125, low = 1.42860682030941723212e-6;
    const tlsphi_bits set = 0x4330000000000000u, bias = 1023;
    enum { TERMS = 13, SHIFT = 52 };
#endif
    const tlsph_real size = tlsphi_abs(given), x = tlsphi_copysign(size < most ? size : most, given);
    tlsph_real n = x * TLSPHI_R(1.4426950408889634) + large, y = 1, power;
    tlsphi_bits bits;
    memcpy(&bits, &n, sizeof bits);
    bits |= set;
    memcpy(&n, &bits, sizeof n);
    bits = (bits + bias) << SHIFT;
    memcpy(&power, &bits, sizeof power);
    n -= large;
    const tlsph_real r = (x - n * high) - n * low;
    TLSPHI_UNROLL for (int i = TERMS; i > 7; i--) y = 1 + y * r * TLSPHI_R(1.0 / i); /* two loops, as only 9 are unrolled */
    TLSPHI_UNROLL for (int i = 7; i > 0; i--) y = 1 + y * r * TLSPHI_R(1.0 / i);
    return y * power;
}
/* 1/x, or 0 for x = 0: lanes without a pair have nothing else than zeros, in whatever order a compiler multiplies them. */
TLSPHI_INLINE tlsph_real tlsphi_inverse_or_0(tlsph_real x) {
    return tlsphi_choose(x > TLSPHI_TINY, 1 / tlsphi_max(x, TLSPHI_TINY), 0);
}
TLSPHI_INLINE int tlsphi_nan(tlsph_real x) { /* not finite, and not equal to infinity's bits */
    const tlsph_real infinity = (tlsph_real)HUGE_VAL, minus = -infinity;
    return !tlsphi_finite(x) && memcmp(&x, &infinity, sizeof x) != 0 && memcmp(&x, &minus, sizeof x) != 0;
}
static int tlsphi_all_finite(const tlsph_real *x, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (!tlsphi_finite(x[i])) return 0;
    return 1;
}

/* Fills an error record and returns its result, so that callers can write `return tlsphi_fail(...)`. */
TLSPHI_APART tlsph_result tlsphi_fail(tlsph_error *error, tlsph_result result, const char *stage, const char *field,
                                size_t particle, double value, double limit, const char *allowed) {
    if (!error) return result;
    memset(error, 0, sizeof *error);
    error->result = result;
    error->stage = stage;
    error->field = field;
    error->cause = "";
    error->particle = particle;
    error->value = value;
    error->limit = limit;
    if (particle == TLSPH_NO_PARTICLE)
        snprintf(error->message, sizeof error->message, "%s: %s; %s is %g, allowed: %s", stage,
                 tlsph_result_text(result), field, value, allowed);
    else
        snprintf(error->message, sizeof error->message, "%s: %s; particle %lu: %s is %g, allowed: %s", stage,
                 tlsph_result_text(result), (unsigned long)particle, field, value, allowed);
    return result;
}
static void tlsphi_no_error(tlsph_error *error) {
    if (!error) return;
    memset(error, 0, sizeof *error);
    error->stage = error->field = error->cause = "";
    error->particle = TLSPH_NO_PARTICLE;
}

TLSPHI_DEF const char *tlsph_result_text(tlsph_result result) {
    static const char *const texts[] = {
#define TLSPHI_RESULT(name, text) text,
        TLSPH_RESULTS(TLSPHI_RESULT)
#undef TLSPHI_RESULT
    };
    return (unsigned)result < (unsigned)TLSPH_RESULT_COUNT ? texts[result] : "no such result";
}

static void *tlsphi_default_allocate(void *user, size_t size) {
    (void)user;
    return TLSPH_MALLOC(size);
}
static void tlsphi_default_release(void *user, void *memory, size_t size) {
    (void)user;
    (void)size;
    TLSPH_FREE(memory);
}
static tlsph_allocator tlsphi_allocator(const tlsph_allocator *given) {
    tlsph_allocator a = *given;
    if (!a.allocate || !a.release) {
        a.allocate = tlsphi_default_allocate;
        a.release = tlsphi_default_release;
        a.user = NULL;
    }
    return a;
}

/* Runs task(arg, i) for every i: on the host's threads, with OpenMP, or serially. */
TLSPHI_APART void tlsphi_parallel(tlsph_run_fn run, void *user, int threads, tlsph_task_fn task, void *arg,
                                  size_t tasks) {
    const long count = (long)tasks;
    if (run) {
        run(user, task, arg, tasks);
        return;
    }
#ifdef _OPENMP
    if (threads > 0) {
#pragma omp parallel for schedule(static) num_threads(threads)
        for (long i = 0; i < count; i++) task(arg, (size_t)i);
        return;
    }
#pragma omp parallel for schedule(static)
#else
    (void)threads;
#endif
    for (long i = 0; i < count; i++) task(arg, (size_t)i);
}

/* A bump allocator over one block. With memory == NULL it only counts, so the same code measures and lays out. */
typedef struct tlsphi_arena {
    unsigned char *memory;
    size_t used, size;
    int overflow;
} tlsphi_arena;

TLSPHI_APART void *tlsphi_take(tlsphi_arena *arena, size_t count, size_t size) {
    size_t start = (arena->used + 63) & ~(size_t)63;
    if (size && count > (SIZE_MAX / 4 - start) / size) {
        arena->overflow = 1;
        return NULL;
    }
    arena->used = start + count * size;
    if (!arena->memory) return NULL;
    if (arena->used > arena->size) {
        arena->overflow = 1;
        return NULL;
    }
    return arena->memory + start;
}
#define TLSPHI_TAKE(arena, type, count) ((type *)tlsphi_take((arena), (count), sizeof(type)))

/* ==== [TENSORS] ====================================================================================================
   Small loops with the dimension as a constant argument: after inlining they are straight code of 2 or 3 components.
   3x3 tensors are row-major, first index spatial. */

TLSPHI_INLINE tlsph_real tlsphi_dot(int n, const tlsph_real *a, const tlsph_real *b) {
    tlsph_real sum = a[0] * b[0];
    TLSPHI_UNROLL for (int i = 1; i < n; i++) sum += a[i] * b[i];
    return sum;
}
/* y = A x with n rows, `width` columns */
TLSPHI_INLINE void tlsphi_multiply_thin(int n, int width, const tlsph_real *A, const tlsph_real *x, tlsph_real *y) {
    TLSPHI_UNROLL for (int i = 0; i < n; i++) y[i] = tlsphi_dot(width, A + i * width, x);
}
TLSPHI_INLINE void tlsphi_multiply(int n, const tlsph_real *A, const tlsph_real *x, tlsph_real *y) {
    tlsphi_multiply_thin(n, n, A, x, y);
}
/* y = A^T x */
TLSPHI_INLINE void tlsphi_multiply_transposed(int n, const tlsph_real *A, const tlsph_real *x, tlsph_real *y) {
    TLSPHI_UNROLL for (int i = 0; i < n; i++) {
        y[i] = A[i] * x[0];
        TLSPHI_UNROLL for (int j = 1; j < n; j++) y[i] += A[j * n + i] * x[j];
    }
}
/* y = (A + B) x / 2, of n rows and `width` columns */
TLSPHI_INLINE void tlsphi_multiply_mean(int n, int width, const tlsph_real *A, const tlsph_real *B, const tlsph_real *x,
                                        tlsph_real *y) {
    TLSPHI_UNROLL for (int i = 0; i < n; i++) {
        y[i] = (A[i * width] + B[i * width]) * (x[0] / 2);
        TLSPHI_UNROLL for (int j = 1; j < width; j++) y[i] += (A[i * width + j] + B[i * width + j]) * (x[j] / 2);
    }
}
/* A += a (x) b */
TLSPHI_INLINE void tlsphi_add_outer(int n, tlsph_real *A, const tlsph_real *a, const tlsph_real *b) {
    TLSPHI_UNROLL for (int i = 0; i < n; i++) { TLSPHI_UNROLL for (int j = 0; j < n; j++) A[i * n + j] += a[i] * b[j]; }
}
/* C = A B */
TLSPHI_INLINE void tlsphi_product(int n, const tlsph_real *A, const tlsph_real *B, tlsph_real *C) {
    TLSPHI_UNROLL for (int i = 0; i < n; i++) {
        TLSPHI_UNROLL for (int j = 0; j < n; j++) {
            tlsph_real sum = 0;
            TLSPHI_UNROLL for (int k = 0; k < n; k++) sum += A[i * n + k] * B[k * n + j];
            C[i * n + j] = sum;
        }
    }
}
/* C = A B^T */
TLSPHI_INLINE void tlsphi_product_transposed(int n, const tlsph_real *A, const tlsph_real *B, tlsph_real *C) {
    TLSPHI_UNROLL for (int i = 0; i < n; i++) {
        TLSPHI_UNROLL for (int j = 0; j < n; j++) C[i * n + j] = tlsphi_dot(n, A + i * n, B + j * n);
    }
}
/* The same where the dimension is none, one copy of each. */
TLSPHI_APART tlsph_real tlsphi_any_dot(int n, const tlsph_real *a, const tlsph_real *b) { return tlsphi_dot(n, a, b); }
TLSPHI_APART void tlsphi_any_multiply(int n, const tlsph_real *A, const tlsph_real *x, tlsph_real *y) {
    tlsphi_multiply(n, A, x, y);
}
TLSPHI_APART void tlsphi_any_multiply_transposed(int n, const tlsph_real *A, const tlsph_real *x, tlsph_real *y) {
    tlsphi_multiply_transposed(n, A, x, y);
}
TLSPHI_APART void tlsphi_any_product(int n, const tlsph_real *A, const tlsph_real *B, tlsph_real *C) {
    tlsphi_product(n, A, B, C);
}
/* Plane strain to 3-D: the out-of-plane diagonal entry is `last`. In 3-D a copy. */
TLSPHI_INLINE void tlsphi_expand(int n, const tlsph_real *A, tlsph_real last, tlsph_real *out) {
    if (n == 3) {
        memcpy(out, A, 9 * sizeof *out);
        return;
    }
    out[0] = A[0];
    out[1] = A[1];
    out[2] = 0;
    out[3] = A[2];
    out[4] = A[3];
    out[5] = 0;
    out[6] = 0;
    out[7] = 0;
    out[8] = last;
}
/* The in-plane part of a 3-D tensor. */
TLSPHI_INLINE void tlsphi_shrink(int n, const tlsph_real *A, tlsph_real *out) {
    if (n == 3) {
        memcpy(out, A, 9 * sizeof *out);
        return;
    }
    out[0] = A[0];
    out[1] = A[1];
    out[2] = A[3];
    out[3] = A[4];
}
static void tlsphi_identity(tlsph_real *A) {
    for (int i = 0; i < 9; i++) A[i] = i % 4 == 0;
}

TLSPHI_DEF tlsph_real tlsph_determinant(const tlsph_real *F) {
    return F[0] * (F[4] * F[8] - F[5] * F[7]) + F[1] * (F[5] * F[6] - F[3] * F[8]) + F[2] * (F[3] * F[7] - F[4] * F[6]);
}
/* Rows of cof F are cross products of the rows of F. */
TLSPHI_INLINE void tlsphi_cofactor_inline(const tlsph_real *F, tlsph_real *H) {
    H[0] = F[4] * F[8] - F[5] * F[7];
    H[1] = F[5] * F[6] - F[3] * F[8];
    H[2] = F[3] * F[7] - F[4] * F[6];
    H[3] = F[7] * F[2] - F[8] * F[1];
    H[4] = F[8] * F[0] - F[6] * F[2];
    H[5] = F[6] * F[1] - F[7] * F[0];
    H[6] = F[1] * F[5] - F[2] * F[4];
    H[7] = F[2] * F[3] - F[0] * F[5];
    H[8] = F[0] * F[4] - F[1] * F[3];
}
TLSPHI_DEF void tlsph_cofactor(const tlsph_real *F, tlsph_real *H) { tlsphi_cofactor_inline(F, H); }
/* (A x B)_iI = e_ijk e_IJK A_jJ B_kK: the polar form of the cofactor, cof(A + B) = cof A + A x B + cof B. */
TLSPHI_INLINE void tlsphi_cross_inline(const tlsph_real *A, const tlsph_real *B, tlsph_real *C) {
    TLSPHI_UNROLL for (int i = 0; i < 3; i++) {
        const int j = 3 * ((i + 1) % 3), k = 3 * ((i + 2) % 3);
        TLSPHI_UNROLL for (int I = 0; I < 3; I++) {
            const int J = (I + 1) % 3, K = (I + 2) % 3;
            C[3 * i + I] = A[j + J] * B[k + K] - A[j + K] * B[k + J] + A[k + K] * B[j + J] - A[k + J] * B[j + K];
        }
    }
}
TLSPHI_DEF void tlsph_cross(const tlsph_real *A, const tlsph_real *B, tlsph_real *C) { tlsphi_cross_inline(A, B, C); }

/* Eigenvalues and vectors (columns of Q) of a symmetric 3x3 by cyclic Jacobi rotations. A is destroyed: its diagonal
   becomes the eigenvalues, unordered. Equal eigenvalues do no harm: no difference of them is ever divided by. */
static void tlsphi_rotate(double A[9], double Q[9], int p, int q) {
    const double apq = A[3 * p + q];
    if (apq == 0) return;
    const double h = (A[4 * q] - A[4 * p]) / (2 * apq);
    const double t = (h < 0 ? -1.0 : 1.0) / (fabs(h) + sqrt(h * h + 1));
    const double c = 1 / sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < 3; k++) {
        const double akp = A[3 * k + p], akq = A[3 * k + q];
        A[3 * k + p] = c * akp - s * akq;
        A[3 * k + q] = s * akp + c * akq;
    }
    for (int k = 0; k < 3; k++) {
        const double apk = A[3 * p + k], aqk = A[3 * q + k], qkp = Q[3 * k + p], qkq = Q[3 * k + q];
        A[3 * p + k] = c * apk - s * aqk;
        A[3 * q + k] = s * apk + c * aqk;
        Q[3 * k + p] = c * qkp - s * qkq;
        Q[3 * k + q] = s * qkp + c * qkq;
    }
}
static void tlsphi_eigen(double A[9], double Q[9]) {
    for (int i = 0; i < 9; i++) Q[i] = i % 4 == 0;
    for (int sweep = 0; sweep < 12; sweep++) {
        const double off = fabs(A[1]) + fabs(A[2]) + fabs(A[5]), size = fabs(A[0]) + fabs(A[4]) + fabs(A[8]);
        if (!(off > 1e-18 * size)) return;
        tlsphi_rotate(A, Q, 0, 1);
        tlsphi_rotate(A, Q, 0, 2);
        tlsphi_rotate(A, Q, 1, 2);
    }
}
/* x = A^+ b for symmetric semi-definite A: directions whose eigenvalue is below 1e-12 of the largest are left out. */
static void tlsphi_solve_symmetric(const double A[9], const double b[3], double x[3]) {
    double D[9], Q[9];
    memcpy(D, A, sizeof D);
    tlsphi_eigen(D, Q);
    const double largest = tlsphi_dmax(fabs(D[0]), tlsphi_dmax(fabs(D[4]), fabs(D[8])));
    x[0] = x[1] = x[2] = 0;
    for (int k = 0; k < 3; k++) {
        if (fabs(D[4 * k]) <= 1e-12 * largest) continue;
        const double share = (Q[k] * b[0] + Q[3 + k] * b[1] + Q[6 + k] * b[2]) / D[4 * k];
        for (int i = 0; i < 3; i++) x[i] += share * Q[3 * i + k];
    }
}
/* Principal stretches of F, largest first. */
static void tlsphi_stretches(const tlsph_real *F, double out[3]) {
    double C[9], Q[9];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            C[3 * i + j] =
                (double)F[i] * (double)F[j] + (double)F[3 + i] * (double)F[3 + j] + (double)F[6 + i] * (double)F[6 + j];
    tlsphi_eigen(C, Q);
    for (int i = 0; i < 3; i++) out[i] = sqrt(tlsphi_dmax(C[4 * i], 0));
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < 2; i++)
            if (out[i] < out[i + 1]) {
                const double swap = out[i];
                out[i] = out[i + 1];
                out[i + 1] = swap;
            }
}
/* Upper bound of the largest eigenvalue of a 3x3 semi-definite tensor from its trace and the trace of its square;
   exact when the two smaller ones are equal, and much cheaper than the eigenvalue. */
TLSPHI_INLINE tlsph_real tlsphi_largest_bound(tlsph_real trace, tlsph_real trace_of_square) {
    const tlsph_real spread = trace_of_square - trace * trace * TLSPHI_R(1.0 / 3.0);
    return trace * TLSPHI_R(1.0 / 3.0) + tlsphi_square_root(TLSPHI_R(2.0 / 3.0) * tlsphi_max(spread, 0));
}
static double tlsphi_dot3(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static double tlsphi_norm2(const double a[3]) { return tlsphi_dot3(a, a); }

/* ==== [KERNELS] ====================================================================================================
   With s = r/h and support s < 2 (h: smoothing length).
   cubic B-spline:  W = w (1 - 3/2 s^2 + 3/4 s^3) for s < 1,  w/4 (2 - s)^3 beyond;  w = 1/(pi h^3), 2-D: 10/(7 pi h^2)
   quadratic:       W = w (3/16 s^2 - 3/4 s + 3/4);                                  w = 5/(4 pi h^3), 2-D: 2/(pi h^2)
   Wendland C2:     W = w (1 - s/2)^4 (1 + 2 s);                      w = 21/(16 pi h^3), 2-D: 7/(4 pi h^2)
   Wendland C4:     W = w (1 - s/2)^6 (1 + 3 s + 35/12 s^2);          w = 495/(256 pi h^3), 2-D: 9/(4 pi h^2)
   The quadratic one (001 section 3.2) has a gradient that never turns weaker towards r = 0. */

static void tlsphi_kernel(tlsph_kernel kernel, int dimension, double r, double h, double *W, double *dW) {
    const double pi = 3.14159265358979323846, s = r / h, t = 2 - s;
    const double volume = dimension == 3 ? h * h * h : h * h;
    *W = *dW = 0;
    if (s >= 2) return;
    if (kernel == TLSPH_QUADRATIC) {
        const double w = (dimension == 3 ? 1.25 : 2.0) / (pi * volume);
        *W = w * 0.1875 * t * t;
        *dW = -w * 0.375 * t / h;
    } else if (kernel == TLSPH_WENDLAND_C2) {
        const double w = (dimension == 3 ? 1.3125 : 1.75) / (pi * volume), u = t / 2;
        *W = w * u * u * u * u * (1 + 2 * s);
        *dW = -w * 5 * s * u * u * u / h;
    } else if (kernel == TLSPH_WENDLAND_C4) {
        const double w = (dimension == 3 ? 495.0 / 256 : 2.25) / (pi * volume), u = t / 2, u5 = u * u * u * u * u;
        *W = w * u5 * u * (1 + 3 * s + 35.0 / 12 * s * s);
        *dW = -w * 14.0 / 3 * s * u5 * (1 + 2.5 * s) / h;
    } else {
        const double w = (dimension == 3 ? 1.0 : 10.0 / 7.0) / (pi * volume);
        *W = s < 1 ? w * (1 - 1.5 * s * s + 0.75 * s * s * s) : w * 0.25 * t * t * t;
        *dW = (s < 1 ? w * (-3 * s + 2.25 * s * s) : -w * 0.75 * t * t) / h;
    }
}
TLSPHI_DEF void tlsph_kernel_evaluate(tlsph_kernel kernel, int dimension, tlsph_real r, tlsph_real h, tlsph_real *W,
                                      tlsph_real *dW) {
    double w, dw;
    tlsphi_kernel(kernel, dimension, (double)r, (double)h, &w, &dw);
    *W = (tlsph_real)w;
    *dW = (tlsph_real)dw;
}

/* ==== [NEIGHBOURS] =================================================================================================
   Cells as wide as the largest search radius. Particles are sorted by the Morton (bit-interleaved) number of their cell,
   which serves twice: equal numbers are the cells' contents, and the order keeps neighbours close in memory. Cells are
   found again through a hash table of occupied cells, so that sparse scenes cost no more. All O(n); the sort is a radix
   sort. This is creation only: a total Lagrangian body keeps its neighbours. */

typedef struct tlsphi_grid {
    size_t count, buckets;
    int dimension;
    double low[3], width; /* corner and edge of the cells, m */
    uint64_t *key;        /* Morton number of each particle, in sorted order */
    uint32_t *order;      /* host number, in sorted order */
    uint32_t *table;      /* hash table: sorted position of a cell's first particle, or TLSPHI_NONE */
} tlsphi_grid;

#define TLSPHI_GRID_BITS 21 /* per axis: three fit into 63 bits */

/* Spreads 21 bits so that two zeros follow each. */
static uint64_t tlsphi_spread(uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffffu;
    x = (x | x << 16) & 0x1f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}
static uint64_t tlsphi_morton(const uint64_t cell[3]) {
    return tlsphi_spread(cell[0]) | tlsphi_spread(cell[1]) << 1 | tlsphi_spread(cell[2]) << 2;
}
static void tlsphi_cell_of(const tlsphi_grid *grid, const tlsph_real *X, uint64_t cell[3]) {
    cell[2] = 0;
    for (int i = 0; i < grid->dimension; i++) cell[i] = (uint64_t)(((double)X[i] - grid->low[i]) / grid->width);
}
static size_t tlsphi_bucket(const tlsphi_grid *grid, uint64_t key) {
    return (size_t)((key * 0x9e3779b97f4a7c15u) >> 20) & (grid->buckets - 1);
}
/* Sorts (key, order) by key, 8 bits a pass, stable; passes in which all keys agree are skipped. */
static void tlsphi_radix_sort(uint64_t *key, uint32_t *order, uint64_t *key2, uint32_t *order2, size_t n) {
    for (int shift = 0; shift < 64; shift += 8) {
        size_t start[257] = {0};
        for (size_t i = 0; i < n; i++) start[(key[i] >> shift & 255) + 1]++;
        if (start[(key[0] >> shift & 255) + 1] == n) continue;
        for (int d = 0; d < 256; d++) start[d + 1] += start[d];
        for (size_t i = 0; i < n; i++) {
            const size_t to = start[key[i] >> shift & 255]++;
            key2[to] = key[i];
            order2[to] = order[i];
        }
        memcpy(key, key2, n * sizeof *key);
        memcpy(order, order2, n * sizeof *order);
    }
}
/* First sorted position of the particles in a cell, or TLSPHI_NONE. */
static uint32_t tlsphi_find_cell(const tlsphi_grid *grid, uint64_t key) {
    for (size_t b = tlsphi_bucket(grid, key);; b = (b + 1) & (grid->buckets - 1)) {
        const uint32_t at = grid->table[b];
        if (at == TLSPHI_NONE || grid->key[at] == key) return at;
    }
}
static void tlsphi_grid_hash(tlsphi_grid *grid) {
    for (size_t b = 0; b < grid->buckets; b++) grid->table[b] = TLSPHI_NONE;
    for (size_t i = 0; i < grid->count; i++) {
        if (i && grid->key[i] == grid->key[i - 1]) continue;
        size_t b = tlsphi_bucket(grid, grid->key[i]);
        while (grid->table[b] != TLSPHI_NONE) b = (b + 1) & (grid->buckets - 1);
        grid->table[b] = (uint32_t)i;
    }
}

/* ==== [OPERATORS] ==================================================================================================
   A plan is what creation works out before it knows how much memory the solver needs: the particles' order, the number
   of pairs, and whether C is antisymmetric by itself. Each builder answers one question: which neighbours has host
   particle a, and what is g_ab for each? */

#define TLSPHI_CORRECTION_MOST 10 /* largest entry of M_a behind surfaces */
#define TLSPHI_BLOCK 128 /* particles a task: small enough for load balance, large enough to hide the call */

/* Lanes. The hot loops take this many neighbouring particles at once: the physics of one pair or particle is written for
   one, as an inline function, and stands in a loop over the lanes, which a compiler turns into vector instructions.
   What neighbours read lies in rows, one a component of a block of particles, so that the lanes of a component lie side by
   side. On a lattice the particles of a tile mostly have their k-th neighbours side by side, too (see [TILES]); others are
   gathered into spare columns at the end of the rows of their own block. */
#ifdef TLSPH_REAL_FLOAT
#define TLSPHI_LANES 16
#else
#define TLSPHI_LANES 8
#endif
#define TLSPHI_ROW (TLSPHI_BLOCK + TLSPHI_LANES)

/* Pairs by tiles of TLSPHI_LANES particles: a slot is one neighbour for each lane. */
typedef struct tlsphi_slot {
    unsigned pattern : 28; /* which of the tile patterns: C_ab (D lanes each) and |C_ab|, 0 where a lane has no pair */
    unsigned scattered : 1;
    unsigned axes : 3; /* bit i: some of its vectors C_ab or X_b - X_a have a component i */
    uint32_t from; /* first of the neighbours side by side, or where the lanes' neighbours begin in `gathered` */
} tlsphi_slot;
/* Magnitudes of pair vectors, each of which stands for all that differ from it by the round-off of positions. */
#define TLSPHI_MAGNITUDES_SEEN 4096
typedef struct tlsphi_magnitudes {
    double value[TLSPHI_MAGNITUDES_SEEN / 4], cell[TLSPHI_MAGNITUDES_SEEN / 4]; /* as they came; floor(value/slack) */
    uint16_t seen[TLSPHI_MAGNITUDES_SEEN]; /* hash table by cells, number + 1 */
    unsigned count;
    double slack;
} tlsphi_magnitudes;
/* Different sets of numbers, each of which is stored once. */
typedef struct tlsphi_patterns {
    size_t count, room;
    tlsph_real *pattern;
    uint32_t *seen; /* hash table, number + 1 */
} tlsphi_patterns;
typedef struct tlsphi_graph {
    size_t tiles, slots, patterns, gathers;
    size_t *first; /* slot of each tile; tiles in the order of the blocks */
    tlsphi_slot *slot;
    uint32_t *gathered;
    int width;           /* rows of a pattern: g_ab, |C_ab|, and what else a scene needs: */
    int along;           /* 1: C_ab . d_ab, which compact conduction takes where C is not g */
    int raw;             /* first row of C_ab itself, which gradients take with bonds; 0: they take g */
    int laplacian;       /* row of l_ab, with TLSPH_JST; or 0 */
    tlsph_real *pattern; /* width x lanes each */
} tlsphi_graph;

typedef struct tlsphi_scratch {
    void *memory;
    size_t size;
} tlsphi_scratch;

typedef struct tlsphi_plan {
    const tlsph_desc *desc;
    tlsph_allocator allocator;
    tlsph_error *error;
    int dim;
    size_t n, pairs, least, most; /* particles, directed pairs, fewest and most neighbours */
    double h;                     /* smoothing length */
    tlsphi_magnitudes *magnitudes;
    tlsphi_grid grid;
    const tlsph_real *weights; /* w_a */
    size_t *cell_first;        /* TLSPH_CELLS: cells around each particle, */
    uint32_t *cell_of;
    double *volume;         /* and V_a made of them */
    struct tlsphi_lines *lattice; /* TLSPH_CELLS_4 */
    size_t damped_pairs, images;
    double *correction;     /* kernels: M_a, dim x dim each, host order */
    tlsphi_patterns M;      /* the same by tiles */
    uint32_t *M_of;
    size_t *closed_first;   /* TLSPH_CLOSED: neighbour lists and C_ab, host order; NULL until they are solved */
    uint32_t *closed_list;
    double *closed_C;
    tlsph_closure closure;
    struct tlsphi_bond *bond; /* operators that need a second pair vector: coefficients, host order; else NULL */
    int antisymmetric;      /* C_ab = -C_ba to round-off: the solver stores C itself */
    uint32_t *host, *inner; /* solver order -> host number, and back */
    uint32_t *body;         /* of each particle in solver order */
    uint8_t *level, *seen;  /* [MULTI-RATE], host order, NULL: off; bit l: a neighbour has another level l */
    double *lightest;       /* and root of the least density of the neighbours over the particle's own, at most 1 */
    uint32_t *found, *B_of; /* solver order: numbers of neighbours; the particles with B_a, */
    tlsph_real *tau, *B;    /* tau_a; B_a */
    size_t areas, B_room, B_of_room;
    int levels;
    size_t bodies, blocks;
    tlsphi_graph graph[2];   /* of all pairs; of those of the dissipation, where they are others. See [TILES] */
    uint8_t *fixed;          /* number of constrained directions of each particle (solver order), */
    double *fixed_direction; /* and these directions, orthonormal, dim x dim each */
    size_t fixes, mirrors, held_parts; /* how many in all (see [CONDITIONS], [SURFACES]) */
    tlsphi_scratch scratch[96]; /* the richest operators take 66 */
    int scratches;
} tlsphi_plan;

static void *tlsphi_scratch_take(tlsphi_plan *plan, size_t count, size_t size) {
    if (count > SIZE_MAX / 4 / size) return NULL;
    const size_t bytes = count * size + (count == 0);
    void *memory = plan->allocator.allocate(plan->allocator.user, bytes);
    if (!memory) return NULL;
    TLSPH_ASSERT((size_t)plan->scratches < sizeof plan->scratch / sizeof *plan->scratch);
    memset(memory, 0, bytes);
    plan->scratch[plan->scratches].memory = memory;
    plan->scratch[plan->scratches++].size = bytes;
    return memory;
}
#define TLSPHI_SCRATCH(plan, type, count) ((type *)tlsphi_scratch_take((plan), (count), sizeof(type)))
/* A longer copy of an array (NULL: a new one), which is given back itself. */
static void *tlsphi_scratch_grow(tlsphi_plan *plan, void *old, size_t from, size_t to, size_t size) {
    int i = 0;
    void *memory = tlsphi_scratch_take(plan, to, size);
    if (!memory || !old) return memory;
    memcpy(memory, old, from * size);
    while (plan->scratch[i].memory != old) i++;
    plan->allocator.release(plan->allocator.user, old, plan->scratch[i].size);
    plan->scratch[i] = plan->scratch[--plan->scratches];
    return memory;
}

/* Makes an array hold `need` elements at least. 0 if there is no memory. */
static int tlsphi_scratch_room(tlsphi_plan *plan, void **array, size_t *capacity, size_t need, size_t size) {
    if (need <= *capacity) return 1;
    void *memory = tlsphi_scratch_grow(plan, *array, *capacity, 2 * need + 64, size);
    if (!memory) return 0;
    *array = memory;
    *capacity = 2 * need + 64;
    return 1;
}

static void tlsphi_plan_release(tlsphi_plan *plan) {
    while (plan->scratches > 0) {
        const tlsphi_scratch *s = &plan->scratch[--plan->scratches];
        plan->allocator.release(plan->allocator.user, s->memory, s->size);
    }
}
TLSPHI_APART tlsph_result tlsphi_plan_fail(tlsphi_plan *plan, tlsph_result result, const char *field, size_t particle,
                                     double value, double limit, const char *allowed) {
    return tlsphi_fail(plan->error, result, "create", field, particle, value, limit, allowed);
}
static tlsph_result tlsphi_no_memory(tlsphi_plan *plan, double bytes) {
    return tlsphi_plan_fail(plan, TLSPH_ERROR_MEMORY, "bytes", TLSPH_NO_PARTICLE, bytes, 0,
                            "what the allocator can give");
}

static const tlsph_real *tlsphi_position(const tlsphi_plan *plan, size_t a) {
    return plan->desc->particles.positions + 3 * a;
}

static void tlsphi_difference(const tlsphi_plan *plan, size_t a, size_t b, double d[3]) {
    const tlsph_real *A = tlsphi_position(plan, a), *B = tlsphi_position(plan, b);
    d[2] = 0;
    for (int i = 0; i < plan->dim; i++) d[i] = (double)B[i] - (double)A[i];
}

/* -- builder 1: kernels. g_ab = 2 w_a w_b grad W_b(X_a); M_a = V_a/w_a L_a (000-51, 52 with two volumes) -- */

/* Smoothing length of a pair: symmetric, so that grad W is antisymmetric. */
static double tlsphi_pair_h(const tlsphi_plan *plan, size_t a, size_t b) {
    const tlsph_real *s = plan->desc->particles.spacings;
    return s ? ((double)s[a] + (double)s[b]) / 2 * (double)plan->desc->support : plan->h;
}
/* Neighbours of host particle a within 2h; with list == NULL only counts. */
static size_t tlsphi_kernel_neighbours(const tlsphi_plan *plan, size_t a, uint32_t *list, double *g) {
    const tlsphi_grid *grid = &plan->grid;
    uint64_t cell[3], other[3] = {0, 0, 0};
    size_t found = 0;
    tlsphi_cell_of(grid, tlsphi_position(plan, a), cell);
    const int cells = plan->dim == 3 ? 27 : 9;
    for (int c = 0; c < cells; c++) {
        other[0] = cell[0] + (uint64_t)(c % 3) - 1;
        other[1] = cell[1] + (uint64_t)(c / 3 % 3) - 1;
        if (plan->dim == 3) other[2] = cell[2] + (uint64_t)(c / 9) - 1;
        const uint64_t key = tlsphi_morton(other);
        for (size_t i = tlsphi_find_cell(grid, key); i < grid->count && grid->key[i] == key; i++) {
            const uint32_t b = grid->order[i];
            double d[3], W, dW;
            tlsphi_difference(plan, a, b, d);
            const double r = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), h = tlsphi_pair_h(plan, a, b);
            if (b == a || r >= 2 * h) continue;
            if (list) {
                tlsphi_kernel(plan->desc->kernel, plan->dim, r, h, &W, &dW);
                const double factor = r > 0 ? -2 * (double)plan->weights[a] * (double)plan->weights[b] * dW / r : 0;
                list[found] = b;
                for (int k = 0; k < plan->dim; k++) g[(size_t)plan->dim * found + (size_t)k] = factor * d[k];
            }
            found++;
        }
    }
    return found;
}

/* -- builder 2: cells. C_ab is the area of the dual face across the edge ab: a quarter (2-D: half) of the cross-section
   of every cell around the edge. Exact for linear fields and closed on any voxel body, re-entrant edges included. -- */

/* Edge lengths of cell c. */
static void tlsphi_cell_size(const tlsphi_plan *plan, size_t c, double size[3]) {
    const uint32_t *corner = plan->desc->particles.cells + (c << plan->dim);
    double d[3];
    size[2] = 1;
    for (int axis = 0; axis < plan->dim; axis++) {
        tlsphi_difference(plan, corner[0], corner[1 << axis], d);
        size[axis] = d[axis];
    }
}
static size_t tlsphi_cell_neighbours(const tlsphi_plan *plan, size_t a, uint32_t *list, double *g) {
    const int dim = plan->dim;
    uint32_t seen[24];
    double area[24][3];
    size_t found = 0;
    for (size_t i = plan->cell_first[a]; i < plan->cell_first[a + 1]; i++) {
        const uint32_t *corner = plan->desc->particles.cells + ((size_t)plan->cell_of[i] << dim);
        double size[3];
        int me = 0;
        tlsphi_cell_size(plan, plan->cell_of[i], size);
        while (corner[me] != a) me++;
        for (int axis = 0; axis < dim; axis++) {
            const uint32_t b = corner[me ^ (1 << axis)];
            const double section = size[0] * size[1] * size[2] / size[axis] / (dim == 3 ? 4 : 2);
            size_t at = 0;
            while (at < found && seen[at] != b) at++;
            if (at == found) {
                seen[found] = b;
                area[found][0] = area[found][1] = area[found][2] = 0;
                found++;
            }
            area[at][axis] += (me >> axis & 1) ? -section : section;
        }
    }
    for (size_t i = 0; list && i < found; i++) {
        list[i] = seen[i];
        for (int k = 0; k < dim; k++) g[(size_t)dim * i + (size_t)k] = area[i][k];
    }
    return found;
}

/* -- builder 3: the host's own pair vectors -- */
static size_t tlsphi_given_neighbours(const tlsphi_plan *plan, size_t a, uint32_t *list, double *g) {
    const tlsph_particles *p = &plan->desc->particles;
    const size_t found = p->first[a + 1] - p->first[a];
    for (size_t i = 0; list && i < found; i++) {
        list[i] = p->neighbours[p->first[a] + i];
        for (int k = 0; k < plan->dim; k++)
            g[(size_t)plan->dim * i + (size_t)k] = (double)p->pair_vectors[3 * (p->first[a] + i) + (size_t)k];
    }
    return found;
}

/* -- builder 4: closed clouds. Kernel neighbours until [CLOSURE] has solved for C_ab. -- */
static size_t tlsphi_closed_neighbours(const tlsphi_plan *plan, size_t a, uint32_t *list, double *g) {
    if (!plan->closed_C) return tlsphi_kernel_neighbours(plan, a, list, g);
    const size_t D = (size_t)plan->dim, start = plan->closed_first[a], found = plan->closed_first[a + 1] - start;
    if (list) {
        memcpy(list, plan->closed_list + start, found * sizeof *list);
        memcpy(g, plan->closed_C + D * start, D * found * sizeof *g);
    }
    return found;
}

/* -- builder: cells of order 4 --------------------------------------------------------------------------------------
   Along a lattice line 1/V sum_b (f_b - f_a)/2 C_ab is a difference quotient sum_j Q_ij (f_j - f_i)/H_i with C = 2 Q times
   the area across: Q = 2/3, -1/12 inside (fourth order). At a free end the first four rows are those of a summation-by-
   parts operator (Strand 1994): there second order, everywhere antisymmetric, closed by the end's area, exact for linear
   fields. At a roller or tangentially fixed face the line goes on as its mirror image, and the order stays.

   Voxel bodies. Every plane at which the cross-section or the cells' size changes cuts the whole lattice; between cuts
   the body is a set of full boxes. A box has the tensor product of its lines' operators (C along x: 2 Q_x H_y H_z
   areas), and V, C and B of boxes that meet add up: faces that meet are whole and have equal weights H_y H_z, because
   both boxes share the intervals of the other axes. So all properties carry over, re-entrant edges included; at a cut
   the order is that of a free end.
   Intervals that are too short for this (less than 7 cells; with a mirror 4, between two 3) have H = 1/2, 1, 1, ... and
   Q = 1/2, for all boxes in them: a body of short intervals, say a ball of voxels, gets TLSPH_CELLS.

   The dissipation acts between first neighbours, with the area of the cross-section (a pair list of its own).

   Mirrors. Beyond a plane through line point 0 the point -j carries the image of j. Pairs of the plane's own particles need
   no images: what is odd across the plane has C_0j = C_0,-j together, half of it on this side, what is even cancels, and
   the mirror rule of [EVALUATION] takes that away already. Only point 1 reaches over the plane to -1, its own image: a
   difference of -2 times the odd part of v, so a term of particle 1 alone (tlsphi_image). */

/* Cells [begin, end) of an axis with one operator. mirror: 0, or the condition's kind, at either end. */
typedef struct tlsphi_interval {
    double size; /* of a cell */
    uint32_t begin, end;
    int mirror[2], fourth;
} tlsphi_interval;
typedef struct tlsphi_lines {
    double *plane[3]; /* coordinates of the lattice's planes, rising */
    uint32_t layers[3];
    tlsphi_interval *of_layer[3]; /* the interval of each layer of cells */
    uint32_t *place, *step;       /* lattice place, 3 a particle; neighbours along -x, +x, -y, ... or TLSPHI_NONE */
} tlsphi_lines;
/* All about one particle. image: area of its own image beyond the mirrors -x, +x, -y, ... */
typedef struct tlsphi_stencil {
    size_t count;
    uint32_t b[24];
    double C[24][3], across[24][3], B[3], V, image[6], image_moment[3], fineness[3]; /* 1/size */
    int image_kind[6];
} tlsphi_stencil;

static double tlsphi_line_weight(const tlsphi_interval *line, uint32_t i) {
    static const double H[4] = {17. / 48, 59. / 48, 43. / 48, 49. / 48};
    const uint32_t from_end[2] = {i, line->end - line->begin - i};
    for (int side = 0; side < 2; side++)
        if (line->fourth && !line->mirror[side] && from_end[side] < 4) return H[from_end[side]];
    return from_end[0] && from_end[1] ? 1 : 0.5;
}
/* 2 Q_ij for j = i + offset. */
static double tlsphi_line_pair(const tlsphi_interval *line, uint32_t i, int offset) {
    static const double Q[4][4] = {{0, 59. / 48, -1. / 6, -1. / 16}, {0, 59. / 48, 0, 0}, {0, 59. / 48, -1. / 6, 0},
                                   {0, 4. / 3, -1. / 6, 0}};
    static const double inner[4] = {0, 4. / 3, -1. / 6, 0};
    const int n = (int)(line->end - line->begin), j = (int)i + offset, reach = offset < 0 ? -offset : offset;
    const int sign = offset < 0 ? -1 : 1, left = offset < 0 ? j : (int)i, right = n - left - reach;
    if (left < 0 || right < 0) return 0;
    if (!line->fourth) return reach == 1 ? sign : 0;
    if (left < 4 && !line->mirror[0]) return sign * Q[left][reach];
    if (right < 4 && !line->mirror[1]) return sign * Q[right][reach];
    return sign * inner[reach];
}

/* Adds a particle's share in one box; line: the box's intervals, i: the place in them. */
static void tlsphi_box_stencil(const tlsphi_plan *plan, size_t a, tlsphi_interval *const line[3], const uint32_t i[3],
                               tlsphi_stencil *out) {
    const tlsphi_lines *lattice = plan->lattice;
    double length[3] = {1, 1, 1};
    for (int x = 0; x < plan->dim; x++) length[x] = tlsphi_line_weight(line[x], i[x]) * line[x]->size;
    out->V += length[0] * length[1] * length[2];
    for (int x = 0; x < plan->dim; x++) {
        const double area = length[0] * length[1] * length[2] / length[x];
        out->fineness[x] = tlsphi_dmax(out->fineness[x], 1 / line[x]->size);
        const uint32_t n = line[x]->end - line[x]->begin;
        for (int side = 0; side < 2; side++) {
            const uint32_t from_end = side ? n - i[x] : i[x];
            uint32_t b = (uint32_t)a;
            if (from_end == 0) out->B[x] += side ? area : -area;
            if (from_end == 1 && line[x]->fourth && line[x]->mirror[side]) {
                out->image[2 * x + side] += area / 6;
                out->image_moment[x] -= area / 6 * line[x]->size;
                out->image_kind[2 * x + side] = line[x]->mirror[side];
            }
            for (int reach = 1; reach <= (line[x]->fourth ? 3 : 1); reach++) {
                const double C = area * tlsphi_line_pair(line[x], i[x], side ? reach : -reach);
                if (b != TLSPHI_NONE) b = lattice->step[6 * (size_t)b + (size_t)(2 * x + side)];
                if (!(C < 0) && !(C > 0)) continue;
                size_t at = 0;
                while (at < out->count && out->b[at] != b) at++;
                if (at == out->count) out->b[out->count++] = b;
                out->C[at][x] += C;
                if (reach == 1) out->across[at][x] += side ? area : -area;
            }
        }
    }
}
/* A particle's boxes are those of the cells around it; a box counts once, by its cell on the upper sides. */
static void tlsphi_stencil_of(const tlsphi_plan *plan, size_t a, tlsphi_stencil *out) {
    const tlsphi_lines *lattice = plan->lattice;
    memset(out, 0, sizeof *out);
    for (size_t k = plan->cell_first[a]; k < plan->cell_first[a + 1]; k++) {
        const uint32_t *corner = plan->desc->particles.cells + ((size_t)plan->cell_of[k] << plan->dim);
        tlsphi_interval *line[3] = {NULL, NULL, NULL};
        uint32_t i[3] = {0, 0, 0};
        int me = 0, counts = 1;
        while (corner[me] != a) me++;
        for (int x = 0; x < plan->dim; x++) {
            const uint32_t place = lattice->place[3 * a + (size_t)x], below = (uint32_t)(me >> x & 1);
            line[x] = lattice->of_layer[x] + (place - below);
            i[x] = place - line[x]->begin;
            if (below && place < line[x]->end) counts = 0;
        }
        if (counts) tlsphi_box_stencil(plan, a, line, i, out);
    }
}
static size_t tlsphi_fourth_neighbours(const tlsphi_plan *plan, size_t a, uint32_t *list, double *g) {
    tlsphi_stencil stencil;
    tlsphi_stencil_of(plan, a, &stencil);
    for (size_t i = 0; list && i < stencil.count; i++) {
        list[i] = stencil.b[i];
        for (int k = 0; k < plan->dim; k++) g[(size_t)plan->dim * i + (size_t)k] = stencil.C[i][k];
    }
    return stencil.count;
}
/* What the images add to sum C (x) d / 2. */
static void tlsphi_image_moment(const tlsphi_plan *plan, size_t a, double A[9]) {
    tlsphi_stencil stencil;
    tlsphi_stencil_of(plan, a, &stencil);
    for (int x = 0; x < plan->dim; x++) A[4 * x] += stencil.image_moment[x];
}

/* The planes of an axis, and each particle's place among them. Few planes stand for many particles, so insertion will do. */
static tlsph_result tlsphi_find_planes(tlsphi_plan *plan, int x) {
    tlsphi_lines *l = plan->lattice;
    const size_t most = plan->n < 65536 ? plan->n : 65536;
    double size[3], *plane = l->plane[x] = TLSPHI_SCRATCH(plan, double, most);
    size_t count = 0;
    if (!plane) return tlsphi_no_memory(plan, 8.0 * (double)most);
    tlsphi_cell_size(plan, 0, size);
    const double close = (TLSPHI_EPSILON > 1e-10 ? 1e-2 : 1e-6) * size[x];
    for (int pass = 0; pass < 2; pass++) /* collects the planes, then looks them up */
        for (size_t a = 0; a < plan->n; a++) {
            const double X = (double)tlsphi_position(plan, a)[x];
            size_t low = 0, high = count;
            while (low < high) {
                const size_t middle = (low + high) / 2;
                if (plane[middle] < X - close) low = middle + 1;
                else high = middle;
            }
            l->place[3 * a + (size_t)x] = (uint32_t)low;
            if (pass || (low < count && plane[low] <= X + close)) continue;
            if (count == most)
                return tlsphi_plan_fail(plan, TLSPH_ERROR_ARGUMENT, "planes of the lattice", a, (double)count,
                                        (double)most, "the planes of a lattice of cells");
            memmove(plane + low + 1, plane + low, (count++ - low) * sizeof *plane);
            plane[low] = X;
        }
    l->layers[x] = (uint32_t)count - 1;
    return TLSPH_OK;
}
/* Steps to the lattice neighbours; every cell must lie between neighbouring planes. */
static tlsph_result tlsphi_lattice_places(tlsphi_plan *plan, tlsphi_lines *l) {
    const uint32_t *cells = plan->desc->particles.cells;
    tlsph_result r;
    for (int x = 0; x < plan->dim; x++)
        if ((r = tlsphi_find_planes(plan, x))) return r;
    for (size_t i = 0; i < 6 * plan->n; i++) l->step[i] = TLSPHI_NONE;
    for (size_t c = 0; c < plan->desc->particles.cell_count; c++)
        for (int k = 0; k < 1 << plan->dim; k++)
            for (int x = 0; x < plan->dim; x++) {
                const uint32_t *corner = cells + (c << plan->dim);
                const uint32_t a = corner[k], place = l->place[3 * (size_t)corner[0] + (size_t)x] + (uint32_t)(k >> x & 1);
                if (l->place[3 * (size_t)a + (size_t)x] != place)
                    return tlsphi_plan_fail(plan, TLSPH_ERROR_ARGUMENT, "plane of a cell's corner", a,
                                            (double)l->place[3 * (size_t)a + (size_t)x], (double)place,
                                            "that of its cell: order 4 needs cells between the planes of one lattice");
                l->step[6 * (size_t)corner[k] + (size_t)(2 * x + !(k >> x & 1))] = corner[k ^ (1 << x)];
            }
    return TLSPH_OK;
}
/* The mirror through all particles of the plane at `place`: kind of the condition, or 0. */
static int tlsphi_plane_mirror(const tlsphi_plan *plan, const uint8_t *mirrors, int x, uint32_t place) {
    int common = 3; /* bits: roller, tangent */
    for (size_t a = 0; a < plan->n; a++)
        if (plan->lattice->place[3 * a + (size_t)x] == place) common &= mirrors[a] >> (2 * x);
    return common & 1 ? TLSPH_ROLLER : common & 2 ? TLSPH_TANGENT : 0;
}
/* Which particles lie in mirrors across the axes. Scalars are even at rollers (not at those that conduct heat), but neither
   even nor odd at tangentially fixed faces: these are mirrors only where no scalar needs a gradient. */
static void tlsphi_mark_mirrors(const tlsphi_plan *plan, uint8_t *mirrors) {
    const tlsph_desc *d = plan->desc;
    const int scalars = d->thermal || d->unknowns == TLSPH_PFJ || d->unknowns == TLSPH_PFHJ;
    for (size_t k = 0; d->mirror_gradients && k < d->condition_count; k++) {
        const tlsph_condition *c = d->conditions + k;
        const int roller = c->kind == TLSPH_ROLLER && !(d->thermal && c->conducts);
        double N2 = 0;
        for (int x = 0; x < plan->dim; x++) N2 += (double)c->normal[x] * (double)c->normal[x];
        if (!roller && (c->kind != TLSPH_TANGENT || scalars)) continue;
        for (int x = 0; x < plan->dim; x++)
            for (size_t i = 0; pow((double)c->normal[x], 2) > (1 - 1e-9) * N2 && i < (c->particles ? c->count : plan->n); i++)
                mirrors[c->particles ? c->particles[i] : i] |= (uint8_t)((roller ? 1 : 2) << (2 * x));
    }
}
/* Cuts an axis where the pattern of cells changes, and chooses the order of each interval. */
static tlsph_result tlsphi_cut_axis(tlsphi_plan *plan, int x, const uint8_t *mirrors) {
    tlsphi_lines *l = plan->lattice;
    const uint32_t layers = l->layers[x];
    uint64_t *pattern = TLSPHI_SCRATCH(plan, uint64_t, layers);
    l->of_layer[x] = TLSPHI_SCRATCH(plan, tlsphi_interval, layers);
    if (!pattern || !l->of_layer[x]) return tlsphi_no_memory(plan, 40.0 * layers);
    for (size_t c = 0; c < plan->desc->particles.cell_count; c++) { /* a sum of scrambled places: order does not matter */
        const uint32_t *at = l->place + 3 * (size_t)plan->desc->particles.cells[c << plan->dim];
        uint64_t h = at[(x + 1) % 3] * (uint64_t)0x9e3779b97f4a7c15u + at[(x + 2) % 3] + 1;
        h = (h ^ h >> 29) * 0xbf58476d1ce4e5b9u;
        pattern[at[x]] += (h ^ h >> 32) | 1;
    }
    for (uint32_t begin = 0, end; begin < layers; begin = end) {
        tlsphi_interval line = {0, begin, 0, {0, 0}, 0};
        const double *plane = l->plane[x], first = plane[begin + 1] - plane[begin];
        for (end = begin + 1; end < layers && pattern[end] == pattern[begin]; end++)
            if (fabs(plane[end + 1] - plane[end] - first) > (TLSPHI_EPSILON > 1e-10 ? 1e-2 : 1e-6) * first) break;
        line.end = end;
        line.size = (plane[end] - plane[begin]) / (end - begin);
        if (begin == 0 || pattern[begin - 1] == 0) line.mirror[0] = tlsphi_plane_mirror(plan, mirrors, x, begin);
        if (end == layers || pattern[end] == 0) line.mirror[1] = tlsphi_plane_mirror(plan, mirrors, x, end);
        const int images = (line.mirror[0] != 0) + (line.mirror[1] != 0);
        line.fourth = end - begin >= (images == 2 ? 3u : images == 1 ? 4u : 7u);
        for (uint32_t i = begin; i < end; i++) l->of_layer[x][i] = line;
    }
    return TLSPH_OK;
}
static tlsph_result tlsphi_fourth_build(tlsphi_plan *plan) {
    tlsphi_lines *l = plan->lattice = TLSPHI_SCRATCH(plan, tlsphi_lines, 1);
    uint8_t *mirrors = TLSPHI_SCRATCH(plan, uint8_t, plan->n);
    tlsph_result r;
    if (l) l->place = TLSPHI_SCRATCH(plan, uint32_t, 3 * plan->n);
    if (l) l->step = TLSPHI_SCRATCH(plan, uint32_t, 6 * plan->n);
    if (!l || !mirrors || !l->place || !l->step) return tlsphi_no_memory(plan, 37.0 * (double)plan->n);
    if ((r = tlsphi_lattice_places(plan, l))) return r;
    tlsphi_mark_mirrors(plan, mirrors);
    for (int x = 0; x < plan->dim; x++)
        if ((r = tlsphi_cut_axis(plan, x, mirrors))) return r;
    for (size_t a = 0; a < plan->n; a++) {
        tlsphi_stencil stencil;
        tlsphi_stencil_of(plan, a, &stencil);
        plan->volume[a] = stencil.V;
        for (size_t i = 0; i < stencil.count; i++)
            plan->damped_pairs += fabs(stencil.across[i][0]) + fabs(stencil.across[i][1]) + fabs(stencil.across[i][2]) > 0;
        for (int i = 0; i < 6; i++) plan->images += stencil.image[i] > 0;
    }
    return TLSPH_OK;
}

/* What round-off of the positions may change in a pair vector of length 1, in M_a, or in lengths over h. */
static double tlsphi_position_slack(const tlsphi_plan *plan) {
    double reach = 1;
    for (size_t i = 0; i < 3 * plan->n; i++)
        if (i % 3 < (size_t)plan->dim) reach = tlsphi_dmax(reach, fabs((double)tlsphi_position(plan, 0)[i]) / plan->h);
    return tlsphi_dmin(4 * reach, 256) * TLSPHI_EPSILON;
}
/* The first of the magnitudes that is within the slack of x; x itself, if there is none, is one from then on, while there
   is room. So an x stands for the same whenever it is asked for. */
static double tlsphi_common_magnitude(tlsphi_magnitudes *m, double x) {
    const double cell = floor(x / m->slack); /* holds one at most: all in it are within the slack of each other */
    size_t at = 0;
    unsigned number = 0;
    for (int i = 0; i < 3; i++) {
        const double key = cell + (i < 2 ? 2 * i - 1 : 0); /* its own cell last: `at` is where x may be put */
        unsigned found;
        uint64_t bits;
        memcpy(&bits, &key, sizeof bits);
        at = (size_t)(bits * 0x9e3779b97f4a7c15u >> 52);
        for (; (found = m->seen[at]) > 0; at = (at + 1) % TLSPHI_MAGNITUDES_SEEN)
            if (m->cell[found - 1] == key) break;
        const int fits = found && (i == 2 || fabs(m->value[found - 1] - x) <= m->slack);
        if (fits && (!number || found < number)) number = found;
    }
    if (number) return m->value[number - 1];
    if (m->count == TLSPHI_MAGNITUDES_SEEN / 4) return x;
    m->cell[m->count] = cell;
    m->value[m->count++] = x;
    m->seen[at] = (uint16_t)m->count;
    return x;
}
/* Kernels' vectors that differ by the round-off of positions become the same, so that few patterns serve for a lattice (see
   [TILES]). Rounding is odd: C_ab = -C_ba stays exact, and M_a is made from what is rounded. */
static void tlsphi_round_vectors(const tlsphi_plan *plan, double *g, size_t reals) {
    const double quantum = (plan->dim == 3 ? plan->h * plan->h : plan->h) * (TLSPHI_EPSILON > 1e-10 ? 1e-6 : 1e-14);
    for (size_t i = 0; i < reals; i++) {
        const double rounded = floor(fabs(g[i]) / quantum + 0.5) * quantum;
        if (rounded > 0) g[i] = (g[i] < 0 ? -1 : 1) * tlsphi_common_magnitude(plan->magnitudes, rounded);
        else g[i] = rounded;
    }
}
static tlsph_result tlsphi_start_rounding(tlsphi_plan *plan) {
    plan->magnitudes = TLSPHI_SCRATCH(plan, tlsphi_magnitudes, 1);
    if (!plan->magnitudes) return tlsphi_no_memory(plan, (double)sizeof(tlsphi_magnitudes));
    plan->magnitudes->slack = tlsphi_position_slack(plan) * (plan->dim == 3 ? plan->h * plan->h : plan->h);
    tlsphi_common_magnitude(plan->magnitudes, 0); /* the first: what is nearly 0 is 0 */
    return TLSPH_OK;
}
static size_t tlsphi_neighbours_of(const tlsphi_plan *plan, size_t a, uint32_t *list, double *g) {
    switch (plan->desc->operator_kind) {
    case TLSPH_CLOSED: return tlsphi_closed_neighbours(plan, a, list, g);
    case TLSPH_CELLS: return tlsphi_cell_neighbours(plan, a, list, g);
    case TLSPH_CELLS_4: return tlsphi_fourth_neighbours(plan, a, list, g);
    case TLSPH_GIVEN: return tlsphi_given_neighbours(plan, a, list, g);
    default: break;
    }
    const size_t count = tlsphi_kernel_neighbours(plan, a, list, g);
    if (g && !plan->bond) tlsphi_round_vectors(plan, g, count * (size_t)plan->dim);
    return count;
}
static double tlsphi_plan_volume(const tlsphi_plan *plan, size_t a) {
    return plan->volume ? plan->volume[a] : (double)plan->desc->particles.volumes[a];
}

/* -- preparations of each builder -- */

static tlsph_result tlsphi_grid_build(tlsphi_plan *plan) {
    const size_t n = plan->n;
    tlsphi_grid *grid = &plan->grid;
    double high[3] = {0, 0, 0};
    grid->count = n;
    grid->dimension = plan->dim;
    grid->width = 2 * plan->h * (1 + 1e-9);
    for (int i = 0; i < plan->dim; i++) {
        grid->low[i] = high[i] = (double)tlsphi_position(plan, 0)[i];
        for (size_t a = 1; a < n; a++) {
            grid->low[i] = tlsphi_dmin(grid->low[i], (double)tlsphi_position(plan, a)[i]);
            high[i] = tlsphi_dmax(high[i], (double)tlsphi_position(plan, a)[i]);
        }
        grid->low[i] -= 1.5 * grid->width; /* so that cell - 1 never wraps below zero */
        const double cells = (high[i] - grid->low[i]) / grid->width + 2;
        if (!tlsphi_finite((tlsph_real)cells) || cells > (double)(1 << TLSPHI_GRID_BITS))
            return tlsphi_plan_fail(plan, TLSPH_ERROR_SIZE, "extent / support radius", TLSPH_NO_PARTICLE, cells,
                                    (double)(1 << TLSPHI_GRID_BITS), "less than 2^21; check spacing and positions");
    }
    for (grid->buckets = 16; grid->buckets < 2 * n;) grid->buckets *= 2;
    grid->key = TLSPHI_SCRATCH(plan, uint64_t, n);
    grid->order = TLSPHI_SCRATCH(plan, uint32_t, n);
    grid->table = TLSPHI_SCRATCH(plan, uint32_t, grid->buckets);
    uint64_t *key2 = TLSPHI_SCRATCH(plan, uint64_t, n);
    uint32_t *order2 = TLSPHI_SCRATCH(plan, uint32_t, n);
    if (!grid->key || !grid->order || !grid->table || !key2 || !order2) return tlsphi_no_memory(plan, 24.0 * (double)n);
    for (size_t a = 0; a < n; a++) {
        uint64_t cell[3];
        tlsphi_cell_of(grid, tlsphi_position(plan, a), cell);
        grid->key[a] = tlsphi_morton(cell);
        grid->order[a] = (uint32_t)a;
    }
    tlsphi_radix_sort(grid->key, grid->order, key2, order2, n);
    tlsphi_grid_hash(grid);
    return TLSPH_OK;
}

/* Lists the cells around each particle, checks the cells and makes V_a of them. */
static tlsph_result tlsphi_cells_build(tlsphi_plan *plan) {
    const tlsph_particles *p = &plan->desc->particles;
    const size_t corners = p->cell_count << plan->dim;
    plan->cell_first = TLSPHI_SCRATCH(plan, size_t, plan->n + 2);
    plan->cell_of = TLSPHI_SCRATCH(plan, uint32_t, corners);
    plan->volume = TLSPHI_SCRATCH(plan, double, plan->n);
    if (!plan->cell_first || !plan->cell_of || !plan->volume) return tlsphi_no_memory(plan, 16.0 * (double)plan->n);
    for (size_t i = 0; i < corners; i++) {
        if (p->cells[i] >= plan->n)
            return tlsphi_plan_fail(plan, TLSPH_ERROR_ARGUMENT, "corner of a cell", TLSPH_NO_PARTICLE,
                                    (double)p->cells[i], (double)plan->n, "less than the number of particles");
        plan->cell_first[p->cells[i] + 2]++;
    }
    for (size_t a = 0; a < plan->n; a++) {
        if (plan->cell_first[a + 2] > (size_t)1 << plan->dim)
            return tlsphi_plan_fail(plan, TLSPH_ERROR_ARGUMENT, "cells around it", a, (double)plan->cell_first[a + 2],
                                    (double)(1 << plan->dim), "at most 8 (2-D: 4): cells of a lattice, each once");
        plan->cell_first[a + 2] += plan->cell_first[a + 1];
    }
    for (size_t i = 0; i < corners; i++)
        plan->cell_of[plan->cell_first[p->cells[i] + 1]++] = (uint32_t)(i >> plan->dim);
    for (size_t c = 0; c < p->cell_count; c++) {
        double size[3];
        tlsphi_cell_size(plan, c, size);
        for (int axis = 0; axis < plan->dim; axis++)
            if (!(size[axis] > 0))
                return tlsphi_plan_fail(plan, TLSPH_ERROR_VOLUME, "edge of a cell", p->cells[c << plan->dim],
                                        size[axis], 0, "more than 0, corners numbered x fastest");
        for (int k = 0; k < 1 << plan->dim; k++)
            plan->volume[p->cells[(c << plan->dim) + (size_t)k]] += size[0] * size[1] * size[2] / (1 << plan->dim);
    }
    for (size_t a = 0; a < plan->n; a++)
        if (!(plan->volume[a] > 0))
            return tlsphi_plan_fail(plan, TLSPH_ERROR_NEIGHBOURS, "cells around it", a, 0, 1, "at least 1");
    return TLSPH_OK;
}

/* Size of C_ab + C_ba over that of C_ab for the i-th given pair, which belongs to a; 1 where there is no C_ba. */
static double tlsphi_given_asymmetry(const tlsphi_plan *plan, size_t a, size_t i) {
    const tlsph_particles *p = &plan->desc->particles;
    const size_t b = p->neighbours[i];
    for (size_t j = p->first[b]; j < p->first[b + 1]; j++) {
        double sum = 0, size = 0;
        if (p->neighbours[j] != a) continue;
        for (size_t k = 0; k < (size_t)plan->dim; k++) {
            const double mine = (double)p->pair_vectors[3 * i + k], other = (double)p->pair_vectors[3 * j + k];
            sum += (mine + other) * (mine + other);
            size += mine * mine + other * other;
        }
        return size > 0 ? sqrt(sum / size) : 0;
    }
    return 1;
}
static tlsph_result tlsphi_given_check(tlsphi_plan *plan) {
    const tlsph_particles *p = &plan->desc->particles;
    for (size_t a = 0; a < plan->n; a++) {
        if (p->first[a + 1] < p->first[a])
            return tlsphi_plan_fail(plan, TLSPH_ERROR_SIZE, "first", a, (double)p->first[a + 1], (double)p->first[a],
                                    "not falling");
        for (size_t i = p->first[a]; i < p->first[a + 1]; i++) {
            if (p->neighbours[i] >= plan->n || p->neighbours[i] == a)
                return tlsphi_plan_fail(plan, TLSPH_ERROR_ARGUMENT, "neighbour", a, (double)p->neighbours[i],
                                        (double)plan->n, "another particle's number");
            if (!tlsphi_all_finite(p->pair_vectors + 3 * i, (size_t)plan->dim))
                return tlsphi_plan_fail(plan, TLSPH_ERROR_NOT_FINITE, "pair vector", a, (double)i, 0, "finite");
        }
    }
    for (size_t a = 0; a < plan->n; a++)
        for (size_t i = p->first[a]; i < p->first[a + 1]; i++) {
            const double defect = tlsphi_given_asymmetry(plan, a, i), limit = TLSPHI_EPSILON > 1e-10 ? 1e-5 : 1e-10;
            if (!(defect <= limit))
                return tlsphi_plan_fail(plan, TLSPH_ERROR_ARGUMENT, "|C_ab + C_ba| / |C_ab|", a, defect, limit,
                                        "C_ab = -C_ba, with each pair in both lists");
        }
    return TLSPH_OK;
}

/* Row-major inverse of a symmetric positive matrix of size 2 or 3, padded to 3x3 with 1 on the diagonal. */
static void tlsphi_inverse(int n, const double A[9], double out[9]) {
    const double c00 = A[4] * A[8] - A[5] * A[7], c01 = A[5] * A[6] - A[3] * A[8], c02 = A[3] * A[7] - A[4] * A[6];
    const double det = A[0] * c00 + A[1] * c01 + A[2] * c02;
    double inverse[9];
    inverse[0] = c00;
    inverse[1] = A[2] * A[7] - A[1] * A[8];
    inverse[2] = A[1] * A[5] - A[2] * A[4];
    inverse[3] = c01;
    inverse[4] = A[0] * A[8] - A[2] * A[6];
    inverse[5] = A[2] * A[3] - A[0] * A[5];
    inverse[6] = c02;
    inverse[7] = A[1] * A[6] - A[0] * A[7];
    inverse[8] = A[0] * A[4] - A[1] * A[3];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) out[i * n + j] = inverse[3 * i + j] / det;
}

/* sum_b g_ab (x) d_ab / 2, padded to 3x3: for kernels w_a L_a^-1, for closed operators V_a I. */
static tlsph_result tlsphi_moment(tlsphi_plan *plan, size_t a, const uint32_t *list, const double *g, size_t count,
                                  double A[9]) {
    for (int i = 0; i < 9; i++) A[i] = 0;
    if (plan->dim == 2) A[8] = 1;
    for (size_t i = 0; i < count; i++) {
        double d[3] = {0, 0, 0};
        tlsphi_difference(plan, a, list[i], d);
        if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= 1e-18 * plan->h * plan->h)
            return tlsphi_plan_fail(plan, TLSPH_ERROR_DUPLICATE, "same place as particle", a, (double)list[i], 0,
                                    "distinct positions");
        for (int k = 0; k < plan->dim; k++)
            for (int l = 0; l < plan->dim; l++) A[3 * k + l] += 0.5 * g[(size_t)plan->dim * i + (size_t)k] * d[l];
    }
    return TLSPH_OK;
}
/* M_a = V_a/w_a L_a, after a check that the neighbours span the space. */
static tlsph_result tlsphi_correct(tlsphi_plan *plan, size_t a, const double A[9], size_t count, double *M) {
    double D[9], Q[9];
    memcpy(D, A, sizeof D);
    if (plan->dim == 2) D[8] = D[0] + D[4];
    tlsphi_eigen(D, Q);
    double least = D[0], largest = D[0];
    for (int i = 1; i < plan->dim; i++) {
        least = tlsphi_dmin(least, D[4 * i]);
        largest = tlsphi_dmax(largest, D[4 * i]);
    }
    if (count < (size_t)plan->dim || !(least > 1e-8 * largest))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_NEIGHBOURS, "neighbours", a, (double)count, plan->dim,
                                plan->dim == 3 ? "3 or more, not in a plane; or raise `support`"
                                               : "2 or more, not on a line; or raise `support`");
    tlsphi_inverse(plan->dim, A, M);
    for (int i = 0; i < plan->dim * plan->dim; i++) M[i] *= tlsphi_plan_volume(plan, a);
    return TLSPH_OK;
}

/* ==== [BONDS] ======================================================================================================
   Operators of 002. Kernels that are corrected themselves (W~, 002-6), so that sum w W~ = 1 and, first order,
   sum w (X_b - X_a) W~ = 0: with x = X_a - X_b and W of the plain kernel
     W~_ab = alpha (1 + beta.x) W,   G_ab = w_b L (alpha (1 + beta.x) grad W + ((1 + beta.x) grad alpha
                                                  + alpha (grad beta^T x + beta)) W),   C_ab = 2 V_a G_ab
   Zeroth order: beta = 0, L = (sum w d (x) grad W~)^-T ((12) lacks the transpose, gamma of (13) its factor W).
   First order: L = I. The plain gradient of 000 is alpha = 1, beta = 0. The kernel sums include the particle itself.

   Bond-based gradient (37), (39): F^c = F A + sum_b (x_b - x_a)/r (x) n w_b W~_ab with n = d/r and
   A = I - sum_b w_b W~_ab n (x) n. Since F = sum x (x) G, this is one more constant gradient:
     G^c_ab = A G_ab + w_b W~_ab n/r
   It needs no loop of its own, and its adjoint is the force that keeps the energy (25 as printed does not).

   Storage. None of these C_ab is M_a times an antisymmetric vector. The half difference g_ab = (C_ab - C_ba)/2 takes the
   place of the antisymmetric operator, and the half sum r_ab = (C_ab + C_ba)/2 is a second vector:
     P_a C_ab - P_b C_ba = (P_a + P_b) g_ab + (P_a - P_b) r_ab
   The patterns of [TILES] hold g_ab and C_ab, for gradients; forces take r_ab = C_ab - g_ab in a gather of its own.
   The printed force is what remains without the second part, with g_ab of the kernel's gradient and not of the bonds; r_ab
   then is C_ab - g_ab and serves gradients only. */

typedef struct tlsphi_bond {
    double alpha, beta[3], d_alpha[3], d_beta[9]; /* d_beta[3 k + i] = d beta_i / dX_k */
    double L[9], A[9];
} tlsphi_bond;

static int tlsphi_is_bond(tlsph_operator_kind kind) { return kind == TLSPH_BOND || kind == TLSPH_ZEROTH_BOND; }
static int tlsphi_needs_bonds(const tlsph_desc *d) {
    return tlsphi_is_bond(d->operator_kind) || d->operator_kind == TLSPH_ZEROTH_KERNEL ||
           d->operator_kind == TLSPH_FIRST_KERNEL ||
           (d->operator_kind == TLSPH_CORRECTED_KERNEL && d->force_form == TLSPH_FORCE_AS_PRINTED);
}
/* y = A x for padded 3x3. */
static void tlsphi_multiply9(const double A[9], const double x[3], double y[3]) {
    for (int i = 0; i < 3; i++) y[i] = A[3 * i] * x[0] + A[3 * i + 1] * x[1] + A[3 * i + 2] * x[2];
}
/* w_b W~_ab and w_b grad W~_ab, without L. */
static void tlsphi_bond_kernel(const tlsphi_plan *plan, size_t a, size_t b, double *value, double slope[3]) {
    const tlsphi_bond *c = plan->bond + a;
    double d[3], x[3], W, dW;
    tlsphi_difference(plan, a, b, d);
    const double r = sqrt(tlsphi_norm2(d)), w = (double)plan->weights[b];
    tlsphi_kernel(plan->desc->kernel, plan->dim, r, plan->h, &W, &dW);
    for (int i = 0; i < 3; i++) x[i] = -d[i];
    const double shape = 1 + c->beta[0] * x[0] + c->beta[1] * x[1] + c->beta[2] * x[2];
    *value = w * c->alpha * shape * W;
    tlsphi_multiply9(c->d_beta, x, slope);
    for (int i = 0; i < 3; i++)
        slope[i] = w * ((c->alpha * (slope[i] + c->beta[i]) + c->d_alpha[i] * shape) * W +
                        (r > 0 ? c->alpha * shape * dW * x[i] / r : 0));
}
/* C_ab = 2 V_a G_ab, with or without the bonds. */
static void tlsphi_bond_vector(const tlsphi_plan *plan, size_t a, size_t b, int bonds, double C[3]) {
    double W, slope[3], G[3], d[3];
    tlsphi_bond_kernel(plan, a, b, &W, slope);
    tlsphi_multiply9(plan->bond[a].L, slope, G);
    if (bonds) {
        tlsphi_multiply9(plan->bond[a].A, G, slope);
        tlsphi_difference(plan, a, b, d);
        for (int i = 0; i < 3; i++) G[i] = slope[i] + W * d[i] / tlsphi_norm2(d);
    }
    for (int i = 0; i < 3; i++) C[i] = 2 * tlsphi_plan_volume(plan, a) * G[i];
}

/* Moments of the kernel about a particle (002-52, 55), the particle itself included; d_...[k]: derivative by X_k. */
typedef struct tlsphi_kernel_moments {
    double sum, first[3], second[9], d_sum[3], d_first[3][3], d_second[3][9];
} tlsphi_kernel_moments;

static void tlsphi_add_kernel_moments(const tlsphi_plan *plan, size_t a, size_t b, tlsphi_kernel_moments *m) {
    double d[3], x[3], W, dW;
    tlsphi_difference(plan, a, b, d);
    const double r = sqrt(tlsphi_norm2(d)), w = (double)plan->weights[b];
    tlsphi_kernel(plan->desc->kernel, plan->dim, r, plan->h, &W, &dW);
    for (int i = 0; i < 3; i++) x[i] = -d[i];
    m->sum += w * W;
    for (int i = 0; i < 3; i++) m->first[i] += w * x[i] * W;
    for (int i = 0; i < 9; i++) m->second[i] += w * x[i / 3] * x[i % 3] * W;
    for (int k = 0; k < plan->dim; k++) {
        const double slope = r > 0 ? w * dW * x[k] / r : 0;
        m->d_sum[k] += slope;
        for (int i = 0; i < 3; i++) m->d_first[k][i] += x[i] * slope + (i == k ? w * W : 0);
        for (int i = 0; i < 9; i++)
            m->d_second[k][i] += x[i / 3] * x[i % 3] * slope + w * W * ((i % 3 == k) * x[i / 3] + (i / 3 == k) * x[i % 3]);
    }
}
/* alpha, beta and their derivatives (002-51, 54). */
static void tlsphi_first_order(const tlsphi_kernel_moments *m, int dim, tlsphi_bond *c) {
    double second[9], inverse[9] = {0}, compact[9], rhs[3];
    memcpy(second, m->second, sizeof second);
    if (dim == 2) second[8] = 1;
    tlsphi_inverse(dim, second, compact);
    for (int i = 0; i < dim * dim; i++) inverse[3 * (i / dim) + i % dim] = compact[i];
    tlsphi_multiply9(inverse, m->first, c->beta);
    for (int i = 0; i < 3; i++) c->beta[i] = -c->beta[i];
    c->alpha = 1 / (m->sum + tlsphi_dot3(c->beta, m->first));
    for (int k = 0; k < dim; k++) {
        tlsphi_multiply9(m->d_second[k], c->beta, rhs);
        for (int i = 0; i < 3; i++) rhs[i] = -rhs[i] - m->d_first[k][i];
        tlsphi_multiply9(inverse, rhs, c->d_beta + 3 * k);
        c->d_alpha[k] = -c->alpha * c->alpha *
                        (m->d_sum[k] + tlsphi_dot3(c->d_beta + 3 * k, m->first) + tlsphi_dot3(c->beta, m->d_first[k]));
    }
}
/* L, and A of the bonds; then sum_b d (x) C_ab must be 2 V_a I. */
static tlsph_result tlsphi_bond_correct(tlsphi_plan *plan, size_t a, const uint32_t *list, size_t count) {
    const int dim = plan->dim, plain = plan->desc->operator_kind == TLSPH_CORRECTED_KERNEL;
    const int first = plan->desc->operator_kind == TLSPH_FIRST_KERNEL || plan->desc->operator_kind == TLSPH_BOND;
    tlsphi_bond *c = plan->bond + a;
    tlsphi_kernel_moments m;
    double moment[9] = {0}, W, slope[3], d[3], inverse[9], worst = 0;
    memset(&m, 0, sizeof m);
    tlsphi_add_kernel_moments(plan, a, a, &m);
    for (size_t i = 0; i < count; i++) tlsphi_add_kernel_moments(plan, a, list[i], &m);
    c->alpha = plain ? 1 : 1 / m.sum;
    for (int k = 0; k < dim && !plain; k++) c->d_alpha[k] = -c->alpha * c->alpha * m.d_sum[k];
    if (first) tlsphi_first_order(&m, dim, c);
    for (int i = 0; i < 9; i++) c->L[i] = c->A[i] = i % 4 == 0;
    for (size_t i = 0; i < count; i++) {
        tlsphi_bond_kernel(plan, a, list[i], &W, slope);
        tlsphi_difference(plan, a, list[i], d);
        for (int k = 0; k < 9; k++) {
            moment[k] += slope[k / 3] * d[k % 3]; /* the transpose that (12) lacks */
            c->A[k] -= W * d[k / 3] * d[k % 3] / tlsphi_norm2(d);
        }
    }
    if (dim == 2) moment[8] = 1;
    tlsphi_inverse(dim, moment, inverse);
    for (int i = 0; i < dim * dim && !first; i++) c->L[3 * (i / dim) + i % dim] = inverse[i];
    for (int k = 0; k < dim * dim; k++) { /* the product of both, to see whether either was singular */
        const int row = k / dim, column = k % dim;
        double product = 0;
        for (int i = 0; i < dim; i++) product += c->L[3 * row + i] * moment[3 * i + column];
        worst = tlsphi_dmax(worst, tlsphi_finite((tlsph_real)product) ? fabs(product - (row == column)) : 1);
    }
    return worst <= 1e-6 ? TLSPH_OK
                         : tlsphi_plan_fail(plan, TLSPH_ERROR_NEIGHBOURS, "neighbours", a, (double)count, dim,
                                            "enough, not in a plane, for a corrected kernel; or raise `support`");
}
/* M_a g, or g where there is no correction, in double; a is a host number. */
static void tlsphi_apply_correction(const tlsphi_plan *plan, size_t a, const double *g, double out[3]) {
    const size_t D = (size_t)plan->dim;
    for (size_t i = 0; i < D; i++) {
        out[i] = plan->correction ? 0 : g[i];
        for (size_t k = 0; plan->correction && k < D; k++) out[i] += plan->correction[D * D * a + D * i + k] * g[k];
    }
}
/* C_ab and -C_ba for the pair (a, b) with vector g of its builder, and g_ab where the force is the printed one; host
   numbers. */
static void tlsphi_pair_vectors(const tlsphi_plan *plan, size_t a, size_t b, const double *g, double mine[3],
                                double other[3], double middle[3]) {
    if (!plan->bond) {
        tlsphi_apply_correction(plan, a, g, mine);
        tlsphi_apply_correction(plan, b, g, other);
    } else {
        const int bonds = tlsphi_is_bond(plan->desc->operator_kind);
        tlsphi_bond_vector(plan, a, b, bonds, mine);
        tlsphi_bond_vector(plan, b, a, bonds, other);
        for (int i = 0; i < 3; i++) other[i] = -other[i];
        tlsphi_round_vectors(plan, mine, 3);
        tlsphi_round_vectors(plan, other, 3);
        if (bonds && plan->desc->force_form == TLSPH_FORCE_AS_PRINTED) {
            double back[3];
            tlsphi_bond_vector(plan, a, b, 0, middle);
            tlsphi_bond_vector(plan, b, a, 0, back);
            for (int i = 0; i < 3; i++) middle[i] = (middle[i] - back[i]) / 2;
            tlsphi_round_vectors(plan, middle, 3);
            return;
        }
    }
    for (int i = 0; i < 3; i++) middle[i] = (mine[i] + other[i]) / 2;
    if ((plan->correction && plan->antisymmetric) || plan->bond) tlsphi_round_vectors(plan, middle, 3);
}

/* -- bodies and order -- */

/* Union-find over the pairs: connected particles are one body (projection, [PROJECTION]). */
static uint32_t tlsphi_root(uint32_t *parent, uint32_t a) {
    while (parent[a] != a) a = parent[a] = parent[parent[a]];
    return a;
}
static void tlsphi_join(uint32_t *parent, uint32_t a, uint32_t b) {
    a = tlsphi_root(parent, a);
    b = tlsphi_root(parent, b);
    if (a < b) parent[b] = a;
    else parent[a] = b;
}

static void tlsphi_closed_moment(const tlsphi_plan *plan, size_t a, double A[9]); /* [CLOSURE] */

static int tlsphi_owns_surface(const tlsph_desc *d, size_t a);                    /* [VALIDATION] */
/* M_a = V (V I - T)^-1 for particles behind the surface; A: the operator's own V I - T. */
static tlsph_result tlsphi_correct_closed(tlsphi_plan *plan, size_t a, const double A[9]) {
    const double V = tlsphi_plan_volume(plan, a);
    const size_t dd = (size_t)(plan->dim * plan->dim);
    double wanted[9], *M = plan->correction + dd * a, worst = 0, most = 0;
    tlsphi_closed_moment(plan, a, wanted);
    for (int k = 0; k < 9; k++) worst = tlsphi_dmax(worst, fabs(A[k] - wanted[k]) / V);
    tlsphi_inverse(plan->dim, wanted, M);
    for (size_t k = 0; k < dd; k++) {
        M[k] *= V;
        most = tlsphi_dmax(most, fabs(M[k]));
    }
    if (!(worst <= 0.1))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_NEIGHBOURS, "defect of sum C (x) d / 2 = V I - T over V", a, worst, 0.1,
                                "pair vectors that are exact for linear fields");
    if (!(most <= TLSPHI_CORRECTION_MOST))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_SURFACE, "its distance from the surface: V (V I - T)^-1", a, most,
                                TLSPHI_CORRECTION_MOST, "about 2 half a spacing behind it; more particles across thin parts");
    return TLSPH_OK;
}
/* Goes once over all particles: builds M_a, joins bodies. list and g hold the largest neighbourhood. */
static tlsph_result tlsphi_survey(tlsphi_plan *plan, uint32_t *parent, uint32_t *list, double *g) {
    for (size_t a = 0; a < plan->n; a++) {
        double A[9];
        const size_t count = tlsphi_neighbours_of(plan, a, list, g);
        tlsph_result r = tlsphi_moment(plan, a, list, g, count, A);
        if (plan->lattice) tlsphi_image_moment(plan, a, A);
        if (!r && plan->bond) r = tlsphi_bond_correct(plan, a, list, count);
        if (r) return r;
        const double V = tlsphi_plan_volume(plan, a);
        if (plan->closed_C && plan->correction) {
            if ((r = tlsphi_correct_closed(plan, a, A))) return r;
        } else if (plan->correction) {
            r = tlsphi_correct(plan, a, A, count, plan->correction + (size_t)(plan->dim * plan->dim) * a);
            if (r) return r;
        } else if (!plan->bond) {
            double worst = 0;
            for (int k = 0; k < plan->dim * plan->dim; k++) {
                const int i = k / plan->dim, j = k % plan->dim;
                worst = tlsphi_dmax(worst, fabs(A[3 * i + j] - (i == j ? V : 0)));
            }
            const double allowed = plan->closed_C ? 0.1 : TLSPHI_EPSILON > 1e-10 ? 1e-3 : 1e-6;
            if (!(worst <= allowed * V))
                return tlsphi_plan_fail(plan, TLSPH_ERROR_NEIGHBOURS, "defect of sum C (x) d / 2 = V I over V", a,
                                        worst / V, allowed, "pair vectors that are exact for linear fields");
        }
        for (size_t i = 0; i < count; i++) tlsphi_join(parent, (uint32_t)a, list[i]);
    }
    return TLSPH_OK;
}

static size_t tlsphi_count_pairs(tlsphi_plan *plan) {
    plan->least = plan->n;
    for (size_t a = 0; a < plan->n; a++) {
        const size_t count = tlsphi_neighbours_of(plan, a, NULL, NULL);
        plan->pairs += count;
        plan->least = count < plan->least ? count : plan->least;
        plan->most = count > plan->most ? count : plan->most;
    }
    return plan->most;
}

/* If M_a g_ab and M_b g_ab agree to round-off for every pair, C is antisymmetric and the solver needs no M_a. */
static void tlsphi_test_antisymmetry(tlsphi_plan *plan, uint32_t *list, double *g) {
    const int dim = plan->dim;
    const size_t dd = (size_t)(dim * dim);
    double worst = 0, largest = 0;
    for (size_t a = 0; a < plan->n; a++) {
        const size_t count = tlsphi_neighbours_of(plan, a, list, g);
        for (size_t i = 0; i < count; i++)
            for (int k = 0; k < dim; k++) {
                double mine = 0, other = 0;
                for (int l = 0; l < dim; l++) {
                    mine += plan->correction[dd * a + (size_t)(k * dim + l)] * g[(size_t)dim * i + (size_t)l];
                    other += plan->correction[dd * list[i] + (size_t)(k * dim + l)] * g[(size_t)dim * i + (size_t)l];
                }
                worst = tlsphi_dmax(worst, fabs(mine - other));
                largest = tlsphi_dmax(largest, fabs(mine));
            }
    }
    /* positions in float carry their own round-off; its effect on C is not asymmetry either */
    plan->antisymmetric = worst <= (TLSPHI_EPSILON > 1e-10 ? 1e-5 : 1e-11) * largest;
}

/* Spacing of the lattice along each axis, seen from the first particle: the least distance along the axis of which all its
   neighbours' are multiples. Clouds have none; there it is the edge of the particle's volume. */
static void tlsphi_row_spacing(const tlsphi_plan *plan, const uint32_t *list, size_t count, double spacing[3]) {
    const tlsph_real V = (tlsph_real)tlsphi_plan_volume(plan, 0), root = tlsphi_inverse_cube_root(V);
    const double edge = plan->dim == 3 ? (double)(V * root * root) : sqrt((double)V); /* pow is not the same everywhere */
    for (int axis = 0; axis < plan->dim; axis++) {
        double d[3], least = TLSPHI_LARGEST;
        int regular = 1;
        for (int pass = 0; pass < 2; pass++)
            for (size_t i = 0; i < count; i++) {
                tlsphi_difference(plan, 0, list[i], d);
                const double along = fabs(d[axis]);
                if (!pass && along > 1e-3 * edge) least = tlsphi_dmin(least, along);
                if (pass && fabs(along / least - floor(along / least + 0.5)) > 1e-3) regular = 0;
            }
        spacing[axis] = regular && least > 0.3 * edge && least < 10 * edge ? least : edge;
    }
}
/* Sort keys: rows along the longest axis, in strips of about TLSPHI_STRIP particles a layer, so that the layers above and
   below are still in the cache when they are needed again. */
#define TLSPHI_STRIP 1024
static void tlsphi_row_keys(const tlsphi_plan *plan, const double spacing[3], uint64_t *key) {
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    uint64_t cells[3] = {1, 1, 1};
    int axis[3] = {0, 1, 2};
    for (int i = 0; i < plan->dim; i++) {
        low[i] = high[i] = (double)tlsphi_position(plan, 0)[i];
        for (size_t a = 1; a < plan->n; a++) {
            low[i] = tlsphi_dmin(low[i], (double)tlsphi_position(plan, a)[i]);
            high[i] = tlsphi_dmax(high[i], (double)tlsphi_position(plan, a)[i]);
        }
        cells[i] = (uint64_t)tlsphi_dmin((high[i] - low[i]) / spacing[i] + 1.5, 2e6);
    }
    for (int i = 1; i < 3; i++)
        if (cells[i] > cells[axis[0]]) {
            axis[i] = axis[0];
            axis[0] = i;
        }
    const int x = axis[0], y = axis[1], z = axis[2];
    const uint64_t strip = cells[x] < TLSPHI_STRIP ? TLSPHI_STRIP / cells[x] : 1;
    for (size_t a = 0; a < plan->n; a++) {
        uint64_t at[3] = {0, 0, 0};
        for (int i = 0; i < plan->dim; i++) {
            at[i] = (uint64_t)(((double)tlsphi_position(plan, a)[i] - low[i]) / spacing[i] + 0.5);
            if (at[i] >= cells[i]) at[i] = cells[i] - 1;
        }
        key[a] = (((at[y] / strip) * cells[z] + at[z]) * strip + at[y] % strip) * cells[x] + at[x];
    }
}
/* Particles by rows of the lattice, or of a lattice laid over a cloud: see [TILES]. list and g hold the largest
   neighbourhood. */
static uint32_t *tlsphi_order_rows(tlsphi_plan *plan, uint32_t *list, double *g) {
    const size_t n = plan->n;
    uint64_t *key = TLSPHI_SCRATCH(plan, uint64_t, n), *key2 = TLSPHI_SCRATCH(plan, uint64_t, n);
    uint32_t *order = TLSPHI_SCRATCH(plan, uint32_t, n), *order2 = TLSPHI_SCRATCH(plan, uint32_t, n);
    double spacing[3] = {1, 1, 1};
    if (!key || !key2 || !order || !order2) return NULL;
    tlsphi_row_spacing(plan, list, tlsphi_neighbours_of(plan, 0, list, g), spacing);
    tlsphi_row_keys(plan, spacing, key);
    for (size_t i = 0; i < n; i++) order[i] = (uint32_t)i;
    tlsphi_radix_sort(key, order, key2, order2, n);
    return order;
}
/* 2 level + 1 beside another level; particles of a class stand together. */
static size_t tlsphi_rate_class(const tlsphi_plan *plan, size_t host) {
    return plan->level ? 2 * (size_t)plan->level[host] + (plan->seen[host] != 0) : 0;
}
/* Bodies get numbers in the order of their first particle; particles are ordered by body, then by rows. */
static tlsph_result tlsphi_order(tlsphi_plan *plan, uint32_t *parent, uint32_t *list, double *g) {
    const size_t n = plan->n;
    const size_t classes = plan->level ? 2 * (size_t)plan->levels : 1;
    size_t *start = TLSPHI_SCRATCH(plan, size_t, classes * n + 2);
    uint32_t *label = TLSPHI_SCRATCH(plan, uint32_t, n);
    plan->host = TLSPHI_SCRATCH(plan, uint32_t, n);
    plan->inner = TLSPHI_SCRATCH(plan, uint32_t, n);
    plan->body = TLSPHI_SCRATCH(plan, uint32_t, n);
    const uint32_t *order = tlsphi_order_rows(plan, list, g);
    if (!start || !label || !plan->host || !plan->inner || !plan->body || !order)
        return tlsphi_no_memory(plan, 48.0 * (double)n);
    for (size_t a = 0; a < n; a++) { /* roots are the smallest numbers of their bodies, so they come first */
        const uint32_t root = tlsphi_root(parent, (uint32_t)a);
        label[a] = root == a ? (uint32_t)plan->bodies++ : label[root];
        start[classes * label[a] + tlsphi_rate_class(plan, a) + 2]++;
    }
    for (size_t b = 0; b < classes * plan->bodies; b++) start[b + 2] += start[b + 1];
    for (size_t i = 0; i < n; i++) {
        const uint32_t a = order[i];
        const size_t at = start[classes * label[a] + tlsphi_rate_class(plan, a) + 1]++;
        plan->host[at] = a;
        plan->inner[a] = (uint32_t)at;
        plan->body[at] = label[a];
    }
    return TLSPH_OK;
}

/* ==== [CLOSURE] ====================================================================================================
   Pair vectors for irregular clouds. With d = X_b - X_a, V_a and B_a given, C must satisfy

     C_ab = -C_ba,   sum_b C_ab = -B_a,   1/2 sum_b C_ab (x) d = V_a I

   so that a uniform stress is in balance with the tractions P B_a and linear fields have exact gradients. Of all such C
   take the one nearest to zero in the norm sum |C|^2/w, w the kernel's -2 w_a w_b W'/r. Lagrange's multipliers l_a (a
   vector) and m_a (a matrix) give

     C_ab = w [(l_a - l_b) + (m_a + m_b) d]

   and m_a = V_a (sum w d (x) d)^-1, l = 0 is a symmetrised corrected kernel, from which the solution starts. The matrix is
   singular for quadratic l with m = grad l / 2, and nearly so for smooth ones; so both conditions get a little slack,
   which changes B_a only where it is not zero and only in its length (at corners with D + 1 neighbours or fewer, whose
   conditions outnumber their pairs, in all directions):

     B_a -> B_a + s0 n (n.l_a)/100,  n = B_a/|B_a|;    V_a I -> V_a I - s0 eps h^2 (m_a - start),  eps = 1e-3 (V_a/h^D)^2

   s0 = sum_b w. The volumes' slack leaves gradients of linear fields wrong by up to 2 % in a few particles, 0.2 % on average.
   Where there are more than 5 % anywhere, a second solution goes on from the first with a tenth of that slack; with
   `tight_closure` with a hundredth, which leaves 0.1 % and costs ten times as much, and waves are not the better for it.
   What the iterations leave of sum C + B is at last taken away by l alone, a graph's Laplacian, after sum B (x) X was made
   V I: a uniform stress exerts no force inside the body but round-off, and its tractions no torque.

   Particles behind the surface (`moments`). The share of the surface that a particle owns lies around X_a + o, not at X_a. With
   T_a = integral of n (x) (x - X_a) over it, B (x) o where it is flat, the second condition becomes V I - T, by the divergence
   theorem on the particle's cell. Gradients of linear fields come out right by M_a = V (V I - T)^-1 ([OPERATORS]), and
   with P M in the forces a uniform stress is in balance with the tractions P B at the shares' own places ([SURFACES]).
   Conjugate gradients; preconditioner: the inverse of each particle's own (1 + D) x (1 + D) block, one for all components.
   In units of the largest spacing. w and d are rounded to float: that halves the memory to read and costs d 1e-7. */

#define TLSPHI_CLOSURE_SLACK 1e-3  /* eps */
#define TLSPHI_CLOSURE_AREA 0.01   /* slack of B_a along n */
#define TLSPHI_CLOSURE_LIMIT 2e-2  /* largest residual of the first solution, in the local spacing's area and 2 V: a tenth
                                      of it changes no error by 1 % */
#define TLSPHI_CLOSURE_DEFECT 0.05 /* of linear fields in any particle, above which the second solution is made */
#define TLSPHI_CLOSURE_TIGHT 1e-3  /* the same with `tight_closure` */
#define TLSPHI_CLOSURE_BALANCE 1e-9 /* largest residual of sum C + B in the end */
#define TLSPHI_CLOSURE_STEPS 20000 /* iterations, far more than ever needed */
#define TLSPHI_CLOSURE_BLOCK 256   /* particles a task */

/* Unknowns of a particle: `rows` rows of 4, components across and the fourth of them empty; the first row is l, then the
   columns of m. While l alone moves there is one row. */
typedef struct tlsphi_closer {
    tlsphi_plan *plan;
    size_t n, tasks, rows;
    size_t *first;                /* neighbours in grid order */
    uint32_t *list;
    float (*pair)[4];             /* w, d */
    double *x, *r, *p, *q;        /* unknowns, residual, direction, K times direction */
    float (*block)[16];           /* inverse blocks */
    double (*slack)[7];           /* n times the root of B's slack; slack of m; scales of residuals: h^(D-1), 2 V; across n */
    double *sums;                 /* 2 a task */
    uint32_t *part;               /* number of the connected part with each root, and the parts' turns */
    struct tlsphi_closure_turn *turn;
    double missing;               /* what the last turn had to give */
    double step, beta, eased, unit; /* eased: share of the slack; unit: m */
} tlsphi_closer;

/* The loop over components; left rolled it becomes one vector operation. */
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 8
#define TLSPHI_FOUR _Pragma("GCC unroll 1") for (int j = 0; j < 4; j++)
#else
#define TLSPHI_FOUR for (int j = 0; j < 4; j++)
#endif

/* out += S l, by which B_a shrinks */
TLSPHI_INLINE void tlsphi_closure_slack(const double *slack, const double *l, double *out) {
    const double along = tlsphi_dot3(slack, l);
    for (int j = 0; j < 3; j++) out[j] += slack[j] * along + slack[6] * l[j];
}
/* q = K p for one particle; the sum of q.p. */
TLSPHI_INLINE double tlsphi_closure_row(const tlsphi_closer *c, size_t a, const int rows) {
    const double *slack = c->slack[a], *from = c->p + 4 * (size_t)rows * a;
    double pa[16], y[16] = {0}, *q = c->q + 4 * (size_t)rows * a, sum = 0;
    TLSPHI_UNROLL for (int l = 0; l < rows; l++) TLSPHI_FOUR pa[4 * l + j] = from[4 * l + j];
    for (size_t k = c->first[a]; k < c->first[a + 1]; k++) {
        const double *pb = c->p + 4 * (size_t)rows * c->list[k], w = (double)c->pair[k][0];
        const double d[4] = {0, (double)c->pair[k][1], (double)c->pair[k][2], (double)c->pair[k][3]};
        double X[4];
        TLSPHI_FOUR X[j] = pa[j] - pb[j];
        TLSPHI_UNROLL for (int l = 1; l < rows; l++) TLSPHI_FOUR X[j] += (pa[4 * l + j] + pb[4 * l + j]) * d[l];
        TLSPHI_FOUR X[j] *= w;
        TLSPHI_FOUR y[j] += X[j];
        TLSPHI_UNROLL for (int l = 1; l < rows; l++) TLSPHI_FOUR y[4 * l + j] += X[j] * d[l];
    }
    if (rows > 1) tlsphi_closure_slack(slack, pa, y);
    for (int k = 4; k < 4 * rows; k++) y[k] += slack[3] * pa[k];
    for (int k = 0; k < 4 * rows; k++) sum += (q[k] = y[k]) * pa[k];
    return sum;
}
static void tlsphi_closure_product_task(void *arg, size_t i) {
    tlsphi_closer *c = (tlsphi_closer *)arg;
    const size_t begin = i * TLSPHI_CLOSURE_BLOCK;
    double sum = 0;
    for (size_t a = begin; a < begin + TLSPHI_CLOSURE_BLOCK && a < c->n; a++)
        sum += c->rows == 4 ? tlsphi_closure_row(c, a, 4) : c->rows == 3 ? tlsphi_closure_row(c, a, 3) : tlsphi_closure_row(c, a, 1);
    c->sums[2 * i] = sum;
}
/* x += step p, r -= step q, q = inverse block times r; sum of r.q, largest r^2. */
static void tlsphi_closure_update_task(void *arg, size_t i) {
    tlsphi_closer *c = (tlsphi_closer *)arg;
    const size_t begin = i * TLSPHI_CLOSURE_BLOCK, rows = c->rows;
    double sum = 0, most = 0;
    for (size_t a = begin; a < begin + TLSPHI_CLOSURE_BLOCK && a < c->n; a++) {
        double *x = c->x + 4 * rows * a, *r = c->r + 4 * rows * a, *p = c->p + 4 * rows * a, *q = c->q + 4 * rows * a;
        const double *scale = c->slack[a] + 4;
        double size[2] = {0, 0};
        for (size_t k = 0; k < 4 * rows; k++) {
            x[k] += c->step * p[k];
            r[k] -= c->step * q[k];
            size[k >= 4] += r[k] * r[k];
        }
        for (size_t k = 0; k < rows; k++) {
            double z[4] = {0, 0, 0, 0};
            for (size_t l = 0; l < rows; l++) {
                const double M = (double)c->block[a][4 * k + l];
                TLSPHI_FOUR z[j] += M * r[4 * l + (size_t)j];
            }
            for (size_t j = 0; j < 4; j++) sum += (q[4 * k + j] = z[j]) * r[4 * k + j];
        }
        for (int k = 0; k < 2; k++) most = tlsphi_dmax(most, size[k] / (scale[k] * scale[k]));
    }
    c->sums[2 * i] = sum;
    c->sums[2 * i + 1] = most;
}
/* p = q + beta p */
static void tlsphi_closure_direction_task(void *arg, size_t i) {
    tlsphi_closer *c = (tlsphi_closer *)arg;
    const size_t begin = i * TLSPHI_CLOSURE_BLOCK, end = begin + TLSPHI_CLOSURE_BLOCK;
    for (size_t k = 4 * c->rows * begin; k < 4 * c->rows * (end < c->n ? end : c->n); k++) c->p[k] = c->q[k] + c->beta * c->p[k];
}
/* Returns the tasks' sum; most: the largest residual. */
static double tlsphi_closure_run(tlsphi_closer *c, tlsph_task_fn task, double *most) {
    const tlsph_desc *d = c->plan->desc;
    double sum = 0;
    tlsphi_parallel(d->run, d->run_user, d->threads, task, c, c->tasks);
    for (size_t i = 0; i < c->tasks; i++) sum += c->sums[2 * i];
    for (size_t i = 0; most && i < c->tasks; i++) *most = tlsphi_dmax(i ? *most : 0, sqrt(c->sums[2 * i + 1]));
    return sum;
}
/* Until the largest residual meets the limit; r is the residual of x. */
static tlsph_result tlsphi_closure_iterate(tlsphi_closer *c, double limit, double *residual) {
    double old = 0, rz;
    c->step = 0;
    memset(c->p, 0, 4 * c->rows * c->n * sizeof *c->p);
    memset(c->q, 0, 4 * c->rows * c->n * sizeof *c->q);
    rz = tlsphi_closure_run(c, tlsphi_closure_update_task, residual);
    for (int steps = 0; *residual > limit; steps++, c->plan->closure.iterations++) {
        c->beta = old > 0 ? rz / old : 0;
        tlsphi_closure_run(c, tlsphi_closure_direction_task, NULL);
        const double pq = tlsphi_closure_run(c, tlsphi_closure_product_task, NULL);
        c->step = pq > 0 ? rz / pq : 0;
        old = rz;
        rz = tlsphi_closure_run(c, tlsphi_closure_update_task, residual);
        if (steps >= TLSPHI_CLOSURE_STEPS || !(*residual < 1e15))
            return tlsphi_plan_fail(c->plan, TLSPH_ERROR_NEIGHBOURS, "residual of the closure", TLSPH_NO_PARTICLE, *residual,
                                    limit, "a cloud whose volumes and areas belong together");
    }
    return TLSPH_OK;
}
/* What is missing of sum C + B for the unknowns in p: component j of grid particle i. Follows a product. */
static double tlsphi_closure_open(const tlsphi_closer *c, size_t i, size_t j) {
    const size_t D = (size_t)c->plan->dim;
    const double B = j < D ? (double)c->plan->desc->particles.areas[3 * c->plan->grid.order[i] + j] : 0;
    return -B / pow(c->unit, (double)D - 1) - c->q[4 * c->rows * i + j];
}
/* Inverse of a symmetric positive matrix by Gauss-Jordan without pivots. */
static void tlsphi_closure_invert(size_t n, double *A) {
    for (size_t k = 0; k < n; k++) {
        const double pivot = 1 / A[n * k + k];
        A[n * k + k] = 1;
        for (size_t j = 0; j < n; j++) A[n * k + j] *= pivot;
        for (size_t i = 0; i < n; i++) {
            const double factor = A[n * i + k];
            if (i == k) continue;
            A[n * i + k] = 0;
            for (size_t j = 0; j < n; j++) A[n * i + j] -= factor * A[n * k + j];
        }
    }
}
/* A uniform stress has no torque on a part where sum B (x) X + T = V I. What is missing for that goes into the lengths of its B,
   V n (n.(y_0 + Y X)): D (D + 1) equations A y = R a part. */
typedef struct tlsphi_closure_turn { double A[144], y[12], V, MV; } tlsphi_closure_turn;
/* y = A^-1 y; A may lack directions, for instance the turns of a ball. sum B (x) X = sum K, and behind surfaces sum B (x) X + T
   = sum M K: it changes with the lengths of B by the mean of M as much. There the turns of a ball do need something, which lengths
   cannot give: a little damping keeps them from trying. */
static void tlsphi_closure_turn_solve(tlsphi_closure_turn *t, size_t N) {
    double y[12], most = 0;
    for (size_t k = 0; k < N; k++) most = tlsphi_dmax(most, t->A[(N + 1) * k]);
    for (size_t k = 0; k < N; k++) {
        t->A[(N + 1) * k] += 1e-12 * most;
        y[k] = t->y[k] * (k % (N == 12 ? 4 : 3) ? t->V / t->MV : 1);
        if (k % (N == 12 ? 4 : 3) && t->MV > t->V) t->A[(N + 1) * k] *= 1.02;
    }
    tlsphi_closure_invert(N, t->A);
    for (size_t k = 0; k < N; k++) {
        t->y[k] = 0;
        for (size_t m = 0; m < N; m++) t->y[k] += t->A[N * k + m] * y[m];
    }
}
/* V I less the moment by which tractions act: T, or behind the surface T M K/V = (M - I) K, since loads are levered by the
   particles' own gradients (see [SURFACES]); K = sum C (x) d / 2 of the solution, as it is in q. Returns the mean of M's
   diagonal. */
static double tlsphi_closure_arms(const tlsphi_closer *c, size_t i, double A[9]) {
    const size_t D = c->rows - 1, a = c->plan->grid.order[i];
    const double V = tlsphi_plan_volume(c->plan, a), volume = pow(c->unit, (double)D);
    double M[9] = {0}, mean = 0;
    tlsphi_closed_moment(c->plan, a, A);
    if (!tlsphi_owns_surface(c->plan->desc, a)) return 1;
    tlsphi_inverse((int)D, A, M);
    for (size_t j = 0; j < D; j++) mean += V * M[(D + 1) * j] / (double)D;
    for (size_t j = 0; j < D; j++)
        for (size_t l = 0; l < D; l++) {
            A[3 * j + l] = j == l ? V : 0;
            for (size_t k = 0; k < D; k++) {
                const size_t at = 4 * c->rows * i + 4 * (l + 1) + k;
                A[3 * j + l] -= (V * M[D * j + k] - (j == k)) * (c->q[at] - c->slack[i][3] * c->x[at]) * volume / 2;
            }
        }
    return mean;
}
/* Adds grid particle i to the equations of its part, around X0; or (apply) their solution to the residual. */
static void tlsphi_closure_turn_add(tlsphi_closer *c, size_t i, const tlsph_real *X0, tlsphi_closure_turn *t, int apply) {
    const size_t rows = c->rows, N = (rows - 1) * rows;
    const tlsph_real *X = c->plan->desc->particles.positions + 3 * c->plan->grid.order[i];
    const double *n = c->slack[i], volume = c->slack[i][5] / 2, nn = tlsphi_dot3(n, n);
    double f[4] = {1, 0, 0, 0}, had[3] = {0, 0, 0}, along = 0, A[9];
    const double unit = pow(c->unit, (double)(rows - 1));
    for (size_t k = 1; k < rows; k++) f[k] = (double)(X[k - 1] - X0[k - 1]) / c->unit;
    if (apply && nn > 0) {
        for (size_t k = 0; k < N; k++) along += n[k / rows] * t->y[k] * f[k % rows];
        for (size_t k = 0; k < 3; k++) c->r[4 * i + k] -= volume * along / nn * n[k];
    }
    if (apply) return;
    t->MV += volume * tlsphi_closure_arms(c, i, A);
    t->V += volume;
    tlsphi_closure_slack(c->slack[i], c->x + 4 * rows * i, had);
    for (size_t k = 0; k < N; k++) {
        const size_t j = k / rows;
        t->y[k] += (c->r[4 * i + j] + c->q[4 * rows * i + j] - had[j]) * f[k % rows];
        if (k % rows) t->y[k] += A[3 * j + k % rows - 1] / unit;
        for (size_t m = 0; nn > 0 && m < N; m++)
            t->A[N * k + m] += volume / nn * n[j] * n[m / rows] * f[k % rows] * f[m % rows];
    }
}
static tlsph_result tlsphi_closure_turn_all(tlsphi_closer *c, uint32_t *parent, double *missing) {
    const tlsph_real *X = c->plan->desc->particles.positions;
    const size_t N = (c->rows - 1) * c->rows;
    uint32_t parts = 0;
    if (!c->part && !(c->part = TLSPHI_SCRATCH(c->plan, uint32_t, c->n)))
        return tlsphi_no_memory(c->plan, 4.0 * (double)c->n);
    for (size_t a = 0; a < c->n; a++)
        if (parent[a] == a) c->part[a] = parts++;
    if (!c->turn && !(c->turn = TLSPHI_SCRATCH(c->plan, tlsphi_closure_turn, parts)))
        return tlsphi_no_memory(c->plan, (double)sizeof *c->turn * parts);
    tlsphi_closure_turn *const turn = c->turn;
    memset(turn, 0, parts * sizeof *turn);
    for (int apply = 0; apply < 2; apply++) {
        for (size_t i = 0; i < c->n; i++) {
            const size_t root = tlsphi_root(parent, c->plan->grid.order[i]);
            tlsphi_closure_turn_add(c, i, X + 3 * root, turn + c->part[root], apply);
        }
        *missing = 0;
        for (uint32_t p = 0; p < parts; p++) {
            if (!apply) tlsphi_closure_turn_solve(turn + p, N);
            for (size_t k = 0; k < N; k++) *missing = tlsphi_dmax(*missing, fabs(turn[p].y[k]));
        }
    }
    return TLSPH_OK;
}
/* The last word: l alone, packed into the memory of p. Behind the surface arms change with l, so that it is said again. */
static tlsph_result tlsphi_closure_balance(tlsphi_closer *c, uint32_t *parent, int again) {
    tlsphi_closer packed = *c;
    const size_t size = 4 * c->n;
    double residual, missing = 0;
    for (size_t i = 0; i < c->n; i++) {
        double sum = 0;
        for (size_t k = c->first[i]; k < c->first[i + 1]; k++) sum += (double)c->pair[k][0];
        c->block[i][0] = (float)(1 / sum);
    }
    memcpy(c->p, c->x, c->rows * size * sizeof *c->p);
    tlsphi_closure_run(c, tlsphi_closure_product_task, NULL);
    for (size_t i = 0; i < size; i++) c->r[i] = again ? 0 : tlsphi_closure_open(c, i / 4, i % 4);
    const tlsph_result turned = tlsphi_closure_turn_all(c, parent, &missing);
    const int vain = again > 2 && !(missing < 0.8 * c->missing), enough = again && !(missing > 10 * TLSPHI_CLOSURE_BALANCE);
    if (turned || vain || enough) return turned;
    c->missing = missing;
    packed.rows = 1;
    packed.x = c->p;
    packed.p = c->p + size;
    packed.q = c->p + 2 * size;
    memset(packed.x, 0, size * sizeof *packed.x);
    const tlsph_result r = tlsphi_closure_iterate(&packed, TLSPHI_CLOSURE_BALANCE, &residual);
    for (size_t i = 0; i < size; i++) c->x[c->rows * (i - i % 4) + i % 4] += packed.x[i];
    return r || !c->plan->desc->particles.moments || again == 20 ? r : tlsphi_closure_balance(c, parent, again + 1);
}

/* V I - T of host particle a, padded to 3x3. */
static void tlsphi_closed_moment(const tlsphi_plan *plan, size_t a, double A[9]) {
    const tlsph_real *T = plan->desc->particles.moments;
    for (int k = 0; k < 9; k++) {
        const int inside = k / 3 < plan->dim && k % 3 < plan->dim;
        A[k] = k % 4 ? 0 : inside ? tlsphi_plan_volume(plan, a) : 1;
        if (T && inside) A[k] -= (double)T[9 * a + (size_t)k];
    }
}
/* Block and slack of grid particle i, and its start: m, row by row, into out. */
static tlsph_result tlsphi_closure_particle(tlsphi_closer *c, size_t i, double *out) {
    tlsphi_plan *plan = c->plan;
    const size_t D = (size_t)plan->dim, rows = c->rows, a = plan->grid.order[i];
    const tlsph_real *B = plan->desc->particles.areas + 3 * a;
    const double BB = (double)tlsphi_any_dot(plan->dim, B, B), volume = pow(c->unit, (double)D);
    const double h = tlsphi_pair_h(plan, a, a) / (double)plan->desc->support / c->unit;
    double block[16] = {0}, moment[9] = {0}, m[9], A[9], *slack = c->slack[i];
    if (D == 2) moment[8] = 1;
    for (size_t k = c->first[i]; k < c->first[i + 1]; k++) {
        const float *pair = c->pair[k];
        for (size_t j = 0; j < rows * rows; j++)
            block[j] += (double)pair[0] * (j / rows ? (double)pair[j / rows] : 1) * (j % rows ? (double)pair[j % rows] : 1);
    }
    for (size_t j = 0; j < D * D; j++) moment[3 * (j / D) + j % D] = block[rows * (1 + j / D) + 1 + j % D];
    const tlsph_result r = tlsphi_correct(plan, a, moment, c->first[i + 1] - c->first[i], m);
    if (r) return r;
    for (size_t j = 0; j < 4 * rows; j++) out[j] = 0;
    tlsphi_closed_moment(plan, a, A);
    for (size_t j = 0; j < D * D; j++) /* (V I - T) (sum w d (x) d)^-1; m is V times the inverse */
        for (size_t k = 0; k < D; k++)
            out[4 * (1 + j % D) + j / D] += A[3 * (j / D) + k] * m[D * k + j % D] / (volume * tlsphi_plan_volume(plan, a));
    slack[4] = D == 3 ? h * h : h;
    slack[5] = 2 * tlsphi_plan_volume(plan, a) / volume;
    const double sum = block[0], share = tlsphi_dmin(1, slack[5] / (2 * slack[4] * h));
    const double area = BB > 0 ? TLSPHI_CLOSURE_AREA * sum : 0;
    for (size_t j = 0; j < 3; j++) slack[j] = j < D && BB > 0 ? sqrt(area / BB) * (double)B[j] : 0;
    slack[6] = c->first[i + 1] - c->first[i] <= D + 1 && !plan->desc->particles.moments ? area : 0;
    slack[3] = TLSPHI_CLOSURE_SLACK * c->eased * share * share * sum * h * h;
    block[0] += area / (double)D;
    for (size_t j = 1; j < rows; j++) block[(rows + 1) * j] += slack[3];
    tlsphi_closure_invert(rows, block);
    for (size_t j = 0; j < rows * rows; j++) c->block[i][4 * (j / rows) + j % rows] = (float)block[j];
    return TLSPH_OK;
}
/* Neighbour lists in grid order, with w and d in units of the spacing. */
static tlsph_result tlsphi_closure_lists(tlsphi_closer *c, uint32_t *sorted, uint32_t *parent, uint32_t *list, double *g) {
    tlsphi_plan *plan = c->plan;
    const size_t D = (size_t)plan->dim;
    for (size_t i = 0; i < c->n; i++) sorted[plan->grid.order[i]] = (uint32_t)i;
    for (size_t i = 0; i < c->n; i++) {
        const size_t a = plan->grid.order[i], count = tlsphi_kernel_neighbours(plan, a, list, g);
        size_t at = c->first[i];
        for (size_t k = 0; k < count; k++) {
            double d[3], rr = 0, gd = 0;
            tlsphi_difference(plan, a, list[k], d);
            for (size_t j = 0; j < D; j++) {
                rr += d[j] * d[j];
                gd += g[D * k + j] * d[j];
            }
            if (rr <= 1e-18 * plan->h * plan->h)
                return tlsphi_plan_fail(plan, TLSPH_ERROR_DUPLICATE, "same place as particle", a, (double)list[k], 0,
                                        "distinct positions");
            c->list[at] = sorted[list[k]];
            c->pair[at][0] = (float)(gd / rr / pow(c->unit, (double)D - 2));
            for (size_t j = 0; j < D; j++) c->pair[at][1 + j] = (float)(d[j] / c->unit);
            tlsphi_join(parent, (uint32_t)a, list[k]);
            at++;
        }
        c->first[i + 1] = at;
    }
    return TLSPH_OK;
}
/* Each connected part must have a closed surface around its volume: sum B = 0, sum B.X = D V. */
static tlsph_result tlsphi_closure_parts(tlsphi_closer *c, uint32_t *parent, double *sums) {
    tlsphi_plan *plan = c->plan;
    const tlsph_particles *p = &plan->desc->particles;
    memset(sums, 0, 6 * c->n * sizeof *sums);
    for (size_t a = 0; a < c->n; a++) {
        double *s = sums + 6 * tlsphi_root(parent, (uint32_t)a), BB = 0;
        for (int k = 0; k < plan->dim; k++) {
            const double B = (double)p->areas[3 * a + (size_t)k];
            s[k] += B;
            s[3] += B * ((double)p->positions[3 * a + (size_t)k] - plan->grid.low[k]);
            if (p->moments) s[3] += (double)p->moments[9 * a + 4 * (size_t)k];
            BB += B * B;
        }
        s[4] += sqrt(BB);
        s[5] += plan->dim * tlsphi_plan_volume(plan, a);
    }
    for (size_t a = 0; a < c->n; a++) {
        const double *s = sums + 6 * a, open = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
        if (parent[a] != a) continue;
        if (!(s[4] > 0))
            return tlsphi_plan_fail(plan, TLSPH_ERROR_NEIGHBOURS, "surface of its connected part", a, s[4], 0,
                                    "more than 0: give `areas` on the surface, or raise `support` if it is a splinter");
        if (!(open <= 1e-4 * s[4]))
            return tlsphi_plan_fail(plan, TLSPH_ERROR_NEIGHBOURS, "sum of the areas of its connected part over their size",
                                    a, open / s[4], 1e-4, "0: a closed surface; or raise `support` if the part is cut off");
        if (s[3] > 0 && fabs(s[3] - s[5]) > 0.25 * c->unit * s[4])
            return tlsphi_plan_fail(plan, TLSPH_ERROR_SURFACE, "distance of the surface from its particles in spacings", a,
                                    fabs(s[3] - s[5]) / (c->unit * s[4]), 0.25,
                                    "0: particles on the surface, not behind it, or with `moments` (tlsph_voronoi)");
        if (!(fabs(s[3] / s[5] - 1) < 0.3))
            return tlsphi_plan_fail(plan, TLSPH_ERROR_VOLUME, "sum of B.X over D V of its connected part", a, s[3] / s[5],
                                    1, "about 1: areas outward, of the same body as the volumes");
    }
    return TLSPH_OK;
}
/* The start in x, and its residual. */
static tlsph_result tlsphi_closure_start(tlsphi_closer *c) {
    const size_t D = (size_t)c->plan->dim, rows = c->rows;
    const double volume = pow(c->unit, (double)D);
    for (size_t i = 0; i < c->n; i++) {
        const tlsph_result r = tlsphi_closure_particle(c, i, c->p + 4 * rows * i);
        if (r) return r;
    }
    tlsphi_closure_run(c, tlsphi_closure_product_task, NULL);
    for (size_t i = 0; i < c->n; i++) {
        const double *p = c->p + 4 * rows * i, *q = c->q + 4 * rows * i;
        double A[9];
        tlsphi_closed_moment(c->plan, c->plan->grid.order[i], A);
        for (size_t j = 0; j < 4 * rows; j++) /* slack holds for the change from the start */
            c->r[4 * rows * i + j] = j < 4 ? tlsphi_closure_open(c, i, j)
                                           : (j % 4 < D ? 2 * A[3 * (j % 4) + j / 4 - 1] / volume : 0) - q[j] +
                                                 c->slack[i][3] * p[j];
    }
    memcpy(c->x, c->p, 4 * rows * c->n * sizeof *c->x);
    return TLSPH_OK;
}
/* From the first solution to the second, if linear fields need it: what slack is given up is residual then. */
static tlsph_result tlsphi_closure_tighten(tlsphi_closer *c) {
    const int tight = c->plan->desc->tight_closure;
    double worst = 0, residual = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < c->n; i++) {
            const size_t at = 4 * c->rows * i;
            double start[16], before = c->slack[i][3];
            const tlsph_result r = tlsphi_closure_particle(c, i, start);
            if (r) return r;
            for (size_t j = 4; j < 4 * c->rows; j++) {
                const double change = c->x[at + j] - start[j];
                worst = tlsphi_dmax(worst, before * fabs(change) / c->slack[i][5]);
                c->r[at + j] += (before - c->slack[i][3]) * change;
            }
        }
        if (!tight && !(worst > TLSPHI_CLOSURE_DEFECT)) return TLSPH_OK;
        c->eased = tight ? 0.01 : 0.1;
    }
    return tlsphi_closure_iterate(c, tight ? TLSPHI_CLOSURE_TIGHT : TLSPHI_CLOSURE_LIMIT, &residual);
}
/* C_ab in the host's order; how far it is from the start (in p), and how well the conditions hold. */
static void tlsphi_closure_store(tlsphi_closer *c, size_t *first, uint32_t *list, double *C) {
    tlsphi_plan *plan = c->plan;
    tlsph_closure *report = &plan->closure;
    const size_t D = (size_t)plan->dim, width = 4 * c->rows;
    const double area = pow(c->unit, (double)D - 1);
    double start_sum = 0;
    for (size_t i = 0; i < c->n; i++) {
        first[plan->grid.order[i] + 1] = c->first[i + 1] - c->first[i];
        tlsphi_closure_particle(c, i, c->p + width * i);
    }
    for (size_t a = 0; a < c->n; a++) first[a + 1] += first[a];
    for (size_t i = 0; i < c->n; i++) {
        const size_t a = plan->grid.order[i];
        double sum[16] = {0}, A[9];
        for (size_t k = c->first[i], at = first[a]; k < c->first[i + 1]; k++, at++) {
            const double *x[2] = {c->x + width * i, c->x + width * c->list[k]};
            const double *p[2] = {c->p + width * i, c->p + width * c->list[k]};
            double change = 0, size = 0;
            list[at] = plan->grid.order[c->list[k]];
            for (size_t j = 0; j < D; j++) {
                double X = x[0][j] - x[1][j], start = 0;
                for (size_t l = 1; l <= D; l++) {
                    X += (x[0][4 * l + j] + x[1][4 * l + j]) * (double)c->pair[k][l];
                    start += (p[0][4 * l + j] + p[1][4 * l + j]) * (double)c->pair[k][l];
                }
                X *= (double)c->pair[k][0];
                start *= (double)c->pair[k][0];
                change += (X - start) * (X - start);
                size += start * start;
                C[D * at + j] = X * area;
                sum[j] += X;
                for (size_t l = 1; l <= D; l++) sum[4 * l + j] += X * (double)c->pair[k][l];
            }
            start_sum += sqrt(size);
            report->change_mean += sqrt(change);
            report->change_largest = tlsphi_dmax(report->change_largest, sqrt(change));
        }
        tlsphi_closed_moment(plan, a, A);
        for (size_t j = 0; j < D; j++) {
            const double B = (double)plan->desc->particles.areas[3 * a + j] / area;
            report->closing = tlsphi_dmax(report->closing, fabs(sum[j] + B) / c->slack[i][4]);
            for (size_t l = 0; l < D; l++)
                report->linear = tlsphi_dmax(report->linear, fabs(sum[4 * (l + 1) + j] / c->slack[i][5] -
                                                                  A[3 * j + l] / tlsphi_plan_volume(plan, a)));
        }
    }
    report->change_largest *= (double)plan->pairs / start_sum;
    report->change_mean /= start_sum;
}
static tlsph_result tlsphi_closure_solve(tlsphi_plan *plan, uint32_t *parent, uint32_t *list, double *g) {
    tlsphi_closer closer, *c = &closer;
    tlsph_result r;
    const size_t n = plan->n, D = (size_t)plan->dim;
    memset(c, 0, sizeof *c);
    c->plan = plan;
    c->n = n;
    c->rows = D + 1;
    c->tasks = (n + TLSPHI_CLOSURE_BLOCK - 1) / TLSPHI_CLOSURE_BLOCK;
    c->eased = 1;
    c->unit = plan->h / (double)plan->desc->support;
    uint32_t *sorted = TLSPHI_SCRATCH(plan, uint32_t, n), *host_list = TLSPHI_SCRATCH(plan, uint32_t, plan->pairs);
    size_t *host_first = TLSPHI_SCRATCH(plan, size_t, n + 1);
    double *C = TLSPHI_SCRATCH(plan, double, D *plan->pairs);
    c->first = TLSPHI_SCRATCH(plan, size_t, n + 1);
    c->list = TLSPHI_SCRATCH(plan, uint32_t, plan->pairs);
    c->pair = (float (*)[4])tlsphi_scratch_take(plan, plan->pairs, sizeof *c->pair);
    double **const vectors[4] = {&c->x, &c->r, &c->p, &c->q};
    for (int i = 0; i < 4; i++) *vectors[i] = TLSPHI_SCRATCH(plan, double, 4 * c->rows *n);
    c->block = (float (*)[16])tlsphi_scratch_take(plan, n, sizeof *c->block);
    c->slack = (double (*)[7])tlsphi_scratch_take(plan, n, sizeof *c->slack);
    c->sums = TLSPHI_SCRATCH(plan, double, 2 * c->tasks);
    if (!sorted || !host_list || !host_first || !C || !c->first || !c->list || !c->pair || !c->x || !c->r || !c->p || !c->q ||
        !c->block || !c->slack || !c->sums)
        return tlsphi_no_memory(plan, 640.0 * (double)n + 48.0 * (double)plan->pairs);
    if ((r = tlsphi_closure_lists(c, sorted, parent, list, g)) || (r = tlsphi_closure_parts(c, parent, c->p)) ||
        (r = tlsphi_closure_start(c)) || (r = tlsphi_closure_iterate(c, TLSPHI_CLOSURE_LIMIT, &plan->closure.residual)) ||
        (r = tlsphi_closure_tighten(c)) || (r = tlsphi_closure_balance(c, parent, 0)))
        return r;
    tlsphi_closure_store(c, host_first, host_list, C);
    plan->closed_first = host_first;
    plan->closed_list = host_list;
    plan->closed_C = C;
    return TLSPH_OK;
}

/* ==== [MATERIALS] ==================================================================================================
   Every law is a pair of potentials at the reference temperature: e_R and eta_R (000-19, 22). Then
     theta = theta_R + (E - p.p/(2 rho) - e_R)/c_v   or   theta_R exp((eta - eta_R)/c_v)               (000-20, 23)
     Sigma_X = d e_R/dX - theta d eta_R/dX   for X = F, H, J, at fixed entropy.
   The built-in laws share one deviatoric energy
     psi(F,H,J) = zeta (J^-2/3 F:F - 3) + gamma (J^-2 (H:H)^3/2 - 3 sqrt 3),   mu = 2 zeta + 3 sqrt 3 gamma,
   and one volumetric energy u(J) = k/2 (J - 1)^2:
     neo-Hookean, Mie-Grueneisen   e_R = psi + u + beta theta_R (J - 1)      eta_R = beta (J^q - 1)/q
     modified entropic elasticity  e_R = beta theta_R (J - 1)                eta_R = (e_R - psi - u)/theta_R
     linear                        psi = mu dev(eps):dev(eps), H = I, J = 1 + tr eps; else Mie-Grueneisen with q = 1
   with beta = c_v Gamma_0 = 3 kappa alpha and k = kappa - beta theta_R (1 - q) (Mie-Grueneisen) or kappa (000-29, 32).

   THE J EQUATION (default, TLSPH_SPLIT). If J is evolved, psi sees F and det F only, u and the thermal terms see J, and
   the drift phi = J - det F costs W(phi) = b0 mu (phi^2/2 + phi^4/(4 phi_c^2)). W cancels in P, because
   dW/dF + dW/dJ H = 0 when H = cof F, and stays in Sigma_J = e_J - theta eta_J + W'. Without W, Sigma_J(I) != 0 lets a
   drift lower the energy and the printed form becomes unstable. */

/* A material's constants as the loops want them. */
typedef struct tlsphi_material {
    tlsph_material_kind kind;
    int entropic, mooney;               /* MEE: psi and u sit in the entropy; gamma is not 0 */
    tlsph_real rho, c_v, theta_R, h;    /* kg/m^3, J/(m^3 K), K, W/(m K) */
    tlsph_real zeta, gamma, k, beta, q; /* Pa, Pa, Pa, Pa/K, 1 */
    tlsph_real mu, kappa;               /* Pa; kappa = k = 0 in the incompressible scheme, which has instead: */
    tlsph_real compressibility;         /* 1/kappa, 1/Pa */
    tlsph_real c_linear;                /* p speed of the undeformed body at constant temperature, m/s */
    tlsph_real yield, hardening, heating; /* Pa, Pa, 1 */
    tlsph_response_fn response;
    void *user;
} tlsphi_material;

static tlsphi_material tlsphi_calibrate(const tlsph_material *m) {
    tlsphi_material out;
    memset(&out, 0, sizeof out);
    out.kind = m->kind;
    out.entropic = m->kind == TLSPH_MEE;
    out.rho = m->density;
    out.c_v = m->density * m->specific_heat;
    out.theta_R = m->reference_temperature;
    out.h = m->conductivity;
    out.mu = m->young / (2 * (1 + m->poisson));
    out.kappa = m->young / (3 * (1 - 2 * m->poisson));
    out.q = m->kind == TLSPH_MIE_GRUNEISEN ? m->gruneisen_exponent : 1;
    out.beta = m->kind == TLSPH_NEO_HOOKEAN || m->kind == TLSPH_USER ? 0 : 3 * out.kappa * m->expansion;
    out.gamma = m->mooney_fraction * out.mu / TLSPHI_R(5.196152422706632); /* 3 sqrt 3 */
    out.mooney = out.gamma != 0;
    out.zeta = (1 - m->mooney_fraction) * out.mu / 2;
    out.k = out.kappa - out.beta * out.theta_R * (1 - out.q);
    out.c_linear = tlsphi_sqrt((out.kappa + 4 * out.mu / 3) / out.rho);
    out.yield = m->yield_stress;
    out.hardening = m->hardening;
    out.heating = m->plastic_heat;
    out.response = m->response;
    out.user = m->response_user;
    return out;
}

/* The deviatoric energy and its derivatives: Sigma_F = a F, Sigma_H = b H, dpsi/dJ = c. */
typedef struct tlsphi_deviator {
    tlsph_real psi, a, b, c, J23, per_J; /* J23 = J^(-2/3) */
} tlsphi_deviator;

TLSPHI_INLINE tlsphi_deviator tlsphi_deviatoric(const tlsphi_material *m, tlsph_real I1, tlsph_real I2, tlsph_real J) {
    tlsphi_deviator out;
    const tlsph_real root = tlsphi_inverse_cube_root(J), J23 = root * root;
    out.J23 = J23;
    out.per_J = J23 * root;
    out.psi = m->zeta * (J23 * I1 - 3);
    out.a = 2 * m->zeta * J23;
    out.b = 0;
    out.c = -out.a * I1 * out.per_J * TLSPHI_R(1.0 / 3.0);
    if (m->mooney) {
        const tlsph_real root2 = tlsphi_square_root(I2), J2 = out.per_J * out.per_J;
        out.psi += m->gamma * (J2 * I2 * root2 - TLSPHI_R(5.196152422706632));
        out.b = 3 * m->gamma * J2 * root2;
        out.c -= 2 * m->gamma * J2 * I2 * root2 * out.per_J;
    }
    return out;
}

/* Upper bound of the largest eigenvalue of the acoustic tensor of psi + u over all directions, Pa.
   For a direction N put f = F N, h = H N (then f.h = J) and r = H H^T h. The acoustic tensor is
     2 zeta J^-2/3 [I - 2/(3J) (f h + h f) + 5 I1/(9J^2) h h] + k h h
     + 3 gamma J^-2 sqrt(I2) S + 3 gamma J^-4/sqrt(I2) [(I2 h + r)(I2 h + r) - 2 I2^2 h h],
   where S is the form |F x (m (x) N)|^2 of m.
   In the basis (h/|h|, across) each entry is bounded by the largest and smallest principal stretches, which follow from
   the invariants; the 2x2 eigenvalue is then a bound. It is exact at F = I, where dropping the mixed terms would give
   kappa + 8/3 mu instead of kappa + 4/3 mu. */
typedef struct tlsphi_invariants {
    tlsph_real I1, I2, J;  /* F:F, H:H, det F */
    tlsph_real L1, LH, l3; /* bounds: largest eigenvalue of F^T F and of H^T H, least of F^T F */
} tlsphi_invariants;

TLSPHI_INLINE tlsphi_invariants tlsphi_principal_bounds(tlsph_real I1, tlsph_real I2, tlsph_real J) {
    tlsphi_invariants s;
    s.I1 = I1;
    s.I2 = I2;
    s.J = J;
    s.L1 = tlsphi_largest_bound(I1, I1 * I1 - 2 * I2);         /* tr C^2 = I1^2 - 2 I2 */
    s.LH = tlsphi_largest_bound(I2, I2 * I2 - 2 * J * J * I1); /* the same for cof C */
    s.l3 = J * J / s.LH;
    return s;
}
TLSPHI_INLINE tlsph_real tlsphi_acoustic_bound(const tlsphi_material *m, const tlsphi_deviator *dev,
                                        const tlsphi_invariants *s) {
    /* of J^(-1/3) F, whatever the size of J: I1, largest of H^T H, largest over least stretch and its inverse */
    const tlsph_real I1 = s->I1 * dev->J23, LH = s->LH * dev->J23 * dev->J23, square = s->L1 * dev->J23 * LH;
    const tlsph_real inverse = tlsphi_inverse_root(square), ratio = square * inverse;
    tlsph_real along = dev->a * (TLSPHI_R(5.0 / 9.0) * I1 * LH - TLSPHI_R(1.0 / 3.0)) + m->k * s->LH;
    tlsph_real across = dev->a, mixed = dev->a * (ratio - inverse) * TLSPHI_R(1.0 / 3.0);
    if (m->mooney) {
        const tlsph_real factor = dev->b * dev->per_J * dev->per_J / s->I2; /* 3 gamma J^-4 / sqrt I2 */
        const tlsph_real least = s->J * s->J / s->L1;             /* of H^T H */
        const tlsph_real half = (s->LH - least) / 2, sum = s->I2 + s->LH;
        const tlsph_real bracket = sum * sum - 2 * s->I2 * s->I2;
        along += dev->b * (s->I1 - s->l3) + factor * bracket * (bracket > 0 ? s->LH : least);
        across += dev->b * s->L1 + factor * half * half * s->LH;
        mixed += dev->b * (s->L1 - s->l3) / 2 + factor * s->LH * sum * half;
    }
    return (along + across + tlsphi_square_root((along - across) * (along - across) + 4 * mixed * mixed)) / 2;
}
/* MEE: bound of |d eta_R/dF N|^2, by which coupling stiffens the isentropic wave. With the vectors above,
   d eta_R/dF N = (beta theta_R h - P_psi N)/theta_R = c_h h + c_f f + c_r r. */
TLSPHI_INLINE tlsph_real tlsphi_entropic_coupling(const tlsphi_material *m, const tlsphi_deviator *dev,
                                           const tlsphi_invariants *s) {
    const tlsph_real per_theta = 1 / m->theta_R, third = TLSPHI_R(1.0 / 3.0);
    const tlsph_real mooney = dev->b * s->I2 * dev->per_J; /* 3 gamma J^-3 I2^3/2 */
    const tlsph_real volumetric = m->k * (s->J - 1) - dev->a * s->I1 * dev->per_J * third + mooney * third;
    const tlsph_real c_h = m->beta - volumetric * per_theta, c_f = -dev->a * per_theta;
    const tlsph_real c_r = dev->b * dev->per_J * per_theta, least = s->J * s->J / s->L1;
    tlsph_real largest = 0;
    for (int end = 0; end < 2; end++) {
        const tlsph_real c = c_h + c_r * (end ? s->LH : least);
        largest = tlsphi_max(largest, c * c * s->LH + 2 * c * c_f * s->J + c_f * c_f * s->L1);
    }
    const tlsph_real norm = tlsphi_square_root(largest) + c_r * tlsphi_square_root(s->LH) * (s->LH - least) / 2;
    return norm * norm;
}

/* Whether the deviatoric energy is one of the invariants of F and H above, with a, b, c. */
static int tlsphi_has_invariants(tlsph_material_kind kind) {
    return kind != TLSPH_LINEAR && kind != TLSPH_VON_MISES && kind != TLSPH_USER;
}
/* Bounds rho c^2 = [0] + theta [1]. J here is det F; with `coupled` = 0 the isothermal p speed. */
TLSPHI_INLINE void tlsphi_moduli(const tlsphi_material *m, const tlsphi_deviator *dev, const tlsphi_invariants *s, int coupled,
                          tlsph_response *out) {
    const tlsph_real elastic = tlsphi_acoustic_bound(m, dev, s);
    const tlsph_real shear = dev->a + dev->b * s->I1 * TLSPHI_R(1.0 / 3.0);
    const tlsph_real per_theta = 1 / m->theta_R, per_c_v = 1 / m->c_v; /* isothermal scenes may have no c_v */
    if (m->entropic) {
        out->p_modulus[0] = out->s_modulus[0] = 0;
        out->p_modulus[1] = elastic * per_theta;
        out->p_modulus[1] += tlsphi_choose(coupled, tlsphi_entropic_coupling(m, dev, s) * per_c_v, 0);
        out->s_modulus[1] = shear * per_theta;
        return;
    }
    const tlsph_real power = m->q == 1 ? 1 : tlsphi_pow(s->J, m->q - 1), gruneisen = m->beta * power; /* d eta_R/dJ */
    tlsph_real thermal = m->beta * (1 - m->q) * power * dev->per_J;
    thermal += tlsphi_choose(coupled, gruneisen * gruneisen * per_c_v, 0);
    out->p_modulus[0] = elastic;
    out->p_modulus[1] = thermal * s->LH;
    out->s_modulus[0] = shear;
    out->s_modulus[1] = 0;
}

/* Linear material: psi = mu dev(eps):dev(eps). */
static void tlsphi_respond_linear(const tlsphi_material *m, const tlsph_real *F, tlsph_real J, int coupled,
                                  tlsph_response *out, tlsphi_deviator *dev) {
    const tlsph_real third = (F[0] + F[4] + F[8]) / 3 - 1;
    tlsph_real square = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const tlsph_real e = (F[3 * i + j] + F[3 * j + i]) / 2 - (i == j ? 1 + third : 0);
            out->e_F[3 * i + j] = 2 * m->mu * e;
            square += e * e;
        }
    memset(out->eta_F, 0, sizeof out->eta_F);
    memset(dev, 0, sizeof *dev);
    dev->psi = m->mu * square;
    out->energy = dev->psi + m->k / 2 * (J - 1) * (J - 1) + m->beta * m->theta_R * (J - 1);
    out->entropy = m->beta * (J - 1);
    out->e_J = m->k * (J - 1) + m->beta * m->theta_R;
    out->eta_J = m->beta;
    out->p_modulus[0] = m->kappa + TLSPHI_R(4.0 / 3.0) * m->mu;
    out->p_modulus[1] = coupled && m->beta != 0 ? m->beta * m->beta / m->c_v : 0;
    out->s_modulus[0] = m->mu;
    out->s_modulus[1] = 0;
}

/* The built-in laws but for e_F and eta_F, with what the deviatoric arguments give, at J. */
TLSPHI_INLINE void tlsphi_respond_scalars(const tlsphi_material *m, const tlsphi_deviator *dev,
                                          const tlsphi_invariants *s, tlsph_real J, int coupled, tlsph_response *out) {
    const tlsph_real u = m->k / 2 * (J - 1) * (J - 1), du = m->k * (J - 1), thermal = m->beta * m->theta_R;
    const tlsph_real per_theta = 1 / m->theta_R; /* once for all lanes: a division a component took half of the time */
    if (m->entropic) {
        out->energy = thermal * (J - 1);
        out->entropy = (out->energy - dev->psi - u) * per_theta;
        out->e_J = thermal;
        out->eta_J = m->beta - du * per_theta;
    } else {
        const tlsph_real power = m->q == 1 ? J : m->q == 0 ? 1 : tlsphi_pow(J, m->q);
        out->energy = dev->psi + u + thermal * (J - 1);
        out->entropy = m->q == 0 ? (m->beta == 0 ? 0 : m->beta * tlsphi_log(J)) : m->beta * (power - 1) / m->q;
        out->e_J = du + thermal;
        out->eta_J = m->q == 1 ? m->beta : m->beta * power / J;
    }
    tlsphi_moduli(m, dev, s, coupled, out);
}
/* The deviatoric part a F + b H x F + c H as e_F, for MEE as -theta_R eta_F. */
TLSPHI_INLINE void tlsphi_respond_tensors(const tlsphi_material *m, const tlsphi_deviator *dev, const tlsph_real *F,
                                          const tlsph_real *H, tlsph_response *out) {
    const tlsph_real per_theta = 1 / m->theta_R;
    tlsph_real S[9];
    TLSPHI_UNROLL for (int i = 0; i < 9; i++) S[i] = dev->a * F[i] + dev->c * H[i];
    if (m->mooney) {
        tlsph_real HxF[9];
        tlsphi_cross_inline(H, F, HxF);
        TLSPHI_UNROLL for (int i = 0; i < 9; i++) S[i] += dev->b * HxF[i];
    }
    TLSPHI_UNROLL for (int i = 0; i < 9; i++) {
        out->e_F[i] = m->entropic ? 0 : S[i];
        out->eta_F[i] = m->entropic ? -S[i] * per_theta : 0;
    }
}
static void tlsphi_respond(const tlsphi_material *m, const tlsph_real *F, const tlsph_real *H, tlsph_real Jd,
                           tlsph_real J, int coupled, tlsph_response *out, tlsphi_deviator *dev) {
    if (m->kind == TLSPH_LINEAR) {
        tlsphi_respond_linear(m, F, J, coupled, out, dev);
        return;
    }
    const tlsph_real I1 = tlsphi_dot(9, F, F), I2 = tlsphi_dot(9, H, H);
    const tlsphi_invariants spread = tlsphi_principal_bounds(I1, I2, Jd);
    *dev = tlsphi_deviatoric(m, I1, I2, Jd);
    tlsphi_respond_scalars(m, dev, &spread, J, coupled, out);
    tlsphi_respond_tensors(m, dev, F, H, out);
}

/* W(phi)/(b0 mu), W' and W'' of the drift potential. */
TLSPHI_INLINE void tlsphi_drift(tlsph_real phi, tlsph_real scale, tlsph_real *W, tlsph_real *dW, tlsph_real *ddW) {
    const tlsph_real per_square = 1 / (scale * scale), s2 = phi * phi * per_square;
    *W = phi * phi * (TLSPHI_R(0.5) + TLSPHI_R(0.25) * s2);
    *dW = phi * (1 + s2);
    *ddW = 1 + 3 * s2;
}

/* ==== [PLASTICITY] =================================================================================================
   Von Mises plasticity with linear isotropic hardening on Hencky's elasticity (001 Algorithm 2). The inverse plastic
   right Cauchy-Green tensor C_p^-1 gives the elastic b = F C_p^-1 F^T; with its principal logarithmic strains e_i, less
   their mean,
     e_R = mu sum e_i^2 + kappa/2 (ln J)^2 + beta theta_R ln J (+ stored plastic work)      eta_R = beta ln J
     P = tau' F^-T + p H,   tau'_i = 2 mu e_i,   p = kappa ln J / J - beta (theta - theta_R)/J
   so that the split of the J equation holds: tau' sees F, the volumetric terms see J. Where tau = sqrt(3/2 tau':tau')
   is above yield + hardening x plastic strain, the flow shrinks e_i by one factor: that is the whole return map, in closed
   form. It starts from the values at the beginning of the step in every stage, so that the last stage decides.

   Plastic work is a function of the plastic strain, w = yield eps + hardening eps^2/2. Isothermal scenes lose it. In
   thermal scenes the share `plastic_heat` becomes heat, the rest is stored (e_R). With the total energy E this needs no
   source: the temperature follows from E less what is stored. The entropy so made is kept with the state. */

typedef struct tlsphi_plastic {
    tlsph_real C[9]; /* C_p^-1 */
    tlsph_real strain, entropy; /* equivalent plastic strain; entropy made by plastic heat, J/(m^3 K) */
} tlsphi_plastic;

static const tlsphi_plastic tlsphi_virgin = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, 0, 0};

TLSPHI_INLINE tlsph_real tlsphi_plastic_work(const tlsphi_material *m, tlsph_real strain) {
    return strain * (m->yield + m->hardening * strain / 2);
}
/* Symmetric tensors here are their entries 11, 22, 33, 12, 13, 23, in double also for float: a yield strain is a few
   thousandths. Their places among all nine; and all nine: */
static const int tlsphi_symmetric_slot[6] = {0, 4, 8, 1, 2, 5};
static void tlsphi_symmetric_expand(const double S[6], double out[9]) {
    static const int slot[9] = {0, 3, 4, 3, 1, 5, 4, 5, 2};
    for (int i = 0; i < 9; i++) out[i] = S[slot[i]];
}
/* X : X/2 of a symmetric tensor. */
TLSPHI_INLINE double tlsphi_half_square(const double X[6]) {
    return (X[0] * X[0] + X[1] * X[1] + X[2] * X[2]) / 2 + X[3] * X[3] + X[4] * X[4] + X[5] * X[5];
}
/* a I + b X + c X^2, of which `part` holds a, b, c, times X, plus `add` I. */
TLSPHI_INLINE void tlsphi_times_and_add(double square, double third, double add, double part[3]) {
    const double linear = part[0] + square * part[2];
    part[0] = third * part[2] + add;
    part[2] = part[1];
    part[1] = linear;
}
/* out = ln(I + X) or exp X - I for a small symmetric X without trace, by twelve terms of the power series. Its powers
   stay in the span of I, X and X^2 (Cayley-Hamilton: X^3 = tr X^2/2 X + det X I), so that Horner's scheme takes three
   numbers. */
#define TLSPHI_SMALL 0.03 /* largest (X : X/2)^(1/2): 0.05^13 is below round-off */
TLSPHI_INLINE void tlsphi_power_series(const int exponential, const double X[6], double out[6]) {
    static const double logarithm[12] = {1, -1. / 2, 1. / 3, -1. / 4, 1. / 5, -1. / 6, 1. / 7, -1. / 8, 1. / 9, -1. / 10,
                                         1. / 11, -1. / 12};
    static const double exponential_of[12] = {1, 1. / 2, 1. / 6, 1. / 24, 1. / 120, 1. / 720, 1. / 5040, 1. / 40320,
                                              1. / 362880, 1. / 3628800, 1. / 39916800, 1. / 479001600};
    const double *weight = exponential ? exponential_of : logarithm, square = tlsphi_half_square(X);
    const double XX[6] = {X[0] * X[0] + X[3] * X[3] + X[4] * X[4], X[3] * X[3] + X[1] * X[1] + X[5] * X[5],
                          X[4] * X[4] + X[5] * X[5] + X[2] * X[2], X[0] * X[3] + X[3] * X[1] + X[4] * X[5],
                          X[0] * X[4] + X[3] * X[5] + X[4] * X[2], X[3] * X[4] + X[1] * X[5] + X[5] * X[2]};
    const double third = X[0] * (X[1] * X[2] - X[5] * X[5]) + X[3] * (X[5] * X[4] - X[3] * X[2]) +
                         X[4] * (X[3] * X[5] - X[1] * X[4]);
    double part[3] = {0, 0, 0}; /* of I, X and X^2 */
    TLSPHI_UNROLL for (int k = 12; k > 6; k--) tlsphi_times_and_add(square, third, weight[k - 1], part); /* two loops, as */
    TLSPHI_UNROLL for (int k = 6; k > 0; k--) tlsphi_times_and_add(square, third, weight[k - 1], part); /* 9 are unrolled */
    tlsphi_times_and_add(square, third, 0, part);
    TLSPHI_UNROLL for (int i = 0; i < 6; i++) out[i] = (i < 3 ? part[0] : 0) + part[1] * X[i] + part[2] * XX[i];
}
/* The same for any X, from its eigenvalues, which Jacobi rotations find without ever dividing by a difference of them. */
static void tlsphi_spectral_function(int exponential, const double X[6], double out[6]) {
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    double D[9], Q[9];
    tlsphi_symmetric_expand(X, D);
    for (int i = 0; i < 9 && !exponential; i += 4) D[i] += 1;
    tlsphi_eigen(D, Q);
    for (int i = 0; i < 6; i++) out[i] = 0;
    for (int k = 0; k < 3; k++) {
        const double value = exponential ? exp(D[4 * k]) - 1 : log(D[4 * k]);
        for (int i = 0; i < 6; i++) out[i] += value * Q[3 * row[i] + k] * Q[3 * column[i] + k];
    }
}
static void tlsphi_symmetric_function(int exponential, const double X[6], double out[6]) {
    if (tlsphi_half_square(X) > TLSPHI_SMALL * TLSPHI_SMALL) tlsphi_spectral_function(exponential, X, out);
    else if (exponential) tlsphi_power_series(1, X, out);
    else tlsphi_power_series(0, X, out);
}

/* Deviator e of the logarithmic elastic strain ln(b)/2 and (3/2 e:e)^(1/2), so that tau = 2 mu size. */
typedef struct tlsphi_elastic {
    double e[6], size;
} tlsphi_elastic;
/* X = b/(tr b/3) - I of b = F C_p^-1 F^T. */
TLSPHI_INLINE void tlsphi_elastic_left(const double F[9], const double C[6], double X[6]) {
    double FC[9], b[6];
    TLSPHI_UNROLL for (int i = 0; i < 9; i += 3) {
        FC[i] = F[i] * C[0] + F[i + 1] * C[3] + F[i + 2] * C[4];
        FC[i + 1] = F[i] * C[3] + F[i + 1] * C[1] + F[i + 2] * C[5];
        FC[i + 2] = F[i] * C[4] + F[i + 1] * C[5] + F[i + 2] * C[2];
    }
    TLSPHI_UNROLL for (int i = 0; i < 3; i++)
        b[i] = FC[3 * i] * F[3 * i] + FC[3 * i + 1] * F[3 * i + 1] + FC[3 * i + 2] * F[3 * i + 2];
    b[3] = FC[0] * F[3] + FC[1] * F[4] + FC[2] * F[5];
    b[4] = FC[0] * F[6] + FC[1] * F[7] + FC[2] * F[8];
    b[5] = FC[3] * F[6] + FC[4] * F[7] + FC[5] * F[8];
    const double per_mean = 3 / (b[0] + b[1] + b[2]);
    TLSPHI_UNROLL for (int i = 0; i < 6; i++) X[i] = b[i] * per_mean - (i < 3 ? 1 : 0);
}
/* e from ln b; square = 3/2 e:e. */
TLSPHI_INLINE void tlsphi_elastic_deviator(double e[6], double *square) {
    const double third = (e[0] + e[1] + e[2]) / 3;
    TLSPHI_UNROLL for (int i = 0; i < 6; i++) e[i] = (e[i] - (i < 3 ? third : 0)) / 2;
    *square = 3 * tlsphi_half_square(e);
}
static void tlsphi_elastic_strain(const tlsph_real *F, const tlsphi_plastic *plastic, tlsphi_elastic *out) {
    double F_d[9], C[6], X[6], square;
    for (int i = 0; i < 9; i++) F_d[i] = (double)F[i];
    for (int i = 0; i < 6; i++) C[i] = (double)plastic->C[tlsphi_symmetric_slot[i]];
    tlsphi_elastic_left(F_d, C, X);
    tlsphi_symmetric_function(0, X, out->e);
    tlsphi_elastic_deviator(out->e, &square);
    out->size = sqrt(square);
}

/* The elastic response. Bound of the acoustic tensor: with the current normal n = F^-T N, m the direction of motion and
   c = m.n/|n|, the form is |n|^2 [(kappa (1 - ln J) - beta (theta_R - theta)) c^2 + 2 mu f (1/2 + c^2/6) + g]. Here
   f = x coth x <= 1 + x^2/3, x <= tau/(sqrt 3 mu) the largest difference of the elastic log strains, is what finite
   strains add to the moduli, and g <= 4/3 tau what the stress itself does; |n|^2 is at most L_H/J^2. */
static void tlsphi_respond_von_mises(const tlsphi_material *m, const tlsph_real *F, tlsph_real d, tlsph_real J,
                                     int coupled, const tlsphi_elastic *elastic, tlsph_response *out) {
    double e[9];
    tlsph_real tensor[9], H[9];
    const tlsph_real tau = (tlsph_real)(2 * (double)m->mu * elastic->size);
    tlsphi_symmetric_expand(elastic->e, e);
    const tlsph_real log_J = tlsphi_log(J), pull = m->beta * m->theta_R;
    for (int i = 0; i < 9; i++) tensor[i] = (tlsph_real)(2 * (double)(m->mu / d) * e[i]);
    tlsph_cofactor(F, H);
    tlsphi_product(3, tensor, H, out->e_F); /* tau' F^-T */
    memset(out->eta_F, 0, sizeof out->eta_F);
    out->energy = tau * tau / (6 * m->mu) + log_J * (m->kappa * log_J / 2 + pull);
    out->entropy = m->beta * log_J;
    out->e_J = (m->kappa * log_J + pull) / J;
    out->eta_J = m->beta / J;
    const tlsph_real L = tlsphi_principal_bounds(tlsphi_dot(9, F, F), tlsphi_dot(9, H, H), d).LH, dd = L / (d * d);
    const tlsph_real shear = m->mu * (1 + tau * tau / (9 * m->mu * m->mu)), own = TLSPHI_R(4.0 / 3.0) * tau;
    out->p_modulus[0] = (tlsphi_max(m->kappa * (1 - log_J), 0) - pull) * L / (J * J) +
                        (TLSPHI_R(4.0 / 3.0) * shear + own) * dd;
    out->p_modulus[1] = m->beta * (1 + (coupled && m->beta != 0 ? m->beta / m->c_v : 0)) * L / (J * J);
    out->s_modulus[0] = (shear + own) * dd;
    out->s_modulus[1] = 0;
}

/* Lets C_p^-1 and the plastic strain flow until F is admissible. Returns 1 if it had to. */
static int tlsphi_return_map(const tlsphi_material *m, const tlsph_real *F, tlsph_real d, const tlsphi_elastic *elastic,
                             tlsphi_plastic *plastic) {
    double twice_e[6], exponential[6], b[9];
    const double tau = 2 * (double)m->mu * elastic->size;
    const double excess = tau - (double)(m->yield + m->hardening * plastic->strain);
    if (!(excess > 0) || !(tau < TLSPHI_LARGEST)) return 0;
    const double flow = excess / (3 * (double)m->mu + (double)m->hardening);
    const double keep = 1 - 3 * (double)m->mu * flow / tau, root = (double)tlsphi_inverse_cube_root(d);
    const double scale = root * root * root * root; /* b has the volume of F: J^2/3, and 1/J^2 for both F^-1 = H^T/J */
    tlsph_real H[9], bH[9], left[9];
    for (int i = 0; i < 6; i++) twice_e[i] = 2 * keep * elastic->e[i];
    tlsphi_symmetric_function(1, twice_e, exponential);
    tlsphi_symmetric_expand(exponential, b);
    for (int i = 0; i < 9; i++) left[i] = (tlsph_real)(scale * (b[i] + (i % 4 ? 0 : 1)));
    tlsph_cofactor(F, H);
    tlsphi_product(3, left, H, bH);
    for (int i = 0; i < 9; i++)
        plastic->C[i] = H[i / 3] * bH[i % 3] + H[3 + i / 3] * bH[3 + i % 3] + H[6 + i / 3] * bH[6 + i % 3];
    plastic->strain += (tlsph_real)flow;
    return 1;
}

/* In the state: the different entries of C_p^-1 (plane strain: four), plastic strain, in thermal scenes the entropy. */
static size_t tlsphi_plastic_reals(int dim, int thermal) { return (dim == 3 ? 7u : 5u) + (thermal ? 1u : 0u); }
static void tlsphi_load_plastic(int dim, int thermal, const tlsph_real *at, tlsphi_plastic *out) {
    const int entries = dim == 3 ? 6 : 4;
    static const int mirrored[6] = {0, 4, 8, 3, 6, 7};
    *out = tlsphi_virgin;
    for (int k = 0; k < entries; k++) out->C[tlsphi_symmetric_slot[k]] = out->C[mirrored[k]] = at[k];
    out->strain = at[entries];
    if (thermal) out->entropy = at[entries + 1];
}
static void tlsphi_store_plastic(int dim, int thermal, const tlsphi_plastic *plastic, tlsph_real *at) {
    const int entries = dim == 3 ? 6 : 4;
    for (int k = 0; k < entries; k++) at[k] = plastic->C[tlsphi_symmetric_slot[k]];
    at[entries] = plastic->strain;
    if (thermal) at[entries + 1] = plastic->entropy;
}

/* The first constant out of range, or NULL. */
static const char *tlsphi_material_fault(const tlsph_material *m, int thermal, int incompressible, double *value,
                                         const char **allowed) {
    const struct {
        const char *name;
        tlsph_real value;
        double low, high;
        int open_low, open_high;
        const char *allowed;
    } range[] = {
        {"density", m->density, 0, TLSPHI_LARGEST, 1, 1, "more than 0"},
        {"young", m->young, 0, TLSPHI_LARGEST, 1, 1, "more than 0"},
        {"poisson", m->poisson, -1, 0.5, 1, !incompressible,
         "between -1 and 0.5, both excluded; 0.5 with TLSPH_INCOMPRESSIBLE"},
        {"expansion", m->expansion, 0, TLSPHI_LARGEST, 0, 1, "0 or more"},
        {"conductivity", m->conductivity, 0, TLSPHI_LARGEST, 0, 1, "0 or more"},
        {"reference_temperature", m->reference_temperature, 0, TLSPHI_LARGEST, 1, 1, "more than 0"},
        {"gruneisen_exponent", m->gruneisen_exponent, 0, 1, 0, 0, "0 to 1"},
        {"mooney_fraction", m->mooney_fraction, 0, 1, 0, 0, "0 to 1"},
        {"specific_heat", m->specific_heat, 0, TLSPHI_LARGEST, thermal, 1,
         "more than 0 in thermal scenes, else 0 or more"},
        {"yield_stress", m->yield_stress, 0, TLSPHI_LARGEST, m->kind == TLSPH_VON_MISES, 1,
         "more than 0 for TLSPH_VON_MISES"},
        {"hardening", m->hardening, 0, TLSPHI_LARGEST, 0, 1, "0 or more"},
        {"plastic_heat", m->plastic_heat, 0, 1, 0, 0, "0 to 1"},
    };
    for (size_t i = 0; i < sizeof range / sizeof range[0]; i++) {
        const double v = (double)range[i].value;
        const int ok = tlsphi_finite(range[i].value) && (range[i].open_low ? v > range[i].low : v >= range[i].low) &&
                       (range[i].open_high ? v < range[i].high : v <= range[i].high);
        if (ok) continue;
        *value = v;
        *allowed = range[i].allowed;
        return range[i].name;
    }
    *value = (double)m->kind;
    *allowed = "a tlsph_material_kind; TLSPH_USER with a response function";
    if ((unsigned)m->kind > (unsigned)TLSPH_USER || (m->kind == TLSPH_USER && !m->response)) return "kind";
    *allowed = "linear or neo-Hookean with TLSPH_INCOMPRESSIBLE";
    if (incompressible) return m->kind == TLSPH_LINEAR || m->kind == TLSPH_NEO_HOOKEAN ? NULL : "kind";
    const tlsphi_material c = tlsphi_calibrate(m);
    *value = (double)c.k;
    *allowed = "more than 0: kappa - 3 kappa alpha theta_R (1 - q); lower alpha or raise q";
    return c.k > 0 ? NULL : "chi_R";
}

TLSPHI_DEF tlsph_result tlsph_material_evaluate(const tlsph_material *material, const tlsph_real *F, tlsph_real theta,
                                                tlsph_material_state *out) {
    double value;
    const char *allowed;
    if (!material || !F || !out) return TLSPH_ERROR_ARGUMENT;
    if (tlsphi_material_fault(material, 0, 0, &value, &allowed)) return TLSPH_ERROR_MATERIAL;
    if (!tlsphi_all_finite(F, 9) || !tlsphi_finite(theta)) return TLSPH_ERROR_NOT_FINITE;
    if (!(theta > 0)) return TLSPH_ERROR_TEMPERATURE;
    const tlsphi_material m = tlsphi_calibrate(material);
    const int linear = m.kind == TLSPH_LINEAR, coupled = m.c_v > 0;
    tlsph_real H[9], d = tlsph_determinant(F), weight = 1;
    tlsph_response r;
    tlsphi_deviator dev;
    memset(&dev, 0, sizeof dev);
    if (linear) {
        tlsphi_identity(H);
        d = F[0] + F[4] + F[8] - 2;
    } else tlsph_cofactor(F, H);
    if (!(d > 0) && !linear) return TLSPH_ERROR_INVERSION;
    if (m.kind == TLSPH_USER) {
        const uint32_t particle = 0;
        m.response(m.user, 1, &particle, F, &d, &r);
    } else if (m.kind == TLSPH_VON_MISES) {
        tlsphi_elastic elastic;
        tlsphi_elastic_strain(F, &tlsphi_virgin, &elastic);
        tlsphi_respond_von_mises(&m, F, d, d, coupled, &elastic, &r);
    } else {
        tlsphi_respond(&m, F, H, d, d, coupled, &r, &dev);
    }
    if (m.entropic) weight = theta / m.theta_R;
    const tlsph_real p = r.e_J - theta * r.eta_J;
    for (int i = 0; i < 9; i++) {
        const tlsph_real S = r.e_F[i] - theta * r.eta_F[i];
        out->P[i] = S + p * H[i];
        out->Sigma_F[i] = tlsphi_has_invariants(m.kind) ? weight * dev.a * F[i] : S;
        out->Sigma_H[i] = weight * dev.b * H[i];
    }
    out->Sigma_J = p + weight * dev.c;
    out->theta = theta;
    out->eta = r.entropy + (coupled ? m.c_v * tlsphi_log(theta / m.theta_R) : 0);
    out->internal_energy = r.energy + m.c_v * (theta - m.theta_R);
    out->helmholtz = out->internal_energy - theta * out->eta;
    out->c_p = tlsphi_sqrt(tlsphi_max(r.p_modulus[0] + theta * r.p_modulus[1], 0) / m.rho);
    out->c_s = tlsphi_sqrt(tlsphi_max(r.s_modulus[0] + theta * r.s_modulus[1], 0) / m.rho);
    return TLSPH_OK;
}

/* ==== [SOLVER-DATA] ================================================================================================
   All arrays are in the solver's order and lie in one block. D = dimension, DD = D * D. Optional arrays are NULL where
   the scene does not need them. Tasks are blocks of particles of one body; sums are made per block and added in block
   order, so their value does not depend on the threads. Vectors have their components side by side; tensors of the state
   (F, H) and grad v lie by tiles, a component of all its particles side by side, as the loops over lanes take them. */

/* Rows of a block. w is v without the body's rigid motion, as the dissipation sees it (without projection w is v);
   P = P M, as the forces have it, A = H M, slope_w the gradient of w that reconstruction takes; wave (c_p, c_s, rho, with J
   the drift ratio; X and rho are set at creation); heat M^T Q/theta; h_J h/J. Sharp gradients keep the plain P M,
   grad w and grad v beside the sharpened. */
typedef struct tlsphi_rows {
    int v, w, X, P, A, slope_w, wave; /* D, D, D, DD, DD, DD, 3 or 4 */
    int S, slope_S;                   /* 1, D: Sigma_J; with J */
    int theta;                        /* 1; thermal */
    int slope_theta, heat, h_J;       /* D, D, 1; with conduction */
    int PM, grad_w, grad_v;           /* DD, DD, DD side by side; without sharp gradients P, slope_w and none */
    int lap_p;                        /* D; JST */
    int count;
} tlsphi_rows;
enum { TLSPHI_ROWS_MOST = 52 }; /* without those of sharp gradients and JST */

TLSPHI_INLINE tlsphi_rows tlsphi_rows_of(const int dim, const int has_J, int thermal, int conducts, int sharp) {
    tlsphi_rows r;
    const int dd = dim * dim;
    r.v = 0;
    r.w = dim;
    r.X = 2 * dim;
    r.P = 3 * dim;
    r.A = r.P + dd;
    r.slope_w = r.A + dd;
    r.wave = r.slope_w + dd;
    r.S = r.wave + (has_J ? 4 : 3);
    r.slope_S = r.S + 1;
    r.theta = r.S + (has_J ? 1 + dim : 0);
    r.slope_theta = r.theta + (thermal ? 1 : 0);
    r.heat = r.slope_theta + (conducts ? dim : 0);
    r.h_J = r.heat + (conducts ? dim : 0);
    r.count = r.h_J + (conducts ? 1 : 0);
    r.PM = sharp ? r.count : r.P;
    r.grad_w = sharp ? r.count + dd : r.slope_w;
    r.grad_v = r.count + 2 * dd;
    r.count += sharp ? 3 * dd : 0;
    return r;
}

typedef struct tlsphi_state {
    tlsph_real *x, *p, *F; /* D, D, DD by tiles */
    tlsph_real *H, *J, *E; /* DD by tiles, 1, 1 (E or eta); optional */
    tlsph_real *plastic;   /* tlsphi_plastic_reals; optional */
    tlsph_real *q;         /* 1: pressure of the incompressible scheme (tension positive); optional */
} tlsphi_state;

enum {
    TLSPHI_SUM_DISSIPATION, TLSPHI_SUM_DISSIPATION_ENTROPY, TLSPHI_SUM_CONDUCTION_ENTROPY, TLSPHI_SUM_LEAST, TLSPHI_SUMS
};
enum { TLSPHI_MOMENTS = 16 }; /* sums of the projection, see [PROJECTION] */

typedef struct tlsphi_block {
    uint32_t begin, end, body;
    uint32_t tile; /* its first, in a graph */
    uint32_t fronts; /* bit i: tile i had one last time, see tlsphi_flux_tile */
    int level, seen; /* [MULTI-RATE]; bit l: some neighbours have another level l */
    double reached;  /* the time of its x there */
    uint32_t failed; /* first bad particle of the block, or TLSPHI_NONE */
    tlsph_result failure;
    double time_step, heat_step; /* stable step of its particles, s; of conduction alone, where that is split off */
    double sums[TLSPHI_SUMS];
    double moments[TLSPHI_MOMENTS];
} tlsphi_block;

typedef struct tlsphi_mirror {
    uint32_t particle;
    int tangent, conducts;
    tlsph_real N[3];
} tlsphi_mirror;
typedef struct tlsphi_fix {
    uint32_t particle;
    tlsph_real e[3];
} tlsphi_fix; /* sorted by particle */

/* Particles behind the surface: the part of a particle's share of it that a condition means; see [SURFACES]. */
typedef struct tlsphi_part {
    tlsph_real B[3], T[9], o[3], W[9]; /* area vector, moment, middle seen from X_a; M^-1 of the particle */
} tlsphi_part;
typedef struct tlsphi_held_part {
    uint32_t particle, load, item; /* whose values are `wanted`; load TLSPHI_NONE: at rest */
    int along;                     /* 0: all components are held, 1: that along N, -1: those across N */
    int mirror;                    /* the other components do not change along N */
    tlsph_real N[3], damping;      /* share of the damping: the particle's own weight in v_o to the power -2 */
    tlsph_real wanted[3], jump[3]; /* v of the surface, and what the extrapolated v lacks of it */
    tlsphi_part part;
} tlsphi_held_part;

typedef struct tlsphi_load {
    tlsph_condition given;  /* pointers replaced by copies */
    tlsphi_part *part;      /* one a particle; NULL: particles on the surface, or a load on volumes */
    uint32_t *inner, *host; /* solver and host numbers */
    tlsph_real *area;       /* traction, heat flux: 1; pressure: D; else NULL */
    tlsph_real *values;     /* 3 or 1 a particle, of the current stage */
    tlsph_real *X, *x;      /* 3 a particle, for the callback; NULL without */
    tlsph_real *before;     /* driven velocity: kinetic part before the stage, 1 a particle */
} tlsphi_load;

/* Cumulative entries of the ledger, and the values from which they count. */
typedef struct tlsphi_account {
    double dissipation, dissipation_entropy, conduction_entropy, external_work, external_heat, external_entropy;
    double projection_work, contact_loss, retries, limits, limit_step, impulse[3], angular_impulse[3], least_pair_production;
    double initial_plastic_work, initial_plastic_entropy;
    double initial_energy, initial_entropy, initial_momentum[3], initial_angular[3];
} tlsphi_account;

typedef struct tlsphi_body {
    uint32_t first;                       /* particle */
    double volume, inertia[9], centre[3]; /* of the stage's positions */
    int turns;                            /* axes about which its mirror planes let it turn: 3, 1 (`axis`) or 0 */
    double axis[3];
    double v_mean[3], spin[3];            /* rigid motion nearest to v */
    double turn[3];                       /* the spin that grad w lacks */
    double lambda[3], linear[3], middle[3]; /* multipliers of the projection, and its centre */
    int closed;                           /* incompressible: its whole surface is held, so that the mean pressure is free */
    double shift;
    double debt[3];                       /* torque that earlier stages owe to the step, see [PROJECTION] */
    double owed[6], from[3];              /* [MULTI-RATE]: resultant and torque of all passes; centre at first */
} tlsphi_body;

/* Work arrays of [INCOMPRESSIBLE]. */
typedef struct tlsphi_pressure {
    tlsph_real *A, *a, *slope, *back, *velocity;                 /* DD, D, D, D, D */
    tlsph_real *b, *diagonal, *compact, *q, *r, *z, *p, *Sp;     /* 1 each */
} tlsphi_pressure;
/* The image of a particle beyond a mirror plane of normal N next to it, seen with C = c N: its v differs by -2 times the odd
   part, along N at rollers, across it at tangentially fixed faces. */
typedef struct tlsphi_image {
    uint32_t particle;
    int tangent, axis;
    tlsph_real c;
} tlsphi_image;

/* Conduction in stages of its own, see [SUPER-STEPS]: temperatures at the beginning, of the last two stages, rates at the
   beginning and of heat loads, and E before the step. */
typedef struct tlsphi_super {
    int most, fresh; /* stages a half step, 0: off, no arrays; is this one the first? */
    tlsph_real *first, *previous, *current, *rate, *source, *E;
    tlsph_real *conductance; /* of each pair, by slots; NULL where the form is not the compact one */
} tlsphi_super;

/* See [MULTI-RATE]. */
typedef struct tlsphi_rates {
    int levels;              /* 1: off, no arrays */
    uint8_t *of;             /* level of each particle */
    uint32_t *list;          /* blocks of level l from first[2 l], others with neighbours in it from first[2 l + 1] */
    size_t first[17];
    tlsph_real *was;         /* x when each level was moved last, n D a level, and */
    double last[8];          /* when that was, since the beginning of the step */
    int level;               /* of the pass, */
    double time, step;       /* its time since then, step, */
    tlsph_real elapsed;      /* and time since last */
} tlsphi_rates;

struct tlsph_solver {
    int dim, thermal, linear, has_H, has_J, sharp, corrected, conducts, has_user, has_plastic, metal;
    int heat_moves; /* the fluxes hold conduction: conducts, but for the mechanical part of a split step */
    tlsphi_super super;
    int audit, projection, dissipation_heats, retries, threads, bonds;
    int gathers_w;     /* grad w is a sum over neighbours; else it comes from that of v, see tlsphi_take_turn */
    int keeps_rate;    /* rate_F is there */
    int constrains;    /* driven velocities, walls or temperatures are imposed after a stage */
    int keeps_pairs;   /* `neighbour` and `g` are there; else only the graph of [TILES] */
    int turns;         /* the body's spin turns F exactly (tlsphi_turn_gradient) */
    int frozen, damps; /* the integrator freezes the dissipation; this stage evaluates it */
    int leaps;         /* TLSPH_LEAPFROG */
    tlsphi_rates rates;
    int parted;        /* stresses and dissipation are gathered apart: frozen, or over different pairs */
    tlsph_integrator integrator;
    tlsph_dissipation dissipation;
    tlsph_force_form force_form;
    tlsph_step_rule step_rule;
    double harmonic, biharmonic, jst_step; /* eta2 h, eta4 h^3, and the step that these allow */
    tlsph_volume_coupling coupling;
    tlsph_conduction conduction;
    tlsph_real drift_stiffness, drift_scale, jump_share, drift_relaxation, cfl, limit;
    size_t n, pairs, blocks, bodies, fixes, mirrors, loads, held_parts;
    tlsphi_material *materials;
    size_t material_count;
    uint8_t *material_of; /* NULL: one material */
    tlsph_real *beside; /* 2 a particle, NULL: one material; see tlsphi_fill_interfaces */
    /* operator */
    uint32_t *found; /* number of neighbours */
    size_t *first;   /* NULL without keeps_pairs, like neighbour and g */
    uint32_t *neighbour;
    tlsph_real *g, *rest; /* rest: r_ab, see [BONDS] */
    uint32_t *M_of;       /* the pattern of M of each tile of TLSPHI_LANES particles, in M (NULL: all are I); */
    tlsph_real *M;        /* DD x lanes each; a lattice has few */
    size_t *damped_first; /* the pairs of the dissipation: the same arrays, but for TLSPH_CELLS_4 */
    uint32_t *damped_neighbour;
    tlsph_real *damped_g;
    size_t images;
    struct tlsphi_image *image; /* TLSPH_CELLS_4: sorted by particle */
    tlsph_real *V, *tau;
    size_t areas;   /* particles with a boundary vector, */
    uint32_t *B_of; /* sorted, */
    tlsph_real *B;  /* D each; see tlsphi_boundary */
    uint32_t *host, *inner;
    /* state, and the state at the beginning of the step */
    tlsphi_state now, old, spare; /* spare: see tlsphi_share_state */
    tlsph_real *now_memory, *old_memory, *spare_memory;
    /* incompressible scheme */
    int incompressible;
    tlsph_incompressible choice;
    tlsph_real laplacian_share;
    tlsphi_pressure pressure;
    tlsph_pressure_report report;
    size_t state_reals;
    /* rates per reference volume */
    tlsph_real *rate_p, *rate_F, *rate_J, *rate_E;
    tlsphi_rows rows;
    tlsph_real *row;         /* blocks of rows, see above */
    int lanes;               /* fluxes by lanes, see [FLUXES] */
    tlsphi_graph graph, damped_graph; /* the second with TLSPH_CELLS_4 */
    tlsph_real *least_stretch;        /* [PAIR-STEP] */
    tlsph_real *laplacian, *lean;     /* [JST]: l_ab a pair, with keeps_pairs; 2 vectors a particle */
    tlsph_real *held; /* dissipation that outlasts its pass, see tlsphi_keep_damping */
    /* conditions */
    tlsphi_fix *fix;
    tlsphi_mirror *mirror;
    uint32_t *mirror_of;
    tlsphi_load *load;
    tlsphi_held_part *held_part; /* sorted by particle */
    tlsphi_block *block;
    tlsphi_body *body;
    /* time and balances */
    double time;
    uint64_t step;
    double last_dt, first_dt;
    uint64_t fingerprint;
    tlsphi_account account, account_old;
    tlsph_error error;
    tlsph_size size;
    tlsph_closure closure;
    /* threads and memory */
    tlsph_run_fn run;
    void *run_user;
    tlsph_allocator allocator;
    void *memory;
    size_t memory_size;
    int owns_memory;
};

TLSPHI_INLINE const tlsphi_material *tlsphi_material_of(const tlsph_solver *s, size_t a) {
    return s->materials + (s->material_of ? s->material_of[a] : 0);
}

/* The first component of particle a in a row; the others follow TLSPHI_ROW apart. */
TLSPHI_INLINE tlsph_real *tlsphi_at(const tlsph_solver *s, int row, size_t a) {
    return s->row + (a / TLSPHI_BLOCK * (size_t)s->rows.count + (size_t)row) * TLSPHI_ROW + a % TLSPHI_BLOCK;
}
/* -- bodies larger than the cache --
   To the processor the rows of a tile are some forty streams, more than it follows by itself, and the tile waits for
   each. So a pass first reads what its next block will need once through, a cache line after the other, at more than
   twice the speed: that saves a fifth of a step. So many prefetches in place of the reads gained nothing. Smaller
   bodies would lose up to 3 %. */
#ifndef TLSPHI_CACHED /* tests set 0 */
#define TLSPHI_CACHED ((size_t)8 << 20) /* bytes */
#endif
static int tlsphi_outgrows_cache(const tlsph_solver *s) {
    return s->blocks * (size_t)s->rows.count * TLSPHI_ROW * sizeof *s->row > TLSPHI_CACHED;
}
static void tlsphi_warm(const tlsph_real *from, size_t count) {
    const volatile tlsph_real *line = from;
    for (size_t i = 0; i < count; i += TLSPHI_LANES) (void)line[i];
}
/* The rows [first, end) of the block of particle a, without the spare columns: its task may be writing there. */
static void tlsphi_warm_rows(const tlsph_solver *s, size_t a, int first, int end) {
    for (int r = first; r < end; r++) tlsphi_warm(tlsphi_at(s, r, a - a % TLSPHI_BLOCK), TLSPHI_BLOCK);
}
/* A particle of the block that the next block will be the first to reach: the last neighbour of its first tile within
   some layers of a strip (see TLSPHI_STRIP); one in another strip concerns few of its tiles. */
static size_t tlsphi_reach_ahead(const tlsph_solver *s, const tlsphi_block *block) {
    const tlsphi_graph *graph = &s->graph;
    const tlsphi_block *next = block + (block + 1 < s->block + s->blocks);
    size_t last = next->begin;
    for (size_t k = graph->first[next->tile]; k < graph->first[next->tile + 1]; k++) {
        const tlsphi_slot *slot = graph->slot + k;
        const uint32_t *b = slot->scattered ? graph->gathered + slot->from : &slot->from;
        for (size_t l = 0; l < (slot->scattered ? TLSPHI_LANES : 1); l++)
            if (b[l] > last && b[l] < next->begin + 4 * TLSPHI_STRIP) last = b[l];
    }
    return last;
}
TLSPHI_INLINE void tlsphi_take_apart(const int n, const tlsph_real *at, const size_t apart, tlsph_real *out) {
    TLSPHI_UNROLL for (int i = 0; i < n; i++) out[i] = at[(size_t)i * apart];
}
TLSPHI_INLINE void tlsphi_take_rows(const int n, const tlsph_real *at, tlsph_real *out) {
    tlsphi_take_apart(n, at, TLSPHI_ROW, out);
}
TLSPHI_INLINE void tlsphi_row_get(const tlsph_solver *s, int row, const int n, size_t a, tlsph_real *out) {
    tlsphi_take_rows(n, tlsphi_at(s, row, a), out);
}
TLSPHI_INLINE void tlsphi_row_put(const tlsph_solver *s, int row, const int n, size_t a, const tlsph_real *in) {
    tlsph_real *at = tlsphi_at(s, row, a);
    TLSPHI_UNROLL for (int i = 0; i < n; i++) at[(size_t)i * TLSPHI_ROW] = in[i];
}
/* Component of X_a. */
TLSPHI_INLINE tlsph_real tlsphi_X(const tlsph_solver *s, size_t a, size_t i) {
    return tlsphi_at(s, s->rows.X, a)[i * TLSPHI_ROW];
}
/* v_a as the rows hold it, a component and all: of the last evaluation, but for the mean velocities of leapfrogs. */
TLSPHI_INLINE tlsph_real tlsphi_v(const tlsph_solver *s, size_t a, size_t i) {
    return tlsphi_at(s, s->rows.v, a)[i * TLSPHI_ROW];
}
TLSPHI_INLINE void tlsphi_velocity(const tlsph_solver *s, size_t a, tlsph_real *out) {
    if (s->dim == 3) tlsphi_row_get(s, s->rows.v, 3, a, out);
    else tlsphi_row_get(s, s->rows.v, 2, a, out);
}
/* d = X_b - X_a */
TLSPHI_INLINE void tlsphi_pair_arm(const tlsph_solver *s, size_t a, size_t b, const int dim, tlsph_real *d) {
    TLSPHI_UNROLL for (size_t i = 0; i < (size_t)dim; i++) d[i] = tlsphi_X(s, b, i) - tlsphi_X(s, a, i);
}
/* Places of a field of tensors by tiles, and of the first component of particle a; the others follow TLSPHI_LANES
   apart. */
TLSPHI_INLINE size_t tlsphi_tensor_reals(size_t n, size_t dd) {
    return (n + TLSPHI_LANES - 1) / TLSPHI_LANES * TLSPHI_LANES * dd;
}
TLSPHI_INLINE size_t tlsphi_tensor_at(size_t dd, size_t a) {
    return a / TLSPHI_LANES * dd * TLSPHI_LANES + a % TLSPHI_LANES;
}
TLSPHI_INLINE void tlsphi_tensor_get(const tlsph_real *field, const int dd, size_t a, tlsph_real *out) {
    const tlsph_real *at = field + tlsphi_tensor_at((size_t)dd, a);
    TLSPHI_UNROLL for (int i = 0; i < dd; i++) out[i] = at[(size_t)i * TLSPHI_LANES];
}
TLSPHI_INLINE void tlsphi_tensor_put(tlsph_real *field, const int dd, size_t a, const tlsph_real *in) {
    tlsph_real *at = field + tlsphi_tensor_at((size_t)dd, a);
    TLSPHI_UNROLL for (int i = 0; i < dd; i++) at[(size_t)i * TLSPHI_LANES] = in[i];
}
/* grad v of particle a, whose components are `apart` from each other: rate_F but for sharp gradients. Only where
   keeps_rate is set, see tlsphi_take_turn. */
TLSPHI_INLINE tlsph_real *tlsphi_grad_v(const tlsph_solver *s, size_t a, size_t *apart) {
    *apart = s->sharp ? TLSPHI_ROW : TLSPHI_LANES;
    return s->sharp ? tlsphi_at(s, s->rows.grad_v, a) : s->rate_F + tlsphi_tensor_at((size_t)(s->dim * s->dim), a);
}
/* Dissipation that outlasts the pass, by tiles: D_p, D_J and the power, see tlsphi_keep_damping. */
TLSPHI_INLINE tlsph_real *tlsphi_held(const tlsph_solver *s, size_t a) {
    return s->held + tlsphi_tensor_at((size_t)s->dim + 2, a);
}
/* As 3x3, with the third diagonal entry of plane strain. */
static void tlsphi_tensor_expand(const tlsph_real *field, int dim, size_t a, tlsph_real third, tlsph_real out[9]) {
    tlsph_real in_plane[9];
    tlsphi_tensor_get(field, dim * dim, a, in_plane);
    tlsphi_expand(dim, in_plane, third, out);
}

/* M of the particles of a tile, as lanes, and of one of them. */
TLSPHI_INLINE const tlsph_real *tlsphi_correction_lanes(const tlsph_solver *s, size_t a) {
    return s->M + (size_t)s->M_of[a / TLSPHI_LANES] * (size_t)(s->dim * s->dim) * TLSPHI_LANES;
}
TLSPHI_INLINE int tlsphi_correction(const tlsph_solver *s, size_t a, const int dim, tlsph_real *out) {
    if (!s->M) return 0;
    tlsphi_take_apart(dim * dim, tlsphi_correction_lanes(s, a) + a % TLSPHI_LANES, TLSPHI_LANES, out);
    return 1;
}
/* out = M_a x, M_a^T x, P M_a, (M_a + M_b) g/2; without M what is given. */
TLSPHI_INLINE void tlsphi_correct_vector(const tlsph_solver *s, size_t a, const int dim, const tlsph_real *x,
                                         tlsph_real *out) {
    tlsph_real M[9];
    if (tlsphi_correction(s, a, dim, M)) tlsphi_multiply(dim, M, x, out);
    else memcpy(out, x, (size_t)dim * sizeof *x);
}
TLSPHI_INLINE void tlsphi_correct_transposed(const tlsph_solver *s, size_t a, const int dim, const tlsph_real *x,
                                             tlsph_real *out) {
    tlsph_real M[9];
    if (tlsphi_correction(s, a, dim, M)) tlsphi_multiply_transposed(dim, M, x, out);
    else memcpy(out, x, (size_t)dim * sizeof *x);
}
TLSPHI_INLINE void tlsphi_correct_tensor(const tlsph_solver *s, size_t a, const int dim, const tlsph_real *P,
                                         tlsph_real *out) {
    tlsph_real M[9];
    if (tlsphi_correction(s, a, dim, M)) tlsphi_product(dim, P, M, out);
    else memcpy(out, P, (size_t)(dim * dim) * sizeof *P);
}
TLSPHI_INLINE void tlsphi_skew_vector(const tlsph_solver *s, size_t a, size_t b, const int dim, const tlsph_real *g,
                                      tlsph_real *out) {
    tlsph_real M_a[9], M_b[9];
    if (tlsphi_correction(s, a, dim, M_a) && tlsphi_correction(s, b, dim, M_b))
        tlsphi_multiply_mean(dim, dim, M_a, M_b, g, out);
    else memcpy(out, g, (size_t)dim * sizeof *g);
}

/* End of the tile that begins with particle a. */
TLSPHI_INLINE size_t tlsphi_tile_end(const tlsphi_block *block, size_t a) {
    const size_t end = (a / TLSPHI_LANES + 1) * TLSPHI_LANES;
    return end < block->end ? end : block->end;
}
TLSPHI_INLINE tlsph_real *tlsphi_theta(const tlsph_solver *s, size_t a) { return tlsphi_at(s, s->rows.theta, a); }

/* First entry of a particle >= a in a list sorted by particle, whose entries of `size` bytes begin with its number. */
static size_t tlsphi_find_particle(const void *list, size_t count, size_t size, size_t a) {
    size_t low = 0, high = count;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        uint32_t particle;
        memcpy(&particle, (const unsigned char *)list + size * middle, sizeof particle);
        if (particle < a) low = middle + 1;
        else high = middle;
    }
    return low;
}
static const tlsph_real *tlsphi_boundary(const tlsph_solver *s, size_t a) {
    static const tlsph_real none[3] = {0, 0, 0};
    const size_t i = tlsphi_find_particle(s->B_of, s->areas, sizeof *s->B_of, a);
    return i < s->areas && s->B_of[i] == a ? s->B + (size_t)s->dim * i : none;
}
/* Runs task(arg, i) for every block i. */
static void tlsphi_run_tasks(const tlsph_solver *s, tlsph_task_fn task, void *arg) {
    tlsphi_parallel(s->run, s->run_user, s->threads, task, arg, s->blocks);
}

/* The same for a function of a block. */
typedef void (*tlsphi_block_fn)(tlsph_solver *s, tlsphi_block *block);
typedef struct tlsphi_phase {
    tlsph_solver *s;
    tlsphi_block_fn fn;
} tlsphi_phase;

static void tlsphi_phase_task(void *arg, size_t i) {
    const tlsphi_phase *phase = (const tlsphi_phase *)arg;
    phase->fn(phase->s, phase->s->block + i);
}
static void tlsphi_run(tlsph_solver *s, tlsphi_block_fn fn) {
    tlsphi_phase phase;
    phase.s = s;
    phase.fn = fn;
    tlsphi_run_tasks(s, tlsphi_phase_task, &phase);
}

TLSPHI_INLINE void tlsphi_cross3(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* ==== [EVALUATION] =================================================================================================
   Algorithm 1 lines (8) and (9): stress, temperature, wave speeds of each particle from its state, and what neighbours
   read of it. */

typedef struct tlsphi_point {
    tlsph_real F[9], H[9], d, J; /* d = det F (linear: 1 + tr eps) */
    tlsph_response r;            /* with W inside */
    tlsphi_deviator dev;
    tlsphi_plastic plastic;
    tlsph_real kinetic, theta, p, P[9], Sigma_J, c_p, c_s, drift_ratio;
} tlsphi_point;

/* Loads F, H and J as 3x3; where H or J are not evolved they follow from F. */
static void tlsphi_load_measures(const tlsph_solver *s, const tlsphi_state *u, const tlsphi_material *m, size_t a,
                                 tlsphi_point *pt) {
    const int dim = s->dim;
    tlsphi_tensor_expand(u->F, dim, a, 1, pt->F);
    if (m->kind == TLSPH_LINEAR) {
        tlsphi_identity(pt->H);
        pt->d = pt->F[0] + pt->F[4] + pt->F[8] - 2;
    } else {
        pt->d = tlsph_determinant(pt->F);
        if (s->has_H) tlsphi_tensor_expand(u->H, dim, a, pt->F[0] * pt->F[4] - pt->F[1] * pt->F[3], pt->H);
        else tlsph_cofactor(pt->F, pt->H);
    }
    pt->J = s->has_J ? u->J[a] : pt->d;
}

/* Adds W(J - d) to the energy (MEE: to the entropy), sets W''/kappa and returns W'. */
TLSPHI_INLINE tlsph_real tlsphi_add_drift(const tlsphi_material *m, tlsph_real stiffness, tlsph_real scale,
                                          tlsphi_point *pt) {
    tlsph_real W, dW, ddW;
    tlsphi_drift(pt->J - pt->d, scale, &W, &dW, &ddW);
    const tlsph_real per_theta = stiffness / m->theta_R, per_kappa = stiffness / m->kappa;
    if (m->entropic) pt->r.entropy -= per_theta * W;
    else pt->r.energy += stiffness * W;
    pt->drift_ratio = per_kappa * ddW;
    return stiffness * dW;
}

static tlsph_real tlsphi_temperature(const tlsph_solver *s, const tlsphi_state *u, const tlsphi_material *m, size_t a,
                                     const tlsphi_point *pt) {
    if (s->thermal == TLSPH_ENERGY) return m->theta_R + (u->E[a] - pt->kinetic - pt->r.energy) / m->c_v;
    if (s->thermal == TLSPH_ENTROPY) {
        const tlsph_real heat = (u->E[a] + pt->plastic.entropy - pt->r.entropy) * (1 / m->c_v);
        return tlsphi_finite(heat) ? m->theta_R * tlsphi_exp(heat) : heat;
    }
    return m->theta_R;
}

/* What a tile has had evaluated at once: the response of a user's material, the elastic strain of a metal. */
typedef struct tlsphi_known {
    const tlsph_response *response;
    const tlsphi_elastic *elastic;
} tlsphi_known;
/* Sets F, H, J, response: all that does not need the temperature. known may be NULL. Returns TLSPH_OK, NOT_FINITE or
   INVERSION. */
static tlsph_result tlsphi_respond_at(const tlsph_solver *s, const tlsphi_state *u, size_t a,
                                      const tlsphi_known *known, tlsphi_point *pt) {
    const tlsphi_material *m = tlsphi_material_of(s, a);
    const int dim = s->dim, joint = s->coupling == TLSPH_JOINT_AS_PRINTED;
    tlsphi_load_measures(s, u, m, a, pt);
    pt->plastic.strain = pt->plastic.entropy = 0;
    if (!tlsphi_finite(pt->d) || !tlsphi_finite(pt->J)) return TLSPH_ERROR_NOT_FINITE;
    if (m->kind != TLSPH_LINEAR && (!(pt->d > 0) || !(pt->J > 0))) return TLSPH_ERROR_INVERSION;
    if (m->kind == TLSPH_USER) {
        if (known) pt->r = *known->response;
        else m->response(m->user, 1, s->host + a, pt->F, &pt->J, &pt->r);
        memset(&pt->dev, 0, sizeof pt->dev);
    } else if (m->kind == TLSPH_VON_MISES) {
        const size_t reals = tlsphi_plastic_reals(dim, s->thermal);
        tlsphi_elastic elastic;
        tlsphi_load_plastic(dim, s->thermal, u->plastic + reals * a, &pt->plastic);
        if (!known) tlsphi_elastic_strain(pt->F, &pt->plastic, &elastic);
        tlsphi_respond_von_mises(m, pt->F, pt->d, pt->J, s->thermal, known ? known->elastic : &elastic, &pt->r);
        if (s->thermal) pt->r.energy += (1 - m->heating) * tlsphi_plastic_work(m, pt->plastic.strain);
        memset(&pt->dev, 0, sizeof pt->dev);
    } else if (s->has_H && !joint && m->mooney) {
        tlsph_real H[9]; /* the deviatoric part sees the true cofactor */
        tlsph_cofactor(pt->F, H);
        tlsphi_respond(m, pt->F, H, pt->d, pt->J, s->thermal, &pt->r, &pt->dev);
    } else {
        tlsphi_respond(m, pt->F, pt->H, joint ? pt->J : pt->d, pt->J, s->thermal, &pt->r, &pt->dev);
    }
    pt->kinetic = tlsphi_dot(dim, u->p + (size_t)dim * a, u->p + (size_t)dim * a) / (2 * m->rho);
    pt->drift_ratio = 0;
    pt->Sigma_J = s->has_J && !joint ? tlsphi_add_drift(m, s->drift_stiffness * m->mu, s->drift_scale, pt) : pt->dev.c;
    return TLSPH_OK;
}

/* Stress, Sigma_J and wave speeds at the temperature theta; p: Sigma_J without the drift's part, or the pressure. */
TLSPHI_INLINE void tlsphi_conclude(const tlsphi_material *m, tlsph_real theta, tlsph_real pressure, tlsphi_point *pt) {
    const tlsph_real per_rho = 1 / m->rho, per_theta = 1 / m->theta_R;
    pt->theta = theta;
    pt->p = pressure;
    TLSPHI_UNROLL for (int i = 0; i < 9; i++) pt->P[i] =
        pt->r.e_F[i] - theta * pt->r.eta_F[i] + pt->p * pt->H[i];
    pt->Sigma_J = pt->p + pt->Sigma_J * (m->entropic ? theta * per_theta : 1);
    pt->c_p = tlsphi_square_root(tlsphi_max(pt->r.p_modulus[0] + theta * pt->r.p_modulus[1], 0) * per_rho);
    pt->c_s = tlsphi_square_root(tlsphi_max(pt->r.s_modulus[0] + theta * pt->r.s_modulus[1], 0) * per_rho);
}
/* Everything at a particle. */
static tlsph_result tlsphi_constitute(const tlsph_solver *s, const tlsphi_state *u, size_t a,
                                      const tlsphi_known *known, tlsphi_point *pt) {
    const tlsphi_material *m = tlsphi_material_of(s, a);
    const tlsph_result result = tlsphi_respond_at(s, u, a, known, pt);
    if (result) return result;
    const tlsph_real theta = pt->theta = tlsphi_temperature(s, u, m, a, pt);
    if (!tlsphi_finite(theta)) return TLSPH_ERROR_NOT_FINITE;
    if (!(theta > 0)) return TLSPH_ERROR_TEMPERATURE;
    if (u->q) pt->r.energy += m->compressibility * u->q[a] * u->q[a] / 2;
    tlsphi_conclude(m, theta, u->q ? u->q[a] : pt->r.e_J - theta * pt->r.eta_J, pt);
    return tlsphi_all_finite(pt->P, 9) && tlsphi_finite(pt->kinetic) && tlsphi_finite(pt->c_p) ? TLSPH_OK
                                                                                               : TLSPH_ERROR_NOT_FINITE;
}

/* The same of a state that was evaluated without fault: lanes round otherwise, and may have found the least bit of heat
   where there is none here. */
static void tlsphi_constitute_again(const tlsph_solver *s, size_t a, tlsphi_point *pt) {
    if (tlsphi_constitute(s, &s->now, a, NULL, pt) != TLSPH_ERROR_TEMPERATURE) return;
    const tlsph_real theta = *tlsphi_theta(s, a);
    tlsphi_conclude(tlsphi_material_of(s, a), theta, s->now.q ? s->now.q[a] : pt->r.e_J - theta * pt->r.eta_J, pt);
}

/* One callback for the run of particles [begin, end) that share a user's material. */
static void tlsphi_user_responses(const tlsph_solver *s, size_t begin, size_t end, tlsph_response *out) {
    tlsph_real F[9 * TLSPHI_LANES], J[TLSPHI_LANES];
    for (size_t start = begin, stop; start < end; start = stop) {
        const tlsphi_material *m = tlsphi_material_of(s, start);
        for (stop = start; stop < end && tlsphi_material_of(s, stop) == m; stop++) {
            tlsphi_point pt;
            tlsphi_load_measures(s, &s->now, m, stop, &pt);
            memcpy(F + 9 * (stop - start), pt.F, sizeof pt.F);
            J[stop - start] = pt.J;
        }
        if (m->kind == TLSPH_USER) m->response(m->user, stop - start, s->host + start, F, J, out + (start - begin));
    }
}

/* Mirror rules (METHOD: boundary-aware gradients). At a roller with normal N tangential velocities, temperature and
   Sigma_J are even across the plane, so their normal derivative vanishes: G -= (I - N N) (G N) (x) N. At a tangentially
   fixed face the normal velocity is even: G -= N N (G N) (x) N. Both are orthogonal projections; used on P as well they
   keep force and gradient adjoint, so that no energy is lost. */
static void tlsphi_mirror_tensor(int dim, const tlsphi_mirror *mirror, tlsph_real *G) {
    tlsph_real GN[3] = {0, 0, 0};
    tlsphi_multiply(dim, G, mirror->N, GN);
    const tlsph_real normal = tlsphi_dot(dim, GN, mirror->N);
    for (int i = 0; i < dim; i++) GN[i] = mirror->tangent ? -normal * mirror->N[i] : normal * mirror->N[i] - GN[i];
    tlsphi_add_outer(dim, G, GN, mirror->N);
}
static void tlsphi_mirror_vector(int dim, const tlsphi_mirror *mirror, tlsph_real *grad) {
    const tlsph_real normal = tlsphi_dot(dim, grad, mirror->N);
    for (int i = 0; i < dim; i++) grad[i] -= normal * mirror->N[i];
}
/* The mirrors of particle a are consecutive; the list ends with a sentinel. */
static const tlsphi_mirror *tlsphi_mirrors_of(const tlsph_solver *s, size_t a) {
    return s->mirror_of && s->mirror_of[a] != TLSPHI_NONE ? s->mirror + s->mirror_of[a] : NULL;
}

#define TLSPHI_SHARP_STEP 1.5 /* by which sharp gradients shorten tau: 1.37 times the largest frequency, and a margin */

/* Largest stable step of one particle, s: (78) with the current isentropic speed, and the diffusive limit. */
static double tlsphi_particle_step(const tlsph_solver *s, size_t a, const tlsphi_point *pt, double *heat) {
    const tlsphi_material *m = tlsphi_material_of(s, a);
    double tau = (double)s->tau[a], dt = TLSPHI_LARGEST;
    *heat = TLSPHI_LARGEST;
    if (pt->c_p > 0 && s->step_rule == TLSPH_STEP_BY_PARTICLE) dt = (double)s->cfl * tau / (double)pt->c_p;
    if (s->beside) dt *= (double)s->beside[2 * a];
    if (s->sharp) tau *= TLSPHI_SHARP_STEP; /* sharp gradients are for v only: heat keeps its stencil */
    const tlsph_real h = s->beside ? s->beside[2 * a + 1] : m->h;
    if (s->conducts && h > 0) {
        tlsph_real HtH[9];
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                HtH[3 * i + j] = pt->H[i] * pt->H[j] + pt->H[3 + i] * pt->H[3 + j] + pt->H[6 + i] * pt->H[6 + j];
        const tlsph_real K = h / pt->J * tlsphi_largest_bound(HtH[0] + HtH[4] + HtH[8], tlsphi_dot(9, HtH, HtH));
        *heat = 0.8 * (double)m->c_v * tau * tau / (2 * s->dim * (double)K);
    }
    return s->super.most ? dt : tlsphi_dmin(dt, *heat);
}

/* Bound of |H N| over all directions N: by this the fastest direction is faster than one with |H N| = 1. */
static tlsph_real tlsphi_largest_stretch_of_areas(const tlsphi_point *pt) {
    return tlsphi_sqrt(tlsphi_principal_bounds(tlsphi_dot(9, pt->F, pt->F), tlsphi_dot(9, pt->H, pt->H), pt->d).LH);
}
/* Writes what neighbours read. */
static void tlsphi_publish(tlsph_solver *s, size_t a, const tlsphi_point *pt) {
    const int dim = s->dim, dd = dim * dim;
    const size_t D = (size_t)dim;
    const tlsphi_rows *r = &s->rows;
    const tlsphi_material *m = tlsphi_material_of(s, a);
    const tlsph_real spread = s->metal ? tlsphi_largest_stretch_of_areas(pt) : 1;
    const tlsph_real wave[2] = {pt->c_p / spread, pt->c_s / spread};
    tlsph_real P[9], H[9], PM[9], A[9], v[3] = {0, 0, 0};
    tlsphi_shrink(dim, pt->P, P);
    tlsphi_shrink(dim, pt->H, H);
    for (const tlsphi_mirror *mirror = tlsphi_mirrors_of(s, a); mirror && mirror->particle == a; mirror++)
        tlsphi_mirror_tensor(dim, mirror, P);
    tlsphi_correct_tensor(s, a, dim, P, PM);
    tlsphi_correct_tensor(s, a, dim, H, A);
    for (size_t i = 0; i < D; i++) v[i] = s->now.p[D * a + i] / m->rho;
    tlsphi_row_put(s, r->v, dim, a, v);
    if (!s->projection) tlsphi_row_put(s, r->w, dim, a, v);
    tlsphi_row_put(s, r->PM, dd, a, PM);
    tlsphi_row_put(s, r->A, dd, a, A);
    tlsphi_row_put(s, r->wave, 2, a, wave);
    if (s->has_J) *tlsphi_at(s, r->wave + 3, a) = pt->drift_ratio;
    if (s->has_J) *tlsphi_at(s, r->S, a) = pt->Sigma_J;
    if (s->thermal) *tlsphi_at(s, r->theta, a) = pt->theta;
    if (s->conducts) /* linear: H = I, J = 1 in (000-13) */
        *tlsphi_at(s, r->h_J, a) = m->kind == TLSPH_LINEAR ? m->h : m->h / pt->J;
}

/* Elastic strains of the particles [begin, end) of a tile, by lanes where they are small, as they are in most metals. */
static void tlsphi_elastic_strains(const tlsph_solver *s, const tlsph_real *plastic, size_t begin, size_t end,
                                   tlsphi_elastic *out) {
    const size_t reals = tlsphi_plastic_reals(s->dim, s->thermal), count = end - begin;
    tlsph_real F[TLSPHI_LANES][9];
    tlsphi_plastic at[TLSPHI_LANES];
    TLSPHI_ALIGNED double F_of[9 * TLSPHI_LANES] = {0}, C_of[6 * TLSPHI_LANES] = {0}, e_of[6 * TLSPHI_LANES];
    TLSPHI_ALIGNED double strain[TLSPHI_LANES], square[TLSPHI_LANES]; /* X : X/2 and 3/2 e:e */
    for (size_t l = 0; l < count; l++) {
        tlsphi_tensor_expand(s->now.F, s->dim, begin + l, 1, F[l]);
        tlsphi_load_plastic(s->dim, s->thermal, plastic + reals * (begin + l), at + l);
        for (size_t i = 0; i < 9; i++) F_of[i * TLSPHI_LANES + l] = (double)F[l][i];
        for (size_t i = 0; i < 6; i++) C_of[i * TLSPHI_LANES + l] = (double)at[l].C[tlsphi_symmetric_slot[i]];
    }
    for (size_t l = count; l < TLSPHI_LANES; l++) /* no particle: F = C = I */
        for (size_t i = 0; i < 3; i++) F_of[4 * i * TLSPHI_LANES + l] = C_of[i * TLSPHI_LANES + l] = 1;
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        double F_d[9], C[6], X[6], e[6];
        TLSPHI_UNROLL for (size_t i = 0; i < 9; i++) F_d[i] = F_of[i * TLSPHI_LANES + l];
        TLSPHI_UNROLL for (size_t i = 0; i < 6; i++) C[i] = C_of[i * TLSPHI_LANES + l];
        tlsphi_elastic_left(F_d, C, X);
        strain[l] = tlsphi_half_square(X);
        tlsphi_power_series(0, X, e);
        tlsphi_elastic_deviator(e, square + l);
        TLSPHI_UNROLL for (size_t i = 0; i < 6; i++) e_of[i * TLSPHI_LANES + l] = e[i];
    }
    for (size_t l = 0; l < count; l++) {
        for (size_t i = 0; i < 6; i++) out[l].e[i] = e_of[i * TLSPHI_LANES + l];
        out[l].size = sqrt(square[l]);
        if (strain[l] > TLSPHI_SMALL * TLSPHI_SMALL) tlsphi_elastic_strain(F[l], at + l, out + l);
    }
}
/* Plastic flow of one particle since the beginning of the step. Returns 1 if there was any. */
static int tlsphi_flow(tlsph_solver *s, size_t a, const tlsphi_elastic *elastic) {
    const tlsphi_material *m = tlsphi_material_of(s, a);
    const size_t reals = tlsphi_plastic_reals(s->dim, s->thermal);
    tlsphi_plastic plastic;
    tlsph_real F[9];
    if (m->kind != TLSPH_VON_MISES) return 0;
    tlsphi_tensor_expand(s->now.F, s->dim, a, 1, F);
    tlsphi_load_plastic(s->dim, s->thermal, s->old.plastic + reals * a, &plastic);
    const tlsph_real d = tlsph_determinant(F);
    const int flows = d > 0 && tlsphi_finite(d) && tlsphi_return_map(m, F, d, elastic, &plastic);
    tlsphi_store_plastic(s->dim, s->thermal, &plastic, s->now.plastic + reals * a);
    return flows;
}
/* Entropy of the plastic heat. In the energy form E has given the heat already: theta is that after it. */
static void tlsphi_heat_of_flow(tlsph_solver *s, size_t a) {
    const tlsphi_material *m = tlsphi_material_of(s, a);
    const size_t reals = tlsphi_plastic_reals(s->dim, s->thermal);
    tlsphi_plastic old;
    tlsphi_point pt;
    if (tlsphi_constitute(s, &s->now, a, NULL, &pt)) return; /* the evaluation that follows reports it */
    tlsphi_load_plastic(s->dim, s->thermal, s->old.plastic + reals * a, &old);
    const tlsph_real heat =
        m->heating * (tlsphi_plastic_work(m, pt.plastic.strain) - tlsphi_plastic_work(m, old.strain));
    const tlsph_real before = s->thermal == TLSPH_ENTROPY ? pt.theta : pt.theta - heat / m->c_v;
    if (before > 0) pt.plastic.entropy = old.entropy + m->c_v * tlsphi_log(1 + heat / (m->c_v * before));
    tlsphi_store_plastic(s->dim, s->thermal, &pt.plastic, s->now.plastic + reals * a);
}
static void tlsphi_flow_block(tlsph_solver *s, tlsphi_block *block) {
    tlsphi_elastic elastic[TLSPHI_LANES];
    for (size_t begin = block->begin, end; begin < block->end; begin = end) {
        end = tlsphi_tile_end(block, begin);
        tlsphi_elastic_strains(s, s->old.plastic, begin, end, elastic);
        for (size_t a = begin; a < end; a++)
            if (tlsphi_flow(s, a, elastic + (a - begin)) && s->thermal) tlsphi_heat_of_flow(s, a);
    }
}

/* One particle in full. Returns 0 if its state is impossible. */
static int tlsphi_evaluate_particle(tlsph_solver *s, tlsphi_block *block, size_t a, const tlsphi_known *known) {
    tlsphi_point pt;
    double heat;
    const tlsph_result result = tlsphi_constitute(s, &s->now, a, known, &pt);
    if (result) {
        block->failed = (uint32_t)a;
        block->failure = result;
        return 0;
    }
    tlsphi_publish(s, a, &pt);
    if (s->least_stretch) {
        double stretches[3];
        tlsphi_stretches(pt.F, stretches);
        s->least_stretch[a] = (tlsph_real)stretches[2];
    }
    block->time_step = tlsphi_dmin(block->time_step, tlsphi_particle_step(s, a, &pt, &heat));
    block->heat_step = tlsphi_dmin(block->heat_step, heat);
    return 1;
}

/* -- the same for tiles of one material, by lanes: the built-in laws but for powers of J --
   From F to c_p each number of a particle waits for the one before, over more operations than a processor looks ahead.
   So this goes in parts, each for a few tiles before the next begins: the processor then works at several tiles at a
   time, which takes half as long. */

#define TLSPHI_RUN ((size_t)4) /* tiles; their lanes should stay in the first cache */

/* A tile's state, and what one part leaves for the next. */
typedef struct TLSPHI_ALIGNED tlsphi_state_lanes {
    tlsph_real v[3 * TLSPHI_LANES], kinetic[TLSPHI_LANES], d[TLSPHI_LANES], J[TLSPHI_LANES];
    tlsph_real I1[TLSPHI_LANES], I2[TLSPHI_LANES], L1[TLSPHI_LANES], LH[TLSPHI_LANES], l3[TLSPHI_LANES];
    tlsph_real psi[TLSPHI_LANES], a[TLSPHI_LANES], b[TLSPHI_LANES], c[TLSPHI_LANES];
    tlsph_real J23[TLSPHI_LANES], per_J[TLSPHI_LANES];
    tlsph_real energy[TLSPHI_LANES], entropy[TLSPHI_LANES], e_J[TLSPHI_LANES], eta_J[TLSPHI_LANES];
    tlsph_real p_modulus[2 * TLSPHI_LANES], s_modulus[2 * TLSPHI_LANES], drift[TLSPHI_LANES], ratio[TLSPHI_LANES];
    tlsph_real theta[TLSPHI_LANES], Sigma_J[TLSPHI_LANES], c_p[TLSPHI_LANES], all[TLSPHI_LANES];
} tlsphi_state_lanes;

/* n components a particle become n lanes. */
TLSPHI_INLINE void tlsphi_transpose(const tlsph_real *from, const size_t n, tlsph_real *to) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
        TLSPHI_UNROLL for (size_t i = 0; i < n; i++) to[i * TLSPHI_LANES + l] = from[n * l + i];
}
/* F and H of lane l of the tile at `begin`, completed in plane strain; H = cof F where it is not evolved. d is a number
   of its own: clang turns a choice between two members into one of addresses, and then makes no vectors. */
TLSPHI_INLINE void tlsphi_take_measures(const tlsph_solver *s, size_t begin, size_t l, const int dim, const int has_H,
                                        tlsphi_point *pt) {
    const size_t at = (size_t)(dim * dim) * begin + l;
    tlsph_real F[9], H[9];
    tlsphi_take_apart(dim * dim, s->now.F + at, TLSPHI_LANES, F);
    tlsphi_expand(dim, F, 1, pt->F);
    tlsphi_cofactor_inline(pt->F, pt->H);
    const tlsph_real d = pt->F[0] * pt->H[0] + pt->F[1] * pt->H[1] + pt->F[2] * pt->H[2];
    if (has_H) {
        tlsphi_take_apart(dim * dim, s->now.H + at, TLSPHI_LANES, H);
        tlsphi_expand(dim, H, d, pt->H);
    }
    pt->d = d;
}
TLSPHI_INLINE void tlsphi_measure_lanes(const tlsph_solver *s, size_t begin, const int dim, const int has_H,
                                        tlsphi_state_lanes *x) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsphi_point pt;
        tlsphi_take_measures(s, begin, l, dim, has_H, &pt);
        x->I1[l] = tlsphi_dot(9, pt.F, pt.F);
        x->I2[l] = tlsphi_dot(9, pt.H, pt.H);
        x->d[l] = pt.d;
    }
}
/* What of the state the laws depend on. */
TLSPHI_INLINE void tlsphi_load_tile(const tlsph_solver *s, const tlsphi_material *m, size_t begin, const int dim,
                                    tlsphi_state_lanes *x) {
    const size_t D = (size_t)dim;
    const tlsph_real per_rho = 1 / m->rho, half = m->rho / 2;
    tlsphi_transpose(s->now.p + D * begin, D, x->v);
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsph_real square = 0;
        TLSPHI_UNROLL for (size_t i = 0; i < D; i++) {
            const tlsph_real v = x->v[i * TLSPHI_LANES + l] * per_rho;
            x->v[i * TLSPHI_LANES + l] = v;
            square += v * v;
        }
        x->kinetic[l] = square * half;
    }
    if (s->has_H) tlsphi_measure_lanes(s, begin, dim, 1, x);
    else tlsphi_measure_lanes(s, begin, dim, 0, x);
    const tlsph_real theta_R = m->theta_R, *J = s->has_J ? s->now.J + begin : x->d;
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        x->J[l] = J[l];
        x->theta[l] = theta_R; /* isothermal; others follow */
    }
}
/* `mooney` and `entropic` are constants here and below. */
TLSPHI_INLINE void tlsphi_deviate_lanes(const tlsphi_material *given, const int mooney, size_t tiles,
                                        tlsphi_state_lanes *x) {
    tlsphi_material m = *given;
    m.mooney = mooney;
    for (; tiles > 0; tiles--, x++)
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
            const tlsphi_deviator dev = tlsphi_deviatoric(&m, x->I1[l], x->I2[l], x->d[l]);
            const tlsphi_invariants spread = tlsphi_principal_bounds(x->I1[l], x->I2[l], x->d[l]);
            x->psi[l] = dev.psi;
            x->a[l] = dev.a;
            x->b[l] = mooney ? dev.b : 0;
            x->c[l] = dev.c;
            x->J23[l] = dev.J23;
            x->per_J[l] = dev.per_J;
            x->L1[l] = spread.L1;
            x->LH[l] = spread.LH;
            x->l3[l] = mooney ? spread.l3 : 0; /* a division */
        }
}
TLSPHI_INLINE tlsphi_deviator tlsphi_take_deviator(const tlsphi_state_lanes *x, size_t l) {
    tlsphi_deviator dev;
    dev.psi = x->psi[l];
    dev.a = x->a[l];
    dev.b = x->b[l];
    dev.c = x->c[l];
    dev.J23 = x->J23[l];
    dev.per_J = x->per_J[l];
    return dev;
}
TLSPHI_INLINE void tlsphi_respond_lanes(const tlsph_solver *s, const tlsphi_material *given, const int entropic,
                                        const int mooney, size_t tiles, tlsphi_state_lanes *x) {
    const tlsph_real stiffness = s->has_J ? s->drift_stiffness * given->mu : 0, scale = s->drift_scale;
    const int heated = s->thermal != TLSPH_ISOTHERMAL;
    tlsphi_material m = *given;
    m.entropic = entropic;
    m.mooney = mooney;
    m.q = 1;
    for (; tiles > 0; tiles--, x++)
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
            const tlsphi_invariants spread = {x->I1[l], x->I2[l], x->d[l], x->L1[l], x->LH[l], x->l3[l]};
            tlsphi_point pt;
            pt.d = x->d[l];
            pt.J = x->J[l];
            pt.dev = tlsphi_take_deviator(x, l);
            tlsphi_respond_scalars(&m, &pt.dev, &spread, pt.J, heated, &pt.r);
            x->drift[l] = tlsphi_add_drift(&m, stiffness, scale, &pt);
            x->ratio[l] = pt.drift_ratio;
            x->energy[l] = pt.r.energy;
            x->entropy[l] = pt.r.entropy;
            x->e_J[l] = pt.r.e_J;
            x->eta_J[l] = pt.r.eta_J;
            TLSPHI_UNROLL for (size_t i = 0; i < 2; i++) {
                x->p_modulus[i * TLSPHI_LANES + l] = pt.r.p_modulus[i];
                x->s_modulus[i * TLSPHI_LANES + l] = pt.r.s_modulus[i];
            }
        }
}
/* theta is not finite where E, or what it is compared with, is not. */
static void tlsphi_temperature_lanes(const tlsph_solver *s, const tlsphi_material *m, size_t begin,
                                     tlsphi_state_lanes *x) {
    const tlsph_real theta_R = m->theta_R, per_c_v = 1 / m->c_v, *E = s->now.E + begin;
    if (s->thermal == TLSPH_ENERGY) {
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
            x->theta[l] = theta_R + (E[l] - x->kinetic[l] - x->energy[l]) * per_c_v;
        return;
    }
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        const tlsph_real heat = (E[l] - x->entropy[l]) * per_c_v;
        x->theta[l] = theta_R * tlsphi_exp(heat) + 0 * heat;
    }
}
/* Writes P and H to their rows, the wave speeds, and `all`, which is finite only if all of them are. */
TLSPHI_INLINE void tlsphi_conclude_lanes(const tlsph_solver *s, const tlsphi_material *given, const int dim,
                                         const int has_H, const int entropic, const int mooney, size_t begin,
                                         size_t tiles, tlsphi_state_lanes *x) {
    const size_t dd = (size_t)(dim * dim);
    tlsphi_material m = *given;
    m.entropic = entropic;
    m.mooney = mooney;
    for (; tiles > 0; tiles--, x++, begin += TLSPHI_LANES) {
        tlsph_real *const P = tlsphi_at(s, s->rows.PM, begin), *const A = tlsphi_at(s, s->rows.A, begin);
        tlsph_real *const wave = tlsphi_at(s, s->rows.wave, begin);
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
            tlsphi_point pt;
            tlsph_real out[9], theta = x->theta[l];
            tlsphi_take_measures(s, begin, l, dim, has_H, &pt);
            pt.dev = tlsphi_take_deviator(x, l);
            tlsphi_respond_tensors(&m, &pt.dev, pt.F, pt.H, &pt.r);
            tlsphi_take_apart(2, x->p_modulus + l, TLSPHI_LANES, pt.r.p_modulus);
            tlsphi_take_apart(2, x->s_modulus + l, TLSPHI_LANES, pt.r.s_modulus);
            pt.Sigma_J = x->drift[l];
            tlsphi_conclude(&m, theta, x->e_J[l] - theta * x->eta_J[l], &pt);
            tlsphi_shrink(dim, pt.P, out);
            TLSPHI_UNROLL for (size_t i = 0; i < dd; i++) P[i * TLSPHI_ROW + l] = out[i];
            tlsphi_shrink(dim, pt.H, out);
            TLSPHI_UNROLL for (size_t i = 0; i < dd; i++) A[i * TLSPHI_ROW + l] = out[i];
            wave[l] = x->c_p[l] = pt.c_p;
            wave[TLSPHI_ROW + l] = pt.c_s;
            x->Sigma_J[l] = pt.Sigma_J;
            tlsph_real all = x->d[l] + x->J[l] + theta + pt.c_p + x->kinetic[l];
            TLSPHI_UNROLL for (int i = 0; i < 9; i++) all += pt.P[i];
            x->all[l] = all;
        }
    }
}
#define TLSPHI_CONCLUDE(dim, H, entropic, mooney)                                                                      \
    static void tlsphi_conclude_##dim##H##entropic##mooney(const tlsph_solver *s, const tlsphi_material *m,            \
                                                           size_t begin, size_t tiles, tlsphi_state_lanes *x) {        \
        tlsphi_conclude_lanes(s, m, dim, H, entropic, mooney, begin, tiles, x);                                        \
    }
#define TLSPHI_CONCLUSIONS(X)                                                                                          \
    X(2, 0, 0, 0) X(2, 0, 0, 1) X(2, 0, 1, 0) X(2, 0, 1, 1) X(2, 1, 0, 0) X(2, 1, 1, 0)                                \
    X(3, 0, 0, 0) X(3, 0, 0, 1) X(3, 0, 1, 0) X(3, 0, 1, 1) X(3, 1, 0, 0) X(3, 1, 1, 0)
TLSPHI_CONCLUSIONS(TLSPHI_CONCLUDE)
#define TLSPHI_CASE(dim, H, entropic, mooney)                                                                          \
    case 8 * (dim == 3) + 4 * H + 2 * entropic + mooney:                                                               \
        tlsphi_conclude_##dim##H##entropic##mooney(s, m, begin, tiles, x);                                             \
        break;

static void tlsphi_constitute_tiles(const tlsph_solver *s, const tlsphi_material *m, size_t begin, size_t tiles,
                                    tlsphi_state_lanes *x) {
    if (m->mooney) tlsphi_deviate_lanes(m, 1, tiles, x);
    else tlsphi_deviate_lanes(m, 0, tiles, x);
    if (m->entropic && m->mooney) tlsphi_respond_lanes(s, m, 1, 1, tiles, x);
    else if (m->entropic) tlsphi_respond_lanes(s, m, 1, 0, tiles, x);
    else if (m->mooney) tlsphi_respond_lanes(s, m, 0, 1, tiles, x);
    else tlsphi_respond_lanes(s, m, 0, 0, tiles, x);
    for (size_t i = 0; s->thermal && i < tiles; i++) tlsphi_temperature_lanes(s, m, begin + i * TLSPHI_LANES, x + i);
    switch ((s->dim == 3 ? 8 : 0) + (s->has_H ? 4 : 0) + (m->entropic ? 2 : 0) + (m->mooney ? 1 : 0)) {
        TLSPHI_CONCLUSIONS(TLSPHI_CASE)
    default: break; /* no laws of Mooney with H, see tlsphi_count_tiles */
    }
}
#undef TLSPHI_CASE
#undef TLSPHI_CONCLUSIONS
TLSPHI_INLINE void tlsphi_put_lanes(const int rows, const tlsph_real *lanes, tlsph_real *row) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
        TLSPHI_UNROLL for (size_t i = 0; i < (size_t)rows; i++) row[i * TLSPHI_ROW + l] = lanes[i * TLSPHI_LANES + l];
}
/* P M and H M in the rows of a tile. */
TLSPHI_INLINE void tlsphi_correct_rows(const tlsph_real *M, tlsph_real *row, const int dim) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsph_real A[9], B[9], C[9];
        tlsphi_take_rows(dim * dim, row + l, A);
        TLSPHI_UNROLL for (int i = 0; i < dim * dim; i++) B[i] = M[(size_t)i * TLSPHI_LANES + l];
        tlsphi_product(dim, A, B, C);
        TLSPHI_UNROLL for (int i = 0; i < dim * dim; i++) row[(size_t)i * TLSPHI_ROW + l] = C[i];
    }
}
static tlsph_real tlsphi_least_lane(const tlsph_real *lanes) {
    tlsph_real least = 1 / TLSPHI_TINY;
    for (size_t l = 0; l < TLSPHI_LANES; l++) least = tlsphi_min(least, lanes[l]);
    return least;
}
/* Asked here and not in tlsphi_conclude_lanes: SSE2 compares no integers of 64 bits, and no vectors would be made of that. */
static int tlsphi_is_possible(const tlsphi_state_lanes *x) {
    int good = 1;
    for (size_t l = 0; l < TLSPHI_LANES; l++)
        good &= (x->d[l] > 0) & (x->J[l] > 0) & (x->theta[l] > 0) & tlsphi_finite(x->all[l]);
    return good;
}
/* Lowers dt to the longest steps of the particles of a tile, but for cfl: as tlsphi_particle_step. */
static void tlsphi_tile_step(const tlsph_solver *s, size_t begin, const tlsphi_state_lanes *x, tlsph_real *dt) {
    const tlsph_real *tau = s->tau + begin;
    tlsph_real own[TLSPHI_LANES];
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) own[l] = tau[l] / tlsphi_max(x->c_p[l], TLSPHI_TINY);
    for (size_t l = 0; s->beside && l < TLSPHI_LANES; l++) own[l] *= s->beside[2 * (begin + l)];
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) dt[l] = tlsphi_min(dt[l], own[l]);
}
/* The diffusive limit; before P and H are corrected. h is taken first, because with a choice of pointers gcc makes no
   vectors. */
TLSPHI_INLINE void tlsphi_tile_heat_step(tlsph_solver *s, tlsphi_block *block, size_t begin, const tlsphi_material *m,
                                         const tlsphi_state_lanes *x, const int dim) {
    const tlsph_real *tau = s->tau + begin, *row = tlsphi_at(s, s->rows.A, begin);
    tlsph_real dt[TLSPHI_LANES], h[TLSPHI_LANES];
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) h[l] = s->beside ? s->beside[2 * (begin + l) + 1] : m->h;
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsph_real in_plane[9], H[9], HtH[9];
        tlsphi_take_rows(dim * dim, row + l, in_plane);
        tlsphi_expand(dim, in_plane, dim == 3 ? 0 : in_plane[0] * in_plane[3] - in_plane[1] * in_plane[2], H);
        tlsphi_product_transposed(3, H, H, HtH); /* H H^T: its eigenvalues are those of H^T H */
        const tlsph_real bound = tlsphi_largest_bound(HtH[0] + HtH[4] + HtH[8], tlsphi_dot(9, HtH, HtH));
        dt[l] = tau[l] * tau[l] * x->J[l] / tlsphi_max(h[l] * bound, TLSPHI_TINY);
    }
    const double per = 2 * dim, sharp = s->sharp ? TLSPHI_SHARP_STEP * TLSPHI_SHARP_STEP : 1;
    const double heat = 0.8 * (double)m->c_v * sharp * (double)tlsphi_least_lane(dt) / per;
    block->heat_step = tlsphi_dmin(block->heat_step, heat);
    if (!s->super.most) block->time_step = tlsphi_dmin(block->time_step, heat);
}
/* P of the particles in mirrors. */
TLSPHI_INLINE void tlsphi_mirror_tile(const tlsph_solver *s, size_t begin, const int dim) {
    for (size_t a = begin; a < begin + TLSPHI_LANES; a++)
        for (const tlsphi_mirror *mirror = tlsphi_mirrors_of(s, a); mirror && mirror->particle == a; mirror++) {
            tlsph_real P[9];
            tlsphi_row_get(s, s->rows.PM, dim * dim, a, P);
            tlsphi_mirror_tensor(dim, mirror, P);
            tlsphi_row_put(s, s->rows.PM, dim * dim, a, P);
        }
}
/* Writes what neighbours read, and lowers dt and the limits of heat; or returns 0 if a state is impossible. */
TLSPHI_INLINE int tlsphi_publish_tile(tlsph_solver *s, tlsphi_block *block, const tlsphi_material *m, size_t begin,
                                      const int dim, const tlsphi_state_lanes *x, tlsph_real *dt) {
    const tlsphi_rows *r = &s->rows;
    if (!tlsphi_is_possible(x)) return 0;
    tlsphi_put_lanes(dim, x->v, tlsphi_at(s, r->v, begin));
    if (!s->projection) tlsphi_put_lanes(dim, x->v, tlsphi_at(s, r->w, begin));
    if (s->has_J) tlsphi_put_lanes(1, x->ratio, tlsphi_at(s, r->wave + 3, begin));
    if (s->has_J) tlsphi_put_lanes(1, x->Sigma_J, tlsphi_at(s, r->S, begin));
    if (s->thermal) tlsphi_put_lanes(1, x->theta, tlsphi_theta(s, begin));
    if (s->conducts) {
        tlsph_real *h_J = tlsphi_at(s, r->h_J, begin);
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) h_J[l] = m->h / x->J[l];
        tlsphi_tile_heat_step(s, block, begin, m, x, dim);
    }
    if (s->mirror_of) tlsphi_mirror_tile(s, begin, dim);
    if (s->M) {
        tlsphi_correct_rows(tlsphi_correction_lanes(s, begin), tlsphi_at(s, r->PM, begin), dim);
        tlsphi_correct_rows(tlsphi_correction_lanes(s, begin), tlsphi_at(s, r->A, begin), dim);
    }
    tlsphi_tile_step(s, begin, x, dt);
    return 1;
}
/* The particles [begin, end), one by one. */
static int tlsphi_evaluate_particles(tlsph_solver *s, tlsphi_block *block, size_t begin, size_t end) {
    tlsph_response user[TLSPHI_LANES];
    tlsphi_elastic elastic[TLSPHI_LANES];
    if (s->has_user) tlsphi_user_responses(s, begin, end, user);
    if (s->now.plastic) tlsphi_elastic_strains(s, s->now.plastic, begin, end, elastic);
    for (size_t a = begin; a < end; a++) {
        const tlsphi_known known = {user + (a - begin), elastic + (a - begin)};
        if (!tlsphi_evaluate_particle(s, block, a, &known)) return 0;
    }
    return 1;
}
/* How many tiles from `begin` on go by lanes together. */
static size_t tlsphi_count_tiles(const tlsph_solver *s, const tlsphi_block *block, size_t begin) {
    const tlsphi_material *m = tlsphi_material_of(s, begin);
    const size_t whole = begin % TLSPHI_LANES ? 0 : (block->end - begin) / TLSPHI_LANES;
    const size_t most = whole < TLSPHI_RUN ? whole : TLSPHI_RUN;
    if (s->audit || s->incompressible || s->least_stretch || s->metal || s->coupling == TLSPH_JOINT_AS_PRINTED ||
        !tlsphi_has_invariants(m->kind) || m->q != 1 || (s->has_H && m->mooney))
        return 0;
    for (size_t i = 0; s->material_of && i < most * TLSPHI_LANES; i++)
        if (tlsphi_material_of(s, begin + i) != m) return i / TLSPHI_LANES;
    return most;
}
TLSPHI_INLINE int tlsphi_evaluate_tiles(tlsph_solver *s, tlsphi_block *block, size_t begin, size_t tiles,
                                        const int dim) {
    const tlsphi_material *m = tlsphi_material_of(s, begin);
    tlsphi_state_lanes x[TLSPHI_RUN];
    tlsph_real dt[TLSPHI_LANES];
    for (size_t l = 0; l < TLSPHI_LANES; l++) dt[l] = 1 / TLSPHI_TINY;
    for (size_t i = 0; i < tiles; i++) tlsphi_load_tile(s, m, begin + i * TLSPHI_LANES, dim, x + i);
    tlsphi_constitute_tiles(s, m, begin, tiles, x);
    for (size_t i = 0; i < tiles; i++) {
        const size_t a = begin + i * TLSPHI_LANES;
        if (!tlsphi_publish_tile(s, block, m, a, dim, x + i, dt) &&
            !tlsphi_evaluate_particles(s, block, a, a + TLSPHI_LANES)) /* finds the particle */
            return 0;
    }
    if (s->step_rule == TLSPH_STEP_BY_PARTICLE)
        block->time_step = tlsphi_dmin(block->time_step, (double)s->cfl * (double)tlsphi_least_lane(dt));
    return 1;
}
static void tlsphi_evaluate_block(tlsph_solver *s, tlsphi_block *block) {
    int good = 1;
    block->failed = TLSPHI_NONE;
    block->time_step = block->heat_step = TLSPHI_LARGEST;
    for (size_t begin = block->begin, end; good && begin < block->end; begin = end) {
        const size_t tiles = tlsphi_count_tiles(s, block, begin);
        end = tiles ? begin + tiles * TLSPHI_LANES : tlsphi_tile_end(block, begin);
        if (!tiles) good = tlsphi_evaluate_particles(s, block, begin, end);
        else if (s->dim == 3) good = tlsphi_evaluate_tiles(s, block, begin, tiles, 3);
        else good = tlsphi_evaluate_tiles(s, block, begin, tiles, 2);
    }
}
static void tlsphi_pair_step_block(tlsph_solver *s, tlsphi_block *block); /* [PAIR-STEP] */

/* After all blocks: the first failed one or NULL. */
static const tlsphi_block *tlsphi_evaluated(tlsph_solver *s) {
    for (size_t i = 0; i < s->blocks; i++)
        if (s->block[i].failed != TLSPHI_NONE) return s->block + i;
    if (s->step_rule != TLSPH_STEP_BY_PARTICLE) tlsphi_run(s, tlsphi_pair_step_block);
    return NULL;
}
static const tlsphi_block *tlsphi_evaluate(tlsph_solver *s) {
    tlsphi_run(s, tlsphi_evaluate_block);
    return tlsphi_evaluated(s);
}

/* ==== [PAIR-STEP] ==================================================================================================
   The time step of 002 (31), (32): alpha_CFL min r_ab / c_ab over the pairs, with the current distance r_ab and
   c_ab = c_lin / (mean of the least stretches of a and b). The reference speed knows nothing of stiffening. */

static void tlsphi_pair_step_block(tlsph_solver *s, tlsphi_block *block) {
    const size_t D = (size_t)s->dim;
    for (size_t a = block->begin; a < block->end; a++)
        for (size_t k = s->first[a]; k < s->first[a + 1]; k++) {
            const size_t b = s->neighbour[k];
            const double c_a = (double)tlsphi_material_of(s, a)->c_linear, c_b = (double)tlsphi_material_of(s, b)->c_linear;
            double square = 0, stretch = 1;
            for (size_t i = 0; i < D; i++) {
                const double d = (double)s->now.x[D * b + i] - (double)s->now.x[D * a + i];
                square += d * d;
            }
            if (s->step_rule == TLSPH_STEP_BY_PAIR) stretch = (double)(s->least_stretch[a] + s->least_stretch[b]) / 2;
            block->time_step = tlsphi_dmin(block->time_step,
                                           (double)s->cfl * sqrt(square) * stretch / tlsphi_dmax(c_a, c_b));
        }
}

/* ==== [DISSIPATION] ================================================================================================
   The jump of v between two particles is damped along n = c/|c| with the p speed and across with the s speed
   (000-73, 74). Raw jumps are first order. Reconstruction takes the linear part away: with d = X_b - X_a,
     Dr = Dv - (grad v_a + grad v_b)/2 d,
   which is third order in smooth flow. Then D_p . Dv >= 0 no longer holds by itself. The limiter takes of the normal part
   minmod(n.Dr, n.Dv), nothing where the signs differ, else the smaller; of the tangential part t of Dr the share t.Dv/t.t
   within 0 and 1. Energy goes with it without division by temperature differences:
     D_E = (v_a + v_b)/2 . D_p + (Sigma_a + Sigma_b)/2 D_J,
   so that each side receives half of the production Dv . D_p + DS D_J >= 0 as heat. The printed form (66), (76) uses
   jumps of v theta_R/theta: a translating body with uneven temperature is pushed, and D_E is singular.

   Rigid rotation. In a bent body that turns, Dr is not zero: the dissipation would brake the turn, the projection would
   push it on again, and the heat in between would come from nowhere. So v stands here for the velocity w that remains
   when the rigid motion of the body is taken away (see [PROJECTION]). A turning frame then changes nothing.

   TLSPH_SELF_ADJOINT. The limiter drops what would feed the motion and keeps the rest: where Dr is chance, as the errors of
   gradients in clouds are, half of it dissipates all the same. Without a limiter let R be the linear map from v to all Dr.
   The force -R^T S R v dissipates sum Dr.S_p Dr >= 0 whatever the state, and fourth order small: the pairs give D_p = S_p Dr
   as above, and the slopes' part, by the adjoint of the gradient, is that of a stress
     P_D,a = -1/(2 V_a) sum_b D_p,ab (x) d_ab   beside P_a in the forces, not in E.
   A pair heats by Dr.D_p. Sigma_J keeps the limiter. Column in torsion at 400 rad/s, 0.05 s, n = 5: a cloud keeps 0.72 of its
   energy, the lattice 0.71, the tips differ by 0.8 %; with the limiter 0.35 and 0.64, and 10 %.

   Metals (all materials TLSPH_VON_MISES). A foot that is squeezed to a quarter has waves four times as fast along it and
   half as fast across; the bound over all directions would damp the flow across eight times too much. All moduli are those
   of the current shape there, so the speed along N is c |H N|/max |H N| exactly, and |H N| = |c|/|C|. Fronts are not
   sought: plastic flow over a few spacings looks like one, and yielding bounds the overshoot. Taylor bar, 4 spacings a
   radius: the final radius is 6.35 mm with fronts, 6.6 without, for 7.0. */

#define TLSPHI_FRONT_LOW 0.0015 /* approach over p speed from which a pair may be a front; full strength at twice it */
#define TLSPHI_FRONT_GAIN 4 /* on symmetric impacts at 0.1 and 0.3 c_p: overshoot 2 to 3 %, 25 to 45 % without */

/* The limiter. One that drops Dr or keeps it whole, by the sign of Dr . Dv, is as accurate; but by symmetry Dv may be 0
   but for round-off where Dr is not. Chance then throws the switch, and a symmetric body loses its symmetry: punch_test at
   CFL 0.5 by 1 % after 0.42 s, against 1e-7 with this continuous one, and energy and entropy form differed by 1.5 %
   instead of 0.04 %. Nor is the jump ever more than the raw one, that of the first-order dissipation. */

/* The share of t that is damped: product = t . Dv, square = t . t. */
TLSPHI_INLINE tlsph_real tlsphi_limited_share(tlsph_real product, tlsph_real square) {
    return tlsphi_max(0, tlsphi_min(1, product / (square + TLSPHI_TINY)));
}
/* 0 where the signs differ, else the smaller in size. */
TLSPHI_INLINE tlsph_real tlsphi_minmod(tlsph_real a, tlsph_real b) {
    return tlsphi_max(tlsphi_min(b, 0), tlsphi_min(a, tlsphi_max(b, 0)));
}

/* Density in the impedance of a pair: the mean, but at most twice the lighter one. With the plain mean the lighter side is
   stopped in less than a step where its neighbour has many times its density, and nothing is stable. */
TLSPHI_INLINE tlsph_real tlsphi_pair_density(tlsph_real a, tlsph_real b) {
    return tlsphi_min((a + b) / 2, 2 * tlsphi_min(a, b));
}

/* S_p (jump): half_impedance = rho |C| / 2; Dr: the jump without its linear part; n: any vector along the normal, inverse
   1/(n.n); front in [0, 1] gives the normal part of the raw jump back, where with_front is not 0. */
TLSPHI_INLINE void tlsphi_damp_velocity(const int dim, const int kind, const int with_front, const tlsph_real *Dv,
                                        const tlsph_real *Dr, const tlsph_real *n, tlsph_real inverse, tlsph_real front,
                                        tlsph_real half_impedance, tlsph_real c_p, tlsph_real c_s, tlsph_real *D_p) {
    const tlsph_real *jump = kind == TLSPH_FIRST_ORDER || kind == TLSPH_AS_PRINTED ? Dv : Dr;
    tlsph_real normal = tlsphi_dot(dim, n, jump), across = half_impedance * c_s, tangent[3];
    TLSPHI_UNROLL for (int i = 0; i < dim; i++) tangent[i] = jump[i] - normal * inverse * n[i];
    if (kind == TLSPH_LIMITED) {
        const tlsph_real raw = tlsphi_dot(dim, n, Dv);
        /* tangent is perpendicular to n, so its product with Dv is that with the tangential part of Dv */
        across *= tlsphi_limited_share(tlsphi_dot(dim, tangent, Dv), tlsphi_dot(dim, tangent, tangent));
        normal = tlsphi_minmod(normal, raw);
        if (with_front) normal += front * (raw - normal);
    }
    const tlsph_real along = half_impedance * c_p * normal * inverse;
    TLSPHI_UNROLL for (int i = 0; i < dim; i++) D_p[i] = across * tangent[i] + along * n[i];
}
/* The jump of a scalar that is damped; Dr: with its linear part taken away. */
TLSPHI_INLINE tlsph_real tlsphi_damped_jump(int kind, const int with_front, tlsph_real D, tlsph_real Dr,
                                            tlsph_real front) {
    if (kind == TLSPH_LIMITED || kind == TLSPH_SELF_ADJOINT) {
        const tlsph_real limited = tlsphi_minmod(Dr, D);
        return with_front ? limited + front * (D - limited) : limited;
    }
    return kind == TLSPH_RECONSTRUCTED ? Dr : D;
}

/* Fronts. Behind a shock Dr is small although one of the two gradients belongs to the other side: reconstruction alone
   overshoots. `front` in [0, 1] tells how much of the raw jump is put back. It needs two things: the particles approach
   each other by more than TLSPHI_FRONT_LOW of the p speed (raw < 0), and the jumps beyond them, 2 slope - raw, are unlike
   raw. For rho = beyond/raw the van Albada function phi = rho (rho + 1)/(rho^2 + 1) is 1 +- O(h) in smooth flow and
   0 at the foot of a front, so front is O(h^2) where there is none, and exactly 0 in gentle flow. */
TLSPHI_INLINE tlsph_real tlsphi_smoothness(tlsph_real raw, tlsph_real slope) {
    const tlsph_real beyond = 2 * slope - raw;
    return tlsphi_max(0, tlsphi_min(1, beyond * (beyond + raw) / (beyond * beyond + raw * raw)));
}
TLSPHI_INLINE tlsph_real tlsphi_front(tlsph_real raw, tlsph_real slope_a, tlsph_real slope_b, tlsph_real c_p) {
    const tlsph_real rough = 1 - tlsphi_min(tlsphi_smoothness(raw, slope_a), tlsphi_smoothness(raw, slope_b));
    const tlsph_real strength = -raw / (TLSPHI_R(TLSPHI_FRONT_LOW) * c_p) - 1;
    const tlsph_real front = tlsphi_min(1, strength) * tlsphi_min(1, TLSPHI_R(TLSPHI_FRONT_GAIN) * rough * rough);
    return tlsphi_choose(strength > 0, front, 0); /* otherwise `rough` may be 0/0 */
}
/* S_J (000-73) times the share a_J, weakened where the drift potential is stiff; cc = |c|^2, CC = |C|. */
TLSPHI_INLINE tlsph_real tlsphi_jacobian_factor(tlsph_real a_J, tlsph_real cc, tlsph_real CC, tlsph_real rho,
                                                tlsph_real c_p, tlsph_real mean_ratio) {
    return a_J * cc * tlsphi_inverse_or_0(2 * rho * c_p * CC * (1 + mean_ratio)); /* 0 where C is */
}

/* (66) and (76), with x/(x^2 + 1e-12) for 1/x where the temperatures meet. */
static void tlsphi_dissipation_as_printed(const tlsph_pair_side *a, const tlsph_pair_side *b, const tlsph_real n[3],
                                          tlsph_real half_impedance, tlsph_real c_p, tlsph_real c_s, tlsph_real S_J,
                                          tlsph_pair_flux *out) {
    const tlsph_real Xa = a->theta / a->theta_R, Xb = b->theta / b->theta_R, x = 1 / Xa - 1 / Xb;
    tlsph_real jump[3], Dv[3], D_v[3];
    for (int i = 0; i < 3; i++) {
        Dv[i] = b->velocity[i] - a->velocity[i];
        jump[i] = b->velocity[i] / Xb - a->velocity[i] / Xa;
    }
    const tlsph_real DS = b->Sigma_J - a->Sigma_J, jump_S = b->Sigma_J / Xb - a->Sigma_J / Xa;
    tlsphi_damp_velocity(3, TLSPH_AS_PRINTED, 0, jump, jump, n, 1, 0, half_impedance, c_p, c_s, out->D_p);
    tlsphi_damp_velocity(3, TLSPH_AS_PRINTED, 0, Dv, Dv, n, 1, 0, half_impedance, c_p, c_s, D_v);
    out->D_J = S_J * jump_S;
    const tlsph_real wanted = tlsphi_dot(3, Dv, D_v) + S_J * DS * DS;
    const tlsph_real bracket = wanted - tlsphi_dot(3, jump, out->D_p) - S_J * jump_S * jump_S;
    out->D_E = bracket * x / (x * x + TLSPHI_R(1e-12));
    out->production = wanted;
}

TLSPHI_DEF void tlsph_pair_dissipation(tlsph_dissipation kind, const tlsph_pair_side *a, const tlsph_pair_side *b,
                                       const tlsph_real C[3], const tlsph_real c[3], const tlsph_real d[3],
                                       tlsph_real a_J, tlsph_pair_flux *out) {
    const tlsph_real cc = tlsphi_dot(3, c, c), CC = tlsphi_sqrt(tlsphi_dot(3, C, C)), length = tlsphi_sqrt(cc);
    const tlsph_real rho = (a->density + b->density) / 2, c_p = (a->c_p + b->c_p) / 2, c_s = (a->c_s + b->c_s) / 2;
    tlsph_real n[3], Dv[3], Dr[3];
    memset(out, 0, sizeof *out);
    if (kind == TLSPH_NO_DISSIPATION || !(CC > 0) || !(length > 0)) return;
    const tlsph_real S_J = tlsphi_jacobian_factor(a_J, cc, CC, rho, c_p, (a->drift_ratio + b->drift_ratio) / 2);
    for (int i = 0; i < 3; i++) {
        n[i] = c[i] / length;
        Dv[i] = b->velocity[i] - a->velocity[i];
        Dr[i] = Dv[i] -
                (tlsphi_dot(3, a->velocity_gradient + 3 * i, d) + tlsphi_dot(3, b->velocity_gradient + 3 * i, d)) / 2;
    }
    if (kind == TLSPH_AS_PRINTED) {
        tlsphi_dissipation_as_printed(a, b, n, rho * CC / 2, c_p, c_s, S_J, out);
        return;
    }
    const tlsph_real raw = tlsphi_dot(3, n, Dv);
    tlsph_real front = 0;
    if (kind == TLSPH_LIMITED && raw < -TLSPHI_R(TLSPHI_FRONT_LOW) * c_p) {
        tlsph_real Gd_a[3], Gd_b[3];
        tlsphi_multiply(3, a->velocity_gradient, d, Gd_a);
        tlsphi_multiply(3, b->velocity_gradient, d, Gd_b);
        front = tlsphi_front(raw, tlsphi_dot(3, n, Gd_a), tlsphi_dot(3, n, Gd_b), c_p);
    }
    const tlsph_real DS = b->Sigma_J - a->Sigma_J;
    const tlsph_real DSr = DS - (tlsphi_dot(3, a->Sigma_J_gradient, d) + tlsphi_dot(3, b->Sigma_J_gradient, d)) / 2;
    tlsphi_damp_velocity(3, (int)kind, 1, Dv, Dr, n, 1, front, tlsphi_pair_density(a->density, b->density) * CC / 2,
                         c_p, c_s, out->D_p);
    out->D_J = S_J * tlsphi_damped_jump((int)kind, 1, DS, DSr, front);
    for (int i = 0; i < 3; i++) out->D_E += (a->velocity[i] + b->velocity[i]) / 2 * out->D_p[i];
    out->D_E += (a->Sigma_J + b->Sigma_J) / 2 * out->D_J;
    out->production = tlsphi_dot(3, Dv, out->D_p) + DS * out->D_J;
}

/* ==== [SURFACES] ===================================================================================================
   Conditions where particles lie behind the surface. A particle owns a share of it, in parts of different normals, with area
   vector B, moment T = integral of n (x) (X - X_a), middle X_a + o. There a field is

     f_o = f_a + grad f_a o,   grad f_a = 1/V_a sum_b (f_b - f_a)/2 (x) M_a g_ab,   so   f_o = f_a + sum_b y_b (f_b - f_a).

   A load t on the part acts by the same weights, y_b t on b and the rest on a: its power is t.v_o and its torque about x_o
   exactly, and in a uniform stress with t = P B the particle is in balance, because M_a = V (V I - T)^-1.
   A prescribed velocity u enters the gradient, and by the adjoint of that the wall pulls with the stress of the particle:

     grad v += S [(u - v_a) (x) B - grad v_a T^T] / V_a  (S (u - v_o) (x) B/V where it is flat),   force on the part S P_a B,

   S: the components that are held. Its power is that of the wall, so E stays exact. Linear fields and uniform stress are
   exact for any u and S, so parts of different conditions may meet in a particle. The wall damps, too, with half of the
   impedance as the particle feels it: D = rho |B|/(2 k^2) (c_p nn + c_s (I - nn)) S (u - v_o), k = 1 - sum_b y_b, heat
   D.(u - v_o) >= 0. Without k^2 clamped corners were unstable.
   At a mirror (roller, tangentially fixed) the other components are even: their v_o is v_a + grad v_a (I - NN) o, which halves
   their slope along N as the image of the particle would.
   A prescribed temperature fixes theta_a so that theta_o is the given one. */

/* Of a force of first moment Z = force (x) arm about X_a: what the k-th neighbour of a takes. */
TLSPHI_INLINE void tlsphi_lever(const tlsph_solver *s, size_t a, size_t k, const tlsph_real *Z, tlsph_real *y) {
    const size_t D = (size_t)s->dim;
    tlsph_real C[3];
    tlsphi_correct_vector(s, a, s->dim, s->g + D * k, C);
    tlsphi_any_multiply(s->dim, Z, C, y);
    for (size_t i = 0; i < D; i++) y[i] /= 2 * s->V[a];
}
/* y_b of the k-th neighbour for o = arm. */
static tlsph_real tlsphi_share_behind(const tlsph_solver *s, size_t a, size_t k, const tlsph_real *arm) {
    tlsph_real C[3] = {0, 0, 0};
    tlsphi_correct_vector(s, a, s->dim, s->g + (size_t)s->dim * k, C);
    return tlsphi_any_dot(s->dim, arm, C) / (2 * s->V[a]);
}
/* The first held part of a particle >= a. */
static tlsphi_held_part *tlsphi_find_held_part(const tlsph_solver *s, size_t a) {
    return s->held_part + tlsphi_find_particle(s->held_part, s->held_parts, sizeof *s->held_part, a);
}
/* S v */
static void tlsphi_held_components(int dim, const tlsphi_held_part *h, tlsph_real *v) {
    const tlsph_real along = tlsphi_any_dot(dim, v, h->N);
    for (int i = 0; h->along && i < dim; i++) v[i] = h->along > 0 ? along * h->N[i] : v[i] - along * h->N[i];
}
/* P_a without M. */
static void tlsphi_stress_behind(const tlsph_solver *s, const tlsphi_held_part *h, tlsph_real *P) {
    tlsph_real PM[9];
    tlsphi_row_get(s, s->rows.PM, s->dim * s->dim, h->particle, PM);
    tlsphi_any_product(s->dim, PM, h->part.W, P);
}
/* The jump u - v_o by S and, with the other components of a mirror, times a column of B; arm: the same column of T^T. */
static void tlsphi_held_jump(const tlsph_solver *s, const tlsphi_held_part *h, const tlsph_real *G, tlsph_real B,
                             const tlsph_real *arm, tlsph_real *jump) {
    const int dim = s->dim;
    const tlsph_real deep = tlsphi_any_dot(dim, arm, h->N);
    tlsph_real v[3] = {0, 0, 0}, slope[3] = {0, 0, 0}, held[3] = {0, 0, 0};
    tlsphi_velocity(s, h->particle, v);
    for (int i = 0; i < dim; i++) jump[i] = (h->wanted[i] - v[i]) * B - tlsphi_any_dot(dim, G + dim * i, arm);
    tlsphi_held_components(dim, h, jump);
    if (!h->mirror) return;
    tlsphi_any_multiply(dim, G, h->N, slope);
    memcpy(held, slope, sizeof held);
    tlsphi_held_components(dim, h, held);
    for (int i = 0; i < dim; i++) jump[i] -= (slope[i] - held[i]) * deep;
}
/* Adds the jumps at the held parts [h, end) of one particle to its gradients, and their power to E. */
static void tlsphi_hold_gradient(tlsph_solver *s, tlsphi_held_part *h, const tlsphi_held_part *end) {
    const int dim = s->dim;
    const size_t D = (size_t)dim, a = h->particle;
    size_t apart;
    tlsph_real G[9], P[9], *grad = tlsphi_grad_v(s, a, &apart);
    tlsphi_take_apart(dim * dim, grad, apart, G);
    tlsphi_stress_behind(s, h, P);
    for (; h != end; h++)
        for (size_t j = 0; j <= D; j++) { /* column j of S [...], at last the jump at the middle itself */
            tlsph_real column[3];
            if (j == D) tlsphi_held_jump(s, h, G, 1, h->part.o, h->jump);
            if (j == D) tlsphi_held_components(dim, h, h->jump);
            if (j == D) break;
            tlsphi_held_jump(s, h, G, h->part.B[j], h->part.T + D * j, column);
            for (size_t i = 0; i < D; i++) {
                const tlsph_real change = column[i] / s->V[a];
                grad[(D * i + j) * apart] += change;
                tlsphi_at(s, s->rows.grad_w, a)[(D * i + j) * TLSPHI_ROW] += change;
                if (s->rate_E) s->rate_E[a] += P[D * i + j] * change;
            }
        }
}
/* Force of a held part: S P B and the damping D, with its first moment Z; returns the heat D.jump, W. */
static tlsph_real tlsphi_held_force(const tlsph_solver *s, const tlsphi_held_part *h, tlsph_real *force,
                                    tlsph_real *Z) {
    const int dim = s->dim;
    const size_t D = (size_t)dim, a = h->particle;
    tlsph_real P[9], A[9], H[9], c[3] = {0}, damping[3], wave[3], column[3] = {0}, even[3], moment[9] = {0};
    tlsphi_stress_behind(s, h, P);
    tlsphi_row_get(s, s->rows.A, dim * dim, a, A);
    tlsphi_row_get(s, s->rows.wave, 3, a, wave);
    tlsphi_any_product(dim, A, h->part.W, H);
    tlsphi_any_multiply(dim, H, h->part.B, c);
    const tlsph_real half = h->damping * wave[2] * tlsphi_sqrt(tlsphi_any_dot(dim, h->part.B, h->part.B)) / 2;
    const tlsph_real normal = tlsphi_any_dot(dim, c, h->jump) * tlsphi_inverse_or_0(tlsphi_any_dot(dim, c, c));
    for (size_t i = 0; i < D; i++)
        damping[i] = s->dissipation == TLSPH_NO_DISSIPATION
                         ? 0
                         : half * (wave[1] * h->jump[i] + (wave[0] - wave[1]) * normal * c[i]);
    tlsphi_held_components(dim, h, damping);
    tlsphi_any_multiply(dim, P, h->part.B, force);
    tlsphi_held_components(dim, h, force);
    for (size_t j = 0; j < D; j++) {
        tlsph_real arm[3] = {0, 0, 0};
        for (size_t i = 0; i < D; i++) arm[i] = h->part.T[D * i + j];
        tlsphi_any_multiply(dim, P, arm, column);
        memcpy(even, column, sizeof even);
        tlsphi_held_components(dim, h, column);
        for (size_t i = 0; i < D; i++) {
            Z[D * i + j] = column[i] + damping[i] * h->part.o[j];
            for (size_t k = 0; h->mirror && k < D; k++) moment[D * i + k] += (even[i] - column[i]) * h->N[j] * h->N[k];
        }
    }
    for (size_t i = 0; i < D * D; i++) Z[i] += moment[i];
    for (size_t i = 0; i < D; i++) force[i] += damping[i];
    return tlsphi_any_dot(dim, damping, h->jump);
}
/* Forces of all held parts, after the projection: the surroundings exert them. weight: dt times the stage's share. */
static void tlsphi_held_forces(tlsph_solver *s, double weight) {
    const size_t D = (size_t)s->dim;
    for (const tlsphi_held_part *h = s->held_part, *end = h + s->held_parts; h != end; h++) {
        const size_t a = h->particle;
        tlsph_real force[3] = {0, 0, 0}, Z[9], y[3];
        const tlsph_real heat = tlsphi_held_force(s, h, force, Z);
        s->account.external_work += weight * (double)tlsphi_any_dot(s->dim, force, h->wanted);
        s->account.dissipation += weight * (double)heat;
        for (size_t k = s->first[a]; k < s->first[a + 1]; k++) {
            const size_t b = s->neighbour[k];
            tlsphi_lever(s, a, k, Z, y);
            for (size_t i = 0; i < D; i++) {
                s->rate_p[D * b + i] += y[i] / s->V[b];
                force[i] -= y[i];
            }
        }
        for (size_t i = 0; i < D; i++) s->rate_p[D * a + i] += force[i] / s->V[a];
        if (!s->rate_E) continue;
        const tlsph_real theta = *tlsphi_theta(s, a);
        s->account.dissipation_entropy += weight * (double)(heat / theta);
        if (s->thermal == TLSPH_ENERGY) s->rate_E[a] += heat / s->V[a];
        else if (s->dissipation_heats) s->rate_E[a] += heat / (s->V[a] * theta);
    }
}

/* ==== [GRADIENTS] ==================================================================================================
   grad f_a = 1/V_a sum_b (f_b - f_a)/2 (x) g_ab M_a^T (000-53), for v and, where needed, Sigma_J and theta. */

/* Pairs along an axis of a lattice have vectors of one component (diagonals in a plane two), and need one column of each
   tensor. So the code of a pair has a constant `width`, the components that g and d have, and columns[j], which they are. */
static const size_t tlsphi_columns[8][3] = {{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0},
                                            {2, 0, 0}, {0, 2, 0}, {1, 2, 0}, {0, 1, 2}}; /* by slot.axes; [7]: all */
static const int tlsphi_widths[8] = {1, 1, 1, 2, 1, 2, 2, 3};
TLSPHI_INLINE void tlsphi_take_columns(const int dim, const int width, const size_t *columns, const tlsph_real *at,
                                       const size_t apart, tlsph_real *out) {
    TLSPHI_UNROLL for (size_t i = 0; i < (size_t)dim; i++)
        TLSPHI_UNROLL for (size_t j = 0; j < (size_t)width; j++)
            out[(size_t)width * i + j] = at[((size_t)dim * i + columns[j]) * apart];
}
TLSPHI_INLINE void tlsphi_take_components(const int width, const size_t *columns, const tlsph_real *at,
                                          const size_t apart, tlsph_real *out) {
    TLSPHI_UNROLL for (int j = 0; j < width; j++) out[j] = at[columns[j] * apart];
}

/* The neighbours of a slot, as the address of their row 0: where they lie, or, scattered, in the spare columns of this
   task's own rows, into which the rows first, first + step, ... < end are copied. */
TLSPHI_INLINE const tlsph_real *tlsphi_gather_each(const tlsph_solver *s, const tlsphi_block *block,
                                                   const tlsphi_graph *graph, const tlsphi_slot *slot, int first,
                                                   int end, int step) {
    if (!slot->scattered) return tlsphi_at(s, 0, slot->from);
    tlsph_real *spare = s->row + (size_t)(block - s->block) * (size_t)s->rows.count * TLSPHI_ROW + TLSPHI_BLOCK;
    const tlsph_real *at[TLSPHI_LANES];
    TLSPHI_LANE_BY_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
        at[l] = tlsphi_at(s, 0, graph->gathered[slot->from + l]);
    for (size_t r = (size_t)first; r < (size_t)end; r += (size_t)step) {
        tlsph_real *out = spare + r * TLSPHI_ROW;
        TLSPHI_LANE_BY_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) out[l] = at[l][r * TLSPHI_ROW];
    }
    return spare;
}
TLSPHI_INLINE const tlsph_real *tlsphi_gather(const tlsph_solver *s, const tlsphi_block *block, const tlsphi_graph *graph,
                                              const tlsphi_slot *slot, int first, int end) {
    return tlsphi_gather_each(s, block, graph, slot, first, end, 1);
}
/* Of the tensors only the column `axis`. */
TLSPHI_INLINE const tlsph_real *tlsphi_gather_column(const tlsph_solver *s, const tlsphi_block *block,
                                                     const tlsphi_graph *graph, const tlsphi_slot *slot,
                                                     const tlsphi_rows *r, int axis, const int dim, int end) {
    tlsphi_gather_each(s, block, graph, slot, r->w, r->P, 1);
    tlsphi_gather_each(s, block, graph, slot, r->P + axis, r->wave, dim);
    return tlsphi_gather_each(s, block, graph, slot, r->wave, end, 1);
}
/* The rows [first, end) of the tile itself, close together: that saves an address a row, which a compiler would keep and
   load again for every pair. */
TLSPHI_INLINE void tlsphi_take_tile(const tlsph_real *row, int first, int end, tlsph_real *out) {
    for (size_t i = (size_t)first; i < (size_t)end; i++)
        memcpy(out + i * TLSPHI_LANES, row + i * TLSPHI_ROW, TLSPHI_LANES * sizeof *out);
}
/* Sums of a tile start from 0, and are handed on; in these forms, because for memset and memcpy of many rows compilers
   call what takes longer than the stores. */
TLSPHI_INLINE void tlsphi_clear_lanes(const int rows, tlsph_real *lanes) {
    TLSPHI_LANE_BY_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
        TLSPHI_UNROLL for (int i = 0; i < rows; i++) lanes[(size_t)i * TLSPHI_LANES + l] = 0;
}
TLSPHI_INLINE void tlsphi_copy_lanes(const int rows, const tlsph_real *from, tlsph_real *to) {
    TLSPHI_UNROLL for (size_t i = 0; i < (size_t)rows; i++)
        memcpy(to + i * TLSPHI_LANES, from + i * TLSPHI_LANES, TLSPHI_LANES * sizeof *to);
}
/* Sums of (f_b - f_a) (x) g over the pairs of a tile, for `rows` rows f that lie side by side and, `with_more`, for one
   elsewhere. First what a slot adds, for the components i that g has, see tlsphi_columns. */
TLSPHI_INLINE void tlsphi_add_jumps(const tlsph_real *a, const tlsph_real *b, const size_t apart, const tlsph_real *g,
                                    const int dim, const int width, const size_t *columns, const int rows,
                                    tlsph_real *sum) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        TLSPHI_UNROLL for (size_t r = 0; r < (size_t)rows; r++) {
            const tlsph_real jump = b[r * apart + l] - a[r * TLSPHI_LANES + l];
            TLSPHI_UNROLL for (size_t j = 0; j < (size_t)width; j++)
                sum[(r * (size_t)dim + columns[j]) * TLSPHI_LANES + l] += jump * g[columns[j] * TLSPHI_LANES + l];
        }
    }
}
TLSPHI_INLINE void tlsphi_collect_rows(const tlsph_real *const *at, size_t first, const int rows, tlsph_real *out) {
    TLSPHI_UNROLL for (size_t r = 0; r < (size_t)rows; r++)
        TLSPHI_LANE_BY_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
            out[r * TLSPHI_LANES + l] = at[l][first + r * TLSPHI_ROW];
}
/* Scattered slots have a loop of their own, because in the other gcc then keeps the sums in registers. */
TLSPHI_INLINE void tlsphi_sum_jumps(const tlsph_solver *s, size_t tile, size_t base, int row, const int rows, int more,
                                    const int with_more, const int dim, tlsph_real *out, tlsph_real *out_more) {
    const tlsphi_graph *graph = &s->graph;
    const tlsphi_slot *slot = graph->slot + graph->first[tile], *end = graph->slot + graph->first[tile + 1];
    const size_t beside = (size_t)(more - row) * TLSPHI_ROW, raw = (size_t)graph->raw, *const all = tlsphi_columns[7];
    TLSPHI_ALIGNED tlsph_real sum[9 * TLSPHI_LANES], sum_more[3 * TLSPHI_LANES];
    TLSPHI_ALIGNED tlsph_real a[3 * TLSPHI_LANES], a_more[TLSPHI_LANES], b[3 * TLSPHI_LANES], b_more[TLSPHI_LANES];
    tlsphi_clear_lanes(rows * dim, sum);
    tlsphi_clear_lanes(dim, sum_more);
    tlsphi_take_tile(tlsphi_at(s, row, base), 0, rows, a);
    if (with_more) tlsphi_take_tile(tlsphi_at(s, more, base), 0, 1, a_more);
    while (slot < end) {
        for (; slot < end && slot->scattered; slot++) {
            const tlsph_real *g = graph->pattern + ((size_t)slot->pattern * (size_t)graph->width + raw) * TLSPHI_LANES;
            const tlsph_real *at[TLSPHI_LANES];
            TLSPHI_LANE_BY_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
                at[l] = tlsphi_at(s, row, graph->gathered[slot->from + l]);
            tlsphi_collect_rows(at, 0, rows, b);
            tlsphi_add_jumps(a, b, TLSPHI_LANES, g, dim, dim, all, rows, sum);
            if (with_more) tlsphi_collect_rows(at, beside, 1, b_more);
            if (with_more) tlsphi_add_jumps(a_more, b_more, TLSPHI_LANES, g, dim, dim, all, 1, sum_more);
        }
        for (; slot < end && !slot->scattered; slot++) {
            const tlsph_real *g = graph->pattern + ((size_t)slot->pattern * (size_t)graph->width + raw) * TLSPHI_LANES;
            const tlsph_real *there = tlsphi_at(s, row, slot->from);
#define TLSPHI_ADD_JUMPS(width, columns)                                                                               \
    do {                                                                                                               \
        tlsphi_add_jumps(a, there, TLSPHI_ROW, g, dim, width, columns, rows, sum);                                     \
        if (with_more) tlsphi_add_jumps(a_more, there + beside, TLSPHI_ROW, g, dim, width, columns, 1, sum_more);      \
    } while (0)
            if (slot->axes == 1) TLSPHI_ADD_JUMPS(1, tlsphi_columns[1]);
            else if (slot->axes == 2) TLSPHI_ADD_JUMPS(1, tlsphi_columns[2]);
            else if (dim == 3 && slot->axes == 4) TLSPHI_ADD_JUMPS(1, tlsphi_columns[4]);
            else TLSPHI_ADD_JUMPS(dim, all);
        }
    }
    tlsphi_copy_lanes(rows * dim, sum, out);
    if (with_more) tlsphi_copy_lanes(dim, sum_more, out_more);
}
#define TLSPHI_SUM_JUMPS(dim, rows, with_more)                                                                         \
    TLSPHI_APART void tlsphi_sum_jumps_##dim##rows##with_more(const tlsph_solver *s, size_t tile, size_t base,         \
                                                              int row, int more, tlsph_real *out,                      \
                                                              tlsph_real *out_more) {                                  \
        tlsphi_sum_jumps(s, tile, base, row, rows, more, with_more, dim, out, out_more);                               \
    }
TLSPHI_SUM_JUMPS(2, 1, 0)
TLSPHI_SUM_JUMPS(2, 2, 0)
TLSPHI_SUM_JUMPS(2, 2, 1)
TLSPHI_SUM_JUMPS(3, 1, 0)
TLSPHI_SUM_JUMPS(3, 3, 0)
TLSPHI_SUM_JUMPS(3, 3, 1)
/* Of a vector and, unless out_more is NULL, of one number more; of a number. */
TLSPHI_INLINE void tlsphi_sum_vector(const tlsph_solver *s, size_t tile, size_t base, int row, int more, const int dim,
                                     tlsph_real *out, tlsph_real *out_more) {
    if (dim == 3 && out_more) tlsphi_sum_jumps_331(s, tile, base, row, more, out, out_more);
    else if (dim == 3) tlsphi_sum_jumps_330(s, tile, base, row, row, out, NULL);
    else if (out_more) tlsphi_sum_jumps_221(s, tile, base, row, more, out, out_more);
    else tlsphi_sum_jumps_220(s, tile, base, row, row, out, NULL);
}
TLSPHI_INLINE void tlsphi_sum_number(const tlsph_solver *s, size_t tile, size_t base, int row, const int dim,
                                     tlsph_real *out) {
    if (dim == 3) tlsphi_sum_jumps_310(s, tile, base, row, row, out, NULL);
    else tlsphi_sum_jumps_210(s, tile, base, row, row, out, NULL);
}
/* Raw sums of a tile: v and w, Sigma_J, theta; by rows of lanes. */
typedef struct TLSPHI_ALIGNED tlsphi_slopes {
    tlsph_real v[9 * TLSPHI_LANES], w[9 * TLSPHI_LANES], S[3 * TLSPHI_LANES],
        theta[3 * TLSPHI_LANES];
} tlsphi_slopes;
/* Lanes [first, end) to the columns of rows `apart` from each other. */
TLSPHI_INLINE void tlsphi_store_lanes(const int rows, const tlsph_real *lanes, size_t first, size_t end, size_t apart,
                                      tlsph_real *row) {
    if (end - first == TLSPHI_LANES) {
        TLSPHI_UNROLL for (size_t i = 0; i < (size_t)rows; i++)
            memcpy(row + i * apart, lanes + i * TLSPHI_LANES, TLSPHI_LANES * sizeof *row);
        return;
    }
    for (size_t i = 0; i < (size_t)rows; i++)
        for (size_t l = first; l < end; l++) row[i * apart + l] = lanes[i * TLSPHI_LANES + l];
}
TLSPHI_INLINE void tlsphi_store_rows(const int rows, const tlsph_real *lanes, size_t first, size_t end,
                                     tlsph_real *row) {
    tlsphi_store_lanes(rows, lanes, first, end, TLSPHI_ROW, row);
}
/* 1/(2 V), of all lanes or, in a tile at the end of a block, 0 for those of others. */
TLSPHI_INLINE void tlsphi_half_per_volume(const tlsph_solver *s, size_t base, size_t first, size_t end,
                                          tlsph_real *out) {
    if (end - first == TLSPHI_LANES) {
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) out[l] = 1 / (2 * s->V[base + l]);
        return;
    }
    for (size_t l = 0; l < TLSPHI_LANES; l++) out[l] = l < first || l >= end ? 0 : 1 / (2 * s->V[base + l]);
}
/* G = scale G M^T for `rows` gradients a lane; M is NULL, or that of the tile's particles as lanes. */
TLSPHI_INLINE void tlsphi_finish_gradients(const tlsph_real *scale, const tlsph_real *M, const int dim, const int rows,
                                           tlsph_real *G) {
    if (!M) {
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
            TLSPHI_UNROLL for (size_t i = 0; i < (size_t)(rows * dim); i++) G[i * TLSPHI_LANES + l] *= scale[l];
        return;
    }
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsph_real A[9], g[3], out[3];
        TLSPHI_UNROLL for (int i = 0; i < dim * dim; i++) A[i] = M[(size_t)i * TLSPHI_LANES + l];
        TLSPHI_UNROLL for (int r = 0; r < rows; r++) {
            TLSPHI_UNROLL for (int i = 0; i < dim; i++) g[i] = G[(size_t)(r * dim + i) * TLSPHI_LANES + l] * scale[l];
            tlsphi_multiply(dim, A, g, out);
            TLSPHI_UNROLL for (int i = 0; i < dim; i++) G[(size_t)(r * dim + i) * TLSPHI_LANES + l] = out[i];
        }
    }
}
/* scale P : G of each lane */
TLSPHI_INLINE void tlsphi_contract(const int n, const tlsph_real *row, const tlsph_real *G, const tlsph_real *scale,
                                   tlsph_real *out) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsph_real sum = 0;
        TLSPHI_UNROLL for (size_t i = 0; i < (size_t)n; i++) sum += row[i * TLSPHI_ROW + l] * G[i * TLSPHI_LANES + l];
        out[l] = sum * scale[l];
    }
}
/* The particles first to last of a tile: n components of each become lanes. */
TLSPHI_INLINE void tlsphi_take_lanes(const tlsph_real *from, const size_t n, size_t first, size_t last,
                                     tlsph_real *to) {
    if (last - first == TLSPHI_LANES) {
        tlsphi_transpose(from, n, to);
        return;
    }
    memset(to, 0, n * TLSPHI_LANES * sizeof *to);
    for (size_t l = first; l < last; l++)
        for (size_t i = 0; i < n; i++) to[i * TLSPHI_LANES + l] = from[n * l + i];
}
/* w = v - spin x (x - centre) - mean, to its rows, and grad w = grad v - spin x F in place of G = grad v. As F is the
   gradient of x this saves a gather; it sees x and F of the stage, which is as exact for rigid and affine motions, but
   where forces take torques about x_next it is not their adjoint to the last digit: scenes with E or eta gather grad w.
   Grad v follows from grad w and F in the same manner, so that Runge-Kutta schemes need no array for it here. */
TLSPHI_INLINE void tlsphi_take_turn(const tlsph_solver *s, const tlsphi_body *body, size_t base, size_t first,
                                    size_t last, const int dim, tlsph_real *G) {
    const size_t D = (size_t)dim, dd = D * D;
    const tlsph_real *v = tlsphi_at(s, s->rows.v, base);
    tlsph_real arm[3 * TLSPHI_LANES], unit[9 * TLSPHI_LANES], w[3 * TLSPHI_LANES];
    const tlsph_real *F = s->linear ? unit : s->now.F + dd * base;
    tlsph_real spin[3], mean[3], centre[3] = {0, 0, 0};
    for (size_t i = 0; i < 3; i++) {
        spin[i] = (tlsph_real)body->spin[i];
        mean[i] = (tlsph_real)body->v_mean[i];
        if (i >= D) continue;
        const tlsph_real from = s->linear ? tlsphi_X(s, body->first, i) : s->now.x[D * body->first + i];
        centre[i] = (tlsph_real)((double)from + body->centre[i]);
    }
    if (!s->linear) tlsphi_take_lanes(s->now.x + D * base, D, first, last, arm);
    for (size_t i = 0; s->linear && i < D; i++)
        memcpy(arm + i * TLSPHI_LANES, tlsphi_at(s, s->rows.X, base) + i * TLSPHI_ROW, TLSPHI_LANES * sizeof *arm);
    if (s->linear) tlsphi_clear_lanes(9, unit);
    for (size_t i = 0; s->linear && i < D; i++)
        for (size_t l = 0; l < TLSPHI_LANES; l++) unit[(D + 1) * i * TLSPHI_LANES + l] = 1;
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        TLSPHI_UNROLL for (int k = 0; k <= dim; k++) { /* the columns of F, and the arm */
            tlsph_real column[3] = {0}, turn[3];
            TLSPHI_UNROLL for (int i = 0; i < dim; i++) column[i] =
                k < dim ? F[(size_t)(dim * i + k) * TLSPHI_LANES + l] : arm[(size_t)i * TLSPHI_LANES + l] - centre[i];
            turn[0] = spin[1] * column[2] - spin[2] * column[1];
            turn[1] = spin[2] * column[0] - spin[0] * column[2];
            turn[2] = spin[0] * column[1] - spin[1] * column[0];
            TLSPHI_UNROLL for (int i = 0; i < dim; i++) {
                if (k < dim) G[(size_t)(dim * i + k) * TLSPHI_LANES + l] -= turn[i];
                else w[(size_t)i * TLSPHI_LANES + l] = v[(size_t)i * TLSPHI_ROW + l] - mean[i] - turn[i];
            }
        }
    }
    tlsphi_store_rows(dim, w, first, last, tlsphi_at(s, s->rows.w, base));
}
/* M^T Q/theta = -h/(J theta) A^T A G with A = H M and the raw gradient G = scale sum of theta (000-56). */
TLSPHI_INLINE void tlsphi_heat_flux_lanes(const tlsph_solver *s, size_t base, const int dim, const tlsph_real *scale,
                                          const tlsph_real *sum, tlsph_real *heat) {
    const tlsph_real *row = tlsphi_at(s, s->rows.A, base), *theta = tlsphi_theta(s, base);
    const tlsph_real *h_J = tlsphi_at(s, s->rows.h_J, base);
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsph_real A[9], G[3], push[3], out[3];
        tlsphi_take_rows(dim * dim, row + l, A);
        TLSPHI_UNROLL for (int i = 0; i < dim; i++) G[i] = sum[(size_t)i * TLSPHI_LANES + l];
        tlsphi_multiply(dim, A, G, push);
        tlsphi_multiply_transposed(dim, A, push, out);
        const tlsph_real factor = -h_J[l] * scale[l] / theta[l];
        TLSPHI_UNROLL for (int i = 0; i < dim; i++) heat[(size_t)i * TLSPHI_LANES + l] = factor * out[i];
    }
}
/* The raw sums of theta become its slopes and the heat fluxes. */
TLSPHI_INLINE void tlsphi_store_theta(const tlsph_solver *s, size_t base, size_t first, size_t last, const int dim,
                                      const tlsph_real *scale, const tlsph_real *M, tlsph_real *sum) {
    tlsph_real heat[3 * TLSPHI_LANES];
    tlsphi_heat_flux_lanes(s, base, dim, scale, sum, heat);
    tlsphi_store_rows(dim, heat, first, last, tlsphi_at(s, s->rows.heat, base));
    tlsphi_finish_gradients(scale, M, dim, 1, sum);
    tlsphi_store_rows(dim, sum, first, last, tlsphi_at(s, s->rows.slope_theta, base));
}
/* What becomes of the raw sums of the particles [begin, end) of a tile. E without its kinetic part changes by P : grad w
   (see [PROJECTION]), J by H : grad v; PM : (raw sum) and HM : (raw sum) are the same, and adjoint to T_a. */
TLSPHI_INLINE void tlsphi_store_slopes(const tlsph_solver *s, const tlsphi_block *block, size_t begin, size_t end,
                                       const int dim, int with_w, int with_S, int with_theta, tlsphi_slopes *sum) {
    const size_t base = begin / TLSPHI_LANES * TLSPHI_LANES, first = begin - base, last = end - base;
    const int dd = dim * dim;
    const tlsph_real *M = s->M ? tlsphi_correction_lanes(s, base) : NULL;
    tlsph_real *row = tlsphi_at(s, 0, base), scale[TLSPHI_LANES], rate[TLSPHI_LANES];
    tlsphi_half_per_volume(s, base, first, last, scale);
    tlsph_real *const w = with_w ? sum->w : sum->v;
    if (s->rate_E) {
        tlsphi_contract(dd, row + (size_t)s->rows.PM * TLSPHI_ROW, w, scale, rate);
        tlsphi_store_lanes(1, rate, first, last, 0, s->rate_E + base);
    }
    if (s->rate_J) {
        tlsphi_contract(dd, row + (size_t)s->rows.A * TLSPHI_ROW, sum->v, scale, rate);
        tlsphi_store_lanes(1, rate, first, last, 0, s->rate_J + base);
    }
    tlsphi_finish_gradients(scale, M, dim, dim, sum->v);
    if (with_w) tlsphi_finish_gradients(scale, M, dim, dim, sum->w);
    if (s->keeps_rate) {
        size_t apart;
        tlsph_real *grad_v = tlsphi_grad_v(s, base, &apart);
        tlsphi_store_lanes(dd, sum->v, first, last, apart, grad_v);
    }
    if (s->projection && !s->gathers_w) tlsphi_take_turn(s, s->body + block->body, base, first, last, dim, w);
    tlsphi_store_rows(dd, w, first, last, row + (size_t)s->rows.grad_w * TLSPHI_ROW);
    if (with_S) {
        tlsphi_finish_gradients(scale, M, dim, 1, sum->S);
        tlsphi_store_rows(dim, sum->S, first, last, row + (size_t)s->rows.slope_S * TLSPHI_ROW);
    }
    if (with_theta) tlsphi_store_theta(s, base, first, last, dim, scale, M, sum->theta);
}
TLSPHI_INLINE void tlsphi_gradient_tile(const tlsph_solver *s, const tlsphi_block *block, size_t tile, size_t begin,
                                        size_t end, const int dim, int with_w, int with_S, int with_theta) {
    const size_t base = begin / TLSPHI_LANES * TLSPHI_LANES;
    const tlsphi_rows *r = &s->rows;
    tlsphi_slopes sum;
    tlsphi_sum_vector(s, tile, base, r->v, r->S, dim, sum.v, with_S ? sum.S : NULL);
    if (with_w) tlsphi_sum_vector(s, tile, base, r->w, r->theta, dim, sum.w, with_theta ? sum.theta : NULL);
    else if (with_theta) tlsphi_sum_number(s, tile, base, r->theta, dim, sum.theta);
    tlsphi_store_slopes(s, block, begin, end, dim, with_w, with_S, with_theta, &sum);
}

/* The slope of Sigma_J or, heat, of theta. */
static void tlsphi_mirror_slope(tlsph_solver *s, int row, int heat, size_t a) {
    tlsph_real slope[3];
    tlsphi_row_get(s, row, s->dim, a, slope);
    for (const tlsphi_mirror *m = tlsphi_mirrors_of(s, a); m && m->particle == a; m++)
        if (!m->tangent && !(heat && m->conducts)) tlsphi_mirror_vector(s->dim, m, slope);
    tlsphi_row_put(s, row, s->dim, a, slope);
}
static void tlsphi_mirror_gradients(tlsph_solver *s, size_t a) {
    const int dim = s->dim, dd = dim * dim;
    const tlsphi_rows *r = &s->rows;
    tlsph_real Gw[9];
    if (s->has_J) tlsphi_mirror_slope(s, r->slope_S, 0, a);
    if (s->conducts) tlsphi_mirror_slope(s, r->slope_theta, 1, a);
    for (const tlsphi_mirror *m = tlsphi_mirrors_of(s, a); m && m->particle == a; m++) {
        if (s->keeps_rate) {
            size_t apart;
            tlsph_real *grad_v = tlsphi_grad_v(s, a, &apart);
            tlsphi_take_apart(dd, grad_v, apart, Gw);
            tlsphi_mirror_tensor(dim, m, Gw);
            for (size_t i = 0; i < (size_t)dd; i++) grad_v[i * apart] = Gw[i];
        }
        tlsphi_row_get(s, r->grad_w, dd, a, Gw);
        tlsphi_mirror_tensor(dim, m, Gw);
        tlsphi_row_put(s, r->grad_w, dd, a, Gw);
    }
}

/* The same from the gradient, where that is not the raw sum's. Q = -h/J H^T H grad theta is mirrored like the gradient,
   so that both stay adjoint. */
static void tlsphi_heat_flux(tlsph_solver *s, size_t a) {
    const int dim = s->dim;
    tlsphi_point pt;
    tlsph_real H[9], slope[3], push[3], Q[3], heat[3];
    tlsphi_load_measures(s, &s->now, tlsphi_material_of(s, a), a, &pt);
    tlsphi_shrink(dim, pt.H, H);
    tlsphi_row_get(s, s->rows.slope_theta, dim, a, slope);
    tlsphi_multiply(dim, H, slope, push);
    tlsphi_multiply_transposed(dim, H, push, Q);
    for (const tlsphi_mirror *m = tlsphi_mirrors_of(s, a); m && m->particle == a; m++)
        if (!m->tangent && !m->conducts) tlsphi_mirror_vector(dim, m, Q);
    const tlsph_real factor = -*tlsphi_at(s, s->rows.h_J, a) / *tlsphi_at(s, s->rows.theta, a);
    for (int i = 0; i < dim; i++) Q[i] *= factor;
    tlsphi_correct_transposed(s, a, dim, Q, heat);
    tlsphi_row_put(s, s->rows.heat, dim, a, heat);
}

/* G += spin x F */
static void tlsphi_add_turn(const tlsph_solver *s, const double spin[3], size_t a, tlsph_real *G) {
    const size_t D = (size_t)s->dim;
    tlsph_real F[9];
    tlsphi_tensor_get(s->now.F, s->dim * s->dim, a, F);
    for (size_t j = 0; j < D; j++) {
        double column[3] = {0, 0, 0}, turn[3];
        for (size_t i = 0; i < D; i++) column[i] = (double)F[D * i + j];
        tlsphi_cross3(spin, column, turn);
        for (size_t i = 0; i < D; i++) G[D * i + j] += (tlsph_real)turn[i];
    }
}
/* grad v of a particle of the body: kept, or grad w + turn x F. */
static void tlsphi_velocity_gradient(const tlsph_solver *s, const tlsphi_body *body, size_t a, tlsph_real *G) {
    if (s->rate_F) tlsphi_tensor_get(s->rate_F, s->dim * s->dim, a, G);
    else {
        tlsphi_row_get(s, s->rows.grad_w, s->dim * s->dim, a, G);
        if (s->projection) tlsphi_add_turn(s, body->turn, a, G);
    }
}
/* dJ/dt = H : grad v where grad v is not the raw sum's; the dissipation is added by the fluxes. */
static void tlsphi_jacobian_rate(tlsph_solver *s, const tlsphi_body *body, size_t a) {
    const int dd = s->dim * s->dim;
    tlsphi_point pt;
    tlsph_real H[9], G[9] = {0};
    tlsphi_load_measures(s, &s->now, tlsphi_material_of(s, a), a, &pt);
    tlsphi_shrink(s->dim, pt.H, H);
    tlsphi_velocity_gradient(s, body, a, G);
    s->rate_J[a] = tlsphi_dot(dd, H, G);
}

/* The odd part of a vector across an image's mirror; the image's share in grad v (for w it is the same, because the rigid
   motion respects the mirrors) and, adjoint, in the force: (P_a + P_image) C/2 is the odd part of P C. The force comes
   after the projection: it is no internal one, the other half of the body exerts it. */
static void tlsphi_odd_part(const tlsphi_image *image, int dim, tlsph_real *v) {
    for (int i = 0; i < dim; i++)
        if ((i == image->axis) == (image->tangent != 0)) v[i] = 0;
}
static void tlsphi_image_gradient(const tlsph_solver *s, const tlsphi_image *image) {
    const size_t D = (size_t)s->dim, a = image->particle, axis = (size_t)image->axis;
    const tlsph_real factor = -image->c / s->V[a];
    size_t apart;
    tlsph_real odd[3] = {0, 0, 0}, *grad_v = tlsphi_grad_v(s, a, &apart);
    tlsphi_velocity(s, a, odd);
    tlsphi_odd_part(image, s->dim, odd);
    for (size_t i = 0; i < D; i++) {
        const size_t row = (D * i + axis) * TLSPHI_ROW;
        grad_v[(D * i + axis) * apart] += factor * odd[i];
        tlsphi_at(s, s->rows.grad_w, a)[row] += factor * odd[i];
        if (s->rate_E) s->rate_E[a] += tlsphi_at(s, s->rows.PM, a)[row] * factor * odd[i];
    }
}
static void tlsphi_image_forces(tlsph_solver *s) {
    const size_t D = (size_t)s->dim;
    for (const tlsphi_image *image = s->image, *end = image + s->images; image != end; image++) {
        const size_t a = image->particle;
        tlsph_real force[3] = {0, 0, 0};
        const tlsph_real *PM = tlsphi_at(s, s->rows.PM, a);
        for (size_t i = 0; i < D; i++) force[i] = PM[(D * i + (size_t)image->axis) * TLSPHI_ROW] * image->c / s->V[a];
        tlsphi_odd_part(image, s->dim, force);
        for (size_t i = 0; i < D; i++) s->rate_p[D * a + i] += force[i];
    }
}
/* First image of a particle >= a. */
static const tlsphi_image *tlsphi_find_image(const tlsph_solver *s, size_t a) {
    return s->image + tlsphi_find_particle(s->image, s->images, sizeof *s->image, a);
}
/* dF/dt = grad w + spin x F: exact for turns where grad x is F only to the slack of TLSPH_CLOSED. P does no work on the
   second part. */
static void tlsphi_turn_gradient(tlsph_solver *s, const double spin[3], size_t a) {
    tlsph_real G[9];
    tlsphi_row_get(s, s->rows.grad_w, s->dim * s->dim, a, G);
    tlsphi_add_turn(s, spin, a, G);
    tlsphi_tensor_put(s->rate_F, s->dim * s->dim, a, G);
}
/* What neighbours ahead give, and what the block's own particles read and write. */
static void tlsphi_warm_gradients(const tlsph_solver *s, const tlsphi_block *block, int with_w, int with_S,
                                  int with_theta) {
    const tlsphi_rows *r = &s->rows;
    const size_t D = (size_t)s->dim, a = block->begin, n = block->end - a, ahead = tlsphi_reach_ahead(s, block);
    tlsphi_warm_rows(s, ahead, r->v, with_w ? r->X : r->w);
    if (with_S) tlsphi_warm_rows(s, ahead, r->S, r->slope_S);
    if (with_theta) tlsphi_warm_rows(s, ahead, r->theta, r->slope_theta);
    tlsphi_warm_rows(s, a, r->w, r->X);
    if (s->rate_J) tlsphi_warm_rows(s, a, r->A, r->slope_w);
    tlsphi_warm_rows(s, a, r->grad_w, r->grad_w + s->dim * s->dim);
    if (with_S) tlsphi_warm_rows(s, a, r->slope_S, r->theta);
    if (!s->projection || s->gathers_w || s->linear) return;
    tlsphi_warm(s->now.F + D * D * a, D * D * n); /* for tlsphi_take_turn */
    tlsphi_warm(s->now.x + D * a, D * n);
}
static void tlsphi_gradient_block(tlsph_solver *s, tlsphi_block *block) {
    const int with_S = s->has_J && s->damps, with_theta = s->heat_moves;
    /* w and Sigma_J are there for the dissipation, E and turns */
    const int with_w = s->gathers_w && (s->damps || s->rate_E || s->turns);
    const tlsphi_image *image = tlsphi_find_image(s, block->begin), *last = s->image + s->images;
    if (tlsphi_outgrows_cache(s)) tlsphi_warm_gradients(s, block, with_w, with_S, with_theta);
    for (size_t a = block->begin, tile = block->tile, end; a < block->end; a = end, tile++) {
        end = tlsphi_tile_end(block, a);
        if (s->dim == 3) tlsphi_gradient_tile(s, block, tile, a, end, 3, with_w, with_S, with_theta);
        else tlsphi_gradient_tile(s, block, tile, a, end, 2, with_w, with_S, with_theta);
    }
    if (!s->mirrors && !s->images && !s->held_parts && !s->turns) return;
    tlsphi_held_part *held = tlsphi_find_held_part(s, block->begin), *const parts = s->held_part + s->held_parts;
    for (size_t a = block->begin; a < block->end; a++) {
        const int mirrored = tlsphi_mirrors_of(s, a) != NULL, imaged = image != last && image->particle == a;
        for (; image != last && image->particle == a; image++) tlsphi_image_gradient(s, image);
        tlsphi_held_part *const from = held;
        while (held != parts && held->particle == a) held++;
        if (held != from) tlsphi_hold_gradient(s, from, held);
        if (mirrored) tlsphi_mirror_gradients(s, a);
        if (s->turns) tlsphi_turn_gradient(s, s->body[block->body].spin, a);
        if (s->rate_J && !s->sharp && (imaged || mirrored || held != from || s->turns))
            tlsphi_jacobian_rate(s, s->body + block->body, a);
        if (with_theta && mirrored) tlsphi_heat_flux(s, a); /* the gradient is not the raw sum */
    }
}

/* -- sharp gradients: an order of dispersion for one more gather (METHOD: better operators) --
   The pair difference v_b - v_a is long by a third of the change of its slope. With g = grad v from above,
     G = 1/V_a sum_b (v_b - v_a - (g_b - g_a) d/3)/2 (x) C_ab,
   and its adjoint, by which the forces must be made so that energy and momenta stay exact,
     P^_a = P_a + 1/(6 V_a) sum_b ((P_a - P_b) C_ab) (x) d.
   On a lattice the symbol sin k becomes sin k (1 + (1 - cos k)/3) = k + O(k^5): fourth order, at 1.37 times the largest
   frequency. Needs C_ab = -C_ba.
   The dissipation reconstructs with g + r (G - g). With s = sin(k/2) it then damps 2 s^3 (1 - 2 r/3) + O(s^5) of a wave
   instead of 2 s^3: r = 3/2 would leave fifth order, but the two-stage scheme amplifies waves by (omega dt)^4/8 a step,
   which a little of the third order must outweigh, diagonal waves in 3-D included: 1 - 2 r/3 > 6 nu^3 with nu the Courant
   number over TLSPHI_SHARP_STEP. At CFL 0.3 that is 0.067 > 0.048. */
#define TLSPHI_SHARP_REACH 1.4 /* r */

/* Sums of a particle: ((g_b - g_a) d) (x) C_ab, with grad w and with grad v for g; ((P_a - P_b) C_ab) (x) d. */
typedef struct TLSPHI_ALIGNED tlsphi_sharp_sums {
    tlsph_real moment[9 * TLSPHI_LANES], relative[9 * TLSPHI_LANES], correction[9 * TLSPHI_LANES];
} tlsphi_sharp_sums;

/* sum += ((Z_b - Z_a) u) (x) t for the components that u and t have */
TLSPHI_INLINE void tlsphi_add_change(const tlsph_real *a, const tlsph_real *b, const size_t apart, const tlsph_real *u,
                                     const tlsph_real *t, const int dim, const int width, const size_t *columns,
                                     tlsph_real *sum) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
        TLSPHI_UNROLL for (size_t i = 0; i < (size_t)dim; i++) {
            tlsph_real jump = 0;
            TLSPHI_UNROLL for (size_t j = 0; j < (size_t)width; j++) {
                const size_t k = (size_t)dim * i + columns[j];
                jump += (b[k * apart + l] - a[k * TLSPHI_LANES + l]) * u[columns[j] * TLSPHI_LANES + l];
            }
            TLSPHI_UNROLL for (size_t j = 0; j < (size_t)width; j++)
                sum[((size_t)dim * i + columns[j]) * TLSPHI_LANES + l] += jump * t[columns[j] * TLSPHI_LANES + l];
        }
}
/* The rows PM, grad_w and grad_v lie side by side: a holds those of the tile, b those of the neighbours. */
TLSPHI_INLINE void tlsphi_add_changes(const tlsph_real *a, const tlsph_real *b, const size_t apart, const tlsph_real *d,
                                      const tlsph_real *g, const int dim, const int width, const size_t *columns,
                                      tlsphi_sharp_sums *sum) {
    const size_t dd = (size_t)(dim * dim);
    tlsphi_add_change(a, b, apart, g, d, dim, width, columns, sum->moment);
    tlsphi_add_change(a + dd * TLSPHI_LANES, b + dd * apart, apart, d, g, dim, width, columns, sum->relative);
    tlsphi_add_change(a + 2 * dd * TLSPHI_LANES, b + 2 * dd * apart, apart, d, g, dim, width, columns, sum->correction);
}
TLSPHI_INLINE void tlsphi_sum_sharp(const tlsph_solver *s, size_t tile, size_t base, const int dim,
                                    tlsphi_sharp_sums *sum) {
    const tlsphi_graph *graph = &s->graph;
    const tlsphi_rows *r = &s->rows;
    const int dd = dim * dim;
    TLSPHI_ALIGNED tlsph_real a[27 * TLSPHI_LANES], X_a[3 * TLSPHI_LANES], d[3 * TLSPHI_LANES];
    TLSPHI_ALIGNED tlsph_real b_of[27 * TLSPHI_LANES], X_of[3 * TLSPHI_LANES]; /* collected */
    tlsphi_clear_lanes(dd, sum->moment);
    tlsphi_clear_lanes(dd, sum->relative);
    tlsphi_clear_lanes(dd, sum->correction);
    tlsphi_take_tile(tlsphi_at(s, r->PM, base), 0, 3 * dd, a);
    tlsphi_take_tile(tlsphi_at(s, r->X, base), 0, dim, X_a);
    for (size_t k = graph->first[tile]; k < graph->first[tile + 1]; k++) {
        const tlsphi_slot *slot = graph->slot + k;
        const tlsph_real *g = graph->pattern + (size_t)slot->pattern * (size_t)graph->width * TLSPHI_LANES;
        const tlsph_real *b = b_of, *X_b = X_of, *at[TLSPHI_LANES];
        size_t apart = TLSPHI_LANES;
        if (slot->scattered) {
            TLSPHI_LANE_BY_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
                at[l] = tlsphi_at(s, r->X, graph->gathered[slot->from + l]);
            tlsphi_collect_rows(at, 0, dim, X_of);
            tlsphi_collect_rows(at, (size_t)(r->PM - r->X) * TLSPHI_ROW, 3 * dd, b_of);
        } else {
            b = tlsphi_at(s, r->PM, slot->from);
            X_b = tlsphi_at(s, r->X, slot->from);
            apart = TLSPHI_ROW;
        }
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
            TLSPHI_UNROLL for (size_t i = 0; i < (size_t)dim; i++)
                d[i * TLSPHI_LANES + l] = X_b[i * apart + l] - X_a[i * TLSPHI_LANES + l];
        if (tlsphi_widths[slot->axes] == 1)
            tlsphi_add_changes(a, b, apart, d, g, dim, 1, tlsphi_columns[slot->axes], sum);
        else tlsphi_add_changes(a, b, apart, d, g, dim, dim, tlsphi_columns[7], sum);
    }
}
/* The same for the particles [begin, end) of a tile, pair by pair. */
TLSPHI_INLINE void tlsphi_sum_sharp_pairs(const tlsph_solver *s, size_t begin, size_t end, const int dim,
                                          tlsphi_sharp_sums *sum) {
    const size_t D = (size_t)dim;
    const int dd = dim * dim;
    memset(sum, 0, sizeof *sum);
    for (size_t a = begin; a < end; a++) {
        tlsph_real *const to[3] = {sum->moment, sum->relative, sum->correction};
        for (size_t k = s->first[a]; k < s->first[a + 1]; k++) {
            const size_t b = s->neighbour[k];
            tlsph_real d[3];
            tlsphi_pair_arm(s, a, b, dim, d);
            for (int z = 0; z < 3; z++) {
                const tlsph_real *u = z ? d : s->g + D * k, *t = z ? s->g + D * k : d;
                tlsph_real Z_a[9], Z_b[9], jump[3], change[9] = {0};
                tlsphi_row_get(s, s->rows.PM + z * dd, dd, a, Z_a);
                tlsphi_row_get(s, s->rows.PM + z * dd, dd, b, Z_b);
                for (int i = 0; i < dd; i++) Z_b[i] -= Z_a[i];
                tlsphi_multiply(dim, Z_b, u, jump);
                tlsphi_add_outer(dim, change, jump, t);
                for (int i = 0; i < dd; i++) to[z][(size_t)i * TLSPHI_LANES + a % TLSPHI_LANES] += change[i];
            }
        }
    }
}
static void tlsphi_mirror_all(const tlsph_solver *s, size_t a, tlsph_real *G) {
    for (const tlsphi_mirror *m = tlsphi_mirrors_of(s, a); m && m->particle == a; m++)
        tlsphi_mirror_tensor(s->dim, m, G);
}
static void tlsphi_mirror_lane(const tlsph_solver *s, size_t a, tlsph_real *sum) {
    tlsph_real G[9], *at = sum + a % TLSPHI_LANES;
    tlsphi_take_apart(s->dim * s->dim, at, TLSPHI_LANES, G);
    tlsphi_mirror_all(s, a, G);
    for (size_t i = 0; i < (size_t)(s->dim * s->dim); i++) at[i * TLSPHI_LANES] = G[i];
}
/* What becomes of the sums of the lanes [first, last). dJ/dt = H : grad v; A is H, as without M (C_ab = -C_ba). */
TLSPHI_INLINE void tlsphi_store_sharp(const tlsph_solver *s, size_t base, size_t first, size_t last, const int dim,
                                      tlsphi_sharp_sums *sum) {
    const tlsphi_rows *r = &s->rows;
    const tlsph_real *PM = tlsphi_at(s, r->PM, base), *A = tlsphi_at(s, r->A, base);
    const tlsph_real *w = tlsphi_at(s, r->grad_w, base), *v = tlsphi_at(s, r->grad_v, base);
    tlsph_real scale[TLSPHI_LANES], heat[TLSPHI_LANES], growth[TLSPHI_LANES];
    tlsphi_half_per_volume(s, base, first, last, scale);
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        const tlsph_real sixth = scale[l] * TLSPHI_R(1.0 / 3.0), reach = sixth * TLSPHI_R(TLSPHI_SHARP_REACH);
        tlsph_real power = 0, HG = 0;
        TLSPHI_UNROLL for (size_t i = 0; i < (size_t)(dim * dim); i++) {
            const size_t k = i * TLSPHI_LANES + l, row = i * TLSPHI_ROW + l;
            power += PM[row] * sum->relative[k];
            sum->correction[k] = v[row] - sixth * sum->correction[k];
            HG += A[row] * sum->correction[k];
            sum->relative[k] = w[row] - reach * sum->relative[k];
            sum->moment[k] = PM[row] - sixth * sum->moment[k];
        }
        heat[l] = sixth * power;
        growth[l] = HG;
    }
    for (size_t l = first; s->rate_E && l < last; l++) s->rate_E[base + l] -= heat[l];
    if (s->rate_J) tlsphi_store_lanes(1, growth, first, last, 0, s->rate_J + base);
    tlsphi_store_rows(dim * dim, sum->moment, first, last, tlsphi_at(s, r->P, base));
    tlsphi_store_rows(dim * dim, sum->relative, first, last, tlsphi_at(s, r->slope_w, base));
    tlsphi_store_lanes(dim * dim, sum->correction, first, last, TLSPHI_LANES, s->rate_F + (size_t)(dim * dim) * base);
}
TLSPHI_INLINE void tlsphi_sharpen_tile(tlsph_solver *s, size_t tile, size_t begin, size_t end, const int dim) {
    const size_t base = begin / TLSPHI_LANES * TLSPHI_LANES;
    tlsphi_sharp_sums sum;
    if (s->lanes) tlsphi_sum_sharp(s, tile, base, dim, &sum);
    else tlsphi_sum_sharp_pairs(s, begin, end, dim, &sum);
    for (size_t a = begin; s->mirrors && a < end; a++) {
        tlsphi_mirror_lane(s, a, sum.moment);
        tlsphi_mirror_lane(s, a, sum.relative);
        tlsphi_mirror_lane(s, a, sum.correction);
    }
    tlsphi_store_sharp(s, base, begin - base, end - base, dim, &sum);
}
static void tlsphi_sharpen_block(tlsph_solver *s, tlsphi_block *block) {
    for (size_t a = block->begin, tile = block->tile, end; a < block->end; a = end, tile++) {
        end = tlsphi_tile_end(block, a);
        if (s->dim == 3) tlsphi_sharpen_tile(s, tile, a, end, 3);
        else tlsphi_sharpen_tile(s, tile, a, end, 2);
    }
}

/* ==== [JST] ========================================================================================================
   Dissipation of Jameson, Schmidt and Turkel (002-28): with the p speed c of the undeformed body and p = rho v
     V_a D_a = sum_b l_ab c (eta2 h (p_b - p_a) - eta4 h^3 (Lp_b - Lp_a)),   l_ab = max(0, C_ab^skew.d/|d|^2)
     Lp_a = sum_b L_ab (p_b - p_a),   L_ab = (l_ab - C_ab . sum_c l_ac d_ac / (2 V_a))/V_a
   The Laplacian comes from the operator and not from second derivatives of a kernel: where C is exact for linear fields
   sum_b l_ab |d|^2 = 2 dim V_a, so that it is right for X.X on every particle, and at support 0.6 on a lattice it is the
   usual difference. The second term of L_ab takes away what a linear field would give beside a face (no Laplacian from the
   neighbours there can be right for all quadratic fields: at a corner it would be 0/0). The harmonic part of each pair
   dissipates; the biharmonic part is the square of the Laplacian inside the body and has no sign pair by pair. v is the
   velocity without rigid motion, as in [DISSIPATION]; each side of a pair takes half of its work as heat. The time step by
   particles is kept below what this dissipation allows (with wide supports h^3 makes it stiff); the paper's is not. */

#define TLSPHI_JST_STEP 1.8 /* over the bound of the fastest decay: two stages allow 2 over the decay itself */

static tlsph_real tlsphi_pair_laplacian(const tlsph_solver *s, size_t a, size_t b, size_t k) {
    const int dim = s->dim;
    const size_t D = (size_t)dim;
    tlsph_real d[3] = {0}, C[3] = {0};
    tlsphi_skew_vector(s, a, b, dim, s->g + D * k, C);
    tlsphi_pair_arm(s, a, b, dim, d);
    return tlsphi_max(tlsphi_dot(dim, C, d), 0) / tlsphi_dot(dim, d, d);
}
/* Number of the neighbour that a lane of a slot holds. */
TLSPHI_INLINE size_t tlsphi_slot_neighbour(const tlsphi_graph *graph, const tlsphi_slot *slot, size_t lane) {
    return slot->scattered ? graph->gathered[slot->from + lane] : slot->from + lane;
}
/* sum_c l_ac d_ac / (2 V_a^2), turned so that its product with g_ab is that with C_ab; r_ab goes with rest. Returns the sum
   of l_ac. */
static tlsph_real tlsphi_laplacian_lean(const tlsph_solver *s, size_t tile, size_t a, tlsph_real lean[3],
                                        tlsph_real turned[3]) {
    const tlsphi_graph *graph = &s->graph;
    const size_t D = (size_t)s->dim, lane = a % TLSPHI_LANES;
    tlsph_real sum = 0;
    lean[0] = lean[1] = lean[2] = 0;
    for (size_t k = graph->first[tile]; k < graph->first[tile + 1]; k++) {
        const size_t row = (size_t)graph->slot[k].pattern * (size_t)graph->width + (size_t)graph->laplacian;
        const tlsph_real l = graph->pattern[row * TLSPHI_LANES + lane];
        if (!(l > 0)) continue; /* nor may a lane without a pair read a particle that is not there */
        const size_t b = tlsphi_slot_neighbour(graph, graph->slot + k, lane);
        for (size_t i = 0; i < D; i++) lean[i] += l / (2 * s->V[a] * s->V[a]) * (tlsphi_X(s, b, i) - tlsphi_X(s, a, i));
        sum += l;
    }
    tlsphi_correct_transposed(s, a, s->dim, lean, turned);
    return sum;
}
/* rho w of b less that of a */
TLSPHI_INLINE void tlsphi_momentum_jump(const tlsph_solver *s, size_t a, size_t b, const int dim, tlsph_real *jump) {
    const tlsph_real *w_a = tlsphi_at(s, s->rows.w, a), *w_b = tlsphi_at(s, s->rows.w, b);
    const tlsph_real rho_a = tlsphi_material_of(s, a)->rho, rho_b = tlsphi_material_of(s, b)->rho;
    TLSPHI_UNROLL for (size_t i = 0; i < (size_t)dim; i++)
        jump[i] = rho_b * w_b[i * TLSPHI_ROW] - rho_a * w_a[i * TLSPHI_ROW];
}
/* L of the particles [begin, end) of a tile, one by one and by lanes; there all are of one material. */
static void tlsphi_laplacian_particles(const tlsph_solver *s, size_t begin, size_t end) {
    const size_t D = (size_t)s->dim;
    for (size_t a = begin; a < end; a++) {
        const tlsph_real *lean = s->lean + 2 * D * a;
        tlsph_real sum[3] = {0, 0, 0}, jump[3];
        for (size_t k = s->first[a]; k < s->first[a + 1]; k++) {
            const size_t b = s->neighbour[k];
            tlsph_real L = s->laplacian[k] / s->V[a] - tlsphi_dot(s->dim, lean, s->g + D * k);
            if (s->rest) L -= tlsphi_dot(s->dim, lean + D, s->rest + D * k);
            tlsphi_momentum_jump(s, a, b, s->dim, jump);
            for (size_t i = 0; i < D; i++) sum[i] += L * jump[i];
        }
        tlsphi_row_put(s, s->rows.lap_p, s->dim, a, sum);
    }
}
TLSPHI_INLINE void tlsphi_laplacian_tile(const tlsph_solver *s, const tlsphi_block *block, size_t tile, size_t begin,
                                         size_t end, const int dim) {
    const tlsphi_graph *graph = &s->graph;
    const size_t D = (size_t)dim, base = begin / TLSPHI_LANES * TLSPHI_LANES, raw = (size_t)graph->raw * TLSPHI_LANES;
    const tlsph_real rho = s->materials->rho, *a = tlsphi_at(s, s->rows.w, base);
    TLSPHI_ALIGNED tlsph_real lean[6 * TLSPHI_LANES], sum[3 * TLSPHI_LANES] = {0}, scale[TLSPHI_LANES];
    tlsphi_half_per_volume(s, base, begin - base, end - base, scale);
    tlsphi_take_lanes(s->lean + 2 * D * base, 2 * D, begin - base, end - base, lean);
    for (size_t k = graph->first[tile]; k < graph->first[tile + 1]; k++) {
        const tlsphi_slot *slot = graph->slot + k;
        const tlsph_real *g = graph->pattern + (size_t)slot->pattern * (size_t)graph->width * TLSPHI_LANES;
        const tlsph_real *b = tlsphi_gather(s, block, graph, slot, s->rows.w, s->rows.w + dim) +
                              (size_t)s->rows.w * TLSPHI_ROW;
        const tlsph_real *l_ab = g + (size_t)graph->laplacian * TLSPHI_LANES;
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
            tlsph_real L = 2 * l_ab[l] * scale[l];
            TLSPHI_UNROLL for (size_t i = 0; i < D; i++) {
                const size_t at = i * TLSPHI_LANES + l;
                L -= lean[at] * g[at] + (raw ? lean[D * TLSPHI_LANES + at] * (g[raw + at] - g[at]) : 0);
            }
            TLSPHI_UNROLL for (size_t i = 0; i < D; i++)
                sum[i * TLSPHI_LANES + l] += L * rho * (b[i * TLSPHI_ROW + l] - a[i * TLSPHI_ROW + l]);
        }
    }
    tlsphi_store_rows(dim, sum, begin - base, end - base, tlsphi_at(s, s->rows.lap_p, base));
}
static void tlsphi_laplacian_block(tlsph_solver *s, tlsphi_block *block) {
    for (size_t begin = block->begin, tile = block->tile, end; begin < block->end; begin = end, tile++) {
        end = tlsphi_tile_end(block, begin);
        if (!s->lanes) tlsphi_laplacian_particles(s, begin, end);
        else if (s->dim == 3) tlsphi_laplacian_tile(s, block, tile, begin, end, 3);
        else tlsphi_laplacian_tile(s, block, tile, begin, end, 2);
    }
}
/* ==== [FLUXES] =====================================================================================================
   One gather over the neighbours: stress, numerical dissipation and heat. The power of the stresses needs no pairs: the
   flux form (54e) is P_a : grad v_a + v_a . T_a/V_a identically, so E follows from the rates of F and p, and the total
   is conserved to round-off because force and gradient are adjoint. The physics of a pair is written once, for two sides
   that were loaded from the rows, and stands in two loops: over the lanes of a tile, and over the pairs of a particle
   (the printed dissipation, JST with several materials, bonds that conduct heat, metals with other reconstructions; with
   `audit` all, which is how tests compare the two). */

/* T_a, D_J, heat (E form: J/s; eta form: heat conduction/theta only), and what the ledger wants to know. */
typedef struct tlsphi_gathered {
    tlsph_real T[3], damped[3]; /* damped: the dissipation's part of T, where the step asks for it */
    tlsph_real J, heat, production, conduction, source;
    double least;
} tlsphi_gathered;

/* One side of a pair, as dissipation and heat see it. */
typedef struct tlsphi_damp_side {
    tlsph_real w[3], X[3], A[9], slope_w[9], c_p, c_s, rho, ratio, S, slope_S[3];
} tlsphi_damp_side;
typedef struct tlsphi_heat_side {
    tlsph_real X[3], A[9], theta, slope[3], heat[3], h_J;
} tlsphi_heat_side;

/* at: the particle's place in row 0 */
TLSPHI_INLINE void tlsphi_load_side(const tlsphi_rows *r, const tlsph_real *at, const size_t apart, const int dim,
                                    const int width, const size_t *columns, const int with_J, tlsphi_damp_side *out) {
    tlsphi_take_apart(dim, at + (size_t)r->w * apart, apart, out->w);
    tlsphi_take_components(width, columns, at + (size_t)r->X * apart, apart, out->X);
    tlsphi_take_columns(dim, width, columns, at + (size_t)r->A * apart, apart, out->A);
    tlsphi_take_columns(dim, width, columns, at + (size_t)r->slope_w * apart, apart, out->slope_w);
    out->c_p = at[(size_t)(r->wave + 0) * apart];
    out->c_s = at[(size_t)(r->wave + 1) * apart];
    out->rho = at[(size_t)(r->wave + 2) * apart];
    out->S = out->ratio = 0;
    if (!with_J) return;
    out->ratio = at[(size_t)(r->wave + 3) * apart];
    out->S = at[(size_t)r->S * apart];
    tlsphi_take_components(width, columns, at + (size_t)r->slope_S * apart, apart, out->slope_S);
}
TLSPHI_INLINE void tlsphi_load_heat(const tlsphi_rows *r, const tlsph_real *at, const size_t apart, const int dim,
                                    const int width, const size_t *columns, tlsphi_heat_side *out) {
    tlsphi_take_components(width, columns, at + (size_t)r->X * apart, apart, out->X);
    tlsphi_take_columns(dim, width, columns, at + (size_t)r->A * apart, apart, out->A);
    tlsphi_take_components(width, columns, at + (size_t)r->slope_theta * apart, apart, out->slope);
    tlsphi_take_components(width, columns, at + (size_t)r->heat * apart, apart, out->heat);
    out->theta = at[(size_t)r->theta * apart];
    out->h_J = at[(size_t)r->h_J * apart];
}

/* What a pair dissipates: the fluxes, their production, and whether it might be a front: if `approach` < 0. */
typedef struct tlsphi_damping {
    tlsph_real D_p[3], D_J, production, approach;
} tlsphi_damping;
/* (002-28) for one pair: lc = l_ab c; jumps of rho w, of its Laplacian and of w. */
TLSPHI_INLINE void tlsphi_jst_flux(const int dim, tlsph_real lc, tlsph_real eta2, tlsph_real eta4, const tlsph_real *jump,
                                   const tlsph_real *lap, const tlsph_real *Dw, tlsphi_damping *out) {
    out->production = 0;
    TLSPHI_UNROLL for (int i = 0; i < dim; i++) {
        out->D_p[i] = lc * (eta2 * jump[i] - eta4 * lap[i]);
        out->production += Dw[i] * out->D_p[i];
    }
}
TLSPHI_INLINE void tlsphi_pair_jst(const tlsph_solver *s, size_t a, size_t b, size_t k, int dim, tlsphi_damping *out) {
    const tlsph_real c = (tlsphi_material_of(s, a)->c_linear + tlsphi_material_of(s, b)->c_linear) / 2;
    const tlsph_real *lap_a = tlsphi_at(s, s->rows.lap_p, a), *lap_b = tlsphi_at(s, s->rows.lap_p, b);
    const tlsph_real *w_a = tlsphi_at(s, s->rows.w, a), *w_b = tlsphi_at(s, s->rows.w, b);
    tlsph_real jump[3], lap[3], Dw[3];
    tlsphi_momentum_jump(s, a, b, dim, jump);
    TLSPHI_UNROLL for (size_t i = 0; i < (size_t)dim; i++) {
        lap[i] = lap_b[i * TLSPHI_ROW] - lap_a[i * TLSPHI_ROW];
        Dw[i] = w_b[i * TLSPHI_ROW] - w_a[i * TLSPHI_ROW];
    }
    tlsphi_jst_flux(dim, s->laplacian[k] * c, TLSPHI_R(s->harmonic), TLSPHI_R(s->biharmonic), jump, lap, Dw, out);
}
/* Default forms for one pair: g and |C| of the pair. dim, width, with_J, with_front, kind are constants after inlining.
   Without with_front the fluxes are those away from fronts; `approach` tells whether that must be looked at again. */
TLSPHI_INLINE void tlsphi_pair_dissipate(const tlsphi_damp_side *a, const tlsphi_damp_side *b, const tlsph_real *g,
                                         tlsph_real CC, const int dim, const int width, const int with_J,
                                         const int with_front, const int kind, const int metal, tlsph_real jump_share,
                                         tlsphi_damping *out) {
    tlsph_real c[3] = {0}, d[3] = {0}, Dv[3], Dr[3], front = 0;
    tlsphi_multiply_mean(dim, width, a->A, b->A, g, c);
    TLSPHI_UNROLL for (int i = 0; i < width; i++) d[i] = b->X[i] - a->X[i];
    tlsphi_multiply_mean(dim, width, a->slope_w, b->slope_w, d, Dr);
    TLSPHI_UNROLL for (int i = 0; i < dim; i++) {
        Dv[i] = b->w[i] - a->w[i];
        Dr[i] = Dv[i] - Dr[i];
    }
    const tlsph_real cc = tlsphi_dot(dim, c, c), inverse = tlsphi_inverse_or_0(cc);
    const tlsph_real rho = (a->rho + b->rho) / 2, half = TLSPHI_R(0.5);
    const tlsph_real share = metal ? half * tlsphi_square_root(cc) * tlsphi_inverse_or_0(CC) : half;
    const tlsph_real c_p = (a->c_p + b->c_p) * share, c_s = (a->c_s + b->c_s) * share;
    const tlsph_real raw = tlsphi_dot(dim, c, Dv), low = TLSPHI_R(TLSPHI_FRONT_LOW) * c_p;
    out->approach = raw * tlsphi_abs(raw) + low * low * cc;
    if (kind == TLSPH_LIMITED && with_front && !metal) {
        const tlsph_real per = tlsphi_inverse_root(cc);
        tlsph_real Gd_a[3], Gd_b[3];
        tlsphi_multiply_thin(dim, width, a->slope_w, d, Gd_a);
        tlsphi_multiply_thin(dim, width, b->slope_w, d, Gd_b);
        front = tlsphi_front(raw * per, tlsphi_dot(dim, c, Gd_a) * per, tlsphi_dot(dim, c, Gd_b) * per, c_p);
    }
    tlsphi_damp_velocity(dim, kind, with_front, Dv, Dr, c, inverse, front,
                         tlsphi_pair_density(a->rho, b->rho) * CC / 2, c_p, c_s, out->D_p);
    out->production = tlsphi_dot(dim, kind == TLSPH_SELF_ADJOINT ? Dr : Dv, out->D_p);
    out->D_J = 0;
    if (!with_J) return;
    tlsph_real slope;
    tlsphi_multiply_mean(1, width, a->slope_S, b->slope_S, d, &slope);
    const tlsph_real DS = b->S - a->S;
    out->D_J = tlsphi_jacobian_factor(jump_share, cc, CC, rho, c_p, (a->ratio + b->ratio) / 2) *
               tlsphi_damped_jump(kind, with_front, DS, DS - slope, front);
    out->production += DS * out->D_J;
}

/* The printed form in the same place; slow and seldom used, so it goes through the public function. `heat` is what the
   particle a gets beside half of the production. */
static void tlsphi_pair_printed(const tlsph_solver *s, size_t a, size_t b, const tlsphi_damp_side *side_a,
                                const tlsphi_damp_side *side_b, const tlsph_real *C, const tlsph_real *c,
                                tlsphi_damping *out, tlsph_real *heat) {
    const int dim = s->dim;
    const size_t index[2] = {a, b};
    const tlsphi_damp_side *given[2] = {side_a, side_b};
    tlsph_pair_side side[2];
    tlsph_pair_flux flux;
    tlsph_real C3[3] = {0}, c3[3] = {0}, d[3] = {0};
    memset(side, 0, sizeof side);
    for (int i = 0; i < 2; i++) {
        const size_t q = index[i];
        side[i].theta_R = tlsphi_material_of(s, q)->theta_R; /* eta form and isothermal: (72) */
        side[i].theta = s->thermal == TLSPH_ENERGY ? *tlsphi_at(s, s->rows.theta, q) : side[i].theta_R;
        side[i].c_p = given[i]->c_p;
        side[i].c_s = given[i]->c_s;
        side[i].density = given[i]->rho;
        side[i].drift_ratio = given[i]->ratio;
        side[i].Sigma_J = given[i]->S;
        for (int k = 0; k < dim; k++) /* (66) has the rigid motion in it, (72) not */
            side[i].velocity[k] = s->thermal == TLSPH_ENERGY ? tlsphi_v(s, q, (size_t)k) : given[i]->w[k];
    }
    for (int k = 0; k < dim; k++) {
        C3[k] = C[k];
        c3[k] = c[k];
    }
    tlsph_pair_dissipation(s->thermal == TLSPH_ENERGY ? TLSPH_AS_PRINTED : TLSPH_FIRST_ORDER, &side[0], &side[1], C3,
                           c3, d, s->has_J ? s->jump_share : 0, &flux);
    for (int k = 0; k < dim; k++) out->D_p[k] = flux.D_p[k];
    out->D_J = flux.D_J;
    out->production = flux.production;
    /* D_p works on w in the end, because the projection takes its resultant and torque away; half of the production and
       S_a D_J are added for all forms alike */
    *heat = s->thermal == TLSPH_ENERGY ? flux.D_E - tlsphi_dot(dim, side_a->w, flux.D_p) - flux.production / 2 -
                                             side_a->S * flux.D_J
                                       : 0;
}

/* Heat of one pair. The double-gradient flux of (54e), (57), whose production is Q.grad theta/theta^2 exactly, and in
   the compact form the difference between the two-point flux k (theta_b - theta_a) and its value from the gradients. On an
   undeformed lattice the sum is the two-point flux, under shear the mixed terms of K stay; the limiter is that of the
   dissipation, so heat of this part only flows down the pair's temperature difference. k = h/J |c|^2/|C|^2 (C.d)/|d|^2,
   on lattices h/J |c|^2/(C.d), which is unbounded in clouds, where C may be nearly perpendicular to d.
   Where one neighbour is more than twice as hot as the other, the products Q_a theta_b/theta_a of the double gradient are
   larger than any flux, and unstable; there the two-point flux stands alone. */
/* k with CC = |C|^2; along: C.d, or NULL where C is at hand. */
TLSPHI_INLINE tlsph_real tlsphi_conductance(const tlsphi_heat_side *a, const tlsphi_heat_side *b,
                                            const tlsph_real *g, tlsph_real CC, const tlsph_real *C,
                                            const tlsph_real *along, const int dim, const int width) {
    tlsph_real d[3] = {0}, c_a[3] = {0}, c_b[3] = {0};
    TLSPHI_UNROLL for (int i = 0; i < width; i++) d[i] = b->X[i] - a->X[i];
    const tlsph_real Cd = tlsphi_max(along ? *along : tlsphi_dot(width, C, d), 0);
    tlsphi_multiply_thin(dim, width, a->A, g, c_a);
    tlsphi_multiply_thin(dim, width, b->A, g, c_b);
    return (a->h_J * tlsphi_dot(dim, c_a, c_a) + b->h_J * tlsphi_dot(dim, c_b, c_b)) * Cd *
           tlsphi_inverse_or_0(2 * CC * tlsphi_dot(width, d, d));
}
typedef struct tlsphi_pair_of_heat {
    tlsph_real heat, source, conduction;
} tlsphi_pair_of_heat;

TLSPHI_INLINE void tlsphi_pair_heat(const tlsphi_heat_side *a, const tlsphi_heat_side *b, const tlsph_real *g,
                                    tlsph_real k, const tlsph_real *rest, const int dim, const int width, int thermal,
                                    const int compact, tlsphi_pair_of_heat *out) {
    tlsph_real q_a = tlsphi_dot(width, a->heat, g), q_b = tlsphi_dot(width, b->heat, g);
    if (rest) {
        q_a += tlsphi_dot(dim, a->heat, rest);
        q_b -= tlsphi_dot(dim, b->heat, rest);
    }
    const tlsph_real D_theta = b->theta - a->theta, one = 1;
    const int front = compact && ((D_theta > a->theta) | (-D_theta > b->theta));
    q_a = tlsphi_choose(front, 0, q_a);
    q_b = tlsphi_choose(front, 0, q_b);
    out->source = -q_a * D_theta;
    const int energy = thermal == TLSPH_ENERGY;
    out->heat = -(q_a * tlsphi_choose(energy, b->theta, one) + q_b * tlsphi_choose(energy, a->theta, one)) / 2;
    out->conduction = 0;
    if (!compact) return;
    tlsph_real d[3] = {0};
    TLSPHI_UNROLL for (int i = 0; i < width; i++) d[i] = b->X[i] - a->X[i];
    const tlsph_real slope = (tlsphi_dot(width, a->slope, d) + tlsphi_dot(width, b->slope, d)) / 2;
    const tlsph_real limited = tlsphi_damped_jump(TLSPH_LIMITED, 0, D_theta, D_theta - slope, 0);
    const tlsph_real into = k * tlsphi_choose(front, D_theta, limited);
    out->heat += into / tlsphi_choose(energy, one, a->theta);
    out->conduction = into * D_theta * tlsphi_inverse_or_0(2 * a->theta * b->theta);
}

/* Audit: the pair's production over the size of its terms must not be negative beyond round-off. */
static double tlsphi_audit(int dim, const tlsphi_damp_side *a, const tlsphi_damp_side *b, const tlsphi_damping *flux) {
    double size = fabs((double)(b->S - a->S) * (double)flux->D_J);
    for (int i = 0; i < dim; i++) size += fabs((double)(b->w[i] - a->w[i]) * (double)flux->D_p[i]);
    return size > 0 ? (double)flux->production / size : 0;
}

/* -- the pairs of a particle, one by one -- */

/* Stresses, and heat, of one pair. */
TLSPHI_INLINE void tlsphi_add_heat(const tlsph_solver *s, size_t a, size_t k, const tlsph_real *C, const int dim,
                                   int thermal, tlsphi_gathered *sum) {
    const tlsph_real *g = s->g + (size_t)dim * k;
    const tlsph_real *rest = s->rest && s->force_form == TLSPH_ADJOINT ? s->rest + (size_t)dim * k : NULL;
    tlsphi_heat_side side_a, side_b;
    tlsphi_pair_of_heat heat;
    tlsphi_load_heat(&s->rows, tlsphi_at(s, 0, a), TLSPHI_ROW, dim, dim, tlsphi_columns[7], &side_a);
    tlsphi_load_heat(&s->rows, tlsphi_at(s, 0, s->neighbour[k]), TLSPHI_ROW, dim, dim, tlsphi_columns[7], &side_b);
    const tlsph_real conductance = tlsphi_conductance(&side_a, &side_b, g, tlsphi_dot(dim, C, C), C, NULL, dim, dim);
    tlsphi_pair_heat(&side_a, &side_b, g, conductance, rest, dim, dim, thermal, s->conduction == TLSPH_COMPACT, &heat);
    sum->heat += heat.heat;
    sum->source += heat.source;
    sum->conduction += heat.conduction;
}
TLSPHI_INLINE void tlsphi_add_stress(const tlsph_solver *s, size_t a, size_t k, const tlsph_real *C, const int dim,
                                     tlsphi_gathered *sum) {
    const int dd = dim * dim;
    const size_t b = s->neighbour[k], D = (size_t)dim;
    const tlsph_real *g = s->g + D * k, *rest = s->rest && s->force_form == TLSPH_ADJOINT ? s->rest + D * k : NULL;
    tlsph_real P_a[9], P_b[9], t[3];
    tlsphi_row_get(s, s->rows.P, dd, a, P_a);
    tlsphi_row_get(s, s->rows.P, dd, b, P_b);
    tlsphi_multiply_mean(dim, dim, P_a, P_b, g, t); /* (P_a C_ab - P_b C_ba)/2 */
    for (int i = 0; i < dim; i++) sum->T[i] += t[i];
    if (rest) { /* (P_a - P_b) r_ab / 2 */
        for (int i = 0; i < dd; i++) P_a[i] = (P_a[i] - P_b[i]) / 2;
        tlsphi_multiply(dim, P_a, rest, t);
        for (int i = 0; i < dim; i++) sum->T[i] += t[i];
    }
    if (s->heat_moves) tlsphi_add_heat(s, a, k, C, dim, s->thermal, sum);
}
/* Dissipation of the pair k of s->g, or of s->damped_g. */
TLSPHI_INLINE void tlsphi_add_damping_of(const tlsph_solver *s, size_t a, size_t b, size_t k, const tlsph_real *g,
                                         const tlsph_real *C, const int dim, tlsphi_gathered *sum) {
    tlsphi_damp_side side_a, side_b;
    tlsphi_damping flux;
    tlsph_real heat = 0, c[3];
    memset(&flux, 0, sizeof flux);
    if (s->dissipation != TLSPH_JST || s->audit) {
        tlsphi_load_side(&s->rows, tlsphi_at(s, 0, a), TLSPHI_ROW, dim, dim, tlsphi_columns[7], s->has_J, &side_a);
        tlsphi_load_side(&s->rows, tlsphi_at(s, 0, b), TLSPHI_ROW, dim, dim, tlsphi_columns[7], s->has_J, &side_b);
    }
    if (s->dissipation == TLSPH_AS_PRINTED) {
        tlsphi_multiply_mean(dim, dim, side_a.A, side_b.A, g, c);
        tlsphi_pair_printed(s, a, b, &side_a, &side_b, C, c, &flux, &heat);
    } else if (s->dissipation == TLSPH_JST) {
        tlsphi_pair_jst(s, a, b, k, dim, &flux);
    } else {
        const tlsph_real CC = tlsphi_sqrt(tlsphi_max(tlsphi_dot(dim, C, C), TLSPHI_TINY));
        tlsphi_pair_dissipate(&side_a, &side_b, g, CC, dim, dim, s->has_J, 1, (int)s->dissipation, s->metal,
                              s->jump_share, &flux);
    }
    for (int i = 0; i < dim; i++) sum->T[i] += flux.D_p[i];
    for (int i = 0; i < dim; i++) sum->damped[i] += flux.D_p[i];
    sum->J += flux.D_J;
    sum->heat += heat;
    sum->production += flux.production;
    if (s->audit) sum->least = tlsphi_dmin(sum->least, tlsphi_audit(dim, &side_a, &side_b, &flux));
}
/* parts: TLSPHI_STRESSES (and heat) or TLSPHI_DAMPING or both; apart only where the dissipation is frozen or has pairs of
   its own. TLSPHI_HEAT: that of the E form alone, see [SUPER-STEPS]. */
enum { TLSPHI_STRESSES = 1, TLSPHI_DAMPING = 2, TLSPHI_BOTH = 3, TLSPHI_HEAT = 4 };
TLSPHI_INLINE void tlsphi_flux_pairs(const tlsph_solver *s, size_t a, int parts, const int dim, tlsphi_gathered *sum) {
    const size_t D = (size_t)dim, *first = parts == TLSPHI_DAMPING ? s->damped_first : s->first;
    const uint32_t *neighbour = parts == TLSPHI_DAMPING ? s->damped_neighbour : s->neighbour;
    const tlsph_real *vectors = parts == TLSPHI_DAMPING ? s->damped_g : s->g;
    if (s->dissipation == TLSPH_NO_DISSIPATION) parts &= ~TLSPHI_DAMPING;
    for (size_t k = first[a]; k < first[a + 1]; k++) {
        const size_t b = neighbour[k];
        const tlsph_real *g = vectors + D * k;
        tlsph_real C[3];
        tlsphi_skew_vector(s, a, b, dim, g, C);
        if (parts & TLSPHI_STRESSES) tlsphi_add_stress(s, a, k, C, dim, sum);
        if (parts & TLSPHI_HEAT) tlsphi_add_heat(s, a, k, C, dim, TLSPH_ENERGY, sum);
        if (parts & TLSPHI_DAMPING) tlsphi_add_damping_of(s, a, b, k, g, C, dim, sum);
    }
}

static void tlsphi_flux_one_by_one(const tlsph_solver *s, size_t begin, size_t end, int parts, tlsphi_gathered *out) {
    memset(out, 0, (end - begin) * sizeof *out);
    for (size_t a = begin; a < end; a++, out++) {
        out->least = TLSPHI_LARGEST;
        if (s->dim == 3) tlsphi_flux_pairs(s, a, parts, 3, out);
        else tlsphi_flux_pairs(s, a, parts, 2, out);
    }
}

/* -- the pairs of a tile, slot by slot -- */

typedef struct TLSPHI_ALIGNED tlsphi_lane_sums {
    tlsph_real T[3 * TLSPHI_LANES], damped[3 * TLSPHI_LANES];
    tlsph_real J[TLSPHI_LANES], production[TLSPHI_LANES];
    tlsph_real heat[TLSPHI_LANES], source[TLSPHI_LANES], conduction[TLSPHI_LANES];
    tlsph_real approach[TLSPHI_LANES]; /* the least of the pairs: fronts where it is below 0 */
} tlsphi_lane_sums;
TLSPHI_INLINE void tlsphi_clear_damping(tlsphi_lane_sums *sum) {
    tlsphi_clear_lanes(3, sum->damped);
    tlsphi_clear_lanes(1, sum->J);
    tlsphi_clear_lanes(1, sum->production);
    tlsphi_clear_lanes(1, sum->approach);
}

TLSPHI_INLINE void tlsphi_stress_lanes(const tlsphi_rows *r, const tlsph_real *a, const tlsph_real *b,
                                       const tlsph_real *pattern, const int dim, const int width,
                                       const size_t *columns, tlsphi_lane_sums *sum) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsph_real P_a[9], P_b[9], g[3], t[3];
        tlsphi_take_columns(dim, width, columns, a + r->P * TLSPHI_LANES + l, TLSPHI_LANES, P_a);
        tlsphi_take_columns(dim, width, columns, b + r->P * TLSPHI_ROW + l, TLSPHI_ROW, P_b);
        tlsphi_take_components(width, columns, pattern + l, TLSPHI_LANES, g);
        tlsphi_multiply_mean(dim, width, P_a, P_b, g, t);
        TLSPHI_UNROLL for (int i = 0; i < dim; i++) sum->T[(size_t)i * TLSPHI_LANES + l] += t[i];
    }
}
TLSPHI_INLINE void tlsphi_heat_lanes(const tlsphi_rows *r, const tlsph_real *a, const tlsph_real *b,
                                     const tlsph_real *pattern, const int dim, const int width, const size_t *columns,
                                     int thermal, const int compact, const int given, tlsphi_lane_sums *sum) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsphi_heat_side side_a, side_b;
        tlsphi_pair_of_heat heat;
        tlsph_real g[3], k = 0;
        tlsphi_load_heat(r, a + l, TLSPHI_LANES, dim, width, columns, &side_a);
        tlsphi_load_heat(r, b + l, TLSPHI_ROW, dim, width, columns, &side_b);
        tlsphi_take_components(width, columns, pattern + l, TLSPHI_LANES, g);
        const tlsph_real *size = pattern + (size_t)dim * TLSPHI_LANES + l, *along = given ? size + TLSPHI_LANES : NULL;
        if (compact) k = tlsphi_conductance(&side_a, &side_b, g, *size * *size, g, along, dim, width);
        tlsphi_pair_heat(&side_a, &side_b, g, k, NULL, dim, width, thermal, compact, &heat);
        sum->heat[l] += heat.heat;
        sum->source[l] += heat.source;
        sum->conduction[l] += heat.conduction;
    }
}
/* Adds the dissipation of a slot, with a look for fronts or that of metals. */
enum { TLSPHI_PLAIN, TLSPHI_FRONTS, TLSPHI_METALS };
TLSPHI_INLINE void tlsphi_damp_lanes(const tlsphi_rows *r, const tlsph_real *a, const tlsph_real *b,
                                     const tlsph_real *pattern, const int dim, const int width, const size_t *columns,
                                     const int with_J, const int kind, const int mode, tlsph_real jump_share,
                                     tlsphi_lane_sums *sum) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsphi_damp_side side_a, side_b;
        tlsphi_damping flux;
        tlsph_real g[3];
        tlsphi_load_side(r, a + l, TLSPHI_LANES, dim, width, columns, with_J, &side_a);
        tlsphi_load_side(r, b + l, TLSPHI_ROW, dim, width, columns, with_J, &side_b);
        tlsphi_take_components(width, columns, pattern + l, TLSPHI_LANES, g);
        tlsphi_pair_dissipate(&side_a, &side_b, g, pattern[(size_t)dim * TLSPHI_LANES + l], dim, width, with_J,
                              mode == TLSPHI_FRONTS, kind, mode == TLSPHI_METALS, jump_share, &flux);
        TLSPHI_UNROLL for (int i = 0; i < dim; i++) sum->damped[(size_t)i * TLSPHI_LANES + l] += flux.D_p[i];
        if (with_J) sum->J[l] += flux.D_J;
        sum->production[l] += flux.production;
        sum->approach[l] = tlsphi_min(sum->approach[l], flux.approach);
    }
}
/* The vectors of a slot without the pairs whose dissipation belongs to another pass, see [MULTI-RATE]. */
static const tlsph_real *tlsphi_mask_slot(const tlsph_solver *s, const tlsphi_graph *graph, const tlsphi_slot *slot,
                                          size_t base, int dim, const tlsph_real *g, tlsph_real *out) {
    for (size_t l = 0; l < TLSPHI_LANES; l++) {
        const size_t a = base + l, b = tlsphi_slot_neighbour(graph, slot, l);
        const int level_a = a < s->n ? s->rates.of[a] : 0, level_b = b < s->n ? s->rates.of[b] : 0;
        const int in = (level_a > level_b ? level_a : level_b) == s->rates.level;
        for (size_t i = 0; i <= (size_t)dim; i++) out[i * TLSPHI_LANES + l] = in ? g[i * TLSPHI_LANES + l] : 0;
    }
    return out;
}
/* By the columns that the vectors of a slot have: stresses; heat; the default dissipation, as tlsphi_damp_lanes. */
TLSPHI_INLINE void tlsphi_stress_slot(const tlsphi_rows *r, const tlsph_real *a, const tlsph_real *b, const tlsph_real *g,
                                      const int dim, int axes, tlsphi_lane_sums *sum) {
    const int width = tlsphi_widths[axes];
    if (width == 1) tlsphi_stress_lanes(r, a, b, g, dim, 1, tlsphi_columns[axes], sum);
    else if (width < dim) tlsphi_stress_lanes(r, a, b, g, dim, 2, tlsphi_columns[axes], sum);
    else tlsphi_stress_lanes(r, a, b, g, dim, dim, tlsphi_columns[7], sum);
}
TLSPHI_INLINE void tlsphi_heat_slot(const tlsph_solver *s, const tlsphi_rows *r, const tlsph_real *a, const tlsph_real *b,
                                    const tlsph_real *g, const int dim, int axes, tlsphi_lane_sums *sum) {
    const size_t *const all = tlsphi_columns[7];
    if (s->conduction != TLSPH_COMPACT) tlsphi_heat_lanes(r, a, b, g, dim, dim, all, s->thermal, 0, 0, sum);
    else if (s->M) tlsphi_heat_lanes(r, a, b, g, dim, dim, all, s->thermal, 1, 1, sum);
    else if (tlsphi_widths[axes] == 1)
        tlsphi_heat_lanes(r, a, b, g, dim, 1, tlsphi_columns[axes], s->thermal, 1, 0, sum);
    else tlsphi_heat_lanes(r, a, b, g, dim, dim, all, s->thermal, 1, 0, sum);
}
TLSPHI_INLINE void tlsphi_limited_slot(const tlsphi_rows *r, const tlsph_real *a, const tlsph_real *b,
                                       const tlsph_real *g, const int dim, int axes, const int with_J, const int mode,
                                       tlsph_real share, tlsphi_lane_sums *sum) {
    const size_t *const columns = tlsphi_columns[axes], *const all = tlsphi_columns[7];
    const int width = tlsphi_widths[axes];
    if (width == 1) tlsphi_damp_lanes(r, a, b, g, dim, 1, columns, with_J, TLSPH_LIMITED, mode, share, sum);
    else if (width < dim) tlsphi_damp_lanes(r, a, b, g, dim, 2, columns, with_J, TLSPH_LIMITED, mode, share, sum);
    else tlsphi_damp_lanes(r, a, b, g, dim, dim, all, with_J, TLSPH_LIMITED, mode, share, sum);
}
TLSPHI_INLINE void tlsphi_damp_slot(const tlsph_solver *s, const tlsphi_rows *r, const tlsph_real *a,
                                    const tlsph_real *b, const tlsph_real *g, const int dim, int axes,
                                    const int with_J, tlsphi_lane_sums *sum) {
    const size_t *const all = tlsphi_columns[7];
    const tlsph_real share = s->jump_share;
    if (s->dissipation == TLSPH_LIMITED) tlsphi_limited_slot(r, a, b, g, dim, axes, with_J, 0, share, sum);
    else if (s->dissipation == TLSPH_FIRST_ORDER)
        tlsphi_damp_lanes(r, a, b, g, dim, dim, all, with_J, TLSPH_FIRST_ORDER, 0, share, sum);
    else if (s->dissipation == TLSPH_RECONSTRUCTED)
        tlsphi_damp_lanes(r, a, b, g, dim, dim, all, with_J, TLSPH_RECONSTRUCTED, 0, share, sum);
    else tlsphi_damp_lanes(r, a, b, g, dim, dim, all, with_J, TLSPH_SELF_ADJOINT, 0, share, sum);
}
/* mode: with a look for fronts, or of metals, the default dissipation and nothing else. */
TLSPHI_INLINE void tlsphi_flux_slots(const tlsph_solver *s, const tlsphi_block *block, size_t tile, size_t base,
                                     const int dim, const int with_J, const int mode, int parts,
                                     tlsphi_lane_sums *sum) {
    const tlsphi_graph *graph = parts == TLSPHI_DAMPING ? &s->damped_graph : &s->graph;
    const tlsphi_rows r = tlsphi_rows_of(dim, with_J, 1, 1, 0); /* constants; those that differ in a scene are not used */
    TLSPHI_ALIGNED tlsph_real a[TLSPHI_ROWS_MOST * TLSPHI_LANES];
    const int stresses = mode == TLSPHI_PLAIN && (parts & TLSPHI_STRESSES), heats = s->heat_moves && stresses;
    const int rows = heats ? r.count : with_J ? r.theta : r.S;
    const int damps = (parts & TLSPHI_DAMPING) && s->dissipation != TLSPH_NO_DISSIPATION && s->dissipation != TLSPH_JST;
    const int thin = (!damps || s->dissipation == TLSPH_LIMITED) && (!heats || (s->conduction == TLSPH_COMPACT && !s->M));
    tlsphi_take_tile(tlsphi_at(s, 0, base), r.w, rows, a);
    for (size_t k = graph->first[tile]; k < graph->first[tile + 1]; k++) {
        const tlsphi_slot *slot = graph->slot + k;
        const tlsph_real *g = graph->pattern + (size_t)slot->pattern * (size_t)graph->width * TLSPHI_LANES;
        const int column = slot->scattered && tlsphi_widths[slot->axes] == 1 && thin;
        const int axis = (int)tlsphi_columns[slot->axes][0];
        const tlsph_real *b = column ? tlsphi_gather_column(s, block, graph, slot, &r, axis, dim, rows)
                                     : tlsphi_gather(s, block, graph, slot, r.w, rows);
        if (stresses) tlsphi_stress_slot(&r, a, b, g, dim, slot->axes, sum);
        if (heats) tlsphi_heat_slot(s, &r, a, b, g, dim, slot->axes, sum);
        tlsph_real masked[4 * TLSPHI_LANES];
        if (damps && block->seen) g = tlsphi_mask_slot(s, graph, slot, base, dim, g, masked);
        if (!damps) continue;
        if (mode) tlsphi_limited_slot(&r, a, b, g, dim, slot->axes, with_J, mode, s->jump_share, sum);
        else tlsphi_damp_slot(s, &r, a, b, g, dim, slot->axes, with_J, sum);
    }
}
#define TLSPHI_FLUX_SLOTS(dim, J, mode)                                                                                \
    static void tlsphi_flux_slots_##dim##J##mode(const tlsph_solver *s, const tlsphi_block *block, size_t tile,        \
                                                   size_t base, int parts, tlsphi_lane_sums *sum) {                    \
        tlsphi_flux_slots(s, block, tile, base, dim, J, mode, parts, sum);                                             \
    }
#define TLSPHI_EACH_FLUX(X)                                                                                            \
    X(2, 0, 0) X(2, 0, 1) X(2, 0, 2) X(2, 1, 0) X(2, 1, 1) X(2, 1, 2)                                                  \
    X(3, 0, 0) X(3, 0, 1) X(3, 0, 2) X(3, 1, 0) X(3, 1, 1) X(3, 1, 2)
TLSPHI_EACH_FLUX(TLSPHI_FLUX_SLOTS)
#define TLSPHI_CASE(dim, J, mode)                                                                                      \
    case 6 * (dim == 3) + 3 * J + mode: tlsphi_flux_slots_##dim##J##mode(s, block, tile, base, parts, sum); break;

static void tlsphi_add_slots(const tlsph_solver *s, const tlsphi_block *block, size_t tile, size_t base, int mode,
                             int parts, tlsphi_lane_sums *sum) {
    switch ((s->dim == 3 ? 6 : 0) + (s->has_J ? 3 : 0) + mode) {
        TLSPHI_EACH_FLUX(TLSPHI_CASE)
    default: break;
    }
}
#undef TLSPHI_CASE
#undef TLSPHI_EACH_FLUX
/* P += P_D M of the particles [begin, end) of a tile (TLSPH_SELF_ADJOINT). Other tasks read no P meanwhile. */
TLSPHI_INLINE void tlsphi_adjoint_tile(const tlsph_solver *s, const tlsphi_block *block, size_t tile, size_t begin,
                                       size_t end, const int dim) {
    const tlsphi_graph *graph = &s->graph;
    const tlsphi_rows r = tlsphi_rows_of(dim, 0, 1, 1, 0);
    const size_t base = begin / TLSPHI_LANES * TLSPHI_LANES, D = (size_t)dim, dd = D * D;
    TLSPHI_ALIGNED tlsph_real a[TLSPHI_ROWS_MOST * TLSPHI_LANES], sum[9 * TLSPHI_LANES] = {0};
    tlsphi_take_tile(tlsphi_at(s, 0, base), r.w, r.S, a);
    for (size_t k = graph->first[tile]; k < graph->first[tile + 1]; k++) {
        const tlsphi_slot *slot = graph->slot + k;
        const tlsph_real *g = graph->pattern + (size_t)slot->pattern * (size_t)graph->width * TLSPHI_LANES;
        const tlsph_real *b = tlsphi_gather(s, block, graph, slot, r.w, r.P);
        tlsphi_lane_sums flux;
        tlsphi_clear_damping(&flux);
        if (slot->scattered) tlsphi_gather(s, block, graph, slot, r.A, r.S);
        tlsphi_damp_lanes(&r, a, b, g, dim, dim, tlsphi_columns[7], 0, TLSPH_SELF_ADJOINT, TLSPHI_PLAIN, 0, &flux);
        for (size_t j = 0; j < D; j++) {
            const tlsph_real *X_a = a + ((size_t)r.X + j) * TLSPHI_LANES, *X_b = b + ((size_t)r.X + j) * TLSPHI_ROW;
            for (size_t i = 0; i < D; i++)
                for (size_t l = 0; l < TLSPHI_LANES; l++)
                    sum[(D * i + j) * TLSPHI_LANES + l] -= flux.damped[i * TLSPHI_LANES + l] * (X_b[l] - X_a[l]);
        }
    }
    for (size_t p = begin; p < end; p++) {
        tlsph_real P_D[9], PM[9], P[9];
        for (size_t i = 0; i < dd; i++) P_D[i] = sum[i * TLSPHI_LANES + p - base] / (2 * s->V[p]);
        for (const tlsphi_mirror *m = tlsphi_mirrors_of(s, p); m && m->particle == p; m++)
            tlsphi_mirror_tensor(dim, m, P_D);
        tlsphi_correct_tensor(s, p, dim, P_D, PM);
        tlsphi_row_get(s, r.P, (int)dd, p, P);
        for (size_t i = 0; i < dd; i++) P[i] += PM[i];
        tlsphi_row_put(s, r.P, (int)dd, p, P);
    }
}
static void tlsphi_adjoint_block(tlsph_solver *s, tlsphi_block *block) {
    for (size_t a = block->begin, tile = block->tile, end; a < block->end; a = end, tile++) {
        end = tlsphi_tile_end(block, a);
        if (s->dim == 3) tlsphi_adjoint_tile(s, block, tile, a, end, 3);
        else tlsphi_adjoint_tile(s, block, tile, a, end, 2);
    }
}
/* (P_a - P_b) r_ab/2 of a tile ([BONDS]): a gather of its own, so that other operators have no branch in theirs. */
TLSPHI_INLINE void tlsphi_add_rests(const tlsph_solver *s, const tlsphi_block *block, size_t tile, size_t base,
                                    const int dim, tlsph_real *T) {
    const tlsphi_graph *graph = &s->graph;
    const tlsphi_rows r = tlsphi_rows_of(dim, 0, 1, 1, 0);
    const size_t D = (size_t)dim;
    for (size_t k = graph->first[tile]; k < graph->first[tile + 1]; k++) {
        const tlsphi_slot *slot = graph->slot + k;
        const tlsph_real *g = graph->pattern + (size_t)slot->pattern * (size_t)graph->width * TLSPHI_LANES;
        const tlsph_real *raw = g + (size_t)graph->raw * TLSPHI_LANES;
        const tlsph_real *b = tlsphi_gather(s, block, graph, slot, r.P, r.P + dim * dim), *a = tlsphi_at(s, 0, base);
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
            TLSPHI_UNROLL for (size_t i = 0; i < D; i++) {
                tlsph_real sum = 0;
                TLSPHI_UNROLL for (size_t j = 0; j < D; j++) {
                    const size_t at = ((size_t)r.P + D * i + j) * TLSPHI_ROW + l, m = j * TLSPHI_LANES + l;
                    sum += (a[at] - b[at]) * (raw[m] - g[m]);
                }
                T[i * TLSPHI_LANES + l] += sum / 2;
            }
        }
    }
}
/* The dissipation of TLSPH_JST of a tile. */
TLSPHI_INLINE void tlsphi_add_jst(const tlsph_solver *s, const tlsphi_block *block, size_t tile, size_t base,
                                  const int dim, tlsphi_lane_sums *sum) {
    const tlsphi_graph *graph = &s->graph;
    const size_t D = (size_t)dim, w = (size_t)s->rows.w * TLSPHI_ROW, lap_p = (size_t)s->rows.lap_p * TLSPHI_ROW;
    const tlsph_real rho = s->materials->rho, c = s->materials->c_linear, *a = tlsphi_at(s, 0, base);
    const tlsph_real eta2 = TLSPHI_R(s->harmonic), eta4 = TLSPHI_R(s->biharmonic);
    for (size_t k = graph->first[tile]; k < graph->first[tile + 1]; k++) {
        const tlsphi_slot *slot = graph->slot + k;
        const size_t row = (size_t)slot->pattern * (size_t)graph->width + (size_t)graph->laplacian;
        const tlsph_real *l_ab = graph->pattern + row * TLSPHI_LANES;
        const tlsph_real *b = tlsphi_gather(s, block, graph, slot, s->rows.w, s->rows.w + dim);
        if (slot->scattered) tlsphi_gather(s, block, graph, slot, s->rows.lap_p, s->rows.lap_p + dim);
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
            tlsph_real jump[3], lap[3], Dw[3];
            tlsphi_damping flux;
            TLSPHI_UNROLL for (size_t i = 0; i < D; i++) {
                Dw[i] = b[w + i * TLSPHI_ROW + l] - a[w + i * TLSPHI_ROW + l];
                jump[i] = rho * Dw[i];
                lap[i] = b[lap_p + i * TLSPHI_ROW + l] - a[lap_p + i * TLSPHI_ROW + l];
            }
            tlsphi_jst_flux(dim, l_ab[l] * c, eta2, eta4, jump, lap, Dw, &flux);
            TLSPHI_UNROLL for (size_t i = 0; i < D; i++) sum->damped[i * TLSPHI_LANES + l] += flux.D_p[i];
            sum->production[l] += flux.production;
        }
    }
}
static int tlsphi_any_front(const tlsphi_lane_sums *sum) {
    int any = 0;
    for (size_t l = 0; l < TLSPHI_LANES; l++) any |= sum->approach[l] < 0;
    return any;
}
/* Sums of a tile, whose first lane is particle `base`. To look for fronts takes nearly twice as long: that is done where
   the tile had one last time, and where a new one shows, in place of what was taken without. The sums are the same. */
static void tlsphi_flux_tile(const tlsph_solver *s, tlsphi_block *block, size_t tile, size_t base, int parts,
                             tlsphi_lane_sums *sum) {
    const uint32_t bit = (uint32_t)1 << (tile - block->tile);
    const int limited = s->dissipation == TLSPH_LIMITED && (parts & TLSPHI_DAMPING), metal = limited && s->metal;
    const int known = limited && !metal && (block->fronts & bit), rest = known || metal ? parts & ~TLSPHI_DAMPING : parts;
    tlsph_real *const scalars[3] = {sum->heat, sum->source, sum->conduction};
    tlsphi_clear_lanes(3, sum->T);
    for (int i = 0; i < 3; i++) tlsphi_clear_lanes(1, scalars[i]);
    tlsphi_clear_damping(sum);
    if (rest) tlsphi_add_slots(s, block, tile, base, TLSPHI_PLAIN, rest, sum);
    if (metal) tlsphi_add_slots(s, block, tile, base, TLSPHI_METALS, TLSPHI_DAMPING, sum);
    const int jst = (parts & TLSPHI_DAMPING) && s->dissipation == TLSPH_JST;
    if (jst && s->dim == 3) tlsphi_add_jst(s, block, tile, base, 3, sum);
    else if (jst) tlsphi_add_jst(s, block, tile, base, 2, sum);
    const int split = (parts & TLSPHI_STRESSES) && s->bonds && s->force_form == TLSPH_ADJOINT;
    if (split && s->dim == 3) tlsphi_add_rests(s, block, tile, base, 3, sum->T);
    else if (split) tlsphi_add_rests(s, block, tile, base, 2, sum->T);
    if (known || (limited && !metal && tlsphi_any_front(sum))) {
        tlsphi_clear_damping(sum);
        tlsphi_add_slots(s, block, tile, base, TLSPHI_FRONTS, TLSPHI_DAMPING, sum);
        block->fronts = tlsphi_any_front(sum) ? block->fronts | bit : block->fronts & ~bit;
    }
    for (size_t i = 0; i < 3 * TLSPHI_LANES; i++) sum->T[i] += sum->damped[i];
}
/* Those of the lanes [first, last), one by one. */
static void tlsphi_part_lanes(const tlsphi_lane_sums *sum, int dim, size_t first, size_t last, tlsphi_gathered *out) {
    for (size_t l = first; l < last; l++, out++) {
        for (size_t i = 0; i < (size_t)dim; i++) out->T[i] = sum->T[i * TLSPHI_LANES + l];
        for (size_t i = 0; i < (size_t)dim; i++) out->damped[i] = sum->damped[i * TLSPHI_LANES + l];
        out->J = sum->J[l];
        out->production = sum->production[l];
        out->heat = sum->heat[l];
        out->source = sum->source[l];
        out->conduction = sum->conduction[l];
        out->least = TLSPHI_LARGEST;
    }
}

/* -- what becomes of the sums -- */

static void tlsphi_add_gathered(tlsphi_gathered *sum, const tlsphi_gathered *more) {
    for (int i = 0; i < 3; i++) sum->T[i] += more->T[i];
    for (int i = 0; i < 3; i++) sum->damped[i] += more->damped[i];
    sum->J += more->J;
    sum->heat += more->heat;
    sum->production += more->production;
}
static tlsph_real tlsphi_sigma(const tlsph_solver *s, size_t a) { return s->has_J ? *tlsphi_at(s, s->rows.S, a) : 0; }
/* Frozen dissipation (see [STEP]) is evaluated and kept in the first stage, and added in all. The leapfrog keeps it
   because it does not know the velocity of the whole step yet: T_D, and w.T_D as the power. */
TLSPHI_INLINE void tlsphi_keep_damping(const int dim, const tlsph_real *w, tlsph_real sigma, const tlsph_real *T,
                                       tlsph_real D_J, tlsph_real heat, tlsph_real *held) {
    tlsph_real power = 0;
    TLSPHI_UNROLL for (size_t i = 0; i < (size_t)dim; i++) {
        held[i * TLSPHI_LANES] = T[i];
        power += w[i] * T[i];
    }
    held[(size_t)dim * TLSPHI_LANES] = D_J;
    held[((size_t)dim + 1) * TLSPHI_LANES] = power + heat + sigma * D_J;
}
/* T += T_D, D_J; returns the production. */
TLSPHI_INLINE tlsph_real tlsphi_add_damping(const int dim, const tlsph_real *held, const tlsph_real *w,
                                            tlsph_real sigma, tlsph_real *T, tlsph_real *D_J) {
    tlsph_real power = 0;
    TLSPHI_UNROLL for (size_t i = 0; i < (size_t)dim; i++) {
        T[i] += held[i * TLSPHI_LANES];
        power += w[i] * held[i * TLSPHI_LANES];
    }
    *D_J = held[(size_t)dim * TLSPHI_LANES];
    return 2 * (held[((size_t)dim + 1) * TLSPHI_LANES] - power - sigma * *D_J);
}

/* Relaxation of J towards det F, -r c_p/tau phi, r = min(1, r0 (c_s/c_p)^2 (1 + (ln(J/d)/0.05)^2)): slower the closer nu
   is to 0.5, so that the pressure stays smooth, faster where the drift is large. Not entropy-stable pair by pair; for long
   static loads. */
static tlsph_real tlsphi_relaxation(const tlsph_solver *s, size_t a) {
    tlsphi_point pt;
    tlsphi_load_measures(s, &s->now, tlsphi_material_of(s, a), a, &pt);
    tlsph_real wave[2];
    tlsphi_row_get(s, s->rows.wave, 2, a, wave);
    const tlsph_real ratio = wave[1] / wave[0], strain = tlsphi_log(pt.J / pt.d) / TLSPHI_R(0.05);
    const tlsph_real r = tlsphi_min(1, s->drift_relaxation * ratio * ratio * (1 + strain * strain));
    return -r * wave[0] / s->tau[a] * (pt.J - pt.d);
}

/* Turns the gathered sums of one particle into rates per volume and block sums. */
static void tlsphi_flux_store(tlsph_solver *s, size_t a, const tlsphi_gathered *sum, double *block) {
    const size_t D = (size_t)s->dim;
    const tlsph_real inverse = 1 / s->V[a];
    tlsph_real relaxation = 0;
    for (size_t i = 0; i < D; i++) s->rate_p[D * a + i] = sum->T[i] * inverse;
    if (s->rate_J && s->drift_relaxation > 0) relaxation = tlsphi_relaxation(s, a);
    if (s->rate_J) s->rate_J[a] += sum->J * inverse + relaxation;
    block[TLSPHI_SUM_DISSIPATION] += (double)sum->production / 2;
    block[TLSPHI_SUM_LEAST] = tlsphi_dmin(block[TLSPHI_SUM_LEAST], sum->least);
    if (!s->rate_E) return;
    const tlsph_real theta = *tlsphi_at(s, s->rows.theta, a);
    tlsph_real rate = sum->heat * inverse;
    if (s->thermal == TLSPH_ENERGY) /* D_E - v_a . D_p */
        rate += (sum->production / 2 + tlsphi_sigma(s, a) * sum->J) * inverse;
    block[TLSPHI_SUM_DISSIPATION_ENTROPY] += (double)(sum->production / (2 * theta));
    block[TLSPHI_SUM_CONDUCTION_ENTROPY] += (double)sum->conduction;
    if (s->heat_moves) { /* -Q.grad theta/theta^2, the source of (57) */
        const tlsph_real source = sum->source / (2 * theta);
        block[TLSPHI_SUM_CONDUCTION_ENTROPY] += (double)source;
        if (s->thermal == TLSPH_ENTROPY) rate += source * inverse;
    }
    if (s->thermal == TLSPH_ENTROPY && s->dissipation_heats) rate += sum->production * inverse / (2 * theta);
    if (s->thermal == TLSPH_ENTROPY && s->drift_relaxation > 0 && s->rate_J) rate -= relaxation * tlsphi_sigma(s, a) / theta;
    s->rate_E[a] = s->thermal == TLSPH_ENERGY ? s->rate_E[a] + rate : rate;
}

/* -- the same for a whole tile: what the integrator keeps of the dissipation and adds again, sums, rates -- */
TLSPHI_INLINE void tlsphi_keep_lanes(const tlsph_solver *s, size_t base, const int dim,
                                     const tlsphi_lane_sums *damping) {
    const tlsph_real none[TLSPHI_LANES] = {0}, whole = s->leaps ? 0 : TLSPHI_R(1);
    const tlsph_real *w = tlsphi_at(s, s->rows.w, base), *S = s->has_J ? tlsphi_at(s, s->rows.S, base) : none;
    tlsph_real *held = tlsphi_held(s, base);
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsph_real w_a[3], T[3];
        tlsphi_take_apart(dim, w + l, TLSPHI_ROW, w_a);
        tlsphi_take_apart(dim, damping->damped + l, TLSPHI_LANES, T);
        tlsphi_keep_damping(dim, w_a, S[l], T, whole * damping->J[l], whole * (damping->production[l] / 2), held + l);
    }
}
TLSPHI_INLINE void tlsphi_add_kept_lanes(const tlsph_solver *s, size_t base, const int dim, tlsphi_lane_sums *sum) {
    const tlsph_real none[TLSPHI_LANES] = {0}, *held = tlsphi_held(s, base);
    const tlsph_real *w = tlsphi_at(s, s->rows.w, base), *S = s->has_J ? tlsphi_at(s, s->rows.S, base) : none;
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsph_real w_a[3], T[3], D_J;
        tlsphi_take_apart(dim, w + l, TLSPHI_ROW, w_a);
        tlsphi_take_apart(dim, sum->T + l, TLSPHI_LANES, T);
        sum->production[l] = tlsphi_add_damping(dim, held + l, w_a, S[l], T, &D_J);
        sum->J[l] = D_J;
        TLSPHI_UNROLL for (size_t i = 0; i < (size_t)dim; i++) sum->T[i * TLSPHI_LANES + l] = T[i];
    }
}
static void tlsphi_add_sums(const tlsphi_lane_sums *damping, tlsphi_lane_sums *sum) {
    for (size_t i = 0; i < 3 * TLSPHI_LANES; i++) {
        sum->T[i] += damping->T[i];
        sum->damped[i] += damping->damped[i];
    }
    for (size_t l = 0; l < TLSPHI_LANES; l++) {
        sum->J[l] += damping->J[l];
        sum->production[l] += damping->production[l];
    }
}
/* Sums of a tile as the stage wants them: stresses and dissipation at once, or apart where the second is kept or has pairs
   of its own. */
TLSPHI_INLINE void tlsphi_flux_whole(const tlsph_solver *s, tlsphi_block *block, size_t tile, size_t base,
                                     const int dim, tlsphi_lane_sums *sum) {
    tlsphi_lane_sums damping;
    const int apart = s->parted && (!s->frozen || s->damps);
    tlsphi_flux_tile(s, block, tile, base, s->parted ? TLSPHI_STRESSES : TLSPHI_BOTH, sum);
    if (apart) tlsphi_flux_tile(s, block, tile, base, TLSPHI_DAMPING, &damping);
    if (apart && s->frozen) tlsphi_keep_lanes(s, base, dim, &damping);
    else if (apart) tlsphi_add_sums(&damping, sum);
    if (s->frozen) tlsphi_add_kept_lanes(s, base, dim, sum);
    if (s->leaps) tlsphi_keep_lanes(s, base, dim, sum);
}
TLSPHI_INLINE void tlsphi_store_momentum(const tlsph_solver *s, size_t base, const tlsphi_lane_sums *sum,
                                         const tlsph_real *inverse, const size_t D) {
    tlsph_real *rate = s->rate_p + D * base;
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
        TLSPHI_UNROLL for (size_t i = 0; i < D; i++) rate[D * l + i] = sum->T[i * TLSPHI_LANES + l] * inverse[l];
}
static void tlsphi_store_energy(const tlsph_solver *s, size_t base, const tlsphi_lane_sums *sum,
                                const tlsph_real *inverse, double *block) {
    const tlsph_real *theta = tlsphi_theta(s, base), *S = s->has_J ? tlsphi_at(s, s->rows.S, base) : NULL;
    tlsph_real *rate = s->rate_E + base, entropy[TLSPHI_LANES], source[TLSPHI_LANES];
    for (size_t l = 0; l < TLSPHI_LANES; l++) {
        entropy[l] = sum->production[l] / (2 * theta[l]);
        source[l] = s->heat_moves ? sum->source[l] / (2 * theta[l]) : 0;
    }
    if (s->thermal == TLSPH_ENERGY) {
        for (size_t l = 0; l < TLSPHI_LANES; l++)
            rate[l] += sum->heat[l] * inverse[l] + (sum->production[l] / 2 + (S ? S[l] * sum->J[l] : 0)) * inverse[l];
    } else {
        const tlsph_real heats = s->dissipation_heats ? TLSPHI_R(1) : 0;
        for (size_t l = 0; l < TLSPHI_LANES; l++)
            rate[l] = (sum->heat[l] + source[l] + heats * entropy[l]) * inverse[l];
    }
    for (size_t l = 0; l < TLSPHI_LANES; l++) {
        block[TLSPHI_SUM_DISSIPATION_ENTROPY] += (double)entropy[l];
        block[TLSPHI_SUM_CONDUCTION_ENTROPY] += (double)sum->conduction[l];
        block[TLSPHI_SUM_CONDUCTION_ENTROPY] += (double)source[l];
    }
}
static void tlsphi_store_tile(const tlsph_solver *s, size_t base, const tlsphi_lane_sums *sum, double *block) {
    tlsph_real inverse[TLSPHI_LANES];
    for (size_t l = 0; l < TLSPHI_LANES; l++) inverse[l] = 1 / s->V[base + l];
    if (s->dim == 3) tlsphi_store_momentum(s, base, sum, inverse, 3);
    else tlsphi_store_momentum(s, base, sum, inverse, 2);
    for (size_t l = 0; s->rate_J && l < TLSPHI_LANES; l++) s->rate_J[base + l] += sum->J[l] * inverse[l];
    for (size_t l = 0; l < TLSPHI_LANES; l++) block[TLSPHI_SUM_DISSIPATION] += (double)sum->production[l] / 2;
    if (s->rate_E) tlsphi_store_energy(s, base, sum, inverse, block);
}
/* The particles [begin, end) of a tile, one by one. */
static void tlsphi_flux_particles(tlsph_solver *s, tlsphi_block *block, size_t tile, size_t begin, size_t end) {
    const int first = s->parted ? TLSPHI_STRESSES : TLSPHI_BOTH, passes = s->parted && (!s->frozen || s->damps) ? 2 : 1;
    const size_t base = begin / TLSPHI_LANES * TLSPHI_LANES;
    tlsphi_gathered part[2][TLSPHI_LANES]; /* all, or stresses and damping apart */
    tlsphi_lane_sums lanes;
    for (int k = 0; k < passes; k++) {
        const int parts = k ? TLSPHI_DAMPING : first;
        if (!s->lanes) tlsphi_flux_one_by_one(s, begin, end, parts, part[k]);
        if (!s->lanes) continue;
        tlsphi_flux_tile(s, block, tile, base, parts, &lanes);
        tlsphi_part_lanes(&lanes, s->dim, begin - base, end - base, part[k]);
    }
    for (size_t a = begin; a < end; a++) {
        tlsphi_gathered *sum = &part[0][a - begin], *damping = &part[1][a - begin];
        tlsph_real *held = s->held ? tlsphi_held(s, a) : NULL, w[3] = {0, 0, 0}, D_J = 0;
        const tlsph_real sigma = tlsphi_sigma(s, a);
        tlsphi_row_get(s, s->rows.w, s->dim, a, w);
        if (passes == 2 && s->frozen)
            tlsphi_keep_damping(s->dim, w, sigma, damping->T, damping->J, damping->heat + damping->production / 2, held);
        if (passes == 2 && !s->frozen) tlsphi_add_gathered(sum, damping);
        if (passes == 2) sum->least = tlsphi_dmin(sum->least, damping->least);
        if (s->frozen) sum->production += tlsphi_add_damping(s->dim, held, w, sigma, sum->T, &D_J);
        if (s->leaps) tlsphi_keep_damping(s->dim, w, 0, sum->damped, 0, 0, held);
        sum->J += D_J;
        tlsphi_flux_store(s, a, sum, block->sums);
    }
}
static void tlsphi_warm_fluxes(const tlsph_solver *s, const tlsphi_block *block) {
    const tlsphi_rows *r = &s->rows;
    const size_t ahead = tlsphi_reach_ahead(s, block);
    if (s->heat_moves) tlsphi_warm_rows(s, ahead, r->w, r->count);
    else if (s->damps && s->dissipation != TLSPH_NO_DISSIPATION) tlsphi_warm_rows(s, ahead, r->w, r->theta);
    else tlsphi_warm_rows(s, ahead, r->P, r->A);
}
static void tlsphi_flux_block(tlsph_solver *s, tlsphi_block *block) {
    const int plain = s->lanes && !(s->drift_relaxation > 0);
    tlsphi_lane_sums lanes;
    if (tlsphi_outgrows_cache(s)) tlsphi_warm_fluxes(s, block);
    for (int i = 0; i < TLSPHI_SUMS; i++) block->sums[i] = i == TLSPHI_SUM_LEAST ? TLSPHI_LARGEST : 0;
    for (size_t begin = block->begin, tile = block->tile, end; begin < block->end; begin = end, tile++) {
        end = tlsphi_tile_end(block, begin);
        if (!plain || end - begin < TLSPHI_LANES) {
            tlsphi_flux_particles(s, block, tile, begin, end);
            continue;
        }
        if (s->dim == 3) tlsphi_flux_whole(s, block, tile, begin, 3, &lanes);
        else tlsphi_flux_whole(s, block, tile, begin, 2, &lanes);
        tlsphi_store_tile(s, begin, &lanes, block->sums);
    }
}

/* ==== [CONDITIONS] =================================================================================================
   Loads are forces and heat added to the rates. Constraints act on the momentum after each stage: first driven
   velocities, then fixed directions, then walls, then prescribed temperatures. Fixed directions of a particle are
   orthonormal, so that applying them one after the other satisfies all of them, whatever the angles of the planes.

   Energy of driven particles. E holds the kinetic energy, and the drive replaces the momentum that the fluxes would have
   given. So the power of all forces on the driven component leaves the rate of E, and after the stage the true change of
   its kinetic energy is added; what E gains is the work of the drive. */

static int tlsphi_condition_components(tlsph_condition_kind kind) {
    switch (kind) {
    case TLSPH_VELOCITY:
    case TLSPH_FORCE:
    case TLSPH_TRACTION:
    case TLSPH_BODY_FORCE:
    case TLSPH_ACCELERATION: return 3;
    case TLSPH_PRESSURE:
    case TLSPH_TEMPERATURE:
    case TLSPH_HEAT_FLUX:
    case TLSPH_HEAT_SOURCE: return 1;
    default: return 0;
    }
}
static int tlsphi_is_thermal(tlsph_condition_kind kind) {
    return kind == TLSPH_TEMPERATURE || kind == TLSPH_HEAT_FLUX || kind == TLSPH_HEAT_SOURCE;
}

/* One stage of a Runge-Kutta scheme: u = a u_old + b u + c dt L(u), with loads at time `start`, constraints at `end`; its
   rates and its corrections after the stage enter the result of the step with these weights. Angular momentum changes by
   dt sum over stages of z x force, z = z_old x_old + z_next x_next + dt (z_was v_old + z_is v), see [PROJECTION].
   ahead: the projection takes torques about x_next, which the last stage knows beforehand. */
typedef struct tlsphi_stage {
    double a, b, c, start, end, rate_weight, after_weight;
    double z_old, z_next, z_was, z_is;
    int ahead;
} tlsphi_stage;

/* Values of a load for this time: constant, or from the host's callback. */
static void tlsphi_load_values(tlsph_solver *s, tlsphi_load *load, double time) {
    const size_t count = load->given.count, D = (size_t)s->dim;
    const size_t components = (size_t)tlsphi_condition_components(load->given.kind);
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < components; k++) load->values[components * i + k] = load->given.value[k];
    if (!load->given.values) return;
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < 3; k++) {
            const size_t at = D * load->inner[i] + k;
            load->X[3 * i + k] = k < D ? tlsphi_X(s, load->inner[i], k) : 0;
            load->x[3 * i + k] = k < D ? s->now.x[at] : 0;
            if (!load->part || k >= D) continue;
            tlsph_real F[9];
            tlsphi_tensor_get(s->now.F, s->dim * s->dim, load->inner[i], F);
            load->X[3 * i + k] += load->part[i].o[k];
            load->x[3 * i + k] += tlsphi_any_dot(s->dim, F + D * k, load->part[i].o);
        }
    load->given.values(load->given.values_user, (tlsph_real)time, count, load->host, load->X, load->x, load->values);
}

/* Where the projection of this stage, which begins at x, sees a particle, and (next) where it takes it. Linear elasticity
   takes moments about the reference positions: there P is symmetric, not P F^T, and X x p is what is conserved. */
TLSPHI_INLINE double tlsphi_next_position(const tlsph_solver *s, const tlsph_real *x, const tlsphi_stage *stage,
                                          double dt, size_t a, size_t i) {
    const size_t at = (size_t)s->dim * a + i;
    const double was = (double)s->old.x[at];
    return was + stage->b * ((double)x[at] - was) + stage->c * dt * (double)tlsphi_v(s, a, i);
}
TLSPHI_INLINE void tlsphi_stage_position(const tlsph_solver *s, const tlsph_real *x, const tlsphi_stage *stage,
                                         double dt, size_t a, double X[3]) {
    const size_t D = (size_t)s->dim;
    X[2] = 0;
    for (size_t i = 0; i < D; i++)
        X[i] = s->linear      ? (double)tlsphi_X(s, a, i)
               : stage->ahead ? tlsphi_next_position(s, x, stage, dt, a, i)
                              : (double)x[D * a + i];
}
/* The arm z with which a force of this stage changes the angular momentum of the step. */
static void tlsphi_stage_arm(const tlsph_solver *s, const tlsphi_stage *stage, double dt, size_t a, double z[3]) {
    const size_t D = (size_t)s->dim;
    const double rho = (double)tlsphi_material_of(s, a)->rho;
    z[2] = 0;
    for (size_t i = 0, at = D * a; i < D; i++, at++) {
        const double v = (double)tlsphi_v(s, a, i);
        z[i] = s->linear ? stage->rate_weight * (double)tlsphi_X(s, a, i)
                         : stage->z_old * (double)s->old.x[at] +
                               stage->z_next * tlsphi_next_position(s, s->now.x, stage, dt, a, i) +
                               dt * (stage->z_was * (double)s->old.p[at] / rho + stage->z_is * v);
    }
}

/* Surface velocities of held parts at a time. */
static void tlsphi_surface_velocities(tlsph_solver *s, double time) {
    for (size_t i = 0; s->held_parts && i < s->loads; i++)
        if (s->load[i].given.kind == TLSPH_VELOCITY) tlsphi_load_values(s, s->load + i, time);
    for (tlsphi_held_part *h = s->held_part, *end = h + s->held_parts; h != end; h++)
        if (h->load != TLSPHI_NONE) memcpy(h->wanted, s->load[h->load].values + 3 * (size_t)h->item, sizeof h->wanted);
}
/* Is the i-th particle of a drive held at its surface, not itself? */
static int tlsphi_driven_behind(const tlsphi_load *load, size_t i) {
    return load->part && tlsphi_dot(3, load->part[i].B, load->part[i].B) > 0;
}

/* The force of a load on its i-th particle, N; behind the surface also its first moment Z. */
static void tlsphi_load_force(const tlsph_solver *s, const tlsphi_load *load, size_t i, tlsph_real force[3],
                              tlsph_real Z[9]) {
    const size_t a = load->inner[i], D = (size_t)s->dim;
    const tlsph_real *value = load->values + 3 * i;
    tlsph_real factor = 1;
    if (load->given.kind == TLSPH_PRESSURE) { /* -p H A: A is carried to the deformed normal (Nanson) */
        tlsphi_point pt;
        tlsph_real H[9];
        tlsphi_load_measures(s, &s->now, tlsphi_material_of(s, a), a, &pt);
        tlsphi_shrink(s->dim, pt.H, H);
        tlsphi_any_multiply(s->dim, H, load->area + D * i, force);
        for (size_t k = 0; k < D; k++) force[k] *= -load->values[i];
        if (load->part) tlsphi_any_product(s->dim, H, load->part[i].T, Z);
        for (size_t k = 0; load->part && k < D * D; k++) Z[k] *= -load->values[i];
        return;
    }
    if (load->given.kind == TLSPH_TRACTION) factor = load->area[i];
    if (load->given.kind == TLSPH_BODY_FORCE) factor = s->V[a];
    if (load->given.kind == TLSPH_ACCELERATION) factor = s->V[a] * tlsphi_material_of(s, a)->rho;
    for (size_t k = 0; k < D; k++) force[k] = factor * value[k];
    for (size_t k = 0; load->part && k < D * D; k++) Z[k] = force[k / D] * load->part[i].o[k % D];
}

/* A force on particle a, N. */
static void tlsphi_push_particle(tlsph_solver *s, size_t a, const tlsph_real force[3], const tlsphi_stage *stage,
                                 double dt) {
    const size_t D = (size_t)s->dim;
    const double share = stage->rate_weight * dt;
    tlsphi_account *account = &s->account;
    double z[3];
    tlsph_real v[3] = {0, 0, 0};
    tlsphi_stage_arm(s, stage, dt, a, z);
    tlsphi_velocity(s, a, v);
    const tlsph_real power = tlsphi_any_dot(s->dim, force, v);
    for (size_t k = 0; k < D; k++) s->rate_p[D * a + k] += force[k] / s->V[a];
    account->external_work += share * (double)power;
    for (int k = 0; k < 3; k++) {
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        account->impulse[k] += share * (double)force[k];
        account->angular_impulse[k] += dt * (z[l] * (double)force[m] - z[m] * (double)force[l]);
    }
}
static void tlsphi_apply_force(tlsph_solver *s, const tlsphi_load *load, const tlsphi_stage *stage, double dt) {
    for (size_t i = 0; i < load->given.count; i++) {
        const size_t a = load->inner[i];
        tlsph_real force[3] = {0, 0, 0}, Z[9], y[3] = {0, 0, 0};
        tlsphi_load_force(s, load, i, force, Z);
        for (size_t k = load->part ? s->first[a] : 0; load->part && k < s->first[a + 1]; k++) {
            tlsphi_lever(s, a, k, Z, y);
            tlsphi_push_particle(s, s->neighbour[k], y, stage, dt);
            for (int j = 0; j < s->dim; j++) force[j] -= y[j];
        }
        tlsphi_push_particle(s, a, force, stage, dt);
    }
}

/* Heat of a load into its i-th particle, W. */
static tlsph_real tlsphi_heat_power(const tlsph_solver *s, const tlsphi_load *load, size_t i) {
    return load->given.kind == TLSPH_HEAT_FLUX ? -load->values[i] * load->area[i]
                                               : load->values[i] * s->V[load->inner[i]];
}
static void tlsphi_heat(tlsph_solver *s, size_t a, tlsph_real power, double weight) {
    const tlsph_real theta = *tlsphi_theta(s, a);
    s->rate_E[a] += power / s->V[a] / (s->thermal == TLSPH_ENTROPY ? theta : 1);
    s->account.external_heat += weight * (double)power;
    s->account.external_entropy += weight * (double)(power / theta);
}
/* Behind a surface of prescribed temperature its heat -Q.B has the moment -Q T; the particle itself is held. */
static void tlsphi_held_heat(const tlsph_solver *s, const tlsphi_load *load, size_t i, tlsph_real *arm) {
    tlsph_real heat[3], Q[3];
    tlsphi_row_get(s, s->rows.heat, s->dim, load->inner[i], heat);
    tlsphi_any_multiply_transposed(s->dim, load->part[i].W, heat, Q);
    tlsphi_any_multiply_transposed(s->dim, load->part[i].T, Q, arm);
    for (int k = 0; k < s->dim; k++) arm[k] *= -*tlsphi_theta(s, load->inner[i]);
}
static void tlsphi_apply_heat(tlsph_solver *s, const tlsphi_load *load, const tlsphi_stage *stage, double dt) {
    const int held = load->given.kind == TLSPH_TEMPERATURE;
    for (size_t i = 0; i < load->given.count; i++) {
        const size_t a = load->inner[i];
        tlsph_real power = held ? 0 : tlsphi_heat_power(s, load, i), arm[3] = {0, 0, 0};
        for (int k = 0; load->part && k < s->dim; k++) arm[k] = power * load->part[i].o[k];
        if (held) tlsphi_held_heat(s, load, i, arm);
        for (size_t k = load->part ? s->first[a] : 0; load->part && k < s->first[a + 1]; k++) {
            const tlsph_real y = tlsphi_share_behind(s, a, k, arm);
            tlsphi_heat(s, s->neighbour[k], y, stage->rate_weight * dt);
            power -= y;
        }
        tlsphi_heat(s, a, power, stage->rate_weight * dt);
    }
}

/* Component of a vector that a drive prescribes: all of it, or that along the normal. */
static void tlsphi_driven_part(int dim, const tlsph_condition *c, const tlsph_real *v, tlsph_real *part) {
    const tlsph_real nn = tlsphi_any_dot(dim, c->normal, c->normal);
    const tlsph_real along = nn > 0 ? tlsphi_any_dot(dim, v, c->normal) / nn : 0;
    for (int i = 0; i < dim; i++) part[i] = nn > 0 ? along * c->normal[i] : v[i];
}
static void tlsphi_release_driven_power(tlsph_solver *s, tlsphi_load *load, const tlsphi_stage *stage, double dt) {
    const size_t D = (size_t)s->dim;
    for (size_t i = 0; i < load->given.count; i++) {
        const size_t a = load->inner[i];
        tlsph_real v[3] = {0, 0, 0}, part[3];
        if (tlsphi_driven_behind(load, i)) continue;
        tlsphi_velocity(s, a, v);
        tlsphi_driven_part(s->dim, &load->given, v, part);
        const tlsph_real power = tlsphi_any_dot(s->dim, part, s->rate_p + D * a);
        load->before[i] = tlsphi_any_dot(s->dim, part, part) * tlsphi_material_of(s, a)->rho / 2;
        if (s->thermal == TLSPH_ENERGY && !s->leaps) s->rate_E[a] -= power;
        s->account.external_work -= stage->rate_weight * dt * (double)(power * s->V[a]);
    }
}

static void tlsphi_apply_loads(tlsph_solver *s, const tlsphi_stage *stage, double dt) {
    for (size_t i = 0; i < s->loads; i++) {
        tlsphi_load *load = s->load + i;
        const tlsph_condition_kind kind = load->given.kind;
        if (kind == TLSPH_TEMPERATURE && load->part && s->heat_moves) tlsphi_apply_heat(s, load, stage, dt);
        if (kind == TLSPH_VELOCITY || kind == TLSPH_TEMPERATURE || kind == TLSPH_WALL) continue;
        if (tlsphi_is_thermal(kind) && s->heat_moves < s->conducts) continue; /* heats in the conduction's own stages */
        tlsphi_load_values(s, load, s->time + stage->start * dt);
        if (tlsphi_is_thermal(kind)) tlsphi_apply_heat(s, load, stage, dt);
        else tlsphi_apply_force(s, load, stage, dt);
    }
    for (size_t i = 0; i < s->loads; i++)
        if (s->load[i].given.kind == TLSPH_VELOCITY) tlsphi_release_driven_power(s, s->load + i, stage, dt);
}

/* Sets driven momenta at the end of a stage and gives E the change of their kinetic energy. */
static void tlsphi_drive(tlsph_solver *s, tlsphi_load *load, const tlsphi_stage *stage, double time) {
    const size_t D = (size_t)s->dim;
    tlsphi_load_values(s, load, time);
    for (size_t i = 0; i < load->given.count; i++) {
        const size_t a = load->inner[i];
        const tlsph_real rho = tlsphi_material_of(s, a)->rho;
        tlsph_real is[3], was[3], wanted[3], *p = s->now.p + D * a;
        if (tlsphi_driven_behind(load, i)) continue;
        tlsphi_driven_part(s->dim, &load->given, p, is);
        tlsphi_driven_part(s->dim, &load->given, s->old.p + D * a, was);
        tlsphi_driven_part(s->dim, &load->given, load->values + 3 * i, wanted);
        for (size_t k = 0; k < D; k++) p[k] += rho * wanted[k] - is[k];
        const double gain = (double)(rho * tlsphi_any_dot(s->dim, wanted, wanted) / 2) -
                            stage->a * (double)(tlsphi_any_dot(s->dim, was, was) / (2 * rho)) -
                            stage->b * (double)load->before[i];
        if (s->thermal == TLSPH_ENERGY && !s->leaps) s->now.E[a] += (tlsph_real)gain;
        s->account.external_work += stage->after_weight * gain * (double)s->V[a];
    }
}

/* Takes the fixed directions out of momenta, or of their rates, of the particles [begin, end). */
static void tlsphi_apply_fixes(const tlsph_solver *s, tlsph_real *momenta, size_t begin, size_t end) {
    size_t i = tlsphi_find_particle(s->fix, s->fixes, sizeof *s->fix, begin);
    for (; i < s->fixes && s->fix[i].particle < end; i++) {
        tlsph_real *p = momenta + (size_t)s->dim * s->fix[i].particle;
        const tlsph_real along = tlsphi_any_dot(s->dim, p, s->fix[i].e);
        for (int k = 0; k < s->dim; k++) p[k] -= along * s->fix[i].e[k];
    }
}

/* A particle at or behind the wall may not move further into it. What it loses is the kinetic energy that the stage
   holds for its approach, a KE_old + b KE + c dt v.dp/dt, not that of the momentum which was just taken away: while it
   rests at the wall, the reaction does no work. In thermal scenes the loss stays in E as heat. */
static void tlsphi_apply_wall(tlsph_solver *s, const tlsphi_load *load, const tlsphi_stage *stage, double dt) {
    const size_t D = (size_t)s->dim;
    const tlsph_real *N = load->given.normal;
    for (size_t i = 0; i < load->given.count; i++) {
        const size_t a = load->inner[i];
        const double rho = (double)tlsphi_material_of(s, a)->rho;
        tlsph_real v[3] = {0, 0, 0}, gap[3] = {0, 0, 0}, *p = s->now.p + D * a;
        for (size_t k = 0; k < D; k++) gap[k] = s->now.x[D * a + k] - load->given.point[k];
        const tlsph_real along = tlsphi_any_dot(s->dim, p, N);
        if (tlsphi_any_dot(s->dim, gap, N) > 0 || along >= 0) continue;
        for (size_t k = 0; k < D; k++) p[k] -= along * N[k];
        tlsphi_velocity(s, a, v);
        const double was = (double)tlsphi_any_dot(s->dim, s->old.p + D * a, N) / rho,
                     is = (double)tlsphi_any_dot(s->dim, v, N);
        const double rate = (double)tlsphi_any_dot(s->dim, s->rate_p + D * a, N);
        const double held = rho / 2 * (stage->a * was * was + stage->b * is * is) +
                            stage->c * dt * is * rate * (s->leaps ? 0.5 : 1); /* leaps: the mean of v and 0 */
        if (s->leaps && s->thermal == TLSPH_ENERGY) s->now.E[a] += (tlsph_real)held;
        s->account.contact_loss += stage->after_weight * held * (double)s->V[a];
    }
}

/* E or eta of particle a at temperature theta; everything else as it is. Returns 0 where the particle is not valid. */
static int tlsphi_set_temperature(tlsph_solver *s, size_t a, tlsph_real theta) {
    const tlsphi_material *m = tlsphi_material_of(s, a);
    tlsphi_point pt;
    if (tlsphi_respond_at(s, &s->now, a, NULL, &pt)) return 0;
    if (s->thermal == TLSPH_ENERGY) s->now.E[a] = pt.kinetic + pt.r.energy + m->c_v * (theta - m->theta_R);
    else s->now.E[a] = pt.r.entropy + m->c_v * tlsphi_log(theta / m->theta_R) - pt.plastic.entropy;
    return 1;
}
/* The temperature of the i-th particle with which that of its surface is the given one, half of that at least: the neighbours
   are those before the stage. */
static tlsph_real tlsphi_temperature_behind(const tlsph_solver *s, const tlsphi_load *load, size_t i) {
    const size_t a = load->inner[i];
    tlsph_real value = load->values[i], own = 1;
    for (size_t k = load->part ? s->first[a] : 0; load->part && k < s->first[a + 1]; k++) {
        const tlsph_real y = tlsphi_share_behind(s, a, k, load->part[i].o);
        value -= y * *tlsphi_theta(s, s->neighbour[k]);
        own -= y;
    }
    return tlsphi_max(value / own, load->values[i] / 2);
}
static void tlsphi_hold_temperature(tlsph_solver *s, tlsphi_load *load, double weight, double time) {
    tlsphi_load_values(s, load, time);
    for (size_t i = 0; i < load->given.count; i++) {
        const size_t a = load->inner[i];
        const tlsph_real theta = load->part ? tlsphi_temperature_behind(s, load, i) : load->values[i];
        const tlsph_real before = s->now.E[a];
        if (!tlsphi_set_temperature(s, a, theta)) continue; /* the evaluation that follows reports it */
        const double gain = weight * (double)((s->now.E[a] - before) * s->V[a]);
        s->account.external_heat += s->thermal == TLSPH_ENTROPY ? gain * (double)theta : gain;
        s->account.external_entropy += s->thermal == TLSPH_ENTROPY ? gain : gain / (double)theta;
    }
}

/* Algorithm 1 line (7): momenta, then temperatures. */
static void tlsphi_constrain(tlsph_solver *s, const tlsphi_stage *stage, double dt) {
    const double time = s->time + stage->end * dt;
    for (size_t i = 0; i < s->loads; i++)
        if (s->load[i].given.kind == TLSPH_VELOCITY) tlsphi_drive(s, s->load + i, stage, time);
    tlsphi_apply_fixes(s, s->now.p, 0, s->n);
    for (size_t i = 0; i < s->loads; i++)
        if (s->load[i].given.kind == TLSPH_WALL) tlsphi_apply_wall(s, s->load + i, stage, dt);
}
static void tlsphi_hold_temperatures(tlsph_solver *s, const tlsphi_stage *stage, double dt) {
    for (size_t i = 0; i < s->loads; i++)
        if (s->load[i].given.kind == TLSPH_TEMPERATURE)
            tlsphi_hold_temperature(s, s->load + i, stage->after_weight, s->time + stage->end * dt);
}
static void tlsphi_impose(tlsph_solver *s, const tlsphi_stage *stage, double dt) {
    tlsphi_constrain(s, stage, dt);
    tlsphi_hold_temperatures(s, stage, dt);
}

/* ==== [PROJECTION] =================================================================================================
   Internal forces of a body must have no resultant and no torque about the stage's positions (000-79): x^n in the first
   stage, x^{n+1} in the last. With these the angular momentum of the two-stage scheme is exact. The smallest change is
     T^ = T + V (lambda x X' + mu),  X' = X - centre,  I lambda = -sum X' x T,  mu = -sum T / sum V          (000-81, 82)
   The stresses need none of it as long as F is the gradient of x and H = cof F; the torque comes from the dissipation.

   Energy. Split v = rigid + w, where the rigid motion is the nearest one to v at the same positions. T^ does no work on
   the rigid part by construction, and T^ - T, being rigid, does none on w. So the power of the dissipative forces is
   sum w.D_p = -sum over pairs Dw.D_p, exactly what the dissipation, evaluated with w, gives to the particles as heat:
   the energy is conserved and no entropy is destroyed. For the same reason the stresses heat by P : grad w; it differs
   from P : dF/dt only because the last stage takes torques about x^{n+1}, by O(dt^2). Works with constraints, which take
   their part of T^ as reaction, and body by body.

   Other schemes. Let stage k move x by v_k and p by f_k. Inserting one into the other, the angular momentum of a step
   changes by dt sum_k z_k x f_k exactly, where the arms z_k hold only what stage k knows: for (002-30) (x_0 - dt v_0)/6,
   (x_0 + dt (v_1 - v_0)/6)/6 and 2/3 x_next; for frozen schemes -dt v_0/2 in the last stage but one and x_next in the last.
   To take torques about these would spoil a stage, whose own place is x_k. So each stage is projected about x_k, its
   z_k x T is booked as a debt, and the last stage settles all of it by a turn about x_next, O(dt^3), whose work v.T stays
   out of E (tlsphi_settle). In the two-stage scheme z_0 = x_0/2 and z_1 = x_next/2: no debts.

   Mirror planes. The rules of the mirror (see [GRADIENTS]) hold for w only if they hold for the rigid motion. So spin and
   lambda are restricted to what the planes of a body allow: a roller plane turns about its normal, planes of two
   directions or a tangentially fixed one do not turn at all. Nothing is lost: about the other axes the planes exert
   torques of their own.

   Clamped bodies that wind up fast. Where a part rests while the body as a whole turns with W, damping of w pushes what is
   out of line by z along W x z, as damping in the rotor makes a fast shaft whirl: layers come to alternate, which F hardly
   sees. `projection` 0 ends that, for more dissipation (examples/twisting_limits.c). */

typedef struct tlsphi_projection {
    tlsph_solver *s;
    tlsphi_stage stage;
    double dt;
    const tlsph_real *x; /* positions before the stage */
    int leaves; /* the correction of the rates to those who use them next, block by block: nothing else reads them before */
} tlsphi_projection;

/* Positions of this stage are seen from the first particle of the body, for the sake of round-off. */
static void tlsphi_projection_origin(const tlsphi_projection *p, const tlsphi_block *block, double origin[3]) {
    tlsphi_stage_position(p->s, p->x, &p->stage, p->dt, p->s->body[block->body].first, origin);
}
TLSPHI_INLINE void tlsphi_projection_arm(const tlsphi_projection *p, const double origin[3], size_t a, double X[3]) {
    tlsphi_stage_position(p->s, p->x, &p->stage, p->dt, a, X);
    for (int i = 0; i < 3; i++) X[i] -= origin[i];
}
/* The same, seen from the centre of the body. */
static void tlsphi_projection_centre(const tlsphi_projection *p, const tlsphi_block *block, double centre[3]) {
    tlsphi_projection_origin(p, block, centre);
    for (int i = 0; i < 3; i++) centre[i] += p->s->body[block->body].centre[i];
}
TLSPHI_INLINE void tlsphi_vector3(const tlsph_real *v, int dim, double out[3]) {
    out[2] = 0;
    for (int i = 0; i < dim; i++) out[i] = (double)v[i];
}

/* Arms X of the particles [begin, end) of a tile, and their volumes, as lanes; 0 where the tile has no particle. */
typedef struct TLSPHI_ALIGNED tlsphi_arms {
    double X[3][TLSPHI_LANES], V[TLSPHI_LANES], f[3][TLSPHI_LANES];
} tlsphi_arms;

/* A vector field of the same particles, and their v. */
TLSPHI_INLINE void tlsphi_take_vectors(const tlsph_real *f, const size_t D, size_t begin, size_t end,
                                       double (*out)[TLSPHI_LANES]) {
    const size_t base = begin / TLSPHI_LANES * TLSPHI_LANES;
    if (end - begin == TLSPHI_LANES) {
        TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++)
            TLSPHI_UNROLL for (size_t i = 0; i < D; i++) out[i][l] = (double)f[D * (base + l) + i];
        return;
    }
    for (size_t a = begin; a < end; a++)
        for (size_t i = 0; i < D; i++) out[i][a - base] = (double)f[D * a + i];
}
TLSPHI_INLINE void tlsphi_take_velocities(const tlsph_solver *s, const size_t D, size_t begin, size_t end,
                                          double (*out)[TLSPHI_LANES]) {
    const size_t first = begin % TLSPHI_LANES;
    const tlsph_real *v = tlsphi_at(s, s->rows.v, begin - first);
    for (size_t i = 0; i < D; i++, v += TLSPHI_ROW) {
        if (end - begin == TLSPHI_LANES) for (size_t l = 0; l < TLSPHI_LANES; l++) out[i][l] = (double)v[l];
        else for (size_t l = first; l < first + end - begin; l++) out[i][l] = (double)v[l];
    }
}
/* The arms of a whole tile, as tlsphi_projection_arm. dim and ahead are constants. */
TLSPHI_INLINE void tlsphi_tile_arms(const tlsphi_projection *p, const double origin[3], const int dim, const int ahead,
                                    size_t base, tlsphi_arms *out) {
    const tlsph_solver *s = p->s;
    const size_t D = (size_t)dim;
    const tlsph_real *x = p->x + D * base, *old = s->old.x + D * base;
    const tlsph_real *v = tlsphi_at(s, s->rows.v, base), *X = tlsphi_at(s, s->rows.X, base);
    const double B = p->stage.b, C = p->stage.c * p->dt, from[3] = {origin[0], origin[1], dim == 3 ? origin[2] : 0};
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        out->V[l] = (double)s->V[base + l];
        TLSPHI_UNROLL for (size_t i = 0; i < D; i++) {
            const double is = (double)x[D * l + i], was = (double)old[D * l + i];
            out->X[i][l] = (ahead ? was + B * (is - was) + C * (double)v[i * TLSPHI_ROW + l] : is) - from[i];
        }
    }
    for (size_t i = 0; i < 3; i++)
        for (size_t l = 0; (s->linear || i == D) && l < TLSPHI_LANES; l++)
            out->X[i][l] = i < D ? (double)X[i * TLSPHI_ROW + l] - from[i] : 0;
}
static void tlsphi_take_arms(const tlsphi_projection *p, const double origin[3], size_t begin, size_t end,
                             tlsphi_arms *out) {
    const size_t base = begin / TLSPHI_LANES * TLSPHI_LANES;
    const int ahead = p->stage.ahead && !p->s->linear;
    double X[3];
    if (p->s->dim == 2) memset(out->f, 0, sizeof out->f);
    if (end - begin == TLSPHI_LANES) {
        if (p->s->dim == 3 && ahead) tlsphi_tile_arms(p, origin, 3, 1, base, out);
        else if (p->s->dim == 3) tlsphi_tile_arms(p, origin, 3, 0, base, out);
        else if (ahead) tlsphi_tile_arms(p, origin, 2, 1, base, out);
        else tlsphi_tile_arms(p, origin, 2, 0, base, out);
        return;
    }
    memset(out, 0, sizeof *out);
    for (size_t a = begin; a < end; a++) {
        tlsphi_projection_arm(p, origin, a, X);
        out->V[a - base] = (double)p->s->V[a];
        for (int i = 0; i < 3; i++) out->X[i][a - base] = X[i];
    }
}
/* Sums of V f, V X x f and, if asked for, V, V X, V X X (6), lane by lane. */
TLSPHI_INLINE void tlsphi_add_arms(const tlsphi_arms *u, const int with_inertia, double (*m)[TLSPHI_LANES]) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        const double V = u->V[l], X[3] = {u->X[0][l], u->X[1][l], u->X[2][l]}, f[3] = {u->f[0][l], u->f[1][l], u->f[2][l]};
        double Xf[3];
        tlsphi_cross3(X, f, Xf);
        if (with_inertia) m[0][l] += V;
        TLSPHI_UNROLL for (int k = 0; k < 3; k++) {
            if (with_inertia) m[1 + k][l] += V * X[k];
            if (with_inertia) m[4 + k][l] += V * X[k] * X[k];
            if (with_inertia) m[7 + k][l] += V * X[(k + 1) % 3] * X[(k + 2) % 3];
            m[10 + k][l] += V * f[k];
            m[13 + k][l] += V * Xf[k];
        }
    }
}
/* Moments of v with the inertia, or of dp/dt, over a block: its lanes are added in order at the end. */
TLSPHI_INLINE void tlsphi_block_moments(const tlsphi_projection *p, tlsphi_block *block, const int of_v) {
    const tlsph_solver *s = p->s;
    TLSPHI_ALIGNED double m[TLSPHI_MOMENTS][TLSPHI_LANES], origin[3];
    tlsphi_arms arms;
    memset(m, 0, sizeof m);
    tlsphi_projection_origin(p, block, origin);
    for (size_t begin = block->begin, end; begin < block->end; begin = end) {
        end = tlsphi_tile_end(block, begin);
        tlsphi_take_arms(p, origin, begin, end, &arms);
        if (of_v) tlsphi_take_velocities(s, (size_t)s->dim, begin, end, arms.f);
        else if (s->dim == 3) tlsphi_take_vectors(s->rate_p, 3, begin, end, arms.f);
        else tlsphi_take_vectors(s->rate_p, 2, begin, end, arms.f);
        tlsphi_add_arms(&arms, of_v, m);
    }
    for (int k = 0; k < TLSPHI_MOMENTS; k++) {
        block->moments[k] = 0;
        for (size_t l = 0; l < TLSPHI_LANES; l++) block->moments[k] += m[k][l];
    }
}
static void tlsphi_rigid_task(void *arg, size_t i) {
    const tlsphi_projection *p = (const tlsphi_projection *)arg;
    tlsphi_block_moments(p, p->s->block + i, 1);
}
/* Sums of T | X x T, from the same moments. */
static void tlsphi_torque_task(void *arg, size_t i) {
    const tlsphi_projection *p = (const tlsphi_projection *)arg;
    tlsphi_block *block = p->s->block + i;
    tlsphi_block_moments(p, block, 0);
    for (int k = 0; k < 6; k++) block->moments[k] = block->moments[10 + k];
}
/* x with I x = moment, within the turns that the body's mirror planes allow. */
static void tlsphi_turn(const tlsphi_body *body, const double moment[3], double x[3]) {
    double stiffness = 0;
    if (body->turns == 3) {
        tlsphi_solve_symmetric(body->inertia, moment, x);
        return;
    }
    for (int i = 0; i < 9; i++) stiffness += body->axis[i / 3] * body->inertia[i] * body->axis[i % 3];
    const double turn = body->turns && stiffness > 0 ? tlsphi_dot3(body->axis, moment) / stiffness : 0;
    for (int i = 0; i < 3; i++) x[i] = turn * body->axis[i];
}
/* Rigid motion of a body from its moments: centre, inertia (both with V as weight), mean velocity and spin. */
static void tlsphi_rigid_motion(tlsphi_body *body, const double *m) {
    const double V = body->volume = m[0];
    double *const c = body->centre, *const I = body->inertia, moment[3];
    for (int i = 0; i < 3; i++) {
        c[i] = m[1 + i] / V;
        body->v_mean[i] = m[10 + i] / V;
    }
    const double xx = m[4] - V * c[0] * c[0], yy = m[5] - V * c[1] * c[1], zz = m[6] - V * c[2] * c[2];
    I[0] = yy + zz;
    I[4] = xx + zz;
    I[8] = xx + yy;
    I[5] = I[7] = -(m[7] - V * c[1] * c[2]);
    I[2] = I[6] = -(m[8] - V * c[2] * c[0]);
    I[1] = I[3] = -(m[9] - V * c[0] * c[1]);
    tlsphi_cross3(c, m + 10, moment);
    for (int i = 0; i < 3; i++) moment[i] = m[13 + i] - moment[i];
    tlsphi_turn(body, moment, body->spin);
}
static void tlsphi_multipliers(tlsphi_body *body, const double *m) {
    double torque[3];
    tlsphi_cross3(body->centre, m, torque);
    for (int i = 0; i < 3; i++) {
        torque[i] -= m[3 + i];
        body->linear[i] = -m[i] / body->volume;
    }
    tlsphi_turn(body, torque, body->lambda);
}
static void tlsphi_add_debt(tlsphi_body *body, const double *m) {
    for (int i = 0; i < 3; i++) body->debt[i] += m[i];
}
static void tlsphi_pay_debt(tlsphi_body *body, const double *m) {
    double left[TLSPHI_MOMENTS];
    memcpy(left, m, sizeof left);
    for (int i = 0; i < 3; i++) left[3 + i] += body->debt[i];
    tlsphi_multipliers(body, left);
    memset(body->debt, 0, sizeof body->debt);
}
/* turn x X + shift of each lane, to f. */
TLSPHI_INLINE void tlsphi_rigid_lanes(const double turn[3], const double shift[3], tlsphi_arms *u) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        const double X[3] = {u->X[0][l], u->X[1][l], u->X[2][l]};
        double out[3];
        tlsphi_cross3(turn, X, out);
        TLSPHI_UNROLL for (int k = 0; k < 3; k++) u->f[k][l] = out[k] + shift[k];
    }
}
/* w = v - rigid motion. */
static void tlsphi_relative_task(void *arg, size_t i) {
    const tlsphi_projection *p = (const tlsphi_projection *)arg;
    tlsph_solver *s = p->s;
    const tlsphi_block *block = s->block + i;
    const tlsphi_body *body = s->body + block->body;
    const size_t D = (size_t)s->dim;
    double centre[3];
    tlsphi_arms arms;
    tlsphi_projection_centre(p, block, centre);
    for (size_t begin = block->begin, end; begin < block->end; begin = end) {
        end = tlsphi_tile_end(block, begin);
        tlsphi_take_arms(p, centre, begin, end, &arms);
        tlsphi_rigid_lanes(body->spin, body->v_mean, &arms);
        for (size_t k = 0; k < D; k++) {
            const size_t base = begin / TLSPHI_LANES * TLSPHI_LANES;
            const tlsph_real *v = tlsphi_at(s, s->rows.v + (int)k, base);
            tlsph_real *w = tlsphi_at(s, s->rows.w + (int)k, base);
            for (size_t l = begin - base; l < end - base; l++) w[l] = (tlsph_real)((double)v[l] - arms.f[k][l]);
        }
    }
}
/* f += the vectors of `count` lanes */
TLSPHI_INLINE void tlsphi_add_vectors(double (*lanes)[TLSPHI_LANES], const size_t D, const size_t first,
                                      const size_t count, tlsph_real *f) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < count; l++)
        TLSPHI_UNROLL for (size_t k = 0; k < D; k++) f[D * l + k] += (tlsph_real)lanes[k][first + l];
}
static void tlsphi_correct_task(void *arg, size_t i) {
    const tlsphi_projection *p = (const tlsphi_projection *)arg;
    tlsph_solver *s = p->s;
    const tlsphi_block *block = s->block + i;
    const tlsphi_body *body = s->body + block->body;
    const size_t D = (size_t)s->dim;
    tlsphi_arms arms;
    for (size_t begin = block->begin, end; begin < block->end; begin = end) {
        end = tlsphi_tile_end(block, begin);
        tlsphi_take_arms(p, body->middle, begin, end, &arms);
        tlsphi_rigid_lanes(body->lambda, body->linear, &arms);
        if (D == 3 && end - begin == TLSPHI_LANES) tlsphi_add_vectors(arms.f, 3, 0, TLSPHI_LANES, s->rate_p + D * begin);
        else tlsphi_add_vectors(arms.f, D, begin % TLSPHI_LANES, end - begin, s->rate_p + D * begin);
    }
}
/* Sums of z x T over a block. */
static void tlsphi_debt_task(void *arg, size_t i) {
    const tlsphi_projection *p = (const tlsphi_projection *)arg;
    const tlsph_solver *s = p->s;
    tlsphi_block *block = p->s->block + i;
    const tlsphi_body *body = s->body + block->body;
    double origin[3], z[3], T[3], zT[3];
    memset(block->moments, 0, sizeof block->moments);
    tlsphi_stage_arm(s, &p->stage, p->dt, body->first, origin);
    for (size_t a = block->begin; a < block->end; a++) {
        tlsphi_stage_arm(s, &p->stage, p->dt, a, z);
        for (int k = 0; k < 3; k++) z[k] -= origin[k];
        tlsphi_vector3(s->rate_p + (size_t)s->dim * a, s->dim, T);
        tlsphi_cross3(z, T, zT);
        for (int k = 0; k < 3; k++) block->moments[k] += (double)s->V[a] * zT[k];
    }
}
/* The work of the settling turn stays out of E, and is seen from the body's mean motion, because the turn has no resultant. */
static void tlsphi_settle_energy_task(void *arg, size_t i) {
    const tlsphi_projection *p = (const tlsphi_projection *)arg;
    tlsph_solver *s = p->s;
    const tlsphi_block *block = s->block + i;
    const tlsphi_body *body = s->body + block->body;
    double centre[3], X[3], turn[3];
    tlsphi_projection_centre(p, block, centre);
    for (size_t a = block->begin; a < block->end; a++) {
        tlsphi_projection_arm(p, centre, a, X);
        tlsphi_cross3(body->lambda, X, turn);
        for (int k = 0; k < s->dim; k++) {
            const double relative = (double)tlsphi_v(s, a, (size_t)k) - body->v_mean[k];
            s->rate_E[a] -= (tlsph_real)((turn[k] + body->linear[k]) * relative);
        }
    }
}
/* Adds the blocks' moments body by body, in block order, and hands them to `solve`. */
static void tlsphi_each_body(tlsph_solver *s, void (*solve)(tlsphi_body *body, const double *moments)) {
    for (size_t i = 0; i < s->blocks;) {
        const uint32_t body = s->block[i].body;
        double moments[TLSPHI_MOMENTS] = {0};
        for (; i < s->blocks && s->block[i].body == body; i++)
            for (int k = 0; k < TLSPHI_MOMENTS; k++) moments[k] += s->block[i].moments[k];
        solve(s->body + body, moments);
    }
}
static void tlsphi_find_moments(tlsphi_projection *p) {
    tlsphi_run_tasks(p->s, tlsphi_rigid_task, p);
    tlsphi_each_body(p->s, tlsphi_rigid_motion);
}
static void tlsphi_find_rigid_motion(tlsphi_projection *p) {
    tlsphi_find_moments(p);
    for (size_t i = 0; i < p->s->bodies; i++) memcpy(p->s->body[i].turn, p->s->body[i].spin, sizeof p->s->body[i].turn);
    if (p->s->gathers_w) tlsphi_run_tasks(p->s, tlsphi_relative_task, p);
}
/* The centre of a body for tlsphi_correct_task: the first particle, from which it is seen, may have moved by then. */
static void tlsphi_keep_middle(const tlsphi_projection *p, tlsphi_body *body) {
    tlsphi_stage_position(p->s, p->x, &p->stage, p->dt, body->first, body->middle);
    for (int i = 0; i < 3; i++) body->middle[i] += body->centre[i];
}
/* The blocks know their torques. */
static void tlsphi_project_forces(tlsphi_projection *p, void (*solve)(tlsphi_body *body, const double *moments)) {
    tlsphi_each_body(p->s, solve);
    for (size_t i = 0; i < p->s->bodies; i++) {
        tlsphi_body *b = p->s->body + i;
        double spin_moment[3] = {0, 0, 0};
        tlsphi_keep_middle(p, b);
        for (int j = 0; j < 9; j++) spin_moment[j / 3] += b->inertia[j] * b->spin[j % 3];
        p->s->account.projection_work +=
            p->stage.rate_weight * p->dt *
            (tlsphi_dot3(b->lambda, spin_moment) + b->volume * tlsphi_dot3(b->linear, b->v_mean));
    }
    if (!p->leaves) tlsphi_run_tasks(p->s, tlsphi_correct_task, p);
}
/* In the last stage of a scheme with debts: z_next sum x_next x T = -debt. */
static void tlsphi_settle(tlsphi_projection *p) {
    p->stage.ahead = 1;
    for (size_t i = 0; i < p->s->bodies; i++)
        for (int k = 0; k < 3; k++) p->s->body[i].debt[k] /= p->stage.z_next;
    tlsphi_find_moments(p);
    tlsphi_run_tasks(p->s, tlsphi_torque_task, p);
    tlsphi_project_forces(p, tlsphi_pay_debt);
    if (p->s->thermal == TLSPH_ENERGY) tlsphi_run_tasks(p->s, tlsphi_settle_energy_task, p);
}
/* Algorithm 1 line (5), after tlsphi_flux_task. */
static void tlsphi_project(tlsphi_projection *p) {
    const tlsph_solver *s = p->s;
    const tlsphi_stage *stage = &p->stage;
    const int owes = !s->linear && stage->z_was != 0, settles = !s->linear && stage->z_next > 0 && !stage->ahead;
    p->leaves = !owes && !settles && !s->loads && !s->images && !s->held_parts;
    tlsphi_project_forces(p, tlsphi_multipliers);
    if (owes) {
        tlsphi_run_tasks(s, tlsphi_debt_task, p);
        tlsphi_each_body(p->s, tlsphi_add_debt);
    }
    if (settles) tlsphi_settle(p);
}

/* ==== [RHS] ========================================================================================================
   Algorithm 1 line (4). The boundaries between the phases are also where a distributed host would exchange halos. */

static void tlsphi_collect_sums(tlsph_solver *s, double share) {
    for (size_t i = 0; i < s->blocks; i++) {
        const double *sums = s->block[i].sums;
        s->account.dissipation += share * sums[TLSPHI_SUM_DISSIPATION];
        s->account.dissipation_entropy += share * sums[TLSPHI_SUM_DISSIPATION_ENTROPY];
        s->account.conduction_entropy += share * sums[TLSPHI_SUM_CONDUCTION_ENTROPY];
        s->account.least_pair_production = tlsphi_dmin(s->account.least_pair_production, sums[TLSPHI_SUM_LEAST]);
    }
}
/* Fluxes of a block, and the torques of its forces while they are at hand. */
static void tlsphi_flux_task(void *arg, size_t i) {
    const tlsphi_projection *p = (const tlsphi_projection *)arg;
    tlsphi_flux_block(p->s, p->s->block + i);
    if (p->s->projection) tlsphi_torque_task(arg, i);
}
static tlsphi_projection tlsphi_projection_of(tlsph_solver *s, const tlsphi_stage *stage, double dt) {
    tlsphi_projection out;
    out.s = s;
    out.stage = *stage;
    out.dt = dt;
    out.x = s->now.x;
    out.leaves = 0;
    return out;
}
static void tlsphi_right_hand_side(tlsphi_projection *p) {
    tlsph_solver *s = p->s;
    const tlsphi_stage *stage = &p->stage;
    const double dt = p->dt;
    if (s->projection) tlsphi_find_rigid_motion(p);
    tlsphi_surface_velocities(s, s->time + stage->start * dt);
    tlsphi_run(s, tlsphi_gradient_block);
    if (s->sharp) tlsphi_run(s, tlsphi_sharpen_block);
    if (s->lean && s->damps) tlsphi_run(s, tlsphi_laplacian_block);
    if (s->dissipation == TLSPH_SELF_ADJOINT) tlsphi_run(s, tlsphi_adjoint_block);
    tlsphi_run_tasks(s, tlsphi_flux_task, p);
    tlsphi_collect_sums(s, stage->rate_weight * dt);
    if (s->projection) tlsphi_project(p);
    tlsphi_image_forces(s);
    tlsphi_held_forces(s, stage->rate_weight * dt);
    tlsphi_apply_loads(s, stage, dt);
}

/* ==== [INCOMPRESSIBLE] =============================================================================================
   Fractional step of 001 section 5 for bulk moduli up to infinity. F and the deviatoric stresses advance explicitly, then
   the pressure increment q of the stage is found, with which the momentum at the end of the stage,
     p = p_int + w T[q]/V,   T_a[q] = sum_b (q_a A_a + q_b A_b) g_ab/2,   A = H M,                          (001-45a)
   meets, with d = det F and w the weight of the stage's forces (dt, then dt/2),
     V (d + T div v) = V (1 + (p + q)/kappa) + alpha T^2 R(p + q),  V_a div_a v = sum_b (v_b - v_a)/2 . A_a g_ab,  (001-47)
   (49) with "= 0" and (50) with its dt where it belongs. Departures: the volume that a step of T would lead to, d + T div v,
   stands where (42) has the increment of the pressure, so that det F - 1 cannot accumulate: it stays of third order in the
   step. T is the stable step, also in a shorter one: there, what is left of det F - 1 would be corrected by a blow.
   And H is that of x^n in the first stage, of x^{n+1} in the last: there T[q] has no torque, so that angular momentum
   stays exact; what H gains during the first stage is known, (H* - H) : grad v^n, and goes to the right-hand side.

   R is the Laplacian of (54)-(58), k_ab = |c|^2/(rho C.d), without which checkerboards of p are invisible. As printed it
   takes jumps p_b - p_a, and what it takes from div v is of first order at boundaries. By default the jumps are those that
   remain when the linear part (grad p_a + grad p_b).d/2 is taken away; R is the derivative of sum k jump^2/4, symmetric.

   The system S q = b, S = V/(kappa T) + w B V^-1 B^T/rho + alpha T R, is symmetric and positive: conjugate gradients with
   its diagonal as preconditioner. The dual time steps of (48), (52), (53) are there for comparison: v and q in turn, like
   a damped wave of speed sqrt(gamma/rho), point-implicit in what only damps. Bodies whose whole surface is held leave the
   mean of p free: it is set to zero, and the mean of b, by which the held velocities change the volume, spread evenly. */

typedef struct tlsphi_solution {
    tlsph_solver *s;
    double w, T;
    int first_stage, gradient;  /* gradient: R needs grad p */
    const tlsph_real *f, *vector; /* operands of the tasks below */
    tlsph_real *out, factor, *add_to;
    const tlsph_real *dot_a, *dot_b;
} tlsphi_solution;

/* A, the part of b that does not depend on momentum, 1/kappa; diagonal of S and mass for the preconditioner. */
static void tlsphi_pressure_prepare_task(void *arg, size_t i) {
    const tlsphi_solution *q = (const tlsphi_solution *)arg;
    tlsph_solver *s = q->s;
    const size_t D = (size_t)s->dim, dd = D * D;
    for (size_t a = s->block[i].begin; a < s->block[i].end; a++) {
        const tlsphi_material *m = tlsphi_material_of(s, a);
        tlsphi_point pt, next;
        tlsph_real H[9], G[9] = {0}, gain = 0;
        tlsphi_load_measures(s, q->first_stage ? &s->old : &s->now, m, a, &pt);
        tlsphi_shrink(s->dim, pt.H, H);
        tlsphi_mirror_all(s, a, H);
        tlsphi_correct_tensor(s, a, s->dim, H, s->pressure.A + dd * a);
        if (q->first_stage) {
            tlsphi_load_measures(s, &s->now, m, a, &next);
            for (int k = 0; k < 9; k++) next.H[k] -= pt.H[k];
            tlsphi_shrink(s->dim, next.H, H);
            tlsphi_tensor_get(s->rate_F, (int)dd, a, G);
            gain = tlsphi_dot((int)dd, H, G);
        }
        s->pressure.b[a] = s->V[a] * ((pt.d - 1) / (tlsph_real)q->T + gain);
    }
}
/* k_ab of R */
TLSPHI_INLINE tlsph_real tlsphi_pressure_pair(const tlsph_solver *s, size_t a, size_t b, const tlsph_real *g,
                                              const int dim, tlsph_real *d) {
    const size_t dd = (size_t)(dim * dim);
    tlsph_real c[3], C[3];
    tlsphi_pair_arm(s, a, b, dim, d);
    tlsphi_multiply_mean(dim, dim, s->pressure.A + dd * a, s->pressure.A + dd * b, g, c);
    tlsphi_skew_vector(s, a, b, dim, g, C);
    const tlsph_real Cd = tlsphi_dot(dim, C, d), rho = (tlsphi_material_of(s, a)->rho + tlsphi_material_of(s, b)->rho) / 2;
    return Cd > 0 ? tlsphi_dot(dim, c, c) / (rho * Cd) : 0;
}
TLSPHI_INLINE void tlsphi_pressure_diagonal(tlsph_solver *s, const tlsphi_solution *q, size_t a, const int dim) {
    const size_t D = (size_t)dim, dd = D * D;
    const tlsph_real T = (tlsph_real)q->T;
    tlsph_real wide = 0, compact = 0, sum[3] = {0}, Ag[3], d[3];
    for (size_t k = s->first[a]; k < s->first[a + 1]; k++) {
        const size_t b = s->neighbour[k];
        tlsphi_multiply(dim, s->pressure.A + dd * a, s->g + D * k, Ag);
        for (size_t j = 0; j < D; j++) sum[j] += Ag[j];
        wide += tlsphi_dot(dim, Ag, Ag) / (4 * tlsphi_material_of(s, b)->rho * s->V[b]);
        compact += tlsphi_pressure_pair(s, a, b, s->g + D * k, dim, d);
    }
    wide += tlsphi_dot(dim, sum, sum) / (4 * tlsphi_material_of(s, a)->rho * s->V[a]);
    s->pressure.compact[a] = s->V[a] * tlsphi_material_of(s, a)->compressibility / T + s->laplacian_share * T * compact;
    s->pressure.diagonal[a] = s->pressure.compact[a] + (tlsph_real)q->w * wide;
}
static void tlsphi_pressure_diagonal_task(void *arg, size_t i) {
    const tlsphi_solution *q = (const tlsphi_solution *)arg;
    for (size_t a = q->s->block[i].begin; a < q->s->block[i].end; a++) {
        if (q->s->dim == 3) tlsphi_pressure_diagonal(q->s, q, a, 3);
        else tlsphi_pressure_diagonal(q->s, q, a, 2);
    }
}
/* out = T[f]/(rho V), and grad f. */
TLSPHI_INLINE void tlsphi_pressure_force(const tlsph_solver *s, const tlsphi_solution *q, size_t a, const int dim) {
    const size_t D = (size_t)dim, dd = D * D;
    const tlsph_real *f = q->f, *A = s->pressure.A;
    tlsph_real T[3] = {0}, slope[3] = {0};
    for (size_t k = s->first[a]; k < s->first[a + 1]; k++) {
        const size_t b = s->neighbour[k];
        const tlsph_real *g = s->g + D * k, f_a = f[a] / 2, f_b = f[b] / 2, jump = f_b - f_a;
        TLSPHI_UNROLL for (int i = 0; i < dim; i++) {
            TLSPHI_UNROLL for (int j = 0; j < dim; j++) T[i] +=
                (f_a * A[dd * a + (size_t)(dim * i + j)] + f_b * A[dd * b + (size_t)(dim * i + j)]) * g[j];
            slope[i] += jump * g[i];
        }
    }
    const tlsph_real inverse = 1 / s->V[a], rho = tlsphi_material_of(s, a)->rho;
    for (size_t i = 0; i < D; i++) {
        q->out[D * a + i] = T[i] * inverse / rho;
        slope[i] *= inverse;
    }
    if (!q->gradient) return;
    tlsphi_correct_vector(s, a, dim, slope, s->pressure.slope + D * a);
    for (const tlsphi_mirror *m = tlsphi_mirrors_of(s, a); m && m->particle == a; m++)
        if (!m->tangent) tlsphi_mirror_vector(dim, m, s->pressure.slope + D * a);
}
static void tlsphi_pressure_force_task(void *arg, size_t i) {
    const tlsphi_solution *q = (const tlsphi_solution *)arg;
    for (size_t a = q->s->block[i].begin; a < q->s->block[i].end; a++) {
        if (q->s->dim == 3) tlsphi_pressure_force(q->s, q, a, 3);
        else tlsphi_pressure_force(q->s, q, a, 2);
    }
}
/* out = V f/(kappa T) - factor V div(vector) + alpha T (R f without the adjoint of its gradients, which follows). */
TLSPHI_INLINE void tlsphi_pressure_balance(tlsph_solver *s, const tlsphi_solution *q, size_t a, const int dim) {
    const size_t D = (size_t)dim, dd = D * D;
    const tlsph_real *slope = s->pressure.slope, *A = s->pressure.A + dd * a, *vector = q->vector;
    tlsph_real divergence = 0, direct = 0, back[3] = {0}, d[3];
    for (size_t k = s->first[a]; k < s->first[a + 1]; k++) {
        const size_t b = s->neighbour[k];
        const tlsph_real *g = s->g + D * k, conductance = tlsphi_pressure_pair(s, a, b, g, dim, d);
        tlsph_real jump = q->f[b] - q->f[a];
        TLSPHI_UNROLL for (int i = 0; i < dim; i++) {
            tlsph_real Ag = 0;
            TLSPHI_UNROLL for (int j = 0; j < dim; j++) Ag += A[dim * i + j] * g[j];
            divergence += (vector[D * b + (size_t)i] - vector[D * a + (size_t)i]) * Ag / 2;
        }
        if (q->gradient) TLSPHI_UNROLL for (int i = 0; i < dim; i++) jump -=
            (slope[D * a + (size_t)i] + slope[D * b + (size_t)i]) * d[i] / 2;
        direct -= conductance * jump;
        TLSPHI_UNROLL for (int i = 0; i < dim; i++) back[i] -= conductance * jump * d[i] / 2;
    }
    q->out[a] = s->V[a] * tlsphi_material_of(s, a)->compressibility / (tlsph_real)q->T * q->f[a] -
                q->factor * divergence + s->laplacian_share * (tlsph_real)q->T * direct;
    if (!q->gradient) return;
    for (const tlsphi_mirror *m = tlsphi_mirrors_of(s, a); m && m->particle == a; m++)
        if (!m->tangent) tlsphi_mirror_vector(dim, m, back);
    tlsphi_correct_transposed(s, a, dim, back, s->pressure.back + D * a);
    for (size_t i = D * a; i < D * (a + 1); i++) s->pressure.back[i] /= 2 * s->V[a];
}
static void tlsphi_pressure_balance_task(void *arg, size_t i) {
    const tlsphi_solution *q = (const tlsphi_solution *)arg;
    for (size_t a = q->s->block[i].begin; a < q->s->block[i].end; a++) {
        if (q->s->dim == 3) tlsphi_pressure_balance(q->s, q, a, 3);
        else tlsphi_pressure_balance(q->s, q, a, 2);
    }
}
/* The adjoint of the gradients in R: -sum_b (back_a + back_b).g_ab */
static void tlsphi_pressure_adjoint_task(void *arg, size_t i) {
    const tlsphi_solution *q = (const tlsphi_solution *)arg;
    const tlsph_solver *s = q->s;
    const size_t D = (size_t)s->dim;
    for (size_t a = s->block[i].begin; a < s->block[i].end; a++) {
        tlsph_real sum = 0;
        for (size_t k = s->first[a]; k < s->first[a + 1]; k++)
            for (size_t j = 0; j < D; j++)
                sum -= (s->pressure.back[D * a + j] + s->pressure.back[D * s->neighbour[k] + j]) * s->g[D * k + j];
        q->out[a] += s->laplacian_share * (tlsph_real)q->T * sum;
    }
}
/* Fixed directions and driven components take no acceleration from the pressure. */
static void tlsphi_pressure_hold(const tlsph_solver *s, tlsph_real *vector) {
    const size_t D = (size_t)s->dim;
    for (size_t i = 0; i < s->loads; i++) {
        const tlsphi_load *load = s->load + i;
        for (size_t j = 0; load->given.kind == TLSPH_VELOCITY && j < load->given.count; j++) {
            tlsph_real part[3], *at = vector + D * load->inner[j];
            tlsphi_driven_part(s->dim, &load->given, at, part);
            for (size_t k = 0; k < D; k++) at[k] -= part[k];
        }
    }
    for (size_t i = 0; i < s->fixes; i++) {
        tlsph_real *at = vector + D * s->fix[i].particle;
        const tlsph_real along = tlsphi_dot(s->dim, at, s->fix[i].e);
        for (size_t k = 0; k < D; k++) at[k] -= along * s->fix[i].e[k];
    }
}
static void tlsphi_pressure_accelerate(tlsphi_solution *q, const tlsph_real *f, tlsph_real *out) {
    q->f = f;
    q->out = out;
    tlsphi_run_tasks(q->s, tlsphi_pressure_force_task, q);
    tlsphi_pressure_hold(q->s, out);
}
/* out = S f with the divergence of `vector` times `factor`; grad f is that of the last tlsphi_pressure_accelerate. */
static void tlsphi_pressure_terms(tlsphi_solution *q, const tlsph_real *f, const tlsph_real *vector, double factor,
                                  tlsph_real *out) {
    q->f = f;
    q->vector = vector;
    q->factor = (tlsph_real)factor;
    q->out = out;
    tlsphi_run_tasks(q->s, tlsphi_pressure_balance_task, q);
    if (q->gradient) tlsphi_run_tasks(q->s, tlsphi_pressure_adjoint_task, q);
}
static void tlsphi_pressure_apply(tlsphi_solution *q, const tlsph_real *f, tlsph_real *out) {
    tlsphi_pressure_accelerate(q, f, q->s->pressure.a);
    tlsphi_pressure_terms(q, f, q->s->pressure.a, q->w, out);
}
/* Sums of a block: a.b, largest |a| T/V. */
static void tlsphi_pressure_sums_task(void *arg, size_t i) {
    const tlsphi_solution *q = (const tlsphi_solution *)arg;
    tlsphi_block *block = q->s->block + i;
    double sum = 0, most = 0;
    for (size_t a = block->begin; a < block->end; a++) {
        const double value = fabs((double)q->dot_a[a]) * q->T / (double)q->s->V[a];
        sum += (double)q->dot_a[a] * (double)q->dot_b[a];
        if (!(value <= most)) most = value; /* NaN too */
    }
    block->moments[0] = sum;
    block->moments[1] = most;
}
static double tlsphi_pressure_dot(tlsphi_solution *q, const tlsph_real *a, const tlsph_real *b, double *most) {
    double sum = 0, largest = 0;
    q->dot_a = a;
    q->dot_b = b;
    tlsphi_run_tasks(q->s, tlsphi_pressure_sums_task, q);
    for (size_t i = 0; i < q->s->blocks; i++) {
        sum += q->s->block[i].moments[0];
        if (!(q->s->block[i].moments[1] <= largest)) largest = q->s->block[i].moments[1];
    }
    if (most) *most = largest;
    return sum;
}

/* Bodies in which a constant pressure does nothing: is S 1 round-off beside the diagonal? */
static void tlsphi_pressure_closed(tlsphi_body *body, const double *m) {
    body->closed = m[1] <= 1e4 * TLSPHI_EPSILON * m[2];
    body->shift = body->closed ? m[3] / m[0] : 0;
}
/* Sums V | |S 1| | diagonal | values, or V q, and takes the mean of values away from closed bodies. */
static void tlsphi_pressure_level(tlsphi_solution *q, tlsph_real *values, int by_volume) {
    tlsph_solver *s = q->s;
    for (size_t i = 0; i < s->blocks; i++) {
        double *m = s->block[i].moments;
        m[0] = m[1] = m[2] = m[3] = 0;
        for (size_t a = s->block[i].begin; a < s->block[i].end; a++) {
            m[0] += (double)s->V[a];
            m[1] += fabs((double)s->pressure.Sp[a]);
            m[2] += (double)s->pressure.diagonal[a];
            m[3] += (by_volume ? (double)s->V[a] : 1) * (double)values[a];
        }
    }
    tlsphi_each_body(s, tlsphi_pressure_closed);
    for (size_t i = 0; i < s->blocks; i++)
        for (size_t a = s->block[i].begin; a < s->block[i].end; a++)
            values[a] -= (tlsph_real)(s->body[s->block[i].body].shift * (by_volume ? 1 : (double)s->V[a]));
}

/* S q = b from q = 0; r holds b and ends as the residual. Returns the iterations, or -1. */
static int tlsphi_pressure_conjugate(tlsphi_solution *q, double *residual) {
    tlsph_solver *s = q->s;
    tlsphi_pressure *const u = &s->pressure;
    double rz = 0, most = 0;
    (void)tlsphi_pressure_dot(q, u->r, u->r, &most);
    for (int it = 0;; it++) {
        *residual = most;
        if (most <= (double)s->choice.tolerance) return it;
        if (it >= s->choice.iteration_limit || !(most < TLSPHI_LARGEST)) return -1;
        for (size_t a = 0; a < s->n; a++) u->z[a] = u->r[a] / u->diagonal[a];
        const double next = tlsphi_pressure_dot(q, u->r, u->z, NULL), beta = it ? next / rz : 0;
        for (size_t a = 0; a < s->n; a++) u->p[a] = u->z[a] + (tlsph_real)beta * u->p[a];
        rz = next;
        tlsphi_pressure_apply(q, u->p, u->Sp);
        const double curvature = tlsphi_pressure_dot(q, u->p, u->Sp, NULL);
        if (!(curvature > 0)) return -1;
        const tlsph_real step = (tlsph_real)(rz / curvature);
        for (size_t a = 0; a < s->n; a++) {
            u->q[a] += step * u->p[a];
            u->r[a] -= step * u->Sp[a];
        }
        (void)tlsphi_pressure_dot(q, u->r, u->r, &most);
    }
}
/* (001-52), (53) in pseudo-time: momentum, then pressure. The velocity of the iteration is kept in `drift` as its
   difference from p_int/rho + w T[q]/(rho V), which the converged solution has. */
static int tlsphi_pressure_dual_time(tlsphi_solution *q, double *residual) {
    tlsph_solver *s = q->s;
    tlsphi_pressure *const u = &s->pressure;
    const size_t D = (size_t)s->dim;
    double slowest = 0, most = 0;
    for (size_t a = 0; a < s->n; a++) { /* the wide part of the diagonal over V is (pseudo frequency/2)^2 or more */
        const double mu = (double)tlsphi_material_of(s, a)->mu * (double)s->choice.pseudo_modulus;
        const double wide = (double)(u->diagonal[a] - u->compact[a]) / (q->w * (double)s->V[a]);
        slowest = tlsphi_dmax(slowest, sqrt(mu * wide));
    }
    const double step = 0.7 / slowest, keep = 1 / (1 + step / q->w);
    memset(u->velocity, 0, D * s->n * sizeof *u->velocity); /* change from v_int */
    for (int it = 0;; it++) {
        tlsphi_pressure_accelerate(q, u->q, u->a);
        for (size_t i = 0; i < D * s->n; i++) /* the true residual S q - b needs w a, the iteration its own velocity */
            u->velocity[i] = (tlsph_real)(keep * ((double)u->velocity[i] + step * (double)u->a[i]));
        tlsphi_pressure_terms(q, u->q, u->a, q->w, u->Sp);
        for (size_t a = 0; a < s->n; a++) u->z[a] = u->r[a] - u->Sp[a];
        (void)tlsphi_pressure_dot(q, u->z, u->z, &most);
        *residual = most;
        if (most <= (double)s->choice.tolerance) return it;
        if (it >= s->choice.iteration_limit || !(most < TLSPHI_LARGEST)) return -1;
        tlsphi_pressure_terms(q, u->q, u->velocity, 1, u->Sp);
        for (size_t a = 0; a < s->n; a++) {
            const double rate = step * (double)tlsphi_material_of(s, a)->mu * (double)s->choice.pseudo_modulus / (double)s->V[a];
            u->q[a] += (tlsph_real)(rate * (double)(u->r[a] - u->Sp[a]) / (1 + rate * (double)u->compact[a]));
        }
    }
}

/* The pressure of a stage and the momentum that goes with it. */
static tlsph_result tlsphi_pressure_solve(tlsph_solver *s, const tlsphi_stage *stage, int number, double dt) {
    tlsphi_solution q;
    tlsphi_pressure *const u = &s->pressure;
    const size_t D = (size_t)s->dim;
    memset(&q, 0, sizeof q);
    q.s = s;
    q.T = tlsphi_dmax(dt, (double)tlsph_stable_time_step(s));
    q.w = stage->c * dt;
    q.first_stage = number == 0;
    q.gradient = !s->choice.laplacian_as_printed && s->laplacian_share > 0;
    tlsphi_run_tasks(s, tlsphi_pressure_prepare_task, &q);
    tlsphi_run_tasks(s, tlsphi_pressure_diagonal_task, &q);
    tlsphi_pressure_accelerate(&q, s->now.q, u->a); /* for its gradient */
    for (size_t i = 0; i < D * s->n; i++) u->a[i] = s->now.p[i] / tlsphi_material_of(s, i / D)->rho;
    tlsphi_pressure_terms(&q, s->now.q, u->a, 1, u->r);
    for (size_t a = 0; a < s->n; a++) {
        u->r[a] = u->b[a] - u->r[a];
        u->q[a] = 0;
        u->z[a] = 1;
    }
    tlsphi_pressure_apply(&q, u->z, u->Sp);
    tlsphi_pressure_level(&q, u->r, 0);
    double residual = 0;
    const int iterations = s->choice.iteration == TLSPH_DUAL_TIME ? tlsphi_pressure_dual_time(&q, &residual)
                                                                  : tlsphi_pressure_conjugate(&q, &residual);
    s->report.iterations[number] = iterations < 0 ? s->choice.iteration_limit : iterations;
    s->report.iterations_total += (uint64_t)s->report.iterations[number];
    s->report.residual[number] = residual;
    if (iterations < 0) {
        tlsphi_fail(&s->error, TLSPH_ERROR_CONVERGENCE, "step", "volume strain that the pressure misses", TLSPH_NO_PARTICLE,
                    residual, (double)s->choice.tolerance,
                    "at most incompressible.tolerance within iteration_limit; raise the limit, alpha or the tolerance");
        s->error.time = s->time;
        s->error.step = s->step;
        return TLSPH_ERROR_CONVERGENCE;
    }
    tlsphi_pressure_accelerate(&q, u->q, u->a);
    for (size_t a = 0; a < s->n; a++) {
        const double mass = q.w * (double)tlsphi_material_of(s, a)->rho;
        s->now.q[a] += u->q[a];
        for (size_t i = D * a; i < D * (a + 1); i++) s->now.p[i] += (tlsph_real)(mass * (double)u->a[i]);
    }
    for (size_t i = 0; i < s->bodies; i++) /* level p of closed bodies: as found above, by what S 1 was */
        if (s->body[i].closed) q.first_stage = -1;
    if (q.first_stage < 0) {
        for (size_t a = 0; a < s->n; a++) u->z[a] = 1;
        tlsphi_pressure_apply(&q, u->z, u->Sp);
        tlsphi_pressure_level(&q, s->now.q, 1);
    }
    return TLSPH_OK;
}

TLSPHI_DEF tlsph_result tlsph_pressure_report_read(const tlsph_solver *s, tlsph_pressure_report *report) {
    if (!report) return TLSPH_ERROR_ARGUMENT;
    if (!s->now.q) return TLSPH_ERROR_FIELD;
    *report = s->report;
    report->tolerance = (double)s->choice.tolerance;
    report->volume_error = 0;
    for (size_t a = 0; a < s->n; a++) {
        const tlsphi_material *m = tlsphi_material_of(s, a);
        tlsphi_point pt;
        tlsphi_load_measures(s, &s->now, m, a, &pt);
        report->volume_error =
            tlsphi_dmax(report->volume_error, fabs((double)(pt.d - 1 - s->now.q[a] * m->compressibility)));
    }
    return TLSPH_OK;
}

/* ==== [SUPER-STEPS] ================================================================================================
   Conduction limits explicit steps to about c_v h^2/(2 d K), which on fine bodies is far below the sound limit. Where the
   description asks, a step is split in three: conduction for dt/2, everything else with adiabatic particles for dt,
   conduction for dt/2. Each conduction is one super-step of the stabilised scheme RKL2 (Meyer, Balsara and Aslam, J. Comput.
   Phys. 257 (2014) 594), of second order: m stages of two light gathers reach (m^2 + m - 2)/4 explicit steps. The recursion
   is linear in the rates, so heat is conserved to round-off; deformation and momentum do not change meanwhile, and the
   mechanical part is adiabatic, so no order of the parts can make entropy vanish (Armero and Simo, Int. J. Numer. Meth.
   Engrg. 35 (1992) 737).
   What it gives up: waves that exchange their heat within one step (k^2 K dt/c_v > 1) are stressed adiabatically during
   the step and relax after it, a viscosity delta c^2 dt/2 of first order. Longer waves keep second order. */

/* How many explicit steps m stages are worth. */
static double tlsphi_super_reach(int m) { return ((double)m * m + m - 2) / 4; }
static double tlsphi_heat_step(const tlsph_solver *s) {
    double dt = TLSPHI_LARGEST;
    for (size_t i = 0; i < s->blocks; i++) dt = tlsphi_dmin(dt, s->block[i].heat_step);
    return dt;
}

TLSPHI_INLINE void tlsphi_theta_gradient_tile(const tlsph_solver *s, size_t tile, size_t begin, size_t end,
                                              const int dim) {
    const size_t base = begin / TLSPHI_LANES * TLSPHI_LANES, first = begin - base, last = end - base;
    tlsph_real sum[3 * TLSPHI_LANES], scale[TLSPHI_LANES];
    tlsphi_sum_number(s, tile, base, s->rows.theta, dim, sum);
    tlsphi_half_per_volume(s, base, first, last, scale);
    tlsphi_store_theta(s, base, first, last, dim, scale, s->M ? tlsphi_correction_lanes(s, base) : NULL, sum);
}
/* One by one: with bonds, at mirrors, and to compare (`audit`). */
static void tlsphi_theta_gradient(tlsph_solver *s, size_t a) {
    const size_t D = (size_t)s->dim;
    const tlsph_real half = 1 / (2 * s->V[a]);
    tlsph_real grad[3] = {0, 0, 0}, slope[3];
    for (size_t k = s->first[a]; k < s->first[a + 1]; k++) {
        const tlsph_real jump = (*tlsphi_theta(s, s->neighbour[k]) - *tlsphi_theta(s, a)) * half;
        for (size_t i = D * k; i < D * k + D; i++) grad[i - D * k] += jump * (s->g[i] + (s->rest ? s->rest[i] : 0));
    }
    tlsphi_correct_vector(s, a, s->dim, grad, slope);
    tlsphi_row_put(s, s->rows.slope_theta, s->dim, a, slope);
}
static void tlsphi_theta_gradient_block(tlsph_solver *s, tlsphi_block *block) {
    const int one_by_one = s->audit || s->bonds;
    for (size_t a = block->begin, tile = block->tile, end; a < block->end && !one_by_one; a = end, tile++) {
        end = tlsphi_tile_end(block, a);
        if (s->dim == 3) tlsphi_theta_gradient_tile(s, tile, a, end, 3);
        else tlsphi_theta_gradient_tile(s, tile, a, end, 2);
    }
    for (size_t a = block->begin; (s->mirrors || one_by_one) && a < block->end; a++) {
        if (one_by_one) tlsphi_theta_gradient(s, a);
        if (!one_by_one && !tlsphi_mirrors_of(s, a)) continue;
        tlsphi_mirror_slope(s, s->rows.slope_theta, 1, a);
        tlsphi_heat_flux(s, a);
    }
}
/* Heat that the pairs of a slot bring. As deformation rests meanwhile, the first stage of a super-step keeps the
   conductances k for the others. */
TLSPHI_INLINE void tlsphi_theta_lanes(const tlsphi_rows *r, const tlsph_real *a, const tlsph_real *b,
                                      const tlsph_real *pattern, const int dim, const int compact, const int fresh,
                                      const int given, tlsph_real *k, tlsph_real *sum) {
    TLSPHI_EACH_LANE for (size_t l = 0; l < TLSPHI_LANES; l++) {
        tlsphi_heat_side side_a, side_b;
        tlsphi_pair_of_heat heat;
        tlsph_real g[5];
        tlsphi_load_heat(r, a + l, TLSPHI_ROW, dim, dim, tlsphi_columns[7], &side_a);
        tlsphi_load_heat(r, b + l, TLSPHI_ROW, dim, dim, tlsphi_columns[7], &side_b);
        tlsphi_take_apart(dim + 1 + given, pattern + l, TLSPHI_LANES, g);
        const tlsph_real CC = g[dim] * g[dim], *along = given ? g + dim + 1 : NULL;
        if (fresh) k[l] = tlsphi_conductance(&side_a, &side_b, g, CC, g, along, dim, dim);
        tlsphi_pair_heat(&side_a, &side_b, g, compact ? k[l] : 0, NULL, dim, dim, TLSPH_ENERGY, compact, &heat);
        sum[l] += heat.heat;
    }
}
TLSPHI_INLINE void tlsphi_theta_rate_tile(const tlsph_solver *s, const tlsphi_block *block, size_t tile,
                                          const tlsph_real *a, const int dim, const int has_J, tlsph_real *sum) {
    const tlsphi_rows r = tlsphi_rows_of(dim, has_J, 1, 1, 0);
    for (size_t at = s->graph.first[tile]; at < s->graph.first[tile + 1]; at++) {
        const tlsphi_slot *slot = s->graph.slot + at;
        const tlsph_real *g = s->graph.pattern + (size_t)slot->pattern * (size_t)s->graph.width * TLSPHI_LANES;
        const tlsph_real *b = tlsphi_gather(s, block, &s->graph, slot, r.theta, s->super.fresh ? r.count : r.h_J);
        tlsph_real *k = s->super.conductance + at * TLSPHI_LANES;
        if (slot->scattered) tlsphi_gather(s, block, &s->graph, slot, r.X, r.X + dim);
        if (slot->scattered && s->super.fresh) tlsphi_gather(s, block, &s->graph, slot, r.A, r.slope_w);
        if (s->conduction != TLSPH_COMPACT) tlsphi_theta_lanes(&r, a, b, g, dim, 0, 0, 0, NULL, sum);
        else if (!s->super.fresh) tlsphi_theta_lanes(&r, a, b, g, dim, 1, 0, 0, k, sum);
        else if (s->M) tlsphi_theta_lanes(&r, a, b, g, dim, 1, 1, 1, k, sum);
        else tlsphi_theta_lanes(&r, a, b, g, dim, 1, 1, 0, k, sum);
    }
}
/* rate_E becomes d theta/dt, K/s. */
static void tlsphi_theta_rate_block(tlsph_solver *s, tlsphi_block *block) {
    tlsphi_gathered pairs[TLSPHI_LANES];
    for (size_t a = block->begin, tile = block->tile, end; a < block->end; a = end, tile++) {
        const size_t base = a / TLSPHI_LANES * TLSPHI_LANES;
        const tlsph_real *row = tlsphi_at(s, 0, base);
        tlsph_real sum[TLSPHI_LANES] = {0};
        end = tlsphi_tile_end(block, a);
        if (s->audit || s->bonds) {
            tlsphi_flux_one_by_one(s, a, end, TLSPHI_HEAT, pairs);
            for (size_t p = a; p < end; p++) sum[p - base] = pairs[p - a].heat;
        } else if (s->dim == 3 && s->has_J) tlsphi_theta_rate_tile(s, block, tile, row, 3, 1, sum);
        else if (s->dim == 3) tlsphi_theta_rate_tile(s, block, tile, row, 3, 0, sum);
        else if (s->has_J) tlsphi_theta_rate_tile(s, block, tile, row, 2, 1, sum);
        else tlsphi_theta_rate_tile(s, block, tile, row, 2, 0, sum);
        for (size_t p = a; p < end; p++)
            s->rate_E[p] = sum[p - base] / (s->V[p] * tlsphi_material_of(s, p)->c_v) + s->super.source[p];
    }
}

/* Rates of all heat loads, at the middle of the super-step; `after` it the entropy that came with them, at mean
   temperatures. */
static double tlsphi_super_loads(tlsph_solver *s, double time, double dt, int after) {
    double entropy = 0;
    if (!after) memset(s->super.source, 0, s->n * sizeof *s->super.source);
    for (size_t k = 0; k < s->loads; k++) {
        tlsphi_load *load = s->load + k;
        if (load->given.kind != TLSPH_HEAT_FLUX && load->given.kind != TLSPH_HEAT_SOURCE) continue;
        if (!after) tlsphi_load_values(s, load, time + dt / 2);
        for (size_t i = 0; i < load->given.count; i++) {
            const size_t a = load->inner[i];
            const tlsph_real power = tlsphi_heat_power(s, load, i);
            if (after) entropy += 2 * dt * (double)(power / (s->super.first[a] + s->super.current[a]));
            else s->super.source[a] += power / (s->V[a] * tlsphi_material_of(s, a)->c_v);
            if (!after) s->account.external_heat += dt * (double)power;
        }
    }
    return entropy;
}
/* Neighbours see prescribed temperatures; the recursion of the particle itself goes on freely, so that the difference at
   the end is the heat that holding it has cost. `book`: take that into the account and end the recursion there. */
static double tlsphi_super_hold(tlsph_solver *s, double time, int book) {
    double entropy = 0;
    for (size_t k = 0; k < s->loads; k++) {
        tlsphi_load *load = s->load + k;
        if (load->given.kind != TLSPH_TEMPERATURE) continue;
        tlsphi_load_values(s, load, time);
        for (size_t i = 0; i < load->given.count; i++) {
            const size_t a = load->inner[i];
            (*tlsphi_theta(s, a)) = load->values[i];
            if (!book) continue;
            const double gain = (double)(((*tlsphi_theta(s, a)) - s->super.current[a]) * s->V[a] * tlsphi_material_of(s, a)->c_v);
            s->account.external_heat += gain;
            entropy += gain / (double)(*tlsphi_theta(s, a));
            s->super.current[a] = (*tlsphi_theta(s, a));
        }
    }
    return entropy;
}

/* Y_j = mu Y_j-1 + nu Y_j-2 + (1 - mu - nu) Y_0 + dt (now L(Y_j-1) + then L(Y_0)) */
typedef struct tlsphi_super_stage {
    tlsph_solver *s;
    int number;
    tlsph_real mu, nu, now, then; /* the last two times dt */
} tlsphi_super_stage;

static tlsphi_super_stage tlsphi_super_weights(tlsph_solver *s, int j, int m, double dt) {
    tlsphi_super_stage out;
    double b[3]; /* of the stages j, j - 1, j - 2 */
    for (int i = 0; i < 3; i++) {
        const double l = j - i;
        b[i] = l < 2 ? 1.0 / 3.0 : (l * l + l - 2) / (2 * l * (l + 1));
    }
    const double w = dt / tlsphi_super_reach(m), mu = j > 1 ? (2 - 1.0 / j) * b[0] / b[1] : 1;
    out.s = s;
    out.number = j;
    out.mu = (tlsph_real)mu;
    out.nu = (tlsph_real)(j > 1 ? (1.0 / j - 1) * b[0] / b[2] : 0);
    out.now = (tlsph_real)(j > 1 ? mu * w : w * b[0]);
    out.then = (tlsph_real)(j > 1 ? (b[1] - 1) * mu * w : 0);
    return out;
}
static void tlsphi_super_task(void *arg, size_t i) {
    const tlsphi_super_stage *stage = (const tlsphi_super_stage *)arg;
    tlsph_solver *s = stage->s;
    tlsphi_super *y = &s->super;
    for (size_t a = s->block[i].begin; a < s->block[i].end; a++) {
        if (stage->number == 1) {
            y->first[a] = y->previous[a] = y->current[a] = (*tlsphi_theta(s, a));
            y->rate[a] = s->rate_E[a];
        }
        const tlsph_real was = y->first[a]; /* in changes: the weights add up to 1 only but for rounding, which made heat */
        const tlsph_real next = was + (stage->mu * (y->current[a] - was) + stage->nu * (y->previous[a] - was) +
                                       stage->now * s->rate_E[a] + stage->then * y->rate[a]);
        y->previous[a] = y->current[a];
        y->current[a] = (*tlsphi_theta(s, a)) = next;
    }
}
/* E or eta from the new temperatures, and the entropy that was made. */
static void tlsphi_super_finish(tlsph_solver *s, tlsphi_block *block) {
    double made = 0;
    for (size_t a = block->begin; a < block->end; a++) {
        const tlsph_real c_v = tlsphi_material_of(s, a)->c_v, was = s->super.first[a], is = s->super.current[a];
        const tlsph_real gain = is > 0 ? c_v * tlsphi_log(is / was) : 0; /* if not, the evaluation reports it */
        made += (double)(s->V[a] * gain);
        s->now.E[a] += s->thermal == TLSPH_ENTROPY && is > 0 ? gain : c_v * (is - was);
    }
    block->sums[TLSPHI_SUM_CONDUCTION_ENTROPY] = made;
}
/* Conduction alone from `time` for dt. Returns the first failed block of the evaluation after it, or NULL. */
static const tlsphi_block *tlsphi_conduct(tlsph_solver *s, double time, double dt) {
    int m = 3;
    double entropy = 0, made = 0;
    tlsphi_super_loads(s, time, dt, 0);
    while (tlsphi_super_reach(m) * tlsphi_heat_step(s) < dt * (1 - 1e-9) && m < s->super.most) m += 2;
    for (int j = 1; j <= m; j++) {
        tlsphi_super_stage stage = tlsphi_super_weights(s, j, m, dt);
        const double reached = j > 1 ? tlsphi_super_reach(j) / tlsphi_super_reach(m) : 1 / (3 * tlsphi_super_reach(m));
        s->super.fresh = j == 1;
        tlsphi_run(s, tlsphi_theta_gradient_block);
        tlsphi_run(s, tlsphi_theta_rate_block);
        tlsphi_run_tasks(s, tlsphi_super_task, &stage);
        entropy += tlsphi_super_hold(s, time + reached * dt, j == m);
    }
    tlsphi_run(s, tlsphi_super_finish);
    entropy += tlsphi_super_loads(s, time, dt, 1);
    for (size_t i = 0; i < s->blocks; i++) made += s->block[i].sums[TLSPHI_SUM_CONDUCTION_ENTROPY];
    s->account.external_entropy += entropy;
    s->account.conduction_entropy += made - entropy;
    return tlsphi_evaluate(s);
}

/* ==== [STEP] =======================================================================================================
   Runge-Kutta schemes as tables, geometry in the same scheme.

   Frozen dissipation. Stages u0 + c dt (L(u) + D(u0)) keep the forces T_D, D_J of the step's beginning, but heat must be
   what these take from the motion now: the share of a particle is share_0 - (w - w_0).T_D - (Sigma_J - Sigma_J0) D_J, whose
   sum over the body is -sum (w.T_D + Sigma_J D_J) as before, so that the energy is conserved to round-off. Given up: within
   a step w may turn against T_D, so that a share, and the production of a pair, may be negative by O(dt) of itself. */

/* The rate of the kinetic part of E, v . dp/dt: all forces are in rate_p by now. */
TLSPHI_INLINE void tlsphi_kinetic_rate_tile(tlsph_solver *s, size_t begin, const size_t count, const int dim) {
    const tlsph_real *v = tlsphi_at(s, s->rows.v, begin), *force = s->rate_p + (size_t)dim * begin;
    tlsph_real *rate = s->rate_E + begin;
    TLSPHI_EACH_LANE for (size_t l = 0; l < count; l++) {
        tlsph_real own[3] = {0};
        tlsphi_take_rows(dim, v + l, own);
        rate[l] += tlsphi_dot(dim, own, force + (size_t)dim * l);
    }
}
static void tlsphi_add_kinetic_rate(tlsph_solver *s, const tlsphi_block *block) {
    for (size_t a = block->begin, end; a < block->end; a = end) {
        end = tlsphi_tile_end(block, a);
        if (end - a < TLSPHI_LANES) tlsphi_kinetic_rate_tile(s, a, end - a, s->dim);
        else if (s->dim == 3) tlsphi_kinetic_rate_tile(s, a, TLSPHI_LANES, 3);
        else tlsphi_kinetic_rate_tile(s, a, TLSPHI_LANES, 2);
    }
}
/* now = a old + b u + c dt rate over the entries [begin, end), written so that a + b = 1 has no round-off. */
TLSPHI_INLINE void tlsphi_combine(tlsph_real *now, const tlsph_real *old, const tlsph_real *u, const tlsph_real *rate,
                                  size_t begin, size_t end, tlsph_real B, tlsph_real C) {
    TLSPHI_EACH_LANE for (size_t i = begin; i < end; i++) now[i] = old[i] + B * (u[i] - old[i]) + C * rate[i];
}
/* The same for x, whose rate lies in the rows of v. */
TLSPHI_INLINE void tlsphi_move_tile(tlsph_solver *s, const tlsph_real *u_x, size_t begin, const size_t count,
                                    const size_t D, tlsph_real B, tlsph_real C) {
    const tlsph_real *row = tlsphi_at(s, s->rows.v, begin);
    tlsph_real v[3 * TLSPHI_LANES];
    TLSPHI_EACH_LANE for (size_t l = 0; l < count; l++)
        TLSPHI_UNROLL for (size_t i = 0; i < D; i++) v[D * l + i] = row[i * TLSPHI_ROW + l];
    tlsphi_combine(s->now.x + D * begin, s->old.x + D * begin, u_x + D * begin, v, 0, D * count, B, C);
}
static void tlsphi_move(tlsph_solver *s, const tlsph_real *u_x, const tlsphi_block *block, tlsph_real B, tlsph_real C) {
    for (size_t a = block->begin, end; a < block->end; a = end) {
        end = tlsphi_tile_end(block, a);
        if (end - a < TLSPHI_LANES) tlsphi_move_tile(s, u_x, a, end - a, (size_t)s->dim, B, C);
        else if (s->dim == 3) tlsphi_move_tile(s, u_x, a, TLSPHI_LANES, 3, B, C);
        else tlsphi_move_tile(s, u_x, a, TLSPHI_LANES, 2, B, C);
    }
}
/* The same for F and, where it is evolved, H, of the lanes [first, last) of the tile at `base`: dF/dt = grad v and
   dH/dt = F x grad v with F of state u. `from` and `turn`: grad v, or grad w and the spin that it lacks. */
TLSPHI_INLINE void tlsphi_deform_lanes(tlsph_solver *s, const tlsphi_state *u, const tlsph_real *from, size_t apart,
                                       const tlsph_real turn[3], size_t base, size_t first, size_t last, const int dim,
                                       const int has_H, tlsph_real B, tlsph_real C) {
    const size_t D = (size_t)dim, dd = D * D, at = dd * base;
    const tlsph_real *u_F = u->F + at, *u_H = has_H ? u->H + at : NULL;
    const tlsph_real *old_F = s->old.F + at, *old_H = has_H ? s->old.H + at : NULL;
    tlsph_real *now_F = s->now.F + at, *now_H = has_H ? s->now.H + at : NULL;
    TLSPHI_EACH_LANE for (size_t l = first; l < last; l++) {
        tlsph_real u_in[9], G_in[9], F[9], G[9], rate[9], out[9];
        TLSPHI_UNROLL for (size_t i = 0; i < dd; i++) u_in[i] = u_F[i * TLSPHI_LANES + l];
        TLSPHI_UNROLL for (size_t j = 0; j < D; j++) {
            const tlsph_real c[3] = {u_in[j], u_in[D + j], dim == 3 ? u_in[2 * D + j] : 0};
            G_in[j] = from[j * apart + l] + turn[1] * c[2] - turn[2] * c[1];
            G_in[D + j] = from[(D + j) * apart + l] + turn[2] * c[0] - turn[0] * c[2];
            if (dim == 3) G_in[2 * D + j] = from[(2 * D + j) * apart + l] + turn[0] * c[1] - turn[1] * c[0];
        }
        TLSPHI_UNROLL for (size_t i = 0; i < dd; i++) {
            const size_t k = i * TLSPHI_LANES + l;
            now_F[k] = old_F[k] + B * (u_in[i] - old_F[k]) + C * G_in[i];
        }
        if (!has_H) continue;
        tlsphi_expand(dim, u_in, 1, F);
        tlsphi_expand(dim, G_in, 0, G);
        tlsphi_cross_inline(F, G, rate);
        tlsphi_shrink(dim, rate, out);
        TLSPHI_UNROLL for (size_t i = 0; i < dd; i++) {
            const size_t k = i * TLSPHI_LANES + l;
            now_H[k] = old_H[k] + B * (u_H[k] - old_H[k]) + C * out[i];
        }
    }
}
TLSPHI_INLINE void tlsphi_deform_tile(tlsph_solver *s, const tlsphi_state *u, const tlsph_real *from, size_t apart,
                                      const tlsph_real turn[3], size_t a, size_t end, const int dim, tlsph_real B,
                                      tlsph_real C) {
    const size_t first = a % TLSPHI_LANES, base = a - first, last = end - base;
    const int whole = end - a == TLSPHI_LANES;
    if (whole && s->has_H) tlsphi_deform_lanes(s, u, from, apart, turn, base, 0, TLSPHI_LANES, dim, 1, B, C);
    else if (whole) tlsphi_deform_lanes(s, u, from, apart, turn, base, 0, TLSPHI_LANES, dim, 0, B, C);
    else if (s->has_H) tlsphi_deform_lanes(s, u, from, apart, turn, base, first, last, dim, 1, B, C);
    else tlsphi_deform_lanes(s, u, from, apart, turn, base, first, last, dim, 0, B, C);
}
static void tlsphi_deform(tlsph_solver *s, const tlsphi_state *u, const tlsphi_block *block, tlsph_real B,
                          tlsph_real C) {
    const size_t dd = (size_t)(s->dim * s->dim);
    tlsph_real turn[3] = {0, 0, 0};
    for (int i = 0; i < 3 && !s->rate_F && s->projection; i++) turn[i] = (tlsph_real)s->body[block->body].turn[i];
    for (size_t a = block->begin, end; a < block->end; a = end) {
        const size_t base = a / TLSPHI_LANES * TLSPHI_LANES, apart = s->rate_F ? TLSPHI_LANES : TLSPHI_ROW;
        const tlsph_real *from = s->rate_F ? s->rate_F + dd * base : tlsphi_at(s, s->rows.grad_w, base);
        end = tlsphi_tile_end(block, a);
        if (s->dim == 3) tlsphi_deform_tile(s, u, from, apart, turn, a, end, 3, B, C);
        else tlsphi_deform_tile(s, u, from, apart, turn, a, end, 2, B, C);
    }
}
typedef struct tlsphi_update {
    tlsph_solver *s;
    const tlsphi_state *u; /* the state before the stage */
    tlsphi_projection *projection;
    int concludes; /* (7) to (9), too */
    tlsph_real B, C;
} tlsphi_update;

static void tlsphi_update_task(void *arg, size_t i) {
    const tlsphi_update *up = (const tlsphi_update *)arg;
    tlsph_solver *s = up->s;
    const size_t D = (size_t)s->dim, begin = s->block[i].begin, end = s->block[i].end;
    const tlsph_real B = up->B, C = up->C;
    const tlsphi_state *u = up->u;
    if (up->projection->leaves) tlsphi_correct_task(up->projection, i);
    if (s->thermal == TLSPH_ENERGY) tlsphi_add_kinetic_rate(s, s->block + i);
    tlsphi_move(s, u->x, s->block + i, B, C);
    tlsphi_combine(s->now.p, s->old.p, u->p, s->rate_p, D * begin, D * end, B, C);
    tlsphi_deform(s, u, s->block + i, B, C);
    if (s->has_J) tlsphi_combine(s->now.J, s->old.J, u->J, s->rate_J, begin, end, B, C);
    if (s->now.E) tlsphi_combine(s->now.E, s->old.E, u->E, s->rate_E, begin, end, B, C);
    if (s->now.plastic) tlsphi_flow_block(s, s->block + i);
    if (!up->concludes) return;
    tlsphi_apply_fixes(s, s->now.p, begin, end);
    tlsphi_evaluate_block(s, s->block + i);
}
/* The state before a stage. Of the first one that is the old state, and the new one goes to the spare memory, see
   tlsphi_share_state. */
static const tlsphi_state *tlsphi_before(tlsph_solver *s) {
    if (s->now_memory != s->old_memory) return &s->now;
    s->now = s->spare;
    s->now_memory = s->spare_memory;
    return &s->old;
}
/* Algorithm 1 line (6). Where no condition needs the whole of the new state, (7) to (9) follow block by block, while it is
   in the cache: that saves a twentieth of the memory's traffic for each line. */
static void tlsphi_evolve(tlsphi_projection *projection, int concludes) {
    tlsph_solver *s = projection->s;
    const tlsphi_stage *stage = &projection->stage;
    tlsphi_update up;
    up.s = s;
    up.projection = projection;
    up.concludes = concludes;
    up.u = tlsphi_before(s);
    up.B = (tlsph_real)stage->b;
    up.C = (tlsph_real)(stage->c * projection->dt);
    tlsphi_run_tasks(s, tlsphi_update_task, &up);
}

static void tlsphi_principal_data(tlsph_solver *s, size_t a, const tlsphi_point *pt, tlsph_error *e) {
    const size_t D = (size_t)s->dim;
    for (size_t i = 0; i < D; i++) e->position[i] = (double)s->now.x[D * a + i];
    if (tlsphi_all_finite(pt->F, 9)) tlsphi_stretches(pt->F, e->stretches);
    e->temperature = (double)pt->theta;
    e->neighbours = s->found[a];
    e->time = s->time;
    e->step = s->step;
}
#define TLSPHI_SQUEEZED "it is squeezed to nothing: the law may allow collapse, or the load is too strong"
/* What holds of the scene whatever failed; else NULL. */
static const char *tlsphi_cause_of_scene(const tlsph_solver *s) {
    if (s->dissipation == TLSPH_NO_DISSIPATION) return "without dissipation noise grows";
    if (s->cfl > tlsph_cfl_limit(s->integrator) && !s->incompressible) return "cfl is above tlsph_cfl_limit";
    return NULL;
}
/* Least stretch of particle a in the last good state, and its det F. */
static double tlsphi_squeeze_before(const tlsph_solver *s, size_t a, tlsph_real *d) {
    double stretches[3];
    tlsphi_point was;
    tlsphi_load_measures(s, &s->old, tlsphi_material_of(s, a), a, &was);
    tlsphi_stretches(was.F, stretches);
    *d = was.d;
    return stretches[2];
}
/* Why particle a, which is at pt now, turned inside out. */
static const char *tlsphi_cause_of_inversion(const tlsph_solver *s, size_t a, const tlsphi_point *pt) {
    const tlsphi_material *m = tlsphi_material_of(s, a);
    tlsph_real d;
    const double least = tlsphi_squeeze_before(s, a, &d);
    if (pt->d > 0) return "the evolved J has left det F: raise drift_stiffness, or use TLSPH_PF";
    if (d > TLSPHI_R(0.5)) return "it was whole a step ago: a load or velocity is too fast for the step; set retries";
    if (!s->has_J && !s->incompressible && m->kappa > 50 * m->mu) return "nu above 0.49 without J evolved; use TLSPH_PFJ";
    if (least < 0.2) return "it was squeezed flat: the law may allow collapse, or the resolution is too coarse";
    return "a load, drive or shock too strong for the resolution, or growing noise";
}
static const char *tlsphi_cause_of_cold(const tlsph_solver *s, size_t a, const tlsphi_point *pt) {
    const tlsphi_material *m = tlsphi_material_of(s, a);
    for (size_t i = 0; i < s->loads; i++)
        for (size_t k = 0; tlsphi_is_thermal(s->load[i].given.kind) && k < s->load[i].given.count; k++)
            if (s->load[i].inner[k] == a) return "a heat load takes more than there is";
    const double mechanical = (double)(pt->kinetic + tlsphi_abs(pt->r.energy)), heat = (double)(m->c_v * m->theta_R);
    if (s->thermal == TLSPH_ENERGY && TLSPHI_EPSILON * mechanical > 1e-2 * heat)
        return "heat is lost in the round-off of mechanical energy; use TLSPH_ENTROPY";
    return "mechanical energy changes by more than there is heat, and the step is too coarse for that; set retries";
}
/* Completes the record with the particle's state. */
static void tlsphi_add_cause(tlsph_solver *s, size_t a, const tlsphi_point *pt, const char *cause) {
    tlsph_error *e = &s->error;
    const size_t length = strlen(e->message);
    e->cause = cause;
    tlsphi_principal_data(s, a, pt, e);
    snprintf(e->message + length, sizeof e->message - length, "; probable cause: %s", cause);
}
/* Describes the particle at which the evaluation failed. */
static tlsph_result tlsphi_describe_failure(tlsph_solver *s, const tlsphi_block *block, const char *stage) {
    const size_t a = block->failed;
    const char *cause = tlsphi_cause_of_scene(s), *field = "state", *allowed = "finite";
    tlsphi_point pt;
    memset(&pt, 0, sizeof pt);
    tlsphi_constitute(s, &s->now, a, NULL, &pt);
    double value = (double)pt.kinetic;
    if (block->failure == TLSPH_ERROR_INVERSION) {
        field = pt.d > 0 ? "J" : "det F";
        value = (double)(pt.d > 0 ? pt.J : pt.d);
        allowed = "more than 0";
        if (!cause) cause = tlsphi_cause_of_inversion(s, a, &pt);
    } else if (block->failure == TLSPH_ERROR_TEMPERATURE) {
        field = "temperature";
        value = (double)pt.theta;
        allowed = "more than 0";
        if (!cause) cause = tlsphi_cause_of_cold(s, a, &pt);
    } else if (!cause) {
        tlsph_real d;
        cause = tlsphi_squeeze_before(s, a, &d) < 0.01
                    ? TLSPHI_SQUEEZED
                    : "a load, a drive or a user's material gave no finite number, or values have run away";
    }
    tlsphi_fail(&s->error, block->failure, stage, field, s->host[a], value, 0, allowed);
    tlsphi_add_cause(s, a, &pt, cause);
    return block->failure;
}
/* The stable step has collapsed: the particle that asks for the least one. */
static tlsph_result tlsphi_describe_collapse(tlsph_solver *s, double stable, double limit) {
    tlsphi_point pt, worst;
    size_t at = 0;
    double least = 2 * TLSPHI_LARGEST, heat;
    memset(&worst, 0, sizeof worst);
    for (size_t a = 0; a < s->n; a++) {
        if (tlsphi_constitute(s, &s->now, a, NULL, &pt)) continue;
        const double dt = tlsphi_particle_step(s, a, &pt, &heat);
        if (dt >= least) continue;
        least = dt;
        worst = pt;
        at = a;
    }
    tlsphi_fail(&s->error, TLSPH_ERROR_TIME_STEP, "step", "stable dt", s->host[at], stable, limit,
                "more than 1e-9 of the first step");
    const char *cause = tlsphi_cause_of_scene(s);
    double stretches[3];
    tlsphi_stretches(worst.F, stretches);
    if (!cause && stretches[2] < 0.01) cause = TLSPHI_SQUEEZED;
    tlsphi_add_cause(s, at, &worst, cause ? cause : "wave speed or conductivity has run away");
    return TLSPH_ERROR_TIME_STEP;
}

static void tlsphi_keep_state(tlsph_solver *s) {
    memcpy(s->old_memory, s->now_memory, s->state_reals * sizeof *s->now_memory);
    s->account_old = s->account;
}
/* The same without a copy, which takes a twentieth of a step: until the first stage has ended (tlsphi_before), the old state
   and the present one are the same memory. For schemes whose first stage writes all of the state. */
static void tlsphi_share_state(tlsph_solver *s) {
    s->spare = s->old;
    s->spare_memory = s->old_memory;
    s->old = s->now;
    s->old_memory = s->now_memory;
    s->account_old = s->account;
}
static void tlsphi_restore_state(tlsph_solver *s) {
    memcpy(s->now_memory, s->old_memory, s->state_reals * sizeof *s->now_memory);
    s->account = s->account_old;
    tlsphi_evaluate(s);
}

TLSPHI_DEF tlsph_real tlsph_stable_time_step(const tlsph_solver *s) {
    double dt = s->jst_step;
    for (size_t i = 0; i < s->blocks; i++) dt = tlsphi_dmin(dt, s->block[i].time_step);
    if (s->super.most) dt = tlsphi_dmin(dt, 2 * tlsphi_super_reach(s->super.most) * tlsphi_heat_step(s));
#ifdef TLSPH_REAL_FLOAT
    dt = tlsphi_dmin(dt, 3e38);
#endif
    return (tlsph_real)dt;
}

/* a, b, c | start, end | rate and after weight | z: old, next, was, is | ahead */
typedef struct tlsphi_scheme {
    int stages;
    double cfl_limit;
    tlsphi_stage stage[4];
} tlsphi_scheme;
static const tlsphi_scheme tlsphi_schemes[5] = {
    {2, 0.40, {{0, 1, 1, 0, 1, 1. / 2, 1. / 2, 1. / 2, 0, 0, 0, 0},
              {1. / 2, 1. / 2, 1. / 2, 1, 1, 1. / 2, 1, 0, 1. / 2, 0, 0, 1}}},
    {3, 0.60, {{0, 1, 1, 0, 1, 1. / 6, 1. / 6, 1. / 6, 0, -1. / 6, 0, 0},
              {3. / 4, 1. / 4, 1. / 4, 1, 1. / 2, 1. / 6, 2. / 3, 1. / 6, 0, -1. / 36, 1. / 36, 0},
              {1. / 3, 2. / 3, 2. / 3, 1. / 2, 1, 2. / 3, 1, 0, 2. / 3, 0, 0, 0}}},
    {3, 0.50, {{1, 0, 1. / 3, 0, 1. / 3, 0, 0, 0, 0, 0, 0, 0},
              {1, 0, 1. / 2, 1. / 3, 1. / 2, 0, 0, 0, 0, -1. / 2, 0, 0},
              {1, 0, 1, 1. / 2, 1, 1, 1, 0, 1, 0, 0, 0}}},
    {4, 0.50, {{1, 0, 1. / 4, 0, 1. / 4, 0, 0, 0, 0, 0, 0, 0},
              {1, 0, 1. / 3, 1. / 4, 1. / 3, 0, 0, 0, 0, 0, 0, 0},
              {1, 0, 1. / 2, 1. / 3, 1. / 2, 0, 0, 0, 0, -1. / 2, 0, 0},
              {1, 0, 1, 1. / 2, 1, 1, 1, 0, 1, 0, 0, 0}}},
    {1, 0.50, {{1, 0, 1, 1. / 2, 1, 1, 1, 1, 0, 0, 1. / 2, 0}}}};

TLSPHI_DEF tlsph_real tlsph_cfl_limit(tlsph_integrator integrator) {
    return (unsigned)integrator <= TLSPH_LEAPFROG ? (tlsph_real)tlsphi_schemes[integrator].cfl_limit : 0;
}

/* ==== [LEAPFROG] ===================================================================================================
   With v = p/rho and the mean velocity m = (v^n + v^{n+1})/2 of a step:
     drift  x, F, J, H (E) by dt/2 with grad v^n:  the state at the half, and its stress P
     kick   p^{n+1} = p^n + dt f(P, v^n), then the constraints
     drift  x, F, J, H (E) from state n by dt with grad m, and with P, F, H of the half
   One gather of forces a step instead of two, at steps 1.7 times as long. As it is made of P of the half and of m, the
   work of the stresses, V P : grad m = -T.m, and the change of the kinetic energy, m.(p^{n+1} - p^n), balance to round-off
   in E. Angular momentum changes by dt x^{n+1/2} x f exactly, so that the projection sees the positions of the half.
   Dissipation and conduction are evaluated with v^n and theta^n, first order in the step; what the dissipation takes
   from the motion is -m.T_D, so the particles get that heat. */

/* v becomes m. */
static void tlsphi_mean_velocity_block(tlsph_solver *s, tlsphi_block *block) {
    const size_t D = (size_t)s->dim;
    for (size_t a = block->begin; a < block->end; a++) {
        const tlsph_real half = 1 / (2 * tlsphi_material_of(s, a)->rho);
        tlsph_real v[3] = {0, 0, 0};
        for (size_t k = 0; k < D; k++) v[k] = half * (s->old.p[D * a + k] + s->now.p[D * a + k]);
        tlsphi_row_put(s, s->rows.v, s->dim, a, v);
        if (!s->projection) tlsphi_row_put(s, s->rows.w, s->dim, a, v);
    }
}
/* The kinetic part of E, and the heat of the dissipation as far as m differs from v^n. */
static void tlsphi_mean_work_block(tlsph_solver *s, tlsphi_block *block) {
    const size_t D = (size_t)s->dim;
    double dissipated = 0, entropy = 0;
    for (size_t a = block->begin; a < block->end; a++) {
        const tlsph_real *held = tlsphi_held(s, a), *p = s->now.p + D * a, *old = s->old.p + D * a;
        const tlsph_real *w = tlsphi_at(s, s->rows.w, a);
        tlsph_real heat = held[(D + 1) * TLSPHI_LANES];
        for (size_t k = 0; k < D; k++) heat -= w[k * TLSPHI_ROW] * held[k * TLSPHI_LANES];
        dissipated += (double)heat;
        if (!s->thermal) continue;
        const tlsph_real theta = *tlsphi_theta(s, a), density = heat / s->V[a];
        entropy += (double)(heat / theta);
        if (s->thermal == TLSPH_ENTROPY) s->rate_E[a] = s->dissipation_heats ? density / theta : 0;
        else s->rate_E[a] += density;
        for (size_t k = 0; s->thermal == TLSPH_ENERGY && k < D; k++) s->now.E[a] += tlsphi_v(s, a, k) * (p[k] - old[k]);
    }
    block->sums[TLSPHI_SUM_DISSIPATION] += dissipated;
    block->sums[TLSPHI_SUM_DISSIPATION_ENTROPY] += entropy;
}
/* u_old + C rate of all that grad v moves; `on`: with the second half of a step, J and E from their present value. */
typedef struct tlsphi_leap_move {
    tlsph_solver *s;
    const tlsphi_state *u; /* of the F in dH/dt */
    tlsph_real C;
    int on, concludes; /* no condition waits for the whole of the state */
    tlsphi_projection *projection;
} tlsphi_leap_move;

static void tlsphi_drift_task(void *arg, size_t i) {
    const tlsphi_leap_move *drift = (const tlsphi_leap_move *)arg;
    tlsph_solver *s = drift->s;
    const size_t D = (size_t)s->dim, begin = s->block[i].begin, end = s->block[i].end;
    const tlsph_real C = drift->C, on = drift->on ? TLSPHI_R(1) : 0;
    const tlsph_real C_E = s->thermal == TLSPH_ENERGY || drift->on ? C : 0;
    const tlsphi_state *u = drift->u;
    if (drift->on) tlsphi_mean_work_block(s, s->block + i);
    if (u == &s->old) memcpy(s->now.p + D * begin, u->p + D * begin, D * (end - begin) * sizeof *u->p);
    tlsphi_move(s, u->x, s->block + i, 0, C);
    tlsphi_deform(s, u, s->block + i, 0, C);
    if (s->has_J) tlsphi_combine(s->now.J, s->old.J, u->J, s->rate_J, begin, end, on, C);
    if (s->now.E) tlsphi_combine(s->now.E, s->old.E, u->E, s->rate_E, begin, end, on, C_E);
    if (s->now.plastic) tlsphi_flow_block(s, s->block + i);
    if (!drift->on || drift->concludes) tlsphi_evaluate_block(s, s->block + i);
}
static void tlsphi_kick_task(void *arg, size_t i) {
    const tlsphi_leap_move *kick = (const tlsphi_leap_move *)arg;
    tlsph_solver *s = kick->s;
    const size_t D = (size_t)s->dim, begin = s->block[i].begin, end = s->block[i].end;
    if (kick->projection->leaves) tlsphi_correct_task(kick->projection, i);
    tlsphi_combine(s->now.p, s->old.p, s->now.p, s->rate_p, D * begin, D * end, 0, kick->C);
    if (s->has_J) tlsphi_combine(s->now.J, s->old.J, s->now.J, s->rate_J, begin, end, 0, kick->C);
    if (s->now.E) tlsphi_combine(s->now.E, s->old.E, s->now.E, s->rate_E, begin, end, 0, kick->C);
    if (!kick->concludes) return;
    tlsphi_apply_fixes(s, s->now.p, begin, end);
    tlsphi_mean_velocity_block(s, s->block + i);
}
/* The work of loads has been taken with v^n: the rest of that with m. */
static void tlsphi_mean_work_of_loads(tlsph_solver *s, double dt) {
    const size_t D = (size_t)s->dim;
    for (size_t i = 0; i < s->loads; i++) {
        const tlsphi_load *load = s->load + i;
        const tlsph_condition_kind kind = load->given.kind;
        if (kind == TLSPH_WALL || tlsphi_is_thermal(kind)) continue;
        for (size_t k = 0; k < load->given.count; k++) {
            const size_t a = load->inner[k];
            const tlsph_real *rate = s->rate_p + D * a;
            tlsph_real change[3] = {0, 0, 0}, force[3] = {0, 0, 0};
            for (size_t l = 0; l < D; l++)
                change[l] = tlsphi_v(s, a, l) - s->old.p[D * a + l] / tlsphi_material_of(s, a)->rho;
            if (kind == TLSPH_VELOCITY) {
                tlsphi_driven_part(s->dim, &load->given, rate, force);
                for (size_t l = 0; l < D; l++) force[l] *= -s->V[a];
            } else tlsphi_load_force(s, load, k, force, NULL); /* not behind surfaces */
            s->account.external_work += dt * (double)tlsphi_any_dot(s->dim, force, change);
        }
    }
}
static void tlsphi_leap_gradients(tlsphi_projection *p, int damps) {
    tlsph_solver *s = p->s;
    s->damps = damps;
    if (s->projection) tlsphi_find_rigid_motion(p);
    tlsphi_run(s, tlsphi_gradient_block);
    if (s->sharp) tlsphi_run(s, tlsphi_sharpen_block);
}
/* Rates of p, and of J and E as far as they do not come from grad v. */
static void tlsphi_leap_forces(tlsphi_projection *p) {
    tlsph_solver *s = p->s;
    if (s->sharp) tlsphi_run(s, tlsphi_sharpen_block); /* the stress of the half */
    if (s->lean) tlsphi_run(s, tlsphi_laplacian_block);
    if (s->rate_J) memset(s->rate_J, 0, s->n * sizeof *s->rate_J);
    if (s->rate_E) memset(s->rate_E, 0, s->n * sizeof *s->rate_E);
    if (s->projection) tlsphi_find_moments(p);
    tlsphi_run_tasks(s, tlsphi_flux_task, p);
    if (s->projection) tlsphi_project(p);
    tlsphi_image_forces(s);
    tlsphi_apply_loads(s, &p->stage, p->dt);
}
/* Returns the first failed block or NULL. */
static const tlsphi_block *tlsphi_leap(tlsph_solver *s, const tlsphi_stage *stage, double dt) {
    tlsphi_projection projection = tlsphi_projection_of(s, stage, dt);
    tlsphi_leap_move drift;
    drift.s = s;
    drift.projection = &projection;
    drift.on = 0;
    drift.concludes = !s->constrains;
    drift.C = (tlsph_real)(dt / 2);
    tlsphi_leap_gradients(&projection, 1);
    drift.u = tlsphi_before(s);
    projection.x = s->now.x; /* those of the half from here on */
    tlsphi_run_tasks(s, tlsphi_drift_task, &drift);
    const tlsphi_block *bad = tlsphi_evaluated(s);
    if (bad) return bad;
    tlsphi_leap_forces(&projection);
    drift.C = (tlsph_real)dt;
    tlsphi_run_tasks(s, tlsphi_kick_task, &drift);
    if (s->constrains) tlsphi_constrain(s, stage, dt);
    if (s->constrains) tlsphi_run(s, tlsphi_mean_velocity_block);
    tlsphi_mean_work_of_loads(s, dt);
    tlsphi_leap_gradients(&projection, 0);
    drift.on = 1;
    drift.u = &s->now;
    tlsphi_run_tasks(s, tlsphi_drift_task, &drift);
    tlsphi_collect_sums(s, dt);
    if (!s->constrains) return tlsphi_evaluated(s);
    tlsphi_hold_temperatures(s, stage, dt);
    return tlsphi_evaluate(s);
}

/* ==== [MULTI-RATE] =================================================================================================
   Where stiff or fine parts set the step, `desc.rates` lets them take it alone. A particle of level l moves its F by
   steps of dt/2^l, with kicks in their middle: its stress pushes it and its neighbours at once, so that each impulse is
   without resultant, and without torque but for what the projection takes away. In between momenta are constant, and
   one who is asked seldom sees the way that its neighbours have gone meanwhile:
     F(t) = F(t') + grad (x(t) - x(t')),   H and J by the differences of cof F and det F.
   The passes S_l(dt) = S_{l+1}(dt/2) K_l(dt) S_{l+1}(dt/2) are symmetric in time, as are asynchronous variational
   integrators (Lew, Marsden, Ortiz and West, Int. J. Numer. Meth. Engrg. 60 (2004) 153) and the impulse method of
   molecular dynamics. The dissipation of a pair goes with the finer of the two. A pass takes its level and, for the
   forces, those with neighbours in it; levels, and of them the particles beside others, have blocks of their own.
   Levels are chosen at creation, from each particle's stable step and so that a second costs least; what stiffens later
   shortens the whole step. Where all have the same level, this is the plain leapfrog, bitwise.
   What it gives up: errors are those of the whole step, of second order and by the dissipation of first; dissipation
   between parts reconstructs with slopes up to a step old. Momenta are exact, the energy balance is of second order
   (TLSPH_ENERGY, which promises more, is refused). Slow parts push once per whole step, so that waves in the fast ones
   with periods near twice that might resonate; ratios of speeds from 1.7 to 12 did not, on noise, to the CFL limit. */

/* Runs fn for blocks of the pass's level: its own, those with neighbours in it, or both. */
enum { TLSPHI_OWN, TLSPHI_TOUCHED, TLSPHI_ALL };
typedef struct tlsphi_pass {
    tlsph_solver *s;
    const uint32_t *list;
    tlsphi_block_fn fn;
} tlsphi_pass;
static void tlsphi_pass_task(void *arg, size_t i) {
    const tlsphi_pass *pass = (const tlsphi_pass *)arg;
    pass->fn(pass->s, pass->s->block + pass->list[i]);
}
static void tlsphi_run_level(tlsph_solver *s, tlsphi_block_fn fn, int which) {
    const size_t *first = s->rates.first + 2 * s->rates.level;
    const size_t begin = first[which == TLSPHI_TOUCHED], end = first[which == TLSPHI_OWN ? 1 : 2];
    tlsphi_pass pass;
    pass.s = s;
    pass.list = s->rates.list + begin;
    pass.fn = fn;
    tlsphi_parallel(s->run, s->run_user, s->threads, tlsphi_pass_task, &pass, end - begin);
}
/* Where the pass sees a particle; linear elasticity takes moments about X. */
static void tlsphi_pass_position(const tlsph_solver *s, size_t a, double x[3]) {
    tlsph_real X[3];
    tlsphi_row_get(s, s->rows.X, s->dim, a, X);
    tlsphi_vector3(s->linear ? X : s->now.x + (size_t)s->dim * a, s->dim, x);
}
/* Moves x to the time of the pass. The rows of v become mean velocities since the level was moved last, those of w the
   same without the rigid motion that the body had when the step began, seen from the middle of that time. */
static void tlsphi_view_block(tlsph_solver *s, tlsphi_block *block) {
    const size_t D = (size_t)s->dim;
    const tlsphi_rates *rates = &s->rates;
    const tlsphi_body *body = s->body + block->body;
    const tlsph_real dt = (tlsph_real)(rates->time - block->reached), per = 1 / rates->elapsed;
    const double middle = rates->time - (double)rates->elapsed / 2;
    tlsph_real *was = rates->was + (size_t)rates->level * D * s->n, v[3];
    for (size_t a = block->begin; a < block->end; a++) {
        const tlsph_real move = dt / tlsphi_material_of(s, a)->rho;
        double arm[3] = {0, 0, 0}, turn[3];
        for (size_t k = 0, at = D * a; k < D; k++, at++) {
            s->now.x[at] += move * s->now.p[at];
            v[k] = (s->now.x[at] - was[at]) * per;
            was[at] = s->now.x[at];
        }
        tlsphi_row_put(s, s->rows.v, s->dim, a, v);
        tlsphi_pass_position(s, a, arm);
        for (size_t k = 0; k < D; k++)
            arm[k] -= s->linear ? body->from[k]
                                : body->from[k] + middle * body->v_mean[k] + (rates->time - middle) * (double)v[k];
        tlsphi_cross3(body->spin, arm, turn);
        for (size_t k = 0; s->projection && k < D; k++) v[k] -= (tlsph_real)(body->v_mean[k] + turn[k]);
        tlsphi_row_put(s, s->rows.w, s->dim, a, v);
        if (s->rate_J) s->rate_J[a] = 0;
    }
    block->reached = rates->time;
}
/* F, H and J by grad v; H and J with F of the middle, which is exact but for det(change) in J. */
static void tlsphi_deform_block(tlsph_solver *s, tlsphi_block *block) {
    const size_t D = (size_t)s->dim, dd = D * D;
    const tlsph_real dt = s->rates.elapsed;
    for (size_t a = block->begin; a < block->end; a++) {
        tlsph_real G[9], old[9], rate[9], H[9], in_plane[9];
        tlsphi_tensor_get(s->rate_F, (int)dd, a, G);
        for (size_t j = 0; s->turns && j < D; j++) { /* G has spin x F in it: make it that of the middle */
            double column[3] = {0, 0, 0}, turn[3];
            for (size_t i = 0; i < D; i++) column[i] = (double)G[D * i + j];
            tlsphi_cross3(s->body[block->body].spin, column, turn);
            for (size_t i = 0; i < D; i++) G[D * i + j] += dt / 2 * (tlsph_real)turn[i];
        }
        tlsphi_tensor_expand(s->now.F, s->dim, a, 1, old);
        tlsphi_expand(s->dim, G, 0, rate);
        if (s->has_J) {
            tlsphi_cross_inline(old, rate, H);
            const int linear = tlsphi_material_of(s, a)->kind == TLSPH_LINEAR;
            s->now.J[a] += dt * (s->rate_J[a] + (linear ? 0 : dt / 2 * tlsphi_dot(9, H, rate)));
            s->rate_J[a] = 0;
        }
        if (s->has_H) {
            for (int i = 0; i < 9; i++) old[i] += dt / 2 * rate[i];
            tlsphi_cross_inline(old, rate, H);
            tlsphi_shrink(s->dim, H, in_plane);
            for (size_t i = 0; i < dd; i++) s->now.H[tlsphi_tensor_at(dd, a) + i * TLSPHI_LANES] += dt * in_plane[i];
        }
        for (size_t i = 0; i < dd; i++) s->now.F[tlsphi_tensor_at(dd, a) + i * TLSPHI_LANES] += dt * G[i];
    }
}
/* A pass sees no stresses but those of its own level: they act once and go. */
static void tlsphi_hide_stress(tlsph_solver *s, tlsphi_block *block) {
    for (int i = 0; i < s->dim * s->dim; i++)
        memset(tlsphi_at(s, s->rows.P + i, block->begin), 0, (block->end - block->begin) * sizeof *s->row);
}
/* Resultant and torque of the pass's rates. */
static void tlsphi_torque_block(tlsph_solver *s, tlsphi_block *block) {
    double x[3], T[3], torque[3];
    memset(block->moments, 0, sizeof block->moments);
    for (size_t a = block->begin; a < block->end; a++) {
        tlsphi_pass_position(s, a, x);
        tlsphi_vector3(s->rate_p + (size_t)s->dim * a, s->dim, T);
        tlsphi_cross3(x, T, torque);
        for (int k = 0; k < 3; k++) block->moments[k] += (double)s->V[a] * T[k];
        for (int k = 0; k < 3; k++) block->moments[3 + k] += (double)s->V[a] * torque[k];
    }
}
/* p and J by the rates of the pass; what the dissipation took, at the mean of v before and after. */
static void tlsphi_push_block(tlsph_solver *s, tlsphi_block *block) {
    const size_t D = (size_t)s->dim;
    const tlsph_real dt = (tlsph_real)s->rates.step;
    for (size_t a = block->begin; a < block->end; a++) {
        const tlsph_real *held = tlsphi_held(s, a), *rate = s->rate_p + D * a;
        const tlsph_real per_rho = 1 / tlsphi_material_of(s, a)->rho;
        tlsph_real heat = held[(D + 1) * TLSPHI_LANES], *p = s->now.p + D * a;
        for (size_t k = 0; k < D; k++) {
            heat -= (p[k] + dt / 2 * rate[k]) * per_rho * held[k * TLSPHI_LANES];
            p[k] += dt * rate[k];
        }
        if (s->rate_J) s->now.J[a] += dt * s->rate_J[a];
        block->sums[TLSPHI_SUM_DISSIPATION] += (double)heat;
    }
    tlsphi_hide_stress(s, block);
}
/* A load on a particle of the level: into the rates, or, `done`, its work at the mean of v before and after. */
static void tlsphi_load_particle(tlsph_solver *s, const tlsphi_load *load, size_t i, int done) {
    const size_t D = (size_t)s->dim, a = load->inner[i];
    const double dt = s->rates.step;
    const tlsph_real *p = s->now.p + D * a, half = (tlsph_real)(dt / 2), per_rho = 1 / tlsphi_material_of(s, a)->rho;
    tlsph_real force[3] = {0, 0, 0}, *rate = s->rate_p + D * a;
    double x[3], f[3], turn[3];
    tlsphi_load_force(s, load, i, force, NULL); /* not behind surfaces */
    for (size_t k = 0; k < D; k++) {
        if (done) s->account.external_work += dt * (double)(force[k] * (p[k] - half * rate[k]) * per_rho);
        else rate[k] += force[k] / s->V[a];
    }
    if (!done) return;
    tlsphi_pass_position(s, a, x);
    tlsphi_vector3(force, s->dim, f);
    tlsphi_cross3(x, f, turn);
    for (int k = 0; k < 3; k++) s->account.impulse[k] += dt * f[k];
    for (int k = 0; k < 3; k++) s->account.angular_impulse[k] += dt * turn[k];
}
static void tlsphi_load_level(tlsph_solver *s, int done) {
    for (size_t i = 0; i < s->loads; i++) {
        tlsphi_load *load = s->load + i;
        if (load->given.values && !done) tlsphi_load_values(s, load, s->time + s->rates.time);
        for (size_t k = 0; k < load->given.count; k++)
            if (s->rates.of[load->inner[k]] == s->rates.level) tlsphi_load_particle(s, load, k, done);
    }
}
/* Moves F, H, J of a level to `time`, since the beginning of the step. */
static void tlsphi_move_level(tlsph_solver *s, int level, double time) {
    tlsphi_rates *rates = &s->rates;
    rates->level = level;
    rates->time = time;
    rates->elapsed = (tlsph_real)(time - rates->last[level]);
    rates->last[level] = time;
    tlsphi_run_level(s, tlsphi_view_block, TLSPHI_ALL);
    tlsphi_run_level(s, tlsphi_gradient_block, TLSPHI_OWN);
    tlsphi_run_level(s, tlsphi_deform_block, TLSPHI_OWN);
}
/* One pass: the impulse of a level's stresses over `step`. Returns the first failed block or NULL. */
static const tlsphi_block *tlsphi_push_level(tlsph_solver *s, int level, double time, double step) {
    tlsphi_rates *rates = &s->rates;
    const size_t *first = rates->first + 2 * level;
    if (first[0] == first[1]) return NULL;
    tlsphi_move_level(s, level, time);
    tlsphi_run_level(s, tlsphi_evaluate_block, TLSPHI_OWN);
    for (size_t i = first[0]; i < first[1]; i++)
        if (s->block[rates->list[i]].failed != TLSPHI_NONE) return s->block + rates->list[i];
    rates->step = step;
    tlsphi_run_level(s, tlsphi_flux_block, TLSPHI_ALL);
    tlsphi_run_level(s, tlsphi_torque_block, TLSPHI_ALL);
    tlsphi_load_level(s, 0);
    tlsphi_apply_fixes(s, s->rate_p, 0, s->n);
    tlsphi_run_level(s, tlsphi_push_block, TLSPHI_ALL);
    tlsphi_load_level(s, 1);
    for (size_t i = first[0]; i < first[2]; i++) {
        const tlsphi_block *block = s->block + rates->list[i];
        for (int k = 0; k < 6; k++) s->body[block->body].owed[k] += step * block->moments[k];
        s->account.dissipation += step * block->sums[TLSPHI_SUM_DISSIPATION];
    }
    return NULL;
}
/* Takes what resultant and torque the passes have left, by the smallest change of the motion at the end ([PROJECTION]).
   Its work is the dissipation's, which was booked with v and not with w. */
static void tlsphi_settle_rates(tlsphi_projection *p) {
    tlsph_solver *s = p->s;
    const size_t D = (size_t)s->dim;
    memset(s->rate_p, 0, D * s->n * sizeof *s->rate_p);
    tlsphi_find_moments(p);
    for (size_t i = 0; i < s->bodies; i++) {
        tlsphi_body *body = s->body + i;
        double m[TLSPHI_MOMENTS] = {0}, origin[3], shift[3];
        tlsphi_pass_position(s, body->first, origin);
        tlsphi_cross3(origin, body->owed, shift);
        for (int k = 0; k < 3; k++) m[k] = body->owed[k];
        for (int k = 0; k < 3; k++) m[3 + k] = body->owed[3 + k] - shift[k];
        tlsphi_multipliers(body, m);
        tlsphi_keep_middle(p, body);
    }
    tlsphi_run_tasks(s, tlsphi_correct_task, p);
    tlsphi_apply_fixes(s, s->rate_p, 0, s->n);
    for (size_t i = 0; i < D * s->n; i++) {
        const tlsph_real change = s->rate_p[i], mean = s->now.p[i] + change / 2;
        s->account.dissipation -= (double)(s->V[i / D] / tlsphi_material_of(s, i / D)->rho * change * mean);
        s->now.p[i] += change;
    }
}
static void tlsphi_begin_rates(tlsphi_projection *p) {
    tlsph_solver *s = p->s;
    tlsphi_rates *rates = &s->rates;
    const size_t reals = (size_t)s->dim * s->n;
    s->damps = 1;
    if (s->projection) tlsphi_find_rigid_motion(p);
    for (size_t i = 0; i < s->bodies; i++) {
        tlsphi_body *body = s->body + i;
        memset(body->owed, 0, sizeof body->owed);
        tlsphi_pass_position(s, body->first, body->from);
        for (int k = 0; k < 3; k++) body->from[k] += body->centre[k];
    }
    for (int l = 0; l < rates->levels; l++) {
        memcpy(rates->was + (size_t)l * reals, s->now.x, reals * sizeof *rates->was);
        rates->last[l] = 0;
        rates->level = l;
        tlsphi_run_level(s, tlsphi_gradient_block, TLSPHI_TOUCHED); /* slopes for the dissipation beside other levels */
    }
    for (size_t i = 0; i < s->blocks; i++) s->block[i].reached = 0;
    for (size_t i = 0; i < s->loads; i++)
        if (!s->load[i].given.values) tlsphi_load_values(s, s->load + i, s->time);
    tlsphi_run(s, tlsphi_hide_stress);
}
/* Returns the first failed block or NULL. */
static const tlsphi_block *tlsphi_leap_by_rates(tlsph_solver *s, const tlsphi_stage *stage, double dt) {
    const int finest = s->rates.levels - 1, steps = 1 << finest;
    const double least = dt / steps;
    tlsphi_projection projection = tlsphi_projection_of(s, stage, dt);
    tlsphi_begin_rates(&projection);
    for (int i = 1; i <= steps; i++) {
        const tlsphi_block *bad = tlsphi_push_level(s, finest, (i - 0.5) * least, least);
        int level = finest - 1; /* that whose step has its middle here */
        for (int k = i; k % 2 == 0; k /= 2) level--;
        if (!bad && level >= 0) bad = tlsphi_push_level(s, level, i * least, least * (1 << (finest - level)));
        if (bad) return bad;
    }
    for (int l = 0; l <= finest; l++) tlsphi_move_level(s, l, dt);
    if (s->projection) tlsphi_settle_rates(&projection);
    return tlsphi_evaluate(s);
}

/* ==== [ALGORITHM] ==================================================================================================
   Algorithm 1 on a page: from state n to n + 1, with retries and the choice of the step. */

/* Algorithm 1, from state n to n + 1. */
static tlsph_result tlsphi_give_up(tlsph_solver *s, const tlsphi_block *bad, int split) {
    const tlsph_result result = tlsphi_describe_failure(s, bad, "step");
    if (split) memcpy(s->old.E, s->super.E, s->n * sizeof *s->old.E);
    s->heat_moves = s->conducts;
    tlsphi_restore_state(s);
    return result;
}
static tlsph_result tlsphi_describe_shrinking(tlsph_solver *s, size_t a, double share, int split) {
    tlsphi_point pt;
    tlsphi_constitute(s, &s->now, a, NULL, &pt);
    tlsphi_fail(&s->error, TLSPH_ERROR_TIME_STEP, "step", "share of volume lost", s->host[a], share, (double)s->limit,
                "desc.limit in a step");
    tlsphi_add_cause(s, a, &pt, "a motion too fast for the step; allow more retries");
    if (split) memcpy(s->old.E, s->super.E, s->n * sizeof *s->old.E);
    tlsphi_restore_state(s);
    return TLSPH_ERROR_TIME_STEP;
}
/* A particle that has lost more of its volume in this step than the scene allows, or n. */
static size_t tlsphi_shrunk(const tlsph_solver *s, double *share) {
    for (size_t a = 0; s->limit > 0 && a < s->n; a++) {
        tlsphi_point is, was;
        tlsphi_load_measures(s, &s->now, tlsphi_material_of(s, a), a, &is);
        tlsphi_load_measures(s, &s->old, tlsphi_material_of(s, a), a, &was);
        *share = 1 - (double)(is.d / was.d);
        if (*share > (double)s->limit) return a;
    }
    return s->n;
}
static tlsph_result tlsphi_step_by(tlsph_solver *s, double dt) {
    const tlsphi_scheme *scheme = tlsphi_schemes + s->integrator;
    const int split = s->super.most && dt > tlsphi_heat_step(s);
    if (split || s->rates.levels > 1 || s->incompressible || s->now.plastic) tlsphi_keep_state(s); /* (1) u_old, x_old */
    else tlsphi_share_state(s);
    if (split) {
        const tlsphi_block *bad = tlsphi_conduct(s, s->time, dt / 2);
        memcpy(s->super.E, s->old.E, s->n * sizeof *s->old.E);
        memcpy(s->old.E, s->now.E, s->n * sizeof *s->old.E);
        if (bad) return tlsphi_give_up(s, bad, 1);
        s->heat_moves = 0;
    }
    for (int k = 0; k < scheme->stages; k++) {
        const tlsphi_stage *stage = scheme->stage + k;
        if (s->leaps) {
            const tlsphi_block *bad =
                s->rates.levels > 1 ? tlsphi_leap_by_rates(s, stage, dt) : tlsphi_leap(s, stage, dt);
            if (bad) return tlsphi_give_up(s, bad, split);
            continue;
        }
        s->damps = k == 0 || !s->frozen;
        tlsphi_projection projection = tlsphi_projection_of(s, stage, dt);
        const int at_once = !s->constrains && !s->incompressible;
        tlsphi_right_hand_side(&projection);          /* (4) rates, (5) projection            */
        tlsphi_evolve(&projection, at_once);          /* (6) u = a u_old + b u + c dt L       */
        if (!at_once) tlsphi_impose(s, stage, dt);    /* (7) constraints                      */
        if (s->incompressible && tlsphi_pressure_solve(s, stage, k, dt)) {
            tlsphi_restore_state(s);
            return s->error.result;
        }
        /* (8) stress, (9) temperature */
        const tlsphi_block *bad = at_once ? tlsphi_evaluated(s) : tlsphi_evaluate(s);
        if (bad) return tlsphi_give_up(s, bad, split);
    }
    s->heat_moves = s->conducts;
    if (split) {
        const tlsphi_block *bad = tlsphi_conduct(s, s->time + dt / 2, dt / 2);
        if (bad) return tlsphi_give_up(s, bad, 1);
    }
    double share = 0;
    const size_t shrunk = tlsphi_shrunk(s, &share);
    if (shrunk < s->n) return tlsphi_describe_shrinking(s, shrunk, share, split);
    s->step++;
    s->last_dt = dt;
    return TLSPH_OK;
}

/* The stable step, or less after a retry (desc.limit). */
static double tlsphi_allowed_step(const tlsph_solver *s) {
    const double stable = (double)tlsph_stable_time_step(s), limit = s->account.limit_step;
    return limit > 0 && limit < stable ? limit : stable;
}
/* After a step of size dt: where it was halved, the next ones start from it and grow by a sixteenth each. */
static void tlsphi_limit_next(tlsph_solver *s, int retried, double dt) {
    tlsphi_account *account = &s->account;
    if (!(s->limit > 0)) return;
    account->limits += account->limit_step > 0;
    if (retried) account->limit_step = dt;
    else account->limit_step *= 1.0625;
    if (account->limit_step >= (double)tlsph_stable_time_step(s)) account->limit_step = 0;
}
/* A step that fails is taken again, half as long, as often as the scene allows. Then it fails as it did. */
static tlsph_result tlsphi_step_or_retry(tlsph_solver *s, double *dt) {
    const double before = s->account.retries, asked = *dt;
    tlsph_result result = tlsphi_step_by(s, *dt);
    for (int i = 0; result && i < s->retries; i++) {
        *dt /= 2;
        s->account.retries++;
        result = tlsphi_step_by(s, *dt);
    }
    if (result) s->account.retries = before;
    else tlsphi_limit_next(s, *dt < asked, *dt);
    return result;
}
TLSPHI_DEF tlsph_result tlsph_step(tlsph_solver *s, tlsph_real dt_limit) {
    const double stable = (double)tlsph_stable_time_step(s), allowed = tlsphi_allowed_step(s); /* (2), (3) */
    double dt = (double)dt_limit < allowed ? (double)dt_limit : allowed;
    if (tlsphi_nan(dt_limit) || !tlsphi_finite((tlsph_real)dt) || !(dt > 0) || !(dt < 1e290))
        return tlsphi_fail(&s->error, TLSPH_ERROR_TIME_STEP, "step", "dt", TLSPH_NO_PARTICLE, (double)dt_limit, 0,
                           "more than 0; infinite only with a finite wave speed");
    if (s->first_dt > 0 && stable < 1e-9 * s->first_dt) return tlsphi_describe_collapse(s, stable, 1e-9 * s->first_dt);
    const tlsph_result result = tlsphi_step_or_retry(s, &dt);
    if (!result) s->time += dt;
    if (!result && !(s->first_dt > 0)) s->first_dt = stable;
    return result;
}
TLSPHI_DEF tlsph_result tlsph_advance(tlsph_solver *s, tlsph_real time) {
    const double end = (double)time;
    if (!tlsphi_finite(time))
        return tlsphi_fail(&s->error, TLSPH_ERROR_ARGUMENT, "advance", "time", TLSPH_NO_PARTICLE, end, 0, "finite");
    while (s->time < end) {
        const double left = end - s->time, stable = tlsphi_allowed_step(s);
        /* two equal steps instead of a full one and a sliver */
        const double dt = left <= stable ? left : left < 2 * stable ? left / 2 : stable;
        const tlsph_result result = tlsph_step(s, (tlsph_real)dt);
        if (result) return result;
        const int whole = s->last_dt > 0.75 * dt; /* and not halved by a retry */
        if ((left <= stable && whole) || s->time > end) s->time = end;
    }
    return TLSPH_OK;
}
TLSPHI_DEF tlsph_real tlsph_time(const tlsph_solver *s) { return (tlsph_real)s->time; }
TLSPHI_DEF uint64_t tlsph_step_count(const tlsph_solver *s) { return s->step; }
TLSPHI_DEF const tlsph_error *tlsph_last_error(const tlsph_solver *s) { return &s->error; }
TLSPHI_DEF size_t tlsph_count(const tlsph_solver *s) { return s->n; }
TLSPHI_DEF size_t tlsph_body_count(const tlsph_solver *s) { return s->bodies; }
TLSPHI_DEF void tlsph_size_read(const tlsph_solver *s, tlsph_size *size) { *size = s->size; }
TLSPHI_DEF void tlsph_closure_read(const tlsph_solver *s, tlsph_closure *closure) { *closure = s->closure; }

/* ==== [LEDGER] ===================================================================================================== */

static void tlsphi_ledger_particle(const tlsph_solver *s, size_t a, tlsph_ledger *out) {
    const size_t D = (size_t)s->dim;
    const tlsphi_material *m = tlsphi_material_of(s, a);
    const double V = (double)s->V[a];
    double x[3] = {0, 0, 0}, p[3] = {0, 0, 0}, arm[3] = {0, 0, 0}, xp[3];
    tlsphi_point pt;
    tlsphi_constitute_again(s, a, &pt);
    for (size_t i = 0; i < D; i++) {
        x[i] = (double)s->now.x[D * a + i];
        p[i] = V * (double)s->now.p[D * a + i];
        arm[i] = s->linear ? (double)tlsphi_X(s, a, i) : x[i];
    }
    tlsphi_cross3(arm, p, xp);
    out->mass += V * (double)m->rho;
    for (int i = 0; i < 3; i++) {
        out->linear_momentum[i] += p[i];
        out->angular_momentum[i] += xp[i];
        out->centre[i] += V * (double)m->rho * x[i];
    }
    out->kinetic_energy += V * (double)pt.kinetic;
    out->plastic_work += V * (double)tlsphi_plastic_work(m, pt.plastic.strain);
    out->plastic_entropy += V * (double)pt.plastic.entropy;
    if (s->thermal) {
        const double theta = (double)pt.theta, theta_R = (double)m->theta_R, c_v = (double)m->c_v;
        const double eta = (double)pt.r.entropy + c_v * log(theta / theta_R);
        out->strain_energy += V * (double)pt.r.energy;
        out->thermal_energy += V * c_v * (theta - theta_R);
        out->entropy += V * eta;
        out->ballistic_energy -= V * theta_R * eta;
    } else {
        out->strain_energy += V * ((double)pt.r.energy - (double)m->theta_R * (double)pt.r.entropy);
    }
    out->drift_largest = tlsphi_dmax(out->drift_largest, fabs((double)(pt.J / pt.d) - 1));
    out->jacobian_least = tlsphi_dmin(out->jacobian_least, (double)tlsphi_min(pt.J, pt.d));
    out->temperature_least = tlsphi_dmin(out->temperature_least, (double)pt.theta);
    out->temperature_largest = tlsphi_dmax(out->temperature_largest, (double)pt.theta);
}
static void tlsphi_ledger_accounts(const tlsph_solver *s, tlsph_ledger *out) {
    const tlsphi_account *c = &s->account;
    out->dissipation = c->dissipation;
    out->dissipation_entropy = c->dissipation_entropy;
    out->conduction_entropy = c->conduction_entropy;
    out->external_work = c->external_work;
    out->external_heat = c->external_heat;
    out->external_entropy = c->external_entropy;
    out->projection_work = c->projection_work;
    out->contact_loss = c->contact_loss;
    out->retries = (uint64_t)c->retries;
    out->limits = (uint64_t)c->limits;
    out->least_pair_production = c->least_pair_production < TLSPHI_LARGEST ? c->least_pair_production : 0;
    for (int i = 0; i < 3; i++) {
        out->impulse[i] = c->impulse[i];
        out->angular_impulse[i] = c->angular_impulse[i];
        out->linear_residual[i] = out->linear_momentum[i] - c->initial_momentum[i] - c->impulse[i];
        out->angular_residual[i] = out->angular_momentum[i] - c->initial_angular[i] - c->angular_impulse[i];
    }
    const int keeps_heat = s->thermal == TLSPH_ENERGY || (s->thermal == TLSPH_ENTROPY && s->dissipation_heats);
    out->energy_residual = out->total_energy - c->initial_energy - c->external_work - c->external_heat +
                           (keeps_heat ? 0 : c->dissipation) + (s->thermal == TLSPH_ENERGY ? 0 : c->contact_loss) +
                           (s->thermal ? 0 : out->plastic_work - c->initial_plastic_work);
    out->entropy_residual = out->entropy - c->initial_entropy - c->conduction_entropy - c->external_entropy -
                            (keeps_heat ? c->dissipation_entropy : 0) -
                            (out->plastic_entropy - c->initial_plastic_entropy);
}
TLSPHI_DEF void tlsph_ledger_read(const tlsph_solver *s, tlsph_ledger *out) {
    memset(out, 0, sizeof *out);
    out->jacobian_least = out->temperature_least = TLSPHI_LARGEST;
    for (size_t a = 0; a < s->n; a++) tlsphi_ledger_particle(s, a, out);
    for (int i = 0; i < 3; i++) out->centre[i] /= out->mass;
    out->time = s->time;
    out->step = s->step;
    out->time_step = s->last_dt;
    out->total_energy = out->kinetic_energy + out->strain_energy + out->thermal_energy;
    out->ballistic_energy += out->total_energy;
    tlsphi_ledger_accounts(s, out);
}
TLSPHI_DEF void tlsph_ledger_reset(tlsph_solver *s) {
    tlsph_ledger now;
    memset(&s->account, 0, sizeof s->account);
    tlsph_ledger_read(s, &now);
    s->account.initial_energy = now.total_energy;
    s->account.initial_entropy = now.entropy;
    s->account.initial_plastic_work = now.plastic_work;
    s->account.initial_plastic_entropy = now.plastic_entropy;
    s->account.least_pair_production = TLSPHI_LARGEST;
    for (int i = 0; i < 3; i++) {
        s->account.initial_momentum[i] = now.linear_momentum[i];
        s->account.initial_angular[i] = now.angular_momentum[i];
    }
}

/* ==== [FIELDS] ===================================================================================================== */

TLSPHI_DEF const char *tlsph_field_name(tlsph_field field) {
    switch (field) {
#define TLSPHI_FIELD(id, name, unit, components, writable)                                                             \
    case id: return name;
        TLSPH_FIELDS(TLSPHI_FIELD)
#undef TLSPHI_FIELD
    default: return "";
    }
}
TLSPHI_DEF const char *tlsph_field_unit(tlsph_field field) {
    switch (field) {
#define TLSPHI_FIELD(id, name, unit, components, writable)                                                             \
    case id: return unit;
        TLSPH_FIELDS(TLSPHI_FIELD)
#undef TLSPHI_FIELD
    default: return "";
    }
}
TLSPHI_DEF int tlsph_field_components(tlsph_field field) {
    switch (field) {
#define TLSPHI_FIELD(id, name, unit, components, writable)                                                             \
    case id: return components;
        TLSPH_FIELDS(TLSPHI_FIELD)
#undef TLSPHI_FIELD
    default: return 0;
    }
}
static int tlsphi_field_writable(tlsph_field field) {
    switch (field) {
#define TLSPHI_FIELD(id, name, unit, components, writable)                                                             \
    case id: return writable;
        TLSPH_FIELDS(TLSPHI_FIELD)
#undef TLSPHI_FIELD
    default: return 0;
    }
}

/* A vector of the solver's dimension as three components. */
static void tlsphi_out_vector(int dim, const tlsph_real *v, tlsph_real scale, tlsph_real *out) {
    out[2] = 0;
    for (int i = 0; i < dim; i++) out[i] = v[i] * scale;
}

static const tlsphi_body *tlsphi_body_of(const tlsph_solver *s, size_t a) {
    size_t i = s->bodies - 1;
    while (s->body[i].first > a) i--;
    return s->body + i;
}
/* Fields that are stored. Returns 0 if `field` is none of them. */
static int tlsphi_read_stored(const tlsph_solver *s, size_t a, tlsph_field field, tlsph_real *out) {
    const int dim = s->dim;
    const size_t D = (size_t)dim;
    const tlsph_real rho = tlsphi_material_of(s, a)->rho;
    tlsph_real G[9];
    switch (field) {
    case TLSPH_FIELD_REFERENCE_POSITION:
        tlsphi_row_get(s, s->rows.X, dim, a, G);
        tlsphi_out_vector(dim, G, 1, out);
        return 1;
    case TLSPH_FIELD_POSITION: tlsphi_out_vector(dim, s->now.x + D * a, 1, out); return 1;
    case TLSPH_FIELD_DISPLACEMENT:
        tlsphi_out_vector(dim, s->now.x + D * a, 1, out);
        for (size_t i = 0; i < D; i++) out[i] -= tlsphi_X(s, a, i);
        return 1;
    case TLSPH_FIELD_VELOCITY: tlsphi_out_vector(dim, s->now.p + D * a, 1 / rho, out); return 1;
    case TLSPH_FIELD_MOMENTUM: tlsphi_out_vector(dim, s->now.p + D * a, 1, out); return 1;
    case TLSPH_FIELD_BOUNDARY_AREA: tlsphi_out_vector(dim, tlsphi_boundary(s, a), 1, out); return 1;
    case TLSPH_FIELD_F: tlsphi_tensor_expand(s->now.F, dim, a, 1, out); return 1;
    case TLSPH_FIELD_VELOCITY_GRADIENT:
        tlsphi_velocity_gradient(s, tlsphi_body_of(s, a), a, G);
        tlsphi_expand(dim, G, 0, out);
        return 1;
    case TLSPH_FIELD_VOLUME: *out = s->V[a]; return 1;
    case TLSPH_FIELD_MASS: *out = s->V[a] * rho; return 1;
    case TLSPH_FIELD_NEIGHBOURS: *out = (tlsph_real)s->found[a]; return 1;
    default: return 0;
    }
}
static tlsph_real tlsphi_von_mises(const tlsphi_point *pt, tlsph_real volume) {
    tlsph_real sigma[9], square = 0;
    tlsphi_product_transposed(3, pt->P, pt->F, sigma);
    const tlsph_real mean = (sigma[0] + sigma[4] + sigma[8]) / 3;
    for (int i = 0; i < 9; i++) {
        const tlsph_real deviator = (sigma[i] - (i % 4 ? 0 : mean)) / volume;
        square += deviator * deviator;
    }
    return tlsphi_sqrt(TLSPHI_R(1.5) * square);
}
/* Fields that follow from the state. */
static void tlsphi_read_derived(const tlsph_solver *s, size_t a, tlsph_field field, tlsph_real *out) {
    const tlsphi_material *m = tlsphi_material_of(s, a);
    tlsphi_point pt;
    tlsphi_constitute_again(s, a, &pt);
    const tlsph_real weight = m->entropic ? pt.theta / m->theta_R : 1, volume = m->kind == TLSPH_LINEAR ? 1 : pt.J;
    const tlsph_real internal = pt.r.energy + (s->thermal ? m->c_v * (pt.theta - m->theta_R) : 0);
    const tlsph_real entropy = pt.r.entropy + (s->thermal ? m->c_v * tlsphi_log(pt.theta / m->theta_R) : 0);
    switch (field) {
    case TLSPH_FIELD_H: memcpy(out, pt.H, sizeof pt.H); break;
    case TLSPH_FIELD_J: *out = pt.J; break;
    case TLSPH_FIELD_DRIFT: *out = pt.J / pt.d - 1; break;
    case TLSPH_FIELD_TEMPERATURE: *out = pt.theta; break;
    case TLSPH_FIELD_ENERGY: *out = pt.kinetic + internal; break;
    case TLSPH_FIELD_ENTROPY: *out = entropy; break;
    case TLSPH_FIELD_STRESS: memcpy(out, pt.P, sizeof pt.P); break;
    case TLSPH_FIELD_PRESSURE: *out = tlsphi_dot(9, pt.P, pt.F) / (3 * volume); break;
    case TLSPH_FIELD_VON_MISES: *out = tlsphi_von_mises(&pt, volume); break;
    case TLSPH_FIELD_PLASTIC_STRAIN: *out = pt.plastic.strain; break;
    case TLSPH_FIELD_SIGMA_F:
        for (int i = 0; i < 9; i++)
            out[i] = tlsphi_has_invariants(m->kind) ? weight * pt.dev.a * pt.F[i]
                                                    : pt.r.e_F[i] - pt.theta * pt.r.eta_F[i];
        break;
    case TLSPH_FIELD_SIGMA_H:
        for (int i = 0; i < 9; i++) out[i] = weight * pt.dev.b * pt.H[i];
        break;
    case TLSPH_FIELD_SIGMA_J: *out = pt.Sigma_J; break;
    case TLSPH_FIELD_INTERNAL_ENERGY: *out = internal; break;
    case TLSPH_FIELD_HELMHOLTZ_ENERGY: *out = internal - pt.theta * entropy; break;
    case TLSPH_FIELD_P_WAVE_SPEED: *out = pt.c_p; break;
    case TLSPH_FIELD_S_WAVE_SPEED: *out = pt.c_s; break;
    default: break;
    }
}
static int tlsphi_field_exists(const tlsph_solver *s, tlsph_field field) {
    if ((unsigned)field >= (unsigned)TLSPH_FIELD_COUNT) return 0;
    if (field == TLSPH_FIELD_PLASTIC_STRAIN && !s->now.plastic) return 0;
    return s->thermal ||
           (field != TLSPH_FIELD_TEMPERATURE && field != TLSPH_FIELD_ENERGY && field != TLSPH_FIELD_ENTROPY);
}
TLSPHI_DEF tlsph_result tlsph_read(const tlsph_solver *s, tlsph_field field, tlsph_real *out) {
    if (!tlsphi_field_exists(s, field)) return TLSPH_ERROR_FIELD;
    if (!out) return TLSPH_ERROR_ARGUMENT;
    const size_t components = (size_t)tlsph_field_components(field);
    for (size_t i = 0; i < s->blocks; i++)
        for (size_t a = s->block[i].begin; a < s->block[i].end; a++) {
            tlsph_real *to = out + components * s->host[a];
            if (field == TLSPH_FIELD_BODY) *to = (tlsph_real)s->block[i].body;
            else if (!tlsphi_read_stored(s, a, field, to)) tlsphi_read_derived(s, a, field, to);
        }
    return TLSPH_OK;
}

/* Sets F of one particle and what follows from it. */
static void tlsphi_write_gradient(tlsph_solver *s, size_t a, const tlsph_real *F) {
    const int dim = s->dim, linear = tlsphi_material_of(s, a)->kind == TLSPH_LINEAR;
    tlsph_real in_plane[9], full[9], H[9];
    tlsphi_shrink(dim, F, in_plane);
    tlsphi_expand(dim, in_plane, 1, full);
    tlsphi_tensor_put(s->now.F, dim * dim, a, in_plane);
    if (s->has_H) {
        tlsph_cofactor(full, H);
        tlsphi_shrink(dim, H, in_plane);
        tlsphi_tensor_put(s->now.H, dim * dim, a, in_plane);
    }
    if (s->has_J) s->now.J[a] = linear ? full[0] + full[4] + full[8] - 2 : tlsph_determinant(full);
}
static void tlsphi_write_particle(tlsph_solver *s, size_t a, tlsph_field field, const tlsph_real *in) {
    const size_t D = (size_t)s->dim;
    const tlsph_real rho = tlsphi_material_of(s, a)->rho;
    switch (field) {
    case TLSPH_FIELD_POSITION: memcpy(s->now.x + D * a, in, D * sizeof *in); break;
    case TLSPH_FIELD_VELOCITY:
        for (size_t i = 0; i < D; i++) s->now.p[D * a + i] = rho * in[i];
        break;
    case TLSPH_FIELD_F: tlsphi_write_gradient(s, a, in); break;
    case TLSPH_FIELD_J: s->now.J[a] = *in; break;
    default: break;
    }
}
/* Values that no state may have. */
static tlsph_result tlsphi_check_input(tlsph_solver *s, tlsph_field field, const tlsph_real *in) {
    const size_t components = (size_t)tlsph_field_components(field);
    for (size_t a = 0; a < s->n; a++)
        for (size_t k = 0; k < components; k++) {
            const tlsph_real value = in[components * a + k];
            if (!tlsphi_finite(value))
                return tlsphi_fail(&s->error, TLSPH_ERROR_NOT_FINITE, "write", tlsph_field_name(field), a,
                                   (double)value, 0, "finite");
            if (field == TLSPH_FIELD_TEMPERATURE && !(value > 0))
                return tlsphi_fail(&s->error, TLSPH_ERROR_TEMPERATURE, "write", "temperature", a, (double)value, 0,
                                   "more than 0");
        }
    return TLSPH_OK;
}
TLSPHI_DEF tlsph_result tlsph_write(tlsph_solver *s, tlsph_field field, const tlsph_real *in) {
    if (!tlsphi_field_exists(s, field) || !tlsphi_field_writable(field) || (field == TLSPH_FIELD_J && !s->has_J))
        return tlsphi_fail(&s->error, TLSPH_ERROR_FIELD, "write", tlsph_field_name(field), TLSPH_NO_PARTICLE,
                           (double)field, 0, "a writable field that the scene evolves");
    if (!in) return tlsphi_fail(&s->error, TLSPH_ERROR_ARGUMENT, "write", "in", TLSPH_NO_PARTICLE, 0, 0, "not NULL");
    tlsph_result result = tlsphi_check_input(s, field, in);
    if (result) return result;
    const size_t components = (size_t)tlsph_field_components(field);
    const tlsph_real *theta = field == TLSPH_FIELD_TEMPERATURE ? in : NULL;
    tlsphi_keep_state(s);
    for (size_t a = 0; a < s->n; a++) tlsphi_write_particle(s, a, field, in + components * s->host[a]);
    if (field == TLSPH_FIELD_VELOCITY) tlsphi_apply_fixes(s, s->now.p, 0, s->n);
    for (size_t a = 0; s->now.plastic && field == TLSPH_FIELD_F && a < s->n; a++) {
        tlsphi_elastic elastic;
        tlsphi_elastic_strains(s, s->old.plastic, a, a + 1, &elastic);
        tlsphi_flow(s, a, &elastic);
    }
    for (size_t a = 0; s->thermal && a < s->n; a++)
        tlsphi_set_temperature(s, a, theta ? theta[s->host[a]] : (*tlsphi_theta(s, a)));
    const tlsphi_block *bad = tlsphi_evaluate(s);
    if (bad) {
        result = tlsphi_describe_failure(s, bad, "write");
        tlsphi_restore_state(s);
        return result;
    }
    if (s->step == 0) tlsph_ledger_reset(s);
    return TLSPH_OK;
}

TLSPHI_DEF void tlsph_operator_view(const tlsph_solver *s, tlsph_operator *view) {
    view->count = s->n;
    view->pairs = s->pairs;
    view->dimension = s->dim;
    view->corrected = s->corrected;
    view->first = s->first;
    view->neighbours = s->neighbour;
    view->vectors = s->g;
    view->rests = s->rest;
    view->volumes = s->V;
    view->spacing = s->tau;
    view->host = s->host;
}

TLSPHI_DEF void tlsph_correction_read(const tlsph_solver *s, size_t a, tlsph_real *M) {
    tlsph_real in_plane[9];
    for (int i = 0; i < 9; i++) M[i] = i % 4 == 0;
    if (tlsphi_correction(s, a, s->dim, in_plane)) tlsphi_expand(s->dim, in_plane, 1, M);
}

/* ==== [CHECKPOINT] =================================================================================================
   Little-endian bytes: "TLSPHCK1", size of a real, fingerprint of the description, time, step, first and last dt, the
   ledger's accounts, the state in the host's order, and a checksum (FNV-1a, which sees every single changed byte). */

#define TLSPHI_ACCOUNTS (sizeof(tlsphi_account) / sizeof(double))
#define TLSPHI_HEADER (8 + 8 + 8 + 8 + 8 + 8 + 8 + 8 * TLSPHI_ACCOUNTS)

static uint64_t tlsphi_hash(uint64_t h, const unsigned char *bytes, size_t n) {
    for (size_t i = 0; i < n; i++) h = (h ^ bytes[i]) * 0x100000001b3u;
    return h;
}
static void tlsphi_put(unsigned char **at, uint64_t bits, int bytes) {
    for (int i = 0; i < bytes; i++) *(*at)++ = (unsigned char)(bits >> (8 * i) & 255);
}
static uint64_t tlsphi_get(const unsigned char **at, int bytes) {
    uint64_t bits = 0;
    for (int i = 0; i < bytes; i++) bits |= (uint64_t) * (*at)++ << (8 * i);
    return bits;
}
static void tlsphi_put_double(unsigned char **at, double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    tlsphi_put(at, bits, 8);
}
static double tlsphi_get_double(const unsigned char **at) {
    const uint64_t bits = tlsphi_get(at, 8);
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}
static void tlsphi_put_real(unsigned char **at, tlsph_real x) {
    tlsphi_bits bits;
    memcpy(&bits, &x, sizeof bits);
    tlsphi_put(at, bits, (int)sizeof bits);
}
static tlsph_real tlsphi_get_real(const unsigned char **at) {
    const tlsphi_bits bits = (tlsphi_bits)tlsphi_get(at, (int)sizeof(tlsphi_bits));
    tlsph_real x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* The state arrays in the order of the checkpoint, with their components and how far these lie apart. */
typedef struct tlsphi_saved {
    tlsph_real *array;
    size_t components, apart;
} tlsphi_saved;
static int tlsphi_state_arrays(const tlsph_solver *s, tlsphi_saved out[8]) {
    const size_t D = (size_t)s->dim, DD = D * D, L = TLSPHI_LANES;
    const tlsphi_saved all[8] = {{s->now.x, D, 1}, {s->now.p, D, 1}, {s->now.F, DD, L}, {s->now.H, DD, L},
                                 {s->now.J, 1, 1}, {s->now.E, 1, 1},
                                 {s->now.plastic, tlsphi_plastic_reals(s->dim, s->thermal), 1}, {s->now.q, 1, 1}};
    int count = 0;
    for (int i = 0; i < 8; i++)
        if (all[i].array) out[count++] = all[i];
    return count;
}
/* Component i of the particle with host's number h. */
static tlsph_real *tlsphi_saved_at(const tlsph_solver *s, const tlsphi_saved *saved, size_t h, size_t i) {
    const size_t a = s->inner[h], n = saved->components;
    return saved->array + (saved->apart > 1 ? tlsphi_tensor_at(n, a) : n * a) + i * saved->apart;
}
TLSPHI_DEF size_t tlsph_save_size(const tlsph_solver *s) {
    tlsphi_saved saved[8];
    size_t reals = 0;
    for (int k = tlsphi_state_arrays(s, saved); k-- > 0;) reals += saved[k].components * s->n;
    return TLSPHI_HEADER + reals * sizeof(tlsph_real) + 8;
}
TLSPHI_DEF tlsph_result tlsph_save(const tlsph_solver *s, void *buffer, size_t size) {
    unsigned char *at = (unsigned char *)buffer;
    tlsphi_saved saved[8];
    double accounts[TLSPHI_ACCOUNTS];
    if (!buffer) return TLSPH_ERROR_ARGUMENT;
    if (size < tlsph_save_size(s)) return TLSPH_ERROR_SIZE;
    memcpy(at, "TLSPHCK1", 8);
    at += 8;
    tlsphi_put(&at, sizeof(tlsph_real), 8);
    tlsphi_put(&at, s->fingerprint, 8);
    tlsphi_put_double(&at, s->time);
    tlsphi_put(&at, s->step, 8);
    tlsphi_put_double(&at, s->first_dt);
    tlsphi_put_double(&at, s->last_dt);
    memcpy(accounts, &s->account, sizeof accounts);
    for (size_t i = 0; i < TLSPHI_ACCOUNTS; i++) tlsphi_put_double(&at, accounts[i]);
    const int arrays = tlsphi_state_arrays(s, saved);
    for (int k = 0; k < arrays; k++)
        for (size_t h = 0; h < s->n; h++)
            for (size_t i = 0; i < saved[k].components; i++) tlsphi_put_real(&at, *tlsphi_saved_at(s, saved + k, h, i));
    tlsphi_put(&at, tlsphi_hash(0xcbf29ce484222325u, (const unsigned char *)buffer, tlsph_save_size(s) - 8), 8);
    return TLSPH_OK;
}
/* Whether the bytes are an undamaged checkpoint of this scene. */
static tlsph_result tlsphi_check_checkpoint(tlsph_solver *s, const unsigned char *bytes, size_t size) {
    const char *const field = "checkpoint";
    const size_t wanted = tlsph_save_size(s);
    if (size < wanted)
        return tlsphi_fail(&s->error, TLSPH_ERROR_CHECKPOINT, "restore", "bytes", TLSPH_NO_PARTICLE, (double)size,
                           (double)wanted, "as saved");
    const unsigned char *at = bytes + wanted - 8;
    if (memcmp(bytes, "TLSPHCK1", 8) || tlsphi_get(&at, 8) != tlsphi_hash(0xcbf29ce484222325u, bytes, wanted - 8))
        return tlsphi_fail(&s->error, TLSPH_ERROR_CHECKPOINT, "restore", field, TLSPH_NO_PARTICLE, 0, 0,
                           "undamaged data of tlsph_save");
    at = bytes + 8;
    if (tlsphi_get(&at, 8) != sizeof(tlsph_real) || tlsphi_get(&at, 8) != s->fingerprint)
        return tlsphi_fail(&s->error, TLSPH_ERROR_CHECKPOINT, "restore", "fingerprint", TLSPH_NO_PARTICLE, 0, 0,
                           "a checkpoint of the same description");
    return TLSPH_OK;
}
TLSPHI_DEF tlsph_result tlsph_restore(tlsph_solver *s, const void *buffer, size_t size) {
    const unsigned char *at = (const unsigned char *)buffer;
    tlsphi_saved saved[8];
    double accounts[TLSPHI_ACCOUNTS];
    if (!buffer)
        return tlsphi_fail(&s->error, TLSPH_ERROR_ARGUMENT, "restore", "buffer", TLSPH_NO_PARTICLE, 0, 0, "not NULL");
    const tlsph_result result = tlsphi_check_checkpoint(s, at, size);
    if (result) return result;
    at += 24;
    const double time = tlsphi_get_double(&at);
    const uint64_t step = tlsphi_get(&at, 8);
    const double first_dt = tlsphi_get_double(&at), last_dt = tlsphi_get_double(&at);
    tlsphi_keep_state(s);
    for (size_t i = 0; i < TLSPHI_ACCOUNTS; i++) accounts[i] = tlsphi_get_double(&at);
    memcpy(&s->account, accounts, sizeof accounts);
    const int arrays = tlsphi_state_arrays(s, saved);
    for (int k = 0; k < arrays; k++)
        for (size_t h = 0; h < s->n; h++)
            for (size_t i = 0; i < saved[k].components; i++)
                *tlsphi_saved_at(s, saved + k, h, i) = tlsphi_get_real(&at);
    const int finite = tlsphi_finite((tlsph_real)time) && tlsphi_all_finite(s->now_memory, s->state_reals);
    if (!finite || tlsphi_evaluate(s)) { /* a checksum can be forged */
        tlsphi_restore_state(s);
        return tlsphi_fail(&s->error, TLSPH_ERROR_CHECKPOINT, "restore", "state", TLSPH_NO_PARTICLE, time, 0,
                           "one that steps have led to");
    }
    s->time = time;
    s->step = step;
    s->first_dt = first_dt;
    s->last_dt = last_dt;
    return TLSPH_OK;
}

/* ==== [VALIDATION] ================================================================================================= */

static tlsph_result tlsphi_check_range(tlsphi_plan *plan, const char *field, double value, double low, double high,
                                       const char *allowed) {
    return tlsphi_finite((tlsph_real)value) && value >= low && value <= high
               ? TLSPH_OK
               : tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, field, TLSPH_NO_PARTICLE, value, low, allowed);
}
/* Are particles behind their surface? */
static int tlsphi_has_moments(const tlsph_desc *d) {
    return d->operator_kind == TLSPH_CLOSED && d->particles.moments;
}
static int tlsphi_is_cells(const tlsph_desc *d) {
    return d->operator_kind == TLSPH_CELLS || d->operator_kind == TLSPH_CELLS_4;
}
/* Why a scene may not have more than one step size, or NULL. */
static const char *tlsphi_rates_refuse(const tlsph_desc *d) {
    if (d->rates < 2) return NULL;
    if (d->thermal) return "1 where E or entropy is evolved";
    if (d->sharp_gradients || d->operator_kind == TLSPH_CELLS_4) return "1 with sharp gradients or TLSPH_CELLS_4";
    if (d->dissipation == TLSPH_AS_PRINTED || d->dissipation == TLSPH_JST || d->audit)
        return "1 with TLSPH_AS_PRINTED, TLSPH_JST or audit";
    if (tlsphi_needs_bonds(d) || d->step_rule || d->volume_coupling || d->drift_relaxation > 0)
        return "1 with operators of [BONDS], a step_rule by pairs, TLSPH_JOINT_AS_PRINTED or drift_relaxation";
    for (size_t i = 0; d->materials && i < d->material_count; i++)
        if (d->materials[i].kind == TLSPH_VON_MISES) return "1 with TLSPH_VON_MISES";
    for (size_t i = 0; d->conditions && i < d->condition_count; i++)
        if (d->conditions[i].kind == TLSPH_VELOCITY || d->conditions[i].kind == TLSPH_WALL)
            return "1 with TLSPH_VELOCITY or TLSPH_WALL";
    return NULL;
}
static tlsph_result tlsphi_check_description(tlsphi_plan *plan) {
    const tlsph_desc *d = plan->desc;
    const struct {
        const char *name;
        double value, low, high;
        const char *allowed;
    } range[] = {
        {"cookie", (double)d->cookie, TLSPHI_COOKIE, TLSPHI_COOKIE, "what tlsph_desc_default sets"},
        {"dimension", (double)d->dimension, 2, 3, "2 or 3"},
        {"unknowns", (double)d->unknowns, TLSPH_PF, TLSPH_PFH, "a tlsph_unknowns"},
        {"thermal", (double)d->thermal, TLSPH_ISOTHERMAL, TLSPH_ENTROPY, "a tlsph_thermal"},
        {"operator_kind", (double)d->operator_kind, TLSPH_CORRECTED_KERNEL, TLSPH_CLOSED, "a tlsph_operator_kind"},
        {"kernel", (double)d->kernel, TLSPH_CUBIC_SPLINE, TLSPH_WENDLAND_C4, "a tlsph_kernel"},
        {"support", (double)d->support, 1e-3, 100, "0.001 to 100"},
        {"dissipation", (double)d->dissipation, TLSPH_LIMITED, TLSPH_SELF_ADJOINT, "a tlsph_dissipation"},
        {"harmonic", (double)d->harmonic, 0, 100, "0 to 100"},
        {"biharmonic", (double)d->biharmonic, 0, 100, "0 to 100"},
        {"force_form", (double)d->force_form, TLSPH_ADJOINT, TLSPH_FORCE_AS_PRINTED, "a tlsph_force_form"},
        {"retries", (double)d->retries, 0, 30, "0 to 30"},
        {"limit", (double)d->limit, 0, d->retries > 0 ? 0.99 : 0, d->retries > 0 ? "0 to 0.99" : "0 without retries"},
        {"conduction_stages", (double)(d->conduction_stages ? d->conduction_stages : 3), 3, 1000, "0, or 3 to 1000"},
        {"step_rule", (double)d->step_rule, TLSPH_STEP_BY_PARTICLE, TLSPH_STEP_BY_PAIR_LINEAR, "a tlsph_step_rule"},
        {"volume_coupling", (double)d->volume_coupling, TLSPH_SPLIT, TLSPH_JOINT_AS_PRINTED, "a tlsph_volume_coupling"},
        {"drift_stiffness", (double)d->drift_stiffness, 0, 1e6, "0 to 1e6"},
        {"drift_scale", (double)d->drift_scale, 1e-6, 1e6, "1e-6 to 1e6"},
        {"jump_share", (double)d->jump_share, 0, 100, "0 to 100"},
        {"drift_relaxation", (double)d->drift_relaxation, 0, 100, "0 to 100"},
        {"conduction", (double)d->conduction, TLSPH_COMPACT, TLSPH_DOUBLE_GRADIENT, "a tlsph_conduction"},
        {"integrator", (double)d->integrator, TLSPH_RK2, (double)(d->scheme ? TLSPH_RK2 : TLSPH_LEAPFROG),
         "a tlsph_integrator; TLSPH_RK2 with TLSPH_INCOMPRESSIBLE"},
        {"scheme", (double)d->scheme, TLSPH_EXPLICIT, TLSPH_INCOMPRESSIBLE, "a tlsph_scheme"},
        {"thermal", (double)d->thermal, TLSPH_ISOTHERMAL, (double)(d->scheme ? TLSPH_ISOTHERMAL : TLSPH_ENTROPY),
         "isothermal with TLSPH_INCOMPRESSIBLE"},
        {"sharp_gradients", (double)d->sharp_gradients, -1e9, d->scheme ? 0 : 1e9, "0 with TLSPH_INCOMPRESSIBLE"},
        {"incompressible.iteration", (double)d->incompressible.iteration, TLSPH_CONJUGATE_GRADIENTS, TLSPH_DUAL_TIME,
         "a tlsph_pressure_iteration"},
        {"incompressible.laplacian", (double)d->incompressible.laplacian, 0, 1, "0 to 1"},
        {"incompressible.tolerance", (double)d->incompressible.tolerance, 1e-14, 0.1, "1e-14 to 0.1"},
        {"incompressible.iteration_limit", (double)d->incompressible.iteration_limit, 1, 1e9, "1 or more"},
        {"incompressible.pseudo_modulus", (double)d->incompressible.pseudo_modulus, 1e-3, 1e9, "0.001 to 1e9"},
        {"cfl", (double)d->cfl, 1e-9, 1, "more than 0, at most 1"},
        {"rates", (double)d->rates, 1, d->integrator == TLSPH_LEAPFROG ? 8.0 : 1.0, "1; to 8 with TLSPH_LEAPFROG"},
        {"threads", (double)d->threads, 0, 4096, "0 to 4096"},
        {"integrator", (double)d->integrator, 0, (double)(tlsphi_has_moments(d) ? TLSPH_RK4_FROZEN : TLSPH_LEAPFROG),
         "a Runge-Kutta scheme where particles have moments"},
        {"conduction_stages", (double)d->conduction_stages, 0, tlsphi_has_moments(d) ? 0.0 : 1000.0,
         "0 where particles have moments"},
        {"scheme", (double)d->scheme, 0, (double)(tlsphi_has_moments(d) ? TLSPH_EXPLICIT : TLSPH_INCOMPRESSIBLE),
         "TLSPH_EXPLICIT where particles have moments"},
        {"particles.spacing", (double)d->particles.spacing, 0, TLSPHI_LARGEST, "0 (from the weights) or more"},
        {"material_count", (double)d->material_count, 1, 256, "1 to 256"},
        {"particles.count", (double)d->particles.count, 2, 4294967294.0, "2 to 2^32 - 2"},
        {"particles.cell_count", (double)d->particles.cell_count, 0, (double)d->particles.count,
         "fewer than particles: a lattice has more corners than cells"},
    };
    if (d->cookie == TLSPHI_COOKIE && !tlsphi_finite(d->particles.spacing))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_NOT_FINITE, "particles.spacing", TLSPH_NO_PARTICLE,
                                (double)d->particles.spacing, 0, "finite");
    for (size_t i = 0; i < sizeof range / sizeof range[0]; i++) {
        const tlsph_result r =
            tlsphi_check_range(plan, range[i].name, range[i].value, range[i].low, range[i].high, range[i].allowed);
        if (r) return r;
    }
    if (d->scheme == TLSPH_INCOMPRESSIBLE && (d->unknowns == TLSPH_PFJ || d->unknowns == TLSPH_PFHJ))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, "unknowns", TLSPH_NO_PARTICLE, (double)d->unknowns, 0,
                                "TLSPH_PF or TLSPH_PFH with TLSPH_INCOMPRESSIBLE, where the pressure replaces J");
    if (d->scheme == TLSPH_INCOMPRESSIBLE && tlsphi_needs_bonds(d))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, "operator", TLSPH_NO_PARTICLE, (double)d->operator_kind, 0,
                                "plain corrected kernels, cells or given pairs with TLSPH_INCOMPRESSIBLE");
    const char *const alone = tlsphi_rates_refuse(d);
    if (alone) return tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, "rates", TLSPH_NO_PARTICLE, d->rates, 1, alone);
    const int pointers = d->materials && d->particles.positions &&
                         (d->particles.volumes || tlsphi_is_cells(d)) &&
                         (!d->condition_count || d->conditions) &&
                         (!tlsphi_is_cells(d) || (d->particles.cells && d->particles.cell_count)) &&
                         (d->operator_kind != TLSPH_GIVEN ||
                          (d->particles.first && d->particles.neighbours && d->particles.pair_vectors));
    if (d->operator_kind == TLSPH_CLOSED && !d->particles.areas)
        return tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, "particles.areas", TLSPH_NO_PARTICLE, 0, 0,
                                "not NULL: a cloud is closed by its surface's area vectors (tlsph_voronoi makes them); "
                                "points alone: TLSPH_CORRECTED_KERNEL");
    if (!d->allocator.allocate != !d->allocator.release)
        return tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, "allocator", TLSPH_NO_PARTICLE, 0, 0,
                                "both functions or neither");
    if (!pointers)
        return tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, "a pointer", TLSPH_NO_PARTICLE, 0, 0,
                                "not NULL: materials, positions, volumes, conditions and what the operator needs");
    return TLSPH_OK;
}
static tlsph_result tlsphi_check_particles(tlsphi_plan *plan) {
    const tlsph_desc *d = plan->desc;
    const tlsph_particles *p = &d->particles;
    for (size_t a = 0; a < p->count; a++) {
        for (int i = 0; i < d->dimension; i++)
            if (!tlsphi_finite(p->positions[3 * a + (size_t)i]))
                return tlsphi_plan_fail(plan, TLSPH_ERROR_NOT_FINITE, "position", a,
                                        (double)p->positions[3 * a + (size_t)i], 0, "finite");
        for (int i = 0; i < 3; i++) {
            static const char *const names[3] = {"volume", "weight", "local spacing"};
            const tlsph_real *const array = i == 2 ? p->spacings : i ? p->weights : p->volumes;
            if (!array || (array[a] > 0 && tlsphi_finite(array[a]))) continue;
            return tlsphi_plan_fail(plan, tlsphi_finite(array[a]) ? TLSPH_ERROR_VOLUME : TLSPH_ERROR_NOT_FINITE,
                                    names[i], a, (double)array[a], 0, "more than 0, finite");
        }
        if (p->areas && !tlsphi_all_finite(p->areas + 3 * a, (size_t)d->dimension))
            return tlsphi_plan_fail(plan, TLSPH_ERROR_NOT_FINITE, "area", a, (double)p->areas[3 * a], 0, "finite");
        if (p->moments && !tlsphi_all_finite(p->moments + 9 * a, 9))
            return tlsphi_plan_fail(plan, TLSPH_ERROR_NOT_FINITE, "moment", a, (double)p->moments[9 * a], 0, "finite");
        if (p->materials && p->materials[a] >= d->material_count)
            return tlsphi_plan_fail(plan, TLSPH_ERROR_MATERIAL, "material index", a, p->materials[a],
                                    (double)d->material_count, "less than material_count");
    }
    return TLSPH_OK;
}
static tlsph_result tlsphi_check_materials(tlsphi_plan *plan) {
    for (size_t i = 0; i < plan->desc->material_count; i++) {
        double value;
        const char *allowed, *fault =
            tlsphi_material_fault(plan->desc->materials + i, plan->desc->thermal != TLSPH_ISOTHERMAL,
                                  plan->desc->scheme == TLSPH_INCOMPRESSIBLE, &value, &allowed);
        if (fault) return tlsphi_plan_fail(plan, TLSPH_ERROR_MATERIAL, fault, TLSPH_NO_PARTICLE, value, 0, allowed);
    }
    return TLSPH_OK;
}
/* The particles that a condition concerns: a list, or all. */
static size_t tlsphi_set_size(const tlsphi_plan *plan, const tlsph_condition *c) {
    return c->particles ? c->count : plan->n;
}
static uint32_t tlsphi_set_host(const tlsph_condition *c, size_t i) {
    return c->particles ? c->particles[i] : (uint32_t)i;
}

static int tlsphi_is_constraint(tlsph_condition_kind kind) {
    return kind == TLSPH_CLAMPED || kind == TLSPH_ROLLER || kind == TLSPH_TANGENT;
}
static int tlsphi_holds_velocity(tlsph_condition_kind kind) {
    return tlsphi_is_constraint(kind) || kind == TLSPH_VELOCITY;
}
/* Does host particle a lie behind its surface? */
static int tlsphi_owns_surface(const tlsph_desc *d, size_t a) {
    const tlsph_real *B = tlsphi_has_moments(d) ? d->particles.areas + 3 * a : NULL;
    return B && tlsphi_any_dot(d->dimension, B, B) > 0;
}
/* The normal that picks a part of a particle's share of the surface; NULL: all of it. */
static const tlsph_real *tlsphi_condition_face(int dim, const tlsph_condition *c) {
    return tlsphi_any_dot(dim, c->face, c->face) > 0     ? c->face
           : tlsphi_any_dot(dim, c->normal, c->normal) > 0 ? c->normal
                                                       : NULL;
}
static tlsph_result tlsphi_check_condition(tlsphi_plan *plan, const tlsph_condition *c) {
    const size_t n = plan->n;
    const int plane = c->kind == TLSPH_ROLLER || c->kind == TLSPH_TANGENT || c->kind == TLSPH_WALL;
    const tlsph_real NN = tlsphi_any_dot(plan->dim, c->normal, c->normal);
    if (c->cookie != TLSPHI_COOKIE || (unsigned)c->kind > (unsigned)TLSPH_WALL)
        return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "cookie or kind", TLSPH_NO_PARTICLE, (double)c->kind, 0,
                                "what tlsph_condition_default sets");
    if (!c->particles && c->count)
        return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "particles", TLSPH_NO_PARTICLE, (double)c->count, 0,
                                "not NULL, or count 0 for all");
    if (!tlsphi_all_finite(c->normal, 3) || !tlsphi_all_finite(c->value, 3) || !tlsphi_all_finite(c->point, 3) ||
        !tlsphi_all_finite(c->face, 3))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "value, normal, face or point", TLSPH_NO_PARTICLE, 0, 0,
                                "finite");
    if ((plane && !(NN > 0)) || !tlsphi_finite(NN))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "normal", TLSPH_NO_PARTICLE, (double)NN, 0,
                                "a square that is finite, and not zero for this kind");
    if (c->kind == TLSPH_WALL && (plan->desc->scheme == TLSPH_INCOMPRESSIBLE || tlsphi_has_moments(plan->desc)))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "kind", TLSPH_NO_PARTICLE, (double)c->kind, 0,
                                "no walls with TLSPH_INCOMPRESSIBLE, nor where particles have moments");
    if (tlsphi_is_thermal(c->kind) && !plan->desc->thermal)
        return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "kind", TLSPH_NO_PARTICLE, (double)c->kind, 0,
                                "no heat in an isothermal scene");
    if (c->kind == TLSPH_TEMPERATURE && !c->values && !(c->value[0] > 0))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "temperature", TLSPH_NO_PARTICLE, (double)c->value[0], 0,
                                "more than 0");
    for (size_t i = 0; i < c->count; i++)
        if (c->particles[i] >= n)
            return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "particle number", c->particles[i],
                                    (double)c->particles[i], (double)n, "less than the number of particles");
    for (size_t i = 0; tlsphi_holds_velocity(c->kind) && i < tlsphi_set_size(plan, c); i++) {
        const uint32_t a = tlsphi_set_host(c, i);
        if (!tlsphi_owns_surface(plan->desc, a)) continue;
        const tlsph_real *B = plan->desc->particles.areas + 3 * a, *N = tlsphi_condition_face(plan->dim, c);
        const tlsph_real square = N ? tlsphi_any_dot(plan->dim, N, N) : 1;
        const tlsph_real share = N ? tlsphi_abs(tlsphi_any_dot(plan->dim, B, N)) / tlsphi_sqrt(square) : 1;
        plan->held_parts++;
        if (!(share > TLSPHI_R(1e-6) * tlsphi_sqrt(tlsphi_any_dot(plan->dim, B, B))))
            return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "share of the surface across face or normal", a,
                                    (double)share, 0, "more than 0: particles next to it (tlsph_select_plane)");
    }
    const size_t per = c->kind == TLSPH_PRESSURE ? 3 : 1;
    for (size_t i = 0; c->areas && i < per * tlsphi_set_size(plan, c); i++)
        if (!tlsphi_finite(c->areas[i]))
            return tlsphi_plan_fail(plan, TLSPH_ERROR_CONDITION, "area", tlsphi_set_host(c, i / per),
                                    (double)c->areas[i], 0, "finite");
    return TLSPH_OK;
}

/* ==== [CREATION] =================================================================================================== */

/* Adds what is new in direction e to the orthonormal fixed directions of a particle (Gram-Schmidt). */
static void tlsphi_fix_direction(tlsphi_plan *plan, uint32_t host, const double e[3]) {
    const int dim = plan->dim;
    double *basis = plan->fixed_direction + (size_t)(dim * dim) * host, rest[3] = {e[0], e[1], e[2]}, norm = 0;
    const int have = plan->fixed[host];
    if (have == dim) return;
    for (int k = 0; k < have; k++) {
        double along = 0;
        for (int i = 0; i < dim; i++) along += basis[dim * k + i] * rest[i];
        for (int i = 0; i < dim; i++) rest[i] -= along * basis[dim * k + i];
    }
    for (int i = 0; i < dim; i++) norm += rest[i] * rest[i];
    if (norm < 1e-20) return;
    for (int i = 0; i < dim; i++) basis[dim * have + i] = rest[i] / sqrt(norm);
    plan->fixed[host]++;
    plan->fixes++;
}
static void tlsphi_unit_normal(const tlsph_condition *c, int dim, double N[3]) {
    double norm = 0;
    N[2] = 0;
    for (int i = 0; i < dim; i++) norm += (double)c->normal[i] * (double)c->normal[i];
    for (int i = 0; i < dim; i++) N[i] = (double)c->normal[i] / sqrt(norm);
}
/* The directions that a constraint fixes: N; or all that is perpendicular to N; or everything. */
static void tlsphi_fix_particle(tlsphi_plan *plan, const tlsph_condition *c, uint32_t host) {
    double N[3];
    if (c->kind == TLSPH_ROLLER) {
        tlsphi_unit_normal(c, plan->dim, N);
        tlsphi_fix_direction(plan, host, N);
        return;
    }
    for (int axis = 0; axis < plan->dim; axis++) {
        double e[3] = {0, 0, 0};
        e[axis] = 1;
        if (c->kind == TLSPH_TANGENT) {
            tlsphi_unit_normal(c, plan->dim, N);
            for (int i = 0; i < plan->dim; i++) e[i] -= N[axis] * N[i];
        }
        tlsphi_fix_direction(plan, host, e);
    }
}
static tlsph_result tlsphi_plan_conditions(tlsphi_plan *plan) {
    const tlsph_desc *d = plan->desc;
    size_t constraints = 0;
    for (size_t k = 0; k < d->condition_count; k++) {
        const tlsph_result r = tlsphi_check_condition(plan, d->conditions + k);
        if (r) return r;
        constraints += tlsphi_is_constraint(d->conditions[k].kind) ? 1 : 0;
        const tlsph_condition_kind kind = d->conditions[k].kind;
        const int mirror = d->mirror_gradients && (kind == TLSPH_ROLLER || kind == TLSPH_TANGENT);
        for (size_t i = 0; mirror && i < tlsphi_set_size(plan, d->conditions + k); i++)
            plan->mirrors += !tlsphi_owns_surface(d, tlsphi_set_host(d->conditions + k, i));
    }
    if (!constraints) return TLSPH_OK;
    plan->fixed = TLSPHI_SCRATCH(plan, uint8_t, plan->n);
    plan->fixed_direction = TLSPHI_SCRATCH(plan, double, (size_t)(plan->dim * plan->dim) * plan->n);
    if (!plan->fixed || !plan->fixed_direction) return tlsphi_no_memory(plan, 73.0 * (double)plan->n);
    for (size_t k = 0; k < d->condition_count; k++)
        for (size_t i = 0; tlsphi_is_constraint(d->conditions[k].kind) && i < tlsphi_set_size(plan, d->conditions + k);
             i++) {
            const uint32_t host = tlsphi_set_host(d->conditions + k, i);
            if (!tlsphi_owns_surface(d, host)) tlsphi_fix_particle(plan, d->conditions + k, host);
        }
    return TLSPH_OK;
}

static void tlsphi_smoothing_length(tlsphi_plan *plan) {
    double spacing = (double)plan->desc->particles.spacing, mean = 0;
    if (!(spacing > 0)) {
        for (size_t a = 0; a < plan->n; a++) mean += plan->weights ? (double)plan->weights[a] : plan->volume[a];
        mean /= (double)plan->n;
        spacing = plan->dim == 3 ? cbrt(mean) : sqrt(mean);
    }
    const tlsph_real *local = plan->desc->particles.spacings;
    for (size_t a = 0; local && a < plan->n; a++) spacing = tlsphi_dmax(a ? spacing : 0, (double)local[a]);
    plan->h = spacing * (double)plan->desc->support;
}
/* Blocks end with the rows' blocks and with bodies, tiles also with every TLSPHI_LANES particles. */
static int tlsphi_block_begins(const tlsphi_plan *plan, size_t a) {
    return a % TLSPHI_BLOCK == 0 || plan->body[a] != plan->body[a - 1] ||
           tlsphi_rate_class(plan, plan->host[a]) != tlsphi_rate_class(plan, plan->host[a - 1]);
}
static int tlsphi_tile_begins(const tlsphi_plan *plan, size_t a) {
    return a % TLSPHI_LANES == 0 || tlsphi_block_begins(plan, a);
}
static void tlsphi_count_blocks(tlsphi_plan *plan) {
    for (size_t a = 0; a < plan->n; a++) plan->blocks += tlsphi_block_begins(plan, a) ? 1 : 0;
}

/* ==== [TILES] ======================================================================================================
   Neighbours by tiles of TLSPHI_LANES consecutive particles. A slot holds one neighbour for each of them. On a lattice
   whose particles are ordered by rows most of the neighbours of a tile in one direction are consecutive, too: such a slot
   needs only their first number. Pairs that fit no such slot (at the ends of rows of unequal length, in clouds) share
   slots with a list of numbers. A lane without a pair in a slot has the vector 0 and reads any particle.
   The vectors of a slot are a pattern; equal patterns are stored once, and a lattice has few. */

#define TLSPHI_PATTERNS_SEEN 32768
#define TLSPHI_PATTERNS_MOST 0xfffffffu /* as a slot can number */

/* What building takes: the pairs of the particles of one tile, and arrays that grow. */
typedef struct tlsphi_tiler {
    tlsphi_plan *plan;
    tlsphi_graph *graph;
    int damped;               /* pairs of the dissipation (TLSPH_CELLS_4) */
    size_t base, begin, end;  /* a - base is the lane */
    size_t count[TLSPHI_LANES], most;
    uint32_t *list;           /* lanes x most */
    double *g;                /* lanes x most x D */
    tlsph_real *size, *along; /* lanes x most: |C_ab|, C_ab . d_ab */
    tlsph_real *raw;          /* lanes x most x D, with bonds: C_ab itself */
    tlsph_real *laplacian;    /* lanes x most: l_ab */
    uint8_t *done, *axes;     /* lanes x most; axes: as in tlsphi_slot */
    size_t slot_room, gather_room;
    tlsphi_patterns patterns;
    tlsph_real pattern[8 * TLSPHI_LANES];
    unsigned slot_axes;
} tlsphi_tiler;

static int tlsphi_are_close(const tlsph_real *a, const tlsph_real *b, size_t n, double slack) {
    for (size_t i = 0; slack > 0 && i < n; i++)
        if (!(fabs((double)a[i] - (double)b[i]) <= slack)) return 0;
    return slack > 0 || memcmp(a, b, n * sizeof *a) == 0;
}
/* Number of a set of numbers (at most 9 a lane) among its equals, to within a slack; TLSPHI_NONE if there is no memory. */
static uint32_t tlsphi_pattern_number(tlsphi_plan *plan, tlsphi_patterns *p, const tlsph_real *pattern, size_t reals,
                                      double slack) {
    const size_t bytes = reals * sizeof *pattern;
    tlsph_real rounded[9 * TLSPHI_LANES];
    for (size_t i = 0; slack > 0 && i < reals; i++) rounded[i] = (tlsph_real)floor((double)pattern[i] / slack + 0.5);
    const void *const key = slack > 0 ? rounded : pattern;
    const uint64_t hash = tlsphi_hash(0xcbf29ce484222325u, (const unsigned char *)key, bytes);
    size_t at = (size_t)(hash >> 20) % TLSPHI_PATTERNS_SEEN;
    for (int probe = 0; probe < 8 && p->seen[at]; probe++, at = (at + 1) % TLSPHI_PATTERNS_SEEN)
        if (tlsphi_are_close(p->pattern + (p->seen[at] - 1) * reals, pattern, reals, slack)) return p->seen[at] - 1;
    if (p->count == TLSPHI_PATTERNS_MOST ||
        !tlsphi_scratch_room(plan, (void **)&p->pattern, &p->room, p->count + 1, bytes))
        return TLSPHI_NONE;
    memcpy(p->pattern + p->count * reals, pattern, bytes);
    p->seen[at] = (uint32_t)++p->count; /* if the table is full there, an older one is forgotten */
    return p->seen[at] - 1;
}
/* Sorts a neighbour list (solver's numbers) with its vectors: memory is then walked forwards. */
static void tlsphi_sort_pairs(int dim, uint32_t *list, double *g, size_t count) {
    for (size_t i = 1; i < count; i++) {
        const uint32_t b = list[i];
        double vector[3] = {0, 0, 0};
        size_t j = i;
        for (int k = 0; k < dim; k++) vector[k] = g[(size_t)dim * i + (size_t)k];
        for (; j > 0 && list[j - 1] > b; j--) {
            list[j] = list[j - 1];
            for (int k = 0; k < dim; k++) g[(size_t)dim * j + (size_t)k] = g[(size_t)dim * (j - 1) + (size_t)k];
        }
        list[j] = b;
        for (int k = 0; k < dim; k++) g[(size_t)dim * j + (size_t)k] = vector[k];
    }
}

/* Pairs of the dissipation of a particle of a lattice of order 4: those that share a face, with its area. */
static size_t tlsphi_damped_pairs_of(const tlsphi_plan *plan, size_t a, uint32_t *list, double *g) {
    const size_t D = (size_t)plan->dim;
    tlsphi_stencil stencil;
    size_t count = 0;
    tlsphi_stencil_of(plan, a, &stencil);
    for (size_t i = 0; i < stencil.count; i++) {
        const double *across = stencil.across[i], size = fabs(across[0]) + fabs(across[1]) + fabs(across[2]);
        if (!(size > 0)) continue;
        for (size_t k = 0; k < D; k++) g[D * count + k] = across[k];
        list[count++] = stencil.b[i];
    }
    return count;
}
/* What the pairs of a particle add up to: boundary vector B_a = -sum_b C_ab^skew, and the time step's length
   tau_a = 2 dim V_a / sum_b |C_ab|. B of the size of round-off is 0. With TLSPH_CELLS_4 both come from the cells: smaller
   volumes at free faces and edges did not lower the stable step. */
TLSPHI_APART int tlsphi_plan_sums(tlsphi_plan *plan, size_t a, double *B, double sum) {
    const size_t D = (size_t)plan->dim, h = plan->host[a];
    plan->tau[a] = (tlsph_real)(2 * plan->dim * tlsphi_plan_volume(plan, h) / sum /
                                (plan->desc->sharp_gradients ? TLSPHI_SHARP_STEP : 1));
    if (plan->lattice) {
        tlsphi_stencil stencil;
        tlsphi_stencil_of(plan, h, &stencil);
        memcpy(B, stencil.B, sizeof stencil.B);
        plan->tau[a] = (tlsph_real)(plan->dim / (stencil.fineness[0] + stencil.fineness[1] + stencil.fineness[2]));
    }
    if (sqrt(tlsphi_norm2(B)) <= 256 * TLSPHI_EPSILON * sum) return 1;
    if (!tlsphi_scratch_room(plan, (void **)&plan->B_of, &plan->B_of_room, plan->areas + 1, sizeof *plan->B_of) ||
        !tlsphi_scratch_room(plan, (void **)&plan->B, &plan->B_room, plan->areas + 1, D * sizeof *plan->B))
        return 0;
    plan->B_of[plan->areas] = (uint32_t)a;
    for (size_t k = 0; k < D; k++) plan->B[D * plan->areas + k] = (tlsph_real)B[k];
    plan->areas++;
    return 1;
}
/* Pairs of a lane in the solver's numbers; g becomes the vector that the solver stores. 0 if there is no memory. */
static int tlsphi_tile_lane(tlsphi_tiler *t, size_t a) {
    tlsphi_plan *plan = t->plan;
    const size_t D = (size_t)plan->dim, lane = a - t->base, h = plan->host[a];
    const int behind = plan->closed_C && !plan->antisymmetric; /* sum g is the area vector; tau by the longer of C_ab, C_ba */
    double B[3] = {0, 0, 0}, sum = 0;
    uint32_t *list = t->list + lane * t->most;
    double *g = t->g + D * lane * t->most;
    const size_t count = t->damped ? tlsphi_damped_pairs_of(plan, h, list, g) : tlsphi_neighbours_of(plan, h, list, g);
    for (size_t i = 0; i < count; i++) list[i] = plan->inner[list[i]];
    tlsphi_sort_pairs(plan->dim, list, g, count);
    for (size_t i = 0; i < count; i++) {
        double mine[3] = {0, 0, 0}, other[3] = {0, 0, 0}, C[3] = {0, 0, 0};
        if (t->damped) memcpy(C, g + D * i, D * sizeof *C);
        else tlsphi_pair_vectors(plan, h, plan->host[list[i]], g + D * i, mine, other, C);
        const double square = tlsphi_dot3(mine, mine);
        for (size_t k = 0; k < D; k++) B[k] -= behind ? g[D * i + k] : C[k];
        sum += sqrt(behind ? tlsphi_dmax(square, tlsphi_dot3(other, other)) : square);
        double size = sqrt(tlsphi_norm2(C));
        if (plan->correction) tlsphi_round_vectors(plan, &size, 1);
        double d[3] = {0, 0, 0}, along;
        tlsphi_difference(plan, h, plan->host[list[i]], d);
        along = tlsphi_dot3(C, d) / plan->h;
        if (plan->correction) tlsphi_round_vectors(plan, &along, 1);
        t->size[lane * t->most + i] = (tlsph_real)size;
        t->along[lane * t->most + i] = (tlsph_real)(along * plan->h);
        if (t->laplacian) {
            double laplacian = tlsphi_dmax(tlsphi_dot3(C, d), 0) / tlsphi_dot3(d, d) * plan->h; /* as large as an area */
            tlsphi_round_vectors(plan, &laplacian, 1);
            t->laplacian[lane * t->most + i] = (tlsph_real)(laplacian / plan->h);
        }
        for (size_t k = 0; k < D && plan->antisymmetric; k++) g[D * i + k] = C[k];
        t->axes[lane * t->most + i] = 0;
        for (size_t k = 0; k < D; k++) {
            if (t->raw) t->raw[D * (lane * t->most + i) + k] = (tlsph_real)mine[k];
            if (d[k] != 0 || (tlsph_real)g[D * i + k] != 0 || (t->raw && (tlsph_real)mine[k] != 0))
                t->axes[lane * t->most + i] |= (uint8_t)(1u << k);
        }
    }
    t->count[lane] = count;
    if (t->damped) return 1;
    plan->found[a] = (uint32_t)count;
    return tlsphi_plan_sums(plan, a, B, sum);
}
static void tlsphi_tile_take(tlsphi_tiler *t, size_t lane, size_t i) {
    const size_t D = (size_t)t->plan->dim, at = lane * t->most + i;
    t->done[at] = 1;
    t->slot_axes |= t->axes[at];
    for (size_t k = 0; k < D; k++) t->pattern[k * TLSPHI_LANES + lane] = (tlsph_real)t->g[D * at + k];
    t->pattern[D * TLSPHI_LANES + lane] = t->size[at];
    if (t->raw)
        for (size_t k = 0; k < D; k++) t->pattern[(D + 1 + k) * TLSPHI_LANES + lane] = t->raw[D * at + k];
    else if (t->graph->along) t->pattern[(D + 1) * TLSPHI_LANES + lane] = t->along[at];
    if (t->laplacian) t->pattern[(size_t)t->graph->laplacian * TLSPHI_LANES + lane] = t->laplacian[at];
}
/* Closes a slot: the pattern is set; `from` is the first neighbour, or, scattered, the place of the list. */
static int tlsphi_tile_emit(tlsphi_tiler *t, size_t from, uint32_t scattered) {
    tlsphi_graph *graph = t->graph;
    const uint32_t pattern =
        tlsphi_pattern_number(t->plan, &t->patterns, t->pattern, (size_t)graph->width * TLSPHI_LANES, 0);
    memset(t->pattern, 0, sizeof t->pattern);
    if (pattern == TLSPHI_NONE ||
        !tlsphi_scratch_room(t->plan, (void **)&graph->slot, &t->slot_room, graph->slots + 1, sizeof *graph->slot))
        return 0;
    graph->slot[graph->slots].pattern = pattern & TLSPHI_PATTERNS_MOST;
    graph->slot[graph->slots].from = (uint32_t)from;
    graph->slot[graph->slots].scattered = scattered & 1;
    graph->slot[graph->slots++].axes = t->slot_axes & 7;
    t->slot_axes = 0;
    return 1;
}
/* Pair of a lane whose neighbour lies `lane - reference` behind b, if it has not been taken; t->most otherwise. */
static size_t tlsphi_tile_find(const tlsphi_tiler *t, size_t lane, size_t from) {
    for (size_t i = 0; i < t->count[lane]; i++)
        if (t->list[lane * t->most + i] == from + lane && !t->done[lane * t->most + i]) return i;
    return t->most;
}
/* A slot of consecutive neighbours from + lane, if half of the lanes or more have them. */
static int tlsphi_tile_consecutive(tlsphi_tiler *t, size_t from) {
    size_t found = 0;
    if (from % TLSPHI_BLOCK + TLSPHI_LANES > TLSPHI_BLOCK) return 1;
    for (size_t lane = t->begin - t->base; lane < t->end - t->base; lane++)
        found += tlsphi_tile_find(t, lane, from) < t->most;
    if (2 * found < t->end - t->begin) return 1;
    for (size_t lane = t->begin - t->base; lane < t->end - t->base; lane++) {
        const size_t i = tlsphi_tile_find(t, lane, from);
        if (i < t->most) tlsphi_tile_take(t, lane, i);
    }
    return tlsphi_tile_emit(t, from, 0);
}
/* A slot with the first pair of each lane that is left; 2: nothing is left. */
static int tlsphi_tile_scattered(tlsphi_tiler *t) {
    tlsphi_graph *graph = t->graph;
    const size_t from = graph->gathers * TLSPHI_LANES;
    int left = 0;
    if (!tlsphi_scratch_room(t->plan, (void **)&graph->gathered, &t->gather_room, from + TLSPHI_LANES, sizeof(uint32_t)))
        return 0;
    for (size_t lane = 0; lane < TLSPHI_LANES; lane++) {
        size_t i = 0;
        graph->gathered[from + lane] = (uint32_t)t->begin;
        if (lane < t->begin - t->base || lane >= t->end - t->base) continue;
        while (i < t->count[lane] && t->done[lane * t->most + i]) i++;
        if (i == t->count[lane]) continue;
        graph->gathered[from + lane] = t->list[lane * t->most + i];
        tlsphi_tile_take(t, lane, i);
        left = 1;
    }
    if (!left) return 2;
    graph->gathers++;
    return tlsphi_tile_emit(t, from, 1);
}
static int tlsphi_tile_build(tlsphi_tiler *t) {
    int more = 1;
    memset(t->count, 0, sizeof t->count);
    memset(t->done, 0, TLSPHI_LANES * t->most);
    for (size_t a = t->begin; a < t->end; a++)
        if (!tlsphi_tile_lane(t, a)) return 0;
    for (size_t lane = t->begin - t->base; lane < t->end - t->base; lane++)
        for (size_t i = 0; i < t->count[lane]; i++) {
            const size_t at = lane * t->most + i;
            if (!t->done[at] && t->list[at] >= lane && !tlsphi_tile_consecutive(t, t->list[at] - lane)) return 0;
        }
    while (more == 1) more = tlsphi_tile_scattered(t);
    return more;
}
static tlsph_result tlsphi_graph_build(tlsphi_plan *plan, int damped) {
    const size_t D = (size_t)plan->dim, n = plan->n, all = TLSPHI_LANES * plan->most;
    tlsphi_tiler tiler, *t = &tiler;
    memset(t, 0, sizeof *t);
    t->plan = plan;
    t->damped = damped;
    t->graph = plan->graph + damped;
    const int compact = plan->desc->thermal && plan->desc->conduction == TLSPH_COMPACT;
    t->graph->raw = plan->bond ? plan->dim + 1 : 0;
    t->graph->along = compact && !plan->antisymmetric && !plan->bond;
    t->graph->width = plan->dim + 1 + (plan->bond ? plan->dim : t->graph->along);
    if (plan->desc->dissipation == TLSPH_JST) t->graph->laplacian = t->graph->width++;
    t->most = plan->most;
    t->list = TLSPHI_SCRATCH(plan, uint32_t, all);
    t->g = TLSPHI_SCRATCH(plan, double, D * all);
    t->size = TLSPHI_SCRATCH(plan, tlsph_real, all);
    t->along = TLSPHI_SCRATCH(plan, tlsph_real, all);
    if (plan->bond) t->raw = TLSPHI_SCRATCH(plan, tlsph_real, D * all);
    if (t->graph->laplacian) t->laplacian = TLSPHI_SCRATCH(plan, tlsph_real, all);
    t->done = TLSPHI_SCRATCH(plan, uint8_t, all);
    t->axes = TLSPHI_SCRATCH(plan, uint8_t, all);
    t->patterns.seen = TLSPHI_SCRATCH(plan, uint32_t, TLSPHI_PATTERNS_SEEN);
    for (size_t a = 0; a < n; a++) t->graph->tiles += tlsphi_tile_begins(plan, a) ? 1 : 0;
    t->graph->first = TLSPHI_SCRATCH(plan, size_t, t->graph->tiles + 1);
    if (!t->list || !t->g || !t->size || !t->along || (plan->bond && !t->raw) ||
        (t->graph->laplacian && !t->laplacian) || !t->done || !t->axes || !t->patterns.seen || !t->graph->first)
        return tlsphi_no_memory(plan, 64.0 * (double)all);
    for (size_t tile = 0; t->end < n; tile++) {
        t->begin = t->end;
        do t->end++;
        while (t->end < n && !tlsphi_tile_begins(plan, t->end));
        t->base = t->begin / TLSPHI_LANES * TLSPHI_LANES;
        if (!tlsphi_tile_build(t)) return tlsphi_no_memory(plan, 64.0 * (double)plan->pairs);
        t->graph->first[tile + 1] = t->graph->slots;
    }
    t->graph->patterns = t->patterns.count;
    t->graph->pattern = t->patterns.pattern;
    return TLSPH_OK;
}
/* M_a as lanes of tiles. Those are the same that differ by what round-off of the positions does to them: force and gradient
   stay adjoint, as they take the same M. */
static tlsph_result tlsphi_tile_corrections(tlsphi_plan *plan) {
    const size_t dd = (size_t)(plan->dim * plan->dim), tiles = (plan->n - 1) / TLSPHI_LANES + 1;
    if (plan->antisymmetric) return TLSPH_OK;
    plan->M_of = TLSPHI_SCRATCH(plan, uint32_t, tiles);
    plan->M.seen = TLSPHI_SCRATCH(plan, uint32_t, TLSPHI_PATTERNS_SEEN);
    if (!plan->M_of || !plan->M.seen) return tlsphi_no_memory(plan, 4.0 * (double)tiles);
    const double slack = tlsphi_position_slack(plan);
    for (size_t tile = 0; tile < tiles; tile++) {
        tlsph_real lanes[9 * TLSPHI_LANES] = {0};
        for (size_t l = 0; l < TLSPHI_LANES && tile * TLSPHI_LANES + l < plan->n; l++)
            for (size_t i = 0; i < dd; i++)
                lanes[i * TLSPHI_LANES + l] =
                    (tlsph_real)plan->correction[dd * plan->host[tile * TLSPHI_LANES + l] + i];
        plan->M_of[tile] = tlsphi_pattern_number(plan, &plan->M, lanes, dd * TLSPHI_LANES, slack);
        if (plan->M_of[tile] == TLSPHI_NONE) return tlsphi_no_memory(plan, 72.0 * (double)plan->n);
    }
    return TLSPH_OK;
}
static tlsph_result tlsphi_tiles(tlsphi_plan *plan) {
    tlsph_result r = tlsphi_tile_corrections(plan);
    plan->found = TLSPHI_SCRATCH(plan, uint32_t, plan->n);
    plan->tau = TLSPHI_SCRATCH(plan, tlsph_real, plan->n);
    if (!r && (!plan->found || !plan->tau)) return tlsphi_no_memory(plan, 12.0 * (double)plan->n);
    if (!r) r = tlsphi_graph_build(plan, 0);
    return r || !plan->lattice ? r : tlsphi_graph_build(plan, 1);
}

/* -- levels of [MULTI-RATE] -- */

/* Stable step of a particle over cfl. Its stress pushes neighbours, too, which may be lighter. */
static double tlsphi_plan_step(tlsphi_plan *plan, size_t a, const uint32_t *list, const double *g, size_t count) {
    const tlsph_desc *d = plan->desc;
    const uint8_t *of = d->particles.materials;
    const tlsphi_material m = tlsphi_calibrate(d->materials + (of ? of[a] : 0));
    double sum = 0, lightest = 1;
    for (size_t i = 0; i < count; i++) {
        double mine[3] = {0, 0, 0}, other[3] = {0, 0, 0}, middle[3];
        tlsphi_pair_vectors(plan, a, list[i], g + (size_t)plan->dim * i, mine, other, middle);
        sum += sqrt(tlsphi_dot3(mine, mine));
        lightest = tlsphi_dmin(lightest, (double)(d->materials[of ? of[list[i]] : 0].density / m.rho));
    }
    plan->lightest[a] = sqrt(lightest);
    return 2 * plan->dim * tlsphi_plan_volume(plan, a) / sum / (double)m.c_linear * plan->lightest[a];
}
/* Sets so many levels, `least` being the shortest step, and returns the work of a second, in steps of one particle. A
   pass costs about 0.8 of one, for neighbours of its level 0.6, and ending the whole step 0.4. */
static double tlsphi_plan_rates(tlsphi_plan *plan, int levels, const double *dt, double least, uint32_t *list,
                                double *g) {
    const double whole = least * (1 << (levels - 1)) * (1 - 1e-6);
    double work = 0;
    for (size_t a = 0; a < plan->n; a++)
        for (plan->level[a] = 0; dt[a] * (1 << plan->level[a]) < whole;) plan->level[a]++;
    for (size_t a = 0; a < plan->n; a++) {
        const size_t count = tlsphi_neighbours_of(plan, a, list, g);
        plan->seen[a] = 0;
        for (size_t i = 0; i < count; i++)
            if (plan->level[list[i]] != plan->level[a]) plan->seen[a] |= (uint8_t)(1u << plan->level[list[i]]);
        work += levels == 1 ? 1 : 0.4 + 0.8 * (1 << plan->level[a]) + 0.6 * plan->seen[a];
    }
    return work / whole;
}
static tlsph_result tlsphi_plan_levels(tlsphi_plan *plan, uint32_t *list, double *g) {
    double least = TLSPHI_LARGEST, longest = 0, best = TLSPHI_LARGEST;
    plan->levels = 1;
    if (plan->desc->rates < 2) return TLSPH_OK;
    double *dt = TLSPHI_SCRATCH(plan, double, plan->n);
    plan->level = TLSPHI_SCRATCH(plan, uint8_t, plan->n);
    plan->seen = TLSPHI_SCRATCH(plan, uint8_t, plan->n);
    plan->lightest = TLSPHI_SCRATCH(plan, double, plan->n);
    if (!dt || !plan->level || !plan->seen || !plan->lightest) return tlsphi_no_memory(plan, 18.0 * (double)plan->n);
    for (size_t a = 0; a < plan->n; a++) {
        dt[a] = tlsphi_plan_step(plan, a, list, g, tlsphi_neighbours_of(plan, a, list, g));
        least = tlsphi_dmin(least, dt[a]);
        longest = tlsphi_dmax(longest, dt[a]);
    }
    for (int levels = 1; levels <= plan->desc->rates && least * (1 << (levels - 1)) <= longest; levels++) {
        const double work = tlsphi_plan_rates(plan, levels, dt, least, list, g);
        if (work < best) plan->levels = levels;
        best = tlsphi_dmin(best, work);
    }
    tlsphi_plan_rates(plan, plan->levels, dt, least, list, g);
    return TLSPH_OK;
}

/* Its two parts must be those of the same pairs and the same instant. */
static int tlsphi_takes_self_adjoint(const tlsph_desc *d) {
    for (size_t i = 0; i < d->material_count; i++)
        if (d->materials[i].kind == TLSPH_VON_MISES) return 0;
    return (d->integrator == TLSPH_RK2 || d->integrator == TLSPH_SSP_RK3) && d->scheme == TLSPH_EXPLICIT &&
           !d->sharp_gradients && !tlsphi_needs_bonds(d) && d->operator_kind != TLSPH_CELLS_4 && !d->particles.moments;
}
/* Everything that creation can find out without the solver's memory. Leaves scratch for tlsphi_plan_release. */
static tlsph_result tlsphi_plan_make(tlsphi_plan *plan, const tlsph_desc *desc, tlsph_error *error) {
    tlsph_result r;
    memset(plan, 0, sizeof *plan);
    plan->desc = desc;
    plan->error = error;
    tlsphi_no_error(error);
    if (!desc) return tlsphi_plan_fail(plan, TLSPH_ERROR_ARGUMENT, "desc", TLSPH_NO_PARTICLE, 0, 0, "not NULL");
    if ((r = tlsphi_check_description(plan))) return r;
    plan->allocator = tlsphi_allocator(&desc->allocator);
    plan->dim = desc->dimension;
    plan->n = desc->particles.count;
    plan->weights = desc->particles.weights ? desc->particles.weights : desc->particles.volumes;
    if ((r = tlsphi_check_particles(plan)) || (r = tlsphi_check_materials(plan)) || (r = tlsphi_plan_conditions(plan)))
        return r;
    if (tlsphi_is_cells(desc) && (r = tlsphi_cells_build(plan))) return r;
    if (desc->dissipation == TLSPH_SELF_ADJOINT && !tlsphi_takes_self_adjoint(desc))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, "dissipation", TLSPH_NO_PARTICLE, TLSPH_SELF_ADJOINT, 0,
                                "TLSPH_SELF_ADJOINT with TLSPH_RK2 or TLSPH_SSP_RK3, explicit, without sharp gradients, "
                                "bonds, TLSPH_CELLS_4, `moments` and TLSPH_VON_MISES");
    if (desc->operator_kind == TLSPH_CELLS_4 &&
        (desc->sharp_gradients || desc->dissipation == TLSPH_JST || desc->scheme == TLSPH_INCOMPRESSIBLE))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, "operator_kind", TLSPH_NO_PARTICLE, TLSPH_CELLS_4, 0,
                                "TLSPH_CELLS_4 without sharp gradients (it has their order), TLSPH_JST, "
                                "TLSPH_INCOMPRESSIBLE");
    if (desc->operator_kind == TLSPH_CELLS_4 && (r = tlsphi_fourth_build(plan))) return r;
    if (desc->operator_kind == TLSPH_GIVEN && (r = tlsphi_given_check(plan))) return r;
    tlsphi_smoothing_length(plan);
    if ((r = tlsphi_grid_build(plan)) || (r = tlsphi_start_rounding(plan))) return r;
    const size_t most = tlsphi_count_pairs(plan), D = (size_t)plan->dim;
    uint32_t *list = TLSPHI_SCRATCH(plan, uint32_t, most);
    double *g = TLSPHI_SCRATCH(plan, double, D *most);
    uint32_t *parent = TLSPHI_SCRATCH(plan, uint32_t, plan->n);
    if (!list || !g || !parent) return tlsphi_no_memory(plan, 32.0 * (double)most);
    if (((desc->operator_kind == TLSPH_CORRECTED_KERNEL && !tlsphi_needs_bonds(desc)) || tlsphi_has_moments(desc)) &&
        !(plan->correction = TLSPHI_SCRATCH(plan, double, D *D * plan->n)))
        return tlsphi_no_memory(plan, 72.0 * (double)plan->n);
    if (tlsphi_needs_bonds(desc) && !(plan->bond = TLSPHI_SCRATCH(plan, tlsphi_bond, plan->n)))
        return tlsphi_no_memory(plan, (double)sizeof(tlsphi_bond) * (double)plan->n);
    for (size_t a = 0; a < plan->n; a++) parent[a] = (uint32_t)a;
    if (desc->operator_kind == TLSPH_CLOSED && (r = tlsphi_closure_solve(plan, parent, list, g))) return r;
    if ((r = tlsphi_survey(plan, parent, list, g))) return r;
    plan->antisymmetric = 1;
    if (plan->correction) tlsphi_test_antisymmetry(plan, list, g);
    if (desc->sharp_gradients && (!plan->antisymmetric || plan->bond))
        return tlsphi_plan_fail(plan, TLSPH_ERROR_DESCRIPTION, "sharp_gradients", TLSPH_NO_PARTICLE, 1, 0,
                                "0 where C_ab != -C_ba; use TLSPH_CELLS, or a box lattice with support 0.6");
    if ((r = tlsphi_plan_levels(plan, list, g)) || (r = tlsphi_order(plan, parent, list, g))) return r;
    tlsphi_count_blocks(plan);
    return tlsphi_tiles(plan);
}

static void tlsphi_copy_options(tlsph_solver *s, const tlsphi_plan *plan) {
    const tlsph_desc *d = plan->desc;
    s->dim = d->dimension;
    s->thermal = (int)d->thermal;
    s->has_H = d->unknowns == TLSPH_PFHJ || d->unknowns == TLSPH_PFH;
    s->has_J = d->unknowns == TLSPH_PFJ || d->unknowns == TLSPH_PFHJ;
    s->sharp = d->sharp_gradients;
    s->corrected = !plan->antisymmetric;
    s->audit = d->audit;
    s->projection = d->projection;
    s->dissipation_heats = d->dissipation_heats;
    s->threads = d->threads;
    s->dissipation = d->dissipation;
    s->coupling = d->volume_coupling;
    s->conduction = d->conduction;
    s->drift_stiffness = d->drift_stiffness;
    s->drift_scale = d->drift_scale;
    s->jump_share = d->volume_coupling == TLSPH_SPLIT ? d->jump_share : 1;
    s->drift_relaxation = d->drift_relaxation;
    s->cfl = d->cfl;
    s->integrator = d->integrator;
    s->incompressible = d->scheme == TLSPH_INCOMPRESSIBLE;
    s->choice = d->incompressible;
    s->laplacian_share = d->incompressible.laplacian;
    s->leaps = d->integrator == TLSPH_LEAPFROG;
    s->frozen = d->integrator >= TLSPH_RK3_FROZEN && !s->leaps && d->dissipation != TLSPH_NO_DISSIPATION;
    s->damps = 1;
    s->parted = s->frozen || plan->lattice != NULL;
    s->images = plan->images;
    s->bonds = plan->bond != NULL;
    s->force_form = d->force_form;
    s->step_rule = d->step_rule;
    s->retries = d->retries;
    s->limit = d->limit;
    s->harmonic = (double)d->harmonic * plan->h;
    s->biharmonic = (double)d->biharmonic * plan->h * plan->h * plan->h;
    s->n = plan->n;
    s->pairs = plan->pairs;
    s->blocks = plan->blocks;
    s->bodies = plan->bodies;
    s->fixes = plan->fixes;
    s->held_parts = plan->held_parts;
    s->mirrors = plan->mirrors;
    s->material_count = d->material_count;
    s->closure = plan->closure;
    s->run = d->run;
    s->run_user = d->run_user;
    s->linear = s->metal = 1;
    for (size_t i = 0; i < d->material_count; i++) {
        s->linear &= d->materials[i].kind == TLSPH_LINEAR;
        s->conducts |= s->thermal && d->materials[i].conductivity > 0;
        s->has_user |= d->materials[i].kind == TLSPH_USER;
        s->has_plastic |= d->materials[i].kind == TLSPH_VON_MISES;
        s->metal &= d->materials[i].kind == TLSPH_VON_MISES;
    }
    s->rates.levels = plan->levels;
    s->turns = d->projection && d->operator_kind == TLSPH_CLOSED && !s->linear && !s->sharp && !s->incompressible;
    s->gathers_w = s->projection && (s->thermal || s->turns || s->frozen || s->bonds || s->sharp || s->incompressible ||
                                     s->rates.levels > 1); /* F is not that of the pass */
    s->keeps_rate = s->gathers_w || s->linear || s->sharp || s->leaps || s->bonds || s->images || s->incompressible ||
                    tlsphi_has_moments(d);
    s->rows = tlsphi_rows_of(s->dim, s->has_J, s->thermal, s->conducts, s->sharp);
    if (s->dissipation == TLSPH_JST) {
        s->rows.lap_p = s->rows.count;
        s->rows.count += s->dim;
    }
    s->lanes = s->dissipation != TLSPH_AS_PRINTED && !(s->dissipation == TLSPH_JST && s->material_count > 1) &&
               !(s->bonds && s->conducts) && !s->audit &&
               !(s->metal && (s->dissipation == TLSPH_RECONSTRUCTED || s->dissipation == TLSPH_FIRST_ORDER));
    s->heat_moves = s->conducts;
    s->keeps_pairs = d->keep_pairs || !s->lanes || s->incompressible || d->particles.moments ||
                     s->step_rule != TLSPH_STEP_BY_PARTICLE;
    s->super.most = s->conducts && d->conduction_stages ? (d->conduction_stages - 1) | 1 : 0; /* odd: RKL2 damps better */
    for (size_t i = 0; i < d->condition_count; i++) {
        const tlsph_condition_kind kind = d->conditions[i].kind;
        s->loads += tlsphi_is_constraint(kind) ? 0 : 1;
        s->constrains |= kind == TLSPH_VELOCITY || kind == TLSPH_WALL || kind == TLSPH_TEMPERATURE;
    }
}

static void tlsphi_layout_state(tlsph_solver *s, tlsphi_arena *arena) {
    const size_t D = (size_t)s->dim, n = s->n, tensor = tlsphi_tensor_reals(n, D * D);
    const size_t plastic = s->has_plastic ? n * tlsphi_plastic_reals(s->dim, s->thermal) : 0;
    const size_t reals[8] = {tensor, s->has_H ? tensor : 0, D * n, D * n, /* F first, on a boundary of cache lines */
                             s->has_J ? n : 0, s->thermal ? n : 0, plastic, s->incompressible ? n : 0};
    s->state_reals = 0;
    for (int k = 0; k < 8; k++) s->state_reals += reals[k];
    s->now_memory = TLSPHI_TAKE(arena, tlsph_real, s->state_reals);
    s->old_memory = TLSPHI_TAKE(arena, tlsph_real, s->state_reals);
    if (!arena->memory || arena->overflow) return;
    for (int i = 0; i < 2; i++) {
        tlsphi_state *u = i ? &s->old : &s->now;
        tlsph_real *at = i ? s->old_memory : s->now_memory;
        tlsph_real **const parts[8] = {&u->F, &u->H, &u->x, &u->p, &u->J, &u->E, &u->plastic, &u->q};
        for (int k = 0; k < 8; at += reals[k++]) *parts[k] = reals[k] ? at : NULL;
    }
}
static void tlsphi_layout_work(tlsph_solver *s, tlsphi_arena *arena) {
    const size_t D = (size_t)s->dim, n = s->n;
    s->rate_p = TLSPHI_TAKE(arena, tlsph_real, D * n);
    if (s->keeps_rate) s->rate_F = TLSPHI_TAKE(arena, tlsph_real, tlsphi_tensor_reals(n, D * D));
    s->row = TLSPHI_TAKE(arena, tlsph_real, s->blocks * (size_t)s->rows.count * TLSPHI_ROW);
    if (s->frozen || s->leaps) s->held = TLSPHI_TAKE(arena, tlsph_real, tlsphi_tensor_reals(n, D + 2));
    if (s->rates.levels > 1) {
        s->rates.of = TLSPHI_TAKE(arena, uint8_t, n);
        s->rates.list = TLSPHI_TAKE(arena, uint32_t, s->blocks * (size_t)s->rates.levels);
        s->rates.was = TLSPHI_TAKE(arena, tlsph_real, (size_t)s->rates.levels * D * n);
    }
    if (s->step_rule == TLSPH_STEP_BY_PAIR) s->least_stretch = TLSPHI_TAKE(arena, tlsph_real, n);
    if (s->dissipation == TLSPH_JST) s->lean = TLSPHI_TAKE(arena, tlsph_real, 2 * D * n);
    if (s->has_J) s->rate_J = TLSPHI_TAKE(arena, tlsph_real, n);
    if (s->thermal) s->rate_E = TLSPHI_TAKE(arena, tlsph_real, n);
    if (s->super.most) {
        tlsph_real **const arrays[6] = {&s->super.first, &s->super.previous, &s->super.current,
                                        &s->super.rate,  &s->super.source,   &s->super.E};
        for (int i = 0; i < 6; i++) *arrays[i] = TLSPHI_TAKE(arena, tlsph_real, n);
    }
}
static void tlsphi_layout_pressure(tlsph_solver *s, tlsphi_arena *arena) {
    const size_t D = (size_t)s->dim, n = s->n;
    tlsphi_pressure *const u = &s->pressure;
    tlsph_real **const scalars[8] = {&u->b, &u->diagonal, &u->compact, &u->q, &u->r, &u->z, &u->p, &u->Sp};
    if (!s->incompressible) return;
    for (int i = 0; i < 8; i++) *scalars[i] = TLSPHI_TAKE(arena, tlsph_real, n);
    u->A = TLSPHI_TAKE(arena, tlsph_real, D * D * n);
    u->a = TLSPHI_TAKE(arena, tlsph_real, D * n);
    u->slope = TLSPHI_TAKE(arena, tlsph_real, D * n);
    u->back = TLSPHI_TAKE(arena, tlsph_real, D * n);
    if (s->choice.iteration == TLSPH_DUAL_TIME) u->velocity = TLSPHI_TAKE(arena, tlsph_real, D * n);
}
static void tlsphi_layout_loads(tlsph_solver *s, tlsphi_arena *arena, const tlsphi_plan *plan) {
    s->load = TLSPHI_TAKE(arena, tlsphi_load, s->loads);
    for (size_t k = 0, at = 0; k < plan->desc->condition_count; k++) {
        const tlsph_condition *c = plan->desc->conditions + k;
        const size_t count = tlsphi_set_size(plan, c), components = (size_t)tlsphi_condition_components(c->kind);
        const int has_area = c->kind == TLSPH_TRACTION || c->kind == TLSPH_HEAT_FLUX || c->kind == TLSPH_PRESSURE;
        tlsphi_load load;
        if (tlsphi_is_constraint(c->kind)) continue;
        memset(&load, 0, sizeof load);
        load.given = *c;
        load.given.count = count;
        load.inner = TLSPHI_TAKE(arena, uint32_t, count);
        load.host = TLSPHI_TAKE(arena, uint32_t, count);
        load.area =
            TLSPHI_TAKE(arena, tlsph_real, has_area ? count * (c->kind == TLSPH_PRESSURE ? (size_t)s->dim : 1) : 0);
        load.values = TLSPHI_TAKE(arena, tlsph_real, count * components);
        load.X = TLSPHI_TAKE(arena, tlsph_real, c->values ? 3 * count : 0);
        load.x = TLSPHI_TAKE(arena, tlsph_real, c->values ? 3 * count : 0);
        load.before = TLSPHI_TAKE(arena, tlsph_real, c->kind == TLSPH_VELOCITY ? count : 0);
        if (tlsphi_has_moments(plan->desc) && (has_area || c->kind == TLSPH_VELOCITY || c->kind == TLSPH_TEMPERATURE))
            load.part = TLSPHI_TAKE(arena, tlsphi_part, count);
        if (s->load && !arena->overflow) s->load[at++] = load;
    }
}
static void tlsphi_layout_graph(tlsphi_arena *arena, const tlsphi_graph *plan, tlsphi_graph *out) {
    *out = *plan;
    out->first = TLSPHI_TAKE(arena, size_t, plan->tiles + 1);
    out->slot = TLSPHI_TAKE(arena, tlsphi_slot, plan->slots);
    out->gathered = TLSPHI_TAKE(arena, uint32_t, plan->gathers * TLSPHI_LANES);
    out->pattern = TLSPHI_TAKE(arena, tlsph_real, plan->patterns * (size_t)plan->width * TLSPHI_LANES);
}
/* Gives every array its place. Called twice: without memory to count, then with it. */
static void tlsphi_layout(tlsph_solver *s, tlsphi_arena *arena, const tlsphi_plan *plan) {
    const size_t D = (size_t)s->dim, n = s->n;
    (void)TLSPHI_TAKE(arena, tlsph_solver, 1);
    s->materials = TLSPHI_TAKE(arena, tlsphi_material, s->material_count);
    const size_t fixed = arena->used;
    if (s->material_count > 1) s->material_of = TLSPHI_TAKE(arena, uint8_t, n);
    if (s->material_count > 1 || s->rates.levels > 1) s->beside = TLSPHI_TAKE(arena, tlsph_real, 2 * n);
    s->block = TLSPHI_TAKE(arena, tlsphi_block, s->blocks);
    s->body = TLSPHI_TAKE(arena, tlsphi_body, s->bodies);
    s->host = TLSPHI_TAKE(arena, uint32_t, n);
    s->inner = TLSPHI_TAKE(arena, uint32_t, n);
    s->V = TLSPHI_TAKE(arena, tlsph_real, n);
    s->areas = plan->areas;
    s->B_of = TLSPHI_TAKE(arena, uint32_t, s->areas);
    s->B = TLSPHI_TAKE(arena, tlsph_real, D * s->areas);
    s->tau = TLSPHI_TAKE(arena, tlsph_real, n);
    tlsphi_layout_state(s, arena);
    tlsphi_layout_work(s, arena);
    tlsphi_layout_pressure(s, arena);
    if (s->corrected) s->M_of = TLSPHI_TAKE(arena, uint32_t, (n - 1) / TLSPHI_LANES + 1);
    if (s->corrected) s->M = TLSPHI_TAKE(arena, tlsph_real, D * D * TLSPHI_LANES * plan->M.count);
    s->fix = TLSPHI_TAKE(arena, tlsphi_fix, s->fixes);
    s->mirror = TLSPHI_TAKE(arena, tlsphi_mirror, s->mirrors ? s->mirrors + 1 : 0);
    if (s->mirrors) s->mirror_of = TLSPHI_TAKE(arena, uint32_t, n);
    tlsphi_layout_loads(s, arena, plan);
    s->held_part = TLSPHI_TAKE(arena, tlsphi_held_part, s->held_parts);
    s->found = TLSPHI_TAKE(arena, uint32_t, n);
    const size_t before_pairs = arena->used;
    s->size.bytes_per_particle = (before_pairs - fixed) / n;
    if (s->keeps_pairs) s->first = TLSPHI_TAKE(arena, size_t, n + 1);
    if (s->keeps_pairs) s->neighbour = TLSPHI_TAKE(arena, uint32_t, s->pairs);
    if (s->keeps_pairs) s->g = TLSPHI_TAKE(arena, tlsph_real, D * s->pairs);
    const int apart = s->keeps_pairs && plan->lattice;
    s->damped_first = apart ? TLSPHI_TAKE(arena, size_t, n + 1) : s->first;
    s->damped_neighbour = apart ? TLSPHI_TAKE(arena, uint32_t, plan->damped_pairs) : s->neighbour;
    s->damped_g = apart ? TLSPHI_TAKE(arena, tlsph_real, D * plan->damped_pairs) : s->g;
    s->image = TLSPHI_TAKE(arena, tlsphi_image, s->images);
    if (s->bonds && s->keeps_pairs) s->rest = TLSPHI_TAKE(arena, tlsph_real, D * s->pairs);
    if (s->dissipation == TLSPH_JST && s->keeps_pairs) s->laplacian = TLSPHI_TAKE(arena, tlsph_real, s->pairs);
    tlsphi_layout_graph(arena, plan->graph, &s->graph);
    if (s->super.most && s->conduction == TLSPH_COMPACT && !s->bonds)
        s->super.conductance = TLSPHI_TAKE(arena, tlsph_real, TLSPHI_LANES * plan->graph->slots);
    if (plan->lattice) tlsphi_layout_graph(arena, plan->graph + 1, &s->damped_graph);
    else s->damped_graph = s->graph;
    s->size.bytes_per_pair = (arena->used - before_pairs) / (s->pairs ? s->pairs : 1);
    s->size.bytes = arena->used + 63;
    s->size.pairs = s->pairs;
    s->size.neighbours_least = plan->least;
    s->size.neighbours_most = plan->most;
    s->size.rates = plan->levels;
}

/* -- filling the block -- */

static void tlsphi_fill_blocks(tlsph_solver *s, const tlsphi_plan *plan) {
    tlsphi_block *block = s->block - 1;
    uint32_t tiles = 0;
    for (size_t a = 0; a < s->n; a++) {
        if (a == 0 || plan->body[a] != plan->body[a - 1]) s->body[plan->body[a]].first = (uint32_t)a;
        if (tlsphi_block_begins(plan, a)) {
            (++block)->begin = (uint32_t)a;
            block->body = plan->body[a];
            block->tile = tiles;
        }
        tiles += tlsphi_tile_begins(plan, a) ? 1 : 0;
        block->end = (uint32_t)(a + 1);
    }
}
static void tlsphi_fill_graph(const tlsphi_graph *plan, tlsphi_graph *out) {
    memcpy(out->first, plan->first, (plan->tiles + 1) * sizeof *plan->first);
    if (plan->slots) memcpy(out->slot, plan->slot, plan->slots * sizeof *plan->slot);
    if (plan->gathers) memcpy(out->gathered, plan->gathered, plan->gathers * TLSPHI_LANES * sizeof *plan->gathered);
    if (plan->patterns)
        memcpy(out->pattern, plan->pattern, plan->patterns * (size_t)plan->width * TLSPHI_LANES * sizeof *plan->pattern);
}
static void tlsphi_fill_particles(tlsph_solver *s, const tlsphi_plan *plan) {
    const size_t D = (size_t)s->dim;
    for (size_t a = 0; a < s->n; a++) {
        const uint32_t h = plan->host[a];
        s->host[a] = h;
        s->inner[h] = (uint32_t)a;
        s->V[a] = (tlsph_real)tlsphi_plan_volume(plan, h);
        if (s->material_of)
            s->material_of[a] = plan->desc->particles.materials ? plan->desc->particles.materials[h] : 0;
        *tlsphi_at(s, s->rows.wave + 2, a) = tlsphi_material_of(s, a)->rho;
        for (size_t i = 0; i < D; i++) {
            s->now.x[D * a + i] = plan->desc->particles.positions[3 * h + i];
            tlsphi_at(s, s->rows.X, a)[i * TLSPHI_ROW] = s->now.x[D * a + i];
            s->now.F[tlsphi_tensor_at(D * D, a) + (D + 1) * i * TLSPHI_LANES] = 1;
            if (s->has_H) s->now.H[tlsphi_tensor_at(D * D, a) + (D + 1) * i * TLSPHI_LANES] = 1;
        }
        if (s->has_J) s->now.J[a] = 1;
        if (s->now.plastic)
            tlsphi_store_plastic(s->dim, s->thermal, &tlsphi_virgin,
                                 s->now.plastic + tlsphi_plastic_reals(s->dim, s->thermal) * a);
    }
    if (!s->M) return;
    memcpy(s->M_of, plan->M_of, ((s->n - 1) / TLSPHI_LANES + 1) * sizeof *s->M_of);
    memcpy(s->M, plan->M.pattern, plan->M.count * D * D * TLSPHI_LANES * sizeof *s->M);
}

/* Boundary vectors, the time step's lengths, and the pairs, where they are kept. */
static void tlsphi_fill_pairs(tlsph_solver *s, const tlsphi_plan *plan, uint32_t *list, double *g) {
    const size_t D = (size_t)s->dim;
    memcpy(s->tau, plan->tau, s->n * sizeof *s->tau);
    if (s->areas) memcpy(s->B_of, plan->B_of, s->areas * sizeof *s->B_of);
    if (s->areas) memcpy(s->B, plan->B, D * s->areas * sizeof *s->B);
    memcpy(s->found, plan->found, s->n * sizeof *s->found);
    for (size_t a = 0; s->keeps_pairs && a < s->n; a++) {
        const uint32_t h = plan->host[a];
        const size_t start = s->first[a], count = tlsphi_neighbours_of(plan, h, list, g);
        s->first[a + 1] = start + count;
        TLSPH_ASSERT(start + count <= s->pairs);
        for (size_t i = 0; i < count; i++) list[i] = plan->inner[list[i]];
        tlsphi_sort_pairs(s->dim, list, g, count);
        for (size_t i = 0; i < count; i++) {
            double mine[3] = {0, 0, 0}, other[3] = {0, 0, 0}, C[3];
            tlsphi_pair_vectors(plan, h, plan->host[list[i]], g + D * i, mine, other, C);
            s->neighbour[start + i] = list[i];
            for (size_t k = 0; k < D; k++) {
                if (s->rest) s->rest[D * (start + i) + k] = (tlsph_real)(mine[k] - C[k]);
                s->g[D * (start + i) + k] = (tlsph_real)(s->M ? g[D * i + k] : C[k]);
            }
        }
    }
}
/* TLSPH_CELLS_4: pairs of the dissipation, images. */
static void tlsphi_fill_fourth(tlsph_solver *s, const tlsphi_plan *plan, uint32_t *list, double *g) {
    const size_t D = (size_t)s->dim;
    size_t at = 0, image = 0;
    for (size_t a = 0; plan->lattice && a < s->n; a++) {
        const size_t count = tlsphi_damped_pairs_of(plan, plan->host[a], list, g);
        tlsphi_stencil stencil;
        tlsphi_stencil_of(plan, plan->host[a], &stencil);
        for (size_t i = 0; i < count; i++) list[i] = plan->inner[list[i]];
        tlsphi_sort_pairs(s->dim, list, g, count);
        for (size_t i = 0; s->keeps_pairs && i < count; i++, at++) {
            s->damped_neighbour[at] = list[i];
            for (size_t k = 0; k < D; k++) s->damped_g[D * at + k] = (tlsph_real)g[D * i + k];
        }
        if (s->keeps_pairs) s->damped_first[a + 1] = at;
        for (int i = 0; i < 6; i++) {
            if (!(stencil.image[i] > 0)) continue;
            s->image[image].particle = (uint32_t)a;
            s->image[image].tangent = stencil.image_kind[i] == TLSPH_TANGENT;
            s->image[image].axis = i / 2;
            s->image[image++].c = (tlsph_real)(i % 2 ? -stencil.image[i] : stencil.image[i]);
        }
    }
}
/* l_ab, what corrects it, and the step that the dissipation allows by Gershgorin's bound 2 sum_b l_ab / V_a. */
static void tlsphi_fill_laplacian(tlsph_solver *s) {
    const size_t D = (size_t)s->dim;
    double fastest = 0;
    for (size_t a = 0; s->laplacian && a < s->n; a++)
        for (size_t k = s->first[a]; k < s->first[a + 1]; k++)
            s->laplacian[k] = tlsphi_pair_laplacian(s, a, s->neighbour[k], k);
    for (size_t i = 0; s->lean && i < s->blocks; i++)
        for (size_t a = s->block[i].begin, tile = s->block[i].tile, end; a < s->block[i].end; tile++)
            for (end = tlsphi_tile_end(s->block + i, a); a < end; a++) {
                tlsph_real lean[3], turned[3];
                const tlsph_real sum = tlsphi_laplacian_lean(s, tile, a, lean, turned);
                const double bound = 2 * (double)(sum / s->V[a]), c = (double)tlsphi_material_of(s, a)->c_linear;
                fastest = tlsphi_dmax(fastest, c * bound * (s->harmonic + s->biharmonic * bound));
                for (size_t k = 0; k < D; k++) {
                    s->lean[2 * D * a + k] = turned[k];
                    s->lean[2 * D * a + D + k] = lean[k];
                }
            }
    s->jst_step = fastest > 0 && s->step_rule == TLSPH_STEP_BY_PARTICLE ? TLSPHI_JST_STEP / fastest : TLSPHI_LARGEST;
}
/* Where materials meet, a particle feels half of its neighbour's stiffness M = rho c_p^2 and conductivity with its own mass
   and heat capacity: it vibrates as if its sound were that of (M_a + M_b)/(2 rho_a). By this its step is shortened. */
static void tlsphi_fill_interfaces(tlsph_solver *s, const tlsphi_plan *plan, uint32_t *list, double *g) {
    for (size_t a = 0; s->beside && a < s->n; a++) {
        const size_t count = tlsphi_neighbours_of(plan, plan->host[a], list, g);
        const tlsphi_material *m = tlsphi_material_of(s, a);
        double stiffest = 1, h = (double)m->h;
        for (size_t i = 0; i < count; i++) {
            const tlsphi_material *other = tlsphi_material_of(s, plan->inner[list[i]]);
            const double speeds = (double)(other->c_linear / m->c_linear);
            stiffest = tlsphi_dmax(stiffest, (1 + (double)(other->rho / m->rho) * speeds * speeds) / 2);
            h = tlsphi_dmax(h, (double)(m->h + other->h) / 2);
        }
        s->beside[2 * a] = (tlsph_real)(1 / sqrt(stiffest));
        s->beside[2 * a + 1] = (tlsph_real)h;
    }
}
/* Levels, the blocks of each, and by how much longer than a particle's own step the whole one may be. */
static void tlsphi_fill_rates(tlsph_solver *s, const tlsphi_plan *plan) {
    tlsphi_rates *rates = &s->rates;
    size_t at = 0;
    if (rates->levels < 2) return;
    for (size_t i = 0; i < s->blocks; i++) {
        tlsphi_block *block = s->block + i;
        for (size_t a = block->begin; a < block->end; a++) {
            const uint32_t h = plan->host[a];
            rates->of[a] = plan->level[h];
            s->beside[2 * a] = (tlsph_real)(plan->lightest[h] * (1 << plan->level[h]));
            block->seen |= plan->seen[h];
        }
        block->level = rates->of[block->begin];
    }
    for (int l = 0; l < rates->levels; l++)
        for (int other = 0; other < 2; other++) {
            rates->first[2 * l + other] = at;
            for (uint32_t i = 0; i < s->blocks; i++)
                if (other ? s->block[i].seen >> l & 1 : s->block[i].level == l) rates->list[at++] = i;
        }
    rates->first[2 * rates->levels] = at;
}
static void tlsphi_fill_fixes(tlsph_solver *s, const tlsphi_plan *plan) {
    const size_t D = (size_t)s->dim;
    size_t at = 0;
    for (size_t a = 0; s->fixes && a < s->n; a++) {
        const uint32_t h = plan->host[a];
        for (size_t k = 0; k < plan->fixed[h]; k++, at++) {
            s->fix[at].particle = (uint32_t)a;
            for (size_t i = 0; i < D; i++) s->fix[at].e[i] = (tlsph_real)plan->fixed_direction[D * D * h + D * k + i];
        }
    }
}
/* Mirrors sorted by particle, with a sentinel behind the last. */
static void tlsphi_fill_mirrors(tlsph_solver *s, const tlsphi_plan *plan) {
    if (!s->mirrors) return;
    for (size_t a = 0; a < s->n; a++) s->mirror_of[a] = 0;
    /* count, then place: mirror_of first counts up to each particle's end, then is walked back */
    for (int pass = 0; pass < 2; pass++) {
        for (size_t k = 0; k < plan->desc->condition_count; k++) {
            const tlsph_condition *c = plan->desc->conditions + k;
            if (c->kind != TLSPH_ROLLER && c->kind != TLSPH_TANGENT) continue;
            double N[3];
            tlsphi_unit_normal(c, s->dim, N);
            for (size_t i = 0; i < tlsphi_set_size(plan, c); i++) {
                const uint32_t a = plan->inner[tlsphi_set_host(c, i)];
                if (tlsphi_owns_surface(plan->desc, plan->host[a])) continue;
                if (!pass) {
                    s->mirror_of[a]++;
                    continue;
                }
                tlsphi_mirror *m = s->mirror + --s->mirror_of[a];
                m->particle = a;
                m->tangent = c->kind == TLSPH_TANGENT;
                m->conducts = c->conducts;
                for (int j = 0; j < 3; j++) m->N[j] = (tlsph_real)N[j];
            }
        }
        for (size_t a = 1; !pass && a < s->n; a++) s->mirror_of[a] += s->mirror_of[a - 1];
    }
    s->mirror[s->mirrors].particle = TLSPHI_NONE;
    for (size_t a = 0; a < s->n; a++)
        if (s->mirror[s->mirror_of[a]].particle != a) s->mirror_of[a] = TLSPHI_NONE;
}
/* What the mirror planes leave of the three axes about which a body may turn (see [PROJECTION]). */
static void tlsphi_fill_turns(tlsph_solver *s) {
    for (size_t i = 0; i < s->bodies; i++) s->body[i].turns = 3;
    for (size_t i = 0; i < s->blocks; i++) {
        tlsphi_body *body = s->body + s->block[i].body;
        for (size_t a = s->block[i].begin; a < s->block[i].end; a++)
            for (const tlsphi_mirror *m = tlsphi_mirrors_of(s, a); m && m->particle == a; m++) {
                const double N[3] = {(double)m->N[0], (double)m->N[1], (double)m->N[2]};
                const int same = body->turns == 1 && fabs(tlsphi_dot3(body->axis, N)) > 1 - 1e-6;
                if (m->tangent || (body->turns < 3 && !same)) body->turns = 0;
                if (body->turns < 3) continue;
                body->turns = 1;
                memcpy(body->axis, N, sizeof N);
            }
    }
}
/* Reference area of a load on one particle: given, or from the operator's boundary vector. */
static void tlsphi_fill_area(const tlsph_solver *s, const tlsphi_load *load, const tlsph_condition *c, size_t i) {
    const size_t D = (size_t)s->dim, a = load->inner[i];
    const tlsph_real *B = tlsphi_boundary(s, a), *N = tlsphi_condition_face(s->dim, c);
    const tlsph_real size = N ? tlsphi_sqrt(tlsphi_any_dot(s->dim, N, N)) : 0;
    const tlsph_real along = N ? tlsphi_any_dot(s->dim, B, N) / size : 0, BB = tlsphi_any_dot(s->dim, B, B);
    if (c->kind == TLSPH_PRESSURE) {
        for (size_t k = 0; k < D; k++) {
            load->area[D * i + k] = c->areas ? c->areas[3 * i + k] : N ? along * N[k] / size : B[k];
            for (size_t l = 0; load->part && c->areas && l < D; l++)
                load->part[i].T[D * k + l] = c->areas[3 * i + k] * load->part[i].o[l];
        }
        return;
    }
    load->area[i] = c->areas ? c->areas[i] : N == c->face ? tlsphi_abs(along) : N ? along : tlsphi_sqrt(BB);
}
/* The part of particle a's share of the surface that a condition means: all, or N N.B with moment N (x) T^T N. */
static tlsphi_part tlsphi_part_of(const tlsph_solver *s, const tlsphi_plan *plan, const tlsph_condition *c, size_t a) {
    const size_t D = (size_t)s->dim;
    const tlsph_real *T = plan->desc->particles.moments + 9 * plan->host[a], *N = tlsphi_condition_face(s->dim, c);
    const tlsph_real *B = tlsphi_boundary(s, a);
    const tlsph_real NN = N ? tlsphi_any_dot(s->dim, N, N) : 1;
    const tlsph_real along = N ? tlsphi_any_dot(s->dim, B, N) / NN : 0;
    tlsphi_part out;
    double A[9];
    memset(&out, 0, sizeof out);
    tlsphi_closed_moment(plan, plan->host[a], A);
    for (size_t j = 0; j < D * D; j++) out.W[j] = (tlsph_real)A[3 * (j / D) + j % D] / s->V[a];
    for (size_t i = 0; i < D; i++) out.B[i] = N ? along * N[i] : B[i];
    for (size_t i = 0; i < D * D; i++)
        for (size_t k = 0; k < D; k++)
            out.T[i] += N ? N[i / D] * N[k] * T[3 * k + i % D] / NN : k == i / D ? T[3 * k + i % D] : 0;
    for (size_t i = 0; i < D; i++)
        for (size_t k = 0; k < D; k++)
            out.o[i] += out.T[D * k + i] * out.B[k] * tlsphi_inverse_or_0(tlsphi_dot(3, out.B, out.B));
    return out;
}
/* Parts whose velocity is held, sorted by particle: count into the particles' first part, then place. */
static tlsph_result tlsphi_fill_held_parts(tlsph_solver *s, tlsphi_plan *plan) {
    const tlsph_desc *d = plan->desc;
    size_t *at = s->held_parts ? TLSPHI_SCRATCH(plan, size_t, s->n + 1) : NULL;
    if (!s->held_parts) return TLSPH_OK;
    if (!at) return tlsphi_no_memory(plan, 8.0 * (double)s->n);
    for (int pass = 0; pass < 2; pass++) {
        uint32_t load = 0;
        for (size_t k = 0; k < d->condition_count; k++) {
            const tlsph_condition *c = d->conditions + k;
            for (size_t i = 0; tlsphi_holds_velocity(c->kind) && i < tlsphi_set_size(plan, c); i++) {
                const uint32_t host = tlsphi_set_host(c, i), a = plan->inner[host];
                double N[3] = {0, 0, 0};
                if (!tlsphi_owns_surface(d, host)) continue;
                if (!pass) at[a + 1]++;
                if (!pass) continue;
                tlsphi_held_part *h = s->held_part + at[a]++;
                memset(h, 0, sizeof *h);
                h->particle = a;
                h->load = c->kind == TLSPH_VELOCITY ? load : TLSPHI_NONE;
                h->item = (uint32_t)i;
                h->along = c->kind == TLSPH_TANGENT ? -1
                                                    : c->kind != TLSPH_CLAMPED &&
                                                          tlsphi_any_dot(s->dim, c->normal, c->normal) > 0;
                h->mirror = tlsphi_is_constraint(c->kind) && h->along && d->mirror_gradients;
                if (h->along) tlsphi_unit_normal(c, s->dim, N);
                for (size_t j = 0; j < 3; j++) h->N[j] = (tlsph_real)N[j];
                h->part = tlsphi_part_of(s, plan, c, a);
                tlsph_real MB[3] = {0, 0, 0}; /* sum of g is -B */
                tlsphi_correct_vector(s, a, s->dim, tlsphi_boundary(s, a), MB);
                const tlsph_real own = 1 + tlsphi_max(0, tlsphi_any_dot(s->dim, h->part.o, MB)) / (2 * s->V[a]);
                h->damping = 1 / (own * own);
            }
            load += !tlsphi_is_constraint(c->kind);
        }
        for (size_t a = 0; !pass && a < s->n; a++) at[a + 1] += at[a];
    }
    return TLSPH_OK;
}
static void tlsphi_fill_loads(tlsph_solver *s, const tlsphi_plan *plan) {
    size_t at = 0;
    for (size_t k = 0; k < plan->desc->condition_count; k++) {
        const tlsph_condition *c = plan->desc->conditions + k;
        if (tlsphi_is_constraint(c->kind)) continue;
        tlsphi_load *load = s->load + at++;
        const int has_area = c->kind == TLSPH_TRACTION || c->kind == TLSPH_HEAT_FLUX || c->kind == TLSPH_PRESSURE;
        for (size_t i = 0; i < load->given.count; i++) {
            load->host[i] = tlsphi_set_host(c, i);
            load->inner[i] = plan->inner[load->host[i]];
            if (load->part) load->part[i] = tlsphi_part_of(s, plan, c, load->inner[i]);
            if (has_area) tlsphi_fill_area(s, load, c, i);
        }
        load->given.particles = NULL;
        load->given.areas = NULL;
        if (c->kind == TLSPH_WALL) {
            double N[3];
            tlsphi_unit_normal(c, s->dim, N);
            for (int i = 0; i < 3; i++) load->given.normal[i] = (tlsph_real)N[i];
        }
    }
}

static uint64_t tlsphi_hash_reals(uint64_t h, const tlsph_real *x, size_t n) {
    for (size_t i = 0; i < n; i++) {
        unsigned char bytes[8], *at = bytes;
        tlsphi_put_real(&at, x[i]);
        h = tlsphi_hash(h, bytes, (size_t)(at - bytes));
    }
    return h;
}
/* What a checkpoint must agree with: the layout of the state, the reference geometry and the materials. */
static uint64_t tlsphi_fingerprint(const tlsph_solver *s) {
    const unsigned char options[7] = {(unsigned char)s->dim,      (unsigned char)s->thermal,
                                      (unsigned char)s->has_H,    (unsigned char)s->has_J,
                                      (unsigned char)s->coupling, (unsigned char)s->material_count,
                                      (unsigned char)s->incompressible};
    uint64_t h = tlsphi_hash(0xcbf29ce484222325u, options, sizeof options);
    for (size_t i = 0; i < s->n; i++) {
        const size_t a = s->inner[i];
        tlsph_real X[3];
        tlsphi_row_get(s, s->rows.X, s->dim, a, X);
        h = tlsphi_hash_reals(h, X, (size_t)s->dim);
        h = tlsphi_hash_reals(h, s->V + a, 1);
        if (s->material_of) h = tlsphi_hash(h, s->material_of + a, 1);
    }
    for (size_t i = 0; i < s->material_count; i++) {
        const tlsphi_material *m = s->materials + i;
        const tlsph_real constants[12] = {m->rho, m->c_v,  m->theta_R, m->h,     m->zeta,      m->gamma,
                                          m->k,   m->beta, m->q,       m->yield, m->hardening, m->heating};
        const unsigned char kind = (unsigned char)m->kind;
        h = tlsphi_hash_reals(tlsphi_hash(h, &kind, 1), constants, 12);
    }
    return h;
}

/* Fills a solver whose arrays have their places. */
static tlsph_result tlsphi_fill_solver(tlsph_solver *s, tlsphi_plan *plan) {
    uint32_t *list = TLSPHI_SCRATCH(plan, uint32_t, plan->most);
    double *g = TLSPHI_SCRATCH(plan, double, (size_t)plan->dim * plan->most);
    if (!list || !g) return tlsphi_no_memory(plan, 32.0 * (double)plan->most);
    for (size_t i = 0; i < s->material_count; i++) s->materials[i] = tlsphi_calibrate(plan->desc->materials + i);
    for (size_t i = 0; s->incompressible && i < s->material_count; i++) {
        const tlsph_material *m = plan->desc->materials + i;
        s->materials[i].compressibility = 3 * (1 - 2 * m->poisson) / m->young;
        s->materials[i].k = s->materials[i].kappa = 0;
        s->materials[i].c_linear = tlsphi_sqrt(TLSPHI_R(4.0 / 3.0) * s->materials[i].mu / m->density);
    }
    tlsphi_fill_blocks(s, plan);
    tlsphi_fill_graph(plan->graph, &s->graph);
    if (plan->lattice) tlsphi_fill_graph(plan->graph + 1, &s->damped_graph);
    TLSPH_ASSERT(s->block[s->blocks - 1].end == s->n);
    tlsphi_fill_particles(s, plan);
    tlsphi_fill_pairs(s, plan, list, g);
    tlsphi_fill_fourth(s, plan, list, g);
    tlsphi_fill_laplacian(s);
    tlsphi_fill_interfaces(s, plan, list, g);
    tlsphi_fill_rates(s, plan);
    tlsphi_fill_fixes(s, plan);
    tlsphi_fill_mirrors(s, plan);
    tlsphi_fill_turns(s);
    tlsphi_fill_loads(s, plan);
    const tlsph_result held = tlsphi_fill_held_parts(s, plan);
    if (held) return held;
    s->fingerprint = tlsphi_fingerprint(s);
    tlsphi_no_error(&s->error);
    for (size_t a = 0; s->thermal && a < s->n; a++) {
        *tlsphi_theta(s, a) = tlsphi_material_of(s, a)->theta_R;
        tlsphi_set_temperature(s, a, tlsphi_material_of(s, a)->theta_R);
    }
    tlsphi_stage start;
    memset(&start, 0, sizeof start);
    start.a = 1; /* the driven velocity replaces the old one, which is zero */
    tlsphi_keep_state(s);
    tlsphi_impose(s, &start, 0);
    const tlsphi_block *bad = tlsphi_evaluate(s);
    if (bad) {
        const tlsph_result r = tlsphi_describe_failure(s, bad, "create");
        if (plan->error) *plan->error = s->error;
        return r;
    }
    tlsph_ledger_reset(s);
    return TLSPH_OK;
}

/* Counts bytes into s->size; `s` may be a temporary. */
static tlsph_result tlsphi_measure_plan(tlsph_solver *s, const tlsphi_plan *plan) {
    tlsphi_arena arena;
    memset(&arena, 0, sizeof arena);
    memset(s, 0, sizeof *s);
    tlsphi_copy_options(s, plan);
    tlsphi_layout(s, &arena, plan);
    if (!arena.overflow) return TLSPH_OK;
    return tlsphi_fail(plan->error, TLSPH_ERROR_SIZE, "create", "bytes", TLSPH_NO_PARTICLE, (double)s->n, 0,
                       "what an address can reach");
}
TLSPHI_DEF tlsph_result tlsph_measure(const tlsph_desc *desc, tlsph_size *size, tlsph_error *error) {
    tlsphi_plan plan;
    tlsph_solver s;
    tlsph_result r = tlsphi_plan_make(&plan, desc, error);
    if (!r) r = tlsphi_measure_plan(&s, &plan);
    if (!r && size) *size = s.size;
    tlsphi_plan_release(&plan);
    return r;
}

/* The solver's block: the caller's, or one from the allocator. */
static tlsph_result tlsphi_take_block(tlsphi_plan *plan, const tlsph_size *size, tlsphi_arena *arena) {
    const tlsph_desc *d = plan->desc;
    memset(arena, 0, sizeof *arena);
    arena->size = size->bytes;
    if (d->memory && d->memory_size < size->bytes)
        return tlsphi_plan_fail(plan, TLSPH_ERROR_SIZE, "memory_size", TLSPH_NO_PARTICLE, (double)d->memory_size,
                                (double)size->bytes, "tlsph_measure's bytes or more");
    arena->memory =
        (unsigned char *)(d->memory ? d->memory : plan->allocator.allocate(plan->allocator.user, size->bytes));
    return arena->memory ? TLSPH_OK : tlsphi_no_memory(plan, (double)size->bytes);
}
static tlsph_result tlsphi_create_planned(tlsphi_plan *plan, tlsph_solver **out) {
    tlsph_solver draft, *s;
    tlsphi_arena arena;
    tlsph_result r = tlsphi_measure_plan(&draft, plan);
    if (r || (r = tlsphi_take_block(plan, &draft.size, &arena))) return r;
    unsigned char *const block = arena.memory;
    const size_t size = draft.size.bytes;
    memset(block, 0, size);
    arena.memory += (64 - ((uintptr_t)block & 63)) & 63; /* line up with cache lines; the size has room for it */
    s = (tlsph_solver *)(void *)arena.memory;
    memset(&draft, 0, sizeof draft);
    tlsphi_copy_options(&draft, plan);
    *s = draft;
    tlsphi_layout(s, &arena, plan);
    TLSPH_ASSERT(!arena.overflow && arena.used <= size);
    s->allocator = plan->allocator;
    s->memory = block;
    s->memory_size = size;
    s->owns_memory = !plan->desc->memory;
    r = tlsphi_fill_solver(s, plan);
    if (r) tlsph_destroy(s);
    else *out = s;
    return r;
}
TLSPHI_DEF tlsph_result tlsph_create(const tlsph_desc *desc, tlsph_solver **solver, tlsph_error *error) {
    tlsphi_plan plan;
    if (!solver) {
        tlsphi_no_error(error);
        return tlsphi_fail(error, TLSPH_ERROR_ARGUMENT, "create", "solver", TLSPH_NO_PARTICLE, 0, 0, "not NULL");
    }
    *solver = NULL;
    tlsph_result r = tlsphi_plan_make(&plan, desc, error);
    if (!r) r = tlsphi_create_planned(&plan, solver);
    tlsphi_plan_release(&plan);
    return r;
}
TLSPHI_DEF void tlsph_destroy(tlsph_solver *s) {
    if (!s || !s->owns_memory) return;
    const tlsph_allocator allocator = s->allocator;
    allocator.release(allocator.user, s->memory, s->memory_size);
}

/* -- default descriptions -- */

TLSPHI_DEF tlsph_desc tlsph_desc_default(int dimension) {
    tlsph_desc d;
    memset(&d, 0, sizeof d);
    d.cookie = TLSPHI_COOKIE;
    d.dimension = dimension;
    d.kernel = TLSPH_QUADRATIC;
    d.support = TLSPHI_R(0.6);
    d.biharmonic = TLSPHI_R(0.125);
    d.drift_stiffness = 1;
    d.drift_scale = TLSPHI_R(0.03);
    d.jump_share = TLSPHI_R(0.5);
    d.mirror_gradients = 1;
    d.dissipation_heats = 1;
    d.projection = 1;
    d.cfl = TLSPHI_R(0.3);
    d.rates = 1;
    d.incompressible.laplacian = TLSPHI_R(0.25);
    d.incompressible.tolerance = sizeof(tlsph_real) == 8 ? TLSPHI_R(1e-6) : TLSPHI_R(1e-5);
    d.incompressible.iteration_limit = 1000;
    d.incompressible.pseudo_modulus = 50;
    return d;
}
/* At 0.5 the limiter and a dissipation evaluated once a step let round-off grow where gradients are of fourth order (punch_test
   with TLSPH_PRESET_BALANCED, 0.42 s: asymmetry 9e-8, at 0.45 3e-12); smooth errors of three stages are 14 to 70 % larger. */
#define TLSPHI_FOURTH_CFL 0.45

TLSPHI_DEF void tlsph_preset(tlsph_desc *d, tlsph_preset_name name) {
    const int lattice = d->operator_kind == TLSPH_CELLS || d->operator_kind == TLSPH_CELLS_4 ||
                        (d->operator_kind == TLSPH_CORRECTED_KERNEL && d->support <= TLSPHI_R(0.6) && d->particles.cell_count);
    if ((unsigned)name > TLSPH_PRESET_ACCURATE || d->scheme != TLSPH_EXPLICIT) return;
    const int fourth = name != TLSPH_PRESET_FAST && d->dissipation != TLSPH_JST;
    if (lattice) d->operator_kind = fourth ? TLSPH_CELLS_4 : TLSPH_CELLS;
    d->sharp_gradients = 0;
    static const tlsph_integrator integrators[3] = {TLSPH_LEAPFROG, TLSPH_RK3_FROZEN, TLSPH_RK4_FROZEN};
    d->integrator = integrators[name];
    d->cfl = lattice && fourth ? TLSPHI_R(TLSPHI_FOURTH_CFL) : tlsph_cfl_limit(d->integrator);
    d->conduction_stages = 9;
}
TLSPHI_DEF tlsph_material tlsph_material_default(tlsph_material_kind kind) {
    tlsph_material m;
    memset(&m, 0, sizeof m);
    m.kind = kind;
    m.reference_temperature = TLSPHI_R(293.15);
    m.gruneisen_exponent = 1;
    return m;
}
TLSPHI_DEF tlsph_condition tlsph_condition_default(tlsph_condition_kind kind) {
    tlsph_condition c;
    memset(&c, 0, sizeof c);
    c.cookie = TLSPHI_COOKIE;
    c.kind = kind;
    return c;
}

/* ==== [SELF-TEST] ==================================================================================================
   Is a material what the solver takes it for? All by central differences of tlsph_material_evaluate, so that a user's
   callback is asked in the way in which a step asks it. */

typedef struct tlsphi_trial {
    const tlsph_material *material;
    double F[9], theta, scale; /* scale: of stiffness at F, Pa */
    tlsph_result result;       /* of the first evaluation that failed */
    tlsph_material_state at;
} tlsphi_trial;

static void tlsphi_try(tlsphi_trial *trial, const double F[9], double theta, tlsph_material_state *out) {
    tlsph_real real[9];
    for (int i = 0; i < 9; i++) real[i] = (tlsph_real)F[i];
    const tlsph_result result = tlsph_material_evaluate(trial->material, real, (tlsph_real)theta, out);
    if (result && !trial->result) trial->result = result;
    if (result) memset(out, 0, sizeof *out);
}
/* F + step in entry k, where rounding leaves the step that is divided by. */
static double tlsphi_try_beside(tlsphi_trial *trial, int k, double step, tlsph_material_state *out) {
    double F[9];
    memcpy(F, trial->F, sizeof F);
    F[k] = (double)(tlsph_real)(F[k] + step);
    tlsphi_try(trial, F, trial->theta, out);
    return F[k];
}
/* dP/dF (row: entry of P) and the error of P against d psi/dF. */
static void tlsphi_try_tangent(tlsphi_trial *trial, double A[81], tlsph_material_report *report) {
    const double step = cbrt(TLSPHI_EPSILON);
    tlsph_material_state low, high;
    double scale = (double)trial->material->young;
    for (int k = 0; k < 9; k++) {
        const double below = tlsphi_try_beside(trial, k, -step, &low), above = tlsphi_try_beside(trial, k, step, &high);
        for (int i = 0; i < 9; i++) A[9 * i + k] = ((double)high.P[i] - (double)low.P[i]) / (above - below);
        scale = tlsphi_dmax(scale, fabs(A[10 * k]));
    }
    trial->scale = scale;
    for (int k = 0; k < 9; k++) {
        const double below = tlsphi_try_beside(trial, k, -step, &low), above = tlsphi_try_beside(trial, k, step, &high);
        const double slope = ((double)high.helmholtz - (double)low.helmholtz) / (above - below);
        report->derivative = tlsphi_dmax(report->derivative, fabs(slope - (double)trial->at.P[k]) / scale);
        for (int i = 0; i < k; i++)
            report->symmetry = tlsphi_dmax(report->symmetry, fabs(A[9 * i + k] - A[9 * k + i]) / scale);
    }
}
/* eta = -d psi/d theta; out: -dP/d theta. */
static void tlsphi_try_heat(tlsphi_trial *trial, double out[9], tlsph_material_report *report) {
    const double theta = trial->theta, step = cbrt(TLSPHI_EPSILON) * theta;
    const double below = (double)(tlsph_real)(theta - step), above = (double)(tlsph_real)(theta + step);
    tlsph_material_state low, high;
    tlsphi_try(trial, trial->F, below, &low);
    tlsphi_try(trial, trial->F, above, &high);
    const double slope = ((double)high.helmholtz - (double)low.helmholtz) / (above - below);
    report->entropy = tlsphi_dmax(report->entropy, fabs(slope + (double)trial->at.eta) * theta / trial->scale);
    for (int i = 0; i < 9; i++) out[i] = ((double)low.P[i] - (double)high.P[i]) / (above - below);
}
/* P(Q F) = Q P(F) and the same energy. */
static void tlsphi_try_turned(tlsphi_trial *trial, const double Q[9], tlsph_material_report *report) {
    tlsph_material_state turned;
    double QF[9] = {0};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) QF[3 * i + j] += Q[3 * i + k] * trial->F[3 * k + j];
    tlsphi_try(trial, QF, trial->theta, &turned);
    for (int i = 0; i < 9; i++) {
        double QP = 0;
        for (int k = 0; k < 3; k++) QP += Q[3 * (i / 3) + k] * (double)trial->at.P[3 * k + i % 3];
        report->objectivity = tlsphi_dmax(report->objectivity, fabs((double)turned.P[i] - QP) / trial->scale);
    }
    report->objectivity =
        tlsphi_dmax(report->objectivity, fabs((double)(turned.helmholtz - trial->at.helmholtz)) / trial->scale);
}
/* Acoustic tensor along N: isothermal for hyperbolicity, isentropic against the bound of the wave speed. */
static void tlsphi_try_waves(const tlsphi_trial *trial, const double A[81], const double heat[9], const double N[3],
                             tlsph_material_report *report) {
    const tlsph_material *m = trial->material;
    const double c_v = (double)m->density * (double)m->specific_heat, rho = (double)m->density;
    double slow[9], fast[9], h[3] = {0, 0, 0}, Q[9];
    for (int i = 0; i < 9; i++) h[i / 3] += heat[i] * N[i % 3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            double sum = 0;
            for (int J = 0; J < 3; J++)
                for (int L = 0; L < 3; L++) sum += A[9 * (3 * i + J) + 3 * k + L] * N[J] * N[L];
            slow[3 * i + k] = sum;
            fast[3 * i + k] = sum + (c_v > 0 ? trial->theta / c_v * h[i] * h[k] : 0);
        }
    tlsphi_eigen(slow, Q);
    tlsphi_eigen(fast, Q);
    const double least = tlsphi_dmin(slow[0], tlsphi_dmin(slow[4], slow[8])) / trial->scale;
    const double most = tlsphi_dmax(fast[0], tlsphi_dmax(fast[4], fast[8]));
    const double bound = rho * (double)trial->at.c_p * (double)trial->at.c_p;
    report->hyperbolicity = tlsphi_dmin(report->hyperbolicity, least);
    if (most > 0) report->wave_bound = tlsphi_dmin(report->wave_bound, bound / most);
}

static double tlsphi_try_random(uint64_t *seed) { /* -1 to 1 */
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 33) / 1073741824.0 - 1;
}
/* F = I + entries up to `strain`, a turn (about a random axis, its eigenvectors by a random symmetric tensor), N. */
static void tlsphi_try_sample(uint64_t *seed, double strain, double F[9], double Q[9], double N[3]) {
    double S[9];
    for (int i = 0; i < 9; i++) F[i] = (i % 4 == 0) + strain * tlsphi_try_random(seed);
    for (int i = 0; i < 9; i++) S[i] = i % 3 < i / 3 ? S[3 * (i % 3) + i / 3] : tlsphi_try_random(seed);
    tlsphi_eigen(S, Q);
    for (int i = 0; i < 3; i++) N[i] = Q[3 * i];
    const double det = Q[0] * (Q[4] * Q[8] - Q[5] * Q[7]) + Q[1] * (Q[5] * Q[6] - Q[3] * Q[8]) +
                       Q[2] * (Q[3] * Q[7] - Q[4] * Q[6]);
    for (int i = 0; i < 9; i++) Q[i] *= det; /* a rotation, no reflection */
}

/* A linear material is not objective by its nature. */
static tlsph_result tlsphi_report_fault(const tlsph_material *m, const tlsph_material_report *r, tlsph_error *error) {
    const double rounding = pow(TLSPHI_EPSILON, 0.5); /* differences: 2/3 of the digits, and a margin */
    const struct {
        const char *name;
        double value, limit;
        int least;
        const char *allowed;
    } rules[] = {
        {"derivative", r->derivative, rounding, 0, "round-off: P = d psi/dF"},
        {"entropy", r->entropy, rounding, 0, "round-off: eta = -d psi/d theta"},
        {"symmetry", r->symmetry, 10 * rounding, 0, "round-off: dP/dF is symmetric"},
        {"objectivity", m->kind == TLSPH_LINEAR ? 0 : r->objectivity, rounding, 0, "round-off: P(Q F) = Q P(F)"},
        {"wave_bound", r->wave_bound, 0.99, 1, "1 or more: p_modulus bounds rho c_p^2"},
    };
    for (size_t i = 0; i < sizeof rules / sizeof *rules; i++)
        if (!(rules[i].least ? rules[i].value >= rules[i].limit : rules[i].value <= rules[i].limit))
            return tlsphi_fail(error, TLSPH_ERROR_MATERIAL, "material_check", rules[i].name, TLSPH_NO_PARTICLE,
                               rules[i].value, rules[i].limit, rules[i].allowed);
    return TLSPH_OK;
}
TLSPHI_DEF tlsph_result tlsph_material_check(const tlsph_material *material, double strain, int samples,
                                             tlsph_material_report *report, tlsph_error *error) {
    uint64_t seed = 1;
    tlsphi_trial trial;
    tlsphi_no_error(error);
    if (!material || !report || !(strain >= 0) || samples < 1)
        return tlsphi_fail(error, TLSPH_ERROR_ARGUMENT, "material_check", "strain", TLSPH_NO_PARTICLE, strain, 0,
                           "0 or more, with 1 sample or more, a material and a report");
    memset(report, 0, sizeof *report);
    report->hyperbolicity = report->wave_bound = TLSPHI_LARGEST;
    memset(&trial, 0, sizeof trial);
    trial.material = material;
    for (int i = 0; i < samples; i++) {
        const tlsph_material_report before = *report;
        double A[81], heat[9], Q[9], N[3];
        tlsphi_try_sample(&seed, strain, trial.F, Q, N);
        trial.theta = (double)material->reference_temperature * (1 + tlsphi_try_random(&seed) / 4);
        tlsphi_try(&trial, trial.F, trial.theta, &trial.at);
        tlsphi_try_tangent(&trial, A, report);
        tlsphi_try_heat(&trial, heat, report);
        tlsphi_try_turned(&trial, Q, report);
        for (int k = 0; k < 3; k++) { /* three directions at right angles */
            for (int j = 0; j < 3; j++) N[j] = Q[3 * j + k];
            tlsphi_try_waves(&trial, A, heat, N, report);
        }
        if (trial.result == TLSPH_ERROR_INVERSION) { /* there or beside it: too large a strain, another sample */
            trial.result = TLSPH_OK;
            *report = before;
            report->inverted++;
        }
        if (trial.result)
            return tlsphi_fail(error, trial.result, "material_check", "F[0]", TLSPH_NO_PARTICLE, trial.F[0], 0,
                               "a state that the material can be evaluated at; lower strain");
    }
    return tlsphi_report_fault(material, report, error);
}

/* ==== [VORONOI] ====================================================================================================
   The part of the body nearest to each particle. A cell starts as a cube around X_a and is cut by the planes half-way to its
   neighbours, nearest first, until the next one is farther than twice its farthest corner. The body's surface, cut by the
   planes of the cell, gives B_a; its facets' planes then split the cell into convex pieces, each wholly inside or outside,
   and V_a is the volume of those inside. Works for any closed surface: re-entrant edges, holes, thin walls. In 2-D the
   cells are prisms, with walls of the surface's segments. Coordinates are relative to X_a. */

#define TLSPHI_POLY_FACES 64
#define TLSPHI_POLY_VERTICES 512
#define TLSPHI_PATCH_VERTICES 24
#define TLSPHI_PATCHES 160 /* facets in one cell that are looked at one by one */
#define TLSPHI_SPLITS 40   /* depth of the splitting */

typedef struct tlsphi_poly {
    int faces, vertices;
    int first[TLSPHI_POLY_FACES + 1]; /* vertices of each face, counter-clockwise from outside */
    double plane[TLSPHI_POLY_FACES][4]; /* n.x <= h inside */
    double v[TLSPHI_POLY_VERTICES][3];
} tlsphi_poly;
typedef struct tlsphi_patch {
    int count;
    double plane[4], v[TLSPHI_PATCH_VERTICES][3];
} tlsphi_patch;
typedef struct tlsphi_split_level {
    tlsphi_poly poly;
    int patches;
    tlsphi_patch patch[TLSPHI_PATCHES];
} tlsphi_split_level;

static double tlsphi_beyond(const double plane[4], const double v[3]) { return tlsphi_dot3(plane, v) - plane[3]; }
static void tlsphi_cut_point(const double a[3], const double b[3], double fa, double fb, double out[3]) {
    for (int i = 0; i < 3; i++) out[i] = a[i] + (b[i] - a[i]) * (fa / (fa - fb));
}
/* The part of a convex polygon on the inner side; exit_point (or NULL) gets where it is left. Returns whether it is. */
static int tlsphi_cut_polygon(const double (*v)[3], int count, const double plane[4], double (*out)[3], int *out_count,
                              int capacity, double exit_point[3]) {
    int found = 0, leaves = 0;
    for (int i = 0; i < count && found < capacity - 1; i++) {
        const double *a = v[i], *b = v[(i + 1) % count], fa = tlsphi_beyond(plane, a), fb = tlsphi_beyond(plane, b);
        if (fa <= 0) memcpy(out[found++], a, 3 * sizeof *a);
        if ((fa <= 0) == (fb <= 0)) continue;
        /* from inside to outside whichever way the edge runs, so that both its faces get the same bits */
        if (fa <= 0) tlsphi_cut_point(a, b, fa, fb, out[found]);
        else tlsphi_cut_point(b, a, fb, fa, out[found]);
        if (fa <= 0 && exit_point) memcpy(exit_point, out[found], 3 * sizeof *a);
        leaves |= fa <= 0;
        found++;
    }
    *out_count = found;
    return leaves;
}
/* Angle-like number in [0, 4), growing with the angle of (x, y). */
static double tlsphi_diamond(double x, double y) {
    const double s = fabs(x) + fabs(y);
    if (!(s > 0)) return 0;
    return y >= 0 ? (x >= 0 ? y / s : 2 - y / s) : (x < 0 ? 2 - y / s : 4 + y / s);
}
/* Closes a cut with the polygon through its points, ordered around their mean. */
static void tlsphi_close_cut(tlsphi_poly *p, double (*points)[3], int count, const double plane[4]) {
    const int axis = fabs(plane[0]) < fabs(plane[1]) ? (fabs(plane[0]) < fabs(plane[2]) ? 0 : 2)
                                                     : (fabs(plane[1]) < fabs(plane[2]) ? 1 : 2);
    double e[3] = {0, 0, 0}, u[3], w[3], mean[3] = {0, 0, 0}, angle[TLSPHI_POLY_FACES];
    if (count < 3 || p->faces >= TLSPHI_POLY_FACES || p->vertices + count > TLSPHI_POLY_VERTICES) return;
    e[axis] = 1;
    tlsphi_cross3(e, plane, u);
    tlsphi_cross3(plane, u, w);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) mean[k] += points[i][k] / count;
    for (int i = 0; i < count; i++) { /* insertion sort */
        double d[3], point[3];
        int j = i;
        memcpy(point, points[i], sizeof point);
        for (int k = 0; k < 3; k++) d[k] = point[k] - mean[k];
        const double at = tlsphi_diamond(tlsphi_dot3(d, u), tlsphi_dot3(d, w));
        for (; j > 0 && angle[j - 1] > at; j--) {
            angle[j] = angle[j - 1];
            memcpy(points[j], points[j - 1], sizeof point);
        }
        angle[j] = at;
        memcpy(points[j], point, sizeof point);
    }
    memcpy(p->v[p->vertices], points, (size_t)count * sizeof *points);
    memcpy(p->plane[p->faces], plane, 4 * sizeof *plane);
    p->vertices += count;
    p->first[++p->faces] = p->vertices;
}
/* out = the part of `in` with n.x <= h. */
static void tlsphi_cut_poly(const tlsphi_poly *in, const double plane[4], tlsphi_poly *out) {
    double points[TLSPHI_POLY_FACES][3];
    int count = 0;
    out->faces = out->vertices = out->first[0] = 0;
    for (int f = 0; f < in->faces; f++) {
        int kept;
        const int size = in->first[f + 1] - in->first[f];
        if (tlsphi_cut_polygon(in->v + in->first[f], size, plane, out->v + out->vertices, &kept,
                               TLSPHI_POLY_VERTICES - out->vertices, points[count]))
            count++;
        if (kept < 3) continue;
        memcpy(out->plane[out->faces], in->plane[f], sizeof in->plane[f]);
        out->vertices += kept;
        out->first[++out->faces] = out->vertices;
    }
    tlsphi_close_cut(out, points, count, plane);
}
static void tlsphi_poly_range(const tlsphi_poly *p, const double plane[4], double *least, double *most) {
    *least = 1e300;
    *most = -1e300;
    for (int i = 0; i < p->vertices; i++) {
        const double f = tlsphi_beyond(plane, p->v[i]);
        *least = tlsphi_dmin(*least, f);
        *most = tlsphi_dmax(*most, f);
    }
}
/* Volume, and the centroid times it. */
static double tlsphi_poly_volume(const tlsphi_poly *p, double moment[3]) {
    double volume = 0, n[3];
    moment[0] = moment[1] = moment[2] = 0;
    for (int f = 0; f < p->faces; f++) {
        const double (*v)[3] = p->v + p->first[f];
        for (int i = 1; i + 1 < p->first[f + 1] - p->first[f]; i++) {
            tlsphi_cross3(v[i], v[i + 1], n);
            const double part = tlsphi_dot3(v[0], n) / 6;
            volume += part;
            for (int k = 0; k < 3; k++) moment[k] += part * (v[0][k] + v[i][k] + v[i + 1][k]) / 4;
        }
    }
    return volume;
}
/* Area vector and centroid of a patch. */
static double tlsphi_patch_area(const tlsphi_patch *p, double area[3], double centre[3]) {
    double total = 0;
    for (int k = 0; k < 3; k++) area[k] = centre[k] = 0;
    for (int i = 1; i + 1 < p->count; i++) {
        double a[3], b[3], n[3];
        for (int k = 0; k < 3; k++) {
            a[k] = p->v[i][k] - p->v[0][k];
            b[k] = p->v[i + 1][k] - p->v[0][k];
        }
        tlsphi_cross3(a, b, n);
        const double part = sqrt(tlsphi_dot3(n, n)) / 2;
        total += part;
        for (int k = 0; k < 3; k++) {
            area[k] += n[k] / 2;
            centre[k] += part * (p->v[0][k] + p->v[i][k] + p->v[i + 1][k]) / 3;
        }
    }
    for (int k = 0; k < 3; k++) centre[k] = total > 0 ? centre[k] / total : p->v[0][k];
    return total;
}
static void tlsphi_patch_normal(tlsphi_patch *p) {
    double centre[3];
    const double size = tlsphi_patch_area(p, p->plane, centre);
    for (int k = 0; k < 3; k++) p->plane[k] /= size > 0 ? size : 1;
    p->plane[3] = tlsphi_dot3(p->plane, p->v[0]);
}

typedef struct tlsphi_voronoi {
    tlsphi_plan plan; /* of the particles alone: grid and scratch */
    const tlsph_particles *particles;
    size_t facets;
    double (*corner)[3];   /* 4 a facet in 2-D (walls), 3 in 3-D */
    int corners;
    double low[3], bin;    /* bins of facets */
    size_t bins[3], *bin_first;
    uint32_t *bin_facet, *stamp, stamped;
    double *near_r;        /* candidates of one particle */
    uint32_t *nearest;
    size_t near_capacity;
    tlsphi_split_level *level;
} tlsphi_voronoi;

/* Is the point c of a cell inside the body? Looks along a line to a facet of the cell; the first facet met tells. */
static int tlsphi_side(const tlsphi_split_level *cell, const double c[3]) {
    double best = -1, target[3] = {0, 0, 0}, first = 2;
    int side = 1;
    for (int i = 0; i < cell->patches; i++) {
        double area[3], centre[3], d[3];
        if (!(tlsphi_patch_area(&cell->patch[i], area, centre) > 0)) continue;
        for (int k = 0; k < 3; k++) d[k] = c[k] - centre[k];
        const double rr = tlsphi_dot3(d, d), seen = fabs(tlsphi_dot3(area, d)) / (rr * sqrt(rr) + 1e-300);
        if (!(seen > best)) continue;
        best = seen;
        memcpy(target, centre, sizeof target);
    }
    for (int i = 0; i < cell->patches && best > 0; i++) {
        const tlsphi_patch *p = &cell->patch[i];
        const double fc = tlsphi_beyond(p->plane, c), ft = tlsphi_beyond(p->plane, target);
        double x[3];
        int in = 1;
        const double at = fc / (fc - ft);
        if (fc == ft || !(at >= 0 && at <= 1 + 1e-9 && at < first)) continue;
        for (int k = 0; k < 3; k++) x[k] = c[k] + (target[k] - c[k]) * at;
        for (int j = 0; j < p->count && in; j++) {
            double edge[3], to[3], n[3];
            for (int k = 0; k < 3; k++) {
                edge[k] = p->v[(j + 1) % p->count][k] - p->v[j][k];
                to[k] = x[k] - p->v[j][k];
            }
            tlsphi_cross3(edge, to, n);
            in = tlsphi_dot3(n, p->plane) >= -1e-9 * tlsphi_dot3(to, to); /* edges may have shrunk to nothing */
        }
        if (!in) continue;
        first = at;
        side = fc <= 0;
    }
    return side;
}
/* Volume of the body in level->poly, whose facets are level->patch; split by one of them, as long as one crosses it. */
static double tlsphi_split_volume(const tlsphi_split_level *cell, tlsphi_split_level *level, int depth, double size) {
    double moment[3], area[3], centre[3], least, most;
    const double volume = tlsphi_poly_volume(&level->poly, moment);
    if (!(volume > 1e-12 * size * size * size)) return 0;
    for (int i = 0; i < level->patches && depth < TLSPHI_SPLITS; i++) {
        const double *plane = level->patch[i].plane, back[4] = {-plane[0], -plane[1], -plane[2], -plane[3]};
        double sum = 0;
        if (!(tlsphi_patch_area(&level->patch[i], area, centre) > 1e-12 * size * size)) continue;
        tlsphi_poly_range(&level->poly, plane, &least, &most);
        if (!(least < -1e-9 * size && most > 1e-9 * size)) continue;
        for (int half = 0; half < 2; half++) {
            tlsphi_split_level *next = level + 1;
            tlsphi_cut_poly(&level->poly, half ? back : plane, &next->poly);
            next->patches = 0;
            for (int j = 0; j < level->patches; j++) {
                tlsphi_patch *to = &next->patch[next->patches];
                if (j == i) continue;
                memcpy(to->plane, level->patch[j].plane, sizeof to->plane);
                tlsphi_cut_polygon((const double (*)[3])level->patch[j].v, level->patch[j].count, half ? back : plane, to->v,
                                   &to->count, TLSPHI_PATCH_VERTICES, NULL);
                next->patches += to->count >= 3;
            }
            sum += tlsphi_split_volume(cell, next, depth + 1, size);
        }
        return sum;
    }
    for (int k = 0; k < 3; k++) moment[k] /= volume;
    return tlsphi_side(cell, moment) ? volume : 0;
}

/* Neighbours within `reach` (m), nearest first. */
static size_t tlsphi_near(tlsphi_voronoi *v, size_t a, double reach) {
    const tlsphi_grid *grid = &v->plan.grid;
    const int rings = (int)ceil(reach / grid->width), dim = v->plan.dim;
    uint64_t cell[3], other[3] = {0, 0, 0};
    size_t found = 0;
    tlsphi_cell_of(grid, tlsphi_position(&v->plan, a), cell);
    for (int z = dim == 3 ? -rings : 0; z <= (dim == 3 ? rings : 0); z++)
        for (int y = -rings; y <= rings; y++)
            for (int x = -rings; x <= rings; x++) {
                other[0] = cell[0] + (uint64_t)x;
                other[1] = cell[1] + (uint64_t)y;
                if (dim == 3) other[2] = cell[2] + (uint64_t)z;
                const uint64_t key = tlsphi_morton(other);
                for (size_t i = tlsphi_find_cell(grid, key); i < grid->count && grid->key[i] == key; i++) {
                    double d[3];
                    tlsphi_difference(&v->plan, a, grid->order[i], d);
                    const double rr = tlsphi_dot3(d, d);
                    if (grid->order[i] == a || rr >= reach * reach || found >= v->near_capacity) continue;
                    v->near_r[found] = rr;
                    v->nearest[found++] = grid->order[i];
                }
            }
    for (size_t gap = found / 2; gap > 0; gap /= 2) /* Shell sort */
        for (size_t i = gap; i < found; i++) {
            const double rr = v->near_r[i];
            const uint32_t b = v->nearest[i];
            size_t j = i;
            for (; j >= gap && (v->near_r[j - gap] > rr || (v->near_r[j - gap] == rr && v->nearest[j - gap] > b)); j -= gap) {
                v->near_r[j] = v->near_r[j - gap];
                v->nearest[j] = v->nearest[j - gap];
            }
            v->near_r[j] = rr;
            v->nearest[j] = b;
        }
    return found;
}
static double tlsphi_poly_radius(const tlsphi_poly *p) {
    double rr = 0;
    for (int i = 0; i < p->vertices; i++) rr = tlsphi_dmax(rr, tlsphi_dot3(p->v[i], p->v[i]));
    return sqrt(rr);
}
static void tlsphi_poly_box(tlsphi_poly *p, const double half[3]) {
    double plane[4] = {-1, 0, 0, half[0]};
    static const int loop[4] = {0, 2, 3, 1};
    p->faces = p->vertices = p->first[0] = 0;
    for (int f = 0; f < 6; f++) {
        const int axis = f / 2, up = f % 2, i = (axis + 1) % 3, j = (axis + 2) % 3;
        for (int k = 0; k < 4; k++) {
            const int corner = loop[up ? (4 - k) % 4 : k];
            double *x = p->v[p->vertices++];
            x[axis] = up ? half[axis] : -half[axis];
            x[i] = corner & 1 ? half[i] : -half[i];
            x[j] = corner & 2 ? half[j] : -half[j];
        }
        for (int k = 0; k < 3; k++) plane[k] = k == axis ? (up ? 1 : -1) : 0;
        plane[3] = half[axis];
        memcpy(p->plane[f], plane, sizeof plane);
        p->first[++p->faces] = p->vertices;
    }
}
/* The cell of particle a before the surface cuts it, at most 3/2 spacings wide on each side; NULL-terminated work. */
static tlsphi_poly *tlsphi_voronoi_cell(tlsphi_voronoi *v, size_t a, double spacing) {
    tlsphi_poly *now = &v->level[0].poly, *next = &v->level[1].poly;
    double reach = 0, half[3] = {1.5 * spacing, 1.5 * spacing, v->plan.dim == 3 ? 1.5 * spacing : spacing / 2};
    size_t done = 0;
    tlsphi_poly_box(now, half);
    for (int ring = 0; ring < 2; ring++) {
        if (2 * tlsphi_poly_radius(now) <= reach) break;
        reach = (ring ? 5.2 : 2.6) * spacing;
        const size_t found = tlsphi_near(v, a, reach);
        double radius = tlsphi_poly_radius(now);
        for (; done < found && v->near_r[done] < 4 * radius * radius; done++) {
            double plane[4], least, most;
            tlsphi_difference(&v->plan, a, v->nearest[done], plane);
            const double r = sqrt(v->near_r[done]);
            for (int k = 0; k < 3; k++) plane[k] /= r;
            plane[3] = r / 2;
            tlsphi_poly_range(now, plane, &least, &most);
            if (!(most > 1e-9 * spacing)) continue;
            tlsphi_cut_poly(now, plane, next);
            tlsphi_poly *const swap = now;
            now = next;
            next = swap;
            radius = tlsphi_poly_radius(now);
        }
    }
    return now;
}
/* Facets that meet a cell, cut by its planes, relative to X_a. Returns how many; beyond the capacity they only count. B: area
   vector, followed by the moment T, row by row. */
static int tlsphi_voronoi_patches(tlsphi_voronoi *v, size_t a, tlsphi_split_level *cell, double B[12], double *area) {
    double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300}, X[3] = {0, 0, 0};
    size_t from[3], to[3], at[3];
    int found = 0;
    for (int k = 0; k < v->plan.dim; k++) X[k] = (double)tlsphi_position(&v->plan, a)[k];
    for (int i = 0; i < cell->poly.vertices; i++)
        for (int k = 0; k < 3; k++) {
            low[k] = tlsphi_dmin(low[k], cell->poly.v[i][k] + X[k]);
            high[k] = tlsphi_dmax(high[k], cell->poly.v[i][k] + X[k]);
        }
    for (int k = 0; k < 3; k++) {
        const double last = (double)v->bins[k] - 1;
        from[k] = (size_t)tlsphi_dmin(last, tlsphi_dmax(0, floor((low[k] - v->low[k]) / v->bin)));
        to[k] = (size_t)tlsphi_dmin(last, tlsphi_dmax(0, floor((high[k] - v->low[k]) / v->bin)));
    }
    v->stamped++;
    cell->patches = 0;
    for (at[2] = from[2]; at[2] <= to[2]; at[2]++)
        for (at[1] = from[1]; at[1] <= to[1]; at[1]++)
            for (at[0] = from[0]; at[0] <= to[0]; at[0]++) {
                const size_t b = (at[2] * v->bins[1] + at[1]) * v->bins[0] + at[0];
                for (size_t i = v->bin_first[b]; i < v->bin_first[b + 1]; i++) {
                    const uint32_t f = v->bin_facet[i];
                    tlsphi_patch one, other, *p = &one, *q = &other;
                    double part[3], centre[3];
                    if (v->stamp[f] == v->stamped) continue;
                    v->stamp[f] = v->stamped;
                    p->count = v->corners;
                    for (int k = 0; k < p->count; k++)
                        for (int l = 0; l < 3; l++) p->v[k][l] = v->corner[(size_t)v->corners * f + (size_t)k][l] - X[l];
                    tlsphi_patch_normal(p);
                    memcpy(other.plane, one.plane, sizeof one.plane);
                    for (int k = 0; k < cell->poly.faces && p->count >= 3; k++) {
                        tlsphi_cut_polygon((const double (*)[3])p->v, p->count, cell->poly.plane[k], q->v, &q->count,
                                           TLSPHI_PATCH_VERTICES, NULL);
                        tlsphi_patch *const swap = p;
                        p = q;
                        q = swap;
                    }
                    if (p->count < 3) continue;
                    const double size = tlsphi_patch_area(p, part, centre);
                    if (!(size > 0)) continue;
                    *area += size;
                    for (int l = 0; l < 12; l++) B[l] += l < 3 ? part[l] : part[l / 3 - 1] * centre[l % 3];
                    if (cell->patches < TLSPHI_PATCHES) cell->patch[cell->patches++] = *p;
                    found++;
                }
            }
    return found;
}
/* V_a, B_a, T_a (for prisms: of their height) and the area of the surface in the cell. */
static double tlsphi_voronoi_particle(tlsphi_voronoi *v, size_t a, double spacing, double B[12], double *area) {
    tlsphi_split_level *cell = v->level + 2;
    double moment[3], centre[3];
    cell->poly = *tlsphi_voronoi_cell(v, a, spacing);
    memset(B, 0, 12 * sizeof *B);
    const int found = tlsphi_voronoi_patches(v, a, cell, B, area);
    if (!found) return tlsphi_poly_volume(&cell->poly, moment);
    if (found > TLSPHI_PATCHES) { /* a surface much finer than the particles: locally its mean plane */
        double plane[4] = {0, 0, 0, 0}, total = 0, part[3];
        const double size = sqrt(tlsphi_dot3(B, B));
        for (int i = 0; i < cell->patches; i++) {
            const double weight = tlsphi_patch_area(&cell->patch[i], part, centre);
            total += weight;
            for (int k = 0; k < 3; k++) plane[3] += weight * centre[k] * B[k] / (size + 1e-300);
        }
        for (int k = 0; k < 3; k++) plane[k] = B[k] / (size + 1e-300);
        plane[3] /= total;
        tlsphi_cut_poly(&cell->poly, plane, &v->level[0].poly);
        return tlsphi_poly_volume(&v->level[0].poly, moment);
    }
    v->level[3] = *cell; /* the cell itself stays for tlsphi_damp_side */
    return tlsphi_split_volume(cell, v->level + 3, 0, spacing);
}

/* -- the surface: facets, equal corners made one, edges -- */

typedef struct tlsphi_mesh {
    int dim, corners; /* of a facet: 3, or 2 in 2-D */
    size_t facets, vertices, edges;
    const tlsph_real *given;
    uint32_t *vertex;       /* corners a facet */
    uint32_t *first_corner; /* of each vertex: where its coordinates stand */
    uint64_t *edge;         /* half-edges sorted by their two vertices (3-D) */
    uint32_t *half;         /* facet x 3 + corner, in that order */
    double low[3], high[3], volume, centre[3], size;
} tlsphi_mesh;

static const tlsph_real *tlsphi_mesh_corner(const tlsphi_mesh *m, size_t facet, int corner) {
    return m->given + 3 * ((size_t)m->corners * facet + (size_t)corner);
}
static void tlsphi_mesh_point(const tlsphi_mesh *m, size_t facet, int corner, double x[3]) {
    for (int k = 0; k < 3; k++) x[k] = k < m->dim ? (double)tlsphi_mesh_corner(m, facet, corner)[k] : 0;
}
static double tlsphi_mesh_normal(const tlsphi_mesh *m, size_t facet, double n[3]) {
    double a[3], b[3], c[3], size;
    tlsphi_mesh_point(m, facet, 0, a);
    tlsphi_mesh_point(m, facet, 1, b);
    if (m->dim == 2) {
        n[0] = b[1] - a[1];
        n[1] = a[0] - b[0];
        n[2] = 0;
    } else {
        tlsphi_mesh_point(m, facet, 2, c);
        for (int k = 0; k < 3; k++) {
            b[k] -= a[k];
            c[k] -= a[k];
        }
        tlsphi_cross3(b, c, n);
    }
    size = sqrt(tlsphi_dot3(n, n));
    for (int k = 0; k < 3; k++) n[k] /= size > 0 ? size : 1;
    return m->dim == 2 ? size : size / 2;
}
TLSPHI_APART tlsph_result tlsphi_surface_fail(tlsph_error *error, const char *what, const double X[3], double value,
                                        const char *allowed) {
    const tlsph_result r =
        tlsphi_fail(error, TLSPH_ERROR_SURFACE, "surface", what, TLSPH_NO_PARTICLE, value, 0, allowed);
    if (!error) return r;
    for (int k = 0; k < 3; k++) error->position[k] = X[k];
    const size_t used = strlen(error->message);
    snprintf(error->message + used, sizeof error->message - used, "; at (%g, %g, %g)", X[0], X[1], X[2]);
    return r;
}
/* One number for all corners at the same place: equal bits, as files of triangles have them. */
static void tlsphi_mesh_weld(tlsphi_mesh *m, uint64_t *key, uint32_t *order, uint64_t *key2, uint32_t *order2) {
    const size_t n = (size_t)m->corners * m->facets;
    for (size_t i = 0; i < n; i++) {
        uint64_t h = 0xcbf29ce484222325u;
        for (int k = 0; k < m->dim; k++) {
            const double x = (double)m->given[3 * i + (size_t)k] + 0.0; /* -0 becomes 0 */
            uint64_t bits;
            memcpy(&bits, &x, sizeof bits);
            h = (h ^ bits) * 0x9e3779b97f4a7c15u;
            h ^= h >> 29;
        }
        key[i] = h;
        order[i] = (uint32_t)i;
    }
    tlsphi_radix_sort(key, order, key2, order2, n);
    for (size_t i = 0; i < n; i++) {
        if (!i || key[i] != key[i - 1]) m->first_corner[m->vertices++] = order[i];
        m->vertex[order[i]] = (uint32_t)(m->vertices - 1);
    }
}
/* Every edge must be run through as often in one direction as in the other (2-D: every vertex entered as often as left). */
static tlsph_result tlsphi_mesh_check(tlsphi_mesh *m, int *balance, tlsph_error *error) {
    double X[3];
    for (size_t f = 0; m->dim == 2 && f < m->facets; f++) {
        balance[m->vertex[2 * f]]++;
        balance[m->vertex[2 * f + 1]]--;
    }
    for (size_t i = 0; m->dim == 2 && i < 2 * m->facets; i++) {
        const int open = balance[m->vertex[i]];
        tlsphi_mesh_point(m, i / 2, (int)(i % 2), X);
        if (open)
            return tlsphi_surface_fail(error, "segments that start less those that end", X, open,
                                       "0: a closed line, the body on the left");
    }
    for (size_t i = 0, j; m->dim == 3 && i < 3 * m->facets; i = j) {
        int sum = 0;
        for (j = i; j < 3 * m->facets && m->edge[j] == m->edge[i]; j++) {
            const size_t f = m->half[j] / 3, c = m->half[j] % 3;
            sum += m->vertex[3 * f + c] < m->vertex[3 * f + (c + 1) % 3] ? 1 : -1;
        }
        if (!sum) continue;
        double Y[3];
        tlsphi_mesh_point(m, m->half[i] / 3, (int)(m->half[i] % 3), X);
        tlsphi_mesh_point(m, m->half[i] / 3, (int)((m->half[i] % 3 + 1) % 3), Y);
        for (int k = 0; k < 3; k++) X[k] = (X[k] + Y[k]) / 2;
        return tlsphi_surface_fail(error, j - i > 1 ? "direction of an edge: a flipped facet" : "facets of an edge: a leak",
                                   X, (double)(j - i), "two, which run through it in opposite directions");
    }
    return TLSPH_OK;
}
/* Bounds, volume and centroid by the divergence theorem, area. */
static tlsph_result tlsphi_mesh_measure(tlsphi_mesh *m, tlsph_error *error) {
    double moment[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        m->low[k] = m->high[k] = k < m->dim ? (double)m->given[k] : 0;
        for (size_t i = 0; k < m->dim && i < (size_t)m->corners * m->facets; i++) {
            const double x = (double)m->given[3 * i + (size_t)k];
            if (!tlsphi_finite((tlsph_real)x))
                return tlsphi_fail(error, TLSPH_ERROR_NOT_FINITE, "surface", "corner", TLSPH_NO_PARTICLE, x, 0, "finite");
            m->low[k] = tlsphi_dmin(m->low[k], x);
            m->high[k] = tlsphi_dmax(m->high[k], x);
        }
    }
    for (size_t f = 0; f < m->facets; f++) {
        double v[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, n[3], sum[3] = {0, 0, 0};
        m->size += tlsphi_mesh_normal(m, f, n);
        for (int c = 0; c < m->corners; c++) {
            tlsphi_mesh_point(m, f, c, v[c]);
            for (int k = 0; k < m->dim; k++) sum[k] += v[c][k] -= m->low[k];
        }
        if (m->dim == 3) tlsphi_cross3(v[1], v[2], n);
        const double part = m->dim == 3 ? tlsphi_dot3(v[0], n) / 6 : (v[0][0] * v[1][1] - v[0][1] * v[1][0]) / 2;
        m->volume += part;
        for (int k = 0; k < m->dim; k++) moment[k] += part * sum[k] / (m->dim + 1);
    }
    for (int k = 0; k < 3; k++) m->centre[k] = m->low[k] + (k < m->dim ? moment[k] / m->volume : 0);
    if (m->volume > 0 && tlsphi_finite((tlsph_real)m->volume)) return TLSPH_OK;
    return tlsphi_surface_fail(error, "volume", m->low, m->volume, "more than 0: facets counter-clockwise from outside");
}
/* `plan` gives the scratch. */
static tlsph_result tlsphi_mesh_make(tlsphi_mesh *m, tlsphi_plan *plan, int dim, const tlsph_surface *surface,
                                     tlsph_error *error) {
    memset(m, 0, sizeof *m);
    m->dim = m->corners = dim;
    m->facets = surface->count;
    m->given = surface->corners;
    if (!m->given || m->facets < 1 || m->facets > 1000000000u)
        return tlsphi_fail(error, TLSPH_ERROR_SURFACE, "surface", "facets", TLSPH_NO_PARTICLE, (double)m->facets, 0,
                           "1 to 10^9");
    const size_t n = (size_t)dim * m->facets;
    uint64_t *key2 = TLSPHI_SCRATCH(plan, uint64_t, n);
    uint32_t *order2 = TLSPHI_SCRATCH(plan, uint32_t, n);
    int *balance = TLSPHI_SCRATCH(plan, int, n);
    m->edge = TLSPHI_SCRATCH(plan, uint64_t, n);
    m->half = TLSPHI_SCRATCH(plan, uint32_t, n);
    m->vertex = TLSPHI_SCRATCH(plan, uint32_t, n);
    m->first_corner = TLSPHI_SCRATCH(plan, uint32_t, n);
    if (!key2 || !order2 || !balance || !m->edge || !m->half || !m->vertex || !m->first_corner)
        return tlsphi_no_memory(plan, 40.0 * (double)n);
    const tlsph_result r = tlsphi_mesh_measure(m, error);
    if (r) return r;
    tlsphi_mesh_weld(m, m->edge, m->half, key2, order2);
    for (size_t i = 0; dim == 3 && i < n; i++) {
        const uint64_t u = m->vertex[i], w = m->vertex[i - i % 3 + (i + 1) % 3];
        m->edge[i] = u < w ? u << 32 | w : w << 32 | u;
        m->half[i] = (uint32_t)i;
    }
    if (dim == 3) tlsphi_radix_sort(m->edge, m->half, key2, order2, n);
    return tlsphi_mesh_check(m, balance, error);
}

/* -- cells of all particles -- */

static void tlsphi_bin_range(const tlsphi_voronoi *v, size_t f, size_t from[3], size_t to[3]) {
    for (int k = 0; k < 3; k++) {
        double low = 1e300, high = -1e300;
        for (int c = 0; c < v->corners; c++) {
            low = tlsphi_dmin(low, v->corner[(size_t)v->corners * f + (size_t)c][k]);
            high = tlsphi_dmax(high, v->corner[(size_t)v->corners * f + (size_t)c][k]);
        }
        const double last = (double)v->bins[k] - 1;
        from[k] = (size_t)tlsphi_dmin(last, tlsphi_dmax(0, floor((low - v->low[k]) / v->bin)));
        to[k] = (size_t)tlsphi_dmin(last, tlsphi_dmax(0, floor((high - v->low[k]) / v->bin)));
    }
}
/* Bins of facets, about as wide as a cell. In 2-D the walls stand on both sides of the plane. */
static tlsph_result tlsphi_voronoi_bins(tlsphi_voronoi *v, const tlsphi_mesh *m, double spacing) {
    size_t from[3], to[3], at[3], total = 1, entries = 0;
    v->facets = m->facets;
    v->corners = m->dim == 3 ? 3 : 4;
    v->corner = (double (*)[3])tlsphi_scratch_take(&v->plan, (size_t)v->corners * m->facets, 3 * sizeof(double));
    if (!v->corner) return tlsphi_no_memory(&v->plan, 100.0 * (double)m->facets);
    for (size_t f = 0; f < m->facets; f++)
        for (int c = 0; c < v->corners; c++) {
            double *x = v->corner[(size_t)v->corners * f + (size_t)c];
            tlsphi_mesh_point(m, f, m->dim == 3 ? c : (c + 1) / 2 % 2, x);
            if (m->dim == 2) x[2] = c < 2 ? -spacing : spacing;
        }
    v->bin = 2 * spacing;
    for (int k = 0; k < m->dim; k++) v->bin = tlsphi_dmax(v->bin, (m->high[k] - m->low[k]) / 512);
    for (int k = 0; k < 3; k++) {
        v->low[k] = m->low[k];
        v->bins[k] = k < m->dim ? (size_t)((m->high[k] - m->low[k]) / v->bin) + 1 : 1;
        total *= v->bins[k];
    }
    v->bin_first = TLSPHI_SCRATCH(&v->plan, size_t, total + 2);
    v->stamp = TLSPHI_SCRATCH(&v->plan, uint32_t, m->facets);
    if (!v->bin_first || !v->stamp) return tlsphi_no_memory(&v->plan, 8.0 * (double)total);
    for (int pass = 0; pass < 2; pass++) {
        for (size_t f = 0; f < m->facets; f++) {
            tlsphi_bin_range(v, f, from, to);
            for (at[2] = from[2]; at[2] <= to[2]; at[2]++)
                for (at[1] = from[1]; at[1] <= to[1]; at[1]++)
                    for (at[0] = from[0]; at[0] <= to[0]; at[0]++) {
                        const size_t b = (at[2] * v->bins[1] + at[1]) * v->bins[0] + at[0];
                        if (pass) v->bin_facet[v->bin_first[b + 1]++] = (uint32_t)f;
                        else v->bin_first[b + 2]++;
                        entries++;
                    }
        }
        for (size_t b = 0; !pass && b < total; b++) v->bin_first[b + 2] += v->bin_first[b + 1];
        if (!pass && !(v->bin_facet = TLSPHI_SCRATCH(&v->plan, uint32_t, entries)))
            return tlsphi_no_memory(&v->plan, 4.0 * (double)entries);
    }
    return TLSPH_OK;
}
/* V_a *= 1 + g + b.(X_a - X_c), so that volumes add up to the body's and have its centroid. */
static void tlsphi_voronoi_balance(const tlsphi_voronoi *v, const tlsphi_mesh *m, tlsph_real *V) {
    double S = 0, first[3] = {0, 0, 0}, second[9] = {0}, b[3], d[3] = {0, 0, 0};
    for (int pass = 0; pass < 2; pass++) {
        for (size_t a = 0; a < v->plan.n; a++) {
            for (int k = 0; k < m->dim; k++) d[k] = (double)tlsphi_position(&v->plan, a)[k] - m->centre[k];
            if (pass) {
                V[a] = (tlsph_real)((double)V[a] * S * (1 - tlsphi_dot3(b, d)));
                continue;
            }
            S += (double)V[a];
            for (int k = 0; k < 9; k++) second[k] += (double)V[a] * d[k / 3] * d[k % 3];
            for (int k = 0; k < 3; k++) first[k] += (double)V[a] * d[k];
        }
        if (pass) break;
        tlsphi_solve_symmetric(second, first, b);
        if (tlsphi_dot3(first, b) > 0.1 * S) b[0] = b[1] = b[2] = 0; /* a few particles cannot have any centroid */
        S = m->volume / (S - tlsphi_dot3(first, b));
    }
}
static tlsph_result tlsphi_voronoi_measure(tlsphi_voronoi *v, const tlsphi_mesh *m, tlsph_real *volumes, tlsph_real *areas,
                                           tlsph_real *moments, tlsph_error *error) {
    const tlsph_particles *p = v->particles;
    double covered = 0, total = 0;
    for (size_t a = 0; a < p->count; a++) {
        const double spacing = (double)(p->spacings ? p->spacings[a] : p->spacing);
        double B[12], area = 0;
        for (size_t k = 0; k < (size_t)m->dim; k++) {
            const double x = (double)p->positions[3 * a + k], beyond = tlsphi_dmax(m->low[k] - x, x - m->high[k]);
            if (beyond > 1e-3 * spacing)
                return tlsphi_fail(error, TLSPH_ERROR_VOLUME, "voronoi", "distance out of the body's bounds", a, beyond, 0,
                                   "0: particles in the body or on its surface");
        }
        const double V = tlsphi_voronoi_particle(v, a, spacing, B, &area), height = m->dim == 2 ? spacing : 1;
        if (!(V > 1e-9 * pow(spacing, 3)))
            return tlsphi_fail(error, TLSPH_ERROR_VOLUME, "voronoi", "volume of its cell in the body", a, V, 0,
                               "more than 0: particles in the body or on its surface");
        volumes[a] = (tlsph_real)(V / height);
        for (int k = 0; k < 3; k++) areas[3 * a + (size_t)k] = k < m->dim ? (tlsph_real)(B[k] / height) : 0;
        for (int k = 0; moments && k < 9; k++)
            moments[9 * a + (size_t)k] = k / 3 < m->dim && k % 3 < m->dim ? (tlsph_real)(B[3 + k] / height) : 0;
        covered += area / height;
        total += V / height;
    }
    if (!(fabs(covered / m->size - 1) < 1e-4) || !(fabs(total / m->volume - 1) < 0.05))
        return tlsphi_fail(error, TLSPH_ERROR_SURFACE, "voronoi", "share of the body in the cells", TLSPH_NO_PARTICLE,
                           tlsphi_dmin(covered / m->size, total / m->volume), 1,
                           "1: particles everywhere in the body, at most about 1.5 spacings apart");
    tlsphi_voronoi_balance(v, m, volumes);
    return TLSPH_OK;
}
static tlsph_result tlsphi_voronoi_begin(tlsphi_voronoi *v, const tlsphi_mesh *m, const tlsph_desc *desc) {
    const tlsph_particles *p = v->particles = &desc->particles;
    double least = (double)p->spacing, most = least;
    for (size_t a = 0; p->spacings && a < p->count; a++) {
        least = tlsphi_dmin(a ? least : 1e300, (double)p->spacings[a]);
        most = tlsphi_dmax(a ? most : 0, (double)p->spacings[a]);
    }
    v->plan.dim = desc->dimension;
    v->plan.n = p->count;
    v->plan.h = tlsphi_dmin(1.3 * most, 2 * 1.3 * least); /* 2 h: width of the grid's cells */
    if (!(most <= 4096 * least))
        return tlsphi_plan_fail(&v->plan, TLSPH_ERROR_ARGUMENT, "largest local spacing", TLSPH_NO_PARTICLE, most,
                                4096 * least, "4096 times the least, or less");
    const tlsph_result r = tlsphi_grid_build(&v->plan);
    if (r) return r;
    v->near_capacity = p->count < 65536 ? p->count : 65536;
    v->nearest = TLSPHI_SCRATCH(&v->plan, uint32_t, v->near_capacity);
    v->near_r = TLSPHI_SCRATCH(&v->plan, double, v->near_capacity);
    v->level = TLSPHI_SCRATCH(&v->plan, tlsphi_split_level, TLSPHI_SPLITS + 5);
    return v->nearest && v->near_r && v->level ? tlsphi_voronoi_bins(v, m, most)
                                            : tlsphi_no_memory(&v->plan, 1e7);
}
TLSPHI_DEF tlsph_result tlsph_voronoi(int dimension, const tlsph_particles *particles, const tlsph_surface *surface,
                                      const tlsph_allocator *allocator, tlsph_real *volumes, tlsph_real *areas,
                                      tlsph_real *moments, tlsph_error *error) {
    tlsphi_voronoi v;
    tlsphi_mesh m;
    tlsph_desc desc;
    tlsph_allocator none;
    tlsphi_no_error(error);
    if (!particles || !surface || !volumes || !areas || dimension < 2 || dimension > 3 || !particles->positions ||
        !particles->count || (double)particles->count > 4294967294.0 ||
        !(particles->spacing > 0 || particles->spacings))
        return tlsphi_fail(error, TLSPH_ERROR_ARGUMENT, "voronoi", "an argument", TLSPH_NO_PARTICLE, dimension, 0,
                           "positions with a spacing, a surface, two arrays; dimension 2 or 3");
    memset(&none, 0, sizeof none);
    memset(&v, 0, sizeof v);
    desc = tlsph_desc_default(dimension);
    desc.particles = *particles;
    desc.particles.volumes = desc.particles.weights = desc.particles.areas = desc.particles.moments = NULL;
    desc.particles.materials = NULL;
    v.plan.desc = &desc;
    v.plan.error = error;
    v.plan.allocator = tlsphi_allocator(allocator ? allocator : &none);
    tlsph_result r = tlsphi_check_particles(&v.plan);
    if (!r) r = tlsphi_mesh_make(&m, &v.plan, dimension, surface, error);
    if (!r) r = tlsphi_voronoi_begin(&v, &m, &desc);
    if (!r) r = tlsphi_voronoi_measure(&v, &m, volumes, areas, moments, error);
    tlsphi_plan_release(&v.plan);
    return r;
}

/* ==== [SHAPES] =====================================================================================================
   Irregular clouds in bodies given by a signed distance or by triangles. A distance is turned into a closed surface first, by
   dual contouring: where the edges of a grid of half the spacing cross the surface, points and normals are found, each cell
   takes the point nearest to all their tangent planes, so that flat faces, sharp edges and corners stay what they are, and
   each crossed grid edge makes a facet between the cells around it. Then particles are set, from corners to edges, faces and
   the inside, and pushed apart a few times, those of faces within the surface. Their cells give V_a and B_a ([VORONOI]).
   Everything follows from `seed`. */

#define TLSPHI_SHARP 0.85   /* cosine: edges that bend more are features */
#define TLSPHI_RELAXATIONS 12
#define TLSPHI_BEHIND 0.45  /* TLSPH_SCATTERED_INSIDE: distance of the first layer from the surface in spacings, */
#define TLSPHI_BEHIND_LEAST 0.2 /* and the least, in corners */
#define TLSPHI_LINES 4096   /* of a lattice, at most, per axis */

/* splitmix64: the same jitter everywhere for the same seed. */
static double tlsphi_random(uint64_t *state) {
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (double)((z ^ z >> 31) >> 11) / 9007199254740992.0;
}
static double tlsphi_fill_distance(const tlsph_fill *f, const double X[3]) {
    const tlsph_real at[3] = {(tlsph_real)X[0], (tlsph_real)X[1], (tlsph_real)(f->dimension == 3 ? X[2] : 0)};
    if (f->shape == TLSPH_DISTANCE) return (double)f->distance(f->distance_user, at);
    double rr = 0, least = 1e300, beyond = -1e300;
    for (int i = 0; i < f->dimension; i++) {
        const double half = (double)f->size[i] / 2, d = X[i] - (double)f->origin[i] - half;
        if (f->shape == TLSPH_CYLINDER && f->dimension == 3 && i == f->axis) {
            beyond = fabs(d) - half;
            continue;
        }
        rr += d * d;
        least = tlsphi_dmin(least, half);
    }
    const double shell = tlsphi_dmax(sqrt(rr) - least, f->inner_radius > 0 ? (double)f->inner_radius - sqrt(rr) : -1e300);
    return tlsphi_dmax(shell, beyond);
}
TLSPHI_DEF tlsph_real tlsph_distance_box(const tlsph_real X[3], const tlsph_real low[3], const tlsph_real high[3]) {
    double out = 0, in = -1e300;
    for (int k = 0; k < 3; k++) {
        const double d = tlsphi_dmax((double)(low[k] - X[k]), (double)(X[k] - high[k]));
        in = tlsphi_dmax(in, d);
        if (d > 0) out += d * d;
    }
    return (tlsph_real)(in > 0 ? sqrt(out) : in);
}
/* Distances from an axis through the centre, along it and across it. */
static void tlsphi_axial(const tlsph_real X[3], const tlsph_real centre[3], const tlsph_real axis[3], double *along,
                         double *across) {
    double d[3], n[3];
    for (int k = 0; k < 3; k++) {
        d[k] = (double)(X[k] - centre[k]);
        n[k] = (double)axis[k];
    }
    *along = tlsphi_dot3(d, n) / sqrt(tlsphi_dot3(n, n));
    *across = sqrt(tlsphi_dmax(0, tlsphi_dot3(d, d) - *along * *along));
}
TLSPHI_DEF tlsph_real tlsph_distance_sphere(const tlsph_real X[3], const tlsph_real centre[3], tlsph_real radius) {
    double d[3];
    for (int k = 0; k < 3; k++) d[k] = (double)(X[k] - centre[k]);
    return (tlsph_real)(sqrt(tlsphi_dot3(d, d)) - (double)radius);
}
TLSPHI_DEF tlsph_real tlsph_distance_cylinder(const tlsph_real X[3], const tlsph_real centre[3], const tlsph_real axis[3],
                                              tlsph_real radius, tlsph_real length) {
    double along, across;
    tlsphi_axial(X, centre, axis, &along, &across);
    const double side = across - (double)radius, end = fabs(along) - (double)length / 2;
    const double out = sqrt(pow(tlsphi_dmax(side, 0), 2) + pow(tlsphi_dmax(end, 0), 2));
    return (tlsph_real)(out > 0 ? out : tlsphi_dmax(side, end));
}
TLSPHI_DEF tlsph_real tlsph_distance_torus(const tlsph_real X[3], const tlsph_real centre[3], const tlsph_real axis[3],
                                           tlsph_real radius, tlsph_real tube) {
    double along, across;
    tlsphi_axial(X, centre, axis, &along, &across);
    return (tlsph_real)(sqrt(pow(across - (double)radius, 2) + along * along) - (double)tube);
}

/* -- dual contouring -- */

typedef struct tlsphi_contour {
    const tlsph_fill *fill;
    double low[3], step;
    size_t nodes[3];
    tlsph_real *phi, *vertex; /* per node: distance; of the cell above it: its point, 3 */
    tlsph_real *out;
    size_t count;
} tlsphi_contour;

static size_t tlsphi_contour_node(const tlsphi_contour *c, const size_t i[3]) {
    return (i[2] * c->nodes[1] + i[1]) * c->nodes[0] + i[0];
}
static void tlsphi_contour_node_at(const tlsphi_contour *c, const size_t i[3], double X[3]) {
    for (int k = 0; k < 3; k++) X[k] = k < c->fill->dimension ? c->low[k] + c->step * (double)i[k] : 0;
}
/* Where the distance is zero between two points of opposite sign: bisection, then a secant. */
static void tlsphi_crossing(const tlsph_fill *f, const double from[3], const double to[3], double X[3]) {
    double a = 0, b = 1, fa = tlsphi_fill_distance(f, from), fb = tlsphi_fill_distance(f, to), at = 0;
    for (int i = 0; i < 20; i++) {
        at = i % 2 ? (a + b) / 2 : a + (b - a) * fa / (fa - fb);
        for (int k = 0; k < 3; k++) X[k] = from[k] + (to[k] - from[k]) * at;
        const double now = tlsphi_fill_distance(f, X);
        if (now == 0 || fa == fb) break;
        if ((now < 0) == (fa < 0)) a = at, fa = now;
        else b = at, fb = now;
    }
}
static void tlsphi_distance_normal(const tlsph_fill *f, const double X[3], double step, double n[3]) {
    double size = 0;
    for (int k = 0; k < 3; k++) {
        double Y[3] = {X[0], X[1], X[2]};
        n[k] = 0;
        if (k >= f->dimension) continue;
        Y[k] += step;
        n[k] = tlsphi_fill_distance(f, Y);
        Y[k] -= 2 * step;
        n[k] -= tlsphi_fill_distance(f, Y);
        size += n[k] * n[k];
    }
    for (int k = 0; k < 3; k++) n[k] /= size > 0 ? sqrt(size) : 1;
}
/* The point of a cell: least squares of the distances to its tangent planes; weak directions stay at the mean. */
static void tlsphi_contour_vertex(tlsphi_contour *c, const size_t at[3]) {
    const int dim = c->fill->dimension;
    double point[12][3], normal[12][3], mean[3] = {0, 0, 0}, A[9] = {0}, b[3] = {0, 0, 0}, Q[9], low[3];
    int found = 0;
    for (int axis = 0; axis < dim; axis++)
        for (int side = 0; side < 1 << (dim - 1); side++) {
            size_t i[3] = {at[0], at[1], at[2]}, j[3];
            double from[3], to[3];
            i[(axis + 1) % dim] += (size_t)(side & 1);
            if (dim == 3) i[(axis + 2) % dim] += (size_t)(side >> 1);
            memcpy(j, i, sizeof j);
            j[axis]++;
            if ((c->phi[tlsphi_contour_node(c, i)] < 0) == (c->phi[tlsphi_contour_node(c, j)] < 0)) continue;
            tlsphi_contour_node_at(c, i, from);
            tlsphi_contour_node_at(c, j, to);
            tlsphi_crossing(c->fill, from, to, point[found]);
            tlsphi_distance_normal(c->fill, point[found], (TLSPHI_EPSILON > 1e-10 ? 1e-2 : 1e-4) * c->step, normal[found]);
            found++;
        }
    if (!found) return;
    for (int i = 0; i < found; i++)
        for (int k = 0; k < 3; k++) mean[k] += point[i][k] / found;
    for (int i = 0; i < found; i++) {
        double d[3];
        for (int k = 0; k < 3; k++) d[k] = point[i][k] - mean[k];
        for (int k = 0; k < 9; k++) A[k] += normal[i][k / 3] * normal[i][k % 3];
        for (int k = 0; k < 3; k++) b[k] += normal[i][k] * tlsphi_dot3(normal[i], d);
    }
    tlsphi_eigen(A, Q);
    const double most = tlsphi_dmax(A[0], tlsphi_dmax(A[4], A[8]));
    double X[3] = {mean[0], mean[1], mean[2]};
    for (int k = 0; k < 3; k++) {
        if (A[4 * k] < 0.05 * most) continue;
        const double share = (Q[k] * b[0] + Q[3 + k] * b[1] + Q[6 + k] * b[2]) / A[4 * k];
        for (int l = 0; l < 3; l++) X[l] += share * Q[3 * l + k];
    }
    tlsphi_contour_node_at(c, at, low);
    for (int k = 0; k < dim; k++) /* far outside its cell: planes that hardly meet */
        if (X[k] < low[k] - c->step / 2 || X[k] > low[k] + 1.5 * c->step) memcpy(X, mean, sizeof X);
    for (int k = 0; k < 3; k++) c->vertex[3 * tlsphi_contour_node(c, at) + (size_t)k] = (tlsph_real)X[k];
}
/* The facet across the grid edge from node `at` along an axis; with out == NULL only counts it. */
static void tlsphi_contour_facet(tlsphi_contour *c, const size_t at[3], int axis) {
    static const int turn[2][6] = {{0, 1, 2, 0, 2, 3}, {0, 2, 1, 0, 3, 2}};
    const int dim = c->fill->dimension, u = (axis + 1) % dim, w = (axis + 2) % dim;
    size_t next[3] = {at[0], at[1], at[2]};
    next[axis]++;
    const int in = c->phi[tlsphi_contour_node(c, at)] < 0;
    if (in == (c->phi[tlsphi_contour_node(c, next)] < 0)) return;
    for (int k = 0; c->out && k < (dim == 3 ? 6 : 2); k++) {
        size_t cell[3] = {at[0], at[1], at[2]};
        if (dim == 3) {
            const int corner = turn[!in][k];
            cell[u] -= (size_t)(corner == 0 || corner == 3);
            cell[w] -= (size_t)(corner < 2);
        } else cell[u] -= (size_t)((k == 0) == (in == (axis == 0)));
        memcpy(c->out + 3 * ((size_t)dim * c->count + (size_t)k), c->vertex + 3 * tlsphi_contour_node(c, cell), 3 * sizeof *c->out);
    }
    c->count += dim == 3 ? 2 : 1;
}
/* Visits all cells or edges inside the grid's rim. */
static void tlsphi_contour_sweep(tlsphi_contour *c, int vertices) {
    const int dim = c->fill->dimension;
    size_t i[3];
    for (i[2] = dim == 3 ? 1 : 0; i[2] + (dim == 3 ? 1 : 0) < c->nodes[2]; i[2]++)
        for (i[1] = 1; i[1] + 1 < c->nodes[1]; i[1]++)
            for (i[0] = 1; i[0] + 1 < c->nodes[0]; i[0]++) {
                if (vertices) tlsphi_contour_vertex(c, i);
                for (int axis = 0; !vertices && axis < dim; axis++) tlsphi_contour_facet(c, i, axis);
            }
}
static tlsph_result tlsphi_contour_make(tlsphi_plan *plan, const tlsph_fill *f, double spacing, tlsph_surface *surface) {
    tlsphi_contour c;
    size_t total = 1, i[3];
    double places = 1;
    memset(&c, 0, sizeof c);
    c.fill = f;
    c.step = spacing / 2;
    for (int k = 0; k < 3; k++) { /* an odd offset keeps the nodes off the faces of most bodies */
        c.low[k] = (double)f->origin[k] - (2.3719 + 0.0413 * k) * c.step;
        c.nodes[k] = k < f->dimension ? (size_t)((double)f->size[k] / c.step + 6) : 1;
        total *= c.nodes[k];
        places *= (double)c.nodes[k];
    }
    if (!(places < (double)(SIZE_MAX / 256))) return tlsphi_no_memory(plan, 32 * places);
    c.phi = TLSPHI_SCRATCH(plan, tlsph_real, total);
    c.vertex = TLSPHI_SCRATCH(plan, tlsph_real, 3 * total);
    if (!c.phi || !c.vertex) return tlsphi_no_memory(plan, 32.0 * (double)total);
    for (i[2] = 0; i[2] < c.nodes[2]; i[2]++)
        for (i[1] = 0; i[1] < c.nodes[1]; i[1]++)
            for (i[0] = 0; i[0] < c.nodes[0]; i[0]++) {
                double X[3];
                tlsphi_contour_node_at(&c, i, X);
                c.phi[tlsphi_contour_node(&c, i)] = (tlsph_real)tlsphi_fill_distance(f, X);
                for (int k = 0; k < f->dimension; k++)
                    if ((i[k] < 2 || i[k] + 2 >= c.nodes[k]) && c.phi[tlsphi_contour_node(&c, i)] < 0)
                        return tlsphi_surface_fail(plan->error, "distance beyond origin and size", X,
                                                   (double)c.phi[tlsphi_contour_node(&c, i)], "more than 0: a box around the body");
            }
    tlsphi_contour_sweep(&c, 1);
    tlsphi_contour_sweep(&c, 0);
    if (!(c.out = TLSPHI_SCRATCH(plan, tlsph_real, 3 * (size_t)f->dimension * c.count + 1)))
        return tlsphi_no_memory(plan, 72.0 * (double)c.count);
    c.count = 0;
    tlsphi_contour_sweep(&c, 0);
    surface->count = c.count;
    surface->corners = c.out;
    return TLSPH_OK;
}

/* -- setting particles -- */

typedef struct tlsphi_sampler {
    const tlsph_fill *fill;
    tlsphi_voronoi v; /* bins of facets and scratch */
    tlsphi_mesh mesh;
    double *X;        /* 3 each */
    uint8_t *kind;    /* 0 fixed, 1 on the surface, 2 inside */
    uint32_t *next;   /* of the same bin */
    uint32_t *head;   /* per bin of particles */
    size_t count, capacity, bins[3];
    double low[3], bin, largest; /* largest spacing */
    uint64_t random;
} tlsphi_sampler;

static double tlsphi_local_spacing(const tlsph_fill *f, const double X[3]) {
    const tlsph_real at[3] = {(tlsph_real)X[0], (tlsph_real)X[1], (tlsph_real)X[2]};
    const double s = f->spacing_at ? (double)f->spacing_at(f->spacing_user, at) : (double)f->spacing;
    const int plausible = tlsphi_finite((tlsph_real)s) && s > (double)f->spacing / 64 && s < 64 * (double)f->spacing;
    return plausible ? s : (double)f->spacing;
}
static void tlsphi_sample_cell(const tlsphi_sampler *s, const double X[3], size_t at[3]) {
    for (int k = 0; k < 3; k++)
        at[k] = (size_t)tlsphi_dmin((double)s->bins[k] - 1, tlsphi_dmax(0, floor((X[k] - s->low[k]) / s->bin)));
}
/* Calls for every particle within reach of X; stops when visit returns 1, and returns that. */
typedef int (*tlsphi_near_fn)(tlsphi_sampler *s, size_t b, const double d[3], double r, void *arg);
static int tlsphi_sample_near(tlsphi_sampler *s, const double X[3], double reach, tlsphi_near_fn visit, void *arg) {
    size_t from[3], to[3], at[3];
    double Y[3];
    for (int k = 0; k < 3; k++) Y[k] = X[k] - reach;
    tlsphi_sample_cell(s, Y, from);
    for (int k = 0; k < 3; k++) Y[k] = X[k] + reach;
    tlsphi_sample_cell(s, Y, to);
    for (at[2] = from[2]; at[2] <= to[2]; at[2]++)
        for (at[1] = from[1]; at[1] <= to[1]; at[1]++)
            for (at[0] = from[0]; at[0] <= to[0]; at[0]++)
                for (uint32_t b = s->head[(at[2] * s->bins[1] + at[1]) * s->bins[0] + at[0]]; b != TLSPHI_NONE; b = s->next[b]) {
                    double d[3];
                    for (int k = 0; k < 3; k++) d[k] = X[k] - s->X[3 * b + (uint32_t)k];
                    const double r = sqrt(tlsphi_dot3(d, d));
                    if (r < reach && visit(s, b, d, r, arg)) return 1;
                }
    return 0;
}
static int tlsphi_sample_any(tlsphi_sampler *s, size_t b, const double d[3], double r, void *arg) {
    (void)s;
    (void)b;
    (void)d;
    (void)r;
    (void)arg;
    return 1;
}
static void tlsphi_sample_link(tlsphi_sampler *s, size_t a) {
    size_t at[3];
    tlsphi_sample_cell(s, s->X + 3 * a, at);
    uint32_t *head = s->head + (at[2] * s->bins[1] + at[1]) * s->bins[0] + at[0];
    s->next[a] = *head;
    *head = (uint32_t)a;
}
static tlsph_result tlsphi_sample_add(tlsphi_sampler *s, const double X[3], int kind) {
    if (s->count == s->capacity) {
        const size_t more = s->capacity ? 2 * s->capacity : 4096, n = s->count;
        tlsphi_plan *plan = &s->v.plan;
        s->X = (double *)tlsphi_scratch_grow(plan, s->X, 3 * n, 3 * more, sizeof *s->X);
        s->kind = (uint8_t *)tlsphi_scratch_grow(plan, s->kind, n, more, 1);
        s->next = (uint32_t *)tlsphi_scratch_grow(plan, s->next, n, more, sizeof *s->next);
        if (!s->X || !s->kind || !s->next || more > 1000000000u) return tlsphi_no_memory(plan, 29.0 * (double)more);
        s->capacity = more;
    }
    memcpy(s->X + 3 * s->count, X, 3 * sizeof *X);
    s->kind[s->count] = (uint8_t)kind;
    tlsphi_sample_link(s, s->count++);
    return TLSPH_OK;
}
/* A particle at X, unless another is nearer than share x spacing. */
static tlsph_result tlsphi_sample_try(tlsphi_sampler *s, const double X[3], int kind, double share) {
    if (tlsphi_sample_near(s, X, share * tlsphi_local_spacing(s->fill, X), tlsphi_sample_any, NULL)) return TLSPH_OK;
    return tlsphi_sample_add(s, X, kind);
}
/* Nearest point of a facet (2-D: of a segment) to P. */
static void tlsphi_nearest_on_facet(const tlsphi_mesh *m, size_t facet, const double P[3], double out[3]) {
    double best = 1e300, n[3], v[3][3], d[3];
    tlsphi_mesh_normal(m, facet, n);
    for (int c = 0; c < m->corners; c++) tlsphi_mesh_point(m, facet, c, v[c]);
    if (m->dim == 3) { /* the foot of the perpendicular, if it is inside */
        int in = 1;
        for (int k = 0; k < 3; k++) d[k] = P[k] - v[0][k];
        const double off = tlsphi_dot3(d, n);
        for (int k = 0; k < 3; k++) out[k] = P[k] - off * n[k];
        for (int c = 0; c < 3 && in; c++) {
            double edge[3], to[3], x[3];
            for (int k = 0; k < 3; k++) {
                edge[k] = v[(c + 1) % 3][k] - v[c][k];
                to[k] = out[k] - v[c][k];
            }
            tlsphi_cross3(edge, to, x);
            in = tlsphi_dot3(x, n) >= 0;
        }
        if (in) return;
    }
    for (int c = 0; c < (m->dim == 3 ? 3 : 1); c++) {
        double edge[3], to[3], x[3], rr = 0;
        for (int k = 0; k < 3; k++) {
            edge[k] = v[(c + 1) % m->corners][k] - v[c][k];
            to[k] = P[k] - v[c][k];
        }
        const double at = tlsphi_dmin(1, tlsphi_dmax(0, tlsphi_dot3(to, edge) / (tlsphi_dot3(edge, edge) + 1e-300)));
        for (int k = 0; k < 3; k++) {
            x[k] = v[c][k] + at * edge[k];
            rr += (x[k] - P[k]) * (x[k] - P[k]);
        }
        if (!(rr < best)) continue;
        best = rr;
        memcpy(out, x, sizeof x);
    }
}
/* Signed distance to the surface and its nearest point, in growing rings of bins. Where facets are equally near (an edge),
   the one most across tells the side. */
static double tlsphi_surface_distance(tlsphi_sampler *s, const double P[3], double nearest[3]) {
    tlsphi_voronoi *v = &s->v;
    double best = 1e300, across = 0;
    long at[3], most = 0;
    for (int k = 0; k < 3; k++) {
        at[k] = (long)tlsphi_dmin((double)v->bins[k] - 1, tlsphi_dmax(0, floor((P[k] - v->low[k]) / v->bin)));
        most = most > (long)v->bins[k] ? most : (long)v->bins[k];
    }
    v->stamped++;
    for (long ring = 0; ring <= most && best > (double)(ring - 1) * v->bin; ring++)
        for (long z = at[2] - ring; z <= at[2] + ring; z++)
            for (long y = at[1] - ring; y <= at[1] + ring; y++) {
                const int rim = labs(z - at[2]) == ring || labs(y - at[1]) == ring;
                if (z < 0 || y < 0 || z >= (long)v->bins[2] || y >= (long)v->bins[1]) continue;
                for (long x = at[0] - ring; x <= at[0] + ring; x += rim || !ring ? 1 : 2 * ring) {
                    if (x < 0 || x >= (long)v->bins[0]) continue;
                    const size_t b = ((size_t)z * v->bins[1] + (size_t)y) * v->bins[0] + (size_t)x;
                    for (size_t i = v->bin_first[b]; i < v->bin_first[b + 1]; i++) {
                        const uint32_t f = v->bin_facet[i];
                        double Q[3], n[3], d[3];
                        if (v->stamp[f] == v->stamped) continue;
                        v->stamp[f] = v->stamped;
                        tlsphi_nearest_on_facet(&s->mesh, f, P, Q);
                        for (int k = 0; k < 3; k++) d[k] = P[k] - Q[k];
                        const double r = sqrt(tlsphi_dot3(d, d));
                        if (r > best * (1 + 1e-9)) continue;
                        tlsphi_mesh_normal(&s->mesh, f, n);
                        const double off = tlsphi_dot3(d, n);
                        if (r > best * (1 - 1e-9) && fabs(off) <= fabs(across)) continue;
                        best = r;
                        across = off;
                        memcpy(nearest, Q, sizeof Q);
                    }
                }
            }
    return across < 0 ? -best : best;
}
static double tlsphi_sample_distance(tlsphi_sampler *s, const double X[3]) {
    double nearest[3];
    return s->fill->shape == TLSPH_DISTANCE || s->fill->shape == TLSPH_SPHERE || s->fill->shape == TLSPH_CYLINDER
               ? tlsphi_fill_distance(s->fill, X)
               : tlsphi_surface_distance(s, X, nearest);
}

/* -- lines of sharp edges (2-D: the whole surface) -- */

typedef struct tlsphi_features {
    uint32_t (*end)[2];    /* vertices of each feature edge */
    uint32_t (*edge_of)[2]; /* the first two feature edges of each vertex */
    uint32_t *degree;
    uint8_t *corner, *used;
    size_t count;
} tlsphi_features;

static void tlsphi_vertex_point(const tlsphi_mesh *m, uint32_t vertex, double X[3]) {
    const size_t i = m->first_corner[vertex];
    tlsphi_mesh_point(m, i / (size_t)m->corners, (int)(i % (size_t)m->corners), X);
}
static void tlsphi_feature_add(tlsphi_features *l, uint32_t u, uint32_t w) {
    const uint32_t ends[2] = {u, w};
    for (int k = 0; k < 2; k++) {
        l->end[l->count][k] = ends[k];
        if (l->degree[ends[k]] < 2) l->edge_of[ends[k]][l->degree[ends[k]]] = (uint32_t)l->count;
        l->degree[ends[k]]++;
    }
    l->count++;
}
static uint32_t tlsphi_other_end(const tlsphi_features *l, uint32_t edge, uint32_t vertex) {
    return l->end[edge][0] == vertex ? l->end[edge][1] : l->end[edge][0];
}
static tlsph_result tlsphi_feature_find(tlsphi_sampler *s, tlsphi_features *l) {
    tlsphi_mesh *m = &s->mesh;
    tlsphi_plan *plan = &s->v.plan;
    const size_t n = (size_t)m->corners * m->facets;
    memset(l, 0, sizeof *l);
    l->end = (uint32_t (*)[2])tlsphi_scratch_take(plan, n, sizeof *l->end);
    l->edge_of = (uint32_t (*)[2])tlsphi_scratch_take(plan, m->vertices, sizeof *l->edge_of);
    l->degree = TLSPHI_SCRATCH(plan, uint32_t, m->vertices);
    l->corner = TLSPHI_SCRATCH(plan, uint8_t, m->vertices);
    l->used = TLSPHI_SCRATCH(plan, uint8_t, n);
    if (!l->end || !l->edge_of || !l->degree || !l->corner || !l->used) return tlsphi_no_memory(plan, 40.0 * (double)n);
    for (size_t f = 0; m->dim == 2 && f < m->facets; f++) tlsphi_feature_add(l, m->vertex[2 * f], m->vertex[2 * f + 1]);
    for (size_t i = 0; m->dim == 3 && i + 1 < n; i++) {
        double a[3], b[3];
        if (m->edge[i] != m->edge[i + 1] || (i && m->edge[i - 1] == m->edge[i])) continue;
        tlsphi_mesh_normal(m, m->half[i] / 3, a);
        tlsphi_mesh_normal(m, m->half[i + 1] / 3, b);
        if (tlsphi_dot3(a, b) < TLSPHI_SHARP)
            tlsphi_feature_add(l, (uint32_t)(m->edge[i] >> 32), (uint32_t)m->edge[i]);
    }
    for (uint32_t v = 0; v < m->vertices; v++) {
        double X[3], Y[2][3];
        l->corner[v] = l->degree[v] != 0 && l->degree[v] != 2;
        if (l->degree[v] != 2) continue;
        tlsphi_vertex_point(m, v, X);
        for (int k = 0; k < 2; k++) {
            tlsphi_vertex_point(m, tlsphi_other_end(l, l->edge_of[v][k], v), Y[k]);
            for (int i = 0; i < 3; i++) Y[k][i] -= X[i];
        }
        l->corner[v] = -tlsphi_dot3(Y[0], Y[1]) < TLSPHI_SHARP * sqrt(tlsphi_dot3(Y[0], Y[0]) * tlsphi_dot3(Y[1], Y[1]));
    }
    return TLSPH_OK;
}
/* Walks a line from `vertex` along `edge` to the next corner. With `every` <= 0 only measures it, in spacings; else sets a
   particle after each `every`. */
static tlsph_result tlsphi_line_walk(tlsphi_sampler *s, tlsphi_features *l, uint32_t vertex, uint32_t edge, double every,
                                     size_t wanted, double *length) {
    double A[3], B[3], done = 0;
    size_t placed = 0;
    const uint32_t start = vertex;
    for (;;) {
        const uint32_t to = tlsphi_other_end(l, edge, vertex);
        double size = 0, X[3];
        l->used[edge] = 1;
        tlsphi_vertex_point(&s->mesh, vertex, A);
        tlsphi_vertex_point(&s->mesh, to, B);
        for (int k = 0; k < 3; k++) {
            size += (B[k] - A[k]) * (B[k] - A[k]);
            X[k] = (A[k] + B[k]) / 2;
        }
        const double step = sqrt(size) / tlsphi_local_spacing(s->fill, X);
        while (every > 0 && placed < wanted && (double)(placed + 1) * every <= done + step * (1 + 1e-9)) {
            const double at = ((double)++placed * every - done) / step;
            for (int k = 0; k < 3; k++) X[k] = A[k] + (B[k] - A[k]) * at;
            const tlsph_result r = tlsphi_sample_add(s, X, 0);
            if (r) return r;
        }
        done += step;
        vertex = to;
        if (l->corner[to] || to == start) break;
        edge = l->edge_of[to][0] == edge ? l->edge_of[to][1] : l->edge_of[to][0];
    }
    *length = done;
    return TLSPH_OK;
}
static tlsph_result tlsphi_sample_lines(tlsphi_sampler *s) {
    tlsphi_features l;
    tlsph_result r = tlsphi_feature_find(s, &l);
    for (uint32_t v = 0; !r && v < s->mesh.vertices; v++) {
        double X[3];
        tlsphi_vertex_point(&s->mesh, v, X);
        if (l.corner[v]) r = tlsphi_sample_try(s, X, 0, 0.6); /* rims of contours bend at many vertices */
    }
    for (int loops = 0; loops < 2; loops++) /* lines between corners, then closed ones */
        for (uint32_t e = 0; !r && e < l.count; e++) {
            uint32_t from = l.end[e][0];
            double length, X[3];
            if (l.used[e]) continue;
            if (!l.corner[from]) from = l.end[e][1];
            if (!loops && !l.corner[from]) continue;
            tlsphi_vertex_point(&s->mesh, from, X);
            if (loops && (r = tlsphi_sample_add(s, X, 0))) return r;
            r = tlsphi_line_walk(s, &l, from, e, 0, 0, &length);
            const double parts = floor(length + 0.5);
            if (!r && parts > 1) r = tlsphi_line_walk(s, &l, from, e, length / parts, (size_t)parts - 1, &length);
        }
    return r;
}

/* -- faces and inside -- */

static tlsph_result tlsphi_sample_faces(tlsphi_sampler *s) {
    const tlsphi_mesh *m = &s->mesh;
    double *sum = TLSPHI_SCRATCH(&s->v.plan, double, m->facets + 1);
    if (!sum) return tlsphi_no_memory(&s->v.plan, 8.0 * (double)m->facets);
    for (size_t f = 0; f < m->facets; f++) { /* area in squares of the local spacing */
        double n[3], X[3] = {0, 0, 0}, v[3];
        for (int c = 0; c < 3; c++) {
            tlsphi_mesh_point(m, f, c, v);
            for (int k = 0; k < 3; k++) X[k] += v[k] / 3;
        }
        sum[f + 1] = sum[f] + tlsphi_mesh_normal(m, f, n) / pow(tlsphi_local_spacing(s->fill, X), 2);
    }
    if (!(30 * sum[m->facets] < 4e9)) return tlsphi_no_memory(&s->v.plan, 24 * sum[m->facets]);
    const size_t tries = (size_t)(30 * sum[m->facets]) + 64;
    size_t step = (size_t)(0.6180339887 * (double)tries) | 1, i = 0;
    for (size_t a = tries, b = step % tries; b || a != 1;) { /* make it coprime, so that every share of the area has its turn */
        if (!b) {
            step += 2;
            a = tries;
            b = step % tries;
            continue;
        }
        const size_t rest = a % b;
        a = b;
        b = rest;
    }
    for (size_t t = 0; t < tries; t++, i = (i + step) % tries) {
        const double at = sum[m->facets] * ((double)i + tlsphi_random(&s->random)) / (double)tries;
        double u = tlsphi_random(&s->random), w = tlsphi_random(&s->random), v[3][3], X[3];
        size_t low = 0, high = m->facets;
        while (high - low > 1) {
            const size_t middle = (low + high) / 2;
            if (sum[middle] <= at) low = middle;
            else high = middle;
        }
        if (u + w > 1) u = 1 - u, w = 1 - w;
        for (int c = 0; c < 3; c++) tlsphi_mesh_point(m, low, c, v[c]);
        for (int k = 0; k < 3; k++) X[k] = v[0][k] + u * (v[1][k] - v[0][k]) + w * (v[2][k] - v[0][k]);
        const tlsph_result r = tlsphi_sample_try(s, X, 1, 0.82);
        if (r) return r;
    }
    return TLSPH_OK;
}
/* A lattice that fits the bounds, or, where the spacing varies, random places that keep their distance. */
static tlsph_result tlsphi_sample_inside(tlsphi_sampler *s) {
    const tlsphi_mesh *m = &s->mesh;
    const int varies = s->fill->spacing_at != NULL, inside = s->fill->placement == TLSPH_SCATTERED_INSIDE;
    size_t cells[3], i[3];
    double width[3];
    for (int k = 0; k < 3; k++) {
        cells[k] = k < m->dim ? (size_t)((m->high[k] - m->low[k]) / s->largest + 0.5) : 1;
        if (!cells[k]) cells[k] = 1;
        width[k] = (m->high[k] - m->low[k]) / (double)cells[k];
    }
    for (int pass = 0; pass < (varies ? 24 : 1); pass++)
        for (i[2] = 0; i[2] < cells[2]; i[2]++)
            for (i[1] = 0; i[1] < cells[1]; i[1]++)
                for (i[0] = 0; i[0] < cells[0]; i[0]++) {
                    double X[3], middle[3];
                    for (int k = 0; k < 3; k++) middle[k] = m->low[k] + width[k] * ((double)i[k] + 0.5);
                    const double ratio = s->largest / tlsphi_local_spacing(s->fill, middle);
                    const size_t tries = varies ? (size_t)ceil(m->dim == 3 ? ratio * ratio * ratio : ratio * ratio) : 1;
                    for (size_t t = 0; t < tries; t++) {
                        for (int k = 0; k < 3; k++) {
                            const double shift = tlsphi_random(&s->random);
                            const double still = (inside ? 0.5 : 0) + (2 * shift - 1) * (double)s->fill->jitter;
                            X[k] = m->low[k] + width[k] * ((double)i[k] + (varies ? shift : still));
                            if (k >= m->dim) X[k] = 0;
                        }
                        const double h = tlsphi_local_spacing(s->fill, X);
                        const double share = varies ? (m->dim == 3 ? 0.87 : 0.83) : 0.5;
                        if (tlsphi_sample_near(s, X, share * h, tlsphi_sample_any, NULL)) continue;
                        if (!(tlsphi_sample_distance(s, X) < -(inside ? TLSPHI_BEHIND_LEAST : 0.5) * h)) continue;
                        const tlsph_result r = tlsphi_sample_add(s, X, 2);
                        if (r) return r;
                    }
                }
    return TLSPH_OK;
}
typedef struct tlsphi_push {
    double h, move[3];
    size_t self;
} tlsphi_push;
static int tlsphi_sample_push(tlsphi_sampler *s, size_t b, const double d[3], double r, void *arg) {
    tlsphi_push *push = (tlsphi_push *)arg;
    const double q = 1 - r / (1.5 * push->h);
    (void)s;
    if (b == push->self || !(r > 0)) return 0;
    for (int k = 0; k < 3; k++) push->move[k] += q * q * d[k] / r;
    return 0;
}
/* Moves a particle inside from X to Y, unless that comes near the surface: with all particles inside to what is then nearest. */
static void tlsphi_sample_move(tlsphi_sampler *s, double X[3], double Y[3], double h) {
    const int inside = s->fill->placement == TLSPH_SCATTERED_INSIDE;
    double nearest[3], deep = tlsphi_sample_distance(s, Y);
    if (inside && deep < 0 && deep > -TLSPHI_BEHIND * h && (deep = tlsphi_surface_distance(s, Y, nearest)) < 0)
        for (int k = 0; k < 3; k++) Y[k] = nearest[k] - (Y[k] - nearest[k]) * TLSPHI_BEHIND * h / deep;
    if (tlsphi_sample_distance(s, Y) < -(inside ? TLSPHI_BEHIND_LEAST : 0.4) * h) memcpy(X, Y, 3 * sizeof *X);
}
/* Particles push each other apart, one after the other: faces within the surface, the inside by less than reaches it. */
static void tlsphi_sample_relax(tlsphi_sampler *s) {
    const size_t bins = s->bins[0] * s->bins[1] * s->bins[2];
    for (int pass = 0; pass < TLSPHI_RELAXATIONS; pass++) {
        for (size_t a = 0; a < s->count; a++) {
            double *X = s->X + 3 * a, Y[3];
            tlsphi_push push;
            if (!s->kind[a]) continue;
            memset(&push, 0, sizeof push);
            push.h = tlsphi_local_spacing(s->fill, X);
            push.self = a;
            tlsphi_sample_near(s, X, 1.5 * push.h, tlsphi_sample_push, &push);
            const double size = sqrt(tlsphi_dot3(push.move, push.move)), step = tlsphi_dmin(0.3, 0.15 / (size + 1e-300)) * push.h;
            for (int k = 0; k < 3; k++) Y[k] = X[k] + (k < s->mesh.dim ? step * push.move[k] : 0);
            if (s->kind[a] == 1) tlsphi_surface_distance(s, Y, X);
            else tlsphi_sample_move(s, X, Y, push.h);
        }
        for (size_t b = 0; b < bins; b++) s->head[b] = TLSPHI_NONE;
        for (size_t a = 0; a < s->count; a++) tlsphi_sample_link(s, a);
    }
}
/* f: s->fill, which gets the bounds of its triangles. */
static tlsph_result tlsphi_sample_begin(tlsphi_sampler *s, tlsph_fill *f, tlsph_error *error) {
    tlsphi_plan *plan = &s->v.plan;
    double least = 1e300;
    tlsph_surface surface = f->surface;
    tlsph_result r;
    if (f->shape == TLSPH_TRIANGLES) {
        if ((r = tlsphi_mesh_make(&s->mesh, plan, f->dimension, &surface, error))) return r;
        for (int k = 0; k < 3; k++) {
            f->origin[k] = (tlsph_real)s->mesh.low[k];
            f->size[k] = (tlsph_real)(s->mesh.high[k] - s->mesh.low[k]);
            if (!(f->size[k] < TLSPHI_LINES * f->spacing))
                return tlsphi_fail(error, TLSPH_ERROR_DESCRIPTION, "fill", "spacing", TLSPH_NO_PARTICLE,
                                   (double)f->spacing, 0, "fewer than 4096 in the surface's bounds");
        }
    }
    for (int i = 0; i < 4096; i++) { /* the range of spacings, from a grid of 16^3 places */
        const int at[3] = {i % 16, i / 16 % 16, f->dimension == 3 ? i / 256 : 0};
        double X[3];
        for (int k = 0; k < 3; k++) X[k] = (double)f->origin[k] + (double)f->size[k] * at[k] / 15;
        const double h = tlsphi_local_spacing(f, X);
        least = tlsphi_dmin(least, h);
        s->largest = tlsphi_dmax(s->largest, h);
    }
    if (f->shape != TLSPH_TRIANGLES && ((r = tlsphi_contour_make(plan, f, least, &surface)) ||
                                        (r = tlsphi_mesh_make(&s->mesh, plan, f->dimension, &surface, error))))
        return r;
    if ((r = tlsphi_voronoi_bins(&s->v, &s->mesh, s->largest))) return r;
    size_t total = 1;
    s->bin = 1.5 * s->largest;
    for (int k = 0; k < f->dimension; k++) s->bin = tlsphi_dmax(s->bin, (s->mesh.high[k] - s->mesh.low[k]) / 1000);
    for (int k = 0; k < 3; k++) {
        s->low[k] = s->mesh.low[k];
        s->bins[k] = (size_t)((s->mesh.high[k] - s->mesh.low[k]) / s->bin) + 1;
        total *= s->bins[k];
    }
    if (!(s->head = TLSPHI_SCRATCH(plan, uint32_t, total))) return tlsphi_no_memory(plan, 4.0 * (double)total);
    for (size_t b = 0; b < total; b++) s->head[b] = TLSPHI_NONE;
    if (f->placement == TLSPH_SCATTERED && (r = tlsphi_sample_lines(s))) return r;
    if (f->placement == TLSPH_SCATTERED && f->dimension == 3 && (r = tlsphi_sample_faces(s))) return r;
    if ((r = tlsphi_sample_inside(s))) return r;
    tlsphi_sample_relax(s);
    return TLSPH_OK;
}
static tlsph_result tlsphi_sample_store(tlsphi_sampler *s, tlsph_cloud *cloud, tlsph_error *error) {
    const size_t n = s->count, dim = (size_t)s->fill->dimension;
    tlsphi_arena arena;
    tlsph_real *X = NULL, *V = NULL, *w = NULL, *B = NULL, *h = NULL, *T = NULL;
    const int inside = s->fill->placement == TLSPH_SCATTERED_INSIDE;
    tlsph_surface surface;
    if (!n) return tlsphi_fail(error, TLSPH_ERROR_SIZE, "fill", "particles", TLSPH_NO_PARTICLE, 0, 0, "at least 1; refine the spacing");
    memset(&arena, 0, sizeof arena);
    for (int pass = 0; pass < 2; pass++) {
        arena.used = 0;
        X = TLSPHI_TAKE(&arena, tlsph_real, 3 * n);
        V = TLSPHI_TAKE(&arena, tlsph_real, n);
        w = TLSPHI_TAKE(&arena, tlsph_real, n);
        B = TLSPHI_TAKE(&arena, tlsph_real, 3 * n);
        h = TLSPHI_TAKE(&arena, tlsph_real, n);
        T = TLSPHI_TAKE(&arena, tlsph_real, inside ? 9 * n : 0);
        if (pass) break;
        cloud->memory_size = arena.size = arena.used;
        cloud->allocator = s->v.plan.allocator;
        cloud->memory = cloud->allocator.allocate(cloud->allocator.user, cloud->memory_size);
        if (!cloud->memory) return tlsphi_no_memory(&s->v.plan, (double)cloud->memory_size);
        arena.memory = (unsigned char *)cloud->memory;
    }
    for (size_t a = 0; a < n; a++) {
        const double local = tlsphi_local_spacing(s->fill, s->X + 3 * a);
        for (size_t k = 0; k < 3; k++) X[3 * a + k] = (tlsph_real)s->X[3 * a + k];
        w[a] = (tlsph_real)pow(local, (double)dim);
        h[a] = (tlsph_real)local;
    }
    cloud->particles.count = n;
    cloud->particles.positions = X;
    cloud->particles.volumes = V;
    cloud->particles.weights = w;
    cloud->particles.areas = B;
    if (inside) cloud->particles.moments = T;
    cloud->particles.spacing = (tlsph_real)s->largest;
    if (s->fill->spacing_at) cloud->particles.spacings = h;
    for (size_t k = 0; k < dim; k++) cloud->cell_size[k] = (tlsph_real)s->largest;
    surface.count = s->mesh.facets;
    surface.corners = s->mesh.given;
    return tlsph_voronoi((int)dim, &cloud->particles, &surface, &cloud->allocator, V, B, inside ? T : NULL, error);
}
/* surface: of boxes and the like, or none. */
static tlsph_result tlsphi_cloud_scatter(const tlsph_fill *fill, const tlsph_surface *surface, tlsph_cloud *cloud,
                                         tlsph_error *error) {
    tlsphi_sampler s;
    tlsph_fill copy = *fill;
    memset(&s, 0, sizeof s);
    if (surface) {
        copy.surface = *surface;
        copy.shape = TLSPH_TRIANGLES;
    }
    s.fill = &copy;
    s.random = fill->seed;
    s.v.plan.error = error;
    s.v.plan.allocator = tlsphi_allocator(&fill->allocator);
    tlsph_result r = tlsphi_sample_begin(&s, &copy, error);
    if (!r) r = tlsphi_sample_store(&s, cloud, error);
    tlsphi_plan_release(&s.v.plan);
    return r;
}

/* ==== [PREFLIGHT] ================================================================================================== */

TLSPHI_DEF const char *tlsph_hint_text(tlsph_hint hint) {
    static const char *const texts[] = {
#define TLSPHI_HINT(id, text) text,
        TLSPH_HINTS(TLSPHI_HINT)
#undef TLSPHI_HINT
    };
    return (unsigned)hint < (unsigned)TLSPH_HINT_COUNT ? texts[hint] : "no such hint";
}
static void tlsphi_hint(tlsph_preflight_report *r, tlsph_hint hint, int holds) {
    if (holds) r->hints |= 1u << hint;
}
/* How evenly the neighbours of a lie around it: dim times the least eigenvalue of sum |C| e (x) e / sum |C|, e = C/|C|. */
static double tlsphi_evenness(const tlsph_solver *s, size_t tile, size_t a) {
    const tlsphi_graph *graph = &s->graph;
    double K[9] = {0}, Q[9], sum = 0;
    for (size_t k = graph->first[tile]; k < graph->first[tile + 1]; k++) {
        const size_t at = (size_t)graph->slot[k].pattern * (size_t)graph->width * TLSPHI_LANES + a % TLSPHI_LANES;
        double C[3] = {0, 0, 0};
        for (int i = 0; i < s->dim; i++) C[i] = (double)graph->pattern[at + (size_t)i * TLSPHI_LANES];
        const double length = sqrt(tlsphi_norm2(C));
        for (int i = 0; i < 9 && length > 0; i++) K[i] += C[i / 3] * C[i % 3] / length;
        sum += length;
    }
    if (s->dim == 2) K[8] = sum;
    tlsphi_eigen(K, Q);
    return sum > 0 ? s->dim * tlsphi_dmin(K[0], tlsphi_dmin(K[4], K[8])) / sum : 0;
}
/* Corrected kernels: inside a lattice the antisymmetric parts add up to zero, inside an irregular cloud they do not. */
static int tlsphi_is_irregular(const tlsph_solver *s) {
    size_t inside = 0, open = 0;
    for (size_t a = 0; s->M && a < s->n; a++) {
        double B[3];
        if (s->found[a] < s->size.neighbours_most) continue;
        tlsphi_vector3(tlsphi_boundary(s, a), s->dim, B);
        inside++;
        open += sqrt(tlsphi_norm2(B)) > 1e-3 * pow((double)s->V[a], (s->dim - 1.0) / s->dim);
    }
    return 2 * open > inside;
}
static double tlsphi_survey_particles(const tlsph_solver *s, tlsph_preflight_report *r) {
    double sound_step = TLSPHI_LARGEST;
    r->support = r->spacing_least = TLSPHI_LARGEST;
    for (size_t a = 0, block = 0, tile = 0; a < s->n; a++) {
        block += a == s->block[block].end;
        tile += a > 0 && (a % TLSPHI_LANES == 0 || a == s->block[block].begin);
        const double even = tlsphi_evenness(s, tile, a), tau = (double)s->tau[a];
        if (even < r->support) {
            r->support = even;
            r->weakest = s->host[a];
        }
        r->spacing_least = tlsphi_dmin(r->spacing_least, tau);
        r->spacing_most = tlsphi_dmax(r->spacing_most, tau);
        const double c_p = (double)*tlsphi_at(s, s->rows.wave, a);
        if (c_p > 0) sound_step = tlsphi_dmin(sound_step, (double)s->cfl * tau / c_p);
    }
    return sound_step;
}
/* Sizes of the bodies; returns the longest extent, m. */
static double tlsphi_survey_bodies(const tlsph_solver *s, tlsph_preflight_report *r) {
    const size_t D = (size_t)s->dim;
    double longest = 0;
    r->smallest_body = s->n;
    for (size_t i = 0; i < s->bodies; i++) {
        const size_t begin = s->body[i].first, end = i + 1 < s->bodies ? s->body[i + 1].first : s->n;
        double volume = 0, thin = TLSPHI_LARGEST;
        for (size_t a = begin; a < end; a++) volume += (double)s->V[a];
        for (size_t k = 0; k < D; k++) {
            double low = TLSPHI_LARGEST, high = -TLSPHI_LARGEST;
            for (size_t a = begin; a < end; a++) {
                low = tlsphi_dmin(low, (double)tlsphi_X(s, a, k));
                high = tlsphi_dmax(high, (double)tlsphi_X(s, a, k));
            }
            thin = tlsphi_dmin(thin, high - low);
            longest = tlsphi_dmax(longest, high - low);
        }
        if (end - begin < r->smallest_body) r->smallest_body = end - begin;
        tlsphi_hint(r, TLSPH_HINT_THIN, thin < 1.5 * pow(volume / (double)(end - begin), 1.0 / s->dim));
    }
    return longest;
}
static int tlsphi_load_is_huge(const tlsph_solver *s, const tlsphi_load *load, double length) {
    const tlsphi_material *m = tlsphi_material_of(s, load->given.count ? load->inner[0] : 0);
    const tlsph_real *v = load->given.value;
    const double value = sqrt((double)tlsphi_dot(3, v, v)), stiffness = (double)(m->kappa + m->mu);
    switch (load->given.kind) {
    case TLSPH_VELOCITY: return value > sqrt(stiffness / (double)m->rho);
    case TLSPH_TRACTION:
    case TLSPH_PRESSURE: return value > stiffness;
    case TLSPH_BODY_FORCE: return value * length > stiffness;
    case TLSPH_ACCELERATION: return value * length * (double)m->rho > stiffness;
    default: return 0;
    }
}
/* The shortest waves feel raw jumps only and decay at 2 (c_p + (D - 1) c_s)/tau, which must lie within the scheme's reach on
   the real axis: 2, or 2.51 with three full stages. 4 % beyond it was still stable in bodies of 16 spacings. */
static int tlsphi_overdamps(const tlsph_solver *s) {
    const double reach = 1.04 * (s->integrator == TLSPH_SSP_RK3 ? 2.51 : 2);
    int over = 0;
    for (size_t i = 0; s->dissipation < TLSPH_JST && !s->incompressible && i < s->material_count; i++) {
        const tlsphi_material *m = s->materials + i;
        const double c_s = sqrt((double)(m->mu / m->rho)), c_p = (double)m->c_linear;
        over |= (double)s->cfl * 2 * (1 + (s->dim - 1) * c_s / c_p) > reach;
    }
    return over;
}
/* Times that forces are gathered over pairs in a step. A pass of [MULTI-RATE] takes its level and what that touches. */
static double tlsphi_survey_visits(const tlsph_solver *s) {
    const tlsphi_rates *rates = &s->rates;
    double visits = 0;
    if (rates->levels < 2) return (double)s->pairs * tlsphi_schemes[s->integrator].stages;
    for (int l = 0; l < rates->levels; l++) {
        const size_t *first = rates->first + 2 * l;
        for (size_t i = first[0]; first[0] < first[1] && i < first[2]; i++) {
            const tlsphi_block *block = s->block + rates->list[i];
            for (size_t a = block->begin; a < block->end; a++) visits += (double)s->found[a] * (1 << l);
        }
    }
    return visits;
}
TLSPHI_DEF void tlsph_preflight(const tlsph_solver *s, tlsph_real end_time, tlsph_preflight_report *r) {
    memset(r, 0, sizeof *r);
    const double end = (double)end_time, sound_step = tlsphi_survey_particles(s, r);
    const double length = tlsphi_survey_bodies(s, r);
    r->particles = s->n;
    r->pairs = s->pairs;
    r->bodies = s->bodies;
    r->bytes = s->size.bytes;
    r->time_step = (double)tlsph_stable_time_step(s);
    r->steps = ceil(tlsphi_dmax(end - s->time, 0) / r->time_step);
    r->crossings = sound_step < TLSPHI_LARGEST
                       ? tlsphi_dmax(end - s->time, 0) * (double)s->cfl * r->spacing_least / (sound_step * length)
                       : 0;
    r->pair_visits = tlsphi_survey_visits(s) * r->steps;
    tlsphi_hint(r, TLSPH_HINT_WEAK_SUPPORT, r->support < 0.1);
    tlsphi_hint(r, TLSPH_HINT_IRREGULAR, tlsphi_is_irregular(s));
    for (size_t i = 0; i < s->material_count && !s->has_J; i++) /* kappa/mu at nu = 0.49 */
        tlsphi_hint(r, TLSPH_HINT_INCOMPRESSIBLE, s->materials[i].kappa > TLSPHI_R(49.7) * s->materials[i].mu);
    tlsphi_hint(r, TLSPH_HINT_CFL, s->cfl > tlsph_cfl_limit(s->integrator) || tlsphi_overdamps(s));
    tlsphi_hint(r, TLSPH_HINT_SMALL_PARTICLES, s->rates.levels < 2 && r->spacing_least < 0.1 * r->spacing_most);
    tlsphi_hint(r, TLSPH_HINT_DIFFUSION, r->time_step < 0.5 * sound_step && s->conducts);
    tlsphi_hint(r, TLSPH_HINT_UNITS_TIME, end > 0 && (end < r->time_step || r->steps > 1e8));
    for (size_t i = 0; i < s->loads; i++)
        tlsphi_hint(r, TLSPH_HINT_UNITS_LOAD, tlsphi_load_is_huge(s, s->load + i, length));
}

/* ==== [FILL] =======================================================================================================
   A lattice of cells over the shape's box. A cell belongs to the body if its centre does. On-face particles sit at the
   corners of cells with an eighth (2-D: a quarter) of each cell around them; cell-centred ones in the middle. The lines
   of the lattice are spaced per segment, so that the notch of an L lies on a line. */

typedef struct tlsphi_lattice {
    const tlsph_fill *fill;
    tlsph_allocator allocator;
    size_t cells[3], lines[3]; /* per axis */
    double *line[3];           /* coordinates */
    unsigned char *inside;     /* per cell */
    uint32_t *number;          /* per corner or cell: particle, or TLSPHI_NONE */
    size_t particles, body_cells;
    void *memory;
    size_t memory_size;
} tlsphi_lattice;

static int tlsphi_inside(const tlsph_fill *f, const double X[3]) {
    double r2 = 0, least = 1e300;
    tlsph_real at[3];
    for (int i = 0; i < 3; i++) at[i] = (tlsph_real)X[i];
    switch (f->shape) {
    case TLSPH_L_SHAPE:
        return !(X[0] > (double)f->origin[0] + (double)f->notch[0] &&
                 X[1] > (double)f->origin[1] + (double)f->notch[1]);
    case TLSPH_PREDICATE: return f->inside(f->inside_user, at);
    case TLSPH_DISTANCE: return f->distance(f->distance_user, at) < 0;
    case TLSPH_CYLINDER:
    case TLSPH_SPHERE:
        for (int i = 0; i < f->dimension; i++) {
            const double half = (double)f->size[i] / 2, d = X[i] - (double)f->origin[i] - half;
            if (f->shape == TLSPH_CYLINDER && f->dimension == 3 && i == f->axis) continue;
            r2 += d * d;
            least = tlsphi_dmin(least, half);
        }
        return r2 <= least * least && r2 >= (double)f->inner_radius * (double)f->inner_radius;
    default: return 1;
    }
}
/* Writes the lines of one segment [low, low + length], returns how many cells it has. */
static size_t tlsphi_segment(double *line, double low, double length, double spacing) {
    double rounded = floor(length / spacing + 0.5);
    if (rounded < 1) rounded = 1;
    const size_t cells = (size_t)rounded;
    for (size_t i = 0; line && i <= cells; i++) line[i] = low + length * ((double)i / (double)cells);
    return cells;
}
static size_t tlsphi_axis_lines(const tlsph_fill *f, int axis, double *line) {
    const double low = (double)f->origin[axis], length = (double)f->size[axis], spacing = (double)f->spacing;
    if (f->shape != TLSPH_L_SHAPE || axis == 2) return tlsphi_segment(line, low, length, spacing);
    const double notch = (double)f->notch[axis];
    const size_t first = tlsphi_segment(line, low, notch, spacing);
    return first + tlsphi_segment(line ? line + first : NULL, low + notch, length - notch, spacing);
}

static size_t tlsphi_cell_index(const tlsphi_lattice *l, const size_t c[3]) {
    return (c[2] * l->cells[1] + c[1]) * l->cells[0] + c[0];
}
static size_t tlsphi_line_index(const tlsphi_lattice *l, const size_t c[3]) {
    return (c[2] * l->lines[1] + c[1]) * l->lines[0] + c[0];
}
static double tlsphi_lattice_cell(const tlsphi_lattice *l, const size_t c[3], double centre[3]) {
    double volume = 1;
    centre[2] = 0;
    for (int i = 0; i < l->fill->dimension; i++) {
        const double low = l->line[i][c[i]], high = l->line[i][c[i] + 1];
        centre[i] = (low + high) / 2;
        volume *= high - low;
    }
    return volume;
}
/* Calls visit for every cell of the body (or of the box, while `inside` is being found). */
typedef void (*tlsphi_cell_fn)(tlsphi_lattice *l, const size_t c[3], void *arg);
static void tlsphi_each_cell(tlsphi_lattice *l, int all, tlsphi_cell_fn visit, void *arg) {
    size_t c[3];
    for (c[2] = 0; c[2] < l->cells[2]; c[2]++)
        for (c[1] = 0; c[1] < l->cells[1]; c[1]++)
            for (c[0] = 0; c[0] < l->cells[0]; c[0]++)
                if (all || l->inside[tlsphi_cell_index(l, c)]) visit(l, c, arg);
}
static void tlsphi_test_cell(tlsphi_lattice *l, const size_t c[3], void *arg) {
    double centre[3];
    (void)arg;
    tlsphi_lattice_cell(l, c, centre);
    const int in = tlsphi_inside(l->fill, centre) != 0;
    l->inside[tlsphi_cell_index(l, c)] = (unsigned char)in;
    l->body_cells += (size_t)in;
}
/* Lattice line of corner k of a cell. */
static size_t tlsphi_corner(const tlsphi_lattice *l, const size_t c[3], int k) {
    size_t at[3];
    for (int i = 0; i < 3; i++) at[i] = c[i] + (size_t)(i < l->fill->dimension ? k >> i & 1 : 0);
    return tlsphi_line_index(l, at);
}
static void tlsphi_mark_cell(tlsphi_lattice *l, const size_t c[3], void *arg) {
    (void)arg;
    if (l->fill->placement == TLSPH_CELL_CENTRED) l->number[tlsphi_cell_index(l, c)] = 0;
    else
        for (int k = 0; k < 1 << l->fill->dimension; k++) l->number[tlsphi_corner(l, c, k)] = 0;
}
static void tlsphi_number_particles(tlsphi_lattice *l, size_t places) {
    for (size_t i = 0; i < places; i++) l->number[i] = TLSPHI_NONE;
    tlsphi_each_cell(l, 0, tlsphi_mark_cell, NULL);
    for (size_t i = 0; i < places; i++)
        if (l->number[i] != TLSPHI_NONE) l->number[i] = (uint32_t)l->particles++;
}

typedef struct tlsphi_fill_target {
    tlsph_real *X, *V, *w, *share;
    uint32_t *cells;
    size_t cell;
} tlsphi_fill_target;

static void tlsphi_fill_cell(tlsphi_lattice *l, const size_t c[3], void *arg) {
    tlsphi_fill_target *t = (tlsphi_fill_target *)arg;
    double centre[3];
    const double volume = tlsphi_lattice_cell(l, c, centre);
    if (l->fill->placement == TLSPH_CELL_CENTRED) {
        const uint32_t a = l->number[tlsphi_cell_index(l, c)];
        for (int i = 0; i < 3; i++) t->X[3 * a + (uint32_t)i] = (tlsph_real)centre[i];
        t->V[a] = t->w[a] = (tlsph_real)volume;
        return;
    }
    const int corners = 1 << l->fill->dimension;
    for (int k = 0; k < corners; k++) {
        const uint32_t a = l->number[tlsphi_corner(l, c, k)];
        for (int i = 0; i < 3; i++)
            t->X[3 * a + (uint32_t)i] =
                i < l->fill->dimension ? (tlsph_real)l->line[i][c[i] + (size_t)(k >> i & 1)] : 0;
        t->V[a] += (tlsph_real)(volume / corners);
        t->w[a] += (tlsph_real)volume; /* becomes the mean volume of the cells around a particle */
        t->share[a] += 1;
        t->cells[((size_t)corners) * t->cell + (size_t)k] = a;
    }
    t->cell++;
}

/* The faces between cells of the body and others, as segments or triangles; with out == NULL only counts them. */
typedef struct tlsphi_faces {
    tlsph_real *out;
    size_t count;
} tlsphi_faces;
static void tlsphi_cell_faces(tlsphi_lattice *l, const size_t c[3], void *arg) {
    tlsphi_faces *faces = (tlsphi_faces *)arg;
    const int dim = l->fill->dimension;
    static const int quad[6] = {0, 1, 3, 0, 3, 2}, line[2] = {0, 1};
    for (int axis = 0; axis < dim; axis++)
        for (int up = 0; up < 2; up++) {
            const int i = (axis + 1) % dim, j = (axis + 2) % dim, corners = dim == 3 ? 6 : 2;
            size_t other[3] = {c[0], c[1], c[2]};
            if (up ? c[axis] + 1 < l->cells[axis] : c[axis] > 0) {
                other[axis] = up ? c[axis] + 1 : c[axis] - 1;
                if (l->inside[tlsphi_cell_index(l, other)]) continue;
            }
            for (int k = 0; faces->out && k < corners; k++) {
                const int turned = dim == 3 ? !up : up == (axis == 1), from = turned ? corners - 1 - k : k;
                const int corner = dim == 3 ? quad[from] : line[from];
                tlsph_real *x = faces->out + 3 * (faces->count * (size_t)dim + (size_t)k);
                x[2] = 0;
                x[axis] = (tlsph_real)l->line[axis][c[axis] + (size_t)up];
                x[i] = (tlsph_real)l->line[i][c[i] + (size_t)(corner & 1)];
                if (dim == 3) x[j] = (tlsph_real)l->line[j][c[j] + (size_t)(corner >> 1)];
            }
            faces->count += (size_t)corners / (size_t)dim;
        }
}
/* Moves particles by up to jitter x spacing along each axis; on the faces of a box only within the face, on other
   surfaces not at all. */
static void tlsphi_jitter(const tlsphi_lattice *l, tlsph_real *X, const tlsph_real *share) {
    const tlsph_fill *f = l->fill;
    uint64_t state = f->seed;
    for (size_t a = 0; a < l->particles; a++)
        for (int i = 0; i < f->dimension; i++) {
            const double move = (2 * tlsphi_random(&state) - 1) * (double)f->jitter * (double)f->spacing;
            const double low = l->line[i][0], high = l->line[i][l->cells[i]], x = (double)X[3 * a + (size_t)i];
            const int interior = share ? share[a] == (tlsph_real)(1 << f->dimension) : 1;
            const int on_box = x <= low || x >= high;
            if (f->placement == TLSPH_CELL_CENTRED || interior || (f->shape == TLSPH_BOX && !on_box))
                X[3 * a + (size_t)i] = (tlsph_real)(x + move);
        }
}

TLSPHI_APART tlsph_result tlsphi_fill_fail(tlsph_error *error, tlsph_result r, const char *field, double value,
                                     const char *allowed) {
    return tlsphi_fail(error, r, "fill", field, TLSPH_NO_PARTICLE, value, 0, allowed);
}
static int tlsphi_scatters(const tlsph_fill *f) { return f->placement >= TLSPH_SCATTERED; }
static tlsph_result tlsphi_check_fill(const tlsph_fill *f, tlsph_error *error) {
    if (f->cookie != TLSPHI_COOKIE || f->dimension < 2 || f->dimension > 3 ||
        (unsigned)f->shape > (unsigned)TLSPH_TRIANGLES || (unsigned)f->placement > (unsigned)TLSPH_SCATTERED_INSIDE ||
        (f->shape == TLSPH_PREDICATE && (!f->inside || tlsphi_scatters(f))) ||
        (f->shape == TLSPH_DISTANCE && !f->distance) ||
        (f->shape == TLSPH_TRIANGLES && (!f->surface.count || !tlsphi_scatters(f))) || f->axis < 0 || f->axis > 2)
        return tlsphi_fill_fail(error, TLSPH_ERROR_DESCRIPTION, "cookie, dimension, shape, placement, axis or inside",
                                f->dimension, "what tlsph_fill_default sets");
    if (!tlsphi_all_finite(f->origin, 3) || !tlsphi_all_finite(f->size, 3) || !tlsphi_finite(f->spacing))
        return tlsphi_fill_fail(error, TLSPH_ERROR_NOT_FINITE, "origin, size or spacing", (double)f->spacing, "finite");
    for (int i = 0; i < f->dimension; i++) {
        if (f->shape == TLSPH_TRIANGLES && f->spacing > 0) continue;
        if (!(f->size[i] > 0))
            return tlsphi_fill_fail(error, TLSPH_ERROR_DESCRIPTION, "size", (double)f->size[i], "more than 0");
        if (!(f->spacing > 0) || !((double)f->size[i] / (double)f->spacing < TLSPHI_LINES - 2))
            return tlsphi_fill_fail(error, TLSPH_ERROR_DESCRIPTION, "spacing", (double)f->spacing,
                                    "more than 0, fewer than 4094 cells an axis");
        if (f->shape == TLSPH_L_SHAPE && i < 2 && !(f->notch[i] > 0 && f->notch[i] < f->size[i]))
            return tlsphi_fill_fail(error, TLSPH_ERROR_DESCRIPTION, "notch", (double)f->notch[i], "between 0 and size");
    }
    if (!(f->jitter >= 0) || !(f->jitter <= TLSPHI_R(0.45)))
        return tlsphi_fill_fail(error, TLSPH_ERROR_DESCRIPTION, "jitter", (double)f->jitter, "0 to 0.45");
    if (!f->allocator.allocate != !f->allocator.release)
        return tlsphi_fill_fail(error, TLSPH_ERROR_DESCRIPTION, "allocator", 0, "both functions or neither");
    return f->inner_radius >= 0
               ? TLSPH_OK
               : tlsphi_fill_fail(error, TLSPH_ERROR_DESCRIPTION, "inner_radius", (double)f->inner_radius, "0 or more");
}
/* Lines, inside flags and numbers in one scratch block. */
static tlsph_result tlsphi_lattice_make(tlsphi_lattice *l, tlsph_error *error) {
    tlsphi_arena arena;
    size_t cells = 1, lines = 1;
    double places = 1;
    for (int i = 0; i < 3; i++) {
        l->cells[i] = i < l->fill->dimension ? tlsphi_axis_lines(l->fill, i, NULL) : 1;
        l->lines[i] = i < l->fill->dimension ? l->cells[i] + 1 : 1;
        cells *= l->cells[i];
        lines *= l->lines[i];
        places *= (double)l->lines[i];
    }
    if (!(places < 4294967295.0 && places < (double)(SIZE_MAX / 4)))
        return tlsphi_fill_fail(error, TLSPH_ERROR_SIZE, "places of the lattice", places,
                                "less than 2^32 (32-bit machines: 2^30); take a larger spacing");
    memset(&arena, 0, sizeof arena);
    for (int pass = 0; pass < 2; pass++) {
        arena.used = 0;
        for (int i = 0; i < 3; i++) l->line[i] = TLSPHI_TAKE(&arena, double, l->lines[i] + 1);
        l->inside = TLSPHI_TAKE(&arena, unsigned char, cells);
        l->number = TLSPHI_TAKE(&arena, uint32_t, lines);
        if (pass) break;
        l->memory_size = arena.size = arena.used;
        l->memory = l->allocator.allocate(l->allocator.user, l->memory_size);
        if (!l->memory)
            return tlsphi_fill_fail(error, TLSPH_ERROR_MEMORY, "bytes", (double)l->memory_size,
                                    "what the allocator can give");
        arena.memory = (unsigned char *)l->memory;
    }
    for (int i = 0; i < l->fill->dimension; i++) tlsphi_axis_lines(l->fill, i, l->line[i]);
    tlsphi_each_cell(l, 1, tlsphi_test_cell, NULL);
    tlsphi_number_particles(l, l->fill->placement == TLSPH_CELL_CENTRED ? cells : lines);
    return l->particles ? TLSPH_OK
                        : tlsphi_fill_fail(error, TLSPH_ERROR_SIZE, "particles", 0, "at least 1; refine the spacing");
}
/* Boxes and L-shapes take their few large faces, all else the faces of the lattice's cells. */
static tlsph_result tlsphi_cloud_voronoi(tlsphi_lattice *l, tlsph_cloud *cloud, tlsph_real *volumes,
                                         tlsph_real *areas, tlsph_real *moments, tlsph_error *error) {
    const int plain = l->fill->shape == TLSPH_BOX || l->fill->shape == TLSPH_L_SHAPE;
    tlsph_fill coarse = *l->fill;
    tlsphi_lattice few, *from = l;
    tlsphi_faces faces;
    tlsph_surface surface;
    tlsph_result r = TLSPH_OK;
    memset(&few, 0, sizeof few);
    memset(&faces, 0, sizeof faces);
    few.fill = &coarse;
    few.allocator = l->allocator;
    for (int i = 0; i < 3; i++) coarse.spacing = tlsphi_max(coarse.spacing, 4 * l->fill->size[i]);
    coarse.placement = TLSPH_ON_FACES;
    if (plain && !(r = tlsphi_lattice_make(&few, error))) from = &few;
    if (!r) tlsphi_each_cell(from, 0, tlsphi_cell_faces, &faces);
    const size_t bytes = faces.count * (size_t)coarse.dimension * 3 * sizeof(tlsph_real);
    if (!r && !(faces.out = (tlsph_real *)l->allocator.allocate(l->allocator.user, bytes)))
        r = tlsphi_fill_fail(error, TLSPH_ERROR_MEMORY, "bytes", (double)bytes, "what the allocator can give");
    surface.count = faces.count;
    surface.corners = faces.out;
    faces.count = 0;
    if (!r) tlsphi_each_cell(from, 0, tlsphi_cell_faces, &faces);
    if (!r && tlsphi_scatters(l->fill)) r = tlsphi_cloud_scatter(l->fill, &surface, cloud, error);
    else if (!r)
        r = tlsph_voronoi(coarse.dimension, &cloud->particles, &surface, &l->allocator, volumes, areas, moments, error);
    if (faces.out) l->allocator.release(l->allocator.user, faces.out, bytes);
    if (few.memory) few.allocator.release(few.allocator.user, few.memory, few.memory_size);
    return r;
}
static tlsph_result tlsphi_cloud_fill(tlsphi_lattice *l, tlsph_cloud *cloud, tlsph_error *error) {
    tlsphi_arena arena;
    tlsphi_fill_target t;
    tlsph_real *areas = NULL, *moments = NULL;
    const int on_faces = l->fill->placement == TLSPH_ON_FACES;
    const size_t n = l->particles, corners = on_faces ? l->body_cells << l->fill->dimension : 0;
    memset(&arena, 0, sizeof arena);
    memset(&t, 0, sizeof t);
    for (int pass = 0; pass < 2; pass++) {
        arena.used = 0;
        t.X = TLSPHI_TAKE(&arena, tlsph_real, 3 * n);
        t.V = TLSPHI_TAKE(&arena, tlsph_real, n);
        t.w = TLSPHI_TAKE(&arena, tlsph_real, n);
        t.share = TLSPHI_TAKE(&arena, tlsph_real, n);
        t.cells = TLSPHI_TAKE(&arena, uint32_t, corners);
        areas = TLSPHI_TAKE(&arena, tlsph_real, l->fill->voronoi ? 3 * n : 0);
        moments = TLSPHI_TAKE(&arena, tlsph_real, l->fill->voronoi && !on_faces ? 9 * n : 0);
        if (pass) break;
        cloud->memory_size = arena.size = arena.used;
        cloud->memory = l->allocator.allocate(l->allocator.user, cloud->memory_size);
        if (!cloud->memory)
            return tlsphi_fill_fail(error, TLSPH_ERROR_MEMORY, "bytes", (double)cloud->memory_size,
                                    "what the allocator can give");
        arena.memory = (unsigned char *)cloud->memory;
        memset(cloud->memory, 0, cloud->memory_size);
    }
    tlsphi_each_cell(l, 0, tlsphi_fill_cell, &t);
    for (size_t a = 0; on_faces && a < n; a++) t.w[a] /= t.share[a];
    if (l->fill->jitter > 0) tlsphi_jitter(l, t.X, on_faces ? t.share : NULL);
    cloud->particles.count = n;
    cloud->particles.positions = t.X;
    cloud->particles.volumes = t.V;
    cloud->particles.weights = t.w;
    cloud->particles.cells = on_faces && !(l->fill->jitter > 0) ? t.cells : NULL;
    cloud->particles.cell_count = cloud->particles.cells ? l->body_cells : 0;
    cloud->allocator = l->allocator;
    double mean = 1;
    for (int i = 0; i < l->fill->dimension; i++) {
        const double edge = (l->line[i][l->cells[i]] - l->line[i][0]) / (double)l->cells[i];
        cloud->cell_size[i] = (tlsph_real)edge;
        mean = i ? tlsphi_dmax(mean, edge) : edge;
    }
    cloud->particles.spacing = (tlsph_real)mean; /* the largest, as the papers take it */
    if (!l->fill->voronoi) return TLSPH_OK;
    cloud->particles.areas = areas;
    if (!on_faces) cloud->particles.moments = moments;
    return tlsphi_cloud_voronoi(l, cloud, t.V, areas, on_faces ? NULL : moments, error);
}
TLSPHI_DEF tlsph_result tlsph_cloud_create(const tlsph_fill *fill, tlsph_cloud *cloud, tlsph_error *error) {
    tlsphi_lattice l;
    tlsphi_no_error(error);
    if (cloud) memset(cloud, 0, sizeof *cloud);
    if (!fill || !cloud) return tlsphi_fill_fail(error, TLSPH_ERROR_ARGUMENT, "fill or cloud", 0, "not NULL");
    tlsph_result r = tlsphi_check_fill(fill, error);
    if (r) return r;
    memset(&l, 0, sizeof l);
    l.fill = fill;
    l.allocator = tlsphi_allocator(&fill->allocator);
    if (!tlsphi_scatters(fill)) {
        r = tlsphi_lattice_make(&l, error);
        if (!r) r = tlsphi_cloud_fill(&l, cloud, error);
    } else if (fill->shape == TLSPH_BOX || fill->shape == TLSPH_L_SHAPE)
        r = tlsphi_cloud_voronoi(&l, cloud, NULL, NULL, NULL, error);
    else r = tlsphi_cloud_scatter(fill, NULL, cloud, error);
    if (r) tlsph_cloud_destroy(cloud);
    if (l.memory) l.allocator.release(l.allocator.user, l.memory, l.memory_size);
    return r;
}
TLSPHI_DEF void tlsph_cloud_destroy(tlsph_cloud *cloud) {
    if (!cloud) return;
    if (cloud->memory) cloud->allocator.release(cloud->allocator.user, cloud->memory, cloud->memory_size);
    memset(cloud, 0, sizeof *cloud);
}
TLSPHI_DEF tlsph_fill tlsph_fill_default(int dimension) {
    tlsph_fill f;
    memset(&f, 0, sizeof f);
    f.cookie = TLSPHI_COOKIE;
    f.dimension = dimension;
    f.axis = 2;
    return f;
}
TLSPHI_DEF size_t tlsph_select(const tlsph_particles *particles, tlsph_inside_fn inside, void *user, uint32_t *out,
                               size_t capacity) {
    size_t found = 0;
    for (size_t a = 0; a < particles->count; a++) {
        if (!inside(user, particles->positions + 3 * a)) continue;
        if (found < capacity) out[found] = (uint32_t)a;
        found++;
    }
    return found;
}
typedef struct tlsphi_plane {
    int axis;
    tlsph_real value, tolerance;
} tlsphi_plane;
static int tlsphi_in_plane(void *user, const tlsph_real *X) {
    const tlsphi_plane *plane = (const tlsphi_plane *)user;
    return tlsphi_abs(X[plane->axis] - plane->value) <= plane->tolerance;
}
TLSPHI_DEF size_t tlsph_select_plane(const tlsph_particles *particles, int axis, tlsph_real value, tlsph_real tolerance,
                                     uint32_t *out, size_t capacity) {
    tlsphi_plane plane;
    size_t found = 0;
    const size_t k = (size_t)axis;
    for (size_t a = 0; particles->moments && a < particles->count; a++) {
        const tlsph_real B = particles->areas[3 * a + k], T = particles->moments[9 * a + 4 * k];
        if (!(tlsphi_abs((particles->positions[3 * a + k] - value) * B + T) <= tolerance * tlsphi_abs(B))) continue;
        if (!(tlsphi_abs(B) > 0)) continue;
        if (found < capacity) out[found] = (uint32_t)a;
        found++;
    }
    if (particles->moments) return found;
    plane.axis = axis;
    plane.value = value;
    plane.tolerance = tolerance;
    return tlsph_select(particles, tlsphi_in_plane, &plane, out, capacity);
}

/* ==== [REPRODUCING] ================================================================================================
   Psi_I(x) = e_0^T M^-1 H(z) Phi,  z = x - X_I,  M(x) = sum_I H H^T Phi, with H the monomials of z up to the order (003-16
   to 22). With e_i, minus one at the i-th linear monomial, instead of e_0 it is the implicit gradient (28). Every such sum
   has the derivative  c^T (dH Phi + H dPhi) - (M^-1 dM c)^T H Phi,  c = M^-1 e  (23, 24). Lengths are in units of the
   largest radius in reach, so that M is well conditioned at any scale. */

enum { TLSPHI_MONOMIALS = 10 };
typedef struct tlsphi_monomials { double H[TLSPHI_MONOMIALS], dH[3][TLSPHI_MONOMIALS], phi, dphi[3]; } tlsphi_monomials;
typedef struct tlsphi_moments {
    int dim, count;
    double scale, M[TLSPHI_MONOMIALS][TLSPHI_MONOMIALS], dM[3][TLSPHI_MONOMIALS][TLSPHI_MONOMIALS];
    double c[4][TLSPHI_MONOMIALS], dc[4][3][TLSPHI_MONOMIALS];
} tlsphi_moments;

/* Monomials and kernel of one node at x, with derivatives by x. 0 where it is out of reach. */
static int tlsphi_node_at(const tlsph_nodes *nodes, size_t node, const tlsph_real *x, double scale,
                          tlsphi_monomials *out) {
    const int dim = nodes->dimension;
    const double h = (double)nodes->radii[node] / 2 / scale;
    double z[3] = {0, 0, 0}, r = 0, W, dW, W0, dW0;
    for (int i = 0; i < dim; i++) {
        z[i] = ((double)x[i] - (double)nodes->positions[3 * node + (size_t)i]) / scale;
        r += z[i] * z[i];
    }
    r = sqrt(r);
    if (!(r < 2 * h)) return 0;
    tlsphi_kernel(nodes->kernel, 3, r, h, &W, &dW);
    tlsphi_kernel(nodes->kernel, 3, 0, h, &W0, &dW0);
    memset(out, 0, sizeof *out);
    out->phi = W / W0;
    for (int i = 0; i < dim; i++) out->dphi[i] = r > 0 ? dW / W0 * z[i] / r : 0;
    out->H[0] = 1;
    for (int i = 0; i < dim; i++) {
        out->H[1 + i] = z[i];
        out->dH[i][1 + i] = 1;
    }
    for (int i = 0, k = 1 + dim; nodes->order == 2 && i < dim; i++)
        for (int j = i; j < dim; j++, k++) {
            out->H[k] = z[i] * z[j];
            out->dH[i][k] += z[j];
            out->dH[j][k] += z[i];
        }
    return out->phi > 0;
}
static void tlsphi_add_moments(tlsphi_moments *m, const tlsphi_monomials *n) {
    for (int i = 0; i < m->count; i++)
        for (int j = 0; j < m->count; j++) {
            m->M[i][j] += n->H[i] * n->H[j] * n->phi;
            for (int k = 0; k < m->dim; k++)
                m->dM[k][i][j] += (n->dH[k][i] * n->H[j] + n->H[i] * n->dH[k][j]) * n->phi + n->H[i] * n->H[j] * n->dphi[k];
        }
}
/* M = L L^T in place; 0 where M is singular. */
static int tlsphi_factor_moments(tlsphi_moments *m) {
    for (int i = 0; i < m->count; i++) {
        const double largest = m->M[i][i];
        for (int j = 0; j <= i; j++) {
            double sum = m->M[i][j];
            for (int k = 0; k < j; k++) sum -= m->M[i][k] * m->M[j][k];
            if (j < i) m->M[i][j] = sum / m->M[j][j];
            else if (!(sum > 3e-8 * largest)) return 0; /* rounding, 1e-16 over the last pivot, must stay below */
            else m->M[i][i] = sqrt(sum);
        }
    }
    return 1;
}
static void tlsphi_solve_moments(const tlsphi_moments *m, double *b) {
    for (int i = 0; i < m->count; i++) {
        for (int k = 0; k < i; k++) b[i] -= m->M[i][k] * b[k];
        b[i] /= m->M[i][i];
    }
    for (int i = m->count - 1; i >= 0; i--) {
        for (int k = i + 1; k < m->count; k++) b[i] -= m->M[k][i] * b[k];
        b[i] /= m->M[i][i];
    }
}
/* c = M^-1 e and its derivatives for the shape function (0) and the implicit gradients (1 to dim). */
static void tlsphi_find_coefficients(tlsphi_moments *m) {
    for (int r = 0; r <= m->dim; r++) {
        m->c[r][r] = r ? -1 : 1;
        tlsphi_solve_moments(m, m->c[r]);
        for (int k = 0; k < m->dim; k++) {
            for (int i = 0; i < m->count; i++)
                for (int j = 0; j < m->count; j++) m->dc[r][k][i] -= m->dM[k][i][j] * m->c[r][j];
            tlsphi_solve_moments(m, m->dc[r][k]);
        }
    }
}
/* The r-th function of a node and its gradient, in units of 1/scale. */
static double tlsphi_shape_value(const tlsphi_moments *m, const tlsphi_monomials *n, int r, double gradient[3]) {
    double value = 0;
    for (int k = 0; k < 3; k++) gradient[k] = 0;
    for (int i = 0; i < m->count; i++) {
        value += m->c[r][i] * n->H[i] * n->phi;
        for (int k = 0; k < m->dim; k++)
            gradient[k] += m->c[r][i] * (n->dH[k][i] * n->phi + n->H[i] * n->dphi[k]) + m->dc[r][k][i] * n->H[i] * n->phi;
    }
    return value;
}
static void tlsphi_store_shape(const tlsphi_moments *m, const tlsphi_monomials *n, size_t node,
                               const tlsph_shape_functions *out) {
    double value[4], gradient[4][3];
    memset(value, 0, sizeof value);
    memset(gradient, 0, sizeof gradient);
    for (int r = 0; n && r <= m->dim; r++) value[r] = tlsphi_shape_value(m, n, r, gradient[r]);
    if (out->value) out->value[node] = (tlsph_real)value[0];
    for (size_t i = 0; i < 3; i++) {
        if (out->gradient) out->gradient[3 * node + i] = (tlsph_real)(gradient[0][i] / m->scale);
        if (out->implicit) out->implicit[3 * node + i] = (tlsph_real)(value[1 + i] / m->scale);
        for (size_t j = 0; out->implicit_gradient && j < 3; j++)
            out->implicit_gradient[9 * node + 3 * i + j] =
                (tlsph_real)((gradient[1 + i][j] + gradient[1 + j][i]) / (2 * m->scale * m->scale));
    }
}
static double tlsphi_largest_radius(const tlsph_nodes *nodes) {
    double largest = 0;
    for (size_t a = 0; a < nodes->count; a++) largest = tlsphi_dmax(largest, (double)nodes->radii[a]);
    return largest;
}
TLSPHI_DEF tlsph_result tlsph_reproduce(const tlsph_nodes *nodes, const tlsph_real x[3],
                                        const tlsph_shape_functions *out, tlsph_error *error) {
    const int dim = nodes->dimension, order = nodes->order;
    tlsphi_monomials n;
    tlsphi_moments m;
    tlsphi_no_error(error);
    if (dim < 1 || dim > 3 || order < 1 || order > 2)
        return tlsphi_fail(error, TLSPH_ERROR_DESCRIPTION, "reproduce", dim < 1 || dim > 3 ? "dimension" : "order",
                           TLSPH_NO_PARTICLE, dim < 1 || dim > 3 ? dim : order, 0, "1 to 3, and order 1 or 2");
    memset(&m, 0, sizeof m);
    m.dim = dim;
    m.count = order == 1 ? 1 + dim : (dim + 1) * (dim + 2) / 2;
    m.scale = tlsphi_largest_radius(nodes);
    for (size_t a = 0; a < nodes->count; a++)
        if (tlsphi_node_at(nodes, a, x, m.scale, &n)) tlsphi_add_moments(&m, &n);
    if (!tlsphi_factor_moments(&m))
        return tlsphi_fail(error, TLSPH_ERROR_NEIGHBOURS, "reproduce", "nodes", TLSPH_NO_PARTICLE, (double)nodes->count,
                           m.count, "so many in reach that they determine a polynomial of this order");
    tlsphi_find_coefficients(&m);
    for (size_t a = 0; a < nodes->count; a++)
        tlsphi_store_shape(&m, tlsphi_node_at(nodes, a, x, m.scale, &n) ? &n : NULL, a, out);
    return TLSPH_OK;
}
TLSPHI_DEF void tlsph_nodal_weight(int dimension, const tlsph_real low[3], const tlsph_real high[3], const tlsph_real x[3],
                                   tlsph_real *weight, tlsph_real second[3]) {
    *weight = 1;
    for (int i = 0; i < dimension; i++) *weight *= high[i] - low[i];
    for (int i = 0; i < dimension; i++) {
        const tlsph_real a = low[i] - x[i], b = high[i] - x[i];
        second[i] = *weight * (a * a + a * b + b * b) / 3;
    }
}

#if defined(__clang__)
#pragma clang diagnostic pop
#elif defined(__GNUC__)
#pragma GCC pop_options
#endif
#endif /* TLSPH_IMPLEMENTATION_DONE */
#endif /* TLSPH_IMPLEMENTATION */

/* ==== [LICENCE] ====================================================================================================
   You may choose: public domain (www.unlicense.org), or MIT:

   Copyright (c) 2026 the authors of tlsph.h
   Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
   documentation files (the "Software"), to deal in the Software without restriction, including without limitation the
   rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and to permit
   persons to whom the Software is furnished to do so, subject to the following conditions: The above copyright notice and
   this permission notice shall be included in all copies or substantial portions of the Software. THE SOFTWARE IS PROVIDED
   "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF
   MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS
   BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
   OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.

   HISTORY
   0.1  the core: container, corrected-kernel and cell operators, {p,F} to {p,F,H,J,E}, four materials and the user's
        own, limited dissipation, two-stage Runge-Kutta step, conditions, ledger, checkpoints, lattice fillers. */
