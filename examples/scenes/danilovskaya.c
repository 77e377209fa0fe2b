/*
danilovskaya.c - the half space of Danilovskaya, Sternberg and Chakravorty as a bar between rollers (003 section 9)

Constants of 003, table 1: rho, c_p, beta and lambda + 2 mu of steel; nu = 0.3 is ours, in uniaxial strain it cannot be
seen. T0 follows from delta by 003 (10). The conduction length a = kappa/c_s of steel is 0.9 nm; since dimensionless
numbers alone matter, the conductivity is raised until a = 1 m, so that positions in files and pictures are y itself.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DENSITY 7820.0
#define SPECIFIC_HEAT 461.0
#define BETA 3.34e6     /* thermal stress modulus, Pa/K */
#define P_WAVE 1.99e11  /* lambda + 2 mu, Pa */
#define POISSON 0.3
#define LEAST_DELTA 1e-6 /* where thermal stress exists, so does its work: delta = 0 contradicts the first law */

void danilovskaya_default(danilovskaya_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.thermal = TLSPH_ENERGY;
    p->options.threads = 1; /* a few hundred particles: threads would wait for each other */
    p->options.conduction_stages = 9; /* steps of sound instead of h^2: ten times as fast, the same errors */
    p->options.sharp = 1; /* half the dispersion error and half the overshoot at the front */
    p->problem = DANILOVSKAYA_FIRST;
    p->delta = 1;
    p->spacing = 0.05;
    p->length = 8;
    p->across = 1;
    p->dimension = 3;
    p->load = 1e-5;
    p->rise = 3;
    p->material = TLSPH_LINEAR;
}

static tlsph_material make_material(const danilovskaya_parameters *p, danilovskaya *out) {
    const double delta = fmax(p->delta, LEAST_DELTA), speed = sqrt(P_WAVE / DENSITY), c_v = DENSITY * SPECIFIC_HEAT;
    const double T0 = delta * c_v * P_WAVE / (BETA * BETA), bulk = P_WAVE * (1 + POISSON) / (3 * (1 - POISSON));
    tlsph_material m = tlsph_material_default((tlsph_material_kind)p->material);
    out->length_unit = 1;
    out->time_unit = out->length_unit / speed;
    out->theta_unit = fmin(p->load / delta, 0.1) * T0;
    out->stress_unit = BETA * out->theta_unit;
    out->u_unit = out->length_unit * out->stress_unit / P_WAVE;
    m.density = (tlsph_real)DENSITY;
    m.young = (tlsph_real)(3 * bulk * (1 - 2 * POISSON));
    m.poisson = (tlsph_real)POISSON;
    m.expansion = (tlsph_real)(BETA / (3 * bulk));
    m.specific_heat = (tlsph_real)SPECIFIC_HEAT;
    m.conductivity = (tlsph_real)(c_v * speed * out->length_unit);
    m.reference_temperature = (tlsph_real)T0;
    out->T0 = (double)m.reference_temperature;
    out->flux_unit = c_v * speed * out->theta_unit;
    return m;
}

static void ramp_temperature(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                             const tlsph_real *x, tlsph_real *values) {
    const danilovskaya *bar = user;
    const double length = bar->ramp * bar->time_unit;
    const double share = (double)time < length ? (double)time / length : 1;
    (void)particle; (void)X; (void)x;
    for (size_t i = 0; i < count; i++) values[i] = (tlsph_real)(bar->T0 + share * bar->theta_unit);
}

/* The surface's temperature is that of the step's beginning, carried on with its last rate. */
static void surface_flux(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                         const tlsph_real *x, tlsph_real *values) {
    const danilovskaya *bar = user;
    const double since = (double)time / bar->time_unit + bar->start - bar->surface_time;
    const double theta = bar->surface + bar->surface_rate * since;
    const double flux = DANILOVSKAYA_TRANSFER * (1 - theta) * bar->flux_unit;
    (void)particle; (void)X; (void)x;
    for (size_t i = 0; i < count; i++) values[i] = (tlsph_real)-flux;
}

