// SPDX-License-Identifier: MIT
// What the box remembers of heat moves as heat does: from one state file to the next, over restarts
// and other files, a lag goes exactly as far as its input takes it in the time between.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <set>
#include <tuple>
#include <vector>

#include "tests/world/blocks.h"
#include "tests/world/interval.h"
#include "tests/world/invariants.h"
#include "tests/world/reference.h"
#include "tests/world/run.h"
#include "tests/world/state_file.h"

namespace compbox::world {

namespace {

using nlohmann::json;

interval to_the(const interval &of, std::uint32_t power) {
    interval made = interval::none();
    made.take(power_of(of.low, power));
    made.take(power_of(of.high, power));
    if (power % 2 == 0 && of.low < 0 && of.high > 0) made.take(0);
    return made;
}

// What a source gave in the newest time, with what it had given before.
class given_values {
  public:
    void take(time_ns now, double value) {
        turn(now);
        newest_.take(value);
        last_ = value;
    }
    // out: of at least that time
    interval within(time_ns now) {
        turn(now);
        interval all = newest_;
        all.take(before_);
        return all;
    }
    static constexpr time_ns at_least = 20 * second;

  private:
    void turn(time_ns now) {
        if (now - began_ < at_least) return;
        before_ = now - began_ < 2 * at_least ? newest_ : interval::none();
        newest_ = interval::none();
        if (last_) newest_.take(*last_);
        before_.take(newest_);
        began_ = now;
    }
    time_ns began_ = 0;
    interval newest_ = interval::none(), before_ = interval::none();
    std::optional<double> last_;
};

class lags_invariant : public invariant {
  public:
    explicit lags_invariant(run &of)
        : invariant(of, "lags"),
          judged_(longest_lag(of) == 0 &&
                  !draws_any(of, {fault_kind::clock, fault_kind::hostile, fault_kind::memory,
                                  fault_kind::state, fault_kind::wire, fault_kind::line})),
          reads_file_(!draws_any(
              of, {fault_kind::refuse, fault_kind::partial, fault_kind::disk, fault_kind::links})) {
    }
    // A box goes on from what the file has, if the pause is a quarter of the time constant at most.
    void started() override {
        lags_.clear();
        most_go_on_.reset();
        if (!judged_ || !reads_file_) return;
        const auto state = decoded(of_.box.files.text(run::state_path));
        if (!state) return;
        const time_ns wall_offset = of_.box.wall() - of_.time.now();
        most_go_on_ = 0;
        for (const state_file::record &record : state->records) {
            const time_ns at = record.unix_us * us - wall_offset;
            const double pause_s = 1e-9 * static_cast<double>(of_.time.now() - at);
            if (4 * (pause_s - unsure_s(true)) <= static_cast<double>(record.tau_s)) ++*most_go_on_;
            if (4 * (pause_s + unsure_s(true)) > static_cast<double>(record.tau_s)) continue;
            remember(record, at);
            lags_[key_of(record)].of_file = true;
        }
    }
    // Another file may know a lag of the first file no more, or by another time constant; and its
    // banks may hold their inputs within other ranges. A lag that it does not have begins anew when
    // a later file has it.
    void taken(const machine &was, const machine &is) override {
        if (!judged_) return;
        for (auto lag = lags_.begin(); lag != lags_.end();) {
            const bool of_bank = lag->first.signal.empty();
            const bool gone = of_bank ? held_ranges(was, lag->first) != held_ranges(is, lag->first)
                                      : is.signal(lag->first.signal) == nullptr;
            lag = gone || lag->second.of_file ? lags_.erase(lag) : std::next(lag);
        }
        for (const json &signal : is.file().at("signals"))
            if (signal.contains("lag_of"))
                for (auto &[key, lag] : lags_)
                    if (key.signal == signal.at("name")) lag.tau_s.take(signal.at("tau_s"));
    }
    void exchanged(const exchange &seen) override {
        if (!judged_) return;
        each_signal(of_.running_at(seen.sent), seen,
                    [this](const std::string &signal, double value) { keep(signal, value); });
    }
    void sampled(const std::string &signal, double value) override {
        if (judged_) keep(signal, value);
    }
    // Another file may give a lag another time constant.
    void logged(const std::string &line) override {
        static const std::regex go_on(R"(: (\d+) of \d+ lags go on after a pause)");
        std::smatch words;
        if (!most_go_on_ || draws(of_, fault_kind::reload) ||
            !std::regex_search(line, words, go_on))
            return;
        if (std::stoi(words[1]) > *most_go_on_)
            violated(fmt::format("{} lags go on, for {} the pause was short enough", words[1].str(),
                                 *most_go_on_));
        most_go_on_.reset();  // a start says it once
    }
    void file_written(const std::string &path, const node &file) override {
        if (!judged_ || path != run::state_path) return;
        const auto state = decoded(file.bytes);
        if (!state) return;
        const time_ns booted = of_.time.now() - of_.box.boottime();
        for (const state_file::record &record : state->records) {
            const time_ns at = booted + record.boottime_us * us;
            judge(record, at);
            remember(record, at);
        }
    }

  private:
    // Of the clock of another boot, and of microseconds.
    static constexpr double unsure_s(bool of_file) { return of_file ? 5e-3 : 2e-6; }
    struct lag_key {
        std::string signal, of;  // of a bank: no name
        float tau_s;             // of a bank; a signal keeps its lag with another one
        std::uint32_t power, range;
        bool operator<(const lag_key &other) const {
            return std::tie(signal, of, tau_s, power, range) <
                   std::tie(other.signal, other.of, other.tau_s, other.power, other.range);
        }
    };
    struct known_lag {
        double y, input;
        time_ns at;
        interval tau_s;
        bool of_file;  // it was read, and no file written since
    };

