// SPDX-License-Identifier: MIT
// Lines typed by a person or sent by a script, for a program that must not wait for them.
#pragma once

#include <optional>
#include <string>

namespace compbox {

class input_lines {
  public:
    explicit input_lines(int descriptor) : descriptor_(descriptor) {}
    // Reads once; false at the end of the input. Waits where nothing is there: poll before. Drops
    // a line that is longer than 64 kB.
    bool read_more();
    // The next whole line without its end; nothing where none has been read.
    std::optional<std::string> next();

  private:
    int descriptor_;
    std::string text_;
};

}  // namespace compbox
