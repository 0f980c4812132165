/* SPDX-License-Identifier: MIT
 * The TCP connection to the PLC, which is opened, lost and reopened without blocking. Nothing here
 * waits; call it in each cycle until the connection is up. */
#ifndef COMPBOX_HAL_LINUX_LINK_H
#define COMPBOX_HAL_LINUX_LINK_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>

enum cb_link_state {
    CB_LINK_DOWN,
    CB_LINK_CONNECTING,
    CB_LINK_UP,
    CB_LINK_LEAVING, /* closed in order by the box; waits for the PLC to close it too */
};

/* Cause of the present or last loss of the connection, for the log. */
enum cb_link_cause {
    CB_LINK_CAUSE_NONE,
    CB_LINK_CAUSE_ERRNO,   /* a system call failed; see error_number */
    CB_LINK_CAUSE_PEER,    /* the PLC closed it */
    CB_LINK_CAUSE_SILENT,  /* closed by the box after too many exchanges without a valid reply */
    CB_LINK_CAUSE_FRAMING, /* closed by the box: the bytes cannot be divided into replies */
    CB_LINK_CAUSE_LEFT,    /* closed by the box in order, behind a last write */
};

struct cb_link {
    struct sockaddr_storage address;
    socklen_t address_size;
    int fd;               /* -1: none */
    uint8_t state;        /* enum cb_link_state */
    uint8_t cause;        /* enum cb_link_cause */
    int error_number;     /* of CB_LINK_CAUSE_ERRNO */
    uint32_t backoff_us;  /* pause before the next attempt; 0: none, the last connection worked */
    int64_t since_us;     /* start of the pending attempt, of the pause, or of leaving */
    uint32_t connects;    /* connections made */
    uint32_t failures;    /* attempts that failed */
    uint32_t disconnects; /* connections lost or given up */
};

/* in : host, numeric IPv4 or IPv6 address
 * out: false when host is not one (a name would need a resolver, which blocks) */
bool cb_link_start(struct cb_link *link, const char *host, uint16_t port);

/* Continues an attempt, starts one when the pause is over. out: true when the connection is up. */
bool cb_link_ready(struct cb_link *link, int64_t now_us);

/* The peer replied to reads and writes: no pause before the attempt that follows the next loss. */
void cb_link_proven(struct cb_link *link);

/* Drops the connection and its unsent bytes, because a request must not arrive long after its time.
 * The next attempt starts at once if the connection was proven, else after a pause that doubles
 * from 50 ms to 1 s. */
void cb_link_drop(struct cb_link *link, enum cb_link_cause cause, int error_number, int64_t now_us);

/* Closes in order: all sent bytes arrive, then the end of the stream. Bytes from the PLC are
 * dropped until it closes too, for at most a second; then as cb_link_drop.
 * in : a connection that is up; afterwards it is down until cb_link_ready returns true */
void cb_link_leave(struct cb_link *link, int64_t now_us);

/* Closes in order, at the end of the program. */
void cb_link_close(struct cb_link *link);

#endif
