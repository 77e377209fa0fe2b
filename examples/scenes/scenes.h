/*
scenes.h - the scenes that examples, tests and benches share

A scene is a geometry with material, loads and initial state, and its exact or published answer. Each one has
    <scene>_parameters           what may be changed, all in SI units
    <scene>_default(p)           fills it with the values of the source that the scene names
    <scene>_create(p, out, err)  makes cloud and solver at time 0; on error `out` is empty. `out` must stay where it is,
                                 because loads point into it
    scene_destroy(&out->body)    gives all of it back
and functions for exact answers and errors. Common options live in scene_options, once for all scenes.
Nothing here prints or writes files; driver.h does that for the examples.
*/
#ifndef SCENES_H
#define SCENES_H

#include "../../tlsph.h"
#include "../common/common.h"

#define SCENE_PI 3.14159265358979323846

/* ---- options common to all scenes -------------------------------------------------------------------------------- */

/* What every scene lets one choose. Integers are those of the enumerations in tlsph.h. */
typedef struct scene_options {
    double end_time;             /* s */
    double cfl, support, harmonic, biharmonic;
    int unknowns, thermal, operator_kind, kernel, dissipation, volume_coupling, conduction, integrator;
    int force_form, step_rule, placement;
    int conduction_stages, sharp, projection, audit, threads, rates;
    int preset;                  /* as named on the command line, 0: none; drivers apply it before the other options */
    int scheme, pressure_iteration, laplacian_as_printed; /* TLSPH_INCOMPRESSIBLE: unknowns lose their J */
    double laplacian;
    int frames, quiet, check;    /* used by drivers only */
    const char *output;
} scene_options;

#define SCENE_OPTION_COUNT 30

/* The library's own defaults, no end time, one frame. */
void scene_options_default(scene_options *options);
/* Fills table[SCENE_OPTION_COUNT] with command line entries that write into *options. */
void scene_option_table(scene_options *options, ex_option *table);
/* Irregular clouds: the closed operator instead of the default one, with the volumes and areas that it needs. */
void scene_options_cloud(scene_options *options, tlsph_fill *fill);
/* The same for scenes whose own choice is cells: a cloud scattered in the body of a signed distance. */
void scene_options_scatter(scene_options *options, tlsph_fill *fill, tlsph_length_fn distance, void *user);
void scene_options_apply(const scene_options *options, tlsph_desc *desc);
/* tlsph_preset by name: fast, balanced, accurate. 0 for another name, without a change. */
int scene_options_preset(scene_options *options, const char *name);

/* ---- a body under construction ----------------------------------------------------------------------------------- */

typedef struct scene_body {
    tlsph_cloud cloud;
    tlsph_material material;
    tlsph_solver *solver;
} scene_body;

#define SCENE_CONDITIONS 16

/* Conditions and the lists that they point to, needed until the solver has copied them. Start with scene_begin, end
   with scene_end in every case: failures on the way are kept in `result` and come out there. */
typedef struct scene_setup {
    scene_body body;
    tlsph_condition conditions[SCENE_CONDITIONS];
    void *lists[3 * SCENE_CONDITIONS];
    size_t condition_count, list_count;
    tlsph_result result;
} scene_setup;

void scene_begin(scene_setup *setup, const tlsph_fill *fill, const tlsph_material *material, tlsph_error *error);
/* The same for a cloud of one's own, which the setup then owns; `made`: the result of making it. */
void scene_begin_cloud(scene_setup *setup, const tlsph_cloud *cloud, tlsph_result made, const tlsph_material *material,
                       tlsph_error *error);
/* A condition on all particles; the pointer is never NULL and lives until scene_end. */
tlsph_condition *scene_add(scene_setup *setup, tlsph_condition_kind kind);
/* On the particles with X[axis] = value, with the normal along the axis. */
tlsph_condition *scene_add_plane(scene_setup *setup, tlsph_condition_kind kind, int axis, double value);
/* On the particles chosen by inside(user, X) != 0. */
tlsph_condition *scene_add_where(scene_setup *setup, tlsph_condition_kind kind, tlsph_inside_fn inside, void *user);
/* Rollers on both faces across `axis` of the box that the cloud fills. */
void scene_add_rollers(scene_setup *setup, int axis);
/* Shares the area of a plane face among the condition's particles by their tributary volumes, so that it adds up. */
void scene_share_area(scene_setup *setup, tlsph_condition *condition, double area);
/* Memory that lives until scene_end; NULL after a failure. */
void *scene_keep(scene_setup *setup, size_t size);
/* Creates the solver from all of it. `out` owns the result; empty on error. */
tlsph_result scene_end(scene_setup *setup, const scene_options *options, scene_body *out, tlsph_error *error);
/* Position, velocity, deformation gradient and temperature of a material point; filled with X, 0, I, theta_R before. */
typedef struct scene_state { double x[3], v[3], F[9], theta; } scene_state;
typedef void (*scene_state_fn)(const void *scene, const tlsph_real X[3], scene_state *state);
/* Writes a state into every particle and starts the ledger anew. */
tlsph_result scene_set_state(scene_body *body, const void *scene, scene_state_fn state);
void scene_destroy(scene_body *body);

/* Largest difference of displacement and of pressure between particles and their mirror images across X[axis] = 0, by the
   largest displacement and pressure; infinite where the lattice is not symmetric. */
double scene_asymmetry(const scene_body *body, int axis);

/* ---- surfaces of lattice bodies ---------------------------------------------------------------------------------- */

/* A face that belongs to one cell only: its corners (particles), middle (m) and outward area vector (m^2). */
typedef struct scene_face { uint32_t corner[4]; double middle[3], area[3]; } scene_face;
typedef void (*scene_face_fn)(void *user, const scene_face *face);
/* Calls visit for every face of the surface of a 3-D lattice body with particles on its faces. */
tlsph_result scene_surface(const tlsph_cloud *cloud, scene_face_fn visit, void *user);
/* The area (m^2) of the true surface for which a face of the lattice stands: n.area with the true outward normal n, on a
   curved surface less than the staircase has. 0: not part of the set. */
typedef double (*scene_share_fn)(void *user, const scene_face *face);
/* A condition on a part of the surface, each face's share split among its corners, and scaled to add up to `area` if this
   is known (else 0). On clouds with areas the particles' own stand for faces. */
