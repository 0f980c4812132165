// SPDX-License-Identifier: MIT
// The real box against the PLC, the control and the axes of fakeplc, in one process and in virtual
// time: the registers are exchanged as Modbus requests and replies, only the wire is missing.
#pragma once

#include <vector>

#include "host-tools/fakeplc/plc.h"

extern "C" {
#include "hal/cycle.h"
}

namespace compbox {

// A machine at rest.
struct settled_stop {
    xyz position_mm;      // as the control shows it
    xyz displacement_um;  // of the tool, by what has entered the axes
};

struct virtual_run {
    std::vector<settled_stop> stops;  // one for each position asked for
    cb_counters counters;             // of the box, at the end
    double duration_s;                // virtual
};

// Starts the PLC and the box, waits until the box is ACTIVE, moves to each position in turn and
// waits there until the compensation stands still. Throws input_error, in words, when the box does
// not become or stay ACTIVE or does not come to rest.
virtual_run run_virtually(const cb_config &config, const twin_config &machine,
                          const register_map &map, const std::vector<xyz> &positions_mm,
                          double feed_mm_per_s);

}  // namespace compbox
