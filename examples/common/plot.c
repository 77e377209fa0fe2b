/* plot.c - line charts with linear and logarithmic axes. */
#include "picture.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FINE = 3, COLOURS = 8 }; /* samples per pixel and direction */

static const double palette[COLOURS][3] = { { 31, 95, 168 },  { 208, 74, 32 },  { 36, 138, 84 }, { 132, 74, 160 },
                                            { 214, 150, 20 }, { 30, 150, 175 }, { 95, 95, 100 }, { 214, 84, 146 } };
static const double white[3] = { 255, 255, 255 };

/* One axis; for a logarithmic one low and high are decadic logarithms. */
typedef struct {
    double low, high;
    int log, automatic;
} range;

/* The name of a point and where it stands. */
typedef struct {
    const char *name;
    double at[2];
    ex_box box;
} note;

enum { NOTES = 64 };

typedef struct {
    ex_image *page, fine; /* fine: FINE times the size of the chart */
    const ex_axes *axes;
    const ex_curve *curves;
    int count, x0, y0, width, height; /* place on the page */
    double size;
    range x, y;
    ex_ticks x_ticks, y_ticks;
    ex_box frame; /* relative to (x0, y0), like all coordinates below */
    ex_box legend;
    note notes[NOTES];
    int note_count;
} chart;

/* ---- ticks -------------------------------------------------------------- */

static double round_step(double rough) {
    double power = pow(10.0, floor(log10(rough)));
    double digit = rough / power;
    return power * (digit <= 1.001 ? 1 : digit <= 2.001 ? 2 : digit <= 5.001 ? 5 : 10);
}

void ex_ticks_linear(ex_ticks *t, double low, double high, int about) {
    double step = round_step((high - low) / (about > 1 ? about : 1));
    double first = ceil(low / step - 1e-6);
    double largest = fmax(fabs(low), fabs(high));
    int decimals;
    t->count = t->exponent = 0;
    if (largest >= 1e5 || largest < 1e-3) t->exponent = (int)floor(log10(largest) + 1e-9);
    decimals = t->exponent - (int)floor(log10(step) + 1e-9);
    decimals = decimals < 0 ? 0 : decimals > 15 ? 15 : decimals;
    while (t->count < EX_MAX_TICKS) {
        double value = (first + t->count) * step;
        if (value > high + 1e-6 * step) break;
        /* Adding zero turns a negative zero into the plain one. */
        snprintf(t->text[t->count], sizeof t->text[0], "%.*f", decimals, value * pow(10.0, -t->exponent) + 0.0);
        t->value[t->count++] = value;
    }
}

double ex_ticks_width(const ex_ticks *t, double size) {
    double widest = 0.0;
    for (int i = 0; i < t->count; i++) widest = fmax(widest, ex_label_width(size, t->text[i]));
    return widest;
}

static void log_text(char text[24], int mantissa, int decade, int plain) {
    if (plain) snprintf(text, 24, "%g", mantissa * pow(10.0, decade));
    else if (mantissa == 1) snprintf(text, 24, "10^%d", decade);
    else snprintf(text, 24, "%d" EX_TIMES "10^%d", mantissa, decade);
}

static void add_decade_ticks(ex_ticks *t, const range *r, int decade, const char *mantissas) {
    int plain = r->low >= -3.01 && r->high <= 4.01;
    for (; *mantissas != '\0'; mantissas++) {
        double value = decade + log10(*mantissas - '0');
        if (value < r->low - 1e-6 || value > r->high + 1e-6) continue;
        if (t->count >= EX_MAX_TICKS) return;
        log_text(t->text[t->count], *mantissas - '0', decade, plain);
        t->value[t->count++] = value;
    }
}

/* Whole decades where enough of them are seen, else finer steps. */
static void ticks_log(ex_ticks *t, const range *r, int about) {
    static const char *const sets[3] = { "1", "125", "1234568" };
    int from = (int)floor(r->low), to = (int)ceil(r->high);
    int stride = 1 + (to - from) / (about > 1 ? about : 1);
    for (int k = 0; k < 3; k++) {
        t->count = t->exponent = 0;
        for (int d = from; d <= to; d++)
            if (d % stride == 0) add_decade_ticks(t, r, d, sets[k]);
        if (t->count >= 3 || stride > 1) return;
    }
}

