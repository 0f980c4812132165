// SPDX-License-Identifier: MIT
// The newest lines of the daemon's events (docs/events.md), across its rotated files.
#pragma once

#include <deque>
#include <functional>
#include <string>

#include "host-tools/box_files/followed_file.h"

namespace compbox::box_files {

constexpr std::size_t event_log_lines = 1000, event_most_bytes = 8192;

class event_log {
  public:
    // in : path: "": none
    explicit event_log(const std::string &path);

    // Calls `fresh` with the JSON of each line that came since the last call. The first call reads
    // what is there, and reports nothing.
    void poll(const std::function<void(const std::string &)> &fresh);

    // out: a JSON array of the newest events, at most `limit`, in the order of the file
    std::string text(std::size_t limit) const;

  private:
    bool add(std::string_view line);
    void read_old();

    std::string path_;
    followed_file file_;
    std::deque<std::string> lines_;
    bool is_read_ = false;
};

}  // namespace compbox::box_files
