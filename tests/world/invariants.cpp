// SPDX-License-Identifier: MIT
#include "tests/world/invariants.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/world/run.h"

namespace compbox::world {

namespace {

double number_in(const number_format &format, int address, const std::vector<std::uint16_t> &block,
                 int start) {
    return format.decode(&block[static_cast<std::size_t>(address - start)]);
}

// The tool's displacement by each channel in a written block, µm.
std::vector<double> values_of(const machine &of, const std::vector<std::uint16_t> &written) {
    std::vector<double> values;
    for (std::size_t c = 0; c < of.channels.size(); ++c) {
        const taken_channel &channel = of.map.channels[c];
        values.push_back(of.channels[c].sign * channel.scale_um *
                         number_in(channel.format, channel.address, written, of.map.write.start));
    }
    return values;
}

// The value of a channel that the PLC reports as applied, µm: with `applied` the box starts from
// it after a loss, and an NC may take one channel after the other.
double applied_of(run &of, std::size_t c) {
    return of.box_machine.channels[c].sign * of.plc.control.side().applied()[c].um;
}

// No value is beyond its limit, or not a number.
class size_invariant : public invariant {
  public:
    explicit size_invariant(run &of) : invariant(of, "size") {}
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const auto values = values_of(of_.box_machine, seen.written);
        for (std::size_t c = 0; c < values.size(); ++c) {
            const channel_facts &facts = of_.box_machine.channels[c];
            const double most = facts.limit_um * (1 + 1e-6) + 1e-6;
            if (std::isfinite(values[c]) && std::fabs(values[c]) <= most) continue;
            violated(
                fmt::format("{} is {} µm, its limit {} µm", facts.name, values[c], facts.limit_um));
        }
    }
};

// The two motors of a stage are never further apart than allowed.
class pair_invariant : public invariant {
  public:
    explicit pair_invariant(run &of) : invariant(of, "pair") {}
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const auto values = values_of(of_.box_machine, seen.written);
        for (const pair_facts &pair : of_.box_machine.pairs) {
            const double apart_um = std::fabs(values[pair.first] - values[pair.second]);
            const double sum_um = std::fabs(values[pair.first]) + std::fabs(values[pair.second]);
            // a float32 register rounds each value
            if (apart_um <= pair.most_um * (1 + 1e-6) + 2.5e-7 * sum_um + 1e-6) continue;
            if (starts_from_applied(pair, apart_um)) continue;
            violated(fmt::format("{} and {} are {} µm apart, allowed are {} µm",
                                 of_.box_machine.channels[pair.first].name,
                                 of_.box_machine.channels[pair.second].name, apart_um,
                                 pair.most_um));
        }
    }

  private:
    // The PLC's own values are as far apart, and the box starts from them.
    bool starts_from_applied(const pair_facts &pair, double apart_um) const {
        const channel_facts &facts = of_.box_machine.channels[pair.first];
        const double there_um =
            std::fabs(applied_of(of_, pair.first) - applied_of(of_, pair.second));
        return facts.has_applied && apart_um <= there_um * (1 + 1e-6) + facts.unit_um + 1e-3;
    }
};

// From one write to the next no value moves faster than its slew, by the times of sending. A write
// of a connection that the box has given up may come later than newer ones. A step computes its
// values before it sends them: with faults as much earlier as the longest delay of a call.
class slew_invariant : public invariant {
  public:
    explicit slew_invariant(run &of) : invariant(of, "slew") {}
    void started() override { before_.reset(); }
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const auto values = values_of(of_.box_machine, seen.written);
        const double period_s = static_cast<double>(of_.box_machine.period_us) * 1e-6;
        const double early_s = of_.options.faults.empty() ? 0.0 : 0.3;
        if (before_ && seen.sent < before_ns_) return;
        if (before_) {
            const double dt_s =
                static_cast<double>(seen.sent - before_ns_) * 1e-9 + 1.5 * period_s + early_s;
            for (std::size_t c = 0; c < values.size(); ++c) {
                const channel_facts &facts = of_.box_machine.channels[c];
                const double most_um = facts.slew_um_per_s * dt_s + 1.5 * facts.unit_um + 1e-3;
                const double step_um = std::fabs(values[c] - (*before_)[c]);
                if (step_um <= most_um) continue;
                const double from_applied_um = std::fabs(values[c] - applied_of(of_, c));
                if (facts.has_applied && from_applied_um <= most_from_applied(facts)) continue;
                violated(fmt::format("{} moves by {} µm in {} s, allowed are {} µm", facts.name,
                                     step_um, dt_s, most_um));
            }
        }
        before_ = values;
        before_ns_ = seen.sent;
    }

  private:
    double most_from_applied(const channel_facts &facts) const {
        const double period_s = static_cast<double>(of_.box_machine.period_us) * 1e-6;
        return 2 * facts.slew_um_per_s * period_s + 1.5 * facts.unit_um + 1e-3;
    }
    std::optional<std::vector<double>> before_;
    time_ns before_ns_ = 0;
};

