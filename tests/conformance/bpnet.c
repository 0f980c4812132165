/* SPDX-License-Identifier: MIT
 * The network and the guard of its training range against tests/oracle/bpnet.py. */
#include "models/bpnet.h"

#include <stddef.h>

#include "models/num.h"
#include "models/training_range.h"
#include "tests/conformance/check.h"
#include "tests/support/training_range_hold.h"

enum { MAX_INPUTS = 19 };

struct bpnet_row {
    float x[MAX_INPUTS];
    uint8_t input; /* of the slope */
    double y[CB_BPNET_MAX_OUTPUTS], y_bound[CB_BPNET_MAX_OUTPUTS];
    double slope[CB_BPNET_MAX_OUTPUTS], slope_bound[CB_BPNET_MAX_OUTPUTS];
};

struct bpnet_case {
    const char *title;
    struct cb_bpnet_source source;
    const struct bpnet_row *rows;
    size_t row_count;
};

struct training_row {
    float x[4], inside[4];
    double weight;
    uint8_t extrapolated, beyond;
};

#include "tests/conformance/vectors/bpnet.inc"
#include "tests/conformance/vectors/training_range.inc"

enum {
    MAX_FLOATS = CB_BPNET_MAX_HIDDEN * (CB_BPNET_MAX_INPUTS + 1) +
                 CB_BPNET_MAX_OUTPUTS * (1 + CB_BPNET_MAX_HIDDEN + CB_BPNET_MAX_INPUTS)
};
static float weights[MAX_FLOATS];

static void check_case(struct check *check, const struct bpnet_case *item) {
    struct cb_bpnet net;
    check_equal(check, "fold", cb_bpnet_fold(&item->source, weights, &net), true);
    for (size_t i = 0; i < item->row_count; ++i) {
        const struct bpnet_row *row = &item->rows[i];
        float y[CB_BPNET_MAX_OUTPUTS], slope[CB_BPNET_MAX_OUTPUTS];
        check->row = (uint32_t)i;
        cb_bpnet_evaluate(&net, row->x, y);
        cb_bpnet_slope(&net, row->x, row->input, slope);
        for (unsigned k = 0; k < net.outputs; ++k) {
            check_number(check, "output", y[k], row->y[k], row->y_bound[k]);
            check_number(check, "slope", slope[k], row->slope[k], row->slope_bound[k]);
        }
    }
}

/* The largest network, folded weights from a linear congruence: no oracle, but the same bits. */
static void largest(struct check *check) {
    static float x[CB_BPNET_MAX_INPUTS];
    const struct cb_bpnet net = {weights, CB_BPNET_MAX_INPUTS, CB_BPNET_MAX_HIDDEN,
                                 CB_BPNET_MAX_OUTPUTS, true};
    uint32_t seed = 1;
    check->subject = "the largest, 64-64-8";
    for (unsigned i = 0; i < MAX_FLOATS + 20 * CB_BPNET_MAX_INPUTS; ++i) {
        seed = seed * 1664525u + 1013904223u;
        const float number = ((float)(seed >> 16) - 32768.0f) / 65536.0f;
        if (i < MAX_FLOATS) {
            weights[i] = number;
            continue;
        }
        const unsigned input = (i - MAX_FLOATS) % CB_BPNET_MAX_INPUTS;
        x[input] = number;
        if (input != CB_BPNET_MAX_INPUTS - 1) continue;
        float y[CB_BPNET_MAX_OUTPUTS];
        cb_bpnet_evaluate(&net, x, y);
        for (unsigned k = 0; k < net.outputs; ++k) check_hash(check, cb_bits_of(y[k]));
    }
}

void run_bpnet(struct check *check) {
    for (size_t i = 0; i < LENGTH(bpnet_cases); ++i) {
        check->subject = bpnet_cases[i].title;
        check_case(check, &bpnet_cases[i]);
    }
    largest(check);
}

void run_training_range(struct check *check) {
    check->subject = "four inputs";
    for (size_t i = 0; i < LENGTH(training_rows); ++i) {
        const struct training_row *row = &training_rows[i];
        float inside[4];
        const struct cb_training_verdict verdict =
            hold_in_training_ranges(training_ranges, 4, row->x, inside);
        check->row = (uint32_t)i;
        check_number(check, "weight", verdict.weight, row->weight, 0.0);
        check_equal(check, "extrapolated", verdict.extrapolated, row->extrapolated);
        check_equal(check, "beyond", verdict.beyond, row->beyond);
        for (int j = 0; j < 4; ++j)
            check_equal(check, "inside", cb_bits_of(inside[j]), cb_bits_of(row->inside[j]));
    }
}
