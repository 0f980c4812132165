// SPDX-License-Identifier: MIT
// fakeplc's log (docs/fakeplc.md) of a run with compboxd: the compensation in real time.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host-tools/twin/twin_file.h"

namespace compbox::simulation {

struct plc_log {
    std::vector<double> time_s;
    std::vector<bool> active;  // the status of the box was ACTIVE
    std::vector<twin::xyz> position_mm, displacement_um, before_um, after_um;
};

// Throws input_error for another kind of file.
plc_log read_plc_log(const std::string &path);

// The stretch in which the axes moved, and the range of the true error over it about its own
// least-squares line, without and with compensation.
struct motion_figures {
    double duration_s = 0.0, feed_mm_per_min = 0.0;  // 0: nothing moved
    twin::xyz before_um = {}, after_um = {};
};
motion_figures figures_in_motion(const plc_log &log);

}  // namespace compbox::simulation
