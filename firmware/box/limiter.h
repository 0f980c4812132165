/* SPDX-License-Identifier: MIT
 * The last stage: every output passes here, whatever the mode, the file and the faults.
 *
 * It knows what the PLC may hold. After a write that got no answer that is not one value but
 * several; the next output is chosen so that it is within every limit from each of them. The rules
 * and why they hold: limiter.c. */
#ifndef COMPBOX_FIRMWARE_BOX_LIMITER_H
#define COMPBOX_FIRMWARE_BOX_LIMITER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/base/io.h"
#include "firmware/config/config.h"

/* One output. All values are in µm on the grid of the register: whole multiples of its unit. */
struct cb_channel_state {
    float wanted_um; /* -sum of outputs, before limits and grid */
    float output_um; /* what the registers say */
    float carry_um;  /* progress towards the next grid value: |carry| < one unit */
    float possible_min_um, possible_max_um; /* the PLC holds a value in this interval */
    float late_min_um, late_max_um;   /* writes without an answer: each may still take effect … */
    float older_min_um, older_max_um; /* … and those of the turn before; min > max: none … */
    uint32_t late_us; /* … for so long that the PLC lives, from the newest of them; 0: none */
    uint32_t turn_us; /* … or for this turn and the next, while the PLC serves requests */
    float sent_um;    /* last output that was handed to a write; finite */
    float applied_um; /* of a channel with applied: the newest finite value that the PLC reported */
    uint32_t limited, excessive; /* steps with a demand beyond limit_um; … beyond error_um */
};

/* How far outputs may move in one step. */
struct cb_motion {
    float elapsed_s;     /* since the step before; 0 … 2 periods */
    float max_s;         /* 2 periods */
    float ramp_um_per_s; /* > 0: outputs move at this rate where it is below their slew rate; 0:
                            slew */
    bool writing; /* the output will be written; false: the PLC is out of reach, no interval */
};

/* How long a write without an answer may still take effect after a later one was confirmed: its
 * bytes may wait in the PLC behind a new connection. A PLC that lives serves what waits in one turn
 * of its program, which heartbeat_timeout_ms bounds; two periods pass until both ends know of it.
 * Where the program is not seen running, the PLC has to serve requests for twice this time. */
uint32_t cb_limiter_late_us(const struct cb_config *config);

/* Takes note of how the write of all outputs of the step before ended.
 * in : elapsed_us: since the step before, 0 … 2 periods; alive: the PLC's heartbeat was, then */
void cb_limiter_written(const struct cb_config *config, struct cb_channel_state *channels,
                        enum cb_transfer result, uint32_t elapsed_us, bool alive);

/* in : target_um[channels]: any floats; NaN counts as 0
 * out: every output moved towards its target: |output| <= limit, pairs within their difference,
 *      change within slew * elapsed from the last output and slew * 2 periods from all that the
 *      PLC may hold (plus one unit of the register where a step is less than that); where the
 *      control has a largest step (step_um), not further than that from what is applied */
void cb_limiter_step(const struct cb_config *config, struct cb_channel_state *channels,
                     struct cb_counters *counters, const float *target_um,
                     const struct cb_motion *motion);

/* Where an output goes on from. */
struct cb_start {
    float um;     /* finite */
    bool certain; /* the PLC holds or applies it; false: what it may hold stays as it was */
};

/* Puts the outputs where the PLC is: start[channels]. What may be the box's own value is taken as
 * it is, also where another file's limits were wider: it comes inside at the slew rate. Anything
 * else is forced into the limits of value and pairs. */
void cb_limiter_place(const struct cb_config *config, struct cb_channel_state *channels,
                      const struct cb_start *start);

#endif
