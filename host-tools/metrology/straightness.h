// SPDX-License-Identifier: MIT
// ISO 230-1: straightness deviation about a reference line.
#pragma once

#include <vector>

namespace compbox::metrology {

// y = offset + slope * x
struct straight_line {
    double offset = 0.0, slope = 0.0;
    double at(double x) const { return offset + slope * x; }
};

// x strictly ascending, at least two points, y of the same size.
straight_line end_point_line(const std::vector<double> &x, const std::vector<double> &y);
straight_line least_squares_line(const std::vector<double> &x, const std::vector<double> &y);
// The middle line of the narrowest pair of parallel lines (distance along y) that holds all points:
// exact, from the convex hull.
straight_line minimum_zone_line(const std::vector<double> &x, const std::vector<double> &y);

// max - min of y about the line: the straightness deviation.
double deviation_about(const straight_line &line, const std::vector<double> &x,
                       const std::vector<double> &y);

}  // namespace compbox::metrology
