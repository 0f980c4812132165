// SPDX-License-Identifier: MIT
// Values in the PLC that are not the box's, and writes that it refuses (docs/faults.md, reasons 12,
// 13, 21 and "What the PLC holds").
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

// `applied` beyond error_um ends ACTIVE; outside what was sent of late it is reported.
class applied_invariant : public invariant {
  public:
    explicit applied_invariant(run &of)
        : invariant(of, "applied"),
          lag_ns_(longest_lag(of)),
          judged_(lag_ns_ != never && !draws_any(of, {fault_kind::hostile, fault_kind::memory})),
          hears_all_(lag_ns_ == 0 &&
                     !draws_any(of, {fault_kind::loss, fault_kind::reset, fault_kind::tear,
                                     fault_kind::wire, fault_kind::line, fault_kind::plc_stop,
                                     fault_kind::exception, fault_kind::partial})) {}
    void started() override {
        channels_.assign(channels_.size(), {});
        sent_.clear();
        read_ns_ = 0;
        start_ns_ = of_.time.now();
    }
    // The PLC may still apply what was sent before; and the box counts on.
    void taken(const machine &, const machine &) override {
        for (const channel_state &one : channels_)
            if (one.may_be > 0) two_ns_ = read_ns_;
        channels_.clear();
    }
    void exchanged(const exchange &seen) override {
        if (!judged_) return;
        const machine &facts = of_.running_at(seen.sent);
        channels_.resize(facts.channels.size());
        if (seen.duration == never) forget_outside();
        if (!seen.written.empty() && (sent_.empty() || seen.sent >= sent_.back().ns))
            judge(of_.author_of(seen), seen);
        if (is_reading(facts, seen) && head_of(facts, seen).whole) take(facts, seen);
    }

  private:
    struct channel_state {
        std::uint64_t beyond = 0;  // readings in a row …
        time_ns beyond_ns = 0;     // … since then
        unsigned may_be = 0;       // readings in a row that may be
        double outside_s = 0;      // less a quarter of the time inside
    };
    struct sent_block {
        time_ns ns;
        written_block block;
    };
    static constexpr std::uint64_t most_beyond = 12;       // of which the box gets two at least
    static constexpr double report_s = 0.4, most_s = 0.5;  // the box: 0.25 s, 0.5 s
    static constexpr time_ns of_late = 1500 * ms,
                             may_follow = second;       // the box: of late, 1 s to 1.25 s
    static constexpr time_ns least_outside = 200 * ms;  // the box: 0.25 s
    static constexpr time_ns forgiven = 3 * second;     // the box: four times 0.5 s

    // Without a reply the box may be in HOLD for a moment.
    void forget_outside() {
        for (channel_state &one : channels_) one.outside_s = 0;
    }

    void judge(const machine &facts, const exchange &seen) {
        const written_block &block = block_of(facts, seen);
        if (sent_.empty()) start_ns_ = seen.sent;
        // Behind a gap the box begins with what the PLC held, and that counts as sent.
        if (sent_.empty() || 2 * (seen.sent - sent_.back().ns) > 5 * facts.period_us * us)
            placed_ns_ = seen.sent;
        if (seen.sent - placed_ns_ <= of_late) forget_outside();
        if (hears_all_) judge_fault(facts, block, seen.sent);
        sent_.push_back({seen.sent, block});
        // The newest one from before is what the PLC held when that time began.
        while (sent_.size() > 1 && sent_[1].ns < seen.sent - of_late) sent_.pop_front();
        if (block.mode != fakeplc::box_mode::active) {
            idle_ns_ = seen.sent;
            return;
        }
        const bool follows = of_.plc.has_followed(seen.sent - idle_ns_);
        if (hears_all_ && block.reason == box_reason::unapplied &&
            seen.sent - outside_ns_ > forgiven + 20 * facts.period_us * us)
            violated(fmt::format("reason 13, and the PLC applies what was sent for {} ms",
                                 (seen.sent - outside_ns_) / ms));
        if (hears_all_ && block.reason == box_reason::unapplied &&
            seen.sent - idle_ns_ < least_outside)
            violated(fmt::format("reason 13 when the box had been ACTIVE for {} ms",
                                 (seen.sent - idle_ns_) / ms));
        for (std::size_t c = 0; c < channels_.size(); ++c) {
            const std::string &channel = facts.channels[c].name;
            if (channels_[c].beyond >= most_beyond && seen.sent - channels_[c].beyond_ns >= lag_ns_)
                violated(fmt::format("ACTIVE, and {} readings show {} applied beyond error_um",
                                     channels_[c].beyond, channel));
            if (hears_all_ && follows && channels_[c].outside_s > report_s &&
                block.reason != box_reason::unapplied)
                violated(
                    fmt::format("ACTIVE with reason {}, and what the PLC applies to {} was "
                                "outside what was sent for {} s",
                                block.reason, channel, channels_[c].outside_s));
        }
    }

