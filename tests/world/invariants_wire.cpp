// SPDX-License-Identifier: MIT
// The wire to the PLC: what the box sends when, and that its counters are those of the wire
// (docs/rtu.md, hal/linux/tcp.h).
#include <fmt/core.h>

#include <algorithm>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

// By TCP one request is pending at a time. On a serial line nothing but a probe follows a request
// without a reply, until a probe has one; a damaged reading is repeated at once.
class order_invariant : public invariant {
  public:
    explicit order_invariant(run &of)
        : invariant(of, "order"),
          judged_(!draws_any(of, {fault_kind::partial, fault_kind::refuse})) {}
    void started() override { doubt_ = true; }
    void asked(const question &now) override {
        if (!judged_) return;
        if (longest_lag(of_) == 0 && (now.is_reading || now.is_probe)) judge_reading(now);
        if (!now.on_line) {
            // A request whose length has changed on the wire may be two.
            if (!now.first && !now.settled && !draws(of_, fault_kind::wire))
                violated("a request is sent before the reply to the one before it");
            return;
        }
        if (now.first || !now.settled) doubt_ = true;
        if (now.settled && now.was_probe) doubt_ = false;
        if (doubt_ && !now.is_probe)
            violated("a request is sent, and an earlier one may still have its reply");
        if (now.was_damaged_reading && !now.was_probe && !now.is_the_same && !now.is_probe &&
            has_time())
            violated("a reading is not repeated, and its reply had a wrong check sum");
    }

  private:
    // out: what is left of the time of a cycle's exchange, four fifths of the period
    time_ns left_ns() const {
        return began_ns_ + of_.running().period_us * us * 4 / 5 - of_.time.now();
    }
    // out: how long a repeated reading and the write behind it may take, by the longest time of a
    //      slave (docs/rtu.md)
    time_ns takes_ns() const {
        const nlohmann::json &plc = of_.running().file().at("plc");
        const std::int64_t registers = plc.at("read").value("count", std::int64_t{0}) +
                                       plc.at("write").value("count", std::int64_t{0}),
                           characters = 8 + 5 + 9 + 8 + 2 * registers;
        const double delay_ms = plc.at("transport").at("rtu").value("slave_delay_ms", 2.0);
        constexpr time_ns lumps = 6 * ms;  // in which the bytes of the reading may come
        return of_.plc_line->character() * characters * 10 / 11 + 3 * of_.plc_line->silence() +
               lumps + static_cast<time_ns>(2e6 * delay_ms);
    }
    // Beside slow threads there may be none.
    bool has_time() const { return longest_lag(of_) == 0 && left_ns() > takes_ns() + 6 * ms; }

    void judge_reading(const question &now) {
        // A damaged reply that was late too is not known as one here: soon behind it comes a
        // repetition.
        const bool is_soon = 2 * (of_.time.now() - began_ns_) < of_.running().period_us * us;
        const bool is_next = !is_soon && now.settled && !now.was_probe && !now.was_damaged_reading;
        if (left_ns() < 0 || is_next) {
            began_ns_ = of_.time.now();
            readings_ = 0;
        }
        if (now.is_probe || ++readings_ == 1 || of_.running().fc23) return;
        if (takes_ns() > left_ns() + ms)
            violated(fmt::format(
                "a reading is repeated {} ms before its exchange ends, and takes {} ms with the "
                "write behind it",
                left_ns() / ms, takes_ns() / ms));
    }
    bool judged_;
    bool doubt_ = true;              // of a serial line
    time_ns began_ns_ = -never / 2;  // the first reading or probe of this cycle
    int readings_ = 0;
};

// Before a request a serial line is silent for long enough for a slave to know where it begins. A
// box that opens its device again does not know when its last request ends.
class gap_invariant : public invariant {
  public:
    explicit gap_invariant(run &of)
        : invariant(of, "gap"),
          judged_(!draws_any(of, {fault_kind::partial, fault_kind::refuse})) {}
    void line_asked(time_ns quiet, time_ns silence) override {
        if (judged_ && quiet < silence)
            violated(
                fmt::format("a request is sent {} µs behind the last byte, a frame ends with "
                            "{} µs of silence",
                            quiet / us, silence / us));
    }

