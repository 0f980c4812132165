/* SPDX-License-Identifier: MIT
 * The box: one call per cycle does everything and touches no hardware (docs/DESIGN.md §4).
 *
 *     plc -> signals -> terms -> mode -> channels -> limiter -> registers
 *
 * Whatever the file, the inputs and the faults, after every step:
 *   |output| <= limit;  |change against what the PLC may hold| <= slew * min(elapsed, 2 periods),
 *   plus one unit of the register where a step is less than that;
 *   |difference of a pair| <= its maximum;  no NaN leaves;
 *   no value is computed from a signal older than its maximum age. */
#ifndef COMPBOX_FIRMWARE_BOX_BOX_H
#define COMPBOX_FIRMWARE_BOX_BOX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/base/cause.h"
#include "firmware/base/counters.h"
#include "firmware/base/io.h"
#include "firmware/base/limits.h"
#include "firmware/box/applied.h"
#include "firmware/box/channels.h"
#include "firmware/box/mode.h"
#include "firmware/box/plc.h"
#include "firmware/box/tangent.h"
#include "firmware/config/config.h"
#include "firmware/signals/lead.h"
#include "firmware/signals/signals.h"
#include "firmware/terms/terms.h"

enum {
    CB_CLOCK_PERIODS = 5,      /* a longer gap between steps makes every input stale */
    CB_STEP_PERIODS = 2,       /* no step moves further than in this time */
    CB_OVERRUN_FAULT = 16,     /* score at which overruns are a fault: +1 for a cycle with missed */
    CB_OVERRUN_FORGIVES = 32,  /* ticks, -1 for so many cycles in time */
    CB_CONFIG_PASS_STEPS = 800 /* at most: for one sum over the whole configuration, in slices */
};

/* A register of the write block that holds something else than was written. */
struct cb_foreign_register {
    uint8_t channel; /* its index; CB_NONE: there is none */
    float value_um;  /* what the register stands for … */
    float sent_um;   /* … and what was sent there */
};

/* What goes on unchanged when a new configuration takes over (cb_box_adopt). */
struct cb_box_life {
    int64_t now_us; /* of the last step */
    struct cb_lead_state lead;
    uint16_t box_heartbeat; /* of the last step */
    uint16_t block_counter; /* of the write block's first and last register */
    uint8_t overrun_score;  /* leaky count of cycles with missed ticks */
    uint8_t good_cycles;    /* … and of cycles in time towards forgiving one */
    uint8_t sent_mode;      /* enum cb_mode in the last registers handed to a write */
    bool started;           /* a step was made */
    bool writing;           /* the last outputs were for writing */
    bool wrote;             /* … and ever any were */
    bool zero_written;      /* the PLC confirmed outputs that are all zero, no others
                               were handed to a write since; or none ever were */
    bool stop_confirmed;    /* the PLC confirmed status STOPPED */
    bool stopped_before;    /* the run before ended STOPPED, as the target knows from its memory */
};

/* The configuration must not be written to while the box runs: each step checks what it uses of it,
 * and 64 bytes of a sum over all of its memory, padding included. After copying a box, call
 * cb_box_start() on the copy. */
struct cb_box {
    struct cb_config config;
    struct cb_mode_state mode;
    struct cb_counters counters;
    struct cb_plc_state plc;
    struct cb_box_life life;
    struct cb_signal_state signals[CB_MAX_SIGNALS];
    struct cb_term_state terms[CB_MAX_TERMS];
    float outputs[CB_MAX_OUTPUTS]; /* term outputs of the last step, µm or µrad */
    struct cb_channel_state channels[CB_MAX_CHANNELS];
    struct cb_tangent_state tangent;
    struct cb_applied_state applied;
    struct cb_cause cause;              /* behind mode.reason; of a fault that of its first step */
    uint32_t config_sum;                /* cb_memory_check() of config, at start */
    uint32_t head_sum;                  /* what each step checks of it, at start: the front … */
    uint32_t used_sum;                  /* … and the entries in use behind it */
    uint32_t sum_so_far;                /* running check, a slice each step … */
    uint32_t words_checked;             /* … and how far it is */
    struct cb_foreign_register foreign; /* found by the last read-back */
    bool config_corrupt; /* the configuration has changed: nothing is written any more */
};
_Static_assert(offsetof(struct cb_box, config) == 0, "cb_box_start() clears all behind config");
_Static_assert(sizeof(struct cb_box) < 64 * 1024, "the box with its configuration");

