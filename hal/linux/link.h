/* SPDX-License-Identifier: MIT
 * The TCP connection to the PLC: opened, lost and opened again without ever blocking. Nothing
 * here waits; whoever calls each cycle sees the connection come up. */
#ifndef COMPBOX_HAL_LINUX_LINK_H
#define COMPBOX_HAL_LINUX_LINK_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>

enum cb_link_state {
    CB_LINK_DOWN,
    CB_LINK_CONNECTING,
    CB_LINK_UP,
    CB_LINK_LEAVING, /* closed in order by us; waits for the PLC to close it too */
};

/* Why the connection is, or was last, not there. For the log. */
enum cb_link_cause {
    CB_LINK_CAUSE_NONE,
    CB_LINK_CAUSE_ERRNO,   /* a system call failed; see error_number */
    CB_LINK_CAUSE_PEER,    /* the PLC closed it */
    CB_LINK_CAUSE_SILENT,  /* closed by us after too many exchanges without a valid reply */
    CB_LINK_CAUSE_FRAMING, /* closed by us: what came cannot be cut into replies any more */
    CB_LINK_CAUSE_LEFT,    /* closed by us in order, behind a last write */
};

struct cb_link {
    struct sockaddr_storage address;
    socklen_t address_size;
    int fd;               /* -1: none */
    uint8_t state;        /* enum cb_link_state */
    uint8_t cause;        /* enum cb_link_cause */
    int error_number;     /* of CB_LINK_CAUSE_ERRNO */
    uint32_t backoff_us;  /* pause before the next attempt; 0: none, the last connection worked */
    int64_t since_us;     /* start of the attempt that is under way, of the pause, or of leaving */
    uint32_t connects;    /* connections made */
    uint32_t failures;    /* attempts that failed */
    uint32_t disconnects; /* connections lost or given up */
};

/* in : host, numeric IPv4 or IPv6 address
 * out: false when host is not one (a name would need a resolver, which blocks) */
bool cb_link_start(struct cb_link *link, const char *host, uint16_t port);

/* Goes on with an attempt, starts one when the pause is over. True when the connection is up. */
bool cb_link_ready(struct cb_link *link, int64_t now_us);

/* The peer proved that it works, by answering readings and writes: the next loss is answered by an
 * attempt without a pause. */
void cb_link_proven(struct cb_link *link);

/* Gives the connection up, throwing away what has not been sent: a request must not arrive long
 * after its time. Starts the next attempt at once when the connection had proven itself, else
 * after a pause that doubles from 50 ms to 1 s. */
void cb_link_drop(struct cb_link *link, enum cb_link_cause cause, int error_number, int64_t now_us);

/* Closes in order: all that was sent arrives, then the end of the stream. What the PLC still sends
 * is thrown away until it closes too, for at most a second; then as cb_link_drop.
 * in : a connection that is up; afterwards it is not, until cb_link_ready says so again */
void cb_link_leave(struct cb_link *link, int64_t now_us);

/* Closes in good order; for the end of the program. */
void cb_link_close(struct cb_link *link);

#endif