tlsph_condition *scene_add_surface(scene_setup *setup, tlsph_condition_kind kind, scene_share_fn share, void *user,
                                   double area);

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* A copy of a field, to be freed; NULL without memory or where the scene lacks the field. */
tlsph_real *scene_read(const tlsph_solver *solver, tlsph_field field);
/* One component of a field at one particle; NaN without memory or where the scene lacks the field. */
double scene_value(const tlsph_solver *solver, tlsph_field field, size_t particle, int component);
/* Host number of the particle nearest to X. */
size_t scene_nearest(const tlsph_particles *particles, double x, double y, double z);
/* The material of 000 section 7.1 (also of 7.2): E = 50.05 kPa, nu = 0.3, rho = 1000 kg/m^3, h = 10 W/(m K),
   C_v = 1 J/(kg K), alpha = 2.223e-4 1/K, theta_R = 293.15 K. The paper gives neither q, xi_R nor gamma_R: q = 1 and
   no Mooney terms here. */
tlsph_material scene_paper_material(tlsph_material_kind kind);
/* Linear thermal expansion that gives a coupling delta = (c_v Gamma_0)^2 theta_R / (c_v (lambda + 2 mu)), where
   c_v Gamma_0 = 3 kappa alpha (METHOD section 1). */
double scene_expansion(const tlsph_material *material, double delta);
/* P-wave modulus lambda + 2 mu, bulk modulus kappa and shear modulus mu, Pa. */
void scene_moduli(const tlsph_material *material, double *p_wave, double *bulk, double *shear);

/* ---- L-shaped block: 000 section 7.2 ----------------------------------------------------------------------------- */

typedef struct l_block_parameters {
    scene_options options;
    double spacing;       /* m; 0.64, 0.46, 0.3, 0.195 give 792, 1920, 5324, 17152 particles (figure 5: 680 ... 17600) */
    double force[3];      /* N at f = 1: F1 on the face Y = 10 m, -F1 on X = 6 m */
    double ramp;          /* s; f rises for this time and falls for as long, then nothing acts */
    double hot, cold;     /* K, on Y = 10 m and on X = 6 m at t = 0 */
    double jitter;        /* spacings: an irregular cloud and the closed operator */
} l_block_parameters;

typedef struct l_block {
    scene_body body;
    l_block_parameters parameters;
    size_t probe;         /* particle at X = (0, 10, 0) m (figure 7) */
    double traction[3];   /* Pa at f = 1 */
} l_block;

void l_block_default(l_block_parameters *parameters);
tlsph_result l_block_create(const l_block_parameters *parameters, l_block *out, tlsph_error *error);
/* Impulse of one of the two forces over the whole loading, N s: the scale of momenta in this scene. */
double l_block_impulse(const l_block_parameters *parameters);

/* ---- thermo-elastic standing wave (references/README, thermoelastic_standing_wave.csv) --------------------------- */

typedef struct standing_wave_parameters {
    scene_options options;
    int dimension;        /* 2 or 3 */
    int n;                /* spacings a wavelength, even */
    int across;           /* spacings across the bar */
    double length;        /* m; half a wavelength */
    double delta;         /* thermo-elastic coupling */
    double conductivity;  /* W/(m K) */
    double amplitude;     /* of the displacement, m */
    double periods;       /* over which frequency and damping are measured */
} standing_wave_parameters;

typedef struct standing_wave {
    scene_body body;
    standing_wave_parameters parameters;
    double k;             /* 1/m */
    double s[2];          /* exact root of the mode e^{st}: real and imaginary part, 1/s */
    double ratio[2];      /* exact b/a: temperature by displacement amplitude, K/m */
} standing_wave;

void standing_wave_default(standing_wave_parameters *parameters);
/* Conductivity at which conduction and wave are equally fast, D k^2 = c k: there damping by conduction is large. */
double standing_wave_matched_conductivity(const standing_wave_parameters *parameters);
tlsph_result standing_wave_create(const standing_wave_parameters *parameters, standing_wave *out, tlsph_error *error);
/* Exact root s and ratio b/a of a bar of density rho, P-wave modulus M, c_v (per volume) and conductivity h. */
void standing_wave_mode(double k, double rho, double M, double c_v, double h, double T0, double delta, double s[2],
                        double ratio[2]);
/* Exact displacement (m), velocity (m/s), strain and temperature difference (K) at X and t. */
void standing_wave_exact(const standing_wave *wave, double X, double t, double *u, double *v, double *strain,
                         double *theta);
/* Amplitude of the velocity's part along sin kX now, m/s. */
double standing_wave_amplitude(const standing_wave *wave);
/* Relative L2 errors of displacement and temperature now, by the amplitudes of the modes. */
void standing_wave_errors(const standing_wave *wave, double *error_u, double *error_theta);
/* Fits e^{st} to samples y(t): s starts as a guess and ends as the least-squares root. Returns 0 when it converged. */
int standing_wave_fit(const double *t, const double *y, size_t count, double s[2]);
/* Time at which the measurement ends, s: after `periods`, or at the options' end time (0: none) if that is earlier. */
double standing_wave_end(const standing_wave *wave);
/* Runs to that time and fits. `step` is called after each step with `user`; it may be NULL. */
tlsph_result standing_wave_measure(standing_wave *wave, double s[2], void (*step)(void *user), void *user);

/* ---- swinging cube: 001 section 7.1, METHOD sections 4 to 6, swinging_cube_t0.002.csv ---------------------------- */

typedef struct swinging_cube_parameters {
    scene_options options;
    int n;                /* spacings a side of 1 m */
    double jitter;        /* share of the spacing by which interior particles are moved */
    double amplitude;     /* U0, m */
    double young, poisson, density;
    int linear;           /* 1: linear material, for which the solution is exact; 0: neo-Hookean */
} swinging_cube_parameters;

typedef struct swinging_cube {
    scene_body body;
    swinging_cube_parameters parameters;
    double omega;         /* rad/s */
} swinging_cube;

void swinging_cube_default(swinging_cube_parameters *parameters);
tlsph_result swinging_cube_create(const swinging_cube_parameters *parameters, swinging_cube *out, tlsph_error *error);
/* Exact velocity (m/s), deformation gradient and stress (Pa) at X and t. */
void swinging_cube_exact(const swinging_cube *cube, const tlsph_real X[3], double t, double v[3], double F[9],
                         double P[9]);
