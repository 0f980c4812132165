// SPDX-License-Identifier: MIT
// The twin file's keys of geometry: errors, chain, squareness, stages (docs/twin.md).
#pragma once

#include "host-tools/twin/reading.h"
#include "host-tools/twin/twin_file.h"

namespace compbox::twin {

// config.axes must have been read. Throws input_error with file and key.
void read_geometry(const json &root, twin_config &config, const reading::place &top);

}  // namespace compbox::twin
