/* SPDX-License-Identifier: MIT
 * Whole steps of a box under the reference load (reference_load.py), for the counter. */
#ifndef COMPBOX_TESTS_GATES_STEP_H
#define COMPBOX_TESTS_GATES_STEP_H

#include <stdbool.h>
#include <stdint.h>

/* What the box is put through, 30 ms by 30 ms. */
enum step_world {
    STEP_REST,   /* the machine stands still, nothing changes */
    STEP_TRAVEL, /* three axes travel, every thermometer changes in every cycle */
};

/* The reference load, and its options. */
enum step_file { STEP_SHARED_BREAKS, STEP_OWN_BREAKS, STEP_BANK, STEP_SIGMA };

/* out: false when the loader refuses the file */
bool step_load(enum step_file file);

/* Starts the box and makes `cycles` steps.
 * out: the most instructions that one of them took after the first */
uint32_t step_most(enum step_world world, unsigned cycles);

/* out: true if the last step was ACTIVE: what was counted is a box that compensates */
bool step_was_active(void);

#endif
