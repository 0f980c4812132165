/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/wire.h"

void cb_wire_start(struct cb_wire *wire, enum cb_usart port, const struct cb_rtu_line *line,
                   uint32_t lumps_us) {
    static const enum cb_usart_parity with[] = {[CB_PARITY_NONE] = CB_USART_NONE,
                                                [CB_PARITY_EVEN] = CB_USART_EVEN,
                                                [CB_PARITY_ODD] = CB_USART_ODD};
    const struct cb_rtu_silence silence = cb_rtu_silences(line);
    *wire = (struct cb_wire){.line = *line, .silence = silence, .port = port};
    cb_rtu_receiver_start(&wire->receiver, (struct cb_rtu_silence){silence.inside_us + lumps_us,
                                                                   silence.between_us + lumps_us});
    cb_usart_open(port, line->baud, with[line->parity], line->stop_bits);
}

static bool finish(struct cb_wire *wire, enum cb_rtu_end end) {
    wire->counters.noise_bytes += wire->receiver.noise;
    wire->receiver.noise = 0;
    wire->end = end;
    wire->state = CB_WIRE_DONE;
    return true;
}

void cb_wire_send(struct cb_wire *wire, enum cb_rtu_send what, uint8_t unit,
                  const struct cb_modbus_request *request, uint16_t *registers, int64_t until_us) {
    wire->what = what;
    wire->dropped = 0;
    wire->unit = unit;
    wire->request = *request;
    wire->registers = registers;
    wire->until_us = until_us;
    wire->state = CB_WIRE_QUIET;
    wire->frame_bytes = (uint16_t)cb_rtu_encode(unit, request, wire->frame);
    wire->request.write_registers = 0;
    if (wire->frame_bytes == 0) (void)finish(wire, CB_RTU_END_NOT_SENT);
}

/* in : now_us: a reading of the clock; low_us: the low part of a byte's time
 * out: the byte's full time. The difference is signed, -35 to +35 minutes, because a byte that
 *      comes after the reading is a few µs newer than now_us. No byte waits longer: a line is read
 *      every 32 minutes at the latest (every_ms 60 000, back-off 32 of
 *      firmware/signals/bus_turns.h). */
static int64_t whole_time(int64_t now_us, uint32_t low_us) {
    return now_us - (int32_t)((uint32_t)now_us - low_us);
}

/* Takes bytes while no reply is awaited: late replies, noise, traffic of other peers. */
static void drain(struct cb_wire *wire, int64_t now_us) {
    struct cb_usart_byte byte;
    while (cb_usart_take(wire->port, &byte)) {
        wire->quiet_us = whole_time(now_us, byte.time_us);
        ++wire->counters.noise_bytes;
        ++wire->dropped;
    }
}

/* A frame's worth of bytes may have been a reply, and more may follow. */
static bool is_stray(const struct cb_wire *wire) {
    return wire->wary && wire->what == CB_RTU_SEND_REQUEST && wire->dropped >= CB_RTU_MIN_FRAME;
}

/* out: whether it is DONE */
static bool send_when_quiet(struct cb_wire *wire, int64_t now_us) {
    drain(wire, now_us);
    if (cb_usart_busy(wire->port)) wire->quiet_us = now_us; /* with an abandoned request */
    if (now_us - wire->quiet_us < (int64_t)wire->silence.between_us) return false;
    if (is_stray(wire)) return finish(wire, CB_RTU_END_STRAY);
    if (now_us >= wire->until_us) return false; /* nobody would wait for the reply */
    if (!cb_usart_send(wire->port, wire->frame, wire->frame_bytes)) return false;
    ++wire->counters.requests;
    wire->state = CB_WIRE_SENDING;
    return false;
}

static void expect(struct cb_wire *wire, int64_t now_us) {
    cb_rtu_receiver_expect(&wire->receiver, wire->unit, &wire->request, now_us);
}

/* Bytes received during sending are no reply. */
static void mind_sending(struct cb_wire *wire, int64_t now_us) {
    if (cb_usart_busy(wire->port)) {
        drain(wire, now_us);
        return;
    }
    wire->quiet_us = now_us;
    expect(wire, now_us);
    wire->state = CB_WIRE_LISTENING;
}