  private:
    bool judged_;
};

// The statistics of a daemon that ended agree with what the calls and the wire say. A PLC that
// answers each request, if late, keeps its connection.
class account_invariant : public invariant {
  public:
    explicit account_invariant(run &of)
        : invariant(of, "account"), by_tcp_(of.box_machine.plc_device.empty()) {}
    void started() override {
        sent_ = sent_at_tick_ = of_.box.tcp_sent;
        asking_cycles_ = 0;
        ended_ = of_.box.tcp_ended;
        start_ns_ = of_.time.now();
        connections_ = of_.plc.connections_made();
        closed_unasked_ = of_.net.closed_unasked;
        unheard_ = stopped_ = halves_ = 0;
        readings_ = writes_ = 0;
        silences_ = silent_ = 0;
        answered_ = true;
    }
    void asked(const question &of) override {
        if (of.on_line) return;
        end_question();
        if (of.first) silent_ = 0;
        answered_ = false;
    }
    void exchanged(const exchange &seen) override {
        const bool own = !seen.written.empty() && seen.sent >= start_ns_;
        unheard_ += own && seen.duration == never;
        // A box takes what comes within four fifths of its period, in two requests.
        const time_ns period_ns = of_.running_at(seen.sent).period_us * us;
        answered_ = answered_ || seen.duration < period_ns / 4;
        note_proof(seen);
    }
    void reply_torn(time_ns rest) override {
        const time_ns period_ns = of_.running().period_us * us;
        stopped_ += rest > period_ns + 15 * ms && rest < 2 * period_ns;
        const time_ns deadline_ns = of_.ticked_ns() + 3 * period_ns / 4;
        halves_ += rest > 9 * ms && of_.time.now() + rest > deadline_ns;
    }
    void ended(const ending &how) override {
        if (how.by_signal || how.code != 0 || draws(of_, fault_kind::memory)) return;
        const auto all = finished_statistics();
        if (!by_tcp_) return;
        if (!all.is_null()) {
            judge_tcp(all.at("plc"), all.at("box"));
            judge_times(all);
        }
        judge_connections();
    }
    void ticked() override {
        asking_cycles_ += std::exchange(sent_at_tick_, of_.box.tcp_sent) != of_.box.tcp_sent;
        judge_unasked();
        const time_ns idle_ns = of_.time.now() - of_.net.closed_ns;
        if (!by_tcp_ || of_.net.open > 0 || longest_lag(of_) != 0 || draws(of_, fault_kind::memory))
            return;
        if (of_.time.now() - start_ns_ > most_idle && idle_ns > most_idle)
            violated(fmt::format("no connection is begun for {} ms", idle_ns / ms));
        if (idle_ns > longest_start && of_.net.attempts == attempt_ && is_proven())
            violated(
                fmt::format("a connection with {} readings and {} writes is lost, and none is "
                            "begun for {} ms",
                            readings_, writes_, idle_ns / ms));
    }

