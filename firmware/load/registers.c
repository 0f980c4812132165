/* SPDX-License-Identifier: MIT */
#include "firmware/load/registers.h"

#include "firmware/base/assert.h"
#include "firmware/config/config.h"
#include "firmware/wire/number.h"

const struct cb_word cb_number_words[] = {
    {"uint8", CB_NUMBER_UINT8},          {"int8", CB_NUMBER_INT8},
    {"uint16", CB_NUMBER_UINT16},        {"int16", CB_NUMBER_INT16},
    {"uint32", CB_NUMBER_UINT32},        {"int32", CB_NUMBER_INT32},
    {"float32", CB_NUMBER_FLOAT32},      {"uint32cdab", CB_NUMBER_UINT32_CDAB},
    {"int32cdab", CB_NUMBER_INT32_CDAB}, {"float32cdab", CB_NUMBER_FLOAT32_CDAB},
    {"uint16le", CB_NUMBER_UINT16_LE},   {"int16le", CB_NUMBER_INT16_LE},
    {"uint32le", CB_NUMBER_UINT32_LE},   {"int32le", CB_NUMBER_INT32_LE},
    {"float32le", CB_NUMBER_FLOAT32_LE}, {0, 0},
};

static const char *fixed_user(uint8_t user) {
    static const char *const names[] = {
        [CB_USER_NOBODY] = "nobody",
        [CB_USER_COUNTER] = "a block counter (counters)",
        [CB_USER_CONTROL] = "the control word (control)",
        [CB_USER_PLC_HEARTBEAT] = "plc_heartbeat",
        [CB_USER_STATUS] = "the status word (status)",
        [CB_USER_BOX_HEARTBEAT] = "box_heartbeat",
        [CB_USER_HANDSHAKE] = "handshake",
        [CB_USER_DETAIL] = "detail",
        [CB_USER_REQUEST] = "request",
    };
    return names[user];
}

/* out: false, and a message with the user of the register */
static bool taken(struct cb_loader *loader, uint32_t at, uint32_t address, uint8_t user) {
    const struct cb_config *config = loader->config;
    if (user >= CB_USER_CHANNEL)
        return cb_fail(loader, CB_ERROR_OVERLAP, at, "register %u already belongs to channel %s",
                       address, config->channels[user - CB_USER_CHANNEL].name);
    if (user >= CB_USER_SIGNAL)
        return cb_fail(loader, CB_ERROR_OVERLAP, at, "register %u already belongs to signal %s",
                       address, config->signals[user - CB_USER_SIGNAL].name);
    return cb_fail(loader, CB_ERROR_OVERLAP, at, "register %u already belongs to %s", address,
                   fixed_user(user));
}

/* out: true if `width` registers from `address` on are in the block; else false and a message */
static bool inside(struct cb_loader *loader, uint32_t at, const struct cb_block_config *block,
                   const char *name, uint32_t address, uint32_t width) {
    const uint32_t last = block->start + block->count - 1u;
    if (address < block->start || address > last)
        return cb_fail(loader, CB_ERROR_RANGE, at, "register %o is outside plc.%s, %u to %u", at,
                       name, (uint32_t)block->start, last);
    if (address + width - 1 > last)
        return cb_fail(loader, CB_ERROR_RANGE, at,
                       "registers %u and %u: the second is outside plc.%s, %u to %u", address,
                       address + 1, name, (uint32_t)block->start, last);
    return true;
}

/* in : user, of a register, no channel: channels are loaded after signals
 * out: true if it is a signal that reads the same number at `first` */
static bool same_number(const struct cb_config *config, uint8_t user, uint8_t type,
                        uint32_t first) {
    CB_ASSERT(user < CB_USER_CHANNEL);
    if (user < CB_USER_SIGNAL) return false;
    const struct cb_signal_config *signal = &config->signals[user - CB_USER_SIGNAL];
    return signal->reg == first && signal->type == type;
}

bool cb_take_read(struct cb_loader *loader, uint32_t at, uint8_t type, uint8_t user,
                  uint16_t *reg) {
    const struct cb_block_config *block = &loader->config->plc.read;
    uint8_t *users = loader->scratch->read_user;
    const uint32_t width = cb_number_registers(type);
    if (!inside(loader, at, block, "read", *reg, width)) return false;
    const uint32_t first = (uint32_t)*reg - block->start;
    for (uint32_t i = first; i < first + width; ++i) {
        const bool signal = user >= CB_USER_SIGNAL && user < CB_USER_CHANNEL;
        const bool shared = signal && same_number(loader->config, users[i], type, first);
        if (users[i] != CB_USER_NOBODY && !shared)
            return taken(loader, at, block->start + i, users[i]);
    }
    for (uint32_t i = first; i < first + width; ++i) users[i] = user;
    *reg = (uint16_t)first;
    return true;
}

bool cb_take_write(struct cb_loader *loader, uint32_t at, uint8_t type, uint8_t user,
                   uint16_t *reg) {
    const struct cb_block_config *block = &loader->config->plc.write;
    uint8_t *users = loader->scratch->write_user;
    const uint32_t width = cb_number_registers(type);
    if (!inside(loader, at, block, "write", *reg, width)) return false;
    const uint32_t first = (uint32_t)*reg - block->start;
    for (uint32_t i = first; i < first + width; ++i) {
        if (users[i] != CB_USER_NOBODY) return taken(loader, at, block->start + i, users[i]);
        users[i] = user;
    }
    *reg = (uint16_t)first;
    return true;
}

bool cb_register_holds(uint8_t type, float number) {
    const struct cb_range range = cb_number_range(type);
    const float rounded = number * (1.0f - 3.0f / 16777216.0f);
    return rounded >= range.min && rounded <= range.max;
}

void cb_take_counters(struct cb_loader *loader) {
    const struct cb_plc_config *plc = &loader->config->plc;
    if (plc->read.counters) {
        loader->scratch->read_user[0] = CB_USER_COUNTER;
        loader->scratch->read_user[plc->read.count - 1] = CB_USER_COUNTER;
    }
    if (plc->write.counters) {
        loader->scratch->write_user[0] = CB_USER_COUNTER;
        loader->scratch->write_user[plc->write.count - 1] = CB_USER_COUNTER;
    }
}