    // One reading alone makes no fault.
    void judge_fault(const machine &facts, const written_block &block, time_ns sent) {
        const bool begins = block.mode == fakeplc::box_mode::fault &&
                            block.reason == box_reason::foreign && !sent_.empty() &&
                            sent_.back().block.mode != fakeplc::box_mode::fault;
        if (begins && sent - two_ns_ > 4 * facts.period_us * us)
            violated(
                fmt::format("FAULT by a value of others, and two readings in a row with one "
                            "were {} ms ago",
                            (sent - two_ns_) / ms));
    }
    void take(const machine &facts, const exchange &seen) {
        // A box that was silent may have been in HOLD.
        const time_ns recent = 5 * facts.period_us * us / 2;
        const bool active = !sent_.empty() && seen.sent - sent_.back().ns < recent &&
                            sent_.back().block.mode == fakeplc::box_mode::active;
        const double step_s = 1e-9 * static_cast<double>(seen.sent - read_ns_);
        const double elapsed_s = std::min(step_s, 2e-6 * static_cast<double>(facts.period_us));
        read_ns_ = seen.sent;
        for (std::size_t c = 0; c < channels_.size(); ++c) {
            if (!facts.channels[c].has_applied) continue;
            note(facts, c, applied_in(facts, c, seen), active ? elapsed_s : -most_s * 4);
        }
    }
    // A PLC that interpolates begins at the tangent before, where the new one has its reference.
    void take_lines(const machine &facts, std::size_t c, double &low, double &high) const {
        const channel_facts &channel = facts.channels[c];
        if (channel.tangent_signal.empty() || !facts.file().at("plc").contains("interpolate_ms"))
            return;
        for (std::size_t i = 1; i < sent_.size(); ++i) {
            const written_block &from = sent_[i - 1].block, &to = sent_[i].block;
            if (c >= std::min(from.um.size(), to.um.size())) continue;
            const double way_um = 1e3 * from.slope[c] * (to.reference_mm[c] - from.reference_mm[c]);
            const double um = std::clamp(from.um[c] + way_um, -channel.error_um, channel.error_um);
            low = std::min(low, um);
            high = std::max(high, um);
        }
    }
    // in : elapsed_s: of the box in ACTIVE; below 0: it is not
    void note(const machine &facts, std::size_t c, double um, double elapsed_s) {
        const channel_facts &channel = facts.channels[c];
        channel_state &state = channels_[c];
        double low = channel.limit_um, high = -channel.limit_um, new_low = low, new_high = high;
        for (const sent_block &one : sent_) {
            if (c >= one.block.um.size()) continue;  // of a file without this channel
            low = std::min(low, one.block.um[c]);
            high = std::max(high, one.block.um[c]);
            if (one.ns < read_ns_ - may_follow + 2 * facts.period_us * us) continue;
            new_low = std::min(new_low, one.block.um[c]);
            new_high = std::max(new_high, one.block.um[c]);
        }
        take_lines(facts, c, low, high);
        if (read_ns_ - start_ns_ < of_late) {  // before its first block a box has sent zero
            low = std::min(low, 0.0);
            high = std::max(high, 0.0);
        }
        if (!(elapsed_s > 0 && um >= new_low && um <= new_high)) outside_ns_ = read_ns_;
        const double near = 2 * (facts.map.deadband_um.value_or(0.1) + channel.unit_um) + 0.01;
        const bool inside = sent_.empty() || (um >= low - near && um <= high + near);
        const double most = 1.01 * std::max({channel.error_um, -low, high}) + near;
        state.beyond = std::fabs(um) <= most || inside ? 0 : state.beyond + 1;
        if (state.beyond <= 1) state.beyond_ns = read_ns_;
        const double least = 0.99 * std::max({channel.error_um, -new_low, new_high}) - near;
        state.may_be = std::fabs(um) < least ? 0 : state.may_be + 1;
        if (state.may_be >= 2) two_ns_ = read_ns_;
        // With a handshake the window is longer than here.
        const bool outside = !inside && elapsed_s > 0 && facts.profile.name != "fanuc";
        const double change_s = outside ? elapsed_s : -std::fabs(elapsed_s) / 4;
        state.outside_s = std::clamp(state.outside_s + change_s, 0.0, most_s);
    }

