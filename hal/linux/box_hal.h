/* SPDX-License-Identifier: MIT
 * The operations of hal.h on Linux: ticks, Modbus over TCP or a serial line, CAN, and requests from
 * the other thread. */
#ifndef COMPBOX_HAL_LINUX_BOX_HAL_H
#define COMPBOX_HAL_LINUX_BOX_HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"
#include "hal/linux/can_source.h"
#include "hal/linux/libmodbus.h"
#include "hal/linux/rtu.h"
#include "hal/linux/sample_ring.h"
#include "hal/linux/tcp.h"
#include "hal/linux/tick.h"

struct cb_linux {
    struct cb_tick tick;
    uint8_t transport; /* enum cb_transport: the wire in use */
    bool beside;       /* TCP by libmodbus, in a thread of its own */
    struct cb_tcp tcp; /* with libmodbus: its counters */
    struct cb_libmodbus libmodbus;
    struct cb_rtu rtu;
    struct cb_serial_opener opener; /* of the device for RTU */
    struct cb_can_source can;
    struct cb_sample_ring bus;  /* from the thread that reads the slow bus */
    struct cb_sample_ring hand; /* from the normal thread: measurements by hand */
    uint32_t generation;        /* of the running coefficient file */
    bool stop;                  /* a cb_flag: ramp to zero and report STOPPED */
    uint32_t steps;             /* completed ones; the watchdogs check it */
};

/* The caller keeps *target while the operations are in use. It has set and started its transport
 * (tcp or rtu) and can, and starts target->tick in the thread that runs the cycle. */
struct cb_hal cb_linux_hal(struct cb_linux *target);

/* Closes the wire in order, at the end of the loop. */
void cb_linux_close(struct cb_linux *target);

/* Stops the threads beside the loop, after it, at the end of the program. */
void cb_linux_stop(struct cb_linux *target);

#endif
