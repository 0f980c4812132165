// SPDX-License-Identifier: MIT
// Terms that adapt (docs/coefficient-file.md, "adapt"), by each snapshot: their bounds, and what
// each probe makes of them. The filter is computed here in double precision, with its covariance
// as a matrix. It follows the box's b and g from probe to probe, so nothing accumulates in them.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/reference.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

using nlohmann::json;

// A term that adapts stays within bias_max + gain_max |m| of its model m, whatever the probe says.
// No measurement counts twice.
class adapted_invariant : public invariant {
  public:
    explicit adapted_invariant(run &of)
        : invariant(of, "adapted"),
          steps_on_(longest_lag(of) == 0 && !draws(of, fault_kind::suspend)) {
        // Another file may have other bounds, and a bit may flip in those of this one.
        if (draws_any(of, {fault_kind::hostile, fault_kind::memory})) return;
        const json &root = of.box_machine.file();
        for (const auto &term : root.at("terms"))
            if (term.at("type") == "adapt") adapts_.push_back(term);
    }
    void shown(const json &snapshot) override {
        if (adapts_.empty()) return;
        for (const auto &term : adapts_) judge(term, snapshot.at("terms"));
        for (const auto &one : snapshot.value("adapted", json::array())) {
            judge_bounds(one, of_.with_revision(snapshot.at("revision")));
            judge_counts(one);
            const auto taken = one.at("taken").get<std::uint64_t>();
            const bool is_taken = std::exchange(taken_, taken) != taken;
            judge_model(one, snapshot, is_taken);
            // Two probes may take it there and back, and the term is one of them behind.
            if (is_taken) settled_.reset();
            const bool is_active = snapshot.value("mode", "") == "ACTIVE" && !may_fade(snapshot);
            if (!is_active) settled_.reset();
            const auto term = term_of(one, snapshot.at("terms"));
            if (term) judge_settled(*term, is_active);
            if (!term || !is_active) moves_.reset();
            if (term && !draws(of_, fault_kind::sensors)) judge_arrives(*term, snapshot);
        }
    }
    void started() override {
        settled_.reset();
        moves_.reset();
        resumed_ = newest_;
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (adapts_.empty() || !is_reading(facts, seen)) return;
        const std::string counter = adapts_[0].at("probe").at("count");
        std::uint16_t most = 0;  // another file may take the other count
        for (const fakeplc::shown_signal &signal : facts.map.signals) {
            if (signal.name != counter && signal.name != other_probe_count) continue;
            const auto count = static_cast<std::uint16_t>(signal_in(facts, signal, seen));
            const auto was = std::exchange(counts_[signal.name == counter], count);
            most = std::max(most, static_cast<std::uint16_t>(count - was));
        }
        if (!is_reference(facts, counter, seen.sent)) measured_ += most;
    }

