/* SPDX-License-Identifier: MIT
 * The section "sensors": sensors that check each other. */
#include <string.h>

#include "firmware/config/config.h"
#include "firmware/load/sections.h"
#include "firmware/terms/load.h"
#include "models/num.h"

#define AT(member) .offset = offsetof(struct cb_sensors_config, member)

enum { SIGNALS, CENTER, PRECISION, THRESHOLD, AFTER, SENSORS_KEYS };
static const struct cb_field SENSORS_FIELDS[SENSORS_KEYS] = {
    [SIGNALS] = {"signals", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [CENTER] = {"center", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [PRECISION] = {"precision", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [THRESHOLD] = {"threshold", CB_FIELD_FLOAT, true, AT(threshold), .least = "1",
                   .most = "1000000"},
    [AFTER] = {"after_s", CB_FIELD_FLOAT, false, AT(after_s), .least = "1", .most = "3600",
               .otherwise = "120"},
};
const struct cb_object cb_sensors_object = {SENSORS_FIELDS, SENSORS_KEYS};

static bool is_listed(const struct cb_config *config, uint8_t signal) {
    for (unsigned j = 0; j < config->sensors_count; ++j)
        if (config->sensors.signal[j] == signal) return true;
    return false;
}

/* Reads the names of three or more different signals that are measured and plain. */
static bool read_signals(struct cb_loader *loader, uint32_t at) {
    struct cb_config *config = loader->config;
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        uint8_t signal = 0;
        if (!cb_list_has_room(loader, &list, CB_MAX_SENSORS, "sensors")) return false;
        if (!cb_read_signal(loader, list.at, &signal)) return false;
        if (is_listed(config, signal))
            return cb_fail(loader, CB_ERROR_NAME, list.at, "%o occurs twice", list.at);
        if (config->signals[signal].source == CB_SOURCE_LAG || config->signals[signal].essential)
            return cb_fail(loader, CB_ERROR_RANGE, list.at,
                           "%o is a lag or essential; name measured signals that may go stale",
                           list.at);
        config->sensors.signal[config->sensors_count++] = signal;
    }
    if (config->sensors_count >= 3) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at, "at least three sensors are needed to find one");
}

/* out: true if matrix[count * count] is symmetric and its diagonal positive */
static bool check_precision(struct cb_loader *loader, uint32_t at, const float *matrix) {
    const unsigned count = loader->config->sensors_count;
    for (unsigned j = 0; j < count; ++j) {
        const uint32_t row = cb_list_at(loader, at, j);
        if (!(matrix[j * count + j] >= 1e-9f))
            return cb_fail(loader, CB_ERROR_RANGE, cb_list_at(loader, row, j),
                           "on the diagonal a number must be at least 1e-9");
        for (unsigned k = 0; k < j; ++k) {
            if (matrix[j * count + k] != matrix[k * count + j])
                return cb_fail(loader, CB_ERROR_RANGE, cb_list_at(loader, row, k),
                               "row %u differs here from column %u, and the matrix is symmetric",
                               (uint32_t)j, (uint32_t)j);
        }
    }
    return true;
}

bool cb_load_sensors(struct cb_loader *loader, uint32_t at) {
    struct cb_config *config = loader->config;
    struct cb_sensors_config *sensors = &config->sensors;
    float *const numbers = loader->scratch->values;
    uint32_t slots[SENSORS_KEYS];
    if (!cb_read_object(loader, at, &cb_sensors_object, sensors, slots)) return false;
    if (!read_signals(loader, slots[SIGNALS])) return false;
    const uint32_t count = config->sensors_count;
    if (!cb_take_pool(loader, at, count + count * count, &sensors->pool)) return false;
    float *const pool = config->pool + sensors->pool;
    if (!cb_read_vector(loader, slots[CENTER], count, "sensors", pool)) return false;
    if (!cb_read_rows(loader, slots[PRECISION], count, "sensors", count, "sensors", numbers))
        return false;
    if (!check_precision(loader, slots[PRECISION], numbers)) return false;
    memcpy(pool + count, numbers, count * count * sizeof *numbers);
    sensors->threshold_square = sensors->threshold * sensors->threshold;
    sensors->after_us = (uint32_t)(sensors->after_s * 1e6f);
    return true;
}
