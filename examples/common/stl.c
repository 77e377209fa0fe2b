/* stl.c - triangle surfaces in STL files, binary and ASCII. */
#include "common.h"

#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define HEAD 84   /* bytes: text and number of triangles */
#define RECORD 50 /* normal, three corners, attribute */

static float get_float(const unsigned char *at) {
    const uint32_t bits = (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}
static void put_float(unsigned char *at, float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    for (int i = 0; i < 4; i++) at[i] = (unsigned char)(bits >> 8 * i);
}

static int no_memory(char why[EX_WHY]) {
    snprintf(why, EX_WHY, "no memory");
    return 1;
}

/* ---- reading ------------------------------------------------------------ */

static int read_binary(const unsigned char *bytes, size_t count, ex_triangles *out, char why[EX_WHY]) {
    out->corners = malloc(9 * count * sizeof *out->corners);
    if (!out->corners) return no_memory(why);
    for (size_t f = 0; f < count; f++)
        for (size_t k = 0; k < 9; k++)
            out->corners[9 * f + k] = (double)get_float(bytes + HEAD + RECORD * f + 12 + 4 * k);
    out->count = count;
    return 0;
}

/* The next word, or NULL at the end; counts lines. */
static const char *next_word(const char **at, size_t *length, int *line) {
    const char *word = *at;
    for (; isspace((unsigned char)*word); word++) *line += *word == '\n';
    *length = strcspn(word, " \t\r\n\v\f");
    *at = word + *length;
    return *length ? word : NULL;
}
static int is_word(const char *word, size_t length, const char *text) {
    return strlen(text) == length && !strncmp(word, text, length);
}

/* Only "vertex" and "endfacet" matter: each facet must have three of the first. */
static int read_ascii(const char *text, ex_triangles *out, char why[EX_WHY]) {
    size_t capacity = 0, numbers = 0, length;
    const char *at = text, *word;
    int line = 1;
    while ((word = next_word(&at, &length, &line)) != NULL) {
        if (is_word(word, length, "endfacet")) {
            if (numbers == 9 * ++out->count) continue;
            snprintf(why, EX_WHY, "line %d: a facet with other than three corners", line);
            return 1;
        }
        if (!is_word(word, length, "vertex")) continue;
        if (numbers + 3 > capacity) {
            double *more = realloc(out->corners, (capacity = 2 * capacity + 900) * sizeof *more);
            if (!more) return no_memory(why);
            out->corners = more;
        }
        for (int k = 0; k < 3; k++) {
            char *end;
            out->corners[numbers++] = strtod(at, &end);
            if (end == at) {
                snprintf(why, EX_WHY, "line %d: a corner needs three numbers", line);
                return 1;
            }
            at = end;
        }
    }
    if (out->count && numbers == 9 * out->count) return 0;
    snprintf(why, EX_WHY, numbers ? "line %d: the last facet is not complete" : "no facets in %d lines", line);
    return 1;
}

int ex_stl_read(const char *path, double scale, ex_triangles *out, char why[EX_WHY]) {
    FILE *file = fopen(path, "rb");
    unsigned char *bytes = NULL;
    long size = -1;
    int bad = 1;
    out->count = 0;
    out->corners = NULL;
    snprintf(why, EX_WHY, "cannot be read");
    if (!file) return 1;
    if (fseek(file, 0, SEEK_END) == 0) size = ftell(file);
    if (size >= 0 && fseek(file, 0, SEEK_SET) == 0) bytes = malloc((size_t)size + 1);
    if (bytes && fread(bytes, 1, (size_t)size, file) == (size_t)size) {
        const size_t length = (size_t)size;
        bytes[length] = 0;
        /* Some binary files begin with "solid", too: their length tells. */
        size_t count = 0;
        for (int i = 3; length >= HEAD && i >= 0; i--) count = count << 8 | bytes[80 + i];
        if (count && length == HEAD + RECORD * count) bad = read_binary(bytes, count, out, why);
        else if (!strncmp((const char *)bytes, "solid", 5)) bad = read_ascii((const char *)bytes, out, why);
        else snprintf(why, EX_WHY, "neither ASCII (no \"solid\") nor binary: %lu triangles take %lu bytes, found %lu",
                      (unsigned long)count, (unsigned long)(HEAD + RECORD * count), (unsigned long)length);
    }
    free(bytes);
    fclose(file);
    if (bad) ex_stl_free(out);
    for (size_t i = 0; i < 9 * out->count; i++) out->corners[i] *= scale;
    return bad;
}

void ex_stl_free(ex_triangles *t) {
    free(t->corners);
    t->corners = NULL;
    t->count = 0;
}

/* ---- writing ------------------------------------------------------------ */

static void normal(const double *c, double n[3]) {
    double a[3], b[3], size = 0;
    for (int k = 0; k < 3; k++) { a[k] = c[3 + k] - c[k]; b[k] = c[6 + k] - c[k]; }
    for (int k = 0; k < 3; k++) {
        n[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        size += n[k] * n[k];
    }
    for (int k = 0; k < 3; k++) n[k] = size > 0 ? n[k] / sqrt(size) : 0;
}

int ex_stl_write(const char *path, const ex_triangles *t, int ascii) {
    FILE *file = fopen(path, "wb");
    unsigned char head[HEAD] = "triangles", record[RECORD] = { 0 };
    if (!file) return 1;
    for (int i = 0; i < 4; i++) head[80 + i] = (unsigned char)(t->count >> 8 * i);
    if (ascii) fprintf(file, "solid part\n");
    else fwrite(head, 1, HEAD, file);
    for (size_t f = 0; f < t->count; f++) {
        const double *c = t->corners + 9 * f;
        double n[3];
        normal(c, n);
        if (!ascii) {
            for (int k = 0; k < 12; k++) put_float(record + 4 * k, (float)(k < 3 ? n[k] : c[k - 3]));
            fwrite(record, 1, RECORD, file);
            continue;
        }
        fprintf(file, " facet normal %.9g %.9g %.9g\n  outer loop\n", n[0], n[1], n[2]);
        for (int k = 0; k < 9; k += 3) fprintf(file, "   vertex %.17g %.17g %.17g\n", c[k], c[k + 1], c[k + 2]);
        fprintf(file, "  endloop\n endfacet\n");
    }
    if (ascii) fprintf(file, "endsolid part\n");
    const int bad = ferror(file);
    return fclose(file) != 0 || bad;
}
