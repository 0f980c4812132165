// SPDX-License-Identifier: MIT
// One set-up of a laser: where its beam points, when it stood there, and how its readings scatter.
#pragma once

#include <string>

#include "host-tools/twin/machine.h"
#include "host-tools/twin/random.h"

namespace compbox {

class laser_set_up {
  public:
    // name: of what is measured; each has its streams and its hour within the month before the
    // control starts. straight: the beam is a straightness reference and has a slope.
    laser_set_up(const twin_machine &twin, const std::string &name, bool straight);

    // One reading: the error, and beam, approach and noise, rounded. way_mm: from the first target.
    double reading_um(double error_um, double way_mm);
    // The unexplained error of this moment where the machine stands; each reading takes 10 s.
    xyz unexplained_um(const xyz &position_mm);

  private:
    const twin_machine &twin_;
    random_stream noise_;
    double slope_um_per_mm_ = 0.0, offset_um_ = 0.0;
    double time_s_;
};

// To the least digit of the laser.
double as_shown(double error_um, const twin_config &config);

}  // namespace compbox
