// SPDX-License-Identifier: MIT
#include "host-tools/fitting/fit.h"

#include <algorithm>
#include <cmath>

#include "firmware/base/limits.h"
#include "host-tools/fitting/cells.h"
#include "host-tools/fitting/methods.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox::fitting {

namespace {

// Approximate maximum number of positions at which the best estimate is stored.
constexpr int dense_points = 4000;
// um, urad or parts of sigma: no instrument here resolves less. Readings without visible noise
// (made by a program, or from a coarse display) count as having this noise.
constexpr double least_noise = 0.001;

// in : result.curve and data.mean, not empty
// out: the residuals and their summary, in the unit of the data; the sample variance has n - 1
void summarize(fit_result &result) {
    const measurement &data = result.data;
    residual_summary &sum = result.summary;
    const auto n = static_cast<double>(data.position.size());
    for (std::size_t i = 0; i < data.position.size(); ++i) {
        const double residual = data.mean[i] - result.curve.value(data.position[i]);
        result.residuals.push_back(residual);
        sum.mean += residual / n;
        sum.rms += residual * residual / n;
        if (std::abs(residual) > std::abs(sum.worst) || i == 0) {
            sum.worst = residual;
            sum.worst_at_mm = data.position[i];
        }
    }
    for (const double residual : result.residuals) {
        sum.variance += (residual - sum.mean) * (residual - sum.mean) / std::max(n - 1.0, 1.0);
    }
    sum.rms = std::sqrt(sum.rms);
    const auto [low, high] = std::minmax_element(result.residuals.begin(), result.residuals.end());
    sum.lowest = *low;
    sum.highest = *high;
    sum.range = *high - *low;
}

// The mean of a curve over a cell less its value at the centre, where the curve bends most.
void find_cell_loss(fit_result &result) {
    if (result.data.cells.readings == 0) return;
    const double half = 0.5 * result.data.cells.width_mm;
    for (const double x : result.data.position) {
        if (x - half < result.data.from() || x + half > result.data.to()) continue;
        const double bend = result.curve.value(x - half) - 2.0 * result.curve.value(x) +
                            result.curve.value(x + half);
        result.cell_loss = std::max(result.cell_loss, std::abs(bend) / 6.0);
    }
}

// A baseline is fitted without the tolerance, but judged by it.
void judge_baseline(fit_result &result) {
    const double tolerance = result.options.tolerance_um, worst = std::abs(result.summary.worst);
    const bool baseline = result.options.method == fit_method::polynomial ||
                          result.options.method == fit_method::polyline;
    if (!baseline || tolerance <= 0.0 || worst <= tolerance) return;
    result.converged = false;
    result.warnings.push_back(fmt::format(
        "did not converge: this {} leaves a residual of {:.3g} {}, more than the tolerance of {} "
        "{}",
        name_of(result.options.method), worst, result.data.unit, tolerance, result.data.unit));
}

}  // namespace

double to_float(double value) {
    return static_cast<double>(static_cast<float>(value));
}

double fitted_curve::value(double x) const {
    if (method != fit_method::polynomial) return value_at(bspline, x);
    const double u =
        (std::clamp(x, polynomial.from, polynomial.to) - polynomial.centre) / polynomial.half_range;
    double value = 0.0;
    for (std::size_t k = polynomial.coefficients.size(); k-- > 0;) {
        value = value * u + polynomial.coefficients[k];
    }
    return value;
}

std::size_t fitted_curve::coefficient_count() const {
    return method == fit_method::polynomial ? polynomial.coefficients.size()
                                            : bspline.control_points.size();
}

void require_points(const fit_result &result, std::size_t coefficients) {
    const std::size_t n = result.data.position.size();
    if (n >= coefficients) return;
    throw input_error(result.data.file, 0, 0,
                      "has {} positions, but this {} has {} coefficients; measure more positions "
                      "or lower --degree",
                      n, name_of(result.options.method), coefficients);
}

void require_room(const fit_result &result, std::size_t coefficients) {
    if (coefficients <= CB_MAX_CURVE_POINTS) return;
    throw input_error(result.data.file, 0, 0,
                      "needs {} coefficients with this method; one curve of the box has at most {}",
                      coefficients, CB_MAX_CURVE_POINTS);
}

double band_sigma(const fit_result &result, std::size_t i) {
    const smooth_curve &best = result.best;
    const double estimate = std::hypot(best.sigma[i], best.more_sigma[i]);
    return std::hypot(estimate, best.mean[i] - result.curve.value(best.x[i]));
}

curve_distance estimate_distance(const fit_result &result) {
    const smooth_curve &best = result.best;
    curve_distance distance;
    for (std::size_t i = 0; i < best.x.size(); ++i) {
        const double off = std::abs(best.mean[i] - result.curve.value(best.x[i]));
        distance.rms += off * off / static_cast<double>(best.x.size());
        if (off <= distance.largest) continue;
        distance.largest = off;
        distance.largest_at_mm = best.x[i];
    }
    distance.rms = std::sqrt(distance.rms);
    return distance;
}

void find_estimate(fit_result &result) {
    if (result.data.position.size() < 3) return;
    const int intervals = static_cast<int>(result.data.position.size()) - 1;
    result.best =
        smooth(result.data, std::clamp(dense_points / intervals, 1, 12), result.options.progress);
    result.noise = std::max(result.best.noise, least_noise);
}

void fit_one(fit_result &result) {
    result.curve.method = result.options.method;
    switch (result.options.method) {
        case fit_method::bspline:
            fit_bspline(result);
            break;
        case fit_method::bspline_lmc:
            fit_lmc(result);
            break;
        case fit_method::polynomial:
            fit_polynomial(result);
            break;
        case fit_method::polyline:
            fit_polyline(result);
            break;
    }
}

fit_result fit_curve(const measurement &data, const fit_options &options) {
    fit_result result;
    result.options = options;
    result.data = in_cells(data);
    if (data.position.size() < 2) {
        throw input_error(data.file, 0, 0, "has a single position; a curve needs at least two");
    }
    check_reference(result);
    warn_of_constant(result);
    if (options.degree == 0) {
        const bool polynomial = options.method == fit_method::polynomial;
        result.options.degree = polynomial ? 7 : (options.method == fit_method::polyline ? 1 : 3);
    }
    take_off_line(result);
    find_estimate(result);
    if (options.branches) split_branches(result);
    fit_one(result);
    for (auto &backward : result.backward) fit_one(backward);
    put_to_zero(result);
    summarize(result);
    judge_baseline(result);
    for (auto &backward : result.backward) {
        summarize(backward);
        judge_baseline(backward);
    }
    find_cell_loss(result);
    add_warnings(result);
    return result;
}

const char *name_of(fit_method method) {
    switch (method) {
        case fit_method::bspline:
            return "bspline";
        case fit_method::bspline_lmc:
            return "bspline-lmc";
        case fit_method::polynomial:
            return "polynomial";
        case fit_method::polyline:
            return "polyline";
    }
    return "";
}

const char *name_of(reference_line line) {
    switch (line) {
        case reference_line::keep:
            return "keep";
        case reference_line::end_point:
            return "end-point";
        case reference_line::least_squares:
            return "least-squares";
    }
    return "";
}

}  // namespace compbox::fitting
