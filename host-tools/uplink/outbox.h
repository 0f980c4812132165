// SPDX-License-Identifier: MIT
// Messages that wait for the broker, in order, within a number of bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

namespace compbox::uplink {

struct message {
    std::string topic, payload;
};

class outbox {
  public:
    explicit outbox(std::size_t most_bytes) : most_bytes_(most_bytes) {}

    // Drops the oldest messages where it is full, but none that is on its way.
    void add(message one);

    // out: the next one that is not on its way; null: none, or `window` of them are
    const message *next() const;

    // The next one is on its way. in : the number under which it will be confirmed
    void sent(int id);

    // Removes what is confirmed from the front.
    void confirmed(int id);

    std::size_t waiting() const { return messages_.size(); }
    std::size_t bytes() const { return bytes_; }
    std::uint64_t lost() const { return lost_; }
    std::uint64_t delivered() const { return delivered_; }

    static constexpr std::size_t window = 20;  // on their way at a time

  private:
    struct entry {
        message of;
        int id = 0;  // 0: it waits; -1: it is confirmed, one before it is not
    };
    std::deque<entry> messages_;
    std::size_t on_their_way_ = 0;  // at the front
    std::size_t most_bytes_, bytes_ = 0;
    std::uint64_t lost_ = 0, delivered_ = 0;
};

}  // namespace compbox::uplink
