// SPDX-License-Identifier: MIT
// The virtual laser: measures the twin as a person with an interferometer, and gives no other
// access.
#pragma once

#include <string>
#include <vector>

#include "host-tools/twin/machine.h"

namespace compbox::twin {

// The readings of one set-up along one axis, the input of the writers of file formats.
struct laser_series {
    struct reading {
        double position_mm, error_um;  // or µrad
        int run;                       // from 1
    };
    std::string name;  // ISO 230-1: EZX …, or a drive of a stage: X1
    std::vector<reading> readings;
    std::string unit = "um";  // or urad: a rotation
};

class virtual_laser {
  public:
    // The noise depends on twin.config().seed. The twin must outlive the laser.
    explicit virtual_laser(const twin_machine &twin);

    // Target positions of an axis ('X'): every measure_every_mm from the low end, and the high end;
    // the last interval is shorter if the travel is not a multiple.
    std::vector<double> targets_mm(char axis) const;

    // One set-up: all runs over all targets, the other axes at start_mm, uncompensated. A
    // displacement is that of the tool, minus a constant. The beam adds a slope and offset, the
    // machine its repeatability at each approach, each reading its noise; the result is rounded to
    // the resolution.
    laser_series measure(const std::string &name) const;

    // Remeasurement: one noisy reading of the tool error in X, Y, Z in that state. Each call draws
    // new noise. There is no slope or offset, because it is one set-up along the whole path, and
    // figures are ranges.
    xyz read_tool_error_um(const twin_state &state) { return shown(twin_.true_error_um(state)); }
    xyz read_tool_error_um(const xyz &position_mm, const xyz &displacement_um) {
        return read_tool_error_um(state_at(position_mm, displacement_um));
    }
    // One such reading of a true error.
    xyz shown(xyz error_um);

  private:
    double true_value(const std::string &name, const error_name &error,
                      const xyz &position_mm) const;

    const twin_machine &twin_;
    random_stream remeasure_;
};

// "position_mm,error_um,run" as CSV text; error_urad for a rotation.
std::string laser_csv(const laser_series &series);

// Measures every configured error and every side of a stage, and writes FOLDER/NAME.csv. out: the
// written paths. Throws input_error when a file cannot be written.
std::vector<std::string> measure_all(const twin_machine &twin, const std::string &folder);

}  // namespace compbox::twin