/* Relative L2 errors of p_x and P_xX now, over the particles. */
void swinging_cube_errors(const swinging_cube *cube, double *error_p, double *error_P);

/* ---- finite circularly polarised shear wave: finite_shear_wave.csv ----------------------------------------------- */

/* x = (l X + A cos q, l Y + A sin q, l3 Z), q = k Z - w t: exact in nonlinear elasticity without any force. */
typedef struct shear_wave_parameters {
    scene_options options;
    int n;                /* spacings a wavelength of 1 m */
    double width;         /* m, of the bar, whose surface moves as the exact solution */
    double stretch, stretch_along; /* l, l3 */
    double amplitude;     /* A, m */
    double omega;         /* rad/s */
    double theta;         /* K */
    tlsph_material material;
} shear_wave_parameters;

typedef struct shear_wave {
    scene_body body;
    shear_wave_parameters parameters;
    double k;             /* 1/m */
} shear_wave;

void shear_wave_default(shear_wave_parameters *parameters);
tlsph_result shear_wave_create(const shear_wave_parameters *parameters, shear_wave *out, tlsph_error *error);
void shear_wave_exact(const shear_wave *wave, const tlsph_real X[3], double t, double x[3], double v[3], double F[9]);
/* Relative L2 errors of velocity and of the wave's part of F now, of particles deeper below the surface than `depth` (m):
   on the surface gradients are one-sided, first order, and the stress there disturbs a layer below it. */
void shear_wave_errors(const shear_wave *wave, double depth, double *error_v, double *error_F);

/* ---- rotation with pulsating stretch: rotation_with_pulsating_stretch.csv ---------------------------------------- */

/* F(t) = R(2 pi t about Z) diag(1 + 0.2 sin 3t, 1 + 0.1 (1 - cos 4t), 1 - 0.15 sin 2t), body force rho F'' X,
   theta(0) = 310 K, adiabatic. */
typedef struct pulsating_rotation_parameters {
    scene_options options;
    int n;                /* spacings a side of 1 m */
    int hold_surface;     /* 1: exact velocity on the surface, without which the body is no longer homogeneous */
    tlsph_material material;
} pulsating_rotation_parameters;

typedef struct pulsating_rotation {
    scene_body body;
    pulsating_rotation_parameters parameters;
} pulsating_rotation;

void pulsating_rotation_default(pulsating_rotation_parameters *parameters);
tlsph_result pulsating_rotation_create(const pulsating_rotation_parameters *parameters, pulsating_rotation *out,
                                       tlsph_error *error);
/* F, F' and F'' at t. */
void pulsating_rotation_exact(double t, double F[9], double rate[9], double second[9]);

/* ---- symmetric impact: riemann_star_states.csv ------------------------------------------------------------------- */

typedef struct impact_parameters {
    scene_options options;
    int n;                /* spacings along the bar */
    int across;           /* spacings across */
    double length;        /* m; the halves meet at X = 0 */
    double speed;         /* m/s of each half */
    tlsph_material material;
} impact_parameters;

/* State between the two shocks. */
typedef struct impact_star { double stress, jacobian, temperature; /* Pa (P_XX), -, K */ } impact_star;

typedef struct impact {
    scene_body body;
    impact_parameters parameters;
} impact;

void impact_default(impact_parameters *parameters);
tlsph_result impact_create(const impact_parameters *parameters, impact *out, tlsph_error *error);
/* Exact star state, from the jump conditions; returns the shock's speed in the reference, m/s. */
double impact_exact(const impact_parameters *parameters, impact_star *star);
/* Isothermal p speed at rest, the scale of impact speeds, m/s. */
double impact_p_speed(const tlsph_material *material);
/* Means over |X| between the shares `from` and `to` of the shock's place now (speed of the shock: m/s, reference), and
   largest overshoot of -P_XX over the exact star stress, as a share of it. */
void impact_read(const impact *bar, double shock_speed, double from, double to, const impact_star *exact,
                 impact_star *mean, double *overshoot);

/* How much of a field (say the pressure) alternates from particle to particle, as a share of how much it varies smoothly:
       standard deviation of  f_a - (f_{a-1} + f_{a+1})/2   over all particles and lattice lines through them
       -------------------------------------------------------------------------------------------------------
       standard deviation of the smoothed field f_a - (mean of these differences at a)/2
   The lines run along the axes, found in the solver's neighbour lists; where one end is missing (at the surface) the line
   is left out. Particles without lines, as in clouds, take f_a less the linear function that fits their neighbours, unless
   these are on one side. A linear field gives 0; a checkerboard of +-A on a smooth field of deviation S gives 2 A/S, one
   that alternates along one axis of d only gives 2 A/(S sqrt d). Smooth curvature counts too, f'' h^2/2: it falls with
   the square of the spacing, a checkerboard does not. On its own a number above some 0.1 or 0.2 means a picture that looks
   spotted; compare scenes at equal spacing and time. Infinite where the smoothed field is constant and the field is not,
   and without memory, so that checks of bounds fail. `field` must have one component; `values` one a particle, host order. */
double scene_oscillation(const tlsph_solver *solver, tlsph_field field);
double scene_oscillation_of(const tlsph_solver *solver, const tlsph_real *values);

/* How far every second particle is moved out of line along lattice lines of `axis`, in spacings: root of the mean square of
   the fourth difference of positions over 16. What smooth shapes give falls with the fourth power of the spacing. */
double scene_alternation(const scene_body *body, int axis);

/* ---- twisting column: 001 section 7.3.1 -------------------------------------------------------------------------- */

typedef struct twisting_column_parameters {
    scene_options options;
    int n;                /* spacings across 1 m */
    int centred;          /* 1: particles at the centres of cells, as n x n x 6n in 002; 0: on the faces */
    double nu;            /* Poisson's ratio */
    double omega;         /* rad/s, of the initial angular velocity at the top */
    double jitter;        /* spacings: an irregular cloud and the closed operator */
} twisting_column_parameters;

typedef struct twisting_column {
    scene_body body;
    twisting_column_parameters parameters;
} twisting_column;

