// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "host-tools/identification/identify.h"

namespace compbox {

// The six curves with their ±2 sigma bands, one panel each. Throws input_error (formats/plot.h).
void plot_identified(const six_curves &curves, int axis, const std::string &path);

}  // namespace compbox
