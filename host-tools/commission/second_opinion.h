// SPDX-License-Identifier: MIT
// The read block by libmodbus, which shares no line with the box's own client, beside the box's
// readings.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host-tools/commission/live.h"
#include "host-tools/formats/json_type.h"

namespace compbox::commission {

// One reading by libmodbus. Made before the box connects, because an 840D's server takes one
// client; closed at once.
struct second_opinion {
    std::vector<std::uint16_t> registers;  // empty: none
    std::string fault;                     // why there is none; "" on a serial line
};
second_opinion ask_libmodbus(const cb_plc_config &plc);

// Cycles for a moment. Registers that stay the same in the box's readings are compared; the others
// change too fast.
// out: {"compared", "changing", "differing": [address …], "fault"}; null without an opinion
json compare(const second_opinion &by_libmodbus, live_box &live);

// out: one line for a person, and the remark about differing registers; "": none
std::string comparison_text(const json &comparison);
std::string comparison_remark(const json &comparison);

}  // namespace compbox::commission
