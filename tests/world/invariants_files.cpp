// SPDX-License-Identifier: MIT
// Files and log are whole after every kill and power cut, and what they say is true
// (docs/compboxd.md).
#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "host-tools/formats/text.h"
#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"
#include "tests/world/state_file.h"

namespace compbox::world {

namespace {

// Whoever reads the statistics or the snapshot finds one whole JSON object, at any time.
class stats_invariant : public invariant {
  public:
    explicit stats_invariant(run &of) : invariant(of, "statistics") {}
    void started() override {
        check_both("at a start");
        longest_between_steps_ns_ = 0;
        can_lost_ = of_.can ? of_.can->lost : 0;
        can_lost_told_ = of_.can ? of_.can->lost_told : 0;
        alarm_ = false;
        alarms_ = 0;
    }
    void file_written(const std::string &path, const node &) override {
        if (path == run::stats_path || path == run::snapshot_path) check(path, "after a write");
    }
    void ended(const ending &how) override {
        check_both("at the end");
        if (how.by_signal || how.code != 0) return;
        const auto all = nlohmann::json::parse(of_.box.files.text(run::stats_path), nullptr, false);
        if (!all.is_object()) return;
        if (!all.value("finished", false))
            violated("the daemon ended with 0, its statistics are not finished");
        check_ticks(all);
        check_jumps(all.at("box"));
        check_wakes(all);
        check_times(all);
        check_can(all);
        check_plausible(all.at("box"));
        check_alarms(all.at("box"));
        check_lead(all);
        check_ceiling(all);
        check_foreign(all.at("box"));
    }
    void taken(const machine &, const machine &) override { taken_ns_ = of_.time.now(); }
    void reported(const nlohmann::json &all) override { judge_lead(all); }

