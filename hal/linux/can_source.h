/* SPDX-License-Identifier: MIT
 * Samples from a CAN bus, for the loop: receives, decodes, supervises CANopen nodes. Never
 * waits. */
#ifndef COMPBOX_HAL_LINUX_CAN_SOURCE_H
#define COMPBOX_HAL_LINUX_CAN_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/signals/can.h"
#include "firmware/signals/canopen.h"
#include "hal/hal.h"
#include "hal/linux/can.h"

struct cb_can_source {
    struct cb_can can;
    struct cb_can_config config;
    struct cb_can_map map;
    struct cb_can_batch batch;
    uint32_t short_id; /* of the last frame that was too short */
    struct cb_canopen_node nodes[CB_MAX_CAN_NODES];
};

/* out: true if the source needs the bus, for signals or for nodes */
bool cb_can_source_used(const struct cb_can_source *source);

/* Takes the signals and nodes of the file, before the loop starts. Requests a socket if the bus is
 * used. */
void cb_can_source_start(struct cb_can_source *source, const struct cb_config *config);

/* Another coefficient file takes over, between two cycles. The socket stays, with its filters,
 * until the normal thread offers another. A socket of another interface is returned at once. Nodes
 * get a new start command where their section changed. */
void cb_can_source_replan(struct cb_can_source *source, const struct cb_config *config);

/* out: a socket for the frames of a coefficient file, to be offered to the source; or -errno. For
 *      the normal thread. */
int cb_can_source_open(const struct cb_config *config);

/* The operation `samples` of hal.h: the newest number of each signal since the last call. Sends the
 * start commands that are due. */
size_t cb_can_source_samples(struct cb_can_source *source, struct cb_sample *samples, size_t max,
                             int64_t now_us);

#endif
