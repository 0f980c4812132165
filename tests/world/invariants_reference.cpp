// SPDX-License-Identifier: MIT
// In ACTIVE each output goes where its terms want it: at once as far as its slew rate allows, in
// each step, also while axes move and temperatures change. What the terms want is computed again
// (reference.h). Judged where the box gets each reading that the PLC gave, some time behind each
// write that is not confirmed.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/reference.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

class reference_invariant : public invariant {
  public:
    explicit reference_invariant(run &of) : invariant(of, "reference") {
        samples_arrive_ = !draws_any(of, {fault_kind::can, fault_kind::reload});
        measurements_arrive_ = samples_arrive_ && hears_measurements(of);
    }
    void started() override {
        if (of_.starts() > 1 && draws(of_, fault_kind::reload)) box_.reset();  // which file it runs
        if (of_.starts() == 1 && !hides_exchanges(of_)) box_.emplace(of_.running());
        if (box_) box_->start(of_.starts() > 1 || of_.box.files.has(run::state_path));
        steady_ = calm_ = readings_ = 0;
        silent_ = of_.starts() > 1;
    }
    void taken(const machine &, const machine &is) override {
        if (box_) box_->take(is);
        steady_ = calm_ = 0;
    }
    void sampled(const std::string &signal, double value) override {
        const bool by_hand = signal[0] == 'H';
        if (box_ && (by_hand ? measurements_arrive_ : samples_arrive_))
            box_->sample(signal, value, of_.time.now());
    }
    void exchanged(const exchange &seen) override {
        if (!box_) return;
        const machine &facts = of_.running_at(seen.sent);
        if (seen.duration == never || seen.exception != 0)
            open_until_ns_ = settled_behind(facts, seen);
        if (!seen.written.empty()) follow(facts, block_of(facts, seen), seen);
        if (seen.duration == never) return;
        if (seen.function != 16) replied_ns_ = seen.now + seen.duration;
        looked_back_ = looked_back_ || is_read_back(facts, seen);
        if (!is_reading(facts, seen)) return;
        if (!head_of(facts, seen).whole) return;
        box_->read(facts, seen, seen.sent);
        read_ns_ = seen.sent;
        ++readings_;
        applied_um_ = all_applied_in(facts, seen);
    }

  private:
    // Steps in a row from which nothing is missing; before that the box may have had another past.
    static constexpr int settled = 8;
    // What one channel wants: its target within its limit.
    struct target {
        double um, near;
        bool at_limit;
    };

    // Behind a write that may have an effect or not, and behind a silence, the box allows for both
    // for a while (docs/decisions/0003-what-the-plc-may-hold.md).
    static time_ns settled_behind(const machine &facts, const exchange &seen) {
        return seen.sent + 4 * longest_late(facts);
    }

    void follow(const machine &facts, const written_block &block, const exchange &seen) {
        using namespace box_reason;
        const time_ns gap_ns = seen.sent - sent_ns_, period_ns = facts.period_us * us;
        const bool on_time = 2 * gap_ns > period_ns && 2 * gap_ns < 3 * period_ns && readings_ == 1;
        const bool follows =
            on_time && block.mode == fakeplc::box_mode::active &&
            (block.reason == none || block.reason == degraded || block.reason == limited ||
             block.reason == extrapolated || block.reason == drifted);
        steady_ = follows ? steady_ + 1 : 0;
        if (std::exchange(silent_, false) || (sent_ns_ > 0 && 2 * gap_ns >= 3 * period_ns))
            open_until_ns_ = settled_behind(facts, seen);
        // The box steps behind a reading: before it sends FC16, behind the reply to FC23 or to the
        // read-back that follows it. Frames of another length take another time.
        const time_ns stepped_ns = facts.fc23 ? replied_ns_ : seen.sent;
        const time_ns unsure_ns = std::exchange(looked_back_, false) ? 3 * ms : 500 * us;
        elapsed_s_ = 1e-9 * static_cast<double>(stepped_ns -
                                                std::exchange(stepped_ns_, stepped_ns) - unsure_ns);
        const bool settled_now = seen.sent > open_until_ns_;
        if (steady_ >= settled && settled_now && box_->knows()) judge(facts, block);
        calm_ = on_time ? calm_ + 1 : 0;
        if (calm_ >= settled && settled_now) judge_pause(facts, block);
        sent_ns_ = seen.sent;
        before_ = block;
        readings_ = 0;
    }

