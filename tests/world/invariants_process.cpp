// SPDX-License-Identifier: MIT
// The process: how it ends, what it holds, that it recovers, its ticks (docs/compboxd.md).
#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

// The daemon ends as it was asked to: by an assertion never, with 0 exactly where the PLC confirmed
// STOPPED and all files are complete; state and events are then on the disk. It refuses to start
// only with a fault that may spoil a file or a call.
class exit_invariant : public invariant {
  public:
    explicit exit_invariant(run &of) : invariant(of, "exit") {}
    void started() override {
        has_reason_ = is_incomplete_ = stopped_ = false;
        asked_ns_ = never;
        lost_ns_ = -never / 2;  // the next daemon asks the PLC
    }
    void logged(const std::string &line) override {
        has_reason_ = has_reason_ || line.rfind("compboxd: ", 0) == 0;
        is_incomplete_ =
            is_incomplete_ || line.find(" could not be written: ") != std::string::npos;
    }
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const written_block &block = block_of(of_.author_of(seen), seen);
        // A write of an abandoned connection, older than that of STOPPED, may still be on its way.
        // Its mode is an old one, but it moves nothing.
        if (stopped_ && seen.sent < stopped_ns_ && block.is_zero()) return;
        stopped_ = block.mode == fakeplc::box_mode::stopped && block.is_zero();
        if (stopped_) stopped_ns_ = seen.sent;
        if (seen.duration == never && !block.is_zero()) lost_ns_ = std::max(lost_ns_, seen.sent);
        judge_stop(of_.author_of(seen), seen.sent - lost_ns_);
    }
    void ended(const ending &how) override {
        const bool asked = of_.asked_to_stop || of_.stop_asked;
        const bool at_start = of_.cycles_of_daemon == 0;
        // Before it has blocked the signals of a stop, these end it at once.
        if (how.by_signal && how.code != 9 && !(at_start && (asked || how.code == 1)))
            violated(fmt::format("the daemon ended by signal {}", how.code));
        // The first file is one that a box can run.
        const bool spoils =
            of_.box.lacks_thread ||
            draws_any(of_, {fault_kind::refuse, fault_kind::disk, fault_kind::links,
                            fault_kind::state}) ||
            (of_.starts() > 1 && draws_any(of_, {fault_kind::hostile, fault_kind::reload,
                                                 fault_kind::power_cut, fault_kind::kill}));
        const bool refused = at_start && how.code == 1 && has_reason_ && spoils;
        if (!how.by_signal && !asked && !refused)
            violated(fmt::format("the daemon ended with {} by itself", how.code));
        if (!how.by_signal && how.code != 0 && of_.faults.count() == 0)
            violated(fmt::format("the daemon ended with {} without a fault", how.code));
        if (how.by_signal || how.code != 0) return;
        if (!stopped_)
            violated("the daemon ended with 0, but the PLC did not get STOPPED and zero");
        if (is_incomplete_) violated("the daemon ended with 0, but a file is not complete");
        for (const char *path : {run::state_path, run::events_path}) {
            const auto file = of_.box.files.find(path, false);
            if (file != nullptr && file->dirty && file->bytes != file->durable &&
                !draws_any(of_, {fault_kind::disk, fault_kind::refuse, fault_kind::links,
                                 fault_kind::state}))
                violated(fmt::format("the daemon ended with 0, and {} is not on the disk", path));
        }
    }
    void ticked() override {
        if (!of_.stop_asked || of_.asked_to_stop) asked_ns_ = never;
        if (!of_.stop_asked || of_.asked_to_stop || longest_lag(of_) != 0) return;
        if (asked_ns_ == never) {
            asked_ns_ = of_.time.now();
            most_ns_ = run::rest_ns(of_.running()) + 15 * second;
        }
        // A value of another client begins a ramp of its own.
        const time_ns since_ns = std::max(asked_ns_, of_.plc.foreign_write_ns);
        if (of_.time.now() - since_ns > most_ns_)
            violated(fmt::format("the daemon has not ended {} s behind SIGTERM",
                                 (of_.time.now() - asked_ns_) / second));
    }
    void finished() override {
        if (of_.box.runs()) violated("the daemon did not end within the stated time");
    }

  private:
    // in : the time since the newest write of an offset that had no reply. It may still take effect
    //      (docs/decisions/0003-what-the-plc-may-hold.md, "A stop"); not on a serial line, where
    //      the reply to a probe ends that.
    void judge_stop(const machine &facts, time_ns behind) {
        if (!facts.plc_device.empty()) return;
        const time_ns least = (facts.heartbeat_timeout_us + facts.period_us) * us;
        if (stopped_ && behind < least)
            violated(
                fmt::format("STOPPED {} ms behind a write of an offset without a reply, which "
                            "may still take effect",
                            behind / ms));
    }

    bool has_reason_ = false;  // a sentence about a failed start
    bool is_incomplete_ = false, stopped_ = false;
    time_ns lost_ns_ = -never / 2;
    time_ns stopped_ns_ = 0;                  // when the write of STOPPED was sent
    time_ns asked_ns_ = never, most_ns_ = 0;  // SIGTERM, and the time from it to the end
};

