/* picture.h - drawing shared by image.c, render.c and plot.c only. */
#ifndef EX_PICTURE_H
#define EX_PICTURE_H

#include "common.h"

/* Edges in pixels; y grows downwards. */
typedef struct {
    double left, top, right, bottom;
} ex_box;

/* A straight stroke with round ends, blended where inside the clip box. */
void ex_stroke(ex_image *im, const ex_box *clip, const double from[2], const double to[2], double half_width,
               const double rgb[3]);
void ex_fill(ex_image *im, ex_box area, const double rgb[3]);
void ex_frame(ex_image *im, ex_box area);

/* Text around (x, y): align -1, 0, 1 puts its left end, middle or right end there, and y is the middle of a
 * capital letter. With upward set it reads from bottom to top. A number after '^' is raised as an exponent. A size
 * of 1 makes capitals 7 pixels high. */
#define EX_TIMES "\177" /* the sign for multiplication in the font */
enum { EX_LEFT = -1, EX_MIDDLE = 0, EX_RIGHT = 1 };
void ex_label(ex_image *im, double x, double y, double size, int align, int upward, const char *text);
double ex_label_width(double size, const char *text);
/* The size, reduced when the text would be wider than room. */
double ex_label_size(double size, double room, const char *text);

/* Averages squares of factor x factor pixels of big into small at (x, y). */
void ex_shrink_into(ex_image *small, int x, int y, const ex_image *big, int factor);

/* Round numbers inside [low, high] and their texts, which share the factor 10^exponent. */
enum { EX_MAX_TICKS = 40 };
typedef struct {
    int count, exponent;
    double value[EX_MAX_TICKS];
    char text[EX_MAX_TICKS][24];
} ex_ticks;
void ex_ticks_linear(ex_ticks *t, double low, double high, int about);
double ex_ticks_width(const ex_ticks *t, double size); /* of the widest text */

#endif