    void judge(const machine &facts, const written_block &block) {
        box_->look(read_ns_);
        judge_slopes(facts, block);
        const std::string *const beyond = box_->beyond_training();
        if (beyond != nullptr &&
            (block.reason == box_reason::none || block.reason == box_reason::drifted))
            violated(fmt::format("{} is beyond the training range of a term, and the reason is {}",
                                 *beyond, block.reason));
        for (std::size_t c = 0; c < facts.channels.size(); ++c)
            if (block.reason != box_reason::degraded && box_->lacks_input(c, read_ns_))
                violated(fmt::format("a term of {} lacks a signal, and the reason is {}",
                                     facts.channels[c].name, block.reason));
        if (agree(facts, block) || ++unlike_ % 2 == 0) return;
        std::vector<target> targets;
        for (std::size_t c = 0; c < facts.channels.size(); ++c)
            targets.push_back(target_of(facts, c));
        for (const pair_facts &pair : facts.pairs) {
            join(facts, pair, targets);
            judge_standing(facts, pair, targets, block);
        }
        for (std::size_t c = 0; c < targets.size(); ++c) {
            const std::optional<std::size_t> other = partner_of(facts, c);
            if (std::isnan(targets[c].um) || waits(facts, c, targets) ||
                (other && waits(facts, *other, targets)))
                continue;
            if (other && !is_reached(facts, *other, targets[*other])) continue;
            if (is_reached(facts, c, targets[c]))
                judge_arrival(facts.channels[c], targets[c], before_.um[c], block.um[c]);
            else if (!other)
                judge_way(facts, c, targets[c], block.um[c]);
        }
    }

    // A fault stays while its cause lasts, and only in ACTIVE anything follows an axis.
    void judge_pause(const machine &facts, const written_block &block) {
        using namespace box_reason;
        const bool ends = before_.mode == fakeplc::box_mode::fault && before_.reason == demand &&
                          block.mode != fakeplc::box_mode::fault && block.reason != stop &&
                          block.mode != fakeplc::box_mode::stopped;
        if (ends && box_->knows()) judge_end_of_demand(facts);
        const bool rests =
            block.mode != fakeplc::box_mode::active && before_.mode != fakeplc::box_mode::active;
        for (std::size_t c = 0; rests && c < facts.channels.size(); ++c) {
            const channel_facts &channel = facts.channels[c];
            if (!comes_near(channel, 0, 2 * channel.slope_unit, before_.slope[c], block.slope[c]))
                violated(fmt::format("the slope of {} is {} after {} in mode {}", channel.name,
                                     block.slope[c], before_.slope[c], block.mode));
        }
    }
    void judge_end_of_demand(const machine &facts) {
        box_->look(read_ns_);
        for (std::size_t c = 0; c < facts.channels.size(); ++c) {
            const judged_number want = box_->judged_um(c);
            if (std::fabs(want.value) - want.near > facts.channels[c].error_um * (1 + 1e-5))
                violated(
                    fmt::format("a fault was reset, and the terms of {} want {} um, beyond "
                                "its error_um of {} um",
                                facts.channels[c].name, want.value, facts.channels[c].error_um));
        }
    }

