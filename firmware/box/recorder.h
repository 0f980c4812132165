/* SPDX-License-Identifier: MIT
 * Flight recorder: the last N cycles, for the analysis of an event. The caller owns its memory and
 * calls it after each step; the box does not know it. */
#ifndef COMPBOX_FIRMWARE_BOX_RECORDER_H
#define COMPBOX_FIRMWARE_BOX_RECORDER_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/box/box.h"

/* State at the end of one cycle. */
struct cb_record {
    int64_t time_us;                   /* of the step */
    uint32_t cycle;                    /* counter `cycles` */
    uint32_t counters;                 /* bit i: counter i + 1 moved (cb_counter_name()) */
    uint16_t control;                  /* the PLC's control word, as last read */
    uint8_t mode, reason;              /* enum cb_mode, enum cb_reason */
    uint16_t detail;                   /* the cause of the reason, as cb_cause_detail() */
    float channel_um[CB_MAX_CHANNELS]; /* outputs */
};

struct cb_recorder {
    struct cb_record *records; /* records[capacity], memory of the caller */
    uint32_t capacity;         /* >= 1 */
    uint32_t count;            /* records made, at most capacity */
    uint32_t next;             /* index of the next record */
    struct cb_counters before; /* counters at the last record */
};

/* out: an empty recorder over records[capacity] */
void cb_recorder_start(struct cb_recorder *recorder, struct cb_record *records, uint32_t capacity);

/* Appends a record; a full recorder overwrites its oldest. Call after each step. */
void cb_recorder_note(struct cb_recorder *recorder, const struct cb_box *box);

/* out: the record `ago` cycles before the last one (0: the last); NULL if there is none */
const struct cb_record *cb_recorder_at(const struct cb_recorder *recorder, uint32_t ago);

#endif
