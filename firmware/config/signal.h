/* SPDX-License-Identifier: MIT
 * The section "signals" of the coefficient file in memory: source, conversion and plausible range
 * of each signal, and the lags. */
#ifndef COMPBOX_FIRMWARE_CONFIG_SIGNAL_H
#define COMPBOX_FIRMWARE_CONFIG_SIGNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/limits.h"

enum cb_signal_source {
    CB_SOURCE_PLC,  /* registers of the PLC's read block */
    CB_SOURCE_CAN,  /* raw CAN frame, by identifier */
    CB_SOURCE_BUS,  /* register of a module on a slow bus of the box (Pt100) */
    CB_SOURCE_LAG,  /* first-order lag of another signal: computed, on every target */
    CB_SOURCE_HAND, /* measured and typed in by a person (compbox measured) */
};

/* Part of a measurement by hand that a signal carries. */
enum cb_hand_part { CB_HAND_VALUE, CB_HAND_COUNT };

#define CB_CAN_EXTENDED 0x80000000u /* set in a CAN identifier of 29 bits */
#define CB_CAN_ID_BITS 0x1FFFFFFFu
#define CB_CAN_ANY_SOURCE 0x40000000u /* … whose last eight bits may be any (J1939) */

/* value = raw * scale + zero, in the signal's unit (mm, degC, 1/min …). Each step checks the fields
 * from source on, except for lags (box/check.c). */
struct cb_signal_config {
    char name[CB_NAME_SIZE];
    char unit[8];
    uint32_t can_id;      /* CAN: identifier, with the flags above; hand: cb_hand_key */
    float max_rate_per_s; /* plausible rate of change, unit/s; 0 = unlimited */
    float tau_s;          /* lag: time constant, > 0 */
    uint8_t lag_of;       /* lag: index of its signal */
    uint8_t power;        /* lag: 1 follows its signal, 2 the signal's square */
    uint8_t bus;          /* bus: its index; hand: enum cb_hand_part */
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

/* The name of measurements by hand as a number. in : name: ended by 0. out: its 1 to 4 bytes, the
 * first one highest; 0 for a longer name and for "" */
static inline uint32_t cb_hand_key(const char *name) {
    uint32_t key = 0;
    for (unsigned i = 0; name[i] != '\0'; ++i) {
        if (i == 4) return 0;
        key = key << 8 | (uint8_t)name[i];
    }
    return key;
}

/* A lag and its signal; derived, in the order of config->lags. */
struct cb_lag_link {
    uint8_t lag, of; /* indices of signals */
    bool squares;    /* the input is the square */
    uint8_t more;    /* number of lags after this one that share its time constant */
    float tau_s;
};

#endif
