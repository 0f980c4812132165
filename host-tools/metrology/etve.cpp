// SPDX-License-Identifier: MIT
#include "host-tools/metrology/etve.h"

#include <fmt/core.h>

#include <algorithm>
#include <deque>

#include "host-tools/formats/error.h"

namespace compbox::metrology {

namespace {

constexpr double s_per_h = 3600.0, shortest_h = 4.0, longest_gap_s = 300.0;

bool ends_in(const std::string &name, const std::string &end) {
    return name.size() > end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0;
}

// Largest (sign 1) or smallest (sign -1) reading of a window that moves on: its candidates, in
// order, each better than those behind it.
class moving_extreme {
  public:
    moving_extreme(const std::vector<double> &values, double sign) : values_(values), sign_(sign) {}

    void enter(std::size_t i) {
        while (!kept_.empty() && sign_ * values_[kept_.back()] <= sign_ * values_[i]) {
            kept_.pop_back();
        }
        kept_.push_back(i);
    }
    void leave_before(std::size_t first) {
        while (kept_.front() < first) kept_.pop_front();
    }
    double value() const { return values_[kept_.front()]; }

  private:
    const std::vector<double> &values_;
    double sign_;
    std::deque<std::size_t> kept_;
};

// Throws input_error where a time is not after the one before.
void check_times(const formats::csv_table &table, const std::vector<double> &time_s) {
    if (time_s.size() < 2) throw input_error(table.file, 0, 0, "needs at least two readings");
    for (std::size_t i = 1; i < time_s.size(); ++i) {
        if (time_s[i] > time_s[i - 1]) continue;
        throw input_error(table.file, table.lines[i], 0, "the time {:g} s comes after {:g} s",
                          time_s[i], time_s[i - 1]);
    }
}

// The requirements of ISO 230-3 that a record can show.
void remark(drift_record &record) {
    const auto &t = record.time_s;
    const double hours = (t.back() - t.front()) / s_per_h;
    double gap = 0.0;
    for (std::size_t i = 1; i < t.size(); ++i) gap = std::max(gap, t[i] - t[i - 1]);
    if (hours < shortest_h) {
        record.remarks.push_back(fmt::format(
            "{:.2f} h long; the test of ISO 230-3 takes {:g} h at least", hours, shortest_h));
    }
    if (gap > longest_gap_s) {
        record.remarks.push_back(
            fmt::format("has a gap of {:.0f} s; ISO 230-3 asks for a reading every {:g} s at least",
                        gap, longest_gap_s));
    }
    if (record.temperatures.empty()) {
        record.remarks.push_back(
            "has no temperature; the result of ISO 230-3 states that of the environment");
    }
}

}  // namespace

bool logged_series::temperature() const {
    return ends_in(name, "_degC");
}

drift_record drift_record_of(const formats::csv_table &table) {
    drift_record record;
    record.time_s = table.values("time_s");
    check_times(table, record.time_s);
    std::string others;
    for (const auto &name : table.names) {
        if (name == "time_s") continue;
        if (!ends_in(name, "_um") && !ends_in(name, "_urad") && !ends_in(name, "_degC")) {
            others += (others.empty() ? "" : ", ") + name;
            continue;
        }
        logged_series one{name, table.values(name)};
        (one.temperature() ? record.temperatures : record.displacements).push_back(one);
    }
    if (record.displacements.empty()) {
        throw input_error(table.file, table.header_line, 0,
                          "has no displacement; name its column as in 'X_um' or 'X [µm]'");
    }
    if (!others.empty()) {
        record.remarks.push_back("without a unit and left out: " + others);
    }
    remark(record);
    return record;
}

drift_figures evaluate_drift(const std::vector<double> &time_s, const std::vector<double> &values,
                             double window_s) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    drift_figures figures;
    figures.range = *high - *low;
    figures.change = values.back() - values.front();
    figures.window_from_s = time_s.front();
    moving_extreme largest(values, 1.0), smallest(values, -1.0);
    std::size_t first = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        largest.enter(i);
        smallest.enter(i);
        while (time_s[i] - time_s[first] > window_s) ++first;
        largest.leave_before(first);
        smallest.leave_before(first);
        const double range = largest.value() - smallest.value();
        if (range <= figures.in_window) continue;
        figures.in_window = range;
        figures.window_from_s = time_s[first];
    }
    return figures;
}

}  // namespace compbox::metrology
