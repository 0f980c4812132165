/* SPDX-License-Identifier: MIT */
#include "hal/linux/rtu.h"

#include <poll.h>
#include <string.h>

#include "hal/linux/clock.h"
#include "hal/rtu_exchange.h"

enum { LUMP_US = 6000 /* longest gap within bytes from a driver or a USB adapter */ };

static void start(struct cb_rtu *rtu, const struct cb_serial_config *config,
                  struct cb_serial_opener *opener) {
    const uint32_t between_us = cb_rtu_silences(&config->line).between_us;
    const uint32_t silent_us = between_us + LUMP_US;
    memset(rtu, 0, sizeof *rtu);
    rtu->unit = config->unit;
    rtu->between_us = between_us;
    cb_rtu_receiver_start(&rtu->receiver, (struct cb_rtu_silence){silent_us, silent_us});
    cb_serial_start(&rtu->serial, config, opener);
    cb_serial_ready(&rtu->serial, cb_boottime_us());
}

void cb_rtu_start(struct cb_rtu *rtu, const struct cb_serial_config *config,
                  const struct cb_rtu_manners *manners, struct cb_serial_opener *opener) {
    start(rtu, config, opener);
    rtu->has_dialog = true;
    cb_rtu_dialog_start(&rtu->dialog, manners, LUMP_US);
}

void cb_rtu_start_bus(struct cb_rtu *rtu, const struct cb_serial_config *config,
                      struct cb_serial_opener *opener) {
    start(rtu, config, opener);
}

/* No request begins before 3.5 characters behind these bytes. */
static void keep_silent(struct cb_rtu *rtu, int64_t last_us) {
    const int64_t free_us = last_us + rtu->between_us;
    if (free_us > rtu->line_free_us) rtu->line_free_us = free_us;
}

/* Takes the pending bytes, without waiting. The line is free 3.5 characters after them, and after a
 * request that is still on its way. They may have come since now_us, if this thread did not run. */
static size_t receive(struct cb_rtu *rtu, uint8_t *bytes, size_t size, int64_t now_us) {
    const uint32_t disconnects = rtu->serial.disconnects;
    const size_t got = cb_serial_receive(&rtu->serial, bytes, size, now_us);
    if (got > 0) keep_silent(rtu, cb_boottime_us());
    if (rtu->serial.disconnects != disconnects) {
        rtu->counters.device_errors++;
        cb_rtu_dialog_doubt(&rtu->dialog);
    }
    return got;
}

static void sleep_until_readable(const struct cb_rtu *rtu, int64_t until_us) {
    const int64_t left_us = until_us - cb_boottime_us();
    if (left_us <= 0) return;
    struct pollfd wait = {.fd = rtu->serial.fd, .events = POLLIN};
    struct timespec left = cb_timespec(left_us * 1000);
    ppoll(&wait, 1, &left, NULL);
}

static int64_t sooner(int64_t a_us, int64_t b_us) {
    return a_us < b_us ? a_us : b_us;
}

/* Drops at most a frame's worth of unrequested bytes. out: whether it may have been a frame */
static bool drop(struct cb_rtu *rtu, size_t bytes) {
    const bool frame = bytes >= CB_RTU_MIN_FRAME;
    rtu->counters.noise_bytes += (uint32_t)bytes;
    rtu->counters.stray_replies += frame;
    return frame;
}

/* Drops unrequested bytes, and waits until the line was silent long enough for a frame to begin.
 * out: REPLY if it was; STRAY if the dropped bytes may have held a reply; NOT_SENT if the line is
 *      not silent in time, or the device is lost */
static enum cb_rtu_end find_silence(struct cb_rtu *rtu, int64_t until_us) {
    size_t dropped = 0;
    for (;;) {
        uint8_t bytes[CB_RTU_MAX_FRAME];
        const int64_t now_us = cb_boottime_us();
        const size_t got = receive(rtu, bytes, sizeof bytes, now_us);
        dropped += got;
        if (rtu->serial.fd < 0 || now_us >= until_us) {
            if (drop(rtu, dropped)) cb_rtu_dialog_doubt(&rtu->dialog);
            return CB_RTU_END_NOT_SENT;
        }
        if (got == 0 && now_us >= rtu->line_free_us) break;
        sleep_until_readable(rtu, sooner(rtu->line_free_us, until_us));
    }
    return drop(rtu, dropped) ? CB_RTU_END_STRAY : CB_RTU_END_REPLY;
}

