/* SPDX-License-Identifier: MIT */
#include "hal/linux/link.h"

#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum {
    FIRST_BACKOFF_US = 50000,
    MAX_BACKOFF_US = 1000000,
    CONNECT_TIMEOUT_US = 1000000,
    LEAVE_TIMEOUT_US = 1000000,
    MAX_LEFT_OVERS = 16, /* maximum receive calls per check of a connection that is being left */
};

bool cb_link_start(struct cb_link *link, const char *host, uint16_t port) {
    *link = (struct cb_link){.fd = -1};
    char service[8];
    snprintf(service, sizeof service, "%u", (unsigned)port);
    struct addrinfo hints = {.ai_family = AF_UNSPEC,
                             .ai_socktype = SOCK_STREAM,
                             .ai_flags = AI_NUMERICHOST | AI_NUMERICSERV};
    struct addrinfo *found = NULL;
    if (getaddrinfo(host, service, &hints, &found) != 0) return false;
    memcpy(&link->address, found->ai_addr, found->ai_addrlen);
    link->address_size = found->ai_addrlen;
    freeaddrinfo(found);
    return true;
}

static void set_linger(int fd, bool discard) {
    const struct linger linger = {.l_onoff = discard, .l_linger = 0};
    setsockopt(fd, SOL_SOCKET, SO_LINGER, &linger, sizeof linger);
}

/* Sends requests at once; closing drops queued bytes. */
static void set_options(int fd) {
    int on = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    set_linger(fd, true);
}

static void come_up(struct cb_link *link) {
    link->state = CB_LINK_UP;
    link->connects++;
}

static void longer_backoff(struct cb_link *link) {
    uint32_t doubled = link->backoff_us == 0 ? FIRST_BACKOFF_US : 2 * link->backoff_us;
    link->backoff_us = doubled > MAX_BACKOFF_US ? MAX_BACKOFF_US : doubled;
}

/* Goes to DOWN and starts the pause. */
static void go_down(struct cb_link *link, enum cb_link_cause cause, int error_number,
                    int64_t now_us) {
    if (link->fd >= 0) close(link->fd);
    link->fd = -1;
    link->state = CB_LINK_DOWN;
    link->cause = (uint8_t)cause;
    link->error_number = error_number;
    link->since_us = now_us;
}

static void attempt_failed(struct cb_link *link, int error_number, int64_t now_us) {
    link->failures++;
    longer_backoff(link);
    go_down(link, CB_LINK_CAUSE_ERRNO, error_number, now_us);
}

static void begin_attempt(struct cb_link *link, int64_t now_us) {
    link->fd = socket(link->address.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (link->fd < 0) {
        attempt_failed(link, errno, now_us);
        return;
    }
    set_options(link->fd);
    link->state = CB_LINK_CONNECTING;
    link->since_us = now_us;
    if (connect(link->fd, (const struct sockaddr *)&link->address, link->address_size) == 0)
        come_up(link);
    else if (errno != EINPROGRESS)
        attempt_failed(link, errno, now_us);
}

/* Checks the pending attempt without waiting. */
static void poll_attempt(struct cb_link *link, int64_t now_us) {
    struct pollfd wait = {.fd = link->fd, .events = POLLOUT};
    if (poll(&wait, 1, 0) <= 0) {
        if (now_us - link->since_us > CONNECT_TIMEOUT_US) attempt_failed(link, ETIMEDOUT, now_us);
        return;
    }
    int error_number = 0;
    socklen_t size = sizeof error_number;
    if (getsockopt(link->fd, SOL_SOCKET, SO_ERROR, &error_number, &size) != 0) error_number = errno;
    if (error_number == 0)
        come_up(link);
    else
        attempt_failed(link, error_number, now_us);
}

/* Drops the received bytes: close() with unread bytes would reset the connection, and a PLC may
 * then drop bytes that it has not read yet. out: whether the PLC closed its side too */
static bool read_off(int fd) {
    char left_over[512];
    for (int i = 0; i < MAX_LEFT_OVERS; i++) {
        const ssize_t got = recv(fd, left_over, sizeof left_over, MSG_DONTWAIT);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return got == 0 || errno != EAGAIN;
    }
    return false;
}

void cb_link_leave(struct cb_link *link, int64_t now_us) {
    set_linger(link->fd, false);
    shutdown(link->fd, SHUT_WR);
    link->state = CB_LINK_LEAVING;
    link->since_us = now_us;
}

static void poll_leaving(struct cb_link *link, int64_t now_us) {
    if (!read_off(link->fd) && now_us - link->since_us <= LEAVE_TIMEOUT_US) return;
    cb_link_drop(link, CB_LINK_CAUSE_LEFT, 0, now_us);
}

bool cb_link_ready(struct cb_link *link, int64_t now_us) {
    if (link->state == CB_LINK_LEAVING) poll_leaving(link, now_us);
    if (link->state == CB_LINK_DOWN && now_us - link->since_us >= link->backoff_us)
        begin_attempt(link, now_us);
    if (link->state == CB_LINK_CONNECTING) poll_attempt(link, now_us);
    return link->state == CB_LINK_UP;
}

void cb_link_proven(struct cb_link *link) {
    link->backoff_us = 0;
}

void cb_link_drop(struct cb_link *link, enum cb_link_cause cause, int error_number,
                  int64_t now_us) {
    link->disconnects++;
    bool at_once = link->backoff_us == 0;
    go_down(link, cause, error_number, now_us);
    longer_backoff(link);
    if (at_once) begin_attempt(link, now_us);
}

void cb_link_close(struct cb_link *link) {
    if (link->fd < 0) return;
    set_linger(link->fd, false);
    shutdown(link->fd, SHUT_WR);
    (void)read_off(link->fd);
    close(link->fd);
    link->fd = -1;
    link->state = CB_LINK_DOWN;
}
