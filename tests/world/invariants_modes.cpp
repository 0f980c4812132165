// SPDX-License-Identifier: MIT
// Modes: what permits ACTIVE, and that the status is true (docs/faults.md, docs/DESIGN.md §5).
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

// What a mode may be based on: readings of at most three periods, the heartbeat of its timeout, and
// a PLC that does not refuse each write for three seconds. In FC23 a write carries the step before
// it.
class evidence_invariant : public invariant {
  public:
    explicit evidence_invariant(run &of) : invariant(of, "evidence"), lag_ns_(longest_lag(of)) {}
    void started() override {
        permitted_ns_ = calm_ns_ = beat_ns_ = -never / 2;
        beats_ = 0;
        refused_since_ns_ = never;
    }
    void exchanged(const exchange &seen) override {
        if (lag_ns_ == never) return;
        const machine &facts = of_.running_at(seen.sent);
        judge_refusals(facts, seen);
        if (!seen.written.empty()) judge(of_.author_of(seen), seen);
        if (is_reading(facts, seen)) take(facts, seen);
    }

  private:
    void judge(const machine &facts, const exchange &seen) {
        if (block_of(facts, seen).mode != fakeplc::box_mode::active) return;
        const time_ns period_ns = facts.period_us * us;
        const time_ns reading_ns = 5 * period_ns + lag_ns_;
        const time_ns beat_ns = facts.heartbeat_timeout_us * us + 2 * period_ns + lag_ns_;
        if (seen.sent - permitted_ns_ > reading_ns)
            violated(fmt::format(
                "ACTIVE, but the last reading with enable and all references is {} ms old",
                (seen.sent - permitted_ns_) / ms));
        if (seen.sent - calm_ns_ > reading_ns)
            violated(
                fmt::format("ACTIVE, but the last reading without an alarm of the NC is {} ms old",
                            (seen.sent - calm_ns_) / ms));
        if (seen.sent - beat_ns_ > beat_ns || beats_ < 2)
            violated(fmt::format("ACTIVE, but the PLC's heartbeat has not moved for {} ms",
                                 (seen.sent - beat_ns_) / ms));
    }
    // Each write was refused for longer than the box lets it be (docs/faults.md, reason 18).
    void judge_refusals(const machine &facts, const exchange &seen) {
        const time_ns period_ns = facts.period_us * us;
        if (seen.function == 3 || seen.sent < newest_ns_) return;
        const bool follows = seen.sent - std::exchange(newest_ns_, seen.sent) < 2 * period_ns;
        if (!follows || seen.duration == never) refused_since_ns_ = never;
        if (seen.exception != 0) {
            refused_since_ns_ = std::min(refused_since_ns_, seen.sent);
            return;
        }
        const time_ns since_ns = std::exchange(refused_since_ns_, never);
        if (since_ns != never && seen.sent - since_ns > most_refused + 10 * period_ns + lag_ns_ &&
            block_of(of_.author_of(seen), seen).mode == fakeplc::box_mode::active)
            violated(fmt::format("ACTIVE behind writes that were refused for {} ms",
                                 (seen.sent - since_ns) / ms));
    }
    void take(const machine &facts, const exchange &seen) {
        const read_head head = head_of(facts, seen);
        if (!head.whole) return;
        // Behind a silence nobody knows when it moved.
        const time_ns silent_ns =
            seen.sent - std::exchange(whole_ns_, std::max(whole_ns_, seen.sent));
        const bool known = beats_ > 0 && silent_ns <= 5 * facts.period_us * us + lag_ns_;
        // Behind a lost reply it moves with the next one that comes.
        const bool is_lost = seen.duration == never && head.heartbeat != beat_;
        if (beats_ == 0 || (known && head.heartbeat != beat_)) {
            beat_ns_ = std::max(beat_ns_, seen.sent);
            ++beats_;
        }
        if (!is_lost) beat_ = head.heartbeat;
        if (head.enables() && head.references(facts))
            permitted_ns_ = std::max(permitted_ns_, seen.sent);
        if (!head.nc_alarm) calm_ns_ = std::max(calm_ns_, seen.sent);
    }

    static constexpr time_ns most_refused = 3 * second;
    time_ns newest_ns_ = 0;             // the newest write
    time_ns refused_since_ns_ = never;  // the first of those in a row; never: the newest was taken
    time_ns lag_ns_, permitted_ns_ = -never / 2, beat_ns_ = -never / 2;
    time_ns calm_ns_ = -never / 2;  // without an alarm of the NC
    time_ns whole_ns_ = 0;          // the newest whole reading
    std::uint16_t beat_ = 0;
    std::uint64_t beats_ = 0;  // different heartbeats
};

