/* The implicit reproducing-kernel bar (003 section 9): patch test, orders, exact solutions, growth. */
#include "physics.h"

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Table 2 with twenty sets of nodes: corrected methods exact, the others in this order. */
TEST(patch_test) {
    double median[RKPM_METHODS];
    DOUBLE_ONLY();
    for (int m = 0; m < RKPM_METHODS; m++) {
        double u[20], theta[20];
        for (int s = 0; s < 20; s++) {
            REQUIRE(rkpm_patch((rkpm_method)m, 11, 0.4, (unsigned long)s + 1, &u[s], &theta[s]) == 0);
            if (m != RKPM_VC_DNI && m != RKPM_VC_NSNI) continue;
            CHECK_BELOW(u[s], 1e-12);
            CHECK_BELOW(theta[s], 1e-12);
        }
        qsort(theta, 20, sizeof *theta, by_value);
        median[m] = theta[10];
    }
    CHECK(median[RKPM_DNI] > 3 * median[RKPM_NSNI]);
    CHECK(median[RKPM_NSNI] > 3 * median[RKPM_GAUSS]);
    REPORT("DNI %.2e, NSNI %.2e, Gauss %.2e", median[RKPM_DNI], median[RKPM_NSNI], median[RKPM_GAUSS]);
}

static danilovskaya_errors errors_of(const rkpm_parameters *p, double end) {
    danilovskaya_errors e = { HUGE_VAL, HUGE_VAL, HUGE_VAL, 0 };
    rkpm_bar *bar = rkpm_create(p);
    int bad = !CHECK(bar != NULL);
    while (!bad && rkpm_time(bar) < end * (1 - 1e-9)) bad = rkpm_step(bar);
    if (CHECK(!bad)) e = rkpm_compare(bar);
    rkpm_destroy(bar);
    return e;
}

/* Figure 12: second order in space. */
TEST(quasi_static_second_order) {
    double u[3], theta[3];
    DOUBLE_ONLY();
    for (int i = 0; i < 3; i++) {
        rkpm_parameters p;
        danilovskaya_errors e;
        rkpm_default(&p);
        p.method = RKPM_NSNI;
        p.quasi_static = 1;
        p.spacing = 0.2 / (1 << i);
        p.time_step = 0.25 * p.spacing * p.spacing;
        e = errors_of(&p, 2);
        u[i] = e.u;
        theta[i] = e.theta;
    }
    CHECK(observed_order(u, 3) > 1.8);
    CHECK(observed_order(theta, 3) > 1.8);
    REPORT("orders %.2f %.2f", observed_order(u, 3), observed_order(theta, 3));
}

/* Uneven nodes need both stabilisation and correction. */
TEST(quasi_static_uneven_nodes) {
    danilovskaya_errors e[RKPM_METHODS];
    DOUBLE_ONLY();
    for (int m = 0; m < RKPM_METHODS; m++) {
        rkpm_parameters p;
        rkpm_default(&p);
        p.method = m;
        p.quasi_static = 1;
        p.spacing = 0.04;
        p.time_step = 0.02;
        p.jitter = 0.4;
        e[m] = errors_of(&p, 2);
    }
    CHECK(e[RKPM_DNI].theta > 3 * e[RKPM_NSNI].theta);
    CHECK(e[RKPM_NSNI].theta > 2 * e[RKPM_VC_NSNI].theta);
    CHECK_BELOW(e[RKPM_GAUSS].theta, 1e-4);
}

TEST(dynamic_problems) {
    DOUBLE_ONLY();
    for (int i = 0; i < 6; i++) {
        rkpm_parameters p;
        danilovskaya_errors e;
        rkpm_default(&p);
        p.problem = i % 3;
        p.method = i < 3 ? RKPM_NSNI : RKPM_VC_NSNI;
        p.spacing = 0.04;
        p.time_step = 0.02;
        e = errors_of(&p, 2);
        CHECK_BELOW(e.theta, i % 3 ? 2.5e-3 : 4e-3);
        CHECK_BELOW(e.u, i < 3 ? 5e-3 : 0.015);
    }
}

/* Free vibrations keep their amplitude where the stiffness is symmetric and positive, and grow where it is not. */
TEST(growth_comes_from_asymmetry) {
    rkpm_parameters p;
    double whole, part, plain;
    DOUBLE_ONLY();
    rkpm_default(&p);
    p.length = 2;
    p.spacing = 0.05;
    p.time_step = 0.0125;
    p.jitter = 0.4;
    p.lumped = 1;
    p.seed = 1;
    REQUIRE(rkpm_growth(&p, 40, &whole) == 0);
    p.symmetric = 1;
    REQUIRE(rkpm_growth(&p, 40, &part) == 0);
    p.symmetric = 0;
    p.method = RKPM_NSNI;
    REQUIRE(rkpm_growth(&p, 40, &plain) == 0);
    CHECK(whole > 0.05);
    CHECK_BELOW(part, 0.01);
    CHECK_BELOW(plain, 0.01);
    REPORT("VC-NSNI %.3f, its symmetric part %.3f, NSNI %.3f", whole, part, plain);
}

TEST(too_few_nodes_are_refused) {
    rkpm_parameters p;
    rkpm_default(&p);
    p.spacing = p.length = 1;
    p.length = 0.4; /* one node */
    CHECK(rkpm_create(&p) == NULL);
}

SUITE(physics_rkpm, ENTRY(patch_test), ENTRY(quasi_static_second_order), ENTRY(quasi_static_uneven_nodes),
      ENTRY(dynamic_problems), ENTRY(growth_comes_from_asymmetry), ENTRY(too_few_nodes_are_refused))
