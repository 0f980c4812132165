// SPDX-License-Identifier: MIT
// The counters of the statistics are what happened to this daemon (docs/faults.md): none counts
// what no fault of the run can cause, and none misses what the status has shown to the PLC.
#include <fmt/core.h>

#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

using nlohmann::json;

// Of a PLC that answers all requests in time, on a wire that loses nothing.
const std::vector<const char *> of_the_box = {
    "missed_ticks",      "reads_torn",  "writes_refused", "heartbeats_lost",
    "registers_foreign", "clock_jumps", "resyncs"};
const std::vector<const char *> of_tcp = {"blocked",       "closed_by_peer",     "disconnects",
                                          "exceptions",    "out_of_time",        "framing_errors",
                                          "given_up",      "invalid_replies",    "late_replies",
                                          "socket_errors", "incomplete_replies", "stray_replies",
                                          "timeouts",      "wrong_ids"};
const std::vector<const char *> of_a_line = {"crc_errors",  "device_errors",   "disconnects",
                                             "exceptions",  "invalid_replies", "late_replies",
                                             "noise_bytes", "out_of_time",     "stray_replies",
                                             "timeouts",    "wrong_units"};
// What only sensors that lie bring.
const std::vector<const char *> of_sensors = {"sensors_doubted", "nc_alarms", "holds"};

// A reason that the status has had, and counters of which one then is not 0.
struct reason_counters {
    unsigned reason;
    std::vector<const char *> counters;
};
const std::vector<reason_counters> by_reason = {
    {box_reason::clock, {"clock_jumps"}},
    {box_reason::signal, {"signals_stale", "samples_implausible"}},
    {box_reason::degraded, {"terms_faded", "models_weakened", "terms_not_finite"}},
    {box_reason::limited, {"outputs_limited", "pairs_limited", "slopes_limited", "outputs_slewed"}},
    {box_reason::extrapolated, {"models_extrapolated", "outside_curve"}},
    {box_reason::unapplied, {"applied_foreign"}},
    {box_reason::write_refused, {"writes_refused"}},
};

class counters_invariant : public invariant {
  public:
    explicit counters_invariant(run &of)
        : invariant(of, "counters"),
          judged_(!draws_any(
              of, {fault_kind::memory, fault_kind::hostile, fault_kind::wire, fault_kind::line})),
          calm_(judged_ && !hides_exchanges(of) &&
                !draws_any(of, {fault_kind::twice, fault_kind::boundary, fault_kind::reload,
                                fault_kind::disk})),
          alone_(judged_ &&
                 !draws_any(of, {fault_kind::exception, fault_kind::foreign, fault_kind::plc_stop,
                                 fault_kind::boundary, fault_kind::reload, fault_kind::stray,
                                 fault_kind::twice, fault_kind::partial, fault_kind::restart,
                                 fault_kind::kill, fault_kind::power_cut})) {}
    void started() override {
        modes_ = {};
        mode_ = fakeplc::box_mode::standby;
        reasons_.clear();
        author_ = nullptr;
        whole_ = false;
        refused_ = refused_before_ = 0;
        handshakes_ = handshakes_before_ = 0;
        handshake_ = 0;
        newest_.clear();
        if (of_.can == nullptr) return;
        for (can_node &node : of_.can->nodes) node.starts = node.boots = 0;
    }
    // With other nodes of CAN their counters begin anew; statistics of before may still come.
    void taken(const machine &was, const machine &is) override {
        if (was.file().value("can", json()) != is.file().value("can", json())) nodes_ns_ = never;
    }
    void exchanged(const exchange &seen) override {
        if (calm_) take_reading(seen);
        if (!judged_ || seen.written.empty() || seen.sent < sent_ns_) return;
        sent_ns_ = seen.sent;
        const machine &author = of_.author_of(seen);
        const written_block &block = block_of(author, seen);
        if (block.mode < modes_.size() && block.mode != mode_) ++modes_[block.mode];
        mode_ = block.mode;
        // A term that has had no value yet has not faded: behind a start, and with a signal that
        // the file before did not have.
        if (author_ != &author)
            for (const signal_facts &signal : author.signals)
                whole_ = whole_ && author_ != nullptr && author_->signal(signal.name) != nullptr;
        author_ = &author;
        whole_ = whole_ || (mode_ == fakeplc::box_mode::active && block.reason == box_reason::none);
        if (whole_ || block.reason != box_reason::degraded) ++reasons_[block.reason];
    }
    // None goes back within a daemon's life, whatever file it takes.
    void reported(const json &all) override {
        if (!judged_) return;
        for (const char *part : {"box", "plc"})
            for (const auto &[counter, value] : all.at(part).items())
                if (value.is_number_unsigned() && counter.find("_us") == std::string::npos)
                    keep(part, counter, value);
        if (!all.contains("can")) return;
        if (nodes_ns_ == never && all.at("revision") == of_.running().revision)
            nodes_ns_ = of_.time.now() + 6 * second;
        for (const json &node : all.at("can").at("nodes")) {
            const std::string of_node = fmt::format("node {}", node.at("node").get<int>());
            for (const char *counter : {"boots", "losses", "starts"}) {
                if (of_.time.now() < nodes_ns_) newest_.erase(of_node + " " + counter);
                keep(of_node, counter, node.at(counter));
            }
            judge_node(node);
        }
    }
    void ended(const ending &how) override {
        const json all = finished_statistics();
        if (!judged_ || how.by_signal || how.code != 0 || all.is_null()) return;
        const json &box = all.at("box");
        for (const auto &[reason, counters] : by_reason) judge_reason(box, reason, counters);
        judge_entries(box, "holds", fakeplc::box_mode::hold);
        judge_entries(box, "ramps", fakeplc::box_mode::ramp);
        judge_entries(box, "faults", fakeplc::box_mode::fault);
        // Each sample has its signal, and none is later than now, be the wall clock set back.
        if (counted(box, "samples_unknown") > 0 && !draws(of_, fault_kind::reload))
            violated(fmt::format("{} samples are of no signal, or from the future",
                                 counted(box, "samples_unknown")));
        if (alone_ && counted(box, "registers_foreign") > 0)
            violated(
                fmt::format("{} registers are not as the box wrote them, and nobody else writes",
                            counted(box, "registers_foreign")));
        if (!calm_) return;
        // The newest reading may have come too late for the box.
        const std::uint64_t refused = counted(box, "samples_implausible");
        if (refused < refused_before_)
            violated(fmt::format("samples_implausible is {}, {} values could not be taken", refused,
                                 refused_before_));
        const std::uint64_t handshakes = counted(box, "handshakes");
        if (handshakes < handshakes_before_ || handshakes > handshakes_)
            violated(fmt::format("handshakes is {}, the readings had {}", handshakes, handshakes_));
        judge_none(box, of_the_box);
        // On a slow line a read-back leaves no time for the write of the first contact.
        const bool on_line = !of_.box_machine.plc_device.empty();
        const std::uint64_t lost = counted(box, "writes_failed") + counted(box, "writes_unknown");
        if (lost > (on_line ? 1U : 0U))
            violated(fmt::format("{} writes had no reply, and nothing happened to them", lost));
        // A PLC that still has the connections of before a power cut closes others.
        if (lost == 0 && !draws(of_, fault_kind::power_cut))
            judge_none(all.at("plc"), on_line ? of_a_line : of_tcp);
        if (!draws(of_, fault_kind::sensors)) judge_none(box, of_sensors);
    }

