// SPDX-License-Identifier: MIT
// Bounds of what the PLC gets and what it applies: docs/DESIGN.md "Limits", firmware/box/limiter.c.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

// |output| <= limit, of slopes too, and finite. After a reload to a smaller limit an output walks
// inside: it is no larger than before.
class size_invariant : public invariant {
  public:
    explicit size_invariant(run &of) : invariant(of, "size") {}
    void exchanged(const exchange &seen) override {
        if (seen.written.empty() || of_.files_taken() > 1) return;
        const machine &facts = of_.author_of(seen);
        const written_block &block = block_of(facts, seen);
        for (std::size_t c = 0; c < block.um.size(); ++c) {
            const channel_facts &channel = facts.channels[c];
            check(channel.name, block.um[c], channel.limit_um);
            check("the slope of " + channel.name, block.slope[c], channel.slope_limit);
        }
    }

  private:
    void check(const std::string &of, double value, double limit) {
        const double most = limit * (1 + 1e-6) + (limit > 0.01 ? 1e-6 : 1e-9);
        if (std::isfinite(value) && std::fabs(value) <= most) return;
        violated(fmt::format("{} is {}, its limit {}", of, value, limit));
    }
};

// The two motors of a stage are never further apart than allowed.
class pair_invariant : public invariant {
  public:
    explicit pair_invariant(run &of) : invariant(of, "pair") {}
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.author_of(seen);
        if (seen.written.empty() || facts.pairs.empty() || of_.files_taken() > 1) return;
        const written_block &block = block_of(facts, seen);
        for (const pair_facts &pair : facts.pairs) {
            const double apart_um = std::fabs(block.um[pair.first] - block.um[pair.second]);
            if (apart_um <= pair.most_um * (1 + 1e-6) + 1e-4) continue;  // of two float32
            violated(fmt::format("{} and {} are {} µm apart, allowed are {} µm",
                                 facts.channels[pair.first].name, facts.channels[pair.second].name,
                                 apart_um, pair.most_um));
        }
    }
};

// Whichever writes take effect, and in whatever order: from one value of the PLC to the next at
// most slew x 2 periods, plus a unit. And over a longer time, by the times of sending, at most
// slew x time. Between the writes of two files the faster one counts: the box may stay where the
// file before brought it in a write that the PLC never got (firmware/box/limiter.c). A write
// without a reply may take effect until T is over (decision 3), so each value stays near it, too.
class slew_invariant : public invariant {
  public:
    explicit slew_invariant(run &of) : invariant(of, "slew"), lag_ns_(longest_lag(of)) {}
    void started() override {
        before_.reset();
        past_.clear();
        unanswered_.clear();
    }
    // A window of writes is judged by the rates of one file.
    void taken(const machine &, const machine &) override {
        past_.clear();
        unanswered_.clear();
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (places_outputs(facts, seen)) {
            started();
            placed_ns_ = std::max(placed_ns_, seen.sent);
            refused_ = seen.exception != 0;
        }
        if (is_reading(facts, seen) &&
            seen.sent >= read_ns_) {  // not a late one of a connection given up
            reads_alone_ = seen.function == 3;
            read_ns_ = seen.sent;
        }
        if (seen.written.empty()) return;
        const machine &author = of_.author_of(seen);
        written_block block = block_of(author, seen);
        if (seen.sent < placed_ns_) leave_applied_out(author, block);
        const bool again = before_ && before_->heartbeat == block.heartbeat;  // on a serial line
        if (before_)
            check(*author_, author, *before_, block, 2 * period_s(facts),
                  "from one write to the next");
        before_ = block;
        author_ = &author;
        judge_late(author, seen, block);
        if (again) return;
        if (seen.sent - sent_ns_ > 4 * facts.period_us * us) gap_ns_ = seen.sent;
        unheard_ = seen.duration == never ? unheard_ + 1 : 0;
        if (block.reason == box_reason::unconfirmed || unheard_ >= 4) unconfirmed_ns_ = seen.sent;
        sent_ns_ = std::max(sent_ns_, seen.sent);
        if (lag_ns_ != never) look_back(author, {seen.sent, std::move(block)});
    }