  private:
    // The box takes no measurement from the first count behind a time in which it had none.
    bool is_reference(const machine &facts, const std::string &counter, time_ns sent) {
        const time_ns without_ns = sent - std::exchange(read_ns_, sent);
        return steps_on_ &&
               without_ns > facts.signal(counter)->max_age_us * us + 3 * facts.period_us * us;
    }
    // A term may be faded out, be it for another term's sake; another reason may hide that one.
    static bool may_fade(const json &snapshot) {
        const json &signals = snapshot.at("signals");
        return snapshot.value("reason", "").find("faded") != std::string::npos ||
               std::any_of(signals.begin(), signals.end(), [](const json &one) {
                   return one.at("state") == "stale" || one.at("state") == "never";
               });
    }
    // What a filter has learnt is within the bounds of the file that runs.
    void judge_bounds(const json &one, const machine *of) {
        if (of == nullptr) return;
        for (const auto &term : of->file().at("terms")) {
            if (term.at("name") != one.at("name")) continue;
            const std::pair<const char *, const char *> bounds[] = {{"bias_um", "bias_max_um"},
                                                                    {"gain", "gain_max"}};
            for (const auto &[key, bound] : bounds)
                if (std::fabs(one.value(key, 0.0)) > term.at(bound).get<double>() * (1 + 1e-5))
                    violated(fmt::format("{} of the adapted term is {}, its {} is {}", key,
                                         one.value(key, 0.0), bound, term.at(bound).dump()));
        }
    }
    // Weights, biases and sigma of the model that a term adapts; "": it states no sigma.
    static std::string model_of(const machine &of, const std::string &output) {
        for (const auto &term : of.file().at("terms")) {
            const auto outputs = term.value("outputs", json::array({term.value("name", "")}));
            if (std::find(outputs.begin(), outputs.end(), output) == outputs.end()) continue;
            if (!term.contains("sigma")) return "";
            const json &bank = term.at("bank");
            return json({bank.at("weights"), bank.at("bias"), term.at("sigma")}).dump();
        }
        return "";
    }
    // As long as no probe of a model was taken, the term is as uncertain as the model says of
    // itself. A probe that came with the newest snapshot may be one of the file before. A restart
    // has the models of its state file.
    void judge_model(const json &one, const json &snapshot, bool is_taken) {
        const machine *of = of_.with_revision(snapshot.at("revision"));
        const std::string output = one.at("of");
        const std::string model = of != nullptr ? model_of(*of, output) : "";
        if (is_taken) measured_models_ = {model, shown_model_};
        shown_model_ = model;
        const auto own_um = number_at(snapshot.at("terms"), output, "sigma_um");
        if (model.empty() || !own_um || !one.at("sigma_um").is_number() || *own_um > 1e3 ||
            of_.starts() > 1 || measured_models_.count(model) > 0)
            return;
        if (one.at("sigma_um") < *own_um * (1 - 1e-3))
            violated(
                fmt::format("no probe of the model {} was taken, which states {} um, and the "
                            "adapted term has a sigma of {} um",
                            output, *own_um, one.at("sigma_um").dump()));
    }
    // One term at most has a probe. A count that goes on is each number between, too.
    void judge_counts(const json &one) {
        if (draws_any(of_, {fault_kind::wire, fault_kind::line})) return;
        std::uint64_t counted = 0;
        for (const char *key : {"taken", "asked", "refused", "skipped"})
            counted += one.value(key, std::uint64_t{0});
        if (counted > measured_)
            violated(fmt::format("{} measurements are counted, there were {}", counted, measured_));
    }
    // How far an adapted term is from its model, and how far its filter has it.
    struct shown_term {
        std::pair<double, double> filter;  // bias and gain
        double model_um, is_um, want_um;
    };
    // out: nothing without a value of both
    static std::optional<shown_term> term_of(const json &one, const json &terms) {
        const auto y = number_at(terms, one.at("name"), "value");
        const auto m = number_at(terms, one.at("of"), "value");
        if (!y || !m) return std::nullopt;
        const double bias_um = one.value("bias_um", 0.0), gain = one.value("gain", 0.0);
        return shown_term{{bias_um, gain}, *m, *y - *m, bias_um + gain * *m};
    }
    // What a probe has made of the term stays, also with another file, until the next
    // probe. A start takes it up at once, with the state file.
    void judge_settled(const shown_term &term, bool is_active) {
        const auto &filter = term.filter;
        newest_ = filter;
        // Zeros until the daemon has given the box its state.
        if (resumed_ != filter && (is_active || filter != std::pair{0.0, 0.0})) resumed_.reset();
        // Two filters may come to the same bound.
        const double most_um = adapts_[0].at("bias_max_um");
        const bool at_bound = std::fabs(filter.first) >= most_um * (1 - 1e-6);
        if (at_bound) resumed_.reset();
        if (resumed_ == filter && is_active) settled_ = std::exchange(resumed_, std::nullopt);
        const bool settled = std::fabs(term.is_um - term.want_um) <
                             1e-3 + 1e-4 * (std::fabs(term.model_um) + std::fabs(term.want_um));
        if (settled_ == filter && !settled && !draws_any(of_, {fault_kind::sensors}))
            violated(
                fmt::format("the adapted term is {} um from its model, its filter has {} um, "
                            "and it was there before",
                            term.is_um, term.want_um));
        settled_.reset();
        if (settled) settled_ = filter;
    }
    // While it is ACTIVE the term moves to what its filter has at the ramp, and arrives there.
    void judge_arrives(const shown_term &term, const json &snapshot) {
        const machine *of = of_.with_revision(snapshot.at("revision"));
        if (of == nullptr) return moves_.reset();
        const double far_um = std::fabs(term.is_um - term.want_um);
        const std::uint64_t rows = snapshot.at("jitter_us").at("count");
        if (!moves_ || moves_->filter != term.filter || moves_->revision != of->revision)
            moves_ = way{term.filter, of->revision, rows, far_um, 0};
        moves_->model_um = std::max(moves_->model_um, std::fabs(term.model_um));
        const double most_um = 2 * (moves_->um + moves_->model_um) + of->ramp_um_per_s,
                     ran_s = static_cast<double>(rows - moves_->rows) *
                             static_cast<double>(of->period_us) * 1e-6;
        if (ran_s * of->ramp_um_per_s < most_um || far_um < 1e-3 + 1e-3 * moves_->model_um) return;
        violated(
            fmt::format("the adapted term is {} um from what its filter has, {} s behind {} um",
                        far_um, ran_s, moves_->um));
    }
    void judge(const json &term, const json &terms) {
        const auto y = number_at(terms, term.at("name"), "value");
        const auto m = number_at(terms, term.at("of"), "value");
        if (!y || !m) return;
        const double most = term.at("bias_max_um").get<double>() +
                            term.at("gain_max").get<double>() * std::fabs(*m);
        if (std::fabs(*y - *m) <= most * (1 + 1e-5) + 1e-5 * std::fabs(*m) + 1e-6) return;
        violated(fmt::format("the adapted term is {} um and its model {} um, further apart than {}",
                             *y, *m, most));
    }

