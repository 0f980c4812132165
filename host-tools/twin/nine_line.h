// SPDX-License-Identifier: MIT
// A person with a laser measures an axis along nine lines: three directions at three points of
// its carriage (S2). What leaves the twin is nine files of the instrument.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host-tools/twin/machine.h"

namespace compbox {

struct nine_line_options {
    char axis = 'X';
    std::array<xyz, 3> points_mm = {};  // in the axis' own frame
    // A scale that is warmer than 20 °C is longer: its lines along the axis show that.
    double scale_ppm_per_degC = 0.0, temperature_degC = 20.0;
};

// Writes FOLDER/P1x.rtl … P3z.rtl; returns their paths. Every line is a set-up of its own, with
// offset, slope of the beam (not along the axis), approach and reading noise as virtual_laser has
// them; the other axes stand at start_mm.
std::vector<std::string> measure_nine_lines(const twin_machine &twin,
                                            const nine_line_options &options,
                                            const std::string &folder);

}  // namespace compbox
