/* SPDX-License-Identifier: MIT
 * Telling those who watch over the daemon that it is alive: the hardware watchdog (/dev/watchdog)
 * and systemd (sd_notify's protocol, one datagram, without its library). Both are fed by completed
 * cycles of the loop only: a normal thread that runs while the loop hangs feeds nobody. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_SUPERVISE_H
#define COMPBOX_HAL_LINUX_DAEMON_SUPERVISE_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/un.h>

struct cb_supervise {
    int notify_fd; /* -1: nobody asked for notifications */
    struct sockaddr_un notify_to;
    socklen_t notify_size;
    bool ready;                             /* READY=1 was sent */
    int64_t notify_us;                      /* how often systemd is fed; 0: it does not watch */
    int watchdog_fd;                        /* -1: none */
    int64_t watchdog_us;                    /* how often the hardware is fed */
    uint32_t notify_steps, watchdog_steps;  /* cycles when each was last fed … */
    int64_t notify_fed_us, watchdog_fed_us; /* … and when */
};

/* Looks at NOTIFY_SOCKET and WATCHDOG_USEC, as systemd sets them, and removes both. */
void cb_supervise_start(struct cb_supervise *supervise);

/* in : device: /dev/watchdog or another; timeout_s: after which it resets the machine, where it
 * lets itself be told out: 0, or errno. From now on it wants to be fed. */
int cb_supervise_open_watchdog(struct cb_supervise *supervise, const char *device, int timeout_s);

/* To be called often. steps: completed cycles, as the loop counts them. The first one says READY.
 */
void cb_supervise_feed(struct cb_supervise *supervise, uint32_t steps, int64_t now_us);

/* The box was asked to stop, which takes this long at most. */
void cb_supervise_stopping(struct cb_supervise *supervise, int64_t stop_us);

/* One line for `systemctl status`. */
void cb_supervise_status(struct cb_supervise *supervise, const char *text);

/* The end in good order: the hardware watchdog is disarmed. */
void cb_supervise_finish(struct cb_supervise *supervise);

#endif
