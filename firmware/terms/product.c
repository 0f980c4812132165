/* SPDX-License-Identifier: MIT
 * Terms of type product: another term's output times (signal - origin). */
#include "firmware/terms/kind.h"
#include "firmware/terms/load.h"

enum { FACTOR = CB_TERM_COMMON_KEYS, SIGNAL, ORIGIN, KEYS };
static const struct cb_field FIELDS[KEYS] = {
    CB_TERM_COMMON_FIELDS,
    [FACTOR] = {"term", CB_FIELD_STRING, true, CB_NOT_STORED},
    [SIGNAL] = {"signal", CB_FIELD_STRING, true, CB_NOT_STORED},
    [ORIGIN] = {"origin", CB_FIELD_FLOAT, false,
                .offset = offsetof(struct cb_product_config, origin), .least = CB_LEAST_NUMBER,
                .most = CB_MOST_NUMBER, .otherwise = "0"},
};

static bool load(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                 struct cb_term_config *term) {
    (void)at;
    return cb_read_signal(loader, slots[SIGNAL], &term->as.product.signal);
}

static bool link(struct cb_loader *loader, uint32_t at, struct cb_term_config *term) {
    return cb_read_output(loader, at, &term->as.product.output);
}

/* Rounding error: at most 2^-23 of the product, plus that of the other term's output. */
static uint8_t value(const struct cb_evaluation *e, const struct cb_term_config *term,
                     struct cb_term_state *state, float *value) {
    const struct cb_product_config *product = &term->as.product;
    const struct cb_signal_state *signal = &e->signals[product->signal];
    (void)state;
    if (!signal->fresh || !cb_output_is_live(e, product->output)) return CB_TERM_MISSING;
    value[0] = e->outputs[product->output] * (signal->used - product->origin);
    return 0;
}

static void slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                  float *slope) {
    const struct cb_product_config *product = &term->as.product;
    const float way = pass->e.signals[product->signal].used - product->origin;
    const float own = product->signal == pass->signal ? pass->e.outputs[product->output] : 0.0f;
    slope[0] = pass->slopes[product->output] * way + own;
}

const struct cb_term_kind cb_term_product = {
    .object = {FIELDS, KEYS},
    .signals = CB_TERM_LIST(as.product.signal),
    .uses = CB_TERM_LIST(as.product.output),
    .uses_key = "term",
    .load = load,
    .link = link,
    .value = value,
    .slope = slope,
};
