// SPDX-License-Identifier: MIT
// Temperatures of the machine and load of its spindle over time, and their display by instruments
// and the PLC.
#pragma once

#include <optional>

#include "host-tools/twin/state.h"
#include "host-tools/twin/thermal.h"

namespace compbox::twin {

class machine_process {
  public:
    // Starts at the air's temperature. config.seed determines all random values.
    explicit machine_process(const twin_config &config);

    // in : 0 < dt_s <= 1 s since the last call; the axes' and the spindle's activity in it
    void advance(double dt_s, const twin_state &now);

    // Sets temperatures by the names of the nodes, and the spindle's load, in the state.
    void fill(twin_state &state) const;

    // The PLC's value: a thermometer by the name of its signal, spindle_rpm, spindle_load_percent,
    // feed_mm_per_min, depth_of_cut_mm. Empty for other names, and for machines without `thermal`
    // or `cutting` in their file.
    std::optional<double> signal(const std::string &name) const;

  private:
    cutting_config cutting_;
    thermal_config thermal_config_;
    thermal_process thermal_;
    random_stream load_noise_;
    twin_state now_;
    bool has_any_;
    double filtered_load_percent_ = 0.0, shown_load_percent_ = 0.0, since_load_s_ = 0.0;
};

}  // namespace compbox::twin
