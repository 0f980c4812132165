/* SPDX-License-Identifier: MIT
 * A thread that opens and closes a serial device for a loop that must not be late: open() and
 * close() of a USB adapter take what its driver takes, seconds where it hangs.
 *
 *   IDLE ──loop: ask / give back──► ASKED ──thread: opened, or why not──► DONE ──loop: take──► IDLE
 *                                     └──thread: closed only──► IDLE
 *
 * Everything else belongs to the one whose turn it is by the state. */
#ifndef COMPBOX_HAL_LINUX_SERIAL_OPENER_H
#define COMPBOX_HAL_LINUX_SERIAL_OPENER_H

#include <pthread.h>
#include <semaphore.h>
#include <stdbool.h>

#include "firmware/wire/rtu_line.h"

/* What opening a device came to. */
struct cb_serial_opened {
    int fd;          /* -1: it is not open */
    int error;       /* … and errno why */
    int rs485_error; /* errno where the driver refuses to switch an RS-485 driver; else 0 */
};

/* Opens the device raw and without waiting for bytes, for this program alone: EBUSY where another
 * one has it. Takes as long as it takes. */
struct cb_serial_opened cb_serial_open(const struct cb_serial_config *config);

/* Why it is not open, for people. in: errno */
const char *cb_serial_error(int error_number);

/* Closes it and throws away what nobody will take. Takes as long as it takes. */
void cb_serial_shut(int fd);

enum cb_serial_opener_state { CB_OPENER_IDLE, CB_OPENER_ASKED, CB_OPENER_DONE };

struct cb_serial_opener {
    struct cb_serial_config config;
    struct cb_serial_opened (*open)(const struct cb_serial_config *); /* cb_serial_open */
    struct cb_serial_opened opened;                                   /* in DONE */
    int state;   /* enum cb_serial_opener_state; changes hands by it */
    int shut;    /* in ASKED: a descriptor to be closed … */
    bool wanted; /* … and whether one shall be opened */
    bool quit;   /* a cb_flag */
    sem_t wake;
    pthread_t thread;
};

/* out: 0 or errno. The caller keeps *opener until cb_serial_opener_stop. */
int cb_serial_opener_start(struct cb_serial_opener *opener, const struct cb_serial_config *config);

/* Ends the thread, when what it is at is done, and closes what nobody took.
 * out: false: the driver has held it for a second; it ends by itself some time, and until then
 * *opener has to stay where it is */
bool cb_serial_opener_stop(struct cb_serial_opener *opener);

/* ---- the loop: none of these waits ---- */

/* out: false: it is still busy, nothing was asked */
bool cb_serial_opener_ask(struct cb_serial_opener *opener);

/* The device that was opened by it is closed; afterwards it is not the loop's any more. */
void cb_serial_opener_give_back(struct cb_serial_opener *opener, int fd);

/* out: true, once for each cb_serial_opener_ask: *opened is what it came to */
bool cb_serial_opener_take(struct cb_serial_opener *opener, struct cb_serial_opened *opened);

#endif
