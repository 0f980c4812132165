// SPDX-License-Identifier: MIT
// Names, units and origins in a coefficient file that contradict each other.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

struct cb_config;

namespace compbox::coefficients {

constexpr double least_limit_um = 1.0;  // a smaller limit_um is one in mm

// in : a configuration and the file that it was loaded from
// out: one sentence with place and remedy for each
//   - term that is named after another axis, direction, kind (length, angle) or data file than it
//     has, that a sum holds twice, or that repeats another one number by number
//   - axis whose unit is not its own, or whose register cannot hold its range or is another's
//   - channel whose limit looks like mm or whose tangent is by another axis, and pair whose motors
//     have different signs or limits
//   - curve of positions that was measured with the instrument's correction of the temperature,
//     beside a term that corrects the temperature again
std::vector<std::string> name_remarks(const cb_config &config, const json &file);

}  // namespace compbox::coefficients