// Without faults the box becomes ACTIVE, and its last status is STOPPED. Faults that are over for
// the time of recovery_ns() leave nothing behind.
class service_invariant : public invariant {
  public:
    explicit service_invariant(run &of) : invariant(of, "service") {}
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const written_block &block = block_of(of_.author_of(seen), seen);
        const bool stopped = mode_ == fakeplc::box_mode::stopped && is_zero_;
        if (stopped && seen.sent < sent_ns_ && block.is_zero()) return;  // late, as for `exit`
        sent_ns_ = seen.sent;
        mode_ = block.mode;
        is_zero_ = block.is_zero();
        const bool degraded = block.reason == box_reason::degraded && !of_.box_machine.models_fade;
        const bool whole = !degraded && block.reason != box_reason::unapplied;
        if (mode_ == fakeplc::box_mode::active && whole) active_ns_ = seen.now;
        was_active_ = was_active_ || mode_ == fakeplc::box_mode::active;
        judge_recovery();
    }
    void scanned(const fakeplc::plc_state &) override { judge_recovery(); }
    // By the file of that moment: a slower one may rest longer than the good one behind it.
    void faults_ended() override {
        quiet_ns_ = of_.time.now();
        recovery_ns_ = of_.recovery_ns();
    }
    void finished() override {
        const bool quiet = quiet_ns_ != never && of_.time.now() - quiet_ns_ > recovery_ns_;
        if (quiet && (mode_ != fakeplc::box_mode::stopped || !is_zero_))
            violated(fmt::format("behind the quiet end the last status is {}", mode_));
        if (of_.faults.count() > 0) return;
        if (!was_active_ && of_.box_machine.demands_fit) violated("the box was never ACTIVE");
        if (active_ns_ < 0 && of_.box_machine.demands_fit && of_.time.now() > 20 * second)
            violated("the box was never ACTIVE with all its signals");
        if (mode_ != fakeplc::box_mode::stopped)
            violated(fmt::format("the last status is {}", mode_));
    }

  private:
    void judge_recovery() {
        if (quiet_ns_ == never || of_.asked_to_stop || !of_.box_machine.demands_fit) return;
        if (active_ns_ >= quiet_ns_ || of_.time.now() - quiet_ns_ < recovery_ns_) return;
        violated(
            fmt::format("the box is not ACTIVE, or not with all its signals, {} s after the "
                        "last fault; its status is {}",
                        (of_.time.now() - quiet_ns_) / second, mode_));
    }

    unsigned mode_ = 0;
    bool was_active_ = false, is_zero_ = false;
    time_ns sent_ns_ = 0;  // the newest write
    time_ns quiet_ns_ = never, recovery_ns_ = 0, active_ns_ = -never / 2;
};

// Nothing grows: descriptors, blocks of memory, threads.
class resources_invariant : public invariant {
  public:
    explicit resources_invariant(run &of) : invariant(of, "resources") {}
    void exchanged(const exchange &) override {
        if (++exchanges_ % 16 != 0 || !of_.box.runs()) return;
        const auto &process = of_.box.current_process();
        const auto open = std::count_if(process.descriptors.begin(), process.descriptors.end(),
                                        [](const auto &file) { return file != nullptr; });
        if (open > most_descriptors) violated(fmt::format("{} descriptors are open", open));
        if (process.heap.size() > most_blocks)
            violated(fmt::format("{} blocks of memory are in use", process.heap.size()));
        if (of_.time.threads().size() > most_threads)
            violated(fmt::format("{} threads", of_.time.threads().size()));
    }

  private:
    static constexpr std::ptrdiff_t most_descriptors = 20;
    static constexpr std::size_t most_blocks = 6, most_threads = 12;
    std::uint64_t exchanges_ = 0;
};

