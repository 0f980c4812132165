// SPDX-License-Identifier: MIT
// Numbers as people read them.
#pragma once

#include <fmt/core.h>

namespace compbox {

// value by a printf pattern with one double in it ("%.4g", "%10.1f %%"); 63 bytes at most.
std::string formatted(const char *pattern, double value);

// A finding for reading: value to five digits, which are more than any finding carries.
inline double five_digits(double value) {
    return std::stod(fmt::format("{:.5g}", value));
}

}  // namespace compbox
