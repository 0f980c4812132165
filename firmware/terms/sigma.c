/* SPDX-License-Identifier: MIT */
#include "firmware/terms/sigma.h"

#include "firmware/terms/columns.h"
#include "firmware/terms/kinds.h"
#include "models/num.h"

/* in : power >= 1, in the set. out: the next power of the set; 0: there is none */
static uint8_t power_after(uint8_t set, unsigned power) {
    while (set >> power != 0) {
        if (set >> power++ & 1u) return (uint8_t)power;
    }
    return 0;
}

static const float *offsets_of(const struct cb_config *config, const struct cb_bank_config *bank) {
    return config->pool + bank->sigma + 2u * bank->outputs;
}

/* Begins with the first bank from state->bank on that states a sigma; or the pass has ended. */
static void begin_bank(const struct cb_config *config, struct cb_sigma_state *state) {
    while (state->bank < config->banks_count && config->banks[state->bank].model == 0)
        ++state->bank;
    if (state->bank == config->banks_count) return;
    const struct cb_bank_config *bank = &config->banks[state->bank];
    for (unsigned d = 0; d < CB_MAX_DIRECTIONS; ++d)
        state->sum[d] = d < bank->directions ? offsets_of(config, bank)[d] : 0.0f;
    state->row = 0;
    state->input = 0;
    state->power = power_after(cb_bank_sets(config, bank)[0], 0);
}

/* The bank in work has all its rows, or cannot have them. in: whether it has */
static void end_bank(const struct cb_config *config, struct cb_sigma_state *state, bool whole) {
    for (unsigned d = 0; d < CB_MAX_DIRECTIONS && whole; ++d)
        state->place[state->bank][d] =
            cb_clamp(state->sum[d], -CB_SIGMA_MOST_PLACE, CB_SIGMA_MOST_PLACE);
    if (whole) state->known |= (uint16_t)(1u << state->bank);
    ++state->bank;
    begin_bank(config, state);
}

/* Adds the next row of the bank in work to its sums. The input itself is not held at its training
 * range, as it is for the prediction: the further it is outside, the larger is sigma.
 * Rounding: as cb_columns_value() */
static void add_row(const struct cb_config *config, const struct cb_signal_state *signals,
                    const struct cb_bank_state *lags, struct cb_sigma_state *state) {
    const struct cb_bank_config *bank = &config->banks[state->bank];
    const uint8_t *const sets = cb_bank_sets(config, bank);
    const uint8_t index = config->links[bank->inputs.link + state->input];
    const unsigned columns = cb_columns_rows(sets, bank->inputs.count) * (unsigned)bank->taus_count;
    struct cb_columns from = {
        offsets_of(config, bank) + bank->directions + state->row * (unsigned)bank->taus_count,
        columns,
        lags->lags + bank->lags + state->row * ((unsigned)bank->taus_count - bank->unlagged)};
    if (!signals[index].fresh) {
        end_bank(config, state, false);
        return;
    }
    cb_columns_add(&from, bank, &config->signals[index], state->power,
                   cb_power(signals[index].used, state->power), state->sum, bank->directions);
    ++state->row;
    state->power = power_after(sets[state->input], state->power);
    if (state->power != 0) return;
    if (++state->input == bank->inputs.count)
        end_bank(config, state, true);
    else
        state->power = power_after(sets[state->input], 0);
}

void cb_sigma_step(const struct cb_config *config, const struct cb_signal_state *signals,
                   const struct cb_bank_state *lags, struct cb_sigma_state *state, int64_t now_us) {
    const bool first = !state->begun, ended = state->bank >= config->banks_count;
    if (now_us < state->pass_us) state->pass_us = now_us; /* the clock went back */
    if (ended && !first && now_us - state->pass_us < CB_SIGMA_PASS_US) return;
    if (first || ended) {
        state->begun = true;
        state->pass_us = now_us;
        state->bank = 0;
        begin_bank(config, state);
    }
    unsigned rows = config->sigma_rows;
    while (state->bank < config->banks_count && (first || rows-- > 0))
        add_row(config, signals, lags, state);
}

struct cb_sigma cb_sigma_of(const struct cb_config *config, const struct cb_sigma_state *state,
                            uint8_t output) {
    const struct cb_term_config *term = &config->terms[config->output_terms[output]];
    struct cb_sigma sigma = {.model = 0};
    if (term->type != CB_TERM_LINEAR || !term->as.linear.has_bank) return sigma;
    const unsigned index = term->as.linear.bank, k = output - (unsigned)term->first_output;
    const struct cb_bank_config *bank = &config->banks[index];
    if (bank->model == 0 || !(state->known >> index & 1u)) return sigma;
    sigma.floor_um = config->pool[bank->sigma + k];
    sigma.along_um = config->pool[bank->sigma + bank->outputs + k];
    for (unsigned d = 0; d < CB_MAX_DIRECTIONS; ++d) sigma.place[d] = state->place[index][d];
    sigma.model = bank->model;
    return sigma;
}
