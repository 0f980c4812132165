// SPDX-License-Identifier: MIT
// The read block by libmodbus, which shares no line with the box's own client, beside the box's
// readings.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

extern "C" {
#include "firmware/config/plc.h"
}
#include "host-tools/commission/live.h"
#include "host-tools/formats/json_type.h"

namespace compbox::commission {

class second_opinion {
  public:
    // One reading by libmodbus, before the box connects, because an 840D's server takes one client.
    // Over TCP only.
    explicit second_opinion(const cb_plc_config &plc);

    // Looks at each reading of the box from now on, by live.on_reading.
    void observe(live_box &live);

    // Ends that. Registers that stayed the same in all readings are compared; the others change.
    // out: {"compared", "changing", "differing": [address …]}, or {"fault"}; null on a serial line
    json compare(live_box &live) const;

  private:
    std::vector<std::uint16_t> by_libmodbus_;  // empty: none
    std::string fault_;                        // why there is none; "" on a serial line
    std::vector<std::uint16_t> own_;           // the box's newest
    std::vector<bool> changed_;                // of its registers
};

// out: one line for a person, and the remark about differing registers; "": none
std::string comparison_text(const json &comparison);
std::string comparison_remark(const json &comparison);

}  // namespace compbox::commission
