// SPDX-License-Identifier: MIT
// The steps of `compbox commission` with a live PLC. Each returns its figures, or throws
// input_error with the inconsistency, its place in the file and the remedy.
#pragma once

#include "host-tools/commission/judge.h"
#include "host-tools/commission/live.h"

namespace compbox::commission {

// Reads the block for some seconds. Checks replies, consistency, heartbeat, plausible signals and
// accepted writes; tries to read the write block back.
// out: {"signals": {NAME: value}, "control": …, "update_ms": …, "read_back": "answered", "refused"}
json check_registers(live_box &live, const box_setup &setup);

// out: consequence and remedy if the PLC rejects the read-back; "": it does not
std::string read_back_remark(const live_box &live);

// Waits until the PLC sets enable and referenced and the box is ACTIVE.
void become_active(live_box &live);

// Ramps the channels of an axis to the offset and waits until they are there and, where the file
// has `applied`, until the PLC applies them and leaves the others alone.
void go_to(live_box &live, const test_axis &axis, double offset_um);

// Throws input_error if the PLC withdraws its permission, on a fault, and if the box does not
// return to ACTIVE within seconds; a computer may miss single cycles.
void must_be_active(const live_box &live);

// Cycles at least once, and must be active.
void stay_active(live_box &live, double seconds);

// Small steps to and fro on a channel with `applied`.
loop_times measure_times(live_box &live, std::size_t channel, int steps, double update_ms);

}  // namespace compbox::commission
