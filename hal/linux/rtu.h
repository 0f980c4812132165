/* SPDX-License-Identifier: MIT
 * Modbus RTU client on a serial device for a loop that must not be late.
 *
 * One request is pending at a time. Every call returns by its deadline, whatever the slave does.
 * RTU has no transaction id: firmware/wire/rtu_dialog.h ensures that no late reply is accepted for
 * another request, and chooses the retries of a period (docs/rtu.md). */
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
#define CB_RTU_TRAFFIC(X)                                                   \
    X(requests)      /* sent */                                             \
    X(replies)       /* valid and in time, exceptions included */           \
    X(probes)        /* requests whose reply proves that none is pending */ \
    X(retries)       /* requests repeated in the same period */             \
    X(not_connected) /* requests not sent: the device is missing */

#define CB_RTU_ERRORS(X)                                                             \
    X(exceptions)      /* refused by the PLC */                                      \
    X(timeouts)        /* requests without a reply in their time */                  \
    X(out_of_time)     /* requests not sent: no time for the reply */                \
    X(late_replies)    /* replies to an abandoned request */                         \
    X(stray_replies)   /* unrequested bytes, a frame's worth or more */              \
    X(crc_errors)      /* replies with a wrong check sum */                          \
    X(wrong_units)     /* … with another unit id */                                \
    X(invalid_replies) /* … with another function, count or echo, or with a gap */ \
    X(noise_bytes)     /* skipped before replies and between them */                 \
    X(device_errors)   /* the device was lost while open */

#define CB_RTU_COUNTERS(X) CB_RTU_TRAFFIC(X) CB_RTU_ERRORS(X)

enum { CB_RTU_EXCEPTIONS = 16 }; /* exception codes counted separately; 0: all others */

struct cb_rtu_counters {
#define CB_X(name) uint32_t name;
    CB_RTU_COUNTERS(CB_X)
#undef CB_X
    uint32_t exceptions_by_code[CB_RTU_EXCEPTIONS];
};

struct cb_rtu {
    struct cb_serial serial;
    struct cb_rtu_counters counters;
    struct cb_peer peer; /* without times: the request of a late reply is unknown */
    struct cb_rtu_receiver receiver;
    struct cb_rtu_dialog dialog; /* with the PLC */
    bool has_dialog;             /* false: a bus, whose modules differ by their unit ids */
    uint8_t unit;                /* of the PLC */
    int64_t line_free_us;        /* earliest start of a frame: 3.5 characters after the last one */
    uint32_t between_us;         /* those 3.5 characters */
};

/* Starts the line to the PLC; manners as in cb_rtu_dialog_start, opener as in cb_serial_start. The
 * device opens automatically. */
void cb_rtu_start(struct cb_rtu *rtu, const struct cb_serial_config *config,
                  const struct cb_rtu_manners *manners, struct cb_serial_opener *opener);

/* One request to the PLC, as the operations of hal.h; deadline in CLOCK_BOOTTIME. */
enum cb_transfer cb_rtu_exchange(struct cb_rtu *rtu, const struct cb_modbus_request *request,
                                 uint16_t *registers, int64_t deadline_us);

/* Starts a line of modules; opener as in cb_serial_start. */
void cb_rtu_start_bus(struct cb_rtu *rtu, const struct cb_serial_config *config,
                      struct cb_serial_opener *opener);

/* One request to one module, sent once. */
enum cb_transfer cb_rtu_read_module(struct cb_rtu *rtu, uint8_t unit,
                                    const struct cb_modbus_request *request, uint16_t *registers,
                                    int64_t deadline_us);

#endif