static void make_ticks(ex_ticks *t, const range *r, double about) {
    int most = (int)fmax(2.0, fmin(about, 9.0));
    if (r->log) ticks_log(t, r, most);
    else ex_ticks_linear(t, r->low, r->high, most);
}

/* ---- ranges ------------------------------------------------------------- */

static double scaled(const range *r, double value) {
    /* Numbers of a run that blew up would leave nothing else to be seen. */
    if (!(fabs(value) < 1e150)) return (double)NAN;
    if (!r->log) return value;
    return value > 0.0 ? log10(value) : (double)NAN;
}

static void widen_range(range *r, double part) {
    double size = fmax(fabs(r->low), fabs(r->high));
    double spread = r->high - r->low;
    /* Rounding noise on a constant is no structure to be shown. */
    if (spread <= 1e-12 * size || spread <= 0.0) {
        spread = r->log ? 0.3 : size > 0.0 ? 0.1 * size : 1.0;
        part = 0.5;
    }
    r->low -= part * spread;
    r->high += part * spread;
}

static range make_range(const chart *c, int is_y) {
    const ex_axes *a = c->axes;
    range r = { DBL_MAX, -DBL_MAX, is_y ? a->log_y : a->log_x, 0 };
    double low = is_y ? a->y_low : a->x_low, high = is_y ? a->y_high : a->x_high;
    double part = is_y ? 0.06 : 0.0;
    if (low < high && (!r.log || low > 0.0)) {
        r.low = scaled(&r, low);
        r.high = scaled(&r, high);
        return r;
    }
    r.automatic = 1;
    for (int i = 0; i < c->count; i++) {
        const double *v = is_y ? c->curves[i].y : c->curves[i].x;
        if (c->curves[i].style >= 2) part = 0.06;
        for (size_t j = 0; j < c->curves[i].count; j++) {
            double value = scaled(&r, v[j]);
            if (!isfinite(value)) continue;
            r.low = fmin(r.low, value);
            r.high = fmax(r.high, value);
        }
    }
    if (r.low > r.high) r.low = 0.0, r.high = 1.0;
    widen_range(&r, part);
    return r;
}

/* ---- layout ------------------------------------------------------------- */

static void lay_out(chart *c) {
    double g = c->size;
    ex_box *f = &c->frame;
    f->top = floor((c->axes->title ? 24 : 10) * g);
    f->bottom = floor(c->height - (c->axes->x_label ? 36 : 22) * g);
    make_ticks(&c->y_ticks, &c->y, (f->bottom - f->top) / (28 * g));
    if (c->y_ticks.exponent) f->top = fmax(f->top, floor(24 * g));
    f->left = floor((c->axes->y_label ? 30 : 14) * g + ex_ticks_width(&c->y_ticks, g));
    f->right = floor(c->width - 16 * g);
    make_ticks(&c->x_ticks, &c->x, (f->right - f->left) / (46 * g));
}

static double limited(double value) { return value < -1e5 ? -1e5 : value > 1e5 ? 1e5 : value; }

/* Returns 0 for a point that cannot be drawn. */
static int place_point(const chart *c, const ex_curve *curve, size_t i, double at[2]) {
    const ex_box *f = &c->frame;
    double x = (scaled(&c->x, curve->x[i]) - c->x.low) / (c->x.high - c->x.low);
    double y = (scaled(&c->y, curve->y[i]) - c->y.low) / (c->y.high - c->y.low);
    if (!isfinite(x) || !isfinite(y)) return 0;
    at[0] = limited(f->left + x * (f->right - f->left));
    at[1] = limited(f->bottom - y * (f->bottom - f->top));
    return 1;
}

static int inside(const ex_box *b, const double at[2]) {
    return at[0] >= b->left - 1e-6 && at[0] <= b->right + 1e-6 && at[1] >= b->top - 1e-6 && at[1] <= b->bottom + 1e-6;
}

