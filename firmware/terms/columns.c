/* SPDX-License-Identifier: MIT */
#include "firmware/terms/columns.h"

#include "firmware/terms/ranges.h"

uint8_t cb_columns_value(const struct cb_evaluation *e, const struct cb_term_config *term,
                         float *value) {
    const struct cb_linear_config *const linear = &term->as.linear;
    const struct cb_bank_config *const bank = &e->config->banks[linear->bank];
    const uint8_t *const inputs = e->config->links + bank->inputs.link;
    const uint8_t *const sets = cb_bank_sets(e->config, bank);
    struct cb_columns columns = {e->config->pool + linear->pool,
                                 cb_columns_rows(sets, bank->inputs.count) * bank->taus_count,
                                 e->bank->lags + bank->lags};
    const struct cb_training_range *range = cb_ranges_at(e->config, bank->ranges);
    struct cb_training_verdict verdict = CB_NO_VERDICT;
    for (unsigned k = 0; k < term->outputs; ++k)
        value[k] = columns.weight[term->outputs * columns.apart + k];
    for (unsigned i = 0; i < bank->inputs.count; ++i) {
        const struct cb_signal_state *signal = &e->signals[inputs[i]];
        if (!signal->fresh) return CB_TERM_MISSING;
        const float x =
            bank->trained ? cb_range_hold(range++, i, signal->used, &verdict) : signal->used;
        for (unsigned power = 1; sets[i] >> (power - 1) != 0; ++power) {
            if (!(sets[i] >> (power - 1) & 1u)) continue;
            cb_columns_add(&columns, bank, &e->config->signals[inputs[i]], power,
                           cb_power(x, power), value, term->outputs);
        }
    }
    return bank->trained ? cb_range_judge(&verdict, value, term->outputs) : 0;
}

/* in : input of the bank; x, its value
 * out: slope[outputs] of the columns without a lag, by this input: sum of w p x^(p - 1) */
static void unlagged_slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                           unsigned input, float x, float *slope) {
    const struct cb_linear_config *const linear = &term->as.linear;
    const struct cb_bank_config *const bank = &pass->e.config->banks[linear->bank];
    const uint8_t *const sets = cb_bank_sets(pass->e.config, bank);
    const unsigned columns = cb_columns_rows(sets, bank->inputs.count) * bank->taus_count;
    const float *of_power =
        pass->e.config->pool + linear->pool + cb_columns_rows(sets, input) * bank->taus_count;
    for (unsigned power = 1; sets[input] >> (power - 1) != 0; ++power) {
        if (!(sets[input] >> (power - 1) & 1u)) continue;
        const float rate = power > 1 ? (float)power * cb_power(x, power - 1) : 1.0f;
        for (unsigned k = 0; k < term->outputs; ++k) slope[k] += of_power[k * columns] * rate;
        of_power += bank->taus_count;
    }
}

/* Product rule, as for a network: y = w m(x), with m at the held inputs. */
void cb_columns_slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                      float *slope) {
    const struct cb_config *const config = pass->e.config;
    const struct cb_bank_config *const bank = &config->banks[term->as.linear.bank];
    const unsigned input = cb_input_of(pass, &bank->inputs);
    struct cb_training_verdict verdict = CB_NO_VERDICT;
    const struct cb_training_range *range = cb_ranges_at(config, bank->ranges);
    if (input == bank->inputs.count) return;
    const float used = pass->e.signals[pass->signal].used;
    float x = used;
    for (unsigned i = 0; bank->trained && i < bank->inputs.count; ++i) {
        const uint8_t signal = config->links[bank->inputs.link + i];
        const float held = cb_range_hold(range++, i, pass->e.signals[signal].used, &verdict);
        if (i == input) x = held;
    }
    if (!(verdict.weight > 0.0f)) return;
    if (bank->unlagged && x == used) unlagged_slope(pass, term, input, x, slope);
    cb_range_fade_slope(&verdict, input, pass->e.outputs + term->first_output, slope,
                        term->outputs);
}
