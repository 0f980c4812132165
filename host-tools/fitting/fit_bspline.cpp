// SPDX-License-Identifier: MIT
// Our own method. Without a tolerance: the best estimate of the curve first, then the fewest knots
// that stay well inside its own uncertainty. With one: the fewest knots that keep every residual
// inside, unless that would be fitting noise.
#include <algorithm>
#include <cmath>

#include "firmware/limits.h"
#include "host-tools/fitting/knots.h"
#include "host-tools/fitting/methods.h"
#include "host-tools/formats/csv.h"

namespace compbox {

namespace {

// The curve may leave the best estimate by this part of the estimate's standard deviation: by
// itself that raises the expected error by at most 4 %, and by about 1 % in the mean.
constexpr double part_of_sigma = 0.3;

// The best estimate as points to be met, each inside its own band.
knot_task task_of_estimate(const fit_result &result) {
    const smooth_curve &best = result.best;
    knot_task task;
    task.degree = result.options.degree;
    task.max_coefficients = CB_MAX_CURVE_POINTS;
    task.guard_between = false;
    task.points.x = best.x;
    task.points.y = best.mean;
    double size = 0.0;
    for (const double y : best.mean) size = std::max(size, std::abs(y));
    const double floor = std::max(2e-7 * size, 1e-6);
    for (const double sigma : best.sigma) {
        const double tolerance = std::max(part_of_sigma * sigma, floor);
        task.tolerance.push_back(tolerance);
        task.points.weight.push_back(1.0 / (tolerance * tolerance));
    }
    return task;
}

// The measured means as points to be met, each inside the tolerance.
knot_task task_of_means(const fit_result &result) {
    knot_task task;
    task.degree = result.options.degree;
    task.max_coefficients = CB_MAX_CURVE_POINTS;
    task.points.x = result.data.position;
    task.points.y = result.data.mean;
    for (const double variance : result.data.variance) {
        task.points.weight.push_back(1.0 / variance);
        task.tolerance.push_back(result.options.tolerance_um);
    }
    return task;
}

double largest_difference(const std::vector<double> &a, const std::vector<double> &b) {
    double largest = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
    return largest;
}

// Largest distance of the means from the best estimate.
double estimate_residual(const fit_result &result) {
    std::vector<double> estimate;
    for (const std::size_t i : result.best.measured) estimate.push_back(result.best.mean[i]);
    return largest_difference(estimate, result.data.mean);
}

void fit_within_tolerance(fit_result &result) {
    const double tolerance = result.options.tolerance_um;
    const knot_task wanted = task_of_means(result);
    const knot_result found = fewest_knots(wanted);
    result.curve.bspline = found.curve;
    result.converged = found.inside;
    if (!found.inside) {
        result.warnings.push_back("no curve of degree " + std::to_string(result.options.degree) +
                                  " through these positions keeps every residual inside " +
                                  shortest(tolerance) + " " + result.data.unit);
    }
}

}  // namespace

bool round_to_float(spline &curve, const weighted_points &points) {
    std::vector<double> inner;
    for (const double knot : inner_knots(curve)) inner.push_back(to_float(knot));
    const double from = to_float(curve.from()), to = to_float(curve.to());
    curve.knots = clamped_knots(curve.degree, from, to, inner);
    spline_least_squares solver(points);
    if (!solver.fit(curve)) return false;
    for (double &c : curve.control_points) c = to_float(c);
    return true;
}

void fit_bspline(fit_result &result) {
    require_points(result, static_cast<std::size_t>(result.options.degree) + 1);
    const double tolerance = result.options.tolerance_um;
    const knot_task estimate = task_of_estimate(result);
    if (tolerance > 0.0 && tolerance >= estimate_residual(result)) {
        fit_within_tolerance(result);
        round_to_float(result.curve.bspline, task_of_means(result).points);
        return;
    }
    if (tolerance > 0.0) {
        result.converged = false;
        result.warnings.push_back("a tolerance of " + shortest(tolerance) + " " + result.data.unit +
                                  " is below what the noise permits");
    }
    result.curve.bspline = fewest_knots(estimate).curve;
    round_to_float(result.curve.bspline, estimate.points);
}

}  // namespace compbox
