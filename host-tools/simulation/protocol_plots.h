// SPDX-License-Identifier: MIT
// Figures of a scenario of parts.
#pragma once

#include <string>

#include "host-tools/simulation/protocols.h"

namespace compbox::simulation {

// FOLDER/PROTOCOL.svg: the true error of every judged point of the first machine, in the order in
// which they were cut, without compensation and as left by each method.
void plot_parts(const part_scenario &plan, const part_results &results, const std::string &folder);

}  // namespace compbox::simulation
