// SPDX-License-Identifier: MIT
// Lines of an input, read without blocking.
#pragma once

#include <optional>
#include <string>

namespace compbox::formats {

class input_lines {
  public:
    explicit input_lines(int descriptor) : descriptor_(descriptor) {}
    // Reads once; false at the end of the input. Blocks without data: poll first. Discards a line
    // longer than 64 kB.
    bool read_more();
    // out: the next complete line without its end; nothing: none yet
    std::optional<std::string> next();

  private:
    int descriptor_;
    std::string text_;
};

}  // namespace compbox::formats
