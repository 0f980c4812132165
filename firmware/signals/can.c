/* SPDX-License-Identifier: MIT */
#include "firmware/signals/can.h"

#include "firmware/base/assert.h"
#include "firmware/config/config.h"
#include "firmware/wire/number.h"

void cb_can_map_of(struct cb_can_map *map, const struct cb_config *config) {
    map->count = 0;
    for (unsigned i = 0; i < config->signals_count; ++i) {
        const struct cb_signal_config *signal = &config->signals[i];
        if (signal->source != CB_SOURCE_CAN) continue;
        map->fields[map->count++] =
            (struct cb_can_field){signal->can_id, (uint8_t)i, signal->type, (uint8_t)signal->reg};
    }
}

static void put(struct cb_can_batch *batch, const struct cb_sample *sample) {
    unsigned i = 0;
    while (i < batch->count && batch->samples[i].signal != sample->signal) ++i;
    CB_ASSERT(i < CB_MAX_SIGNALS);
    batch->samples[i] = *sample;
    if (i == batch->count) ++batch->count;
}

enum cb_can_taken cb_can_take(const struct cb_can_map *map, const struct cb_can_frame *frame,
                              struct cb_can_batch *batch) {
    const uint8_t length = frame->length > sizeof frame->data ? 0 : frame->length;
    enum cb_can_taken taken = CB_CAN_FOREIGN;
    for (unsigned i = 0; i < map->count; ++i) {
        const struct cb_can_field *field = &map->fields[i];
        if (!cb_can_is(field->id, frame->id)) continue;
        if (field->offset + cb_number_bytes(field->type) > length) {
            taken = CB_CAN_SHORT;
            continue;
        }
        const float raw = cb_number_decode_bytes(field->type, frame->data + field->offset);
        put(batch, &(struct cb_sample){field->signal, raw, frame->time_us});
        if (taken == CB_CAN_FOREIGN) taken = CB_CAN_TAKEN;
    }
    return taken;
}