  private:
    void check_both(const char *when) {
        check(run::stats_path, when);
        check(run::snapshot_path, when);
    }
    void check(const std::string &path, const char *when) {
        const auto file = of_.box.files.find(path, false);
        if (file == nullptr || file->kind != node_kind::regular) return;
        if (!nlohmann::json::accept(file->bytes))
            violated(
                fmt::format("{} {} is no JSON object: {} bytes", when, path, file->bytes.size()));
    }
    // Nobody else writes, and nothing brings an older write.
    void check_foreign(const nlohmann::json &box) {
        if (longest_lag(of_) != 0 ||
            draws_any(of_, {fault_kind::foreign, fault_kind::wire, fault_kind::line,
                            fault_kind::memory, fault_kind::stray, fault_kind::plc_stop,
                            fault_kind::hostile, fault_kind::twice, fault_kind::boundary,
                            fault_kind::tear, fault_kind::exception}))
            return;
        const auto found = box.value("registers_foreign", std::uint64_t{0});
        if (found > 0)
            violated(fmt::format("{} registers of others are counted, and nobody writes", found));
    }
    // The site's ceiling, and the channels that it lowers (docs/decisions/0011-site-ceiling.md).
    void check_ceiling(const nlohmann::json &all) {
        if (draws_any(of_, {fault_kind::hostile, fault_kind::memory}) ||
            of_.time.now() - taken_ns_ < second || of_.running().profile.name == "fanuc")
            return;  // the profile of such a control lowers rates before (docs/plc-profiles.md)
        const auto names = formats::split(all.at("ceiling").value("lowers", ""), ',');
        for (const channel_facts &channel : of_.running().channels) {
            const bool is_named = std::any_of(names.begin(), names.end(), [&](std::string one) {
                one.erase(0, one.find_first_not_of(' '));
                return one == channel.name;
            });
            if (is_named != channel.lowered)
                violated(fmt::format("the ceiling lowers \"{}\", {} is {}lowered",
                                     all.at("ceiling").value("lowers", ""), channel.name,
                                     channel.lowered ? "" : "not "));
        }
    }
    // cycles + missed ticks fill the time; without faults there is no drift, and nothing is missed.
    void check_ticks(const nlohmann::json &all) {
        const double period_us = all.value("period_us", 0.0),
                     elapsed_us = 1e6 * all.value("elapsed_s", 0.0);
        const double ticks = all.value("cycles", 0.0) + all.value("overruns", 0.0);
        const double drift_us = all.value("drift_us", 0.0);
        if (draws_any(of_, {fault_kind::suspend, fault_kind::stall, fault_kind::boundary,
                            fault_kind::reload, fault_kind::hostile}))
            return;
        const double near_us = 3 * period_us + 1e-3 * static_cast<double>(longest_lag(of_));
        if (std::abs(ticks * period_us - elapsed_us) > near_us)
            violated(fmt::format("{} ticks of {} µs in {} µs", ticks, period_us, elapsed_us));
        if (longest_lag(of_) == 0 && std::abs(drift_us) > 1000)
            violated(fmt::format("the ticks drift by {} µs", drift_us));
        if (longest_lag(of_) == 0 && all.value("overruns", 0) > 0)
            violated(fmt::format("{} ticks were missed, and nothing was slow",
                                 all.value("overruns", 0)));
        if (longest_lag(of_) == 0 &&
            !draws_any(of_, {fault_kind::kill, fault_kind::power_cut, fault_kind::restart}))
            check_counts(all.at("box"));
    }
    // The figures of a time are in order, and none of them is 0: a wake-up, an exchange takes time.
    void check_times(const nlohmann::json &all) {
        for (const char *key : {"jitter_us", "interval_us", "exchange_us", "step_us"}) {
            const nlohmann::json &times = all.at(key);
            const double min = times.value("min", 0.0), max = times.value("max", 0.0);
            const double mean = times.value("mean", 0.0), near = 2e-3 + 1e-9 * max;
            const double p50 = times.value("p50", 0.0), p99 = times.value("p99", 0.0);
            const bool ordered = min <= p50 + near && p50 <= p99 + near && p99 <= max + near &&
                                 min <= mean + near && mean <= max + near;
            if (times.value("count", 0) > 0 && !ordered)
                violated(fmt::format("{} is not in order: {}", key, times.dump()));
        }
        const nlohmann::json &exchanges = all.at("exchange_us"), &intervals = all.at("interval_us");
        if (exchanges.value("count", 0) > 0 && exchanges.value("min", 1.0) <= 0)
            violated("an exchange took no time");
        // The clock of a step may turn to the next microsecond, but not in each.
        const nlohmann::json &steps = all.at("step_us");
        if (longest_lag(of_) == 0 && steps.value("count", 0) > 20 && steps.value("min", 0.0) > 0 &&
            !draws(of_, fault_kind::partial))
            violated(fmt::format("each step takes {} µs or more, and the world gives it none",
                                 steps.value("min", 0.0)));
        if (intervals.value("count", 0) > 0 && longest_lag(of_) == 0 &&
            intervals.value("min", 0.0) < 0.5 * all.value("period_us", 0.0) &&
            !draws_any(of_, {fault_kind::boundary, fault_kind::reload, fault_kind::hostile}))
            violated(fmt::format("{} µs between two wake-ups", intervals.value("min", 0.0)));
        const auto cycles = all.value("cycles", std::uint64_t{0});
        const auto rows = all.at("jitter_us").value("count", std::uint64_t{0});
        const auto lost = all.value("rows_lost", std::uint64_t{0});
        const auto records_lost = all.value("records_lost", std::uint64_t{0});
        if (records_lost < lost)
            violated(fmt::format("records_lost is {}, rows_lost {}", records_lost, lost));
        double before_s = -1e12;
        for (const auto &change : all.at("history")) {
            const double time_s = change.value("time_s", 0.0);
            if (time_s < before_s)
                violated(
                    fmt::format("a change at {} s is listed behind one at {} s", time_s, before_s));
            before_s = time_s;
        }
        // Until the end `cycles` does not have what is lost behind the newest row.
        if (rows > cycles || rows + lost < cycles ||
            (all.value("finished", false) && rows + lost > cycles))
            violated(fmt::format("{} rows and {} lost ones of {} cycles are counted", rows, lost,
                                 cycles));
    }
    // No sensor of the world leaves its range or its rate by itself, whatever the wall clock does.
    void check_plausible(const nlohmann::json &box) {
        if (!of_.box_machine.map.probes.empty() ||
            draws_any(of_, {fault_kind::sensors, fault_kind::hostile, fault_kind::memory,
                            fault_kind::wire, fault_kind::line, fault_kind::reload,
                            fault_kind::plc_stop, fault_kind::exception, fault_kind::can}))
            return;
        const auto refused = box.value("samples_implausible", 0u);
        if (refused > 0) violated(fmt::format("{} samples are implausible, none was", refused));
    }
    // With a handshake the control takes a time that is not known here.
    bool measures_lead() const {
        const nlohmann::json &cycle = of_.box_machine.file().at("cycle");
        return cycle.value("lead_ms", nlohmann::json(0)).is_string() &&
               of_.box_machine.profile.name != "fanuc";
    }
    double interpolates_us() const {
        return 1e3 * of_.box_machine.file().at("plc").value("interpolate_ms", 0.0);
    }
    // The lead that the box measures is that of docs/coefficient-file.md. In a calm run.
    void check_lead(const nlohmann::json &all) {
        constexpr double least_us = 20e6;
        if (!measures_lead() || exchanges_ < 100 || longest_lag(of_) != 0 ||
            1e6 * all.value("elapsed_s", 0.0) < least_us ||
            draws_any(of_, {fault_kind::loss,      fault_kind::reset,  fault_kind::tear,
                            fault_kind::exception, fault_kind::wire,   fault_kind::line,
                            fault_kind::plc_stop,  fault_kind::mute,   fault_kind::partial,
                            fault_kind::foreign,   fault_kind::stray,  fault_kind::boundary,
                            fault_kind::memory,    fault_kind::reload, fault_kind::hostile,
                            fault_kind::twice,     fault_kind::kill,   fault_kind::power_cut,
                            fault_kind::restart,   fault_kind::clock}))
            return;
        const double line_us = interpolates_us();
        const double update_us = 1e6 * of_.box_machine.twin.plc.scan_s;
        const double wanted_us = exchange_us_ + (line_us > 0 ? update_us / 2 : update_us) +
                                 (static_cast<double>(of_.running().period_us) + line_us) / 2;
        const double lead_us = all.value("lead_us", 0.0);
        if (std::abs(lead_us - std::min(wanted_us, 500e3)) > 4000 + 0.05 * wanted_us)
            violated(fmt::format("lead_us is {}, {} µs are measured", lead_us, wanted_us));
    }
    // A PLC that stood still took no longer for each of its cycles.
    void judge_lead(const nlohmann::json &all) {
        if (!measures_lead() || longest_lag(of_) != 0 ||
            draws_any(of_,
                      {fault_kind::tear, fault_kind::line, fault_kind::boundary, fault_kind::reload,
                       fault_kind::hostile, fault_kind::memory, fault_kind::loss,
                       fault_kind::partial, fault_kind::wire, fault_kind::reset}))
            return;
        const machine &facts = of_.box_machine;
        const double most_us = 1.5 * static_cast<double>(facts.period_us) + interpolates_us() +
                               3e6 * facts.twin.plc.scan_s + 20e3 +
                               1e-3 * static_cast<double>(slowest_line_ns_);
        if (all.value("lead_us", 0.0) > most_us)
            violated(fmt::format("lead_us is {}, the PLC takes no more than {}",
                                 all.value("lead_us", 0.0), most_us));
    }
    // An alarm of the NC counts once, for as long as it stays (docs/faults.md).
    void check_alarms(const nlohmann::json &box) {
        const auto counted = box.value("nc_alarms", std::uint64_t{0});
        const bool many =
            counted > alarms_ && !draws_any(of_, {fault_kind::wire, fault_kind::line,
                                                  fault_kind::memory, fault_kind::hostile});
        const bool few =
            counted + 1 < alarms_ && !hides_exchanges(of_) && !draws(of_, fault_kind::reload);
        if (many || few) violated(fmt::format("nc_alarms is {}, the NC had {}", counted, alarms_));
    }
    void see_alarm(const machine &facts, const exchange &seen) {
        if (!is_reading(facts, seen)) return;
        const bool alarm = head_of(facts, seen).nc_alarm;
        alarms_ += alarm && !alarm_;
        alarm_ = alarm;
    }
    // What the reply to a write takes on a serial line.
    time_ns line_ns(const exchange &seen) const {
        if (of_.plc_line == nullptr) return 0;
        const std::size_t characters = seen.function == 23 ? 5 + 2 * seen.read.size() : 8;
        return static_cast<time_ns>(characters) * of_.plc_line->character();
    }
    void time_exchange(const machine &facts, const exchange &seen) {
        if (of_.plc_line != nullptr)
            slowest_line_ns_ = std::max(slowest_line_ns_, seen.now - seen.sent + line_ns(seen));
        if (!seen.written.empty() && read_ns_ > 0) {
            const time_ns replied_ns = seen.now + seen.duration + line_ns(seen);
            const double us_ = 1e-3 * static_cast<double>(replied_ns - read_ns_);
            exchange_us_ += exchanges_++ == 0 ? us_ : (us_ - exchange_us_) / 8;
        }
        if (is_reading(facts, seen)) read_ns_ = seen.sent;
    }
    void check_can(const nlohmann::json &all) {
        if (!all.contains("can") || of_.can == nullptr) return;
        const auto counted = all.at("can").value("queue_overflows", std::uint64_t{0});
        const bool is_old =
            longest_lag(of_) == 0 && of_.time.now() - of_.can->lost_told_ns > second;
        const std::uint64_t least = is_old ? of_.can->lost_told - can_lost_told_ : 0;
        if (counted > of_.can->lost - can_lost_ || counted < least)
            violated(fmt::format("queue_overflows is {}, {} frames were lost, and it read of {}",
                                 counted, of_.can->lost - can_lost_, least));
        const time_ns up_ns = of_.time.now() - of_.can->changed_ns;
        if (all.at("can").value("state", "") == "down" && up_ns > 5 * second &&
            of_.can->state() == can_bus::interface_state::up && longest_lag(of_) == 0)
            violated(fmt::format("CAN is down, and its interface is up for {} ms", up_ns / ms));
    }
    // More than five periods between two steps are a jump of the clock (docs/faults.md). What comes
    // before the first step is behind none.
    void check_jumps(const nlohmann::json &box) {
        if (draws_any(of_, {fault_kind::reload, fault_kind::hostile, fault_kind::memory})) return;
        const time_ns period_ns = of_.running().period_us * us;
        if (longest_between_steps_ns_ > 8 * period_ns && box.value("clock_jumps", 1) == 0)
            violated(fmt::format("no step for {} ms, and no jump of the clock is counted",
                                 longest_between_steps_ns_ / ms));
    }
    void ticked() override {
        const time_ns now = of_.time.now();
        if (of_.steps_of_daemon > 1)
            longest_between_steps_ns_ = std::max(longest_between_steps_ns_, now - ticked_ns_);
        ticked_ns_ = now;
    }
    // A thread that did not run for some periods woke late, and the largest jitter says so.
    void check_wakes(const nlohmann::json &all) {
        if (draws_any(of_, {fault_kind::suspend, fault_kind::reload, fault_kind::hostile,
                            fault_kind::boundary}) ||
            all.value("rows_lost", 1) > 0)
            return;
        const double gap_us = 1e-3 * static_cast<double>(of_.longest_gap_ns);
        const double late_us = all.at("jitter_us").value("max", 0.0);
        if (late_us < gap_us - 2.1 * all.value("period_us", 0.0) - 1000)
            violated(
                fmt::format("no tick for {} µs, and the largest jitter is {} µs", gap_us, late_us));
    }
    // A PLC whose replies all arrive: what the box counted is what happened.
    void check_counts(const nlohmann::json &box) {
        if (draws_any(of_, {fault_kind::loss, fault_kind::reset, fault_kind::tear, fault_kind::wire,
                            fault_kind::plc_stop, fault_kind::foreign, fault_kind::partial,
                            fault_kind::twice, fault_kind::memory}))
            return;
        const bool all_come = !draws(of_, fault_kind::stray);  // which may come in their place
        compare("reads_torn", box.value("reads_torn", 0u), all_come ? torn_ : 0, torn_);
        // A refusal behind two probes of a serial line may be that of the other probe: unknown.
        const std::uint64_t uncertain =
            of_.running().plc_device.empty() ? 0 : box.value("writes_unknown", 0u);
        compare("writes_refused", box.value("writes_refused", 0u),
                all_come ? refused_ - std::min(refused_, uncertain) : 0, refused_ + probes_);
    }
    void compare(const char *counter, std::uint64_t counted, std::uint64_t happened,
                 std::uint64_t most) {
        if (counted + 1 >= happened && counted <= most) return;  // the last may be unread
        violated(fmt::format("{} is {}, it happened {} times", counter, counted, happened));
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (seen.duration == never) return;  // the box gets nothing
        time_exchange(facts, seen);
        see_alarm(facts, seen);
        // On a serial line a write behind a lost reply needs a reading first (docs/rtu.md).
        probes_ += seen.exception != 0 && seen.function == 3 && !facts.plc_device.empty();
        torn_ += is_reading(facts, seen) && !head_of(facts, seen).whole;
        refused_ += seen.exception != 0 && seen.function != 3;
    }

