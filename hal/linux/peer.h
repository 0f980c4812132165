/* SPDX-License-Identifier: MIT
 * Observations of the PLC's replies, for the log and the statistics: replies that do not match the
 * request, unsupported functions, and reply times. */
#ifndef COMPBOX_HAL_LINUX_PEER_H
#define COMPBOX_HAL_LINUX_PEER_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/wire/modbus.h"

/* X(name, word, sentence with two numbers: of the reply, of the request) */
#define CB_ODD_REPLIES(X)                                                                 \
    X(CB_ODD_UNIT, "unit", "a reply from unit %u to a request for unit %u")               \
    X(CB_ODD_FUNCTION, "function", "a reply of function %u to a request for function %u") \
    X(CB_ODD_LENGTH, "length", "a reply of %u bytes of function and data instead of %u")  \
    X(CB_ODD_ECHO, "echo", "a reply that confirms a write to register %u instead of %u")

enum cb_odd {
#define CB_X(name, word, sentence) name,
    CB_ODD_REPLIES(CB_X)
#undef CB_X
        CB_ODD_COUNT
};

enum { CB_PEER_REPLIES = 8 }; /* number of newest replies whose times are kept */

struct cb_odd_reply {
    uint32_t count;         /* wraps */
    uint16_t got, expected; /* of the last one */
};

struct cb_peer {
    struct cb_odd_reply odd[CB_ODD_COUNT];
    uint32_t refused_functions; /* bits 1 << code: last reply was exception 1, illegal function */
    uint32_t reply_us[CB_PEER_REPLIES]; /* 0: none yet */
    uint8_t next;                       /* place in reply_us */
};

/* in : the unit and request that were sent; frame[length]: unit id, function and data of a reply
 *      that does not match it, length >= 2
 * out: counted by the first difference */
void cb_peer_note_odd(struct cb_peer *peer, uint8_t unit, const struct cb_modbus_request *request,
                      const uint8_t *frame, size_t length);

/* in : exception: its code; 0: a normal reply */
void cb_peer_note_answer(struct cb_peer *peer, uint8_t function, uint8_t exception);

/* in : time from a request to its reply, late ones included; >= 0 */
void cb_peer_note_time(struct cb_peer *peer, int64_t took_us);

/* out: the longest of the newest times; 0: none yet */
uint32_t cb_peer_slowest_us(const struct cb_peer *peer);

/* in : a function of CB_MODBUS_… that the PLC refuses by exception 1
 * out: the remedy, one clause */
const char *cb_peer_remedy(uint8_t function);

#endif
