/* SPDX-License-Identifier: MIT
 * The columns of a linear term's bank (struct cb_bank_config): read from the file, summed,
 * differentiated. The bank's lags move in signals/bank.c. */
#ifndef COMPBOX_FIRMWARE_TERMS_COLUMNS_H
#define COMPBOX_FIRMWARE_TERMS_COLUMNS_H

#include "firmware/terms/kind.h"

extern const struct cb_object cb_bank_object;

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
