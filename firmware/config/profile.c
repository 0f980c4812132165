/* SPDX-License-Identifier: MIT */
#include "firmware/config/profile.h"

#include "firmware/config/config.h"
#include "firmware/wire/number.h"

#define FC(code) (1u << (code))
#define TYPE(name) (1u << CB_NUMBER_##name)
#define EVERY_TYPE (TYPE(FLOAT32_LE) * 2u - 1u)

/* Numbers as a big-endian server has them: ABCD. */
#define ABCD_TYPES (TYPE(UINT16) | TYPE(INT16) | TYPE(UINT32) | TYPE(INT32) | TYPE(FLOAT32))

static const struct cb_profile_facts PROFILES[] = {
    [CB_PROFILE_GENERIC] = {.name = "generic",
                            .functions = FC(3) | FC(4) | FC(6) | FC(16) | FC(23),
                            .read_registers = 125,
                            .write_registers = 123,
                            .both_read = 125,
                            .both_write = 121,
                            .number_types = EVERY_TYPE,
                            .value_types = EVERY_TYPE,
                            .tangent = true},
    [CB_PROFILE_SINUMERIK_840D] = {.name = "sinumerik-840d",
                                   .functions = FC(1) | FC(2) | FC(3) | FC(4) | FC(5) | FC(6) |
                                                FC(15) | FC(16),
                                   .read_registers = 125,
                                   .write_registers = 123,
                                   .number_types = ABCD_TYPES,
                                   .value_types = ABCD_TYPES,
                                   .order = "an S7 as Modbus server keeps the order ABCD",
                                   .tangent = true,
                                   .deadband_um = 0.1f,
                                   .clients = 1},
    [CB_PROFILE_FANUC] = {.name = "fanuc",
                          .functions = FC(3) | FC(16) | FC(23),
                          .read_registers = 125,
                          .write_registers = 123,
                          .both_read = 125,
                          .both_write = 121,
                          .number_types = EVERY_TYPE,
                          .value_types = TYPE(INT16) | TYPE(INT32) | TYPE(INT32_CDAB),
                          .order = "its external data input takes whole numbers",
                          .value_most = 9999.0f,
                          .step_most = 9998,
                          .increments_um = {10.0f, 1.0f, 0.1f, 0.01f, 0.001f},
                          .increments = "10, 1, 0.1, 0.01 or 0.001",
                          .handshake_scans = 4},
};

const struct cb_profile_facts *cb_profile_of(uint8_t profile) {
    const unsigned known = sizeof PROFILES / sizeof PROFILES[0];
    return &PROFILES[profile < known ? profile : CB_PROFILE_GENERIC];
}

/* fc23 reads by FC3 while the box must not write (hal/cycle.h). */
static uint32_t needed(enum cb_exchange exchange) {
    switch (exchange) {
        case CB_EXCHANGE_FC3_FC16:
            return FC(3) | FC(16);
        case CB_EXCHANGE_FC23:
            break;
    }
    return FC(3) | FC(23);
}

bool cb_profile_answers(const struct cb_profile_facts *facts, enum cb_exchange exchange) {
    return (needed(exchange) & ~facts->functions) == 0;
}

unsigned cb_profile_read_most(const struct cb_profile_facts *facts, enum cb_exchange exchange) {
    const bool both = exchange == CB_EXCHANGE_FC23 && facts->both_read < facts->read_registers;
    return both ? facts->both_read : facts->read_registers;
}

unsigned cb_profile_write_most(const struct cb_profile_facts *facts, enum cb_exchange exchange) {
    return exchange == CB_EXCHANGE_FC23 ? facts->both_write : facts->write_registers;
}

uint32_t cb_profile_handshake_us(const struct cb_config *config) {
    return cb_profile_of(config->plc.profile)->handshake_scans * config->plc.scan_us;
}

uint32_t cb_profile_update_us(const struct cb_config *config) {
    const uint32_t in_a_row = config->plc.axes_at_once ? 1u : config->channels_count;
    return cb_profile_handshake_us(config) * in_a_row;
}

uint32_t cb_profile_lead_us(const struct cb_config *config) {
    return (cb_profile_handshake_us(config) + cb_profile_update_us(config)) / 2;
}

uint32_t cb_profile_quarter_us(const struct cb_config *config) {
    return cb_profile_step_window_us(config) / 4;
}

uint32_t cb_profile_step_window_us(const struct cb_config *config) {
    const uint32_t updates_us = CB_STEP_WINDOW_UPDATES * cb_profile_update_us(config);
    return updates_us > CB_STEP_WINDOW_US ? updates_us : CB_STEP_WINDOW_US;
}

float cb_profile_slew_most(const struct cb_config *config,
                           const struct cb_channel_config *channel) {
    const uint32_t window_us = cb_profile_step_window_us(config);
    if (config->plc.step_units == 0) return 0.0f;
    /* one unit less: the grid may add one unit to the rate limit (limiter.c) */
    const float step_um = (float)(config->plc.step_units - 1u) * channel->scale;
    return step_um / ((float)window_us * 1e-6f);
}
