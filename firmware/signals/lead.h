/* SPDX-License-Identifier: MIT
 * How far ahead positions are evaluated: as the file says, or measured.
 *
 * Measured, it is the mean time from a position to the value made from it standing in the axis:
 *
 *   lead = exchange + update + period / 2 + handshake
 *
 * and where the PLC goes to each value in a straight line (plc.interpolate_ms)
 *
 *   lead = exchange + update / 2 + (period + line) / 2 + handshake
 *
 * exchange: from asking for the reading to the PLC's confirmation of the write, with fc23 to that
 * of the next request. update: the PLC's own cycle, from how fast its heartbeat counts; a position
 * waits for half of one in the PLC, and so does the value. period / 2: a value stands for a whole
 * period, and is right in the middle of it. line / 2: in the middle of its line the PLC is half way
 * to the value; the line's first step comes in the scan that sees the value, as if the value had
 * not waited for it, hence half an update less. handshake: what a PLC adds that hands values to its
 * NC by handshake (cb_profile_lead_us), else 0.
 *
 * The exchange is counted end to end, which is more than belongs to the lead. Over TCP the PLC
 * looks at a request, and takes a write over, somewhere between its arrival and its answer: half of
 * each exchange on average, 4 to 6 ms, is too much. On a serial line it is the reading's request
 * and the write's answer, eight characters each. It is not taken off, because nothing measures
 * where in an exchange the PLC looks, and because the way behind the PLC's register, which an NC
 * without a handshake does not tell either, is as long and missing (docs/results/lead.md: the best
 * lead there is 2 ms more than the measured one). Who knows both sets lead_ms by hand.
 */
#ifndef COMPBOX_FIRMWARE_SIGNALS_LEAD_H
#define COMPBOX_FIRMWARE_SIGNALS_LEAD_H

#include <stdint.h>

#include "firmware/config/config.h"

enum { CB_MAX_LEAD_US = 500000 };

struct cb_lead_state {
    uint32_t exchange_us; /* filtered; 0: no write was confirmed yet */
    uint32_t update_us;   /* filtered; 0: not known yet */
    uint32_t beats;       /* of the PLC's heartbeat, in the window of about a second … */
    uint32_t window_us;   /* … that is this long so far */
};

/* in : exchange_us of the newest confirmed write, 0: none was */
void cb_lead_take_exchange(struct cb_lead_state *state, uint32_t exchange_us);

/* in : what the PLC's heartbeat counted between two readings, elapsed_us > 0 apart */
void cb_lead_take_heartbeat(struct cb_lead_state *state, uint16_t beats, int64_t elapsed_us);

/* How far apart in time the positions of two readings are. Each beat is a new position, so it is
 * what the heartbeat counted, times the mean time between two beats: a PLC that updates every 8 ms
 * shows in readings 30 ms apart positions that are 24 or 32 ms apart.
 * in : beats between the readings; elapsed_us between them
 * out: 0: there was no new position; elapsed_us where the count is not known or cannot be one of
 *      positions: more than an update off, or an update takes more than three times elapsed_us */
float cb_lead_apart_us(const struct cb_lead_state *state, uint16_t beats, uint32_t elapsed_us);

/* out: the lead in use, 0 … CB_MAX_LEAD_US */
uint32_t cb_lead_us(const struct cb_config *config, const struct cb_lead_state *state);

#endif
