/* SPDX-License-Identifier: MIT
 * How far the terms with a bank may be off now, where their files state a sigma (models/sigma.h).
 * Their places z move as slowly as the columns do, so a pass over all of them takes a second:
 * config->sigma_rows rows of columns in each step, each row at its values of that step. */
#ifndef COMPBOX_FIRMWARE_TERMS_SIGMA_H
#define COMPBOX_FIRMWARE_TERMS_SIGMA_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/limits.h"
#include "firmware/signals/bank.h"
#include "firmware/signals/signals.h"
#include "models/sigma.h"

struct cb_config;
struct cb_loader;
struct cb_term_config;

enum { CB_SIGMA_PASS_US = 1000000 };

/* All zero: no pass has begun. */
struct cb_sigma_state {
    float place[CB_MAX_BANKS][CB_MAX_DIRECTIONS]; /* of each bank, at the end of its last pass */
    float sum[CB_MAX_DIRECTIONS];                 /* of the bank in work, so far */
    int64_t pass_us;                              /* when this pass began */
    uint16_t known;                               /* a bit of each bank: its place was computed */
    uint16_t row;                                 /* of the bank in work: the next one … */
    uint8_t input, power;                         /* … which is this power of this input */
    uint8_t bank;                                 /* in work; banks_count: the pass has ended */
    bool begun;
};
_Static_assert(CB_MAX_BANKS <= 16, "a bit of each");

/* Call once in each step, if config->sigma_rows > 0. The first pass is made at once, so that sigma
 * is known from the start; so is one after the caller has cleared `begun`. A bank with an input
 * that is not fresh keeps its place.
 * in : signals aged, the lags of banks after them */
void cb_sigma_step(const struct cb_config *config, const struct cb_signal_state *signals,
                   const struct cb_bank_state *lags, struct cb_sigma_state *state, int64_t now_us);

/* out: the sigma of an output of a term now; its `model` is 0 if none is stated or none is known */
struct cb_sigma cb_sigma_of(const struct cb_config *config, const struct cb_sigma_state *state,
                            uint8_t output);

/* ---- keys ---- */

extern const struct cb_object cb_sigma_object;

/* in : at, the term, for messages; sigma_at, its sigma; the term's bank is loaded
 * out: floor, along, offsets and directions in the pool, checked against overflow of the sums */
bool cb_sigma_load(struct cb_loader *loader, uint32_t at, uint32_t sigma_at,
                   const struct cb_term_config *term);

#endif
