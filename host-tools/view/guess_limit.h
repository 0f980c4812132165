// SPDX-License-Identifier: MIT
// Wrong passwords by address: a few at once, then one every ten seconds. Bounded memory.
#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace compbox::view {

constexpr double guesses_at_once = 10.0;
constexpr double guess_interval_s = 10.0;
constexpr std::size_t guess_addresses = 256;  // beyond: all others together are one

class guess_limit {
  public:
    // in : address: of the reader; a clock that nobody sets, s
    // out: whether a password of this reader is looked at now
    bool may_try(const std::string &address, double steady_s);

    void was_wrong(const std::string &address, double steady_s);

    std::size_t addresses() const { return left_.size(); }

  private:
    struct allowance {
        double guesses;
        double since_s;
    };
    static double now_left(const allowance &of, double steady_s);
    const std::string &key_of(const std::string &address) const;
    void forget(double steady_s);

    std::map<std::string, allowance> left_;  // of those with a wrong one
};

}  // namespace compbox::view
