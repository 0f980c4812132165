// SPDX-License-Identifier: MIT
#include "host-tools/fitting/spline.h"

#include <algorithm>

namespace compbox::fitting {

namespace {

std::size_t at(int i) {
    return static_cast<std::size_t>(i);
}

}  // namespace

std::vector<double> clamped_knots(int degree, double from, double to,
                                  const std::vector<double> &inner) {
    std::vector<double> knots(at(degree) + 1, from);
    knots.insert(knots.end(), inner.begin(), inner.end());
    knots.insert(knots.end(), at(degree) + 1, to);
    return knots;
}

std::vector<double> inner_knots(const spline &curve) {
    return {curve.knots.begin() + curve.degree + 1, curve.knots.end() - curve.degree - 1};
}

int find_span(const std::vector<double> &knots, int degree, double x, int hint) {
    const int last = static_cast<int>(knots.size()) - degree - 2;
    int k = std::clamp(hint, degree, last);
    if (knots[at(k)] <= x && (k == last || x < knots[at(k + 1)])) return k;
    if (k < last && knots[at(k + 1)] <= x && (k + 1 == last || x < knots[at(k + 2)])) return k + 1;
    const auto begin = knots.begin() + degree + 1, end = knots.begin() + last + 1;
    k = static_cast<int>(std::upper_bound(begin, end, x) - knots.begin()) - 1;
    return std::clamp(k, degree, last);
}

void basis_values(const std::vector<double> &knots, int degree, int k, double x, double *values) {
    double left[max_spline_degree + 1], right[max_spline_degree + 1];
    values[0] = 1.0;
    for (int j = 1; j <= degree; ++j) {
        left[j] = x - knots[at(k + 1 - j)];
        right[j] = knots[at(k + j)] - x;
        double carried = 0.0;
        for (int r = 0; r < j; ++r) {
            const double share = values[r] / (right[r + 1] + left[j - r]);
            values[r] = carried + right[r + 1] * share;
            carried = left[j - r] * share;
        }
        values[j] = carried;
    }
}

double value_at(const spline &curve, double x) {
    const double inside = std::clamp(x, curve.from(), curve.to());
    const int k = find_span(curve.knots, curve.degree, inside);
    double basis[max_spline_degree + 1];
    basis_values(curve.knots, curve.degree, k, inside, basis);
    double value = 0.0;
    for (int j = 0; j <= curve.degree; ++j) {
        value += basis[j] * curve.control_points[at(k - curve.degree + j)];
    }
    return value;
}

}  // namespace compbox::fitting
