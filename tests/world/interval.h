// SPDX-License-Identifier: MIT
// All values between two.
#pragma once

#include <algorithm>

namespace compbox::world {

struct interval {
    double low = 0, high = 0;
    static interval none() { return {1e30, -1e30}; }
    bool is_none() const { return low > high; }
    double width() const { return high - low; }
    interval moved(double by, double wider) const { return {low + by - wider, high + by + wider}; }
    void take(double value) {
        low = std::min(low, value);
        high = std::max(high, value);
    }
    void take(const interval &other) {
        low = std::min(low, other.low);
        high = std::max(high, other.high);
    }
};

}  // namespace compbox::world
