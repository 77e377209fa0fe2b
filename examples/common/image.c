/* image.c - pixels, strokes, a font, colour maps and PNG files. */
#include "picture.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int ex_image_create(ex_image *im, int width, int height) {
    im->width = im->height = 0;
    im->rgb = NULL;
    if (width < 1 || height < 1 || width > 30000 || height > 30000) return 1;
    im->rgb = malloc((size_t)width * (size_t)height * 3);
    if (!im->rgb) return 1;
    im->width = width;
    im->height = height;
    memset(im->rgb, 255, (size_t)width * (size_t)height * 3);
    return 0;
}

void ex_image_destroy(ex_image *im) {
    free(im->rgb);
    im->rgb = NULL;
    im->width = im->height = 0;
}

static unsigned char *pixel(const ex_image *im, int x, int y) {
    return im->rgb + 3 * ((size_t)y * (size_t)im->width + (size_t)x);
}

void ex_shrink_into(ex_image *small, int x, int y, const ex_image *big, int factor) {
    int columns = big->width / factor, rows = big->height / factor;
    for (int k = 0; k < columns * rows * 3; k++) {
        int i = k / 3 % columns, j = k / 3 / columns, sum = 0;
        for (int b = 0; b < factor * factor; b++)
            sum += pixel(big, i * factor + b % factor, j * factor + b / factor)[k % 3];
        sum = (sum + factor * factor / 2) / (factor * factor);
        if (x + i < small->width && y + j < small->height) pixel(small, x + i, y + j)[k % 3] = (unsigned char)sum;
    }
}

/* ---- strokes ------------------------------------------------------------ */

static void blend(ex_image *im, int x, int y, const double rgb[3], double cover) {
    unsigned char *p = pixel(im, x, y);
    for (int c = 0; c < 3; c++) p[c] = (unsigned char)(p[c] + cover * (rgb[c] - p[c]) + 0.5);
}

static double limited(double value, double low, double high) {
    return value < low ? low : value > high ? high : value;
}

static double segment_distance(double x, double y, const double a[2], const double b[2]) {
    double dx = b[0] - a[0], dy = b[1] - a[1];
    double length2 = dx * dx + dy * dy, s = 0.0;
    if (length2 > 0.0) s = limited(((x - a[0]) * dx + (y - a[1]) * dy) / length2, 0.0, 1.0);
    return hypot(x - a[0] - s * dx, y - a[1] - s * dy);
}

void ex_stroke(ex_image *im, const ex_box *clip, const double from[2], const double to[2], double half_width,
               const double rgb[3]) {
    double pad = half_width + 1.0;
    double left = fmax(fmin(from[0], to[0]) - pad, fmax(clip->left, 0));
    double top = fmax(fmin(from[1], to[1]) - pad, fmax(clip->top, 0));
    double right = fmin(fmax(from[0], to[0]) + pad, fmin(clip->right, im->width));
    double bottom = fmin(fmax(from[1], to[1]) + pad, fmin(clip->bottom, im->height));
    for (int y = (int)top; y < bottom; y++)
        for (int x = (int)left; x < right; x++) {
            double d = segment_distance(x + 0.5, y + 0.5, from, to);
            double cover = limited(half_width + 0.5 - d, 0.0, 1.0);
            if (cover > 0.0) blend(im, x, y, rgb, cover);
        }
}

void ex_fill(ex_image *im, ex_box area, const double rgb[3]) {
    int right = (int)fmin(area.right, im->width);
    int bottom = (int)fmin(area.bottom, im->height);
    for (int y = (int)fmax(area.top, 0); y < bottom; y++)
        for (int x = (int)fmax(area.left, 0); x < right; x++) blend(im, x, y, rgb, 1.0);
}

static const double ink[3] = { 35, 35, 40 };

void ex_frame(ex_image *im, ex_box b) {
    ex_fill(im, (ex_box){ b.left - 1, b.top - 1, b.right + 1, b.top }, ink);
    ex_fill(im, (ex_box){ b.left - 1, b.bottom, b.right + 1, b.bottom + 1 }, ink);
    ex_fill(im, (ex_box){ b.left - 1, b.top, b.left, b.bottom }, ink);
    ex_fill(im, (ex_box){ b.right, b.top, b.right + 1, b.bottom }, ink);
}