typedef struct twisting_column_shape {
    double tip_height;       /* m, of the top face's centre */
    double tip_twist;        /* rad, of the top face, whole turns counted from reading to reading */
    double axis[2];          /* m, X and Z of the top face's centre */
    double axis_velocity[2]; /* m/s */
} twisting_column_shape;

void twisting_column_default(twisting_column_parameters *parameters);
tlsph_result twisting_column_create(const twisting_column_parameters *parameters, twisting_column *out,
                                    tlsph_error *error);
/* Brings *shape (zero before the first reading) up to date; call it after each step, so that no turn is missed. */
void twisting_column_read(const twisting_column *column, twisting_column_shape *shape);

/* ---- stent: 001 section 7.3.2 ------------------------------------------------------------------------------------ */

typedef struct stent_parameters {
    scene_options options;
    double spacing;       /* m */
    int around, rows;     /* holes on the whole circumference (a multiple of 4), rows of them on half the length */
    double young, density, nu;
    double start_time;    /* s, of the paper's clock, at which the run starts: before 0.008 s the end moves by 22 um */
} stent_parameters;

typedef struct stent { scene_body body; stent_parameters parameters; } stent;

void stent_default(stent_parameters *parameters);
tlsph_result stent_create(const stent_parameters *parameters, stent *out, tlsph_error *error);
/* Speed (m/s) and way (m) of the end towards the middle at the paper's time t, (60); exact volume of the eighth (m^3), holes
   taken as drilled straight through the middle surface. */
double stent_speed(double t);
double stent_shortening(double t);
double stent_volume(const stent_parameters *parameters);

/* ---- rotating disk: 000 section 7.3 ------------------------------------------------------------------------------ */

/* The figure with the sizes is missing. What the text gives: X = (2, 4, 0) m is watched, and 1591.5 W/m^2 acts on a quarter
   of the lateral surface. 1591.5 is 5000 W by pi m^2, and pi m^2 is the quarter of the lateral surface of a disk of radius
   2 m and thickness 1 m; standing at the origin, in [0,4]^2 x [0,1] m, it has X = (2, 4, 0) on its edge. It has an "inner
   circle", whose radius is set to half the outer one. The momentum of figure 13a is zero: X in (92) is measured from the
   centre. Which quarter is heated is not said: azimuth 0 to 90 degrees. */
typedef struct rotating_disk_parameters {
    scene_options options;
    int n;                /* spacings across the diameter, even; 14, 28, 34, 44: near the paper's 850 to 16000 particles */
    double radius, hole, thickness; /* m */
    double omega[3];      /* rad/s */
    double heat_flux;     /* W/m^2, amplitude of the sine, positive = leaves. The text says both that heat flows out and
                             that the total energy rises first; the figures need the second: -1591.5 */
    double heated[2];     /* degrees, azimuth of the heated part of the lateral surface */
    double switch_off;    /* s; a whole period of the sine */
} rotating_disk_parameters;

typedef struct rotating_disk {
    scene_body body;
    rotating_disk_parameters parameters;
    size_t probe;         /* particle at X = (2, 4, 0) m (figure 12) */
} rotating_disk;

void rotating_disk_default(rotating_disk_parameters *parameters);
tlsph_result rotating_disk_create(const rotating_disk_parameters *parameters, rotating_disk *out, tlsph_error *error);
/* Exact heat that has entered by time t, J. */
double rotating_disk_heat(const rotating_disk_parameters *parameters, double t);
/* ---- Danilovskaya's problems: 003 sections 9.2 and 9.3, METHOD section 9 ------------------------------------------ */

/* Half space y >= 0, free at y = 0 and heated there: suddenly to 1; by the flux m (1 - theta); to 1 in a ramp. */
typedef enum danilovskaya_problem {
    DANILOVSKAYA_FIRST, DANILOVSKAYA_SECOND, STERNBERG_CHAKRAVORTY
} danilovskaya_problem;

#define DANILOVSKAYA_TRANSFER 0.5  /* m of 003 (89) */
#define DANILOVSKAYA_RAMP 0.25     /* length of the ramp, 003 (91) */

/* Dimensionless as in 003 (11), but with the applied temperature as unit instead of T0. */
typedef struct danilovskaya_state { double theta, u, sigma; } danilovskaya_state;

/* Exact values at y >= 0 and t, any delta >= 0; at the front y = t the mean of both sides. */
danilovskaya_state danilovskaya_exact(danilovskaya_problem problem, double delta, double y, double t);
/* First problem without inertia. */
danilovskaya_state danilovskaya_quasi_static(double delta, double y, double t);

typedef struct danilovskaya_parameters {
    scene_options options;  /* end_time is not used: see danilovskaya_advance */
    int problem;            /* a danilovskaya_problem */
    double delta;           /* coupling; the solver uses at least 1e-6 */
    double spacing, length; /* in units of a = kappa/c_s */
    int across, dimension;  /* spacings across the bar; 2 or 3 */
    double load;            /* delta times the applied temperature over T0, which is 0.1 at most: small, because only
                               then the equations are linear; not too small, because strains lose digits in x */
    double rise;            /* first problem: the jump is spread over the time of a wave for so many spacings, with its
                               middle at t = 0; what is shorter than a spacing would only ring behind the front */
    int material;           /* TLSPH_LINEAR or TLSPH_MIE_GRUNEISEN */
    double nsni;            /* f, factor of the naturally stabilised force (METHOD 9): 0 none, 1 as in 003, 3 compact
                               stencil, 4 fourth order. In place of sharp gradients; as a load, so its energy is external */
} danilovskaya_parameters;

typedef struct danilovskaya {
    scene_body body;
    danilovskaya_parameters parameters;
    double length_unit, time_unit, theta_unit, stress_unit, u_unit, flux_unit; /* m, s, K, Pa, m, W/m^2 */
    double T0;              /* K */
    size_t sections;        /* particles along the bar */
    size_t *line;           /* their numbers on one edge, in order of y */
    double *displacement;   /* of the sections, for nsni, and their second differences */
    size_t cells;           /* along the bar */
    double start, ramp;     /* t at the solver's time 0; length of the rise of the temperature */
    double surface, surface_rate, surface_time; /* theta at y = 0 as the second problem's flux needs it */
} danilovskaya;

