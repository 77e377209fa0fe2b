/* scenes.c - what all scenes share: options, construction of a body, reading. */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- options ----------------------------------------------------------------------------------------------------- */

void scene_options_default(scene_options *options) {
    const tlsph_desc desc = tlsph_desc_default(3); /* the library's own choices, so that they stand in one place */
    memset(options, 0, sizeof *options);
    options->cfl = (double)desc.cfl;
    options->support = (double)desc.support;
    options->unknowns = (int)desc.unknowns;
    options->thermal = (int)desc.thermal;
    options->operator_kind = (int)desc.operator_kind;
    options->kernel = (int)desc.kernel;
    options->dissipation = (int)desc.dissipation;
    options->harmonic = (double)desc.harmonic;
    options->biharmonic = (double)desc.biharmonic;
    options->force_form = (int)desc.force_form;
    options->step_rule = (int)desc.step_rule;
    options->volume_coupling = (int)desc.volume_coupling;
    options->conduction = (int)desc.conduction;
    options->integrator = (int)desc.integrator;
    options->sharp = desc.sharp_gradients;
    options->projection = desc.projection;
    options->rates = desc.rates;
    options->laplacian = (double)desc.incompressible.laplacian;
    options->frames = 20;
    options->output = "";
}

static ex_option choice(const char *name, int *value, const char *choices, const char *help) {
    ex_option option = { name, EX_CHOICE, value, NULL, choices, 0, 0, help };
    return option;
}

static ex_option real(const char *name, double *value, const char *unit, double low, double high, const char *help) {
    ex_option option = { name, EX_REAL, value, unit, NULL, low, high, help };
    return option;
}

static ex_option whole(const char *name, int *value, double low, double high, const char *help) {
    ex_option option = { name, EX_INT, value, NULL, NULL, low, high, help };
    return option;
}

void scene_option_table(scene_options *o, ex_option *table) {
    const ex_option quiet = { "quiet", EX_FLAG, &o->quiet, NULL, NULL, 0, 0, "no progress lines" };
    const ex_option check = { "check", EX_FLAG, &o->check, NULL, NULL, 0, 0, "tell cost and doubts of the scene, do not run it" };
    const ex_option output = { "output", EX_TEXT, &o->output, NULL, NULL, 0, 0, "folder to write to" };
    size_t i = 0;
    table[i++] = choice("preset", &o->preset, "none|fast|balanced|accurate", "how to compute; other options change it further");
    table[i++] = real("end-time", &o->end_time, "s", 1e-12, 1e12, "time to stop at");
    table[i++] = real("cfl", &o->cfl, "", 1e-6, 1, "Courant number (000-78)");
    table[i++] = choice("unknowns", &o->unknowns, "pF|pFJ|pFHJ|pFH", "deformation measures that are evolved");
    table[i++] = choice("thermal", &o->thermal, "isothermal|energy|entropy", "thermal unknown that is evolved");
    table[i++] = choice("operator", &o->operator_kind, "corrected|cells|W0|W1|bond0|bond|cells4",
                        "corrected kernel, dual faces of cells, the same of order 4; 002: kernels of order 0 and 1, with bonds");
    table[i++] = choice("kernel", &o->kernel, "cubic|quadratic|wendland2|wendland4", "of the operators with kernels");
    table[i++] = choice("placement", &o->placement, "faces|cells", "of clouds: particles on their surface, or all behind it");
    table[i++] = real("support", &o->support, "spacings", 0.5, 4, "smoothing length h; neighbours within 2h");
    table[i++] = choice("dissipation", &o->dissipation, "limited|reconstructed|first|printed|jst|none|adjoint", "upwinding");
    table[i++] = real("harmonic", &o->harmonic, "", 0, 100, "eta2 of the dissipation jst (002-28)");
    table[i++] = real("biharmonic", &o->biharmonic, "", 0, 100, "eta4 of the dissipation jst (002-28)");
    table[i++] = choice("force", &o->force_form, "adjoint|printed", "forces of W0, W1, bonds (printed: 002-22)");
    table[i++] = choice("step-rule", &o->step_rule, "particle|pair|pair-linear", "time step (pair: 002-31, 32)");
    table[i++] = choice("volume", &o->volume_coupling, "split|printed", "how an evolved J enters the energy");
    table[i++] = choice("conduction", &o->conduction, "compact|double", "heat conduction's stencil");
    table[i++] = choice("integrator", &o->integrator, "rk2|ssprk3|rk3frozen|rk4frozen|leapfrog", "time integrator");
    table[i++] = whole("rates", &o->rates, 1, 8, "leapfrog: most step sizes, for stiff and fine parts of their own");
    table[i++] = whole("conduction-stages", &o->conduction_stages, 0, 1000, "3 or more: conduction in stages of its own");
    table[i++] = whole("sharp", &o->sharp, 0, 1, "1: gradients of fourth-order dispersion (lattices only)");
    table[i++] = whole("projection", &o->projection, 0, 1, "1: conserve angular momentum exactly (000-79 to 82)");
    table[i++] = choice("scheme", &o->scheme, "explicit|incompressible", "incompressible: nu up to 0.5, pressure solved for");
    table[i++] = choice("pressure-iteration", &o->pressure_iteration, "cg|dual", "of the incompressible scheme");
    table[i++] = real("laplacian", &o->laplacian, "", 0, 1, "alpha of the incompressible scheme (001-54)");
    table[i++] = whole("laplacian-as-printed", &o->laplacian_as_printed, 0, 1, "1: jumps without reconstruction (001-58)");
    table[i++] = whole("threads", &o->threads, 0, 4096, "threads; 0: OpenMP's own choice");
    table[i++] = whole("frames", &o->frames, 0, 100000, "frames written as VTK files");
    table[i++] = output;
    table[i++] = check;
    table[i++] = quiet;
}

