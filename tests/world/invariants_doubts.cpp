// SPDX-License-Identifier: MIT
// Sensors that check each other (docs/coefficient-file.md, "sensors"): one that contradicts the
// others for long enough is doubted, not before, and trusted again when it has agreed for ten times
// as long. Its lags follow what the others predict. Judged by status, detail, counter and state
// file, where the box gets each reading that the PLC gave.
#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "tests/world/blocks.h"
#include "tests/world/interval.h"
#include "tests/world/invariants.h"
#include "tests/world/reference.h"
#include "tests/world/run.h"
#include "tests/world/state_file.h"

namespace compbox::world {

namespace {

class doubts_invariant : public invariant {
  public:
    explicit doubts_invariant(run &of)
        : invariant(of, "doubts"),
          names_judged_(!draws_any(of, {fault_kind::memory, fault_kind::hostile})) {
        // Another file ends all doubts, at a moment that nobody outside knows.
        if (hides_exchanges(of) || of.box_machine.redundant.empty() ||
            draws(of, fault_kind::reload))
            return;
        box_.emplace(of.box_machine);
        const nlohmann::json &root = of.box_machine.file();
        const nlohmann::json &sensors = root.at("sensors").at("signals");
        after_s_ = root.at("sensors").value("after_s", 120.0);
        const auto add_lag = [&](const std::string &key, const std::string &input) {
            const auto source = std::find(sensors.begin(), sensors.end(), input);
            if (source != sensors.end())
                lags_[key] = static_cast<std::size_t>(source - sensors.begin());
        };
        for (const auto &signal : root.at("signals")) {
            if (signal.value("power", 1) == 1)
                add_lag(signal.at("name"), signal.value("lag_of", ""));
        }
        std::set<std::string> held;  // two banks differ by the ranges in which an input acts
        for (const auto &term : root.at("terms")) {
            const auto bank = term.value("bank", nlohmann::json::object());
            for (const float tau_s : bank.value("tau_s", std::vector<float>())) {
                for (const std::string input : bank.at("inputs")) {
                    if (tau_s > 0) add_lag(bank_key(input, 1, tau_s), input);
                    if (bank.contains("input_min")) held.insert(bank_key(input, 1, tau_s));
                }
            }
        }
        for (const std::string &key : held) lags_.erase(key);
    }
    void started() override {
        if (!box_) return;
        box_->start(of_.starts() > 1 || of_.box.files.has(run::state_path));
        reads_ = false;
        undoubted_ns_ = -never / 2;
        first_named_.clear();
        past_.clear();
    }
    void exchanged(const exchange &seen) override {
        if (names_judged_ && !seen.written.empty()) {
            const machine &author = of_.author_of(seen);
            judge_name(author, block_of(author, seen));
        }
        if (!box_) return;
        const machine &facts = of_.running_at(seen.sent);
        if (!seen.written.empty() && reads_) judge(facts, block_of(facts, seen), seen.sent);
        if (!is_reading(facts, seen)) return;
        reads_ = seen.duration != never && seen.exception == 0 && head_of(facts, seen).whole;
        if (!reads_) return;
        box_->read(facts, seen, seen.sent);
        keep_lags();
    }
    void file_written(const std::string &path, const node &file) override {
        if (!box_ || !reads_ || path != run::state_path) return;
        const auto state = decoded(file.bytes);
        if (!state) return;
        for (const state_file::record &record : state->records) judge_lag(record);
    }
    void reported(const nlohmann::json &all) override {
        if (!box_ || !reads_) return;
        const auto counted = counted_in(all);
        if (box_->watch()->knows_doubts() && counted > box_->watch()->most_doubts())
            violated(fmt::format("sensors_doubted is {}, {} doubts were possible", counted,
                                 box_->watch()->most_doubts()));
    }
    void ended(const ending &how) override {
        if (!box_ || how.by_signal || how.code != 0) return;
        const auto all = finished_statistics();
        if (all.is_null() || !box_->watch()->knows_doubts()) return;
        const auto counted = counted_in(all);
        if (counted < box_->watch()->least_doubts())
            violated(fmt::format("sensors_doubted is {}, there were {} doubts", counted,
                                 box_->watch()->least_doubts()));
    }

  private:
    static constexpr unsigned doubted = 11;  // the cause of docs/faults.md