/* Clips the parameter interval of a line against the box, side by side. */
static int line_meets(const ex_box *b, const double from[2], const double to[2]) {
    const double low[2] = { b->left, b->top }, high[2] = { b->right, b->bottom };
    double first = 0.0, last = 1.0;
    for (int k = 0; k < 2; k++) {
        double d = to[k] - from[k];
        if (fabs(d) < 1e-9) {
            if (from[k] < low[k] || from[k] > high[k]) return 0;
            continue;
        }
        first = fmax(first, ((d > 0.0 ? low[k] : high[k]) - from[k]) / d);
        last = fmin(last, ((d > 0.0 ? high[k] : low[k]) - from[k]) / d);
    }
    return first <= last;
}

static int overlap(const ex_box *a, const ex_box *b) {
    return a->left < b->right && a->right > b->left && a->top < b->bottom && a->bottom > b->top;
}

/* Long curves are sampled; it is only about the places of texts. */
static int points_covered(const chart *c, const ex_box *b) {
    int hits = 0;
    for (int i = 0; i < c->count; i++) {
        const ex_curve *curve = &c->curves[i];
        double at[2], last[2];
        size_t stride = 1 + curve->count / 1000;
        int joined = 0;
        for (size_t j = 0; j < curve->count; j += stride) {
            int ok = place_point(c, curve, j, at);
            if (ok && joined && curve->style != 2 && curve->style != EX_NOTE) hits += line_meets(b, last, at);
            else if (ok) hits += inside(b, at);
            if (ok) memcpy(last, at, sizeof last);
            joined = ok;
        }
    }
    return hits;
}

/* Places for the name of a note, from the nearest on: left or right of its point, below or above. */
static ex_box note_place(const chart *c, const char *name, const double at[2], int i) {
    const double g = c->size, width = ex_label_width(0.8 * g, name), away = 3 * (i / 4);
    const double left = i % 2 ? at[0] + 4 * g : at[0] - 4 * g - width;
    const double top = at[1] + g * (i % 4 < 2 ? 1 + away : -10 - away);
    return (ex_box){ left, top, left + width, top + 9 * g };
}

static int in_legend(const ex_curve *curve) { return curve->name && curve->style != EX_NOTE; }

static void legend_extent(const chart *c, double *width, double *height) {
    double widest = 0.0;
    int lines = 0;
    for (int i = 0; i < c->count; i++) {
        if (!in_legend(&c->curves[i])) continue;
        widest = fmax(widest, ex_label_width(c->size, c->curves[i].name));
        lines++;
    }
    *width = widest + 40 * c->size;
    *height = lines > 0 ? (13 * lines + 5) * c->size : 0.0;
}

/* Tries a raster of places, corners first, and returns how many points are hidden at the best one. */
static int place_legend(chart *c) {
    static const double parts[5] = { 1.0, 0.0, 0.5, 0.75, 0.25 };
    double width, height, gap = 6 * c->size;
    int least = -1;
    legend_extent(c, &width, &height);
    for (int k = 0; k < 25 && least != 0 && height > 0.0; k++) {
        const ex_box *f = &c->frame;
        double x = f->left + gap + parts[k % 5] * (f->right - f->left - 2 * gap - width);
        double y = f->bottom - gap - height - parts[k / 5] * (f->bottom - f->top - 2 * gap - height);
        ex_box b = { x - gap, y - gap, x + width + gap, y + height + gap };
        int hits = points_covered(c, &b);
        if (least >= 0 && hits >= least) continue;
        least = hits;
        c->legend = (ex_box){ floor(x), floor(y), floor(x + width), floor(y + height) };
    }
    return least > 0 ? least : 0;
}

/* Within the frame, off the legend and earlier notes; the nearer the better, and the fewer points are hidden. */
static void place_note(chart *c, note *n) {
    const ex_box *f = &c->frame;
    const double rim = 3 * c->size;
    int least = INT_MAX;
    n->box = note_place(c, n->name, n->at, 0);
    for (int i = 0; i < 64; i++) {
        const ex_box b = note_place(c, n->name, n->at, i);
        const ex_box wide = { b.left - rim, b.top - rim, b.right + rim, b.bottom + rim };
        int cost = i / 4, off = b.left > f->left && b.right < f->right && b.top > f->top && b.bottom < f->bottom;
        off = off && !overlap(&b, &c->legend);
        for (const note *other = c->notes; other < n && off; other++) off = !overlap(&b, &other->box);
        if (off && cost < least) cost += 3 * points_covered(c, &wide);
        if (!off || cost >= least) continue;
        least = cost;
        n->box = b;
    }
}

