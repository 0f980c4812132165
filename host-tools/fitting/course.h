// SPDX-License-Identifier: MIT
// The course that points take between them, as far as they say.
#pragma once

#include <vector>

#include "host-tools/fitting/least_squares.h"

namespace compbox {

// Where the curve should pass half-way between two points: between the straight line and the cubic
// through four points there, widened by their tolerances and by half of what tells the two apart
// nearby, since readings that turn much from point to point do not say their course more closely.
struct gate {
    double x, centre, half_width;
};

// A gate for each interval. in: at least two points, a tolerance > 0 for each.
std::vector<gate> gates_of(const weighted_points &points, const std::vector<double> &tolerance);

// Inner knots with which a spline can go through every point: at points for an odd degree, between
// them for an even one, none beside the ends.
std::vector<double> interpolating_knots(const std::vector<double> &x, int degree);

}  // namespace compbox
