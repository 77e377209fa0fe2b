/* Checkpoints: bitwise continuation, and refusal of damaged or foreign data. */
#include "support.h"

static const tlsph_unknowns unknown_sets[4] = {TLSPH_PF, TLSPH_PFJ, TLSPH_PFH, TLSPH_PFHJ};
static const tlsph_thermal thermals[3] = {TLSPH_ISOTHERMAL, TLSPH_ENERGY, TLSPH_ENTROPY};

static tlsph_solver *moving(const moving_block *s)
{
    tlsph_solver *solver = NULL;
    CHECK_RESULT(moving_block_create(s, &solver, NULL), TLSPH_OK);
    if (solver) {
        CHECK_RESULT(moving_block_kick(solver, 0.3), TLSPH_OK);
        CHECK_RESULT(take_steps(solver, 5), TLSPH_OK);
    }
    return solver;
}

static int same_ledger(const tlsph_solver *one, const tlsph_solver *two)
{
    tlsph_ledger a, b;
    memset(&a, 0, sizeof a);
    memset(&b, 0, sizeof b);
    tlsph_ledger_read(one, &a);
    tlsph_ledger_read(two, &b);
    return memcmp(&a, &b, sizeof a) == 0;
}

static void check_continuation(const moving_block *s)
{
    tlsph_solver *whole = moving(s), *resumed = NULL;
    unsigned char *saved;
    size_t size;
    REQUIRE(whole);
    saved = save_state(whole, &size);
    REQUIRE(saved);
    CHECK_RESULT(take_steps(whole, 20), TLSPH_OK);
    REQUIRE_OK(moving_block_create(s, &resumed, NULL));
    CHECK_SAME(tlsph_save_size(resumed), size);
    CHECK_RESULT(tlsph_restore(resumed, saved, size), TLSPH_OK);
    CHECK_SAME(tlsph_step_count(resumed), 5);
    CHECK_RESULT(take_steps(resumed, 20), TLSPH_OK);
    CHECK(state_hash(whole) == state_hash(resumed));
    CHECK(same_ledger(whole, resumed));
    CHECK(tlsph_time(whole) == tlsph_time(resumed));
    CHECK_SAME(tlsph_step_count(whole), tlsph_step_count(resumed));
    free(saved);
    tlsph_destroy(whole);
    tlsph_destroy(resumed);
}

TEST(continues_bitwise)
{
    int dimension, u, t;
    for (dimension = 2; dimension <= 3; dimension++)
        for (u = 0; u < 4; u++)
            for (t = 0; t < 3; t++) {
                moving_block s = moving_block_default();
                s.dimension = dimension;
                s.unknowns = unknown_sets[u];
                s.thermal = thermals[t];
                check_continuation(&s);
            }
}

/* Going back in the same solver, which has moved on. */
TEST(goes_back)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver = moving(&s);
    unsigned char *saved;
    size_t size;
    uint64_t then;
    REQUIRE(solver);
    saved = save_state(solver, &size);
    REQUIRE(saved);
    then = state_hash(solver);
    CHECK_RESULT(take_steps(solver, 7), TLSPH_OK);
    CHECK(state_hash(solver) != then);
    CHECK_RESULT(tlsph_restore(solver, saved, size), TLSPH_OK);
    CHECK(state_hash(solver) == then);
    free(saved);
    tlsph_destroy(solver);
}

TEST(saving_is_repeatable)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver = moving(&s);
    size_t size, again;
    unsigned char *one, *two;
    REQUIRE(solver);
    one = save_state(solver, &size);
    two = save_state(solver, &again);
    REQUIRE(one && two);
    CHECK_SAME(size, again);
    CHECK(memcmp(one, two, size) == 0);
    CHECK_RESULT(tlsph_save(solver, two, size - 1), TLSPH_ERROR_SIZE);
    CHECK_RESULT(tlsph_save(solver, two, 0), TLSPH_ERROR_SIZE);
    free(one);
    free(two);
    tlsph_destroy(solver);
}

/* Nothing of the solver may change when data is refused: its own checkpoint is the witness. */
static void check_refused(tlsph_solver *solver, const unsigned char *data, size_t size, const unsigned char *witness,
                          unsigned char *scratch)
{
    size_t own = tlsph_save_size(solver);
    CHECK_RESULT(tlsph_restore(solver, data, size), TLSPH_ERROR_CHECKPOINT);
    CHECK_RESULT(tlsph_save(solver, scratch, own), TLSPH_OK);
    CHECK(memcmp(scratch, witness, own) == 0);
}