/* in : box->config loaded
 * out: everything else as after power-on: STANDBY, outputs zero. Takes the check sum of the whole
 *      configuration. */
void cb_box_start(struct cb_box *box);

/* true: what a step or an exchange with the PLC uses of the configuration is as at the start.
 * Before a target takes an address or a length from box->config it asks this. */
bool cb_box_is_sound(const struct cb_box *box);

/* One cycle. now_us: any monotonic clock that counts suspend, the same for all times in *in.
 * Reads and writes only its arguments; bounded time. Of *out all is set but what lies behind the
 * write block and the channels of the configuration.
 * Nothing may be written to the PLC where out->write is false.
 * A configuration that has changed in memory is used no more, from this step on and until
 * cb_box_start(): FAULT, out->write and out->stopped false, and nothing else of *out is set. */
void cb_box_step(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                 struct cb_outputs *out);

/* Whether the cycle before a step reads the write block back (FC3), after a reading that succeeded,
 * and hands it over in in->held_registers. */
enum cb_want {
    CB_WANT_NOTHING,
    CB_WANT_IF_ROOM, /* to see whether another client writes there: where the exchange has time */
    CB_WANT_NOW,     /* the box does not know what the PLC holds, and writes nothing before */
};
enum cb_want cb_box_wants_held(const struct cb_box *box);

/* Like a step of a box that has been ACTIVE on these inputs for ever: outputs are at the wanted
 * values within their limits. For evaluation on the host; never on a machine. Steps may follow it,
 * with in->last_write CB_TRANSFER_OK and a heartbeat that moves. */
void cb_box_settle(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                   struct cb_outputs *out);

/* Reload: a new configuration takes over from the old one while the machine runs.
 * in : fresh: its configuration loaded and cb_box_start() called; old: running, unchanged
 * out: true: fresh goes on where old is: mode, PLC, counters, signals and outputs by their names.
 *      Nothing steps; outputs beyond a new limit go there at the slew rate.
 *      false, fresh untouched: outputs that are not zero would step, because they lie in other
 *      registers, or have another type, scale or sign, or are gone. Ramp to zero first. Or old's
 *      configuration has changed in memory. */
bool cb_box_adopt(struct cb_box *fresh, const struct cb_box *old);

/* How long the way of all outputs to zero takes: for the slowest channel max(limit, |output|) by
 * the lower one of slew and ramp. Add the time of a few exchanges for the confirmation. */
int64_t cb_box_stop_us(const struct cb_box *box);

/* true: a configuration with other limits or registers may come: STANDBY because the PLC, which
 * answers and lives, has not set enable, and every output is zero in all that the PLC may hold. */
bool cb_box_at_rest(const struct cb_box *box);

/* Why cb_box_adopt() would be false: index in old's channels of the first one that would step;
 * CB_NONE: none would, or old is not sound. */
unsigned cb_box_obstacle(const struct cb_config *fresh, const struct cb_box *old);

/* in : a step whose mode and reason are made. out: the cause of that reason (cause.c) */
struct cb_cause cb_box_find_cause(const struct cb_box *box);

/* Parts of a step and of a start (check.c). out: false, latched: the configuration has changed
 */
bool cb_box_check(struct cb_box *box);
void cb_box_take_sums(struct cb_box *box);

#endif