  private:
    void take_reading(const exchange &seen) {
        const machine &facts = of_.running_at(seen.sent);
        if (seen.duration == never || !is_reading(facts, seen) || !head_of(facts, seen).whole)
            return;
        count_refusals(facts, seen);
        count_handshakes(head_of(facts, seen).handshake);
    }
    // A channel is in transfer, and was not, or ESTB rises.
    void count_handshakes(unsigned word) {
        constexpr unsigned channel = 0xFF, estb = 1u << 8;
        const unsigned was = std::exchange(handshake_, word);
        handshakes_before_ = handshakes_;
        handshakes_ +=
            ((word & ~was & estb) != 0) || ((word & channel) != 0 && ((word ^ was) & channel) != 0);
    }
    // What is no number, or outside of its range for sure.
    void count_refusals(const machine &facts, const exchange &seen) {
        refused_before_ = refused_;
        each_signal(facts, seen, [&](const std::string &of, double value) {
            const signal_facts &signal = *facts.signal(of);
            const double near = at_a_limit(value);
            refused_ += !(value > signal.min - near && value < signal.max + near);
        });
    }
    // None is of another node. A boot from before the start may be heard behind it.
    void judge_node(const json &shown) {
        for (const can_node &node : of_.can->nodes)
            if (node.number == shown.at("node") &&
                (shown.at("starts") > node.starts || shown.at("boots") > node.boots + 1))
                violated(fmt::format(
                    "node {} has had {} starts and {} boots, the box counts {} and {}", node.number,
                    node.starts, node.boots, shown.at("starts").dump(), shown.at("boots").dump()));
    }
    void keep(const std::string &of, const std::string &counter, std::uint64_t value) {
        std::uint64_t &before = newest_[of + " " + counter];
        if (value < before)
            violated(fmt::format("{} of {} is {}, it was {}", counter, of, value, before));
        before = value;
    }
    static std::uint64_t counted(const json &of, const char *counter) {
        return of.at(counter);  // a name that is wrong does not pass for 0
    }
    void judge_none(const json &of, const std::vector<const char *> &counters) {
        for (const char *counter : counters)
            if (counted(of, counter) > 0)
                violated(fmt::format("{} is {}, and nothing happened that it counts", counter,
                                     counted(of, counter)));
    }
    void judge_reason(const json &box, unsigned reason, const std::vector<const char *> &counters) {
        const auto found = reasons_.find(reason);
        if (found == reasons_.end()) return;
        std::uint64_t all = 0;
        std::string names;
        for (const char *counter : counters) {
            all += counted(box, counter);
            names += fmt::format("{}{}", names.empty() ? "" : ", ", counter);
        }
        if (all == 0)
            violated(fmt::format("the status had reason {} {} times, and none is counted in {}",
                                 reason, found->second, names));
    }
    // Of a calm run each step of the box comes to the PLC, but for the first ones.
    void judge_entries(const json &box, const char *counter, unsigned mode) {
        const std::uint64_t is = counted(box, counter), seen = modes_[mode];
        if (is < seen || (calm_ && is > seen + 2))
            violated(fmt::format("{} is {}, the PLC saw {}", counter, is, seen));
    }