static void heat_surface(scene_setup *setup, danilovskaya *out, double area) {
    const int flux = out->parameters.problem == DANILOVSKAYA_SECOND;
    tlsph_condition *c = scene_add_plane(setup, flux ? TLSPH_HEAT_FLUX : TLSPH_TEMPERATURE, 0, 0);
    c->value[0] = setup->body.material.reference_temperature + (tlsph_real)out->theta_unit;
    if (out->parameters.problem == DANILOVSKAYA_FIRST) {
        out->ramp = out->parameters.rise * out->parameters.spacing;
        out->start = -out->ramp / 2;
    } else {
        out->ramp = DANILOVSKAYA_RAMP;
    }
    c->values = flux ? surface_flux : ramp_temperature;
    c->values_user = out;
    if (flux) scene_share_area(setup, c, area);
}

/* The energy sum over inner sections f/(24 h) M A q^2, q = u_i-1 - 2 u_i + u_i+1, is that of the strain's gradient in
   003 (34) with M_L = h^3/12; its force needs the positions only. u is odd across the roller at the far end, where q = 0;
   at the free end the half cell has no second difference of its own. */
static void stabilise(void *user, tlsph_real time, size_t count, const uint32_t *particle, const tlsph_real *X,
                      const tlsph_real *x, tlsph_real *values) {
    danilovskaya *bar = user;
    double *u = bar->displacement, *q = u + bar->cells + 1;
    const double h = bar->parameters.length * bar->length_unit / (double)bar->cells;
    const double stiffness = bar->parameters.nsni * P_WAVE / (12 * h * h);
    (void)time; (void)particle;
    for (size_t a = 0; a < count; a++)
        u[(size_t)((double)X[3 * a] / h + 0.5)] = (double)x[3 * a] - (double)X[3 * a]; /* equal across the bar */
    for (size_t i = 1; i < bar->cells; i++) q[i] = u[i - 1] - 2 * u[i] + u[i + 1];
    q[0] = q[bar->cells] = 0;
    for (size_t a = 0; a < count; a++) {
        const size_t i = (size_t)((double)X[3 * a] / h + 0.5);
        const double before = i ? q[i - 1] : 0, after = i < bar->cells ? q[i + 1] : -q[i - 1];
        const double share = i == 0 || i == bar->cells ? 2 : 1; /* the end sections hold half a cell */
        values[3 * a] = (tlsph_real)(-stiffness * share * (before - 2 * q[i] + after));
        values[3 * a + 1] = values[3 * a + 2] = 0;
    }
}
/* Largest frequency, omega^2 h^2 = 4 z - (4 - 4f/3) z^2 over 0 <= z <= 1, against 1 of the plain stencil. */
double danilovskaya_nsni_frequency(double f) {
    const double middle = f < 1.5 ? 1 / (2 - 2 * f / 3) : 1;
    return sqrt(4 * middle - (4 - 4 * f / 3) * middle * middle);
}
static tlsph_result add_stabilisation(scene_setup *setup, danilovskaya *out, scene_options *options) {
    tlsph_condition *c;
    if (!(out->parameters.nsni > 0)) return TLSPH_OK;
    out->cells = (size_t)(out->parameters.length / out->parameters.spacing + 0.5);
    out->displacement = calloc(2 * (out->cells + 1), sizeof *out->displacement);
    if (!out->displacement) return TLSPH_ERROR_MEMORY;
    c = scene_add(setup, TLSPH_BODY_FORCE);
    c->values = stabilise;
    c->values_user = out;
    options->sharp = 0;
    options->cfl /= danilovskaya_nsni_frequency(out->parameters.nsni);
    return TLSPH_OK;
}

static int by_position(const void *a, const void *b) {
    const double *p = a, *q = b;
    return (p[0] > q[0]) - (p[0] < q[0]);
}

