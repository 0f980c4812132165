/* SPDX-License-Identifier: MIT
 * A thread that opens and closes a serial device for a loop that must not be late: open() and
 * close() of a USB adapter depend on its driver, and take seconds if it hangs.
 *
 *   IDLE ──loop: open or close──► REQUESTED ──thread: opened, or error──► DONE ──loop: take──► IDLE
 *                                     └──thread: only closed──► IDLE
 *
 * The state determines the owner of all other fields. */
#ifndef COMPBOX_HAL_LINUX_SERIAL_OPENER_H
#define COMPBOX_HAL_LINUX_SERIAL_OPENER_H

#include <pthread.h>
#include <semaphore.h>
#include <stdbool.h>

#include "firmware/wire/rtu_line.h"

/* Result of opening a device. */
struct cb_serial_opened {
    int fd;    /* -1: not open */
    int error; /* errno of the failure */
};

/* Opens the device raw and non-blocking, for this program alone: EBUSY if another program has it.
 * May block. */
struct cb_serial_opened cb_serial_open(const struct cb_serial_config *config);

/* in : errno. out: the cause for a person */
const char *cb_serial_error(int error_number);

/* Closes it and drops its unsent bytes. May block. */
void cb_serial_shut(int fd);

enum cb_serial_opener_state { CB_OPENER_IDLE, CB_OPENER_REQUESTED, CB_OPENER_DONE };

struct cb_serial_opener {
    struct cb_serial_config config;
    struct cb_serial_opened (*open)(const struct cb_serial_config *); /* cb_serial_open */
    struct cb_serial_opened opened;                                   /* in DONE */
    int state;   /* enum cb_serial_opener_state; sets the owner of the fields below */
    int shut;    /* in ASKED: a descriptor to close … */
    bool wanted; /* … and whether to open one */
    bool quit;   /* a cb_flag */
    sem_t wake;
    pthread_t thread;
};

/* out: 0 or errno. The caller keeps *opener until cb_serial_opener_stop. */
int cb_serial_opener_start(struct cb_serial_opener *opener, const struct cb_serial_config *config);

/* Ends the thread after its present work, and closes a device that was not taken.
 * out: false: the driver has blocked for a second; the thread ends later, and until then *opener
 *      must stay valid */
bool cb_serial_opener_stop(struct cb_serial_opener *opener);

/* ---- the loop: none of these waits ---- */

/* out: false: it is still busy, the request was not accepted */
bool cb_serial_opener_request(struct cb_serial_opener *opener);

/* Has the device closed that it opened; the loop must not use the descriptor any more. */
void cb_serial_opener_give_back(struct cb_serial_opener *opener, int fd);

/* out: true, once for each cb_serial_opener_request: *opened is the result */
bool cb_serial_opener_take(struct cb_serial_opener *opener, struct cb_serial_opened *opened);

#endif
