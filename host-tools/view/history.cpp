// SPDX-License-Identifier: MIT
#include "host-tools/view/history.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host-tools/view/status_words.h"

namespace compbox::view {

namespace {

constexpr std::size_t spans_shown = 720;  // two rows each: at most 1440 points
constexpr std::size_t no_column = history_most_columns;

// out: comp_NAME_um is the output of a channel; else a term's output or a signal
column_key key_of(const std::string &name, const std::set<std::string> &terms) {
    const bool is_channel = name.size() > 8 && name.rfind("comp_", 0) == 0 &&
                            name.compare(name.size() - 3, 3, "_um") == 0;
    if (is_channel) return {"channels", name.substr(5, name.size() - 8), "output_um"};
    return {terms.count(name) > 0 ? "terms" : "signals", name, ""};
}

void add_row(columns &table, double unix_s, const std::string &mode, const std::string &reason) {
    table.unix_s.push_back(unix_s);
    table.mode.push_back(mode);
    table.reason.push_back(reason);
}

}  // namespace

history::history() {
    for (const double hours : {1.0, 24.0, 168.0, double{history_most_hours}}) {
        const double width_s = hours * 3600.0 / spans_shown;
        levels_.push_back({width_s, std::vector<span>(spans_shown + 1)});
    }
}

void history::set_names(const std::vector<std::string> &names) {
    id_of_value_.clear();
    for (const auto &name : names) {
        const bool is_full = ids_.size() >= history_most_columns && ids_.count(name) == 0;
        id_of_value_.push_back(is_full ? no_column : ids_.emplace(name, ids_.size()).first->second);
    }
}

// Adds the row to its span; one that is older than those kept is left out.
void history::add_to(level &one, double unix_s, int mode, int reason,
                     const std::vector<float> &values) {
    const auto number = static_cast<std::int64_t>(unix_s / one.width_s);
    span &at = one.spans[static_cast<std::size_t>(number) % one.spans.size()];
    if (number < at.number) return;
    if (number > at.number) at = span{number, -1, -1, {}, {}, {}};
    at.low.resize(ids_.size(), no_value);
    at.high.resize(ids_.size(), no_value);
    at.rises.resize(ids_.size(), 1);
    if (mode_severity(mode) >= mode_severity(at.mode)) {
        at.mode = mode;
        at.reason = reason;
    }
    for (std::size_t i = 0; i < std::min(values.size(), id_of_value_.size()); ++i) {
        const std::size_t id = id_of_value_[i];
        if (id == no_column || !std::isfinite(values[i])) continue;
        if (!(values[i] >= at.low[id])) {
            at.low[id] = values[i];
            at.rises[id] = 0;
        }
        if (!(values[i] <= at.high[id])) {
            at.high[id] = values[i];
            at.rises[id] = 1;
        }
    }
}

void history::add(double unix_s, int mode, int reason, const std::vector<float> &values) {
    if (!(unix_s > 0.0 && unix_s < 1e11)) return;  // no wall clock
    for (auto &one : levels_) add_to(one, unix_s, mode, reason, values);
}

// Appends one row of gaps, or none behind another one.
void history::put_gap(columns &table, double unix_s) {
    if (table.mode.empty() || table.mode.back().empty()) return;
    add_row(table, unix_s, "", "");
    for (auto &one : table.all) one.values.push_back(no_value);
}

// Appends the two rows of a span. in : ids: of the table's columns
void history::put_span(columns &table, const std::vector<std::size_t> &ids, const span &at,
                       double width_s) {
    const double start_s = static_cast<double>(at.number) * width_s;
    for (const double part : {0.25, 0.75}) {
        add_row(table, start_s + part * width_s, mode_word(at.mode), reason_word(at.reason));
    }
    for (std::size_t i = 0; i < ids.size(); ++i) {
        const bool is_known = ids[i] < at.low.size();
        const float low = is_known ? at.low[ids[i]] : no_value;
        const float high = is_known ? at.high[ids[i]] : no_value;
        const bool rises = !is_known || at.rises[ids[i]] != 0;
        table.all[i].values.push_back(rises ? low : high);
        table.all[i].values.push_back(rises ? high : low);
    }
}

columns history::last(unsigned hours, double unix_s, const std::set<std::string> &terms) const {
    const double wanted_s = hours * 3600.0;
    const auto fits = [wanted_s](const level &one) {
        return one.width_s * spans_shown >= wanted_s - 1e-6;
    };
    const level &from = *std::find_if(levels_.begin(), levels_.end() - 1, fits);
    const auto newest = static_cast<std::int64_t>(unix_s / from.width_s);
    const auto count = static_cast<std::int64_t>(wanted_s / from.width_s);
    columns table;
    std::vector<std::size_t> ids;
    for (const auto &[name, id] : ids_) {
        table.all.push_back({key_of(name, terms), {}});
        ids.push_back(id);
    }
    for (std::int64_t n = std::max<std::int64_t>(newest - count + 1, 0); n <= newest; ++n) {
        const span &at = from.spans[static_cast<std::size_t>(n) % from.spans.size()];
        if (at.number == n) {
            put_span(table, ids, at, from.width_s);
        } else if (n < newest) {
            put_gap(table, static_cast<double>(n) * from.width_s);
        }
    }
    std::sort(table.all.begin(), table.all.end(),
              [](const column &a, const column &b) { return a.key < b.key; });
    return table;
}

}  // namespace compbox::view
