/* impact.c - two halves of a bar that run into each other, in uniaxial strain: riemann_star_states.csv. */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void impact_default(impact_parameters *p) {
    memset(p, 0, sizeof *p);
    scene_options_default(&p->options);
    p->options.thermal = TLSPH_ENERGY; /* entropy is not conserved through a shock, energy is */
    p->options.end_time = 0.04;        /* the shocks are at +-0.34 m then, the free ends still unaware */
    p->options.threads = 1;            /* some thousand particles */
    p->n = 200;
    p->across = 2;
    p->length = 1;
    p->speed = 0.820822757969100172;   /* 0.1 c_p, first row of the table */
    p->material = scene_paper_material(TLSPH_MIE_GRUNEISEN);
    p->material.conductivity = 0;
}

static void initial_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const impact_parameters *p = &((const impact *)scene)->parameters;
    const double middle = 1e-3 * p->length / p->n;
    if (fabs((double)X[0]) > middle) state->v[0] = (double)X[0] < 0 ? p->speed : -p->speed;
}

tlsph_result impact_create(const impact_parameters *p, impact *out, tlsph_error *error) {
    const double spacing = p->length / p->n;
    tlsph_fill fill = tlsph_fill_default(3);
    scene_setup setup;
    tlsph_result result;
    memset(out, 0, sizeof *out);
    out->parameters = *p;
    fill.origin[0] = (tlsph_real)(-p->length / 2);
    fill.size[0] = (tlsph_real)p->length;
    fill.size[1] = fill.size[2] = (tlsph_real)(p->across * spacing);
    fill.spacing = (tlsph_real)spacing;
    scene_begin(&setup, &fill, &p->material, error);
    scene_add_rollers(&setup, 1);
    scene_add_rollers(&setup, 2);
    result = scene_end(&setup, &p->options, &out->body, error);
    if (result == TLSPH_OK) result = scene_set_state(&out->body, out, initial_state);
    if (result != TLSPH_OK) scene_destroy(&out->body);
    return result;
}

/* Behind the shock the body rests, so that all of the kinetic energy has become internal energy e = rho v^2/2; mass and
   momentum across the shock, which runs at W = v/(1 - J) in the reference, ask for P_XX = -rho v W. With the
   temperature from e(J, theta) the compression J is what remains to be found. Returns the excess of -P_XX over
   rho v W. */
static double rankine_hugoniot(const impact_parameters *p, double J, impact_star *star) {
    const tlsph_material *m = &p->material;
    const double rho = (double)m->density, theta_R = (double)m->reference_temperature;
    const tlsph_real F[9] = { (tlsph_real)J, 0, 0, 0, 1, 0, 0, 0, 1 };
    tlsph_material_state state;
    star->jacobian = J;
    star->temperature = theta_R;
    if (tlsph_material_evaluate(m, F, (tlsph_real)theta_R, &state) != TLSPH_OK) return HUGE_VAL;
    star->temperature +=
        (rho * p->speed * p->speed / 2 - (double)state.internal_energy) / (rho * (double)m->specific_heat);
    if (tlsph_material_evaluate(m, F, (tlsph_real)star->temperature, &state) != TLSPH_OK) return HUGE_VAL;
    star->stress = (double)state.P[0];
    return -star->stress - rho * p->speed * p->speed / (1 - J);
}

double impact_exact(const impact_parameters *p, impact_star *star) {
    double low = 1e-3, high = 1; /* too much pressure at strong compression, too little at none */
    for (int i = 0; i < 200; i++) {
        const double middle = (low + high) / 2;
        if (rankine_hugoniot(p, middle, star) > 0) low = middle;
        else high = middle;
    }
    rankine_hugoniot(p, (low + high) / 2, star);
    return p->speed / (1 - star->jacobian);
}

double impact_p_speed(const tlsph_material *material) {
    double p_wave, bulk, shear;
    scene_moduli(material, &p_wave, &bulk, &shear);
    return sqrt(p_wave / (double)material->density);
}

/* The jacobian of scenes that do not evolve it is read as det F by the same field. */
void impact_read(const impact *bar, double shock_speed, double from, double to, const impact_star *exact,
                 impact_star *mean, double *overshoot) {
    const tlsph_particles *particles = &bar->body.cloud.particles;
    const double place = shock_speed * (double)tlsph_time(bar->body.solver);
    tlsph_real *P = scene_read(bar->body.solver, TLSPH_FIELD_STRESS);
    tlsph_real *J = scene_read(bar->body.solver, TLSPH_FIELD_J);
    tlsph_real *theta = scene_read(bar->body.solver, TLSPH_FIELD_TEMPERATURE);
    double count = 0;
    memset(mean, 0, sizeof *mean);
    *overshoot = 0;
    for (size_t i = 0; P && J && i < particles->count; i++) {
        const double X = fabs((double)particles->positions[3 * i]);
        *overshoot = fmax(*overshoot, (double)P[9 * i] / exact->stress - 1);
        if (X < from * place || X > to * place) continue;
        mean->stress += (double)P[9 * i];
        mean->jacobian += (double)J[i];
        if (theta) mean->temperature += (double)theta[i];
        count++;
    }
    free(P); free(J); free(theta);
    mean->stress /= count; mean->jacobian /= count; mean->temperature /= count;
}
