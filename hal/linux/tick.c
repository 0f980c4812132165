/* SPDX-License-Identifier: MIT */
#include "hal/linux/tick.h"

#include <errno.h>

#include "hal/linux/clock.h"

void cb_tick_start(struct cb_tick *tick, clockid_t clock, uint32_t period_us) {
    int64_t now_ns = cb_clock_ns(clock);
    *tick = (struct cb_tick){.clock = clock,
                             .period_ns = (int64_t)period_us * 1000,
                             .start_ns = now_ns,
                             .woke_ns = now_ns};
}

/* Index of the first tick after now_ns. */
static int64_t next_index(const struct cb_tick *tick, int64_t now_ns) {
    return (now_ns - tick->start_ns) / tick->period_ns + 1;
}

static void sleep_until(clockid_t clock, int64_t ns) {
    struct timespec until = cb_timespec(ns);
    while (clock_nanosleep(clock, TIMER_ABSTIME, &until, NULL) == EINTR) continue;
}

uint32_t cb_tick_wait(struct cb_tick *tick) {
    const int64_t before = tick->index;
    const int64_t due_ns = tick->start_ns + (before + 1) * tick->period_ns;
    int64_t now_ns = cb_clock_ns(tick->clock);
    tick->worst_ns = now_ns > due_ns ? now_ns - due_ns : 0;
    do {
        int64_t wanted = next_index(tick, now_ns);
        if (wanted <= tick->index) wanted = tick->index + 1;
        int64_t wanted_ns = tick->start_ns + wanted * tick->period_ns;
        sleep_until(tick->clock, wanted_ns);
        tick->index = wanted;
        tick->woke_ns = now_ns = cb_clock_ns(tick->clock);
        tick->late_ns = tick->woke_ns - wanted_ns;
        if (tick->worst_ns < tick->late_ns) tick->worst_ns = tick->late_ns;
    } while (tick->late_ns >= tick->period_ns);
    return (uint32_t)(tick->index - before - 1);
}
