// SPDX-License-Identifier: MIT
#include "host-tools/uplink/outbox.h"

#include <algorithm>

namespace compbox::uplink {

namespace {

constexpr int is_done = -1;
constexpr std::size_t overhead_bytes = 100;  // of a message, beside its texts

std::size_t bytes_of(const message &one) {
    return one.topic.size() + one.payload.size() + overhead_bytes;
}

}  // namespace

void outbox::add(message one) {
    const std::size_t more = bytes_of(one);
    while (bytes_ + more > most_bytes_ && messages_.size() > on_their_way_) {
        const auto oldest = messages_.begin() + static_cast<std::ptrdiff_t>(on_their_way_);
        bytes_ -= bytes_of(oldest->of);
        messages_.erase(oldest);
        ++lost_;
    }
    if (bytes_ + more > most_bytes_) {
        ++lost_;
        return;
    }
    bytes_ += more;
    messages_.push_back({std::move(one)});
}

const message *outbox::next() const {
    if (on_their_way_ == messages_.size() || on_their_way_ >= window) return nullptr;
    return &messages_[on_their_way_].of;
}

void outbox::sent(int id) {
    messages_[on_their_way_++].id = id;
}

void outbox::confirmed(int id) {
    const auto end = messages_.begin() + static_cast<std::ptrdiff_t>(on_their_way_);
    const auto found =
        std::find_if(messages_.begin(), end, [&](const entry &one) { return one.id == id; });
    if (found != end) found->id = is_done;
    while (on_their_way_ > 0 && messages_.front().id == is_done) {
        bytes_ -= bytes_of(messages_.front().of);
        messages_.pop_front();
        --on_their_way_;
        ++delivered_;
    }
}

}  // namespace compbox::uplink
