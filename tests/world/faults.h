// SPDX-License-Identifier: MIT
// The kinds of faults, and the injector that the calls, the network and the PLC ask. A kind that is
// left out (--faults) draws nothing, so the others of the same seed stay as they were.
//
// A new kind: its line in WORLD_FAULTS, and its work in faults_*.cpp: either a part of at_call,
// at_segment, at_connect, at_request or between_lines, or an event that plans its own next one.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/world/computer.h"
#include "tests/world/dice.h"
#include "tests/world/network.h"
#include "tests/world/plc_side.h"
#include "tests/world/serial_line.h"

namespace compbox::world {

class run;

#define WORLD_FAULTS(X)                                                 \
    X(preempt, "other threads run between two lines")                   \
    X(delay, "calls and segments that take long")                       \
    X(tear, "segments in two parts")                                    \
    X(loss, "replies that never come, connections that stall")          \
    X(reset, "connections reset, refused, closed")                      \
    X(twice, "replies that come twice")                                 \
    X(exception, "Modbus exceptions, torn readings")                    \
    X(enable, "the operator takes enable away, presses reset")          \
    X(line, "serial lines lose bytes, flip bits, pause, are unplugged") \
    X(can, "CAN goes down, off the bus, away; nodes fall silent, boot again")

enum class fault_kind {
#define X(name, words) name,
    WORLD_FAULTS(X)
#undef X
};

using fault_set = std::set<fault_kind>;

// in : "all", "none" or names with commas between them. Throws std::invalid_argument with a
// sentence.
fault_set fault_set_of(const std::string &text);
std::string name_of(fault_kind kind);
std::string text_of(const fault_set &kinds);

class fault_injector : public call_faults,
                       public link_faults,
                       public plc_faults,
                       public line_faults {
  public:
    fault_injector(run &of, const fault_set &kinds, std::uint64_t seed);

    // Plans the events of each kind. Call it once, when the world is made.
    void begin();
    // No more faults from now on: the world must recover.
    void end() { active_ = false; }
    bool active() const { return active_; }

    bool has(fault_kind kind) const { return active_ && kinds_.count(kind) > 0; }
    dice &chance(fault_kind kind) { return chances_.at(kind); }
    // Remembers it for the report of a violation.
    void note(fault_kind kind, const std::string &words);
    void count_one() { ++count_; }  // one that is too frequent for the report
    const std::vector<std::string> &last() const { return last_; }
    std::uint64_t count() const { return count_; }

    call_fate at_call(const call_site &site) override;
    preemption between_lines() override;
    segment_fate at_segment(bool to_box, std::size_t bytes) override;
    segment_fate at_connect() override;
    reply_fate at_request(const byte_string &request) override;
    line_fate at_line(bool to_box) override;

  private:
    void repeat(fault_kind kind, time_ns mean, const std::function<void()> &what);
    void plan_operator();
    void plan_wires();  // faults_wires.cpp

    run &of_;
    fault_set kinds_;
    std::map<fault_kind, dice> chances_;
    std::vector<std::string> last_;
    std::uint64_t count_ = 0;
    bool active_ = true;
};

}  // namespace compbox::world
