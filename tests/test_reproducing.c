/* Reproducing-kernel shape functions and nodal weights (003 section 3). */
#include "support.h"

enum { SIDE = 7 };
typedef struct cloud { tlsph_real X[3 * SIDE * SIDE * SIDE], radius[SIDE * SIDE * SIDE]; tlsph_nodes nodes; } cloud;

/* A jittered lattice of spacing h in the unit box times `scale`, with supports of different width. */
static void fill(cloud *c, int dimension, int order, double scale, uint64_t seed) {
    const double h = scale / (SIDE - 1);
    size_t count = 0;
    for (int k = 0; k < (dimension > 2 ? SIDE : 1); k++)
        for (int j = 0; j < (dimension > 1 ? SIDE : 1); j++)
            for (int i = 0; i < SIDE; i++, count++) {
                const int at[3] = { i, j, k };
                for (int d = 0; d < 3; d++)
                    c->X[3 * count + (size_t)d] = R(d < dimension ? h * (at[d] + random_between(&seed, -0.2, 0.2)) : 0);
                c->radius[count] = R(h * random_between(&seed, 2.7, 3.1));
            }
    c->nodes.dimension = dimension;
    c->nodes.order = order;
    c->nodes.kernel = TLSPH_CUBIC_SPLINE;
    c->nodes.count = count;
    c->nodes.positions = c->X;
    c->nodes.radii = c->radius;
}

typedef struct shapes {
    tlsph_real value[SIDE * SIDE * SIDE], gradient[3 * SIDE * SIDE * SIDE], implicit[3 * SIDE * SIDE * SIDE];
    tlsph_real second[9 * SIDE * SIDE * SIDE];
} shapes;
static tlsph_shape_functions into(shapes *s) {
    const tlsph_shape_functions out = { s->value, s->gradient, s->implicit, s->second };
    return out;
}

/* A polynomial of the order about the middle, its gradient and second derivatives. */
static double polynomial(const double z[3], int order, double gradient[3], double second[9]) {
    static const double a[3] = { 0.7, -0.4, 1.1 }, b[9] = { 0.5, 0.2, -0.3, 0.2, -0.8, 0.6, -0.3, 0.6, 0.9 };
    double sum = 0.3;
    for (int i = 0; i < 3; i++) {
        gradient[i] = a[i];
        sum += a[i] * z[i];
        for (int j = 0; j < 3; j++) {
            second[3 * i + j] = order == 2 ? 2 * b[3 * i + j] : 0;
            if (order == 2) {
                sum += b[3 * i + j] * z[i] * z[j];
                gradient[i] += 2 * b[3 * i + j] * z[j];
            }
        }
    }
    return sum;
}

/* Everything that the shape functions promise, for one cloud and one place. */
static void reproduces(int dimension, int order, double scale, uint64_t seed) {
    static cloud c;
    static shapes s;
    double sums[13] = { 0 }, gradient[3], second[9], z[3] = { 0, 0, 0 }, value;
    tlsph_real x[3] = { 0, 0, 0 };
    const tlsph_shape_functions out = into(&s);
    const double tolerance = 4e4 * EPSILON;
    fill(&c, dimension, order, scale, seed);
    for (int d = 0; d < dimension; d++) x[d] = R(scale * random_between(&seed, 0.05, 0.95));
    REQUIRE_OK(tlsph_reproduce(&c.nodes, x, &out, NULL));
    for (size_t a = 0; a < c.nodes.count; a++) {
        for (int d = 0; d < dimension; d++) z[d] = ((double)c.X[3 * a + (size_t)d] - (double)x[d]) / scale;
        value = polynomial(z, order, gradient, second);
        sums[0] += value * (double)s.value[a];
        for (size_t i = 0; i < 3; i++) {
            sums[1 + i] += value * (double)s.gradient[3 * a + i] * scale;
            sums[4 + i] += value * (double)s.implicit[3 * a + i] * scale;
            const double one = (double)s.second[9 * a + 3 * i + (i + 1) % 3];
            CHECK_CLOSE(s.second[9 * a + 3 * ((i + 1) % 3) + i], one, reorders() ? tolerance / scale / scale : 0);
        }
        for (size_t i = 0; i < 3; i++) sums[7 + i] += value * (double)s.second[9 * a + 4 * i] * scale * scale;
        sums[10] += (double)s.second[9 * a];
    }
    z[0] = z[1] = z[2] = 0;
    value = polynomial(z, order, gradient, second);
    CHECK_CLOSE(sums[0], value, tolerance);
    for (int i = 0; i < dimension; i++) {
        CHECK_CLOSE(sums[1 + i], gradient[i], 20 * tolerance);
        CHECK_CLOSE(sums[4 + i], gradient[i], 20 * tolerance);
        CHECK_CLOSE(sums[7 + i], order == 2 ? second[4 * i] : 0, 400 * tolerance);
    }
    CHECK_CLOSE(sums[10] * scale * scale, 0, 400 * tolerance);
}

