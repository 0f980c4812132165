/* SPDX-License-Identifier: MIT
 * Velocities of the section "signals": which signal is the velocity of a position. */
#include "firmware/config/config.h"
#include "firmware/load/sections.h"

/* Units of a velocity by the unit of its position, and their factors to that unit per second. */
static const struct {
    const char *position, *velocity;
    float per_second;
} UNITS[] = {{"mm", "mm/s", 1.0f},
             {"mm", "mm/min", 1.0f / 60.0f},
             {"deg", "deg/s", 1.0f},
             {"deg", "deg/min", 1.0f / 60.0f}};

static bool find_scale(struct cb_loader *loader, uint32_t at, struct cb_signal_config *position) {
    const struct cb_signal_config *velocity = &loader->config->signals[position->velocity];
    for (uint32_t i = 0; i < sizeof UNITS / sizeof UNITS[0]; ++i) {
        if (!cb_same_text(position->unit, UNITS[i].position)) continue;
        if (!cb_same_text(velocity->unit, UNITS[i].velocity)) continue;
        position->velocity_scale = UNITS[i].per_second;
        return true;
    }
    return cb_fail(loader, CB_ERROR_NAME, at,
                   "the velocity of a position in %s has the unit %s/s or %s/min, and %s has %s",
                   position->unit, position->unit, position->unit, velocity->name, velocity->unit);
}

static bool read_velocity(struct cb_loader *loader, uint32_t at,
                          struct cb_signal_config *position) {
    const struct cb_config *config = loader->config;
    char name[CB_NAME_SIZE];
    if (!cb_read_name(loader, at, name)) return false;
    if (!position->leads)
        return cb_fail(loader, CB_ERROR_KEY, at,
                       "only a position from the PLC, in mm or deg, has a velocity");
    position->velocity =
        cb_find_name(config->signals, sizeof config->signals[0], config->signals_count, name);
    if (position->velocity == CB_NONE)
        return cb_fail(loader, CB_ERROR_NAME, at, "no signal is called %o", at);
    if (config->signals[position->velocity].source != CB_SOURCE_PLC)
        return cb_fail(loader, CB_ERROR_NAME, at, "%o is not from the PLC, as the position is", at);
    return find_scale(loader, at, position);
}

bool cb_resolve_velocities(struct cb_loader *loader, uint32_t at) {
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        struct cb_signal_config *position = &loader->config->signals[list.index];
        const uint32_t velocity = cb_find_key(loader, list.at, "velocity");
        if (velocity != CB_ABSENT && !read_velocity(loader, velocity, position)) return false;
    }
    return true;
}
