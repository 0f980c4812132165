// SPDX-License-Identifier: MIT
// The real box against the PLC, the control and the axes of fakeplc, in one process and in virtual
// time: the registers are exchanged as Modbus requests and replies, only the wire is missing.
#pragma once

#include <vector>

#include "host-tools/fakeplc/plc.h"

extern "C" {
#include "hal/cycle.h"
}

namespace compbox::simulation {

// What a reading and a writing take on the wire; the PLC sees a request in the middle of it.
struct wire_times {
    int64_t read_us = 0, write_us = 0;
};

// A straight travel in one go, at a feed along it.
struct travel {
    xyz from_mm = {}, to_mm = {};
    double feed_mm_per_s = 0.0;
};

struct virtual_run {
    std::vector<twin_state> states;  // at rest: one for each position; in motion: many
    cb_counters counters;            // of the box, at the end
    double duration_s;               // virtual
    double lead_ms;                  // that the box looks ahead, at the end
};

// Starts the PLC and the box, waits until the box is ACTIVE, moves to each position in turn and
// waits there until the compensation stands still. Throws input_error, in words, when the box does
// not become or stay ACTIVE or does not come to rest.
virtual_run run_virtually(const cb_config &config, const twin_config &machine,
                          const register_map &map, const std::vector<xyz> &positions_mm,
                          double feed_mm_per_s, const wire_times &wire = {});

// The same to the beginning of a travel, and along it without a stop. At most about most_states
// moments of the motion are kept, at equal times.
virtual_run run_in_motion(const cb_config &config, const twin_config &machine,
                          const register_map &map, const travel &way, const wire_times &wire,
                          int most_states = 4000);

}  // namespace compbox::simulation