    static std::uint64_t counted_in(const nlohmann::json &all) {
        return all.at("box").value("sensors_doubted", std::uint64_t{0});
    }
    // out: the sensor that is doubted, by the detail; "": it is about something else, or no signal
    // has this place
    static std::string doubted_in(const machine &author, const written_block &block) {
        if (!says_doubted(author, block)) return "";
        const nlohmann::json &signals = author.file().at("signals");
        const std::size_t place = block.detail & 0xFFu;
        return place >= 1 && place <= signals.size() ? signals[place - 1].at("name") : "";
    }
    static bool says_doubted(const machine &author, const written_block &block) {
        return block.reason == box_reason::degraded && author.map.detail &&
               block.detail >> 8 == doubted;
    }
    // Also with files that check fewer sensors, or none.
    void judge_name(const machine &author, const written_block &block) {
        if (!says_doubted(author, block)) return;
        const std::string named = doubted_in(author, block);
        if (named.empty())
            return violated(
                fmt::format("the detail is {:#x}, no signal has this place", block.detail));
        const nlohmann::json sensors = author.file().value("sensors", nlohmann::json::object());
        const nlohmann::json names = sensors.value("signals", nlohmann::json::array());
        if (std::find(names.begin(), names.end(), named) == names.end())
            violated(fmt::format("{} is doubted, and no sensor checks it", named));
    }
    void judge(const machine &facts, const written_block &block, time_ns sent) {
        using namespace box_reason;
        if (block.mode != fakeplc::box_mode::active) return;
        const sensor_watch &watch = *box_->watch();
        const bool passes = block.reason == none || block.reason == limited ||
                            block.reason == extrapolated || block.reason == drifted;
        const bool names = block.reason == degraded && facts.map.detail;
        const std::string named = doubted_in(facts, block);
        for (std::size_t j = 0; j < watch.names().size(); ++j) {
            if (watch.doubts(j) && passes)
                violated(fmt::format("{} contradicts the others, and the box uses it",
                                     watch.names()[j]));
            if (watch.doubts(j) && names && named.empty())
                violated(fmt::format("{} contradicts the others, and the detail is {:#x}",
                                     watch.names()[j], block.detail));
            if (watch.trusts(j) && named == watch.names()[j])
                violated(fmt::format("{} is doubted too early, or agrees with the others", named));
        }
        if (passes) undoubted_ns_ = sent;
        judge_second(facts, named, sent);
    }
    // Behind a doubt the others begin to disagree anew: a second one takes as long again.
    void judge_second(const machine &facts, const std::string &named, time_ns sent) {
        if (named.empty()) return first_named_.clear();
        if (first_named_.empty()) first_named_ = named;
        const time_ns least_ns = static_cast<time_ns>(1e9 * after_s_) - 3 * facts.period_us * us;
        if (longest_lag(of_) == 0 && named != first_named_ && sent - undoubted_ns_ < least_ns)
            violated(fmt::format("{} and {} are doubted {} ms behind a step without a doubt",
                                 first_named_, named, (sent - undoubted_ns_) / ms));
    }
    // What the lags of doubted sensors were in the newest time.
    void keep_lags() {
        for (const auto &[lag, source] : lags_) {
            std::deque<lag_value> &past = past_[lag];
            if (!box_->watch()->doubts(source))
                past.clear();
            else
                past.push_back({of_.time.now(), box_->lag_of(lag)});
            while (!past.empty() && of_.time.now() - past.front().at_ns > 5 * second)
                past.pop_front();
        }
    }
    // The file has them of one moment, which is older than the file.
    void judge_lag(const state_file::record &record) {
        const time_ns at = of_.time.now() - of_.box.boottime() + record.boottime_us * us;
        const double y = static_cast<double>(record.hi);
        const std::string key =
            record.name[0] != 0 ? record.name : bank_key(record.lag_of, record.power, record.tau_s);
        const auto found = past_.find(key);
        if (found == past_.end() || found->second.empty() || found->second.front().at_ns > at)
            return;
        interval all = interval::none();
        for (const lag_value &one : found->second)
            if (std::abs(one.at_ns - at) < 3 * of_.running().period_us * us)
                all.take(interval{one.is.value, one.is.value}.moved(0, one.is.near));
        if (all.is_none() || (y > all.low - 0.02 && y < all.high + 0.02)) return;
        violated(fmt::format("the lag {} of a doubted sensor is {}, the others take it to {} … {}",
                             key, y, all.low, all.high));
    }
    bool names_judged_;
    std::optional<reference_box> box_;
    bool reads_ = false;  // the newest reading came whole
    double after_s_ = 0;
    time_ns undoubted_ns_ = -never / 2;  // the newest step in ACTIVE that uses all sensors
    std::string first_named_;            // by the detail since then
    std::map<std::string, std::size_t>
        lags_;  // of sensors that check each other: the place of each
    struct lag_value {
        time_ns at_ns;
        judged_number is;
    };
    std::map<std::string, std::deque<lag_value>> past_;
};

}  // namespace

void add_doubts(run &of, invariants &all) {
    all.push_back(std::make_unique<doubts_invariant>(of));
}

}  // namespace compbox::world
