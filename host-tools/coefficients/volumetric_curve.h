// SPDX-License-Identifier: MIT
// One curve of a volumetric term while it is made: what was measured and what was fitted.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "host-tools/coefficients/volumetric.h"

namespace compbox::coefficients {

constexpr const char *axis_names[3] = {"X", "Y", "Z"};
constexpr const char *squareness_names[3] = {"C0Y", "B0Z", "A0Z"};

struct volumetric_curve {
    std::string name;
    fitting::measurement data;
    fitting::fit_result fitted;

    std::size_t axis() const { return static_cast<std::size_t>(name[2] - 'X'); }
    bool is_roll() const { return name[1] - 'A' == name[2] - 'X'; }
    // out: a line through zero in the middle of the curve that rises by 1 over it; beyond it, as
    // the
    //      box evaluates a curve, the value at its end
    double rise_at(double position_mm) const {
        const double within_mm = std::clamp(position_mm, data.from(), data.to());
        return (within_mm - data.centre()) / (data.to() - data.from());
    }
    void add_rise(double size);
    // Fits the data anew. Throws input_error that names the file.
    void fit(const volumetric_options &options);
};

// Adjusts squareness and linear roll to options.diagonals: result.diagonals. Adds the linear roll
// to the curves of roll, and remarks to the result, which has the reference points.
void adjust_to_diagonals(const volumetric_options &options, std::vector<volumetric_curve> &curves,
                         volumetric_result &result);

}  // namespace compbox::coefficients