    // The slope of a channel with `tangent` is that of its terms where they were evaluated, as far
    // as its own rate allows, and 0 beyond the channel's limit.
    void judge_slopes(const machine &facts, const written_block &block) {
        if (++slopes_ % 4 != 0) return;
        for (std::size_t c = 0; c < facts.channels.size(); ++c) {
            const std::string &axis = facts.channels[c].tangent_signal;
            if (axis.empty()) continue;
            const judged_number place = box_->judged_place(axis);
            if (box_->lacks(axis, read_ns_)) judge_lost_slope(facts.channels[c], c, block.slope[c]);
            if (std::isnan(place.value)) continue;
            const double reference_unit = 1e-3;
            if (std::fabs(block.reference_mm[c] - place.value) > place.near + reference_unit)
                violated(
                    fmt::format("the slope of {} begins at {} mm, its terms are those of {} mm",
                                facts.channels[c].name, block.reference_mm[c], place.value));
            judge_slope(facts.channels[c], box_->judged_um(c), box_->judged_slope(c, axis),
                        before_.slope[c], block.slope[c]);
        }
    }
    // Without the position it goes to zero.
    void judge_lost_slope(const channel_facts &channel, std::size_t c, double slope) {
        if (!comes_near(channel, 0, 2 * channel.slope_unit, before_.slope[c], slope))
            violated(fmt::format("the slope of {} is {} after {}, and its position is too old",
                                 channel.name, slope, before_.slope[c]));
    }
    void judge_slope(const channel_facts &channel, const judged_number &want,
                     const judged_number &slope, double was, double is) {
        const double beyond_um = std::fabs(want.value) - channel.limit_um;
        if (std::isnan(slope.value) || std::fabs(beyond_um) <= want.near) return;
        const double most = beyond_um > 0 ? 0 : channel.slope_limit;
        const double to = std::clamp(1e-3 * slope.value, -most, most);
        const double near = 1e-3 * slope.near + 2 * channel.slope_unit;
        if (!comes_near(channel, to, near, was, is))
            violated(fmt::format("the slope of {} is {} after {}, its terms have {} within {}",
                                 channel.name, is, was, to, near));
    }

    // out: whether a slope has come nearer by its rate, or is there
    bool comes_near(const channel_facts &channel, double to, double near, double was,
                    double is) const {
        const double step = 0.97 * elapsed_s_ * channel.slope_slew_per_s;
        return std::fabs(is - to) <= std::max(std::fabs(to - was) - step, 0.0) + near;
    }

