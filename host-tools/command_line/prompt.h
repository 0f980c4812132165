// SPDX-License-Identifier: MIT
// Questions to a person or a script, with work that goes on until the answer is there.
#pragma once

#include <functional>
#include <iosfwd>
#include <optional>
#include <string>

#include "host-tools/command_line/command_line.h"
#include "host-tools/formats/input_lines.h"

namespace compbox::cli {

// A number as a person types it: "-19.8", "+19,8".
struct typed_number {
    double value = 0.0;
    int decimals = 0;  // digits behind the point or comma
};
// out: nothing for anything else than one finite decimal number
std::optional<typed_number> number_in(const std::string &text);

class prompt {
  public:
    explicit prompt(const streams &io);

    bool at_terminal() const { return terminal_; }

    // Prints the question and calls wait() again and again until a line is complete; without wait
    // it blocks. out: the line without blanks at its ends; nothing at the end of the input
    std::optional<std::string> ask(const std::string &question,
                                   const std::function<void()> &wait = {});

  private:
    void call(const std::function<void()> &wait);

    int in_;
    std::ostream &err_;
    formats::input_lines lines_;
    bool terminal_;
};

}  // namespace compbox::cli
