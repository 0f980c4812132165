/* SPDX-License-Identifier: MIT
 * The section "can": the interface, and the supervised CANopen nodes. */
#include <string.h>

#include "firmware/config/config.h"
#include "firmware/load/sections.h"

enum { INTERFACE, NODES, CAN_KEYS };
static const struct cb_field CAN_FIELDS[CAN_KEYS] = {
    [INTERFACE] = {"interface", CB_FIELD_TEXT, false,
                   .offset = offsetof(struct cb_can_config, interface),
                   .size = sizeof(((struct cb_can_config *)0)->interface)},
    [NODES] = {"nodes", CB_FIELD_ARRAY, false, CB_NOT_STORED},
};
const struct cb_object cb_can_object = {CAN_FIELDS, CAN_KEYS};

#define AT(member) .offset = offsetof(struct cb_can_node_config, member)

enum { NODE, START, HEARTBEAT_TIMEOUT, NODE_KEYS };
static const struct cb_field NODE_FIELDS[NODE_KEYS] = {
    [NODE] = {"node", CB_FIELD_UINT8, true, AT(node), .least = "1", .most = "127"},
    [START] = {"start", CB_FIELD_BOOL, false, AT(start), .otherwise = "false"},
    [HEARTBEAT_TIMEOUT] = {"heartbeat_timeout_ms", CB_FIELD_UINT32, false, AT(heartbeat_timeout_ms),
                           .least = "50", .most = "600000"},
};
const struct cb_object cb_can_node_object = {NODE_FIELDS, NODE_KEYS};

static bool is_listed(const struct cb_can_config *can, uint8_t node) {
    for (uint32_t i = 0; i < can->nodes_count; ++i)
        if (can->nodes[i].node == node) return true;
    return false;
}

static bool load_node(struct cb_loader *loader, uint32_t at) {
    struct cb_can_config *can = &loader->config->can;
    struct cb_can_node_config *node = &can->nodes[can->nodes_count];
    uint32_t slots[NODE_KEYS];
    if (!cb_read_object(loader, at, &cb_can_node_object, node, slots)) return false;
    if (is_listed(can, node->node))
        return cb_fail(loader, CB_ERROR_NAME, slots[NODE], "node %o occurs twice", slots[NODE]);
    if (!node->start && slots[HEARTBEAT_TIMEOUT] == CB_ABSENT)
        return cb_fail(loader, CB_ERROR_KEY, at,
                       "a node needs start or heartbeat_timeout_ms; omit one that needs neither");
    ++can->nodes_count;
    return true;
}

/* A name that the kernel accepts: 1 … 15 bytes without slash, colon and white space, not . or .. */
static bool check_interface(struct cb_loader *loader, uint32_t at) {
    const char *name = loader->config->can.interface;
    bool good = name[0] != '\0' && !cb_same_text(name, ".") && !cb_same_text(name, "..");
    for (const char *c = name; *c; ++c) good = good && *c != '/' && *c != ' ' && *c != ':';
    if (good) return true;
    return cb_fail(loader, CB_ERROR_NAME, at, "%o is not a name of a network interface", at);
}

bool cb_load_can(struct cb_loader *loader, uint32_t at) {
    static const char usual[] = "can0";
    struct cb_can_config *can = &loader->config->can;
    uint32_t slots[CAN_KEYS];
    memcpy(can->interface, usual, sizeof usual);
    if (at == CB_ABSENT) return true;
    if (!(loader->target->sources & 1u << CB_SOURCE_CAN))
        return cb_fail(loader, CB_ERROR_PROFILE, at, "%s reads no CAN bus in this version",
                       loader->target->name);
    if (!cb_read_object(loader, at, &cb_can_object, can, slots)) return false;
    if (slots[INTERFACE] != CB_ABSENT && !check_interface(loader, slots[INTERFACE])) return false;
    if (slots[NODES] == CB_ABSENT) return true;
    struct cb_list list = cb_list(loader, slots[NODES]);
    while (cb_list_next(&list)) {
        if (!cb_list_has_room(loader, &list, CB_MAX_CAN_NODES, "nodes")) return false;
        if (!load_node(loader, list.at)) return false;
    }
    return true;
}
