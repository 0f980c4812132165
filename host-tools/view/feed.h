// SPDX-License-Identifier: MIT
// Server-sent events for any number of readers, which share their texts. A reader that is slow
// continues with the newest ones; nothing queues for it.
#pragma once

#include <cstdint>
#include <deque>

#include "host-tools/view/body.h"

namespace compbox::view {

constexpr std::size_t feed_events = 100;

class feed {
  public:
    // Where one reader is; the caller owns it.
    struct reader {
        std::uint64_t live = 0, beat = 0, event = 0;  // the numbers of those that it has
        body part;                                    // that it reads
        std::size_t done = 0;                         // bytes of it
    };

    // out: a reader that gets the newest live text and later events
    reader begin() const;

    // in : JSON on one line
    void set_live(const std::string &text);
    void add_event(const std::string &text);
    void beat();  // keeps silent connections open

    // out: number of bytes, at most `size`; 0: it has everything. Keeps its place in `who`.
    std::size_t read(reader &who, char *bytes, std::size_t size) const;

  private:
    body next(reader &who) const;

    body live_;
    std::uint64_t lives_ = 0, beats_ = 0, events_ = 0;  // numbers of the newest
    std::deque<body> last_events_;
};

}  // namespace compbox::view
