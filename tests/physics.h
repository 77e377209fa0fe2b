/* What the physics tests share: tables of references, free bodies with a smooth state, orders of convergence. */
#ifndef PHYSICS_H
#define PHYSICS_H

#include "../examples/scenes/scenes.h"
#include "harness.h"

#define R(x) ((tlsph_real)(x))

/* ---- tables with a header line ----------------------------------------------------------------------------------- */

typedef struct table { char *text; char *cells[4096]; size_t columns, rows; } table;

static inline char *table_text(const char *path) {
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    size_t size;
    if (!file) return NULL;
    text = malloc(1 << 20);
    size = text ? fread(text, 1, (1 << 20) - 1, file) : 0;
    if (text) text[size] = '\0';
    fclose(file);
    return text;
}

/* Cuts the text at commas and line ends. Returns 0 on success. */
static inline int table_read(table *t, const char *path) {
    char *at = t->text = table_text(path);
    size_t cell = 0, column = 0;
    t->columns = t->rows = 0;
    while (at && *at && cell < sizeof t->cells / sizeof *t->cells) {
        const size_t length = strcspn(at, ",\r\n");
        const int ends = at[length] != ',';
        t->cells[cell++] = at;
        column++;
        at += length;
        if (ends) { if (t->columns == 0) t->columns = column; column = 0; }
        while (*at == ',' || *at == '\r' || *at == '\n') { const int comma = *at == ','; *at++ = '\0'; if (comma) break; }
    }
    if (t->columns) t->rows = cell / t->columns - 1;
    return t->rows == 0;
}

static inline const char *table_word(const table *t, size_t row, const char *column) {
    for (size_t i = 0; i < t->columns; i++)
        if (strcmp(t->cells[i], column) == 0) return t->cells[(row + 1) * t->columns + i];
    return "nan";
}

static inline double table_number(const table *t, size_t row, const char *column) {
    return strtod(table_word(t, row, column), NULL);
}

/* F11 ... F33 with a prefix and an ending: prefix "P", ending "_at_phase0". */
static inline void table_tensor(const table *t, size_t row, const char *prefix, const char *ending, double out[9]) {
    char name[64];
    for (int i = 0; i < 9; i++) {
        snprintf(name, sizeof name, "%s%d%d%s", prefix, i / 3 + 1, i % 3 + 1, ending);
        out[i] = table_number(t, row, name);
    }
}

/* Material of a row with columns q and a share of the Mooney terms, adiabatic. */
static inline tlsph_material table_material(const table *t, size_t row, const char *mooney) {
    const int neo_hookean = strcmp(table_word(t, row, "model"), "NH") == 0;
    tlsph_material m = scene_paper_material(neo_hookean ? TLSPH_NEO_HOOKEAN : TLSPH_MIE_GRUNEISEN);
    m.gruneisen_exponent = R(table_number(t, row, "q"));
    m.mooney_fraction = R(table_number(t, row, mooney));
    m.conductivity = 0;
    return m;
}

/* ---- free bodies ------------------------------------------------------------------------------------------------- */

/* A box of cells[i] cubic cells of 1/4 m with the paper's material; conditions may be added before scene_end. */
static inline void box_begin(scene_setup *setup, int nx, int ny, int nz, const tlsph_material *material) {
    tlsph_fill fill = tlsph_fill_default(3);
    fill.spacing = R(0.25);
    fill.size[0] = R(0.25 * nx); fill.size[1] = R(0.25 * ny); fill.size[2] = R(0.25 * nz);
    scene_begin(setup, &fill, material, NULL);
}

static inline scene_options physics_options(tlsph_unknowns unknowns, tlsph_thermal thermal) {
    scene_options options;
    scene_options_default(&options);
    options.unknowns = (int)unknowns;
    options.thermal = (int)thermal;
    options.threads = 1; /* small bodies: threads cost more than they give */
    return options;
}

/* A smooth motion that is no rigid one, with spin, and a warm side: scene is a pointer to the speed in m/s. */
static inline void lively_state(const void *scene, const tlsph_real X[3], scene_state *state) {
    const double speed = *(const double *)scene, x = (double)X[0], y = (double)X[1], z = (double)X[2];
    state->v[0] = speed * (-y + 0.5 * sin(2 * x) - 0.3 * z);
    state->v[1] = speed * (x + 0.4 * cos(3 * z) + 0.2 * y * z);
    state->v[2] = speed * (0.7 * sin(2 * y) - 0.2 * x * x);
    state->theta += 20 * sin(1.5 * x + y);
}

/* Steps of a fixed size, so that two runs meet the same times. */
static inline tlsph_result fixed_steps(tlsph_solver *solver, double dt, int count) {
    tlsph_result result = TLSPH_OK;
    for (int i = 0; i < count && result == TLSPH_OK; i++) result = tlsph_step(solver, R(dt));
    return result;
}

/* ---- norms ------------------------------------------------------------------------------------------------------- */

/* Observed order from errors at spacings that halve from one entry to the next, over the whole list. */
static inline double observed_order(const double *errors, int count) {
    return log2(errors[0] / errors[count - 1]) / (count - 1);
}

static inline double length3(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

#endif
