// SPDX-License-Identifier: MIT
// A measured error curve to a term of the coefficient file.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fitting/measurement.h"
#include "host-tools/fitting/smooth.h"
#include "host-tools/fitting/spline.h"
#include "host-tools/formats/json_type.h"

namespace compbox::fitting {

enum class fit_method { bspline, bspline_lmc, polynomial, polyline };
enum class reference_line { keep, end_point, least_squares };

struct fit_options {
    std::string name = "EXX";  // of the term
    std::string signal = "X";
    fit_method method = fit_method::bspline;
    int degree = 0;             // 0: 3 for splines, 7 for a polynomial
    double tolerance_um = 0.0;  // 0: none given
    bool fewest_knots = false;  // with a tolerance: fewest knots first, then the best estimate
    reference_line line = reference_line::keep;
    std::optional<double> zero_at_mm;  // the curve (its forward branch) is zero there
    bool branches = false;             // separate curves forward and backward
    double reversal_mm = 0.1;          // with branches: distance of a reversal from one branch to
                                       // the other
    std::function<void(double)> progress;  // called with 0 … 1; may be empty
};

// One polynomial over the range, ascending powers of u = (x - centre) / half_range.
struct power_polynomial {
    std::vector<double> coefficients;
    double centre = 0.0, half_range = 1.0, from = 0.0, to = 0.0;
};

// The curve as written: every number is a float32.
struct fitted_curve {
    fit_method method = fit_method::bspline;
    spline bspline;                // bspline, bspline-lmc; polyline as degree 1
    power_polynomial polynomial;   // polynomial
    double value(double x) const;  // outside the range: value at its end
    std::size_t coefficient_count() const;
};

// Summary of the residuals (mean of the readings - curve).
struct residual_summary {
    double lowest = 0.0, highest = 0.0, range = 0.0, mean = 0.0, variance = 0.0, rms = 0.0;
    double worst = 0.0, worst_at_mm = 0.0;  // largest |residual|, with sign, and its position
};

// Distance of the written curve from the best estimate, at the measured positions and between them.
struct curve_distance {
    double rms = 0.0, largest = 0.0, largest_at_mm = 0.0;
};

// One curve of bspline-lmc on the way to its tolerance.
struct key_step {
    std::size_t key_points = 0;
    double largest_residual = 0.0;  // at the measured positions, unit of the error
};

struct fit_result {
    fit_options options;       // with the degree in use
    measurement data;          // means minus the reference line
    double line_offset = 0.0;  // subtracted line: offset + slope (x - centre of the range)
    double line_slope = 0.0;   // um per mm
    double zero_offset = 0.0;  // also subtracted, so that the curve is zero at zero_at_mm
    fitted_curve curve;
    std::vector<double> residuals;  // at data.position
    residual_summary summary;
    smooth_curve best;       // the best estimate before the choice of a form, with its band
    double noise = 0.0;      // standard deviation of one reading (of a cell's mean)
    double cell_loss = 0.0;  // largest change of the curve by averaging in cells
    bool constant = false;   // all readings of the file are equal
    bool converged = true;   // false: a tolerance is set and not met
    std::vector<std::string> warnings;
    std::size_t key_points = 0;        // bspline-lmc only
    std::vector<key_step> key_steps;   // likewise, the last is the curve
    std::vector<fit_result> backward;  // with branches: the backward curve, and this is the forward
                                       // one; else empty
};

// Fits the curve. Throws input_error, with the file's name, for too few points and the box's
// limits.
fit_result fit_curve(const measurement &data, const fit_options &options);

// Standard deviation of the error about the written curve at result.best.x[i]: of the best
// estimate, plus the curve's distance from it.
double band_sigma(const fit_result &result, std::size_t i);

// out: zero where there are too few positions for an estimate
curve_distance estimate_distance(const fit_result &result);

// The curve with that band as CSV: position_mm,curve_um,sigma_um (urad for angles; with branches
// also backward_um,backward_sigma_um), at the measured positions and between them.
std::string band_of(const fit_result &result);

// The fragment {"signals": [], "terms": [...], "provenance": {...}} that `build` takes.
json fragment_of(const fit_result &result);

// The same results for a person: a table in plain text.
std::string report_of(const fit_result &result);

// The same results as figures (.svg, .png, .pdf).
void plot_fit(const fit_result &result, const std::string &path);

const char *name_of(fit_method method);
const char *name_of(reference_line line);

}  // namespace compbox::fitting