  private:
    // The cycle that finds a connection up asks on it.
    void judge_unasked() {
        const bool gave_up =
            std::exchange(closed_unasked_, of_.net.closed_unasked) != of_.net.closed_unasked;
        if (!by_tcp_ ||
            draws_any(of_, {fault_kind::memory, fault_kind::refuse, fault_kind::partial}))
            return;
        if (gave_up && !of_.stop_asked)
            violated("a connection is given up on which nothing was sent");
        const time_ns idle_ns = of_.time.now() - of_.net.unasked_ns;  // below 0: there is none
        if (longest_lag(of_) == 0 && idle_ns > 2 * of_.running().period_us * us)
            violated(
                fmt::format("nothing is sent on a connection that is up for {} ms", idle_ns / ms));
    }
    // A connection that had replies to both is begun again at once (docs/compboxd.md).
    void note_proof(const exchange &seen) {
        if (std::exchange(attempt_, of_.net.attempts) != of_.net.attempts) readings_ = writes_ = 0;
        if (seen.duration == never || seen.sent < start_ns_) return;
        readings_ += is_reading(of_.running_at(seen.sent), seen);
        writes_ += !seen.written.empty();
    }
    bool is_proven() const {
        return std::min(readings_, writes_) > 3 &&
               !draws_any(
                   of_, {fault_kind::loss, fault_kind::wire, fault_kind::tear, fault_kind::partial,
                         fault_kind::refuse, fault_kind::twice, fault_kind::stray, fault_kind::mute,
                         fault_kind::hostile, fault_kind::reload, fault_kind::boundary});
    }
    // Behind each third request in a row without a reply the connection is given up.
    void end_question() {
        silent_ = std::exchange(answered_, true) ? 0 : silent_ + 1;
        if (silent_ < 3) return;
        ++silences_;
        silent_ = 0;
    }
    // out: the box takes each reply that was sent at once
    bool hears_replies() const {
        return longest_lag(of_) == 0 &&
               !draws_any(of_, {fault_kind::wire, fault_kind::tear, fault_kind::partial,
                                fault_kind::twice, fault_kind::stray, fault_kind::hostile,
                                fault_kind::boundary, fault_kind::suspend});
    }
    // Where nothing else ends it.
    void judge_connections() {
        const int made = of_.plc.connections_made() - connections_;
        if (made > 1 && of_.running().fc23 &&
            !draws_any(of_, {fault_kind::delay,     fault_kind::preempt, fault_kind::disk,
                             fault_kind::stall,     fault_kind::suspend, fault_kind::loss,
                             fault_kind::reset,     fault_kind::tear,    fault_kind::twice,
                             fault_kind::exception, fault_kind::refuse,  fault_kind::partial,
                             fault_kind::wire,      fault_kind::foreign, fault_kind::plc_stop,
                             fault_kind::stray,     fault_kind::mute,    fault_kind::reload,
                             fault_kind::hostile,   fault_kind::memory,  fault_kind::boundary}))
            violated(fmt::format("{} connections to a PLC that answers each request", made));
    }
    void judge_tcp(const nlohmann::json &plc, const nlohmann::json &box) {
        const std::uint64_t sent = of_.box.tcp_sent - sent_, ended = of_.box.tcp_ended - ended_;
        const auto requests = plc.value("requests", std::uint64_t{0});
        if (requests != sent) violated(fmt::format("requests is {}, {} were sent", requests, sent));
        std::uint64_t failures = 0;
        for (const char *counter : {"timeouts", "blocked", "invalid_replies", "wrong_ids"})
            failures += plc.value(counter, std::uint64_t{0});
        const auto given_up = plc.value("given_up", std::uint64_t{0});
        if (3 * given_up > failures)
            violated(fmt::format("{} connections are given up behind {} exchanges that failed",
                                 given_up, failures));
        // Bits flip now and then: of three failures in a row one is an invalid reply at most.
        const auto invalid = plc.value("invalid_replies", std::uint64_t{0});
        if (2 * given_up > failures - invalid &&
            !draws_any(of_, {fault_kind::stray, fault_kind::mute}))
            violated(
                fmt::format("{} connections are given up behind {} invalid replies and {} "
                            "other failures",
                            given_up, invalid, failures - invalid));
        end_question();
        if (hears_replies() && given_up > silences_ && plc.value("blocked", 0u) == 0)
            violated(
                fmt::format("{} connections are given up, and {} times three requests in a "
                            "row had no reply",
                            given_up, silences_));
        const auto lost = plc.value("closed_by_peer", std::uint64_t{0}) +
                          plc.value("socket_errors", std::uint64_t{0});
        if (lost > ended)
            violated(fmt::format("closed_by_peer and socket_errors are {}, {} calls said so", lost,
                                 ended));
        // The last one may be unread.
        at_least("writes_unknown", box, unheard_ - std::min<std::uint64_t>(unheard_, 1));
        const bool reads_on =
            longest_lag(of_) == 0 && !draws_any(of_, {fault_kind::loss, fault_kind::reset,
                                                      fault_kind::plc_stop, fault_kind::wire});
        if (!reads_on) return;
        at_least("incomplete_replies", plc, stopped_ - std::min(stopped_, given_up));
        const auto incomplete = plc.value("incomplete_replies", std::uint64_t{0});
        if (incomplete > halves_)
            violated(fmt::format("incomplete_replies is {}, and {} stood still for 10 ms",
                                 incomplete, halves_));
    }
    // Each cycle with a request has its time, be its reply in time or not.
    void judge_times(const nlohmann::json &all) {
        constexpr std::uint64_t few = 2;  // requests sent in part, or in the last cycle
        const auto count = all.at("exchange_us").value("count", std::uint64_t{0});
        const auto lost = all.value("rows_lost", std::uint64_t{0});
        if (count + lost + few < asking_cycles_)
            violated(fmt::format("exchange_us has {} cycles, and {} had a request", count,
                                 asking_cycles_));
    }
    void at_least(const char *counter, const nlohmann::json &of, std::uint64_t happened) {
        const auto counted = of.value(counter, std::uint64_t{0});
        if (counted < happened)
            violated(fmt::format("{} is {}, it happened {} times", counter, counted, happened));
    }

