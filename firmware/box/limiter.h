/* SPDX-License-Identifier: MIT
 * The last stage. Every output passes it, in every mode.
 *
 * It tracks the values that the PLC may hold. After a write without a reply these are several
 * values, and the next output is within the slew rate of each of them. limiter.c has the rules and
 * their proofs. */
#ifndef COMPBOX_FIRMWARE_BOX_LIMITER_H
#define COMPBOX_FIRMWARE_BOX_LIMITER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/base/io.h"

struct cb_config;

/* One output. All values are in µm on the grid of the register: whole multiples of its unit. */
struct cb_channel_state {
    float wanted_um; /* -sum of outputs, before limits and grid */
    float output_um; /* value of the registers */
    float carry_um;  /* progress towards the next grid value: |carry| < one unit */
    float possible_min_um, possible_max_um; /* the PLC holds a value in this interval */
    float late_min_um, late_max_um; /* values of writes without a reply: each may take effect … */
    float older_min_um, older_max_um; /* … and those of the previous turn; min > max: none */
    uint32_t late_us; /* … within this time in which the PLC is alive; 0: there are none */
    uint32_t turn_us; /* … or in this turn and the next, while the PLC serves requests */
    float sent_um;    /* last output that was handed to a write; finite */
    float applied_um; /* of a channel with applied: the newest finite value that the PLC reported */
    uint32_t limited, excessive; /* steps with a demand beyond limit_um; … beyond error_um */
};

/* How far outputs may move in one step. */
struct cb_motion {
    float elapsed_s;     /* since the previous step; 0 … 2 periods */
    float max_s;         /* 2 periods */
    float ramp_um_per_s; /* > 0: upper bound of all rates; 0: the slew rates alone */
    bool writing;        /* the outputs will be written; false: the PLC is out of reach, its
                            possible values are ignored */
};

/* out: time for which a write without a reply may take effect after a later one was confirmed: its
 *      bytes may wait in the PLC on an old connection. A PLC that is alive serves waiting bytes
 *      within one turn of its program, which heartbeat_timeout_ms bounds; two periods are added for
 *      the exchange. If the program is not seen running, the PLC has to serve requests for twice
 *      this time. */
uint32_t cb_limiter_late_us(const struct cb_config *config);

/* Updates the possible values by the result of the last write.
 * in : elapsed_us since the previous step, 0 … 2 periods; alive: the PLC's heartbeat was alive */
void cb_limiter_written(const struct cb_config *config, struct cb_channel_state *channels,
                        enum cb_transfer result, uint32_t elapsed_us, bool alive);

/* in : target_um[channels], any floats; NaN counts as 0
 * out: every output moved towards its target: |output| <= limit, pairs within their difference,
 *      change within slew * elapsed from the last output and slew * 2 periods from all possible
 *      values (plus one unit of the register if a step is less than that); if the control has a
 *      largest step (step_um), at most that far from the applied value */
void cb_limiter_step(const struct cb_config *config, struct cb_channel_state *channels,
                     struct cb_counters *counters, const float *target_um,
                     const struct cb_motion *motion);

/* Start value of an output. */
struct cb_start {
    float um;     /* finite */
    bool certain; /* the PLC holds or applies it; false: the possible values stay as they were */
};

/* Sets the outputs to the PLC's values. in: start[channels] A value that the box itself may have
 * written is kept, even outside of the present limits: it moves inside at the slew rate. Any other
 * value is forced into the limits of channels and pairs; so is a pair of which another client wrote
 * one value, so that only their difference is not the box's. */
void cb_limiter_place(const struct cb_config *config, struct cb_channel_state *channels,
                      const struct cb_start *start);

#endif