// Whoever reads statistics, snapshot or state sees a daemon that works: no reader of the log, no
// PLC, no file to come and nothing that a crash left holds the thread that writes them.
class fresh_invariant : public invariant {
  public:
    explicit fresh_invariant(run &of)
        : invariant(of, "fresh"),
          judged_(!draws_any(
              of, {fault_kind::disk, fault_kind::refuse, fault_kind::stall, fault_kind::suspend,
                   fault_kind::links, fault_kind::partial, fault_kind::boundary})) {}
    void started() override {
        written_ns_ = {{run::stats_path, of_.time.now()}, {run::state_path, of_.time.now()}};
        if (of_.keeps_snapshot()) written_ns_[run::snapshot_path] = of_.time.now();
    }
    void file_written(const std::string &path, const node &) override {
        const auto found = written_ns_.find(path);
        if (found != written_ns_.end()) found->second = of_.time.now();
    }
    void ticked() override {
        for (const auto &[path, at_ns] : written_ns_)
            if (judged_ && of_.time.now() - at_ns > most)
                violated(fmt::format("{} is {} s old", path, (of_.time.now() - at_ns) / second));
    }

  private:
    static constexpr time_ns most = 20 * second;  // the box: state every 10 s, statistics 5 s
    bool judged_;
    std::map<std::string, time_ns> written_ns_;
};

// What the statistics and the snapshot say is true: a box that is ACTIVE writes.
class report_invariant : public invariant {
  public:
    explicit report_invariant(run &of)
        : invariant(of, "report"),
          lag_ns_(longest_lag(of)),
          judged_(
              lag_ns_ != never &&
              !draws_any(of, {fault_kind::loss, fault_kind::reset, fault_kind::tear,
                              fault_kind::wire, fault_kind::partial, fault_kind::refuse,
                              fault_kind::plc_stop, fault_kind::boundary, fault_kind::memory})) {}
    void started() override {
        written_ns_ = of_.time.now();
        claimed_ns_.clear();
    }
    void exchanged(const exchange &seen) override {
        if (!seen.written.empty()) started();
    }
    void shown(const nlohmann::json &all) override { hear(run::snapshot_path, all); }
    void reported(const nlohmann::json &all) override { hear(run::stats_path, all); }
    // A box that has just found its PLC writes in the next cycle.
    void ticked() override {
        for (const auto &[path, at_ns] : claimed_ns_) judge(of_.time.now() - at_ns);
    }

  private:
    void hear(const std::string &path, const nlohmann::json &all) {
        if (!judged_ || of_.time.now() - written_ns_ < most + lag_ns_) return;
        // A disk that hangs may delay a file; the next one then corrects it at once.
        if (all.value("mode", "") == "ACTIVE")
            claimed_ns_.emplace(path, of_.time.now());
        else
            claimed_ns_.erase(path);
    }
    void judge(time_ns since_ns) {
        if (since_ns > 10 * of_.running().period_us * us + lag_ns_)
            violated(fmt::format("a file had ACTIVE {} ms ago, and the PLC got no write for {} ms",
                                 since_ns / ms, (of_.time.now() - written_ns_) / ms));
    }

    static constexpr time_ns most = 2 * second;  // the box: 4.5 periods, and what a file takes
    time_ns lag_ns_;
    bool judged_;
    time_ns written_ns_ = 0;
    std::map<std::string, time_ns> claimed_ns_;  // by file, since when it has ACTIVE
};

// A PLC that answers readings alone is not connected to again and again without a pause, nor is an
// adapter that is away opened again and again.
class reconnect_invariant : public invariant {
  public:
    explicit reconnect_invariant(run &of) : invariant(of, "reconnects") {}
    void started() override {
        begin();
        begin_lines();
    }
    void ticked() override {
        const time_ns elapsed_ns = of_.time.now() - lines_since_ns_;
        if (elapsed_ns < window) return;
        if (refused() - refused_ > most_refused + 2 * elapsed_ns / second &&
            !draws_any(of_, {fault_kind::reload, fault_kind::hostile}))  // which start a bus again
            violated(fmt::format("adapters that are away are opened {} times in {} s",
                                 refused() - refused_, elapsed_ns / second));
        begin_lines();
    }
    void exchanged(const exchange &seen) override {
        if (seen.function != 3 && seen.duration != never) begin();
        const time_ns elapsed_ns = of_.time.now() - since_ns_;
        if (elapsed_ns < window) return;
        const int made = of_.plc.connections_made() - made_;
        if (made > most + elapsed_ns / second)
            violated(fmt::format("{} connections in {} s, and no write had a reply", made,
                                 elapsed_ns / second));
        begin();
    }