    // Most steps need no look at how far the box may be from the reference.
    bool agree(const machine &facts, const written_block &block) const {
        for (std::size_t c = 0; c < facts.channels.size(); ++c) {
            const channel_facts &channel = facts.channels[c];
            const double want_um = box_->wanted_um(c);
            if (std::isnan(want_um)) continue;
            const double um = std::clamp(want_um, -channel.limit_um, channel.limit_um);
            if (std::fabs(want_um) > channel.error_um ||
                rests(channel, {um, 0, false}, before_.um[c]) ||
                std::fabs(um - block.um[c]) > 0.51 * channel.unit_um + 2e-3)
                return false;
        }
        return true;
    }
    target target_of(const machine &facts, std::size_t c) {
        const channel_facts &channel = facts.channels[c];
        const judged_number want = box_->judged_um(c);
        if (std::fabs(want.value) - want.near > channel.error_um * (1 + 1e-5))
            violated(fmt::format(
                "the terms of {} want {} um, beyond its error_um of {} um, and the box is ACTIVE",
                channel.name, want.value, channel.error_um));
        const double um = std::isnan(want.value)
                              ? want.value
                              : std::clamp(want.value, -channel.limit_um, channel.limit_um);
        return {um, want.near, std::fabs(want.value) + want.near >= channel.limit_um};
    }
    // No motor goes further from the other's limit than the pair allows. Two whose targets are then
    // too far apart meet: each gives way by the same.
    static void join(const machine &facts, const pair_facts &pair, std::vector<target> &targets) {
        target &a = targets[pair.first], &b = targets[pair.second];
        const double a_most = facts.channels[pair.second].limit_um + pair.most_um;
        const double b_most = facts.channels[pair.first].limit_um + pair.most_um;
        if (!std::isnan(a.um)) a.um = std::clamp(a.um, -a_most, a_most);
        if (!std::isnan(b.um)) b.um = std::clamp(b.um, -b_most, b_most);
        const double excess = std::fabs(a.um - b.um) - pair.most_um;
        // The target of an output within its deadband is where it is, and one follows the other's
        // rounding.
        const channel_facts &first = facts.channels[pair.first],
                            &second = facts.channels[pair.second];
        a.near = b.near = a.near + b.near + first.deadband_um + second.deadband_um +
                          2 * std::max(first.unit_um, second.unit_um);
        if (std::isnan(excess)) a.um = b.um = excess;
        if (!(excess > -a.near)) return;
        a.at_limit = b.at_limit = true;
        if (!(excess > 0)) return;
        const double give = a.um > b.um ? excess / 2 : -excess / 2;
        a.um -= give;
        b.um += give;
    }
    // A pair that is not at its targets moves: the way of each motor waits for the other's alone.
    void judge_standing(const machine &facts, const pair_facts &pair,
                        const std::vector<target> &targets, const written_block &block) {
        constexpr int most = 20;  // steps in a row that are looked at
        bool stands = steady_ > settled, is_away = false;
        for (const std::size_t c : {pair.first, pair.second}) {
            const channel_facts &channel = facts.channels[c];
            const target &to = targets[c];
            stands = stands && !std::isnan(to.um) && !waits(facts, c, targets) &&
                     stays(channel, before_.um[c], block.um[c]);
            is_away = is_away || std::fabs(block.um[c] - to.um) > to.near + 2 * channel.unit_um;
        }
        stands_ = stands && is_away ? stands_ + 1 : 0;
        if (stands_ > most)
            violated(fmt::format("{} and {} stand at {} and {} um, their targets are {} and {} um",
                                 facts.channels[pair.first].name, facts.channels[pair.second].name,
                                 block.um[pair.first], block.um[pair.second],
                                 targets[pair.first].um, targets[pair.second].um));
    }
    // out: the way of this step, at least
    double step_um(const machine &facts, const channel_facts &channel) const {
        return 0.97 * elapsed_s_ * least_slew_um_per_s(facts, channel);
    }
    // Whether the output may have to wait until a control with a largest step applies the value
    // before, and until the box has read that.
    bool waits(const machine &facts, std::size_t c, const std::vector<target> &targets) const {
        const double most_um = 0.9 * facts.step_units * facts.channels[c].unit_um;
        return facts.step_units > 0 && facts.channels[c].has_applied &&
               !(std::fabs(applied_um_[c] - before_.um[c]) < most_um &&
                 std::fabs(applied_um_[c] - targets[c].um) < most_um);
    }
    bool is_reached(const machine &facts, std::size_t c, const target &to) const {
        const channel_facts &channel = facts.channels[c];
        return std::fabs(to.um - before_.um[c]) + to.near + 2 * channel.unit_um <=
               step_um(facts, channel);
    }
    static bool stays(const channel_facts &channel, double was_um, double is_um) {
        return std::fabs(is_um - was_um) < 0.1 * channel.unit_um + 1e-6;
    }
    // Within its deadband an output stays, but for zero and its limit.
    static bool rests(const channel_facts &channel, const target &to, double was_um) {
        return !to.at_limit && std::fabs(to.um) > to.near + 2 * channel.unit_um &&
               std::fabs(to.um - was_um) + to.near + 2 * channel.unit_um < channel.deadband_um;
    }
    void judge_arrival(const channel_facts &channel, const target &to, double was_um,
                       double is_um) {
        const double rounding_um = (to.at_limit ? 2.0 : 0.51) * channel.unit_um;
        const bool is_same = stays(channel, was_um, is_um);
        const bool to_zero = std::fabs(to.um) + to.near < 0.49 * channel.unit_um;
        const double most_um =
            to.near + rounding_um + (is_same && !to_zero ? channel.deadband_um : 0);
        if (!is_same && rests(channel, to, was_um))
            violated(fmt::format(
                "{} moves from {} um to {} um, its terms want {} um: within its deadband of {} um",
                channel.name, was_um, is_um, to.um, channel.deadband_um));
        if (std::fabs(is_um - to.um) <= most_um) return;
        violated(fmt::format("{} is {} um after {} um, its terms want {} um within {} um",
                             channel.name, is_um, was_um, to.um, most_um));
    }
    // Beyond one step's way the output comes nearer by most of what it may.
    void judge_way(const machine &facts, std::size_t c, const target &to, double is_um) {
        const channel_facts &channel = facts.channels[c];
        const double rest_um = to.um - before_.um[c], step = step_um(facts, channel);
        if (std::fabs(rest_um) - to.near < 1.3 * step + 2 * channel.unit_um + channel.deadband_um)
            return;
        const double way_um = (is_um - before_.um[c]) * (rest_um > 0 ? 1 : -1);
        if (way_um >= step - 2.01 * channel.unit_um - 1e-5 * std::fabs(is_um)) return;
        violated(fmt::format("{} moves by {} um towards {} um, {} um are possible", channel.name,
                             way_um, to.um, step));
    }

