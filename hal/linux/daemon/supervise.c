/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/supervise.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/watchdog.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "hal/linux/clock.h"
#include "hal/linux/mailbox.h"
#include "hal/linux/realtime.h"

enum { FEED_WATCHDOG_US = 500000, LOOK_EVERY_US = 50000 };

/* in : a path, or @ and a name in the abstract space */
static bool address_of(const char *path, struct sockaddr_un *address, socklen_t *size) {
    const size_t length = strlen(path);
    if ((path[0] != '/' && path[0] != '@') || length >= sizeof address->sun_path) return false;
    *address = (struct sockaddr_un){.sun_family = AF_UNIX};
    memcpy(address->sun_path, path, length);
    if (path[0] == '@') address->sun_path[0] = '\0';
    *size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length);
    return true;
}

/* systemd recommends half of its timeout. */
static int64_t feed_every_us(void) {
    const char *text = getenv("WATCHDOG_USEC"), *pid = getenv("WATCHDOG_PID");
    if (text == NULL || (pid != NULL && strtol(pid, NULL, 10) != (long)getpid())) return 0;
    return strtoll(text, NULL, 10) / 2;
}

void cb_supervise_start(struct cb_supervise *supervise) {
    *supervise = (struct cb_supervise){.notify_fd = -1, .watchdog_fd = -1};
    const char *path = getenv("NOTIFY_SOCKET");
    if (path != NULL && address_of(path, &supervise->notify_to, &supervise->notify_size)) {
        supervise->notify_fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        supervise->notify_us = feed_every_us();
    }
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
}

/* out: false: it was not sent, as when the queue is full; true also where nobody asked for it */
static bool notify(const struct cb_supervise *supervise, const char *text) {
    return supervise->notify_fd < 0 ||
           sendto(supervise->notify_fd, text, strlen(text), MSG_DONTWAIT | MSG_NOSIGNAL,
                  (const struct sockaddr *)&supervise->notify_to, supervise->notify_size) >= 0;
}

int cb_supervise_open_watchdog(struct cb_supervise *supervise, const char *device, int *timeout_s) {
    supervise->watchdog_fd = open(device, O_WRONLY | O_CLOEXEC | O_NONBLOCK);
    if (supervise->watchdog_fd < 0) return errno;
    int seconds = *timeout_s;
    (void)ioctl(supervise->watchdog_fd, WDIOC_SETTIMEOUT, &seconds); /* on error the device keeps
                                                                        its own */
    if (ioctl(supervise->watchdog_fd, WDIOC_GETTIMEOUT, &seconds) == 0) *timeout_s = seconds;
    supervise->watchdog_us = FEED_WATCHDOG_US;
    return 0;
}

/* out: true if cycles were completed since the last feed, and it is time */
static bool is_due(uint32_t steps, uint32_t fed_steps, int64_t now_us, int64_t fed_us,
                   int64_t every_us) {
    return every_us != 0 && steps != fed_steps && now_us - fed_us >= every_us;
}

static void write_byte(int fd, char byte) {
    if (write(fd, &byte, 1) != 1)
        return; /* no peer for a report: the machine is reset, as
                   intended */
}

static void feed(struct cb_supervise *supervise, uint32_t steps, int64_t now_us) {
    if (steps == 0) return;
    if (!supervise->ready && notify(supervise, "READY=1")) cb_flag_raise(&supervise->ready);
    if (is_due(steps, supervise->notify_steps, now_us, supervise->notify_fed_us,
               supervise->notify_us) &&
        notify(supervise, "WATCHDOG=1")) {
        supervise->notify_steps = steps;
        supervise->notify_fed_us = now_us;
    }
    if (is_due(steps, supervise->watchdog_steps, now_us, supervise->watchdog_fed_us,
               supervise->watchdog_us)) {
        supervise->watchdog_steps = steps;
        supervise->watchdog_fed_us = now_us;
        write_byte(supervise->watchdog_fd, '\0');
    }
}

static void *run(void *argument) {
    struct cb_supervise *supervise = argument;
    cb_settle_thread("compboxd-watch");
    while (!cb_flag_is_raised(&supervise->quit)) {
        feed(supervise, __atomic_load_n(supervise->steps, __ATOMIC_RELAXED), cb_boottime_us());
        const struct timespec wait = cb_timespec(LOOK_EVERY_US * 1000LL);
        nanosleep(&wait, NULL);
    }
    return NULL;
}

int cb_supervise_run(struct cb_supervise *supervise, const uint32_t *steps) {
    supervise->steps = steps;
    const int error = cb_start_thread(&supervise->thread, &cb_no_hurry, run, supervise);
    supervise->runs = error == 0;
    return error;
}

bool cb_supervise_stopping(struct cb_supervise *supervise, int64_t stop_us) {
    char text[80];
    snprintf(text, sizeof text, "STOPPING=1\nEXTEND_TIMEOUT_USEC=%lld", (long long)stop_us);
    return notify(supervise, text);
}

bool cb_supervise_status(struct cb_supervise *supervise, const char *text) {
    char line[300];
    if (!cb_flag_is_raised(&supervise->ready)) return false;
    snprintf(line, sizeof line, "STATUS=%s", text);
    return notify(supervise, line);
}

void cb_supervise_finish(struct cb_supervise *supervise) {
    if (__atomic_exchange_n(&supervise->finished, true, __ATOMIC_ACQ_REL)) return;
    cb_flag_raise(&supervise->quit);
    if (supervise->runs) pthread_join(supervise->thread, NULL);
    supervise->runs = false;
    if (supervise->watchdog_fd < 0) return;
    write_byte(supervise->watchdog_fd, 'V'); /* the device's command for an intended close */
    close(supervise->watchdog_fd);
    supervise->watchdog_fd = -1;
}