    std::vector<json> adapts_;
    bool steps_on_;  // the box makes each of its steps, whatever the PLC does
    time_ns read_ns_ = 0;
    std::array<std::uint16_t, 2> counts_ = {};  // of another probe, and of the one of the file
    std::uint64_t measured_ = 0;
    using bias_and_gain = std::optional<std::pair<double, double>>;
    std::uint64_t taken_ = 0;                // probes, by a snapshot
    std::set<std::string> measured_models_;  // by the newest of them, one of these
    std::string shown_model_;
    bias_and_gain settled_;  // if the term has arrived there
    bias_and_gain newest_;   // by a snapshot
    bias_and_gain resumed_;  // that of the run before, until this one is ACTIVE
    struct way {
        std::pair<double, double> filter;
        unsigned revision;
        std::uint64_t rows;   // of the first snapshot with this filter
        double um, model_um;  // the term from there then; the most of its model since
    };
    std::optional<way> moves_;  // one term at most adapts
};

// The settings of a term, by the names of their keys.
struct filter_settings {
    double bias_max, gain_max, step_max, drift, gain_drift, sigma, min_interval_s;
    explicit filter_settings(const json &term)
        : bias_max(term.at("bias_max_um")),
          gain_max(term.at("gain_max")),
          step_max(term.at("step_max_um")),
          drift(term.at("drift_um_per_sqrt_h")),
          gain_drift(term.at("gain_drift_per_sqrt_h")),
          sigma(term.at("sigma_um")),
          min_interval_s(term.value("min_interval_s", 0.0)) {}
    // out: variances that an hour adds to b and, by m, to g m
    double drift_at(double m) const { return drift * drift + gain_drift * gain_drift * m * m; }
};

// What the snapshot has of the filter.
struct filter_state {
    double b = 0, g = 0;
    std::optional<double> innovation, expected;  // of the probe that was judged last
    double cusum = 0;
    unsigned taken = 0, asked = 0, refused = 0;
    bool asks = false;
    unsigned probes() const { return taken + asked + refused; }
};

// The covariance of b and g.
struct covariance {
    double bb = 1, bg = 0, gg = 0.25;
    double along(double m) const { return bb + 2 * bg * m + gg * m * m; }
    void grow(const filter_settings &by, double hours) {
        bb += by.drift * by.drift * hours;
        gg += by.gain_drift * by.gain_drift * hours;
    }
};

