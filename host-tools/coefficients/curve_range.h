// SPDX-License-Identifier: MIT
// The range of a curve of a coefficient file over its signal.
#pragma once

#include <optional>
#include <string>

#include "host-tools/coefficients/machine_file.h"
#include "host-tools/formats/json_type.h"

namespace compbox::coefficients {

// out: a term's own range; from >= to: none
travel_range range_of_curve(const json &term);

// out: from the lowest to the highest end of all curves over a signal; nothing without a curve
std::optional<travel_range> range_of_curves(const json &terms, const std::string &signal);

}  // namespace compbox::coefficients
