// SPDX-License-Identifier: MIT
// Common functions of the tests of fitting.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "host-tools/fitting/fit.h"

namespace compbox {

// A true error curve over a few metres, in µm.
inline double wave(double x) {
    return 40.0 * std::sin(x / 500.0) + 8.0 * std::cos(x / 170.0);
}

inline bool warns(const fitting::fit_result &fit, const std::string &word) {
    return std::any_of(fit.warnings.begin(), fit.warnings.end(), [&](const std::string &warning) {
        return warning.find(word) != std::string::npos;
    });
}

}  // namespace compbox