/* The particles on the edge Y = Z = 0. */
static tlsph_result find_line(danilovskaya *bar) {
    const tlsph_particles *particles = &bar->body.cloud.particles;
    const double close = 1e-3 * (double)bar->body.cloud.cell_size[0];
    double *order = malloc(2 * particles->count * sizeof *order);
    size_t count = 0;
    bar->line = malloc(particles->count * sizeof *bar->line);
    for (size_t i = 0; order && i < particles->count; i++) {
        const tlsph_real *X = particles->positions + 3 * i;
        if (fabs((double)X[1]) > close || fabs((double)X[2]) > close) continue;
        order[2 * count] = (double)X[0];
        order[2 * count++ + 1] = (double)i;
    }
    if (order && bar->line) {
        qsort(order, count, 2 * sizeof *order, by_position);
        for (size_t i = 0; i < count; i++) bar->line[i] = (size_t)order[2 * i + 1];
        bar->sections = count;
    }
    free(order);
    return bar->sections ? TLSPH_OK : TLSPH_ERROR_MEMORY;
}

tlsph_result danilovskaya_create(const danilovskaya_parameters *p, danilovskaya *out, tlsph_error *error) {
    tlsph_fill fill = tlsph_fill_default(p->dimension);
    scene_setup setup;
    tlsph_material material;
    tlsph_result result;
    scene_options options = p->options;
    double width, area = 1;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material = make_material(p, out);
    width = p->across * p->spacing * out->length_unit;
    fill.spacing = (tlsph_real)(p->spacing * out->length_unit);
    fill.size[0] = (tlsph_real)(p->length * out->length_unit);
    for (int i = 1; i < p->dimension; i++) { fill.size[i] = (tlsph_real)width; area *= width; }
    scene_begin(&setup, &fill, &material, error);
    for (int i = 1; i < p->dimension; i++) scene_add_rollers(&setup, i); /* insulated: their `conducts` is 0 */
    scene_add_plane(&setup, TLSPH_ROLLER, 0, p->length * out->length_unit);
    heat_surface(&setup, out, area);
    if (setup.result == TLSPH_OK) setup.result = add_stabilisation(&setup, out, &options);
    result = scene_end(&setup, &options, &out->body, error);
    if (result == TLSPH_OK) result = find_line(out);
    if (result != TLSPH_OK) danilovskaya_destroy(out);
    return result;
}

void danilovskaya_destroy(danilovskaya *bar) {
    free(bar->line);
    free(bar->displacement);
    bar->line = NULL;
    bar->displacement = NULL;
    scene_destroy(&bar->body);
}

double danilovskaya_time(const danilovskaya *bar) {
    return (double)tlsph_time(bar->body.solver) / bar->time_unit + bar->start;
}

static void look_at_surface(danilovskaya *bar) {
    tlsph_real *theta = scene_read(bar->body.solver, TLSPH_FIELD_TEMPERATURE);
    if (theta) {
        const double now = ((double)theta[bar->line[0]] - bar->T0) / bar->theta_unit, t = danilovskaya_time(bar);
        bar->surface_rate = t > bar->surface_time ? (now - bar->surface) / (t - bar->surface_time) : 0;
        bar->surface = now;
        bar->surface_time = t;
    }
    free(theta);
}

tlsph_result danilovskaya_advance(danilovskaya *bar, double t) {
    const tlsph_real end = (tlsph_real)((t - bar->start) * bar->time_unit);
    tlsph_result result = TLSPH_OK;
    if (bar->parameters.problem != DANILOVSKAYA_SECOND) return tlsph_advance(bar->body.solver, end);
    while (result == TLSPH_OK && tlsph_time(bar->body.solver) < end) {
        const tlsph_real left = end - tlsph_time(bar->body.solver), stable = tlsph_stable_time_step(bar->body.solver);
        look_at_surface(bar);
        if (left <= stable) return tlsph_advance(bar->body.solver, end);
        result = tlsph_step(bar->body.solver, left);
    }
    return result;
}

