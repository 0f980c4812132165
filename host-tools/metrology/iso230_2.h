// SPDX-License-Identifier: MIT
// ISO 230-2: accuracy and repeatability of positioning of one axis.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace compbox::metrology {

// Readings of one axis, sorted by target: readings[i] are the deviations (µm or µrad) at
// target_mm[i], one of each run. Either direction may be empty; otherwise every target has the same
// number of readings in it.
struct axis_readings {
    std::vector<double> target_mm;  // strictly ascending, at least 2
    std::vector<std::vector<double>> forward, backward;
    std::size_t runs_forward() const { return forward.empty() ? 0 : forward.front().size(); }
    std::size_t runs_backward() const { return backward.empty() ? 0 : backward.front().size(); }
};

// The standard's statistics at one target, in one direction. s with n - 1; empty for one run.
struct target_statistics {
    double mean = 0.0;
    std::optional<double> s;
};

// The figures of one direction of approach.
struct approach_figures {
    std::vector<target_statistics> targets;
    double E = 0.0;           // systematic error: range of the means
    std::optional<double> A;  // accuracy: max(mean + 2s) - min(mean - 2s)
    std::optional<double> R;  // repeatability: max 4s
};

struct iso230_2_figures {
    std::optional<approach_figures> forward, backward;

    // Both directions together; only if both were measured.
    std::vector<double> reversal;       // B_i = mean forward - mean backward
    std::vector<double> repeatability;  // R_i; empty for one run
    std::optional<double> B, B_mean;    // max |B_i|, without its sign; mean of B_i
    std::optional<double> E, M, A, R;   // as in the standard's clause on evaluation

    // One sentence for each deviation from the standard's requirements. Empty: conforming.
    std::vector<std::string> remarks;
    // An axis longer than 2 000 mm with fewer than five runs: the standard permits only E, M and B,
    // so A and R stay empty.
    bool long_axis = false;
};

constexpr double long_axis_mm = 2000.0;
constexpr std::size_t iso_runs = 5;

// All figures. Throws std::logic_error if the readings violate axis_readings.
iso230_2_figures evaluate_positioning(const axis_readings &readings);

}  // namespace compbox::metrology
