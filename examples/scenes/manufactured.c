/*
manufactured.c - a cube that is deformed and heated as prescribed, by exact body forces and heat sources: 000
section 7.1

  x = X + s/2 |X|^2 1,  s = 2 A t,  1 = (1, 1, 1);   theta = theta_R (1 + B sin(pi X_1) (t + 1 s));   L = 1 m   (000-84)
With g = s X.1 this gives
  F = I + s 1 (x) X,  J = 1 + g,  H = J I - s X (x) 1,  DIV F = 3 s 1,  DIV H = 0,
  N = H^T H = J^2 I - s J (X (x) 1 + 1 (x) X) + s^2 |X|^2 1 (x) 1,  DIV N = -s (J + 1) 1 - 3 s^2 X,
  F:F = 3 + 2 g + 3 s^2 |X|^2,  H:H = tr N.
Sources are f = -DIV P (the velocity does not depend on t) and s = theta d/dt eta_R + c_v d/dt theta + DIV Q, with the
laws (000-26 to 32) and Q = -h/J N grad theta; linear: P = lambda tr(eps) I + 2 mu eps - beta (theta - theta_R) I and Q
= -h grad theta. (89), (90) as printed have a wrong coefficient and C_v for c_v = rho_R C_v; and their solution stays
only if the exact velocity drives the whole surface, not one corner.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void manufactured_default(manufactured_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.thermal = TLSPH_ENERGY;
    p->n = 16;
    p->layers = 3;
    p->driven = 2;
    manufactured_set(p, TLSPH_LINEAR, 0);
}

void manufactured_set(manufactured_parameters *p, tlsph_material_kind kind, int demanding) {
    p->material = scene_paper_material(kind);
    p->rate = 0.2381;
    p->heating = demanding ? 0.1 : -0.0012;
    p->options.end_time = demanding ? 0.25 : 0.001;
    if (demanding) p->material.conductivity = 100;
}

/* ---- exact solution ---------------------------------------------------------------------------------------------- */

static double exact_temperature_at(const manufactured_parameters *p, double X, double t) {
    return (double)p->material.reference_temperature * (1 + p->heating * sin(SCENE_PI * X) * (t + 1));
}

/* Geometry of the map, the temperature's derivatives, and the constants of the laws, in the papers' letters. */
typedef struct map {
    double s, rate, r2, J, J_rate;
    double N[3][3], M[3][3], divN[3]; /* M = H N */
    double theta_rate, slope, curvature; /* of theta: by t, by X_1 once and twice */
    double rho, mu, kappa, beta, theta_R, c_v, h, q, zeta, gamma, k;
} map;

static map make_map(const manufactured_parameters *p, const double X[3], double t, manufactured_state *o) {
    const tlsph_material *m = &p->material;
    map a;
    double p_wave;
    memset(&a, 0, sizeof a);
    scene_moduli(m, &p_wave, &a.kappa, &a.mu);
    a.rho = (double)m->density; a.c_v = a.rho * (double)m->specific_heat; a.h = (double)m->conductivity;
    a.theta_R = (double)m->reference_temperature;
    a.beta = 3 * a.kappa * (double)m->expansion; /* c_v Gamma_0 */
    a.q = m->kind == TLSPH_MIE_GRUNEISEN ? (double)m->gruneisen_exponent : 1;
    a.zeta = (1 - (double)m->mooney_fraction) * a.mu / 2;
    a.gamma = (double)m->mooney_fraction * a.mu / (3 * sqrt(3));
    a.k = a.kappa - a.beta * a.theta_R * (1 - a.q);
    a.rate = 2 * p->rate; a.s = a.rate * t;
    a.r2 = X[0] * X[0] + X[1] * X[1] + X[2] * X[2];
    a.J_rate = a.rate * (X[0] + X[1] + X[2]); a.J = 1 + a.s * (X[0] + X[1] + X[2]);
    for (int i = 0; i < 3; i++) {
        o->x[i] = X[i] + a.s * a.r2 / 2;
        o->v[i] = a.rate * a.r2 / 2;
        a.divN[i] = -a.s * (a.J + 1) - 3 * a.s * a.s * X[i];
        for (int j = 0; j < 3; j++) {
            o->F[3 * i + j] = (i == j) + a.s * X[j];
            o->H[3 * i + j] = a.J * (i == j) - a.s * X[i];
            a.N[i][j] = a.J * a.J * (i == j) - a.s * a.J * (X[i] + X[j]) + a.s * a.s * a.r2;
        }
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) a.M[i][j] += o->H[3 * i + k] * a.N[k][j];
    const double amplitude = a.theta_R * p->heating, wave = sin(SCENE_PI * X[0]);
    o->theta = exact_temperature_at(p, X[0], t);
    a.theta_rate = amplitude * wave;
    a.slope = amplitude * SCENE_PI * cos(SCENE_PI * X[0]) * (t + 1);
    a.curvature = -amplitude * SCENE_PI * SCENE_PI * wave * (t + 1);
    return a;
}

