/* SPDX-License-Identifier: MIT */
#include "firmware/wire/rtu_receiver.h"

#include "firmware/base/assert.h"

enum { EXCEPTION_BIT = 0x80 };

void cb_rtu_receiver_start(struct cb_rtu_receiver *receiver, struct cb_rtu_silence silence) {
    *receiver = (struct cb_rtu_receiver){.silence = silence};
}

/* Sets unit id, function, and the bytes of the request that the reply repeats. */
static void know_head(struct cb_rtu_receiver *receiver, uint8_t unit) {
    const struct cb_modbus_request *request = &receiver->request;
    uint8_t *head = receiver->head;
    head[0] = unit;
    head[1] = request->function;
    if (request->function != CB_MODBUS_WRITE) {
        head[2] = (uint8_t)(2 * request->read_count);
        receiver->head_bytes = 3;
        return;
    }
    head[2] = (uint8_t)(request->write_start >> 8);
    head[3] = (uint8_t)(request->write_start & 0xFF);
    head[4] = (uint8_t)(request->write_count >> 8);
    head[5] = (uint8_t)(request->write_count & 0xFF);
    receiver->head_bytes = 6;
}

void cb_rtu_receiver_expect(struct cb_rtu_receiver *receiver, uint8_t unit,
                            const struct cb_modbus_request *request, int64_t now_us) {
    receiver->request = *request;
    know_head(receiver, unit);
    receiver->state = CB_RTU_WAITING;
    receiver->from = receiver->have = receiver->plain = 0;
    receiver->last_us = now_us;
}

/* in : bytes[count], count >= 1
 * out: whether they match the beginning of the reply, as far as they go */
static bool begins(const struct cb_rtu_receiver *receiver, const uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count && i < receiver->head_bytes; ++i)
        if (bytes[i] != receiver->head[i]) return false;
    return true;
}

/* in : bytes that do not begin the reply: two or more, if the first is the unit id */
static bool begins_exception(const struct cb_rtu_receiver *receiver, const uint8_t *bytes) {
    return bytes[0] == receiver->head[0] && bytes[1] == (receiver->head[1] | EXCEPTION_BIT);
}

/* in : count >= CB_RTU_MIN_FRAME */
static bool crc_fits(const uint8_t *frame, size_t count) {
    return cb_rtu_crc(frame, count - 2) == (uint16_t)(frame[count - 2] | frame[count - 1] << 8);
}

/* out: length of the frame that the candidate can become; 0: none */
static size_t wanted_bytes(const struct cb_rtu_receiver *receiver, const uint8_t *bytes,
                           size_t count) {
    if (begins(receiver, bytes, count)) return cb_rtu_reply_bytes(&receiver->request);
    return begins_exception(receiver, bytes) ? CB_RTU_EXCEPTION_FRAME : 0;
}

/* in : length of the candidate; 0: not known yet */
static void store_plainly(struct cb_rtu_receiver *receiver, size_t wanted) {
    const size_t last = wanted == 0 ? 0 : receiver->from + wanted - 1;
    receiver->plain = (uint16_t)(last < CB_RTU_MAX_FRAME ? last : CB_RTU_MAX_FRAME);
}

/* Skips bytes until the rest can become the reply. out: whether it is complete. */
static bool find_reply(struct cb_rtu_receiver *receiver) {
    for (; receiver->from < receiver->have; ++receiver->from, ++receiver->noise) {
        const uint8_t *candidate = receiver->frame + receiver->from;
        const size_t count = (size_t)receiver->have - receiver->from;
        const size_t wanted = wanted_bytes(receiver, candidate, count);
        if (wanted > count) {
            store_plainly(receiver, count >= receiver->head_bytes ? wanted : 0);
            return false;
        }
        if (wanted == 0 || !crc_fits(candidate, wanted)) continue;
        receiver->have = (uint16_t)(receiver->from + wanted);
        return true;
    }
    return false;
}

