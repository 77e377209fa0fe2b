/* driver.c - see driver.h. */
#include "driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- command line and errors ------------------------------------------------------------------------------------- */

#define OWN_OPTIONS 32

void driver_arguments(int argc, char **argv, const char *program, const char *summary, scene_options *options,
                      const ex_option *own, int own_count) {
    ex_option table[OWN_OPTIONS + SCENE_OPTION_COUNT];
    if (own_count > OWN_OPTIONS) own_count = OWN_OPTIONS;
    for (int i = 1; i < argc; i++) { /* first, so that options on either side of it count more */
        const size_t length = strlen("--preset");
        if (strncmp(argv[i], "--preset", length)) continue;
        if (argv[i][length] == '=') scene_options_preset(options, argv[i] + length + 1);
        else if (!argv[i][length] && i + 1 < argc) scene_options_preset(options, argv[i + 1]);
    }
    memcpy(table, own, (size_t)own_count * sizeof *own);
    scene_option_table(options, table + own_count);
    ex_arguments(argc, argv, program, summary, table, own_count + SCENE_OPTION_COUNT);
}

int driver_error(const tlsph_error *e) {
    fprintf(stderr, "error: %s\n", e->message[0] ? e->message : tlsph_result_text(e->result));
    fprintf(stderr, "  result   %s\n", tlsph_result_text(e->result));
    fprintf(stderr, "  stage    %s, field %s, value %g, limit %g\n", e->stage ? e->stage : "-", e->field ? e->field : "-",
            e->value, e->limit);
    if (e->particle != TLSPH_NO_PARTICLE)
        fprintf(stderr, "  particle %lu at (%g, %g, %g) m, %lu neighbours\n", (unsigned long)e->particle, e->position[0],
                e->position[1], e->position[2], (unsigned long)e->neighbours);
    fprintf(stderr, "  time     %g s, step %lu\n", e->time, (unsigned long)e->step);
    if (e->stretches[0] > 0)
        fprintf(stderr, "  stretches %g %g %g, temperature %g K\n", e->stretches[0], e->stretches[1], e->stretches[2],
                e->temperature);
    return 3;
}

/* ---- ledger ------------------------------------------------------------------------------------------------------ */

/* Every column of ledger.csv with where it stands in tlsph_ledger. */
#define LEDGER_COLUMNS(X)                                                                                              \
    X("time [s]", time) X("time_step [s]", time_step)                                                                  \
    X("momentum_x [kg m/s]", linear_momentum[0]) X("momentum_y [kg m/s]", linear_momentum[1])                          \
    X("momentum_z [kg m/s]", linear_momentum[2]) X("angular_momentum_x [kg m2/s]", angular_momentum[0])                \
    X("angular_momentum_y [kg m2/s]", angular_momentum[1]) X("angular_momentum_z [kg m2/s]", angular_momentum[2])      \
    X("kinetic_energy [J]", kinetic_energy) X("strain_energy [J]", strain_energy)                                      \
    X("thermal_energy [J]", thermal_energy) X("total_energy [J]", total_energy)                                        \
    X("ballistic_energy [J]", ballistic_energy) X("entropy [J/K]", entropy) X("dissipation [J]", dissipation)          \
    X("dissipation_entropy [J/K]", dissipation_entropy) X("conduction_entropy [J/K]", conduction_entropy)              \
    X("external_work [J]", external_work) X("external_heat [J]", external_heat)                                        \
    X("external_entropy [J/K]", external_entropy) X("projection_work [J]", projection_work)                            \
    X("contact_loss [J]", contact_loss) X("energy_residual [J]", energy_residual)                                      \
    X("entropy_residual [J/K]", entropy_residual) X("least_pair_production", least_pair_production)                    \
    X("drift_largest", drift_largest) X("jacobian_least", jacobian_least)                                              \
    X("temperature_least [K]", temperature_least) X("temperature_largest [K]", temperature_largest)

