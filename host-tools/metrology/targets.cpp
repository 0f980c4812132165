// SPDX-License-Identifier: MIT
#include "host-tools/metrology/targets.h"

#include <fmt/core.h>

#include <cmath>
#include <complex>

namespace compbox::metrology {

namespace {

// Intervals that differ by less are equal: no axis is moved to irregular targets that finely.
constexpr double same_interval_mm = 1e-3;
// Length of the mean of the phases as unit vectors: 1 for one phase, about 0 for phases all around.
constexpr double one_phase = 0.9;

bool equally_spaced(const std::vector<double> &target_mm) {
    const double intervals = static_cast<double>(target_mm.size() - 1);
    const double step = (target_mm.back() - target_mm.front()) / intervals;
    for (std::size_t i = 0; i < target_mm.size(); ++i) {
        const double regular = target_mm.front() + static_cast<double>(i) * step;
        if (std::fabs(target_mm[i] - regular) > same_interval_mm) return false;
    }
    return true;
}

double phase_length(const std::vector<double> &target_mm, double period_mm) {
    const double turn = 2.0 * std::acos(-1.0);
    std::complex<double> sum = 0.0;
    for (const double x : target_mm) sum += std::polar(1.0, turn * std::fmod(x / period_mm, 1.0));
    return std::abs(sum) / static_cast<double>(target_mm.size());
}

}  // namespace

std::string hidden_period(const std::vector<double> &target_mm, std::optional<double> period_mm) {
    constexpr std::size_t fewest = 4;
    if (target_mm.size() < fewest) return "";
    if (period_mm) {
        if (phase_length(target_mm, *period_mm) < one_phase) return "";
        return fmt::format(
            "the targets meet the period of {:g} mm at nearly one phase, so an error of this "
            "period "
            "stays hidden; ISO 230-2 asks for irregular targets",
            *period_mm);
    }
    if (!equally_spaced(target_mm)) return "";
    return fmt::format(
        "the targets are {:g} mm apart throughout, so a periodic error that fits into this "
        "interval, "
        "such as that of a screw's pitch, stays hidden; ISO 230-2 asks for irregular targets",
        (target_mm.back() - target_mm.front()) / static_cast<double>(target_mm.size() - 1));
}

}  // namespace compbox::metrology
