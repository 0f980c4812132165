/* SPDX-License-Identifier: MIT
 * The stop. A separate thread, which touches no file, passes SIGTERM and SIGINT to the loop. A
 * disk, a mount or a pipe that blocks the normal thread therefore delays no ramp to zero. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_STOP_H
#define COMPBOX_HAL_LINUX_DAEMON_STOP_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

#include "hal/linux/daemon/loop.h"
#include "hal/linux/daemon/supervise.h"

/* Maximum time of the normal thread for its files after the loop has ended. */
enum { CB_STOP_FILES_US = 5000000 };

struct cb_stop {
    struct cb_loop *loop;
    struct cb_supervise *supervise;
    bool loop_runs; /* a cb_flag: the loop's thread was started */
    bool ended;     /* a cb_flag: the normal thread has finished */
    bool runs;
    pthread_t thread;
};

/* in : loop and supervise set, all else 0; SIGTERM and SIGINT blocked in the calling thread, and
 *      therefore in all that it starts
 * From now on either signal raises loop->target.stop. However that flag was raised, loop->quit
 * follows after cb_box_stop_us() and a second for the confirmation. If the normal thread does not
 * reach cb_stop_finish() within CB_STOP_FILES_US of the loop's end, the program exits with code 1
 * and a sentence. out: 0, or errno */
int cb_stop_start(struct cb_stop *stop);

/* The normal thread has finished: ends the thread. */
void cb_stop_finish(struct cb_stop *stop);

#endif
