/* SPDX-License-Identifier: MIT
 * From CAN frames to samples, by the place of each signal in its frame. No wire, no clock; the
 * owner of the bus calls it (hal/linux/can.h). Raw frames by identifier, for CANopen TPDOs and
 * J1939 messages alike. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_CAN_H
#define COMPBOX_FIRMWARE_SIGNALS_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/io.h"
#include "firmware/config/signal.h"

struct cb_config;

/* A data frame. */
struct cb_can_frame {
    uint32_t id;    /* CB_CAN_EXTENDED set: of 29 bits */
    uint8_t length; /* 0 … 8 */
    uint8_t data[8];
    int64_t time_us; /* time of reception, in the clock of now_us */
};

/* Place of one signal in its frame. */
struct cb_can_field {
    uint32_t id;    /* flags as in config.h */
    uint8_t signal; /* index in config.signals */
    uint8_t type;   /* enum cb_number_type */
    uint8_t offset; /* of its first byte */
};

struct cb_can_map {
    uint8_t count;
    struct cb_can_field fields[CB_MAX_SIGNALS];
};

/* The newest number of each signal since the batch was emptied. */
struct cb_can_batch {
    uint8_t count;
    struct cb_sample samples[CB_MAX_SIGNALS];
};

/* Bits of a frame's identifier that must match this one. A remote frame never matches; the kernel's
 * flag for it is the bit of CB_CAN_ANY_SOURCE. */
static inline uint32_t cb_can_mask(uint32_t id) {
    return id & CB_CAN_ANY_SOURCE ? 0xFFFFFF00u : 0xFFFFFFFFu;
}

static inline bool cb_can_is(uint32_t wanted, uint32_t id) {
    return (id & cb_can_mask(wanted)) == (wanted & ~CB_CAN_ANY_SOURCE);
}

/* Collects the signals of the coefficient file that come over CAN. */
void cb_can_map_of(struct cb_can_map *map, const struct cb_config *config);

enum cb_can_taken {
    CB_CAN_FOREIGN, /* no signal has this identifier */
    CB_CAN_TAKEN,
    CB_CAN_SHORT, /* the frame ends before one of its signals; the others were taken */
};

/* Adds the numbers of a frame to the batch; a newer number of a signal replaces the older one. */
enum cb_can_taken cb_can_take(const struct cb_can_map *map, const struct cb_can_frame *frame,
                              struct cb_can_batch *batch);

#endif
