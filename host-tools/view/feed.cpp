// SPDX-License-Identifier: MIT
#include "host-tools/view/feed.h"

#include <algorithm>

namespace compbox::view {

namespace {

body message(const char *event, const std::string &text) {
    return std::make_shared<const std::string>(std::string("event: ") + event + "\ndata: " + text +
                                               "\n\n");
}

const body retry = std::make_shared<const std::string>("retry: 2000\n\n");
const body silence = std::make_shared<const std::string>(":\n\n");

}  // namespace

feed::reader feed::begin() const {
    reader who;
    who.beat = beats_;
    who.event = events_;
    who.part = retry;
    return who;
}

void feed::set_live(const std::string &text) {
    live_ = message("live", text);
    ++lives_;
}

void feed::add_event(const std::string &text) {
    last_events_.push_back(message("event", text));
    if (last_events_.size() > feed_events) last_events_.pop_front();
    ++events_;
}

void feed::beat() {
    ++beats_;
}

// out: what the reader gets next; null: nothing
body feed::next(reader &who) const {
    if (who.event < events_) {
        const std::uint64_t oldest = events_ - last_events_.size();
        const std::uint64_t at = std::max(who.event, oldest);
        who.event = at + 1;
        return last_events_[static_cast<std::size_t>(at - oldest)];
    }
    if (who.live < lives_) {
        who.live = lives_;
        who.beat = beats_;
        return live_;
    }
    if (who.beat < beats_) {
        who.beat = beats_;
        return silence;
    }
    return nullptr;
}

std::size_t feed::read(reader &who, char *bytes, std::size_t size) const {
    if (who.part == nullptr) {
        who.part = next(who);
        who.done = 0;
    }
    if (who.part == nullptr) return 0;
    const std::size_t now = who.part->copy(bytes, size, who.done);
    who.done += now;
    if (who.done == who.part->size()) who.part.reset();
    return now;
}

}  // namespace compbox::view