    time_ns ticked_ns_ = 0, longest_between_steps_ns_ = 0;  // of this daemon
    std::uint64_t can_lost_ = 0, can_lost_told_ = 0;        // before this daemon
    time_ns slowest_line_ns_ = 0;                           // of an exchange on a serial line
    double exchange_us_ = 0;  // from a reading to the reply to what it led to, filtered
    std::uint64_t exchanges_ = 0;
    time_ns read_ns_ = 0;
    bool alarm_ = false;  // in the newest reading
    std::uint64_t alarms_ = 0;
    time_ns taken_ns_ = -second;  // the newest other file
    std::uint64_t torn_ = 0, refused_ = 0;
    std::uint64_t probes_ = 0;  // refused readings, each of which may be in a write's place
};

// The state file is whole at any time unless someone else has changed it; a file that is not whole
// is refused, and no other one. STOPPED in it is true. The last file of a run has it if that run
// ended so, or wrote nothing behind one that did. The pause that the log names is the true one. The
// first file of a run has all lags that go on.
class state_invariant : public invariant {
  public:
    explicit state_invariant(run &of) : invariant(of, "state") {}
    void started() override {
        const auto file = of_.box.files.find(run::state_path, false);
        found_ = file != nullptr && file->kind == node_kind::regular ? file->bytes : "";
        const bool others = draws_any(of_, {fault_kind::state, fault_kind::disk});
        if (!others && !found_.empty() && !decoded(found_))
            violated(fmt::format("a start finds a state file of {} bytes that is not whole",
                                 found_.size()));
        said_stopped_ = wrote_nothing_ = left_out_ = false;
        resumed_ = 0;
    }
    void ended(const ending &how) override {
        const auto statistics = finished_statistics();
        const bool began = of_.cycles_of_daemon > 0;
        if (how.by_signal || (began && (statistics.is_null() || left_out_)) ||
            draws_any(of_, {fault_kind::state, fault_kind::disk, fault_kind::memory,
                            fault_kind::refuse, fault_kind::links, fault_kind::reader}))
            return;
        const auto state = decoded(of_.box.files.text(run::state_path));
        const auto found = decoded(found_);
        const bool stopped = !began           ? found && found->end.stopped == 1
                             : wrote_nothing_ ? said_stopped_
                                              : statistics.value("stopped", false);
        if (state && (state->end.stopped == 1) != stopped)
            violated(fmt::format("a run that ended {}STOPPED leaves a state file with {}",
                                 stopped ? "" : "without ", state->end.stopped));
    }
    void file_written(const std::string &path, const node &file) override {
        if (path != run::state_path || file.kind != node_kind::regular ||
            draws(of_, fault_kind::state))
            return;
        const auto state = decoded(file.bytes);
        if (!state) {
            if (!file.bytes.empty()) violated("the daemon wrote a state file that is not whole");
            return;
        }
        if (state->end.stopped == 1 && !zero_)
            violated("the state file says STOPPED, and the PLC has no STOPPED with zero");
        if (state->records.size() < std::exchange(resumed_, 0))
            violated(fmt::format("the first state file of a run has {} lags, and more go on",
                                 state->records.size()));
        remember(*state);
    }
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const written_block &block = block_of(of_.author_of(seen), seen);
        // A late one of an abandoned connection has an old mode, but moves nothing (`exit`).
        if (zero_ && seen.sent < sent_ns_ && block.is_zero()) return;
        sent_ns_ = seen.sent;
        zero_ = block.mode == fakeplc::box_mode::stopped && block.is_zero();
    }
    void logged(const std::string &line) override {
        unsigned resumed = 0, all = 0;
        double pause_s = 0;
        const auto has = [&](const char *words) { return line.find(words) != std::string::npos; };
        said_stopped_ = said_stopped_ || has("; the previous run ended STOPPED");
        wrote_nothing_ = wrote_nothing_ || has("nothing was written: check");
        left_out_ = left_out_ || has("about start and end left out");
        const auto at = line.find(run::state_path);
        if (at == std::string::npos) return;
        const char *words = line.c_str() + at + std::strlen(run::state_path);
        if (has(" and is not used") && decoded(found_) &&
            !draws_any(of_, {fault_kind::state, fault_kind::disk, fault_kind::refuse,
                             fault_kind::hostile, fault_kind::links}))
            violated("a state file that is whole is not used");
        if (std::sscanf(words, ": %u of %u lags go on after a pause of %lf s", &resumed, &all,
                        &pause_s) != 3)
            return;
        resumed_ = resumed;
        const auto state = decoded(found_);
        if (!state) violated("lags go on by a state file that is not whole");
        if (resumed == 0 ||
            draws_any(of_, {fault_kind::state, fault_kind::boundary, fault_kind::suspend}))
            return;
        const auto known = true_ns_.find(found_);
        if (known == true_ns_.end()) return;
        // Behind another boot the wall clock counts, which the fault sets.
        if (draws(of_, fault_kind::clock) && known->second.boot_id != of_.box.boot_id()) {
            if (!of_.box.synchronised && longest_lag(of_) == 0)
                violated(fmt::format("a pause of {} s by a clock that is not set", pause_s));
            if (!state->synchronised)
                violated(fmt::format("a pause of {} s by a clock that was not set", pause_s));
            return;
        }
        // It is the oldest that the coefficient file still has.
        const double near_s =
            0.3 + 1e-9 * static_cast<double>(std::min(longest_lag(of_), 20 * second));
        double true_s = 0;
        for (const time_ns ns : known->second.ns) {
            true_s = 1e-9 * static_cast<double>(of_.time.now() - ns);
            if (std::abs(true_s - pause_s) <= near_s) return;
        }
        violated(fmt::format("the log says a pause of {} s, it was {} s", pause_s, true_s));
    }