/* ---- text --------------------------------------------------------------- */

/* Each digit (base 32) is a row of five dots, from the top: seven rows and up to two below the line. The codes run
 * from ' ' to '~'; behind them is a sign for "times". */
static const char *const glyphs[96] = {
    "",          "4444404",  "aa",        "aavavaa",  "4fke5u4", "op248j3", "cik8lid", "44",      "2488842",
    "8422248",   "04lel4",   "044v44",    "00000048", "000f",    "0000004", "122488g", "ehhhhhe", "4c4444e",
    "eh168gv",   "eh161he",  "26aiv22",   "vgu11he",  "68guhhe", "v124888", "ehhehhe", "ehhf12c", "0040004",
    "00400048",  "0248g842", "00v0v",     "0g84248g", "eh12404", "eh1dlle", "4ahhvhh", "uhhuhhu", "ehggghe",
    "uhhhhhu",   "vgguggv",  "vgguggg",   "ehgnhhf",  "hhhvhhh", "e44444e", "72222ic", "hikokih", "ggggggv",
    "hrllhhh",   "hhpljhh",  "ehhhhhe",   "uhhuggg",  "ehhhlid", "uhhukih", "fgge11u", "v444444", "hhhhhhe",
    "hhhhha4",   "hhhllla",  "hha4ahh",   "hha4444",  "v1248gv", "c88888c", "g884221", "6222226", "4ah",
    "0000000v",  "84",       "00e1fhf",   "ggmphhu",  "00egghe", "11djhhf", "00ehvge", "68s8888", "00fhhhf1e",
    "ggmphhh",   "4044444",  "20222222c", "ggikoki",  "4444444", "00qllll", "00mphhh", "00ehhhe", "00uhhhugg",
    "00fhhhf11", "00moggg",  "00fge1u",   "88s8886",  "00hhhjd", "00hhha4", "00hhlla", "00ha4ah", "00hhhhf1e",
    "00v248v",   "6448446",  "44444444",  "c44244c",  "008l2",   "000a4a"
};

static const char *glyph_of(char character) {
    int index = (unsigned char)character - ' ';
    return glyphs[index >= 0 && index < 96 ? index : '?' - ' '];
}

static unsigned row_bits(const char *glyph, int row) {
    int digit = row >= 0 && row < (int)strlen(glyph) ? glyph[row] : '0';
    return (unsigned)(digit <= '9' ? digit - '0' : digit - 'a' + 10);
}

static int dot(const char *glyph, int column, int row) {
    if (column < 0 || column > 4) return 0;
    return (int)(row_bits(glyph, row) >> (4 - column) & 1u);
}

/* First inked column, and the number of columns with the gap that follows. */
static int glyph_columns(const char *glyph, int *first) {
    unsigned all = 0;
    int last = 4;
    for (int row = 0; row < 9; row++) all |= row_bits(glyph, row);
    *first = 0;
    if (all == 0) return 3;
    while (!(all >> (4 - *first) & 1u)) ++*first;
    while (!(all >> (4 - last) & 1u)) --last;
    return last - *first + 2;
}

/* Distance of (u, v), in dots, from the pen strokes that join neighbouring dots; it turns the coarse dots into
 * smooth letters at any size. */
static double glyph_distance(const char *glyph, double u, double v) {
    static const int step[5][2] = { { 0, 0 }, { 1, 0 }, { 0, 1 }, { 1, 1 }, { -1, 1 } };
    double nearest = 9.0;
    for (int k = 0; k < 45 * 5; k++) {
        int i = k / 5 % 5, j = k / 25, di = step[k % 5][0], dj = step[k % 5][1];
        double from[2] = { i + 0.5, j + 0.5 };
        double to[2] = { from[0] + di, from[1] + dj };
        if (fabs(u - from[0]) > 2.0 || fabs(v - from[1]) > 2.0) continue;
        if (!dot(glyph, i, j) || !dot(glyph, i + di, j + dj)) continue;
        if (di && dj && (dot(glyph, i + di, j) || dot(glyph, i, j + dj))) continue; /* the corner is inked already */
        nearest = fmin(nearest, segment_distance(u, v, from, to));
    }
    return nearest;
}

typedef struct {
    ex_image *im;
    double x, y, size;
    int upward;
} text_pen;