#define NAME(name, member) name ","
static const char ledger_header[] = LEDGER_COLUMNS(NAME) "step";
#undef NAME

static void write_ledger(driver *d) {
#define VALUE(name, member) d->now.member,
    const double row[] = { LEDGER_COLUMNS(VALUE) (double)d->now.step };
#undef VALUE
    ex_csv_row(&d->ledger, row);
}

/* ---- frames ------------------------------------------------------------------------------------------------------ */

double *driver_read(const scene_body *body, tlsph_field field) {
    const size_t count = tlsph_count(body->solver) * (size_t)tlsph_field_components(field);
    tlsph_real *values = scene_read(body->solver, field);
    double *out = values ? malloc(count * sizeof *out) : NULL;
    for (size_t i = 0; out && i < count; i++) out[i] = (double)values[i];
    free(values);
    return out;
}

static const tlsph_field frame_fields[] = {
    TLSPH_FIELD_DISPLACEMENT, TLSPH_FIELD_VELOCITY, TLSPH_FIELD_PRESSURE, TLSPH_FIELD_VON_MISES, TLSPH_FIELD_TEMPERATURE,
    TLSPH_FIELD_J, TLSPH_FIELD_F, TLSPH_FIELD_STRESS, TLSPH_FIELD_VOLUME };
#define FRAME_FIELDS (sizeof frame_fields / sizeof *frame_fields)

static void write_frame(driver *d) {
    ex_field fields[FRAME_FIELDS];
    double *owned[FRAME_FIELDS], *positions = driver_read(d->body, TLSPH_FIELD_POSITION);
    int count = 0;
    for (size_t i = 0; i < FRAME_FIELDS; i++) {
        owned[count] = driver_read(d->body, frame_fields[i]);
        if (!owned[count]) continue; /* the scene lacks it */
        fields[count].name = tlsph_field_name(frame_fields[i]);
        fields[count].components = tlsph_field_components(frame_fields[i]);
        fields[count].values = owned[count];
        count++;
    }
    if (positions) ex_series_frame(&d->series, d->now.time, tlsph_count(d->body->solver), positions, fields, count);
    while (count > 0) free(owned[--count]);
    free(positions);
}

/* ---- running ----------------------------------------------------------------------------------------------------- */

const char *driver_path(driver *d, const char *file) {
    static char path[1024];
    snprintf(path, sizeof path, "%s/%s", d->folder, file);
    return path;
}

/* --check: what the scene will cost and what looks wrong about it. */
static void print_preflight(const scene_body *body, double end_time) {
    tlsph_preflight_report r;
    tlsph_preflight(body->solver, (tlsph_real)end_time, &r);
    printf("%lu particles, %lu connected part(s), %lu pairs, %.3g MB\n", (unsigned long)r.particles, (unsigned long)r.bodies,
           (unsigned long)r.pairs, 1e-6 * (double)r.bytes);
    printf("spacing %.3g to %.3g m, first time step %.3g s\n", r.spacing_least, r.spacing_most, r.time_step);
    printf("%.3g steps to %g s, in which sound crosses the body %.3g times; %.3g visits of pairs\n", r.steps, end_time,
           r.crossings, r.pair_visits);
    printf("least even neighbours: particle %lu, %.2f (1: all around, 0: in a plane)\n", (unsigned long)r.weakest,
           r.support);
    for (int i = 0; i < TLSPH_HINT_COUNT; i++)
        if (r.hints >> i & 1) printf("hint: %s\n", tlsph_hint_text((tlsph_hint)i));
    if (!r.hints) printf("no doubts\n");
}