int scene_options_preset(scene_options *options, const char *name) {
    static const char *const names[] = { "fast", "balanced", "accurate" };
    tlsph_desc desc = tlsph_desc_default(3);
    int i = 0;
    while (i < 3 && strcmp(names[i], name)) i++;
    if (i == 3) return 0;
    scene_options_apply(options, &desc);
    desc.particles.cell_count = 1; /* scenes are lattices; irregular ones end in scene_options_cloud */
    tlsph_preset(&desc, (tlsph_preset_name)i);
    options->operator_kind = (int)desc.operator_kind;
    options->integrator = (int)desc.integrator;
    options->sharp = desc.sharp_gradients;
    options->conduction_stages = desc.conduction_stages;
    options->cfl = (double)desc.cfl;
    return 1;
}

void scene_options_cloud(scene_options *options, tlsph_fill *fill) {
    options->sharp = 0;
    const int chosen = options->preset && (options->operator_kind == TLSPH_CELLS || options->operator_kind == TLSPH_CELLS_4);
    if (options->operator_kind != TLSPH_CORRECTED_KERNEL && !chosen) return; /* the preset's choice was for lattices */
    options->operator_kind = TLSPH_CLOSED;
    options->kernel = TLSPH_WENDLAND_C2;
    options->support = 0.825;
    fill->voronoi = 1;
    if (options->placement)
        fill->placement = fill->placement == TLSPH_SCATTERED ? TLSPH_SCATTERED_INSIDE : TLSPH_CELL_CENTRED;
}

void scene_options_scatter(scene_options *options, tlsph_fill *fill, tlsph_length_fn distance, void *user) {
    if (options->operator_kind == TLSPH_CELLS) options->operator_kind = TLSPH_CORRECTED_KERNEL;
    fill->shape = TLSPH_DISTANCE;
    fill->placement = TLSPH_SCATTERED;
    scene_options_cloud(options, fill);
    fill->distance = distance;
    fill->distance_user = user;
}