static void draw_glyph(const text_pen *pen, const char *glyph, int first) {
    double half_width = fmax(0.43 * pen->size, 0.5);
    int reach = (int)(9.0 * pen->size) + 2;
    for (int k = 0; k < 4 * reach * reach; k++) {
        int x = (int)pen->x - reach + k % (2 * reach);
        int y = (int)pen->y - reach + k / (2 * reach);
        double dx = x + 0.5 - pen->x, dy = y + 0.5 - pen->y;
        double u = (pen->upward ? -dy : dx) / pen->size + first;
        double v = (pen->upward ? dx : dy) / pen->size;
        double d;
        if (u < -1.0 || u > 6.0 || v < -1.0 || v > 10.0) continue;
        if (x < 0 || y < 0 || x >= pen->im->width || y >= pen->im->height) continue;
        d = glyph_distance(glyph, u, v) * pen->size;
        blend(pen->im, x, y, ink, limited(half_width + 0.5 - d, 0.0, 1.0));
    }
}

/* Draws, or without an image only measures, a text from its top left. */
static double run_text(text_pen pen, int exponents, const char *text) {
    double length = 0.0, x = pen.x, y = pen.y, size = pen.size;
    int raised = 0;
    for (; *text != '\0'; text++) {
        int first, columns = glyph_columns(glyph_of(*text), &first);
        if (raised && !strchr("-+0123456789", *text)) raised = 0;
        if (exponents && *text == '^' && text[1] != '\0' && strchr("-+0123456789", text[1])) {
            raised = 1;
            continue;
        }
        double rise = raised ? -2.0 * size : 0.0;
        pen.size = raised ? 0.7 * size : size;
        pen.x = pen.upward ? x + rise : x + length;
        pen.y = pen.upward ? y - length : y + rise;
        if (pen.im) draw_glyph(&pen, glyph_of(*text), first);
        length += columns * pen.size;
    }
    return length > 0.0 ? length - pen.size : 0.0;
}

double ex_label_width(double size, const char *text) { return run_text((text_pen){ NULL, 0, 0, size, 0 }, 1, text); }

double ex_label_size(double size, double room, const char *text) {
    double width = ex_label_width(size, text);
    return width > room ? fmax(size * room / width, 1.0) : size;
}

void ex_label(ex_image *im, double x, double y, double size, int align, int upward, const char *text) {
    double before = 0.5 * (align + 1) * ex_label_width(size, text);
    double across = 3.5 * size;
    text_pen pen = { im, x, y, size, upward };
    pen.x = floor((upward ? x - across : x - before) + 0.5);
    pen.y = floor((upward ? y + before : y - across) + 0.5);
    run_text(pen, 1, text);
}

void ex_image_text(ex_image *im, int x, int y, int scale, const char *text) {
    run_text((text_pen){ im, x, y, scale, 0 }, 0, text);
}

/* ---- colour maps -------------------------------------------------------- */

enum { STOPS = 9 };
static const unsigned char map_stops[3][STOPS][3] = { { { 20, 11, 52 },
                                                        { 71, 16, 96 },
                                                        { 124, 29, 109 },
                                                        { 174, 46, 95 },
                                                        { 216, 71, 67 },
                                                        { 241, 108, 36 },
                                                        { 252, 156, 12 },
                                                        { 247, 205, 60 },
                                                        { 250, 243, 170 } },
                                                      { { 42, 70, 168 },
                                                        { 78, 117, 205 },
                                                        { 124, 160, 229 },
                                                        { 176, 198, 240 },
                                                        { 222, 222, 222 },
                                                        { 240, 188, 165 },
                                                        { 228, 139, 110 },
                                                        { 203, 83, 68 },
                                                        { 165, 20, 42 } },
                                                      { { 68, 1, 84 },
                                                        { 71, 45, 123 },
                                                        { 59, 82, 139 },
                                                        { 44, 114, 142 },
                                                        { 33, 145, 140 },
                                                        { 40, 174, 128 },
                                                        { 94, 201, 98 },
                                                        { 173, 220, 48 },
                                                        { 253, 231, 37 } } };

void ex_map_colour(ex_map map, double value, double rgb[3]) {
    double at = value > 0.0 ? fmin(value, 1.0) * (STOPS - 1) : 0.0;
    int i = at < STOPS - 1 ? (int)at : STOPS - 2;
    for (int c = 0; c < 3; c++) {
        double from = map_stops[map][i][c], to = map_stops[map][i + 1][c];
        rgb[c] = from + (at - i) * (to - from);
    }
}

