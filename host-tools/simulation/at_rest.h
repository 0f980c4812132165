// SPDX-License-Identifier: MIT
// The effect of a coefficient file on the machine at rest: −Σ of its terms in each drive.
#pragma once

#include <vector>

#include "host-tools/twin/state.h"

struct cb_config;

namespace compbox::simulation {

// The state of the machine at rest, compensated, at each position, at time 0. Channels go to the
// drives of their names, to the axis that the machine maps them to, or to that of their name.
std::vector<twin::twin_state> states_at_rest(const cb_config &config,
                                             const twin::twin_config &machine,
                                             const std::vector<twin::xyz> &positions_mm);

}  // namespace compbox::simulation
