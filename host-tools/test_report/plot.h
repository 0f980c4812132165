// SPDX-License-Identifier: MIT
// The usual figure of metrology: runs, mean and the band of two standard deviations.
#pragma once

#include <string>
#include <vector>

#include "host-tools/fitting/measurement.h"

namespace compbox::test_report {

// One panel for each file, the one before and possibly the one after, all with the same scale.
// heading: over all panels; may be empty
void plot_report(const std::vector<fitting::measurement> &files, const std::string &heading,
                 const std::string &path);

// The same without a heading, of the width of a printed page.
std::string report_svg(const std::vector<fitting::measurement> &files);

}  // namespace compbox::test_report