  private:
    struct sent_block {
        time_ns sent;
        written_block block;
    };
    // After lost contact the outputs go on from what the PLC applies or holds (decision 5). The box
    // reads the block back then. With FC23 it has read without a write before; with FC3 and FC16 it
    // has not written for some periods, or had replies to its writes too late.
    bool places_outputs(const machine &facts, const exchange &seen) const {
        const bool refused = seen.function == 3 && seen.exception != 0;
        if (facts.fc23) return (is_read_back(facts, seen) || refused) && reads_alone_;
        const time_ns period_ns = facts.period_us * us;
        const bool lost = draws_any(of_, {fault_kind::plc_stop, fault_kind::line}) ||
                          (refused && draws(of_, fault_kind::delay));
        return (is_read_back(facts, seen) || refused) &&
               (lost || 2 * (seen.sent - sent_ns_) > 3 * period_ns ||
                seen.sent - std::max(gap_ns_, unconfirmed_ns_) < 5 * period_ns);
    }
    // A late write, sent before the outputs were placed, brings a register back to where the box
    // found it. An output that was placed at the applied value, at another client's, or at zero
    // because the PLC refused the read-back, may be far from there, so the two are not compared.
    void leave_applied_out(const machine &facts, written_block &block) const {
        for (std::size_t c = 0; c < block.um.size(); ++c) {
            if (facts.channels[c].has_applied || refused_ || draws(of_, fault_kind::foreign))
                block.um[c] = before_ ? before_->um[c] : std::nan("");  // no step from or to it
            if (refused_ || draws(of_, fault_kind::foreign))            // no `applied` has a slope
                block.slope[c] = before_ ? before_->slope[c] : std::nan("");
        }
    }
    static double period_s(const machine &facts) {
        return 1e-6 * static_cast<double>(facts.period_us);
    }

    // in : two blocks, their files, and the time in which the box may have moved from one to the
    //      other. A channel that is new comes from zero.
    void check(const machine &was, const machine &is, const written_block &from,
               const written_block &to, double time_s, const char *words, double units = 2.01) {
        for (std::size_t c = 0; c < std::min(from.um.size(), to.um.size()); ++c) {
            const channel_facts &channel = is.channels[c];
            const double slew_um_per_s =
                std::max(slew_most(was, was.channels[c]), slew_most(is, channel));
            const double slope_slew_per_s =
                std::max(was.channels[c].slope_slew_per_s, channel.slope_slew_per_s);
            const double most_um = slew_um_per_s * time_s + units * channel.unit_um + 1e-3;
            const double step_um = std::fabs(to.um[c] - from.um[c]);
            if (step_um > most_um)
                violated(fmt::format("{} moves by {} µm {}, allowed are {} µm", channel.name,
                                     step_um, words, most_um));
            const double most = slope_slew_per_s * time_s + 2.01 * channel.slope_unit + 1e-9;
            const double step = std::fabs(to.slope[c] - from.slope[c]);
            if (step > most)
                violated(fmt::format("the slope of {} moves by {} {}, allowed are {}", channel.name,
                                     step, words, most));
        }
    }

    // Only time in which the PLC's heartbeat is alive counts, so T is as long or longer.
    void judge_late(const machine &facts, const exchange &seen, const written_block &block) {
        if (draws(of_, fault_kind::foreign)) return;
        const time_ns late_ns = longest_late(facts);
        while (!unanswered_.empty() && unanswered_.front().sent < seen.sent - late_ns)
            unanswered_.pop_front();
        for (const sent_block &one : unanswered_)
            if (one.sent < seen.sent)
                check(facts, facts, one.block, block, 2 * period_s(facts),
                      "from one that may still take effect");
        // On a serial line a write is sent again, and counts once.
        if (seen.duration != never)
            unanswered_.erase(std::remove_if(unanswered_.begin(), unanswered_.end(),
                                             [&](const sent_block &one) {
                                                 return one.block.heartbeat == block.heartbeat;
                                             }),
                              unanswered_.end());
        else
            unanswered_.push_back({seen.sent, block});
    }