  private:
    // When each record of this file was valid, by the world's time.
    void remember(const state_file &file) {
        std::vector<time_ns> ns;
        for (const auto &record : file.records)
            ns.push_back(of_.time.now() - (of_.box.boottime() - record.boottime_us * us));
        if (true_ns_.size() > 100) true_ns_.clear();
        if (!ns.empty()) true_ns_[of_.box.files.text(run::state_path)] = {ns, of_.box.boot_id()};
    }

    bool zero_ = false;
    bool said_stopped_ = false;   // the log says so of the run before
    bool left_out_ = false;       // the log lacks a line of the start
    bool wrote_nothing_ = false;  // this daemon, by the log
    std::string found_;
    std::size_t resumed_ = 0;  // lags of the run before, which the first file has too
    time_ns sent_ns_ = 0;
    struct moment {
        std::vector<time_ns> ns;
        std::string boot_id;
    };
    std::map<std::string, moment> true_ns_;
};

// out: what gzip packed, so many bytes at most
std::string unpacked(const std::string &packed, std::size_t most) {
    z_stream stream{};
    std::string text(most, '\0');
    if (inflateInit2(&stream, 16 + MAX_WBITS) != Z_OK) return "";  // 16: gzip
    std::string in = packed;
    stream.next_in = reinterpret_cast<Bytef *>(in.data());
    stream.avail_in = static_cast<uInt>(in.size());
    stream.next_out = reinterpret_cast<Bytef *>(text.data());
    stream.avail_out = static_cast<uInt>(text.size());
    inflate(&stream, Z_FINISH);
    text.resize(stream.total_out);
    inflateEnd(&stream);
    return text;
}

// The record has whole rows, in the order of time, also after a full disk; so has each file of the
// black box. A kill may cut the last.
// A start takes no row away, and a limit of all records holds: the oldest alone makes room for the
// next one. The newest row has the wall clock's time.
class record_invariant : public invariant {
  public:
    explicit record_invariant(run &of) : invariant(of, "record") {
        if (of.box.files.has(std::string(run::record_path) + ".1.gz"))
            bytes_ = run::old_records * run::old_record_bytes;
    }
    void started() override {
        writes_ = false;
        start_ns_ = of_.time.now();
        take_last_row();
    }
    void file_written(const std::string &path, const node &file) override {
        writes_ = writes_ || path == run::record_path;
        if (path.rfind(std::string(run::record_path) + ".", 0) == 0) judge_same(path, file);
    }
    // The compressed file has its name before the plain one goes.
    void rename_failed(const std::string &path) override {
        const std::string plain = std::string(run::record_path) + ".1";
        if (path == plain + ".gz" && !of_.box.files.has(plain))
            violated(fmt::format("{} does not take its name, and {} is gone", path, plain));
    }
    void ticked() override {
        look_at_clock();
        if (!writes_ && !is_later(last_row_)) last_row_.clear();  // another clock at its first row
        if (draws(of_, fault_kind::power_cut) && of_.time.now() - looked_ns_ > second)
            look_at_rows();
    }
    void ended(const ending &how) override {
        look_at_clock();
        if (how.power_cut) judge_durable();
        for (const std::string &found : of_.box.files.names_in(run::blackbox_path))
            if (found.size() > 4 && found.substr(found.size() - 4) == ".csv")
                check(fmt::format("{}/{}", run::blackbox_path, found), false);
        const std::string text = of_.box.files.text(run::record_path);
        if (!writes_ || text.empty() || how.power_cut) return;
        check_last_row(text);
        check(run::record_path, how.by_signal);
        check_kept();
        if (!how.by_signal) check_compressed();
        if (!how.by_signal && draws(of_, fault_kind::clock) && longest_lag(of_) == 0)
            check_clock(text);
    }

