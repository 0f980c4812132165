// SPDX-License-Identifier: MIT
// Figures of the demand over the travel, one for each channel.
#pragma once

#include <string>
#include <vector>

struct cb_config;

namespace compbox::coefficients {

// Writes the demand of each channel over each position that it depends on: with the other axes at
// home, the band of all their positions, and limit_um and error_um. A path with a suffix of
// run_gnuplot() is one file, with the channels below each other; any other path is a folder with
// CHANNEL.svg.
// in : home as home_of()
// out: the written files. Throws input_error as run_gnuplot(), and where no channel depends on a
//      position.
std::vector<std::string> plot_demand(const cb_config &config, const std::vector<double> &home,
                                     const std::string &path);

}  // namespace compbox::coefficients
