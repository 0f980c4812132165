/* SPDX-License-Identifier: MIT
 * State of the PLC: readable, alive, its control word, and contact: whether the box knows the
 * values of the PLC's write block. */
#ifndef COMPBOX_FIRMWARE_BOX_PLC_H
#define COMPBOX_FIRMWARE_BOX_PLC_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/base/io.h"

struct cb_config;

/* Bits of the control word. */
enum {
    CB_CONTROL_ENABLE = 1 << 0,
    CB_CONTROL_REFERENCED = 1 << 1, /* the default of plc.referenced_mask */
    CB_CONTROL_RESET = 1 << 2,
    CB_CONTROL_PERMIT_RESUME = 1 << 3,
};

/* Bits of the handshake register (docs/coefficient-file.md). */
enum {
    CB_HANDSHAKE_CHANNEL = 0xFF, /* 1 + index of the channel in transfer; 0: none */
    CB_HANDSHAKE_ESTB = 1 << 8,
    CB_HANDSHAKE_EREND = 1 << 9,
    CB_HANDSHAKE_ALARM = 1 << 15,
};

/* Without contact the box reads the write block back before it writes
 * (docs/decisions/0005-ask-before-writing.md). */
enum cb_contact {
    CB_CONTACT_NONE,  /* since the start the PLC has not returned its write block, nor refused to:
                         nothing is written */
    CB_CONTACT_KNOWN, /* the last writes were confirmed, except for a few */
    CB_CONTACT_LOST,  /* no write was confirmed for CB_LOST_HALF_PERIODS half periods, so the PLC
                         may have restarted: nothing is written until it returns its write block */
};

enum {
    CB_LOST_HALF_PERIODS = 9,  /* four successive writes; a PLC does not restart in that time */
    CB_READ_PERIODS = 3,       /* maximum age of a reading */
    CB_REFUSED_US = 3000000,   /* time of refused writes that is a fault */
    CB_GONE_US = 2000000,      /* longer than a reconnection to a PLC that replies */
    CB_READ_BACK_US = 1000000, /* interval of read-backs, if the exchange has time */
    CB_READ_BACK_TRIES = 3,    /* successive ones without a reply, each of which costs a write */
};

struct cb_plc_state {
    int64_t read_us;         /* time of the request of the last good reading */
    int64_t heartbeat_us;    /* time of the reading in which the PLC's heartbeat last changed */
    uint32_t unconfirmed_us; /* time since the last confirmed write */
    uint32_t refused_us;     /* time since the first of successive refused writes in which the PLC
                                answered */
    uint16_t control;        /* control word of the last good reading */
    uint16_t plc_heartbeat;  /* … and its heartbeat */
    uint16_t handshake;      /* … and its handshake with the NC */
    uint32_t read_back_us;   /* time since the write block was last read back */
    uint8_t contact;         /* enum cb_contact */
    bool beat;               /* plc_heartbeat was read, in any reading */
    bool went_back;          /* the heartbeat is behind the last one before contact was lost: the
                                PLC has restarted, and its offset begins at zero */
    uint8_t unread;          /* successive read-backs without a reply */
    bool silent;             /* it does not return its write block: no more read-backs */
    bool readable;           /* there was a good reading since start or clock jump */
    bool beating;            /* the heartbeat changed since start or clock jump */
    bool alive;              /* … and within its timeout, in this step */
    bool refusing;           /* a write was refused, and none was confirmed since */
    bool confirmed;          /* a write was confirmed since the contact became KNOWN */
    bool mute;               /* no write was confirmed since one of: contact was lost although the
                                PLC replies; contact was lost again without a confirmed write in
                                between; the first write was refused */
    bool parting;            /* contact was lost and made the PLC mute: one last write may report
                                it to the PLC (cb_plc_parts) */
    bool nc_alarm;           /* the NC is in alarm, by the handshake register */
    bool reset_edge;         /* the reset bit rose in this step's reading */
};

/* After a clock jump: invalidates the last reading and heartbeat, whose ages are unknown. */
void cb_plc_forget(struct cb_plc_state *state);

/* Processes the result of the last write. Call before cb_plc_read() of this cycle.
 * in : elapsed_us since the previous step */
void cb_plc_written(const struct cb_config *config, struct cb_plc_state *state,
                    struct cb_counters *counters, enum cb_transfer result, uint32_t elapsed_us,
                    int64_t now_us);

/* out: true if this cycle's reading is good: it succeeded, is whole (the block's counters agree)
 *      and not from the future; then *state has its values */
bool cb_plc_read(const struct cb_config *config, struct cb_plc_state *state,
                 struct cb_counters *counters, const struct cb_inputs *in, int64_t now_us);

/* Sets alive for now_us; counts a heartbeat that is lost. */
void cb_plc_age(const struct cb_config *config, struct cb_plc_state *state,
                struct cb_counters *counters, int64_t now_us);

/* out: true if one last write is permitted: contact was lost although the PLC replies to readings,
 *      so its status register may still have ACTIVE. The write has the last outputs and the present
 *      status. It is permitted until it is sent, readings fail, or CB_READ_PERIODS have passed. */
bool cb_plc_parts(const struct cb_plc_state *state);

/* out: true if the last good reading is at most CB_READ_PERIODS old */
bool cb_plc_readable(const struct cb_config *config, const struct cb_plc_state *state,
                     int64_t now_us);

/* out: true if the PLC has not been readable for CB_GONE_US: more than confirmations are missing */
bool cb_plc_gone(const struct cb_config *config, const struct cb_plc_state *state, int64_t now_us);

#endif
