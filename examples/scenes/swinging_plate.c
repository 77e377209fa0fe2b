/* swinging_plate.c - plane strain plate in a divergence-free mode: 002 section 5.1, references/README */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void swinging_plate_default(swinging_plate_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->n = 20;
    p->amplitude = 0.01; /* (42): the paper gives m/s, but U is a length */
    p->young = 17e6; p->poisson = 0.495; p->density = 1100;
    p->linear = 1;       /* a neo-Hookean plate differs from the formula by 1.6e-3 (u) to 2.7e-2 (P_11) */
}

void swinging_plate_exact(const swinging_plate *p, const tlsph_real X[3], double t, double u[3], double v[3],
                          double F[9], double P[9]) {
    const double q = SCENE_PI / 2, A = p->parameters.amplitude, U = A * sin(p->omega * t);
    const double rate = A * p->omega * cos(p->omega * t);
    const double sx = sin(q * (double)X[0]), cx = cos(q * (double)X[0]), sy = sin(q * (double)X[1]),
                 cy = cos(q * (double)X[1]);
    const double shape[3] = { -sx * cy, cx * sy, 0 };
    const double slope[9] = { -q * cx * cy, q * sx * sy, 0, -q * sx * sy, q * cx * cy, 0, 0, 0, 0 };
    for (int i = 0; i < 3; i++) { u[i] = U * shape[i]; v[i] = rate * shape[i]; }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            F[3 * i + j] = (i == j) + U * slope[3 * i + j];
            P[3 * i + j] = p->shear * U * (slope[3 * i + j] + slope[3 * j + i]); /* no trace */
        }
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    double u[3], P[9];
    swinging_plate_exact(scene, X, 0, u, state->v, state->F, P);
}

