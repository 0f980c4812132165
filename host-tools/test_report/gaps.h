// SPDX-License-Identifier: MIT
// Readings that are missing, and what to drop for figures of the others.
#pragma once

#include <string>
#include <vector>

#include "host-tools/fitting/measurement.h"

namespace compbox::test_report {

// Throws input_error if a run lacks a target: with the first such run, its missing targets, and
// both remedies with what they leave.
void refuse_gaps(const fitting::measurement &data);

// Takes runs (by name, in both directions) and targets off all files. Throws input_error, naming
// the file, for one that none of them has, and if nothing remains.
void drop(std::vector<fitting::measurement> &files, const std::vector<std::string> &runs,
          const std::vector<double> &targets_mm);

}  // namespace compbox::test_report
