// SPDX-License-Identifier: MIT
// One error of one axis as a random function of its position (docs/twin.md, "The curves").
#pragma once

#include <vector>

#include "host-tools/twin/random.h"

namespace compbox::twin {

// Power spectral density S(f) = f^-exponent / (1 + (f/fc)^roll_off), fc = 1/cutoff_mm.
struct roughness {
    double exponent = 2.5;
    double roll_off = 8.0;
    double cutoff_mm = 1000.0;
};

// A Gaussian random function with that spectrum, minus its least-squares line, scaled to a range.
//
// It is a sum of harmonics of a fundamental of four times the travel, with wavelengths down to a
// quarter of the cut-off, where the roll-off makes them negligible. It is continuous with all
// derivatives at any position, also beyond the travel.
class random_curve {
  public:
    // The line and the range are those over this number of equidistant points of the travel, both
    // ends included.
    static constexpr int reference_points = 2001;

    // min_mm < max_mm; amplitude_um >= 0: the range (largest minus smallest value) on the reference
    // points, exact to rounding.
    random_curve(double min_mm, double max_mm, double amplitude_um, const roughness &spectrum,
                 random_stream stream);

    // Error in µm. Cost: one multiply-add chain per harmonic, no table.
    double operator()(double position_mm) const;

  private:
    double raw(double position_mm) const;
    void refer_to_line(double amplitude_um);

    double min_mm_, max_mm_;
    std::vector<double> cosines_, sines_;  // of harmonic k + 1
    double line_offset_ = 0.0;             // at the middle of the travel
    double line_slope_ = 0.0;              // per mm
};

}  // namespace compbox::twin