// A movement of b and g by an innovation.
struct filter_step {
    double bias_by, gain_by;  // within bounds and step_max
    double share;             // of the movement that step_max leaves, 0 … 1
};

// One step of the Kalman filter at m, for an innovation with the variance s. The pair goes into its
// bounds, and then as far towards that as step_max allows.
filter_step step_of(const filter_settings &with, const filter_state &from, const covariance &p,
                    double m, double s, double innovation) {
    const double b = from.b + (p.bb + p.bg * m) / s * innovation;
    const double g = from.g + (p.bg + p.gg * m) / s * innovation;
    const double bias_by = std::clamp(b, -with.bias_max, with.bias_max) - from.b;
    const double gain_by = std::clamp(g, -with.gain_max, with.gain_max) - from.g;
    const double way = std::fabs(bias_by + gain_by * m);
    const double share = way > with.step_max ? with.step_max / way : 1;
    return {share * bias_by, share * gain_by, share};
}

// P - c (2 - c) K S K', with the share c of the gain K that was used
covariance narrowed(const covariance &p, double m, double s, double share) {
    const double kb = p.bb + p.bg * m, kg = p.bg + p.gg * m, part = share * (2 - share) / s;
    return {p.bb - part * kb * kb, p.bg - part * kb * kg, p.gg - part * kg * kg};
}

// Probes, by the readings that had them: a rise of the count is one measurement. Each is taken
// within its gate or where probes agree, and moves b and g by one step of the filter; one that is
// not taken moves nothing. The box asks for another one exactly while it waits for it.
class probes_invariant : public invariant {
  public:
    explicit probes_invariant(run &of) : invariant(of, "probes") {
        const json &root = of.box_machine.file();
        for (const auto &term : root.at("terms"))
            if (term.at("type") == "adapt") term_ = term;
        if (term_.is_null() || hides_exchanges(of) || draws(of, fault_kind::reload)) return;
        with_.emplace(term_);
        is_whole_ = term_.value("measures", "") == "whole";
        box_.emplace(of.box_machine);
        for (const std::string output : root.at("channels")[0].at("sum"))
            if (output != term_.at("name")) others_.push_back(output);
        needs_ = others_;
        needs_.push_back(term_.at("of"));
        for (const auto &term : root.at("terms"))
            states_sigma_ = states_sigma_ ||
                            (term.value("name", "") == term_.at("of") && term.contains("sigma"));
        samples_arrive_ = !draws(of, fault_kind::can);
    }
    void started() override {
        if (of_.starts() > 1 || of_.box.files.has(run::state_path)) box_.reset();  // P goes on
        if (box_) box_->start(false);
        started_ns_ = of_.time.now();
    }
    void ticked() override {
        if (grown_ns_ == 0) grown_ns_ = of_.time.now();
    }
    void sampled(const std::string &signal, double value) override {
        const bool arrives = signal[0] == 'H' ? hears_measurements(of_) : samples_arrive_;
        if (!box_ || !arrives) return;
        box_->sample(signal, value, of_.time.now());
        if (of_.time.now() - newest_.at < second / 2) widen(newest_);
    }
    void exchanged(const exchange &seen) override {
        if (!box_) return;
        const machine &facts = of_.box_machine;
        if (!seen.written.empty()) {
            judge_request(facts, seen);
            note_write(facts, seen);
        }
        if (seen.duration == never || !is_reading(facts, seen) || !head_of(facts, seen).whole)
            return;
        box_->read(facts, seen, seen.sent);
        const auto count = box_->newest(term_.at("probe").at("count"), seen.sent);
        const auto was = std::exchange(count_, count);
        const auto rise = static_cast<std::uint16_t>(static_cast<int>(count.value_or(0)) -
                                                     static_cast<int>(was.value_or(0)));
        if (count && was && rise != 0 && rise < 0x8000) take_probe(facts, seen);
    }
    void shown(const json &snapshot) override {
        if (!box_ || !snapshot.contains("adapted")) return;
        const json &entry = snapshot.at("adapted")[0];
        filter_state now;
        now.b = entry.at("bias_um");
        now.g = entry.at("gain");
        if (entry.at("innovation_um").is_number()) now.innovation = entry.at("innovation_um");
        if (entry.at("expected_um").is_number()) now.expected = entry.at("expected_um");
        now.cusum = entry.at("cusum");
        now.taken = entry.at("taken");
        now.asked = entry.at("asked");
        now.refused = entry.at("refused");
        now.asks = entry.at("asks");
        follow(now);
    }