// ACTIVE ends when an essential signal was implausible for longer than its maximum age.
class essential_invariant : public invariant {
  public:
    explicit essential_invariant(run &of) : invariant(of, "essential"), lag_ns_(longest_lag(of)) {}
    void started() override { good_ns_.clear(); }
    void exchanged(const exchange &seen) override {
        if (lag_ns_ == never) return;
        const machine &facts = of_.running_at(seen.sent);
        const machine &author = of_.author_of(seen);
        if (!seen.written.empty() && block_of(author, seen).mode == fakeplc::box_mode::active)
            judge(author, seen);
        if (is_reading(facts, seen)) take(facts, seen);
    }

  private:
    void take(const machine &facts, const exchange &seen) {
        if (!head_of(facts, seen).whole) return;
        for (const fakeplc::shown_signal &signal : facts.map.signals) {
            time_ns &good_ns = good_ns_.emplace(signal.name, -never / 2).first->second;
            const double value = signal_in(facts, signal, seen);
            const double low = signal.min.value_or(-1e30), high = signal.max.value_or(1e30);
            const double near = 1e-6 * (std::fabs(low) + std::fabs(high));
            if (std::isfinite(value) && value >= low - near && value <= high + near)
                good_ns = std::max(good_ns, seen.sent);
        }
    }
    void judge(const machine &facts, const exchange &seen) {
        for (const auto &[essential, good_ns] : good_ns_) {
            if (seen.sent - good_ns <= 2 * facts.period_us * us) continue;
            const signal_facts *signal = facts.signal(essential);
            if (signal == nullptr || !signal->essential) continue;
            const time_ns most = signal->max_age_us * us + 2 * facts.period_us * us + lag_ns_;
            if (seen.sent - good_ns > most)
                violated(
                    fmt::format("ACTIVE, but the essential {} had no plausible value for {} ms",
                                essential, (seen.sent - good_ns) / ms));
        }
    }

    time_ns lag_ns_;
    std::map<std::string, time_ns> good_ns_;  // by signal; a reload may change their order
};

// After a loss ACTIVE needs permit resume, or enable off and on again: losses are HOLD, a fault, a
// ramp with an input missing, and a start at a PLC whose status is at work (decision 4).
class permission_invariant : public invariant {
  public:
    explicit permission_invariant(run &of)
        : invariant(of, "permission"), lag_ns_(longest_lag(of)) {}
    void started() override {
        // A daemon that tried to write nothing leaves the PLC as the one before it did.
        was_stopped_ = writes_any_ ? stops_ : was_stopped_;
        contact_ = start_known_ = refuses_ = writes_any_ = stops_ = false;
        writes_ = 0;
        refused_ns_ = never;
        mode_ = mode_before_ = fakeplc::box_mode::standby;
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (!contact_ && is_read_back(facts, seen)) first_contact(facts, seen);
        if (!contact_ && is_refused_read_back(facts, seen)) {
            // A second contact has the loss of the first one behind it.
            refused_ns_ = std::min(refused_ns_, seen.sent);
            const bool again = seen.sent - refused_ns_ > contact_lasts(facts);
            lost_ = !trusted();
            start_known_ = was_stopped_ && !again && !hides_start();
        }
        writes_any_ = writes_any_ || seen.function != 3;
        // Writes that are refused again and again are a loss.
        refuses_ = refuses_ || (seen.function != 3 && seen.exception != 0);
        start_known_ = start_known_ && !refuses_;
        if (!seen.written.empty() && seen.sent >= newest_ns_) judge(of_.author_of(seen), seen);
        if (is_reading(facts, seen)) take(facts, seen);
    }

