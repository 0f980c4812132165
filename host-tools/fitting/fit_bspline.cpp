// SPDX-License-Identifier: MIT
// The B-spline method. Without a tolerance: the best estimate of the curve, then the fewest knots
// that stay well inside its uncertainty. With a tolerance: that curve if it keeps every residual
// inside; else the curve inside that is closest to the best estimate, also if it follows the noise,
// which causes a warning.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "firmware/base/limits.h"
#include "host-tools/fitting/course.h"
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

// The written curve is inside if it is inside after the rounding to float32. The search therefore
// keeps a margin, and a larger one if the first was too small.
constexpr double margins[] = {0.9999, 0.99, 0.9, 0.5};

// A curve to choose from. distance: rms from the best estimate, unit of the error
struct candidate {
    spline curve;
    bool inside = false;
    double distance = 0.0;
};

// in : result.best and data
// out: the candidate of a search, rounded to float32 and judged
candidate judged(const fit_result &result, const spline &curve, const weighted_points &points) {
    candidate found{curve, false, 0.0};
    fit_result written = result;
    round_to_float(found.curve, points);
    written.curve.bspline = found.curve;
    found.inside = largest_residual(written) <= result.options.tolerance_um;
    found.distance = estimate_distance(written).rms;
    return found;
}

// out: the fewest knots inside the tolerance, however far from the best estimate
candidate with_fewest_knots(const fit_result &result) {
    candidate found;
    for (const double part : margins) {
        const knot_task task = task_of_means(result, part * result.options.tolerance_um);
        const knot_result tried = fewest_knots(task);
        found = judged(result, tried.curve, task.points);
        if (found.inside || !tried.inside) break;
    }
    return found;
}

// in : part of the tolerance at which a mean may be, 0 … 1
// out: how far each measured position's estimate must move to be that close to its mean
std::vector<double> needed_moves(const fit_result &result, double part) {
    std::vector<double> moves;
    const double reach = part * result.options.tolerance_um;
    for (std::size_t i = 0; i < result.data.position.size(); ++i) {
        const double estimate = result.best.mean[result.best.measured[i]];
        const double mean = result.data.mean[i];
        moves.push_back(std::clamp(estimate, mean - reach, mean + reach) - estimate);
    }
    return moves;
}

// The best estimate, moved to the means as far as the tolerance demands. Between two measured
// positions the curve may be within both moves, because nothing was measured there.
knot_task task_of_moved_estimate(const fit_result &result) {
    constexpr double used = 0.8;  // of the tolerance; the rest is room for the knots
    const double spare = (1.0 - used) * 0.99 * result.options.tolerance_um;
    const std::vector<double> moves = needed_moves(result, used);
    const std::vector<std::size_t> &at = result.best.measured;
    knot_task task = task_of_estimate(result);
    task.max_coefficients = std::min<int>(task.max_coefficients, static_cast<int>(at.size()));
    const std::vector<double> &x = task.points.x;
    for (std::size_t i = 0; i < at.size(); ++i) {
        task.points.y[at[i]] += moves[i];
        task.tolerance[at[i]] = std::min(task.tolerance[at[i]], spare);
        if (moves[i] != 0.0) task.tolerance[at[i]] = spare;
        for (std::size_t k = at[i] + 1; i + 1 < at.size() && k < at[i + 1]; ++k) {
            const double part = (x[k] - x[at[i]]) / (x[at[i + 1]] - x[at[i]]);
            task.points.y[k] += (1.0 - part) * moves[i] + part * moves[i + 1];
            task.tolerance[k] += 0.5 * std::max(std::abs(moves[i]), std::abs(moves[i + 1]));
        }
    }
    for (std::size_t k = 0; k < x.size(); ++k) {
        task.points.weight[k] = 1.0 / (task.tolerance[k] * task.tolerance[k]);
    }
    return task;
}

// The means, each moved to the estimate as far as the tolerance permits.
knot_task task_of_moved_means(const fit_result &result) {
    constexpr double used = 0.8;
    knot_task task = task_of_means(result, (1.0 - used) * 0.99 * result.options.tolerance_um);
    const std::vector<double> moves = needed_moves(result, used);
    for (std::size_t i = 0; i < moves.size(); ++i) {
        task.points.y[i] = result.best.mean[result.best.measured[i]] + moves[i];
        task.points.weight[i] = 1.0;
    }
    return task;
}

// in : result.curve, inside; the readings' course between them is that of gates_of
// out: the curve's largest excursion from it, unit of the error
double swing_of(const fit_result &result) {
    const knot_task task = task_of_means(result, result.options.tolerance_um);
    double largest = 0.0;
    for (const gate &g : gates_of(task.points, task.tolerance)) {
        largest = std::max(largest, std::abs(result.curve.value(g.x) - g.centre) - g.half_width);
    }
    return largest;
}

// in : result.curve is the one without a tolerance
// out: of the curves inside the tolerance the closest to the best estimate. Without any, the one
//      that the search for the fewest knots came to, not converged
void fit_within_tolerance(fit_result &result) {
    const bool estimated = result.best.x.size() > 1;
    const bool free = result.options.fewest_knots || !estimated;
    if (!free && largest_residual(result) <= result.options.tolerance_um) return;
    candidate chosen = with_fewest_knots(result);
    if (!free) {
        for (const knot_task &task :
             {task_of_moved_estimate(result), task_of_moved_means(result)}) {
            const candidate other = judged(result, fewest_knots(task).curve, task.points);
            if (other.inside && (!chosen.inside || other.distance < chosen.distance)) {
                chosen = other;
            }
        }
    }
    result.curve.bspline = chosen.curve;
    result.converged = chosen.inside;
    warn_of_tolerance(result, swing_of(result));
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
    if (result.best.x.size() > 1) {
        const knot_task estimate = task_of_estimate(result);
        result.curve.bspline = fewest_knots(estimate).curve;
        round_to_float(result.curve.bspline, estimate.points);
    }
    if (result.options.tolerance_um > 0.0) fit_within_tolerance(result);
}

}  // namespace compbox::fitting
