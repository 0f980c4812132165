// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/alarms.h"

#include <fmt/core.h>

#include <utility>

namespace compbox::fakeplc {

void alarm_list::set(std::string_view name, std::string_view text, bool there, double now_s,
                     bool needs_reset) {
    for (std::size_t i = 0; i < standing_.size(); ++i) {
        if (standing_[i].name != name) continue;
        if (!there && !standing_[i].needs_reset) go(i);
        return;
    }
    if (!there) return;
    standing_.push_back({std::string(name), std::string(text), now_s, needs_reset});
    events_.push_back(fmt::format("alarm {} came: {}", name, text));
    ++total_;
}

void alarm_list::reset() {
    for (std::size_t i = standing_.size(); i-- > 0;) {
        if (standing_[i].needs_reset) go(i);
    }
}

void alarm_list::go(std::size_t index) {
    events_.push_back(fmt::format("alarm {} went", standing_[index].name));
    standing_.erase(standing_.begin() + static_cast<std::ptrdiff_t>(index));
}

bool alarm_list::stands(const std::string &name) const {
    for (const auto &one : standing_) {
        if (one.name == name) return true;
    }
    return false;
}

std::vector<std::string> alarm_list::take_events() {
    return std::exchange(events_, {});
}

}  // namespace compbox::fakeplc