    time_ns two_ns_ = -never / 2;  // the newest two readings in a row that may be beyond
    time_ns lag_ns_;
    bool judged_, hears_all_;
    std::vector<channel_state> channels_;
    std::deque<sent_block> sent_;  // of late
    time_ns read_ns_ = 0, start_ns_ = 0;
    time_ns idle_ns_ = 0;     // the newest write that is not ACTIVE
    time_ns placed_ns_ = 0;   // the first write behind the newest gap
    time_ns outside_ns_ = 0;  // the newest time when a channel was not what was sent just now
};

// The write block is read back about once a second where the exchange leaves room. A PLC that does
// not answer three times is not asked again (docs/faults.md).
class look_back_invariant : public invariant {
  public:
    explicit look_back_invariant(run &of)
        : invariant(of, "look back"),
          judged_(longest_lag(of) == 0 && of.box_machine.plc_device.empty() &&
                  of.box_machine.period_us >= 20000 &&
                  !draws_any(of, {fault_kind::tear, fault_kind::exception, fault_kind::wire,
                                  fault_kind::plc_stop, fault_kind::partial, fault_kind::memory})) {
    }
    void started() override {
        since_ns_ = of_.time.now();
        unread_ = 0;
    }
    // The connection before it may have taken one along.
    void asked(const question &now) override { unread_ += now.first; }
    void exchanged(const exchange &seen) override {
        if (!judged_) return;
        const machine &facts = of_.running_at(seen.sent);
        if (is_read_back(facts, seen)) {
            since_ns_ = seen.sent;
            unread_ = seen.duration == never ? unread_ + 1 : 0;
        }
        // What waits for a reply leaves no room.
        if (seen.duration == never) since_ns_ = seen.sent;
        if (!seen.written.empty() && seen.sent - since_ns_ > 5 * second && unread_ < most_unread)
            violated("the write block was not read back for five seconds");
    }

  private:
    static constexpr int most_unread = 3;
    bool judged_;
    int unread_ = 0;  // the newest, as many as may have no reply
    time_ns since_ns_ = 0;
};

// A PLC that accepts no write is not compensated again and again, and soon is FAULT: behind some
// seconds in which it answers.
class refused_invariant : public invariant {
  public:
    explicit refused_invariant(run &of) : invariant(of, "refused") {}
    void started() override {
        times_ = 0;
        is_refused_ = ends_ = false;
        refused_ns_ = 0;
    }
    void exchanged(const exchange &seen) override {
        take_answer(of_.running_at(seen.sent), seen);
        if (!seen.written.empty()) {
            times_ = 0;
            const unsigned mode = block_of(of_.author_of(seen), seen).mode;
            if (mode != fakeplc::box_mode::fault) taken_ns_ = seen.sent;
        }
        // A write without a reply is none that is refused.
        if (refused_ns_ > 6 * second && !ends_ && hears_all() &&
            !draws_any(of_, {fault_kind::mute, fault_kind::reader}))
            violated("writes are refused for six seconds, and the box is not in FAULT");
    }
    void logged(const std::string &line) override {
        for (const char *mode : {"STANDBY: ", "ACTIVE: ", "HOLD: ", "RAMP: "})
            ends_ = ends_ && line.find(mode) == std::string::npos;
        // One of the lines that the log's limit left out may be FAULT.
        for (const char *mode : {"FAULT: ", "STOPPED: ", "about the mode left out"})
            ends_ = ends_ || line.find(mode) != std::string::npos;
        if (line.find("about the mode left out") != std::string::npos)
            left_out_ns_ = of_.time.now();
        const time_ns since_ns = of_.time.now() - taken_ns_;
        const bool refuses = line.find("FAULT: the PLC refuses the writes") != std::string::npos;
        if (refuses && since_ns < least_refused && hears_all() && !draws(of_, fault_kind::mute))
            violated(fmt::format("FAULT by refused writes, {} ms after one that was accepted",
                                 since_ns / ms));
        // The line may come behind the first write that is accepted again.
        const bool just_ended = of_.time.now() - ended_ns_ < second / 5;
        const time_ns refused_ns = just_ended ? before_ns_ : refused_ns_;
        // So may one that was left out, seconds later.
        const bool is_late = of_.time.now() - left_out_ns_ < second / 5;
        if (refuses && !is_late && refused_ns < least_refused && longest_lag(of_) == 0 &&
            !draws_any(of_,
                       {fault_kind::wire, fault_kind::line, fault_kind::foreign, fault_kind::loss,
                        fault_kind::stray, fault_kind::memory, fault_kind::mute}))
            violated(fmt::format("FAULT by refused writes, and the PLC answered for {} ms",
                                 refused_ns / ms));
        if (line.find("ACTIVE: ") == std::string::npos) return;
        if (++times_ > most_times && hears_all())
            violated(fmt::format("ACTIVE {} times, and the PLC accepted no write", times_));
    }

