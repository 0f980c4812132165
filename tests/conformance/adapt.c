/* SPDX-License-Identifier: MIT
 * A model adapted by probes against tests/oracle/adapt.py. */
#include "models/adapt.h"

#include <stddef.h>

#include "models/num.h"
#include "tests/conformance/check.h"

struct adapt_row {
    float hours, probed_um, model_um;
    struct cb_sigma own;
    uint32_t outcome;
    double y, y_bound, sigma, sigma_bound;
};

struct adapt_case {
    struct cb_adapt_settings settings;
    const struct adapt_row *rows;
    size_t count;
};

#include "tests/conformance/vectors/adapt.inc"

static void check_row(struct check *check, const struct adapt_case *item, struct cb_adapt *state,
                      const struct adapt_row *row) {
    const float m = row->model_um;
    cb_adapt_wait(&item->settings, state, row->hours);
    check_equal(check, "outcome",
                (uint32_t)cb_adapt_probe(&item->settings, state, row->probed_um, m, &row->own),
                row->outcome);
    check_number(check, "b + (1 + g) m", state->bias_um + (1.0f + state->gain) * m, row->y,
                 row->y_bound);
    check_number(check, "sigma", cb_adapt_sigma(state, m, &row->own), row->sigma, row->sigma_bound);
    check_hash(check, cb_bits_of(cb_adapt_value(&item->settings, state->bias_um, state->gain, m)));
    check_hash(check, cb_bits_of(state->bias_d));
    check_hash(check, cb_bits_of(state->gain_d));
    check_hash(check, cb_bits_of(state->u));
}

void run_adapt(struct check *check) {
    check->subject = "probe";
    for (size_t i = 0; i < LENGTH(adapt_cases); ++i) {
        struct cb_adapt state;
        cb_adapt_start(&state);
        for (check->row = 0; check->row < adapt_cases[i].count; ++check->row)
            check_row(check, &adapt_cases[i], &state, &adapt_cases[i].rows[check->row]);
    }
}
