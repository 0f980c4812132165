/* SPDX-License-Identifier: MIT
 * Telling those who watch over the daemon that it is alive: the hardware watchdog (/dev/watchdog)
 * and systemd (sd_notify's protocol, one datagram, without its library). Both are fed by completed
 * cycles of the loop only: threads that run while the loop hangs feed nobody. A thread of its own
 * feeds them, because the normal one may be kept by a slow disk while the machine is compensated.
 */
#ifndef COMPBOX_HAL_LINUX_DAEMON_SUPERVISE_H
#define COMPBOX_HAL_LINUX_DAEMON_SUPERVISE_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/un.h>

struct cb_supervise {
    int notify_fd; /* -1: nobody asked for notifications */
    struct sockaddr_un notify_to;
    socklen_t notify_size;
    bool ready;                             /* a cb_flag: READY=1 was sent */
    int64_t notify_us;                      /* how often systemd is fed; 0: it does not watch */
    int watchdog_fd;                        /* -1: none */
    int64_t watchdog_us;                    /* how often the hardware is fed */
    uint32_t notify_steps, watchdog_steps;  /* cycles when each was last fed … */
    int64_t notify_fed_us, watchdog_fed_us; /* … and when */
    const uint32_t *steps;                  /* the loop's count of completed cycles */
    pthread_t thread;
    bool runs;
    bool quit;     /* a cb_flag */
    bool finished; /* atomic: a thread has begun to finish */
};

/* Looks at NOTIFY_SOCKET and WATCHDOG_USEC, as systemd sets them, and removes both. */
void cb_supervise_start(struct cb_supervise *supervise);

/* in : device: /dev/watchdog or another; *timeout_s: after which it resets the machine
 * out: 0, and *timeout_s as the device has it; or errno. From now on it wants to be fed. */
int cb_supervise_open_watchdog(struct cb_supervise *supervise, const char *device, int *timeout_s);

/* Begins to feed. steps: completed cycles, as the loop counts them, an atomic. The first one says
 * READY. out: 0, or errno */
int cb_supervise_run(struct cb_supervise *supervise, const uint32_t *steps);

/* The box was asked to stop, which takes this long at most. */
void cb_supervise_stopping(struct cb_supervise *supervise, int64_t stop_us);

/* One line for `systemctl status`; nothing before READY was said. */
void cb_supervise_status(struct cb_supervise *supervise, const char *text);

/* The end in good order, or before anything began: the hardware watchdog is disarmed. From any
 * thread; the second call does nothing. */
void cb_supervise_finish(struct cb_supervise *supervise);

#endif