/* ---- PNG ---------------------------------------------------------------- */

enum { WINDOW = 32768, HASHES = 32768, LONGEST_MATCH = 258, MAX_TRIES = 48 };

typedef struct {
    unsigned char *data;
    size_t size;
    uint32_t bits;
    int bit_count;
} bit_writer;

/* Deflate packs bits from the least significant end. */
static void put_bits(bit_writer *w, unsigned value, int count) {
    w->bits |= value << w->bit_count;
    for (w->bit_count += count; w->bit_count >= 8; w->bit_count -= 8) {
        w->data[w->size++] = (unsigned char)(w->bits & 255u);
        w->bits >>= 8;
    }
}

/* Huffman codes, unlike plain numbers, start with their highest bit. */
static void put_code(bit_writer *w, unsigned code, int count) {
    while (count-- > 0) put_bits(w, code >> count & 1u, 1);
}

static void put_symbol(bit_writer *w, unsigned s) {
    if (s < 144) put_code(w, 0x30 + s, 8);
    else if (s < 256) put_code(w, 0x190 + s - 144, 9);
    else if (s < 280) put_code(w, s - 256, 7);
    else put_code(w, 0xC0 + s - 280, 8);
}

static int highest_bit(unsigned value) {
    int bit = 0;
    while (value >>= 1) bit++;
    return bit;
}

/* Lengths come in four codes for each number of extra bits, distances in two (RFC 1951, 3.2.5); the longest length
 * has a code of its own. */
static void put_match(bit_writer *w, unsigned length, unsigned distance) {
    unsigned l = length - 3, d = distance - 1;
    int le = l < 8 ? 0 : highest_bit(l) - 2;
    int de = d < 4 ? 0 : highest_bit(d) - 1;
    if (length == LONGEST_MATCH) {
        put_symbol(w, 285);
    } else {
        put_symbol(w, 257 + 4 * (unsigned)le + (l >> le));
        put_bits(w, l & ((1u << le) - 1u), le);
    }
    put_code(w, 2 * (unsigned)de + (d >> de), 5);
    put_bits(w, d & ((1u << de) - 1u), de);
}

typedef struct {
    long head[HASHES];   /* latest position with this hash, or -1 */
    long before[WINDOW]; /* the one before it with the same hash */
} match_index;

static unsigned hash3(const unsigned char *p) {
    uint32_t key = (uint32_t)p[0] << 16 | (uint32_t)p[1] << 8 | p[2];
    return (unsigned)(key * 2654435761u >> 17);
}

static void remember(match_index *m, const unsigned char *data, long at) {
    unsigned h = hash3(data + at);
    m->before[at % WINDOW] = m->head[h];
    m->head[h] = at;
}

static int find_match(const match_index *m, const unsigned char *data, long at, long size, long *distance) {
    int most = size - at < LONGEST_MATCH ? (int)(size - at) : LONGEST_MATCH;
    int best = 2;
    long candidate = m->head[hash3(data + at)];
    for (int t = 0; t < MAX_TRIES && candidate >= 0; t++) {
        int n = 0;
        if (at - candidate >= WINDOW) break;
        while (n < most && data[candidate + n] == data[at + n]) n++;
        if (n > best) best = n, *distance = at - candidate;
        if (best == most) break;
        candidate = m->before[candidate % WINDOW];
    }
    return best;
}

static void deflate_fixed(bit_writer *w, const unsigned char *data, long size, match_index *m) {
    long distance = 0;
    for (long i = 0; i < HASHES; i++) m->head[i] = -1;
    put_bits(w, 3, 3); /* last block, fixed codes */
    for (long at = 0; at < size;) {
        int room = size - at >= 3;
        int length = room ? find_match(m, data, at, size, &distance) : 0;
        if (length < 3) {
            put_symbol(w, data[at]);
            length = 1;
        } else {
            put_match(w, (unsigned)length, (unsigned)distance);
        }
        for (; length > 0; length--, at++)
            if (at + 3 <= size) remember(m, data, at);
    }
    put_symbol(w, 256);
    put_bits(w, 0, 7); /* flushes the last byte */
}