void danilovskaya_default(danilovskaya_parameters *parameters);
tlsph_result danilovskaya_create(const danilovskaya_parameters *parameters, danilovskaya *out, tlsph_error *error);
/* Steps until t (dimensionless). */
tlsph_result danilovskaya_advance(danilovskaya *bar, double t);
double danilovskaya_time(const danilovskaya *bar); /* dimensionless */
/* y and the state along the bar now, `sections` values each. 0 on success. */
int danilovskaya_profile(const danilovskaya *bar, double *y, danilovskaya_state *state);
/* Linear interpolation in a profile. */
danilovskaya_state danilovskaya_at(size_t count, const double *y, const danilovskaya_state *state, double where);
/* Relative L2 errors now (exact: with the delta asked for), and how far sigma leaves the exact range within 0.5 of the
   front, as a share of the front's jump exp(-delta t/2) (0 where the problem has no jump). */
typedef struct danilovskaya_errors { double theta, u, sigma, overshoot; } danilovskaya_errors;
int danilovskaya_compare(const danilovskaya *bar, danilovskaya_errors *errors);
/* Largest frequency of the stabilised stencil, in units of that without: the time step is so much shorter. */
double danilovskaya_nsni_frequency(double f);
void danilovskaya_destroy(danilovskaya *bar);

/* ---- derivatives in one dimension: 002 section 4.1, figures 4 to 6 ------------------------------------------------ */

typedef enum gradient_form {
    GRADIENT_STANDARD,     /* (33) with the gradient of the first-order kernel */
    GRADIENT_BOND_ONLY,    /* (34) with (35): no bond of a particle with itself */
    GRADIENT_BOND_FIRST,   /* (34) with (36) and the first-order kernel */
    GRADIENT_BOND_ZEROTH,  /* the same with the zeroth-order kernel and its corrected gradient */
    GRADIENT_FORMS,
    GRADIENT_OPERATOR = GRADIENT_FORMS /* GRADIENT_BOND_FIRST as the constant map of [BONDS], for comparison */
} gradient_form;
typedef struct gradient_field { double (*value)(double X), (*slope)(double X); } gradient_field;

/* Derivative of field at n particles X_i = (i + 1/2) length/n, cubic spline of half-width `radius` (m). out: n. */
void gradient_study_derivative(gradient_form form, const gradient_field *field, double length, int n, double radius,
                               double *out);
/* Root mean square error of it. */
double gradient_study_error(gradient_form form, const gradient_field *field, double length, int n, double radius);

/* ---- swinging plate, plane strain: 002 section 5.1, swinging_plate_t0.002_*.csv ----------------------------------- */

/* [0,2]^2 with rollers on all four sides: u = U sin(w t) {-sin(pi X/2) cos(pi Y/2), cos(pi X/2) sin(pi Y/2)}. The mode has
   no divergence, so that only the shear speed enters: w = (pi/2) sqrt(2 mu/rho). */
typedef struct swinging_plate_parameters {
    scene_options options;
    int n;                /* spacings a side of 2 m */
    double amplitude;     /* U, m */
    double young, poisson, density;
    int linear;           /* 1: linear material, for which the solution is exact; 0: neo-Hookean */
} swinging_plate_parameters;

typedef struct swinging_plate {
    scene_body body;
    swinging_plate_parameters parameters;
    double omega, shear;  /* rad/s, Pa */
} swinging_plate;

/* Errors of the displacement and its gradient: integrals over the plate by their exact values. */
/* Eight doubles in this order. */
typedef struct plate_errors {
    double L2, H1;               /* of the kernels' interpolation, by 10 x 10 tiles of 5 x 5 Gauss points (002-44, 45) */
    double L2_particles, H1_particles; /* sums over the particles, of u and F */
    double velocity, stress;     /* the same of v and P */
    double L2_exact, H1_exact;   /* L2 and H1 of the kernels' interpolation of the exact displacements: what (44), (45) show of a
                                    scheme without error */
} plate_errors;

void swinging_plate_default(swinging_plate_parameters *parameters);
tlsph_result swinging_plate_create(const swinging_plate_parameters *parameters, swinging_plate *out, tlsph_error *error);
void swinging_plate_exact(const swinging_plate *plate, const tlsph_real X[3], double t, double u[3], double v[3],
                          double F[9], double P[9]);
/* integrals 0: without L2 and H1, which cost as much as some steps. */
void swinging_plate_errors(const swinging_plate *plate, int integrals, plate_errors *errors);

/* ---- spinning plate and cube: 002 section 5.2 ---------------------------------------------------------------------- */

/* A free square or cube of 1 m that turns about Z through its middle. */
typedef struct spinning_box_parameters {
    scene_options options;
    int dimension, n;     /* particles a side, at the centres of cells */
    double spin;          /* rad/s */
    double young, poisson, density;
} spinning_box_parameters;

typedef struct spinning_box { scene_body body; spinning_box_parameters parameters; } spinning_box;

void spinning_box_default(spinning_box_parameters *parameters, int dimension);
tlsph_result spinning_box_create(const spinning_box_parameters *parameters, spinning_box *out, tlsph_error *error);

/* ---- bending column: 002 section 5.3 ------------------------------------------------------------------------------- */

/* 1 m x 1 m x 6 m, fixed at Z = 0, v = (0, 5 Z/3, 0) m/s at t = 0. */
typedef struct bending_column_parameters {
    scene_options options;
    int n;                /* spacings across 1 m */
    int centred;          /* 1: particles at the centres of cells, as 5 x 5 x 30 in 002; 0: on the faces */
    double speed;         /* of the tip, m/s */
    double young, poisson, density;
} bending_column_parameters;

typedef struct bending_column { scene_body body; bending_column_parameters parameters; size_t tip; } bending_column;

void bending_column_default(bending_column_parameters *parameters);
tlsph_result bending_column_create(const bending_column_parameters *parameters, bending_column *out, tlsph_error *error);
/* The setting of 002: bonds, cubic spline with support 0.9, JST, no projection, three stages. */
void scene_options_of_002(scene_options *options, double biharmonic);

/* ---- manufactured solution: 000 section 7.1, manufactured_thermoelastic.csv --------------------------------------- */

