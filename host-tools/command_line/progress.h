// SPDX-License-Identifier: MIT
// Progress of long work: on a terminal, and only there.
#pragma once

#include <functional>
#include <string>

#include "host-tools/command_line/command_line.h"

namespace compbox::cli {

// A function to be called with 0 … 1; shows `what` and a percentage on io.err where that is a
// terminal, and clears the line at 1. Empty where it is not.
std::function<void(double)> progress_of(const cli::streams &io, const std::string &what);

// The same with a bar and a figure beside it, such as the loss of a training: called with 0 … 1 and
// the figure.
std::function<void(double, double)> progress_bar_of(const cli::streams &io, const std::string &what,
                                                    const std::string &figure);

}  // namespace compbox::cli