    static constexpr time_ns longest_start = 15 * ms;
    static constexpr time_ns most_idle = 4 * second;  // the box: a pause of one, an attempt of one
    std::uint64_t closed_unasked_ = 0;
    bool by_tcp_;
    time_ns start_ns_ = 0;
    int connections_ = 0;  // before this daemon
    // Requests at the newest tick, and cycles of this daemon that had one.
    std::uint64_t sent_at_tick_ = 0, asking_cycles_ = 0;
    // Before this daemon.
    std::uint64_t sent_ = 0, ended_ = 0;
    // Of this daemon: writes that acted without a reply, replies that stood still in the middle.
    std::uint64_t unheard_ = 0, stopped_ = 0;
    std::uint64_t halves_ = 0;  // replies whose rest came late enough to end the connection
    // Of this daemon: three requests in a row without a reply; those in a row now; the newest one.
    std::uint64_t silences_ = 0, silent_ = 0;
    bool answered_ = true;
    // Of the newest connection: its number, and what was answered on it.
    std::uint64_t attempt_ = 0, readings_ = 0, writes_ = 0;
};

time_ns module_period(const run &of) {
    return of.box_machine.file().at("buses").at(0).at("every_ms").get<time_ns>() * ms;
}

// A module of the bus is asked each `every_ms`. Each turn without a reply doubles its pause, up to
// 32 times it; one reply ends that (docs/coefficient-file.md).
class pace_invariant : public invariant {
  public:
    explicit pace_invariant(run &of)
        : invariant(of, "pace"), judged_(!of.box_machine.modules.empty() && is_steady(of)) {
        if (judged_) every_ns_ = module_period(of);
    }
    void started() override {
        modules_.clear();
        left_alone_ns_.clear();
    }
    void module_asked(const module_turn &turn, const module_reply &before) override {
        if (!judged_) return;
        const time_ns now = of_.time.now();
        if (before.none) {
            modules_.clear();
            left_alone_ns_.clear();
        }
        if (!modules_.empty() && before.prompt) modules_[asked_].silent = 0;
        if (!modules_.empty() && !before.heard)
            left_alone_ns_[asked_.unit] = modules_[asked_].asked_ns;
        judge_left_alone(turn, now);
        const auto found = modules_.find(turn);
        if (found != modules_.end()) {
            const time_ns pause = now - found->second.asked_ns;
            // Each turn without a reply lets the other one of its module wait too.
            const auto of_unit =
                std::count_if(modules_.begin(), modules_.end(),
                              [&turn](const auto &one) { return one.first.unit == turn.unit; });
            if (pause >
                (every_ns_ << found->second.silent) + 3 * (of_unit - 1) * every_ns_ + second)
                violated(
                    fmt::format("module {} is asked after {} ms, behind {} turns without a "
                                "reply",
                                turn.unit, pause / ms, found->second.silent));
        }
        module &one = modules_[turn];
        one.silent = std::min(one.silent + 1, most_silent);
        one.asked_ns = now;
        asked_ = turn;
    }