int danilovskaya_profile(const danilovskaya *bar, double *y, danilovskaya_state *state) {
    tlsph_real *T = scene_read(bar->body.solver, TLSPH_FIELD_TEMPERATURE);
    tlsph_real *x = scene_read(bar->body.solver, TLSPH_FIELD_DISPLACEMENT);
    tlsph_real *P = scene_read(bar->body.solver, TLSPH_FIELD_STRESS);
    const int bad = !T || !x || !P;
    for (size_t i = 0; !bad && i < bar->sections; i++) {
        const size_t a = bar->line[i];
        y[i] = (double)bar->body.cloud.particles.positions[3 * a] / bar->length_unit;
        state[i].theta = ((double)T[a] - bar->T0) / bar->theta_unit;
        state[i].u = (double)x[3 * a] / bar->u_unit;
        state[i].sigma = (double)P[9 * a] / bar->stress_unit;
    }
    free(T); free(x); free(P);
    return bad;
}

danilovskaya_state danilovskaya_at(size_t count, const double *y, const danilovskaya_state *state, double where) {
    danilovskaya_state out;
    size_t i = 1;
    double share;
    while (i + 1 < count && y[i] < where) i++;
    share = (where - y[i - 1]) / (y[i] - y[i - 1]);
    out.theta = (1 - share) * state[i - 1].theta + share * state[i].theta;
    out.u = (1 - share) * state[i - 1].u + share * state[i].u;
    out.sigma = (1 - share) * state[i - 1].sigma + share * state[i].sigma;
    return out;
}

/* Behind the front the stress falls from its exact crest, before it, it falls to its exact trough: beyond these. */
static double overshoot(const danilovskaya *bar, const double *y, const danilovskaya_state *state, double t) {
    const danilovskaya_parameters *p = &bar->parameters;
    const danilovskaya_problem problem = (danilovskaya_problem)p->problem;
    const double crest = danilovskaya_exact(problem, p->delta, t * (1 - 1e-9), t).sigma;
    const double trough = danilovskaya_exact(problem, p->delta, t * (1 + 1e-9), t).sigma;
    double most = 0;
    if (problem != DANILOVSKAYA_FIRST) return 0;
    for (size_t i = 0; i < bar->sections; i++) {
        if (fabs(y[i] - t) > 0.5) continue;
        most = fmax(most, state[i].sigma - fmax(crest, danilovskaya_exact(problem, p->delta, y[i], t).sigma));
        most = fmax(most, fmin(trough, danilovskaya_exact(problem, p->delta, y[i], t).sigma) - state[i].sigma);
    }
    return most / (crest - trough);
}

int danilovskaya_compare(const danilovskaya *bar, danilovskaya_errors *errors) {
    const danilovskaya_problem problem = (danilovskaya_problem)bar->parameters.problem;
    const double t = danilovskaya_time(bar);
    double *y = malloc(bar->sections * sizeof *y), sum[3] = { 0, 0, 0 }, norm[3] = { 0, 0, 0 };
    danilovskaya_state *state = malloc(bar->sections * sizeof *state);
    const int bad = !y || !state || danilovskaya_profile(bar, y, state);
    memset(errors, 0, sizeof *errors);
    for (size_t i = 0; !bad && i < bar->sections; i++) {
        const danilovskaya_state e = danilovskaya_exact(problem, bar->parameters.delta, y[i], t);
        const double weight = i == 0 || i + 1 == bar->sections ? 0.5 : 1;
        sum[0] += weight * pow(state[i].theta - e.theta, 2);
        sum[1] += weight * pow(state[i].u - e.u, 2);
        sum[2] += weight * pow(state[i].sigma - e.sigma, 2);
        norm[0] += weight * e.theta * e.theta;
        norm[1] += weight * e.u * e.u;
        norm[2] += weight * e.sigma * e.sigma;
    }
    if (!bad) {
        errors->theta = sqrt(sum[0] / norm[0]);
        errors->u = sqrt(sum[1] / norm[1]);
        errors->sigma = sqrt(sum[2] / norm[2]);
        errors->overshoot = overshoot(bar, y, state, t);
    }
    free(y); free(state);
    return bad;
}
