// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/setup.h"

#include <algorithm>

#include "host-tools/formats/error.h"

namespace compbox {

namespace {

// Axes without errors, as far as the signals are named X, Y, Z.
twin_config plain_machine(const register_map &map) {
    twin_config config;
    config.machine = "a machine without errors";
    for (const auto &signal : map.signals) {
        const int index = signal.name.size() == 1 ? axis_index(signal.name[0]) : -1;
        if (index < 0) continue;
        auto &axis = config.axes[static_cast<std::size_t>(index)];
        axis.present = true;
        axis.min_mm = signal.min.value_or(0.0);
        axis.max_mm = signal.max.value_or(axis.min_mm + 1000.0);
        axis.max_velocity_mm_per_s = 20000.0 / 60.0;
        axis.acceleration_mm_per_s2 = 500.0;
        config.start_mm[static_cast<std::size_t>(index)] =
            std::min(std::max(0.0, axis.min_mm), axis.max_mm);
    }
    return config;
}

}  // namespace

plc_setup prepare(const plc_options &options) {
    plc_setup setup;
    if (!options.machine.empty()) setup.twin = load_twin(options.machine);
    const std::string path = options.map.empty() ? setup.twin.coefficients : options.map;
    if (path.empty()) {
        throw input_error(
            "no registers are known: give --map a coefficient or machine file, or "
            "name it under 'coefficients' in the twin file");
    }
    setup.map = load_register_map(path);
    if (options.machine.empty()) setup.twin = plain_machine(setup.map);
    if (options.seed) setup.twin.seed = *options.seed;
    const std::string name = options.profile.empty() ? setup.map.profile : options.profile;
    const auto profile = plc_profile::find(name);
    if (!profile) throw input_error(path, 0, 0, "plc.profile: '" + name + "' is unknown");
    setup.profile = *profile;
    return setup;
}

}  // namespace compbox
