// SPDX-License-Identifier: MIT
// The lines of a file that another program appends to, renames away and begins anew.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "host-tools/box_files/line_cutter.h"

namespace compbox::box_files {

class followed_file {
  public:
    // in : most_line: longer lines are left out
    followed_file(const std::string &path, std::size_t most_line)
        : path_(path), lines_(most_line) {}
    ~followed_file();
    followed_file(const followed_file &) = delete;
    followed_file &operator=(const followed_file &) = delete;

    struct reader {
        // A file begins. in : its descriptor. out: the byte from which its lines are wanted
        std::function<std::size_t(int)> begin;
        line_taker line;
    };

    // Reads at most most_bytes of what is there and was not read before. The rest of a file that
    // was renamed comes before the new one.
    // out: whether everything is read
    bool poll(std::size_t most_bytes, const reader &to);

  private:
    bool open(const reader &to);
    void begin(const reader &to);
    void close();
    bool is_renamed() const;
    std::size_t read_once(std::size_t most_bytes, const reader &to);

    std::string path_;
    line_cutter lines_;
    std::size_t position_ = 0;
    int descriptor_ = -1;
};

}  // namespace compbox::box_files
