/* SPDX-License-Identifier: MIT
 * Lead of the positions: from the file, or measured.
 *
 * The measured lead is the mean time from a position to the effect in the axis of the value
 * computed from it:
 *
 *   lead = exchange + update + period / 2 + handshake
 *
 * and for a PLC that moves to each value in a straight line (plc.interpolate_ms)
 *
 *   lead = exchange + update / 2 + (period + line) / 2 + handshake
 *
 * exchange: from the read request to the PLC's confirmation of the write, with fc23 to that of the
 * next request. update: the PLC's own cycle, from the rate of its heartbeat; a position waits for
 * half of one in the PLC, and so does the value. period / 2: a value is in force for a whole
 * period, and is right in the middle of it. line / 2: in the middle of its line the PLC is half way
 * to the value; the line's first step comes in the scan that sees the value, as if the value had
 * not waited, hence half an update less. handshake: delay of a PLC that passes values to its NC by
 * handshake (cb_profile_lead_us), else 0.
 *
 * The whole exchange is counted, although only a part belongs to the lead. Over TCP the PLC
 * evaluates a request, and takes over a write, at some time between its arrival and its reply: on
 * average half of each exchange, 4 to 6 ms, is too much. On a serial line the excess is the read
 * request and the write's reply, eight characters each. It is not subtracted, because this time
 * within an exchange is not measurable. The delay behind the PLC's register is as long and is
 * missing, because an NC without a handshake does not report it (docs/results/lead.md: the best
 * lead there is 2 ms more than the measured one). If both are known, set lead_ms in the file. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_LEAD_H
#define COMPBOX_FIRMWARE_SIGNALS_LEAD_H

#include <stdint.h>

struct cb_config;

enum { CB_MAX_LEAD_US = 500000 };

struct cb_lead_state {
    uint32_t exchange_us; /* filtered; 0: no write was confirmed yet */
    uint32_t update_us;   /* filtered; 0: not known yet */
    uint32_t beats;       /* of the PLC's heartbeat, in the current window of about a second */
    uint32_t window_us;   /* length of that window so far */
};

/* in : exchange_us of the newest confirmed write, 0: none */
void cb_lead_take_exchange(struct cb_lead_state *state, uint32_t exchange_us);

/* A window in which the heartbeat stood for a part counts at most as twice the update, so it moves
 * the estimate by an eighth. A PLC that is slower now is followed by an eighth a second.
 * in : increments of the PLC's heartbeat between two readings, which are elapsed_us > 0 apart */
void cb_lead_take_heartbeat(struct cb_lead_state *state, uint16_t beats, int64_t elapsed_us);

/* Begins a new window: the heartbeat stands, which is no measurement of the PLC's cycle. */
void cb_lead_lose_heartbeat(struct cb_lead_state *state);

/* Time between the positions of two readings. Each beat is a new position, so the result is the
 * number of beats times the mean time between beats: with a PLC that updates every 8 ms, readings
 * 30 ms apart have positions 24 or 32 ms apart.
 * in : beats between the readings; elapsed_us between them
 * out: 0: no new position; elapsed_us where the count is unknown or implausible: more than an
 *      update off, or an update takes more than three times elapsed_us */
float cb_lead_apart_us(const struct cb_lead_state *state, uint16_t beats, uint32_t elapsed_us);

/* out: the lead in use, 0 … CB_MAX_LEAD_US */
uint32_t cb_lead_us(const struct cb_config *config, const struct cb_lead_state *state);

#endif
