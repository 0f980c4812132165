/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/can_sockets.h"

#include <errno.h>
#include <string.h>

enum { LOOK_EVERY_US = 1000000 };

/* out: true: a socket for the file's frames is offered to the loop; false: the cause is logged,
 *      once */
static bool offer(struct cb_can_sockets *sockets, const struct cb_config *config, int64_t now_us) {
    const int got = cb_can_source_open(config);
    if (got >= 0)
        cb_can_offer(&sockets->source->can, got);
    else if (got != sockets->error)
        cb_log_limited(sockets->log, CB_LOG_CAN, now_us,
                       "%s: no CAN bus: %s; trying again every second", config->can.interface,
                       got == -EAFNOSUPPORT ? "this kernel has none" : strerror(-got));
    sockets->error = got;
    return got >= 0;
}

void cb_can_sockets_serve(struct cb_can_sockets *sockets, const struct cb_config *config,
                          int64_t now_us) {
    struct cb_can *can = &sockets->source->can;
    cb_can_tidy(can);
    if (now_us < sockets->again_us) return;
    sockets->again_us = now_us + LOOK_EVERY_US;
    cb_can_look(can, config->can.interface);
    if (cb_can_wanted(can)) offer(sockets, config, now_us);
}

void cb_can_sockets_renew(struct cb_can_sockets *sockets, const struct cb_config *config,
                          int64_t now_us) {
    sockets->error = 0;
    if (!offer(sockets, config, now_us)) cb_can_revoke(&sockets->source->can);
}
