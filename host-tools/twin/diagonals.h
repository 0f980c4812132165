// SPDX-License-Identifier: MIT
// The face and body diagonals of a box in the working space, by a laser (ISO 230-6): they show
// squareness and linear roll.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host-tools/twin/machine.h"

namespace compbox::twin {

struct diagonal_reading {
    std::string diagonal;  // "XY low rising" … "body Y Z falling"
    int run;               // 1 …
    xyz position_mm;
    double error_um;  // measured minus nominal way along the diagonal, from a zero of the set-up
};

// Both diagonals of the six faces and the four of the body, with so many equidistant targets (at
// least 2), as many runs as the laser makes. Each diagonal is one set-up. compensation gives the
// state of the machine at rest at a position, with the control's compensation there.
std::vector<diagonal_reading> measure_diagonals(
    const twin_machine &twin, const xyz &low_mm, const xyz &high_mm, int targets,
    const std::function<twin_state(const xyz &)> &compensation);

// out: a table that `compbox volumetric --diagonals` reads
std::string diagonals_text(const std::vector<diagonal_reading> &readings);

}  // namespace compbox::twin
