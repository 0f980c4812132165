// SPDX-License-Identifier: MIT
// Questions to a person, or to a script behind a pipe, that do not stop the cycle.
#pragma once

#include <functional>
#include <string>

namespace compbox::commission {

// Writes the question to standard error and calls wait() again and again until a line came from
// standard input; out: the line. Throws input_error when standard input ends.
std::string ask(const std::string &question, const std::function<void()> &wait);

// The same until the line is a finite number.
double ask_number(const std::string &question, const std::function<void()> &wait);

}  // namespace compbox::commission
