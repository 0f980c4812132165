/* SPDX-License-Identifier: MIT
 * The thread that reads the box's own slow bus (Pt100 modules) by the schedule of
 * firmware/signals/bus_turns.h, into a ring of samples. It takes no time of the loop. */
#ifndef COMPBOX_HAL_LINUX_BUS_H
#define COMPBOX_HAL_LINUX_BUS_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

#include "firmware/signals/bus_turns.h"
#include "hal/linux/rtu.h"
#include "hal/linux/sample_ring.h"

enum { CB_BUS_REPORTS = 4 };

/* Report of the thread after each turn. */
struct cb_bus_report {
    bool open;        /* the device is open */
    int error_number; /* cause of its present or last failure */
    uint32_t connects, failures, disconnects;
    struct cb_rtu_counters counters;
    uint8_t turns;
    uint8_t units[CB_MAX_SIGNALS]; /* of each turn */
    bool silent[CB_MAX_SIGNALS];   /* its last request got no reply */
};

struct cb_bus {
    const struct cb_config *config; /* unchanged until cb_bus_stop */
    uint32_t generation;
    struct cb_sample_ring *to;
    struct cb_rtu rtu;
    struct cb_serial_opener *opener; /* in memory of its own, because it may outlive a stop */
    struct cb_bus_turns turns;
    bool runs;
    bool quit;   /* a cb_flag */
    bool untold; /* the newest state found no room in the ring */
    pthread_t thread;
    struct cb_ring ring;
    struct cb_bus_report reports[CB_BUS_REPORTS];
    struct cb_bus_report last; /* the newest report taken */
};

/* Starts the thread if the file has a bus; config must stay unchanged until cb_bus_stop.
 * out: 0 or errno */
int cb_bus_start(struct cb_bus *bus, const struct cb_config *config, uint32_t generation,
                 struct cb_sample_ring *to);

/* Ends the thread after its pending request: at most the slave delay and some milliseconds, and a
 * second if the device's driver hangs. */
void cb_bus_stop(struct cb_bus *bus);

/* Updates bus->last. out: whether there was a new report. For the normal thread. */
bool cb_bus_look(struct cb_bus *bus);

#endif