static void place_notes(chart *c) {
    for (int i = 0; i < c->count; i++) {
        const ex_curve *curve = &c->curves[i];
        if (curve->style != EX_NOTE || !curve->name) continue;
        for (size_t j = 0; j < curve->count && c->note_count < NOTES; j++) {
            note *n = &c->notes[c->note_count];
            if (!place_point(c, curve, j, n->at) || !inside(&c->frame, n->at)) continue;
            n->name = curve->name;
            place_note(c, n);
            c->note_count++;
        }
    }
}

/* Makes room above the curves when the legend fits nowhere between them. */
static void arrange(chart *c) {
    range wanted;
    c->x = make_range(c, 0);
    c->y = wanted = make_range(c, 1);
    for (int attempt = 0; attempt < 6; attempt++) {
        lay_out(c);
        if (place_legend(c) == 0 || !c->y.automatic) return;
        c->y.high += 0.1 * (wanted.high - wanted.low);
    }
    c->y = wanted;
    lay_out(c);
    place_legend(c);
}

/* ---- drawing on the fine image ------------------------------------------ */

static void fine_line(chart *c, const ex_box *clip, const double from[2], const double to[2], double half_width,
                      const double rgb[3]) {
    const ex_box b = { clip->left * FINE, clip->top * FINE, clip->right * FINE, clip->bottom * FINE };
    const double a[2] = { from[0] * FINE, from[1] * FINE };
    const double e[2] = { to[0] * FINE, to[1] * FINE };
    ex_stroke(&c->fine, &b, a, e, half_width * FINE, rgb);
}

/* Draws the dashes of one straight piece; travelled carries the pattern over to the next one. */
static void fine_dashes(chart *c, const ex_box *clip, const double from[2], const double to[2], const double rgb[3],
                        double *travelled) {
    double length = hypot(to[0] - from[0], to[1] - from[1]);
    double dash = 5 * c->size, period = 9 * c->size, done = 0.0;
    while (done < length) {
        double phase = fmod(*travelled, period);
        double step = fmin(length - done, phase < dash ? dash - phase : period - phase);
        double s = done / length, e = (done + step) / length;
        double a[2] = { from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]) };
        double b[2] = { from[0] + e * (to[0] - from[0]), from[1] + e * (to[1] - from[1]) };
        if (phase < dash) fine_line(c, clip, a, b, 0.6 * c->size, rgb);
        done += step + 1e-9;
        *travelled += step + 1e-9;
    }
}

/* Half the width of a marker, y from its middle in units of its radius. */
static double marker_width(int shape, double y) {
    switch (shape) {
    case 0: return sqrt(1.0 - y * y);
    case 1: return fabs(y) < 0.85 ? 0.85 : 0.0;
    case 2: return 0.55 * (y + 1.0);
    default: return 1.1 * (1.0 - fabs(y));
    }
}

static void fine_marker(chart *c, const double at[2], int colour) {
    double radius = 2.9 * c->size * FINE;
    double x = at[0] * FINE, y = at[1] * FINE;
    for (double row = ceil(y - radius); row < y + radius; row++) {
        double w = radius * marker_width(colour % 4, (row - y) / radius);
        ex_fill(&c->fine, (ex_box){ x - w, row, x + w, row + 1 }, palette[colour]);
    }
}

static int colour_of(const ex_curve *curve) { return (curve->colour % COLOURS + COLOURS) % COLOURS; }

static void draw_piece(chart *c, const ex_box *clip, const ex_curve *curve, const double from[2], const double to[2],
                       double *travelled) {
    const double *rgb = palette[colour_of(curve)];
    if (curve->style == 2 || curve->style == EX_NOTE || !line_meets(clip, from, to)) return;
    if (curve->style == 1) fine_dashes(c, clip, from, to, rgb, travelled);
    else fine_line(c, clip, from, to, 0.6 * c->size, rgb);
}