  private:
    static constexpr int most_records = 1000;  // CB_ARCHIVE_FILES, and the one that grows
    bool writes_ = false;
    time_ns start_ns_ = 0;
    std::string last_row_;     // at the start, with both line ends, if it is later than that
    std::uint64_t rows_ = 0;   // of all records so far
    std::uint64_t bytes_ = 0;  // of all records at the last end
    time_ns ahead_ns_ = 0;     // the wall clock less the world's time
    time_ns set_ns_ = 0;       // when the wall clock was set last
    // Of the newest look at the record: the file, and whether it has had rows since the look
    // before.
    std::shared_ptr<const node> record_;
    bool had_rows_ = false;
    time_ns looked_ns_ = 0;

    // A record has its first rows on the disk at once, however short it is.
    void look_at_rows() {
        looked_ns_ = of_.time.now();
        const auto file = of_.box.files.find(run::record_path, false);
        had_rows_ = std::exchange(record_, file) == file && file != nullptr && has_row(*file);
    }
    static bool has_row(const node &file) {
        const auto head = std::find(file.bytes.begin(), file.bytes.end(), '\n');
        return head != file.bytes.end() &&
               std::find(head + 1, file.bytes.end(), '\n') != file.bytes.end();
    }
    void judge_durable() {
        const auto file = of_.box.files.find(run::record_path, false);
        const bool is_there = file != nullptr && has_row(*file);
        if (std::exchange(had_rows_, false) && writes_ && !is_there && longest_lag(of_) == 0 &&
            !may_lack_rows(of_))
            violated("the record had rows for a second, and a power cut left none");
        record_.reset();
    }
    // A compressed file that takes its name has the rows of the plain one of that number.
    void judge_same(const std::string &path, const node &file) {
        const auto end = path.rfind(".gz");
        if (end == std::string::npos || end + 3 != path.size()) return;
        const auto plain = of_.box.files.find(path.substr(0, end), false);
        if (plain != nullptr && plain->kind == node_kind::regular &&
            unpacked(file.bytes, plain->bytes.size() + 1) != plain->bytes)
            violated(fmt::format("{} does not have the rows of {}", path, path.substr(0, end)));
    }
    void look_at_clock() {
        const time_ns ahead_ns = of_.box.wall() - of_.time.now();
        if (std::abs(std::exchange(ahead_ns_, ahead_ns) - ahead_ns) > second)
            set_ns_ = of_.time.now();
    }
    // out: whether a row, by its last column, is of a time that has still to come
    bool is_later(const std::string &row) const {
        const auto last = row.rfind(',');
        return last != std::string::npos && std::strtod(row.c_str() + last + 1, nullptr) >
                                                2 + 1e-9 * static_cast<double>(of_.box.wall());
    }
    // A record whose last row is later than the wall clock does not go on.
    void take_last_row() {
        const std::string text = of_.box.files.text(run::record_path);
        const auto end = text.rfind('\n');
        last_row_.clear();
        if (end == std::string::npos || end == 0) return;
        const auto begin = text.rfind('\n', end - 1);
        if (begin != std::string::npos) last_row_ = text.substr(begin, end - begin + 1);
        if (!is_later(last_row_)) last_row_.clear();
    }
    void check_last_row(const std::string &text) {
        const auto found = last_row_.empty() ? std::string::npos : text.find(last_row_);
        if (found != std::string::npos && found + last_row_.size() < text.size())
            violated("the record goes on behind a row that is later than the wall clock was");
        const bool is_first = found == std::string::npos && !last_row_.empty() &&
                              !of_.limits_records() && !may_lack_rows(of_);
        const std::size_t row = text.find('\n') + 1;
        if (is_first && row < text.size() && std::strtod(text.c_str() + row, nullptr) > 0)
            violated(fmt::format("another record begins with {}", text.substr(row, 20)));
    }
    // A clock that was not set for ten seconds gave the newest row its time.
    void check_clock(const std::string &text) {
        const auto last = text.rfind(',');  // unix_s is the last column
        if (std::count(text.begin(), text.end(), '\n') < 2 ||
            of_.time.now() - set_ns_ < 10 * second)
            return;
        const double unix_s = std::strtod(text.c_str() + last + 1, nullptr);
        const double wall_s = 1e-9 * static_cast<double>(of_.box.wall());
        if (std::abs(unix_s - wall_s) > 5)
            violated(
                fmt::format("the newest row has the time {} s, the clock {} s", unix_s, wall_s));
    }
    void check_kept() {
        if (draws_any(of_, {fault_kind::power_cut, fault_kind::disk})) return;
        std::uint64_t rows = 0, bytes = 0;
        const std::string path = run::record_path;
        for (int n = 0; n < most_records; ++n) {  // a refused rename leaves a number out
            const std::string one = n == 0 ? path : fmt::format("{}.{}", path, n);
            const std::string text = of_.box.files.text(one);
            rows += static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\n'));
            bytes += std::min(text.size(), run::most_record_bytes) +
                     of_.box.files.text(one + ".gz").size();
        }
        if (of_.limits_records() && bytes > 1000000)
            violated(fmt::format("all records have {} bytes", bytes));
        // What makes room for the next file is the oldest one, not all.
        if (of_.limits_records() && bytes_ > 600000 && bytes < 450000)
            violated(fmt::format("all records have {} bytes, there were {}", bytes, bytes_));
        bytes_ = bytes;
        if (!of_.limits_records() && rows < rows_)
            violated(fmt::format("the records have {} lines, there were {}", rows, rows_));
        rows_ = rows;
    }
    // Each of them is, before the next one is put aside. A daemon that finds several needs a while.
    void check_compressed() {
        const bool may_find = draws_any(of_, {fault_kind::kill, fault_kind::power_cut,
                                              fault_kind::restart, fault_kind::reload});
        if (!of_.limits_records() || longest_lag(of_) != 0 ||
            (may_find && of_.time.now() - start_ns_ < 60 * second) ||
            draws_any(of_, {fault_kind::hostile, fault_kind::partial}))
            return;
        for (int n = 2; n < most_records; ++n) {
            const std::string one = fmt::format("{}.{}", run::record_path, n);
            if (of_.box.files.has(one)) violated(one + " is not compressed");
        }
    }
    // in : cut: its last row may be a part, as it is where the disk refused to cut that off
    void check(const std::string &path, bool cut) {
        const auto file = of_.box.files.find(path);
        const std::string text = of_.box.files.text(path);
        cut = cut || (file && file->is_uncut);
        std::size_t columns = 0, at = 0;
        double before_s = -1;
        while (at < text.size()) {
            const std::size_t end = text.find('\n', at);
            if (end == std::string::npos) {
                if (!cut) violated("the record ends with a part of a row");
                return;
            }
            const auto from = text.begin() + static_cast<std::ptrdiff_t>(at);
            const auto commas = static_cast<std::size_t>(
                std::count(from, text.begin() + static_cast<std::ptrdiff_t>(end), ','));
            if (at == 0) columns = commas;
            const std::string row = text.substr(at, std::min<std::size_t>(end - at, 40));
            if (commas != columns)
                violated(fmt::format("a row of the record has {} commas, not {}: {}", commas,
                                     columns, row));
            double time_s = 0;
            const bool has_time = std::sscanf(row.c_str(), "%lf", &time_s) == 1;
            if (has_time != (at > 0))
                violated((has_time ? "the record has no header: " : "a row has no time: ") + row);
            if (at > 0 && time_s <= before_s)
                violated(fmt::format("a row of {} s behind one of {} s", time_s, before_s));
            if (at > 0) before_s = time_s;
            at = end + 1;
        }
    }
};

// Lines of the log are whole sentences of compboxd, and few: 20 at once and two a second of each
// kind. A mode that lasts has one line for each signal that is missing.
class log_invariant : public invariant {
  public:
    explicit log_invariant(run &of) : invariant(of, "log") {}
    void started() override {
        since_ns_ = of_.box.boottime();  // a suspend of all the world allows more lines
        lines_.clear();
        again_ = refusals_ = 0;
        files_ = of_.measurer ? of_.measurer->files() : 0;
    }
    void logged(const std::string &line) override {
        judge_repetition(line);
        judge_refusals(line);
        const std::string beginning = beginning_of(line);
        const unsigned lines = ++lines_[beginning];
        if (line.rfind("compboxd: ", 0) != 0 &&
            !draws_any(of_, {fault_kind::partial, fault_kind::refuse, fault_kind::kill,
                             fault_kind::power_cut}))
            violated("a line of the log does not begin with the program's name: " + line);
        const double elapsed_s = 1e-9 * static_cast<double>(of_.box.boottime() - since_ns_);
        if (lines > 40 + 2.2 * elapsed_s)
            violated(fmt::format("{} lines in {} s begin with '{}'", lines, elapsed_s, beginning));
    }

