// SPDX-License-Identifier: MIT
// Readings of a warm scale as those at 20 °C, the reference temperature of lengths (ISO 1).
#pragma once

#include <vector>

#include "host-tools/formats/rtl.h"

namespace compbox::metrology {

constexpr double reference_degC = 20.0;

// out: by how much a scale of this temperature is longer than at 20 °C between two positions, µm
double expansion_um(double from_mm, double to_mm, double expansion_um_per_m_K, double degC);

// The material's temperature in the middle of a run, between start and end of the measurement.
double degC_of_run(const formats::start_and_end &material, std::size_t run, std::size_t runs);

// Takes the expansion of the scale off one run's errors. A warm scale carries the tool too far, so
// the error falls by what the scale has grown from the origin to the position. `fit` may call it
// for each run of a measurement, before average_runs(). in : position_mm and error_um of the same
// size
void convert_to_20_degC(const std::vector<double> &position_mm, std::vector<double> &error_um,
                        double origin_mm, double expansion_um_per_m_K, double degC);

}  // namespace compbox::metrology
