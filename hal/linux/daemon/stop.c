/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/stop.h"

#include <signal.h>
#include <unistd.h>

#include "hal/linux/clock.h"
#include "hal/linux/mailbox.h"
#include "hal/linux/realtime.h"
#include "hal/linux/stderr.h"

enum {
    LOOK_EVERY_MS = 20,
    MARGIN_US = 1000000, /* for the confirmation of zero, and for the watchdog after it */
};

/* Waits for a signal, at most until the next check. */
static void mind_signals(struct cb_stop *stop) {
    const struct timespec wait = cb_timespec(LOOK_EVERY_MS * 1000000LL);
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    if (sigtimedwait(&signals, NULL, &wait) > 0) cb_flag_raise(&stop->loop->target.stop);
}

/* A file blocks the normal thread, which may hold the lock of stderr: this thread ends the program.
 */
static void abandon_files(struct cb_stop *stop) {
    static const char sentence[] =
        "compboxd: a file blocks the end of the program: statistics, record and state are not "
        "complete; check the disks and mounts of their paths\n";
    cb_supervise_finish(stop->supervise);
    cb_stderr_last_words(sentence);
    _exit(1);
}

static bool loop_is_busy(const struct cb_stop *stop) {
    return cb_flag_is_raised(&stop->loop_runs) && !cb_flag_is_raised(&stop->loop->finished);
}

/* A stop is requested. in: times of CLOCK_BOOTTIME; idle_us: last time that the loop was busy */
static void mind_times(struct cb_stop *stop, int64_t give_up_us, int64_t now_us, int64_t *idle_us) {
    if (loop_is_busy(stop)) {
        *idle_us = now_us;
        if (now_us >= give_up_us) cb_flag_raise(&stop->loop->quit);
    } else if (now_us - *idle_us >= CB_STOP_FILES_US)
        abandon_files(stop);
}

/* Thread: raises the stop, then enforces the times of cb_stop_start until cb_stop_finish. */
static void *run(void *argument) {
    struct cb_stop *stop = argument;
    int64_t most_us = 0, give_up_us = 0, idle_us = 0;
    bool told = false;
    cb_settle_thread("compboxd-stop");
    while (!cb_flag_is_raised(&stop->ended)) {
        mind_signals(stop);
        if (!cb_flag_is_raised(&stop->loop->target.stop)) continue;
        const int64_t now_us = cb_boottime_us();
        if (give_up_us == 0) {
            const int64_t longest_us = cb_box_stop_us(cb_loop_box(stop->loop)) + MARGIN_US;
            most_us = longest_us + CB_STOP_FILES_US + MARGIN_US;
            give_up_us = now_us + longest_us;
            idle_us = now_us;
        }
        if (!told) told = cb_supervise_stopping(stop->supervise, most_us);
        mind_times(stop, give_up_us, now_us, &idle_us);
    }
    return NULL;
}

int cb_stop_start(struct cb_stop *stop) {
    const int error = cb_start_thread(&stop->thread, &cb_no_hurry, run, stop);
    stop->runs = error == 0;
    return error;
}

void cb_stop_finish(struct cb_stop *stop) {
    cb_flag_raise(&stop->ended);
    if (stop->runs) pthread_join(stop->thread, NULL);
    stop->runs = false;
}
