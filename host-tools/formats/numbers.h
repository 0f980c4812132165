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

// out: value as float32, with the shortest decimals that read back as the same float32
inline double short_float(double value) {
    return std::stod(fmt::format("{}", static_cast<float>(value)));
}

}  // namespace compbox::formats
