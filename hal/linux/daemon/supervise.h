/* SPDX-License-Identifier: MIT
 * Reports that the daemon is alive to the hardware watchdog (/dev/watchdog) and to systemd
 * (sd_notify's protocol, one datagram, without its library). Only completed cycles of the loop
 * cause a feed: while the loop hangs, no other thread feeds. A separate thread does it, because a
 * slow disk may block the normal one while the machine is compensated. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_SUPERVISE_H
#define COMPBOX_HAL_LINUX_DAEMON_SUPERVISE_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/un.h>

struct cb_supervise {
    int notify_fd; /* -1: no notifications requested */
    struct sockaddr_un notify_to;
    socklen_t notify_size;
    bool ready;                             /* a cb_flag: READY=1 was sent */
    int64_t notify_us;                      /* feed interval for systemd; 0: it does not watch */
    int watchdog_fd;                        /* -1: none */
    int64_t watchdog_us;                    /* feed interval of the hardware */
    uint32_t notify_steps, watchdog_steps;  /* cycle counts at the last feeds … */
    int64_t notify_fed_us, watchdog_fed_us; /* … and their times */
    const uint32_t *steps;                  /* the loop's count of completed cycles */
    pthread_t thread;
    bool runs;
    bool quit;     /* a cb_flag */
    bool finished; /* atomic: a thread has begun to finish */
};

/* Reads NOTIFY_SOCKET and WATCHDOG_USEC, which systemd sets, and removes both. */
void cb_supervise_start(struct cb_supervise *supervise);

/* in : device: /dev/watchdog or another; *timeout_s: time until the reset of the machine
 * out: 0, and *timeout_s as set by the device; or errno. From now on it must be fed. */
int cb_supervise_open_watchdog(struct cb_supervise *supervise, const char *device, int *timeout_s);

/* Begins to feed. steps: completed cycles, an atomic counted by the loop. The first cycle sends
 * READY. out: 0, or errno */
int cb_supervise_run(struct cb_supervise *supervise, const uint32_t *steps);

/* Reports a requested stop, which takes at most stop_us. out: false: call it again */
bool cb_supervise_stopping(struct cb_supervise *supervise, int64_t stop_us);

/* Reports one line for `systemctl status`; nothing before READY. out: false: call it again */
bool cb_supervise_status(struct cb_supervise *supervise, const char *text);

/* Disarms the hardware watchdog, at a regular end or before the start. From any thread; the second
 * call has no effect. */
void cb_supervise_finish(struct cb_supervise *supervise);

#endif
