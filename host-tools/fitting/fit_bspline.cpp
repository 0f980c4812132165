// SPDX-License-Identifier: MIT
// The B-spline method. Without a tolerance: the best estimate of the curve, then the fewest knots
// that stay well inside its uncertainty. With a tolerance: the fewest knots that keep every
// residual inside, also if that follows the noise, which causes a warning.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "firmware/base/limits.h"
#include "host-tools/fitting/knots.h"
#include "host-tools/fitting/methods.h"
#include "host-tools/formats/csv.h"

namespace compbox::fitting {

namespace {

// The curve may deviate from the best estimate by this fraction of the estimate's standard
// deviation. This raises the expected error by at most 4 %, and by about 1 % in the mean.
constexpr double part_of_sigma = 0.3;

// A curve that swings between two readings by more than this fraction of the readings' range causes
// a warning.
constexpr double worth_a_word = 0.02;

// The best estimate as points to approximate, each within its band.
knot_task task_of_estimate(const fit_result &result) {
    const smooth_curve &best = result.best;
    knot_task task;
    task.degree = result.options.degree;
    task.max_coefficients = CB_MAX_CURVE_POINTS;
    task.guard_between = false;
    task.patience = 8;
    task.mendable = 4.0;
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

// The measured means as points to approximate, each within the tolerance.
knot_task task_of_means(const fit_result &result, double tolerance) {
    knot_task task;
    task.degree = result.options.degree;
    task.max_coefficients = CB_MAX_CURVE_POINTS;
    task.points.x = result.data.position;
    task.points.y = result.data.mean;
    for (const double variance : result.data.variance) {
        task.points.weight.push_back(1.0 / variance);
        task.tolerance.push_back(tolerance);
    }
    return task;
}

// Largest distance of the means from the best estimate; a smaller tolerance follows the noise.
double estimate_residual(const fit_result &result) {
    double largest = 0.0;
    for (std::size_t i = 0; i < result.best.measured.size(); ++i) {
        const double estimate = result.best.mean[result.best.measured[i]];
        largest = std::max(largest, std::abs(estimate - result.data.mean[i]));
    }
    return largest;
}

double largest_residual(const fit_result &result) {
    double largest = 0.0;
    for (std::size_t i = 0; i < result.data.position.size(); ++i) {
        const double off = result.data.mean[i] - result.curve.value(result.data.position[i]);
        largest = std::max(largest, std::abs(off));
    }
    return largest;
}

// in : swing: the curve's largest excursion between readings, unit of the error
// out: warnings for a tolerance that is not met, makes the curve swing, or is below the noise
void warn_of_tolerance(fit_result &result, double swing) {
    const double tolerance = result.options.tolerance_um;
    const std::string wanted = fmt::format("{} {}", tolerance, result.data.unit);
    const auto &mean = result.data.mean;
    const auto [low, high] = std::minmax_element(mean.begin(), mean.end());
    if (!result.converged) {
        result.warnings.push_back(fmt::format(
            "did not converge: no curve of degree {} with at most {} coefficients was found that "
            "keeps every residual inside {}",
            result.options.degree,
            std::min<std::size_t>(result.data.position.size(), CB_MAX_CURVE_POINTS), wanted));
    } else if (swing > std::max(worth_a_word * (*high - *low), tolerance)) {
        result.warnings.push_back("within " + wanted +
                                  " the curve swings out between readings; allow more, or measure "
                                  "more closely where the plot shows it");
    }
    if (result.converged && tolerance < estimate_residual(result)) {
        result.warnings.push_back("a tolerance of " + wanted + " is less than the noise (about " +
                                  noise_text(result) + " a reading): the curve may follow noise");
    }
}

// The tolerance applies to the written curve. The search therefore keeps a margin for the rounding
// to float32, and a larger one if the first was too small.
void fit_within_tolerance(fit_result &result) {
    const double tolerance = result.options.tolerance_um;
    double swing = 0.0;
    for (const double part : {0.9999, 0.99, 0.9, 0.5}) {
        const knot_task task = task_of_means(result, part * tolerance);
        const knot_result found = fewest_knots(task);
        result.curve.bspline = found.curve;
        swing = found.swing;
        round_to_float(result.curve.bspline, task.points);
        result.converged = largest_residual(result) <= tolerance;
        if (result.converged || !found.inside) break;
    }
    warn_of_tolerance(result, swing);
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
    if (result.options.tolerance_um > 0.0) {
        fit_within_tolerance(result);
        return;
    }
    const knot_task estimate = task_of_estimate(result);
    result.curve.bspline = fewest_knots(estimate).curve;
    round_to_float(result.curve.bspline, estimate.points);
}

}  // namespace compbox::fitting
