/* SPDX-License-Identifier: MIT
 * The little of CANopen (CiA 301) that a reader of sensors needs: telling nodes to become
 * operational (NMT), because before that they send no PDOs, and watching their heartbeats. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_CANOPEN_H
#define COMPBOX_FIRMWARE_SIGNALS_CANOPEN_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/signals/can.h"

enum cb_canopen_state {
    CB_CANOPEN_BOOTED = 0,
    CB_CANOPEN_STOPPED = 4,
    CB_CANOPEN_OPERATIONAL = 5,
    CB_CANOPEN_PRE_OPERATIONAL = 127,
    CB_CANOPEN_UNKNOWN = 255, /* not heard yet, or lost */
};

/* A node that is told to start is told again after this long, while it does not obey. */
enum { CB_CANOPEN_AGAIN_US = 1000000 };

struct cb_canopen_node {
    uint8_t state;    /* enum cb_canopen_state, as last heard */
    bool asked;       /* it was told to start since it could last have forgotten */
    bool waits;       /* heard_us counts: since it was heard, or since it is waited for … */
    bool lost;        /* … which took too long, and was counted */
    uint32_t boots;   /* boot-up messages heard */
    uint32_t losses;  /* heartbeats that stayed away for longer than the timeout */
    uint32_t starts;  /* times that it was told to start */
    int64_t heard_us; /* last heartbeat; before the first: when the wait for it began */
    int64_t asked_us; /* when it was last told to start */
};

/* Before the first frame: nothing is known of any node. */
void cb_canopen_start(struct cb_canopen_node nodes[CB_MAX_CAN_NODES]);

/* The bus was away (interface down, bus-off): nodes that do not say otherwise are told anew. */
void cb_canopen_bus_is_back(struct cb_canopen_node nodes[CB_MAX_CAN_NODES]);

/* Identifier of a node's heartbeat. */
static inline uint32_t cb_canopen_heartbeat_id(uint8_t node) {
    return 0x700u + node;
}

/* out: true: the frame was a heartbeat or the boot-up message of one of our nodes */
bool cb_canopen_take(const struct cb_can_config *can, struct cb_canopen_node *nodes,
                     const struct cb_can_frame *frame);

/* Counts nodes whose heartbeat stays away, or never comes at all. */
void cb_canopen_watch(const struct cb_can_config *can, struct cb_canopen_node *nodes,
                      int64_t now_us);

/* out: true: *frame tells one node to start and shall be sent now. Call until false; what could not
 *      be sent is due again after CB_CANOPEN_AGAIN_US where cb_canopen_not_sent() was called.
 * A node is told after the bus came up and after it booted; one whose heartbeat is watched also
 * again and again while that says that it is not operational. */
bool cb_canopen_due(const struct cb_can_config *can, struct cb_canopen_node *nodes, int64_t now_us,
                    struct cb_can_frame *frame);

/* The frame that was due could not be sent. */
void cb_canopen_not_sent(const struct cb_can_config *can, struct cb_canopen_node *nodes,
                         const struct cb_can_frame *frame);

#endif
