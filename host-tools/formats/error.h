// SPDX-License-Identifier: MIT
// Mistakes that a person can make and mend; every tool turns them into one sentence and exit 1.
#pragma once

#include <stdexcept>
#include <string>

namespace compbox {

// What is wrong, where, and what to do. `what()` is the whole sentence, without a full stop.
class input_error : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
    // "FILE:LINE:COLUMN: sentence"; a line or column of 0 is left out.
    input_error(const std::string &file, long line, long column, const std::string &sentence)
        : std::runtime_error(place(file, line, column) + sentence) {}

  private:
    static std::string place(const std::string &file, long line, long column) {
        std::string text = file;
        if (line > 0) text += ":" + std::to_string(line);
        if (line > 0 && column > 0) text += ":" + std::to_string(column);
        return text + ": ";
    }
};

}  // namespace compbox
