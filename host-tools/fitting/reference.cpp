// SPDX-License-Identifier: MIT
// What a curve is measured from: the straight line taken off, and the position where it is zero. A
// laser's set-up has a slope and an offset of its own, so both are a choice, and are stated.
#include <algorithm>
#include <cmath>

#include "host-tools/fitting/methods.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox {

namespace {

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

}  // namespace

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

void check_reference(const fit_result &result) {
    const measurement &data = result.data;
    const auto &zero_at = result.options.zero_at_mm;
    if (zero_at && !(*zero_at >= data.from() && *zero_at <= data.to())) {
        throw input_error(data.file, 0, 0,
                          "was measured from " + shortest(data.from()) + " to " +
                              shortest(data.to()) + " mm; the curve cannot be zero at " +
                              shortest(*zero_at) + " mm");
    }
}

namespace {

// Curve, estimate, means and readings lowered by `offset`, so that residuals stay what they are.
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

// Both branches by the same amount: what parts them is the lost motion and stays. Rounding leaves a
// little after the first time.
void put_to_zero(fit_result &result) {
    if (!result.options.zero_at_mm) return;
    for (int i = 0; i < 3; ++i) {
        const double offset = result.curve.value(*result.options.zero_at_mm);
        lower(result, offset);
        for (auto &backward : result.backward) lower(backward, offset);
    }
}

}  // namespace compbox