void scene_options_apply(const scene_options *options, tlsph_desc *desc) {
    desc->unknowns = (tlsph_unknowns)options->unknowns;
    desc->thermal = (tlsph_thermal)options->thermal;
    desc->operator_kind = (tlsph_operator_kind)options->operator_kind;
    desc->kernel = (tlsph_kernel)options->kernel;
    desc->support = (tlsph_real)options->support;
    desc->dissipation = (tlsph_dissipation)options->dissipation;
    desc->harmonic = (tlsph_real)options->harmonic;
    desc->biharmonic = (tlsph_real)options->biharmonic;
    desc->force_form = (tlsph_force_form)options->force_form;
    desc->step_rule = (tlsph_step_rule)options->step_rule;
    desc->volume_coupling = (tlsph_volume_coupling)options->volume_coupling;
    desc->conduction = (tlsph_conduction)options->conduction;
    desc->integrator = (tlsph_integrator)options->integrator;
    desc->conduction_stages = options->conduction_stages;
    desc->rates = options->rates;
    desc->sharp_gradients = options->sharp;
    desc->projection = options->projection;
    desc->scheme = (tlsph_scheme)options->scheme;
    if (desc->scheme == TLSPH_INCOMPRESSIBLE) { /* the pressure takes the place of J */
        if (desc->unknowns == TLSPH_PFJ) desc->unknowns = TLSPH_PF;
        if (desc->unknowns == TLSPH_PFHJ) desc->unknowns = TLSPH_PFH;
    }
    desc->incompressible.iteration = (tlsph_pressure_iteration)options->pressure_iteration;
    desc->incompressible.laplacian = (tlsph_real)options->laplacian;
    desc->incompressible.laplacian_as_printed = options->laplacian_as_printed;
    desc->audit = options->audit;
    desc->threads = options->threads;
    desc->cfl = (tlsph_real)options->cfl;
}

/* ---- construction ------------------------------------------------------------------------------------------------ */

void scene_begin(scene_setup *setup, const tlsph_fill *fill, const tlsph_material *material, tlsph_error *error) {
    memset(setup, 0, sizeof *setup);
    if (error) memset(error, 0, sizeof *error);
    setup->body.material = *material;
    setup->result = tlsph_cloud_create(fill, &setup->body.cloud, error);
}

void scene_begin_cloud(scene_setup *setup, const tlsph_cloud *cloud, tlsph_result made, const tlsph_material *material,
                       tlsph_error *error) {
    memset(setup, 0, sizeof *setup);
    if (error) memset(error, 0, sizeof *error);
    setup->body.material = *material;
    setup->body.cloud = *cloud;
    setup->result = made;
}

/* A failure of this file's own, which no function of the library has described. */
static void describe(tlsph_error *error, tlsph_result result) {
    if (!error || error->result != TLSPH_OK) return;
    error->result = result;
    error->stage = "scene";
    error->particle = TLSPH_NO_PARTICLE;
    snprintf(error->message, sizeof error->message, "scene: %s", tlsph_result_text(result));
}

void *scene_keep(scene_setup *setup, size_t size) {
    void *memory = NULL;
    if (setup->result == TLSPH_OK && setup->list_count < 3 * SCENE_CONDITIONS) memory = malloc(size ? size : 1);
    if (memory) setup->lists[setup->list_count++] = memory;
    else if (setup->result == TLSPH_OK) setup->result = TLSPH_ERROR_MEMORY;
    return memory;
}

tlsph_condition *scene_add(scene_setup *setup, tlsph_condition_kind kind) {
    tlsph_condition *condition;
    if (setup->condition_count == SCENE_CONDITIONS) { /* a scene with too many: fail, but give something to write to */
        setup->result = TLSPH_ERROR_SIZE;
        setup->condition_count--;
    }
    condition = &setup->conditions[setup->condition_count++];
    *condition = tlsph_condition_default(kind);
    return condition;
}

tlsph_condition *scene_add_where(scene_setup *setup, tlsph_condition_kind kind, tlsph_inside_fn inside, void *user) {
    const tlsph_particles *particles = &setup->body.cloud.particles;
    tlsph_condition *condition = scene_add(setup, kind);
    uint32_t *list = scene_keep(setup, particles->count * sizeof *list);
    if (list) {
        condition->count = tlsph_select(particles, inside, user, list, particles->count);
        condition->particles = list;
    }
    return condition;
}

tlsph_condition *scene_add_plane(scene_setup *setup, tlsph_condition_kind kind, int axis, double value) {
    const tlsph_particles *particles = &setup->body.cloud.particles;
    const tlsph_real close = setup->body.cloud.cell_size[axis] / 1000;
    tlsph_condition *condition = scene_add(setup, kind);
    uint32_t *list = scene_keep(setup, particles->count * sizeof *list);
    if (list) condition->count = tlsph_select_plane(particles, axis, (tlsph_real)value, close, list, particles->count);
    condition->particles = list;
    condition->normal[axis] = condition->face[axis] = 1;
    return condition;
}

