/* SPDX-License-Identifier: MIT
 * The box's hardware in virtual time, with a PLC in the same process: an array of registers that
 * the host program updates. Nothing here reads a clock; same calls, same results.
 *
 * Time passes in two ways: wait_tick() advances to the next tick, and each request takes
 * exchange_us. Each time, `update` is called for the PLC and the machine. */
#ifndef COMPBOX_TESTS_SUPPORT_SIM_H
#define COMPBOX_TESTS_SUPPORT_SIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/hal.h"

enum {
    CB_SIM_REGISTERS = 65536, /* the whole address space of Modbus */
    CB_SIM_SAMPLES = 64,      /* sensor samples waiting for collection */
};

struct cb_sim;

/* Supplied by the host program; either may be NULL. */
struct cb_sim_host {
    void *context;

    /* Updates the world to now_us: moves the machine, counts the PLC's heartbeat, sets registers,
     * queues samples. now_us never runs backward. Called at least once for each tick and request,
     * always before the request uses the registers. */
    void (*update)(void *context, struct cb_sim *sim, int64_t now_us);

    /* A write arrived: registers[start … start+count-1] are the new values. */
    void (*written)(void *context, struct cb_sim *sim, uint16_t start, uint16_t count,
                    int64_t now_us);
};

struct cb_sim {
    struct cb_sim_host host;
    int64_t now_us;
    int64_t tick_us;                      /* of the last tick */
    uint32_t period_us;                   /* ticks are multiples of it, from start_us */
    uint32_t exchange_us;                 /* duration of each request */
    bool stop;                            /* result of stop_requested() */
    bool absent;                          /* no PLC: every request fails at once */
    uint32_t watchdog_fed, reads, writes; /* numbers of calls */
    size_t sample_count;
    struct cb_sample samples[CB_SIM_SAMPLES];
    uint16_t registers[CB_SIM_REGISTERS];
};

/* out: registers 0, time start_us, the first tick one period later; exchange_us 0 */
void cb_sim_start(struct cb_sim *sim, const struct cb_sim_host *host, uint32_t period_us,
                  int64_t start_us);

/* The hardware for the box's cycle. *sim must outlive it. */
struct cb_hal cb_sim_hal(struct cb_sim *sim);

/* Advances time; until_us in the past has no effect. Also for decorators (fault.h). */
void cb_sim_pass(void *sim, int64_t until_us);

/* Queues a sensor sample; the oldest is dropped if the queue is full. */
void cb_sim_sample(struct cb_sim *sim, uint8_t signal, float raw, int64_t time_us);

#endif