    // out: where the banks that have the lag hold its input
    static std::multiset<std::pair<double, double>> held_ranges(const machine &of,
                                                                const lag_key &key) {
        std::multiset<std::pair<double, double>> found;
        for (const json &term : of.file().at("terms")) {
            if (!term.contains("bank")) continue;
            const json &bank = term.at("bank");
            const std::vector<trained_range> ranges = ranges_of(bank);
            const auto has = [&key](const json &tau_s) { return tau_s.get<float>() == key.tau_s; };
            if (std::none_of(bank.at("tau_s").begin(), bank.at("tau_s").end(), has)) continue;
            for (std::size_t i = 0; i < ranges.size(); ++i)
                if (bank.at("inputs")[i] == key.of)
                    found.emplace(ranges[i].held(-1e30), ranges[i].held(1e30));
        }
        return found;
    }
    static lag_key key_of(const state_file::record &record) {
        const std::string signal = record.name;
        return {signal, record.lag_of, signal.empty() ? record.tau_s : 0, record.power,
                record.range};
    }
    static double value_of(const state_file::record &record) {
        return static_cast<double>(record.hi) + static_cast<double>(record.lo);
    }
    void remember(const state_file::record &record, time_ns at) {
        const auto tau_s = static_cast<double>(record.tau_s);
        lags_[key_of(record)] = {
            value_of(record), static_cast<double>(record.input), at, {tau_s, tau_s}, false};
    }
    void keep(const std::string &signal, double value) {
        const signal_facts *facts = of_.running().signal(signal);
        const double near = at_a_limit(value);
        if (facts == nullptr || !(value >= facts->min - near) || !(value <= facts->max + near))
            return;  // refused
        given_[signal].take(of_.time.now(), value);
    }

    void judge(const state_file::record &record, time_ns at) {
        const auto found = lags_.find(key_of(record));
        if (found == lags_.end()) return;
        const known_lag &was = found->second;
        const double dt_s = 1e-9 * static_cast<double>(at - was.at);
        const bool other_tau = was.of_file && !(was.tau_s.low == static_cast<double>(record.tau_s));
        if (other_tau || of_.time.now() - was.at > given_values::at_least) return;
        interval tau_s = was.tau_s;
        tau_s.take(static_cast<double>(record.tau_s));
        const interval input = input_of(record, was);
        const double y = value_of(record);
        const interval times = {dt_s - unsure_s(was.of_file), dt_s + unsure_s(was.of_file)};
        // Of the input, as far as it moves the lag, and of the two parts of the lag itself.
        const double size = std::fabs(was.y) + std::fabs(y);
        const double rounding =
            way(1e-5 + 2e-6 * size, times, tau_s, 1) + 1e-9 * size + 1e-7 * std::fabs(y - was.y);
        const double low = was.y + way(input.low - was.y, times, tau_s, -1) - rounding;
        const double high = was.y + way(input.high - was.y, times, tau_s, 1) + rounding;
        if (y < low || y > high)
            violated(fmt::format(
                "the lag {} of {}^{} with {} s is {}, and was {} {} s before: its "
                "input takes it to {} … {}",
                record.name, record.lag_of, record.power, record.tau_s, y, was.y, dt_s, low, high));
    }
    // out: the furthest way towards `missing` in this direction
    static double way(double missing, const interval &times, const interval &tau_s,
                      double direction) {
        const bool further = missing * direction > 0;
        const double from_s = std::max(further ? times.high : times.low, 0.0);
        return missing * -std::expm1(-from_s / (further ? tau_s.low : tau_s.high));
    }
    // out: all that the input may have been, to its power
    interval input_of(const state_file::record &record, const known_lag &was) {
        const bool is_powered = record.name[0] != 0;  // in the file
        interval raw = range_of(record.lag_of);
        interval all = interval::none();
        for (const double value : {was.input, static_cast<double>(record.input)})
            is_powered ? all.take(value) : raw.take(value);
        if (is_powered) {
            if (!raw.is_none()) all.take(to_the(raw, record.power));
            return all;
        }
        for (const json &term : of_.running().file().at("terms"))
            if (term.contains("bank")) take_held(term.at("bank"), record.lag_of, raw, all);
        return to_the(all, record.power);
    }
    // What the source of a signal gave; a lag stays between that and where it is.
    interval range_of(const std::string &source_name) {
        interval all = given_[source_name].within(of_.time.now());
        if (const signal_facts *facts = of_.running().signal(source_name);
            facts != nullptr && may_be_doubted(of_, source_name))
            all.take(interval{facts->min, facts->max});
        for (const json &signal : of_.running().file().at("signals")) {
            if (signal.at("name") != source_name || !signal.contains("lag_of")) continue;
            const interval source = given_[signal.at("lag_of")].within(of_.time.now());
            if (!source.is_none()) all.take(to_the(source, signal.value("power", 1U)));
        }
        return all;
    }
    // Of each bank, where the range in which its input acts leaves it.
    static void take_held(const json &bank, const std::string &signal, const interval &raw,
                          interval &all) {
        const std::vector<trained_range> ranges = ranges_of(bank);
        for (std::size_t i = 0; i < ranges.size(); ++i) {
            if (bank.at("inputs")[i] != signal) continue;
            all.take(ranges[i].held(raw.low));
            all.take(ranges[i].held(raw.high));
        }
    }

    bool judged_, reads_file_;
    std::map<lag_key, known_lag> lags_;
    std::optional<int> most_go_on_;  // of the file that the daemon started with
    std::map<std::string, given_values> given_;
};

}  // namespace

void add_lags(run &of, invariants &all) {
    all.push_back(std::make_unique<lags_invariant>(of));
}

}  // namespace compbox::world