/* Of the particles, or of their shares of the surface. */
static void extent(const tlsph_particles *particles, int axis, double *low, double *high) {
    *low = *high = particles->count ? (double)particles->positions[axis] : 0;
    for (size_t i = 0; i < particles->count; i++) {
        const size_t k = (size_t)axis;
        const double B = particles->moments ? (double)particles->areas[3 * i + k] : 0;
        const double x = (double)particles->positions[3 * i + k] +
                         (fabs(B) > 0 ? (double)particles->moments[9 * i + 4 * k] / B : 0);
        *low = fmin(*low, x);
        *high = fmax(*high, x);
    }
}

void scene_add_rollers(scene_setup *setup, int axis) {
    double low, high;
    extent(&setup->body.cloud.particles, axis, &low, &high);
    scene_add_plane(setup, TLSPH_ROLLER, axis, low);
    scene_add_plane(setup, TLSPH_ROLLER, axis, high);
}

void scene_share_area(scene_setup *setup, tlsph_condition *condition, double area) {
    const tlsph_real *volumes = setup->body.cloud.particles.volumes;
    tlsph_real *areas = scene_keep(setup, condition->count * sizeof *areas);
    double sum = 0;
    if (!areas) return;
    for (size_t i = 0; i < condition->count; i++) sum += (double)volumes[condition->particles[i]];
    for (size_t i = 0; i < condition->count; i++)
        areas[i] = (tlsph_real)(area * (double)volumes[condition->particles[i]] / sum);
    condition->areas = areas;
}

static tlsph_result create_solver(scene_setup *setup, const scene_options *options, int dimension, tlsph_error *error) {
    tlsph_desc desc = tlsph_desc_default(dimension);
    scene_options_apply(options, &desc);
    desc.particles = setup->body.cloud.particles;
    desc.keep_pairs = 1; /* scene_oscillation and scene_alternation look at neighbours */
    desc.materials = &setup->body.material;
    desc.material_count = 1;
    desc.conditions = setup->conditions;
    desc.condition_count = setup->condition_count;
    return tlsph_create(&desc, &setup->body.solver, error);
}

/* A flat cloud is a 2-D scene: cell corners in the plane are 4 a cell, and all third coordinates are equal. */
static int dimension_of(const tlsph_particles *particles) {
    double low, high;
    extent(particles, 2, &low, &high);
    return high > low ? 3 : 2;
}

tlsph_result scene_end(scene_setup *setup, const scene_options *options, scene_body *out, tlsph_error *error) {
    memset(out, 0, sizeof *out);
    if (setup->result == TLSPH_OK)
        setup->result = create_solver(setup, options, dimension_of(&setup->body.cloud.particles), error);
    else
        describe(error, setup->result);
    for (size_t i = 0; i < setup->list_count; i++) free(setup->lists[i]);
    if (setup->result == TLSPH_OK) *out = setup->body;
    else scene_destroy(&setup->body);
    return setup->result;
}

typedef struct state_arrays { tlsph_real *x, *v, *F, *theta; } state_arrays;

static void store_state(const scene_state *state, state_arrays *arrays, size_t particle) {
    for (size_t i = 0; i < 3; i++) {
        arrays->x[3 * particle + i] = (tlsph_real)state->x[i];
        arrays->v[3 * particle + i] = (tlsph_real)state->v[i];
    }
    for (size_t i = 0; i < 9; i++) arrays->F[9 * particle + i] = (tlsph_real)state->F[i];
    if (arrays->theta) arrays->theta[particle] = (tlsph_real)state->theta;
}

