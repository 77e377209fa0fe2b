/* render.c - shaded orthographic pictures of particle bodies. */
#include "picture.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { FINE = 2 }; /* samples per pixel and direction */

/* One particle as the viewer sees it: x to the right, y up, z to the viewer. Over the offset (x, y) from the
 * centre, pair k of parallel faces lies at z = +-reach[k] - slope[k] . (x, y). */
typedef struct {
    double centre[3], half[3]; /* half: of the bounding box */
    double reach[3], slope[3][2], normal[3][3];
    double radius; /* > 0: a sphere, else a parallelepiped */
} solid;

typedef struct {
    double low[3], high[3];
} bounds;

typedef struct {
    ex_image im;
    double *depth;
    double scale, middle[2]; /* fine pixels per unit; centre of the window */
} canvas;

typedef struct {
    const ex_view *view;
    const ex_panel *panels;
    int count, columns, coloured;
    double axes[3][3];        /* of the viewer, as rows */
    double low, high;         /* of the colours */
    double size;              /* of the texts */
    double head, title, side; /* room above all, above each panel, right */
    bounds *extents;
    double *scales;
} scene;

static void camera_axes(const ex_camera *camera, double v[3][3]) {
    const double degree = 0.017453292519943295;
    double ca = cos(camera->azimuth * degree);
    double sa = sin(camera->azimuth * degree);
    double ce = cos(camera->elevation * degree);
    double se = sin(camera->elevation * degree);
    int c = camera->up_axis, a = (c + 1) % 3, b = (c + 2) % 3;
    v[0][a] = -sa;
    v[0][b] = ca;
    v[0][c] = 0.0;
    v[1][a] = -se * ca;
    v[1][b] = -se * sa;
    v[1][c] = ce;
    v[2][a] = ce * ca;
    v[2][b] = ce * sa;
    v[2][c] = se;
}

/* ---- particles ---------------------------------------------------------- */

/* The rows of the inverse of m, which are normal to the faces of the image of the cube [-1,1]^3. Returns the
 * determinant. */