static void linear_laws(const map *a, const double X[3], manufactured_state *o) {
    const double lambda = a->kappa - 2 * a->mu / 3, trace = a->J - 1, warm = o->theta - a->theta_R;
    double square = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            const double e = a->s * (X[i] + X[j]) / 2;
            square += e * e;
            o->P[3 * i + j] = 2 * a->mu * e + (i == j ? lambda * trace - a->beta * warm : 0);
        }
        o->force[i] = -(lambda + 4 * a->mu) * a->s + (i == 0 ? a->beta * a->slope : 0);
    }
    o->source = a->c_v * a->theta_rate + o->theta * a->beta * a->J_rate - a->h * a->curvature;
    o->entropy = a->beta * trace + a->c_v * log(o->theta / a->theta_R);
    o->energy = lambda * trace * trace / 2 + a->mu * square + a->beta * a->theta_R * trace + a->c_v * warm;
}

/* U = zeta (J^(-2/3) F:F - 3) + gamma (J^-2 (H:H)^(3/2) - 3 sqrt 3) + k/2 (J - 1)^2 and its derivative by F,
   c F + b H + d M, with the gradients of c, b, d by X. */
typedef struct strain_law { double U, c, b, d, gc[3], gb[3], gd[3]; } strain_law;

static strain_law make_strain_law(const map *a, const double X[3]) {
    const double J = a->J, s = a->s, z = a->zeta, g = a->gamma;
    const double I1 = 3 + 2 * (J - 1) + 3 * s * s * a->r2, I2 = 3 * J * J - 2 * J * (J - 1) + 3 * s * s * a->r2;
    const double root = sqrt(I2), power = pow(J, -2.0 / 3), J2 = J * J;
    const double c2 = -2.0 / 3 * z * power * I1 / J - 2 * g * I2 * root / (J * J2) + a->k * (J - 1);
    const double c3 = 3 * g * root / J2; /* of (I2 H - M)/J */
    strain_law law;
    law.U = z * (power * I1 - 3) + g * (I2 * root / J2 - 3 * sqrt(3)) + a->k / 2 * (J - 1) * (J - 1);
    law.c = 2 * z * power;
    law.b = c2 + c3 * I2 / J;
    law.d = -c3 / J;
    for (int i = 0; i < 3; i++) {
        const double gI1 = 2 * s + 6 * s * s * X[i], gI2 = 6 * J * s - 2 * s * (2 * J - 1) + 6 * s * s * X[i];
        const double g2 = -2.0 / 3 * z * power / J * (gI1 - 5.0 / 3 * I1 / J * s) -
                          2 * g / (J * J2) * (1.5 * root * gI2 - 3 * I2 * root / J * s) + a->k * s;
        const double g3 = 3 * g / J2 * (gI2 / (2 * root) - 2 * root / J * s);
        law.gc[i] = -2.0 / 3 * law.c / J * s;
        law.gb[i] = g2 + (g3 * I2 + c3 * gI2) / J - c3 * I2 / J2 * s;
        law.gd[i] = -g3 / J + c3 / J2 * s;
    }
    return law;
}

/* P = r U_F + w H: MEE has r = theta/theta_R, w = -beta (theta - theta_R); Mie-Grueneisen r = 1,
   w = beta (theta_R - theta J^(q-1)). */
static void nonlinear_laws(const map *a, int entropic, const double X[3], manufactured_state *o) {
    const strain_law law = make_strain_law(a, X);
    const double *F = o->F, *H = o->H, warm = o->theta - a->theta_R, power = pow(a->J, a->q - 1);
    const double r = entropic ? o->theta / a->theta_R : 1;
    const double w = entropic ? -a->beta * warm : a->beta * (a->theta_R - o->theta * power);
    double U_rate = 0, entropy, entropy_rate, energy,
           div_Q = a->N[0][0] * a->curvature / a->J + a->divN[0] * a->slope / a->J;
    for (int i = 0; i < 3; i++) {
        double HdivN = 0, divergence;
        for (int k = 0; k < 3; k++) HdivN += H[3 * i + k] * a->divN[k];
        divergence = r * (law.c * 3 * a->s + law.d * HdivN);
        for (int j = 0; j < 3; j++) {
            const double U_F = law.c * F[3 * i + j] + law.b * H[3 * i + j] + law.d * a->M[i][j];
            const double heat = j == 0 ? a->slope : 0; /* grad theta */
            const double gw = entropic ? heat : heat * power + o->theta * (a->q - 1) * power / a->J * a->s;
            o->P[3 * i + j] = r * U_F + w * H[3 * i + j];
            U_rate += U_F * a->rate * X[j];
            divergence += r * (F[3 * i + j] * law.gc[j] + H[3 * i + j] * law.gb[j] + a->M[i][j] * law.gd[j]) -
                          a->beta * gw * H[3 * i + j] + (entropic ? U_F * heat / a->theta_R : 0);
        }
        o->force[i] = -divergence;
        div_Q -= a->s / (a->J * a->J) * a->N[i][0] * a->slope;
    }
    energy = a->beta * a->theta_R * (a->J - 1) + (entropic ? 0 : law.U); /* e_R, eta_R and its rate */
    entropy =
        a->beta * (fabs(a->q) > 1e-14 ? (pow(a->J, a->q) - 1) / a->q : log(a->J)) - (entropic ? law.U / a->theta_R : 0);
    entropy_rate = a->beta * power * a->J_rate - (entropic ? U_rate / a->theta_R : 0);
    o->source = o->theta * entropy_rate + a->c_v * a->theta_rate - a->h * div_Q;
    o->entropy = entropy + a->c_v * log(o->theta / a->theta_R);
    o->energy = energy + a->c_v * warm;
}