// The box claims ACTIVE only while a reading of the last second had enable and all reference bits.
class permission_invariant : public invariant {
  public:
    explicit permission_invariant(run &of) : invariant(of, "permission") {}
    void started() override { permitted_ns_ = -never; }
    void exchanged(const exchange &seen) override {
        const register_map &map = of_.box_machine.map;
        if (!seen.written.empty()) {
            const unsigned mode =
                seen.written[static_cast<std::size_t>(map.status - map.write.start)] & 0xFFu;
            if (mode == box_mode::active && seen.now - permitted_ns_ > second)
                violated("ACTIVE is written, and the PLC did not permit it for a second");
        }
        if (seen.read.empty() || seen.read_start != map.read.start) return;
        const std::uint16_t word =
            seen.read[static_cast<std::size_t>(map.control - map.read.start)];
        if ((word & 1u) && (word & map.referenced_mask) == map.referenced_mask)
            permitted_ns_ = seen.now;
    }

  private:
    time_ns permitted_ns_ = -never;
};

// The daemon ends as it was asked to: by an assertion never, with 0 where nothing was wrong.
class exit_invariant : public invariant {
  public:
    explicit exit_invariant(run &of) : invariant(of, "exit") {}
    void started() override { has_reason_ = false; }
    void logged(const std::string &line) override {
        has_reason_ = has_reason_ || line.rfind("compboxd: ", 0) == 0;
    }
    void ended(const ending &how) override {
        const bool asked = of_.asked_to_stop || of_.stop_asked;
        const bool at_start = of_.cycles_of_daemon == 0;
        // Before it has blocked the signals of a stop, these end it at once.
        if (how.by_signal && how.code != 9 && !(at_start && (asked || how.code == 1)))
            violated(fmt::format("the daemon ended by signal {}", how.code));
        const bool refused = at_start && how.code == 1 && has_reason_ && of_.faults.count() > 0;
        if (!how.by_signal && !asked && !refused)
            violated(fmt::format("the daemon ended with {} by itself", how.code));
        if (!how.by_signal && how.code != 0 && of_.faults.count() == 0)
            violated(fmt::format("the daemon ended with {} without a fault", how.code));
    }
    void finished() override {
        if (of_.box.runs()) violated("the daemon did not end within the stated time");
    }

  private:
    bool has_reason_ = false;  // a sentence about a failed start
};

// Without faults the box becomes ACTIVE, keeps its period, and its last status is STOPPED.
class service_invariant : public invariant {
  public:
    explicit service_invariant(run &of) : invariant(of, "service") {}
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const register_map &map = of_.box_machine.map;
        mode_ = seen.written[static_cast<std::size_t>(map.status - map.write.start)] & 0xFFu;
        was_active_ = was_active_ || mode_ == box_mode::active;
    }
    void finished() override {
        if (of_.faults.count() > 0) return;
        if (!was_active_ && of_.box_machine.demands_fit) violated("the box was never ACTIVE");
        if (mode_ != box_mode::stopped) violated(fmt::format("the last status is {}", mode_));
    }

  private:
    unsigned mode_ = 0;
    bool was_active_ = false;
};

}  // namespace

void invariant::violated(const std::string &words) {
    of_.report(name, words);
}

std::vector<std::unique_ptr<invariant>> all_invariants(run &of) {
    std::vector<std::unique_ptr<invariant>> all;
    all.push_back(std::make_unique<size_invariant>(of));
    all.push_back(std::make_unique<pair_invariant>(of));
    all.push_back(std::make_unique<slew_invariant>(of));
    all.push_back(std::make_unique<permission_invariant>(of));
    all.push_back(std::make_unique<exit_invariant>(of));
    all.push_back(std::make_unique<service_invariant>(of));
    return all;
}

}  // namespace compbox::world
