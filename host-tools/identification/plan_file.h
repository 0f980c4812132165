// SPDX-License-Identifier: MIT
// plan.json: {"points_mm": [[x,y,z],[x,y,z],[x,y,z], …], …}, coordinates in the axis' own frame.
#pragma once

#include <string>

#include "host-tools/formats/json_type.h"
#include "host-tools/identification/points.h"

namespace compbox::identification {

// Reads the points. Throws input_error for anything but three or more triples of finite numbers.
points_mm read_plan(const std::string &path);

json points_json(const points_mm &points);

// 0, 1, 2 of "X", "Y", "Z" (either case).
int axis_of(const std::string &name);

}  // namespace compbox::identification
