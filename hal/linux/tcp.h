/* SPDX-License-Identifier: MIT
 * Modbus/TCP client for a loop that must not be late (docs/decisions/0006-own-modbus-client.md).
 *
 * One request is out at a time. Every call returns by its deadline, whatever the PLC does. What a
 * reply is taken for is decided by its transaction id: a late one is dropped when it comes, and a
 * part of one is kept until the rest of it is there. After a few exchanges in a row without a
 * valid reply, or when the stream can no longer be cut into frames, the connection is made anew. */
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

#define CB_TCP_ERRORS(X)                                                                    \
    X(exceptions)         /* replies that refuse */                                         \
    X(timeouts)           /* requests without a valid reply by their deadline */            \
    X(blocked)            /* requests not sent: the one before was still unanswered */      \
    X(out_of_time)        /* requests not sent: no time was left in the cycle */            \
    X(late_replies)       /* replies to a request that had been given up */                 \
    X(stray_replies)      /* second replies, and replies nobody asked for */                \
    X(wrong_ids)          /* replies with a transaction id that was never sent */           \
    X(invalid_replies)    /* right id, but another unit, function, length or echo */        \
    X(incomplete_replies) /* a part of a reply, the rest never came: connection given up */ \
    X(framing_errors)     /* no Modbus/TCP header where one must be: connection given up */ \
    X(closed_by_peer)     /* the PLC closed the connection */                               \
    X(socket_errors)      /* sending or receiving failed */                                 \
    X(given_up)           /* connections closed after several exchanges without valid reply */

#define CB_TCP_COUNTERS(X) CB_TCP_TRAFFIC(X) CB_TCP_ERRORS(X)

enum { CB_TCP_EXCEPTIONS = 16 }; /* exception codes counted apart; 0: all others */

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
    int64_t sent_us;         /* when the request that is out was sent */
    uint8_t unit;            /* Modbus unit id, in requests and in replies */
    bool awaiting;           /* a request is out and has not been answered */
    bool read_answered;      /* a request that reads was, on this connection */
    bool write_answered;     /* … and one that writes */
    uint8_t failures_in_row; /* exchanges without a valid reply, on this connection */
    uint16_t transaction;    /* id of the last request */
    size_t have;             /* bytes received and not yet used */
    int64_t received_us;     /* when the last of them came */
    uint8_t received[2 * CB_TCP_MAX_FRAME];
};

/* in : host, numeric address; false when it is not one. The connection comes up by itself. */
bool cb_tcp_start(struct cb_tcp *tcp, const char *host, uint16_t port, uint8_t unit);

/* One request, as the operations of hal.h; deadline in CLOCK_BOOTTIME. */
enum cb_transfer cb_tcp_exchange(struct cb_tcp *tcp, const struct cb_modbus_request *request,
                                 uint16_t *registers, int64_t deadline_us);

/* Closes the connection in order behind the request that was sent last and has no reply yet
 * (cb_link_leave); the next exchange connects anew. Nothing happens where it is not up. */
void cb_tcp_leave(struct cb_tcp *tcp);

#endif
