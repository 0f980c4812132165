// SPDX-License-Identifier: MIT
// A person who measures at the machine and hands the box what was found (docs/compboxd.md,
// --measured), with the mistakes of persons and of other programs.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tests/world/computer.h"
#include "tests/world/dice.h"

namespace compbox::world {

class person {
  public:
    // Begins to measure the name H every few seconds.
    person(scheduler &time, computer &box, std::uint64_t seed);
    // Called with what the box has to use from now on: at each start, with each measurement, and
    // now and then in between.
    std::function<void(double um, unsigned count)> told;
    // Another daemon takes nothing that was measured before.
    void daemon_starts();

    unsigned files() const { return files_; }  // that came to the path

    static constexpr const char *path = "/run/compboxd/measured";

  private:
    void measure();
    void tell();
    void put(const std::string &text);
    std::string line(double um, std::int64_t unix_s) const;
    double measured_um();
    std::string mistake(std::int64_t now_s);

    scheduler &time_;
    computer &box_;
    dice chance_, links_;
    double um_ = 0;           // of the newest measurement
    unsigned count_ = 0;      // since the daemon's start
    time_ns started_ns_ = 0;  // when the daemon started
    bool repeats_ = false;    // the newest measurement of before the daemon began
    unsigned number_ = 0;     // of the newest line
    unsigned files_ = 0;
    std::string before_;      // number and time of that one, if the box took it
    std::uint64_t told_ = 0;  // an older plan to tell again is void
};

}  // namespace compbox::world
