/* SPDX-License-Identifier: MIT
 * The box: one call per cycle, without access to hardware (docs/DESIGN.md §4).
 *
 *     plc -> signals -> terms -> mode -> channels -> limiter -> registers
 *
 * After every step, for any file, inputs and faults:
 *  - |output| <= limit, and finite
 *  - |output - any value that the PLC may hold| <= slew * min(elapsed, 2 periods), plus one unit of
 *    the register if a step is less than that
 *  - |difference of a pair| <= its maximum
 *  - no output depends on a signal older than its maximum age. */
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
#include "firmware/box/probes.h"
#include "firmware/box/tangent.h"
#include "firmware/config/config.h"
#include "firmware/signals/bank.h"
#include "firmware/signals/lead.h"
#include "firmware/signals/sensors.h"
#include "firmware/signals/signals.h"
#include "firmware/terms/sigma.h"
#include "firmware/terms/terms.h"

enum {
    CB_CLOCK_PERIODS = 5,      /* after a longer gap between steps every input is stale */
    CB_STEP_PERIODS = 2,       /* longest time for which one step moves an output */
    CB_OVERRUN_FAULT = 16,     /* score that is a fault: +1 for a cycle with missed ticks, */
    CB_OVERRUN_FORGIVES = 32,  /* -1 for this number of cycles in time */
    CB_CONFIG_PASS_STEPS = 800 /* maximum steps of one check sum over the whole configuration */
};

/* A register of the write block whose value is not the one that was sent. */
struct cb_foreign_register {
    uint8_t channel; /* its index; CB_NONE: there is none */
    float value_um;  /* value of the register */
    float sent_um;   /* value that was sent */
};

/* State that a reload keeps unchanged (cb_box_adopt). */
struct cb_box_life {
    int64_t now_us; /* of the last step */
    struct cb_lead_state lead;
    uint16_t box_heartbeat; /* of the last step */
    uint16_t block_counter; /* of the write block's first and last register */
    uint8_t overrun_score;  /* leaky count of cycles with missed ticks */
    uint8_t good_cycles;    /* successive cycles in time, 0 … CB_OVERRUN_FORGIVES - 1 */
    uint8_t sent_mode;      /* enum cb_mode in the last registers handed to a write */
    bool started;           /* a step was made */
    bool writing;           /* the last outputs were handed to a write */
    bool wrote;             /* any outputs were */
    bool zero_written;   /* the PLC confirmed outputs that are all zero, no late write has others,
                            and no others were handed to a write since; or none ever were */
    bool stop_confirmed; /* the PLC confirmed status STOPPED */
    bool stopped_before; /* the previous run ended STOPPED, by the target's stored state */
};

/* Do not write to the configuration while the box runs. Each step checks the parts that it uses,
 * and 64 bytes of a sum over all of its memory, padding included. After copying a box, call
 * cb_box_start() on the copy. */
struct cb_box {
    struct cb_config config;
    struct cb_mode_state mode;
    struct cb_counters counters;
    struct cb_plc_state plc;
    struct cb_box_life life;
    struct cb_signal_state signals[CB_MAX_SIGNALS];
    struct cb_sensors_state sensors;
    struct cb_bank_state bank; /* lags of all banks */
    struct cb_term_state terms[CB_MAX_TERMS];
    struct cb_sigma_state sigma;                 /* of terms with a bank */
    struct cb_probe_state probes[CB_MAX_ADAPTS]; /* by the order of config.adapts */
    float outputs[CB_MAX_OUTPUTS];               /* term outputs of the last step, µm or µrad */
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

/* out: true if the parts of the configuration that a step or an exchange uses are as at the start
 * A target calls it before it takes an address or a length from box->config. */
bool cb_box_is_sound(const struct cb_box *box);

/* One cycle.
 * in : now_us, of a monotonic clock that counts suspend, the same clock for all times in *in
 * out: *out, except registers and channels beyond those of the configuration. Write to the PLC only
 *      if out->write is true.
 * Accesses only its arguments; bounded time. If the configuration has changed in memory, the box
 * does not use it until cb_box_start(): FAULT, out->write and out->stopped false, the rest of *out
 * not set. */
void cb_box_step(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                 struct cb_outputs *out);

/* Read-back of the write block (FC3) that the box requests for the next step: after a reading that
 * succeeded, into in->held_registers. */
enum cb_want {
    CB_WANT_NOTHING,
    CB_WANT_IF_ROOM, /* to detect another client that writes: only if the exchange has time */
    CB_WANT_NOW,     /* the PLC's outputs are unknown: nothing is written before */
};
enum cb_want cb_box_wants_held(const struct cb_box *box);

/* As a step of a box that has been ACTIVE with constant inputs: outputs are at the wanted values
 * within their limits. For evaluation on the host; never on a machine. Steps may follow, with
 * in->last_write CB_TRANSFER_OK and a heartbeat that moves. */
void cb_box_settle(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                   struct cb_outputs *out);

/* Reload: a new configuration takes over from the old one while the machine runs.
 * in : fresh, loaded, after cb_box_start(); old, running
 * out: true: fresh continues with mode, PLC, counters, signals and outputs of old, by their names.
 *      No output steps; one beyond a new limit moves there at the slew rate.
 * out: false, fresh unchanged: an output that is not zero would step, because its register, type,
 *      scale or sign differs or its channel is missing (ramp to zero first); or the configuration
 *      of old has changed in memory. */
bool cb_box_adopt(struct cb_box *fresh, const struct cb_box *old);

/* out: longest time to ramp all outputs to zero, µs, if each cycle is on time and each write
 *      confirmed from now on: max(limit, |output|) of the slowest channel at the lower one of slew
 *      and ramp, with the part of the slew that its register cannot represent taken off. Writes
 *      without a reply may hold the outputs, or STOPPED, for two turns (limiter.c, "Arrival").
 * Add the time of a few exchanges for the confirmation. 0 if the configuration has changed in
 * memory: such a box writes nothing, and its limits are unknown. */
int64_t cb_box_stop_us(const struct cb_box *box);

/* out: true if a configuration with other limits or registers may take over: the PLC, readable and
 *      alive, has not set enable, and certainly holds zero everywhere. In FAULT, too: a file's own
 *      error_um may be what no reset ends */
bool cb_box_at_rest(const struct cb_box *box);

/* out: index in old's channels of the first output that would step in cb_box_adopt(); CB_NONE:
 *      there is none, or old is not sound */
unsigned cb_box_obstacle(const struct cb_config *fresh, const struct cb_box *old);

/* ---- for the files of the box ---- */

/* in : mode and reason of this step are set. out: the cause of the reason (cause.c) */
struct cb_cause cb_box_find_cause(const struct cb_box *box);

/* At the start: records the check sums of the configuration (check.c). */
void cb_box_take_sums(struct cb_box *box);

/* In each step. out: false, latched, if the configuration has changed since the start */
bool cb_box_check(struct cb_box *box);

#endif
