/* SPDX-License-Identifier: MIT
 * Takes the reply to one request from a serial line, byte by byte. No I/O, no clock.
 *
 *   WAITING ──byte──► INSIDE ──the last byte of a valid reply──► REPLY
 *      ▲                │ silence
 *      └──less than a frame came──┴──a frame's worth came──► SPOILT
 *
 * A reply is accepted only if unit id, function, count and CRC match the request. Bytes before it
 * are skipped as noise, so that a glitch at the switching of a driver is harmless. */
#ifndef COMPBOX_FIRMWARE_WIRE_RTU_RECEIVER_H
#define COMPBOX_FIRMWARE_WIRE_RTU_RECEIVER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/wire/modbus_rtu.h"
#include "firmware/wire/rtu_line.h"

enum cb_rtu_reception {
    CB_RTU_WAITING, /* no bytes yet, or only noise shorter than a frame */
    CB_RTU_INSIDE,  /* bytes are arriving */
    CB_RTU_REPLY,   /* frame[from … have) is the reply: cb_rtu_receiver_take */
    CB_RTU_SPOILT,  /* other bytes than the reply came, and ended: the slave has replied */
};

struct cb_rtu_receiver {
    struct cb_rtu_silence silence;
    struct cb_modbus_request request; /* its registers are not used */
    uint8_t head[6]; /* required beginning of the reply: unit id, function, count or echo */
    uint8_t head_bytes;
    uint8_t state;   /* enum cb_rtu_reception */
    uint16_t from;   /* start of the candidate for a reply */
    uint16_t have;   /* bytes in frame, <= CB_RTU_MAX_FRAME */
    uint16_t plain;  /* bytes are only stored while have is below it: inside a candidate with a
                        complete head, up to its last byte; 0: check each byte */
    uint32_t noise;  /* bytes skipped since cb_rtu_receiver_start */
    int64_t last_us; /* time of the last byte */
    uint8_t frame[CB_RTU_MAX_FRAME];
};

/* in : silences between frames. Where bytes arrive in lumps (a UART of an operating system, a USB
 *      adapter), both must be longer than the gaps between lumps. */
void cb_rtu_receiver_start(struct cb_rtu_receiver *receiver, struct cb_rtu_silence silence);

/* The last bit of a request was sent at now_us; bytes from now on may be its reply.
 * in : a request and unit that cb_rtu_encode accepts */
void cb_rtu_receiver_expect(struct cb_rtu_receiver *receiver, uint8_t unit,
                            const struct cb_modbus_request *request, int64_t now_us);

/* in : a byte and its time of arrival; now_us must not decrease
 * out: the new state; in REPLY and SPOILT the byte is dropped and nothing changes */
enum cb_rtu_reception cb_rtu_receiver_byte(struct cb_rtu_receiver *receiver, uint8_t byte,
                                           int64_t now_us);

/* out: the state at now_us, if no byte has come since the last call */
enum cb_rtu_reception cb_rtu_receiver_look(struct cb_rtu_receiver *receiver, int64_t now_us);

/* out: whether the bytes have the length and the beginning of the reply and a wrong check sum; no
 *      more bytes will follow */
bool cb_rtu_receiver_damaged(const struct cb_rtu_receiver *receiver);

/* in : any state
 * out: in REPLY the result of cb_rtu_decode_sound (CB_RTU_OK or CB_RTU_EXCEPTION); otherwise the
 *      reason why the bytes are no reply (never these two); CB_RTU_LENGTH if there are none */
enum cb_rtu_answer cb_rtu_receiver_take(const struct cb_rtu_receiver *receiver, uint16_t *registers,
                                        uint8_t *exception);

#endif
