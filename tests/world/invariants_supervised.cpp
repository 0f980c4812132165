// SPDX-License-Identifier: MIT
// Messages to systemd, feeds of the hardware watchdog, and the mode in the status and in the log
// (docs/compboxd.md, "Watchdogs").
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <map>
#include <regex>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

// Cycles complete at their time, and so do the calls of the threads beside them.
bool is_regular(const run &of) {
    return longest_lag(of) == 0 && !draws_any(of, {fault_kind::suspend, fault_kind::partial,
                                                   fault_kind::stall, fault_kind::disk});
}

// Whether this start of the daemon has systemd as its supervisor.
bool is_a_service(const run &of) {
    return of.box.environment.count("NOTIFY_SOCKET") > 0 && !draws(of, fault_kind::refuse);
}

// The hardware watchdog and systemd are fed by completed cycles alone, and READY waits for one.
// systemd gets one at half of its time-out, or soon behind one that was refused. Whoever ends as
// asked leaves the hardware watchdog disarmed.
class watchdog_invariant : public invariant {
  public:
    explicit watchdog_invariant(run &of) : invariant(of, "watchdog") {}
    void started() override {
        fed_ = {};
        first_ns_ = ready_ns_ = never;
    }
    void ticked() override {
        const time_ns now = of_.time.now();
        fed_[0].since_tick = fed_[1].since_tick = 0;
        if (first_ns_ == never) first_ns_ = fed_[0].at_ns = fed_[1].at_ns = now;
        if (is_regular(of_)) judge_silence(now);
    }
    void supervised(const std::string &words) override {
        if (words == "READY=1" && first_ns_ == never)
            violated("systemd hears READY before the first tick, let alone a cycle");
        if (words == "READY=1") ready_ns_ = of_.time.now();
        if (!words.empty() && words != "WATCHDOG=1" && words != "V") return;
        feeding &who = fed_[words == "WATCHDOG=1"];
        const time_ns since_ns = of_.time.now() - who.at_ns,
                      due_ns = std::max(who.at_ns + run::systemd_waits / 2, of_.box.unheard_ns);
        who.at_ns = of_.time.now();
        if (words == "WATCHDOG=1" && who.armed && is_regular(of_) &&
            of_.time.now() - due_ns > second)
            violated(
                fmt::format("systemd is fed {} ms behind the last time, and its time-out is {}"
                            " ms",
                            since_ns / ms, run::systemd_waits / ms));
        who.armed = words != "V";
        // A cycle may end between a feed and the wait for the next tick.
        if (who.armed && ++who.since_tick > 2)
            violated(fmt::format("{} is fed again, and no cycle has ended",
                                 words.empty() ? "the watchdog" : "systemd"));
    }
    void ended(const ending &how) override {
        const bool refuses = draws_any(of_, {fault_kind::refuse, fault_kind::partial});
        if (!how.by_signal && how.code == 0 && fed_[0].armed && !refuses)
            violated("the daemon ended with 0, and the hardware watchdog is armed");
    }

  private:
    // Cycles end, and nobody hears of it.
    void judge_silence(time_ns now) {
        if (of_.has_watchdog() && !draws(of_, fault_kind::refuse) &&
            now - fed_[0].at_ns > run::watchdog_waits / 2)
            violated(fmt::format("the watchdog is not fed for {} ms", (now - fed_[0].at_ns) / ms));
        if (!is_a_service(of_)) return;
        if (ready_ns_ == never && now - std::max(first_ns_, of_.box.unheard_ns) > second)
            violated(fmt::format("cycles for {} ms, and systemd has not heard READY",
                                 (now - first_ns_) / ms));
        if (now - std::max(fed_[1].at_ns, of_.box.unheard_ns) > run::systemd_waits / 2 + second)
            violated(fmt::format("systemd is not fed for {} ms", (now - fed_[1].at_ns) / ms));
    }
    struct feeding {
        bool armed = false;
        int since_tick = 0;
        time_ns at_ns = 0;
    };
    std::array<feeding, 2> fed_;  // the hardware, systemd
    time_ns first_ns_ = never;    // tick
    time_ns ready_ns_ = never;
};