tlsph_result swinging_plate_create(const swinging_plate_parameters *p, swinging_plate *out, tlsph_error *error) {
    tlsph_material material = tlsph_material_default(p->linear ? TLSPH_LINEAR : TLSPH_NEO_HOOKEAN);
    tlsph_fill fill = tlsph_fill_default(2);
    double p_wave, bulk;
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.young = (tlsph_real)p->young;
    material.poisson = (tlsph_real)p->poisson;
    material.density = (tlsph_real)p->density;
    scene_moduli(&material, &p_wave, &bulk, &out->shear);
    out->omega = SCENE_PI / 2 * sqrt(2 * out->shear / p->density); /* (43) */
    fill.size[0] = fill.size[1] = 2;
    fill.spacing = (tlsph_real)(2.0 / p->n);
    scene_begin(&setup, &fill, &material, error);
    for (int axis = 0; axis < 2; axis++) scene_add_rollers(&setup, axis);
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

/* ---- the interpolation that the kernels make of the particles' displacements, at any place ------------------------ */

static int is_zeroth(const swinging_plate *plate) {
    return plate->parameters.options.operator_kind == (int)TLSPH_ZEROTH_KERNEL ||
           plate->parameters.options.operator_kind == (int)TLSPH_ZEROTH_BOND;
}

/* Corrected kernels about x: first order solves for 1, d_x, d_y; zeroth order divides by the sum. out: displacement and
   reference position as the kernels see them. */
static void interpolate(const swinging_plate *plate, const double *u, const double x[2], double out[4]) {
    const tlsph_particles *particles = &plate->body.cloud.particles;
    const double d = 2.0 / plate->parameters.n, h = d * plate->parameters.options.support;
    const int side = plate->parameters.n + 1, reach = (int)(2 * h / d) + 1;
    const int i0 = (int)(x[0] / d), j0 = (int)(x[1] / d);
    double m[6] = { 0 }, b[3][4] = { { 0 } };
    for (int j = j0 - reach; j <= j0 + reach + 1; j++)
        for (int i = i0 - reach; i <= i0 + reach + 1; i++) {
            if (i < 0 || j < 0 || i >= side || j >= side) continue;
            const size_t a = (size_t)j * (size_t)side + (size_t)i;
            const double dx = (double)particles->positions[3 * a] - x[0], dy = (double)particles->positions[3 * a + 1] - x[1];
            tlsph_real W, slope;
            tlsph_kernel_evaluate((tlsph_kernel)plate->parameters.options.kernel, 2, (tlsph_real)sqrt(dx * dx + dy * dy),
                                  (tlsph_real)h, &W, &slope);
            const double w = (double)W, base[3] = { 1, dx, dy };
            m[0] += w; m[1] += w * dx; m[2] += w * dy; m[3] += w * dx * dx; m[4] += w * dx * dy; m[5] += w * dy * dy;
            const double values[4] = { u[3 * a], u[3 * a + 1], x[0] + dx, x[1] + dy };
            for (int k = 0; k < 12; k++) b[k / 4][k % 4] += w * base[k / 4] * values[k % 4];
        }
    for (int c = 0; c < 4; c++) out[c] = b[0][c] / m[0];
    if (is_zeroth(plate)) return;
    /* first row of the inverse of the moment matrix */
    const double r0 = m[3] * m[5] - m[4] * m[4], r1 = m[2] * m[4] - m[1] * m[5], r2 = m[1] * m[4] - m[2] * m[3];
    const double det = m[0] * r0 + m[1] * r1 + m[2] * r2;
    for (int c = 0; c < 4; c++) out[c] = (r0 * b[0][c] + r1 * b[1][c] + r2 * b[2][c]) / det;
}

/* du/dX at x by central differences; zeroth order with the corrected gradient (002-11). */
static void interpolated_gradient(const swinging_plate *plate, const double *u, const double x[2], double out[4]) {
    const double step = 1e-6;
    double G[4], M[4], up[4], down[4];
    for (int axis = 0; axis < 2; axis++) {
        double shifted[2] = { x[0], x[1] };
        shifted[axis] += step;
        interpolate(plate, u, shifted, up);
        shifted[axis] -= 2 * step;
        interpolate(plate, u, shifted, down);
        for (int c = 0; c < 2; c++) {
            G[2 * c + axis] = (up[c] - down[c]) / (2 * step);
            M[2 * c + axis] = (up[2 + c] - down[2 + c]) / (2 * step);
        }
    }
    const double det = M[0] * M[3] - M[1] * M[2]; /* M is I for the first order */
    for (int c = 0; c < 2; c++) {
        out[2 * c] = (G[2 * c] * M[3] - G[2 * c + 1] * M[2]) / det;
        out[2 * c + 1] = (G[2 * c + 1] * M[0] - G[2 * c] * M[1]) / det;
    }
}

static void gauss_errors(const swinging_plate *plate, const double *u, double t, double sum[2][2]) {
    static const double x5[5] = { -0.906179845938664, -0.538469310105683, 0, 0.538469310105683, 0.906179845938664 };
    static const double w5[5] = { 0.236926885056189, 0.478628670499366, 0.568888888888889, 0.478628670499366, 0.236926885056189 };
    const double tile = 0.2;
    for (int point = 0; point < 2500; point++) {
        const int gx = point % 5, gy = point / 5 % 5, i = point / 25 % 10, j = point / 250;
        const double x[2] = { tile * (i + 0.5 + 0.5 * x5[gx]), tile * (j + 0.5 + 0.5 * x5[gy]) };
        const double weight = w5[gx] * w5[gy];
        const tlsph_real X[3] = { (tlsph_real)x[0], (tlsph_real)x[1], 0 };
        double exact[3], v[3], F[9], P[9], here[4], G[4];
        swinging_plate_exact(plate, X, t, exact, v, F, P);
        interpolate(plate, u, x, here);
        for (int c = 0; c < 2; c++) {
            sum[0][0] += weight * pow(here[c] - exact[c], 2);
            sum[0][1] += weight * exact[c] * exact[c];
        }
        interpolated_gradient(plate, u, x, G);
        for (int k = 0; k < 4; k++) {
            const double slope = F[3 * (k / 2) + k % 2] - (k % 3 == 0);
            sum[1][0] += weight * pow(G[k] - slope, 2);
            sum[1][1] += weight * slope * slope;
        }
    }
}

/* Adds the squares of value - exact and of the exact values, less `unit` on the diagonal of tensors. */
static void add_squares(const tlsph_real *value, const double *exact, int count, double unit, double weight, double sum[2]) {
    for (int i = 0; value && i < count; i++) {
        sum[0] += weight * pow((double)value[i] - exact[i], 2);
        sum[1] += weight * pow(exact[i] - (i % 4 == 0 ? unit : 0), 2);
    }
}

void swinging_plate_errors(const swinging_plate *plate, int integrals, plate_errors *errors) {
    static const tlsph_field fields[4] = { TLSPH_FIELD_DISPLACEMENT, TLSPH_FIELD_F, TLSPH_FIELD_VELOCITY, TLSPH_FIELD_STRESS };
    const tlsph_particles *particles = &plate->body.cloud.particles;
    const double t = (double)tlsph_time(plate->body.solver);
    double *u = malloc(6 * particles->count * sizeof *u), sums[8][2] = { { 0 } }, out[8];
    double *exact_u = u ? u + 3 * particles->count : NULL;
    tlsph_real *read[4];
    for (int f = 0; f < 4; f++) read[f] = scene_read(plate->body.solver, fields[f]);
    for (size_t a = 0; a < particles->count; a++) {
        double exact[3], v[3], F[9], P[9];
        swinging_plate_exact(plate, particles->positions + 3 * a, t, exact, v, F, P);
        const double *const values[4] = { exact, F, v, P }, volume = (double)particles->volumes[a];
        for (int f = 0; f < 4; f++) {
            const int count = f % 2 ? 9 : 3;
            add_squares(read[f] ? read[f] + (size_t)count * a : NULL, values[f], count, f == 1, volume, sums[2 + f]);
        }
        for (int i = 0; u && read[0] && i < 3; i++) {
            u[3 * a + (size_t)i] = (double)read[0][3 * a + (size_t)i];
            exact_u[3 * a + (size_t)i] = exact[i];
        }
    }
    if (integrals && u && read[0]) {
        gauss_errors(plate, u, t, sums);
        gauss_errors(plate, exact_u, t, sums + 6);
    }
    for (int i = 0; i < 8; i++) out[i] = sums[i][1] > 0 ? sqrt(sums[i][0] / sums[i][1]) : HUGE_VAL;
    const plate_errors all = { out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7] };
    *errors = all;
    for (int f = 0; f < 4; f++) free(read[f]);
    free(u);
}
