// SPDX-License-Identifier: MIT
// Noise of the lines of a nine-line measurement by their repeated runs.
#pragma once

#include <vector>

#include "host-tools/identification/points.h"

namespace compbox::identification {

// The repeats of one line.
struct line_repeats {
    double variance_um2 = 0.0;  // of one reading, between repeats
    int freedom = 0;            // its degrees of freedom; 0: one run
    double mean_share = 1.0;    // variance of the mean of the runs over that of one reading
    // Variance of the runs' slopes over that which independent readings of variance_um2 would have.
    // Noise that is correlated along a run, and drift, make it larger than 1.
    double slope_ratio = 1.0;
    int slope_freedom = 0;  // its degrees of freedom; 0: unknown
};

// One traverse of a line: its error at each position of the line.
struct line_run {
    std::vector<double> error_um;
    bool backward = false;
};

// in : three or more positions; runs with an error at each of them
// out: scatter of the runs about the mean of their direction. Each run's own offset and slope are
//      kept apart, because the set-up's hide the offsets' mean, and the slopes have a variance of
//      their own. mean_share is 1. No freedom if no direction has two runs.
line_repeats repeats_of(const std::vector<double> &position_mm, const std::vector<line_run> &runs);

// in : the lines d1x d1y d1z d2x …
// out: sigma of each line's mean. Lines of one direction have one instrument, so their variances
//      are pooled unless they differ beyond chance (Bartlett's test, 0.001); a line of one run has
//      the pooled variance of its direction. Readings that repeat to the last digit are taken for
//      1 % of the largest sigma. Empty if a direction has no repeats, or none of them differ.
line_sigma sigma_by_runs(const std::vector<line_repeats> &lines);

// in : the lines d1x d1y d1z d2x …
// out: sigma of each line's slope over that of independent readings. 1 unless the runs show more,
//      beyond chance (0.001); of all lines together unless the directions differ beyond chance.
Eigen::VectorXd slope_factors(const std::vector<line_repeats> &lines);

// out: the value that a sum of squares of `freedom` standard normal numbers exceeds as rarely as
//      one of them exceeds `deviation` (Wilson and Hilferty)
double largest_chance(double freedom, double deviation);

}  // namespace compbox::identification