  private:
    // The state file may say that the run before ended STOPPED: then a refusal is no loss.
    bool trusted() const {
        return was_stopped_ || draws_any(of_, {fault_kind::state, fault_kind::power_cut,
                                               fault_kind::disk, fault_kind::refuse});
    }
    // Whether the state file may say less than the run before, or a write be that of another step.
    bool hides_start() const {
        return longest_lag(of_) != 0 ||
               draws_any(of_, {fault_kind::state, fault_kind::power_cut, fault_kind::disk,
                               fault_kind::refuse, fault_kind::kill, fault_kind::links,
                               fault_kind::partial, fault_kind::memory, fault_kind::hostile,
                               fault_kind::foreign, fault_kind::stray, fault_kind::twice,
                               fault_kind::wire, fault_kind::line, fault_kind::tear,
                               fault_kind::reset, fault_kind::loss, fault_kind::boundary});
    }
    void first_contact(const machine &facts, const exchange &seen) {
        const auto at = static_cast<std::size_t>(facts.map.status - facts.map.write.start);
        const unsigned mode = seen.read[at] & 0xFFu;
        lost_ = mode != fakeplc::box_mode::standby && mode != fakeplc::box_mode::stopped;
        start_known_ = !hides_start();
    }
    void take(const machine &facts, const exchange &seen) {
        const read_head head = head_of(facts, seen);
        // By a late line the box may not have heard it.
        const bool heard =
            seen.duration != never && seen.now + seen.duration - seen.sent < facts.period_us * us;
        if (!head.enables()) {
            off_ns_ = seen.now;
            on_ns_ = never;
        } else if (on_ns_ == never) {
            edge_ns_ = seen.sent;
            counts_ = counts_ || !heard || hides_start();
        }
        if (head.enables() && heard) on_ns_ = std::min(on_ns_, seen.sent);
        if (head.permits() && head.enables()) permit_ns_ = std::max(permit_ns_, seen.sent);
    }
    // By its reason the box lacks what it needs of the PLC, the clock or a signal.
    static bool lacks_input(const written_block &block) {
        using namespace box_reason;
        constexpr std::array inputs = {no_plc, heartbeat, signal, clock, unconfirmed};
        return std::find(inputs.begin(), inputs.end(), block.reason) != inputs.end();
    }
    // A ramp straight from STANDBY is none: the PLC held outputs, and the box was not at work.
    static bool is_loss(unsigned mode_before, const written_block &block) {
        using namespace box_reason;
        if (block.mode == fakeplc::box_mode::hold || block.mode == fakeplc::box_mode::fault)
            return true;
        // An axis that loses its reference at work is one, a cleared enable is not.
        if (mode_before == fakeplc::box_mode::active && block.reason == not_referenced) return true;
        const bool waits = block.reason == wait;
        return block.mode == fakeplc::box_mode::ramp &&
               (waits || (lacks_input(block) && mode_before != fakeplc::box_mode::standby));
    }
    // An edge of enable counts where its step has all that ACTIVE needs of PLC and signals.
    void take_edge(const machine &facts, const exchange &seen, const written_block &block) {
        const time_ns edge_ns = std::exchange(edge_ns_, never);
        if (edge_ns == never) return;
        const bool waits = block.mode == fakeplc::box_mode::standby ||
                           block.mode == fakeplc::box_mode::ramp ||
                           block.mode == fakeplc::box_mode::hold;
        const bool is_next = 2 * (seen.sent - edge_ns) < 3 * facts.period_us * us;
        counts_ = counts_ || !is_next || !waits || !lacks_input(block);
    }
    void judge(const machine &facts, const exchange &seen) {
        const written_block &block = block_of(facts, seen);
        const bool follows = !contact_ || 2 * (seen.sent - newest_ns_) < 3 * facts.period_us * us;
        newest_ns_ = seen.sent;
        contact_ = true;
        // The first writes, without a silence between, in which contact may be lost again.
        if (!follows || ++writes_ > first_writes) start_known_ = false;
        if (start_known_ && !lost_ && block.reason == box_reason::wait)
            violated("a box that has just started waits for permission, and nothing was lost");
        take_edge(facts, seen, block);
        // A line repeats a write without a reply.
        if (block.heartbeat != beat_) mode_before_ = mode_;
        beat_ = block.heartbeat;
        mode_ = block.mode;
        const bool is_confirmed = stops_ || seen.duration != never;
        stops_ = block.mode == fakeplc::box_mode::stopped && is_confirmed;
        if (block.mode != fakeplc::box_mode::active) {
            if (is_loss(mode_before_, block)) lost_ns_ = seen.sent;
            lost_ = lost_ || lost_ns_ == seen.sent;
            return;
        }
        const time_ns lag_ns = lag_ns_ == never ? 200 * second : lag_ns_;
        const time_ns recent = 5 * facts.period_us * us + lag_ns;
        const bool permitted = seen.sent - permit_ns_ <= recent;
        // The write behind a reading with enable off may still be one of the loss, by FC23 the
        // next.
        const bool was_off =
            off_ns_ >= active_ns_ &&
            (off_ns_ + 3 * facts.period_us * us + lag_ns >= lost_ns_ || on_ns_ >= lost_ns_);
        if (lost_ && !permitted && !was_off)
            violated("ACTIVE after a loss, without permit resume and without a new edge of enable");
        if (lost_ && !permitted && !counts_)
            violated("ACTIVE after a loss, and enable came while something was missing");
        lost_ = counts_ = false;
        active_ns_ = seen.sent;
    }

