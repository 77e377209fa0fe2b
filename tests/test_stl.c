/* STL files, and a cloud in the surface that they hold. */
#include "physics.h"

static const char *path(void) { return "build/test_stl.stl"; }

static int write_bytes(const void *bytes, size_t size)
{
    FILE *file = fopen(path(), "wb");
    const size_t written = file ? fwrite(bytes, 1, size, file) : 0;
    return !file || fclose(file) || written != size;
}

TEST(both_formats_keep_every_bit)
{
    ex_triangles made, read;
    char why[EX_WHY];
    REQUIRE(stl_part_bracket(&made) == 0);
    for (int ascii = 0; ascii < 2; ascii++) {
        REQUIRE(ex_stl_write(path(), &made, ascii) == 0);
        REQUIRE(ex_stl_read(path(), 1, &read, why) == 0);
        CHECK(read.count == made.count && !memcmp(read.corners, made.corners, 9 * made.count * sizeof *made.corners));
        ex_stl_free(&read);
    }
    REQUIRE(ex_stl_read(path(), 0.25, &read, why) == 0);
    CHECK_CLOSE(read.corners[0], made.corners[0] / 4, 0);
    ex_stl_free(&read);
    ex_stl_free(&made);
}

TEST(bad_files_say_what_is_wrong)
{
    static const struct { const char *text, *says; } cases[] = {
        { "", "neither" }, { "junk", "neither" }, { "solid s\nendsolid s\n", "no facets in 3 lines" },
        { "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0\nvertex 0 1 0\n", "line 5: a corner" },
        { "solid s\nfacet\nvertex 0 0 0\nvertex 1 0 0\nendfacet\n", "line 5: a facet with other than three" },
        { "solid s\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n", "not complete" } };
    ex_triangles made, read;
    char why[EX_WHY];
    unsigned char bytes[400] = { 0 };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        REQUIRE(write_bytes(cases[i].text, strlen(cases[i].text)) == 0);
        CHECK(ex_stl_read(path(), 1, &read, why) != 0 && read.count == 0 && !read.corners);
        if (!CHECK(strstr(why, cases[i].says) != NULL)) REPORT("%s", why);
    }
    bytes[80] = 6; /* truncated: 6 triangles take 384 bytes */
    REQUIRE(write_bytes(bytes, 383) == 0);
    CHECK(ex_stl_read(path(), 1, &read, why) != 0 && strstr(why, "take 384 bytes, found 383") != NULL);
    REQUIRE(write_bytes(bytes, 384) == 0);
    CHECK(ex_stl_read(path(), 1, &read, why) == 0 && read.count == 6);
    ex_stl_free(&read);
    CHECK(ex_stl_read("build/no such file", 1, &made, why) != 0 && strstr(why, "cannot be read") != NULL);
}

/* Middle of the edge of facet f that is nearest to X: how far away? */
static double from_facet(const double *c, const double X[3])
{
    double least = HUGE_VAL;
    for (int k = 0; k < 3; k++) {
        double sum = 0;
        for (int j = 0; j < 3; j++) sum += pow((c[3 * k + j] + c[3 * ((k + 1) % 3) + j]) / 2 - X[j], 2);
        least = fmin(least, sqrt(sum));
    }
    return least;
}

TEST(leaks_and_flipped_facets_are_found)
{
    stl_part_parameters p;
    stl_part part;
    tlsph_error error;
    double facet[9];
    stl_part_default(&p);
    p.spacing = 0.02;
    p.options.threads = 1;
    REQUIRE(stl_part_bracket(&p.surface) == 0);
    const size_t n = p.surface.count, bytes = sizeof facet;
    for (size_t f = 0; f < n; f += 37) {
        double *c = p.surface.corners + 9 * f, *last = p.surface.corners + 9 * (n - 1);
        memcpy(facet, c, bytes);
        for (int k = 0; k < 3; k++) { c[3 + k] = facet[6 + k]; c[6 + k] = facet[3 + k]; }
        CHECK_RESULT(stl_part_create(&p, &part, &error), TLSPH_ERROR_SURFACE);
        CHECK(strstr(error.message, "flipped") != NULL && strstr(error.message, "at (") != NULL);
        CHECK_BELOW(from_facet(facet, error.position), 1e-6);
        memcpy(c, last, bytes); /* leave facet f out */
        p.surface.count = n - 1;
        CHECK_RESULT(stl_part_create(&p, &part, &error), TLSPH_ERROR_SURFACE);
        CHECK(strstr(error.message, "leak") != NULL);
        CHECK_BELOW(from_facet(facet, error.position), 1e-6);
        p.surface.count = n;
        memcpy(c, facet, bytes);
    }
    ex_stl_free(&p.surface);
}

TEST(bracket_as_a_cloud)
{
    stl_part_parameters p;
    stl_part part;
    tlsph_ledger l;
    tlsph_error error;
    stl_part_default(&p);
    p.spacing = 0.012;
    p.options.threads = 1;
    REQUIRE(stl_part_bracket(&p.surface) == 0);
    /* the L without a polygon of 54 corners on the circle of the hole */
    const double exact = 0.02 * (0.1 * 0.1 - 0.06 * 0.06 - SCENE_PI * 0.012 * 0.012);
    if (!CHECK_RESULT(stl_part_create(&p, &part, &error), TLSPH_OK)) { REPORT("%s", error.message); return; }
    ex_stl_free(&p.surface);
    CHECK_CLOSE(part.volume, exact, 1e-3 * exact);
    tlsph_ledger_read(part.body.solver, &l);
    CHECK_CLOSE(l.mass, 1100 * part.volume, 1e4 * EPSILON * l.mass);
    for (int k = 0; k < 3; k++) CHECK_CLOSE(l.centre[k], part.centre[k], 1e4 * EPSILON * 0.1);
    CHECK_CLOSE(part.face, 0.04 * 0.02, 0.02 * 0.0008); /* cells of particles behind the face may reach it */
    for (int i = 0; i < 200; i++) REQUIRE_OK(tlsph_step(part.body.solver, R(1e9)));
    tlsph_ledger_read(part.body.solver, &l);
    CHECK(length3(l.impulse) > 0);
    CHECK_BELOW(length3(l.linear_residual) / length3(l.impulse), 1e5 * EPSILON);
    CHECK_BELOW(length3(l.angular_residual) / (0.1 * length3(l.impulse)), 1e5 * EPSILON);
    scene_destroy(&part.body);
}

SUITE(stl, ENTRY(both_formats_keep_every_bit), ENTRY(bad_files_say_what_is_wrong),
      ENTRY(leaks_and_flipped_facets_are_found), ENTRY(bracket_as_a_cloud))
