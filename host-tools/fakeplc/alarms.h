// SPDX-License-Identifier: MIT
// The alarm list of the control: which alarms stand, since when, and what only a reset clears.
#pragma once

#include <string>
#include <vector>

namespace compbox {

struct alarm {
    std::string name, text;
    double since_s = 0.0;
    bool needs_reset = false;
};

class alarm_list {
  public:
    // The cause is there (comes, or stands) or not (goes, unless it needs a reset). Each coming and
    // going is told once by take_events().
    void set(const std::string &name, const std::string &text, bool there, double now_s,
             bool needs_reset = false);
    // Alarms that need a reset go.
    void reset();

    const std::vector<alarm> &standing() const { return standing_; }
    bool stands(const std::string &name) const;
    int total() const { return total_; }  // that came since the start
    std::vector<std::string> take_events();

  private:
    void go(std::size_t index);

    std::vector<alarm> standing_;
    std::vector<std::string> events_;
    int total_ = 0;
};

}  // namespace compbox