typedef struct manufactured_parameters {
    scene_options options;
    int n;                /* spacings a side of 1 m */
    int centred;          /* 1: particles at cell centres, 0: on the faces */
    int layers;           /* of particles outside the faces */
    int driven;           /* outermost layers that move exactly: with 2, gradients are central wherever forces count. The
                             others outside are free: where the exact motion is forced upon a scheme that errs by h^2 its
                             error has a kink, and stresses are first order beside it */
    double jitter;        /* share of the spacing */
    double rate;          /* A, 1/s */
    double heating;       /* B, 1/s */
    tlsph_material material; /* linear, MEE or Mie-Grueneisen */
} manufactured_parameters;

typedef struct manufactured {
    scene_body body;
    manufactured_parameters parameters;
    double load_seconds;  /* processor time that the exact sources have taken, which is none of the method's */
} manufactured;

/* All that is exact at a point: force per reference volume (N/m^3), heat source (W/m^3); energy with its kinetic part. */
typedef struct manufactured_state {
    double x[3], v[3], F[9], H[9], P[9], theta, entropy, energy, force[3], source;
} manufactured_state;

/* Relative L2 errors over the particles of the cube: all components together, and each; theta by theta - theta_R. */
typedef struct manufactured_errors { double p, P, theta, p_each[3], P_each[9]; } manufactured_errors;

void manufactured_default(manufactured_parameters *parameters);
/* Material and setting: the paper's (strain 5e-4 at 0.001 s), or a demanding one (strain 0.12 at 0.25 s, in which waves
   cross the cube twice; temperature +-36 K, conductivity 100 W/(m K)). */
void manufactured_set(manufactured_parameters *parameters, tlsph_material_kind kind, int demanding);
void manufactured_exact(const manufactured_parameters *parameters, const double X[3], double t, manufactured_state *out);
tlsph_result manufactured_create(const manufactured_parameters *parameters, manufactured *out, tlsph_error *error);
/* Runs to the options' end time; the norms are over as many equally spaced instants. `step` is called after each step with
   `user`; it may be NULL. */
tlsph_result manufactured_run(manufactured *cube, int instants, void (*step)(void *user), void *user,
                              manufactured_errors *out);

/* ---- pulled column: 002 section 5.4, figures 19 and 20 ----------------------------------------------------------- */

typedef struct pulled_column_parameters {
    scene_options options;   /* end_time 0: from `elongation` */
    int n;                   /* spacings across the width of 1 m, 6 n along the length of 6 m */
    int centred;             /* 1: particles at cell centres (n x n x 6n, as in 002), 0: on the faces */
    int quarter;             /* 1: a quarter of the section between rollers, for even n with particles on the faces */
    int sliding;             /* 1: foot and head are held along the axis only, not sideways */
    double poisson, speed;   /* m/s, of the driven end */
    double elongation;       /* at which the pull ends, percent */
} pulled_column_parameters;

typedef struct pulled_column {
    scene_body body;
    pulled_column_parameters parameters;
    size_t tip;              /* a driven particle */
} pulled_column;

void pulled_column_default(pulled_column_parameters *parameters);
tlsph_result pulled_column_create(const pulled_column_parameters *parameters, pulled_column *out, tlsph_error *error);
/* Time at which the pull ends, s. */
double pulled_column_end(const pulled_column_parameters *parameters);
/* (L' - L)/L now, percent (002-49). */
double pulled_column_elongation(const pulled_column *column);
/* Force that pulls the fixed end down, N: sum of P_zZ dA over the layer of particles beside it. */
double pulled_column_force(const pulled_column *column);
/* Force on a homogeneous bar of the same section (1 m^2) stretched by `stretch`, sides free, N: of psi = mu/2 (J^(-2/3) F:F
   - 3) + kappa/2 (J - 1)^2, with the stretch of the sides from P = 0 there. */
double pulled_column_bar_force(const tlsph_material *material, double stretch);
/* Speed of p waves across that bar in the current state by that of the undeformed body: sqrt(P_xx,xx/rho) b/c_lin, with the
   stretch b of the sides. It is what the step of (31) with c_lin does not know: 1 at rest, 1.7 at 500 % for nu = 0.45. */
double pulled_column_stiffening(const tlsph_material *material, double stretch);

/* ---- implicit reproducing-kernel bar: 003 sections 8 and 9 ------------------------------------------------------- */

/* How the weak form is integrated (003 section 9): at the nodes, with corrected test functions (VC), stabilised (NSNI), or
   with five Gauss points between nodes. */
typedef enum rkpm_method { RKPM_DNI, RKPM_VC_DNI, RKPM_NSNI, RKPM_VC_NSNI, RKPM_GAUSS, RKPM_METHODS } rkpm_method;
extern const char *const rkpm_names[RKPM_METHODS];

typedef struct rkpm_parameters {
    int method, problem;       /* a rkpm_method, a danilovskaya_problem */
    int quasi_static;          /* 1: without inertia (first problem) */
    int newmark, lumped;       /* 1: Newmark and Crank-Nicolson, else backward differences; 1: lumped mass */
    int symmetric;             /* 1: the symmetric part of the stiffness instead of it, to see what asymmetry does */
    double delta, spacing, length, jitter, time_step; /* as in the half space; inner nodes move by jitter x spacing */
    unsigned long seed;
} rkpm_parameters;

typedef struct rkpm_bar rkpm_bar;

void rkpm_default(rkpm_parameters *parameters);
/* NULL without memory, or where nodes are too irregular. */
rkpm_bar *rkpm_create(const rkpm_parameters *parameters);
void rkpm_destroy(rkpm_bar *bar);
/* One time step; 0 on success, 1 where the matrix is singular. */
int rkpm_step(rkpm_bar *bar);
double rkpm_time(const rkpm_bar *bar);
/* Places of the nodes, and the state there. Returns the number of nodes. */
size_t rkpm_read(const rkpm_bar *bar, const double **y, const danilovskaya_state **state);
/* Relative L2 errors now over the bar. */
danilovskaya_errors rkpm_compare(const rkpm_bar *bar);
/* Patch test of 003 section 9.1 on `nodes` nodes: L2 norms of the errors of u = x and theta = x. 0 on success. */
int rkpm_patch(rkpm_method method, int nodes, double jitter, unsigned long seed, double *error_u, double *error_theta);
/* Free elastic vibration from a random shape until `end`: rate (1/t) at which its amplitude grows over the second half. */
int rkpm_growth(const rkpm_parameters *parameters, double end, double *rate);

