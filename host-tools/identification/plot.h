// SPDX-License-Identifier: MIT
// Plot of the six identified errors of an axis.
#pragma once

#include <string>

#include "host-tools/identification/identify.h"
#include "host-tools/identification/plan.h"

namespace compbox::identification {

// The six curves with their ±2 sigma bands, one panel each. Throws input_error (formats/plot.h).
void plot_identified(const six_curves &curves, int axis, const std::string &path);

// The box, its nodes and the three points of a plan in the axis' own frame. Throws likewise.
void plot_plan(const points_mm &points, const std::vector<point_mm> &nodes, const std::string &axis,
               const std::string &path);

}  // namespace compbox::identification
