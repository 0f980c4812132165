/* SPDX-License-Identifier: MIT
 * Modbus/TCP client for a loop that must not be late (docs/decisions/0006-own-modbus-client.md).
 *
 * One request is pending at a time. Every call returns by its deadline, whatever the PLC does. The
 * transaction id assigns a reply to its request: a late reply is dropped, and a part of one is kept
 * until its rest arrives. After a few exchanges in a row without a valid reply, or when the stream
 * can no longer be divided into frames, a new connection is made. */
#ifndef COMPBOX_HAL_LINUX_TCP_H
#define COMPBOX_HAL_LINUX_TCP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/wire/modbus.h"
#include "hal/hal.h"
#include "hal/linux/link.h"
#include "hal/linux/peer.h"

/* Counters for everything that happens on the wire; they wrap. Names are stable. */
#define CB_TCP_TRAFFIC(X)                                         \
    X(requests)      /* sent */                                   \
    X(replies)       /* valid and in time, exceptions included */ \
    X(not_connected) /* requests not sent: no connection */

#define CB_TCP_ERRORS(X)                                                              \
    X(exceptions)         /* refused by the PLC */                                    \
    X(timeouts)           /* requests without a valid reply by their deadline */      \
    X(blocked)            /* requests not sent: the previous one is pending */        \
    X(out_of_time)        /* requests not sent: no time was left in the cycle */      \
    X(late_replies)       /* replies to an abandoned request */                       \
    X(stray_replies)      /* second replies, and unrequested replies */               \
    X(wrong_ids)          /* replies with a transaction id that was never sent */     \
    X(invalid_replies)    /* right id, but another unit, function, length or echo */  \
    X(incomplete_replies) /* part of a reply without its rest: connection dropped */  \
    X(framing_errors)     /* bytes without a Modbus/TCP header: connection dropped */ \
    X(closed_by_peer)     /* the PLC closed the connection */                         \
    X(socket_errors)      /* sending or receiving failed */                           \
    X(given_up)           /* connections dropped after several exchanges without a valid reply */

#define CB_TCP_COUNTERS(X) CB_TCP_TRAFFIC(X) CB_TCP_ERRORS(X)

enum { CB_TCP_EXCEPTIONS = 16 }; /* exception codes counted separately; 0: all others */

struct cb_tcp_counters {
#define CB_X(name) uint32_t name;
    CB_TCP_COUNTERS(CB_X)
#undef CB_X
    uint32_t exceptions_by_code[CB_TCP_EXCEPTIONS];
};

enum { CB_TCP_MAX_FRAME = 260 }; /* header of 7 bytes and 253 bytes of function and data */

struct cb_tcp {
    struct cb_link link;
    struct cb_tcp_counters counters;
    struct cb_peer peer;
    int64_t sent_us;         /* time of the pending request */
    uint8_t unit;            /* Modbus unit id, in requests and in replies */
    bool awaiting;           /* a request is pending */
    bool read_answered;      /* a read got a reply on this connection */
    bool write_answered;     /* a write got a reply on it */
    uint8_t failures_in_row; /* exchanges without a valid reply, on this connection */
    uint16_t transaction;    /* id of the last request */
    size_t have;             /* bytes received and not yet used */
    int64_t received_us;     /* time of the last of them */
    uint8_t received[2 * CB_TCP_MAX_FRAME];
};

/* in : host, numeric address. out: false for any other text. The connection comes up
 * automatically. */
bool cb_tcp_start(struct cb_tcp *tcp, const char *host, uint16_t port, uint8_t unit);

/* One request, as the operations of hal.h; deadline in CLOCK_BOOTTIME. */
enum cb_transfer cb_tcp_exchange(struct cb_tcp *tcp, const struct cb_modbus_request *request,
                                 uint16_t *registers, int64_t deadline_us);

/* Closes the connection in order behind the last request, which has no reply yet (cb_link_leave).
 * The next exchange reconnects. No effect if it is not up. */
void cb_tcp_leave(struct cb_tcp *tcp);

#endif