static bool take_reply(struct cb_wire *wire) {
    const enum cb_rtu_answer answer =
        cb_rtu_receiver_take(&wire->receiver, wire->registers, &wire->exception);
    ++wire->counters.replies;
    if (answer == CB_RTU_OK) return finish(wire, CB_RTU_END_REPLY);
    ++wire->counters.exceptions;
    wire->counters.illegal_functions += wire->exception == CB_MODBUS_ILLEGAL_FUNCTION;
    return finish(wire, CB_RTU_END_REFUSED);
}

/* Counts bytes that are no reply by their kind. A probe continues to wait. out: whether it is
 * DONE */
static bool take_rubbish(struct cb_wire *wire, int64_t now_us) {
    switch (cb_rtu_receiver_take(&wire->receiver, wire->registers, &wire->exception)) {
        case CB_RTU_CRC:
            ++wire->counters.crc_errors;
            break;
        case CB_RTU_UNIT:
            ++wire->counters.wrong_units;
            break;
        case CB_RTU_OK:
        case CB_RTU_EXCEPTION:
        case CB_RTU_LENGTH:
        case CB_RTU_INVALID:
            ++wire->counters.invalid_replies;
            break;
    }
    if (cb_rtu_receiver_damaged(&wire->receiver)) return finish(wire, CB_RTU_END_DAMAGED);
    if (wire->what != CB_RTU_SEND_PROBE) return finish(wire, CB_RTU_END_RUBBISH);
    expect(wire, now_us);
    return false;
}

/* Silence ends a series of bytes; after a damaged reply a short one does. */
static bool is_spoilt(struct cb_wire *wire, int64_t now_us) {
    const enum cb_rtu_reception state = cb_rtu_receiver_look(&wire->receiver, now_us);
    return state == CB_RTU_SPOILT ||
           (state == CB_RTU_INSIDE && cb_rtu_receiver_damaged(&wire->receiver) &&
            now_us - wire->receiver.last_us >= (int64_t)wire->silence.between_us);
}

/* A byte with a parity or framing error is inverted, so that the check sum rejects its frame. */
static bool listen(struct cb_wire *wire, int64_t now_us) {
    struct cb_usart_byte byte;
    while (cb_usart_take(wire->port, &byte)) {
        const uint8_t byte_or_not = byte.bad ? (uint8_t)~byte.byte : byte.byte;
        const int64_t came_us = whole_time(now_us, byte.time_us);
        wire->quiet_us = came_us;
        if (cb_rtu_receiver_look(&wire->receiver, came_us) == CB_RTU_SPOILT &&
            take_rubbish(wire, came_us))
            return true;
        if (cb_rtu_receiver_byte(&wire->receiver, byte_or_not, came_us) == CB_RTU_REPLY)
            return take_reply(wire);
    }
    return is_spoilt(wire, now_us) && take_rubbish(wire, now_us);
}

static bool give_up(struct cb_wire *wire) {
    if (wire->state == CB_WIRE_QUIET)
        return finish(wire, is_stray(wire) ? CB_RTU_END_STRAY : CB_RTU_END_NOT_SENT);
    ++wire->counters.timeouts;
    return finish(wire, CB_RTU_END_SILENT);
}

bool cb_wire_poll(struct cb_wire *wire, int64_t now_us) {
    switch (wire->state) {
        case CB_WIRE_IDLE:
            return false;
        case CB_WIRE_DONE:
            return true;
        case CB_WIRE_QUIET:
            if (send_when_quiet(wire, now_us)) return true;
            break;
        case CB_WIRE_SENDING:
            mind_sending(wire, now_us);
            break;
        case CB_WIRE_LISTENING:
            break;
    }
    /* also right behind SENDING: between two calls the whole reply may have come */
    if (wire->state == CB_WIRE_LISTENING && listen(wire, now_us)) return true;
    if (now_us < wire->until_us) return false;
    return give_up(wire);
}