int driver_begin(driver *d, const char *name, const scene_options *options, scene_body *body, double end_time) {
    memset(d, 0, sizeof *d);
    d->options = options;
    d->body = body;
    if (options->output && options->output[0]) snprintf(d->folder, sizeof d->folder, "%s", options->output);
    else snprintf(d->folder, sizeof d->folder, "out/%s", name);
    if (options->check) {
        print_preflight(body, end_time);
        exit(0);
    }
    d->frame_interval = options->frames > 1 ? end_time / (options->frames - 1) : HUGE_VAL;
    if (ex_make_directory(d->folder) || ex_csv_open(&d->ledger, d->folder, "ledger.csv", ledger_header) ||
        ex_series_open(&d->series, d->folder, name)) {
        fprintf(stderr, "error: cannot write to %s\n", d->folder);
        return 1;
    }
    ex_progress_begin(&d->progress, name, end_time, options->quiet);
    tlsph_ledger_read(body->solver, &d->now);
    write_ledger(d);
    if (options->frames > 0) write_frame(d);
    d->next_frame = d->frame_interval;
    return 0;
}

void driver_stepped(driver *d) {
    tlsph_ledger_read(d->body->solver, &d->now);
    write_ledger(d);
    if (d->options->frames > 0 && d->now.time >= d->next_frame * (1 - 1e-12)) {
        write_frame(d);
        while (d->next_frame * (1 - 1e-12) <= d->now.time) d->next_frame += d->frame_interval;
    }
    ex_progress_update(&d->progress, d->now.time, (long)d->now.step);
    if (d->step) d->step(d);
}

tlsph_result driver_run_to(driver *d, double time) {
    const double close = 1e-10 * fabs(time); /* a rest that is round-off is no step */
    tlsph_solver *solver = d->body->solver;
    while (d->result == TLSPH_OK && time - (double)tlsph_time(solver) > close) {
        d->result = tlsph_step(solver, (tlsph_real)(time - (double)tlsph_time(solver)));
        if (d->result != TLSPH_OK) break;
        if (d->stride < 2 || tlsph_step_count(solver) % (uint64_t)d->stride == 0 ||
            time - (double)tlsph_time(solver) <= close)
            driver_stepped(d);
    }
    return d->result;
}

