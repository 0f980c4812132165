// SPDX-License-Identifier: MIT
// Numbers that a person types: commands of the console, options. Both throw input_error with one
// sentence.
#pragma once

#include <string>

namespace compbox::fakeplc {

// out: finite; the whole text is the number
double number(const std::string &text);

// out: low to high
int whole(const std::string &text, int low, int high);

}  // namespace compbox::fakeplc
