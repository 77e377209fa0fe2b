/* tlsph_material_check: the built-in laws pass, and a user's law that is wrong in one way fails for that reason. */
#include "support.h"

#define SAMPLES 40

static tlsph_result check(const tlsph_material *material, double strain, tlsph_material_report *report)
{
    tlsph_error error;
    tlsph_result result = tlsph_material_check(material, strain, SAMPLES, report, &error);
    if (result) printf("    %s\n", error.message);
    return result;
}

TEST(built_in_materials_pass)
{
    static const tlsph_material_kind kinds[] = {TLSPH_LINEAR, TLSPH_NEO_HOOKEAN, TLSPH_MEE, TLSPH_MIE_GRUNEISEN};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        for (int mooney = 0; mooney < 2; mooney++) {
            tlsph_material material = soft_material(kinds[i]);
            tlsph_material_report report;
            material.mooney_fraction = R(0.5 * mooney);
            CHECK_RESULT(check(&material, 0.2, &report), TLSPH_OK);
            CHECK(report.wave_bound >= 0.999 && report.wave_bound < 2);
        }
    }
}

/* A neo-Hookean law, and ways to spoil it. */
typedef struct law { double mu, kappa, wrong_stress, wrong_entropy, wrong_frame, wrong_speed; } law;

static void respond(void *user, size_t count, const uint32_t *particle, const tlsph_real *F, const tlsph_real *J,
                    tlsph_response *out)
{
    const law *l = user;
    (void)particle;
    for (size_t i = 0; i < count; i++, F += 9) {
        tlsph_response *r = out + i;
        const double j = (double)J[i];
        double I1 = 0;
        memset(r, 0, sizeof *r);
        for (int k = 0; k < 9; k++) I1 += (double)F[k] * (double)F[k];
        r->energy = R(l->mu / 2 * (I1 - 3 - 2 * log(j)) + l->kappa / 2 * (j - 1) * (j - 1) +
                      l->wrong_frame * (double)(F[1] * F[1]));
        for (int k = 0; k < 9; k++) r->e_F[k] = R(l->mu * (1 + l->wrong_stress)) * F[k];
        r->e_F[1] += R(2 * l->wrong_frame) * F[1];
        r->e_J = R(l->kappa * (j - 1) - l->mu / j);
        r->entropy = R(0.01 * l->kappa * (j - 1) * (1 + l->wrong_entropy));
        r->eta_J = R(0.01 * l->kappa);
        r->p_modulus[0] = R((1 - l->wrong_speed) * (l->mu * I1 + (l->kappa + l->mu) * I1 * I1));
        r->p_modulus[1] = 0;
        r->s_modulus[0] = R(l->mu);
    }
}
static tlsph_material user_material(law *l)
{
    tlsph_material material = soft_material(TLSPH_NEO_HOOKEAN);
    l->mu = (double)material.young / 3;
    l->kappa = 2 * l->mu;
    material.kind = TLSPH_USER;
    material.specific_heat = 0; /* else the coupling, which this law has strong, would have to be in its p_modulus */
    material.response = respond;
    material.response_user = l;
    return material;
}
/* The error's field for a law that is spoilt, "" if it passes. */
static const char *fault(const law *spoilt)
{
    law l = *spoilt;
    tlsph_material material = user_material(&l);
    tlsph_material_report report;
    tlsph_error error;
    return tlsph_material_check(&material, 0.2, SAMPLES, &report, &error) ? error.field : "";
}

TEST(wrong_materials_fail)
{
    const law right = {0}, stress = {.wrong_stress = 0.01}, frame = {.wrong_frame = 1e5}, speed = {.wrong_speed = 0.95},
              entropy = {.wrong_entropy = 0.05};
    CHECK(!strcmp(fault(&right), ""));
    CHECK(!strcmp(fault(&stress), "derivative"));
    CHECK(!strcmp(fault(&frame), "objectivity"));
    CHECK(!strcmp(fault(&speed), "wave_bound"));
    CHECK(!strcmp(fault(&entropy), "derivative") || !strcmp(fault(&entropy), "entropy"));
}

TEST(bad_arguments)
{
    tlsph_material material = soft_material(TLSPH_NEO_HOOKEAN);
    tlsph_material_report report;
    tlsph_error error;
    CHECK_RESULT(tlsph_material_check(NULL, 0.1, 1, &report, &error), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_material_check(&material, 0.1, 0, &report, &error), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_material_check(&material, -1, 1, &report, &error), TLSPH_ERROR_ARGUMENT);
    CHECK_RESULT(tlsph_material_check(&material, 0.1, 1, NULL, &error), TLSPH_ERROR_ARGUMENT);
    material.poisson = R(0.5);
    CHECK_RESULT(tlsph_material_check(&material, 0.1, 1, &report, &error), TLSPH_ERROR_MATERIAL);
    material.poisson = R(0.3);
    if (sizeof(tlsph_real) == sizeof(float)) return; /* too few digits for differences near the inversions that follow */
    CHECK_RESULT(tlsph_material_check(&material, 1, SAMPLES, &report, &error), TLSPH_OK); /* many are inside out */
    CHECK(report.inverted > 0 && report.inverted < SAMPLES);
}

SUITE(self_test, ENTRY(built_in_materials_pass), ENTRY(wrong_materials_fail), ENTRY(bad_arguments))