    std::optional<reference_box> box_;
    bool samples_arrive_ = true, measurements_arrive_ = true;
    bool silent_ = false;               // since the end of another daemon
    bool looked_back_ = false;          // since the newest write
    int steady_ = 0, calm_ = 0;         // steps in a row, in ACTIVE and in any mode
    int readings_ = 0;                  // since the newest write
    int stands_ = 0;                    // steps in which the pair stood, and was away
    unsigned unlike_ = 0, slopes_ = 0;  // not each of them is judged
    time_ns open_until_ns_ = 0, sent_ns_ = 0, read_ns_ = 0, replied_ns_ = 0, stepped_ns_ = 0;
    double elapsed_s_ = 0;            // between the two newest steps, at least
    std::vector<double> applied_um_;  // of each channel, in the newest reading
    written_block before_;
};

// out: of the time between two writes, that in which the PLC certainly served
time_ns served_ns(const machine &facts, time_ns gap_ns) {
    return std::min(gap_ns, 2 * facts.period_us * us);
}

// Replies that are lost hold an output back for two turns at most, then it moves on
// (docs/decisions/0003-what-the-plc-may-hold.md). Time counts while writes are confirmed. A target
// that is near all that may still take effect is reached at once.
class progress_invariant : public invariant {
  public:
    explicit progress_invariant(run &of)
        : invariant(of, "progress"),
          is_regular_(of.box_machine.plc_device.empty() && of.box_machine.profile.name != "fanuc" &&
                      !draws_any(of, {fault_kind::reset, fault_kind::exception, fault_kind::mute,
                                      fault_kind::slow, fault_kind::clock})) {
        const bool loses = draws_any(
            of, {fault_kind::loss, fault_kind::mute, fault_kind::reset, fault_kind::exception});
        const bool knows =
            longest_lag(of) == 0 &&
            !draws_any(of, {fault_kind::hostile, fault_kind::reload, fault_kind::memory,
                            fault_kind::foreign, fault_kind::wire, fault_kind::line,
                            fault_kind::tear, fault_kind::partial, fault_kind::stray,
                            fault_kind::plc_stop, fault_kind::boundary});
        if (loses && knows) box_.emplace(of.box_machine);
    }
    void started() override {
        if (box_) box_->start(of_.starts() > 1 || of_.box.files.has(run::state_path));
        waits_.clear();
        lost_.clear();
        since_ns_ = never;
    }
    void exchanged(const exchange &seen) override {
        if (!box_) return;
        const machine &facts = of_.running_at(seen.sent);
        if (!seen.written.empty()) judge(facts, seen);
        if (seen.duration == never || !is_reading(facts, seen) || !head_of(facts, seen).whole)
            return;
        box_->read(facts, seen, seen.sent);
        read_ns_ = seen.sent;
    }

