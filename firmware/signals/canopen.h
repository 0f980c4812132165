/* SPDX-License-Identifier: MIT
 * The part of CANopen (CiA 301) that reading sensors needs: the NMT start command, because nodes
 * send no PDOs before it, and the supervision of heartbeats. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_CANOPEN_H
#define COMPBOX_FIRMWARE_SIGNALS_CANOPEN_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/config/buses.h"
#include "firmware/signals/can.h"

enum cb_canopen_state {
    CB_CANOPEN_BOOTED = 0,
    CB_CANOPEN_STOPPED = 4,
    CB_CANOPEN_OPERATIONAL = 5,
    CB_CANOPEN_PRE_OPERATIONAL = 127,
    CB_CANOPEN_UNKNOWN = 255, /* not received yet, or lost */
};

/* Interval of the start command to a node that does not obey it. */
enum { CB_CANOPEN_AGAIN_US = 1000000 };

struct cb_canopen_node {
    uint8_t state;        /* enum cb_canopen_state, as last received */
    bool commanded;       /* a start command was sent since its last possible reset */
    bool waits;           /* heard_us is valid: a heartbeat is awaited since then … */
    bool lost;            /* … the wait exceeded the timeout, and the loss was counted */
    uint32_t boots;       /* boot-up messages received */
    uint32_t losses;      /* heartbeats later than the timeout */
    uint32_t starts;      /* start commands sent */
    int64_t heard_us;     /* last heartbeat; before the first: start of the wait for it */
    int64_t commanded_us; /* time of the last start command, sent or not */
};

/* Before the first frame: the state of every node is unknown. */
void cb_canopen_start(struct cb_canopen_node nodes[CB_MAX_CAN_NODES]);

/* The bus was down (interface down, bus-off): nodes get a start command again, unless their watched
 * heartbeat says that they are operational. */
void cb_canopen_bus_is_back(struct cb_canopen_node nodes[CB_MAX_CAN_NODES]);

/* Identifier of a node's heartbeat. */
static inline uint32_t cb_canopen_heartbeat_id(uint8_t node) {
    return 0x700u + node;
}

/* out: true if the frame was a heartbeat or the boot-up message of a configured node */
bool cb_canopen_take(const struct cb_can_config *can, struct cb_canopen_node *nodes,
                     const struct cb_can_frame *frame);

/* Counts nodes whose heartbeat is late or has never come. */
void cb_canopen_watch(const struct cb_can_config *can, struct cb_canopen_node *nodes,
                      int64_t now_us);

/* out: true: send *frame now, a start command for one node. Call until false; after
 *      cb_canopen_not_sent() a frame is due again after CB_CANOPEN_AGAIN_US.
 * A node gets the command after the bus came up and after its boot-up message. A node whose
 * heartbeat is watched gets it repeatedly while the heartbeat reports another state than
 * operational. */
bool cb_canopen_due(const struct cb_can_config *can, struct cb_canopen_node *nodes, int64_t now_us,
                    struct cb_can_frame *frame);

/* The due frame could not be sent. */
void cb_canopen_not_sent(const struct cb_can_config *can, struct cb_canopen_node *nodes,
                         const struct cb_can_frame *frame);

#endif
