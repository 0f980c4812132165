/* SPDX-License-Identifier: MIT */
#include "hal/linux/can_source.h"

#include <string.h>

#include "firmware/config/config.h"

bool cb_can_source_used(const struct cb_can_source *source) {
    return source->map.count > 0 || source->config.nodes_count > 0;
}

void cb_can_source_start(struct cb_can_source *source, const struct cb_config *config) {
    *source = (struct cb_can_source){.config = config->can};
    cb_can_map_of(&source->map, config);
    cb_canopen_start(source->nodes);
    cb_can_start(&source->can, cb_can_source_used(source));
}

void cb_can_source_replan(struct cb_can_source *source, const struct cb_config *config) {
    const bool same = memcmp(&source->config, &config->can, sizeof config->can) == 0;
    const bool moves = strcmp(source->config.interface, config->can.interface) != 0;
    cb_can_map_of(&source->map, config);
    source->config = config->can;
    if (!same) cb_canopen_start(source->nodes);
    if (moves) cb_can_revoke(&source->can);
    if (source->can.fd < 0) cb_can_want(&source->can, cb_can_source_used(source));
}

static void add_id(uint32_t *ids, unsigned *count, uint32_t id) {
    for (unsigned i = 0; i < *count; i++)
        if (ids[i] == id) return;
    ids[(*count)++] = id;
}

int cb_can_source_open(const struct cb_config *config) {
    uint32_t ids[CB_MAX_SIGNALS + CB_MAX_CAN_NODES];
    unsigned count = 0;
    struct cb_can_map map;
    cb_can_map_of(&map, config);
    for (unsigned i = 0; i < map.count; i++) add_id(ids, &count, map.fields[i].id);
    for (unsigned i = 0; i < config->can.nodes_count; i++)
        add_id(ids, &count, cb_canopen_heartbeat_id(config->can.nodes[i].node));
    return cb_can_open(config->can.interface, ids, count);
}

static void receive(struct cb_can_source *source, int64_t now_us) {
    struct cb_can_frame frame;
    source->batch.count = 0;
    for (int i = 0; i < CB_CAN_FRAMES_PER_CYCLE; i++) {
        if (!cb_can_receive(&source->can, &frame, now_us)) return;
        source->can.counters.heartbeats += cb_canopen_take(&source->config, source->nodes, &frame);
        if (cb_can_take(&source->map, &frame, &source->batch) != CB_CAN_SHORT) continue;
        source->can.counters.short_frames++;
        source->short_id = frame.id;
    }
}

/* While the controller is off the bus, frames would only fill its queue. While the interface is
 * down, they would fail. */
static void start_nodes(struct cb_can_source *source, int64_t now_us) {
    struct cb_can_frame frame;
    if (cb_can_came_back(&source->can)) cb_canopen_bus_is_back(source->nodes);
    cb_canopen_watch(&source->config, source->nodes, now_us);
    if (source->can.state != CB_CAN_UP) return;
    while (cb_canopen_due(&source->config, source->nodes, now_us, &frame))
        if (!cb_can_send(&source->can, &frame))
            cb_canopen_not_sent(&source->config, source->nodes, &frame);
}

size_t cb_can_source_samples(struct cb_can_source *source, struct cb_sample *samples, size_t max,
                             int64_t now_us) {
    if (!cb_can_source_used(source)) {
        cb_can_leave(&source->can);
        return 0;
    }
    receive(source, now_us);
    start_nodes(source, now_us);
    const size_t count = source->batch.count < max ? source->batch.count : max;
    memcpy(samples, source->batch.samples, count * sizeof *samples);
    return count;
}
