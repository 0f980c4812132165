/* SPDX-License-Identifier: MIT
 * The normal thread's part of CAN: sockets for the loop, on its request. The interface may appear
 * later, disappear, return, and differ after a reload. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_CAN_SOCKETS_H
#define COMPBOX_HAL_LINUX_DAEMON_CAN_SOCKETS_H

#include <stdint.h>

#include "hal/linux/can_source.h"
#include "hal/linux/daemon/log.h"

struct cb_can_sockets {
    struct cb_can_source *source; /* the loop's */
    struct cb_log *log;
    int64_t again_us; /* time of the next attempt at a missing interface */
    int error;        /* last error, which was logged */
};

/* Call it often. config: the running file. */
void cb_can_sockets_serve(struct cb_can_sockets *sockets, const struct cb_config *config,
                          int64_t now_us);

/* After a reload to a file that uses the bus: offers a socket with its filters. Without one the
 * loop returns its own, and cb_can_sockets_serve() keeps trying. */
void cb_can_sockets_renew(struct cb_can_sockets *sockets, const struct cb_config *config,
                          int64_t now_us);

#endif
