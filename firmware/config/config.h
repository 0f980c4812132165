/* SPDX-License-Identifier: MIT
 * The coefficient file in the box's memory: plain data of fixed size, made by load/load.h and never
 * changed afterwards (the box verifies its check sum at run time).
 *
 * References are indices, coefficients are offsets into one pool, so that the whole may be copied
 * or placed anywhere. CB_NONE marks an absent index. */
#ifndef COMPBOX_FIRMWARE_CONFIG_CONFIG_H
#define COMPBOX_FIRMWARE_CONFIG_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/limits.h"
#include "firmware/wire/number.h"
#include "firmware/wire/rtu_line.h"

enum cb_signal_source {
    CB_SOURCE_PLC, /* registers of the PLC's read block */
    CB_SOURCE_CAN, /* raw CAN frame, by identifier */
    CB_SOURCE_BUS, /* register of a module on a slow bus of the box (Pt100) */
    CB_SOURCE_LAG, /* first-order lag of another signal: computed, on every target */
};

#define CB_CAN_EXTENDED 0x80000000u /* set in a CAN identifier of 29 bits */
#define CB_CAN_ID_BITS 0x1FFFFFFFu
#define CB_CAN_ANY_SOURCE 0x40000000u /* … whose last eight bits may be any (J1939) */

/* value = raw * scale + zero, in the signal's unit (mm, degC, 1/min …). Each step checks the fields
 * from source on, except for lags (box/check.c). */
struct cb_signal_config {
    char name[CB_NAME_SIZE];
    char unit[8];
    uint32_t can_id;      /* CAN: identifier, with the flags above */
    float max_rate_per_s; /* plausible rate of change, unit/s; 0 = unlimited */
    float tau_s;          /* lag: time constant, > 0 */
    uint8_t lag_of;       /* lag: index of its signal */
    uint8_t power;        /* lag: 1 follows its signal, 2 the signal's square */
    uint8_t bus;          /* bus: its index */
    uint8_t bus_unit;     /* bus: Modbus unit id of the module */

    uint8_t source;   /* enum cb_signal_source */
    uint8_t type;     /* enum cb_number_type */
    bool essential;   /* its loss stops compensation (HOLD); default: unit is mm or deg */
    bool leads;       /* evaluated lead_ms ahead: a PLC position (unit mm or deg) */
    uint16_t reg;     /* PLC: index in the read block; bus: register address; CAN: byte offset */
    uint8_t velocity; /* of a leading one: index of its velocity, where velocity_scale > 0 */
    bool plain;       /* derived: a PLC signal that does not lead */
    float velocity_scale; /* unit/s of this signal per unit of its velocity; 0: from differences */
    float scale, zero;    /* finite; scale != 0 */
    float min, max;       /* plausible range of the value; min < max */
    uint32_t max_age_ms;  /* default: three periods for PLC signals, 2000 ms for sensors; a lag has
                             that of its signal, as well as min and max (squared for power 2) */
    /* derived (derive.h) */
    float rate_per_s;  /* max_rate_per_s, infinite where that is 0 */
    float change_unit; /* one raw unit of an integer, which a change may exceed its rate by */
};

/* A lag and its signal; derived, in the order of config->lags. */
struct cb_lag_link {
    uint8_t lag, of; /* indices of signals */
    bool squares;    /* the input is the square */
    uint8_t more;    /* number of lags after this one that share its time constant */
    float tau_s;
};

/* A curve of one signal. Pool layout: B-spline and polyline: breaks[spans+1], coefficients
 * [spans*(degree+1)]; polynomial: coefficients[degree+1]. With reversal_mm > 0 it is the branch for
 * a rising position, and branches[backward] is the branch for a falling one. */
struct cb_curve_config {
    uint8_t signal; /* index of its signal */
    uint8_t degree;
    uint16_t spans;                             /* polynomial: 1 */
    uint16_t pool;                              /* offset of the first float */
    uint8_t backward;                           /* index into branches, where reversal_mm > 0 */
    float spans_per_unit;                       /* see cb_ppoly */
    float center, inverse_half_range, from, to; /* polynomial only */
    float reversal_mm; /* distance of a reversal from one branch to the other; 0: no branches */
};

/* Signals that a term uses: config->links[link + i]. */
struct cb_term_inputs {
    uint16_t link;
    uint8_t count;
};

/* A weighted sum of signals. Pool: weights[inputs.count], constant. */
struct cb_linear_config {
    struct cb_term_inputs inputs;
    uint16_t pool;
};

/* Another term's output times (signal - origin). */
struct cb_product_config {
    uint8_t output; /* index into outputs: the slope */
    uint8_t signal;
    float origin; /* unit of the signal */
};