static bool send_request(struct cb_rtu *rtu, uint8_t unit,
                         const struct cb_modbus_request *request) {
    uint8_t frame[CB_RTU_MAX_FRAME];
    const size_t bytes = cb_rtu_encode(unit, request, frame);
    const int64_t now_us = cb_boottime_us();
    if (bytes == 0) return false;
    if (!cb_serial_send(&rtu->serial, frame, bytes, now_us)) {
        rtu->counters.device_errors++;
        cb_rtu_dialog_doubt(&rtu->dialog);
        return false;
    }
    rtu->counters.requests++;
    keep_silent(rtu, cb_boottime_us() + cb_rtu_frame_us(&rtu->serial.config.line, bytes));
    cb_rtu_receiver_expect(&rtu->receiver, unit, request, now_us);
    return true;
}

static enum cb_rtu_end take_reply(struct cb_rtu *rtu, uint16_t *registers) {
    uint8_t code = 0;
    const enum cb_rtu_answer answer = cb_rtu_receiver_take(&rtu->receiver, registers, &code);
    rtu->counters.replies++;
    cb_serial_proven(&rtu->serial);
    cb_peer_note_answer(&rtu->peer, rtu->receiver.request.function, code);
    if (answer == CB_RTU_OK) return CB_RTU_END_REPLY;
    rtu->counters.exceptions++;
    rtu->counters.exceptions_by_code[code < CB_RTU_EXCEPTIONS ? code : 0]++;
    return CB_RTU_END_REFUSED;
}

/* in : the received frame is complete and valid, and not the reply */
static void note_odd(struct cb_rtu *rtu) {
    const struct cb_rtu_receiver *receiver = &rtu->receiver;
    cb_peer_note_odd(&rtu->peer, receiver->head[0], &receiver->request, receiver->frame,
                     (size_t)receiver->have - 2);
}

/* Counts bytes that ended and are not the reply, by their kind. */
static enum cb_rtu_end note_spoilt(struct cb_rtu *rtu, enum cb_rtu_send what) {
    uint8_t exception = 0;
    switch (cb_rtu_receiver_take(&rtu->receiver, NULL, &exception)) {
        case CB_RTU_UNIT:
            rtu->counters.wrong_units++;
            note_odd(rtu);
            break;
        case CB_RTU_INVALID: /* a complete frame of the slave, but for an earlier request */
            rtu->counters.late_replies += what == CB_RTU_SEND_PROBE;
            rtu->counters.invalid_replies += what != CB_RTU_SEND_PROBE;
            if (what != CB_RTU_SEND_PROBE) note_odd(rtu);
            break;
        case CB_RTU_OK:
        case CB_RTU_EXCEPTION:
        case CB_RTU_LENGTH:
        case CB_RTU_CRC:
            rtu->counters.crc_errors++;
            break;
    }
    return cb_rtu_receiver_damaged(&rtu->receiver) ? CB_RTU_END_DAMAGED : CB_RTU_END_RUBBISH;
}

/* out: silence after which received bytes are complete */
static int64_t over_us(const struct cb_rtu *rtu) {
    const bool damaged = cb_rtu_receiver_damaged(&rtu->receiver);
    return rtu->receiver.last_us + (damaged ? rtu->between_us : rtu->receiver.silence.between_us);
}

/* out: whether bytes came, are not the reply, and ended */
static bool is_spoilt(struct cb_rtu *rtu, int64_t now_us) {
    const enum cb_rtu_reception state = cb_rtu_receiver_look(&rtu->receiver, now_us);
    return state == CB_RTU_SPOILT || (state == CB_RTU_INSIDE && now_us >= over_us(rtu));
}

/* Feeds bytes to the receiver.
 * out: whether the reply is complete; then *doubt: whether a frame may have followed it */
static bool hear(struct cb_rtu *rtu, const uint8_t *bytes, size_t count, int64_t now_us,
                 bool *doubt) {
    for (size_t i = 0; i < count; ++i) {
        if (cb_rtu_receiver_byte(&rtu->receiver, bytes[i], now_us) != CB_RTU_REPLY) continue;
        *doubt = drop(rtu, count - i - 1);
        return true;
    }
    return false;
}

