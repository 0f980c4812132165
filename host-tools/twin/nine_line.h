// SPDX-License-Identifier: MIT
// Measurement of an axis along nine lines with a laser: three directions at three or more points of
// its carriage (S2). The output is a file of the instrument for each line.
#pragma once

#include <string>
#include <vector>

#include "host-tools/twin/machine.h"

namespace compbox::twin {

struct nine_line_options {
    char axis = 'X';
    std::vector<xyz> points_mm = {};  // P1, P2, P3 …, in the axis' own frame
    // A scale warmer than 20 °C is longer, which affects the lines along its axis.
    double scale_ppm_per_degC = 0.0, temperature_degC = 20.0;
};

// Writes FOLDER/P1x.rtl … P3z.rtl, and on. out: their paths. Every line is a separate set-up, with
// offset, slope of the beam (not along the axis), approach and reading noise as in virtual_laser;
// the other axes are at start_mm.
std::vector<std::string> measure_nine_lines(const twin_machine &twin,
                                            const nine_line_options &options,
                                            const std::string &folder);

}  // namespace compbox::twin
