/* SPDX-License-Identifier: MIT */
#include "firmware/signals/bank.h"

#include "firmware/signals/lags.h"
#include "models/power.h"
#include "models/training_range.h"

/* Gains of every time constant of a bank, for one time between two values. Inputs of one reading
 * share them. */
struct paces {
    int64_t elapsed_us; /* 0: none yet */
    struct cb_lag_gains gains[CB_MAX_BANK_TAUS];
};

/* Where one input was, and where it is. */
struct way {
    int64_t elapsed_us;
    float from, to;
};

static unsigned lagged(const struct cb_bank_config *bank) {
    return (unsigned)bank->taus_count - bank->unlagged;
}

static const float *taus_of(const struct cb_config *config, const struct cb_bank_config *bank) {
    return config->pool + bank->taus + bank->unlagged;
}

/* out: x within the range in which input i of the bank may act */
static float held(const struct cb_config *config, const struct cb_bank_config *bank, unsigned i,
                  float x) {
    if (!bank->trained) return x;
    const void *const ranges = config->pool + bank->ranges;
    const struct cb_training_range *range = (const struct cb_training_range *)ranges + i;
    return cb_clamp(x, range->min - range->margin, range->max + range->margin);
}

static void take_pace(const struct cb_config *config, const struct cb_bank_config *bank,
                      int64_t elapsed_us, struct paces *paces) {
    if (elapsed_us == paces->elapsed_us) return;
    for (unsigned t = 0; t < lagged(bank); ++t)
        paces->gains[t] = cb_lag_gains_over(elapsed_us, taus_of(config, bank)[t]);
    paces->elapsed_us = elapsed_us;
}

/* Moves `count` adjacent lags, of all time constants.
 * in : way of one power of the input, finite; gains[count] unless way->elapsed_us is 0 */
static void follow(struct cb_bank_state *state, unsigned first, unsigned count,
                   const struct way *way, const struct cb_lag_gains *gains) {
    for (unsigned t = 0; t < count; ++t) {
        struct cb_bank_lag *own = &state->lags[first + t];
        if (!cb_bank_is_settled(state, first + t)) {
            cb_bank_settle(state, first + t, (struct cb_bank_lag){way->to, 0.0f});
        } else if (way->elapsed_us != 0) {
            struct cb_lag lag = {own->hi, own->lo, way->from};
            cb_lag_step_to(&lag, gains[t], way->to);
            *own = (struct cb_bank_lag){lag.hi, lag.lo};
        }
    }
}

/* out: the lags of all inputs that have a value, moved to it */
static void follow_bank(const struct cb_config *config, const struct cb_bank_config *bank,
                        const struct cb_signal_state *signals, struct cb_bank_state *state) {
    const uint8_t *const inputs = config->links + bank->inputs.link;
    struct paces paces = {.elapsed_us = 0};
    unsigned lag = bank->lags;
    for (unsigned i = 0; i < bank->inputs.count; ++i) {
        const struct cb_signal_state *signal = &signals[inputs[i]];
        const unsigned powers = cb_bank_sets(config, bank)[i];
        const int64_t elapsed_us = signal->time_us - state->time_us[inputs[i]];
        const float from = held(config, bank, i, state->value[inputs[i]]);
        const float to = held(config, bank, i, cb_signal_remembered(signal));
        if (signal->known) take_pace(config, bank, elapsed_us, &paces);
        for (unsigned power = 1; powers >> (power - 1) != 0; ++power) {
            if (!(powers >> (power - 1) & 1u)) continue;
            const struct way way = {elapsed_us, cb_power(from, power), cb_power(to, power)};
            if (signal->known) follow(state, lag, lagged(bank), &way, paces.gains);
            lag += lagged(bank);
        }
    }
}

/* Two banks may have the same input, so this waits until both have followed it. */
static void remember(const struct cb_config *config, const struct cb_bank_config *bank,
                     const struct cb_signal_state *signals, struct cb_bank_state *state) {
    const uint8_t *const inputs = config->links + bank->inputs.link;
    for (unsigned i = 0; i < bank->inputs.count; ++i) {
        const struct cb_signal_state *signal = &signals[inputs[i]];
        if (!signal->known) continue;
        state->time_us[inputs[i]] = signal->time_us;
        state->value[inputs[i]] = cb_signal_remembered(signal);
    }
}

void cb_banks_follow(const struct cb_config *config, const struct cb_signal_state *signals,
                     struct cb_bank_state *state) {
    for (unsigned b = 0; b < config->banks_count; ++b)
        follow_bank(config, &config->banks[b], signals, state);
    for (unsigned b = 0; b < config->banks_count; ++b)
        remember(config, &config->banks[b], signals, state);
}

/* ---- keys ---- */

#define UNBOUNDED 1e30f /* of an input without a training range */

/* in : row, from 0, of the products of inputs and powers; powers, the set of each input
 * out: the input; *power of it */
static unsigned input_of_row(const uint8_t *powers, unsigned row, uint8_t *power) {
    unsigned i = 0;
    for (; row >= cb_bank_powers(powers[i]); ++i) row -= cb_bank_powers(powers[i]);
    for (*power = 1;; ++*power) {
        if ((powers[i] >> (*power - 1) & 1u) != 0 && row-- == 0) return i;
    }
}

struct cb_bank_key cb_bank_key_of(const struct cb_config *config, unsigned lag) {
    const struct cb_bank_config *bank = config->banks;
    struct cb_bank_key key;
    for (unsigned b = 1; b < config->banks_count; ++b) /* one without lags begins as the next */
        if (config->banks[b].lags <= lag) bank = &config->banks[b];
    const unsigned own = lag - bank->lags;
    key.tau_s = taus_of(config, bank)[own % lagged(bank)];
    const unsigned i = input_of_row(cb_bank_sets(config, bank), own / lagged(bank), &key.power);
    key.signal = config->links[bank->inputs.link + i];
    key.low = held(config, bank, i, -UNBOUNDED);
    key.high = held(config, bank, i, UNBOUNDED);
    return key;
}

/* out: the bank's lag with this key; CB_MAX_BANK_LAGS if there is none */
static unsigned find_in(const struct cb_config *config, const struct cb_bank_config *bank,
                        struct cb_bank_key key) {
    const uint8_t *const powers = cb_bank_sets(config, bank);
    unsigned row = 0, i = 0, t = 0;
    while (i < bank->inputs.count && config->links[bank->inputs.link + i] != key.signal)
        row += cb_bank_powers(powers[i++]);
    while (t < lagged(bank) && taus_of(config, bank)[t] != key.tau_s) ++t;
    if (i == bank->inputs.count || t == lagged(bank)) return CB_MAX_BANK_LAGS;
    if (!(powers[i] >> (key.power - 1) & 1u)) return CB_MAX_BANK_LAGS;
    row += cb_bank_powers(powers[i] & ((1u << (key.power - 1)) - 1u));
    return bank->lags + row * lagged(bank) + t;
}

unsigned cb_bank_find(const struct cb_config *config, struct cb_bank_key key) {
    unsigned nearest = CB_MAX_BANK_LAGS;
    float least = 0.0f;
    for (unsigned b = 0; b < config->banks_count; ++b) {
        const unsigned lag = find_in(config, &config->banks[b], key);
        if (lag == CB_MAX_BANK_LAGS) continue;
        const struct cb_bank_key found = cb_bank_key_of(config, lag);
        const float apart = cb_abs(found.low - key.low) + cb_abs(found.high - key.high);
        if (nearest < CB_MAX_BANK_LAGS && apart >= least) continue;
        nearest = lag;
        least = apart;
    }
    return nearest;
}