    // Compares with blocks of some periods ago.
    void look_back(const machine &facts, sent_block now) {
        if (!past_.empty() && now.sent < past_.back().sent) return;  // of a given-up connection
        past_.push_back(std::move(now));
        if (past_.size() > many) past_.pop_front();
        for (const std::size_t writes : {few, many}) {
            if (past_.size() < writes) continue;
            const sent_block &before = past_[past_.size() - writes], &newest = past_.back();
            const bool prompt = lag_ns_ == 0 && !facts.fc23 && facts.plc_device.empty();
            const time_ns apart_ns =
                newest.sent - before.sent + lag_ns_ + (prompt ? 0 : longest_between_steps(facts));
            const double time_s =
                1e-9 * static_cast<double>(apart_ns) + (prompt ? 0.05 : 0.2) * period_s(facts);
            check(facts, facts, before.block, newest.block, time_s,
                  writes == few ? "over twelve writes" : "over many writes", prompt ? 1.05 : 2.01);
        }
    }
    // out: the channel's rate, which a control with a largest step may lower (docs/plc-profiles.md)
    static double slew_most(const machine &of, const channel_facts &channel) {
        if (of.step_units == 0) return channel.slew_um_per_s;
        const auto &plc = of.file().at("plc");
        const std::size_t in_a_row = plc.value("axes_at_once", false) ? 1 : of.channels.size();
        const double update_s = 4e-3 * plc.value("scan_ms", 8.0) * static_cast<double>(in_a_row);
        const double lowered = (of.step_units - 1) * channel.unit_um / std::max(1.0, 10 * update_s);
        return std::min(channel.slew_um_per_s, lowered);
    }

    static constexpr std::size_t few = 12, many = 200;

    time_ns lag_ns_, sent_ns_ = 0;
    time_ns placed_ns_ = -never / 2;  // the newest read-back behind which the outputs were placed
    bool refused_ = false;            // that one was answered by an exception
    time_ns gap_ns_ = -never / 2;     // last write after a pause …
    time_ns unconfirmed_ns_ = -never / 2;  // … and last one that says that replies are too late,
    int unheard_ = 0;                      // or that has none, as those before it
    bool reads_alone_ = false;             // the newest reading came without a write …
    time_ns read_ns_ = 0;                  // … and was sent then
    std::optional<written_block> before_;
    const machine *author_ = nullptr;  // of before_
    std::deque<sent_block> past_, unanswered_;
};

// A channel with `applied` stays within the control's largest step of what the PLC applies, or
// comes nearer (docs/coefficient-file.md).
class step_invariant : public invariant {
  public:
    explicit step_invariant(run &of)
        : invariant(of, "step"),
          judged_(longest_lag(of) == 0 &&
                  !draws_any(of, {fault_kind::wire, fault_kind::line, fault_kind::tear,
                                  fault_kind::partial, fault_kind::stray, fault_kind::twice,
                                  fault_kind::memory})) {}
    void started() override {
        before_.reset();
        shown_.clear();
    }
    void taken(const machine &, const machine &) override { started(); }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (!judged_ || facts.step_units == 0) return;
        if (is_reading(facts, seen) && seen.duration != never && head_of(facts, seen).whole)
            remember(facts, seen);
        if (seen.written.empty()) return;
        const machine &author = of_.author_of(seen);
        if (author.revision != facts.revision) return started();
        // Behind an outage the outputs are placed anew, two motors of a pair together.
        const time_ns gap_ns = seen.sent - std::exchange(sent_ns_, seen.sent);
        if (2 * gap_ns > 3 * facts.period_us * us) before_.reset();
        const written_block &block = block_of(facts, seen);
        for (std::size_t c = 0; before_ && c < block.um.size(); ++c)
            if (facts.channels[c].has_applied) judge(facts, c, block);
        before_ = block;
    }

  private:
    void remember(const machine &facts, const exchange &seen) {
        shown_.push_back(all_applied_in(facts, seen));
        if (shown_.size() > remembered) shown_.pop_front();
    }
    // Which reading the box had is not known: all of the newest ones have to say it.
    void judge(const machine &facts, std::size_t c, const written_block &block) {
        if (shown_.size() < remembered) return;
        const channel_facts &channel = facts.channels[c];
        const double um = block.um[c], near = 1.01 * channel.unit_um,
                     most_um = facts.step_units * channel.unit_um;
        for (const std::vector<double> &applied : shown_) {
            const double now = std::fabs(um - applied[c]),
                         then = std::fabs(before_->um[c] - applied[c]);
            if (!(now > most_um + near && now > then + near)) return;
        }
        violated(
            fmt::format("{} goes to {} µm, the PLC applies {} µm, and its largest step is {} µm",
                        channel.name, um, shown_.back()[c], most_um));
    }

    static constexpr std::size_t remembered = 3;
    bool judged_;
    time_ns sent_ns_ = 0;  // the newest write
    std::optional<written_block> before_;
    std::deque<std::vector<double>> shown_;  // applied, of each channel, in the newest readings
};