    time_ns lag_ns_, newest_ns_ = 0, active_ns_ = -never / 2, permit_ns_ = -never / 2,
                     off_ns_ = -never / 2, lost_ns_ = -never / 2;
    time_ns on_ns_ = never;  // the first reading behind off_ns_ with enable that the box has heard
    time_ns edge_ns_ = never;  // of a reading whose step has yet to write
    bool counts_ = false;      // an edge since then may be a permission
    bool lost_ = false, contact_ = false, writes_any_ = false;
    bool stops_ = false, was_stopped_ = false;  // STOPPED had a reply, here and before the start
    bool refuses_ = false;                      // a write of this daemon
    time_ns refused_ns_ = never;                // its first read-back that was refused
    static constexpr int first_writes = 10;
    int writes_ = 0;                              // of this daemon
    bool start_known_ = false;                    // whether something was lost before this start
    unsigned mode_ = fakeplc::box_mode::standby;  // of the newest write …
    unsigned mode_before_ = mode_;                // … and of the step before its own
    std::uint16_t beat_ = 0;                      // of the newest write
};

// A fault ends by the reset bit going from 0 to 1, by a stop, or by a restart. An edge while its
// cause lasts is without effect.
class reset_invariant : public invariant {
  public:
    explicit reset_invariant(run &of) : invariant(of, "reset"), exact_(longest_lag(of) == 0) {}
    void started() override { in_fault_ = false; }
    void taken(const machine &, const machine &) override { taken_ns_ = of_.time.now(); }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (!seen.written.empty() && seen.sent >= newest_ns_) judge(of_.author_of(seen), seen);
        if (!is_reading(facts, seen)) return;
        const read_head head = head_of(facts, seen);
        const bool resets = head.resets();
        if (resets && (!was_set_ || !seen_all())) edge_ns_ = seen.now;
        was_set_ = resets;
        alarms_ = head.nc_alarm ? alarms_ + 1 : 0;
    }

  private:
    // Otherwise the box may have missed readings.
    bool seen_all() const {
        return exact_ &&
               !draws_any(of_, {fault_kind::loss, fault_kind::reset, fault_kind::tear,
                                fault_kind::exception, fault_kind::wire, fault_kind::plc_stop,
                                fault_kind::foreign, fault_kind::partial, fault_kind::twice,
                                fault_kind::line, fault_kind::mute, fault_kind::stray});
    }
    void judge(const machine &facts, const exchange &seen) {
        const written_block &block = block_of(facts, seen);
        newest_ns_ = seen.sent;
        if (block.reason == box_reason::nc_waits && !facts.map.handshake && exact_ &&
            seen.sent - taken_ns_ > second)
            violated("the box waits for an alarm of the NC, which its file does not read");
        // An edge behind the reload ends the fault of an alarm that the file does not read.
        const time_ns few_ns = 4 * facts.period_us * us;
        if (block.mode == fakeplc::box_mode::fault && block.reason == box_reason::nc_alarm &&
            !facts.map.handshake && seen_all() && edge_ns_ > taken_ns_ + few_ns &&
            seen.sent > edge_ns_ + few_ns)
            violated("FAULT by an alarm of the NC, which the file does not read, and it was reset");
        if (block.mode == fakeplc::box_mode::fault) {
            if (!in_fault_ || exact_) since_ns_ = seen.sent - 4 * facts.period_us * us;
            in_fault_ = true;
            reason_ = block.reason;
            return;
        }
        const bool stops =
            block.mode == fakeplc::box_mode::stopped || block.reason == box_reason::stop;
        if (in_fault_ && !stops && edge_ns_ < since_ns_)
            violated(fmt::format("FAULT became {} without an edge of the reset bit then",
                                 fakeplc::box_mode::name_of(block.mode)));
        // With FC23 a write has the step before.
        if (in_fault_ && !stops && seen_all() && alarms_ > 2 && reason_ == box_reason::nc_alarm)
            violated(fmt::format("FAULT became {}, and the NC's alarm lasts",
                                 fakeplc::box_mode::name_of(block.mode)));
        in_fault_ = false;
    }

    bool exact_, in_fault_ = false, was_set_ = false;
    unsigned reason_ = 0;  // of the newest FAULT
    int alarms_ = 0;       // readings in a row with an alarm of the NC
    time_ns newest_ns_ = 0, since_ns_ = 0, edge_ns_ = -never / 2, taken_ns_ = -never / 2;
};

