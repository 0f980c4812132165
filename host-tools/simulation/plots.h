// SPDX-License-Identifier: MIT
// Figures of a simulation and of a real-time run.
#pragma once

#include <string>

#include "host-tools/simulation/paths.h"
#include "host-tools/simulation/plc_log.h"

namespace compbox::simulation {

// FOLDER/PATH.svg for each path of the first seed: true error along it, before and after.
void plot_paths(const scenario &plan, const simulation &result, const std::string &folder);

// Of the first seed, for a scenario with recipes: FOLDER/curves-X.svg for each axis, with the
// readings and curves of all its errors by the first method; FOLDER/key-points.svg, the largest
// residual of each curve over the number of key points, for the first method that has some.
void plot_curves(const simulation &result, const std::string &folder);

// The compensation over time: target, displacement of the axes, residual error.
void plot_log(const plc_log &log, const std::string &file);

}  // namespace compbox::simulation