static void draw_curve(chart *c, const ex_curve *curve) {
    double at[2], last[2], travelled = 0.0;
    int joined = 0;
    for (size_t i = 0; i < curve->count; i++) {
        int ok = place_point(c, curve, i, at);
        if (ok && joined) draw_piece(c, &c->frame, curve, last, at, &travelled);
        if (ok && curve->style >= 2 && inside(&c->frame, at)) fine_marker(c, at, colour_of(curve));
        if (ok) memcpy(last, at, sizeof last);
        joined = ok;
    }
}

/* From a point to its name, where that stands apart. */
static void draw_leads(chart *c) {
    static const double grey[3] = { 150, 150, 150 };
    for (const note *n = c->notes; n < c->notes + c->note_count; n++) {
        const ex_box *b = &n->box;
        const double to[2] = { b->left > n->at[0] ? b->left : b->right, b->top > n->at[1] ? b->top : b->bottom };
        if (fabs(to[1] - n->at[1]) > 3 * c->size) fine_line(c, &c->frame, n->at, to, 0.3 * c->size, grey);
    }
}

static double tick_place(const chart *c, int is_y, double value) {
    const ex_box *f = &c->frame;
    const range *r = is_y ? &c->y : &c->x;
    double part = (value - r->low) / (r->high - r->low);
    return floor(is_y ? f->bottom - part * (f->bottom - f->top) : f->left + part * (f->right - f->left));
}

static void grid_line(chart *c, int is_y, double value, double grey) {
    const double rgb[3] = { grey, grey, grey };
    double at = tick_place(c, is_y, value) * FINE;
    ex_box b = { c->frame.left * FINE, c->frame.top * FINE, c->frame.right * FINE, c->frame.bottom * FINE };
    if (is_y) b.top = at, b.bottom = at + FINE;
    else b.left = at, b.right = at + FINE;
    ex_fill(&c->fine, b, rgb);
}

static void draw_grid(chart *c, int is_y) {
    const range *r = is_y ? &c->y : &c->x;
    const ex_ticks *t = is_y ? &c->y_ticks : &c->x_ticks;
    int crowded = r->high - r->low > 7.0;
    for (double d = floor(r->low); r->log && !crowded && d < r->high; d++)
        for (int m = 2; m < 10; m++) {
            double value = d + log10(m);
            if (value > r->low && value < r->high) grid_line(c, is_y, value, 241);
        }
    for (int i = 0; i < t->count; i++) grid_line(c, is_y, t->value[i], 222);
}

static void draw_legend_samples(chart *c) {
    const ex_box *b = &c->legend;
    const ex_box area = { b->left * FINE, b->top * FINE, b->right * FINE, b->bottom * FINE };
    double y = b->top + 9 * c->size;
    ex_fill(&c->fine, area, white);
    for (int i = 0; i < c->count; i++) {
        double from[2] = { b->left + 6 * c->size, y }, to[2], middle[2];
        double travelled = 0.0;
        if (!in_legend(&c->curves[i])) continue;
        to[0] = from[0] + 23 * c->size;
        middle[0] = 0.5 * (from[0] + to[0]);
        to[1] = middle[1] = y;
        draw_piece(c, b, &c->curves[i], from, to, &travelled);
        if (c->curves[i].style >= 2) fine_marker(c, middle, colour_of(&c->curves[i]));
        y += 13 * c->size;
    }
}

/* ---- texts on the page -------------------------------------------------- */

static void put_text(const chart *c, double x, double y, int align, int upward, const char *text) {
    ex_label(c->page, c->x0 + x, c->y0 + y, c->size, align, upward, text);
}

static void draw_notes(const chart *c) {
    for (const note *n = c->notes; n < c->notes + c->note_count; n++) {
        const double y = c->y0 + (n->box.top + n->box.bottom) / 2;
        ex_label(c->page, c->x0 + n->box.left, y, 0.8 * c->size, EX_LEFT, 0, n->name);
    }
}