  private:
    static constexpr double timed_h = 0.1 / 3600;  // between a reading and the step that has it

    // A measurement of a reading.
    struct probe {
        time_ns at = 0;
        judged_number m = {std::nan(""), 0};  // NaN: not known
        judged_number others = {0, 0};        // of the channel's sum
        std::optional<judged_number> um;      // what the term has to explain; none: not known
        bool is_number = false;               // the value is plausible
        bool may_lack = false;                // an input may have been missing …
        bool lacks = false;                   // … or was, of another term or the model
    };

    void take_probe(const machine &facts, const exchange &seen) {
        box_->look(seen.sent);
        const fakeplc::taken_channel &channel = facts.map.channels[0];
        const auto value = box_->newest(term_.at("probe").at("value"), seen.sent);
        probe one;
        one.at = seen.sent;
        // The box measures the lead for a second first.
        const bool knows = box_->knows();
        if (knows && seen.sent - started_ns_ > 1200 * ms) one.m = box_->judged({term_.at("of")});
        one.is_number = value.has_value();
        one.may_lack = box_->may_lack_input(seen.sent);
        one.lacks = box_->lack_input(needs_, seen.sent);
        one.others = box_->judged(others_);
        if (knows && value && !channel.tangent && !std::isnan(one.others.value)) {
            const judged_number own_um = own_part(facts, seen);
            if (std::isfinite(own_um.value))
                one.um = judged_number{
                    *value - own_um.value - one.others.value,
                    one.others.near + own_um.near + 1e-5 * (std::fabs(own_um.value) + 1)};
        }
        ++probes_;
        newest_ = one;
    }

    // A sample behind the reading may be in the step that takes the probe.
    void widen(probe &one) {
        box_->look(one.at);
        const auto grown = [](judged_number by, judged_number now) {
            return std::fabs(now.value - by.value) + now.near;
        };
        const judged_number m = box_->judged({term_.at("of")}), others = box_->judged(others_);
        if (std::isnan(m.value)) one.m = m;
        one.m.near = std::max(one.m.near, grown(one.m, m));
        if (std::isnan(others.value)) one.um.reset();
        if (one.um) one.um->near += grown(one.others, others);
    }

    // out: the part of a measurement that is the box's own output, µm: what the PLC applies, or
    //      without `applied` what was written; 0: the whole error is measured; NaN: not known
    judged_number own_part(const machine &facts, const exchange &seen) const {
        if (is_whole_) return {0, 0};
        if (facts.channels[0].has_applied) return {applied_in(facts, 0, seen), 0};
        if (confirmed_ < 3) return {std::nan(""), 0};
        return {sent_um_[0], std::fabs(sent_um_[0] - sent_um_[1])};
    }
    // The outputs of the newest two writes, each of which had its reply.
    void note_write(const machine &facts, const exchange &seen) {
        confirmed_ = seen.duration == never ? 0 : confirmed_ + 1;
        sent_um_[1] = std::exchange(sent_um_[0], block_of(facts, seen).um[0]);
    }

    void follow(const filter_state &now) {
        if (now.probes() > probes_) return violated("more probes are counted than were measured");
        // A disk that hangs has old snapshots.
        if (now.probes() < probes_ && longest_lag(of_) == 0 &&
            of_.time.now() - newest_.at > 2 * second)
            return violated(
                fmt::format("{} probes are counted, and {} were measured", now.probes(), probes_));
        const unsigned more = now.probes() - was_.probes();
        if (more == 1 && now.probes() == probes_)
            judge(now);
        else if (more > 0)
            knows_ = pends_known_ = since_known_ = sums_known_ = false;
        else if (now.b != was_.b || now.g != was_.g)
            violated(fmt::format("b and g become {} and {} without a probe", now.b, now.g));
        was_ = now;
        snapshot_ns_ = of_.time.now();
    }

