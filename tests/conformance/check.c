/* SPDX-License-Identifier: MIT */
#include "tests/conformance/check.h"

#include <stdio.h>
#include <string.h>

void check_hash(struct check *check, uint32_t bits) {
    for (int shift = 0; shift < 32; shift += 8) {
        check->hash ^= (bits >> shift) & 0xffu;
        check->hash *= 0x100000001b3u;
    }
}

void check_number(struct check *check, const char *what, float got, double expected, double bound) {
    uint32_t bits;
    memcpy(&bits, &got, sizeof bits);
    check_hash(check, bits);
    ++check->numbers;
    const double error = (double)got > expected ? (double)got - expected : expected - (double)got;
    if (error <= bound) {
        if (bound > 0.0 && error / bound > check->worst) check->worst = error / bound;
        return;
    }
    ++check->failures;
    printf("%s: %s, row %u: %s is %.9g, the oracle says %.17g, which allows %.3g\n", check->group,
           check->subject, (unsigned)check->row, what, (double)got, expected, bound);
}

void check_equal(struct check *check, const char *what, uint32_t got, uint32_t expected) {
    check_hash(check, got);
    ++check->numbers;
    if (got == expected) return;
    ++check->failures;
    printf("%s: %s, row %u: %s is %u, the oracle says %u\n", check->group, check->subject,
           (unsigned)check->row, what, (unsigned)got, (unsigned)expected);
}
