/*
standing_wave.c - coupled thermo-elastic standing wave in a bar (references/README, thermoelastic_standing_wave.csv)

  u = a e^{st} sin kX,  theta - theta_R = b e^{st} cos kX,  k = pi / L, rollers on all sides, insulated. The linear
  equations of momentum and heat,  rho u'' = M u_XX - beta theta_X  and  c_v theta' = h theta_XX - beta theta_R u'_X
  with beta = c_v Gamma_0 = 3 kappa alpha, give
      s^3 + D k^2 s^2 + c^2 k^2 (1 + delta) s + c^2 k^2 D k^2 = 0,   D = h / c_v,  c^2 = M / rho,
      b / a = -beta theta_R k s / (c_v s + h k^2).
*/
#include "scenes.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double complex pair(double re, double im) { return re + im * (double complex)I; }

void standing_wave_default(standing_wave_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.thermal = TLSPH_ENERGY;
    p->options.sharp = 1; /* the plain stencil makes the wave (kh)^2/6 too slow, 0.64 % at n = 32 */
    p->options.threads = 1; /* a few hundred particles: threads would wait for each other */
    p->dimension = 3;
    p->n = 32;
    p->across = 2;
    p->length = 1;
    p->delta = 0.2;
    p->amplitude = 1e-6; /* linear: strains of 3e-6 */
    p->periods = 2;
    p->conductivity = standing_wave_matched_conductivity(p);
}

double standing_wave_matched_conductivity(const standing_wave_parameters *p) {
    const tlsph_material m = scene_paper_material(TLSPH_LINEAR);
    double p_wave, bulk, shear;
    scene_moduli(&m, &p_wave, &bulk, &shear);
    return sqrt(p_wave / (double)m.density) * (double)(m.density * m.specific_heat) * p->length / SCENE_PI;
}

void standing_wave_mode(double k, double rho, double M, double c_v, double h, double T0, double delta, double s[2],
                        double ratio[2]) {
    const double ck2 = M / rho * k * k, diffusion = h / c_v * k * k, beta = sqrt(delta * c_v * M / T0);
    double complex root = pair(0, sqrt(ck2 * (1 + delta))); /* the wave without conduction */
    double complex b;
    for (int i = 0; i < 100; i++) { /* Newton */
        const double complex value = ((root + diffusion) * root + ck2 * (1 + delta)) * root + ck2 * diffusion;
        const double complex slope = (3 * root + 2 * diffusion) * root + ck2 * (1 + delta);
        const double complex change = value / slope;
        root -= change;
        if (cabs(change) <= 1e-15 * cabs(root)) break;
    }
    b = -beta * T0 * k * root / (c_v * root + h * k * k);
    s[0] = creal(root); s[1] = cimag(root);
    ratio[0] = creal(b); ratio[1] = cimag(b);
}

void standing_wave_exact(const standing_wave *wave, double X, double t, double *u, double *v, double *strain,
                         double *theta) {
    const double complex s = pair(wave->s[0], wave->s[1]), b = pair(wave->ratio[0], wave->ratio[1]);
    const double complex a = wave->parameters.amplitude * cexp(s * t);
    *u = creal(a) * sin(wave->k * X);
    *v = creal(s * a) * sin(wave->k * X);
    *strain = creal(a) * wave->k * cos(wave->k * X);
    *theta = creal(b * a) * cos(wave->k * X);
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    double u, strain, theta;
    standing_wave_exact(scene, (double)X[0], 0, &u, &state->v[0], &strain, &theta);
    state->x[0] += u;
    state->F[0] += strain;
    state->theta += theta;
}

static void find_mode(standing_wave *wave, const tlsph_material *m) {
    double p_wave, bulk, shear;
    scene_moduli(m, &p_wave, &bulk, &shear);
    wave->k = SCENE_PI / wave->parameters.length;
    standing_wave_mode(wave->k, (double)m->density, p_wave, (double)(m->density * m->specific_heat),
                       wave->parameters.conductivity, (double)m->reference_temperature, wave->parameters.delta,
                       wave->s, wave->ratio);
}