// What the status says is what the outputs do (docs/faults.md, "Modes").
class status_invariant : public invariant {
  public:
    explicit status_invariant(run &of)
        : invariant(of, "status"),
          lag_ns_(longest_lag(of)),
          each_reading_arrives_(
              lag_ns_ == 0 &&
              !draws_any(of, {fault_kind::hostile, fault_kind::memory, fault_kind::mute,
                              fault_kind::wire, fault_kind::line, fault_kind::reset,
                              fault_kind::tear, fault_kind::partial, fault_kind::stray,
                              fault_kind::exception, fault_kind::loss, fault_kind::boundary})) {}
    void started() override {
        withdrawn_since_ns_ = never;
        before_.reset();
        hold_ns_ = stop_ns_ = never;
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (is_read_back(facts, seen) || is_refused_read_back(facts, seen)) {
            before_.reset();  // the outputs may be set to the PLC's
            sent_ns_ = std::max(sent_ns_, seen.sent);
        }
        if (is_reading(facts, seen)) {
            const read_head head = head_of(facts, seen);
            const bool withdrawn = !head.enables() || !head.references(facts);
            if (withdrawn) withdrawn_ns_ = seen.sent;
            if (!withdrawn || seen.duration == never)
                withdrawn_since_ns_ = never;
            else if (withdrawn_since_ns_ == never)
                withdrawn_since_ns_ = seen.sent;
        }
        if (seen.written.empty()) return;
        const machine &author = of_.author_of(seen);
        const written_block &block = block_of(author, seen);
        if (seen.sent < sent_ns_) return;  // of a given-up connection
        judge(author, block);
        const time_ns most_ns = 3 * author.period_us * us;  // FC23 has the step before
        if (block.mode == fakeplc::box_mode::hold && each_reading_arrives_ &&
            withdrawn_since_ns_ != never && seen.sent - withdrawn_since_ns_ > most_ns &&
            seen.sent - withdrawn_ns_ < most_ns)
            violated(fmt::format("HOLD, and the PLC has wanted no compensation for {} ms",
                                 (seen.sent - withdrawn_since_ns_) / ms));
        const bool again = before_ && before_->heartbeat == block.heartbeat;  // on a serial line
        if (before_) compare(author, *before_, block, seen.sent - sent_ns_);
        watch_hold(author, block, seen.sent);
        before_ = block;
        if (!again) sent_ns_ = seen.sent;
    }

