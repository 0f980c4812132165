/* SPDX-License-Identifier: MIT
 * What a kind of control can do (`plc.profile`), as data: one struct each. The loader refuses what
 * does not fit, the box and the tools take their numbers from here; nobody asks for a profile by
 * its name. Where the facts come from, and which are of memory only: docs/plc-profiles.md. */
#ifndef COMPBOX_FIRMWARE_CONFIG_PROFILE_H
#define COMPBOX_FIRMWARE_CONFIG_PROFILE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/config/config.h"

enum {
    CB_PROFILE_INCREMENTS = 5, /* least increments that a control may have */
    /* an output moves no further than its largest step in this time, or in so many updates of the
     * NC: whichever of the box's values the NC takes over, it sees no larger step */
    CB_STEP_WINDOW_US = 1000000,
    CB_STEP_WINDOW_UPDATES = 10,
    CB_USUAL_SCAN_US = 8000, /* of a ladder, unless plc.scan_ms says otherwise */
};

/* A control. Zero means without limit, or that it has no such thing. */
struct cb_profile_facts {
    const char *name;
    uint32_t functions;      /* function codes that it answers, as bits 1 << code */
    uint8_t read_registers;  /* most in one FC3 */
    uint8_t write_registers; /* most in one FC16 */
    uint8_t both_read;       /* most in one FC23 … */
    uint8_t both_write;      /* … read and written */
    uint32_t number_types;   /* of signals from the PLC, as bits 1 << enum cb_number_type */
    uint32_t value_types;    /* of channels: value, applied, slope and reference */
    float value_most;        /* a value lies within ± this many register units */
    uint16_t step_most;      /* the largest change from one update of the NC to the next, units */
    float increments_um[CB_PROFILE_INCREMENTS]; /* register units that it may have; 0 ends */
    const char *increments;                     /* … in words */
    bool tangent;                               /* the NC follows a slope between two values */
    uint8_t handshake_scans; /* PLC scans until the NC took one value by handshake; 0: none */
    float deadband_um;       /* default of plc.deadband_um */
    uint8_t clients;         /* Modbus clients at a time; 0: not known */
    const char *order;       /* how numbers have to lie, in words */
};

/* in : a value of enum cb_profile */
const struct cb_profile_facts *cb_profile_of(uint8_t profile);

/* true: all function codes that an exchange needs are answered. */
bool cb_profile_answers(const struct cb_profile_facts *facts, enum cb_exchange exchange);

/* Most registers of the two blocks that one request of the exchange carries. */
unsigned cb_profile_read_most(const struct cb_profile_facts *facts, enum cb_exchange exchange);
unsigned cb_profile_write_most(const struct cb_profile_facts *facts, enum cb_exchange exchange);

/* Time until the NC took over one value: one handshake. 0: without a handshake. */
uint32_t cb_profile_handshake_us(const struct cb_config *config);

/* Time from one update of a channel in the NC to the next: a handshake for each, one after the
 * other, or one for all of them. 0: without a handshake. */
uint32_t cb_profile_update_us(const struct cb_config *config);

/* What a value waits for behind the PLC's register, as a part of the lead (lead.h): half of a
 * handshake until the NC has it and half of an update that it then stands for. */
uint32_t cb_profile_lead_us(const struct cb_config *config);

/* A quarter of the time that a PLC has to apply what it was sent: 1 s, and in any case ten updates
 * of the NC. */
uint32_t cb_profile_quarter_us(const struct cb_config *config);

/* The time in which no channel moves further than the largest step. */
uint32_t cb_profile_step_window_us(const struct cb_config *config);

/* The rate at which a channel may move so that no window holds more than the largest step; 0:
 * any. */
float cb_profile_slew_most(const struct cb_config *config, const struct cb_channel_config *channel);

#endif
