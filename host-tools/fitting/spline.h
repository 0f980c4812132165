// SPDX-License-Identifier: MIT
// B-splines in double precision for the fit; the box's own are models/bspline.h.
#pragma once

#include <vector>

namespace compbox::fitting {

// knots.size() == control_points.size() + degree + 1, ascending, clamped: the first and the last
// degree + 1 knots are the ends of the range. Inner knots are distinct unless stated.
struct spline {
    int degree = 3;
    std::vector<double> knots;
    std::vector<double> control_points;

    double from() const { return knots[static_cast<std::size_t>(degree)]; }
    double to() const { return knots[knots.size() - 1 - static_cast<std::size_t>(degree)]; }
};

enum { max_spline_degree = 5 };

// A clamped knot vector of the range and the strictly inner knots.
std::vector<double> clamped_knots(int degree, double from, double to,
                                  const std::vector<double> &inner);

// The knots strictly inside the range.
std::vector<double> inner_knots(const spline &curve);

// The span k with knots[k] <= x < knots[k+1]; x outside the range (and its right end) belongs to
// the first or last span. The search starts at `hint`: one step for ascending x.
int find_span(const std::vector<double> &knots, int degree, double x, int hint = 0);

// Values at x of the degree+1 basis functions that are not zero in span k: N_{k-degree} … N_k.
void basis_values(const std::vector<double> &knots, int degree, int k, double x, double *values);

// The curve at x; outside the range the value at its end, as in the box.
double value_at(const spline &curve, double x);

}  // namespace compbox::fitting
