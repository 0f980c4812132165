/* SPDX-License-Identifier: MIT
 * The columns of a linear term's bank (struct cb_bank_config): read from the file, summed,
 * differentiated. The bank's lags move in signals/bank.c. */
#ifndef COMPBOX_FIRMWARE_TERMS_COLUMNS_H
#define COMPBOX_FIRMWARE_TERMS_COLUMNS_H

#include "firmware/signals/bank.h"
#include "firmware/terms/kind.h"
#include "models/power.h"

extern const struct cb_object cb_bank_object;

/* One pass over the columns, in their order, for several sums of them. */
struct cb_columns {
    const float *weight;           /* of the next column and the first sum … */
    unsigned apart;                /* … and the distance to that of the next sum */
    const struct cb_bank_lag *lag; /* of the next column that has one */
};

/* out: number of products of the first `inputs` inputs and their powers */
static inline unsigned cb_columns_rows(const uint8_t *sets, unsigned inputs) {
    unsigned rows = 0;
    for (unsigned i = 0; i < inputs; ++i) rows += cb_bank_powers(sets[i]);
    return rows;
}

/* Adds the next column to every sum. */
CB_INLINE void cb_columns_add_one(struct cb_columns *columns, float x, float *sum, unsigned sums) {
    const float *weight = columns->weight++;
    for (unsigned k = 0; k < sums; ++k, weight += columns->apart) sum[k] += *weight * x;
}

/* Adds the columns of one power of an input to sum[sums]. in: now, that of the input itself */
static inline void cb_columns_add(struct cb_columns *columns, const struct cb_bank_config *bank,
                                  const struct cb_signal_config *signal, unsigned power, float now,
                                  float *sum, unsigned sums) {
    const struct cb_interval range = cb_power_range(signal->min, signal->max, power);
    if (bank->unlagged) cb_columns_add_one(columns, now, sum, sums);
    for (unsigned t = bank->unlagged; t < bank->taus_count; ++t)
        cb_columns_add_one(columns, cb_clamp(columns->lag++->hi, range.min, range.max), sum, sums);
}

/* in : weights of all columns
 * out: bound of their sum while the signals are within min … max. A power is at most 1e36, because
 *      signals are within 1e9. */
float cb_columns_largest(const struct cb_config *config, const struct cb_bank_config *bank,
                         const float *weights);

/* in : at, the term, for messages; bank_at, its bank; term->outputs
 * out: the bank in config->banks, its weights and biases in the pool, checked against overflow of
 *      the sum; or false and a message */
bool cb_columns_load(struct cb_loader *loader, uint32_t at, uint32_t bank_at,
                     struct cb_term_config *term);

/* As `value` and `slope` of struct cb_term_kind, of a linear term with a bank. Rounding error of a
 * value: at most (columns + 1) 2^-24 of the sum of the absolute summands, each column beside its
 * own: power - 1 roundings, or that of models/lag.h. */
uint8_t cb_columns_value(const struct cb_evaluation *e, const struct cb_term_config *term,
                         float *value);
void cb_columns_slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                      float *slope);

#endif
