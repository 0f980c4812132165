// SPDX-License-Identifier: MIT
// Weighted least squares by B-splines: banded normal equations, one pass over the points.
#pragma once

#include <vector>

#include "host-tools/fitting/spline.h"

namespace compbox::fitting {

// Points to approximate: x strictly ascending, weight > 0 (1 / variance).
struct weighted_points {
    std::vector<double> x, y, weight;
    std::size_t size() const { return x.size(); }
};

// Keeps its work space, so that a search over knots allocates nothing after the first fits. Keeps
// the sums of every span with unchanged knots, so that moving one knot costs only its
// neighbourhood.
class spline_least_squares {
  public:
    // The points must outlive this object and stay unchanged.
    explicit spline_least_squares(const weighted_points &points) : points_(points) {}

    // Fits curve.control_points and the residuals (y - curve) for curve.degree and curve.knots,
    // whose range must hold every point. False when the points do not determine the curve
    // (Schoenberg-Whitney), or only barely; the curve is then invalid. The result does not depend
    // on earlier fits. O(points * degree + coefficients * degree^2), and degree^2 for each point in
    // a changed span.
    bool fit(spline &curve);

    const std::vector<double> &residuals() const { return residuals_; }
    // After a fit: the points of span k of the knots are first_points()[k - degree] up to
    // first_points()[k - degree + 1].
    const std::vector<std::size_t> &first_points() const { return first_; }

  private:
    template <int order>
    bool fit_order(spline &curve);
    template <int order>
    void collect(const std::vector<double> &knots);
    template <int order>
    void add_span(const std::vector<double> &knots, std::size_t span, std::size_t end);
    template <int order>
    bool solve(std::size_t count);
    template <int order>
    void find_residuals();

    const weighted_points &points_;
    std::vector<double> knots_;  // of the last fit
    int degree_ = 0;
    std::vector<double> basis_;       // of each point
    std::vector<std::size_t> first_;  // first point of each span, and the end
    std::vector<double> sums_;        // of each span: normal equations (lower part), right side
    std::vector<double> next_sums_;   // under construction
    std::vector<std::size_t> next_first_;
    std::vector<double> band_, right_, residuals_;
};

}  // namespace compbox::fitting
