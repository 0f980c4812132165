/* SPDX-License-Identifier: MIT */
#include "firmware/signals/canopen.h"

enum {
    NMT_ID = 0,
    NMT_START = 1,
    NMT_BYTES = 2,
    STATE_BITS = 0x7F, /* the bit above toggles in node guarding */
};

void cb_canopen_start(struct cb_canopen_node nodes[CB_MAX_CAN_NODES]) {
    for (unsigned i = 0; i < CB_MAX_CAN_NODES; ++i)
        nodes[i] = (struct cb_canopen_node){.state = CB_CANOPEN_UNKNOWN,
                                            .commanded_us = -CB_CANOPEN_AGAIN_US};
}

void cb_canopen_bus_is_back(struct cb_canopen_node nodes[CB_MAX_CAN_NODES]) {
    for (unsigned i = 0; i < CB_MAX_CAN_NODES; ++i) nodes[i].commanded = false;
}

/* out: index of the node whose heartbeat or boot-up message the frame is; CB_NONE: no configured
 *      node. */
static uint8_t node_of(const struct cb_can_config *can, const struct cb_can_frame *frame) {
    if (frame->length != 1) return CB_NONE;
    for (uint8_t i = 0; i < can->nodes_count; ++i)
        if (frame->id == cb_canopen_heartbeat_id(can->nodes[i].node)) return i;
    return CB_NONE;
}

bool cb_canopen_take(const struct cb_can_config *can, struct cb_canopen_node *nodes,
                     const struct cb_can_frame *frame) {
    const uint8_t i = node_of(can, frame);
    if (i == CB_NONE) return false;
    struct cb_canopen_node *node = &nodes[i];
    node->state = frame->data[0] & STATE_BITS;
    node->heard_us = frame->time_us;
    node->waits = true;
    node->lost = false;
    if (node->state != CB_CANOPEN_BOOTED) return true;
    ++node->boots;
    node->commanded = false;
    return true;
}

void cb_canopen_watch(const struct cb_can_config *can, struct cb_canopen_node *nodes,
                      int64_t now_us) {
    for (unsigned i = 0; i < can->nodes_count; ++i) {
        struct cb_canopen_node *node = &nodes[i];
        const int64_t timeout_us = (int64_t)can->nodes[i].heartbeat_timeout_ms * 1000;
        if (timeout_us == 0 || node->lost) continue;
        if (!node->waits) node->heard_us = now_us;
        node->waits = true;
        if (now_us - node->heard_us <= timeout_us) continue;
        node->state = CB_CANOPEN_UNKNOWN;
        node->lost = true;
        ++node->losses;
    }
}

static bool is_due(const struct cb_can_node_config *config, const struct cb_canopen_node *node,
                   int64_t now_us) {
    const bool watched = config->heartbeat_timeout_ms > 0;
    const bool runs = node->state == CB_CANOPEN_OPERATIONAL;
    if (!config->start || now_us - node->commanded_us < CB_CANOPEN_AGAIN_US) return false;
    if (!node->commanded) return !(watched && runs);
    return watched && !runs && node->state != CB_CANOPEN_UNKNOWN;
}

bool cb_canopen_due(const struct cb_can_config *can, struct cb_canopen_node *nodes, int64_t now_us,
                    struct cb_can_frame *frame) {
    for (unsigned i = 0; i < can->nodes_count; ++i) {
        if (!is_due(&can->nodes[i], &nodes[i], now_us)) continue;
        nodes[i].commanded = true;
        nodes[i].commanded_us = now_us;
        ++nodes[i].starts;
        *frame = (struct cb_can_frame){.id = NMT_ID,
                                       .length = NMT_BYTES,
                                       .data = {NMT_START, can->nodes[i].node},
                                       .time_us = now_us};
        return true;
    }
    return false;
}

void cb_canopen_not_sent(const struct cb_can_config *can, struct cb_canopen_node *nodes,
                         const struct cb_can_frame *frame) {
    for (unsigned i = 0; i < can->nodes_count; ++i) {
        if (can->nodes[i].node != frame->data[1]) continue;
        nodes[i].commanded = false;
        --nodes[i].starts;
    }
}
