/* SPDX-License-Identifier: MIT
 * What a restart leaves in memory: why it happened. Behind the stack and the data, where neither
 * the start-up nor the loader writes. Anything after power-on; a magic number and a sum say whether
 * it is ours. */
#ifndef COMPBOX_HAL_STM32F405_RETAINED_H
#define COMPBOX_HAL_STM32F405_RETAINED_H

#include <stdbool.h>
#include <stdint.h>

/* X(name, text): why the box started: by the chip's reset flags up to WATCHDOG, by the box's own
 * note from FAULT on. */
#define CB_STARTS(X)                                                       \
    X(CB_START_UNKNOWN, "no reset flag is set")                            \
    X(CB_START_POWER, "power-on")                                          \
    X(CB_START_BROWN_OUT, "brown-out: the supply was too low")             \
    X(CB_START_PIN, "reset pin")                                           \
    X(CB_START_SOFTWARE, "software reset, as by a debugger")               \
    X(CB_START_LOW_POWER, "low-power reset, which the box never asks for") \
    X(CB_START_WINDOW, "window watchdog, which the box never starts")      \
    X(CB_START_WATCHDOG, "watchdog: no cycle was completed")               \
    X(CB_START_FAULT, "processor fault")                                   \
    X(CB_START_STACK, "stack overflow, seen by the canary")                \
    X(CB_START_CLOCK, "the crystal failed, internal clock now")            \
    X(CB_START_ASSERTION, "assertion failed: the program has a mistake")   \
    X(CB_START_ASKED, "restart asked for on the console")

enum cb_start_cause {
#define CB_X(name, text) name,
    CB_STARTS(CB_X)
#undef CB_X
};

/* Registers of the processor when it met a fault. */
struct cb_fault_registers {
    uint32_t r[4], r12, lr, pc, psr; /* as the processor stacked them; 0 where it could not */
    uint32_t sp, exc_return, exception;
    uint32_t cfsr, hfsr, mmfar, bfar;
};

struct cb_retained {
    uint32_t magic;
    uint32_t cause;        /* enum cb_start_cause of the restart under way; 0: none */
    uint32_t fault_starts; /* restarts by fault, stack or watchdog since the last long good run */
    uint32_t faults;       /* all processor faults since power-on */
    uint32_t crystal_failed;
    uint32_t trace;                  /* the console asked for a trace from the first cycle on */
    struct cb_fault_registers fault; /* of the newest fault, when faults > 0 */
    char assertion[44];              /* file and … */
    uint32_t assertion_line;         /* line of the newest failed assertion */
    uint32_t sum;
};

extern struct cb_retained cb_retained;

/* At start, once: clears the block when it is not ours.
 * in : what the chip's reset flags say
 * out: why the box started: what it noted itself before the reset, else what the flags say */
enum cb_start_cause cb_retained_open(enum cb_start_cause by_flags);

/* After each change. */
void cb_retained_seal(void);

/* Notes the cause and starts the processor anew. */
_Noreturn void cb_restart(enum cb_start_cause cause);

/* Restarts of the box by itself, one after the other, before it stays in STANDBY with no file. */
enum { CB_FAULT_STARTS_MAX = 5 };

/* A restart that the box did not want: processor, assertion, stack, watchdogs, low power. */
bool cb_start_was_fault(enum cb_start_cause cause);

const char *cb_start_text(enum cb_start_cause cause);

#endif
