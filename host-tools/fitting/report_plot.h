// SPDX-License-Identifier: MIT
// The usual figure of metrology: runs, mean and the band of two standard deviations.
#pragma once

#include <string>
#include <vector>

#include "host-tools/fitting/measurement.h"
#include "host-tools/metrology/iso230_2.h"

namespace compbox {

// The runs as read (without alignment), by target and direction. A run without a stated direction
// counts as forward. Throws input_error if a target lacks a reading of some run.
axis_readings readings_of(const measurement &data);

// One panel for each file, all with the same scale.
void plot_report(const std::vector<measurement> &files, const std::string &path);

}  // namespace compbox
