/* SPDX-License-Identifier: MIT */
#include "firmware/signals/bus_turns.h"

#include "firmware/base/assert.h"
#include "firmware/config/config.h"
#include "firmware/wire/number.h"

enum { MOST_REGISTERS = 125 };

static bool is_on(const struct cb_signal_config *signal, uint8_t bus) {
    return signal->source == CB_SOURCE_BUS && signal->bus == bus;
}

/* out: the register behind the signal's last one, at most 65 537 */
static uint32_t end_of(const struct cb_signal_config *signal) {
    return signal->reg + cb_number_registers((enum cb_number_type)signal->type);
}

/* out: whether signal a comes before b, by unit, then first register, then last */
static bool is_before(const struct cb_signal_config *a, const struct cb_signal_config *b) {
    if (a->bus_unit != b->bus_unit) return a->bus_unit < b->bus_unit;
    return a->reg != b->reg ? a->reg < b->reg : end_of(a) < end_of(b);
}

/* First signal of the bus behind `after` (NULL: of all), by unit and registers. Of equal ones only
 * the first counts, because they are read together. */
static const struct cb_signal_config *next_signal(const struct cb_config *config, uint8_t bus,
                                                  const struct cb_signal_config *after) {
    const struct cb_signal_config *next = 0;
    for (unsigned i = 0; i < config->signals_count; ++i) {
        const struct cb_signal_config *signal = &config->signals[i];
        if (!is_on(signal, bus) || (after && !is_before(after, signal))) continue;
        if (!next || is_before(signal, next)) next = signal;
    }
    return next;
}

/* in : a signal at or behind the turn's start
 * out: true if the turn can read it too; the turn is then extended to it */
static bool joins(struct cb_bus_turn *turn, const struct cb_signal_config *signal) {
    const uint32_t end = (uint32_t)turn->start + turn->count, wanted = end_of(signal);
    if (turn->unit != signal->bus_unit || signal->reg > end) return false;
    if (wanted > (uint32_t)turn->start + MOST_REGISTERS) return false;
    if (wanted > end) turn->count = (uint16_t)(wanted - turn->start);
    return true;
}

void cb_bus_turns_start(struct cb_bus_turns *turns, const struct cb_config *config, uint8_t bus,
                        int64_t now_us) {
    const struct cb_signal_config *signal = 0;
    CB_ASSERT(bus < config->buses_count);
    *turns = (struct cb_bus_turns){.bus = bus, .every_us = config->buses[bus].every_us};
    while ((signal = next_signal(config, bus, signal)) != 0) {
        if (turns->count > 0 && joins(&turns->turns[turns->count - 1], signal)) continue;
        turns->turns[turns->count++] =
            (struct cb_bus_turn){.due_us = now_us,
                                 .start = signal->reg,
                                 .count = (uint16_t)(end_of(signal) - signal->reg),
                                 .unit = signal->bus_unit};
    }
    turns->current = (uint8_t)(turns->count > 0 ? turns->count - 1 : 0);
}

void cb_bus_turns_line_is_back(struct cb_bus_turns *turns, int64_t now_us) {
    for (unsigned i = 0; i < turns->count; ++i) turns->turns[i].due_us = now_us;
    turns->awaits = false;
}

void cb_bus_turns_unasked(struct cb_bus_turns *turns) {
    struct cb_bus_turn *turn = &turns->turns[turns->current];
    turns->awaits = false;
    if (turn->silent > 0) --turn->silent;
}

/* Ends the wait for the last reply, which may still come. */
static void leave_alone(struct cb_bus_turns *turns, int64_t now_us) {
    const uint8_t unit = turns->turns[turns->current].unit;
    const int64_t until_us = now_us + turns->every_us;
    for (unsigned i = 0; i < turns->count; ++i) {
        struct cb_bus_turn *turn = &turns->turns[i];
        if (turn->unit == unit && turn->due_us < until_us) turn->due_us = until_us;
    }
    turns->awaits = false;
}

bool cb_bus_turns_next(struct cb_bus_turns *turns, int64_t now_us, uint8_t *unit,
                       struct cb_modbus_request *request) {
    if (turns->awaits) leave_alone(turns, now_us);
    for (unsigned i = 1; i <= turns->count; ++i) {
        const uint8_t index = (uint8_t)((turns->current + i) % turns->count);
        struct cb_bus_turn *turn = &turns->turns[index];
        if (turn->due_us > now_us) continue;
        turns->current = index;
        turns->awaits = true;
        turns->requested_us = now_us;
        turn->due_us = now_us + ((int64_t)turns->every_us << turn->silent);
        if (turn->silent < CB_BUS_BACKOFF_MAX) ++turn->silent;
        *unit = turn->unit;
        *request = cb_modbus_read(turn->start, turn->count);
        return true;
    }
    return false;
}

void cb_bus_turns_refused(struct cb_bus_turns *turns) {
    struct cb_bus_turn *turn = &turns->turns[turns->current];
    turns->awaits = false;
    turn->silent = 0;
    turn->due_us = turns->requested_us + turns->every_us;
}

static bool is_of(const struct cb_bus_turn *turn, const struct cb_signal_config *signal) {
    return turn->unit == signal->bus_unit && signal->reg >= turn->start &&
           end_of(signal) <= (uint32_t)turn->start + turn->count;
}

size_t cb_bus_turns_take(struct cb_bus_turns *turns, const struct cb_config *config,
                         const uint16_t *registers, struct cb_sample *samples, size_t max) {
    const struct cb_bus_turn *turn = &turns->turns[turns->current];
    size_t count = 0;
    CB_ASSERT(turns->current < turns->count);
    cb_bus_turns_refused(turns); /* the module is alive */
    for (unsigned i = 0; i < config->signals_count && count < max; ++i) {
        const struct cb_signal_config *signal = &config->signals[i];
        if (!is_on(signal, turns->bus) || !is_of(turn, signal)) continue;
        const uint16_t *at = registers + (signal->reg - turn->start);
        samples[count++] =
            (struct cb_sample){.signal = (uint8_t)i,
                               .raw = cb_number_decode((enum cb_number_type)signal->type, at),
                               .time_us = turns->requested_us};
    }
    return count;
}
