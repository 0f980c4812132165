// SPDX-License-Identifier: MIT
// S1 as published: key points are the control points of a cubic B-spline. First the two ends and
// the eight largest local maxima of curvature, then repeatedly the point with the largest residual,
// until all residuals are inside the tolerance or no point is left.
//
// S1's curve is parametric, C(t) = (x(t), y(t)), with t the accumulated chord length; the box's is
// a function of x. Chord length over mm and um equals x within one part in 10^7, so t = x here. The
// residual of a measured point is taken where x(t) is its position. x(t) ascends because its
// control points do, so the finished curve is written as a function of x on the images of its
// knots, halved until the loss is negligible.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "firmware/base/limits.h"
#include "host-tools/fitting/least_squares.h"
#include "host-tools/fitting/methods.h"
#include "host-tools/formats/error.h"

namespace compbox::fitting {

namespace {

constexpr std::size_t curvature_points = 8;  // S1
constexpr double default_tolerance = 0.045;  // S1: 9 um for EZX, whose range was 200 um

// Discrete curvature at each inner point: the second divided difference, because slopes are about
// 10^-6.
std::vector<double> curvatures(const measurement &data) {
    const auto &x = data.position, &y = data.mean;
    std::vector<double> k(x.size(), 0.0);
    for (std::size_t i = 1; i + 1 < x.size(); ++i) {
        const double before = (y[i] - y[i - 1]) / (x[i] - x[i - 1]);
        const double after = (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
        k[i] = std::abs(2.0 * (after - before) / (x[i + 1] - x[i - 1]));
    }
    return k;
}

// Indices of the first key points, ascending.
std::vector<std::size_t> first_key_points(const measurement &data) {
    const auto k = curvatures(data);
    std::vector<std::size_t> maxima;
    for (std::size_t i = 1; i + 1 < k.size(); ++i) {
        if (k[i] > k[i - 1] && k[i] > k[i + 1]) maxima.push_back(i);
    }
    std::stable_sort(maxima.begin(), maxima.end(),
                     [&](std::size_t a, std::size_t b) { return k[a] > k[b]; });
    if (maxima.size() > curvature_points) maxima.resize(curvature_points);
    maxima.push_back(0);
    maxima.push_back(data.position.size() - 1);
    std::sort(maxima.begin(), maxima.end());
    return maxima;
}

// x(t) and y(t) over the same knots.
struct plane_curve {
    spline x, y;
};

// Knots are averages of the parameters of `degree` neighbouring key points, as usual.
plane_curve curve_of(const measurement &data, const std::vector<std::size_t> &keys, int degree) {
    const auto p = static_cast<std::size_t>(degree);
    std::vector<double> inner;
    for (std::size_t j = 1; j + p < keys.size(); ++j) {
        double sum = 0.0;
        for (std::size_t i = j; i < j + p; ++i) sum += data.position[keys[i]];
        inner.push_back(sum / degree);
    }
    plane_curve curve;
    curve.x.degree = curve.y.degree = degree;
    curve.x.knots = curve.y.knots = clamped_knots(degree, data.from(), data.to(), inner);
    for (const std::size_t key : keys) {
        curve.x.control_points.push_back(data.position[key]);
        curve.y.control_points.push_back(data.mean[key]);
    }
    return curve;
}

// y at the parameter with x(t) = x, by bisection: x(t) ascends.
double height_at(const plane_curve &curve, double x) {
    double low = curve.x.from(), high = curve.x.to();
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (value_at(curve.x, middle) < x ? low : high) = middle;
    }
    return value_at(curve.y, 0.5 * (low + high));
}

// The measured point with the largest residual that is no key point yet; `worst` is the largest of
// all points.
std::size_t worst_point(const measurement &data, const plane_curve &curve,
                        const std::vector<std::size_t> &keys, double &worst) {
    std::size_t found = data.position.size();
    double largest = -1.0;
    worst = 0.0;
    for (std::size_t i = 0; i < data.position.size(); ++i) {
        const double residual = std::abs(data.mean[i] - height_at(curve, data.position[i]));
        worst = std::max(worst, residual);
        if (residual <= largest || std::binary_search(keys.begin(), keys.end(), i)) continue;
        largest = residual;
        found = i;
    }
    return found;
}

// The parametric curve at many t, as points of a function.
weighted_points sample(const plane_curve &curve, int per_span) {
    weighted_points points;
    const auto &t = curve.x.knots;
    const auto p = static_cast<std::size_t>(curve.x.degree);
    for (std::size_t k = p; k + p + 1 < t.size(); ++k) {
        for (int i = 0; i < per_span && t[k + 1] > t[k]; ++i) {
            const double at = t[k] + (t[k + 1] - t[k]) * i / per_span;
            points.x.push_back(value_at(curve.x, at));
            points.y.push_back(value_at(curve.y, at));
        }
    }
    points.x.push_back(curve.x.control_points.back());
    points.y.push_back(curve.y.control_points.back());
    points.weight.assign(points.x.size(), 1.0);
    return points;
}

// The images of the knots, with each span divided into `pieces`.
std::vector<double> function_knots(const plane_curve &curve, int pieces) {
    std::vector<double> knots;
    const auto &t = curve.x.knots;
    const auto p = static_cast<std::size_t>(curve.x.degree);
    for (std::size_t k = p; k + p + 1 < t.size(); ++k) {
        for (int i = 0; i < pieces; ++i) {
            if (k == p && i == 0) continue;
            knots.push_back(value_at(curve.x, t[k] + (t[k + 1] - t[k]) * i / pieces));
        }
    }
    return knots;
}

// The curve as a function of x, to within `loss`; without knots where float32 cannot hold them.
// out: the actual loss
double to_function(const plane_curve &curve, double loss, spline &function) {
    const weighted_points points = sample(curve, 64);
    double lost = 0.0;
    for (int pieces = 1; pieces <= 8; pieces *= 2) {
        const auto inner = function_knots(curve, pieces);
        const auto coefficients = inner.size() + static_cast<std::size_t>(curve.x.degree) + 1;
        if (coefficients > CB_MAX_CURVE_POINTS) break;
        spline next;
        next.degree = curve.x.degree;
        next.knots = clamped_knots(next.degree, curve.x.control_points.front(),
                                   curve.x.control_points.back(), inner);
        if (!round_to_float(next, points)) break;
        function = next;
        lost = 0.0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            lost = std::max(lost, std::abs(points.y[i] - value_at(next, points.x[i])));
        }
        if (lost <= loss) break;
    }
    return lost;
}

}  // namespace

