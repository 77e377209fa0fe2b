/*
 * common.h - support code shared by the example programs: command line,
 * progress and result lines, tables, VTK files and pictures.
 *
 * Nothing here knows about the solver; everything is passed as plain arrays.
 * Functions returning int give 0 on success and non-zero when a file could
 * not be written or memory ran out. Only ex_arguments() ends the program.
 */
#ifndef EX_COMMON_H
#define EX_COMMON_H

#include <stddef.h>
#include <stdio.h>

/* ---- arguments (args.c) ------------------------------------------------- */

typedef enum { EX_REAL, EX_INT, EX_TEXT, EX_FLAG, EX_CHOICE } ex_kind;

typedef struct {
    const char *name; /* without the leading dashes */
    ex_kind kind;
    void *value;         /* double, int, const char *, int (0|1) or int (index
                            into choices); holds the default before parsing */
    const char *unit;    /* may be NULL */
    const char *choices; /* EX_CHOICE: names separated by '|' */
    double low, high;    /* allowed closed range; both 0: any finite value */
    const char *help;
} ex_option;

/* Accepts --name value and --name=value. --help prints the usage and exits with 0; any mistake on the command line
 * is explained on stderr, exit 2. */
void ex_arguments(int argc, char **argv, const char *program, const char *summary, const ex_option *options,
                  int count);

/* ---- progress and results (report.c) ------------------------------------ */

typedef struct ex_progress {
    const char *label;
    double t_end;
    int quiet;
    int terminal;      /* stderr is a terminal: rewrite one line */
    double began;      /* wall clock at the start, s */
    double last_shown; /* wall clock of the last rewritten line, s */
    int next_percent;  /* next plain line when stderr is not a terminal */
} ex_progress;

void ex_progress_begin(ex_progress *p, const char *label, double t_end, int quiet);
void ex_progress_update(ex_progress *p, double t, long step);
void ex_progress_end(ex_progress *p, double t, long step);

/* Lines on stdout, made to be read by scripts:
 *   result <key> <value> <unit>
 *   check <key> <value> <reference> <tolerance> pass|FAIL */
void ex_result(const char *key, double value, const char *unit);
void ex_check(const char *key, double value, double reference, double tolerance);
void ex_check_below(const char *key, double value, double limit);
void ex_check_true(const char *key, int ok);

int ex_exit_code(void); /* 1 after any failed check, else 0 */

int ex_make_directory(const char *path); /* with its parents */
double ex_seconds(void);                 /* wall clock, s */
double ex_cpu_seconds(void);             /* processor time, s */

/* ---- tables and VTK files (files.c) ------------------------------------- */

typedef struct {
    FILE *file;
    int columns;
} ex_csv;

int ex_csv_open(ex_csv *c, const char *directory, const char *name, const char *header_comma_separated);
void ex_csv_row(ex_csv *c, const double *values);
void ex_csv_close(ex_csv *c);

/* Reads a table of numbers, skipping a header line and empty lines; *rows is malloc'ed, row after row. */
int ex_csv_read(const char *path, int columns, double **rows, size_t *row_count);

typedef struct {
    const char *name;
    int components;
    const double *values; /* components per point */
} ex_field;

typedef struct ex_series {
    char *directory, *name;
    double *times; /* of the frames written so far */
    int frames, capacity;
} ex_series;

/* A time series for ParaView: <name>_00000.vtu, ... and <name>.pvd, which is rewritten after each frame so that an
 * interrupted run can be opened too. */
int ex_series_open(ex_series *s, const char *directory, const char *name);
int ex_series_frame(ex_series *s, double time, size_t count, const double *positions_xyz, const ex_field *fields,
                    int field_count);
void ex_series_close(ex_series *s);

/* ---- triangle surfaces (stl.c) ------------------------------------------ */

typedef struct ex_triangles {
    double *corners; /* 9 a triangle, counter-clockwise from outside */
    size_t count;
} ex_triangles;

#define EX_WHY 160
/* Reads an STL file, binary or ASCII, and multiplies its lengths by `scale`. 0 on success; else `why` says what is wrong
 * and where, and *out is empty. Whether the surface is closed is for tlsph_cloud_create to tell. */
int ex_stl_read(const char *path, double scale, ex_triangles *out, char why[EX_WHY]);
int ex_stl_write(const char *path, const ex_triangles *triangles, int ascii);
void ex_stl_free(ex_triangles *triangles);

/* ---- pictures (image.c) ------------------------------------------------- */

typedef struct {
    int width, height;
    unsigned char *rgb; /* rows from the top */
} ex_image;

int ex_image_create(ex_image *im, int width, int height); /* white */
void ex_image_destroy(ex_image *im);
int ex_image_write_png(const ex_image *im, const char *path);

/* (x, y) is the top left corner. At scale 1 capitals are 7 pixels high and lines need about 11. Clipped at the
 * borders. */
void ex_image_text(ex_image *im, int x, int y, int scale, const char *text);

typedef enum { EX_MAP_HEAT, EX_MAP_DIVERGING, EX_MAP_VIRIDIS } ex_map;

/* Colour of a value in [0,1] (clamped), as 0..255. */
void ex_map_colour(ex_map map, double value, double rgb[3]);

/* ---- three-dimensional views of particles (render.c) -------------------- */

typedef struct {
    double azimuth, elevation; /* degrees; where the viewer stands; -90, 90 with
                                  up_axis 2 looks at the x-y plane */
    int up_axis;               /* 0, 1, 2 */
    double zoom;               /* 1: the body just fits */
} ex_camera;

typedef struct {
    const char *title;
    const double *positions; /* 3 per particle */
    const double *values;    /* colour; NULL: plain grey */
    size_t count;
    double radius;         /* of a particle, or half the edge of its cube */
    const double *stretch; /* NULL: spheres; else deformation gradients, 9 per
                              particle row by row: the cube is drawn as the
                              parallelepiped it has become */
} ex_panel;

typedef struct {
    int panel_width, panel_height;
    ex_camera camera;
    ex_map map;
    double low, high;    /* equal: 2nd and 98th percentile of all panels */
    const char *label;   /* colour bar, with unit */
    const char *heading; /* above all panels; may be NULL */
    int common_scale;    /* 1: same metres per pixel in all panels; 2: the same
                            window too, so that motion between them is seen */
} ex_view;

int ex_render(const char *path, const ex_view *view, const ex_panel *panels, int count, int columns);

/* ---- line charts (plot.c) ----------------------------------------------- */

typedef struct {
    const char *name; /* legend; NULL: not in the legend */
    const double *x, *y;
    size_t count;
    int style;  /* 0 line, 1 dashed, 2 markers, 3 line and markers, EX_NOTE */
    int colour; /* palette index */
} ex_curve;

#define EX_NOTE 4 /* markers with the name beside each instead of in the legend */

typedef struct {
    const char *title, *x_label, *y_label;
    int log_x, log_y;
    double x_low, x_high, y_low, y_high; /* equal: automatic */
} ex_axes;

int ex_plot(const char *path, int width, int height, const ex_axes *axes, const ex_curve *curves, int count);
int ex_plot_grid(const char *path, int panel_width, int panel_height, const ex_axes *axes,
                 const ex_curve *const *curves, const int *counts, int panels, int columns);

#endif
