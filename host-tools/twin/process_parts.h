// SPDX-License-Identifier: MIT
// Heat and force as parts of the tool's error (part.h).
#pragma once

#include <vector>

#include "host-tools/twin/part.h"
#include "host-tools/twin/random.h"

namespace compbox::twin {

// Expansion by the temperatures in the state, by the names of the nodes; a missing node has the
// reference temperature.
class thermal_part : public error_part {
  public:
    explicit thermal_part(const twin_config &config);
    xyz error_um(const twin_state &state) const override;
    // Temperatures at a random moment of a working day.
    void vary(twin_state &state, random_stream &stream) const override;

  private:
    void work_a_day(const twin_config &config);

    thermal_config config_;
    std::vector<std::vector<double>> moments_;  // node temperatures
};

// Deflection by speed, feed and depth in the state.
class force_part : public error_part {
  public:
    explicit force_part(const twin_config &config) : config_(drawn(config.cutting, config.seed)) {}
    xyz error_um(const twin_state &state) const override;
    void vary(twin_state &state, random_stream &stream) const override;

  private:
    cutting_config config_;
};

}  // namespace compbox::twin
