// SPDX-License-Identifier: MIT
// All chance of the world. One stream for each purpose, so that a kind of fault that is left out
// does not change what the others draw: a shrunk run stays close to the run that failed.
#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

#include "host-tools/twin/random.h"

namespace compbox::world {

class dice {
  public:
    dice(std::uint64_t seed, std::string_view purpose) : stream_(seed, purpose) {}

    std::uint64_t next() { return stream_.next(); }
    // in : n > 0. out: 0 … n - 1
    std::uint64_t below(std::uint64_t n) { return stream_.next() % n; }
    bool one_in(std::uint64_t n) { return below(n) == 0; }
    // in : a probability from 0 to 1
    bool chance(double probability) { return stream_.uniform() < probability; }
    double between(double low, double high) { return low + (high - low) * stream_.uniform(); }
    // in : 0 < low <= high. Each decade is as likely as another one of the range.
    double log_between(double low, double high) {
        return std::exp(between(std::log(low), std::log(high)));
    }
    std::int64_t time_between(std::int64_t low, std::int64_t high) {
        return low + static_cast<std::int64_t>(below(static_cast<std::uint64_t>(high - low) + 1));
    }
    template <typename List>
    auto one_of(const List &list) -> decltype(*list.begin()) {
        return *(list.begin() + static_cast<std::ptrdiff_t>(below(list.size())));
    }

  private:
    twin::random_stream stream_;
};

}  // namespace compbox::world
