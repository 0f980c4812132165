// SPDX-License-Identifier: MIT
// A block of lines above the line at which a person types: drawn again in its place on a terminal.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "host-tools/command_line/command_line.h"

namespace compbox::cli {

// out: characters of UTF-8 text
std::size_t characters(const std::string &text);
// out: the first `columns` characters of UTF-8 text
std::string clipped(const std::string &text, std::size_t columns);
// out: the text with blanks behind it, at least so many characters
std::string padded(const std::string &text, std::size_t columns);

class screen {
  public:
    // Draws nothing where io.err is no terminal.
    explicit screen(const streams &io) : err_(io.err), terminal_(io.shows_progress) {}

    bool is_terminal() const { return terminal_; }

    // Lines that fit: of the terminal's size, with two lines left for the question.
    std::size_t rows() const;

    // Replaces the block; lines are clipped to the terminal, the last ones dropped where it is too
    // low. The first call begins at the start of a line and leaves the cursor below the block,
    // where the question follows; later ones leave it where it is in the question's line.
    void draw(const std::vector<std::string> &lines);

    // Removes block and question after the answer's line end, so that permanent lines follow in
    // their place.
    void clear();

  private:
    std::ostream &err_;
    bool terminal_;
    std::size_t drawn_ = 0;  // lines on the terminal
};

}  // namespace compbox::cli
