// SPDX-License-Identifier: MIT
// One set-up of a laser: direction of its beam, its time, and the noise of its readings.
#pragma once

#include <string>

#include "host-tools/twin/machine.h"
#include "host-tools/twin/random.h"

namespace compbox::twin {

class laser_set_up {
  public:
    // name: of the measured error; each has its own streams and its own hour within the month
    // before the control starts. straight: the beam is a straightness reference and has a slope,
    // and the readings the noise of that instrument, unless they are angles.
    laser_set_up(const twin_machine &twin, const std::string &name, bool straight,
                 bool angles = false);

    // One reading: the error plus beam, approach and noise, rounded. way_mm: from the first target.
    double reading_um(double error_um, double way_mm);
    // The unexplained error now at the machine's position; each reading takes 10 s.
    xyz unexplained_um(const xyz &position_mm);

  private:
    const twin_machine &twin_;
    random_stream noise_;
    double slope_um_per_mm_ = 0.0, offset_um_ = 0.0, sigma_um_;
    double time_s_;
};

// Rounds to the laser's least digit.
double as_shown(double error_um, const twin_config &config);

}  // namespace compbox::twin
