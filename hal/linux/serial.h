/* SPDX-License-Identifier: MIT
 * A serial device: opened raw, lost (an adapter is unplugged) and reopened. It never waits for
 * bytes, nor for opening and closing if another thread does that (serial_opener.h). */
#ifndef COMPBOX_HAL_LINUX_SERIAL_H
#define COMPBOX_HAL_LINUX_SERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/wire/rtu_line.h"
#include "hal/linux/serial_opener.h"

struct cb_serial {
    struct cb_serial_config config;
    struct cb_serial_opener *opener; /* NULL: this thread opens the device itself, which may
                                        block */
    bool opening;                    /* a request to the opener is pending */
    int fd;                          /* -1: closed */
    int error_number;                /* cause of the present or last failure */
    uint32_t backoff_us;             /* pause before the next attempt */
    int64_t since_us;                /* start of the pause */
    uint32_t connects;               /* times opened */
    uint32_t failures;               /* attempts that failed */
    uint32_t disconnects;            /* devices lost */
};

/* Does not open the device yet. in: a running opener of this config, or NULL */
void cb_serial_start(struct cb_serial *serial, const struct cb_serial_config *config,
                     struct cb_serial_opener *opener);

/* Opens the device, itself or by the opener, when it is closed and the pause is over. out: true
 * when it is open. */
bool cb_serial_ready(struct cb_serial *serial, int64_t now_us);

/* out: number of received bytes, at most size; 0: none, or the device is lost (then it is closed;
 *      attempts follow at once, then once a second at the latest). */
size_t cb_serial_receive(struct cb_serial *serial, uint8_t *bytes, size_t size, int64_t now_us);

/* out: false when the device did not take all bytes: it is closed and drops them. */
bool cb_serial_send(struct cb_serial *serial, const uint8_t *bytes, size_t count, int64_t now_us);

/* A slave has replied on it: no pause before the attempt that follows the next loss. */
void cb_serial_proven(struct cb_serial *serial);

/* Closes it, itself or by the opener. */
void cb_serial_close(struct cb_serial *serial);

#endif
