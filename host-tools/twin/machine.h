// SPDX-License-Identifier: MIT
// The twin: the only place where the machine's errors are known.
//
//     twin_config config = load_twin("machine_twin.json");   // config.seed may be changed
//     twin_machine twin(config);
//     virtual_laser laser(twin);                             // laser.h: measures errors
//     nc_motion nc(config);                                  // motion.h: moves the axes
//
// Sign: an error is the displacement of the tool relative to the workpiece, and so is an applied
// compensation; the tool error is their sum. Truth is for reports after the fact: no tool that
// makes coefficients may see it.
#pragma once

#include <string>
#include <vector>

#include "host-tools/twin/geometry.h"
#include "host-tools/twin/part.h"

namespace compbox::twin {

class twin_machine {
  public:
    // config.seed determines the machine; each part and curve has its own stream.
    explicit twin_machine(const twin_config &config);

    const twin_config &config() const { return config_; }

    // For reports after the fact: the tool's error in that state without noise, the sum of the
    // parts and of the compensation in the state.
    xyz true_error_um(const twin_state &state) const;
    // The same without the unexplained part: all that a model could explain.
    xyz explained_error_um(const twin_state &state) const;
    // The unexplained part alone; zero if the machine has none.
    xyz unexplained_error_um(const twin_state &state) const;

    // At rest at time 0; displacement_um is the same for both drives of an axis.
    xyz true_error_um(const xyz &position_mm, const xyz &displacement_um = {}) const {
        return true_error_um(state_at(position_mm, displacement_um));
    }

    // For the virtual instruments.
    const compbox::twin::geometry &geometry() const { return *geometry_; }
    // One error of one axis, such as "EZX" in µm or "EAX" in µrad. The name must be configured.
    double curve_um(const std::string &name, double position_mm) const {
        return geometry_->curve(name, position_mm);
    }

  private:
    twin_config config_;
    std::shared_ptr<const compbox::twin::geometry> geometry_;
    std::vector<part_pointer> explained_;
    part_pointer unexplained_;  // null: none
};

}  // namespace compbox::twin
