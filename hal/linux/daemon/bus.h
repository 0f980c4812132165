/* SPDX-License-Identifier: MIT
 * The thread that reads the box's own slow bus (Pt100 modules): module after module, as
 * firmware/signals/bus_turns.h says, into a ring of samples for the loop. Never in the loop's time.
 */
#ifndef COMPBOX_HAL_LINUX_DAEMON_BUS_H
#define COMPBOX_HAL_LINUX_DAEMON_BUS_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

#include "firmware/signals/bus_turns.h"
#include "hal/linux/rtu.h"
#include "hal/linux/sample_ring.h"

enum { CB_BUS_REPORTS = 4 };

/* What the thread tells about itself, after each turn. */
struct cb_bus_report {
    bool open;        /* the device is */
    int error_number; /* why it is not, or was not */
    uint32_t connects, failures, disconnects;
    struct cb_rtu_counters counters;
    uint8_t turns;
    uint8_t units[CB_MAX_SIGNALS]; /* of each turn … */
    bool silent[CB_MAX_SIGNALS];   /* … and whether it was not answered when last asked */
};

struct cb_bus {
    const struct cb_config *config; /* stays as it is until cb_bus_stop */
    uint32_t generation;
    struct cb_sample_ring *to;
    struct cb_rtu rtu;
    struct cb_serial_opener *opener; /* of its own memory: it may outlive a stop */
    struct cb_bus_turns turns;
    bool runs;
    bool quit; /* a cb_flag */
    pthread_t thread;
    struct cb_ring ring;
    struct cb_bus_report reports[CB_BUS_REPORTS];
    struct cb_bus_report last; /* newest that was taken */
};

/* Starts the thread where the file has a bus; config stays as it is until cb_bus_stop.
 * out: 0 or errno */
int cb_bus_start(struct cb_bus *bus, const struct cb_config *config, uint32_t generation,
                 struct cb_sample_ring *to);

/* Ends the thread, after the request that is out: at most its slave delay and some milliseconds,
 * and a second where the device's driver hangs. */
void cb_bus_stop(struct cb_bus *bus);

/* Brings bus->last up to date; out: whether there was anything new. For the normal thread. */
bool cb_bus_look(struct cb_bus *bus);

#endif
