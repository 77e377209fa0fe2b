/* files.c - comma separated tables and VTK time series. */
#include "common.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Joins directory, name and ending into a malloc'ed path; an empty or missing directory stands for the current
 * one. */
static char *join_path(const char *directory, const char *name, const char *ending) {
    const char *folder = directory && directory[0] ? directory : ".";
    size_t size = strlen(folder) + strlen(name) + strlen(ending) + 2;
    char *path = malloc(size);
    if (path) snprintf(path, size, "%s/%s%s", folder, name, ending);
    return path;
}

static FILE *open_new(const char *directory, const char *name, const char *ending) {
    char *path = join_path(directory, name, ending);
    FILE *file = path ? fopen(path, "wb") : NULL;
    free(path);
    return file;
}

/* Errors of earlier writes count too, since the stream remembers them. */
static int close_checked(FILE *file) {
    int bad = ferror(file);
    return fclose(file) != 0 || bad;
}

/* ---- tables ------------------------------------------------------------- */

int ex_csv_open(ex_csv *c, const char *directory, const char *name, const char *header_comma_separated) {
    c->file = NULL;
    c->columns = 1;
    if (directory && directory[0] && ex_make_directory(directory)) return 1;
    c->file = open_new(directory, name, "");
    if (!c->file) return 1;
    for (const char *s = header_comma_separated; *s != '\0'; s++) c->columns += *s == ',';
    return fprintf(c->file, "%s\n", header_comma_separated) < 0;
}

void ex_csv_row(ex_csv *c, const double *values) {
    if (!c->file) return;
    for (int i = 0; i < c->columns; i++) fprintf(c->file, "%s%.17g", i ? "," : "", values[i]);
    fputc('\n', c->file);
}

void ex_csv_close(ex_csv *c) {
    if (c->file) fclose(c->file);
    c->file = NULL;
}

/* Reads a whole text file into a malloc'ed string. */
static char *read_text(const char *path) {
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    long size = -1;
    if (!file) return NULL;
    if (fseek(file, 0, SEEK_END) == 0) size = ftell(file);
    rewind(file);
    if (size >= 0) text = malloc((size_t)size + 1);
    if (text) {
        size_t got = fread(text, 1, (size_t)size, file);
        text[got] = '\0';
    }
    fclose(file);
    return text;
}

static int parse_row(const char *line, int columns, double *row) {
    for (int i = 0; i < columns; i++) {
        char *end;
        row[i] = strtod(line, &end);
        if (end == line) return 1;
        line = end + strspn(end, " \t\r");
        if (*line == ',' && i + 1 < columns) line++;
    }
    return *line != '\0';
}

static size_t count_lines(const char *text) {
    size_t lines = 1;
    while ((text = strchr(text, '\n')) != NULL) text++, lines++;
    return lines;
}

/* Only the first line may be something else than numbers. */
static int parse_table(char *text, int columns, double *rows, size_t *count) {
    int line_number = 0;
    *count = 0;
    for (char *line = strtok(text, "\n"); line; line = strtok(NULL, "\n")) {
        int bad = parse_row(line, columns, rows + *count * (size_t)columns);
        line_number++;
        if (line[strspn(line, " \t\r")] == '\0') continue;
        if (!bad) ++*count;
        else if (line_number > 1) return 1;
    }
    return 0;
}

int ex_csv_read(const char *path, int columns, double **rows, size_t *row_count) {
    char *text = read_text(path);
    int bad;
    *rows = NULL;
    *row_count = 0;
    if (!text || columns < 1) {
        free(text);
        return 1;
    }
    *rows = malloc(count_lines(text) * (size_t)columns * sizeof **rows);
    bad = !*rows || parse_table(text, columns, *rows, row_count);
    free(text);
    if (!bad) return 0;
    free(*rows);
    *rows = NULL;
    *row_count = 0;
    return 1;
}

/* ---- VTK time series ---------------------------------------------------- */

static char *copy_text(const char *text) {
    char *copy = malloc(strlen(text) + 1);
    return copy ? strcpy(copy, text) : NULL;
}

int ex_series_open(ex_series *s, const char *directory, const char *name) {
    const char *folder = directory && directory[0] ? directory : ".";
    memset(s, 0, sizeof *s);
    if (ex_make_directory(folder)) return 1;
    s->directory = copy_text(folder);
    s->name = copy_text(name);
    if (s->directory && s->name) return 0;
    ex_series_close(s);
    return 1;
}

void ex_series_close(ex_series *s) {
    free(s->directory);
    free(s->name);
    free(s->times);
    memset(s, 0, sizeof *s);
}

static const char *byte_order(void) {
    const uint16_t probe = 1;
    unsigned char first;
    memcpy(&first, &probe, 1);
    return first ? "LittleEndian" : "BigEndian";
}

static void write_escaped(FILE *file, const char *text) {
    for (; *text != '\0'; text++) {
        if (*text == '<') fputs("&lt;", file);
        else if (*text == '&') fputs("&amp;", file);
        else if (*text == '"') fputs("&quot;", file);
        else fputc(*text, file);
    }
}

/* Announces an array whose bytes follow at *offset of the appended data, each array after a UInt64 with its size,
 * and moves the offset behind it. */