static uint32_t adler32(const unsigned char *data, size_t size) {
    uint32_t a = 1, b = 0;
    for (size_t i = 0; i < size; i++) {
        a = (a + data[i]) % 65521u;
        b = (b + a) % 65521u;
    }
    return b << 16 | a;
}

static uint32_t crc32(uint32_t crc, const unsigned char *data, size_t size) {
    for (size_t i = 0; i < size; i++) {
        crc ^= data[i];
        for (int k = 0; k < 8; k++) crc = crc >> 1 ^ (crc & 1u ? 0xEDB88320u : 0u);
    }
    return crc;
}

static void big_endian(unsigned char out[4], uint32_t value) {
    for (int i = 0; i < 4; i++) out[i] = (unsigned char)(value >> (24 - 8 * i) & 255u);
}

static void write_chunk(FILE *file, const char *type, const unsigned char *data, size_t size) {
    unsigned char head[8], tail[4];
    uint32_t crc;
    big_endian(head, (uint32_t)size);
    memcpy(head + 4, type, 4);
    crc = crc32(0xFFFFFFFFu, head + 4, 4);
    if (size > 0) crc = crc32(crc, data, size);
    big_endian(tail, crc ^ 0xFFFFFFFFu);
    fwrite(head, 1, 8, file);
    if (size > 0) fwrite(data, 1, size, file);
    fwrite(tail, 1, 4, file);
}

/* Shaded rows compress better as differences to the row above, flat drawings as they are; filter 2 and 0. The
 * smaller sum of |byte| picks. */
static void filter_row(unsigned char *out, const unsigned char *row, const unsigned char *above, size_t size) {
    long plain = 0, difference = 0;
    for (size_t i = 0; i < size; i++) {
        int d = above ? (signed char)(row[i] - above[i]) : 255;
        plain += row[i] < 128 ? row[i] : 256 - row[i];
        difference += d < 0 ? -d : d;
    }
    out[0] = difference < plain ? 2 : 0;
    for (size_t i = 0; i < size; i++) out[i + 1] = (unsigned char)(row[i] - (out[0] && above ? above[i] : 0));
}

static unsigned char *filtered_rows(const ex_image *im, size_t *size) {
    size_t row = (size_t)im->width * 3, height = (size_t)im->height;
    unsigned char *out = malloc(height * (row + 1));
    *size = height * (row + 1);
    for (size_t y = 0; out && y < height; y++)
        filter_row(out + y * (row + 1), im->rgb + y * row, y > 0 ? im->rgb + (y - 1) * row : NULL, row);
    return out;
}

/* The zlib stream: two bytes of header, deflate, checksum. */
static unsigned char *compress_rows(const ex_image *im, size_t *size) {
    size_t raw_size;
    unsigned char *raw = filtered_rows(im, &raw_size);
    match_index *m = malloc(sizeof *m);
    bit_writer w = { NULL, 2, 0, 0 };
    /* A fixed code has at most nine bits per byte. */
    if (raw && m) w.data = malloc(raw_size + raw_size / 8 + 64);
    if (w.data) {
        w.data[0] = 0x78;
        w.data[1] = 0x01;
        deflate_fixed(&w, raw, (long)raw_size, m);
        big_endian(w.data + w.size, adler32(raw, raw_size));
    }
    *size = w.size + 4;
    free(raw);
    free(m);
    return w.data;
}

int ex_image_write_png(const ex_image *im, const char *path) {
    static const unsigned char signature[8] = { 137, 'P', 'N', 'G', 13, '\n', 26, '\n' };
    unsigned char head[13] = { 0, 0, 0, 0, 0, 0, 0, 0, 8, 2, 0, 0, 0 };
    size_t size;
    unsigned char *data = compress_rows(im, &size);
    FILE *file = data ? fopen(path, "wb") : NULL;
    int bad = !file;
    if (file) {
        big_endian(head, (uint32_t)im->width);
        big_endian(head + 4, (uint32_t)im->height);
        fwrite(signature, 1, sizeof signature, file);
        write_chunk(file, "IHDR", head, sizeof head);
        write_chunk(file, "IDAT", data, size);
        write_chunk(file, "IEND", NULL, 0);
        bad = ferror(file);
        bad = fclose(file) != 0 || bad;
    }
    free(data);
    return bad;
}
