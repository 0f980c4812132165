/* SPDX-License-Identifier: MIT
 * Banks: the lags of linear terms (struct cb_bank_config). They move as lags of signals do
 * (lags.h), but have no signals of their own. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_BANK_H
#define COMPBOX_FIRMWARE_SIGNALS_BANK_H

#include "firmware/base/limits.h"
#include "firmware/config/config.h"
#include "firmware/signals/signals.h"

/* State of struct cb_lag without its input, which follows from that of the signal. */
struct cb_bank_lag {
    float hi, lo;
};

/* All zero: no lag has started. */
struct cb_bank_state {
    struct cb_bank_lag lags[CB_MAX_BANK_LAGS];
    uint32_t settled[CB_MAX_BANK_LAGS / 32]; /* a bit of each lag: it has started */
    int64_t time_us[CB_MAX_SIGNALS];         /* of each input of a bank: time of the last … */
    float value[CB_MAX_SIGNALS];             /* … value that its lags have followed */
};

/* One lag, whatever its bank: two with the same key have the same state. */
struct cb_bank_key {
    uint8_t signal, power;
    float tau_s;
    float low, high; /* its input acts within these: the training range with its margin */
};

static inline bool cb_bank_is_settled(const struct cb_bank_state *state, unsigned lag) {
    return (state->settled[lag / 32] >> lag % 32 & 1u) != 0;
}

/* The lag continues from this state at the next value of its input. */
static inline void cb_bank_settle(struct cb_bank_state *state, unsigned lag,
                                  struct cb_bank_lag from) {
    state->lags[lag] = from;
    state->settled[lag / 32] |= 1u << lag % 32;
}

/* in : the signals of this step, aged
 * out: every lag at the newest value of its input, exact for an input that is linear between its
 *      values. The first value of a lag is its steady state. */
void cb_banks_follow(const struct cb_config *config, const struct cb_signal_state *signals,
                     struct cb_bank_state *state);

/* in : lag < config->bank_lags_count */
struct cb_bank_key cb_bank_key_of(const struct cb_config *config, unsigned lag);

/* out: the lag of this signal, power and time constant whose input acts within the nearest range,
 * the first of several; CB_MAX_BANK_LAGS if there is none */
unsigned cb_bank_find(const struct cb_config *config, struct cb_bank_key key);

/* out: the sets of powers of the bank's inputs */
static inline const uint8_t *cb_bank_sets(const struct cb_config *config,
                                          const struct cb_bank_config *bank) {
    return config->links + bank->inputs.link + bank->inputs.count;
}

/* out: number of powers in the set; bit p - 1 is the power p */
static inline unsigned cb_bank_powers(unsigned set) {
    unsigned count = 0;
    for (; set != 0; set &= set - 1u) ++count;
    return count;
}

#endif