TEST(polynomials_are_reproduced) {
    for (int dimension = 1; dimension <= 3; dimension++)
        for (int order = 1; order <= 2; order++)
            for (uint64_t seed = 1; seed <= 4; seed++) {
                reproduces(dimension, order, 1, 10 * seed);
                reproduces(dimension, order, 1e-6, 10 * seed + 1);
            }
}

/* The derivatives are those of the functions: by central differences. */
TEST(gradients_are_derivatives) {
    static cloud c;
    static shapes at, up, down;
    const double h = 1e-5;
    DOUBLE_ONLY();
    for (int dimension = 1; dimension <= 3; dimension++)
        for (int order = 1; order <= 2; order++) {
            tlsph_real x[3] = { R(0.43), R(0.38), R(0.55) };
            tlsph_shape_functions out = into(&at);
            fill(&c, dimension, order, 1, 7);
            for (int d = dimension; d < 3; d++) x[d] = 0;
            REQUIRE_OK(tlsph_reproduce(&c.nodes, x, &out, NULL));
            x[0] += R(h); out = into(&up);
            REQUIRE_OK(tlsph_reproduce(&c.nodes, x, &out, NULL));
            x[0] -= R(2 * h); out = into(&down);
            REQUIRE_OK(tlsph_reproduce(&c.nodes, x, &out, NULL));
            for (size_t a = 0; a < c.nodes.count; a++) {
                CHECK_CLOSE((up.value[a] - down.value[a]) / R(2 * h), at.gradient[3 * a], 1e-5);
                CHECK_CLOSE((up.implicit[3 * a] - down.implicit[3 * a]) / R(2 * h), at.second[9 * a], 1e-3);
            }
        }
}

TEST(out_of_reach_is_zero_and_null_is_left_out) {
    static cloud c;
    static shapes s;
    const tlsph_real x[3] = { 0, 0, 0 };
    tlsph_shape_functions out = { s.value, NULL, NULL, NULL };
    fill(&c, 2, 1, 1, 3);
    memset(&s, 1, sizeof s);
    REQUIRE_OK(tlsph_reproduce(&c.nodes, x, &out, NULL));
    CHECK(s.value[c.nodes.count - 1] == 0);
}

TEST(bad_nodes_are_refused) {
    static cloud c;
    static shapes s;
    const tlsph_shape_functions out = into(&s);
    const tlsph_real x[3] = { R(0.5), R(0.5), R(0.5) };
    tlsph_error error;
    fill(&c, 3, 1, 1, 3);
    c.nodes.order = 3;
    CHECK_RESULT(tlsph_reproduce(&c.nodes, x, &out, &error), TLSPH_ERROR_DESCRIPTION);
    c.nodes.order = 1;
    c.nodes.dimension = 4;
    CHECK_RESULT(tlsph_reproduce(&c.nodes, x, &out, &error), TLSPH_ERROR_DESCRIPTION);
    c.nodes.dimension = 3;
    c.nodes.count = 3; /* no four in reach */
    CHECK_RESULT(tlsph_reproduce(&c.nodes, x, &out, &error), TLSPH_ERROR_NEIGHBOURS);
    fill(&c, 2, 1, 1, 3); /* a plane does not determine gradients in space */
    c.nodes.dimension = 3;
    CHECK_RESULT(tlsph_reproduce(&c.nodes, x, &out, &error), TLSPH_ERROR_NEIGHBOURS);
}

TEST(nodal_weights) {
    const tlsph_real low[3] = { 0, 1, 2 }, high[3] = { 1, 3, R(2.5) }, x[3] = { R(0.25), 2, 2 };
    tlsph_real W, M[3];
    tlsph_nodal_weight(3, low, high, x, &W, M);
    CHECK_CLOSE(W, 1, 10 * EPSILON);
    CHECK_CLOSE(M[0], (0.25 * 0.25 * 0.25 + 0.75 * 0.75 * 0.75) / 3 * 2 * 0.5, 10 * EPSILON);
    CHECK_CLOSE(M[1], 2.0 / 3 * 0.5, 10 * EPSILON);
    CHECK_CLOSE(M[2], 0.125 / 3 * 2, 10 * EPSILON);
}

SUITE(reproducing, ENTRY(polynomials_are_reproduced), ENTRY(gradients_are_derivatives),
      ENTRY(out_of_reach_is_zero_and_null_is_left_out), ENTRY(bad_nodes_are_refused), ENTRY(nodal_weights))
