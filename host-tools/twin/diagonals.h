// SPDX-License-Identifier: MIT
// Two face diagonals of a rectangle in the working space, by a laser: they show the squareness.
#pragma once

#include <functional>
#include <string>

#include "host-tools/twin/machine.h"

namespace compbox::twin {

struct face {
    std::string name;                        // C0Y, B0Z or A0Z: the plane of its two axes
    xyz corner_mm = {};                      // low corner; the third axis stays here
    double first_mm = 0.0, second_mm = 0.0;  // sides along the first and the second axis
};

// Measured minus nominal length in µm of the diagonal on which both axes rise, and of the other.
struct diagonals {
    double rising_um, falling_um;
};

// Each is the mean over the laser's number of runs. compensation gives the state of the machine at
// rest at a position, with the control's compensation there.
diagonals measure_diagonals(const twin_machine &twin, const face &rectangle,
                            const std::function<twin_state(const xyz &)> &compensation);

}  // namespace compbox::twin