  private:
    // An output that does not move on.
    struct waiting {
        double um = 0;
        time_ns for_ns = 0;    // of confirmed writes
        bool was_far = false;  // already when it had waited for as long before
    };
    static double reach_um(const machine &facts, std::size_t c) {
        const double rate = least_slew_um_per_s(facts, facts.channels[c]);
        return 2e-6 * static_cast<double>(facts.period_us) * rate;
    }
    void judge(const machine &facts, const exchange &seen) {
        using namespace box_reason;
        const written_block &block = block_of(facts, seen);
        const time_ns gap_ns = seen.sent - std::exchange(sent_ns_, seen.sent);
        const time_ns longest_ns = 6 * longest_late(facts);
        const bool runs = block.mode == fakeplc::box_mode::active &&
                          (block.reason == none || block.reason == limited ||
                           block.reason == degraded || block.reason == extrapolated) &&
                          gap_ns < contact_lasts(facts);
        const bool follows = 2 * gap_ns < 3 * facts.period_us * us;
        in_a_row_ = follows && seen.duration != never ? in_a_row_ + 1 : 0;
        if (!runs) since_ns_ = never;
        if (!runs) return waits_.clear();
        if (since_ns_ == never) since_ns_ = seen.sent;
        while (!lost_.empty() && lost_.front().at_ns < seen.sent - longest_ns) lost_.pop_front();
        if (!lost_.empty() && is_regular_ && in_a_row_ > 3 && seen.sent - since_ns_ > longest_ns) {
            box_->look(read_ns_);
            for (std::size_t c = 0; c < facts.channels.size(); ++c) judge_near(facts, block, c);
        }
        if (seen.duration == never) lost_.push_back({seen.sent, block.um});
        sent_um_ = block.um;
        waits_.resize(facts.channels.size());
        for (std::size_t c = 0; c < waits_.size(); ++c) {
            const double way_um = std::fabs(block.um[c] - waits_[c].um);
            if (way_um > 1.2 * reach_um(facts, c) + facts.channels[c].unit_um)
                waits_[c] = {block.um[c], 0, false};
            if (seen.duration != never) waits_[c].for_ns += served_ns(facts, gap_ns);
            if (waits_[c].for_ns > longest_ns) judge_waiting(facts, block, c);
        }
    }
    void judge_near(const machine &facts, const written_block &block, std::size_t c) {
        const channel_facts &channel = facts.channels[c];
        const double reach = reach_um(facts, c);
        const judged_number want = box_->judged_um(c);
        const double to_um = std::clamp(want.value, -channel.limit_um, channel.limit_um);
        const auto is_far = [=](double um) { return std::fabs(um - to_um) > 0.4 * reach; };
        const bool is_held = std::any_of(lost_.begin(), lost_.end(),
                                         [&](const lost_write &one) { return is_far(one.um[c]); });
        if (is_held || is_far(sent_um_[c]) || partner_of(facts, c) || !box_->knows()) return;
        const double off_um = std::fabs(block.um[c] - to_um);
        if (off_um > want.near + channel.deadband_um + 2 * channel.unit_um + 0.05)
            violated(
                fmt::format("{} is {} um, its terms want {} um, and no write without a reply "
                            "is far from it",
                            channel.name, block.um[c], to_um));
    }
    // Where a target moves there and back an output may be near it now and then.
    void judge_waiting(const machine &facts, const written_block &block, std::size_t c) {
        const channel_facts &channel = facts.channels[c];
        box_->look(read_ns_);
        const judged_number want = box_->judged_um(c);
        const double to_um = std::clamp(want.value, -channel.limit_um, channel.limit_um);
        const double far_um = std::fabs(to_um - block.um[c]) - want.near - channel.deadband_um;
        const bool is_far =
            !partner_of(facts, c) && box_->knows() && far_um > 3 * reach_um(facts, c);
        if (is_far && waits_[c].was_far)
            violated(
                fmt::format("{} stays at {} um for {} ms of confirmed writes, its terms want "
                            "{} um",
                            channel.name, block.um[c], waits_[c].for_ns / ms, to_um));
        waits_[c] = {block.um[c], 0, is_far};
    }