  private:
    void begin() {
        made_ = of_.plc.connections_made();
        since_ns_ = of_.time.now();
    }
    int refused() const {
        int all = 0;
        for (const auto *line : {of_.plc_line.get(), of_.bus_line.get()})
            all += line == nullptr ? 0 : line->refused;
        return all;
    }
    void begin_lines() {
        refused_ = refused();
        lines_since_ns_ = of_.time.now();
    }
    static constexpr int most_refused = 16;  // of two lines, with pauses as those of a connection
    int refused_ = 0;
    time_ns lines_since_ns_ = 0;
    static constexpr time_ns window = 5 * second;
    static constexpr int most = 8;  // the box: with pauses from 50 ms to 1 s; then one a second
    int made_ = 0;
    time_ns since_ns_ = 0;
};

// A box whose configuration changed in memory writes and reads nothing more (docs/faults.md, reason
// 17): at once where each step checks it, else behind two passes over all of it.
class memory_invariant : public invariant {
  public:
    explicit memory_invariant(run &of)
        : invariant(of, "memory"),
          lag_ns_(longest_lag(of)),
          judged_(lag_ns_ != never && !draws_any(of, {fault_kind::reload, fault_kind::hostile})) {}
    void exchanged(const exchange &seen) override {
        if (judged_ && of_.flipped_at_step < of_.steps_of_daemon &&
            of_.steps_of_daemon - of_.flipped_at_step > 2 * pass_steps + 2)
            violated(fmt::format("an exchange {} steps after the configuration changed in memory",
                                 of_.steps_of_daemon - of_.flipped_at_step));
        if (!judged_ || of_.flipped_ns == never) return;
        const time_ns after_ns = seen.sent - of_.flipped_ns;
        if (after_ns > 3 * of_.running().period_us * us + lag_ns_)
            violated(fmt::format(
                "an exchange {} ms after a word that each step checks changed in memory",
                after_ns / ms));
    }

  private:
    // Of the check of all of it, at most (firmware/box/box.h); the next one finds what was behind
    // it.
    static constexpr std::uint64_t pass_steps = 800;
    time_ns lag_ns_;
    bool judged_;
};

// No thread works without a pause. Calls that fail at once, as a sleep that each signal ends, come
// again at once.
class calm_invariant : public invariant {
  public:
    explicit calm_invariant(run &of)
        : invariant(of, "calm"),
          judged_(!draws_any(of, {fault_kind::refuse, fault_kind::partial})) {}
    void started() override { begin(); }
    void ticked() override {
        if (of_.time.now() - since_ns_ < second) return;
        const double seconds = 1e-9 * static_cast<double>(of_.time.now() - since_ns_);
        const double calls = static_cast<double>(of_.box.calls - calls_);
        if (judged_ && calls > most * seconds)
            violated(fmt::format("{:.0f} calls in {:.1f} s", calls, seconds));
        begin();
    }

  private:
    static constexpr double most = 12000;  // a second; half of all seconds have about 1800
    void begin() {
        since_ns_ = of_.time.now();
        calls_ = of_.box.calls;
    }
    bool judged_;
    time_ns since_ns_ = 0;
    std::uint64_t calls_ = 0;
};

// Ticks are never made up for: from a write to the one two steps later is at least a period. FC23
// has the outputs of the step before, and sends none of before a suspend.
class tick_invariant : public invariant {
  public:
    explicit tick_invariant(run &of) : invariant(of, "tick") {}
    void started() override {
        known_ = 0;
        waits_ns_ = never;
    }
    void ticked() override {
        if (waits_ns_ != never && of_.steps_of_daemon == steps_) return;  // the same wait again
        steps_ = of_.steps_of_daemon;
        waits_ns_ = of_.time.now();
    }
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const machine &facts = of_.author_of(seen);
        const time_ns old_ns = waits_ns_ == never ? 0 : seen.sent - waits_ns_;
        if (seen.function == 23 && old_ns > (most_periods + 2) * facts.period_us * us)
            violated(fmt::format("outputs of a step more than {} ms ago are sent", old_ns / ms));
        const written_block &block = block_of(facts, seen);
        if (known_ > 0 && block.heartbeat == beat_[0]) return;
        const auto beats = static_cast<std::uint16_t>(block.heartbeat - beat_[1]);
        if (known_ > 1 && beats == 2 && seen.sent > sent_[0]) {
            const time_ns least = facts.period_us * us * 9 / 10;
            if (seen.sent - sent_[1] < least)
                violated(fmt::format("two steps within {} µs", (seen.sent - sent_[1]) / us));
        }
        beat_[1] = beat_[0];
        sent_[1] = sent_[0];
        beat_[0] = block.heartbeat;
        sent_[0] = seen.sent;
        known_ = std::min(known_ + 1, 2);
    }

  private:
    static constexpr time_ns most_periods = 5;
    int known_ = 0;
    std::uint64_t steps_ = 0;   // of this daemon, when …
    time_ns waits_ns_ = never;  // … it began to wait for its next tick
    std::uint16_t beat_[2] = {0, 0};
    time_ns sent_[2] = {0, 0};
};