void manufactured_exact(const manufactured_parameters *p, const double X[3], double t, manufactured_state *out) {
    const map a = make_map(p, X, t, out);
    if (p->material.kind == TLSPH_LINEAR) linear_laws(&a, X, out);
    else nonlinear_laws(&a, p->material.kind == TLSPH_MEE, X, out);
    out->energy += a.rho * 3 * out->v[0] * out->v[0] / 2;
}

/* ---- scene ------------------------------------------------------------------------------------------------------- */

static void exact_at(const manufactured *cube, const tlsph_real *X, double t, manufactured_state *out) {
    const double place[3] = { (double)X[0], (double)X[1], (double)X[2] };
    manufactured_exact(&cube->parameters, place, t, out);
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    manufactured_state exact;
    exact_at(scene, X, 0, &exact);
    memcpy(state->v, exact.v, sizeof state->v);
    state->theta = exact.theta;
}

/* Callbacks of one kind each: velocity, temperature, body force, heat source. */
#define CALLBACK(name, components, prepare, value)                                                                     \
    static void name(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,         \
                     const tlsph_real *x, tlsph_real *values) {                                                        \
        manufactured *cube = user;                                                                                     \
        const double began = ex_cpu_seconds();                                                                         \
        (void)particle; (void)x; (void)time;                                                                           \
        for (size_t i = 0; i < count; i++) {                                                                           \
            const tlsph_real *at = X + 3 * i;                                                                          \
            prepare;                                                                                                   \
            for (size_t j = 0; j < components; j++) values[components * i + j] = (tlsph_real)(value);                  \
        }                                                                                                              \
        cube->load_seconds += ex_cpu_seconds() - began;                                                                \
    }
CALLBACK(exact_velocity, 3, const double r2 = (double)(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]),
         cube->parameters.rate * r2)
CALLBACK(exact_temperature, 1, const double place = (double)at[0],
         exact_temperature_at(&cube->parameters, place, (double)time))
CALLBACK(exact_force, 3, manufactured_state exact; exact_at(cube, at, (double)time, &exact), exact.force[j])
CALLBACK(exact_source, 1, manufactured_state exact; exact_at(cube, at, (double)time, &exact), exact.source)

/* Least distance from the faces of the cube, negative outside. */
static double depth_of(const tlsph_real X[3]) {
    double depth = HUGE_VAL;
    for (int i = 0; i < 3; i++) depth = fmin(depth, fmin((double)X[i], 1 - (double)X[i]));
    return depth;
}

/* The exact solution drives the outermost layers of the cloud, counted in spacings, and all particles in them. */
static int is_driven(void *user, const tlsph_real X[3]) {
    const manufactured_parameters *p = &((const manufactured *)user)->parameters;
    return depth_of(X) < (p->driven - p->layers - (p->centred ? 0 : 0.5)) / p->n;
}

/* Linear and driven at its faces alone: only where the exact solution lets heat through, as in the paper. */
static int is_held(void *user, const tlsph_real X[3]) {
    const manufactured_parameters *p = &((const manufactured *)user)->parameters;
    const double x = (double)X[0];
    if (p->material.kind != TLSPH_LINEAR || p->layers > 0 || p->centred) return is_driven(user, X);
    return fmin(x, 1 - x) < 1e-3 / p->n;
}

static int is_free(void *user, const tlsph_real X[3]) { return !is_driven(user, X); }

