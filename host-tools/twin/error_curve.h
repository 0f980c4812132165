// SPDX-License-Identifier: MIT
// One error of one axis as a function of its position: random about a straight line, or given.
#pragma once

#include <optional>
#include <vector>

#include "host-tools/twin/curve.h"
#include "host-tools/twin/twin_file.h"

namespace compbox::twin {

// A curve through given points: natural cubic spline, linear beyond them.
class given_curve {
  public:
    // Two points or more, positions strictly ascending.
    explicit given_curve(const std::vector<std::array<double, 2>> &points);
    double operator()(double position_mm) const;

  private:
    std::vector<double> x_, y_, bend_;  // bend: second derivative at each point
};

// in µm, or µrad for a rotation: offset + slope * (position - low end) + random or given curve.
class error_curve {
  public:
    // purpose names the random stream: each curve of a machine has its own.
    error_curve(const twin_error &error, const twin_axis &axis, const twin_config &config,
                const std::string &purpose);
    double operator()(double position_mm) const;

  private:
    double offset_, slope_, from_mm_;
    std::optional<random_curve> random_;
    std::optional<given_curve> given_;
};

}  // namespace compbox::twin
