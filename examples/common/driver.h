/*
driver.h - what every example program does around its scene: command line, frames, ledger, pictures, errors

A driver is a table of contents:
    driver_arguments(...);                          options of the scene and the common ones
    <scene>_create(...)  or  driver_error(...)      exit code 3 with the whole record
    driver_begin(...); driver_run_to(...); ...      steps, writes ledger.csv and VTK frames
    pictures from snapshots, result and check lines
    return driver_end(...);
*/
#ifndef DRIVER_H
#define DRIVER_H

#include "../scenes/scenes.h"

typedef struct driver {
    const scene_options *options;
    scene_body *body;
    char folder[512];
    ex_series series;
    ex_csv ledger;
    ex_progress progress;
    double next_frame, frame_interval;      /* s */
    void (*step)(struct driver *d);         /* called after each step with `now` up to date; may be NULL */
    void *user;
    int stride;                             /* steps from one ledger row and callback to the next; 0: one */
    tlsph_ledger now;
    tlsph_result result;
} driver;

/* Parses own options and the common ones of *options; exits as ex_arguments does. At most 32 own. */
void driver_arguments(int argc, char **argv, const char *program, const char *summary, scene_options *options,
                      const ex_option *own, int own_count);
/* Prints the record of an error to stderr and returns the exit code 3. */
int driver_error(const tlsph_error *error);

/* Makes the folder (--output or out/<name>), opens ledger.csv and the VTK series and writes the first frame. Returns 0,
   or 1 with a line on stderr where the folder cannot be written. With --check it tells the scene's cost and exits. */
int driver_begin(driver *d, const char *name, const scene_options *options, scene_body *body, double end_time);
/* Ledger row, frame where one is due, progress and the step callback. */
void driver_stepped(driver *d);
/* Steps until `time` (s) is met. */
tlsph_result driver_run_to(driver *d, double time);
/* Closes the files, says where they are. Exit code: 3 after a failed step (with the record), 1 after a failed check. */
int driver_end(driver *d);
/* Path of a file in the folder, valid until the next call. */
const char *driver_path(driver *d, const char *file);

/* A field as doubles, to be freed; NULL without memory or where the scene lacks it. */
double *driver_read(const scene_body *body, tlsph_field field);

/* What a picture of one instant needs. */
typedef struct driver_snapshot {
    double *positions, *F, *values;
    size_t count;
    double time;
    char title[64];
} driver_snapshot;

/* Keeps one component of a field now, times `scale` (kPa from Pa, for instance). 0 on success. */
int driver_snap(const scene_body *body, tlsph_field field, int component, double scale, driver_snapshot *out);
void driver_snapshot_free(driver_snapshot *snapshot);
/* A view of panels of width x height pixels with one colour scale; angles in degrees. */
ex_view driver_view(int width, int height, double azimuth, double elevation, int up_axis, ex_map map, const char *label,
                    const char *heading);
/* Renders snapshots as panels of stretched particles with half-edge `radius`; empty snapshots are left out. The view's
   sizes, colours and texts are the caller's. 0 on success. */
int driver_render(driver *d, const char *file, const ex_view *view, const driver_snapshot *snapshots, int count,
                  int columns, double radius);

/* What is kept at which time, for runs that draw many instants. */
typedef struct driver_moment { double time; tlsph_field field; int component; double scale; } driver_moment;
/* Steps until `end` (s), meeting each moment exactly and keeping shots[i] there; moments past the end stay empty. */
tlsph_result driver_run_moments(driver *d, double end, const driver_moment *moments, driver_snapshot *shots, int count);

/* Curves that grow: one column of times and `columns` of values. */
typedef struct driver_history {
    double *time, *values;  /* values column by column once closed: see driver_column */
    size_t count, capacity;
    int columns;
    const char *x_label;    /* NULL: time, "t [s]" */
    int bad;                /* memory ran out: what came before is kept */
} driver_history;

void driver_history_add(driver_history *history, double time, const double *values);
/* A copy of one column, to be freed. */
double *driver_column(const driver_history *history, int column);
void driver_history_free(driver_history *history);
/* Writes a history as CSV; the header names the time too. */
int driver_table(driver *d, const char *file, const char *header, const driver_history *history);
/* Runs a body to `end` without files and adds a row of probe(user, row) at t = 0 and about every `interval` (s). */
typedef void (*driver_probe_fn)(void *user, double *row);
tlsph_result driver_record(scene_body *body, double end, double interval, driver_probe_fn probe, void *user,
                           driver_history *history);
/* Largest difference of a column of two histories over the time that both cover, by the range of a's; b is interpolated.
   *rms (or NULL): the root mean square of the differences instead. */
double driver_difference(const driver_history *a, const driver_history *b, int column, double *rms);
/* Draws panels of curves: panel i has title, axis label and the columns first[i] ... first[i + 1] - 1 with their names. */
typedef struct driver_chart { const char *title, *y_label; int first, count; const char *names[4]; } driver_chart;
int driver_plot(driver *d, const char *file, const driver_history *history, const driver_chart *charts, int count,
                int columns);
/* Draws one panel for each of columns 0 ... panels - 1 of several histories, each history a curve with its name. */
typedef struct driver_panel { const char *title, *y_label; } driver_panel;
int driver_overlay(driver *d, const char *file, const driver_history *const *histories, const char *const *names,
                   int count, const driver_panel *panels, int panel_count);

/* The whole program of an example that lets a free body swing in an exact mode (mode_driver.c). */
int driver_cloud_mode(int argc, char **argv, const char *name, const char *summary, cloud_mode_parameters *p);

#endif