/* ---- conduction alone: 000-13, 56 -------------------------------------------------------------------------------- */

typedef enum conduction_motion { CONDUCTION_RESTING, CONDUCTION_STRETCHED, CONDUCTION_TURNING } conduction_motion;
typedef enum conduction_state { CONDUCTION_SPOT, CONDUCTION_MODE, CONDUCTION_ALTERNATING } conduction_state;

typedef struct conduction_parameters {
    scene_options options;
    int dimension;        /* 2 or 3 */
    int n;                /* spacings a side of 1 m, the centre at the origin */
    conduction_motion motion; /* free at rest; all particles held; all particles driven in a rigid rotation */
    conduction_state state;
    double amplitude;     /* K */
    double sigma;         /* m, of the spot at the start */
    double omega;         /* rad/s */
    double jitter;        /* share of the spacing */
    tlsph_material material; /* without expansion */
} conduction_parameters;

typedef struct conducting_body { scene_body body; conduction_parameters parameters; } conducting_body;

void conduction_default(conduction_parameters *parameters);
tlsph_result conduction_create(const conduction_parameters *parameters, conducting_body *out, tlsph_error *error);
/* Exact temperature, K; of the alternating state: the initial one, for ever. */
double conduction_exact(const conduction_parameters *parameters, const tlsph_real X[3], double t);
/* Relative L2 error of theta - theta_R now. */
double conduction_error(const conducting_body *body);
/* How much of the initial field is left in the inner half: its share in the field now, 1 at the start. */
double conduction_amplitude(const conducting_body *body);

/* ---- punch test: 000 section 7.4 --------------------------------------------------------------------------------- */

/* A cylinder on a frictionless floor, punched from above at near incompressibility. The figure with the sizes is missing.
   What the text gives: height H = 1 m, X = (0, 1, 1) m is watched, so that radius 1 m about the Z axis puts it on the upper
   edge; the cylinder is "perforated", and shown from above: a hole along the axis, whose radius is set to a quarter. It is
   punched "on the middle-top face": (94) holds around the hole, out to half the radius, and is 0 outside. */
typedef struct punch_test_parameters {
    scene_options options;
    int n;                /* spacings across the diameter, even; 18, 22, 28: near the paper's 2500, 5000, 10000 particles */
    double radius, height, hole; /* m */
    double speed;         /* m/s at Z = H, downward */
    double punch;         /* m; radius of the part that moves at first */
    double poisson;
} punch_test_parameters;

typedef struct punch_test {
    scene_body body;
    punch_test_parameters parameters;
    size_t probe;         /* particle at X = (0, 1, 1) m (figure 18) */
} punch_test;

void punch_test_default(punch_test_parameters *parameters);
tlsph_result punch_test_create(const punch_test_parameters *parameters, punch_test *out, tlsph_error *error);

/* ---- gripper: 000 section 7.5 ------------------------------------------------------------------------------------ */

/* Four arms from a hollow cylinder. Given: arms to 0.4 m from the centre, cylinder of radius 0.1 m, X = (0.4, 0, -0.03) m
   watched at an end. So the body lies between Z = -0.03 and 0.03 m. Not given: the width of the arms, set to 0.08 m; the
   radius of the bore, 0.06 m; what holds it: the wall of the bore, where the temperature is prescribed, is clamped, since
   the four tractions have a resultant; the sign of the vertical traction: upward. */
typedef struct gripper_parameters {
    scene_options options;
    double spacing;       /* m; 0.02 / integer, so that all faces lie on the lattice */
    double arm, width, thickness, radius, bore; /* m */
    double traction;      /* Pa, along Z on the ends of the arms */
    double cold, hot;     /* K: wall of the bore, for ever; ends of the arms, at t = 0 */
    int cloud;            /* 1: an irregular cloud with particles on the true surface, closed operator */
} gripper_parameters;

typedef struct gripper {
    scene_body body;
    gripper_parameters parameters;
    size_t probe;         /* particle at X = (0.4, 0, -0.03) m (figure 22) */
} gripper;

void gripper_default(gripper_parameters *parameters);
tlsph_result gripper_create(const gripper_parameters *parameters, gripper *out, tlsph_error *error);

/* ---- spherical ball: 000 section 7.6 ----------------------------------------------------------------------------- */

/* A free thin-walled ball with an unsymmetrical pattern of holes. The figure with the sizes is missing. 470.871 kW/m^2 is
   100 kW by 4 pi (0.13 m)^2 (or 1 kW at 13 mm, where 0.042 s would be some hundred swings of the wall and not the few that
   a sequence of six pictures can show): inner radius 0.13 m. Set here: wall 0.02 m; four holes on the equator, three above
   it, none below, mirrored at Y = 0 so that this symmetry can be checked; (95) holds on the cap within 30 degrees of the
   top; the heat enters (positive Q_B of (96) would cool by (36e), but then (93) would cool the disk first, against figure
   13c). */
typedef struct spherical_ball_parameters {
    scene_options options;
    double inner_radius, wall; /* m */
    int n;                /* spacings through the wall */
    double holes[2];      /* degrees, angular radius of the equatorial and of the upper holes; 0: none */
    double latitude;      /* degrees, of the upper ones */
    double cap;           /* degrees from the top */
    double speed;         /* m/s, downward */
    double heat_flux;     /* W/m^2 on the inner surface, positive = leaves */
    int cloud;            /* 1: an irregular cloud with particles on the true surface, closed operator */
} spherical_ball_parameters;

typedef struct spherical_ball {
    scene_body body;
    spherical_ball_parameters parameters;
    double inner_area;    /* m^2, that takes the heat */
    size_t probe;         /* particle at the top, outside */
} spherical_ball;

void spherical_ball_default(spherical_ball_parameters *parameters);
tlsph_result spherical_ball_create(const spherical_ball_parameters *parameters, spherical_ball *out, tlsph_error *error);

/* ---- Taylor bar: 001 section 7.2.3, table 2 ---------------------------------------------------------------------- */