  private:
    // A refused write is an answer, and so is a reading. An outage lies between two that are far
    // apart.
    void take_answer(const machine &facts, const exchange &seen) {
        const bool is_refusal = seen.exception != 0 && seen.function != 3;
        if (!seen.written.empty()) is_refused_ = false;
        if (!is_refused_ && refused_ns_ > 0) {
            ended_ns_ = seen.now;
            before_ns_ = std::exchange(refused_ns_, 0);
        }
        if (!is_refusal && (seen.duration == never || !is_reading(facts, seen))) return;
        const time_ns pause_ns = seen.now - std::exchange(answered_ns_, seen.now);
        if (is_refused_ && pause_ns < 8 * facts.period_us * us) refused_ns_ += pause_ns;
        is_refused_ = is_refused_ || is_refusal;
    }
    bool hears_all() const {
        return longest_lag(of_) == 0 &&
               !draws_any(of_, {fault_kind::loss, fault_kind::reset, fault_kind::tear,
                                fault_kind::wire, fault_kind::line, fault_kind::plc_stop,
                                fault_kind::foreign, fault_kind::partial, fault_kind::memory});
    }
    static constexpr int most_times = 6;
    static constexpr time_ns least_refused = 2500 * ms;  // the box: 3 s
    int times_ = 0;
    time_ns taken_ns_ = -never / 2;  // the newest write that is no FAULT
    time_ns left_out_ns_ = -never / 2;
    time_ns answered_ns_ = 0;  // the newest answer
    bool is_refused_ = false;  // a write, and none was accepted since …
    time_ns refused_ns_ = 0;   // … the time since then in which the PLC answered
    time_ns before_ns_ = 0, ended_ns_ = -never / 2;  // the one before, which ended then
    bool ends_ = false;                              // the last mode in the log is FAULT or STOPPED
};

// Compensation needs a PLC that confirms: behind a contact, an outage and another contact the box
// gives up until a write has a reply (docs/faults.md, reason 12).
class confirmed_invariant : public invariant {
  public:
    explicit confirmed_invariant(run &of) : invariant(of, "confirmed") {}
    void started() override { steps_ = 0; }
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const written_block &block = block_of(of_.author_of(seen), seen);
        if (seen.duration != never) steps_ = 0;
        if (seen.duration != never || block.mode != fakeplc::box_mode::active) return;
        if (steps_ > 0 && block.heartbeat == heartbeat_) return;  // again, on a serial line
        heartbeat_ = block.heartbeat;
        if (++steps_ > most)
            violated(fmt::format("{} writes are ACTIVE, and none of them had a reply", steps_));
    }

  private:
    static constexpr int most = 16;  // the box: five behind each of two contacts, and two late ones
    int steps_ = 0;
    std::uint16_t heartbeat_ = 0;  // of the newest of them
};

}  // namespace

void add_foreign(run &of, invariants &all) {
    all.push_back(std::make_unique<applied_invariant>(of));
    all.push_back(std::make_unique<look_back_invariant>(of));
    all.push_back(std::make_unique<refused_invariant>(of));
    all.push_back(std::make_unique<confirmed_invariant>(of));
}

}  // namespace compbox::world