  private:
    static bool is_fault(unsigned reason) {
        return reason >= box_reason::demand && reason <= box_reason::foreign;
    }
    void judge(const machine &facts, const written_block &block) {
        using namespace box_reason;
        if (block.mode > fakeplc::box_mode::stopped)
            violated(fmt::format("the status has mode {}", block.mode));
        const bool rests =
            block.mode == fakeplc::box_mode::standby || block.mode == fakeplc::box_mode::stopped;
        if (rests && !block.is_zero())
            violated(fmt::format("{} with an output that is not zero",
                                 fakeplc::box_mode::name_of(block.mode)));
        if (!block.counters_agree) violated("the counters of the write block differ");
        static const std::set<unsigned> active = {none,    unapplied,    degraded,
                                                  limited, extrapolated, drifted};
        if (block.mode == fakeplc::box_mode::active && active.count(block.reason) == 0)
            violated(fmt::format("ACTIVE with reason {}", block.reason));
        if ((block.mode == fakeplc::box_mode::fault) != is_fault(block.reason))
            violated(fmt::format("{} with reason {}", fakeplc::box_mode::name_of(block.mode),
                                 block.reason));
        static const std::set<unsigned> caused = {signal, limited, unapplied,
                                                  demand, foreign, drifted};
        if (facts.map.detail && block.reason != degraded &&
            (caused.count(block.reason) > 0) != (block.detail != 0))
            violated(fmt::format("reason {} with detail {:#06x}", block.reason, block.detail));
    }
    void compare(const machine &facts, const written_block &from, const written_block &to,
                 time_ns apart) {
        const auto beats = static_cast<std::uint16_t>(to.heartbeat - from.heartbeat);
        const bool again =
            beats == 0 && !facts.plc_device.empty();  // a repetition on a serial line
        if (beats == 0 && !again) violated("the box's heartbeat is that of the write before");
        const auto period_ns = static_cast<double>(facts.period_us * us);
        if (lag_ns_ != never && beats > 0) {
            const double most = static_cast<double>(apart + lag_ns_) / period_ns + 2;
            if (beats > most)
                violated(fmt::format("the box's heartbeat counts {} in {} ms", beats, apart / ms));
        }
        for (std::size_t c = 0; c < std::min(from.um.size(), to.um.size()); ++c) {
            const double was = from.um[c], is = to.um[c];
            // A step in between, whose write the PLC never got, may have been ACTIVE.
            const bool follows = beats <= 1;
            const bool holds = follows && from.mode == fakeplc::box_mode::hold &&
                               to.mode == fakeplc::box_mode::hold;
            if (holds && is != was && !comes_inside(facts, c, from, to))
                violated(fmt::format("{} moves from {} to {} µm in HOLD", facts.channels[c].name,
                                     was, is));
            const bool ramps = is_ramp(from) && is_ramp(to) && follows;
            if (ramps && (std::fabs(is) > std::fabs(was) || is * was < 0))
                violated(fmt::format("{} goes from {} to {} µm in a ramp", facts.channels[c].name,
                                     was, is));
            if (ramps) check_ramp(facts, c, was, is, apart);
        }
    }
    // Behind a reload to a smaller limit, which takes the other motor of a pair along, or to a
    // smaller difference of a pair.
    bool comes_inside(const machine &facts, std::size_t c, const written_block &from,
                      const written_block &to) const {
        constexpr double almost = 1 - 1e-6;
        if (of_.files_taken() <= 1) return false;
        const auto is_outside = [&](std::size_t one) {
            return std::fabs(from.um[one]) > facts.channels[one].limit_um * almost;
        };
        const std::optional<std::size_t> partner = partner_of(facts, c);
        const bool from_outside = is_outside(c) || (partner && is_outside(*partner));
        if (from_outside && std::fabs(to.um[c]) < std::fabs(from.um[c])) return true;
        return std::any_of(facts.pairs.begin(), facts.pairs.end(), [&](const pair_facts &pair) {
            const double apart_um = std::fabs(from.um[pair.first] - from.um[pair.second]);
            return (c == pair.first || c == pair.second) && apart_um > pair.most_um * almost &&
                   std::fabs(to.um[pair.first] - to.um[pair.second]) < apart_um;
        });
    }
    static bool is_ramp(const written_block &block) {
        return block.mode == fakeplc::box_mode::ramp || block.mode == fakeplc::box_mode::fault;
    }
    // No faster than ramp_um_per_s, over any two writes.
    void check_ramp(const machine &facts, std::size_t c, double was, double is, time_ns apart) {
        if (lag_ns_ != 0) return;
        const time_ns longest_ns = 2 * facts.period_us * us;  // of one step
        const time_ns steps_ns = std::min(apart + longest_between_steps(facts), longest_ns);
        const double time_s = 1e-9 * static_cast<double>(steps_ns);
        const double most = facts.ramp_um_per_s * time_s + 2.01 * facts.channels[c].unit_um + 1e-3;
        if (std::fabs(is - was) > most)
            violated(fmt::format("{} ramps by {} µm in {} s, allowed are {} µm",
                                 facts.channels[c].name, std::fabs(is - was), time_s, most));
    }
    void watch_hold(const machine &facts, const written_block &block, time_ns sent) {
        if (block.mode != fakeplc::box_mode::hold) {
            judge_end_of_hold(facts, block, sent);
            hold_ns_ = never;
            unheld_ns_ = sent;
            return;
        }
        // Between two writes with a gap, which the PLC refused or never got, it was in other modes.
        const time_ns gap_ns = sent - std::exchange(held_ns_, sent);
        if (gap_ns > 3 * facts.period_us * us) hold_ns_ = never;
        hold_ns_ = std::min(hold_ns_, sent);
        const bool stops = of_.stop_asked || of_.asked_to_stop;
        stop_ns_ = stops ? std::min(stop_ns_, sent) : never;
        if (lag_ns_ == 0 && sent - stop_ns_ > second / 2 + 4 * facts.period_us * us)
            violated(
                fmt::format("HOLD {} ms behind the request for a stop", (sent - stop_ns_) / ms));
        const time_ns most = facts.hold_us * us + 8 * facts.period_us * us +
                             (lag_ns_ == never ? 200 * second : lag_ns_);
        if (sent - hold_ns_ > most) violated(fmt::format("HOLD for {} ms", (sent - hold_ns_) / ms));
    }

