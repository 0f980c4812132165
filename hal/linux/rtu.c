/* SPDX-License-Identifier: MIT */
#include "hal/linux/rtu.h"

#include <poll.h>
#include <string.h>

#include "hal/linux/clock.h"

enum {
    LUMP_US = 6000,  /* a driver or a USB adapter may hand bytes over this far apart */
    SETTLE_US = 2000 /* a second reply follows the first by this and the slave's delay */
};

void cb_rtu_start(struct cb_rtu *rtu, const struct cb_serial_config *config,
                  struct cb_serial_opener *opener, uint32_t hold_us) {
    memset(rtu, 0, sizeof *rtu);
    const struct cb_rtu_silence silence = cb_rtu_silences(&config->line);
    const uint32_t silent_us = silence.between_us + LUMP_US;
    rtu->unit = config->unit;
    rtu->hold_us = hold_us;
    rtu->between_us = silence.between_us;
    cb_rtu_receiver_start(&rtu->receiver, (struct cb_rtu_silence){silent_us, silent_us});
    cb_serial_start(&rtu->serial, config, opener);
    cb_serial_ready(&rtu->serial, cb_boottime_us());
}

/* What is waiting, without waiting for it. The line is free 3.5 characters after it. */
static size_t receive(struct cb_rtu *rtu, uint8_t *bytes, size_t size, int64_t now_us) {
    const uint32_t disconnects = rtu->serial.disconnects;
    const size_t got = cb_serial_receive(&rtu->serial, bytes, size, now_us);
    if (got > 0) rtu->line_free_us = now_us + rtu->between_us;
    if (rtu->serial.disconnects != disconnects) {
        rtu->counters.device_errors++;
        rtu->awaiting = rtu->doubtful = false;
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

/* Feeds what comes to the receiver until it has an opinion, or the time is over. */
static enum cb_rtu_reception listen(struct cb_rtu *rtu, int64_t until_us) {
    for (;;) {
        uint8_t bytes[CB_RTU_MAX_FRAME];
        const int64_t now_us = cb_boottime_us();
        const size_t got = receive(rtu, bytes, sizeof bytes, now_us);
        enum cb_rtu_reception state = cb_rtu_receiver_look(&rtu->receiver, now_us);
        rtu->behind = got;
        for (size_t i = 0; i < got && state != CB_RTU_REPLY; ++i, --rtu->behind)
            state = cb_rtu_receiver_byte(&rtu->receiver, bytes[i], now_us);
        if (state == CB_RTU_REPLY || state == CB_RTU_SPOILT) return state;
        if (now_us >= until_us || rtu->serial.fd < 0) return state;
        const int64_t silent_us = rtu->receiver.last_us + rtu->receiver.silence.between_us;
        sleep_until_readable(rtu, state == CB_RTU_INSIDE ? sooner(silent_us, until_us) : until_us);
    }
}

/* A request that was given up is still out: waits for its reply, which is dropped, until the time
 * is over that it stays out. */
static bool await_late_reply(struct cb_rtu *rtu, int64_t deadline_us) {
    const enum cb_rtu_reception state = listen(rtu, sooner(deadline_us, rtu->out_until_us));
    rtu->counters.late_replies += state == CB_RTU_REPLY;
    if (state != CB_RTU_REPLY && state != CB_RTU_SPOILT && cb_boottime_us() < rtu->out_until_us &&
        rtu->serial.fd >= 0) {
        rtu->counters.blocked++;
        return false;
    }
    rtu->awaiting = false;
    rtu->doubtful = state != CB_RTU_REPLY;
    return true;
}

/* Throws away what nobody asked for, and waits until the line was silent long enough for a frame to
 * begin. out: false when that is not before the deadline, or the device is lost */
static bool find_silence(struct cb_rtu *rtu, int64_t deadline_us) {
    size_t dropped = 0;
    for (;;) {
        uint8_t bytes[CB_RTU_MAX_FRAME];
        const int64_t now_us = cb_boottime_us();
        const size_t got = receive(rtu, bytes, sizeof bytes, now_us);
        dropped += got;
        if (rtu->serial.fd < 0 || now_us >= deadline_us) return false;
        if (got == 0 && now_us >= rtu->line_free_us) break;
        sleep_until_readable(rtu, sooner(rtu->line_free_us, deadline_us));
    }
    rtu->counters.noise_bytes += (uint32_t)dropped;
    if (dropped < CB_RTU_MIN_FRAME) return true;
    rtu->counters.stray_replies++;
    rtu->doubtful = true;
    return true;
}

/* Makes sure that a request may be sent and that its reply can come in time. */
static bool ready_to_send(struct cb_rtu *rtu, const struct cb_modbus_request *request,
                          int64_t deadline_us) {
    if (!cb_serial_ready(&rtu->serial, cb_boottime_us())) {
        rtu->counters.not_connected++;
        return false;
    }
    if (rtu->awaiting && !await_late_reply(rtu, deadline_us)) return false;
    const int64_t takes_us = cb_rtu_exchange_us(&rtu->serial.config.line, request, 0);
    if (find_silence(rtu, deadline_us) && cb_boottime_us() + takes_us <= deadline_us) return true;
    if (rtu->serial.fd < 0)
        rtu->counters.not_connected++;
    else
        rtu->counters.out_of_time++;
    return false;
}

static bool send_request(struct cb_rtu *rtu, uint8_t unit,
                         const struct cb_modbus_request *request) {
    uint8_t frame[CB_RTU_MAX_FRAME];
    const size_t bytes = cb_rtu_encode(unit, request, frame);
    const int64_t now_us = cb_boottime_us();
    if (bytes == 0) return false;
    if (!cb_serial_send(&rtu->serial, frame, bytes, now_us)) {
        rtu->counters.device_errors++;
        return false;
    }
    rtu->counters.requests++;
    rtu->line_free_us = now_us + cb_rtu_frame_us(&rtu->serial.config.line, bytes) + rtu->between_us;
    cb_rtu_receiver_expect(&rtu->receiver, unit, request, now_us);
    return true;
}

static void count_exception(struct cb_rtu *rtu, uint8_t code) {
    rtu->counters.exceptions++;
    rtu->counters.exceptions_by_code[code < CB_RTU_EXCEPTIONS ? code : 0]++;
}

/* After a request that was given up, a reply may be the late one to that, and ours comes behind it.
 * out: true when nothing does */
static bool is_the_last_word(struct cb_rtu *rtu, int64_t deadline_us) {
    const int64_t settle_us =
        cb_boottime_us() + rtu->serial.config.slave_delay_us + rtu->between_us + SETTLE_US;
    uint8_t bytes[CB_RTU_MAX_FRAME];
    if (rtu->behind > 0) return false;
    sleep_until_readable(rtu, sooner(settle_us, deadline_us));
    if (receive(rtu, bytes, sizeof bytes, cb_boottime_us()) > 0) return false;
    rtu->doubtful = false;
    return true;
}

static enum cb_transfer take_reply(struct cb_rtu *rtu, uint16_t *registers, int64_t deadline_us) {
    uint8_t exception = 0;
    if (rtu->doubtful && rtu->hold_us > 0 && !is_the_last_word(rtu, deadline_us)) {
        rtu->counters.stray_replies++;
        return CB_TRANSFER_UNKNOWN;
    }
    const enum cb_rtu_answer answer = cb_rtu_receiver_take(&rtu->receiver, registers, &exception);
    rtu->counters.replies++;
    cb_serial_proven(&rtu->serial);
    if (answer == CB_RTU_OK) return CB_TRANSFER_OK;
    count_exception(rtu, exception);
    return CB_TRANSFER_REFUSED;
}

/* Something came that is not the reply, and ended. */
static enum cb_transfer note_spoilt(struct cb_rtu *rtu) {
    uint8_t exception = 0;
    switch (cb_rtu_receiver_take(&rtu->receiver, NULL, &exception)) {
        case CB_RTU_UNIT:
            rtu->counters.wrong_units++;
            break;
        case CB_RTU_INVALID:
            rtu->counters.invalid_replies++;
            break;
        case CB_RTU_OK:
        case CB_RTU_EXCEPTION:
        case CB_RTU_LENGTH:
        case CB_RTU_CRC:
            rtu->counters.crc_errors++;
            break;
    }
    rtu->doubtful = true;
    return CB_TRANSFER_UNKNOWN;
}

static enum cb_transfer note_timeout(struct cb_rtu *rtu, int64_t deadline_us) {
    if (rtu->serial.fd < 0) return CB_TRANSFER_UNKNOWN;
    rtu->counters.timeouts++;
    rtu->awaiting = rtu->hold_us > 0;
    rtu->out_until_us = deadline_us + rtu->hold_us;
    return CB_TRANSFER_UNKNOWN;
}

enum cb_transfer cb_rtu_exchange(struct cb_rtu *rtu, uint8_t unit,
                                 const struct cb_modbus_request *request, uint16_t *registers,
                                 int64_t deadline_us) {
    if (!ready_to_send(rtu, request, deadline_us) || !send_request(rtu, unit, request))
        return CB_TRANSFER_FAILED;
    const uint32_t noise = rtu->receiver.noise;
    const enum cb_rtu_reception state = listen(rtu, deadline_us);
    rtu->counters.noise_bytes += rtu->receiver.noise - noise;
    switch (state) {
        case CB_RTU_REPLY:
            return take_reply(rtu, registers, deadline_us);
        case CB_RTU_SPOILT:
            return note_spoilt(rtu);
        case CB_RTU_WAITING:
        case CB_RTU_INSIDE:
            break;
    }
    return note_timeout(rtu, deadline_us);
}

enum cb_transfer cb_rtu_read(struct cb_rtu *rtu, uint16_t start, uint16_t count,
                             uint16_t *registers, int64_t deadline_us) {
    const struct cb_modbus_request request = cb_modbus_read(start, count);
    return cb_rtu_exchange(rtu, rtu->unit, &request, registers, deadline_us);
}

enum cb_transfer cb_rtu_write(struct cb_rtu *rtu, uint16_t start, uint16_t count,
                              const uint16_t *registers, int64_t deadline_us) {
    const struct cb_modbus_request request = cb_modbus_write(start, count, registers);
    return cb_rtu_exchange(rtu, rtu->unit, &request, NULL, deadline_us);
}

enum cb_transfer cb_rtu_write_read(struct cb_rtu *rtu, uint16_t write_start, uint16_t write_count,
                                   const uint16_t *write_registers, uint16_t read_start,
                                   uint16_t read_count, uint16_t *read_registers,
                                   int64_t deadline_us) {
    const struct cb_modbus_request request =
        cb_modbus_write_read(write_start, write_count, write_registers, read_start, read_count);
    return cb_rtu_exchange(rtu, rtu->unit, &request, read_registers, deadline_us);
}
