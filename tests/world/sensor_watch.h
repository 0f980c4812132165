// SPDX-License-Identifier: MIT
// Which sensors of the section "sensors" the box must doubt, must trust, or may do either with: by
// readings and docs/coefficient-file.md, in double precision. It shares no code with the box.
//
// The box compares about once a second, and nobody outside knows in which moment. So each answer
// holds for all moments in which it may have done so.
#pragma once

#include <cstddef>
#include <deque>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/world/interval.h"
#include "tests/world/scheduler.h"

namespace compbox::world {

class sensor_watch {
  public:
    // in : the section "sensors"
    sensor_watch(const nlohmann::json &section, time_ns period_ns);

    // What the box has of a sensor at a reading.
    struct reading {
        double value, near;  // in its unit, NaN: none; how far the box's value may be from it
        bool fresh, stale;   // for sure; neither: it may be either
        double min, max;
    };
    // A daemon or a file begins with the next look, and trusts all.
    void begin() { begins_ = true; }
    // in : by sensor, at the time of a reading
    void look(time_ns now, const std::vector<reading> &readings);

    const std::vector<std::string> &names() const { return names_; }
    bool trusts(std::size_t j) const { return sensors_[j].is == trust::sure; }
    bool doubts(std::size_t j) const { return sensors_[j].is == trust::doubted; }
    // out: what the lags of one that is not trusted may follow
    interval followed(std::size_t j, const reading &seen) const;
    // Since it began: doubts that are sure, and those that may have been.
    unsigned least_doubts() const { return least_; }
    unsigned most_doubts() const { return most_; }
    bool knows_doubts() const { return counts_; }

  private:
    enum class trust { sure, either, doubted };
    enum class use { reads, predicted, either };
    // Begin of a time in which something held at each reading; never: it does not hold.
    struct stretch {
        time_ns since = never;
        void go_on(bool holds, time_ns now) {
            if (!holds || since == never) since = holds ? now : never;
        }
        bool lasts(time_ns now, time_ns long_ns) const {
            return since != never && now - since >= long_ns;
        }
    };
    struct sensor {
        trust is = trust::sure;
        bool was_doubted = false;  // before it was either
        time_ns either_ns = 0;     // since then
        bool was_stale = false;    // at the look before
        use used = use::reads;
        time_ns used_ns = -100 * second;  // since then
        // Within the threshold; so, or less wrong than another one; beyond it and the worst; beyond
        // it, and within half of it, if it is doubted. For sure, at this look …
        struct verdicts {
            bool quiet = true, safe = true, wrong = true, off = true, agrees = true;
        } now;
        stretch quiet, wrong, off, agrees;  // … and at each since then
        // The first look without `quiet`, and without `off`, that no pass has overruled since.
        time_ns loud_ns = never, near_ns = never;
        time_ns changed_ns = -100 * second;  // newest change of `is`, or look without `safe`
    };
    void take_use(sensor &of, const reading &seen, time_ns now) const;
    void keep(time_ns now, const std::vector<reading> &readings);
    interval predicted(std::size_t j, const std::vector<interval> &others) const;
    std::vector<interval> compared(const std::vector<reading> &readings, unsigned predicts) const;
    void add_choice(const std::vector<reading> &readings, unsigned chosen,
                    const std::vector<interval> &z);
    void judge(const std::vector<reading> &readings, time_ns now);
    void step(std::size_t j, time_ns now);
    void become(sensor &of, trust is, time_ns now);
    std::size_t count(trust is) const;
    void forget(time_ns now);

    std::vector<std::string> names_;
    std::vector<double> center_;
    std::vector<std::vector<double>> precision_;
    double threshold_;
    // A pass comes at most so long behind the one before; so long may pass from its begin to what
    // it changes.
    time_ns pass_ns_, late_ns_;
    // From the first pass that sees it: to the earliest doubt, to the latest one, likewise of
    // trust.
    time_ns doubt_least_ns_, doubt_most_ns_, trust_least_ns_, trust_most_ns_;
    std::vector<sensor> sensors_;
    // The readings of the newest pass: their median, less their centers, and how far each is from
    // it.
    struct moment {
        time_ns at_ns;
        double median;
        std::vector<double> apart, near;
    };
    std::deque<moment> past_;
    time_ns looked_ns_ = 0, begun_ns_ = 0;
    time_ns stopped_ns_ = -100 * second;  // a sensor may have stopped reading: no pass judges
    unsigned least_ = 0, most_ = 0;
    bool begins_ = true, counts_ = true;
};

}  // namespace compbox::world
