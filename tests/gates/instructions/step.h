/* SPDX-License-Identifier: MIT
 * Whole steps of a box under the reference load (reference_load.py), for the counter. */
#ifndef COMPBOX_TESTS_GATES_STEP_H
#define COMPBOX_TESTS_GATES_STEP_H

#include <stdbool.h>
#include <stdint.h>

/* What the box is put through, 30 ms by 30 ms. */
enum step_world {
    STEP_REST,    /* the machine stands still, nothing changes */
    STEP_TRAVEL,  /* three axes travel, every thermometer changes in every cycle */
    STEP_TROUBLE, /* that, and silent PLCs, lost writes, nonsense, missed ticks, clock jumps,
                     withdrawn enables, temperatures far outside the training range */
};

/* Loads the file; shared: the curves of an axis stand on the same breaks. false when the loader
 * refuses it. */
bool step_load(bool shared);

/* Starts the box and makes `cycles` steps.
 * out: the most instructions that one of them took after the first, which has everything to find */
uint32_t step_most(enum step_world world, unsigned cycles);

/* out: the most instructions that the first step took in all these worlds so far */
uint32_t step_first(void);

/* true: steps have held, ramped, faulted, been ACTIVE, met clock jumps, lost contact and weakened
 * networks; so that what was counted is what it claims to be. */
bool step_met_everything(void);

#endif