    // Only a stop and a reading without enable or a reference end HOLD before hold_ms.
    void judge_end_of_hold(const machine &facts, const written_block &block, time_ns sent) {
        const bool ramps = hold_ns_ != never && block.mode == fakeplc::box_mode::ramp;
        if (!ramps || block.reason == box_reason::stop || lag_ns_ != 0 || of_.stop_asked ||
            of_.asked_to_stop || withdrawn_ns_ >= unheld_ns_ - 5 * facts.period_us * us ||
            draws_any(of_, {fault_kind::reload, fault_kind::hostile, fault_kind::memory,
                            fault_kind::wire, fault_kind::line}))
            return;
        const time_ns held_ns = sent - unheld_ns_;
        if (held_ns < facts.hold_us * us - 4 * facts.period_us * us)
            violated(fmt::format("HOLD became RAMP after {} ms", held_ns / ms));
    }

    time_ns lag_ns_, sent_ns_ = 0, hold_ns_ = never, stop_ns_ = never;
    bool each_reading_arrives_;
    time_ns withdrawn_since_ns_ = never;  // each reading since then has no enable or reference
    time_ns held_ns_ = 0;                 // the newest write that is HOLD
    time_ns unheld_ns_ = -never / 2, withdrawn_ns_ = -never / 2;  // … or not; a reading without
    std::optional<written_block> before_;
};

// ACTIVE ends for enable or a reference only if a reading lacked it. A PLC that is not read is the
// first reason of all, and none where each reading and write has its reply in time. What the PLC
// applies is right again by a whole reading alone.
class reason_invariant : public invariant {
  public:
    explicit reason_invariant(run &of)
        : invariant(of, "reason"),
          lag_ns_(longest_lag(of)),
          reads_judged_(lag_ns_ == 0 && !draws_any(of, {fault_kind::tear, fault_kind::partial,
                                                        fault_kind::wire, fault_kind::line,
                                                        fault_kind::hostile, fault_kind::memory})),
          sees_ends_(lag_ns_ == 0 &&
                     !draws_any(of, {fault_kind::partial, fault_kind::wire, fault_kind::line,
                                     fault_kind::hostile, fault_kind::memory})),
          calm_(lag_ns_ == 0 &&
                !draws_any(of, {fault_kind::loss, fault_kind::reset, fault_kind::tear,
                                fault_kind::exception, fault_kind::wire, fault_kind::plc_stop,
                                fault_kind::line, fault_kind::mute, fault_kind::partial,
                                fault_kind::foreign, fault_kind::stray, fault_kind::boundary})) {}
    void started() override {
        active_ns_ = read_ns_ = never;
        was_active_ = is_unapplied_ = false;
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (lag_ns_ == never) return;
        if (!seen.written.empty()) judge_reason(of_.author_of(seen), seen);
        if (!seen.written.empty() && (active_ns_ == never || seen.sent > active_ns_))
            judge(of_.author_of(seen), seen);
        if (!is_reading(facts, seen)) return;
        read_ns_ = seen.sent;
        const read_head head = head_of(facts, seen);
        if (head.whole) is_unapplied_ = false;
        if (!head.enables()) disabled_ns_ = std::max(disabled_ns_, seen.sent);
        if (!head.references(facts)) lost_ns_ = std::max(lost_ns_, seen.sent);
    }

  private:
    static bool has_tangent(const machine &of) {
        return std::any_of(of.channels.begin(), of.channels.end(),
                           [](const channel_facts &one) { return !one.tangent_signal.empty(); });
    }
    void judge_reason(const machine &facts, const exchange &seen) {
        using namespace box_reason;
        const written_block &block = block_of(facts, seen);
        static const std::set<unsigned> of_reading = {not_enabled, not_referenced, heartbeat,
                                                      signal, wait};
        static const std::set<unsigned> of_loss = {no_plc,      heartbeat, clock,
                                                   unconfirmed, unapplied, foreign};
        const time_ns most_ns = 6 * facts.period_us * us + lag_ns_;
        if (reads_judged_ && read_ns_ != never && seen.sent - read_ns_ > most_ns &&
            of_reading.count(block.reason) > 0)
            violated(fmt::format("reason {}, and the PLC was not read for {} ms", block.reason,
                                 (seen.sent - read_ns_) / ms));
        was_active_ = was_active_ || block.mode == fakeplc::box_mode::active;
        const bool acts = block.mode == fakeplc::box_mode::active && !facts.fc23;
        if (sees_ends_ && is_unapplied_ && acts && block.reason == none)
            violated("reason 13 ends without a whole reading");
        is_unapplied_ = acts && block.reason == unapplied;
        if (block.mode != fakeplc::box_mode::active) idle_ns_ = seen.sent;
        // A position that lies gives a line to a tangent another course at the PLC.
        const bool follows = of_.plc.has_followed(seen.sent - idle_ns_) &&
                             (!has_tangent(facts) || !draws(of_, fault_kind::sensors));
        if (calm_ && was_active_ && of_loss.count(block.reason) > 0 &&
            (follows || block.reason != unapplied))
            violated(fmt::format("reason {}, and each request had its reply", block.reason));
    }
    void judge(const machine &facts, const exchange &seen) {
        const written_block &block = block_of(facts, seen);
        const time_ns since_ns =
            std::exchange(active_ns_, block.mode == fakeplc::box_mode::active ? seen.sent : never);
        if (since_ns == never || block.mode == fakeplc::box_mode::active) return;
        const time_ns least_ns = since_ns - 5 * facts.period_us * us - lag_ns_;
        if (block.reason == box_reason::not_enabled && disabled_ns_ < least_ns)
            violated("ACTIVE ended by enable, which was on in each reading");
        if (block.reason == box_reason::not_referenced && lost_ns_ < least_ns)
            violated("ACTIVE ended by a reference, which all readings had");
    }