    void judge(const filter_state &now) {
        const bool taken = now.taken > was_.taken, asked = now.asked > was_.asked;
        const double hours =
            static_cast<double>(newest_.at - std::exchange(grown_ns_, newest_.at)) / 3.6e12;
        p_.grow(*with_, hours);
        pending_h_ += hours;
        since_s_ += 3600 * hours;
        if (!taken && (now.b != was_.b || now.g != was_.g))
            violated(
                fmt::format("b and g become {} and {} by a probe that is not taken", now.b, now.g));
        if (taken || asked)
            judge_outcome(now, taken);
        else
            judge_refusal();
    }
    // A plausible probe of a known model is refused within the shortest time alone.
    void judge_refusal() {
        const bool due = was_.asks || since_s_ > 1.01 * with_->min_interval_s + 0.1;
        if (since_known_ && due && newest_.um && !newest_.may_lack && !std::isnan(newest_.m.value))
            violated(fmt::format("a probe is refused {} s behind the one that was taken last",
                                 since_s_));
    }
    void judge_outcome(const filter_state &now, bool taken) {
        const double e = *now.innovation, m = newest_.m.value, root_s = *now.expected;
        if (!newest_.is_number) violated("a probe that is no number is judged");
        if (newest_.lacks) violated("a probe is judged, and a term of its channel lacks a signal");
        if (!was_.asks && since_s_ < 0.99 * with_->min_interval_s - 0.1)
            violated(fmt::format("a probe is judged {} s after the last one", since_s_));
        if (std::isnan(m)) knows_ = pends_known_ = false;
        if (newest_.um && !std::isnan(m)) judge_innovation(e);
        const double narrow = p_.bb;
        if (knows_) judge_variance(root_s * root_s);
        judge_gate(now, e, root_s, m, taken);
        if (!taken) {
            p_.bb = narrow;  // the place of the last one that was taken counts on
            return;
        }
        since_s_ = 0;
        since_known_ = true;
    }
    // What exceeds half a standard deviation, to one side and to the other; they end at twice the
    // alarm (models/adapt.h).
    struct side_sums {
        double above = 0, below = 0;
        double larger() const { return std::max(above, below); }
        side_sums with(double deviations) const {
            const double x = std::clamp(deviations, -3.0, 3.0);
            return {std::clamp(above + x - 0.5, 0.0, 20.0), std::clamp(below - x - 0.5, 0.0, 20.0)};
        }
    };
    void sum_up(const std::vector<double> &may_take, double near_um, double root_s, double cusum) {
        std::vector<side_sums> found;
        for (const double e : may_take) {
            const side_sums one = sums_.with(e / root_s);
            if (std::fabs(one.larger() - cusum) <= 1e-3 + near_um / root_s) found.push_back(one);
        }
        if (sums_known_ && found.empty())
            violated(fmt::format("the sum of innovations is {}, by the filter {}", cusum,
                                 sums_.with(may_take.front() / root_s).larger()));
        sums_known_ = sums_known_ && !found.empty() && found.front().above == found.back().above;
        if (sums_known_) sums_ = found.front();
        if (cusum > 0) return;
        sums_ = {};
        sums_known_ = true;
    }
    void judge_innovation(double e) {
        const double m = newest_.m.value, y = was_.b + (1 + was_.g) * m;
        const double near = newest_.um->near + (1 + std::fabs(was_.g)) * newest_.m.near +
                            1e-5 * (std::fabs(y) + std::fabs(newest_.um->value)) + 1e-4;
        if (std::fabs(newest_.um->value - y - e) <= near) return;
        violated(fmt::format("the innovation is {} um, the probe {} um and the term {} um", e,
                             newest_.um->value, y));
    }
    // The model's own sigma widens it alone.
    void judge_variance(double s) {
        const double m = newest_.m.value;
        const double is = with_->sigma * with_->sigma + p_.along(m);
        const double near = 0.03 * (with_->sigma * with_->sigma + p_.bb + p_.gg * m * m) +
                            2 * (std::fabs(p_.bg) + p_.gg * std::fabs(m)) * newest_.m.near +
                            p_.gg * newest_.m.near * newest_.m.near + with_->drift_at(m) * timed_h;
        if (s < is - near || (!states_sigma_ && s > is + near))
            violated(fmt::format("the variance of a probe is {} um^2, by the filter {}", s, is));
        if (!states_sigma_) return;
        p_.bb += std::max(0.0, s - is);
        knows_ = near < 0.05 * p_.bb;
    }

