/* SPDX-License-Identifier: MIT
 * The operations of hal.h on Linux: ticks, Modbus over TCP or a serial line, CAN, and requests from
 * the other thread. */
#ifndef COMPBOX_HAL_LINUX_BOX_HAL_H
#define COMPBOX_HAL_LINUX_BOX_HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"
#include "hal/linux/can_source.h"
#include "hal/linux/rtu.h"
#include "hal/linux/sample_ring.h"
#include "hal/linux/tcp.h"
#include "hal/linux/tick.h"

struct cb_linux {
    struct cb_tick tick;
    uint8_t transport; /* enum cb_transport: which of the two is in use */
    struct cb_tcp tcp;
    struct cb_rtu rtu;
    struct cb_serial_opener opener; /* of the device of rtu */
    struct cb_can_source can;
    struct cb_sample_ring bus; /* of the thread that reads the slow bus */
    uint32_t generation;       /* of the coefficient file that runs */
    bool stop;                 /* a cb_flag: the box shall ramp to zero and say STOPPED */
    uint32_t steps;            /* completed ones; what a watchdog looks at */
};

/* The caller keeps *target as long as the operations are used, has set its transport and started
 * that (tcp or rtu) and can, and starts target->tick in the thread that runs the cycle. */
struct cb_hal cb_linux_hal(struct cb_linux *target);

/* Closes the wire in good order; for the end of the loop. */
void cb_linux_close(struct cb_linux *target);

/* Ends what runs beside the loop, after it; for the end of the program. */
void cb_linux_stop(struct cb_linux *target);

#endif
