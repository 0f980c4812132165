// SPDX-License-Identifier: MIT
#include "host-tools/fitting/signs.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "host-tools/metrology/mirrored.h"

namespace compbox::fitting {

namespace {

// out: index of the reading at a position, or the run's size
std::size_t reading_at(const measured_run &run, double position, double closest) {
    const auto at = std::lower_bound(run.position.begin(), run.position.end(), position - closest);
    const bool there = at != run.position.end() && *at <= position + closest;
    return static_cast<std::size_t>((there ? at : run.position.end()) - run.position.begin());
}

// The positions that every run has, and the runs there.
struct common_readings {
    std::vector<double> position;
    std::vector<metrology::directed_run> runs;
};

// in : runs ascending in position
// out: positions that every run has, with each run's readings there
common_readings common_of(const measurement &data) {
    const double closest = closest_positions(data.runs);
    common_readings common;
    for (const auto &run : data.runs) common.runs.push_back({run.direction, {}});
    for (const double position : data.position) {
        std::vector<double> here;
        for (const auto &run : data.runs) {
            const std::size_t i = reading_at(run, position, closest);
            if (i == run.position.size()) break;
            here.push_back(run.error[i]);
        }
        if (here.size() < data.runs.size()) continue;
        common.position.push_back(position);
        for (std::size_t r = 0; r < here.size(); ++r) {
            common.runs[r].deviation.push_back(here[r]);
        }
    }
    return common;
}

std::string name_of(const measurement &data, std::size_t run) {
    const measured_run &one = data.runs[run];
    const std::string name = one.name.empty() ? std::to_string(run + 1) : one.name;
    return name + (one.direction > 0 ? " forward" : one.direction < 0 ? " backward" : "");
}

// out: the mean curve at a position within its range, by a straight line between its points
double mean_at(const measurement &data, double position) {
    const auto &x = data.position;
    const auto above = std::lower_bound(x.begin(), x.end(), position);
    const auto i = static_cast<std::size_t>(above - x.begin());
    if (i == 0) return data.mean.front();
    const double part = (position - x[i - 1]) / (x[i] - x[i - 1]);
    return data.mean[i - 1] + part * (data.mean[i] - data.mean[i - 1]);
}

// out: standard deviation of a mean by the repeats, without slow noise; 0 without repeats
double sigma_of_mean(const measurement &data) {
    if (data.repeat_freedom == 0) return 0.0;
    double variance = 0.0;
    for (const double one : data.variance) variance += one;
    return std::sqrt(data.short_variance * variance / static_cast<double>(data.variance.size()));
}

}  // namespace

std::vector<std::string> mirrored_run_warnings(const measurement &data) {
    std::vector<std::string> warnings;
    if (data.runs.size() < 3) return warnings;
    const common_readings common = common_of(data);
    for (const std::size_t run : metrology::mirrored_runs(common.position, common.runs)) {
        warnings.push_back(
            fmt::format("run {} is the mirror image of the other runs: its sign is wrong, or the "
                        "compensation acts the wrong way round in it; leave the run out, or "
                        "correct its sign",
                        name_of(data, run)));
    }
    return warnings;
}

std::optional<std::string> doubled_error_warning(const measurement &before,
                                                 const measurement &after) {
    std::vector<double> position, was, is;
    for (std::size_t i = 0; i < before.position.size(); ++i) {
        const double x = before.position[i];
        if (x < after.from() || x > after.to()) continue;
        position.push_back(x);
        was.push_back(before.mean[i]);
        is.push_back(mean_at(after, x));
    }
    const auto factor = metrology::doubled_error(position, was, is, sigma_of_mean(before));
    if (!factor) return {};
    return fmt::format(
        "the compensation acts the wrong way round: the error after has the shape of the error "
        "before and {:.2f} times its size; turn the channel's sign, or that of the curve",
        *factor);
}

}  // namespace compbox::fitting
