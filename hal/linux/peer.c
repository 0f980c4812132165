/* SPDX-License-Identifier: MIT */
#include "hal/linux/peer.h"

#include <stdbool.h>

enum { EXCEPTION_BIT = 0x80, WRITE_REPLY_BYTES = 5 };

static void note(struct cb_peer *peer, enum cb_odd kind, unsigned got, unsigned expected) {
    struct cb_odd_reply *odd = &peer->odd[kind];
    odd->count++;
    odd->got = (uint16_t)got;
    odd->expected = (uint16_t)expected;
}

/* in : pdu[length] of the requested function, length >= 1 */
static void note_content(struct cb_peer *peer, const struct cb_modbus_request *request,
                         const uint8_t *pdu, size_t length) {
    const bool writes = request->function == CB_MODBUS_WRITE;
    const unsigned whole = writes ? WRITE_REPLY_BYTES : 2u + 2u * request->read_count;
    const unsigned start = writes && length == whole ? (unsigned)(pdu[1] << 8 | pdu[2]) : 0;
    if (writes && length == whole && start != request->write_start)
        note(peer, CB_ODD_ECHO, start, request->write_start);
    else if (writes && length == whole) /* a reply to a request for this number of registers */
        note(peer, CB_ODD_LENGTH, 2u * (unsigned)(pdu[3] << 8 | pdu[4]), 2u * request->write_count);
    else
        note(peer, CB_ODD_LENGTH, length == whole ? 2u + pdu[1] : (unsigned)length, whole);
}

void cb_peer_note_odd(struct cb_peer *peer, uint8_t unit, const struct cb_modbus_request *request,
                      const uint8_t *frame, size_t length) {
    const unsigned function = frame[1] & ~(unsigned)EXCEPTION_BIT;
    if (frame[0] != unit)
        note(peer, CB_ODD_UNIT, frame[0], unit);
    else if (function != request->function)
        note(peer, CB_ODD_FUNCTION, function, request->function);
    else
        note_content(peer, request, frame + 1, length - 1);
}

void cb_peer_note_answer(struct cb_peer *peer, uint8_t function, uint8_t exception) {
    const uint32_t bit = 1u << (function & 31);
    if (exception == CB_MODBUS_ILLEGAL_FUNCTION)
        peer->refused_functions |= bit;
    else if (exception == 0)
        peer->refused_functions &= ~bit;
}

void cb_peer_note_time(struct cb_peer *peer, int64_t took_us) {
    peer->reply_us[peer->next] = took_us < UINT32_MAX ? (uint32_t)took_us : UINT32_MAX;
    peer->next = (uint8_t)((peer->next + 1) % CB_PEER_REPLIES);
}

uint32_t cb_peer_slowest_us(const struct cb_peer *peer) {
    uint32_t slowest_us = 0;
    for (unsigned i = 0; i < CB_PEER_REPLIES; i++)
        if (peer->reply_us[i] > slowest_us) slowest_us = peer->reply_us[i];
    return slowest_us;
}

const char *cb_peer_remedy(uint8_t function) {
    switch (function) {
        case CB_MODBUS_WRITE_READ:
            return "set plc.exchange to \"fc3+fc16\"";
        case CB_MODBUS_WRITE:
            return "permit writing in its Modbus server, or set plc.exchange to \"fc23\" if it has "
                   "function 23";
        default:
            return "let its Modbus server answer holding registers, nothing else is read";
    }
}