static tlsph_result write_state(tlsph_solver *solver, const state_arrays *arrays) {
    tlsph_result result = tlsph_write(solver, TLSPH_FIELD_POSITION, arrays->x);
    if (result == TLSPH_OK) result = tlsph_write(solver, TLSPH_FIELD_F, arrays->F);
    if (result == TLSPH_OK && arrays->theta) result = tlsph_write(solver, TLSPH_FIELD_TEMPERATURE, arrays->theta);
    if (result == TLSPH_OK) result = tlsph_write(solver, TLSPH_FIELD_VELOCITY, arrays->v);
    if (result == TLSPH_OK) tlsph_ledger_reset(solver);
    return result;
}

tlsph_result scene_set_state(scene_body *body, const void *scene, scene_state_fn fill) {
    const tlsph_particles *particles = &body->cloud.particles;
    state_arrays arrays = { scene_read(body->solver, TLSPH_FIELD_POSITION),
                            scene_read(body->solver, TLSPH_FIELD_VELOCITY), scene_read(body->solver, TLSPH_FIELD_F),
                            scene_read(body->solver, TLSPH_FIELD_TEMPERATURE) };
    tlsph_result result = TLSPH_ERROR_MEMORY;
    if (arrays.x && arrays.v && arrays.F) {
        for (size_t i = 0; i < particles->count; i++) {
            const tlsph_real *X = particles->positions + 3 * i;
            scene_state state = { { (double)X[0], (double)X[1], (double)X[2] }, { 0, 0, 0 },
                                  { 1, 0, 0, 0, 1, 0, 0, 0, 1 }, (double)body->material.reference_temperature };
            fill(scene, X, &state);
            store_state(&state, &arrays, i);
        }
        result = write_state(body->solver, &arrays);
    }
    free(arrays.x); free(arrays.v); free(arrays.F); free(arrays.theta);
    return result;
}

void scene_destroy(scene_body *body) {
    tlsph_destroy(body->solver);
    if (body->cloud.memory) tlsph_cloud_destroy(&body->cloud);
    memset(body, 0, sizeof *body);
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

tlsph_real *scene_read(const tlsph_solver *solver, tlsph_field field) {
    const size_t values = tlsph_count(solver) * (size_t)tlsph_field_components(field);
    tlsph_real *out = malloc(values * sizeof *out);
    if (out && tlsph_read(solver, field, out) == TLSPH_OK) return out;
    free(out);
    return NULL;
}

double scene_value(const tlsph_solver *solver, tlsph_field field, size_t particle, int component) {
    tlsph_real *values = scene_read(solver, field);
    const size_t at = particle * (size_t)tlsph_field_components(field) + (size_t)component;
    const double out = values ? (double)values[at] : (double)NAN;
    free(values);
    return out;
}

size_t scene_nearest(const tlsph_particles *particles, double x, double y, double z) {
    size_t best = 0;
    double least = HUGE_VAL;
    for (size_t i = 0; i < particles->count; i++) {
        const tlsph_real *X = particles->positions + 3 * i;
        const double dx = (double)X[0] - x, dy = (double)X[1] - y, dz = (double)X[2] - z;
        const double distance = dx * dx + dy * dy + dz * dz;
        if (distance < least) { least = distance; best = i; }
    }
    return best;
}

tlsph_material scene_paper_material(tlsph_material_kind kind) {
    tlsph_material material = tlsph_material_default(kind);
    material.density = 1000;
    material.young = 50050;
    material.poisson = (tlsph_real)0.3;
    material.expansion = (tlsph_real)2.223e-4;
    material.specific_heat = 1;
    material.conductivity = 10;
    material.reference_temperature = (tlsph_real)293.15;
    material.gruneisen_exponent = 1;
    material.mooney_fraction = 0;
    return material;
}

void scene_moduli(const tlsph_material *material, double *p_wave, double *bulk, double *shear) {
    const double young = (double)material->young, poisson = (double)material->poisson;
    *shear = young / (2 * (1 + poisson));   /* (000-83) */
    *bulk = young / (3 * (1 - 2 * poisson));
    *p_wave = *bulk + 4 * *shear / 3;
}

double scene_expansion(const tlsph_material *material, double delta) {
    const double c_v = (double)material->density * (double)material->specific_heat; /* per volume */
    double p_wave, bulk, shear;
    scene_moduli(material, &p_wave, &bulk, &shear);
    return sqrt(delta * c_v * p_wave / (double)material->reference_temperature) / (3 * bulk);
}