    // Which innovations may be taken: its own within the gate, where it agrees with the newest
    // pending one, or as the median of three.
    void judge_gate(const filter_state &now, double e, double root_s, double m, bool taken) {
        std::vector<double> may_take;
        const bool within = std::fabs(e) < 3 * root_s * (1 + 1e-5);
        const bool beyond = std::fabs(e) > 3 * root_s * (1 - 1e-5);
        bool may_ask = beyond;
        if (within || !pends_known_) may_take.push_back(e);
        if (beyond && pends_known_ && !pending_.empty()) {
            const double noise = 2 * with_->sigma * with_->sigma;
            const double apart = 3 * std::sqrt(noise + with_->drift_at(m) * pending_h_);
            const double off = std::fabs(e - pending_.back());
            const double error = std::fabs(e + was_.b + was_.g * m);
            const double reach =
                with_->bias_max + with_->gain_max * std::fabs(m) + 3 * with_->sigma;
            const double near = 0.01 + 0.01 * apart + newest_.m.near * (1 + with_->gain_max);
            const bool agrees = off < apart + near && error < reach + near;
            const bool differs = off > apart - near || error > reach - near;
            if (agrees) may_take.push_back(e);
            if (differs && pending_.size() == 2)
                may_take.push_back(std::max(std::min(pending_[0], pending_[1]),
                                            std::min(std::max(pending_[0], pending_[1]), e)));
            may_ask = differs && pending_.size() < 2;
        }
        if (taken && may_take.empty())
            return violated(fmt::format("a probe is taken {} um from the term, its gate is {} um",
                                        e, 3 * root_s));
        if (!taken && !may_ask)
            return violated(fmt::format("a probe {} um from the term is not taken, its gate is {}",
                                        e, 3 * root_s));
        if (now.asks != !taken)
            violated(fmt::format("the box {} another probe behind one that was {}taken",
                                 now.asks ? "asks for" : "does not ask for", taken ? "" : "not "));
        if (taken) {
            sums_known_ = sums_known_ && (pends_known_ || !beyond);
            sum_up(may_take, beyond ? rest_near_um_ : 0, root_s, now.cusum);
            return judge_step(now, may_take, beyond, m);
        }
        if (pending_.size() < 2) pending_.push_back(e);
        pending_h_ = 0;
    }

