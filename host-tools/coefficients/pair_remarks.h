// SPDX-License-Identifier: MIT
// Checks whether the curves of two motors of one stage exceed the limit of their pair.
#pragma once

#include <string>
#include <vector>

struct cb_config;

namespace compbox::coefficients {

// out: one sentence for each pair whose curves have a larger difference than max_difference_um, at
// 201 places along each measured signal with the others in the middle of their ranges. The box
// limits the difference there, and the stage yaws by the rest.
std::vector<std::string> pair_remarks(const cb_config &config);

}  // namespace compbox::coefficients
