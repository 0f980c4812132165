// SPDX-License-Identifier: MIT
#include "host-tools/simulation/figures.h"

#include <algorithm>
#include <cmath>

#include "host-tools/metrology/straightness.h"

namespace compbox::simulation {

namespace {

double distance_mm(const twin::xyz &a, const twin::xyz &b) {
    return std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
}

std::vector<double> column(const std::vector<twin::xyz> &points, std::size_t direction) {
    std::vector<double> values;
    for (const auto &point : points) values.push_back(point[direction]);
    return values;
}

}  // namespace

double range_about_line(const std::vector<twin::xyz> &positions_mm,
                        const std::vector<twin::xyz> &errors_um, std::size_t direction) {
    std::vector<double> along;
    for (const auto &position : positions_mm) {
        along.push_back(distance_mm(positions_mm.front(), position));
    }
    const auto errors = column(errors_um, direction);
    return metrology::deviation_about(metrology::least_squares_line(along, errors), along, errors);
}

double range_of(const std::vector<twin::xyz> &errors_um, std::size_t direction) {
    const auto errors = column(errors_um, direction);
    const auto [low, high] = std::minmax_element(errors.begin(), errors.end());
    return *high - *low;
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

double median_of(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

}  // namespace compbox::simulation
