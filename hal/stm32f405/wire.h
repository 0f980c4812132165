/* SPDX-License-Identifier: MIT
 * A Modbus RTU master on one serial port: one request at a time, never waiting. Whoever owns it
 * calls cb_wire_poll() again and again.
 *
 *   IDLE ──ask──► QUIET ──3.5 characters of silence──► SENDING ──last bit──► LISTENING ──► DONE
 *                   └───────────────────── until_us is over ──────────────────────────────┘ */
#ifndef COMPBOX_HAL_STM32F405_WIRE_H
#define COMPBOX_HAL_STM32F405_WIRE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/wire/rtu_dialog.h"
#include "firmware/wire/rtu_receiver.h"
#include "hal/stm32f405/usart.h"

/* Everything that happens on a wire; they wrap. */
#define CB_WIRE_COUNTERS(X)                                                             \
    X(requests)                                                                         \
    X(replies)           /* valid, exceptions included */                               \
    X(exceptions)        /* replies that refuse … */                                  \
    X(illegal_functions) /* … by exception 1: the PLC does not have the function */   \
    X(timeouts)          /* nothing came */                                             \
    X(crc_errors)        /* something came, its check sum was wrong */                  \
    X(wrong_units)       /* a frame of another unit */                                  \
    X(invalid_replies)   /* a frame with another function, length or echo than asked */ \
    X(noise_bytes)       /* bytes that belonged to no reply */                          \
    X(retries)           /* requests sent again in the same period */                   \
    X(probes)            /* readings of one register, to see that nothing is out any more */

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
    enum cb_rtu_end end;  /* in DONE */
    enum cb_rtu_ask what; /* REQUEST, or PROBE: then what is not its reply is skipped */
    bool wary;            /* a REQUEST is not sent where bytes came that nobody asked for: STRAY */
    uint8_t unit, exception;
    uint16_t frame_bytes;
    uint16_t dropped;    /* bytes that came before the request went out */
    int64_t until_us;    /* then it is over */
    int64_t quiet_us;    /* since when nothing was on the line, as far as is known */
    uint16_t *registers; /* memory of who asked, until DONE */
    struct cb_modbus_request request;
    struct cb_rtu_receiver receiver;
    uint8_t frame[CB_RTU_MAX_FRAME];
};

/* Opens the port. in : lumps_us: how far apart the lumps are in which bytes come; 0 on a real line
 */
void cb_wire_start(struct cb_wire *wire, enum cb_usart port, const struct cb_rtu_line *line,
                   uint32_t lumps_us);

/* in : state IDLE or DONE; what: not NOTHING; what the request points at is only read now;
 * registers of the reply, unchanged unless CB_RTU_END_REPLY, NULL where it has none out: QUIET, or
 * DONE with NOT_SENT for a request that cannot be encoded */
void cb_wire_ask(struct cb_wire *wire, enum cb_rtu_ask what, uint8_t unit,
                 const struct cb_modbus_request *request, uint16_t *registers, int64_t until_us);

/* Does what can be done now. out: whether it is DONE */
bool cb_wire_poll(struct cb_wire *wire, int64_t now_us);

#endif
