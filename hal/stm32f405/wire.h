/* SPDX-License-Identifier: MIT
 * A Modbus RTU master on one serial port: one request at a time, never waiting. Its owner calls
 * cb_wire_poll() repeatedly.
 *
 *   IDLE ──send──► QUIET ──3.5 characters of silence──► SENDING ──last bit──► LISTENING ──► DONE
 *                   └───────────────────── until_us is over ──────────────────────────────┘ */
#ifndef COMPBOX_HAL_STM32F405_WIRE_H
#define COMPBOX_HAL_STM32F405_WIRE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/wire/rtu_dialog.h"
#include "firmware/wire/rtu_receiver.h"
#include "hal/stm32f405/usart.h"

/* Counters of all events on a wire; they wrap. */
#define CB_WIRE_COUNTERS(X)                                                                   \
    X(requests)                                                                               \
    X(replies)           /* valid, exceptions included */                                     \
    X(exceptions)        /* exceptions … */                                                 \
    X(illegal_functions) /* … of them exception 1: the PLC does not support the function */ \
    X(timeouts)          /* no bytes came */                                                  \
    X(crc_errors)        /* frames with a wrong check sum */                                  \
    X(wrong_units)       /* frames of another unit */                                         \
    X(invalid_replies)   /* frames with another function, length or echo than requested */    \
    X(noise_bytes)       /* bytes outside of replies */                                       \
    X(retries)           /* requests repeated in the same period */                           \
    X(probes)            /* reads of one register, which prove that no reply is pending */

struct cb_wire_counters {
#define CB_X(name) uint32_t name;
    CB_WIRE_COUNTERS(CB_X)
#undef CB_X
};

enum cb_wire_state {
    CB_WIRE_IDLE,
    CB_WIRE_QUIET,
    CB_WIRE_SENDING,
    CB_WIRE_LISTENING,
    CB_WIRE_DONE,
};

struct cb_wire {
    struct cb_rtu_line line;
    struct cb_rtu_silence silence;
    struct cb_wire_counters counters;
    enum cb_usart port;
    enum cb_wire_state state;
    enum cb_rtu_end end;   /* in DONE */
    enum cb_rtu_send what; /* REQUEST, or PROBE, which skips all but its reply */
    bool wary;             /* a REQUEST is not sent after unrequested bytes: STRAY */
    uint8_t unit, exception;
    uint16_t frame_bytes;
    uint16_t dropped;    /* bytes received before the request was sent */
    int64_t until_us;    /* end of its time */
    int64_t quiet_us;    /* start of the present silence, as far as known */
    uint16_t *registers; /* memory of the caller, until DONE */
    struct cb_modbus_request request;
    struct cb_rtu_receiver receiver;
    uint8_t frame[CB_RTU_MAX_FRAME];
};

/* Opens the port. in: lumps_us: gap between the lumps in which bytes arrive; 0 on a real line */
void cb_wire_start(struct cb_wire *wire, enum cb_usart port, const struct cb_rtu_line *line,
                   uint32_t lumps_us);

/* in : state IDLE or DONE; what: not NOTHING; the request's registers are read only during this
 *      call; registers for the reply, unchanged unless CB_RTU_END_REPLY, NULL if it has none
 * out: QUIET, or DONE with NOT_SENT for a request that cannot be encoded */
void cb_wire_send(struct cb_wire *wire, enum cb_rtu_send what, uint8_t unit,
                  const struct cb_modbus_request *request, uint16_t *registers, int64_t until_us);

/* Does the work that is due now. out: whether it is DONE */
bool cb_wire_poll(struct cb_wire *wire, int64_t now_us);

#endif
