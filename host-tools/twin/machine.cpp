// SPDX-License-Identifier: MIT
#include "host-tools/twin/machine.h"

namespace compbox {

twin_machine::twin_machine(const twin_config &config) : config_(config) {
    for (const auto &[name, error] : config.errors) {
        const error_name parts = parse_error_name(name).value();
        const twin_axis &axis = config.axes[static_cast<std::size_t>(parts.axis)];
        const roughness spectrum{config.spectrum_exponent, config.spectrum_roll_off,
                                 axis.cutoff_mm};
        const random_stream stream(config.seed, "curve " + name);
        curves_.emplace(
            name, placed_curve{parts, random_curve(axis.min_mm, axis.max_mm, error.amplitude_um,
                                                   spectrum, stream)});
    }
}

xyz twin_machine::true_error_um(const xyz &position_mm) const {
    xyz error_um = {0.0, 0.0, 0.0};
    for (const auto &[name, placed] : curves_) {
        error_um[static_cast<std::size_t>(placed.name.direction)] +=
            placed.curve(position_mm[static_cast<std::size_t>(placed.name.axis)]);
    }
    return error_um;
}

xyz twin_machine::true_error_um(const xyz &position_mm, const xyz &displacement_um) const {
    xyz error_um = true_error_um(position_mm);
    for (std::size_t a = 0; a < 3; ++a) error_um[a] += displacement_um[a];
    return error_um;
}

double twin_machine::curve_um(const std::string &name, double position_mm) const {
    return curves_.at(name).curve(position_mm);
}

}  // namespace compbox
