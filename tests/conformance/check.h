/* SPDX-License-Identifier: MIT
 * Conformance: every number of the core against an exact oracle, and bit for bit against the other
 * targets.
 *
 * One group per kind of term. To add one: a generator tests/oracle/NAME.py that writes
 * vectors/NAME.inc (and its name in CMakeLists.txt), a function run_NAME here and in NAME.c, a
 * line in main.c; then
 * `build/host/bin/conformance > tests/conformance/expected.txt` once, after reading what changed.
 */
#ifndef COMPBOX_TESTS_CONFORMANCE_CHECK_H
#define COMPBOX_TESTS_CONFORMANCE_CHECK_H

#include <stdint.h>

#define LENGTH(array) (sizeof(array) / sizeof((array)[0]))

struct check {
    const char *group;
    uint32_t numbers;
    uint32_t failures;
    uint64_t hash;       /* FNV-1a over the bits of every result, in order */
    double worst;        /* largest error / bound */
    const char *subject; /* what the next numbers belong to, for messages */
    uint32_t row;
};

/* in : expected and bound from the oracle; bound >= 0
 * Counts and hashes got; prints a line and counts a failure unless |got - expected| <= bound. */
void check_number(struct check *check, const char *what, float got, double expected, double bound);

/* The same for something that has to be equal. */
void check_equal(struct check *check, const char *what, uint32_t got, uint32_t expected);

/* Adds the bits of a result that has no expected value of its own. */
void check_hash(struct check *check, uint32_t bits);

/* Of box.c; a target has room for one only. */
extern struct cb_box conformance_box;

void run_bspline(struct check *check);
void run_polyline(struct check *check);
void run_polynomial(struct check *check);
void run_transcendental(struct check *check);
void run_lag(struct check *check);
void run_bpnet(struct check *check);
void run_training_range(struct check *check);
void run_volumetric(struct check *check);
void run_direction(struct check *check);
void run_linear(struct check *check);
void run_bank(struct check *check);
void run_sigma(struct check *check);
void run_adapt(struct check *check);
void run_box(struct check *check);

#endif
