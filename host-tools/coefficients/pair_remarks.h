// SPDX-License-Identifier: MIT
// Whether the curves of two motors of one stage ask for more than their pair allows.
#pragma once

#include <string>
#include <vector>

struct cb_config;

namespace compbox::coefficients {

// One sentence for each pair whose curves demand a larger difference than max_difference_um
// somewhere: the box holds them back there, and the stage yaws by the rest. Looked at are 201
// places along each measured signal, the others in the middle of their ranges.
std::vector<std::string> pair_remarks(const cb_config &config);

}  // namespace compbox::coefficients
