// SPDX-License-Identifier: MIT
#include "host-tools/metrology/iso230_2.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace compbox::metrology {

namespace {

target_statistics statistics_of(const std::vector<double> &values) {
    const double n = static_cast<double>(values.size());
    double sum = 0.0, squares = 0.0;
    for (const double value : values) sum += value;
    const double mean = sum / n;
    for (const double value : values) squares += (value - mean) * (value - mean);
    if (values.size() < 2) return {mean, std::nullopt};
    return {mean, std::sqrt(squares / (n - 1.0))};
}

// Range over the targets of mean + k s and mean - k s; k = 0 gives E, k = 2 gives A.
struct span {
    double low = INFINITY, high = -INFINITY;
    void add(const target_statistics &target, double k) {
        const double width = k * target.s.value_or(0.0);
        low = std::min(low, target.mean - width);
        high = std::max(high, target.mean + width);
    }
    double width() const { return high - low; }
};

approach_figures evaluate_direction(const std::vector<std::vector<double>> &readings, bool spread) {
    approach_figures figures;
    span means, limits;
    double worst_s = 0.0;
    for (const auto &values : readings) {
        figures.targets.push_back(statistics_of(values));
        means.add(figures.targets.back(), 0.0);
        limits.add(figures.targets.back(), 2.0);
        worst_s = std::max(worst_s, figures.targets.back().s.value_or(0.0));
    }
    figures.E = means.width();
    if (spread) figures.A = limits.width();
    if (spread) figures.R = 4.0 * worst_s;
    return figures;
}

// in : figures of both directions, with the same targets; spread: more than one run
// out: the bidirectional figures of ISO 230-2, in the unit of the readings
void evaluate_both(iso230_2_figures &figures, bool spread) {
    const auto &up = figures.forward->targets, &down = figures.backward->targets;
    span means, limits, middles;
    double worst_B = 0.0, sum_B = 0.0, worst_R = 0.0;
    for (std::size_t i = 0; i < up.size(); ++i) {
        const double B = up[i].mean - down[i].mean;
        figures.reversal.push_back(B);
        worst_B = std::max(worst_B, std::fabs(B));
        sum_B += B;
        middles.add({0.5 * (up[i].mean + down[i].mean), std::nullopt}, 0.0);
        for (const auto *target : {&up[i], &down[i]}) {
            means.add(*target, 0.0);
            limits.add(*target, 2.0);
        }
        if (!spread) continue;
        const double s_up = *up[i].s, s_down = *down[i].s;
        const double R = std::max({2 * s_up + 2 * s_down + std::fabs(B), 4 * s_up, 4 * s_down});
        figures.repeatability.push_back(R);
        worst_R = std::max(worst_R, R);
    }
    figures.B = worst_B;
    figures.B_mean = sum_B / static_cast<double>(up.size());
    figures.E = means.width();
    figures.M = middles.width();
    if (spread) figures.A = limits.width();
    if (spread) figures.R = worst_R;
}

// Checks the standard's requirements on targets and runs (clause 5.3).
void remark(iso230_2_figures &figures, const axis_readings &readings, std::size_t runs) {
    const double travel = readings.target_mm.back() - readings.target_mm.front();
    const double targets = static_cast<double>(readings.target_mm.size());
    auto &remarks = figures.remarks;
    if (!figures.forward || !figures.backward) {
        remarks.push_back("only one direction was measured: no reversal, no bidirectional figures");
    }
    if (travel > long_axis_mm) {
        if (travel / (targets - 1.0) > 250.0 * 1.02) {
            remarks.push_back("axes over 2000 mm need targets every 250 mm on average");
        }
    } else if (targets < 5.0 || (travel > 1000.0 && targets < 5.0 * travel / 1000.0)) {
        remarks.push_back("ISO 230-2 asks for 5 targets per metre, and 5 at least");
    }
    if (runs < iso_runs && !figures.long_axis) {
        remarks.push_back(fmt::format(
            "ISO 230-2 asks for 5 runs in each direction, here are {}: the figures do not conform",
            runs));
    }
}

void check(const axis_readings &readings, const std::vector<std::vector<double>> &values) {
    const bool whole = values.size() == readings.target_mm.size() &&
                       std::all_of(values.begin(), values.end(), [&](const auto &v) {
                           return !v.empty() && v.size() == values.front().size();
                       });
    if (!whole) throw std::logic_error("each target needs the same number of readings");
}

}  // namespace

iso230_2_figures evaluate_positioning(const axis_readings &readings) {
    if (readings.target_mm.size() < 2) throw std::logic_error("fewer than two targets");
    if (readings.forward.empty() && readings.backward.empty())
        throw std::logic_error("no readings");
    std::size_t runs = SIZE_MAX;
    for (const auto *values : {&readings.forward, &readings.backward}) {
        if (values->empty()) continue;
        check(readings, *values);
        runs = std::min(runs, values->front().size());
    }
    iso230_2_figures figures;
    const double travel = readings.target_mm.back() - readings.target_mm.front();
    figures.long_axis = travel > long_axis_mm && runs < iso_runs;
    const bool spread = runs >= 2 && !figures.long_axis;
    if (!readings.forward.empty()) figures.forward = evaluate_direction(readings.forward, spread);
    if (!readings.backward.empty())
        figures.backward = evaluate_direction(readings.backward, spread);
    if (figures.forward && figures.backward) evaluate_both(figures, spread);
    remark(figures, readings, runs);
    return figures;
}

}  // namespace compbox::metrology
