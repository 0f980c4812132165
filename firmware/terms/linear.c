/* SPDX-License-Identifier: MIT
 * Terms of type linear: weighted sums of signals, or of the columns of a bank (columns.h). */
#include <string.h>

#include "firmware/terms/columns.h"
#include "firmware/terms/kind.h"
#include "firmware/terms/load.h"
#include "firmware/terms/sigma.h"
#include "models/num.h"

enum { OUTPUTS = CB_TERM_COMMON_KEYS, INPUTS, WEIGHTS, CONSTANT, BANK, SIGMA, KEYS };
static const struct cb_field FIELDS[KEYS] = {
    CB_TERM_COMMON_FIELDS,
    [OUTPUTS] = {"outputs", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [INPUTS] = {"inputs", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [WEIGHTS] = {"weights", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [CONSTANT] = {"constant", CB_FIELD_ANY, false, CB_NOT_STORED},
    [BANK] = {"bank", CB_FIELD_OBJECT, false, CB_NOT_STORED},
    [SIGMA] = {"sigma", CB_FIELD_OBJECT, false, CB_NOT_STORED},
};

/* in : weights[inputs], constant
 * out: bound of |sum| while the signals are within min … max */
static float largest_sum(const struct cb_config *config, const struct cb_linear_config *linear,
                         const float *weights) {
    float sum = cb_abs(weights[linear->inputs.count]);
    for (uint32_t i = 0; i < linear->inputs.count; ++i) {
        const struct cb_signal_config *signal =
            &config->signals[config->links[linear->inputs.link + i]];
        sum += cb_abs(weights[i]) * cb_max(cb_abs(signal->min), cb_abs(signal->max));
    }
    return sum;
}

/* out: true if the keys are those of a term with a bank, or those of a term without */
static bool check_keys(struct cb_loader *loader, uint32_t at, const uint32_t *slots) {
    const bool bank = slots[BANK] != CB_ABSENT;
    for (uint32_t key = INPUTS; key <= CONSTANT; ++key) {
        if (bank && slots[key] != CB_ABSENT)
            return cb_fail(loader, CB_ERROR_KEY, slots[key],
                           "a term with a bank has its inputs, weights and bias there; omit it");
        if (!bank && slots[key] == CB_ABSENT && key != CONSTANT)
            return cb_fail(loader, CB_ERROR_KEY, at, "the key %s is missing", FIELDS[key].key);
    }
    if (!bank && slots[SIGMA] != CB_ABSENT)
        return cb_fail(loader, CB_ERROR_KEY, slots[SIGMA],
                       "only a term with a bank states its sigma; omit it");
    if (bank || slots[OUTPUTS] == CB_ABSENT) return true;
    return cb_fail(loader, CB_ERROR_KEY, slots[OUTPUTS],
                   "without a bank a linear term has one output, which has its name; omit it");
}

/* in : as `load` of struct cb_term_kind
 * out: weights and constant in the pool, checked against overflow of the sum */
static bool load(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                 struct cb_term_config *term) {
    struct cb_linear_config *linear = &term->as.linear;
    float *weights = loader->scratch->values;
    if (!check_keys(loader, at, slots)) return false;
    if (slots[BANK] != CB_ABSENT)
        return cb_columns_load(loader, at, slots[BANK], term) &&
               (slots[SIGMA] == CB_ABSENT || cb_sigma_load(loader, at, slots[SIGMA], term));
    if (!cb_read_inputs(loader, slots[INPUTS], CB_MAX_SIGNALS, &linear->inputs)) return false;
    if (!cb_read_vector(loader, slots[WEIGHTS], linear->inputs.count, "inputs", weights))
        return false;
    weights[linear->inputs.count] = 0.0f;
    if (slots[CONSTANT] != CB_ABSENT &&
        !cb_read_float(loader, slots[CONSTANT], CB_LEAST_NUMBER, CB_MOST_NUMBER,
                       &weights[linear->inputs.count]))
        return false;
    if (!(largest_sum(loader->config, linear, weights) <= cb_number_of(CB_MOST_NUMBER)))
        return cb_fail(loader, CB_ERROR_RANGE, slots[WEIGHTS],
                       "between min and max of its signals this sum exceeds 1e9 µm");
    if (!cb_take_pool(loader, at, linear->inputs.count + 1u, &linear->pool)) return false;
    memcpy(loader->config->pool + linear->pool, weights,
           (linear->inputs.count + 1u) * sizeof *weights);
    return true;
}

/* Rounding error: at most (inputs + 1) 2^-24 of the sum of the absolute summands. */
static uint8_t value(const struct cb_evaluation *e, const struct cb_term_config *term,
                     struct cb_term_state *state, float *value) {
    const struct cb_linear_config *linear = &term->as.linear;
    const float *weights = e->config->pool + linear->pool;
    const uint8_t *links = e->config->links + linear->inputs.link;
    float sum = weights[linear->inputs.count];
    (void)state;
    if (linear->has_bank) return cb_columns_value(e, term, value);
    for (unsigned i = 0; i < linear->inputs.count; ++i) {
        const struct cb_signal_state *signal = &e->signals[links[i]];
        if (!signal->fresh) return CB_TERM_MISSING;
        sum += weights[i] * signal->used;
    }
    value[0] = sum;
    return 0;
}

static void slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                  float *slope) {
    const struct cb_linear_config *linear = &term->as.linear;
    if (linear->has_bank) {
        cb_columns_slope(pass, term, slope);
        return;
    }
    const unsigned i = cb_input_of(pass, &linear->inputs);
    if (i < linear->inputs.count) slope[0] = pass->e.config->pool[linear->pool + i];
}

static const struct cb_term_part PARTS[] = {
    {"bank", &cb_bank_object}, {"sigma", &cb_sigma_object}, {0, 0}};

const struct cb_term_kind cb_term_linear = {
    .object = {FIELDS, KEYS},
    .parts = PARTS,
    .signals = {offsetof(struct cb_term_config, as.linear.inputs), 0},
    .outputs = OUTPUTS,
    .load = load,
    .value = value,
    .slope = slope,
};
