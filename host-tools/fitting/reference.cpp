// SPDX-License-Identifier: MIT
// The reference of a curve: the subtracted straight line, and the position of zero. A laser's
// set-up has its own slope and offset, so both are options, and are reported.
#include "host-tools/fitting/methods.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/metrology/straightness.h"

namespace compbox::fitting {

namespace {

// The line through both ends of the means, or their plain least-squares line. The latter is the
// line of `report`, and the result of any plain line fit to the mean readings.
void find_line(fit_result &result) {
    const measurement &data = result.data;
    const metrology::straight_line line =
        result.options.line == reference_line::end_point
            ? metrology::end_point_line(data.position, data.mean)
            : metrology::least_squares_line(data.position, data.mean);
    result.line_slope = line.slope;
    result.line_offset = line.at(data.centre());
}

}  // namespace

// Subtracts the line from the means and from every run, so that figures show the fitted values.
void take_off_line(fit_result &result) {
    if (result.options.line == reference_line::keep) return;
    find_line(result);
    measurement &data = result.data;
    const auto line = [&](double x) {
        return result.line_offset + result.line_slope * (x - data.centre());
    };
    for (std::size_t i = 0; i < data.position.size(); ++i) data.mean[i] -= line(data.position[i]);
    data.line_variance = {};  // the line is a convention now
    for (auto &run : data.runs) {
        for (std::size_t i = 0; i < run.position.size(); ++i) run.error[i] -= line(run.position[i]);
    }
}

void check_reference(const fit_result &result) {
    const measurement &data = result.data;
    const auto &zero_at = result.options.zero_at_mm;
    if (zero_at && !(*zero_at >= data.from() && *zero_at <= data.to())) {
        throw input_error(data.file, 0, 0,
                          "was measured from {} to {} mm; the curve cannot be zero at {} mm",
                          data.from(), data.to(), *zero_at);
    }
}

namespace {

// Lowers curve, estimate, means and readings by `offset`, which leaves the residuals unchanged.
void lower(fit_result &result, double offset) {
    for (double &c : result.curve.bspline.control_points) c = to_float(c - offset);
    auto &powers = result.curve.polynomial.coefficients;
    if (!powers.empty()) powers[0] = to_float(powers[0] - offset);
    for (double &y : result.best.mean) y -= offset;
    for (double &y : result.data.mean) y -= offset;
    for (auto &run : result.data.runs) {
        for (double &y : run.error) y -= offset;
    }
    result.zero_offset += offset;
}

}  // namespace

// Lowers both branches by the same amount, because their difference is the lost motion. Rounding
// leaves a small rest after the first pass.
void put_to_zero(fit_result &result) {
    if (!result.options.zero_at_mm) return;
    for (int i = 0; i < 3; ++i) {
        const double offset = result.curve.value(*result.options.zero_at_mm);
        lower(result, offset);
        for (auto &backward : result.backward) lower(backward, offset);
    }
}

}  // namespace compbox::fitting
