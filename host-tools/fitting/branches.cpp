// SPDX-License-Identifier: MIT
// Forward and backward readings to two curves. If every position was reached both ways, the best
// estimate of each is the mean of both, minus or plus half the lost motion, each smoothed
// separately. Lost motion varies little along an axis, so each branch gains from the other's
// readings.
#include <algorithm>
#include <cmath>

#include "host-tools/fitting/methods.h"
#include "host-tools/formats/error.h"

namespace compbox::fitting {

namespace {

// The runs of one direction as a separate measurement.
measurement runs_of(const measurement &data, int direction) {
    measurement part;
    part.file = data.file;
    part.unit = data.unit;
    part.about = data.about;
    part.sigma_given = data.sigma_given;
    part.cells = data.cells;
    for (const auto &run : data.runs) {
        if (run.direction != direction) continue;
        part.runs.push_back(run);
        for (std::size_t i = 0; i < run.position.size(); ++i) {
            part.runs.back().error[i] -= run.offset + run.slope * (run.position[i] - data.centre());
        }
    }
    average_runs(part);
    part.line_variance = data.line_variance;
    for (double &variance : part.line_variance) variance *= 2.0;
    part.runs_aligned = part.runs_aligned || data.runs_aligned;
    return part;
}

// Forward - backward as a curve with noise; the means of both directions are independent.
measurement lost_motion_of(const measurement &data) {
    measurement difference = data;
    difference.mean = data.lost_motion;
    for (double &variance : difference.variance) variance *= 4.0;
    for (double &variance : difference.line_variance) variance *= 4.0;
    return difference;
}

// mean + sign * lost / 2, with the uncertainty of both.
smooth_curve combine(const smooth_curve &mean, const smooth_curve &lost, double sign) {
    smooth_curve branch = mean;
    for (std::size_t i = 0; i < mean.x.size(); ++i) {
        branch.mean[i] += 0.5 * sign * lost.mean[i];
        branch.sigma[i] = std::hypot(mean.sigma[i], 0.5 * lost.sigma[i]);
        branch.more_sigma[i] = std::hypot(mean.more_sigma[i], 0.5 * lost.more_sigma[i]);
    }
    double squares = 0.0;
    for (std::size_t i = 0; i < mean.left_out.size(); ++i) {
        branch.left_out[i] += 0.5 * sign * lost.left_out[i];
        branch.left_out_variance[i] += 0.25 * lost.left_out_variance[i];
        squares += branch.left_out[i] * branch.left_out[i];
    }
    branch.left_out_rms = std::sqrt(squares / static_cast<double>(mean.left_out.size()));
    return branch;
}

}  // namespace

void split_branches(fit_result &result) {
    const measurement both = result.data;
    if (!both.bidirectional) {
        throw input_error(both.file, 0, 0,
                          "has no positions reached forward and backward; --branches needs a "
                          "column direction with both");
    }
    const smooth_curve mean = result.best;
    const bool complete = std::none_of(both.lost_motion.begin(), both.lost_motion.end(),
                                       [](double lost) { return std::isnan(lost); });
    result.backward.push_back(result);
    fit_result &backward = result.backward.front();
    result.data = runs_of(both, +1);
    backward.data = runs_of(both, -1);
    result.data.bidirectional = true;
    result.data.mean_lost_motion = both.mean_lost_motion;
    if (!complete || both.position.size() < 3) {
        find_estimate(result);
        find_estimate(backward);
        return;
    }
    const int intervals = static_cast<int>(both.position.size()) - 1;
    const int between = (static_cast<int>(mean.x.size()) - 1) / intervals - 1;
    const smooth_curve lost = smooth(lost_motion_of(both), between);
    result.best = combine(mean, lost, +1.0);
    backward.best = combine(mean, lost, -1.0);
}

}  // namespace compbox::fitting
