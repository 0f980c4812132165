/* SPDX-License-Identifier: MIT
 * Inputs and outputs of one step of the box: plain data, no hardware. */
#ifndef COMPBOX_FIRMWARE_BASE_IO_H
#define COMPBOX_FIRMWARE_BASE_IO_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/limits.h"

/* Result of a request to the PLC: a read, a write, or a read-back of the write block. */
enum cb_transfer {
    CB_TRANSFER_NONE,    /* there was no request */
    CB_TRANSFER_OK,      /* done, and the reply was checked */
    CB_TRANSFER_FAILED,  /* certainly no effect: not connected, not sent, no time left */
    CB_TRANSFER_REFUSED, /* the PLC replied with an exception: no effect */
    CB_TRANSFER_UNKNOWN, /* sent, but no valid reply before the deadline: a write may have taken
                            effect */
};

/* A number from one of the box's own sensors (CAN, bus), before scale and zero. */
struct cb_sample {
    uint8_t signal; /* index in config.signals */
    float raw;
    int64_t time_us; /* time of reception, in the clock of now_us */
};

struct cb_inputs {
    bool read_ok;          /* registers[] hold a fresh, whole reading of the PLC's read block */
    uint8_t last_write;    /* enum cb_transfer, of the previous step's outputs */
    uint8_t held;          /* enum cb_transfer, of the read-back that cb_box_wants_held() requests,
                              after last_write and before this step; OK: held_registers[] */
    bool stop;             /* stop requested: ramp to zero, then report STOPPED */
    uint32_t missed_ticks; /* ticks skipped just before this one */
    int64_t read_us;       /* time of the read request; <= now_us */
    uint32_t exchange_us;  /* from the read request to the confirmation of the write based on that
                              reading, for the newest such write; 0: none yet */
    uint8_t sample_count;  /* <= CB_MAX_SAMPLES */
    uint16_t registers[CB_MAX_READ_REGISTERS];
    uint16_t held_registers[CB_MAX_WRITE_REGISTERS];
    struct cb_sample samples[CB_MAX_SAMPLES]; /* in order of arrival */
};

struct cb_outputs {
    uint16_t registers[CB_MAX_WRITE_REGISTERS]; /* the whole write block, always valid */
    float channel_um[CB_MAX_CHANNELS];          /* value of the registers, after all limits */
    bool write;   /* false: no write allowed now (see enum cb_contact in box/plc.h) */
    bool last;    /* after this write, no other may follow on the same connection */
    bool stopped; /* STOPPED was written and confirmed: the target may exit */
};

#endif
