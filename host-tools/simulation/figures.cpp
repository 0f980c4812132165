// SPDX-License-Identifier: MIT
#include "host-tools/simulation/figures.h"

#include <algorithm>
#include <cmath>

#include "host-tools/metrology/straightness.h"

namespace compbox::simulation {

namespace {

std::vector<double> component(const std::vector<twin::xyz> &points, std::size_t direction) {
    std::vector<double> values;
    for (const auto &point : points) values.push_back(point[direction]);
    return values;
}

}  // namespace

double distance_mm(const twin::xyz &a, const twin::xyz &b) {
    return std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
}

double range_about_line(const std::vector<twin::xyz> &positions_mm,
                        const std::vector<twin::xyz> &errors_um, std::size_t direction) {
    std::vector<double> along;
    for (const auto &position : positions_mm) {
        along.push_back(distance_mm(positions_mm.front(), position));
    }
    const auto errors = component(errors_um, direction);
    return metrology::deviation_about(metrology::least_squares_line(along, errors), along, errors);
}

double range_of(const std::vector<twin::xyz> &errors_um, std::size_t direction) {
    const auto errors = component(errors_um, direction);
    const auto [low, high] = std::minmax_element(errors.begin(), errors.end());
    return *high - *low;
}

double largest_of(const std::vector<twin::xyz> &errors_um, std::size_t direction) {
    double largest = 0.0;
    for (const twin::xyz &error : errors_um)
        largest = std::max(largest, std::fabs(error[direction]));
    return largest;
}

double mean_of(const std::vector<twin::xyz> &errors_um, std::size_t direction) {
    double sum = 0.0;
    for (const auto &error : errors_um) sum += error[direction];
    return sum / static_cast<double>(errors_um.size());
}

double variance_of(const std::vector<twin::xyz> &errors_um, std::size_t direction) {
    const double mean = mean_of(errors_um, direction);
    double sum = 0.0;
    for (const auto &error : errors_um)
        sum += (error[direction] - mean) * (error[direction] - mean);
    return errors_um.size() < 2 ? 0.0 : sum / static_cast<double>(errors_um.size() - 1);
}

std::optional<interval> median_interval(std::vector<double> values) {
    constexpr double outside_one_end = 0.025;
    std::sort(values.begin(), values.end());
    const std::size_t count = values.size();
    double chance = std::pow(0.5, static_cast<double>(count)), below = 0.0;
    std::size_t left_out = 0;  // at each end
    for (; left_out < count; ++left_out) {
        below += chance;  // that no more than left_out values are below the median
        if (below > outside_one_end) break;
        chance *= static_cast<double>(count - left_out) / static_cast<double>(left_out + 1);
    }
    if (left_out == 0) return std::nullopt;
    return interval{values[left_out - 1], values[count - left_out]};
}

double median_of(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

}  // namespace compbox::simulation
