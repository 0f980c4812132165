/* SPDX-License-Identifier: MIT
 * The member "can" of the statistics. */
#include "hal/linux/files/can_words.h"
#include "hal/linux/files/stats.h"

void cb_stats_put_can(struct cb_writer *json, const struct cb_can_config *config,
                      const struct cb_row *row) {
    cb_writer_object(json, "can");
    cb_writer_text(json, "interface", config->interface);
    cb_writer_text(json, "state", cb_can_state_word(row->can.state));
#define CB_X(name) cb_writer_whole(json, #name, row->can.counters.name);
    CB_CAN_COUNTERS(CB_X)
#undef CB_X
    cb_writer_array(json, "nodes");
    for (unsigned i = 0; i < config->nodes_count; i++) {
        const struct cb_canopen_node *node = &row->can.nodes[i];
        cb_writer_object(json, NULL);
        cb_writer_whole(json, "node", config->nodes[i].node);
        cb_writer_text(json, "state", cb_canopen_state_word(node->state));
        cb_writer_whole(json, "boots", node->boots);
        cb_writer_whole(json, "losses", node->losses);
        cb_writer_whole(json, "starts", node->starts);
        cb_writer_close(json);
    }
    cb_writer_close(json);
    cb_writer_close(json);
}
