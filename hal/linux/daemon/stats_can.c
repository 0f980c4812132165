/* SPDX-License-Identifier: MIT
 * The member "can" of the statistics. */
#include "hal/linux/daemon/can_words.h"
#include "hal/linux/daemon/stats.h"

const char *cb_can_state_word(uint8_t state) {
    static const char *const words[] = {
        [CB_CAN_CLOSED] = "not there",
        [CB_CAN_UP] = "up",
        [CB_CAN_DOWN] = "down",
        [CB_CAN_BUS_OFF] = "bus-off",
    };
    return state < sizeof words / sizeof words[0] ? words[state] : "unknown";
}

const char *cb_canopen_state_word(uint8_t state) {
    switch (state) {
        case CB_CANOPEN_BOOTED:
            return "booted";
        case CB_CANOPEN_STOPPED:
            return "stopped";
        case CB_CANOPEN_OPERATIONAL:
            return "operational";
        case CB_CANOPEN_PRE_OPERATIONAL:
            return "pre-operational";
        default:
            return "unknown";
    }
}

static void put_node(FILE *file, uint8_t number, const struct cb_canopen_node *node) {
    fprintf(file,
            "{\"node\": %u, \"state\": \"%s\", \"boots\": %u, \"losses\": %u, \"starts\": %u}",
            (unsigned)number, cb_canopen_state_word(node->state), (unsigned)node->boots,
            (unsigned)node->losses, (unsigned)node->starts);
}

void cb_stats_put_can(FILE *file, const struct cb_can_config *config, const struct cb_row *row) {
    fprintf(file, "  \"can\": {\"interface\": ");
    cb_stats_put_string(file, config->interface);
    fprintf(file, ", \"state\": \"%s\"", cb_can_state_word(row->can.state));
#define CB_X(name) fprintf(file, ", \"" #name "\": %u", (unsigned)row->can.counters.name);
    CB_CAN_COUNTERS(CB_X)
#undef CB_X
    fputs(",\n    \"nodes\": [", file);
    for (unsigned i = 0; i < config->nodes_count; i++) {
        fputs(i == 0 ? "" : ", ", file);
        put_node(file, config->nodes[i].node, &row->can.nodes[i]);
    }
    fputs("]},\n", file);
}
