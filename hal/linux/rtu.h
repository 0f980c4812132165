/* SPDX-License-Identifier: MIT
 * Modbus RTU client on a serial device for a loop that must not be late.
 *
 * One request is out at a time. Every call returns by its deadline, whatever the slave does. RTU
 * has no transaction id: what a late reply might be taken for is excluded by
 * firmware/wire/rtu_dialog.h, which also says what is asked again in the same period (docs/rtu.md).
 */
#ifndef COMPBOX_HAL_LINUX_RTU_H
#define COMPBOX_HAL_LINUX_RTU_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/wire/rtu_dialog.h"
#include "firmware/wire/rtu_receiver.h"
#include "hal/hal.h"
#include "hal/linux/peer.h"
#include "hal/linux/serial.h"

/* Counters for everything that happens on the wire; they wrap. Names are stable. */
#define CB_RTU_TRAFFIC(X)                                                         \
    X(requests)      /* sent */                                                   \
    X(replies)       /* valid and in time, exceptions included */                 \
    X(probes)        /* requests whose reply says that nothing is out any more */ \
    X(retries)       /* requests sent again in the same period */                 \
    X(not_connected) /* requests not sent: the device is not there */

#define CB_RTU_ERRORS(X)                                                             \
    X(exceptions)      /* replies that refuse */                                     \
    X(timeouts)        /* requests without a reply in their time */                  \
    X(out_of_time)     /* requests not sent: their reply could not come in time */   \
    X(late_replies)    /* replies to a request that had been given up */             \
    X(stray_replies)   /* bytes that nobody asked for, a frame's worth or more */    \
    X(crc_errors)      /* what came for a reply has a check sum that does not fit */ \
    X(wrong_units)     /* … is of another unit id */                               \
    X(invalid_replies) /* … is another function, count or echo, or has a hole */   \
    X(noise_bytes)     /* skipped before replies and between them */                 \
    X(device_errors)   /* the device was lost while open */

#define CB_RTU_COUNTERS(X) CB_RTU_TRAFFIC(X) CB_RTU_ERRORS(X)

enum { CB_RTU_EXCEPTIONS = 16 }; /* exception codes counted apart; 0: all others */

struct cb_rtu_counters {
#define CB_X(name) uint32_t name;
    CB_RTU_COUNTERS(CB_X)
#undef CB_X
    uint32_t exceptions_by_code[CB_RTU_EXCEPTIONS];
};

struct cb_rtu {
    struct cb_serial serial;
    struct cb_rtu_counters counters;
    struct cb_peer peer; /* its times are not measured: a late reply is of no known request */
    struct cb_rtu_receiver receiver;
    struct cb_rtu_dialog dialog; /* with the PLC */
    bool has_dialog;             /* false: a bus whose modules are told apart by their unit ids */
    uint8_t unit;                /* of the PLC */
    int64_t line_free_us;        /* when a frame may begin: 3.5 characters after the last one */
    uint32_t between_us;         /* those 3.5 characters */
};

/* The line to the PLC; manners as in cb_rtu_dialog_start, opener as in cb_serial_start. The device
 * is opened by itself. */
void cb_rtu_start(struct cb_rtu *rtu, const struct cb_serial_config *config,
                  const struct cb_rtu_manners *manners, struct cb_serial_opener *opener);

/* One request to it, as the operations of hal.h; deadline in CLOCK_BOOTTIME. */
enum cb_transfer cb_rtu_exchange(struct cb_rtu *rtu, const struct cb_modbus_request *request,
                                 uint16_t *registers, int64_t deadline_us);

/* A line of modules; opener as in cb_serial_start. */
void cb_rtu_start_bus(struct cb_rtu *rtu, const struct cb_serial_config *config,
                      struct cb_serial_opener *opener);

/* One request to one of them, sent once. */
enum cb_transfer cb_rtu_ask_module(struct cb_rtu *rtu, uint8_t unit,
                                   const struct cb_modbus_request *request, uint16_t *registers,
                                   int64_t deadline_us);

#endif
