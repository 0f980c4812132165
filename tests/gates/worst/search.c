/* SPDX-License-Identifier: MIT */
#include "tests/gates/worst/search.h"

#include <string.h>

#include "firmware/config/config.h"

enum {
    CLIMB_TRIES = 1500, /* most of a climb that begins at random; half of all tries are for these */
    START_SLACK = 200   /* instructions by which a change may be cheaper at first */
};

/* The emulator has 64 KiB behind the 128 KiB of the chip's main memory, which two boxes fill. */
static struct { struct search_result found, one, here, other; } *const memory = (void *)0x20020000;

struct search_result *search_memory(void) {
    return &memory->found;
}

static struct {
    uint32_t random;
    unsigned measured, channels; /* of the file: signals and channels that have bytes */
} set;

static uint32_t below(uint32_t end) {
    set.random ^= set.random << 13;
    set.random ^= set.random >> 17;
    set.random ^= set.random << 5;
    return (uint32_t)((uint64_t)set.random * end >> 32);
}

static bool happens(uint32_t per_cent) {
    return below(100) < per_cent;
}

/* ---- events ---- */

/* out: a byte of play_event.signal */
static uint8_t any_code(void) {
    if (happens(20)) return 0;
    return (uint8_t)(happens(55) ? below(16) : below(256));
}

/* Changes one byte beside signals and channels. */
static void change_fault(struct play_event *event) {
    switch (below(11)) {
        case 0:
            event->gap = (uint8_t)(happens(60) ? below(16) : below(256));
            break;
        case 1:
            event->age = (uint8_t)(happens(60) ? below(64) : below(256));
            break;
        case 2:
            event->exchange = (uint8_t)below(256);
            break;
        case 3:
            event->missed = (uint8_t)below(3);
            break;
        case 4:
        case 5:
            event->faults ^= (uint8_t)(1u << below(8));
            break;
        case 6:
            event->write = (uint8_t)below(7);
            break;
        case 7:
            event->held = (uint8_t)below(6);
            break;
        case 8:
            event->control ^= (uint8_t)(1u << below(5));
            break;
        case 9:
            event->beats = (uint8_t)(happens(50) ? below(3) - 1u : below(256));
            break;
        default:
            event->status ^= (uint8_t)(1u << below(8));
            break;
    }
}

static void change_signals(struct play_event *event) {
    const unsigned from = below(set.measured);
    const unsigned run = happens(60) ? 1 : 1 + below(set.measured - from);
    const uint8_t code = any_code();
    const bool equal = happens(50);
    for (unsigned k = from; k < from + run; ++k) event->signal[k] = equal ? code : any_code();
}

static void change_channels(struct play_event *event) {
    uint8_t *const values = happens(50) ? event->held_value : event->applied;
    const uint8_t code = (uint8_t)(happens(40) ? 0 : below(256));
    if (happens(50))
        values[below(set.channels)] = code;
    else
        for (unsigned i = 0; i < set.channels; ++i) values[i] = code == 0 ? 0 : (uint8_t)below(256);
}

/* ---- sequences ---- */

/* Inserts, removes, copies or moves whole events. */
static void change_order(struct search_result *one) {
    const unsigned at = below(one->count), from = below(one->count);
    struct play_event *const events = one->events;
    if (happens(40) && one->count < PLAY_MOST_EVENTS) {
        const struct play_event copy = events[from];
        memmove(&events[at + 1], &events[at], (one->count - at) * sizeof *events);
        events[at] = copy;
        ++one->count;
    } else if (happens(50) && one->count > 1) {
        memmove(&events[at], &events[at + 1], (one->count - at - 1) * sizeof *events);
        --one->count;
    } else if (happens(50)) {
        memcpy(events[at].signal, events[from].signal, sizeof events[at].signal);
    } else {
        events[at] = events[from];
    }
}

/* Most changes are near the end, where the dearest step is. */
static void change(struct search_result *one) {
    do {
        const unsigned back =
            happens(60) ? below(one->count < 3 ? one->count : 3) : below(one->count);
        struct play_event *const event = &one->events[one->count - 1 - back];
        const uint32_t what = below(100);
        if (what < 45)
            change_signals(event);
        else if (what < 75)
            change_fault(event);
        else if (what < 85)
            change_channels(event);
        else
            change_order(one);
    } while (happens(45));
}

static void begin(struct search_result *one) {
    memset(one, 0, sizeof *one);
    one->count = 2 + below(PLAY_MOST_EVENTS - 1);
    for (unsigned i = below(one->count) + below(3); i < one->count; ++i)
        for (unsigned k = below(4); k > 0; --k)
            if (happens(50))
                change_fault(&one->events[i]);
            else
                change_signals(&one->events[i]);
}

/* ---- the search ---- */

/* Plays it and cuts off what follows the dearest step. */
static void measure(struct search_result *one, enum play_kind kind) {
    struct play_most most[PLAY_KINDS];
    play(one->events, one->count, most);
    one->most = most[kind];
    if (one->most.count > 0) one->count = one->most.at + 1;
}

/* in : *best, a sequence that was measured; tries, how many others are played
 * out: *best, the dearest that was met */
static void climb(enum play_kind kind, uint32_t tries, uint32_t slack, struct search_result *best) {
    struct search_result *const here = &memory->here, *const other = &memory->other;
    *here = *best;
    for (uint32_t i = 0; i < tries; ++i) {
        *other = *here;
        change(other);
        measure(other, kind);
        const uint32_t allowed = (uint32_t)((uint64_t)slack * (tries - i) / tries);
        if (other->most.count + allowed < here->most.count) continue;
        *here = *other;
        if (here->most.count > best->most.count) *best = *here;
    }
}

void search(enum play_kind kind, uint32_t seed, uint32_t tries, struct search_result *result) {
    const struct cb_config *config = play_config();
    const uint32_t half = result->count == 0 ? tries / 2 : 0;
    const uint32_t each = half < CLIMB_TRIES ? half : CLIMB_TRIES;
    const uint32_t climbs = each > 0 ? half / each : 0;
    set.random = seed;
    set.measured = (unsigned)config->signals_count - config->lags_count;
    set.channels = cb_all_channels(config);
    if (result->count > 0) measure(result, kind);
    for (uint32_t i = 0; i < climbs; ++i) {
        struct search_result *const one = &memory->one;
        begin(one);
        measure(one, kind);
        climb(kind, each, START_SLACK, one);
        if (one->most.count > result->most.count) *result = *one;
    }
    const uint32_t rest = tries - climbs * each;
    climb(kind, rest / 2, START_SLACK, result);
    climb(kind, rest / 2, 0, result);
}
