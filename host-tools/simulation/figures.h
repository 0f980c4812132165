// SPDX-License-Identifier: MIT
// Figures of errors along a path, for one direction (0: X, 1: Y, 2: Z).
#pragma once

#include <optional>
#include <vector>

#include "host-tools/twin/twin_file.h"

namespace compbox::simulation {

double distance_mm(const twin::xyz &a, const twin::xyz &b);

// Largest minus smallest error about the errors' own least-squares line along the path.
double range_about_line(const std::vector<twin::xyz> &positions_mm,
                        const std::vector<twin::xyz> &errors_um, std::size_t direction);

// Largest minus smallest error.
double range_of(const std::vector<twin::xyz> &errors_um, std::size_t direction);

// Largest |error|.
double largest_of(const std::vector<twin::xyz> &errors_um, std::size_t direction);

double mean_of(const std::vector<twin::xyz> &errors_um, std::size_t direction);
// With n − 1.
double variance_of(const std::vector<twin::xyz> &errors_um, std::size_t direction);

// Middle of the sorted values (mean of the two in the middle); values not empty.
double median_of(std::vector<double> values);

struct interval {
    double low, high;
};

// Two of the values, between which the median of all such machines lies with a probability of at
// least 95 %, whatever the distribution: the number of values below it is binomial.
// out: nothing for fewer than six values
std::optional<interval> median_interval(std::vector<double> values);

}  // namespace compbox::simulation