TEST(every_damaged_byte_is_found)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver;
    unsigned char *data, *witness, *scratch;
    size_t i, size;
    s.cells = 2;
    s.dimension = 2;
    solver = moving(&s);
    REQUIRE(solver);
    data = save_state(solver, &size);
    CHECK_RESULT(take_steps(solver, 3), TLSPH_OK); /* so that a wrong restore would show */
    witness = save_state(solver, &size);
    scratch = malloc(size);
    REQUIRE(data && witness && scratch);
    for (i = 0; i < size; i++) {
        unsigned char bit = (unsigned char)(1u << (i % 8));
        data[i] ^= bit;
        check_refused(solver, data, size, witness, scratch);
        data[i] ^= bit;
    }
    CHECK_RESULT(tlsph_restore(solver, data, size), TLSPH_OK); /* the untouched one is good */
    REPORT("%d bytes", (int)size);
    free(data);
    free(witness);
    free(scratch);
    tlsph_destroy(solver);
}

TEST(truncated_data_is_refused)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver = moving(&s);
    unsigned char *data, *scratch;
    size_t size, i;
    size_t lengths[8] = {0, 1, 4, 8, 16, 64, 0, 0};
    REQUIRE(solver);
    data = save_state(solver, &size);
    scratch = malloc(size);
    REQUIRE(data && scratch);
    lengths[6] = size / 2;
    lengths[7] = size - 1;
    for (i = 0; i < 8; i++) check_refused(solver, data, lengths[i], data, scratch);
    free(data);
    free(scratch);
    tlsph_destroy(solver);
}

/* A checkpoint of `theirs` offered to a solver of the default scene. */
static void check_foreign(const moving_block *theirs)
{
    moving_block mine = moving_block_default();
    tlsph_solver *other = moving(theirs), *solver = moving(&mine);
    unsigned char *data, *witness, *scratch;
    size_t size, own;
    REQUIRE(other && solver);
    data = save_state(other, &size);
    witness = save_state(solver, &own);
    scratch = malloc(own);
    REQUIRE(data && witness && scratch);
    check_refused(solver, data, size, witness, scratch);
    free(data);
    free(witness);
    free(scratch);
    tlsph_destroy(other);
    tlsph_destroy(solver);
}

TEST(foreign_scenes_are_refused)
{
    moving_block s = moving_block_default();
    s.cells = 2;
    check_foreign(&s);
    s = moving_block_default();
    s.unknowns = TLSPH_PFJ;
    check_foreign(&s);
    s = moving_block_default();
    s.thermal = TLSPH_ISOTHERMAL;
    check_foreign(&s);
    s = moving_block_default();
    s.thermal = TLSPH_ENTROPY; /* the same number of bytes, another meaning */
    check_foreign(&s);
    s = moving_block_default();
    s.material = TLSPH_MEE; /* the same sizes, another law */
    check_foreign(&s);
    s = moving_block_default();
    s.jitter = 0.1; /* the same sizes, other places */
    check_foreign(&s);
    s = moving_block_default();
    s.dimension = 2;
    check_foreign(&s);
}

TEST(noise_is_refused)
{
    moving_block s = moving_block_default();
    tlsph_solver *solver = moving(&s);
    unsigned char *data, *witness, *scratch;
    size_t size, i;
    uint64_t seed = 1;
    REQUIRE(solver);
    witness = save_state(solver, &size);
    data = malloc(size);
    scratch = malloc(size);
    REQUIRE(data && witness && scratch);
    for (i = 0; i < size; i++) data[i] = (unsigned char)random_between(&seed, 0, 256);
    check_refused(solver, data, size, witness, scratch);
    memset(data, 0, size);
    check_refused(solver, data, size, witness, scratch);
    free(data);
    free(witness);
    free(scratch);
    tlsph_destroy(solver);
}

SUITE(checkpoint, ENTRY(continues_bitwise), ENTRY(goes_back), ENTRY(saving_is_repeatable),
      ENTRY(every_damaged_byte_is_found), ENTRY(truncated_data_is_refused), ENTRY(foreign_scenes_are_refused),
      ENTRY(noise_is_refused))
