// SPDX-License-Identifier: MIT
#include "host-tools/twin/machine.h"

#include "host-tools/twin/process_parts.h"
#include "host-tools/twin/unexplained.h"

namespace compbox::twin {

twin_machine::twin_machine(const twin_config &config)
    : config_(config), geometry_(std::make_shared<compbox::twin::geometry>(config)) {
    explained_.push_back(geometry_);
    if (!config.thermal.empty()) explained_.push_back(std::make_shared<thermal_part>(config));
    if (!config.cutting.empty()) explained_.push_back(std::make_shared<force_part>(config));
    if (config.unexplained_percent > 0.0) {
        unexplained_ = std::make_shared<unexplained>(config, explained_);
    }
}

xyz twin_machine::explained_error_um(const twin_state &state) const {
    xyz error_um = state.displacement_um();
    for (const auto &part : explained_) error_um = sum_of(error_um, part->error_um(state));
    return error_um;
}

xyz twin_machine::unexplained_error_um(const twin_state &state) const {
    return unexplained_ ? unexplained_->error_um(state) : xyz{};
}

xyz twin_machine::true_error_um(const twin_state &state) const {
    return sum_of(explained_error_um(state), unexplained_error_um(state));
}

}  // namespace compbox::twin