/* Waits for the reply. For a probe, other bytes before the reply are skipped. */
static enum cb_rtu_end listen(struct cb_rtu *rtu, enum cb_rtu_send what, uint16_t *registers,
                              int64_t until_us) {
    for (;;) {
        uint8_t bytes[CB_RTU_MAX_FRAME];
        bool doubt = false;
        const int64_t now_us = cb_boottime_us();
        const size_t got = receive(rtu, bytes, sizeof bytes, now_us);
        if (is_spoilt(rtu, now_us)) {
            const enum cb_rtu_end end = note_spoilt(rtu, what);
            if (what != CB_RTU_SEND_PROBE || end == CB_RTU_END_DAMAGED)
                return drop(rtu, got) ? CB_RTU_END_RUBBISH : end;
            cb_rtu_receiver_expect(&rtu->receiver, rtu->unit, cb_rtu_probe(&rtu->dialog), now_us);
        }
        if (hear(rtu, bytes, got, now_us, &doubt)) {
            const enum cb_rtu_end end = take_reply(rtu, registers);
            if (doubt) cb_rtu_dialog_doubt(&rtu->dialog);
            return end;
        }
        if (now_us >= until_us || rtu->serial.fd < 0) break;
        const bool inside = rtu->receiver.state == CB_RTU_INSIDE;
        sleep_until_readable(rtu, inside ? sooner(over_us(rtu), until_us) : until_us);
    }
    rtu->counters.timeouts += rtu->serial.fd >= 0;
    return CB_RTU_END_SILENT;
}

/* Sends one frame and waits for its result. */
static enum cb_rtu_end exchange_once(struct cb_rtu *rtu, enum cb_rtu_send what, uint8_t unit,
                                     const struct cb_modbus_request *request, uint16_t *registers,
                                     int64_t until_us) {
    if (!cb_serial_ready(&rtu->serial, cb_boottime_us())) {
        rtu->counters.not_connected++;
        return CB_RTU_END_NOT_SENT;
    }
    const enum cb_rtu_end silence = find_silence(rtu, until_us);
    if (silence == CB_RTU_END_NOT_SENT) {
        rtu->counters.not_connected += rtu->serial.fd < 0;
        rtu->counters.out_of_time += rtu->serial.fd >= 0;
        return silence;
    }
    if (silence == CB_RTU_END_STRAY && rtu->has_dialog && what == CB_RTU_SEND_REQUEST)
        return silence;
    if (!send_request(rtu, unit, request)) return CB_RTU_END_NOT_SENT;
    const uint32_t noise = rtu->receiver.noise;
    const enum cb_rtu_end end = listen(rtu, what, registers, until_us);
    rtu->counters.noise_bytes += rtu->receiver.noise - noise;
    return end;
}

static int64_t now_of(void *context) {
    (void)context;
    return cb_boottime_us();
}

static enum cb_rtu_end exchange_with_plc(void *context, enum cb_rtu_send what,
                                         const struct cb_modbus_request *request,
                                         uint16_t *registers, int64_t until_us) {
    struct cb_rtu *rtu = context;
    const uint32_t sent = rtu->counters.requests;
    const bool again = what == CB_RTU_SEND_REQUEST && rtu->dialog.requests > 0;
    const enum cb_rtu_end end = exchange_once(rtu, what, rtu->unit, request, registers, until_us);
    rtu->counters.probes += what == CB_RTU_SEND_PROBE && rtu->counters.requests != sent;
    rtu->counters.retries += again && rtu->counters.requests != sent;
    return end;
}

enum cb_transfer cb_rtu_exchange(struct cb_rtu *rtu, const struct cb_modbus_request *request,
                                 uint16_t *registers, int64_t deadline_us) {
    const struct cb_rtu_wire wire = {
        .context = rtu, .now_us = now_of, .exchange = exchange_with_plc};
    const enum cb_transfer done =
        cb_rtu_exchange_on(&wire, &rtu->dialog, request, registers, deadline_us);
    rtu->counters.out_of_time += rtu->dialog.sent == 0;
    return done;
}

enum cb_transfer cb_rtu_read_module(struct cb_rtu *rtu, uint8_t unit,
                                    const struct cb_modbus_request *request, uint16_t *registers,
                                    int64_t deadline_us) {
    switch (exchange_once(rtu, CB_RTU_SEND_REQUEST, unit, request, registers, deadline_us)) {
        case CB_RTU_END_REPLY:
            return CB_TRANSFER_OK;
        case CB_RTU_END_REFUSED:
            return CB_TRANSFER_REFUSED;
        case CB_RTU_END_DAMAGED:
        case CB_RTU_END_RUBBISH:
        case CB_RTU_END_SILENT:
            return CB_TRANSFER_UNKNOWN;
        case CB_RTU_END_STRAY:
        case CB_RTU_END_NOT_SENT:
            break;
    }
    return CB_TRANSFER_FAILED;
}