static void declare_array(FILE *file, const char *type, const char *name, int components, size_t bytes,
                          uint64_t *offset) {
    fprintf(file, "<DataArray type=\"%s\" Name=\"", type);
    write_escaped(file, name);
    fprintf(file,
            "\" NumberOfComponents=\"%d\" format=\"appended\" "
            "offset=\"%llu\"/>\n",
            components, (unsigned long long)*offset);
    *offset += sizeof(uint64_t) + bytes;
}

static size_t field_bytes(const ex_field *f, size_t count) { return count * (size_t)f->components * sizeof(double); }

static void write_structure(FILE *file, size_t count, const ex_field *fields, int field_count) {
    uint64_t at = 0;
    fprintf(file,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\""
            " version=\"1.0\" byte_order=\"%s\" header_type=\"UInt64\">\n"
            "<UnstructuredGrid>\n<Piece NumberOfPoints=\"%lu\" "
            "NumberOfCells=\"%lu\">\n<Points>\n",
            byte_order(), (unsigned long)count, (unsigned long)count);
    declare_array(file, "Float64", "position", 3, 3 * count * sizeof(double), &at);
    fprintf(file, "</Points>\n<Cells>\n");
    declare_array(file, "Int64", "connectivity", 1, 8 * count, &at);
    declare_array(file, "Int64", "offsets", 1, 8 * count, &at);
    declare_array(file, "UInt8", "types", 1, count, &at);
    fprintf(file, "</Cells>\n<PointData>\n");
    for (int i = 0; i < field_count; i++)
        declare_array(file, "Float64", fields[i].name, fields[i].components, field_bytes(&fields[i], count), &at);
    fprintf(file, "</PointData>\n</Piece>\n</UnstructuredGrid>\n"
                  "<AppendedData encoding=\"raw\">\n_");
}

static void write_block(FILE *file, const void *data, size_t bytes) {
    const uint64_t size = bytes;
    fwrite(&size, sizeof size, 1, file);
    if (bytes > 0) fwrite(data, 1, bytes, file);
}

static void write_counted(FILE *file, size_t count, int64_t first) {
    const uint64_t size = count * sizeof(int64_t);
    fwrite(&size, sizeof size, 1, file);
    for (size_t i = 0; i < count; i++) {
        const int64_t value = (int64_t)i + first;
        fwrite(&value, sizeof value, 1, file);
    }
}

static void write_types(FILE *file, size_t count) {
    enum { VTK_VERTEX = 1 };
    const uint64_t size = count;
    fwrite(&size, sizeof size, 1, file);
    for (size_t i = 0; i < count; i++) fputc(VTK_VERTEX, file);
}

/* Cell i is the single point i. */
static void write_data(FILE *file, size_t count, const double *positions, const ex_field *fields, int field_count) {
    write_block(file, positions, 3 * count * sizeof(double));
    write_counted(file, count, 0);
    write_counted(file, count, 1);
    write_types(file, count);
    for (int i = 0; i < field_count; i++) write_block(file, fields[i].values, field_bytes(&fields[i], count));
    fprintf(file, "\n</AppendedData>\n</VTKFile>\n");
}

static void frame_ending(char ending[32], int frame) { snprintf(ending, 32, "_%05d.vtu", frame); }

/* Written beside and renamed, so that a reader never meets half a file. */
static int write_collection(const ex_series *s) {
    char *path = join_path(s->directory, s->name, ".pvd");
    char *draft = join_path(s->directory, s->name, ".pvd.new");
    FILE *file = path && draft ? fopen(draft, "wb") : NULL;
    int bad = !file;
    if (file) {
        char ending[32];
        fprintf(file, "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" "
                      "version=\"0.1\">\n<Collection>\n");
        for (int i = 0; i < s->frames; i++) {
            frame_ending(ending, i);
            fprintf(file, "<DataSet timestep=\"%.17g\" part=\"0\" file=\"", s->times[i]);
            write_escaped(file, s->name);
            fprintf(file, "%s\"/>\n", ending);
        }
        fprintf(file, "</Collection>\n</VTKFile>\n");
        bad = close_checked(file) || rename(draft, path) != 0;
    }
    free(path);
    free(draft);
    return bad;
}

static int remember_time(ex_series *s, double time) {
    if (s->frames == s->capacity) {
        int capacity = s->capacity ? 2 * s->capacity : 64;
        double *times = realloc(s->times, (size_t)capacity * sizeof *times);
        if (!times) return 1;
        s->times = times;
        s->capacity = capacity;
    }
    s->times[s->frames++] = time;
    return 0;
}

int ex_series_frame(ex_series *s, double time, size_t count, const double *positions_xyz, const ex_field *fields,
                    int field_count) {
    char ending[32];
    FILE *file;
    if (!s->directory) return 1;
    frame_ending(ending, s->frames);
    file = open_new(s->directory, s->name, ending);
    if (!file) return 1;
    write_structure(file, count, fields, field_count);
    write_data(file, count, positions_xyz, fields, field_count);
    if (close_checked(file)) return 1;
    return remember_time(s, time) || write_collection(s);
}