    double s_at(double m) const { return with_->sigma * with_->sigma + p_.along(m); }
    // out: from a number to the interval of those
    static double distance(double from, std::initializer_list<double> to) {
        return std::max({std::min(to) - from, from - std::max(to), 0.0});
    }
    void judge_step(const filter_state &now, const std::vector<double> &may_take, bool beyond,
                    double m) {
        const double bias_by = now.b - was_.b, gain_by = now.g - was_.g;
        // That of this m: P loses nearly all of it, and what remains is smaller than m is known.
        const double s = s_at(m);
        const double way = bias_by + gain_by * m;
        const double m_near = std::isnan(m) ? 0 : newest_.m.near;
        if (!std::isnan(m) && std::fabs(way) > with_->step_max * (1 + 1e-4) +
                                                   std::fabs(gain_by) * m_near +
                                                   1e-5 * (1 + std::fabs(m)))
            violated(fmt::format("one probe moves the term by {} um", way));
        knows_ = knows_ && (pends_known_ || !beyond);
        pending_.clear();
        rest_near_um_ = 0;
        pends_known_ = !beyond;
        if (!knows_) return;
        double least_off = 1e30, taken_um = 0;
        std::optional<filter_step> step;
        for (const double e : may_take) {
            const filter_step one = step_of(*with_, was_, p_, m, s, e);
            const double gain = std::fabs(e) / s;
            const double near = 0.05 + with_->drift_at(m) * timed_h / s;
            const double drift = with_->drift * with_->drift * timed_h;
            const double gain_drift = with_->gain_drift * with_->gain_drift * timed_h;
            const double bias_near =
                gain * (near * (p_.bb + std::fabs(p_.bg * m)) + std::fabs(p_.bg) * m_near + drift);
            const double gain_near = gain * (near * (std::fabs(p_.bg) + p_.gg * std::fabs(m)) +
                                             p_.gg * m_near + gain_drift * std::fabs(m));
            // A limited step is that of its m.
            const filter_step low = step_of(*with_, was_, p_, m - m_near, s_at(m - m_near), e),
                              high = step_of(*with_, was_, p_, m + m_near, s_at(m + m_near), e);
            const double off = std::max(
                distance(bias_by, {one.bias_by, low.bias_by, high.bias_by}) /
                    (bias_near + 1e-4 * (1 + std::fabs(was_.b))),
                distance(gain_by, {one.gain_by, low.gain_by, high.gain_by}) / (gain_near + 1e-5));
            if (off >= least_off) continue;
            least_off = off;
            taken_um = e;
            step = one;
        }
        if (!(least_off <= 1))
            violated(fmt::format("a probe moves b by {} um and g by {}, the filter by {} um and {}",
                                 bias_by, gain_by, step->bias_by, step->gain_by));
        p_ = narrowed(p_, m, s, step->share);
        if (beyond) keep_rest({taken_um - way, std::fabs(gain_by) * m_near}, m);
        // What it does not know well it forgets.
        knows_ = newest_.m.near < 0.002 * std::fabs(m) + 0.0025;
    }

    // What step_max leaves of an innovation that was outside of its gate stays pending there.
    void keep_rest(const judged_number &rest_um, double m) {
        const double share =
            std::fabs(rest_um.value) / (3 * std::sqrt(with_->sigma * with_->sigma + p_.along(m)));
        pends_known_ = share < 0.95 || share > 1.05;
        if (share > 1) {
            pending_ = {rest_um.value};
            rest_near_um_ = rest_um.near;
        }
        pending_h_ = 0;
    }

    // Between two probes the bit is that of the newest snapshot.
    void judge_request(const machine &facts, const exchange &seen) {
        if (!facts.map.request || snapshot_ns_ == 0 || was_.probes() != probes_) return;
        if (seen.sent < snapshot_ns_) return;
        const auto at = static_cast<std::size_t>(*facts.map.request - facts.map.write.start);
        if (((seen.written[at] & 1u) != 0) != was_.asks)
            violated(fmt::format("the box writes a request of {}, and its snapshot has {}",
                                 seen.written[at], was_.asks));
    }

    json term_;
    std::optional<filter_settings> with_;
    std::optional<reference_box> box_;
    time_ns started_ns_ = 0;
    std::vector<std::string> others_;  // of the channel's sum …
    std::vector<std::string> needs_;   // … and the model
    bool states_sigma_ = false, samples_arrive_ = true;
    bool is_whole_ = false;  // a measurement is of the whole model
    double sent_um_[2] = {0, 0};
    int confirmed_ = 0;  // writes in a row
    std::optional<double> count_;
    unsigned probes_ = 0;  // measured
    probe newest_;
    filter_state was_;  // of the newest snapshot
    time_ns snapshot_ns_ = 0, grown_ns_ = 0;
    covariance p_;
    bool knows_ = true;            // P
    std::vector<double> pending_;  // innovations outside of the gate, the oldest first
    bool pends_known_ = true;
    double rest_near_um_ = 0;               // of the oldest, if it is what a step left
    double pending_h_ = 0, since_s_ = 1e9;  // behind a probe that was taken
    bool since_known_ = true;
    side_sums sums_;  // of innovations
    bool sums_known_ = true;
};

}  // namespace

void add_adapted(run &of, invariants &all) {
    all.push_back(std::make_unique<adapted_invariant>(of));
    all.push_back(std::make_unique<probes_invariant>(of));
}

}  // namespace compbox::world
