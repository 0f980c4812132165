// SPDX-License-Identifier: MIT
#include "host-tools/view/guess_limit.h"

#include <algorithm>
#include <iterator>

namespace compbox::view {

namespace {

const std::string all_others;

}  // namespace

double guess_limit::now_left(const allowance &of, double steady_s) {
    const double more = (steady_s - of.since_s) / guess_interval_s;
    return std::min(guesses_at_once, of.guesses + std::max(0.0, more));
}

const std::string &guess_limit::key_of(const std::string &address) const {
    const bool has_room = left_.size() < guess_addresses;
    return has_room || left_.count(address) > 0 ? address : all_others;
}

// Removes those that have their whole allowance again.
void guess_limit::forget(double steady_s) {
    for (auto at = left_.begin(); at != left_.end();) {
        const bool is_whole = now_left(at->second, steady_s) >= guesses_at_once;
        at = is_whole ? left_.erase(at) : std::next(at);
    }
}

bool guess_limit::may_try(const std::string &address, double steady_s) {
    forget(steady_s);
    const auto found = left_.find(key_of(address));
    return found == left_.end() || now_left(found->second, steady_s) >= 1.0;
}

void guess_limit::was_wrong(const std::string &address, double steady_s) {
    const auto found =
        left_.try_emplace(key_of(address), allowance{guesses_at_once, steady_s}).first;
    found->second = {now_left(found->second, steady_s) - 1.0, steady_s};
}

}  // namespace compbox::view
