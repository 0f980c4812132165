/* SPDX-License-Identifier: MIT
 * Plays a sequence of events to a box on a Cortex-M and counts the instructions of each step. An
 * event is plain bytes, each with a meaning for any value: so a search may change any of them, and
 * a kept sequence gives the same steps again. */
#ifndef COMPBOX_TESTS_GATES_PLAY_H
#define COMPBOX_TESTS_GATES_PLAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/box/box.h"
#include "firmware/load/load.h"

enum { PLAY_MOST_EVENTS = 20 };

/* Bits of play_event.faults. */
enum {
    PLAY_SILENT = 1,  /* the reading fails */
    PLAY_TORN = 2,    /* the counters of the read block differ */
    PLAY_STOP = 4,    /* a stop is requested */
    PLAY_FLOOD = 8,   /* samples of sensors repeat until no more fit */
    PLAY_RELOAD = 16, /* a new file takes over before the step; first event: the previous run ended
                         STOPPED */
    PLAY_NEW_SIGNALS = 32, /* with it, the names of these are new, … */
    PLAY_NEW_TERMS = 64,
    PLAY_NEW_CHANNELS = 128,
};

/* What clock, line, PLC and sensors do before a step. All 0: one period later, the same values, all
 * is well. */
struct play_event {
    uint8_t gap;      /* time since the previous step (play.c, gap_us) */
    uint8_t age;      /* of the reading, in 1/64 period; 255: it is from the future */
    uint8_t exchange; /* 0.5 ms */
    uint8_t missed;   /* ticks */
    uint8_t faults;
    uint8_t write;                  /* 0: confirmed; else 1 + enum cb_transfer */
    uint8_t held;                   /* the read-back; 0: as requested; else 1 + enum cb_transfer */
    uint8_t control;                /* XOR with enable, referenced and permit resume */
    uint8_t beats;                  /* of the heartbeat, beyond 1 */
    uint8_t status;                 /* XOR with the status read back; the handshake word */
    uint8_t signal[CB_MAX_SIGNALS]; /* of config.measured[] (play.c, next_value) */
    uint8_t held_value[CB_MAX_CHANNELS]; /* of the register read back; 0: as written */
    uint8_t applied[CB_MAX_CHANNELS];    /* of the applied value; 0: as written */
};

/* What a step is, for the search. */
enum play_kind { PLAY_FIRST, PLAY_LATER, PLAY_RELOADED, PLAY_KINDS };

/* The dearest step of a kind. */
struct play_most {
    uint32_t count; /* instructions; 0: there is no such step */
    uint32_t at;    /* index of its event */
    uint8_t mode;   /* enum cb_mode after it */
};

/* out: true: loaded, for all sequences from now on; false: *message has the loader's sentence */
bool play_load(const char *text, size_t length, const struct cb_target *target,
               struct cb_message *message);

const struct cb_config *play_config(void);

/* Starts the box and plays the events. out: the dearest step of each kind */
void play(const struct play_event *events, unsigned count, struct play_most most[PLAY_KINDS]);

#endif
