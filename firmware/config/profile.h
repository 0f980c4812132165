/* SPDX-License-Identifier: MIT
 * Abilities of each kind of control (`plc.profile`) as data: one struct each. The loader rejects
 * settings beyond them, the box and the tools read their numbers here; no code tests for a profile
 * by name. docs/plc-profiles.md has the source of each fact and its certainty. */
#ifndef COMPBOX_FIRMWARE_CONFIG_PROFILE_H
#define COMPBOX_FIRMWARE_CONFIG_PROFILE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/config/plc.h"

struct cb_channel_config;
struct cb_config;

enum {
    CB_PROFILE_INCREMENTS = 5, /* number of least increments of a control */
    /* an output moves no further than its largest step in this time, or in as many updates of the
     * NC. Any two consecutive values that the NC takes over then differ by no more */
    CB_STEP_WINDOW_US = 1000000,
    CB_STEP_WINDOW_UPDATES = 10,
    CB_USUAL_SCAN_US = 8000, /* of a ladder, unless plc.scan_ms gives another */
};

/* A control. Zero means no limit, or that it has no such feature. */
struct cb_profile_facts {
    const char *name;
    uint32_t functions;      /* supported function codes, as bits 1 << code */
    uint8_t read_registers;  /* most in one FC3 */
    uint8_t write_registers; /* most in one FC16 */
    uint8_t both_read;       /* most in one FC23 … */
    uint8_t both_write;      /* … read and written */
    uint32_t number_types;   /* of signals from the PLC, as bits 1 << enum cb_number_type */
    uint32_t value_types;    /* of channels: value, applied, slope and reference */
    float value_most;        /* a value is within ± this many register units */
    uint16_t step_most;      /* the largest change between two updates of the NC, in units */
    float increments_um[CB_PROFILE_INCREMENTS]; /* permitted register units; 0 ends */
    const char *increments;                     /* … in words */
    bool tangent;                               /* the NC interpolates with a slope between two
                                                   values */
    uint8_t handshake_scans; /* PLC scans per value taken by the NC by handshake; 0: none */
    float deadband_um;       /* default of plc.deadband_um */
    uint8_t clients;         /* Modbus clients at a time; 0: unknown */
    const char *order;       /* required order of numbers, in words */
};

/* in : a value of enum cb_profile */
const struct cb_profile_facts *cb_profile_of(uint8_t profile);

/* out: true if the control supports all function codes of the exchange */
bool cb_profile_answers(const struct cb_profile_facts *facts, enum cb_exchange exchange);

/* Most registers of the two blocks that one request of the exchange can carry. */
unsigned cb_profile_read_most(const struct cb_profile_facts *facts, enum cb_exchange exchange);
unsigned cb_profile_write_most(const struct cb_profile_facts *facts, enum cb_exchange exchange);

/* Time of one handshake, by which the NC takes over one value. 0: without a handshake. */
uint32_t cb_profile_handshake_us(const struct cb_config *config);

/* Time between two updates of a channel in the NC: the sum of all channels' handshakes, or one
 * handshake for all. 0: without a handshake. */
uint32_t cb_profile_update_us(const struct cb_config *config);

/* Delay of a value behind the PLC's register, as a part of the lead (lead.h): half a handshake
 * until the NC has it, and half of the update for which it is then valid. */
uint32_t cb_profile_lead_us(const struct cb_config *config);

/* A quarter of the time in which a PLC must apply a value: 1 s, but at least ten updates of the
 * NC. */
uint32_t cb_profile_quarter_us(const struct cb_config *config);

/* The time in which no channel moves further than the largest step. */
uint32_t cb_profile_step_window_us(const struct cb_config *config);

/* Maximum rate of a channel such that no window exceeds the largest step; 0: any. */
float cb_profile_slew_most(const struct cb_config *config, const struct cb_channel_config *channel);

#endif