    std::optional<reference_box> box_;
    std::vector<waiting> waits_;  // by channel
    struct lost_write {
        time_ns at_ns;
        std::vector<double> um;
    };
    std::deque<lost_write> lost_;  // those that may still take effect
    std::vector<double> sent_um_;  // the newest
    bool is_regular_;              // the box gets each reading and reply that was not lost
    int in_a_row_ = 0;             // writes with a reply, each a period behind the one before
    time_ns sent_ns_ = 0, read_ns_ = 0, since_ns_ = never;
};

// Without permission, and behind a lost contact that outlasts HOLD, outputs come nearer to zero, as
// long as writes are confirmed. The write that may still take effect delays that for a while. A
// control that takes small steps alone gets none while it applies another client's value, or
// stands.
class retreat_invariant : public invariant {
  public:
    explicit retreat_invariant(run &of)
        : invariant(of, "retreat"),
          judged_(!draws_any(of, {fault_kind::hostile, fault_kind::reload, fault_kind::memory,
                                  fault_kind::wire, fault_kind::line, fault_kind::tear,
                                  fault_kind::partial, fault_kind::stray, fault_kind::boundary})) {
        const bool has_steps = of.box_machine.profile.name == "fanuc" ||
                               of.box_machine.text.find("max_step_units") != std::string::npos;
        if (has_steps && draws_any(of, {fault_kind::foreign, fault_kind::plc_stop}))
            judged_ = false;
    }
    void started() override { waits_.clear(); }
    void exchanged(const exchange &seen) override {
        if (!judged_) return;
        const machine &facts = of_.running_at(seen.sent);
        const bool confirmed = seen.duration != never && seen.exception == 0;
        if (is_reading(facts, seen) && confirmed) read_ns_ = seen.sent;
        if (seen.written.empty()) return;
        const written_block &block = block_of(facts, seen);
        const time_ns gap_ns = seen.sent - std::exchange(sent_ns_, seen.sent);
        const bool rests = block.mode == fakeplc::box_mode::standby ||
                           block.mode == fakeplc::box_mode::ramp ||
                           block.mode == fakeplc::box_mode::fault;
        if (!rests || gap_ns > contact_lasts(facts)) return waits_.clear();
        waits_.resize(facts.channels.size());
        // Without a reading the box does not know what a control with a largest step applies.
        const bool reads = seen.sent - read_ns_ < contact_lasts(facts);
        for (std::size_t c = 0; c < waits_.size(); ++c) {
            const channel_facts &channel = facts.channels[c];
            const bool may_go_on = reads || !channel.has_applied || facts.step_units == 0;
            judge(facts, channel, std::fabs(block.um[c]),
                  confirmed && may_go_on ? served_ns(facts, gap_ns) : 0, waits_[c]);
        }
    }

  private:
    struct waiting {
        double um = 0;
        time_ns for_ns = 0;  // of confirmed writes
    };
    void judge(const machine &facts, const channel_facts &channel, double um, time_ns gap_ns,
               waiting &now) {
        if (um <= channel.unit_um + channel.deadband_um || um < now.um)
            now = {um, 0};
        else
            now = {um, now.for_ns + gap_ns};
        const double rate = std::min(facts.ramp_um_per_s, channel.slew_um_per_s);
        const auto unit_ns = static_cast<time_ns>(1e9 * channel.unit_um / rate);
        if (now.for_ns > 6 * longest_late(facts) + 2 * unit_ns)
            violated(fmt::format("{} stays at {} um for {} ms of confirmed writes, without ACTIVE",
                                 channel.name, um, now.for_ns / ms));
    }

    bool judged_;
    std::vector<waiting> waits_;  // by channel
    time_ns sent_ns_ = 0, read_ns_ = 0;
};

}  // namespace

void add_reference(run &of, invariants &all) {
    all.push_back(std::make_unique<reference_invariant>(of));
    all.push_back(std::make_unique<progress_invariant>(of));
    all.push_back(std::make_unique<retreat_invariant>(of));
}

}  // namespace compbox::world