/* A quarter (x, z >= 0) of a round bar along Y that starts at Y = 0, `n` spacings a radius, with particles on the curved
   surface; for TLSPH_GIVEN. The polygon of the arc's particles has the area of the disc. */
tlsph_result scene_round_bar(double radius, double length, int n, tlsph_cloud *out);

typedef struct taylor_bar_parameters {
    scene_options options;
    int n;                /* spacings a radius */
    int fill;             /* 0: round, particles on the surface; 1: lattice */
    int wall;             /* 0: contact; 1: foot held on the wall (roller) */
    double radius, length; /* m */
    double speed;         /* m/s, towards -Y */
    tlsph_material material;
} taylor_bar_parameters;

typedef struct taylor_bar {
    scene_body body;
    taylor_bar_parameters parameters;
    uint32_t *foot;       /* quadrilaterals of the foot, 4 particles each */
    size_t faces;
    size_t tip;           /* particle on the axis at the other end */
} taylor_bar;

typedef struct taylor_bar_shape {
    double radius;        /* m, of the disc that has the area of the foot now */
    double length;        /* m, on the axis */
    double plastic_strain; /* largest */
    double lift;          /* m, largest height of the foot above the wall */
} taylor_bar_shape;

void taylor_bar_default(taylor_bar_parameters *parameters);
tlsph_result taylor_bar_create(const taylor_bar_parameters *parameters, taylor_bar *out, tlsph_error *error);
void taylor_bar_read(const taylor_bar *bar, taylor_bar_shape *shape);
void taylor_bar_destroy(taylor_bar *bar);

/* ---- block with holes, pulled or punched: 001 sections 7.2.1, 7.2.2 ---------------------------------------------- */

typedef struct perforated_block_parameters {
    scene_options options;
    int punch;            /* 0: pulled, clamped below; 1: punched between rollers */
    int n;                /* spacings in 0.1 m */
    double nu, speed;     /* -, m/s */
} perforated_block_parameters;

typedef struct perforated_block { scene_body body; perforated_block_parameters parameters; } perforated_block;

void perforated_block_default(perforated_block_parameters *parameters, int punch);
tlsph_result perforated_block_create(const perforated_block_parameters *parameters, perforated_block *out,
                                     tlsph_error *error);
/* ---- satellite-like structure: 001 section 7.1.2, figures 6 to 9 -------------------------------------------------- */

typedef struct satellite_parameters {
    scene_options options;
    double spacing;          /* m; divides 1 m evenly, so that arms and cone meet the lattice */
    double spin;             /* rad/s about Z */
} satellite_parameters;

typedef struct satellite {
    scene_body body;
    satellite_parameters parameters;
    double centre[3];        /* of mass at the start */
} satellite;

void satellite_default(satellite_parameters *parameters);
tlsph_result satellite_create(const satellite_parameters *parameters, satellite *out, tlsph_error *error);
/* Resultants of figure 9 now, N: sum_a V_a T_a and sum_a V_a D(p_a), made from the operator, the stresses and the pair
   dissipation of the public interface, not from the solver's own forces; and the sums of their absolute values. For
   antisymmetric operators and the limited dissipation, without projection's rigid motion. */
tlsph_result satellite_resultants(const satellite *out, double force[3], double dissipation[3], double size[2]);

/* ---- breathing ball and Lame's mode of a cube: free surfaces on irregular clouds --------------------------------- */

typedef struct cloud_mode_parameters {
    scene_options options;
    int ball;             /* 1: ball of radius 1 m; 0: cube of 1 m */
    int n;                /* spacings a radius, a side */
    double jitter;        /* cube: share of the spacing by which a lattice's particles are moved; 0: the lattice */
    int scattered;        /* cube: 1: a sampled cloud instead of a moved lattice */
    int seed;
    double amplitude;     /* m */
    double young, poisson, density;
    double periods;       /* over which the frequency is measured */
} cloud_mode_parameters;

typedef struct cloud_mode {
    scene_body body;
    cloud_mode_parameters parameters;
    double k, omega;      /* 1/m, rad/s */
} cloud_mode;

void breathing_ball_default(cloud_mode_parameters *parameters);
void lame_mode_default(cloud_mode_parameters *parameters);
tlsph_result cloud_mode_create(const cloud_mode_parameters *parameters, cloud_mode *out, tlsph_error *error);
void cloud_mode_exact(const cloud_mode *mode, const tlsph_real X[3], double t, double v[3], double F[9], double P[9]);
double cloud_mode_period(const cloud_mode *mode);
/* Amplitude of the velocity along the mode now, m/s. */
double cloud_mode_amplitude(const cloud_mode *mode);
/* Relative L2 errors of p and P now, all components. */
void cloud_mode_errors(const cloud_mode *mode, double *error_p, double *error_P);
/* Runs for the periods and fits the frequency: its relative error. `step` is called 64 times; it may be NULL. */
tlsph_result cloud_mode_measure(cloud_mode *mode, double *frequency_error, void (*step)(void *user), void *user);

/* ---- part by a triangle surface ---------------------------------------------------------------------------------- */

/* A free part of rubber, sampled as a cloud in a closed surface, gets a push on the face farthest along X and flies, bends
   and turns. */
typedef struct stl_part_parameters {
    scene_options options;
    ex_triangles surface; /* m; stays the caller's, needed during creation only */
    double spacing;       /* m */
    int seed;
    double push[3];       /* Pa, largest, on the pushed face */
    double duration;      /* s, of the push, half a sine */
} stl_part_parameters;

typedef struct stl_part {
    scene_body body;
    stl_part_parameters parameters;
    double volume, area, centre[3]; /* of the surface, exact: m^3, m^2, m */
    double face;          /* m^2, that is pushed */
    size_t tip;           /* a particle there */
} stl_part;

void stl_part_default(stl_part_parameters *parameters);
/* A bracket: an L with arms of 0.1 m, 0.04 m wide and 0.02 m thick, and a hole of radius 0.012 m in its corner, to be freed.
   All corners are floats, as STL files have them. 0 on success. */
int stl_part_bracket(ex_triangles *out);
/* ERROR_SURFACE says where a surface leaks or a facet is flipped. */
tlsph_result stl_part_create(const stl_part_parameters *parameters, stl_part *out, tlsph_error *error);

#endif
