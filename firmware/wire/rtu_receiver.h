/* SPDX-License-Identifier: MIT
 * The reply to one request, taken from a serial line byte by byte. No I/O, no clock.
 *
 *   WAITING ──byte──► INSIDE ──the last byte of a valid reply──► REPLY
 *      ▲                │ silence
 *      └──less than a frame came──┴──a frame's worth came──► SPOILT
 *
 * A reply counts only when unit id, function, count and CRC are those of the request. Bytes before
 * it are noise and skipped, so that a glitch as a driver is switched on costs nothing. */
#ifndef COMPBOX_FIRMWARE_WIRE_RTU_RECEIVER_H
#define COMPBOX_FIRMWARE_WIRE_RTU_RECEIVER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/wire/modbus_rtu.h"
#include "firmware/wire/rtu_line.h"

enum cb_rtu_reception {
    CB_RTU_WAITING, /* nothing came yet, or only noise shorter than a frame */
    CB_RTU_INSIDE,  /* bytes come */
    CB_RTU_REPLY,   /* frame[from … have) is the reply: cb_rtu_receiver_take */
    CB_RTU_SPOILT,  /* something came, was not the reply, and ended: the slave has had its say */
};

struct cb_rtu_receiver {
    struct cb_rtu_silence silence;
    struct cb_modbus_request request; /* its registers are not looked at */
    uint8_t head[6]; /* how the reply has to begin: unit id, function, count or echo */
    uint8_t head_bytes;
    uint8_t state;   /* enum cb_rtu_reception */
    uint16_t from;   /* where the candidate for a reply begins */
    uint16_t have;   /* bytes in frame, <= CB_RTU_MAX_FRAME */
    uint16_t plain;  /* bytes are only stored while have is below it: inside a candidate whose head
                        is whole, up to its last byte; 0: look at each */
    uint32_t noise;  /* bytes skipped since cb_rtu_receiver_start */
    int64_t last_us; /* when the last byte came */
    uint8_t frame[CB_RTU_MAX_FRAME];
};

/* in : silences that part frames. Where bytes are handed over in lumps (a UART of an operating
 *      system, a USB adapter) both longer than the lumps are apart. */
void cb_rtu_receiver_start(struct cb_rtu_receiver *receiver, struct cb_rtu_silence silence);

/* A request was sent, to the last bit, at now_us: what comes from now on may be its reply.
 * in : a request and unit that cb_rtu_encode takes */
void cb_rtu_receiver_expect(struct cb_rtu_receiver *receiver, uint8_t unit,
                            const struct cb_modbus_request *request, int64_t now_us);

/* in : a byte, and when it came; now_us must not decrease
 * out: the new state; in REPLY and SPOILT the byte is dropped and nothing changes */
enum cb_rtu_reception cb_rtu_receiver_byte(struct cb_rtu_receiver *receiver, uint8_t byte,
                                           int64_t now_us);

/* out: the state at now_us, when no byte came until then */
enum cb_rtu_reception cb_rtu_receiver_look(struct cb_rtu_receiver *receiver, int64_t now_us);

/* out: whether what came has the length and the beginning of the reply, and a wrong check sum:
 * nothing more will come of it */
bool cb_rtu_receiver_damaged(const struct cb_rtu_receiver *receiver);

/* in : any state
 * out: what came, as cb_rtu_decode_sound says of REPLY (CB_RTU_OK or CB_RTU_EXCEPTION), or of the
 * bytes as a whole otherwise (never these two): why it is no reply; CB_RTU_LENGTH where none came
 */
enum cb_rtu_answer cb_rtu_receiver_take(const struct cb_rtu_receiver *receiver, uint16_t *registers,
                                        uint8_t *exception);

#endif
