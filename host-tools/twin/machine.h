// SPDX-License-Identifier: MIT
// The twin: the machine's geometric errors, known here and nowhere else.
//
//     twin_config config = load_twin("machine_twin.json");   // config.seed may be changed
//     twin_machine twin(config);
//     virtual_laser laser(twin);                             // laser.h: what a person may measure
//     nc_motion nc(config);                                  // motion.h: how the axes move
//
// Sign: an error is the displacement of the tool relative to the workpiece, and so is an applied
// compensation; the tool error is their sum. Truth is for reports after the fact: no tool that
// makes coefficients may see it.
#pragma once

#include <map>
#include <string>

#include "host-tools/twin/curve.h"
#include "host-tools/twin/twin_file.h"

namespace compbox {

class twin_machine {
  public:
    // The curves follow from config.seed, each from a stream of its own.
    explicit twin_machine(const twin_config &config);

    const twin_config &config() const { return config_; }

    // For reports after the fact: the geometric error of the tool in space, no noise:
    //     dx = sum of the errors EX·, dy = sum of EY·, dz = sum of EZ·, each of its own axis.
    xyz true_error_um(const xyz &position_mm) const;

    // For reports after the fact: the same with a compensation applied. displacement_um is the
    // tool displacement that the control makes (nc_motion::displacement_um()), or, at standstill,
    // the wanted displacement of the box's channels.
    xyz true_error_um(const xyz &position_mm, const xyz &displacement_um) const;

    // For the virtual instruments: one error of one axis, e.g. "EZX". The name must be configured.
    double curve_um(const std::string &name, double position_mm) const;

  private:
    struct placed_curve {
        error_name name;
        random_curve curve;
    };

    twin_config config_;
    std::map<std::string, placed_curve> curves_;
};

}  // namespace compbox