static void draw_tick_texts(const chart *c) {
    const ex_box *f = &c->frame;
    double g = c->size;
    char text[32];
    for (int i = 0; i < c->x_ticks.count; i++)
        put_text(c, tick_place(c, 0, c->x_ticks.value[i]), f->bottom + 9 * g, EX_MIDDLE, 0, c->x_ticks.text[i]);
    for (int i = 0; i < c->y_ticks.count; i++)
        put_text(c, f->left - 5 * g, tick_place(c, 1, c->y_ticks.value[i]), EX_RIGHT, 0, c->y_ticks.text[i]);
    snprintf(text, sizeof text, EX_TIMES "10^%d", c->y_ticks.exponent);
    if (c->y_ticks.exponent) put_text(c, f->left, f->top - 7 * g, EX_LEFT, 0, text);
    snprintf(text, sizeof text, EX_TIMES "10^%d", c->x_ticks.exponent);
    if (c->x_ticks.exponent) put_text(c, f->right, f->bottom + 24 * g, EX_RIGHT, 0, text);
}

static void draw_axis_texts(const chart *c) {
    const ex_box *f = &c->frame;
    const ex_axes *a = c->axes;
    double g = c->size, x = 0.5 * (f->left + f->right);
    if (a->x_label) put_text(c, x, f->bottom + 25 * g, EX_MIDDLE, 0, a->x_label);
    if (a->y_label) put_text(c, 11 * g, 0.5 * (f->top + f->bottom), EX_MIDDLE, 1, a->y_label);
    if (a->title)
        ex_label(c->page, c->x0 + x, c->y0 + 11 * g, ex_label_size(1.15 * g, f->right - f->left - 60 * g, a->title),
                 EX_MIDDLE, 0, a->title);
}

static void draw_legend_texts(const chart *c) {
    double y = c->legend.top + 9 * c->size;
    for (int i = 0; i < c->count; i++) {
        if (!in_legend(&c->curves[i])) continue;
        put_text(c, c->legend.left + 34 * c->size, y, EX_LEFT, 0, c->curves[i].name);
        y += 13 * c->size;
    }
}

static int draw_chart(chart *c) {
    int smaller = c->width < c->height ? c->width : c->height;
    ex_box border;
    c->size = fmin(fmax(smaller / 290.0, 1.0), 4.0);
    arrange(c);
    place_notes(c);
    if (ex_image_create(&c->fine, c->width * FINE, c->height * FINE)) return 1;
    draw_grid(c, 0);
    draw_grid(c, 1);
    draw_leads(c);
    for (int i = 0; i < c->count; i++) draw_curve(c, &c->curves[i]);
    draw_legend_samples(c);
    ex_shrink_into(c->page, c->x0, c->y0, &c->fine, FINE);
    ex_image_destroy(&c->fine);
    border = (ex_box){ c->x0 + c->frame.left, c->y0 + c->frame.top, c->x0 + c->frame.right, c->y0 + c->frame.bottom };
    ex_frame(c->page, border);
    draw_tick_texts(c);
    draw_axis_texts(c);
    draw_legend_texts(c);
    draw_notes(c);
    return 0;
}

int ex_plot_grid(const char *path, int panel_width, int panel_height, const ex_axes *axes,
                 const ex_curve *const *curves, const int *counts, int panels, int columns) {
    ex_image page;
    int rows, bad = 0;
    if (panels < 1 || columns < 1) return 1;
    if (columns > panels) columns = panels;
    rows = (panels + columns - 1) / columns;
    if (ex_image_create(&page, panel_width * columns, panel_height * rows)) return 1;
    for (int i = 0; i < panels && !bad; i++) {
        chart c = { .page = &page,
                    .axes = &axes[i],
                    .curves = curves[i],
                    .count = counts[i],
                    .x0 = i % columns * panel_width,
                    .y0 = i / columns * panel_height,
                    .width = panel_width,
                    .height = panel_height };
        bad = draw_chart(&c);
    }
    bad = bad || ex_image_write_png(&page, path);
    ex_image_destroy(&page);
    return bad;
}

int ex_plot(const char *path, int width, int height, const ex_axes *axes, const ex_curve *curves, int count) {
    return ex_plot_grid(path, width, height, axes, &curves, &count, 1, 1);
}