static void skip_all(struct cb_rtu_receiver *receiver) {
    receiver->noise += (uint32_t)(receiver->have - receiver->from);
    receiver->from = receiver->have;
    receiver->plain = 0;
}

/* Makes room for one byte. A candidate is shorter than the buffer, so there is always a byte to
 * drop. */
static void make_room(struct cb_rtu_receiver *receiver) {
    if (receiver->have < CB_RTU_MAX_FRAME) return;
    const uint16_t kept = (uint16_t)(receiver->have - receiver->from);
    for (uint16_t i = 0; i < kept; ++i) receiver->frame[i] = receiver->frame[receiver->from + i];
    receiver->from = 0;
    receiver->have = kept;
}

/* Tests for the usual byte, at a fraction of the cost. `plain` is 0 in every state but INSIDE. */
static bool is_plain(const struct cb_rtu_receiver *receiver, int64_t now_us) {
    return receiver->have < receiver->plain &&
           now_us - receiver->last_us <= (int64_t)receiver->silence.inside_us;
}

/* Any other byte, in a function of its own so that the usual byte saves no registers. */
__attribute__((noinline)) static enum cb_rtu_reception look_at(struct cb_rtu_receiver *receiver,
                                                               uint8_t byte, int64_t now_us) {
    receiver->plain = 0;
    const enum cb_rtu_reception before = cb_rtu_receiver_look(receiver, now_us);
    if (before == CB_RTU_REPLY || before == CB_RTU_SPOILT) return before;
    if (now_us - receiver->last_us > (int64_t)receiver->silence.inside_us) skip_all(receiver);
    make_room(receiver);
    CB_ASSERT(receiver->have < CB_RTU_MAX_FRAME);
    receiver->frame[receiver->have++] = byte;
    receiver->last_us = now_us;
    receiver->state = find_reply(receiver) ? CB_RTU_REPLY : CB_RTU_INSIDE;
    return (enum cb_rtu_reception)receiver->state;
}

enum cb_rtu_reception cb_rtu_receiver_byte(struct cb_rtu_receiver *receiver, uint8_t byte,
                                           int64_t now_us) {
    if (!is_plain(receiver, now_us)) return look_at(receiver, byte, now_us);
    receiver->frame[receiver->have++] = byte;
    receiver->last_us = now_us;
    return CB_RTU_INSIDE;
}

enum cb_rtu_reception cb_rtu_receiver_look(struct cb_rtu_receiver *receiver, int64_t now_us) {
    const bool silent = now_us - receiver->last_us >= (int64_t)receiver->silence.between_us;
    if (receiver->state == CB_RTU_INSIDE && silent) {
        if (receiver->have >= CB_RTU_MIN_FRAME) {
            receiver->state = CB_RTU_SPOILT;
            receiver->plain = 0;
        } else {
            skip_all(receiver);
            receiver->from = receiver->have = 0;
            receiver->state = CB_RTU_WAITING;
        }
    }
    return (enum cb_rtu_reception)receiver->state;
}

bool cb_rtu_receiver_damaged(const struct cb_rtu_receiver *receiver) {
    return receiver->state != CB_RTU_REPLY &&
           receiver->have == cb_rtu_reply_bytes(&receiver->request) &&
           begins(receiver, receiver->frame, receiver->have) &&
           !crc_fits(receiver->frame, receiver->have);
}

enum cb_rtu_answer cb_rtu_receiver_take(const struct cb_rtu_receiver *receiver, uint16_t *registers,
                                        uint8_t *exception) {
    if (receiver->state == CB_RTU_REPLY)
        return cb_rtu_decode_sound(&receiver->request, receiver->frame + receiver->from,
                                   (size_t)receiver->have - receiver->from, registers, exception);
    /* complete and valid nevertheless: for another request, or with a gap; never accepted */
    const enum cb_rtu_answer answer =
        cb_rtu_check(receiver->head[0], receiver->frame, receiver->have);
    return answer == CB_RTU_OK ? CB_RTU_INVALID : answer;
}
