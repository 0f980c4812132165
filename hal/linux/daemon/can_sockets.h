/* SPDX-License-Identifier: MIT
 * The normal thread's part of CAN: sockets for the loop, as it asks for them. The interface may
 * come later, go, come again, and be another one after a reload. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_CAN_SOCKETS_H
#define COMPBOX_HAL_LINUX_DAEMON_CAN_SOCKETS_H

#include <stdint.h>

#include "hal/linux/can_source.h"
#include "hal/linux/daemon/log.h"

struct cb_can_sockets {
    struct cb_can_source *source; /* the loop's */
    struct cb_log *log;
    int64_t again_us; /* when a missing interface is next looked for */
    int error;        /* what opening it last gave, which was said */
};

/* To be called often; config: the file that runs now. */
void cb_can_sockets_serve(struct cb_can_sockets *sockets, const struct cb_config *config,
                          int64_t now_us);

/* After a reload to a file that uses the bus: a socket with its filters. Where there is none the
 * loop gives its own back, and cb_can_sockets_serve() goes on looking. */
void cb_can_sockets_renew(struct cb_can_sockets *sockets, const struct cb_config *config,
                          int64_t now_us);

#endif
