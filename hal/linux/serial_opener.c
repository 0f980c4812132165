/* SPDX-License-Identifier: MIT */
#include "hal/linux/serial_opener.h"

#include <errno.h>
#include <sys/prctl.h>
#include <time.h>

#include "hal/linux/clock.h"
#include "hal/linux/mailbox.h"
#include "hal/linux/realtime.h"

enum { PATIENCE_S = 1 }; /* with a driver that blocks the thread at the end */

static int state_of(const struct cb_serial_opener *opener) {
    return __atomic_load_n(&opener->state, __ATOMIC_ACQUIRE);
}

static void hand_over(struct cb_serial_opener *opener, enum cb_serial_opener_state state) {
    __atomic_store_n(&opener->state, (int)state, __ATOMIC_RELEASE);
}

/* Executes the loop's request. in: ASKED */
static void serve(struct cb_serial_opener *opener) {
    if (opener->shut >= 0) cb_serial_shut(opener->shut);
    opener->shut = -1;
    if (opener->wanted) opener->opened = opener->open(&opener->config);
    hand_over(opener, opener->wanted ? CB_OPENER_DONE : CB_OPENER_IDLE);
}

static void *run(void *argument) {
    struct cb_serial_opener *opener = argument;
    prctl(PR_SET_NAME, "compboxd-serial"); /* no real-time priority is needed */
    for (;;) {
        while (sem_wait(&opener->wake) != 0) continue; /* EINTR */
        if (state_of(opener) == CB_OPENER_REQUESTED) serve(opener);
        if (cb_flag_is_raised(&opener->quit)) break;
    }
    if (state_of(opener) == CB_OPENER_DONE && opener->opened.fd >= 0)
        cb_serial_shut(opener->opened.fd);
    return NULL;
}

int cb_serial_opener_start(struct cb_serial_opener *opener, const struct cb_serial_config *config) {
    *opener = (struct cb_serial_opener){
        .config = *config, .open = cb_serial_open, .opened.fd = -1, .shut = -1};
    if (sem_init(&opener->wake, 0, 0) != 0) return errno;
    return cb_start_thread(&opener->thread, &cb_no_hurry, run, opener);
}

bool cb_serial_opener_stop(struct cb_serial_opener *opener) {
    struct timespec until = cb_timespec(cb_clock_ns(CLOCK_REALTIME));
    until.tv_sec += PATIENCE_S;
    cb_flag_raise(&opener->quit);
    sem_post(&opener->wake);
    if (pthread_timedjoin_np(opener->thread, NULL, &until) != 0) {
        pthread_detach(opener->thread);
        return false;
    }
    sem_destroy(&opener->wake);
    return true;
}

static void post(struct cb_serial_opener *opener, int shut, bool wanted) {
    opener->shut = shut;
    opener->wanted = wanted;
    hand_over(opener, CB_OPENER_REQUESTED);
    sem_post(&opener->wake);
}

bool cb_serial_opener_request(struct cb_serial_opener *opener) {
    if (state_of(opener) != CB_OPENER_IDLE) return false;
    post(opener, -1, true);
    return true;
}

/* in: state IDLE, because a loop with a descriptor has no pending request */
void cb_serial_opener_give_back(struct cb_serial_opener *opener, int fd) {
    post(opener, fd, false);
}

bool cb_serial_opener_take(struct cb_serial_opener *opener, struct cb_serial_opened *opened) {
    if (state_of(opener) != CB_OPENER_DONE) return false;
    *opened = opener->opened;
    hand_over(opener, CB_OPENER_IDLE);
    return true;
}