/* Pool: cb_bpnet_floats() weights; a cb_training_range of each input. */
struct cb_bpnet_config {
    struct cb_term_inputs inputs;
    uint8_t hidden;
    bool linear;
    uint16_t weights, ranges;
};

/* Pool: a struct cb_volumetric; constant tool length. */
struct cb_volumetric_config {
    uint8_t signals[4]; /* positions of X, Y, Z; tool length, or CB_NONE */
    bool complete;      /* no error is CB_NONE */
    uint8_t error[18];  /* outputs of the errors in the order of cb_volumetric_state; or CB_NONE */
    uint16_t pool;
};

/* A term comes after those whose outputs it uses, whatever their order in the file. */
struct cb_term_config {
    uint8_t type;         /* enum cb_term_type (terms/kinds.h) */
    uint8_t first_output; /* index into outputs; the term's outputs are consecutive */
    uint8_t outputs;      /* >= 1 */
    union {
        struct cb_curve_config curve;
        struct cb_linear_config linear;
        struct cb_product_config product;
        struct cb_bpnet_config bpnet;
        struct cb_volumetric_config volumetric;
    } as;
};

/* Terms of type B-spline or polyline without branches, which most are. Derived: terms with the same
 * signal, breaks and degree are adjacent and share a grid, so that one search finds the span for
 * all of them. */
struct cb_grid {
    uint8_t signal, degree;
    uint8_t curves;       /* number of its entries in config->plain_curves, after the previous
                             grid's */
    uint8_t term;         /* its first term, whose breaks are searched */
    float spans_per_unit; /* see cb_ppoly, as the next two */
    uint16_t spans;
    uint16_t breaks; /* offset in the pool */
};
struct cb_plain_curve {
    uint16_t coefficients; /* offset in the pool */
    uint8_t term, output;
};

struct cb_output_config {
    char name[CB_NAME_SIZE]; /* a one-output term's own name, or a name from its "outputs" */
    uint8_t term;
};

/* wanted_um = -sum of outputs; written = sign * wanted_um / scale, as `type`. */
struct cb_channel_config {
    char name[CB_NAME_SIZE];
    uint8_t sum[CB_MAX_SUM]; /* indices of outputs */
    uint8_t sum_count;       /* >= 1 */
    uint8_t type;            /* enum cb_number_type */
    int8_t sign;             /* +1 or -1: found by a sign test at commissioning */
    bool has_applied;        /* the PLC returns the applied value, same type, scale and sign; both
                                channels of a pair or none */
    bool is_slope;           /* not a channel of the file, but the slope of one, µm/m */
    bool tangent;            /* it has slope and reference besides its value */
    uint8_t slope;           /* tangent: index of the channel that is its slope */
    uint8_t tangent_signal;  /* tangent: index of its axis' position */
    uint8_t reference_type;  /* tangent: enum cb_number_type */
    uint16_t reference_reg;  /* tangent: index in the write block */
    float reference_scale;   /* tangent: mm per unit of that register; > 0 */
    uint16_t reg;            /* index in the write block */
    uint16_t applied_reg;    /* index in the read block */
    float limit_um;          /* > 0: |output| never exceeds it */
    float error_um;          /* >= limit: a demand beyond it is a FAULT */
    float slew_um_per_s;     /* > 0: |change| <= slew * min(elapsed, 2 periods) */
    float deadband_um;       /* >= 0: smaller changes are not written */
    float step_um;           /* > 0: maximum distance from the PLC's applied value */
    float scale;             /* µm per unit of the register; > 0 */
    /* derived (grid.h) */
    float unit_um; /* one unit of the register; 0 where it is as fine as float32 */
    float most_um; /* the limit, or just inside it */
    float top_um;  /* the largest value within the limit that the register can represent */
};

/* Two motors of one stage: maximum difference of their outputs. */
struct cb_pair_config {
    uint8_t a, b;            /* indices of channels, a != b */
    float max_difference_um; /* > 0 */
};

enum cb_profile { CB_PROFILE_GENERIC, CB_PROFILE_SINUMERIK_840D, CB_PROFILE_FANUC };
enum cb_exchange { CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23 };
enum cb_transport { CB_TRANSPORT_TCP, CB_TRANSPORT_RTU };
enum cb_tcp_client { CB_CLIENT_COMPBOX, CB_CLIENT_LIBMODBUS };

/* A block of holding registers, zero-based protocol address. With counters, its first and last
 * register carry the same number, incremented with every update; a block where they differ is
 * torn. */
struct cb_block_config {
    uint16_t start;
    uint16_t count;
    bool counters;
};

/* A slow bus of the box itself, whose modules are polled in turn. */
struct cb_bus_config {
    char name[CB_NAME_SIZE];
    struct cb_serial_config serial;
    uint32_t every_us; /* poll interval of each module */
};

