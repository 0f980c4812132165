/* SPDX-License-Identifier: MIT */
#include "firmware/box/recorder.h"

#include <string.h>

#include "firmware/base/assert.h"

void cb_recorder_start(struct cb_recorder *recorder, struct cb_record *records, uint32_t capacity) {
    *recorder = (struct cb_recorder){.records = records, .capacity = capacity};
}

/* out: one bit for each counter that differs; `cycles` has none, because it always does */
static uint32_t changed(const struct cb_counters *before, const struct cb_counters *after) {
    uint32_t old[CB_COUNTERS_COUNT], new[CB_COUNTERS_COUNT], bits = 0;
    memcpy(old, before, sizeof old);
    memcpy(new, after, sizeof new);
    for (unsigned i = 1; i < CB_COUNTERS_COUNT; ++i)
        bits |= (uint32_t)(old[i] != new[i]) << (i - 1);
    return bits;
}
_Static_assert(offsetof(struct cb_counters, cycles) == 0, "it is the one without a bit");

void cb_recorder_note(struct cb_recorder *recorder, const struct cb_box *box) {
    CB_ASSERT(recorder->next < recorder->capacity);
    struct cb_record *record = &recorder->records[recorder->next];
    *record = (struct cb_record){.time_us = box->life.now_us,
                                 .cycle = box->counters.cycles,
                                 .counters = changed(&recorder->before, &box->counters),
                                 .control = box->plc.control,
                                 .mode = box->mode.mode,
                                 .reason = box->mode.reason,
                                 .detail = cb_cause_detail(&box->cause)};
    for (unsigned i = 0; i < CB_MAX_CHANNELS; ++i)
        record->channel_um[i] = box->channels[i].output_um;
    recorder->before = box->counters;
    recorder->next = (recorder->next + 1) % recorder->capacity;
    if (recorder->count < recorder->capacity) ++recorder->count;
}

const struct cb_record *cb_recorder_at(const struct cb_recorder *recorder, uint32_t ago) {
    if (ago >= recorder->count) return NULL;
    const uint32_t back = (ago + 1) % recorder->capacity;
    return &recorder->records[(recorder->next + recorder->capacity - back) % recorder->capacity];
}
