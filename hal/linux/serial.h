/* SPDX-License-Identifier: MIT
 * A serial device: opened raw, lost (an adapter is unplugged) and opened again. Bytes are never
 * waited for; opening and closing neither, where another thread does it (serial_opener.h). */
#ifndef COMPBOX_HAL_LINUX_SERIAL_H
#define COMPBOX_HAL_LINUX_SERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/wire/rtu_line.h"
#include "hal/linux/serial_opener.h"

struct cb_serial {
    struct cb_serial_config config;
    struct cb_serial_opener *opener; /* NULL: opens by itself, however long that takes */
    bool opening;                    /* the opener was asked and has not answered */
    int fd;                          /* -1: closed */
    int error_number;                /* why it is, or was last, not open */
    int rs485_error;      /* errno where the driver refuses to switch an RS-485 driver; else 0 */
    uint32_t backoff_us;  /* pause before the next attempt */
    int64_t since_us;     /* start of the pause */
    uint32_t connects;    /* times opened */
    uint32_t failures;    /* attempts that failed */
    uint32_t disconnects; /* devices lost */
};

/* Nothing is opened yet. in: a running opener of this config, or NULL */
void cb_serial_start(struct cb_serial *serial, const struct cb_serial_config *config,
                     struct cb_serial_opener *opener);

/* Opens the device, or has it opened, when it is closed and the pause is over. True when it is
 * open. */
bool cb_serial_ready(struct cb_serial *serial, int64_t now_us);

/* Bytes that are there, at most size; 0: none, or the device is gone (then it is closed, and tried
 * again from at once to once a second). */
size_t cb_serial_receive(struct cb_serial *serial, uint8_t *bytes, size_t size, int64_t now_us);

/* out: false when not all of it was taken: the device is closed, what it took is thrown away. */
bool cb_serial_send(struct cb_serial *serial, const uint8_t *bytes, size_t count, int64_t now_us);

/* A slave answers on it: the next loss is followed by an attempt without a pause. */
void cb_serial_proven(struct cb_serial *serial);

/* Closes it, or has it closed. */
void cb_serial_close(struct cb_serial *serial);

#endif
