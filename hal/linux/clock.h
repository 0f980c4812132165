/* SPDX-License-Identifier: MIT
 * The two clocks of the Linux target. */
#ifndef COMPBOX_HAL_LINUX_CLOCK_H
#define COMPBOX_HAL_LINUX_CLOCK_H

#include <stdint.h>
#include <time.h>

static inline int64_t cb_clock_ns(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static inline struct timespec cb_timespec(int64_t ns) {
    return (struct timespec){.tv_sec = ns / 1000000000, .tv_nsec = ns % 1000000000};
}

/* For ages and deadlines. It includes suspend, so that a value read before a suspend is old after
 * it. */
static inline int64_t cb_boottime_us(void) {
    return cb_clock_ns(CLOCK_BOOTTIME) / 1000;
}

/* For files that outlive a restart; the clock may be set. */
static inline int64_t cb_unix_us(void) {
    return cb_clock_ns(CLOCK_REALTIME) / 1000;
}

#endif
