// SPDX-License-Identifier: MIT
#include "host-tools/fitting/course.h"

#include <algorithm>
#include <cmath>

namespace compbox::fitting {

namespace {

// Value at `middle` of the cubic through the (up to) four points around x[i] … x[i+1].
double cubic_at(const weighted_points &points, long i, double middle) {
    const auto &x = points.x, &y = points.y;
    const auto n = static_cast<long>(x.size());
    const long first = std::clamp(i - 1, 0L, std::max(n - 4, 0L));
    const long last = std::min(first + 4, n);
    double cubic = 0.0;
    for (long a = first; a < last; ++a) {
        const auto p = static_cast<std::size_t>(a);
        double share = 1.0;
        for (long b = first; b < last; ++b) {
            const auto q = static_cast<std::size_t>(b);
            if (a != b) share *= (middle - x[q]) / (x[p] - x[q]);
        }
        cubic += share * y[p];
    }
    return cubic;
}

}  // namespace

std::vector<gate> gates_of(const weighted_points &points, const std::vector<double> &tolerance) {
    const auto &x = points.x, &y = points.y;
    const std::size_t count = x.size() - 1;
    std::vector<gate> gates(count);
    std::vector<double> apart(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double middle = 0.5 * (x[i] + x[i + 1]), chord = 0.5 * (y[i] + y[i + 1]);
        const double cubic = cubic_at(points, static_cast<long>(i), middle);
        gates[i] = {middle, 0.5 * (chord + cubic), 0.5 * std::abs(chord - cubic)};
        apart[i] = std::abs(chord - cubic);
    }
    for (std::size_t i = 0; i < count; ++i) {
        const double before = apart[i > 0 ? i - 1 : i], after = apart[i + 1 < count ? i + 1 : i];
        gates[i].half_width += 1.5 * std::max(tolerance[i], tolerance[i + 1]) +
                               0.5 * std::max({before, apart[i], after});
    }
    return gates;
}

std::vector<double> interpolating_knots(const std::vector<double> &x, int degree) {
    const auto first = static_cast<std::size_t>((degree + 1) / 2);
    const std::size_t count = x.size() - static_cast<std::size_t>(degree) - 1;
    std::vector<double> inner;
    for (std::size_t j = first; j < first + count; ++j) {
        inner.push_back(degree % 2 ? x[j] : 0.5 * (x[j - 1] + x[j]));
    }
    return inner;
}

}  // namespace compbox::fitting