  private:
    // A reply that is late must not pass for that of another block of its module.
    void judge_left_alone(const module_turn &turn, time_ns now) {
        const auto without = left_alone_ns_.find(turn.unit);
        if (without == left_alone_ns_.end() || now - without->second >= every_ns_) return;
        violated(fmt::format("module {} is asked {} ms behind a turn without a reply", turn.unit,
                             (now - without->second) / ms));
    }

    static constexpr int most_silent = 5;
    struct module {
        time_ns asked_ns = 0;
        int silent = most_silent;  // turns without a reply, at most
    };
    bool judged_;
    time_ns every_ns_ = 0;
    module_turn asked_ = {};
    std::map<module_turn, module> modules_;
    std::map<int, time_ns> left_alone_ns_;  // by unit: its newest turn without a reply
};

// An adapter that is back is opened within a second or so, and used at once. Between two turns the
// box may not know that it was gone.
class adapter_invariant : public invariant {
  public:
    explicit adapter_invariant(run &of) : invariant(of, "adapter"), judged_(is_steady(of)) {
        if (of.bus_line != nullptr) every_ns_ = module_period(of);
    }
    void started() override { plc_ns_ = bus_ns_ = of_.time.now(); }
    void asked(const question &of) override {
        if (of.on_line) plc_ns_ = of_.time.now();
    }
    void module_asked(const module_turn &, const module_reply &) override {
        bus_ns_ = of_.time.now();
    }
    void ticked() override {
        if (!judged_) return;
        judge(of_.plc_line.get(), plc_ns_, most);
        if (of_.bus_line != nullptr) judge(of_.bus_line.get(), bus_ns_, most + 32 * every_ns_);
    }

  private:
    static constexpr time_ns most = 3 * second;  // the box: a second between two attempts
    void judge(const serial_line *line, time_ns used_ns, time_ns most_ns) {
        if (line == nullptr || !line->is_plugged() || line->changed_ns() < used_ns) return;
        const time_ns idle_ns = of_.time.now() - line->changed_ns();
        if (idle_ns > most_ns)
            violated(
                fmt::format("an adapter is back for {} ms, and nothing is sent", idle_ns / ms));
    }
    bool judged_;
    time_ns every_ns_ = 0;
    time_ns plc_ns_ = 0, bus_ns_ = 0;  // the newest request of this daemon, or its start
};

