// SPDX-License-Identifier: MIT
// Mistakes that a person can make and mend; every tool turns them into one sentence and exit 1.
#pragma once

#include <stdexcept>
#include <string>

#include "host-tools/formats/text.h"

namespace compbox {

// What is wrong, where, and what to do. `what()` is the whole sentence, without a full stop, and
// printable (text.h), whatever it quotes.
class input_error : public std::runtime_error {
  public:
    explicit input_error(const std::string &sentence) : std::runtime_error(printable(sentence)) {}
    // "FILE:LINE:COLUMN: sentence"; a line or column of 0 is left out.
    input_error(const std::string &file, long line, long column, const std::string &sentence)
        : input_error(place(file, line, column) + sentence) {}

  private:
    static std::string place(const std::string &file, long line, long column) {
        std::string text = file;
        if (line > 0) text += ":" + std::to_string(line);
        if (line > 0 && column > 0) text += ":" + std::to_string(column);
        return text + ": ";
    }
};

}  // namespace compbox
