// SPDX-License-Identifier: MIT
// The alarm list of the control: active alarms, their start, and those that only a reset clears.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace compbox::fakeplc {

struct alarm {
    std::string name, text;
    double since_s = 0.0;
    bool needs_reset = false;
};

class alarm_list {
  public:
    // in : whether the cause of the alarm is present. An alarm that needs a reset stays active
    // without its cause. take_events() reports each start and end once.
    void set(std::string_view name, std::string_view text, bool there, double now_s,
             bool needs_reset = false);
    // Clears alarms that need a reset.
    void reset();

    const std::vector<alarm> &standing() const { return standing_; }
    bool stands(const std::string &name) const;
    int total() const { return total_; }  // alarms since the start
    std::vector<std::string> take_events();

  private:
    void go(std::size_t index);

    std::vector<alarm> standing_;
    std::vector<std::string> events_;
    int total_ = 0;
};

}  // namespace compbox::fakeplc
