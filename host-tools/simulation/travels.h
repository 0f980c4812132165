// SPDX-License-Identifier: MIT
// Travels of the axes in a world, and the machine's states on them.
#pragma once

#include <vector>

#include "host-tools/simulation/world.h"

namespace compbox::simulation {

// A straight travel in one go, at a feed along it.
struct travel {
    twin::xyz from_mm = {}, to_mm = {};
    double feed_mm_per_s = 0.0;
};

// Waits until the box is ACTIVE, moves to each position and waits until the compensation is
// constant. out: the state at each position. Throws input_error if the box does not become or stay
// ACTIVE or does not settle.
std::vector<twin::twin_state> states_at(world &at, const std::vector<twin::xyz> &positions_mm,
                                        double feed_mm_per_s);

// The same to the beginning of a travel, and along it without a stop. out: at most about
// most_states moments of the motion, at equal times.
std::vector<twin::twin_state> states_along(world &at, const travel &way, int most_states = 4000);

}  // namespace compbox::simulation