// The statistics know of the bus what was on its wire, up to a second ago.
class modules_invariant : public invariant {
  public:
    explicit modules_invariant(run &of)
        : invariant(of, "modules"), judged_(!of.box_machine.modules.empty() && is_steady(of)) {}
    void started() override {
        turns_.clear();
        modules_.clear();
        asked_ = nullptr;
        requests_ = old_requests_ = 0;
        start_ns_ = of_.time.now();
    }
    void module_asked(const module_turn &turn, const module_reply &before) override {
        if (!judged_) return;
        if (asked_ != nullptr && !before.none) settle(before.prompt);
        asked_ = &modules_[turn];
        asked_->silent = of_.faults.module_is_silent(turn.unit);
        asked_->asked_ns = of_.time.now();
        turns_.push_back(of_.time.now());
        ++requests_;
    }
    void reported(const nlohmann::json &all) override {
        const time_ns now = of_.time.now();
        if (!judged_ || now - start_ns_ < known) return;
        if (!all.contains("bus")) return violated("nothing of the bus is shown");
        for (; !turns_.empty() && now - turns_.front() > known; turns_.pop_front()) ++old_requests_;
        const nlohmann::json &bus = all.at("bus");
        if (bus.at("samples_lost") > 0) violated("samples of the bus are lost");
        const auto requests = bus.value("requests", std::uint64_t{0});
        if (requests > requests_ || requests < old_requests_)
            violated(fmt::format("requests is {}, {} modules were asked, and {} of late", requests,
                                 requests_, turns_.size()));
        // Both are in the order of units and registers. One that was never asked is unknown.
        if (bus.at("modules").size() != modules_.size()) return;
        auto is = modules_.begin();
        for (const auto &shown : bus.at("modules")) {
            if (shown.at("unit") != is->first.unit)
                violated(fmt::format("the bus has a module {}, not {}", shown.at("unit").dump(),
                                     is->first.unit));
            judge(shown, is++->second, now);
        }
    }

  private:
    static constexpr time_ns known = 2 * second;  // the thread, and the file of each second
    struct module {
        time_ns asked_ns = 0;
        time_ns answers_ns = never;  // the first of the prompt turns in a row
        bool silent = false;         // at the newest turn
    };
    void settle(bool prompt) const {
        module &of = *asked_;
        if (!prompt) of.answers_ns = never;
        if (prompt && of.answers_ns == never) of.answers_ns = of_.time.now();
    }
    void judge(const nlohmann::json &shown, const module &is, time_ns now) {
        const bool answers = shown.at("answers");
        const int unit = shown.at("unit");
        const time_ns plugged_ns = of_.bus_line->changed_ns();
        if (&is != asked_ && plugged_ns < is.answers_ns && !answers && is.answers_ns < now - known)
            violated(fmt::format("module {} is shown as silent, and answers", unit));
        if (answers && is.silent && plugged_ns < is.asked_ns && is.asked_ns < now - known)
            violated(fmt::format("module {} is shown with answers, and is silent", unit));
    }
    bool judged_;
    time_ns start_ns_ = 0;
    std::uint64_t requests_ = 0, old_requests_ = 0;  // of this daemon, and those before `known`
    std::deque<time_ns> turns_;                      // since then
    std::map<module_turn, module> modules_;
    module *asked_ = nullptr;  // the newest
};

// A supervised node of CAN that says it is not operational is started again, each second. One that
// says nothing is started when it boots and when the interface is back, and not again and again. On
// a bus that is down none is operational.
class nodes_invariant : public invariant {
  public:
    explicit nodes_invariant(run &of)
        : invariant(of, "nodes"), judged_(of.can != nullptr && is_steady(of)) {}
    void started() override {
        start_ns_ = of_.time.now();
        if (!judged_) return;
        for (can_node &node : of_.can->nodes) node.waits = node.again = 0;
    }
    void ticked() override {
        if (!judged_ || of_.can->state() != can_bus::interface_state::up) return;
        for (const can_node &node : of_.can->nodes) {
            if (node.supervised && node.waits * node.heartbeat > most)
                violated(fmt::format("node {} waits for its start for {} ms", node.number,
                                     node.waits * node.heartbeat / ms));
            if (!node.watched) judge_unwatched(node);
        }
    }

    // No heartbeat passes a bus that is down, and none is lost where nothing happens to the bus.
    void reported(const nlohmann::json &all) override {
        if (judged_ && !draws(of_, fault_kind::can) && all.contains("can"))
            judge_undisturbed(all.at("can"));
        if (judged_ && all.contains("can")) judge_state(all.at("can").at("state"));
        if (!judged_ || of_.can->state() == can_bus::interface_state::up ||
            of_.time.now() - std::max(start_ns_, of_.can->changed_ns) < most)
            return;
        for (const auto &shown : all.at("can").at("nodes"))
            for (const can_node &node : of_.can->nodes)
                if (node.watched && node.number == shown.at("node") &&
                    shown.at("state") == "operational")
                    violated(fmt::format("node {} is shown as operational, and its bus is down",
                                         node.number));
    }