struct cb_plc_config {
    uint8_t profile;   /* enum cb_profile */
    uint8_t exchange;  /* enum cb_exchange */
    uint8_t transport; /* enum cb_transport */
    uint8_t unit;      /* Modbus unit id */
    struct cb_block_config read, write;
    uint16_t control, plc_heartbeat; /* indices in the read block */
    uint16_t status, box_heartbeat;  /* indices in the write block */
    uint16_t detail;                 /* index in the write block, where has_detail */
    uint32_t heartbeat_timeout_ms;
    uint16_t referenced_mask; /* all of these control bits must be set; default bit 1 */
    uint16_t handshake;       /* index in the read block, where has_handshake */
    uint16_t step_units;      /* largest change between two updates of the NC; 0: any */
    bool has_detail;          /* the box reports the signal or channel behind its reason */
    bool has_handshake;       /* the PLC reports its handshake with the NC */
    bool axes_at_once;        /* with a handshake: one handshake takes all channels */
    uint32_t scan_us;         /* the PLC's scan; 0 where the profile has no handshake */
    float deadband_um;        /* the PLC delays smaller changes than this to the NC */
    uint32_t interpolate_us;  /* the PLC moves to each new value in a straight line over this time;
                                 0: at once; <= a period */
    /* connection to the PLC: used at start, by no step */
    char host[40]; /* TCP: numeric IPv4 or IPv6 address, no resolver in the loop */
    uint16_t port;
    uint8_t client;                 /* TCP: enum cb_tcp_client */
    struct cb_serial_config serial; /* RTU */
};

/* A supervised CANopen device: started, and its heartbeat watched. */
struct cb_can_node_config {
    uint8_t node;                  /* 1 … 127 */
    bool start;                    /* send it the start command (NMT) */
    uint32_t heartbeat_timeout_ms; /* its timeout; 0: not watched */
};

struct cb_can_config {
    char interface[16]; /* name of the network interface */
    uint8_t nodes_count;
    struct cb_can_node_config nodes[CB_MAX_CAN_NODES];
};

/* Each step first checks the part from the front to plc.host as a whole: numbers, counts and lists
 * of indices. Of the arrays behind it, a step checks the entries in use. */
struct cb_config {
    uint32_t period_us;          /* 1 000 … 1 000 000 */
    uint32_t lead_us;            /* 0 … 500 000 */
    uint32_t hold_us;            /* maximum time in HOLD */
    uint32_t applied_quarter_us; /* derived: cb_profile_quarter_us() */
    float ramp_um_per_s;         /* > 0 */
    float ceiling_um;   /* > 0: the site's limit of every output, whatever the file allows; 0:
                           none */
    bool lead_measured; /* the box measures the lead (lead.h); lead_us is 0 */
    uint8_t signals_count, terms_count, outputs_count, channels_count, pairs_count;
    uint8_t lags_count, branches_count, buses_count;
    uint8_t slopes_count; /* slopes behind the channels_count channels of the file */
    uint16_t pool_count, links_count;
    /* derived (derive.h) */
    uint8_t grids_count, other_terms_count, plain_count;
    uint32_t plain_age_us;             /* the smallest maximum age of plain signals */
    uint8_t other_terms[CB_MAX_TERMS]; /* all terms except plain curves, in order */
    uint8_t measured[CB_MAX_SIGNALS]; /* all signals except lags, the plain_count plain ones last */
    struct cb_plc_config plc;

    /* derived */
    uint8_t output_terms[CB_MAX_OUTPUTS]; /* outputs[].term, close together */
    struct cb_grid grids[CB_MAX_TERMS];
    struct cb_plain_curve plain_curves[CB_MAX_TERMS];
    struct cb_lag_link lag_links[CB_MAX_SIGNALS];

    struct cb_signal_config signals[CB_MAX_SIGNALS];
    struct cb_term_config terms[CB_MAX_TERMS];
    struct cb_curve_config branches[CB_MAX_BRANCHES]; /* backward; as curves of terms */
    struct cb_channel_config channels[CB_MAX_CHANNELS];
    struct cb_pair_config pairs[CB_MAX_PAIRS];
    uint32_t revision; /* no step uses the fields from here to outputs */
    char machine[40];
    struct cb_bus_config buses[CB_MAX_BUSES];
    struct cb_can_config can;
    uint8_t lags[CB_MAX_SIGNALS]; /* the lags, each after its signal, adjacent where they share a
                                     time constant and the order permits it */
    struct cb_output_config outputs[CB_MAX_OUTPUTS];
    uint8_t links[CB_MAX_LINKS];
    float pool[CB_POOL_FLOATS];
};

/* Number of channels and slopes: all outputs that pass the limiter. */
static inline unsigned cb_all_channels(const struct cb_config *config) {
    return (unsigned)config->channels_count + config->slopes_count;
}

#endif
