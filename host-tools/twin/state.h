// SPDX-License-Identifier: MIT
// State that determines the error of the tool at one moment. The simulation is a function of the
// state and of the seed; nothing reads a clock.
#pragma once

#include <array>
#include <map>
#include <string>

#include "host-tools/twin/twin_file.h"

namespace compbox::twin {

struct twin_state {
    twin_state() {}  // no aggregate: {1, 2, 3} is a position and never a state

    // Age of the machine: a control starts at 0, earlier measurements have negative times.
    double time_s = 0.0;
    xyz position_mm = {};  // as displayed by the control: without compensation
    // Displacement of the tool by the compensation of each drive of each axis. An axis with one
    // drive has the same value twice.
    std::array<std::array<double, 2>, 3> drive_um = {};
    std::map<std::string, double> temperature_degC;  // by the name of the place
    double spindle_rpm = 0.0, spindle_load_percent = 0.0;
    double feed_mm_per_min = 0.0;
    double depth_of_cut_mm = 0.0;

    // The mean of each axis' drives, which moves the middle of the stage and the tool.
    xyz displacement_um() const {
        xyz mean = {};
        for (std::size_t a = 0; a < 3; ++a) mean[a] = 0.5 * (drive_um[a][0] + drive_um[a][1]);
        return mean;
    }
};

// At rest at a position, with the same compensation for both drives of an axis.
inline twin_state state_at(const xyz &position_mm, const xyz &displacement_um = {}) {
    twin_state state;
    state.position_mm = position_mm;
    for (std::size_t a = 0; a < 3; ++a)
        state.drive_um[a] = {displacement_um[a], displacement_um[a]};
    return state;
}

}  // namespace compbox::twin
