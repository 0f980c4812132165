/* SPDX-License-Identifier: MIT
 * Injects faults around any struct cb_hal: a list of rules, each with a kind, a time window and a
 * frequency. Neither the hardware inside nor the box outside is aware of it. */
#ifndef COMPBOX_TESTS_SUPPORT_FAULT_H
#define COMPBOX_TESTS_SUPPORT_FAULT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/hal.h"

enum cb_fault_kind {
    CB_FAULT_DROP,         /* every request fails at once: not connected */
    CB_FAULT_LATE,         /* the PLC obeys, its reply comes after the deadline: UNKNOWN */
    CB_FAULT_REFUSE_READ,  /* reads get an exception */
    CB_FAULT_REFUSE_WRITE, /* writes get an exception */
    CB_FAULT_WRITE_TOOK,   /* writes take effect, their reply is lost: UNKNOWN */
    CB_FAULT_WRITE_LOST,   /* writes are lost on the way: UNKNOWN too */
    CB_FAULT_TORN,         /* the second half of a reading is from the previous reading */
    CB_FAULT_FREEZE,       /* register `number` of a reading keeps its last value: the heartbeat */
    CB_FAULT_CLOCK,        /* the clock is `number` µs off */
    CB_FAULT_MISS_TICKS,   /* `number` ticks are missed before each delivered one */
};

/* Active while from_us <= time < until_us (time of the inner hardware), in every `every`-th cycle,
 * counted from the first one in the window; 0 and 1: in each. */
struct cb_fault_rule {
    enum cb_fault_kind kind;
    int64_t from_us, until_us;
    uint32_t every;
    int64_t number;
    uint32_t cycles; /* number of cycles begun in the window; starts at 0 */
};

enum { CB_FAULT_REGISTERS = 125 };

struct cb_faults {
    struct cb_hal inner;
    struct cb_fault_rule *rules; /* memory of the caller */
    size_t count;

    /* Advances the inner hardware to until_us; NULL: late replies return without waiting. */
    void (*pass)(void *context, int64_t until_us);

    uint32_t injected;                 /* number of faults with an effect */
    uint16_t last[CB_FAULT_REGISTERS]; /* the previous reading */
    uint16_t last_start, last_count;   /* … and its block */
};

/* The same hardware with faults. *faults must outlive it. */
struct cb_hal cb_faults_hal(struct cb_faults *faults);

#endif
