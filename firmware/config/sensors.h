/* SPDX-License-Identifier: MIT
 * The section "sensors" of the coefficient file in memory: what the box expects of each sensor from
 * all others. */
#ifndef COMPBOX_FIRMWARE_CONFIG_SENSORS_H
#define COMPBOX_FIRMWARE_CONFIG_SENSORS_H

#include <stdint.h>

#include "firmware/base/limits.h"

/* Pool: center of each sensor, then the rows of the symmetric precision matrix. Number of sensors:
 * config->sensors_count. */
struct cb_sensors_config {
    uint8_t signal[CB_MAX_SENSORS]; /* indices of measured signals */
    uint16_t pool;
    float threshold;        /* of the normalised residual */
    float after_s;          /* a sensor disagrees for so long before it is doubted */
    uint32_t after_us;      /* derived: the same */
    float threshold_square; /* derived */
};

#endif
