// SPDX-License-Identifier: MIT
#include "host-tools/fitting/fit.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>

#include "firmware/limits.h"
#include "host-tools/fitting/methods.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox {

namespace {

// Positions for which the best estimate is kept, at most about this many in all.
constexpr int dense_points = 4000;

// The line through both ends, or the least-squares line of the means over the travel: each counts
// with the length it stands for, so that a shorter last interval does not tilt it.
void find_line(fit_result &result) {
    const measurement &data = result.data;
    const double centre = data.centre();
    if (result.options.line == reference_line::end_point) {
        result.line_slope = (data.mean.back() - data.mean.front()) / (data.to() - data.from());
        result.line_offset = 0.5 * (data.mean.front() + data.mean.back());
        return;
    }
    double w = 0.0, wx = 0.0, wy = 0.0, wxx = 0.0, wxy = 0.0;
    for (std::size_t i = 0; i < data.position.size(); ++i) {
        const double left = data.position[i > 0 ? i - 1 : 0];
        const double right = data.position[std::min(i + 1, data.position.size() - 1)];
        const double weight = right - left, x = data.position[i] - centre;
        w += weight;
        wx += weight * x;
        wy += weight * data.mean[i];
        wxx += weight * x * x;
        wxy += weight * x * data.mean[i];
    }
    result.line_slope = (w * wxy - wx * wy) / (w * wxx - wx * wx);
    result.line_offset = (wy - result.line_slope * wx) / w;
}

// Takes the line off the means and off every run, so that figures show what was fitted.
void take_off_line(fit_result &result) {
    if (result.options.line == reference_line::keep) return;
    find_line(result);
    measurement &data = result.data;
    const auto line = [&](double x) {
        return result.line_offset + result.line_slope * (x - data.centre());
    };
    for (std::size_t i = 0; i < data.position.size(); ++i) data.mean[i] -= line(data.position[i]);
    for (auto &run : data.runs) {
        for (std::size_t i = 0; i < run.position.size(); ++i) run.error[i] -= line(run.position[i]);
    }
}

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

// A baseline does not look at the tolerance while it is fitted; it is judged by it all the same.
void judge_baseline(fit_result &result) {
    const double tolerance = result.options.tolerance_um, worst = std::abs(result.summary.worst);
    const bool baseline = result.options.method == fit_method::polynomial ||
                          result.options.method == fit_method::polyline;
    if (!baseline || tolerance <= 0.0 || worst <= tolerance) return;
    result.converged = false;
    result.warnings.push_back(
        std::string("did not converge: this ") + name_of(result.options.method) +
        " leaves a residual of " + text_of(worst, 3) + " " + result.data.unit +
        ", more than the tolerance of " + shortest(tolerance) + " " + result.data.unit);
}

// ISO 230-1: the third letter is the axis that the error belongs to.
void warn_of_other_axis(fit_result &result) {
    const std::string &name = result.options.name, &signal = result.options.signal;
    const bool iso = name.size() == 3 && name[0] == 'E' &&
                     std::string("XYZABC").find(name[1]) != std::string::npos &&
                     std::string("XYZABCUVW").find(name[2]) != std::string::npos;
    if (!iso || signal.empty() || std::toupper(static_cast<unsigned char>(signal[0])) == name[2]) {
        return;
    }
    result.warnings.push_back(name + " is by its name an error of axis " + name[2] +
                              ", but the curve depends on signal " + signal);
}

// The smoothness is found with a noise that nobody measured.
void warn_of_unknown_noise(fit_result &result) {
    const bool used =
        result.options.method == fit_method::bspline && result.options.tolerance_um <= 0;
    if (!used || result.best.noise_measured || result.data.position.size() < 3) return;
    result.warnings.push_back(
        "the noise could not be measured (no repeats, no column sigma); about " +
        text_of(result.noise, 2) + " " + result.data.unit +
        " is taken, as instruments have; measure three runs, or give sigma");
}

// A reading that the others do not believe is worth a sentence: no fit can mend it. What is far is
// judged by what leaving out should cost there, and by what it costs elsewhere.
void warn_of_outliers(fit_result &result) {
    const smooth_curve &best = result.best;
    double worst = 0.0, squares = 0.0;
    std::size_t where = 0;
    const std::size_t n = best.left_out.size();
    for (std::size_t i = 0; i < n; ++i) {
        const double apart = std::abs(best.left_out[i]) / std::sqrt(best.left_out_variance[i]);
        squares += apart * apart;
        if (apart > worst) {
            worst = apart;
            where = i;
        }
    }
    if (n < 12) return;
    const double usual = std::sqrt((squares - worst * worst) / static_cast<double>(n - 1));
    if (worst < 5.0 * std::max(usual, 1.0)) return;
    result.warnings.push_back("the reading at " + text_of(result.data.position[where], 7) +
                              " mm lies far off what its neighbours say: a corner of the curve, or "
                              "a wrong reading to measure again or leave out");
}

}  // namespace

double to_float(double value) {
    return static_cast<double>(static_cast<float>(value));
}

std::string text_of(double value, int digits) {
    char text[64];
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return text;
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
                      "has " + std::to_string(n) + " positions, but this " +
                          name_of(result.options.method) + " has " + std::to_string(coefficients) +
                          " coefficients; measure more positions or lower --degree");
}

void require_room(const fit_result &result, std::size_t coefficients) {
    if (coefficients <= CB_MAX_CURVE_POINTS) return;
    throw input_error(result.data.file, 0, 0,
                      "needs " + std::to_string(coefficients) +
                          " coefficients with this method; one curve of the box has at most " +
                          std::to_string(CB_MAX_CURVE_POINTS));
}

fit_result fit_curve(const measurement &data, const fit_options &options) {
    fit_result result;
    result.options = options;
    result.data = data;
    if (data.position.size() < 2) {
        throw input_error(data.file, 0, 0, "has a single position; a curve needs at least two");
    }
    if (options.degree == 0) {
        const bool polynomial = options.method == fit_method::polynomial;
        result.options.degree = polynomial ? 7 : (options.method == fit_method::polyline ? 1 : 3);
    }
    take_off_line(result);
    result.curve.method = options.method;
    if (data.position.size() >= 3) {
        const int intervals = static_cast<int>(data.position.size()) - 1;
        result.best = smooth(result.data, std::clamp(dense_points / intervals, 1, 12));
        result.noise = result.best.noise;
    }
    switch (options.method) {
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
    summarize(result);
    judge_baseline(result);
    warn_of_other_axis(result);
    warn_of_unknown_noise(result);
    warn_of_outliers(result);
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

}  // namespace compbox
