// SPDX-License-Identifier: MIT
// Files of very many positions. The estimate of a curve passes over every position for each of some
// hundred models, and a curve of the box has at most CB_MAX_CURVE_POINTS coefficients. Beyond
// most_positions the readings of each run are averaged in cells that are far smaller than what such
// a curve resolves.
#pragma once

#include "host-tools/fitting/measurement.h"

namespace compbox::fitting {

constexpr std::size_t most_positions = 20000;

// out: the measurement itself for at most `most` positions; else with the readings of each run
//      averaged in `most` cells. The first and the last cell are centred at the ends of the travel.
//      A cell's mean is moved to its centre along the run's slope. A cell counts as one reading, in
//      proportion to its number of readings, and the scatter within cells measures the noise where
//      there are no repeats.
measurement in_cells(const measurement &data, std::size_t most = most_positions);

}  // namespace compbox::fitting