// What the PLC hands to the NC is within the PLC's own size, whoever writes (docs/plc.md).
class plc_size_invariant : public invariant {
  public:
    explicit plc_size_invariant(run &of) : invariant(of, "plc size") {}
    void scanned(const fakeplc::plc_state &) override {
        const fakeplc::plc_duties &duties = of_.plc.control.duties();
        const auto &sizes = duties.sizes_um();
        for (std::size_t c = 0; c < sizes.size(); ++c) {
            const double um = duties.wanted()[c].um;
            if (std::isfinite(um) && std::fabs(um) <= sizes[c] * (1 + 1e-9)) continue;
            violated(fmt::format("the PLC applies {} µm to {}, its own size is {} µm", um,
                                 of_.box_machine.channels[c].name, sizes[c]));
        }
    }
};

// A restart does not step (decision 5): the first write has what the PLC applies or holds, or zero
// where the PLC was restarted, or refuses the read-back.
class start_invariant : public invariant {
  public:
    explicit start_invariant(run &of) : invariant(of, "start") {}
    void started() override {
        first_ = true;
        refused_ = false;
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.author_of(seen);
        if (first_ && seen.function == 3 && seen.exception != 0) refused_ = true;
        if (seen.written.empty()) return;
        const written_block &block = block_of(facts, seen);
        if (first_ && held_ && !refused_ && !disturbed()) compare(facts, block);
        first_ = false;
        held_ = block;
    }

  private:
    bool disturbed() const {
        return draws_any(
            of_, {fault_kind::foreign, fault_kind::plc_stop, fault_kind::reload,
                  fault_kind::hostile, fault_kind::wire, fault_kind::sensors, fault_kind::boundary,
                  fault_kind::twice, fault_kind::loss, fault_kind::delay, fault_kind::slow});
    }
    void compare(const machine &facts, const written_block &block) {
        for (std::size_t c = 0; c < block.um.size(); ++c) {
            const channel_facts &channel = facts.channels[c];
            const double applied = channel.sign * of_.plc.control.side().applied()[c].um;
            const double held = held_->um[c], value = block.um[c];
            const double reach =
                2e-6 * channel.slew_um_per_s * static_cast<double>(facts.period_us);
            const double near = reach + 2 * channel.unit_um + 1e-3;
            const double low = channel.has_applied ? std::min(applied, held) : held;
            const double high = channel.has_applied ? std::max(applied, held) : held;
            if (value >= low - near && value <= high + near) continue;
            violated(
                fmt::format("after a start the first write of {} is {} µm, the PLC held {} µm and "
                            "applied {} µm",
                            channel.name, value, held, applied));
        }
    }

    bool first_ = true, refused_ = false;
    std::optional<written_block> held_;  // by the PLC
};

