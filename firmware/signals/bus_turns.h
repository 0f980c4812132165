/* SPDX-License-Identifier: MIT
 * Schedule of a slow bus of the box (Pt100 modules): each module has its interval, and one request
 * is pending at a time. No I/O, no clock: the owner of the line takes the next request, sends it,
 * and reports its result.
 *
 * Adjacent registers of one module's signals are one request. Registers without a signal are never
 * read, because modules refuse unknown registers. A module that does not reply is polled less and
 * less often, so that it costs the others little time. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_BUS_TURNS_H
#define COMPBOX_FIRMWARE_SIGNALS_BUS_TURNS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/base/io.h"
#include "firmware/base/limits.h"
#include "firmware/wire/modbus.h"

struct cb_config;

enum { CB_BUS_BACKOFF_MAX = 5 }; /* a silent module is polled every 2^5 = 32 turns */

/* One request to one module. */
struct cb_bus_turn {
    int64_t due_us;
    uint16_t start, count;
    uint8_t unit;
    uint8_t silent; /* consecutive turns without a reply, at most CB_BUS_BACKOFF_MAX */
};

struct cb_bus_turns {
    uint8_t bus; /* index in config.buses */
    uint8_t count;
    uint8_t current; /* the last turn returned */
    bool awaits;     /* it has no reply so far */
    uint32_t every_us;
    int64_t requested_us;
    struct cb_bus_turn turns[CB_MAX_SIGNALS];
};
_Static_assert(CB_MAX_SIGNALS <= 255, "a turn for each signal at most, counted in uint8_t");

/* in : bus < config->buses_count
 * out: the turns of all its signals, the first due at now_us */
void cb_bus_turns_start(struct cb_bus_turns *turns, const struct cb_config *config, uint8_t bus,
                        int64_t now_us);

/* The line was away: each turn is due at now_us. */
void cb_bus_turns_line_is_back(struct cb_bus_turns *turns, int64_t now_us);

/* The line was gone at the last request, or in its wait: that says nothing about the module. */
void cb_bus_turns_unasked(struct cb_bus_turns *turns);

/* in : no request is pending
 * out: true: the request to send now; false: no turn is due
 * The turn counts as silent until cb_bus_turns_take() or cb_bus_turns_refused(). Behind a turn
 * without a reply its module is left alone for its interval, because a late reply looks like that
 * to another request. */
bool cb_bus_turns_next(struct cb_bus_turns *turns, int64_t now_us, uint8_t *unit,
                       struct cb_modbus_request *request);

/* Takes the reply to the current turn.
 * in : registers of the request; samples[max]
 * out: number of samples; their time is that of the request, the earliest possible time of the
 *      numbers */
size_t cb_bus_turns_take(struct cb_bus_turns *turns, const struct cb_config *config,
                         const uint16_t *registers, struct cb_sample *samples, size_t max);

/* The module replied to the current turn with an exception, so it is alive. */
void cb_bus_turns_refused(struct cb_bus_turns *turns);

#endif
