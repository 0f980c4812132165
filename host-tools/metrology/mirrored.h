// SPDX-License-Identifier: MIT
// Signs that are wrong: a run that mirrors the others, an error that compensation has doubled.
// docs/test-report.md states the rules, tests/unit/metrology/mirrored_test.cpp their rate of false
// alarms.
#pragma once

#include <optional>
#include <vector>

namespace compbox::metrology {

// The deviations of one run at the targets; any unit.
struct directed_run {
    int direction = 1;  // +1, -1, or 0 if unknown
    std::vector<double> deviation;
};

// out: indices of the runs that mirror the others of their direction, ascending. Empty if the runs
// have too little in common to decide, for fewer than 5 targets and for fewer than 3 runs.
// in : position_mm ascending; every run has a deviation at each
std::vector<std::size_t> mirrored_runs(const std::vector<double> &position_mm,
                                       const std::vector<directed_run> &runs);

// out: the factor, if the error after has the shape of the error before and about twice its size
// (1.5 to 2.5); empty otherwise, and for fewer than 5 targets.
// in : means at the same ascending positions; sigma: standard deviation of a mean, 0 if unknown
std::optional<double> doubled_error(const std::vector<double> &position_mm,
                                    const std::vector<double> &before,
                                    const std::vector<double> &after, double sigma);

}  // namespace compbox::metrology
