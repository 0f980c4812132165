/* SPDX-License-Identifier: MIT
 * Modbus RTU client on a serial device for a loop that must not be late.
 *
 * One request is out at a time. Every call returns by its deadline, whatever the slave does; a
 * request whose reply cannot come by then is not sent. RTU has no transaction id, so what a late
 * reply might be taken for is kept apart by time (docs/rtu.md): a request that was not answered
 * stays out until something comes or its slave had a whole further period, and the reply to the
 * first request after that counts only when nothing follows it. */
#ifndef COMPBOX_HAL_LINUX_RTU_H
#define COMPBOX_HAL_LINUX_RTU_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/rtu_receiver.h"
#include "hal/hal.h"
#include "hal/linux/serial.h"

/* Counters for everything that happens on the wire; they wrap. Names are stable. */
#define CB_RTU_TRAFFIC(X)                                         \
    X(requests)      /* sent */                                   \
    X(replies)       /* valid and in time, exceptions included */ \
    X(not_connected) /* requests not sent: the device is not there */

#define CB_RTU_ERRORS(X)                                                               \
    X(exceptions)      /* replies that refuse */                                       \
    X(timeouts)        /* requests without a reply by their deadline */                \
    X(blocked)         /* requests not sent: the one before might still be answered */ \
    X(out_of_time)     /* requests not sent: their reply could not come in time */     \
    X(late_replies)    /* replies to a request that had been given up */               \
    X(stray_replies)   /* bytes that nobody asked for, a frame's worth or more */      \
    X(crc_errors)      /* what came for a reply has a check sum that does not fit */   \
    X(wrong_units)     /* … is of another unit id */                                 \
    X(invalid_replies) /* … is another function, count or echo, or has a hole */     \
    X(noise_bytes)     /* skipped before replies and between them */                   \
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
    struct cb_rtu_receiver receiver;
    uint8_t unit;
    bool awaiting;        /* a request is out and was not answered */
    bool doubtful;        /* what comes next may be a late reply to an earlier request */
    size_t behind;        /* bytes that came in one piece with the reply, behind it */
    uint32_t hold_us;     /* how long after its deadline an unanswered request stays out */
    int64_t out_until_us; /* … and when that is over */
    int64_t line_free_us; /* when a frame may begin: 3.5 characters after the last one */
    uint32_t between_us;  /* those 3.5 characters */
};

/* The device is opened by itself. in: opener as in cb_serial_start; hold_us 0: a bus whose modules
 * are told apart by their unit ids, so that nobody has to wait for a late reply */
void cb_rtu_start(struct cb_rtu *rtu, const struct cb_serial_config *config,
                  struct cb_serial_opener *opener, uint32_t hold_us);

/* One request to a unit; registers as in cb_rtu_decode. Deadline in CLOCK_BOOTTIME. */
enum cb_transfer cb_rtu_exchange(struct cb_rtu *rtu, uint8_t unit,
                                 const struct cb_modbus_request *request, uint16_t *registers,
                                 int64_t deadline_us);

/* The three operations of hal.h with their rules. */
enum cb_transfer cb_rtu_read(struct cb_rtu *rtu, uint16_t start, uint16_t count,
                             uint16_t *registers, int64_t deadline_us);
enum cb_transfer cb_rtu_write(struct cb_rtu *rtu, uint16_t start, uint16_t count,
                              const uint16_t *registers, int64_t deadline_us);
enum cb_transfer cb_rtu_write_read(struct cb_rtu *rtu, uint16_t write_start, uint16_t write_count,
                                   const uint16_t *write_registers, uint16_t read_start,
                                   uint16_t read_count, uint16_t *read_registers,
                                   int64_t deadline_us);

#endif
