/* SPDX-License-Identifier: MIT
 * tanh and 1 - exp(-x) against tests/oracle/transcendental.py. */
#include "models/transcendental.h"

#include <stddef.h>

#include "tests/conformance/check.h"

struct function_row {
    float x;
    double value, bound;
};

#include "tests/conformance/vectors/transcendental.inc"

/* Every 65 521st float there is, infinities and NaNs included: same bits everywhere. */
static void sweep(struct check *check, float (*function)(float)) {
    uint32_t bits = 0;
    for (uint32_t i = 0; i < 65556; ++i, bits += 65521u)
        check_hash(check, cb_bits_of(cb_canonical(function(cb_float_of(bits)))));
}

static void run(struct check *check, const char *name, float (*function)(float),
                const struct function_row *rows, size_t count) {
    check->subject = name;
    for (size_t i = 0; i < count; ++i) {
        check->row = (uint32_t)i;
        check_number(check, "value", function(rows[i].x), rows[i].value, rows[i].bound);
    }
    sweep(check, function);
}

void run_transcendental(struct check *check) {
    run(check, "tanh", cb_tanh, tanh_rows, LENGTH(tanh_rows));
    run(check, "1 - exp(-x)", cb_one_minus_exp, one_minus_exp_rows, LENGTH(one_minus_exp_rows));
    const uint32_t minus_infinity = 0xFF800000u;
    check_equal(check, "tanh at the end", cb_bits_of(cb_tanh(cb_float_of(minus_infinity))),
                0xBF800000u);
}
