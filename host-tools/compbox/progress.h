// SPDX-License-Identifier: MIT
// Progress of long work: on a terminal, and only there.
#pragma once

#include <functional>
#include <string>

namespace compbox {

// A function to be called with 0 … 1; shows `what` and a percentage on standard error where that is
// a terminal, and clears the line at 1. Empty where it is not.
std::function<void(double)> progress_of(const std::string &what);

}  // namespace compbox