tlsph_result standing_wave_create(const standing_wave_parameters *p, standing_wave *out, tlsph_error *error) {
    const double spacing = 2 * p->length / p->n;
    tlsph_material material = scene_paper_material(TLSPH_LINEAR);
    tlsph_fill fill = tlsph_fill_default(p->dimension);
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.expansion = (tlsph_real)scene_expansion(&material, p->delta);
    material.conductivity = (tlsph_real)p->conductivity;
    find_mode(out, &material);
    fill.spacing = (tlsph_real)spacing;
    fill.size[0] = (tlsph_real)p->length;
    for (int i = 1; i < p->dimension; i++) fill.size[i] = (tlsph_real)(p->across * spacing);
    scene_begin(&setup, &fill, &material, error);
    for (int i = 0; i < p->dimension; i++) scene_add_rollers(&setup, i); /* insulated: their `conducts` is 0 */
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

double standing_wave_amplitude(const standing_wave *wave) {
    const tlsph_particles *particles = &wave->body.cloud.particles;
    tlsph_real *v = scene_read(wave->body.solver, TLSPH_FIELD_VELOCITY);
    double part = 0, norm = 0;
    if (!v) return 0;
    for (size_t i = 0; i < particles->count; i++) {
        const double shape = sin(wave->k * (double)particles->positions[3 * i]), V = (double)particles->volumes[i];
        part += V * shape * (double)v[3 * i];
        norm += V * shape * shape;
    }
    free(v);
    return part / norm;
}

void standing_wave_errors(const standing_wave *wave, double *error_u, double *error_theta) {
    const tlsph_particles *particles = &wave->body.cloud.particles;
    const double t = (double)tlsph_time(wave->body.solver), decay = exp(wave->s[0] * t);
    const double a = wave->parameters.amplitude * decay, b = a * hypot(wave->ratio[0], wave->ratio[1]);
    const double T0 = (double)wave->body.material.reference_temperature;
    tlsph_real *x = scene_read(wave->body.solver, TLSPH_FIELD_DISPLACEMENT);
    tlsph_real *T = scene_read(wave->body.solver, TLSPH_FIELD_TEMPERATURE);
    double sum_u = 0, sum_T = 0, volume = 0;
    for (size_t i = 0; x && T && i < particles->count; i++) {
        const double V = (double)particles->volumes[i];
        double u, v, strain, theta;
        standing_wave_exact(wave, (double)particles->positions[3 * i], t, &u, &v, &strain, &theta);
        sum_u += V * pow((double)x[3 * i] - u, 2);
        sum_T += V * pow((double)T[i] - T0 - theta, 2);
        volume += V / 2; /* the mean of sin^2 and cos^2 */
    }
    free(x); free(T);
    *error_u = volume > 0 ? sqrt(sum_u / volume) / a : HUGE_VAL;
    *error_theta = volume > 0 ? sqrt(sum_T / volume) / b : HUGE_VAL;
}

/* ---- frequency and damping --------------------------------------------------------------------------------------- */

/* Solves the 4x4 system m x = r by Gaussian elimination with pivoting; x comes in r. Returns 0 if it could. */
static int solve4(double m[4][4], double r[4]) {
    for (int i = 0; i < 4; i++) {
        int pivot = i;
        for (int j = i + 1; j < 4; j++) if (fabs(m[j][i]) > fabs(m[pivot][i])) pivot = j;
        if (!(fabs(m[pivot][i]) > 0)) return 1;
        for (int k = 0; k < 4; k++) { const double swap = m[i][k]; m[i][k] = m[pivot][k]; m[pivot][k] = swap; }
        { const double swap = r[i]; r[i] = r[pivot]; r[pivot] = swap; }
        for (int j = 0; j < 4; j++) {
            const double factor = j == i ? 0 : m[j][i] / m[i][i];
            for (int k = i; k < 4; k++) m[j][k] -= factor * m[i][k];
            r[j] -= factor * r[i];
        }
    }
    for (int i = 0; i < 4; i++) r[i] /= m[i][i];
    return 0;
}

/* y = e^{p0 t} (p2 cos p1 t + p3 sin p1 t): one Gauss-Newton step for the four, with t in units of 1/p1 of the start. */
static int fit_step(const double *t, const double *y, size_t count, double unit, double p[4]) {
    double normal[4][4] = { { 0 } }, right[4] = { 0 };
    for (size_t i = 0; i < count; i++) {
        const double x = t[i] * unit, e = exp(p[0] * x), c = e * cos(p[1] * x), s = e * sin(p[1] * x);
        const double f = p[2] * c + p[3] * s;
        const double slope[4] = { x * f, x * (p[3] * c - p[2] * s), c, s };
        for (int j = 0; j < 4; j++) {
            right[j] += slope[j] * (y[i] - f);
            for (int k = 0; k < 4; k++) normal[j][k] += slope[j] * slope[k];
        }
    }
    if (solve4(normal, right)) return 1;
    for (int j = 0; j < 4; j++) p[j] += right[j];
    return 0;
}

int standing_wave_fit(const double *t, const double *y, size_t count, double s[2]) {
    const double unit = s[1]; /* lengths of time near 1 keep the normal equations well conditioned */
    double p[4] = { s[0] / unit, 1, 0, 0 }, scale = 0;
    for (size_t i = 0; i < count; i++) scale = fmax(scale, fabs(y[i]));
    p[2] = scale / 10; p[3] = -scale;
    for (int i = 0; i < 50; i++) {
        const double before[2] = { p[0], p[1] };
        if (fit_step(t, y, count, unit, p)) return 1;
        if (fabs(p[0] - before[0]) + fabs(p[1] - before[1]) < 1e-13) {
            s[0] = p[0] * unit;
            s[1] = p[1] * unit;
            return 0;
        }
    }
    return 1;
}

typedef struct samples { double *t, *y; size_t count, capacity; } samples;

static int add_sample(samples *list, double t, double y) {
    if (list->count == list->capacity) {
        const size_t capacity = 2 * list->capacity + 256;
        double *times = realloc(list->t, capacity * sizeof *times), *values;
        if (!times) return 1;
        list->t = times;
        values = realloc(list->y, capacity * sizeof *values);
        if (!values) return 1;
        list->y = values;
        list->capacity = capacity;
    }
    list->t[list->count] = t;
    list->y[list->count++] = y;
    return 0;
}

double standing_wave_end(const standing_wave *wave) {
    const double end = wave->parameters.periods * 2 * SCENE_PI / wave->s[1], limit = wave->parameters.options.end_time;
    return limit > 0 ? fmin(end, limit) : end;
}

tlsph_result standing_wave_measure(standing_wave *wave, double s[2], void (*step)(void *user), void *user) {
    const double end = standing_wave_end(wave);
    tlsph_solver *solver = wave->body.solver;
    samples list = { NULL, NULL, 0, 0 };
    tlsph_result result = TLSPH_OK;
    int bad = add_sample(&list, (double)tlsph_time(solver), standing_wave_amplitude(wave));
    while (result == TLSPH_OK && !bad && (double)tlsph_time(solver) < end) {
        result = tlsph_step(solver, (tlsph_real)end);
        bad = add_sample(&list, (double)tlsph_time(solver), standing_wave_amplitude(wave));
        if (step) step(user);
    }
    s[0] = wave->s[0];
    s[1] = wave->s[1];
    if (result == TLSPH_OK && (bad || standing_wave_fit(list.t, list.y, list.count, s))) result = TLSPH_ERROR_NOT_FINITE;
    free(list.t); free(list.y);
    return result;
}