    time_ns lag_ns_;
    bool reads_judged_, sees_ends_, calm_, was_active_ = false;
    bool is_unapplied_ = false;              // by the newest write, and no reading came behind it
    time_ns read_ns_ = never, idle_ns_ = 0;  // idle: the newest write that is not ACTIVE
    time_ns active_ns_ = never;              // of the newest write, if it is ACTIVE
    time_ns disabled_ns_ = -never / 2, lost_ns_ = -never / 2;
};

// A box that no longer writes leaves no ACTIVE behind while the PLC answers readings in time,
// whatever else it leaves unanswered. A PLC whose replies come behind the deadline, or that the box
// did not read for some periods, is out of reach: silence lets its own watchdog act (decision 5).
class silence_invariant : public invariant {
  public:
    explicit silence_invariant(run &of) : invariant(of, "silence") {}
    void started() override { readings_ = 0; }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (!seen.written.empty()) {
            readings_ = 0;
            heard_ns_ = seen.sent;
            active_ = block_of(of_.author_of(seen), seen).mode == fakeplc::box_mode::active;
        } else if (is_late(facts, seen)) {
            readings_ = 0;
        } else if (is_reading(facts, seen)) {
            const time_ns silent_ns = seen.sent - std::exchange(heard_ns_, seen.sent);
            active_ = active_ && 2 * silent_ns < 5 * facts.period_us * us;  // the box: 3 periods
            if (++readings_ > most_readings && active_ && !disturbed())
                violated(fmt::format("{} readings without a write, and the status is ACTIVE",
                                     readings_));
        }
    }

  private:
    static constexpr std::uint64_t most_readings = 16;  // the box: five, if a late reply is awaited
    static constexpr time_ns way = ms;  // of request and reply on the wire, and to the step
    // Two requests of fc3+fc16 have to end before the deadline.
    static bool is_late(const machine &facts, const exchange &seen) {
        const time_ns budget_ns = facts.period_us * us * 4 / 5 / (facts.fc23 ? 1 : 2);
        return is_reading(facts, seen) && seen.duration > budget_ns - way;
    }
    bool disturbed() const {
        // Without the reply of FC23 the box has to read back before it may write (decision 5).
        if (of_.running().fc23 && draws(of_, fault_kind::mute)) return true;
        // A slow slave on a serial line answers readings too late as well, and short writes take
        // the last write away.
        if (draws_any(of_, {fault_kind::slow, fault_kind::partial}) &&
            !of_.box_machine.plc_device.empty())
            return true;
        return draws_any(of_, {fault_kind::memory, fault_kind::foreign, fault_kind::reset,
                               fault_kind::plc_stop, fault_kind::loss, fault_kind::refuse,
                               fault_kind::wire, fault_kind::exception, fault_kind::stray});
    }
    std::uint64_t readings_ = 0;
    time_ns heard_ns_ = 0;  // the newest write, or reading with a reply in time
    bool active_ = false;
};

}  // namespace

void add_modes(run &of, invariants &all) {
    all.push_back(std::make_unique<evidence_invariant>(of));
    all.push_back(std::make_unique<essential_invariant>(of));
    all.push_back(std::make_unique<permission_invariant>(of));
    all.push_back(std::make_unique<reset_invariant>(of));
    all.push_back(std::make_unique<status_invariant>(of));
    all.push_back(std::make_unique<reason_invariant>(of));
    all.push_back(std::make_unique<silence_invariant>(of));
}

}  // namespace compbox::world
