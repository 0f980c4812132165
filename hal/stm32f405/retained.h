/* SPDX-License-Identifier: MIT
 * Memory that survives a restart: its cause and the fault's registers. It is behind the stack and
 * the data, where neither the start-up nor the loader writes. After power-on its content is
 * undefined; a magic number and a sum show whether it is valid. */
#ifndef COMPBOX_HAL_STM32F405_RETAINED_H
#define COMPBOX_HAL_STM32F405_RETAINED_H

#include <stdbool.h>
#include <stdint.h>

/* X(name, text): cause of the start: up to WATCHDOG by the chip's reset flags, from FAULT on by the
 * box's own record. */
#define CB_STARTS(X)                                                     \
    X(CB_START_UNKNOWN, "no reset flag is set")                          \
    X(CB_START_POWER, "power-on")                                        \
    X(CB_START_BROWN_OUT, "brown-out: the supply was too low")           \
    X(CB_START_PIN, "reset pin")                                         \
    X(CB_START_SOFTWARE, "software reset, as by a debugger")             \
    X(CB_START_LOW_POWER, "low-power reset, which the box never uses")   \
    X(CB_START_WINDOW, "window watchdog, which the box never starts")    \
    X(CB_START_WATCHDOG, "watchdog: no cycle was completed")             \
    X(CB_START_FAULT, "processor fault")                                 \
    X(CB_START_STACK, "stack overflow, seen by the canary")              \
    X(CB_START_CLOCK, "the crystal failed, internal clock now")          \
    X(CB_START_ASSERTION, "assertion failed: the program has a mistake") \
    X(CB_START_REQUESTED, "restart requested on the console")

enum cb_start_cause {
#define CB_X(name, text) name,
    CB_STARTS(CB_X)
#undef CB_X
};

/* Registers of the processor at a fault. */
struct cb_fault_registers {
    uint32_t r[4], r12, lr, pc, psr; /* as stacked by the processor; 0 where it could not */
    uint32_t sp, exc_return, exception;
    uint32_t cfsr, hfsr, mmfar, bfar;
};

struct cb_retained {
    uint32_t magic;
    uint32_t cause;        /* enum cb_start_cause of the pending restart; 0: none */
    uint32_t fault_starts; /* restarts by fault, stack or watchdog since the last long good run */
    uint32_t faults;       /* all processor faults since power-on */
    uint32_t crystal_failed;
    uint32_t trace;                  /* the console requested a trace from the first cycle on */
    struct cb_fault_registers fault; /* of the newest fault, when faults > 0 */
    char assertion[44];              /* file of the newest failed assertion … */
    uint32_t assertion_line;         /* … and its line */
    uint32_t sum;
};

extern struct cb_retained cb_retained;

/* Call it once at start: clears a block that is not valid.
 * in : cause by the chip's reset flags
 * out: cause of the start: the box's own record from before the reset, else the flags' cause */
enum cb_start_cause cb_retained_open(enum cb_start_cause by_flags);

/* Call it after each change. */
void cb_retained_seal(void);

/* Records the cause and restarts the processor. */
_Noreturn void cb_restart(enum cb_start_cause cause);

/* Maximum successive restarts of the box by itself; then it stays in STANDBY with no file. */
enum { CB_FAULT_STARTS_MAX = 5 };

/* out: true for an unwanted restart: processor, assertion, stack, watchdogs, low power */
bool cb_start_was_fault(enum cb_start_cause cause);

const char *cb_start_text(enum cb_start_cause cause);

#endif
