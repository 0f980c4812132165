// SPDX-License-Identifier: MIT
// Sign and scale of a channel from a measured displacement, lead and period from measured times.
// Independent of the PLC.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

namespace compbox::commission {

// in : commanded and measured displacement of the tool, µm, of `axis`
// out: true: the tool moves the other way and the sign must be inverted
// Throws input_error if the two differ by more than the sign: no motion, a power of ten, another
// factor.
bool is_reversed(const std::string &axis, double offset_um, double measured_um);

struct spread {
    std::size_t count = 0;
    double p50_ms = 0.0, p99_ms = 0.0;
};
// Of times in µs, not empty.
spread spread_of(std::vector<std::int64_t> times_us);
json json_of(const spread &times);

// Measured times of a value's transfer, for lead and period.
struct loop_times {
    spread exchange;         // from the request of a reading to the confirmed write
    spread write;            // of that the write itself
    spread taken_over;       // from sending a write to its value being applied
    double update_ms = 0.0;  // the PLC's own, by its heartbeat
    double period_ms = 0.0;
    double round_ms =
        0.0;               // of the handshakes of all axes, one step alone does not see it; 0: none
    double line_ms = 0.0;  // interpolation time of the PLC; only its first step is visible
};
// A position waits half of an update in the PLC; a value is on the average half a period old before
// the next one comes, and where axes take turns it waits half a round (firmware/signals/lead.h).
double lead_of(const loop_times &times);
// The shortest whole ms of which four fifths hold 99 % of the exchanges.
double shortest_period_ms(const loop_times &times);

}  // namespace compbox::commission