static double face_normals(double m[3][3], double normal[3][3]) {
    double det = 0.0;
    for (int k = 0; k < 9; k++) {
        int i = k / 3, j = k % 3;
        int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
        normal[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
    }
    for (int k = 0; k < 3; k++) det += m[k][0] * normal[0][k];
    for (int k = 0; k < 9; k++) normal[k / 3][k % 3] /= det;
    return det;
}

static void prepare_faces(solid *s, int k) {
    double *n = s->normal[k];
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    /* Faces seen from the side must not divide by zero. */
    double steep = copysign(fmax(fabs(n[2]), 1e-9 * length), n[2]);
    s->reach[k] = 1.0 / fabs(steep);
    s->slope[k][0] = n[0] / steep;
    s->slope[k][1] = n[1] / steep;
    for (int i = 0; i < 3; i++) n[i] /= copysign(length, n[2]);
}

static void shape_cube(solid *s, const double *stretch, double radius, double v[3][3]) {
    double m[3][3] = { { 0 } }, det;
    for (int k = 0; k < 9; k++)
        for (int j = 0; j < 3; j++) /* a little larger, since bent neighbours gape */
            m[k / 3][k % 3] += 1.03 * radius * v[k / 3][j] * stretch[3 * j + k % 3];
    det = face_normals(m, s->normal);
    /* A particle crushed flat has no inverse; it stays a sphere. */
    if (!isfinite(det) || fabs(det) < 1e-6 * radius * radius * radius) return;
    s->radius = 0.0;
    for (int i = 0; i < 3; i++) {
        s->half[i] = fabs(m[i][0]) + fabs(m[i][1]) + fabs(m[i][2]);
        prepare_faces(s, i);
    }
}

/* Returns 0 for a particle that cannot be drawn. */
static int shape_particle(solid *s, const ex_panel *p, size_t i, double v[3][3]) {
    const double *x = p->positions + 3 * i;
    s->radius = p->radius;
    for (int k = 0; k < 3; k++) {
        s->centre[k] = v[k][0] * x[0] + v[k][1] * x[1] + v[k][2] * x[2];
        s->half[k] = p->radius;
        if (!isfinite(s->centre[k])) return 0;
    }
    if (p->stretch && p->radius > 0.0) shape_cube(s, p->stretch + 9 * i, p->radius, v);
    return p->radius > 0.0;
}

static void widen(bounds *b, const double *low, const double *high) {
    for (int k = 0; k < 3; k++) {
        b->low[k] = fmin(b->low[k], low[k]);
        b->high[k] = fmax(b->high[k], high[k]);
    }
}

static bounds panel_bounds(const ex_panel *p, double v[3][3]) {
    bounds b = { { DBL_MAX, DBL_MAX, DBL_MAX }, { -DBL_MAX, -DBL_MAX, -DBL_MAX } };
    for (size_t i = 0; i < p->count; i++) {
        solid s;
        double low[3], high[3];
        if (!shape_particle(&s, p, i, v)) continue;
        for (int k = 0; k < 3; k++) {
            low[k] = s.centre[k] - s.half[k];
            high[k] = s.centre[k] + s.half[k];
        }
        widen(&b, low, high);
    }
    return b;
}

/* ---- colours ------------------------------------------------------------ */

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int percentile_range(scene *s) {
    size_t total = 0, n = 0;
    double *sorted;
    for (int i = 0; i < s->count; i++) total += s->panels[i].count;
    sorted = malloc((total + 1) * sizeof *sorted);
    if (!sorted) return 1;
    for (int i = 0; i < s->count; i++)
        for (size_t j = 0; s->panels[i].values && j < s->panels[i].count; j++)
            if (isfinite(s->panels[i].values[j])) sorted[n++] = s->panels[i].values[j];
    qsort(sorted, n, sizeof *sorted, ascending);
    s->low = n ? sorted[(n - 1) / 50] : 0.0;
    s->high = n ? sorted[n - 1 - (n - 1) / 50] : 1.0;
    free(sorted);
    return 0;
}

static int colour_range(scene *s) {
    double spread;
    s->low = s->view->low;
    s->high = s->view->high;
    if (s->low < s->high) return 0;
    if (percentile_range(s)) return 1;
    /* The neutral middle of a diverging map belongs to zero. */
    if (s->view->map == EX_MAP_DIVERGING && s->low < 0.0 && s->high > 0.0) {
        s->high = fmax(s->high, -s->low);
        s->low = -s->high;
    }
    spread = 1e-12 * fmax(fabs(s->low), fabs(s->high)) + 1e-30;
    if (s->high - s->low < spread) {
        s->low -= spread;
        s->high += spread;
    }
    return 0;
}

static void base_colour(const scene *s, const ex_panel *p, size_t i, double rgb[3]) {
    double value = p->values ? p->values[i] : (double)NAN;
    rgb[0] = rgb[1] = rgb[2] = 165.0;
    if (!isnan(value)) ex_map_colour(s->view->map, (value - s->low) / (s->high - s->low), rgb);
}

/* ---- drawing ------------------------------------------------------------ */

/* Height z of the surface over the offset (x, y) from the centre, and its outer normal. Returns 0 where the ray
 * misses. */
static int hit_sphere(const solid *s, const double at[2], double *z, double normal[3]) {
    double z2 = s->radius * s->radius - at[0] * at[0] - at[1] * at[1];
    if (z2 < 0.0) return 0;
    *z = sqrt(z2);
    normal[0] = at[0] / s->radius;
    normal[1] = at[1] / s->radius;
    normal[2] = *z / s->radius;
    return 1;
}

static int hit_cube(const solid *s, const double at[2], double *z, double normal[3]) {
    double farthest = -DBL_MAX;
    int face = 0;
    *z = DBL_MAX;
    for (int k = 0; k < 3; k++) {
        double middle = -s->slope[k][0] * at[0] - s->slope[k][1] * at[1];
        if (middle + s->reach[k] < *z) *z = middle + s->reach[k], face = k;
        farthest = fmax(farthest, middle - s->reach[k]);
    }
    for (int k = 0; k < 3; k++) normal[k] = s->normal[face][k];
    return farthest <= *z;
}

/* Lambert light from the upper left, some light from everywhere, and edges turned away from the viewer a little
 * darker. */
static double brightness(const double n[3]) {
    double lambert = -0.38 * n[0] + 0.55 * n[1] + 0.744 * n[2];
    return (0.62 + 0.42 * fmax(lambert, 0.0)) * (0.84 + 0.16 * n[2]);
}

static void paint(canvas *c, size_t at, const double rgb[3], double light, double fog) {
    for (int k = 0; k < 3; k++) {
        double value = fmin(rgb[k] * light, 255.0);
        c->im.rgb[3 * at + (size_t)k] = (unsigned char)(value + fog * (255.0 - value));
    }
}

static void draw_particle(canvas *c, const solid *s, const bounds *b, const double rgb[3]) {
    double px = c->im.width * 0.5 + (s->centre[0] - c->middle[0]) * c->scale;
    double py = c->im.height * 0.5 - (s->centre[1] - c->middle[1]) * c->scale;
    double wx = s->half[0] * c->scale, wy = s->half[1] * c->scale, unit = 1.0 / c->scale;
    if (px - wx >= c->im.width || py - wy >= c->im.height) return;
    int left = (int)fmax(px - wx, 0.0), top = (int)fmax(py - wy, 0.0);
    double right = fmin(px + wx + 1.0, c->im.width);
    double bottom = fmin(py + wy + 1.0, c->im.height);
    for (int y = top; y < bottom; y++)
        for (int x = left; x < right; x++) {
            size_t pixel = (size_t)y * (size_t)c->im.width + (size_t)x;
            double at[2] = { (x + 0.5 - px) * unit, (py - y - 0.5) * unit };
            double z, n[3], fog;
            if (s->centre[2] + s->half[2] <= c->depth[pixel]) continue;
            if (!(s->radius > 0.0 ? hit_sphere : hit_cube)(s, at, &z, n)) continue;
            z += s->centre[2];
            if (z <= c->depth[pixel]) continue;
            c->depth[pixel] = z;
            fog = 0.18 * (b->high[2] - z) / (b->high[2] - b->low[2]);
            paint(c, pixel, rgb, brightness(n), fog);
        }
}

/* A dark line where the surface ends or jumps back makes folds readable. */
static void draw_outlines(canvas *c, double jump) {
    size_t width = (size_t)c->im.width, height = (size_t)c->im.height;
    for (size_t i = width + 1; i + width + 1 < width * height; i++) {
        double lowest = fmin(fmin(c->depth[i - 1], c->depth[i + 1]), fmin(c->depth[i - width], c->depth[i + width]));
        if (c->depth[i] - lowest <= jump) continue;
        for (size_t k = 0; k < 3; k++) c->im.rgb[3 * i + k] = (unsigned char)(c->im.rgb[3 * i + k] * 0.5);
    }
}

/* Lattices are numbered in rows; starting at the near end hides most of the rest before it costs anything. */
static int last_is_nearer(const scene *s, const ex_panel *p) {
    double nearer = 0.0;
    if (p->count < 2) return 0;
    for (int k = 0; k < 3; k++)
        nearer += s->axes[2][k] * (p->positions[3 * (p->count - 1) + (size_t)k] - p->positions[k]);
    return nearer > 0.0;
}

static void draw_body(canvas *c, scene *s, const ex_panel *p, const bounds *b) {
    size_t pixels = (size_t)c->im.width * (size_t)c->im.height;
    int backwards = last_is_nearer(s, p);
    for (size_t i = 0; i < pixels; i++) c->depth[i] = -DBL_MAX;
    for (size_t k = 0; k < p->count; k++) {
        size_t i = backwards ? p->count - 1 - k : k;
        solid shape;
        double rgb[3];
        if (!shape_particle(&shape, p, i, s->axes)) continue;
        base_colour(s, p, i, rgb);
        draw_particle(c, &shape, b, rgb);
    }
    draw_outlines(c, 3.0 * p->radius);
}

static int draw_panel(ex_image *page, scene *s, int index) {
    const ex_view *v = s->view;
    const bounds *b = &s->extents[index];
    int x = index % s->columns * v->panel_width;
    int y = (int)(s->head + s->title + index / s->columns * (s->title + v->panel_height));
    canvas c;
    if (ex_image_create(&c.im, v->panel_width * FINE, v->panel_height * FINE)) return 1;
    c.depth = malloc((size_t)c.im.width * (size_t)c.im.height * sizeof *c.depth);
    c.scale = s->scales[index] * FINE;
    for (int k = 0; k < 2; k++) c.middle[k] = 0.5 * (b->low[k] + b->high[k]);
    if (c.depth) {
        draw_body(&c, s, &s->panels[index], b);
        ex_shrink_into(page, x, y, &c.im, FINE);
    }
    free(c.depth);
    ex_image_destroy(&c.im);
    return !c.depth;
}

/* The axes of the scene, below the colour bar. */
static void draw_triad(ex_image *im, const scene *s) {
    static const double colours[3][3] = { { 190, 50, 40 }, { 40, 140, 60 }, { 45, 80, 180 } };
    static const char *const names[3] = { "x", "y", "z" };
    const ex_box page = { 0, 0, im->width, im->height };
    double arm = 13.0 * s->size;
    double from[2] = { im->width - 0.5 * s->side, im->height - 1.9 * arm };
    for (int k = 0; k < 3; k++) {
        double dx = s->axes[0][k] * arm, dy = -s->axes[1][k] * arm;
        double to[2] = { from[0] + dx, from[1] + dy };
        double length = hypot(dx, dy), away;
        ex_stroke(im, &page, from, to, 0.6 * s->size, colours[k]);
        /* An axis along the view has no room for its name. */
        if (length < 0.2 * arm) continue;
        away = 1.0 + 7.0 * s->size / length;
        ex_label(im, from[0] + dx * away, from[1] + dy * away, 0.9 * s->size, EX_MIDDLE, 0, names[k]);
    }
}

/* ---- page --------------------------------------------------------------- */

static void draw_bar(ex_image *im, const scene *s) {
    double g = s->size, left = im->width - s->side + 8 * g;
    ex_box bar = { floor(left), floor(s->head + 24 * g), floor(left + 11 * g), floor(im->height - 58 * g) };
    double length = bar.bottom - bar.top;
    ex_ticks t;
    ex_ticks_linear(&t, s->low, s->high, 6);
    for (double y = bar.top; y < bar.bottom; y++) {
        double rgb[3];
        ex_map_colour(s->view->map, (bar.bottom - y - 0.5) / length, rgb);
        ex_fill(im, (ex_box){ bar.left, y, bar.right, y + 1 }, rgb);
    }
    ex_frame(im, bar);
    for (int i = 0; i < t.count; i++) {
        double y = floor(bar.bottom - length * (t.value[i] - s->low) / (s->high - s->low));
        ex_frame(im, (ex_box){ bar.right + 1, y, bar.right + 3 * g, y });
        ex_label(im, bar.right + 6 * g, y, g, EX_LEFT, 0, t.text[i]);
    }
    if (t.exponent) {
        char text[32];
        snprintf(text, sizeof text, EX_TIMES "10^%d", t.exponent);
        ex_label(im, bar.left, bar.top - 10 * g, g, EX_LEFT, 0, text);
    }
    if (s->view->label)
        ex_label(im, bar.right + 16 * g + ex_ticks_width(&t, s->size), 0.5 * (bar.top + bar.bottom),
                 ex_label_size(g, length, s->view->label), EX_MIDDLE, 1, s->view->label);
}

static void draw_texts(ex_image *im, const scene *s) {
    const ex_view *v = s->view;
    if (v->heading)
        ex_label(im, 0.5 * im->width, 0.55 * s->head, ex_label_size(1.25 * s->size, 0.96 * im->width, v->heading),
                 EX_MIDDLE, 0, v->heading);
    for (int i = 0; i < s->count; i++) {
        const char *title = s->panels[i].title;
        double x = (i % s->columns + 0.5) * v->panel_width;
        double y = s->head + i / s->columns * (s->title + v->panel_height);
        if (!title) continue;
        ex_label(im, x, y + 0.6 * s->title, ex_label_size(s->size, 0.94 * v->panel_width, title), EX_MIDDLE, 0,
                 title);
    }
}

static double fitting_scale(const ex_view *v, const bounds *b) {
    double dx = fmax(b->high[0] - b->low[0], 1e-300);
    double dy = fmax(b->high[1] - b->low[1], 1e-300);
    return 0.88 * v->camera.zoom * fmin(v->panel_width / dx, v->panel_height / dy);
}

static void choose_scales(scene *s) {
    double least = DBL_MAX;
    bounds all = panel_bounds(&s->panels[0], s->axes);
    for (int i = 0; i < s->count; i++) {
        s->extents[i] = panel_bounds(&s->panels[i], s->axes);
        widen(&all, s->extents[i].low, s->extents[i].high);
    }
    for (int i = 0; i < s->count; i++) {
        if (s->view->common_scale == 2) s->extents[i] = all;
        s->scales[i] = fitting_scale(s->view, &s->extents[i]);
        least = fmin(least, s->scales[i]);
    }
    for (int i = 0; i < s->count && s->view->common_scale; i++) s->scales[i] = least;
}

static void lay_out(scene *s) {
    int smaller = s->view->panel_width < s->view->panel_height ? s->view->panel_width : s->view->panel_height;
    s->size = fmin(fmax(smaller / 240.0, 1.0), 3.5);
    s->head = floor(s->view->heading ? 20 * s->size : 0.0);
    s->title = 0.0;
    for (int i = 0; i < s->count; i++) {
        if (s->panels[i].title) s->title = floor(16 * s->size);
        if (s->panels[i].values) s->coloured = 1;
    }
    s->side = floor(50 * s->size);
    if (s->coloured) {
        ex_ticks t;
        ex_ticks_linear(&t, s->low, s->high, 6);
        s->side = floor(46 * s->size + ex_ticks_width(&t, s->size));
    }
}

static int draw_page(const char *path, scene *s) {
    int rows = (s->count + s->columns - 1) / s->columns, bad = 0;
    ex_image im;
    if (ex_image_create(&im, s->columns * s->view->panel_width + (int)s->side,
                        (int)(s->head + rows * (s->title + s->view->panel_height))))
        return 1;
    for (int i = 0; i < s->count && !bad; i++) bad = draw_panel(&im, s, i);
    draw_triad(&im, s);
    draw_texts(&im, s);
    if (s->coloured) draw_bar(&im, s);
    bad = bad || ex_image_write_png(&im, path);
    ex_image_destroy(&im);
    return bad;
}

int ex_render(const char *path, const ex_view *view, const ex_panel *panels, int count, int columns) {
    scene s = { .view = view, .panels = panels, .count = count };
    int bad = 1;
    if (count < 1 || columns < 1) return 1;
    s.columns = columns < count ? columns : count;
    camera_axes(&view->camera, s.axes);
    s.extents = malloc((size_t)count * sizeof *s.extents);
    s.scales = malloc((size_t)count * sizeof *s.scales);
    if (s.extents && s.scales && !colour_range(&s)) {
        choose_scales(&s);
        lay_out(&s);
        bad = draw_page(path, &s);
    }
    free(s.extents);
    free(s.scales);
    return bad;
}
