// SPDX-License-Identifier: MIT
// The keys `thermal` and `cutting` of a twin file. Every key: docs/twin.md, "Heat" and "Force".
#pragma once

#include "host-tools/twin/force.h"
#include "host-tools/twin/reading.h"
#include "host-tools/twin/thermal.h"

namespace compbox::twin {

// Each function reads the value of its key and throws input_error with the place of a mistake.
thermal_config read_thermal(const json &value, const reading::place &at);
cutting_config read_cutting(const json &value, const reading::place &at);

}  // namespace compbox::twin
