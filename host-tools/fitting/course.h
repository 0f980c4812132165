// SPDX-License-Identifier: MIT
// Range of a curve between its points, as far as the points define it.
#pragma once

#include <vector>

#include "host-tools/fitting/least_squares.h"

namespace compbox::fitting {

// Range for the curve half-way between two points: between the straight line and the cubic through
// four points there. It is widened by their tolerances and by half of the difference of line and
// cubic nearby, because readings that bend strongly from point to point define their course less
// closely.
struct gate {
    double x, centre, half_width;
};

// A gate for each interval. in: at least two points, a tolerance > 0 for each.
std::vector<gate> gates_of(const weighted_points &points, const std::vector<double> &tolerance);

// Inner knots with which a spline can pass through every point: at points for an odd degree,
// between them for an even one, none beside the ends.
std::vector<double> interpolating_knots(const std::vector<double> &x, int degree);

}  // namespace compbox::fitting
