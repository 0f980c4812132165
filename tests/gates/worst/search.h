/* SPDX-License-Identifier: MIT
 * Searches the sequence of events whose dearest step takes most instructions: from random
 * sequences, by changes that are kept unless they make it cheaper. The same seed gives the same
 * result. */
#ifndef COMPBOX_TESTS_GATES_SEARCH_H
#define COMPBOX_TESTS_GATES_SEARCH_H

#include "tests/gates/worst/play.h"

struct search_result {
    struct play_event events[PLAY_MOST_EVENTS];
    unsigned count;
    struct play_most most; /* of the kind that was searched; it is the step of the last event */
};

/* Memory for a result, which is 0 at first. */
struct search_result *search_memory(void);

/* in : seed, not 0; tries, how many sequences are played; *result: a sequence to begin with, or
 *      count 0
 * out: *result, the dearest one that was met */
void search(enum play_kind kind, uint32_t seed, uint32_t tries, struct search_result *result);

#endif
