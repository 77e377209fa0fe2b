/* Small tensors against their definitions, written out with indices. */
#include "support.h"

#define TRIALS 50

static int levi_civita(int i, int j, int k) { return (i - j) * (j - k) * (k - i) / 2; }

static double determinant_by_definition(const tlsph_real F[9])
{
    double sum = 0;
    int i, j, k;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++) sum += levi_civita(i, j, k) * (double)F[i] * (double)F[3 + j] * (double)F[6 + k];
    return sum;
}

/* C_iI = e_ijk e_IJK A_jJ B_kK */
static double cross_by_definition(const tlsph_real A[9], const tlsph_real B[9], int i, int I)
{
    double sum = 0;
    int j, k, J, K;
    for (j = 0; j < 3; j++)
        for (k = 0; k < 3; k++)
            for (J = 0; J < 3; J++)
                for (K = 0; K < 3; K++)
                    sum += levi_civita(i, j, k) * levi_civita(I, J, K) * (double)A[3 * j + J] * (double)B[3 * k + K];
    return sum;
}

TEST(determinant)
{
    uint64_t seed = 1;
    int trial;
    tlsph_real F[9];
    for (trial = 0; trial < TRIALS; trial++) {
        random_deformation(&seed, 2, F);
        CHECK_CLOSE(tlsph_determinant(F), determinant_by_definition(F), 200 * EPSILON);
    }
}

TEST(tensor_cross_product)
{
    uint64_t seed = 2;
    int trial, i;
    tlsph_real A[9], B[9], C[9];
    for (trial = 0; trial < TRIALS; trial++) {
        for (i = 0; i < 9; i++) {
            A[i] = R(random_between(&seed, -2, 2));
            B[i] = R(random_between(&seed, -2, 2));
        }
        tlsph_cross(A, B, C);
        for (i = 0; i < 9; i++) CHECK_CLOSE(C[i], cross_by_definition(A, B, i / 3, i % 3), 100 * EPSILON);
    }
}

TEST(cofactor_is_half_the_cross_product)
{
    uint64_t seed = 3;
    int trial, i;
    tlsph_real F[9], H[9];
    for (trial = 0; trial < TRIALS; trial++) {
        random_deformation(&seed, 2, F);
        tlsph_cofactor(F, H);
        for (i = 0; i < 9; i++) CHECK_CLOSE(H[i], 0.5 * cross_by_definition(F, F, i / 3, i % 3), 100 * EPSILON);
    }
}

/* F H^T = (det F) I: independent of the index definition. */
TEST(cofactor_inverts)
{
    uint64_t seed = 4;
    int trial, i, j;
    tlsph_real F[9], H[9];
    for (trial = 0; trial < TRIALS; trial++) {
        random_deformation(&seed, 2, F);
        tlsph_cofactor(F, H);
        for (i = 0; i < 3; i++)
            for (j = 0; j < 3; j++) {
                double sum = 0;
                int k;
                for (k = 0; k < 3; k++) sum += (double)F[3 * i + k] * (double)H[3 * j + k];
                CHECK_CLOSE(sum, i == j ? determinant_by_definition(F) : 0, 400 * EPSILON);
            }
    }
}

/* Results may be written over an argument only where the header says so: it does not, so inputs must stay. */
TEST(arguments_are_left_alone)
{
    uint64_t seed = 5;
    tlsph_real A[9], kept[9], C[9];
    random_deformation(&seed, 1, A);
    memcpy(kept, A, sizeof A);
    tlsph_cofactor(A, C);
    tlsph_cross(A, A, C);
    (void)tlsph_determinant(A);
    CHECK(memcmp(A, kept, sizeof A) == 0);
}

SUITE(tensors, ENTRY(determinant), ENTRY(tensor_cross_product), ENTRY(cofactor_is_half_the_cross_product),
      ENTRY(cofactor_inverts), ENTRY(arguments_are_left_alone))