  private:
    // Lines of one kind may have several beginnings, but none two kinds.
    static std::string beginning_of(const std::string &line) {
        const auto at = line.find(" s: ");
        return at == std::string::npos ? "" : line.substr(at + 4, line.find(' ', at + 4) - at - 4);
    }
    // With the same mode, reason, signal and words, and no line between that may have had others.
    void judge_repetition(const std::string &line) {
        static const std::regex number(R"( -?[0-9.]+(e[-+]?[0-9]+)?(?= |$))");
        const auto at = line.find(" s: "), end = line.find(": signal ");
        if (line.find("left out)") != std::string::npos || end == std::string::npos) again_ = 0;
        if (at == std::string::npos || end == std::string::npos ||
            draws_any(of_, {fault_kind::hostile, fault_kind::memory, fault_kind::foreign,
                            fault_kind::wire, fault_kind::line}))
            return;
        const std::string told = std::regex_replace(line.substr(at), number, "");
        again_ = told == told_ ? again_ + 1 : 0;
        told_ = told;
        if (again_ > 5)
            violated(fmt::format("{} lines in a row about one signal: {}", again_ + 1, line));
    }
    // A file of measurements that is not accepted has one line, and so has the one of before.
    void judge_refusals(const std::string &line) {
        if (line.find("so no measurement is taken") == std::string::npos) return;
        const unsigned files = of_.measurer->files() - files_ + 1;
        if (++refusals_ > files)
            violated(fmt::format("{} files of measurements are refused, there were {}: {}",
                                 refusals_, files, line));
    }
    time_ns since_ns_ = 0;
    unsigned files_ = 0, refusals_ = 0;  // at the start; since then
    std::map<std::string, unsigned> lines_;
    std::string told_;  // mode, reason, signal and words of the newest line about a missing one …
    unsigned again_ = 0;  // … and the lines in a row that have them too
};

// A symbolic link in the place of an output is never followed, and stays. One that comes while the
// new file is written may be replaced.
class link_invariant : public invariant {
  public:
    explicit link_invariant(run &of)
        : invariant(of, "link"),
          ages_judged_(longest_lag(of) == 0 && !draws(of, fault_kind::clock)) {}
    void file_written(const std::string &path, const node &file) override {
        if (path == run::victim_path && !file.bytes.empty())
            violated("the daemon wrote to the file that a link in the place of its output names");
        static const std::set<std::string> whole = {run::state_path, run::stats_path,
                                                    run::snapshot_path};
        if (ages_judged_ && file.replaced_ns > second && whole.count(path) > 0)
            violated(
                fmt::format("the daemon replaced a link of {} ms in the place of its output {}",
                            file.replaced_ns / ms, path));
    }

