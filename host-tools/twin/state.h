// SPDX-License-Identifier: MIT
// All that the error of the tool depends on at one moment. Everything the twin simulates is a
// function of this and of its seed; nothing reads a clock.
#pragma once

#include <array>
#include <map>
#include <string>

#include "host-tools/twin/twin_file.h"

namespace compbox {

struct twin_state {
    twin_state() {}  // no aggregate: {1, 2, 3} is a position and never a state

    // Of the machine's life: a control starts at 0, what was measured before it is negative.
    double time_s = 0.0;
    xyz position_mm = {};  // as the control shows it: without compensation
    // By how much compensation moves the tool through each drive of each axis. An axis with one
    // drive has the same value twice.
    std::array<std::array<double, 2>, 3> drive_um = {};
    std::map<std::string, double> temperature_degC;  // by the name of the place
    double spindle_rpm = 0.0, spindle_load_percent = 0.0;
    double feed_mm_per_min = 0.0;
    double depth_of_cut_mm = 0.0;

    // The mean of each axis' drives: what moves the middle of the stage, and the tool.
    xyz displacement_um() const {
        xyz mean = {};
        for (std::size_t a = 0; a < 3; ++a) mean[a] = 0.5 * (drive_um[a][0] + drive_um[a][1]);
        return mean;
    }
};

// At rest at a place, with a compensation that both drives of an axis share.
inline twin_state state_at(const xyz &position_mm, const xyz &displacement_um = {}) {
    twin_state state;
    state.position_mm = position_mm;
    for (std::size_t a = 0; a < 3; ++a)
        state.drive_um[a] = {displacement_um[a], displacement_um[a]};
    return state;
}

}  // namespace compbox
