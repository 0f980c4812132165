/* SPDX-License-Identifier: MIT
 * Ticks at absolute times of a clock, start + n * period, so nothing drifts. With CLOCK_MONOTONIC a
 * suspended machine has no ticks, so none are missed; the ages show the elapsed time, because their
 * clock includes suspend. With CLOCK_BOOTTIME they are missed. */
#ifndef COMPBOX_HAL_LINUX_TICK_H
#define COMPBOX_HAL_LINUX_TICK_H

#include <stdint.h>
#include <time.h>

struct cb_tick {
    clockid_t clock;
    int64_t period_ns;
    int64_t start_ns; /* time of tick 0, which is never waited for */
    int64_t index;    /* of the last tick waited for, skipped ones included */
    int64_t woke_ns;  /* end of that wait */
    int64_t late_ns;  /* its lateness behind the tick: 0 … period */
    int64_t worst_ns; /* largest lateness in that wait, of the call or of a wake-up, for statistics:
                         a period or more if a wake-up was repeated */
};

/* Tick 1 is one period from now. */
void cb_tick_start(struct cb_tick *tick, clockid_t clock, uint32_t period_us);

/* Sleeps until the next future tick. out: number of skipped ticks. When the machine oversleeps by a
 * whole period, those ticks count as skipped too, and the wait continues: a cycle never starts
 * later than one period after its tick. worst_ns keeps the largest lateness: of the call
 * behind the first tick due, or of a wake-up behind its tick. */
uint32_t cb_tick_wait(struct cb_tick *tick);

#endif
