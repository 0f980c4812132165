/* SPDX-License-Identifier: MIT
 * Ticks at absolute times of a clock: start + n * period, so nothing drifts. By CLOCK_MONOTONIC a
 * suspended machine has no ticks, so none are missed; that time passed is seen by the ages, whose
 * clock counts suspend. By CLOCK_BOOTTIME they are missed. */
#ifndef COMPBOX_HAL_LINUX_TICK_H
#define COMPBOX_HAL_LINUX_TICK_H

#include <stdint.h>
#include <time.h>

struct cb_tick {
    clockid_t clock;
    int64_t period_ns;
    int64_t start_ns; /* time of tick 0, which is never waited for */
    int64_t index;    /* of the last tick waited for; skipped ones are counted in */
    int64_t woke_ns;  /* when that wait ended */
    int64_t late_ns;  /* … and by how much that was after the tick: 0 … period */
    int64_t worst_ns; /* the same for the first tick due in that wait: a period or more where ticks
                         were skipped; what statistics count */
};

/* Tick 1 is one period from now. */
void cb_tick_start(struct cb_tick *tick, clockid_t clock, uint32_t period_us);

/* Sleeps until the next tick that lies in the future and returns how many were skipped for it.
 * When the machine itself oversleeps by a whole period, those ticks count as skipped too and the
 * next one is waited for: a cycle never starts later than one period after its tick. worst_ns keeps
 * the lateness of the tick that was skipped first, seen at the call or at the first wake-up. */
uint32_t cb_tick_wait(struct cb_tick *tick);

#endif
