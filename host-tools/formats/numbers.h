// SPDX-License-Identifier: MIT
// Numbers as people read them.
#pragma once

#include <fmt/core.h>

#include <string>

namespace compbox {

// A finding for reading: value to five digits, which are more than any finding carries.
inline double five_digits(double value) {
    return std::stod(fmt::format("{:.5g}", value));
}

}  // namespace compbox
