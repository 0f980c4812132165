// SPDX-License-Identifier: MIT
#include "host-tools/view/recent.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace compbox::view {

namespace {

// out: a word of the snapshot, no longer than a real one
std::string word_of(const json &snapshot, const char *key) {
    return snapshot.at(key).get<std::string>().substr(0, 200);
}

}  // namespace

bool recent_values::has_row_of(double unix_s) const {
    return count_ > 0 && std::floor(unix_s) == std::floor(unix_s_[(count_ - 1) % recent_rows]);
}

// Stores from[member] in the row that is being written; a new column begins with gaps.
void recent_values::set(const column_key &key, const json &from, const char *member) {
    const auto value = from.find(member);
    if (value == from.end() || !value->is_number()) return;
    auto at = series_.find(key);
    if (at == series_.end()) {
        if (series_.size() >= recent_most_columns) return;
        at = series_.emplace(key, series{std::vector<float>(recent_rows, no_value), 0}).first;
    }
    at->second.values[count_ % recent_rows] = value->get<float>();
    at->second.last_row = count_;
}

void recent_values::set_row(const json &snapshot) {
    for (const auto &one : snapshot.at("signals")) {
        set({"signals", one.at("name").get<std::string>(), ""}, one, "value");
    }
    for (const auto &one : snapshot.at("terms")) {
        set({"terms", one.at("name").get<std::string>(), ""}, one, "value");
    }
    for (const auto &one : snapshot.at("channels")) {
        const auto name = one.at("name").get<std::string>();
        for (const char *quantity : {"demand_um", "output_um", "applied_um", "limit_um"}) {
            set({"channels", name, quantity}, one, quantity);
        }
    }
}

// Removes the columns without a value in any row that is kept.
void recent_values::forget_empty() {
    for (auto at = series_.begin(); at != series_.end();) {
        const bool is_empty = count_ - at->second.last_row > recent_rows;
        at = is_empty ? series_.erase(at) : std::next(at);
    }
}

void recent_values::add(double unix_s, const json &snapshot) {
    if (has_row_of(unix_s)) return;
    const std::size_t last = (count_ + recent_rows - 1) % recent_rows;
    if (count_ > 0 && unix_s < unix_s_[last]) {
        count_ = 0;
        series_.clear();
    }
    if (snapshot.is_null() && (count_ == 0 || mode_[last].empty())) return;
    const std::size_t row = count_ % recent_rows;
    for (auto &one : series_) one.second.values[row] = no_value;
    unix_s_[row] = unix_s;
    mode_[row] = snapshot.is_null() ? "" : word_of(snapshot, "mode");
    reason_[row] = snapshot.is_null() ? "" : word_of(snapshot, "reason");
    if (!snapshot.is_null()) set_row(snapshot);
    ++count_;
    forget_empty();
}

columns recent_values::all() const {
    columns table;
    const std::size_t rows = std::min(count_, recent_rows);
    for (const auto &one : series_) table.all.push_back({one.first, {}});
    for (std::size_t n = count_ - rows; n < count_; ++n) {
        const std::size_t row = n % recent_rows;
        table.unix_s.push_back(unix_s_[row]);
        table.mode.push_back(mode_[row]);
        table.reason.push_back(reason_[row]);
        std::size_t i = 0;
        for (const auto &one : series_) table.all[i++].values.push_back(one.second.values[row]);
    }
    return table;
}

}  // namespace compbox::view
