/* SPDX-License-Identifier: MIT */
#include "hal/linux/serial.h"

#include <errno.h>
#include <unistd.h>

enum { FIRST_BACKOFF_US = 50000, MAX_BACKOFF_US = 1000000 };

void cb_serial_start(struct cb_serial *serial, const struct cb_serial_config *config,
                     struct cb_serial_opener *opener) {
    *serial = (struct cb_serial){.config = *config, .opener = opener, .fd = -1};
}

static void longer_backoff(struct cb_serial *serial) {
    const uint32_t doubled = serial->backoff_us == 0 ? FIRST_BACKOFF_US : 2 * serial->backoff_us;
    serial->backoff_us = doubled > MAX_BACKOFF_US ? MAX_BACKOFF_US : doubled;
}

/* An open descriptor would make the adapter return under another name. */
void cb_serial_close(struct cb_serial *serial) {
    if (serial->fd < 0) return;
    if (serial->opener)
        cb_serial_opener_give_back(serial->opener, serial->fd);
    else
        cb_serial_shut(serial->fd);
    serial->fd = -1;
}

static void lost(struct cb_serial *serial, int error_number, int64_t now_us) {
    cb_serial_close(serial);
    serial->disconnects++;
    serial->error_number = error_number;
    serial->since_us = now_us;
    if (serial->backoff_us > 0) longer_backoff(serial);
}

/* Ends an attempt. The pause grows until a slave has replied. */
static void take(struct cb_serial *serial, const struct cb_serial_opened *opened, int64_t now_us) {
    serial->opening = false;
    serial->fd = opened->fd;
    if (opened->fd >= 0) {
        serial->connects++;
    } else {
        serial->failures++;
        serial->error_number = opened->error;
        serial->since_us = now_us;
    }
    longer_backoff(serial);
}

/* Starts an attempt; without an opener it ends at once. */
static void attempt(struct cb_serial *serial, int64_t now_us) {
    if (serial->opener) {
        serial->opening = cb_serial_opener_request(serial->opener);
        return;
    }
    const struct cb_serial_opened opened = cb_serial_open(&serial->config);
    take(serial, &opened, now_us);
}

bool cb_serial_ready(struct cb_serial *serial, int64_t now_us) {
    struct cb_serial_opened opened;
    if (serial->fd >= 0) return true;
    if (serial->opening && cb_serial_opener_take(serial->opener, &opened))
        take(serial, &opened, now_us);
    else if (!serial->opening && now_us - serial->since_us >= serial->backoff_us)
        attempt(serial, now_us);
    return serial->fd >= 0;
}

void cb_serial_proven(struct cb_serial *serial) {
    serial->backoff_us = 0;
}

size_t cb_serial_receive(struct cb_serial *serial, uint8_t *bytes, size_t size, int64_t now_us) {
    if (serial->fd < 0) return 0;
    const ssize_t got = read(serial->fd, bytes, size);
    if (got > 0) return (size_t)got;
    if (got == 0 || (errno != EAGAIN && errno != EINTR))
        lost(serial, got == 0 ? EIO : errno, now_us);
    return 0;
}

bool cb_serial_send(struct cb_serial *serial, const uint8_t *bytes, size_t count, int64_t now_us) {
    if (serial->fd < 0) return false;
    const ssize_t sent = write(serial->fd, bytes, count);
    if (sent == (ssize_t)count) return true;
    lost(serial, sent < 0 ? errno : EAGAIN, now_us);
    return false;
}