void fit_lmc(fit_result &result) {
    const measurement &data = result.data;
    require_points(result, static_cast<std::size_t>(result.options.degree) + 1);
    const auto [low, high] = std::minmax_element(data.mean.begin(), data.mean.end());
    const double tolerance = result.options.tolerance_um > 0.0 ? result.options.tolerance_um
                                                               : default_tolerance * (*high - *low);
    result.options.tolerance_um = tolerance;
    auto keys = first_key_points(data);
    while (keys.size() < static_cast<std::size_t>(result.options.degree) + 1) {
        std::size_t spare = 0;
        while (std::binary_search(keys.begin(), keys.end(), spare)) ++spare;
        keys.insert(std::upper_bound(keys.begin(), keys.end(), spare), spare);
    }
    plane_curve curve;
    double worst = 0.0;
    for (;;) {
        curve = curve_of(data, keys, result.options.degree);
        const std::size_t next = worst_point(data, curve, keys, worst);
        result.key_steps.push_back({keys.size(), worst});
        result.converged = worst <= tolerance;
        if (result.converged || next == data.position.size()) break;
        if (keys.size() + 1 > CB_MAX_CURVE_POINTS) break;
        keys.insert(std::upper_bound(keys.begin(), keys.end(), next), next);
    }
    result.key_points = keys.size();
    const double lost = to_function(curve, 0.01 * tolerance, result.curve.bspline);
    if (result.curve.bspline.knots.empty()) {
        throw input_error(data.file, 0, 0,
                          "positions near {} mm are too close together for the box to distinguish",
                          data.from());
    }
    if (!result.converged) {
        result.warnings.push_back(
            fmt::format("did not converge: with {}{} points as key points a residual of {:.3g} "
                        "{} stays above the tolerance of {:.3g} {}",
                        keys.size() == data.position.size() ? "all " : "", keys.size(), worst,
                        data.unit, tolerance, data.unit));
    }
    if (lost > 0.1 * tolerance) {
        result.warnings.push_back(fmt::format(
            "writing the parametric curve as a function of x costs {:.3g} {}", lost, data.unit));
    }
}

}  // namespace compbox::fitting
