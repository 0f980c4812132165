// SPDX-License-Identifier: MIT
// The numbers that no model may return unnoticed.
#pragma once

#include <limits>

namespace compbox_test {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

}  // namespace compbox_test