  private:
    bool ages_judged_;
};

// An output that is not written is reported, and an interrupted write is none. Each row of a record
// is in it or counted as lost, and none twice. No unfinished file stays.
class reports_invariant : public invariant {
  public:
    explicit reports_invariant(run &of)
        : invariant(of, "reports"),
          // Where lines of files are many, or cut, one of them may be missing.
          judged_(!draws_any(of, {fault_kind::reader, fault_kind::refuse, fault_kind::partial,
                                  fault_kind::reload, fault_kind::hostile})) {}
    void started() override {
        failing_.clear();
        lines_ = lines();
        lost_rows_ = 0;
    }
    void rename_failed(const std::string &path) override {
        static const std::set<std::string> whole = {run::state_path, run::stats_path,
                                                    run::snapshot_path};
        if (whole.count(path) == 0) return;
        const time_ns now = of_.time.now();
        const auto found = failing_.emplace(path, failure{now, false}).first;
        if (judged_ && longest_lag(of_) != never && !found->second.is_told &&
            now - found->second.since_ns > longest_silence)
            violated(fmt::format("{} does not take its name for {} ms, and no line says so", path,
                                 (now - found->second.since_ns) / ms));
    }
    void file_written(const std::string &path, const node &) override { failing_.erase(path); }
    void logged(const std::string &line) override {
        const auto words = line.find(": cannot be written: ");
        if (words == std::string::npos) {
            count_lost(line);
            return;
        }
        for (auto &[path, one] : failing_)
            one.is_told = one.is_told || line.find(" " + path + ":") != std::string::npos;
        if (line.find("Interrupted", words) != std::string::npos &&
            of_.time.now() - of_.box.interrupted_ns > longest_silence)
            violated("an interrupted write is not made again: " + line);
    }
    void ended(const ending &how) override {
        if (!how.by_signal && how.code == 0) judge_unfinished();
        if (how.by_signal || !of_.keeps_record() || of_.limits_records() || lines_ == none ||
            lines() == none || !of_.records_each_cycle() ||
            draws_any(of_, {fault_kind::reload, fault_kind::hostile, fault_kind::refuse,
                            fault_kind::partial, fault_kind::links}) ||
            (draws(of_, fault_kind::reader) && draws(of_, fault_kind::disk)))  // a line is lost
            return;
        const auto all = finished_statistics();
        if (all.is_null()) return;
        const auto wanted = all.value("cycles", std::uint64_t{0});
        const auto kept = lines() - lines_ + lost_rows_ + all.value("rows_lost", std::uint64_t{0});
        if (kept < wanted || kept > wanted + few)
            violated(
                fmt::format("{} rows of {} cycles are in the record or counted", kept, wanted));
    }

