/* SPDX-License-Identifier: MIT
 * What the emulator puts into the flash behind a program: a coefficient file, and what to do with
 * it (worst.py). */
#ifndef COMPBOX_TESTS_GATES_JOB_H
#define COMPBOX_TESTS_GATES_JOB_H

#include "tests/gates/worst/play.h"

struct job {
    uint32_t kind;  /* enum play_kind */
    uint32_t seed;  /* not 0 */
    uint32_t tries; /* 0: the events are played; else others are searched, beginning with them */
    uint32_t rtu;   /* 1: the target is the STM32F405; 0: a daemon whose PLC is at Modbus/TCP */
    uint32_t count; /* of events */
    struct play_event events[PLAY_MOST_EVENTS];
};

/* out: the job, its file loaded and the counter started; or NULL, and a sentence is printed */
const struct job *job_begin(void);

#endif
