/* SPDX-License-Identifier: MIT
 * Whose turn it is on a slow bus of the box (Pt100 modules): every module in its time, one after
 * the other. No I/O, no clock: the owner of the line asks for the next request, sends it, and tells
 * how it ended.
 *
 * Signals of one module whose registers lie side by side are one request; registers that no signal
 * names are never read, because modules refuse what they do not have. A module that does not answer
 * is asked less and less often, so that it costs the others little of their time. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_BUS_TURNS_H
#define COMPBOX_FIRMWARE_SIGNALS_BUS_TURNS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/base/io.h"
#include "firmware/config/config.h"
#include "firmware/wire/modbus.h"

enum { CB_BUS_BACKOFF_MAX = 5 }; /* a silent module is asked every 2^5 = 32 turns */

/* One request to one module. */
struct cb_bus_turn {
    int64_t due_us;
    uint16_t start, count;
    uint8_t unit;
    uint8_t silent; /* turns in a row without an answer, at most CB_BUS_BACKOFF_MAX */
};

struct cb_bus_turns {
    uint8_t bus; /* index in config.buses */
    uint8_t count;
    uint8_t current; /* the turn that was given out last */
    uint32_t every_us;
    int64_t asked_us;
    struct cb_bus_turn turns[CB_MAX_SIGNALS];
};
_Static_assert(CB_MAX_SIGNALS <= 255, "a turn for each signal at most, counted in uint8_t");

/* in : bus < config->buses_count
 * out: the turns of all its signals, the first due at now_us */
void cb_bus_turns_start(struct cb_bus_turns *turns, const struct cb_config *config, uint8_t bus,
                        int64_t now_us);

/* out: true: the request to send now; false: nobody is due yet
 * The turn counts as silent until cb_bus_turns_take() or cb_bus_turns_refused(). */
bool cb_bus_turns_next(struct cb_bus_turns *turns, int64_t now_us, uint8_t *unit,
                       struct cb_modbus_request *request);

/* The current turn was answered.
 * in : registers of the request; samples[max]
 * out: how many samples; their time is that of asking, the earliest that the numbers can have */
size_t cb_bus_turns_take(struct cb_bus_turns *turns, const struct cb_config *config,
                         const uint16_t *registers, struct cb_sample *samples, size_t max);

/* The current turn was answered by an exception: the module lives. */
void cb_bus_turns_refused(struct cb_bus_turns *turns);

#endif
