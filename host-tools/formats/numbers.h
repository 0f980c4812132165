// SPDX-License-Identifier: MIT
// Numbers for reports.
#pragma once

#include <fmt/core.h>

#include <string>

namespace compbox::formats {

// out: value rounded to five significant digits
inline double five_digits(double value) {
    return std::stod(fmt::format("{:.5g}", value));
}

}  // namespace compbox::formats
