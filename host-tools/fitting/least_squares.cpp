// SPDX-License-Identifier: MIT
#include "host-tools/fitting/least_squares.h"

#include <algorithm>
#include <cmath>

namespace compbox {

namespace {

std::size_t at(int i) {
    return static_cast<std::size_t>(i);
}

// A pivot below this part of its diagonal means that the points say (almost) nothing about the
// coefficient.
constexpr double smallest_pivot = 1e-11;

}  // namespace

// Basis values of every point, and the lower band of the normal equations: row i of band_ holds
// (i,i), (i,i-1), … (i,i-degree).
void spline_least_squares::collect(const spline &curve) {
    const int p = curve.degree, order = p + 1;
    const int count = static_cast<int>(curve.knots.size()) - order;
    const std::size_t n = points_.size();
    basis_.resize(n * at(order));
    spans_.resize(n);
    residuals_.resize(n);
    band_.assign(at(count) * at(order), 0.0);
    right_.assign(at(count), 0.0);
    int k = p;
    for (std::size_t i = 0; i < n; ++i) {
        k = find_span(curve.knots, p, points_.x[i], k);
        spans_[i] = k;
        double *basis = &basis_[i * at(order)];
        basis_values(curve.knots, p, k, points_.x[i], basis);
        const double w = points_.weight[i], wy = w * points_.y[i];
        for (int a = 0; a < order; ++a) {
            double *row = &band_[at(k - p + a) * at(order)];
            const double wa = w * basis[a];
            for (int b = 0; b <= a; ++b) row[a - b] += wa * basis[b];
            right_[at(k - p + a)] += wy * basis[a];
        }
    }
}

// Cholesky of the band in place, then both substitutions. False when a pivot is too small.
bool spline_least_squares::solve(int count, int degree, std::vector<double> &x) {
    const int order = degree + 1;
    for (int i = 0; i < count; ++i) {
        double *row = &band_[at(i) * at(order)];
        const double diagonal = row[0];
        for (int d = std::min(i, degree); d >= 1; --d) {
            const double *other = &band_[at(i - d) * at(order)];
            double sum = row[d];
            for (int e = d + 1; e <= std::min(i, degree); ++e) sum -= row[e] * other[e - d];
            row[d] = sum * other[0];
            row[0] -= row[d] * row[d];
            x[at(i)] -= row[d] * x[at(i - d)];
        }
        if (!(row[0] > smallest_pivot * diagonal)) return false;
        row[0] = 1.0 / std::sqrt(row[0]);
        x[at(i)] *= row[0];
    }
    for (int i = count - 1; i >= 0; --i) {
        const double *row = &band_[at(i) * at(order)];
        x[at(i)] *= row[0];
        for (int d = 1; d <= std::min(i, degree); ++d) x[at(i - d)] -= row[d] * x[at(i)];
    }
    return true;
}

bool spline_least_squares::fit(spline &curve) {
    const int order = curve.degree + 1;
    const int count = static_cast<int>(curve.knots.size()) - order;
    collect(curve);
    if (!solve(count, curve.degree, right_)) return false;
    curve.control_points = right_;
    for (std::size_t i = 0; i < points_.size(); ++i) {
        const double *basis = &basis_[i * at(order)];
        const double *c = &right_[at(spans_[i] - curve.degree)];
        double value = 0.0;
        for (int a = 0; a < order; ++a) value += basis[a] * c[a];
        residuals_[i] = points_.y[i] - value;
    }
    return true;
}

}  // namespace compbox