// What `systemctl status` shows is the mode, reason and revision of the writes, and each reason has
// its own words. The newest line of the log about the mode has the same. Who stops has told systemd
// for how long at most.
class service_status_invariant : public invariant {
  public:
    explicit service_status_invariant(run &of) : invariant(of, "service-status") {}
    void started() override {
        told_ = line_ = {};
        since_ns_ = asked_ns_ = stopping_ns_ = never;
    }
    void ticked() override {
        if (of_.asked_to_stop && asked_ns_ == never) asked_ns_ = of_.time.now();
    }
    void exchanged(const exchange &seen) override {
        if (seen.written.empty() || !is_regular(of_)) return;
        const machine &author = of_.author_of(seen);
        const written_block &block = block_of(author, seen);
        const state is = {block.mode, block.reason, author.revision};
        // Who sends nothing may have another state in between.
        if (since_ns_ == never || is != is_ || seen.sent - sent_ns_ > second / 2)
            since_ns_ = seen.sent;
        is_ = is;
        sent_ns_ = seen.sent;
        const time_ns stands_ns = seen.sent - std::max(since_ns_, of_.box.unheard_ns);
        if (is_a_service(of_) && stands_ns > settled && told_.is_old(seen.sent)) judge();
        const bool reads = !line_.words.empty() && !draws(of_, fault_kind::reader);
        // One that was left out comes when the mode is quiet again.
        if (reads && stands_ns > settled && seen.sent - line_.at > settled) judge_line();
    }
    void supervised(const std::string &words) override {
        if (words.rfind("STATUS=", 0) == 0) told_ = {words.substr(7), of_.time.now()};
        if (words.rfind("STOPPING=1\nEXTEND_TIMEOUT_USEC=", 0) != 0) return;
        stopping_ns_ = of_.time.now();
        most_ns_ = std::stoll(words.substr(words.rfind('=') + 1)) * us;
        // One whose memory is not sound writes nothing any more.
        const bool moves = since_ns_ != never && !draws(of_, fault_kind::memory);
        const time_ns away_ns = ramp_ns(of_.running(), 0);
        if (moves && is_regular(of_) && stopping_ns_ - taken_ns_ > second && most_ns_ < away_ns)
            violated(fmt::format("it promises to stop within {} ms, and zero is {} ms away",
                                 most_ns_ / ms, away_ns / ms));
    }
    void taken(const machine &, const machine &) override { taken_ns_ = of_.time.now(); }
    void logged(const std::string &line) override {
        static const std::regex about_mode(R"( (STANDBY|ACTIVE|HOLD|RAMP|FAULT|STOPPED): .*$)");
        std::smatch found;
        if (std::regex_search(line, found, about_mode))
            line_ = {found.str().substr(1), of_.time.now()};
        if (line.find("about the mode left out") != std::string::npos) line_ = {};
    }
    void ended(const ending &how) override {
        const time_ns now = of_.time.now();
        if (how.by_signal || asked_ns_ == never || !is_a_service(of_) || !is_regular(of_)) return;
        if (stopping_ns_ == never && now - std::max(asked_ns_, of_.box.unheard_ns) > second / 5)
            violated("the daemon stopped, and has not told systemd");
        if (stopping_ns_ != never && now - stopping_ns_ > most_ns_)
            violated(fmt::format("the daemon stopped within {} ms, and promised {}",
                                 (now - stopping_ns_) / ms, most_ns_ / ms));
    }

  private:
    struct state {
        unsigned mode = 0, reason = 0, revision = 0;
        bool operator!=(const state &other) const {
            return std::tie(mode, reason, revision) !=
                   std::tie(other.mode, other.reason, other.revision);
        }
    };
    // The newest words, which may be of a block that has yet to come if they are not old.
    struct claim {
        std::string words;
        time_ns at = -never / 2;
        bool is_old(time_ns now) const { return now - at > second; }
    };
    void judge() {
        const std::string &words = told_.words;
        const std::size_t mode_ends = words.find(": "), reason_ends = words.find("; revision ");
        if (mode_ends == std::string::npos || reason_ends == std::string::npos)
            return violated(fmt::format("systemd's status is \"{}\"", words));
        judge_mode("systemd's status", words.substr(0, mode_ends));
        if (std::stoul(words.substr(reason_ends + 11)) != is_.revision)
            violated(fmt::format("systemd's status is \"{}\", and the revision {}", words,
                                 is_.revision));
        const std::string reason = words.substr(mode_ends + 2, reason_ends - mode_ends - 2);
        if (reasons_.emplace(reason, is_.reason).first->second != is_.reason)
            violated(fmt::format("systemd's status is \"{}\" for the reasons {} and {}", words,
                                 reasons_[reason], is_.reason));
    }
    void judge_line() {
        judge_mode("the newest line of the log", line_.words.substr(0, line_.words.find(':')));
        const auto is_known = [this](const auto &one) { return one.second == is_.reason; };
        const auto known = std::find_if(reasons_.begin(), reasons_.end(), is_known);
        const std::size_t reason = line_.words.find(": ") + 2;
        if (known != reasons_.end() && line_.words.rfind(known->first, reason) != reason)
            violated(fmt::format("the newest line of the log is \"{}\" for \"{}\"", line_.words,
                                 known->first));
    }
    void judge_mode(const char *where, const std::string &is) {
        const char *const stated = fakeplc::box_mode::name_of(is_.mode);
        if (is != stated)
            violated(fmt::format("{} has {}, and the PLC has had {} for {} ms", where, is, stated,
                                 settled / ms));
    }

    static constexpr time_ns settled = 3 * second;
    claim told_;                               // to systemd, without `STATUS=`
    claim line_;                               // of the log
    std::map<std::string, unsigned> reasons_;  // by their words
    state is_;                                 // of the newest write, …
    time_ns sent_ns_ = 0, since_ns_ = never;   // … and since when all have it
    time_ns asked_ns_ = never, stopping_ns_ = never, most_ns_ = 0;
    time_ns taken_ns_ = -never / 2;  // the newest file
};

}  // namespace

void add_supervised(run &of, invariants &all) {
    all.push_back(std::make_unique<watchdog_invariant>(of));
    all.push_back(std::make_unique<service_status_invariant>(of));
}

}  // namespace compbox::world
