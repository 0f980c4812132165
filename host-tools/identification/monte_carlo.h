// SPDX-License-Identifier: MIT
// The comparison of S2's Table 4: preset errors, ideal readings, Gaussian noise, both methods, many
// runs, for one position in one frame. The closed forms of points.h give the same figures without a
// run.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "host-tools/identification/points.h"

namespace compbox::identification {

struct monte_carlo_options {
    int axis = 0;
    six preset{1, 1, 1, 1, 1, 1};  // the true errors, µm and µrad
    line_sigma sigma_um;           // of a reading of each line; empty: 1 µm
    unsigned runs = 100;           // at least 2
    std::uint64_t seed = 1;
    std::function<void(double)> progress;  // 0 … 1; may be empty
};

struct method_statistics {
    six mean{}, sigma{};  // over the runs; sigma with n - 1
    six closed_form{};    // sigma without runs
};

struct monte_carlo_result {
    method_statistics improved;
    std::optional<method_statistics> traditional;  // empty if its sequence is singular
};

// Both methods get the same noisy readings. The same seed gives the same figures on every machine.
// The points must not lie on a line.
monte_carlo_result monte_carlo(const points_mm &points, const monte_carlo_options &options);

}  // namespace compbox::identification
