// SPDX-License-Identifier: MIT
// The steps of `compbox commission` against a live PLC. Each returns its figures, or throws
// input_error with what is inconsistent, where in the file, and what to do.
#pragma once

#include "host-tools/commission/judge.h"
#include "host-tools/commission/live.h"

namespace compbox::commission {

// Reads the block for some seconds: it answers, is whole, the heartbeat counts, every signal is
// plausible, writes are accepted; whether the write block can be read back.
// out: {"signals": {NAME: value}, "control": …, "update_ms": …, "read_back": "answered", "refused"}
json check_registers(live_box &live, const box_setup &setup);

// What a PLC that refuses the read-back costs, and what to set in it. "": this one does not.
std::string read_back_remark(const live_box &live);

// Waits until the box is ACTIVE on the PLC's enable and referenced bits.
void become_active(live_box &live);

// Ramps the channels of an axis to the offset and waits until they are there and, where the file
// has `applied`, until the PLC applies them and leaves the others alone.
void go_to(live_box &live, const test_axis &axis, double offset_um);

// Throws where the PLC took its permission away, where there is a fault, and where the box could
// not go back to ACTIVE for some seconds: a computer that is no box stumbles now and then.
void must_be_active(const live_box &live);

// Cycles at least once, and must be active.
void stay_active(live_box &live, double seconds);

// Small steps to and fro on a channel with `applied`.
loop_times measure_times(live_box &live, std::size_t channel, int steps, double update_ms);

}  // namespace compbox::commission
