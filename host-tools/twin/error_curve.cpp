// SPDX-License-Identifier: MIT
#include "host-tools/twin/error_curve.h"

#include <algorithm>

namespace compbox::twin {

// Second derivatives of the natural spline: a tridiagonal system, by elimination.
given_curve::given_curve(const std::vector<std::array<double, 2>> &points) {
    const std::size_t n = points.size();
    for (const auto &point : points) {
        x_.push_back(point[0]);
        y_.push_back(point[1]);
    }
    bend_.assign(n, 0.0);
    std::vector<double> above(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        const double before = x_[i] - x_[i - 1], after = x_[i + 1] - x_[i];
        const double kink = (y_[i + 1] - y_[i]) / after - (y_[i] - y_[i - 1]) / before;
        const double pivot = 2.0 * (before + after) - before * above[i - 1];
        above[i] = after / pivot;
        bend_[i] = (6.0 * kink - before * bend_[i - 1]) / pivot;
    }
    for (std::size_t i = n - 1; i-- > 1;) bend_[i] -= above[i] * bend_[i + 1];
}

double given_curve::operator()(double position_mm) const {
    const double inside_mm = std::clamp(position_mm, x_.front(), x_.back());
    const auto next = std::upper_bound(x_.begin() + 1, x_.end() - 1, inside_mm);
    const auto i = static_cast<std::size_t>(next - x_.begin());
    const double step = x_[i] - x_[i - 1], b = (inside_mm - x_[i - 1]) / step, a = 1.0 - b;
    const double value =
        a * y_[i - 1] + b * y_[i] +
        ((a * a * a - a) * bend_[i - 1] + (b * b * b - b) * bend_[i]) * step * step / 6.0;
    const double slope =
        (y_[i] - y_[i - 1]) / step +
        ((1.0 - 3.0 * a * a) * bend_[i - 1] + (3.0 * b * b - 1.0) * bend_[i]) * step / 6.0;
    return value + slope * (position_mm - inside_mm);
}

error_curve::error_curve(const twin_error &error, const twin_axis &axis, const twin_config &config,
                         const std::string &purpose)
    : offset_(error.offset), slope_(error.slope_per_mm), from_mm_(axis.min_mm) {
    if (!error.points.empty()) {
        given_.emplace(error.points);
        return;
    }
    const roughness spectrum{config.spectrum_exponent, config.spectrum_roll_off, axis.cutoff_mm};
    random_.emplace(axis.min_mm, axis.max_mm, error.amplitude, spectrum,
                    random_stream(config.seed, "curve " + purpose));
}

double error_curve::operator()(double position_mm) const {
    const double curve = random_ ? (*random_)(position_mm) : (*given_)(position_mm);
    return curve + offset_ + slope_ * (position_mm - from_mm_);
}

}  // namespace compbox::twin
