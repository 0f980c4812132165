/* SPDX-License-Identifier: MIT
 * SocketCAN: frames in, a few frames out, and what the bus is doing. Two threads share it. The
 * normal one opens sockets, which may wait for the kernel's locks and allocates; the loop receives
 * and sends, and never waits. A socket changes hands through one integer.
 *
 * A socket lives through its interface going down and up and through bus-off. It is opened anew
 * when the interface itself went away (an adapter was unplugged). The interface is configured and
 * brought up by the system, not here. */
#ifndef COMPBOX_HAL_LINUX_CAN_H
#define COMPBOX_HAL_LINUX_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/signals/can.h"

/* Counters; they wrap. Names are stable. */
#define CB_CAN_TRAFFIC(X)                                              \
    X(frames)     /* data frames received that the filters let pass */ \
    X(heartbeats) /* of them, heartbeats and boot-up messages */       \
    X(sent)       /* frames sent */

#define CB_CAN_ERRORS(X)                                                                       \
    X(short_frames)         /* frames that end before a signal that should be in them */       \
    X(error_frames)         /* told by the controller; those below count some of them apart */ \
    X(warnings)             /* … many errors on the bus */                                   \
    X(passives)             /* … very many */                                                \
    X(bus_offs)             /* … the controller left the bus */                              \
    X(restarts)             /* … and came back */                                            \
    X(controller_overflows) /* … it lost frames */                                           \
    X(queue_overflows)      /* frames that the kernel lost because the loop was kept away */   \
    X(went_down)            /* the interface was taken down, or was found so */                \
    X(went_away)            /* the interface disappeared: the socket is opened anew */         \
    X(socket_errors)        /* receiving failed otherwise: likewise */                         \
    X(not_sent)             /* frames that could not be sent */

#define CB_CAN_COUNTERS(X) CB_CAN_TRAFFIC(X) CB_CAN_ERRORS(X)

struct cb_can_counters {
#define CB_X(name) uint32_t name;
    CB_CAN_COUNTERS(CB_X)
#undef CB_X
};

enum cb_can_state {
    CB_CAN_CLOSED,  /* no socket: the interface is not there */
    CB_CAN_UP,      /* as far as is known */
    CB_CAN_DOWN,    /* the interface is down */
    CB_CAN_BUS_OFF, /* the controller has left the bus */
};

/* Error frames and sockets are looked at no more often than this in one cycle. */
enum { CB_CAN_FRAMES_PER_CYCLE = 256 };

struct cb_can {
    int fd;                 /* the loop's socket; -1: none */
    uint8_t state;          /* enum cb_can_state */
    bool is_back;           /* the bus came (back): taken by cb_can_came_back() */
    int64_t emptied_us;     /* when the queue was last empty: what comes is younger */
    uint32_t lost_in_queue; /* of this socket, as the kernel counts them */
    uint32_t downs;         /* times that the kernel said: down; the other thread looks at it … */
    uint32_t up_after;      /* … and says here after which of them the interface was up again */
    struct cb_can_counters counters;
    int offered;  /* from the normal thread: a socket for the loop; -1: none */
    int returned; /* from the loop: a socket to be closed; -1: none */
    bool wanted;  /* the loop has none: open one */
    bool revoked; /* the loop's socket is of no use any more: it gives it back and wants another */
};

/* No socket yet; the loop will ask for one where `wanted`. */
void cb_can_start(struct cb_can *can, bool wanted);

/* ---- the normal thread ---- */

/* in : ids of the frames to be let pass, flags as in firmware/config/config.h; count <= 128
 * out: a socket, or -errno (-ENODEV: there is no such interface) */
int cb_can_open(const char *interface, const uint32_t *ids, unsigned count);

/* true: the loop needs a socket and none is on its way. */
bool cb_can_wanted(const struct cb_can *can);

/* Gives the loop a socket; it closes nothing and returns the one it had. */
void cb_can_offer(struct cb_can *can, int fd);

/* The loop's socket, and one that may be on its way, are of another interface than is wanted now:
 * the loop gives it back and asks for another. For either thread. */
void cb_can_revoke(struct cb_can *can);

/* Looks whether an interface that went down is up again: nothing need come from a bus whose nodes
 * wait to be told. */
void cb_can_look(struct cb_can *can, const char *interface);

/* Closes what the loop gave back, or all of it when the loop has ended. */
void cb_can_tidy(struct cb_can *can);
void cb_can_close(struct cb_can *can);

/* ---- the loop ---- */

/* The next data frame, with its time in CLOCK_BOOTTIME; error frames are counted on the way.
 * out: false: there is none. Never waits. */
bool cb_can_receive(struct cb_can *can, struct cb_can_frame *frame, int64_t now_us);

/* The bus is (not) needed any more: a socket is asked for, or the one there is given back. */
void cb_can_want(struct cb_can *can, bool wanted);
void cb_can_leave(struct cb_can *can);

/* out: true: the frame is in the queue of the interface. Never waits. */
bool cb_can_send(struct cb_can *can, const struct cb_can_frame *frame);

/* true, once: frames can be sent again that could not before. */
bool cb_can_came_back(struct cb_can *can);

#endif
