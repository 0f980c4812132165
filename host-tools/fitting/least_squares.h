// SPDX-License-Identifier: MIT
// Weighted least squares by B-splines: banded normal equations, one pass over the points.
#pragma once

#include <vector>

#include "host-tools/fitting/spline.h"

namespace compbox {

// Points to be approximated: x strictly ascending, weight > 0 (1 / variance).
struct weighted_points {
    std::vector<double> x, y, weight;
    std::size_t size() const { return x.size(); }
};

// Keeps its work space, so that a search over knots allocates nothing after the first fit.
class spline_least_squares {
  public:
    explicit spline_least_squares(const weighted_points &points) : points_(points) {}

    // Fits curve.control_points and the residuals (y - curve) for curve.degree and curve.knots,
    // whose range must hold every point. False when the points do not determine the curve
    // (Schoenberg-Whitney) or only barely; the curve is then meaningless.
    // O(points * degree^2 + coefficients * degree^2).
    bool fit(spline &curve);

    const std::vector<double> &residuals() const { return residuals_; }
    // Span of each point at the last fit.
    const std::vector<int> &spans() const { return spans_; }

  private:
    void collect(const spline &curve);
    bool solve(int count, int degree, std::vector<double> &right_side);

    const weighted_points &points_;
    std::vector<double> basis_, band_, residuals_, right_;
    std::vector<int> spans_;
};

}  // namespace compbox
