// SPDX-License-Identifier: MIT
// Error that no input of a model explains: a rough function of the position that drifts with time,
// so that yesterday's measurement is no longer true. No model can learn it.
#pragma once

#include <vector>

#include "host-tools/twin/part.h"
#include "host-tools/twin/random.h"

namespace compbox::twin {

// In each direction the range over the working space and over a day is `percent` of the explained
// parts' range there, with the temperatures and forces of a working day, if the machine has them.
class unexplained : public error_part {
  public:
    unexplained(const twin_config &config, const std::vector<part_pointer> &explained);

    xyz error_um(const twin_state &state) const override;

  private:
    // One wave in space that travels with time.
    struct wave {
        double phase;     // in turns
        double per_s;     // turns per second
        xyz per_mm = {};  // turns per mm
        double height_um = 0.0;
    };
    xyz raw(const twin_state &state) const;
    void scale(const twin_config &config, const std::vector<part_pointer> &explained);

    std::array<std::vector<wave>, 3> waves_;
};

}  // namespace compbox::twin
