/* Smoothing kernels: normalised, compact, monotone, with the right derivative. */
#include "support.h"

enum { KERNELS = 4 };
static const tlsph_kernel kernels[KERNELS] = {TLSPH_CUBIC_SPLINE, TLSPH_QUADRATIC, TLSPH_WENDLAND_C2, TLSPH_WENDLAND_C4};

/* 5-point Gauss-Legendre on [-1, 1]: exact to degree 9, so for a cubic times r^2. */
static const double gauss_x[5] = {-0.906179845938663992797627, -0.538469310105683091036314, 0,
                                  0.538469310105683091036314, 0.906179845938663992797627};
static const double gauss_w[5] = {0.236926885056189087514264, 0.478628670499366468041292, 0.568888888888888888888889,
                                  0.478628670499366468041292, 0.236926885056189087514264};

static double kernel_value(tlsph_kernel kernel, int dimension, double r, double h)
{
    tlsph_real W, dW;
    tlsph_kernel_evaluate(kernel, dimension, R(r), R(h), &W, &dW);
    return (double)W;
}

static double kernel_slope(tlsph_kernel kernel, int dimension, double r, double h)
{
    tlsph_real W, dW;
    tlsph_kernel_evaluate(kernel, dimension, R(r), R(h), &W, &dW);
    return (double)dW;
}

/* Integral of W over the disk or ball of radius 2h; the kernels are polynomials on [0, h] and [h, 2h], of degree 8 at most
   (10 with r^2), so that each half is cut in four. */
static double integral(tlsph_kernel kernel, int dimension, double h)
{
    double sum = 0;
    int piece, k;
    for (piece = 0; piece < 8; piece++)
        for (k = 0; k < 5; k++) {
            double r = h * (piece + 0.5 + 0.5 * gauss_x[k]) / 4;
            double shell = dimension == 2 ? 2 * PI * r : 4 * PI * r * r;
            sum += 0.125 * h * gauss_w[k] * shell * kernel_value(kernel, dimension, r, h);
        }
    return sum;
}

TEST(normalised)
{
    int i, dimension;
    for (i = 0; i < KERNELS; i++)
        for (dimension = 2; dimension <= 3; dimension++) {
            CHECK_CLOSE(integral(kernels[i], dimension, 1), 1, ROUNDED(1e-10, 50));
            CHECK_CLOSE(integral(kernels[i], dimension, 0.037), 1, ROUNDED(1e-10, 50));
        }
}

TEST(compact_support)
{
    int i, dimension;
    double h = 0.5;
    for (i = 0; i < KERNELS; i++)
        for (dimension = 2; dimension <= 3; dimension++) {
            double centre = kernel_value(kernels[i], dimension, 0, h), r;
            CHECK(kernel_value(kernels[i], dimension, 1.9 * h, h) > 0);
            CHECK_CLOSE(kernel_value(kernels[i], dimension, 2 * h, h), 0, 20 * EPSILON * centre);
            CHECK_CLOSE(kernel_slope(kernels[i], dimension, 2 * h, h), 0, 20 * EPSILON * centre / h);
            for (r = 2.001 * h; r < 5 * h; r += 0.1 * h) {
                CHECK(kernel_value(kernels[i], dimension, r, h) == 0);
                CHECK(kernel_slope(kernels[i], dimension, r, h) == 0);
            }
        }
}

/* Central differences; their error is step^2 W'''/6 plus the rounding of W over the step. */
TEST(slope_is_the_derivative)
{
    int i, dimension;
    double h = 0.7, step = h * cbrt(EPSILON), r;
    for (i = 0; i < KERNELS; i++)
        for (dimension = 2; dimension <= 3; dimension++) {
            double scale = kernel_value(kernels[i], dimension, 0, h) / h;
            for (r = 0.05 * h; r < 1.95 * h; r += 0.0637 * h) {
                /* the step that float really takes */
                double up = (double)R(r + step), down = (double)R(r - step);
                double slope = (kernel_value(kernels[i], dimension, up, h) - kernel_value(kernels[i], dimension, down, h)) /
                               (up - down);
                CHECK_CLOSE(kernel_slope(kernels[i], dimension, r, h), slope, 20 * scale * cbrt(EPSILON * EPSILON));
            }
        }
}

TEST(monotone)
{
    int i, dimension;
    double h = 1, r;
    for (i = 0; i < KERNELS; i++)
        for (dimension = 2; dimension <= 3; dimension++)
            for (r = 0.01; r < 2; r += 0.01) {
                CHECK(kernel_value(kernels[i], dimension, r, h) < kernel_value(kernels[i], dimension, r - 0.01, h));
                CHECK(kernel_slope(kernels[i], dimension, r, h) <= 0);
            }
}

/* W(r; h) = W(r/h; 1) / h^dimension */
TEST(scales_with_h)
{
    int i, dimension;
    for (i = 0; i < KERNELS; i++)
        for (dimension = 2; dimension <= 3; dimension++) {
            double one = kernel_value(kernels[i], dimension, 0.75, 1), small = kernel_value(kernels[i], dimension, 0.1875, 0.25);
            CHECK_CLOSE(small, one * pow(4, dimension), 30 * EPSILON * small);
        }
}

SUITE(kernels, ENTRY(normalised), ENTRY(compact_support), ENTRY(slope_is_the_derivative), ENTRY(monotone),
      ENTRY(scales_with_h))
