/*
satellite.c - truncated cone with four arms, set spinning and left alone: 001 section 7.1.2

Radius 4 m at the base, 2 m at the top, 3 m high; arms of 1 m x 1 m reach to 6.5 m from the axis. The paper gives no
height of the arms: they are at half height here. The cone is made of the lattice's cells, steps included.
*/
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double base_radius = 4, top_radius = 2, height = 3, reach = 6.5, half_width = 0.5; /* m */

static int inside(void *user, const tlsph_real X[3]) {
    const double x = (double)X[0], y = (double)X[1], z = (double)X[2];
    const double radius = base_radius + (top_radius - base_radius) * z / height;
    const int low = fabs(z - height / 2) < half_width;
    (void)user;
    return x * x + y * y < radius * radius * (1 - 1e-6) || /* ties fall on the same side in all quadrants */
           (low && (fabs(x) < half_width || fabs(y) < half_width));
}

static void spin(const void *scene, const tlsph_real X[3], scene_state *state) {
    const satellite *s = scene; /* about the centre of mass (001-59) */
    state->v[0] = -s->parameters.spin * ((double)X[1] - s->centre[1]);
    state->v[1] = s->parameters.spin * ((double)X[0] - s->centre[0]);
}

void satellite_default(satellite_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.operator_kind = TLSPH_CELLS;
    p->options.integrator = TLSPH_RK3_FROZEN;
    p->options.cfl = 0.5;
    p->options.end_time = 12;
    p->spacing = 1. / 3;
    p->spin = 1;
}

tlsph_result satellite_create(const satellite_parameters *p, satellite *out, tlsph_error *error) {
    tlsph_material material = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    tlsph_fill fill = tlsph_fill_default(3);
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    material.density = 1000;
    material.young = 50050; /* the captions have 50046 */
    material.poisson = (tlsph_real)0.3;
    fill.shape = TLSPH_PREDICATE;
    fill.inside = inside;
    fill.spacing = (tlsph_real)p->spacing;
    fill.size[0] = fill.size[1] = (tlsph_real)(2 * reach);
    fill.size[2] = (tlsph_real)height;
    fill.origin[0] = fill.origin[1] = (tlsph_real)-reach;
    scene_begin(&setup, &fill, &material, error);
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) {
        tlsph_ledger ledger;
        tlsph_ledger_read(out->body.solver, &ledger);
        memcpy(out->centre, ledger.centre, sizeof out->centre);
        result = scene_set_state(&out->body, out, spin);
    }
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

/* ---- figure 9 ----------------------------------------------------------------------------------------------------- */

typedef struct fields { tlsph_real *X, *v, *F, *P, *c_p, *c_s; tlsph_pair_side *side; } fields;

static tlsph_pair_side make_side(const tlsph_operator *o, const fields *f, size_t a) {
    tlsph_pair_side side;
    const size_t h = o->host[a];
    memset(&side, 0, sizeof side);
    side.density = 1000;
    side.c_p = f->c_p[h];
    side.c_s = f->c_s[h];
    for (size_t i = 0; i < 3; i++) side.velocity[i] = f->v[3 * h + i];
    for (size_t k = o->first[a]; k < o->first[a + 1]; k++)
        for (size_t i = 0; i < 9; i++)
            side.velocity_gradient[i] += (f->v[3 * o->host[o->neighbours[k]] + i / 3] - f->v[3 * h + i / 3]) *
                                         o->vectors[3 * k + i % 3] / (2 * o->volumes[a]);
    return side;
}

/* Force of pair k, which belongs to a: stresses into T, dissipation into D. */
static void pair_force(const tlsph_operator *o, const fields *f, size_t a, size_t k, tlsph_real T[3], tlsph_real D[3]) {
    const size_t b = o->neighbours[k], p = o->host[a], q = o->host[b];
    const tlsph_real *C = o->vectors + 3 * k;
    tlsph_real H_a[9], H_b[9], c[3], d[3];
    tlsph_pair_flux flux;
    tlsph_cofactor(f->F + 9 * p, H_a);
    tlsph_cofactor(f->F + 9 * q, H_b);
    for (size_t i = 0; i < 3; i++) {
        T[i] = c[i] = 0;
        d[i] = f->X[3 * q + i] - f->X[3 * p + i];
        for (size_t j = 0; j < 3; j++) {
            T[i] += (f->P[9 * p + 3 * i + j] + f->P[9 * q + 3 * i + j]) * C[j] / 2;
            c[i] += (H_a[3 * i + j] + H_b[3 * i + j]) * C[j] / 2;
        }
    }
    tlsph_pair_dissipation(TLSPH_LIMITED, &f->side[a], &f->side[b], C, c, d, 0, &flux);
    memcpy(D, flux.D_p, sizeof flux.D_p);
}

tlsph_result satellite_resultants(const satellite *s, double force[3], double dissipation[3], double size[2]) {
    const tlsph_solver *solver = s->body.solver;
    fields f = { scene_read(solver, TLSPH_FIELD_REFERENCE_POSITION), scene_read(solver, TLSPH_FIELD_VELOCITY),
                 scene_read(solver, TLSPH_FIELD_F), scene_read(solver, TLSPH_FIELD_STRESS),
                 scene_read(solver, TLSPH_FIELD_P_WAVE_SPEED), scene_read(solver, TLSPH_FIELD_S_WAVE_SPEED), NULL };
    tlsph_operator o;
    tlsph_operator_view(solver, &o);
    f.side = malloc(o.count * sizeof *f.side);
    const int ready = f.X && f.v && f.F && f.P && f.c_p && f.c_s && f.side && !o.corrected;
    memset(force, 0, 3 * sizeof *force);
    memset(dissipation, 0, 3 * sizeof *dissipation);
    size[0] = size[1] = 0;
    for (size_t a = 0; ready && a < o.count; a++) f.side[a] = make_side(&o, &f, a);
    for (size_t a = 0; ready && a < o.count; a++)
        for (size_t k = o.first[a]; k < o.first[a + 1]; k++) {
            tlsph_real T[3], D[3];
            pair_force(&o, &f, a, k, T, D);
            for (int i = 0; i < 3; i++) {
                force[i] += (double)T[i];
                dissipation[i] += (double)D[i];
                size[0] += fabs((double)T[i]);
                size[1] += fabs((double)D[i]);
            }
        }
    free(f.X); free(f.v); free(f.F); free(f.P); free(f.c_p); free(f.c_s); free(f.side);
    return ready ? TLSPH_OK : o.corrected ? TLSPH_ERROR_ARGUMENT : TLSPH_ERROR_MEMORY;
}
