// SPDX-License-Identifier: MIT
#include "host-tools/training/parts.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace compbox::training {

namespace {

constexpr double least_pause_s = 600.0, usual_steps = 20.0, day_s = 86400.0;
constexpr std::size_t equal_parts = 6, least_parts = 3;

// in : time_s of two rows or more
// out: the step of which half of the steps are no longer
double usual_step(const std::vector<double> &time_s) {
    std::vector<double> steps;
    for (std::size_t r = 1; r < time_s.size(); ++r) steps.push_back(time_s[r] - time_s[r - 1]);
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    return *middle;
}

table_parts by_pauses(const std::vector<double> &time_s) {
    table_parts parts;
    const double pause = std::max(least_pause_s, usual_steps * usual_step(time_s));
    double number = 1.0;
    for (std::size_t r = 0; r < time_s.size(); ++r) {
        const double step = r == 0 ? 1.0 : time_s[r] - time_s[r - 1];
        if (step > pause || step <= 0.0) number += 1.0;
        parts.number.push_back(number);
    }
    parts.what = fmt::format("its {} pauses", number - 1.0);
    return parts;
}

table_parts by_days(const std::vector<double> &time_s) {
    table_parts parts;
    for (const double one : time_s) {
        parts.number.push_back(1.0 + std::floor((one - time_s.front()) / day_s));
    }
    parts.what = "days";
    return parts;
}

// Parts of equal duration, or of equal numbers of rows without a time.
table_parts by_sixths(const std::vector<double> &time_s, std::size_t rows) {
    table_parts parts;
    for (std::size_t r = 0; r < rows; ++r) {
        const double share = time_s.empty()
                                 ? static_cast<double>(r) / static_cast<double>(rows)
                                 : (time_s[r] - time_s.front()) / (time_s.back() - time_s.front());
        parts.number.push_back(1.0 + std::min(5.0, std::floor(share * equal_parts)));
    }
    parts.what = "six equal parts";
    return parts;
}

}  // namespace

table_parts parts_of(const std::vector<double> &time_s, std::size_t rows) {
    if (time_s.size() < 2) return by_sixths({}, rows);
    table_parts pauses = by_pauses(time_s);
    if (pauses.number.back() >= static_cast<double>(least_parts)) return pauses;
    const double whole_s = time_s.back() - time_s.front();
    if (!(whole_s > 0.0)) return by_sixths({}, rows);
    return whole_s >= 3.0 * day_s ? by_days(time_s) : by_sixths(time_s, rows);
}

bool has_long_steps(const Eigen::VectorXd &speed) {
    std::vector<Eigen::Index> lengths;
    std::size_t turning = 0;
    for (Eigen::Index r = 0; r < speed.size(); ++r) {
        if (r == 0 || speed[r] != speed[r - 1]) {
            lengths.push_back(0);
            turning += speed[r] != 0.0 ? 1 : 0;
        }
        ++lengths.back();
    }
    if (lengths.size() < 6 || lengths.size() > 60 || turning < 3) return false;
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    return *middle >= 20;
}

}  // namespace compbox::training