// Behind an outage an output goes on from what the PLC applies, else from what it holds; from zero
// if the PLC has restarted or refuses the read-back: what was sent before may be gone (decision 5).
// Until the first write the PLC may move on by itself.
class outage_invariant : public invariant {
  public:
    explicit outage_invariant(run &of)
        : invariant(of, "outage"),
          lag_ns_(longest_lag(of)),
          // Otherwise others write, or late writes come, or readings show other values. What a
          // register holds is compared even so.
          compares_applied_(
              lag_ns_ == 0 &&
              !draws_any(of, {fault_kind::foreign, fault_kind::reload, fault_kind::hostile,
                              fault_kind::wire, fault_kind::sensors, fault_kind::boundary,
                              fault_kind::twice, fault_kind::loss, fault_kind::exception,
                              fault_kind::mute, fault_kind::line, fault_kind::reset,
                              fault_kind::tear, fault_kind::partial, fault_kind::stray})) {}
    void started() override {
        found_ = found::nothing;
        written_ns_ = never;  // until the first write: start_invariant
        beats_ = behind_ = restarted_ = false;
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (lag_ns_ == never || draws(of_, fault_kind::memory)) return;
        const bool reads = is_reading(facts, seen) && head_of(facts, seen).whole;
        if (reads && seen.written.empty()) take(facts, seen);
        judge_write(facts, seen);
        if (reads && !seen.written.empty()) take(facts, seen);  // behind what FC23 writes
    }

  private:
    enum class found { nothing, block, refused };

    void judge_write(const machine &facts, const exchange &seen) {
        const time_ns lost_ns = contact_lasts(facts) + lag_ns_;
        const bool lost = written_ns_ != never && seen.sent - written_ns_ > lost_ns;
        if (seen.exception != 0) found_ = found::nothing;
        if (is_read_back(facts, seen)) find(facts, seen, lost);
        if (is_refused_read_back(facts, seen) && lost) {
            found_ = found::refused;
            found_ns_ = seen.sent;
        }
        if (seen.written.empty()) return;
        if (found_ != found::nothing && seen.sent > found_ns_) {
            const machine &author = of_.author_of(seen);
            judge(author, block_of(author, seen));
            found_ = found::nothing;
        }
        behind_ = restarted_ = false;
        written_ns_ = written_ns_ == never ? seen.sent : std::max(written_ns_, seen.sent);
    }
    void take(const machine &facts, const exchange &seen) {
        const std::uint16_t beat = head_of(facts, seen).heartbeat;
        const bool falls = beats_ && static_cast<std::uint16_t>(beat_ - beat - 1) < 0x7FFF;
        // Before the contact is lost the box takes no PLC for one that has restarted.
        const bool lost = written_ns_ != never && seen.sent - written_ns_ > contact_lasts(facts);
        behind_ = behind_ || falls;
        restarted_ = restarted_ || (falls && lost);
        beat_ = beat;
        beats_ = true;
        applied_um_ = all_applied_in(facts, seen);
    }
    void find(const machine &facts, const exchange &seen, bool lost) {
        found_ = lost && seen.duration != never ? found::block : found::nothing;
        if (found_ == found::nothing) return;
        exchange as_written = seen;
        as_written.decoded_for = nullptr;
        as_written.written = seen.read;
        held_ = block_of(facts, as_written);
        found_um_ = applied_um_;
        found_ns_ = seen.sent;
    }
    // Two motors whose values were read on their way may be too far apart.
    bool is_joined(const machine &facts, std::size_t c) const {
        return std::any_of(
            facts.pairs.begin(), facts.pairs.end(), [this, c](const pair_facts &pair) {
                return (pair.first == c || pair.second == c) && pair.second < found_um_.size() &&
                       std::fabs(found_um_[pair.first] - found_um_[pair.second]) > pair.most_um;
            });
    }
    void judge(const machine &facts, const written_block &block) {
        for (std::size_t c = 0; c < block.um.size(); ++c) {
            const channel_facts &channel = facts.channels[c];
            const double reach =
                2e-6 * channel.slew_um_per_s * static_cast<double>(facts.period_us) +
                2 * channel.unit_um + 1e-3;
            if (found_ == found::refused) {
                if (channel.has_applied || std::fabs(block.um[c]) <= reach) continue;
                violated(fmt::format("the PLC refused the read-back, and {} goes on from {} µm",
                                     channel.name, block.um[c]));
                continue;
            }
            const bool applies = channel.has_applied && c < found_um_.size();
            if (!compares_applied_ && (applies || partner_of(facts, c))) continue;
            if (c >= held_.um.size() || (!applies && behind_ != restarted_)) continue;
            const double from_um = applies ? found_um_[c] : restarted_ ? 0.0 : held_.um[c];
            if (!(std::fabs(from_um) <= channel.limit_um) || is_joined(facts, c)) continue;
            const double now_um = applies ? applied_um_[c] : from_um;
            const double nearest_um =
                std::clamp(block.um[c], std::min(from_um, now_um), std::max(from_um, now_um));
            if (std::fabs(block.um[c] - nearest_um) > reach)
                violated(fmt::format("behind an outage {} goes on from {} µm, the PLC has {} µm",
                                     channel.name, block.um[c], from_um));
        }
    }

