/* SPDX-License-Identifier: MIT
 * What the box knows about the PLC: whether it can be read, whether it lives, what it asks for, and
 * whether the box still knows what the PLC's registers hold. */
#ifndef COMPBOX_FIRMWARE_BOX_PLC_H
#define COMPBOX_FIRMWARE_BOX_PLC_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/base/io.h"
#include "firmware/config/config.h"

/* Bits of the control word. */
enum {
    CB_CONTROL_ENABLE = 1 << 0,
    CB_CONTROL_REFERENCED = 1 << 1, /* the default of plc.referenced_mask */
    CB_CONTROL_RESET = 1 << 2,
    CB_CONTROL_PERMIT_RESUME = 1 << 3,
};

/* Bits of the handshake register (docs/coefficient-file.md). */
enum {
    CB_HANDSHAKE_CHANNEL = 0xFF, /* 1 + index of the channel that is being handed over; 0: none */
    CB_HANDSHAKE_ESTB = 1 << 8,
    CB_HANDSHAKE_EREND = 1 << 9,
    CB_HANDSHAKE_ALARM = 1 << 15,
};

/* A box that does not know what the PLC holds asks before it writes
 * (docs/decisions/0005-ask-before-writing.md). */
enum cb_contact {
    CB_CONTACT_NONE,  /* not heard since start: nothing is written until the PLC returned what its
                         write block holds, or refused to */
    CB_CONTACT_KNOWN, /* the last writes were confirmed, or only a few were not */
    CB_CONTACT_LOST,  /* no write was confirmed for CB_LOST_HALF_PERIODS half periods, the PLC may
                         have restarted: nothing is written until it said what it holds */
};

enum {
    CB_LOST_HALF_PERIODS = 9, /* four writes in a row; a PLC does not restart in that time */
    CB_READ_PERIODS = 3,      /* a reading older than this is none */
    CB_REFUSED_US = 3000000,  /* refusing every write for this long is a fault */
    CB_ASK_US = 1000000,      /* the write block is read back this often, where there is room */
};

struct cb_plc_state {
    int64_t read_us;         /* when the last good reading was asked for */
    int64_t heartbeat_us;    /* the reading in which the PLC's heartbeat last moved */
    uint32_t unconfirmed_us; /* time since the last write that was confirmed */
    uint32_t refused_us;     /* time since the first of a row of refused writes */
    uint16_t control;        /* control word of the last good reading */
    uint16_t plc_heartbeat;  /* … and its heartbeat */
    uint16_t handshake;      /* … and its handshake with the NC */
    uint32_t asked_us;       /* time since the write block was last read back */
    uint8_t contact;         /* enum cb_contact */
    bool beat;               /* plc_heartbeat is one that was read */
    bool went_back;          /* the heartbeat is behind the last one before contact was lost: the
                                PLC has restarted, and its offset begins at zero */
    bool silent;             /* it does not return its write block: asked for no more */
    bool readable;           /* a good reading is there, since start or clock jump */
    bool beating;            /* the heartbeat moved, since start or clock jump */
    bool alive;              /* … and within its timeout, in this step */
    bool refusing;           /* a write was refused, and none was confirmed since */
    bool confirmed;          /* a write was confirmed since the contact became KNOWN */
    bool mute;               /* contact was lost though the PLC answers, or again without a write
                                confirmed in between, or the first write was refused; and no write
                                was confirmed since */
    bool parting;            /* mute since the contact was lost, and the PLC was not informed yet:
                                one last write may do it (cb_plc_parts) */
    bool nc_alarm;           /* the handshake register says so */
    bool reset_edge;         /* the reset bit went on with this step's reading */
};

/* Time cannot be trusted: the last reading and heartbeat are too old to be of use. */
void cb_plc_forget(struct cb_plc_state *state);

/* Takes note of how the last write ended; elapsed_us since the step before. Before this cycle's
 * reading. */
void cb_plc_written(const struct cb_config *config, struct cb_plc_state *state,
                    struct cb_counters *counters, enum cb_transfer result, uint32_t elapsed_us,
                    int64_t now_us);

/* Takes this cycle's reading, if it is good: there, whole (counters of the block agree), not from
 * the future. out: whether it is. */
bool cb_plc_read(const struct cb_config *config, struct cb_plc_state *state,
                 struct cb_counters *counters, const struct cb_inputs *in, int64_t now_us);

/* Sets alive for now_us; counts a heartbeat that is lost. */
void cb_plc_age(const struct cb_config *config, struct cb_plc_state *state,
                struct cb_counters *counters, int64_t now_us);

/* Contact was lost just now though the PLC answers readings: the status in its registers may still
 * be ACTIVE. One last write of the last outputs, whose status names what the box does instead, may
 * be handed out, until it is sent, the readings stop, or CB_READ_PERIODS are over. */
bool cb_plc_parts(const struct cb_plc_state *state);

/* The last reading is young enough to act on. */
bool cb_plc_readable(const struct cb_config *config, const struct cb_plc_state *state,
                     int64_t now_us);

#endif