  private:
    // The box starts it when the bus comes up, whatever it said before, and behind its boot-up.
    void judge_unwatched(const can_node &node) {
        const time_ns back = std::max({start_ns_, of_.can->changed_ns, of_.can->on_the_bus_ns}),
                      since = std::max({back, of_.can->full_until_ns, node.booted_ns});
        const bool waits = !node.operational || node.started_ns < back;
        if (waits && of_.can->lost == 0 && of_.time.now() - since > most)
            violated(fmt::format("node {}, which nobody watches, has not been started for {} ms",
                                 node.number, (of_.time.now() - since) / ms));
        if (node.again > 3)
            violated(
                fmt::format("node {} runs, and is started {} times more", node.number, node.again));
    }
    // Nothing happens to the bus.
    void judge_undisturbed(const nlohmann::json &can) {
        static const std::set<std::string> traffic = {"frames", "heartbeats", "sent"};
        for (const auto &[counter, count] : can.items())
            if (count.is_number() && count > 0 && traffic.count(counter) == 0)
                violated(fmt::format("{} of CAN is {}, and nothing happens to it", counter,
                                     count.dump()));
        for (const auto &shown : can.at("nodes")) judge_undisturbed_node(shown);
    }
    // It boots once, is started at most twice, and is not lost.
    void judge_undisturbed_node(const nlohmann::json &shown) {
        if (shown.at("losses") > 0 || shown.at("boots") > 1 || shown.at("starts") > 2)
            violated("a node is disturbed, and nothing happens to the bus: " + shown.dump());
        for (const can_node &node : of_.can->nodes)
            if (node.number == shown.at("node") && node.heartbeat > 0 && node.operational &&
                of_.time.now() - std::max(start_ns_, node.booted_ns) > most &&
                shown.at("state") != "operational")
                violated("a node is operational, and is shown otherwise: " + shown.dump());
    }
    // The controller has said that it is on the bus again, and the box lost no frame. A frame from
    // before an interface went down does not bring it up.
    void judge_state(const std::string &state) {
        const time_ns back_ns = std::max({start_ns_, of_.can->changed_ns, of_.can->on_the_bus_ns});
        if (state == "bus-off" && of_.can->lost == 0 && of_.time.now() - back_ns > most)
            violated(fmt::format("CAN is shown as off the bus, which ended {} ms ago",
                                 (of_.time.now() - back_ns) / ms));
        const time_ns down_ns = of_.time.now() - std::max(start_ns_, of_.can->changed_ns);
        if (state != "up" && of_.time.now() - start_ns_ > most && !draws(of_, fault_kind::can))
            violated(fmt::format("CAN is shown as \"{}\", and nothing happens to it", state));
        if (state == "up" && of_.can->state() != can_bus::interface_state::up && down_ns > most)
            violated(fmt::format("CAN is shown as up, and its interface is not for {} ms",
                                 down_ns / ms));
    }
    static constexpr time_ns most = 4 * second;  // the box: its look at the interface, and a second
    time_ns start_ns_ = 0;
    bool judged_;
};

}  // namespace

void add_wire(run &of, invariants &all) {
    all.push_back(std::make_unique<order_invariant>(of));
    all.push_back(std::make_unique<gap_invariant>(of));
    all.push_back(std::make_unique<account_invariant>(of));
    all.push_back(std::make_unique<pace_invariant>(of));
    all.push_back(std::make_unique<modules_invariant>(of));
    all.push_back(std::make_unique<adapter_invariant>(of));
    all.push_back(std::make_unique<nodes_invariant>(of));
}

}  // namespace compbox::world
