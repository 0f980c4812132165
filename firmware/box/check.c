/* SPDX-License-Identifier: MIT
 * Check sums of the configuration against changes in memory. Each step, before it uses them, sums
 * all fields from which it takes an index, a count, a register or a scale. The rest, which is the
 * pool, names and addresses, is summed in slices over many steps. */
#include <stddef.h>
#include <string.h>

#include "firmware/base/memory_check.h"
#include "firmware/box/box.h"
#include "models/num.h"

enum { CHECK_WORDS = sizeof(struct cb_config) / 4, SLICE_WORDS = 16 };
_Static_assert(CHECK_WORDS * 4 == sizeof(struct cb_config), "checked as whole words");
_Static_assert((CHECK_WORDS + SLICE_WORDS - 1) / SLICE_WORDS <= CB_CONFIG_PASS_STEPS,
               "a pass over the configuration takes no longer than box.h states");

enum {
    HEAD_BYTES = offsetof(struct cb_config, plc) + offsetof(struct cb_plc_config, host),
    SIGNAL_AT = offsetof(struct cb_signal_config, source),
    SIGNAL_WORDS = (sizeof(struct cb_signal_config) - SIGNAL_AT) / 4,
    TERM_WORDS = sizeof(struct cb_term_config) / 4,
    CHANNEL_AT = offsetof(struct cb_channel_config, sum),
};
_Static_assert(HEAD_BYTES % 4 == 0 && SIGNAL_AT % 4 == 0 && CHANNEL_AT % 4 == 0, "whole words");
_Static_assert(SIGNAL_WORDS < 16 && TERM_WORDS < 16, "few words");

/* Adds one word to the quick sum, in 2 instructions. Like cb_memory_check() it detects every change
 * within one word; changes of several words may cancel out. */
CB_INLINE uint32_t add_word(uint32_t sum, const void *word) {
    uint32_t number;
    memcpy(&number, word, sizeof number);
    return (sum << 5 | sum >> 27) + number;
}

CB_INLINE uint32_t add_4(uint32_t sum, const char *at) {
    sum = add_word(add_word(sum, at), at + 4);
    return add_word(add_word(sum, at + 8), at + 12);
}

/* in : words < 16; a constant, so that the compiler removes the branches */
CB_INLINE uint32_t add_few(uint32_t sum, const void *memory, unsigned words) {
    const char *at = memory;
    if (words & 8) {
        sum = add_4(add_4(sum, at), at + 16);
        at += 32;
    }
    if (words & 4) {
        sum = add_4(sum, at);
        at += 16;
    }
    if (words & 2) {
        sum = add_word(add_word(sum, at), at + 4);
        at += 8;
    }
    return words & 1 ? add_word(sum, at) : sum;
}

/* in : bytes in use; the sum includes the whole last word */
static uint32_t add(uint32_t sum, const void *from, size_t bytes) {
    const char *at = from;
    size_t words = (bytes + 3) / 4;
    for (; words >= 8; words -= 8, at += 32) sum = add_few(sum, at, 8);
    return add_few(sum, at, (unsigned)words);
}

static uint32_t head_sum(const struct cb_config *config) {
    return add(0, config, HEAD_BYTES);
}

/* in : a head that is sound, because its counts and indices are used
 * Sums measured signals only: a step uses lag_links for the others. */
static uint32_t add_signals(uint32_t sum, const struct cb_config *config) {
    const unsigned measured = (unsigned)config->signals_count - config->lags_count;
    for (unsigned i = 0; i < measured; ++i) {
        const char *const signal = (const char *)&config->signals[config->measured[i]];
        sum = add_few(sum, signal + SIGNAL_AT, SIGNAL_WORDS);
    }
    return sum;
}

/* in : as add_signals()
 * Omits plain curves unless there are slopes: a step evaluates plain curves by their grids. */
static uint32_t add_terms(uint32_t sum, const struct cb_config *config) {
    for (unsigned i = 0; i < config->other_terms_count; ++i)
        sum = add_few(sum, &config->terms[config->other_terms[i]], TERM_WORDS);
    if (config->slopes_count == 0) return sum;
    return add(sum, config->terms, config->terms_count * sizeof config->terms[0]);
}

/* in : as add_signals(). out: sum of all fields in use beyond the head */
static uint32_t used_sum(const struct cb_config *config) {
    uint32_t sum = add_terms(add_signals(0, config), config);
    const unsigned curves = (unsigned)config->terms_count - config->other_terms_count;
    sum = add(sum, config->grids, config->grids_count * sizeof config->grids[0]);
    sum = add(sum, config->plain_curves, curves * sizeof config->plain_curves[0]);
    sum = add(sum, config->lag_links, config->lags_count * sizeof config->lag_links[0]);
    sum = add(sum, config->banks, config->banks_count * sizeof config->banks[0]);
    sum = add(sum, config->branches, config->branches_count * sizeof config->branches[0]);
    sum = add(sum, config->pairs, config->pairs_count * sizeof config->pairs[0]);
    if (config->sensors_count > 0) sum = add(sum, &config->sensors, sizeof config->sensors);
    sum = add(sum, config->output_terms, config->outputs_count);
    sum = add(sum, config->links, config->links_count);
    for (unsigned i = 0; i < cb_all_channels(config); ++i)
        sum = add(sum, config->channels[i].sum, sizeof config->channels[i] - CHANNEL_AT);
    return sum;
}

void cb_box_take_sums(struct cb_box *box) {
    box->config_sum = cb_memory_check(0, &box->config, CHECK_WORDS);
    box->head_sum = head_sum(&box->config);
    box->used_sum = used_sum(&box->config);
}

bool cb_box_is_sound(const struct cb_box *box) {
    return !box->config_corrupt && head_sum(&box->config) == box->head_sum &&
           used_sum(&box->config) == box->used_sum;
}

/* Sums the next slice of the whole configuration. out: false if a completed pass gave another
 * sum */
static bool check_slice(struct cb_box *box) {
    const uint32_t rest = CHECK_WORDS - box->words_checked;
    const uint32_t words = rest < SLICE_WORDS ? rest : SLICE_WORDS;
    const char *from = (const char *)&box->config + 4 * box->words_checked;
    box->sum_so_far = cb_memory_check(box->sum_so_far, from, words);
    box->words_checked += words;
    if (box->words_checked < CHECK_WORDS) return true;
    const bool same = box->sum_so_far == box->config_sum;
    box->sum_so_far = box->words_checked = 0;
    return same;
}

bool cb_box_check(struct cb_box *box) {
    if (!cb_box_is_sound(box) || !check_slice(box)) box->config_corrupt = true;
    return !box->config_corrupt;
}
