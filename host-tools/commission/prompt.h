// SPDX-License-Identifier: MIT
// Questions to a person or a script that do not stop the cycle.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>

#include "host-tools/formats/input_lines.h"

namespace compbox::commission {

class prompt {
  public:
    // in : a descriptor for the answers, a stream for the questions
    prompt(int in, std::ostream &err) : in_(in), err_(err), lines_(in) {}

    // Prints the question and calls wait() until a line is complete. out: the line without trailing
    // blanks. Throws input_error at the end of the input.
    std::string ask(const std::string &question, const std::function<void()> &wait);

    // Repeats the question until the line is a finite number.
    double ask_number(const std::string &question, const std::function<void()> &wait);

  private:
    int in_;
    std::ostream &err_;
    input_lines lines_;
};

}  // namespace compbox::commission
