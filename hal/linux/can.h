/* SPDX-License-Identifier: MIT
 * SocketCAN: receives frames, sends a few, and tracks the state of the bus. Two threads share it.
 * The normal one opens sockets, which may wait for the kernel's locks and allocates; the loop
 * receives and sends, and never waits. A socket changes hands through one integer.
 *
 * A socket survives its interface going down and up, and bus-off. A new socket is opened when the
 * interface itself disappeared (an adapter was unplugged). The system configures the interface and
 * brings it up. */
#ifndef COMPBOX_HAL_LINUX_CAN_H
#define COMPBOX_HAL_LINUX_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/signals/can.h"

/* Counters; they wrap. Names are stable. */
#define CB_CAN_TRAFFIC(X)                                            \
    X(frames)     /* data frames received that passed the filters */ \
    X(heartbeats) /* of them, heartbeats and boot-up messages */     \
    X(sent)       /* frames sent */

#define CB_CAN_ERRORS(X)                                                                   \
    X(short_frames)         /* frames that end before one of their signals */              \
    X(error_frames)         /* reported by the controller; some kinds are counted below */ \
    X(warnings)             /* … many errors on the bus */                               \
    X(passives)             /* … very many */                                            \
    X(bus_offs)             /* … the controller left the bus */                          \
    X(restarts)             /* … and came back */                                        \
    X(controller_overflows) /* … it lost frames */                                       \
    X(queue_overflows)      /* frames that the kernel lost because the loop was delayed */ \
    X(went_down)            /* the interface was taken down, or found down */              \
    X(went_away)            /* the interface disappeared: a new socket is opened */        \
    X(socket_errors)        /* another receive error: a new socket is opened */            \
    X(not_sent)             /* frames that could not be sent */

#define CB_CAN_COUNTERS(X) CB_CAN_TRAFFIC(X) CB_CAN_ERRORS(X)

struct cb_can_counters {
#define CB_X(name) uint32_t name;
    CB_CAN_COUNTERS(CB_X)
#undef CB_X
};

enum cb_can_state {
    CB_CAN_CLOSED,  /* no socket: there is no such interface */
    CB_CAN_UP,      /* as far as known */
    CB_CAN_DOWN,    /* the interface is down */
    CB_CAN_BUS_OFF, /* the controller has left the bus */
};

/* Maximum number of error frames and sockets handled in one cycle. */
enum { CB_CAN_FRAMES_PER_CYCLE = 256 };

struct cb_can {
    int fd;                 /* the loop's socket; -1: none */
    uint8_t state;          /* enum cb_can_state */
    bool is_back;           /* the bus came up (again); cb_can_came_back() clears it */
    int64_t not_before_us;  /* last time of a frame or an empty queue: later frames are newer */
    int64_t down_us;        /* last time that the kernel reported "down" */
    int64_t stamp_ns;       /* of the last frame, by the kernel … */
    int64_t seen_ns;        /* … and of the last one of the socket before; 0: all are new */
    uint32_t lost_in_queue; /* of this socket, as the kernel counts them */
    uint32_t downs;         /* times that the kernel reported "down"; the other thread … */
    uint32_t up_after;      /* … writes here after which of them the interface was up again */
    struct cb_can_counters counters;
    int64_t offered_us; /* time of the last offer: its socket has all frames since then */
    int offered;        /* from the normal thread: a socket for the loop; -1: none */
    int returned;       /* from the loop: a socket to close; -1: none */
    bool wanted;        /* the loop has none and requests one */
    bool revoked; /* the loop's socket is unusable: the loop returns it and requests another */
};

/* Starts without a socket; the loop requests one if `wanted`. */
void cb_can_start(struct cb_can *can, bool wanted);

/* ---- the normal thread ---- */

/* in : ids of the frames to pass, flags as in firmware/config/config.h; count <= 128
 * out: a socket, or -errno (-ENODEV: there is no such interface) */
int cb_can_open(const char *interface, const uint32_t *ids, unsigned count);

/* out: true if the loop needs a socket and none is offered */
bool cb_can_wanted(const struct cb_can *can);

/* Offers the loop a socket; the loop returns its previous one, behind its last frame of before. */
void cb_can_offer(struct cb_can *can, int fd);

/* The loop's socket is dead, or it and an offered one are of another interface than the wanted one:
 * the loop returns it and requests another. For either thread. */
void cb_can_revoke(struct cb_can *can);

/* Checks whether an interface that went down is up again. A bus whose nodes await a start command
 * may carry no frame that would show it. */
void cb_can_look(struct cb_can *can, const char *interface);

/* Closes the sockets that the loop returned, or all of them when the loop has ended. */
void cb_can_tidy(struct cb_can *can);
void cb_can_close(struct cb_can *can);

/* ---- the loop ---- */

/* out: true and the next data frame, with its time in CLOCK_BOOTTIME; false: none. Counts error
 *      frames on the way. Never waits. */
bool cb_can_receive(struct cb_can *can, struct cb_can_frame *frame, int64_t now_us);

/* Sets whether the bus is needed: requests a socket, or returns the present one. */
void cb_can_want(struct cb_can *can, bool wanted);
void cb_can_leave(struct cb_can *can);

/* out: true: the frame is in the queue of the interface. Never waits. */
bool cb_can_send(struct cb_can *can, const struct cb_can_frame *frame);

/* out: true, once, when frames can be sent again after an interruption */
bool cb_can_came_back(struct cb_can *can);

#endif
