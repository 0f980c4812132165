// SPDX-License-Identifier: MIT
// From bytes as they come to whole lines, in bounded memory.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace compbox::box_files {

using line_taker = std::function<void(std::string_view)>;  // a line without its end

class line_cutter {
  public:
    // in : longer lines are left out
    explicit line_cutter(std::size_t most_line) : most_line_(most_line) {}

    // Hands over the lines that the bytes end, and keeps the rest.
    void add(std::string_view bytes, const line_taker &take);

    void clear();

  private:
    std::size_t most_line_;
    std::string rest_;
    bool skips_ = false;  // the rest of a long line
};

}  // namespace compbox::box_files
