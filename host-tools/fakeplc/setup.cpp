// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/setup.h"

#include <algorithm>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/register_layout.h"

namespace compbox::fakeplc {

namespace {

constexpr double plain_travel_mm = 1000.0;

// out: axis of a channel by its name: Z, or Z1 and Z2 of a stage with two motors
char axis_moved_by(const std::string &channel) {
    const bool named = twin::axis_index(channel[0]) >= 0 &&
                       channel.find_first_not_of("0123456789", 1) == std::string::npos;
    return named ? channel[0] : twin::no_axis;
}

// out: machine with X, Y and Z without errors, with the ranges of the signals of these names
twin::twin_config plain_machine(const register_map &map) {
    twin::twin_config config;
    config.machine = "a machine without errors";
    for (auto &axis : config.axes) {
        axis.present = true;
        axis.max_mm = plain_travel_mm;
        axis.max_velocity_mm_per_s = 20000.0 / 60.0;
        axis.acceleration_mm_per_s2 = 500.0;
    }
    for (const auto &signal : map.signals) {
        const char letter = axis_moved_by(signal.name);
        if (letter == twin::no_axis) continue;
        const auto index = static_cast<std::size_t>(twin::axis_index(letter));
        auto &axis = config.axes[index];
        const double lowest_mm = signal.max ? std::min(0.0, *signal.max - plain_travel_mm) : 0.0;
        axis.min_mm = signal.min.value_or(lowest_mm);
        axis.max_mm = signal.max.value_or(axis.min_mm + plain_travel_mm);
        config.start_mm[index] = std::min(std::max(0.0, axis.min_mm), axis.max_mm);
    }
    for (const auto &channel : map.channels) {
        config.channels[channel.name] = axis_moved_by(channel.name);
    }
    return config;
}

// What compbox init lays out for the twin's axes, each with a position and a channel.
register_map usual_map(const plc_options &options, const twin::twin_config &twin) {
    std::vector<std::string> positions;
    std::vector<formats::layout_channel> channels;
    for (std::size_t a = 0; a < twin.axes.size(); ++a) {
        if (!options.machine.empty() && !twin.axes[a].present) continue;
        const std::string axis(1, twin::axis_letters[a]);
        positions.push_back(axis);
        channels.push_back({axis, axis});
    }
    const std::string profile = options.profile.empty() ? "generic" : options.profile;
    return register_map_of(formats::register_layout(profile, positions, channels), "");
}

// out: the register map that the user named, else the usual one for the machine's axes
register_map registers_for(const plc_options &options, const twin::twin_config &twin) {
    const std::string path = options.map.empty() ? twin.coefficients : options.map;
    if (!path.empty()) return load_register_map(path);
    return usual_map(options, twin);
}

}  // namespace

plc_setup prepare(const plc_options &options) {
    plc_setup setup;
    if (!options.machine.empty()) setup.twin = twin::load_twin(options.machine);
    setup.map = registers_for(options, setup.twin);
    if (options.machine.empty()) setup.twin = plain_machine(setup.map);
    if (options.seed) setup.twin.seed = *options.seed;
    if (options.size_um) {
        setup.twin.plc.size_um = *options.size_um;
        setup.twin.plc.axis_size_um = {};
    }
    const std::string name = options.profile.empty() ? setup.map.profile : options.profile;
    const auto profile = plc_profile::find(name);
    if (!profile) throw input_error(setup.map.file, 0, 0, "plc.profile: '{}' is unknown", name);
    setup.profile = *profile;
    return setup;
}

}  // namespace compbox::fakeplc