  private:
    static constexpr time_ns longest_silence = 3 * second;
    static constexpr std::uint64_t none = ~std::uint64_t{0};
    static constexpr std::uint64_t few = 2;  // headers
    struct failure {
        time_ns since_ns;
        bool is_told;
    };
    // Also of a crash before this run.
    void judge_unfinished() {
        if (draws_any(of_, {fault_kind::disk, fault_kind::refuse, fault_kind::links})) return;
        for (const std::string path : {run::state_path, run::stats_path})
            if (of_.box.files.has(path + run::unfinished))
                violated(path + " has an unfinished file beside it at the end");
    }
    // Of the record; none: it has archives, or is no file.
    std::uint64_t lines() const {
        const auto file = of_.box.files.find(run::record_path, false);
        if (file == nullptr) return 0;
        if (file->kind != node_kind::regular ||
            of_.box.files.has(std::string(run::record_path) + ".1"))
            return none;
        return static_cast<std::uint64_t>(std::count(file->bytes.begin(), file->bytes.end(), '\n'));
    }
    void count_lost(const std::string &line) {
        unsigned long long count = 0;
        const auto at = line.find(std::string(run::record_path) + ": ");
        if (at != std::string::npos && line.find(" could not be written: ") != std::string::npos &&
            std::sscanf(line.c_str() + at + std::strlen(run::record_path), ": %llu row", &count) ==
                1)
            lost_rows_ += count;
    }

    bool judged_;
    std::map<std::string, failure> failing_;
    std::uint64_t lines_ = 0, lost_rows_ = 0;
};

}  // namespace

void add_files(run &of, invariants &all) {
    all.push_back(std::make_unique<stats_invariant>(of));
    all.push_back(std::make_unique<state_invariant>(of));
    all.push_back(std::make_unique<record_invariant>(of));
    all.push_back(std::make_unique<log_invariant>(of));
    all.push_back(std::make_unique<link_invariant>(of));
    all.push_back(std::make_unique<reports_invariant>(of));
}

}  // namespace compbox::world
