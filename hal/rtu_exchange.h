/* SPDX-License-Identifier: MIT
 * One exchange with the PLC on a serial line, on any hardware: executes the requests of
 * firmware/wire/rtu_dialog.h until it is over. */
#ifndef COMPBOX_HAL_RTU_EXCHANGE_H
#define COMPBOX_HAL_RTU_EXCHANGE_H

#include <stdint.h>

#include "firmware/wire/rtu_dialog.h"
#include "hal/hal.h"

/* The wire of a target. */
struct cb_rtu_wire {
    void *context;
    int64_t (*now_us)(void *context);

    /* Sends one request when the line is silent and waits for its reply, at most until until_us.
     * in : what: CB_RTU_SEND_REQUEST, or _PROBE, which skips all but its reply
     * out: registers unchanged unless CB_RTU_END_REPLY */
    enum cb_rtu_end (*exchange)(void *context, enum cb_rtu_send what,
                                const struct cb_modbus_request *request, uint16_t *registers,
                                int64_t until_us);
};

/* Returns by deadline_us. out: as the operations of hal.h */
enum cb_transfer cb_rtu_exchange_on(const struct cb_rtu_wire *wire, struct cb_rtu_dialog *dialog,
                                    const struct cb_modbus_request *request, uint16_t *registers,
                                    int64_t deadline_us);

#endif
