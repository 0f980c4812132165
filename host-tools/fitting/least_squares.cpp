// SPDX-License-Identifier: MIT
#include "host-tools/fitting/least_squares.h"

#include <algorithm>
#include <cmath>

namespace compbox::fitting {

namespace {

std::size_t at(int i) {
    return static_cast<std::size_t>(i);
}

// A pivot below this fraction of its diagonal means that the points (almost) do not determine the
// coefficient.
constexpr double smallest_pivot = 1e-11;

// Number of sums of one span: the lower triangle row by row, then the right side.
template <int order>
constexpr std::size_t sums_size = order *(order + 1) / 2 + order;

}  // namespace

// The points from next_first_[span] on that are in the span (those before `end`): their basis
// values, their sums, and the start of the next span.
template <int order>
void spline_least_squares::add_span(const std::vector<double> &knots, std::size_t span,
                                    std::size_t end) {
    const std::size_t k = span + order - 1, last = knots.size() - order - 1;
    const double upper = knots[k + 1];
    double sums[sums_size<order>] = {};
    std::size_t i = next_first_[span];
    for (; i < end && (k == last || points_.x[i] < upper); ++i) {
        double *basis = &basis_[i * order];
        basis_values(knots, order - 1, static_cast<int>(k), points_.x[i], basis);
        const double w = points_.weight[i], wy = w * points_.y[i];
        double *sum = sums;
        for (int a = 0; a < order; ++a) {
            const double wa = w * basis[a];
            for (int b = 0; b <= a; ++b) *sum++ += wa * basis[b];
        }
        for (int a = 0; a < order; ++a) *sum++ += wy * basis[a];
    }
    next_first_[span + 1] = i;
    std::copy(sums, sums + sums_size<order>, &next_sums_[span * sums_size<order>]);
}

// Sums of every span. They are reused where all knots of its basis are those of the last fit,
// counted from the left or from the right end, and recomputed between.
template <int order>
void spline_least_squares::collect(const std::vector<double> &knots) {
    constexpr std::size_t degree = order - 1;
    const std::size_t size = knots.size(), spans = size - 2 * degree - 1;
    const std::size_t least = std::min(size, knots_.size());
    std::size_t left = 0, right = 0;
    while (left < least && knots[left] == knots_[left]) ++left;
    while (right < least - left && knots[size - 1 - right] == knots_[knots_.size() - 1 - right]) {
        ++right;
    }
    const std::size_t kept = std::min(left > 2 * degree ? left - 2 * degree : 0, spans);
    const std::size_t resumed = std::min(size - right - 1, spans);
    const std::size_t shift = knots_.size();  // old span = span + shift - size
    next_first_.resize(spans + 1);
    next_sums_.resize(spans * sums_size<order>);
    std::copy_n(sums_.begin(), kept * sums_size<order>, next_sums_.begin());
    if (kept > 0) std::copy_n(first_.begin(), kept + 1, next_first_.begin());
    if (kept == 0) next_first_[0] = 0;
    const std::size_t end = resumed < spans ? first_[resumed + shift - size] : points_.size();
    for (std::size_t span = kept; span < resumed; ++span) add_span<order>(knots, span, end);
    for (std::size_t span = resumed; span < spans; ++span) {
        const std::size_t old = span + shift - size;
        std::copy_n(&sums_[old * sums_size<order>], sums_size<order>,
                    &next_sums_[span * sums_size<order>]);
        next_first_[span] = first_[old];
    }
    next_first_[spans] = points_.size();
    sums_.swap(next_sums_);
    first_.swap(next_first_);
    knots_ = knots;
}

// The lower band of the normal equations (row i holds (i,i), (i,i-1), …) is factored in place by
// Cholesky, then both substitutions run in right_. False when a pivot is too small.
template <int order>
bool spline_least_squares::solve(std::size_t count) {
    band_.assign(count * order, 0.0);
    right_.assign(count, 0.0);
    for (std::size_t span = 0; span + order <= count; ++span) {
        const double *sum = &sums_[span * sums_size<order>];
        for (int a = 0; a < order; ++a) {
            double *row = &band_[(span + at(a)) * order];
            for (int b = 0; b <= a; ++b) row[a - b] += *sum++;
        }
        for (int a = 0; a < order; ++a) right_[span + at(a)] += *sum++;
    }
    double *x = right_.data();
    for (std::size_t i = 0; i < count; ++i) {
        double *row = &band_[i * order];
        const double diagonal = row[0];
        const int reach = static_cast<int>(std::min<std::size_t>(i, order - 1));
        for (int d = reach; d >= 1; --d) {
            const double *other = &band_[(i - at(d)) * order];
            double sum = row[d];
            for (int e = d + 1; e <= reach; ++e) sum -= row[e] * other[e - d];
            row[d] = sum * other[0];
            row[0] -= row[d] * row[d];
            x[i] -= row[d] * x[i - at(d)];
        }
        if (!(row[0] > smallest_pivot * diagonal)) return false;
        row[0] = 1.0 / std::sqrt(row[0]);
        x[i] *= row[0];
    }
    for (std::size_t i = count; i-- > 0;) {
        const double *row = &band_[i * order];
        x[i] *= row[0];
        const int reach = static_cast<int>(std::min<std::size_t>(i, order - 1));
        for (int d = 1; d <= reach; ++d) x[i - at(d)] -= row[d] * x[i];
    }
    return true;
}

template <int order>
void spline_least_squares::find_residuals() {
    for (std::size_t span = 0; span + 1 < first_.size(); ++span) {
        const double *c = &right_[span];
        for (std::size_t i = first_[span]; i < first_[span + 1]; ++i) {
            const double *basis = &basis_[i * order];
            double value = 0.0;
            for (int a = 0; a < order; ++a) value += basis[a] * c[a];
            residuals_[i] = points_.y[i] - value;
        }
    }
}

template <int order>
bool spline_least_squares::fit_order(spline &curve) {
    basis_.resize(points_.size() * order);
    residuals_.resize(points_.size());
    collect<order>(curve.knots);
    if (!solve<order>(curve.knots.size() - order)) return false;
    curve.control_points = right_;
    find_residuals<order>();
    return true;
}

bool spline_least_squares::fit(spline &curve) {
    if (curve.degree != degree_) knots_.clear();
    degree_ = curve.degree;
    switch (degree_) {
        case 1:
            return fit_order<2>(curve);
        case 2:
            return fit_order<3>(curve);
        case 3:
            return fit_order<4>(curve);
        case 4:
            return fit_order<5>(curve);
        default:
            return fit_order<6>(curve);
    }
}

}  // namespace compbox::fitting
