// SPDX-License-Identifier: MIT
// Values over time, as the page's curves need them: /api/recent and /api/history (docs/view.md).
#pragma once

#include <limits>
#include <string>
#include <tuple>
#include <vector>

namespace compbox::view {

constexpr float no_value = std::numeric_limits<float>::quiet_NaN();

// What a column shows: group "signals", "terms" or "channels"; quantity "" or, of a channel,
// "demand_um", "output_um", "applied_um", "limit_um".
struct column_key {
    std::string group, name, quantity;
    bool operator<(const column_key &other) const {
        return std::tie(group, name, quantity) < std::tie(other.group, other.name, other.quantity);
    }
};

struct column {
    column_key key;
    std::vector<float> values;  // one for each row; NaN: none
};

// Rows in the order of time.
struct columns {
    std::vector<double> unix_s;
    std::vector<std::string> mode, reason;  // "": unknown
    std::vector<column> all;                // sorted by key
};

// out: the JSON text, null for a missing value
std::string columns_text(const columns &table);

}  // namespace compbox::view
