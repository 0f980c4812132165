// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/typed_number.h"

#include <charconv>
#include <cmath>

#include "host-tools/formats/error.h"

namespace compbox::fakeplc {

double number(const std::string &text) {
    double value = 0.0;
    const auto end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, value);
    if (text.empty() || result.ec != std::errc() || result.ptr != end || !std::isfinite(value)) {
        throw input_error(fmt::format("'{}' is not a number", text));
    }
    return value;
}

int whole(const std::string &text, int low, int high) {
    const double value = number(text);
    if (value != std::floor(value) || value < low || value > high) {
        throw input_error(fmt::format("'{}' is not a whole number from {} to {}", text, low, high));
    }
    return static_cast<int>(value);
}

}  // namespace compbox::fakeplc