static void add_conditions(scene_setup *setup, manufactured *out) {
    tlsph_condition *c[4];
    c[0] = scene_add_where(setup, TLSPH_VELOCITY, is_driven, out);   c[0]->values = exact_velocity;
    c[1] = scene_add_where(setup, TLSPH_BODY_FORCE, is_free, out);  c[1]->values = exact_force;
    c[2] = scene_add_where(setup, TLSPH_TEMPERATURE, is_held, out); c[2]->values = exact_temperature;
    c[3] = scene_add(setup, TLSPH_HEAT_SOURCE);                     c[3]->values = exact_source;
    for (int i = 0; i < 4; i++) c[i]->values_user = out;
}

tlsph_result manufactured_create(const manufactured_parameters *p, manufactured *out, tlsph_error *error) {
    tlsph_fill fill = tlsph_fill_default(3);
    scene_options options = p->options;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    fill.spacing = (tlsph_real)(1.0 / p->n);
    for (int i = 0; i < 3; i++) {
        fill.origin[i] = (tlsph_real)(-(double)p->layers / p->n);
        fill.size[i] = (tlsph_real)(1 + 2.0 * p->layers / p->n);
    }
    fill.placement = p->centred ? TLSPH_CELL_CENTRED : TLSPH_ON_FACES;
    fill.jitter = (tlsph_real)p->jitter;
    if (p->jitter > 0) scene_options_cloud(&options, &fill);
    scene_begin(&setup, &fill, &p->material, error);
    add_conditions(&setup, out);
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

/* ---- errors ------------------------------------------------------------------------------------------------------ */

static double ratio(double error, double scale) { return scale > 0 ? sqrt(error / scale) : HUGE_VAL; }

/* Squares of errors and of exact values, for the components of p, P and for theta - theta_R, of all particles that are
   inside and not driven (which are exact without merit). */
static void add_squares(const manufactured *cube, double sum[13][2]) {
    const tlsph_particles *particles = &cube->body.cloud.particles;
    const double t = (double)tlsph_time(cube->body.solver),
                 theta_R = (double)cube->parameters.material.reference_temperature;
    tlsph_real *p = scene_read(cube->body.solver, TLSPH_FIELD_MOMENTUM);
    tlsph_real *P = scene_read(cube->body.solver, TLSPH_FIELD_STRESS);
    tlsph_real *theta = scene_read(cube->body.solver, TLSPH_FIELD_TEMPERATURE);
    for (size_t a = 0; p && P && theta && a < particles->count; a++) {
        const tlsph_real *X = particles->positions + 3 * a;
        manufactured_state exact;
        if (depth_of(X) < -1e-3 / cube->parameters.n || is_driven((void *)(size_t)cube, X)) continue;
        exact_at(cube, X, t, &exact);
        for (size_t i = 0; i < 13; i++) {
            const double is = (double)(i < 3    ? p[3 * a + i]
                                       : i < 12 ? P[9 * a + i - 3]
                                                : theta[a]) -
                              (i < 12 ? 0 : theta_R);
            const double should = i < 3 ? (double)cube->parameters.material.density * exact.v[i]
                                        : i < 12 ? exact.P[i - 3] : exact.theta - theta_R;
            sum[i][0] += (is - should) * (is - should);
            sum[i][1] += should * should;
        }
    }
    free(p); free(P); free(theta);
}

static void make_errors(double sum[13][2], manufactured_errors *out) {
    double all[4] = { 0 };
    for (int i = 0; i < 12; i++) for (int j = 0; j < 2; j++) all[(i < 3 ? 0 : 2) + j] += sum[i][j];
    out->p = ratio(all[0], all[1]);
    out->P = ratio(all[2], all[3]);
    out->theta = ratio(sum[12][0], sum[12][1]);
    for (int i = 0; i < 3; i++) out->p_each[i] = ratio(sum[i][0], sum[i][1]);
    for (int i = 0; i < 9; i++) out->P_each[i] = ratio(sum[3 + i][0], sum[3 + i][1]);
}

/* The steps shrink with the spacing even where the end comes before one stable step, so that one order is measured. */
tlsph_result manufactured_run(manufactured *cube, int instants, void (*step)(void *user), void *user,
                              manufactured_errors *out) {
    const double end = cube->parameters.options.end_time, largest = 4 * end / cube->parameters.n;
    tlsph_solver *solver = cube->body.solver;
    double sum[13][2] = { { 0 } };
    tlsph_result result = TLSPH_OK;
    for (int i = 1; i <= instants; i++) {
        const double until = end * i / instants;
        while (result == TLSPH_OK && until - (double)tlsph_time(solver) > 1e-10 * end) {
            result = tlsph_step(solver, (tlsph_real)fmin(largest, until - (double)tlsph_time(solver)));
            if (result == TLSPH_OK && step) step(user);
        }
        if (result == TLSPH_OK) add_squares(cube, sum);
    }
    make_errors(sum, out);
    return result;
}