    time_ns lag_ns_, written_ns_ = never, found_ns_ = 0;
    bool compares_applied_;
    found found_ = found::nothing;  // by the newest read-back since the outage
    written_block held_;
    std::vector<double> applied_um_;  // of the newest reading; NaN: the channel has none
    std::vector<double> found_um_;    // of the one before that read-back; with "fc23" the box takes
                                      // the one behind it
    std::uint16_t beat_ = 0;          // of that one, if there is one
    bool beats_ = false, behind_ = false, restarted_ = false;
};

// A read-back counts for the exchanges that follow it: behind a pause the registers may have other
// values, and the box reads them again before it writes (hal/cycle.h).
class placed_invariant : public invariant {
  public:
    explicit placed_invariant(run &of)
        : invariant(of, "placed"),
          judged_(!draws_any(
              of, {fault_kind::wire, fault_kind::line, fault_kind::reset, fault_kind::tear,
                   fault_kind::partial, fault_kind::stray, fault_kind::plc_stop, fault_kind::memory,
                   fault_kind::hostile, fault_kind::reload})) {}
    void started() override {
        held_ns_ = never;
        written_ns_ = -never / 2;
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (!judged_ || seen.sent < written_ns_) return;
        // One of which nothing comes is not repeated for ever.
        if (seen.duration == never || seen.exception != 0) fails_ns_ = seen.sent;
        if (is_read_back(facts, seen) && seen.duration != never) held_ns_ = seen.now;
        if (seen.written.empty()) return;
        const time_ns period_ns = of_.author_of(seen).period_us * us;
        const bool is_behind_outage = seen.sent - written_ns_ > contact_lasts(facts);
        if (is_behind_outage && held_ns_ != never && held_ns_ > std::max(written_ns_, fails_ns_) &&
            seen.sent - held_ns_ > most_periods * period_ns)
            violated(fmt::format("the first write comes {} ms behind the read-back",
                                 (seen.sent - held_ns_) / ms));
        written_ns_ = seen.sent;
    }

  private:
    static constexpr time_ns most_periods = 6;  // the box: two between the steps, fc23 one more
    bool judged_;
    time_ns held_ns_ = never;  // the newest read-back with a reply
    time_ns fails_ns_ = -never / 2, written_ns_ = -never / 2;
};

}  // namespace

void add_bounds(run &of, invariants &all) {
    all.push_back(std::make_unique<size_invariant>(of));
    all.push_back(std::make_unique<pair_invariant>(of));
    all.push_back(std::make_unique<slew_invariant>(of));
    all.push_back(std::make_unique<step_invariant>(of));
    all.push_back(std::make_unique<plc_size_invariant>(of));
    all.push_back(std::make_unique<start_invariant>(of));
    all.push_back(std::make_unique<outage_invariant>(of));
    all.push_back(std::make_unique<placed_invariant>(of));
}

}  // namespace compbox::world
