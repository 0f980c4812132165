/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/app/last_cycles.h"

#include <stdbool.h>
#include <string.h>

enum { MAGIC = 0x4342434C };

/* A restart may tear the newest record, nothing else: a recorder counts a record when it is whole.
 */
static __attribute__((section(".retained"))) struct {
    uint32_t running; /* MAGIC + index of the recorder of this run; the other one is kept */
    struct cb_recorder recorders[2];
    struct cb_record records[2][CB_LAST_CYCLES];
} last;

static unsigned running(void) {
    return last.running - MAGIC;
}

/* out: whether it is a recorder over these records, as cb_recorder_start() leaves it or later */
static bool is_whole(const struct cb_recorder *recorder, const struct cb_record *records) {
    return recorder->records == records && recorder->capacity == CB_LAST_CYCLES &&
           recorder->count <= CB_LAST_CYCLES && recorder->next < CB_LAST_CYCLES;
}

/* After power-on the content is undefined. */
static bool is_valid(enum cb_start_cause cause) {
    return cause != CB_START_POWER && cause != CB_START_BROWN_OUT && running() < 2 &&
           is_whole(&last.recorders[0], last.records[0]) &&
           is_whole(&last.recorders[1], last.records[1]);
}

void cb_last_cycles_open(enum cb_start_cause cause) {
    if (!is_valid(cause)) {
        memset(&last, 0, sizeof last);
        for (unsigned i = 0; i < 2; ++i)
            cb_recorder_start(&last.recorders[i], last.records[i], CB_LAST_CYCLES);
        last.running = MAGIC;
    }
    if (cb_start_was_fault(cause) && last.recorders[running()].count > 0)
        last.running = MAGIC + 1 - running();
    cb_recorder_start(&last.recorders[running()], last.records[running()], CB_LAST_CYCLES);
}

void cb_last_cycles_note(const struct cb_box *box) {
    cb_recorder_note(&last.recorders[running()], box);
}

const struct cb_recorder *cb_last_cycles_kept(void) {
    return &last.recorders[1 - running()];
}