    std::map<std::string, std::uint64_t> newest_;  // counters of this daemon
    // Until then counters of nodes may begin anew; never: no statistics of the new file have come.
    time_ns nodes_ns_ = -never / 2;
    bool judged_, calm_;
    bool alone_;           // no other client writes, and the PLC returns what was written, whole
    time_ns sent_ns_ = 0;  // the newest write
    unsigned mode_ = fakeplc::box_mode::standby;
    std::uint64_t refused_ = 0, refused_before_ = 0;  // values of readings, but for the newest one
    unsigned handshake_ = 0;                          // of the newest reading
    std::uint64_t handshakes_ = 0, handshakes_before_ = 0;  // likewise
    const machine *author_ = nullptr;                       // of the newest write
    bool whole_ = false;                                    // all terms have had values
    std::array<std::uint64_t, 6> modes_ = {};               // entries, as the PLC saw them
    std::map<unsigned, std::uint64_t> reasons_;             // writes with each
};

// The statistics and the snapshot of a daemon that ended are of the same last cycle.
class agreement_invariant : public invariant {
  public:
    explicit agreement_invariant(run &of) : invariant(of, "agreement") {}
    void ended(const ending &how) override {
        if (how.by_signal || how.code != 0) return;
        const json all = finished_statistics();
        const json snapshot = finished_snapshot();
        if (all.is_null() || snapshot.is_null()) return;
        for (const char *member : {"version", "machine", "revision", "started_unix_s", "mode",
                                   "reason", "period_us", "lead_us", "can", "bus"})
            compare(member, all.value(member, json()), snapshot.value(member, json()));
        compare("box", all.at("box"), snapshot.at("counters"));
        compare("plc", all.at("plc").at("address"), snapshot.at("plc"));
        const json &cause = snapshot.at("cause");
        compare("cause", all.at("cause"), cause.is_null() ? json("") : cause.at("text"));
        for (const char *times : {"jitter_us", "exchange_us"})
            for (const char *member : {"count", "p50", "p99", "max"})
                compare(times, all.at(times).at(member), snapshot.at(times).at(member));
        compare_parts("signals", {"implausible", "stale"}, all, snapshot);
        compare_parts("channels", {"limited", "excessive"}, all, snapshot);
        check_exceptions(all.at("plc"));
    }

  private:
    void compare(const std::string &what, const json &is, const json &shown) {
        if (is != shown)
            violated(fmt::format("{} is {} in the statistics and {} in the snapshot", what,
                                 is.dump(), shown.dump()));
    }
    // Each has a code of one digit or two.
    void check_exceptions(const json &plc) {
        static const std::regex code(R"(1?\d)");
        std::uint64_t sum = 0;
        for (const auto &[key, count] : plc.at("exceptions_by_code").items()) {
            sum += count.get<std::uint64_t>();
            if (!std::regex_match(key, code)) violated("an exception has the code " + key);
        }
        if (plc.at("exceptions") != sum)
            violated(
                fmt::format("{} exceptions, {} by their codes", plc.at("exceptions").dump(), sum));
    }
    // The statistics leave out what has counted nothing.
    void compare_parts(const char *parts, const std::vector<const char *> &counters,
                       const json &all, const json &snapshot) {
        for (const json &shown : snapshot.at(parts)) {
            const std::string part_name = shown.at("name");
            const json is = all.at(parts).value(part_name, json::object());
            for (const char *counter : counters)
                compare(fmt::format("{} of {}", counter, part_name), is.value(counter, json(0)),
                        shown.at(counter));
        }
    }
};

}  // namespace

void add_counters(run &of, invariants &all) {
    all.push_back(std::make_unique<agreement_invariant>(of));
    all.push_back(std::make_unique<counters_invariant>(of));
}

}  // namespace compbox::world