// Periods that are missed again and again are FAULT, and none is ACTIVE behind it (docs/faults.md,
// reason 19). The score here counts those misses alone that are certain: one for a step, however
// often the wait before it had to be repeated. A few that are possible make no FAULT.
class overrun_invariant : public invariant {
  public:
    explicit overrun_invariant(run &of) : invariant(of, "overrun") {}
    void started() override {
        forget();
        possible_ = 0;
        in_fault_ = false;
    }
    void ticked() override {
        const time_ns period_ns = of_.running().period_us * us, now = of_.time.now();
        possible_ += possibly_ns_ == never || now - possibly_ns_ > period_ns * 101 / 100;
        possibly_ns_ = now;
        if (of_.steps_of_daemon == steps_ && ticked_ns_ != never) return;
        steps_ = of_.steps_of_daemon;
        const bool missed = ticked_ns_ != never && now - ticked_ns_ > period_ns * 21 / 10;
        ticked_ns_ = now;
        if (missed) {
            score_ = std::min(score_ + 1, fault_score);
            good_ = 0;
        } else if (++good_ >= 32) {
            score_ = std::max(score_ - 1, 0);
            good_ = 0;
        }
        if (score_ < fault_score) full_ns_ = never;
        if (score_ >= fault_score && full_ns_ == never) full_ns_ = now;
    }
    void exchanged(const exchange &seen) override {
        if (seen.written.empty() || seen.sent < sent_ns_) return;
        sent_ns_ = seen.sent;
        const machine &facts = of_.author_of(seen);
        const unsigned mode = block_of(facts, seen).mode;
        if (mode == fakeplc::box_mode::fault) forget();  // the box: behind a fault of any reason
        judge_few(block_of(facts, seen));
        if (full_ns_ == never) return;
        const bool behind = seen.sent > full_ns_ + 4 * facts.period_us * us;
        if (mode == fakeplc::box_mode::active && behind && !unknown())
            violated(fmt::format("ACTIVE, although the overrun score is {}", score_));
    }

  private:
    void forget() {
        score_ = good_ = 0;
        ticked_ns_ = full_ns_ = never;
    }
    void judge_few(const written_block &block) {
        const bool fault = block.mode == fakeplc::box_mode::fault;
        if (fault && !in_fault_ && block.reason == box_reason::overrun && possible_ < few &&
            !draws_any(of_, {fault_kind::suspend, fault_kind::reload, fault_kind::hostile,
                             fault_kind::memory, fault_kind::wire, fault_kind::line}))
            violated(
                fmt::format("FAULT by missed periods, and {} may have been missed", possible_));
        if (fault) possible_ = 0;
        in_fault_ = fault;
    }
    // A FAULT that the PLC refuses to take is not seen here, and clears the score.
    bool unknown() const { return draws_any(of_, {fault_kind::suspend, fault_kind::exception}); }
    static constexpr int fault_score = 18;  // the box: 16
    static constexpr int few = 12;
    std::uint64_t steps_ = 0;  // of this daemon
    time_ns sent_ns_ = 0;      // the newest write
    int score_ = 0, good_ = 0;
    int possible_ = 0;  // periods that may have been missed since the start or the last FAULT
    bool in_fault_ = false;
    time_ns ticked_ns_ = never, full_ns_ = never, possibly_ns_ = never;
};

}  // namespace

void add_process(run &of, invariants &all) {
    all.push_back(std::make_unique<exit_invariant>(of));
    all.push_back(std::make_unique<service_invariant>(of));
    all.push_back(std::make_unique<resources_invariant>(of));
    all.push_back(std::make_unique<memory_invariant>(of));
    all.push_back(std::make_unique<fresh_invariant>(of));
    all.push_back(std::make_unique<report_invariant>(of));
    all.push_back(std::make_unique<reconnect_invariant>(of));
    all.push_back(std::make_unique<tick_invariant>(of));
    all.push_back(std::make_unique<calm_invariant>(of));
    all.push_back(std::make_unique<overrun_invariant>(of));
}

}  // namespace compbox::world