int driver_end(driver *d) {
    int code = d->result == TLSPH_OK ? ex_exit_code() : driver_error(tlsph_last_error(d->body->solver));
    ex_progress_end(&d->progress, d->now.time, (long)d->now.step);
    ex_series_close(&d->series);
    ex_csv_close(&d->ledger);
    printf("written to %s\n", d->folder);
    return code;
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

int driver_snap(const scene_body *body, tlsph_field field, int component, double scale, driver_snapshot *out) {
    const size_t components = (size_t)tlsph_field_components(field);
    double *values = driver_read(body, field);
    memset(out, 0, sizeof *out);
    out->positions = driver_read(body, TLSPH_FIELD_POSITION);
    out->F = driver_read(body, TLSPH_FIELD_F);
    out->count = tlsph_count(body->solver);
    out->time = (double)tlsph_time(body->solver);
    snprintf(out->title, sizeof out->title, "t = %.4g s", out->time);
    for (size_t i = 0; values && i < out->count; i++) values[i] = scale * values[i * components + (size_t)component];
    out->values = values;
    if (out->positions && out->F && values) return 0;
    driver_snapshot_free(out);
    return 1;
}

void driver_snapshot_free(driver_snapshot *s) {
    free(s->positions); free(s->F); free(s->values);
    memset(s, 0, sizeof *s);
}

ex_view driver_view(int width, int height, double azimuth, double elevation, int up_axis, ex_map map, const char *label,
                    const char *heading) {
    ex_view view;
    memset(&view, 0, sizeof view);
    view.panel_width = width;
    view.panel_height = height;
    view.camera.azimuth = azimuth;
    view.camera.elevation = elevation;
    view.camera.up_axis = up_axis;
    view.camera.zoom = 1;
    view.map = map;
    view.label = label;
    view.heading = heading;
    view.common_scale = 1;
    return view;
}

int driver_render(driver *d, const char *file, const ex_view *view, const driver_snapshot *snapshots, int count,
                  int columns, double radius) {
    ex_panel *panels = calloc((size_t)count + 1, sizeof *panels);
    int used = 0, bad = 1;
    for (int i = 0; panels && i < count; i++) {
        const driver_snapshot *s = &snapshots[i];
        ex_panel panel = { s->title, s->positions, s->values, s->count, radius, s->F };
        if (s->count) panels[used++] = panel;
    }
    if (used) bad = ex_render(driver_path(d, file), view, panels, used, columns);
    free(panels);
    return bad;
}

static double next_moment(const driver_moment *moments, int count, double t, double end) {
    for (int i = 0; i < count; i++) if (moments[i].time > t) end = fmin(end, moments[i].time);
    return end;
}

tlsph_result driver_run_moments(driver *d, double end, const driver_moment *moments, driver_snapshot *shots, int count) {
    double t = (double)tlsph_time(d->body->solver), stop = t;
    do {
        if (driver_run_to(d, stop) != TLSPH_OK) break;
        t = stop;
        for (int i = 0; i < count; i++)
            if (moments[i].time <= t && moments[i].time >= t)
                driver_snap(d->body, moments[i].field, moments[i].component, moments[i].scale, &shots[i]);
        stop = next_moment(moments, count, t, end);
    } while (t < end);
    return d->result;
}

/* ---- curves ------------------------------------------------------------------------------------------------------ */

void driver_history_add(driver_history *h, double time, const double *values) {
    const size_t columns = (size_t)h->columns;
    if (h->count == h->capacity && !h->bad) {
        const size_t capacity = 2 * h->capacity + 256;
        double *times = realloc(h->time, capacity * sizeof *times), *table;
        if (times) h->time = times;
        table = times ? realloc(h->values, capacity * columns * sizeof *table) : NULL;
        if (table) { h->values = table; h->capacity = capacity; }
        else h->bad = 1;
    }
    if (h->count == h->capacity) return;
    h->time[h->count] = time;
    memcpy(h->values + h->count * columns, values, columns * sizeof *values);
    h->count++;
}

double *driver_column(const driver_history *h, int column) {
    double *out = malloc((h->count + 1) * sizeof *out);
    for (size_t i = 0; out && i < h->count; i++) out[i] = h->values[i * (size_t)h->columns + (size_t)column];
    return out;
}

void driver_history_free(driver_history *h) {
    free(h->time); free(h->values);
    h->time = h->values = NULL;
    h->count = h->capacity = 0;
}

#define MOST_COLUMNS 32

int driver_table(driver *d, const char *file, const char *header, const driver_history *h) {
    double row[MOST_COLUMNS + 1];
    ex_csv csv;
    if (ex_csv_open(&csv, d->folder, file, header)) return 1;
    for (size_t i = 0; i < h->count; i++) {
        row[0] = h->time[i];
        memcpy(row + 1, h->values + i * (size_t)h->columns, (size_t)h->columns * sizeof *row);
        ex_csv_row(&csv, row);
    }
    ex_csv_close(&csv);
    return 0;
}

tlsph_result driver_record(scene_body *body, double end, double interval, driver_probe_fn probe, void *user,
                           driver_history *h) {
    const double close = 1e-10 * fabs(end); /* a rest that is round-off is no step */
    double row[MOST_COLUMNS] = { 0 }, next = 0, t = (double)tlsph_time(body->solver);
    tlsph_result result = TLSPH_OK;
    while (result == TLSPH_OK) {
        if (t >= next || end - t <= close) {
            probe(user, row);
            driver_history_add(h, t, row);
            next = interval > 0 ? interval * (floor(t / interval) + 1) : t;
        }
        if (end - t <= close) break;
        result = tlsph_step(body->solver, (tlsph_real)(end - t));
        t = (double)tlsph_time(body->solver);
    }
    return result;
}

/* Value of a column at a time between the first row and the last; `at` is a row not after it. */
static double interpolate(const driver_history *h, int column, double t, size_t *at) {
    const size_t columns = (size_t)h->columns, c = (size_t)column;
    double share;
    while (*at + 2 < h->count && h->time[*at + 1] < t) (*at)++;
    if (*at + 1 >= h->count) return h->values[*at * columns + c];
    share = (t - h->time[*at]) / (h->time[*at + 1] - h->time[*at]);
    return (1 - share) * h->values[*at * columns + c] + share * h->values[(*at + 1) * columns + c];
}

double driver_difference(const driver_history *a, const driver_history *b, int column, double *rms) {
    double low = HUGE_VAL, high = -HUGE_VAL, worst = 0, squares = 0;
    size_t at = 0, i;
    if (rms) *rms = HUGE_VAL;
    if (!a->count || !b->count) return HUGE_VAL;
    for (i = 0; i < a->count && a->time[i] <= b->time[b->count - 1]; i++) {
        const double value = a->values[i * (size_t)a->columns + (size_t)column];
        const double off = fabs(value - interpolate(b, column, a->time[i], &at));
        if (!(off <= worst)) worst = off; /* keeps what is not a number */
        squares += off * off;
        low = fmin(low, value);
        high = fmax(high, value);
    }
    if (rms && i && high > low) *rms = sqrt(squares / (double)i) / (high - low);
    return high > low ? worst / (high - low) : worst > 0 ? HUGE_VAL : 0;
}

#define MOST_CHARTS 8

int driver_plot(driver *d, const char *file, const driver_history *h, const driver_chart *charts, int count,
                int columns) {
    ex_axes axes[MOST_CHARTS];
    ex_curve curves[MOST_CHARTS][4];
    const ex_curve *panels[MOST_CHARTS];
    int counts[MOST_CHARTS], bad;
    memset(axes, 0, sizeof axes);
    memset(curves, 0, sizeof curves);
    for (int i = 0; i < count && i < MOST_CHARTS; i++) {
        axes[i].title = charts[i].title;
        axes[i].x_label = h->x_label ? h->x_label : "t [s]";
        axes[i].y_label = charts[i].y_label;
        for (int j = 0; j < charts[i].count; j++) {
            ex_curve curve = { charts[i].names[j], h->time, driver_column(h, charts[i].first + j), h->count, 0, j };
            curves[i][j] = curve;
        }
        panels[i] = curves[i];
        counts[i] = charts[i].count;
    }
    bad = ex_plot_grid(driver_path(d, file), 640, 420, axes, panels, counts, count, columns);
    for (int i = 0; i < count && i < MOST_CHARTS; i++)
        for (int j = 0; j < counts[i]; j++) free((void *)curves[i][j].y);
    return bad;
}

#define MOST_CURVES 8

int driver_overlay(driver *d, const char *file, const driver_history *const *histories, const char *const *names,
                   int count, const driver_panel *panels, int panel_count) {
    ex_axes axes[MOST_CHARTS];
    ex_curve curves[MOST_CHARTS][MOST_CURVES];
    const ex_curve *of[MOST_CHARTS];
    int counts[MOST_CHARTS], bad;
    if (count > MOST_CURVES) count = MOST_CURVES;
    if (panel_count > MOST_CHARTS) panel_count = MOST_CHARTS;
    memset(axes, 0, sizeof axes);
    for (int i = 0; i < panel_count; i++) {
        axes[i].title = panels[i].title;
        axes[i].x_label = "t [s]";
        axes[i].y_label = panels[i].y_label;
        for (int j = 0; j < count; j++) {
            ex_curve curve = { names[j], histories[j]->time, driver_column(histories[j], i), histories[j]->count,
                               j % 2, j };
            curves[i][j] = curve;
        }
        of[i] = curves[i];
        counts[i] = count;
    }
    bad = ex_plot_grid(driver_path(d, file), 640, 420, axes, of, counts, panel_count, panel_count < 2 ? 1 : 2);
    for (int i = 0; i < panel_count; i++)
        for (int j = 0; j < count; j++) free((void *)curves[i][j].y);
    return bad;
}
