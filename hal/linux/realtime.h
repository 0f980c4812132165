/* SPDX-License-Identifier: MIT
 * Real-time settings of a Linux thread: locked memory, a timer without slack, a processor that
 * stays in its lightest sleep, a priority. All before the loop starts. */
#ifndef COMPBOX_HAL_LINUX_REALTIME_H
#define COMPBOX_HAL_LINUX_REALTIME_H

#include <pthread.h>
#include <stdbool.h>

/* Locks all memory of the process, present and future. out: 0, or errno. */
int cb_lock_memory(void);

/* Holds /dev/cpu_dma_latency at 0 for the life of the process, so that the processor stays in its
 * lightest sleep. out: 0, or errno when the device is missing or not permitted. */
int cb_hold_cpu_latency(void);

/* Scheduling of a thread. */
struct cb_schedule {
    int priority; /* 1 … 99: SCHED_FIFO, 0: as the caller */
    int cpu;      /* on this processor only; -1: any */
};
extern const struct cb_schedule cb_no_hurry; /* as the caller, anywhere */

/* Starts a thread with its own small stack. All signals are blocked in it.
 * out: 0, or errno (EPERM: the priority is not permitted; EINVAL: the processor is not) */
int cb_start_thread(pthread_t *thread, const struct cb_schedule *schedule, void *(*run)(void *),
                    void *argument);

/* Call it first in that thread. Sets its name and no timer slack, and touches its stack, so that no
 * page of it is missing later. */
void cb_settle_thread(const char *name);

#endif
