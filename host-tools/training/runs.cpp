// SPDX-License-Identifier: MIT
#include "host-tools/training/runs.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <map>
#include <numeric>

namespace compbox::training {

namespace {

constexpr std::size_t most_returns = 3, long_stretch = 20;

std::vector<std::size_t> stretch_starts(const std::vector<double> &value) {
    std::vector<std::size_t> starts;
    for (std::size_t r = 0; r < value.size(); ++r) {
        if (r == 0 || value[r] != value[r - 1]) starts.push_back(r);
    }
    return starts;
}

std::size_t shortest_stretch(const std::vector<std::size_t> &starts, std::size_t rows) {
    std::size_t least = rows - starts.back();
    for (std::size_t k = 1; k < starts.size(); ++k) {
        least = std::min(least, starts[k] - starts[k - 1]);
    }
    return least;
}

bool rises(const std::vector<double> &time_s) {
    return !time_s.empty() && std::adjacent_find(time_s.begin(), time_s.end(),
                                                 std::greater_equal<double>()) == time_s.end();
}

// One run for each series of equal values.
void by_stretch(found_runs &found, const std::vector<double> &value) {
    std::map<double, int> met;
    for (const std::size_t start : found.starts) {
        found.values.push_back(value[start]);
        found.times.push_back(++met[value[start]]);
    }
    for (std::size_t r = 0, k = 0; r < value.size(); ++r) {
        if (k + 1 < found.starts.size() && r == found.starts[k + 1]) ++k;
        found.run.push_back(k);
    }
}

// One run for each value, in the order in which values appear.
void by_value(found_runs &found, const std::vector<double> &value) {
    std::map<double, std::size_t> number;
    for (const double one : value) {
        const auto [place, is_new] = number.insert({one, number.size()});
        found.run.push_back(place->second);
        if (is_new) found.values.push_back(one), found.times.push_back(1);
    }
}

void put_run_by_run(found_runs &found) {
    const std::vector<std::size_t> run = found.run;
    std::stable_sort(found.row.begin(), found.row.end(),
                     [&](std::size_t a, std::size_t b) { return run[a] < run[b]; });
    found.starts.clear();
    for (std::size_t r = 0; r < run.size(); ++r) {
        found.run[r] = run[found.row[r]];
        if (r == 0 || found.run[r] != found.run[r - 1]) found.starts.push_back(r);
    }
    found.reordered = true;
}

}  // namespace

found_runs find_runs(const std::vector<double> &value, const std::vector<double> &time_s,
                     const std::string &column) {
    found_runs found;
    found.row.resize(value.size());
    std::iota(found.row.begin(), found.row.end(), 0);
    found.starts = stretch_starts(value);
    std::vector<double> distinct = value;
    std::sort(distinct.begin(), distinct.end());
    distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
    const std::size_t stretches = found.starts.size();
    if (stretches <= most_returns * distinct.size() ||
        shortest_stretch(found.starts, value.size()) >= long_stretch) {
        by_stretch(found, value);
        return found;
    }
    by_value(found, value);
    found.note = fmt::format(
        "{} changes {} times between {} values, so all rows of a value are taken for one run",
        column, stretches - 1, distinct.size());
    if (!rises(time_s) || value.size() < 2 * stretches) put_run_by_run(found);
    return found;
}

}  // namespace compbox::training
