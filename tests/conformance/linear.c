/* SPDX-License-Identifier: MIT
 * The terms `linear` and `product` and how both fade when an input is missing, against
 * tests/oracle/linear.py. */
#include <stddef.h>
#include <string.h>

#include "firmware/box/box.h"
#include "firmware/terms/kinds.h"
#include "tests/conformance/check.h"

struct linear_row {
    float x[64];
    double linear, linear_bound, product, product_bound, slope, slope_bound;
};

struct linear_case {
    uint8_t inputs;
    const float *weights; /* and the constant */
    float origin;
    const struct linear_row *rows;
    size_t row_count;
};

#include "tests/conformance/vectors/linear.inc"

enum { LINEAR, PRODUCT };

static void make(struct cb_config *config, const struct linear_case *item) {
    memset(config, 0, sizeof *config);
    config->signals_count = item->inputs;
    config->terms_count = config->outputs_count = 2;
    config->outputs[PRODUCT].term = PRODUCT;
    memcpy(config->pool, item->weights, (item->inputs + 1u) * sizeof item->weights[0]);
    for (uint8_t i = 0; i < item->inputs; ++i) config->links[i] = i;
    config->terms[LINEAR] = (struct cb_term_config){.type = CB_TERM_LINEAR,
                                                    .first_output = LINEAR,
                                                    .outputs = 1,
                                                    .as.linear = {{0, item->inputs}, 0, false, 0}};
    config->terms[PRODUCT] = (struct cb_term_config){.type = CB_TERM_PRODUCT,
                                                     .first_output = PRODUCT,
                                                     .outputs = 1,
                                                     .as.product = {LINEAR, 0, item->origin}};
}

static void evaluate(struct cb_box *box, float fade_um) {
    cb_terms_evaluate(&box->config, box->signals, &box->bank, box->terms, &box->counters, fade_um,
                      box->outputs);
}

/* The last input goes missing: both terms go to zero by 1 µm, and no further than to zero. */
static void check_fading(struct check *check, struct cb_box *box, unsigned last) {
    const float before[] = {box->outputs[LINEAR], box->outputs[PRODUCT]};
    box->signals[last].fresh = false;
    evaluate(box, 1.0f);
    for (int i = 0; i < 2; ++i) {
        const double was = (double)before[i];
        const double left = was > 1.0 ? was - 1.0 : was < -1.0 ? was + 1.0 : 0.0;
        check_number(check, "faded", box->outputs[i], left, 6.0e-8 * (left < 0.0 ? -left : left));
        check_equal(check, "live", box->terms[i].live, false);
    }
    box->signals[last].fresh = true;
}

static void check_row(struct check *check, struct cb_box *box, const struct linear_case *item,
                      const struct linear_row *row) {
    float slopes[CB_MAX_OUTPUTS];
    for (unsigned i = 0; i < item->inputs; ++i) {
        box->signals[i].value = box->signals[i].used = row->x[i];
        box->signals[i].known = box->signals[i].fresh = true;
    }
    evaluate(box, 1.0f);
    check_number(check, "linear", box->outputs[LINEAR], row->linear, row->linear_bound);
    check_number(check, "product", box->outputs[PRODUCT], row->product, row->product_bound);
    cb_terms_slopes(&box->config, box->signals, box->terms, box->outputs, 0, slopes);
    check_number(check, "slope of linear", slopes[LINEAR], (double)item->weights[0], 0.0);
    check_number(check, "slope of product", slopes[PRODUCT], row->slope, row->slope_bound);
    check_fading(check, box, item->inputs - 1u);
}

void run_linear(struct check *check) {
    struct cb_box *box = &conformance_box;
    for (size_t i = 0; i < LENGTH(linear_cases); ++i) {
        const struct linear_case *item = &linear_cases[i];
        check->subject = "linear and product";
        make(&box->config, item);
        cb_box_start(box);
        for (check->row = 0; check->row < item->row_count; ++check->row)
            check_row(check, box, item, &item->rows[check->row]);
    }
}
