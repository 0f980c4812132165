// SPDX-License-Identifier: MIT
// The default register map, which compbox init lays out (docs/fakeplc.md).
#pragma once

#include <string>

#include "host-tools/fakeplc/register_map.h"

namespace compbox {

// axes: letters of XYZ, each once; profile: a known one. Each axis has a position and a channel.
register_map usual_register_map(const std::string &axes, const std::string &profile);

}  // namespace compbox
