// SPDX-License-Identifier: MIT
// What the snapshot shows: a signal that is in use has a value that its source gave, not the one of
// another signal, file or time, and a source that gives values is heard. So it is with the inputs
// of lags in the state file.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <set>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"
#include "tests/world/state_file.h"

namespace compbox::world {

namespace {

using nlohmann::json;

class shown_invariant : public invariant {
  public:
    explicit shown_invariant(run &of)
        : invariant(of, "snapshot"), judged_(!hides_exchanges(of) && longest_lag(of) == 0) {
        const json &file = of.box_machine.file();
        for (const json &signal : file.at("signals"))
            if (signal.contains("max_rate_per_s")) rated_.insert(signal.at("name"));
        for (const auto &sensor : of.box_machine.redundant) redundant_.insert(sensor.name);
    }
    void started() override {
        started_ns_ = steady_ns_ = of_.time.now();
        stands_.clear();
    }
    void taken(const machine &, const machine &) override {
        steady_ns_ = taken_ns_ = of_.time.now();
    }
    // The same file once more: a flood of reloads drops what a slow bus has read.
    void logged(const std::string &line) override {
        if (line.find("is running now") != std::string::npos) steady_ns_ = of_.time.now();
    }
    void exchanged(const exchange &seen) override {
        if (!judged_) return;
        const machine &facts = of_.running_at(seen.sent);
        each_signal(facts, seen,
                    [this](const std::string &signal, double value) { keep(signal, value); });
        if (!is_reading(facts, seen) || seen.duration == never) return;
        const std::vector<double> applied_um = all_applied_in(facts, seen);
        for (std::size_t c = 0; c < applied_um.size(); ++c)
            if (!std::isnan(applied_um[c]))
                keep("applied_um of " + facts.channels[c].name, applied_um[c]);
    }
    void sampled(const std::string &signal, double value) override {
        if (judged_) keep(signal, value);
    }
    void file_written(const std::string &path, const node &file) override {
        if (judged_ && path == run::state_path) judge_state(file.bytes);
    }
    void shown(const json &snapshot) override {
        if (const machine *of = file_named_in(snapshot)) {
            judge_sum(*of, snapshot);
            judge_channels(*of, snapshot);
            for (const json &signal : snapshot.at("signals")) judge_age(*of, signal);
        }
        for (const char *key : {"jitter_us", "exchange_us"}) judge_times(key, snapshot.at(key));
        if (!judged_) return;
        for (const json &channel : snapshot.at("channels"))
            judge_applied("applied_um of " + channel.at("name").get<std::string>(),
                          channel.at("applied_um"));
        for (const json &signal : snapshot.at("signals")) {
            const std::string state = signal.at("state");
            if (signal.at("age_ms").is_number() && signal.at("age_ms") < 0)
                violated(fmt::format("{} is {} ms old", signal.at("name").get<std::string>(),
                                     signal.at("age_ms").get<double>()));
            const std::string of = signal.at("name");
            const bool is_used = state == "fresh" && signal.at("value").is_number();
            if (is_used && (of[0] != 'H' || was_heard(of))) judge(of, signal.at("value"));
            if (state == "never" && of[0] == 'H' && was_heard(of))
                violated(
                    fmt::format("{} was measured by hand, and the box shows no value of it", of));
            if (state != "fresh" && of[0] != 'H') judge_missing(of, state);
        }
    }

  private:
    struct given {
        time_ns at;
        double value;
    };
    static constexpr time_ns longest = 20 * second;  // for which a value is in use

    void keep(const std::string &signal, double value) {
        std::deque<given> &values = values_[signal];
        values.push_back({of_.time.now(), value});
        // The one before is in use until the next one comes, be it long after.
        while (values.size() > 1 && values[1].at < of_.time.now() - longest) values.pop_front();
    }
    // A measurement by hand stays until the next one, which takes some seconds to come.
    bool was_heard(const std::string &signal) const {
        return hears_measurements(of_) && was_given(signal) &&
               of_.time.now() - values_.at(signal).back().at > 5 * second;
    }
    // It is 0, or that of another file, until a reading has come.
    void judge_applied(const std::string &applied, const json &um) {
        if (um.is_number() && was_given(applied) && of_.time.now() - steady_ns_ > 3 * second)
            judge(applied, um);
    }
    // A lag has no source here.
    void judge(const std::string &signal, double value) {
        const auto found = values_.find(signal);
        if (found == values_.end()) return;
        const auto is_near = [value](const given &one) {
            return std::fabs(one.value - value) <= at_a_limit(value);
        };
        if (std::none_of(found->second.rbegin(), found->second.rend(), is_near))
            violated(fmt::format("{} is {}, and its source gave no such value for {} s", signal,
                                 value, longest / second));
    }

    // The counts up to each bound agree with the figures beside them.
    void judge_times(const char *key, const json &times) {
        const double count = times.at("count"), max = times.at("max");
        const double half = times.at("p50"), most = times.at("p99");
        const double sum = times.at("sum");
        if (sum < max * (1 - 1e-6) - 1e-3 || sum > max * count * (1 + 1e-6) + 1e-3)
            violated(fmt::format("{} has the sum {}: {}", key, sum, times.dump()));
        for (const auto &[text, number] : times.at("up_to").items()) {
            const double bound = std::stod(text), up_to = number;
            const double least = max <= bound    ? count
                                 : most <= bound ? 0.99 * count
                                 : half <= bound ? 0.5 * count
                                                 : 0;
            if (up_to < least - 1e-6 * count || up_to > count)
                violated(fmt::format("{} has {} up to {}: {}", key, up_to, text, times.dump()));
        }
    }
    void judge_sum(const machine &of, const json &snapshot) {
        if (snapshot.at("crc") != crc_of(of.text))
            violated(fmt::format("the crc is {}, that of revision {} is {}",
                                 snapshot.at("crc").dump(), of.revision, crc_of(of.text)));
    }

    // A demand is the negative sum of the terms beside it. An output in ACTIVE that differs from it
    // within the limit is on its way.
    void judge_channels(const machine &of, const json &snapshot) {
        std::map<std::string, const json *> terms;
        for (const json &term : snapshot.at("terms")) terms[term.at("name")] = &term.at("value");
        const json &channels = snapshot.at("channels");
        for (std::size_t c = 0; c < of.channels.size(); ++c) {
            const json &shown = channels.at(c);
            if (!shown.at("demand_um").is_number() || !shown.at("output_um").is_number()) continue;
            judge_demand(shown, terms);
            judge_way(of.channels[c], shown, snapshot.at("mode") == "ACTIVE");
            if (judged_ && !partner_of(of, c)) judge_rest(of.channels[c], shown, snapshot);
        }
    }
    void judge_demand(const json &shown, const std::map<std::string, const json *> &terms) {
        double sum = 0, near = 1e-3;
        for (const std::string term : shown.at("terms")) {
            const json &value = *terms.at(term);
            if (!value.is_number()) return;
            sum += value.get<double>();
            near += 1e-5 * std::fabs(value.get<double>());
        }
        if (std::fabs(sum + shown.at("demand_um").get<double>()) > near)
            violated(fmt::format("the demand of {} is {} um, its terms are {} um together",
                                 shown.at("name").dump(), shown.at("demand_um").dump(), sum));
    }
    void judge_way(const channel_facts &channel, const json &shown, bool active) {
        const double output_um = shown.at("output_um");
        const double within_um =
            std::clamp(shown.at("demand_um").get<double>(), -channel.limit_um, channel.limit_um);
        const double way_um = std::fabs(within_um - output_um);
        const double near_um = std::max(channel.deadband_um, channel.unit_um);
        const double rounding_um = 1e-3 + 1.1 * channel.unit_um + 1e-5 * channel.limit_um;
        if (active && shown.at("slewed") != (way_um > near_um) &&
            std::fabs(way_um - near_um) > rounding_um)
            violated(fmt::format("{} is {}on its way, and it is {} um from {} um", channel.name,
                                 shown.at("slewed") ? "" : "not ", way_um, within_um));
        if (!active && shown.at("slewed"))
            violated(fmt::format("{} is on its way without ACTIVE", channel.name));
        if (std::fabs(shown.at("limit_used").get<double>() * channel.limit_um -
                      std::fabs(output_um)) > rounding_um)
            violated(fmt::format("{} uses {} of its limit of {} um, its output is {} um",
                                 channel.name, shown.at("limit_used").dump(), channel.limit_um,
                                 output_um));
    }

    // A deadband keeps no rest of what nothing asks for any more: at a demand of zero no output
    // stands, but at zero.
    void judge_rest(const channel_facts &channel, const json &shown, const json &snapshot) {
        const double um = shown.at("output_um"), demand_um = shown.at("demand_um");
        const bool follows =
            snapshot.at("mode") == "ACTIVE" &&
            snapshot.at("reason").get<std::string>().find("applie") == std::string::npos;
        const auto was = stands_.find(channel.name);
        if (!follows || std::fabs(demand_um) > 1e-6 || was == stands_.end() ||
            was->second.value != um)
            stands_[channel.name] = {of_.time.now(), um};
        else if (std::fabs(um) > 0.6 * channel.unit_um + 1e-6 &&
                 of_.time.now() - was->second.at > 2 * second)
            violated(fmt::format("{} stands at {} um, and its terms ask for {}", channel.name, um,
                                 demand_um));
    }

    // What is older than max_age_ms is in use no more, whatever came of the readings behind it.
    void judge_age(const machine &of, const json &shown) {
        const std::string of_signal = shown.at("name");
        const signal_facts *facts = of.signal(of_signal);
        if (facts == nullptr || facts->is_lag || !shown.at("age_ms").is_number()) return;
        const double most_ms = 1e-3 * static_cast<double>(facts->max_age_us) + 1;
        if (shown.at("age_ms") > most_ms && shown.at("state") != "stale")
            violated(fmt::format("{} is {}, and it is {} ms old, beyond {} ms", of_signal,
                                 shown.at("state").dump(), shown.at("age_ms").dump(), most_ms));
    }

    // Some seconds behind a start or another file. For a time within max_age_ms the source has
    // given a good value again and again.
    void judge_missing(const std::string &signal, const std::string &state) {
        const signal_facts *facts = of_.running().signal(signal);
        const auto found = values_.find(signal);
        const time_ns now = of_.time.now();
        const bool is_flooded = of_.can != nullptr && now - of_.can->flooded_ns < 5 * second;
        if (facts == nullptr || found == values_.end() || is_doubtful(signal) || is_flooded ||
            now - steady_ns_ < 5 * second)
            return;
        time_ns until = now, longest_gap = 0;
        for (auto one = found->second.rbegin(); one != found->second.rend(); ++one) {
            if (now - one->at > 3 * second) break;
            longest_gap = std::max(longest_gap, until - one->at);
            until = one->at;
            const double near = 1e-3 * (facts->max - facts->min);
            if (!(one->value > facts->min + near && one->value < facts->max - near)) return;
        }
        if (now - until > 2 * second && 2 * longest_gap < facts->max_age_us * us)
            violated(fmt::format("{} is {}, and its source gave good values for {} ms", signal,
                                 state, (now - until) / ms));
    }
    // out: whether a good value may be refused, or not used
    bool is_doubtful(const std::string &signal) const {
        return rated_.count(signal) > 0 ||
               (redundant_.count(signal) > 0 && of_.running().file().contains("sensors"));
    }
    // Behind another file, whose signals may have another order. Until its source gives a value, an
    // input is that of the run before; that of a doubted sensor is what the others predict.
    void judge_state(const std::string &bytes) {
        if (of_.time.now() - taken_ns_ > 3 * second || draws(of_, fault_kind::state)) return;
        const auto file = decoded(bytes);
        if (!file) return;
        for (const state_file::record &lag : file->records)
            if (lag.name[0] == 0 && lag.unix_us > 0 && redundant_.count(lag.lag_of) == 0 &&
                was_given(lag.lag_of))
                judge(lag.lag_of, lag.input);
    }

    bool was_given(const std::string &signal) const {
        const auto found = values_.find(signal);
        return found != values_.end() && found->second.back().at > started_ns_;
    }

    bool judged_;
    time_ns started_ns_ = 0;
    time_ns steady_ns_ = 0;          // of the last start or other file …
    time_ns taken_ns_ = -never / 2;  // … and of that file
    std::set<std::string> rated_, redundant_;
    std::map<std::string, std::deque<given>> values_;
    std::map<std::string, given> stands_;  // outputs of channels, since then
};

// A term with an input that is missing goes to zero at the ramp (docs/coefficient-file.md), and is
// not computed by what the input had.
class fading_invariant : public invariant {
  public:
    explicit fading_invariant(run &of) : invariant(of, "fading"), judged_(is_steady(of)) {
        const json &root = of.box_machine.file();
        for (const json &term : root.at("terms")) {
            if (term.at("type") == "adapt") continue;  // stays near its model
            std::set<std::string> inputs;
            for (const char *key : {"signal", "tool_length"})
                if (term.contains(key)) inputs.insert(term.at(key));
            const json &all = term.contains("bank") ? term.at("bank") : term;
            for (const std::string input : all.value("inputs", json::array())) inputs.insert(input);
            std::vector<std::string> parts = term.value("errors", std::vector<std::string>());
            if (term.contains("term")) parts.push_back(term.at("term"));
            for (const std::string &part : parts)  // which stand before it
                inputs.insert(inputs_[part].begin(), inputs_[part].end());
            for (const std::string output : outputs_of(term)) inputs_[output] = inputs;
        }
    }
    void started() override { missing_.clear(); }
    void shown(const json &snapshot) override {
        if (!judged_) return;
        for (const json &signal : snapshot.at("signals")) note(signal);
        if (missing_.empty()) return;
        for (const json &term : snapshot.at("terms"))
            if (term.at("value").is_number()) judge(term.at("name"), term.at("value"));
    }

  private:
    static constexpr double late_s = 1;  // from a snapshot to what it shows, and the next step
    struct missing_signal {
        time_ns since;
        double age_ns;                           // at that time
        std::map<std::string, double> at_first;  // outputs of terms
    };
    // For as long as it has had no accepted value. One that it had between two snapshots is younger
    // than its first age; a snapshot is that of an earlier step.
    void note(const json &signal) {
        const std::string signal_name = signal.at("name");
        const time_ns now = of_.time.now();
        const bool is_missing = signal.at("state") == "stale" && signal.at("age_ms").is_number();
        const double age_ns = is_missing ? signal.at("age_ms").get<double>() * 1e6 : 0;
        const auto found = missing_.find(signal_name);
        const bool is_same =
            is_missing && found != missing_.end() &&
            age_ns > static_cast<double>(now - found->second.since) + found->second.age_ns / 2;
        if (is_same) return;
        if (found != missing_.end()) missing_.erase(found);
        if (is_missing) missing_[signal_name] = {now, age_ns, {}};
    }
    void judge(const std::string &term, double value) {
        const auto inputs = inputs_.find(term);
        if (inputs == inputs_.end()) return;
        for (const std::string &input : inputs->second) {
            const auto found = missing_.find(input);
            if (found == missing_.end()) continue;
            const double first =
                std::fabs(found->second.at_first.emplace(term, value).first->second);
            const double missing_s =
                1e-9 * static_cast<double>(of_.time.now() - found->second.since);
            const double faded_s = std::max(missing_s - late_s, 0.0);
            const double most =
                std::max(first - 0.9 * of_.box_machine.ramp_um_per_s * faded_s, 0.0);
            if (std::fabs(value) > most + 1e-3 + 1e-3 * first)
                violated(fmt::format("{} is {}, and its input {} has been missing for {} s", term,
                                     value, input, missing_s));
        }
    }
    bool judged_;
    std::map<std::string, std::set<std::string>> inputs_;  // of outputs of terms
    std::map<std::string, missing_signal> missing_;
};

// It goes no faster either: a product fades from its last value, not with its factor, whose unit is
// another one.
class product_invariant : public invariant {
  public:
    explicit product_invariant(run &of) : invariant(of, "fading") {
        if (!is_steady(of) || hides_exchanges(of)) return;
        const json &root = of.box_machine.file();
        for (const json &term : root.at("terms"))
            if (term.at("type") == "product") take(root, term);
        if (products_.empty()) return;
        facts_ = facts_of(of.box_machine, of.box_machine.text);
        if (!facts_) products_.clear();
        const json &lead = root.at("cycle").value("lead_ms", json(0));
        ahead_ms_ = lead.is_string() ? most_measured_ms : lead.get<double>();
        ahead_ms_ += 3 * period_ms();
    }
    void started() override {
        for (product &one : products_) one.before = {};
    }
    void exchanged(const exchange &seen) override {
        if (products_.empty()) return;
        each_signal(of_.box_machine, seen, [this, &seen](const std::string &signal, double value) {
            for (product &one : products_)
                if (one.axis == signal) one.pass(value, seen.now, ahead_ms_);
        });
    }
    void shown(const json &snapshot) override {
        for (product &one : products_) {
            reading now = reading_of(one, snapshot.at("signals"));
            if (!now.known) continue;
            if (now.missing_s > 0) {
                now.missing_s = one.fades_for_s(now.missing_s, of_.time.now());
                judge(one, now, snapshot.at("terms"));
            } else {
                one.lives(now);
            }
        }
    }

  private:
    static constexpr double most_measured_ms = 500;
    struct input {
        double value = 0;  // the last one in use
        bool missing = false;
    };
    struct reading {
        std::map<std::string, input> inputs;  // of the factor
        double missing_s = 0;                 // the input that is missing for longest
        bool known = true;
    };
    struct product {
        std::string name, axis;
        double origin = 0, constant = 0;
        std::map<std::string, double> weights;  // of the linear term that is its factor
        reading before;                         // the newest one with all inputs
        // |signal - origin| at least, since then; until then
        double way = 0, way_before = 0;
        double at = std::nan("");  // of the newest reading of the PLC …
        time_ns at_ns = 0;         // … and its time
        time_ns fades_ns = never;  // since then an input is missing

        void pass(double value, time_ns now, double ahead_ms) {
            const double apart_ms = 1e-6 * static_cast<double>(std::max(now - at_ns, ms));
            const double ahead = std::isnan(at) ? 0 : std::fabs(value - at) * ahead_ms / apart_ms;
            way = std::min(way, std::max(std::fabs(value - origin) - ahead, 0.0));
            at = value;
            at_ns = now;
        }
        // One input may come back while another is missing.
        double fades_for_s(double missing_s, time_ns now) {
            fades_ns = std::min(fades_ns, now - static_cast<time_ns>(1e9 * missing_s));
            return 1e-9 * static_cast<double>(now - fades_ns);
        }
        void lives(const reading &now) {
            fades_ns = never;
            before = now;
            way_before = std::exchange(way, 1e9);
        }
        // in : near: how far an input goes between two snapshots
        // out: |value| of its factor when it was computed last, at least
        double factor_um(const reading &now, double near) const {
            double low = constant, high = constant;
            for (const auto &[signal, one] : now.inputs) {
                const double was = before.inputs.at(signal).value, weight = weights.at(signal);
                const double goes = signal[0] == 'B' ? 2.1 : near;  // modules jump
                const double apart = one.missing ? 0 : std::fabs(weight) * goes;
                const double a = weight * one.value, b = one.missing ? a : weight * was;
                low += std::min(a, b) - apart;
                high += std::max(a, b) + apart;
            }
            return std::max({low, -high, 0.0});
        }
    };

    double period_ms() const { return 1e-3 * static_cast<double>(of_.box_machine.period_us); }
    // Another sensor may make the box doubt a redundant one, and a lag has the age of its source.
    void take(const json &root, const json &term) {
        product made;
        made.name = term.at("name");
        made.axis = term.at("signal");
        made.origin = term.value("origin", 0.0);
        for (const json &factor : root.at("terms")) {
            if (factor.value("name", "") != term.at("term") || !factor.contains("weights"))
                continue;
            made.constant = factor.value("constant", 0.0);
            for (std::size_t i = 0; i < factor.at("inputs").size(); ++i)
                made.weights[factor.at("inputs")[i]] = factor.at("weights")[i];
        }
        for (const auto &sensor : of_.box_machine.redundant)
            if (made.weights.count(sensor.name) > 0) return;
        for (const json &signal : root.at("signals"))
            if (signal.contains("lag_of") && made.weights.count(signal.at("name")) > 0) return;
        if (!made.weights.empty()) products_.push_back(made);
    }
    reading reading_of(const product &of, const json &signals) const {
        reading now;
        for (const json &signal : signals) {
            const std::string signal_name = signal.at("name");
            const bool is_input = of.weights.count(signal_name) > 0;
            if (!is_input && of.axis != signal_name) continue;
            const signal_facts *facts = facts_->signal(signal_name);
            const bool missing = signal.at("state") == "stale";
            const bool waits = signal.at("state") == "refused";  // until it is stale
            now.known = now.known && facts != nullptr && signal.at("value").is_number() &&
                        (is_input || !waits);
            if (!now.known) return now;
            if (is_input) now.inputs[signal_name] = {signal.at("value"), missing};
            const double since_s = 1e-3 * signal.at("age_ms").get<double>() -
                                   1e-6 * static_cast<double>(facts->max_age_us);
            if (missing) now.missing_s = std::max(now.missing_s, since_s);
        }
        return now;
    }
    void judge(const product &one, const reading &now, const json &terms) {
        if (one.before.inputs.empty()) return;
        const double faded_um =
            1.02 * of_.box_machine.ramp_um_per_s * (now.missing_s + 3e-3 * period_ms());
        const double factor_um = one.factor_um(now, 0.4 + 3 * of_.box_machine.wanders_k);
        const double least_um = factor_um * std::min(one.way, one.way_before) - faded_um;
        const auto um = number_at(terms, one.name, "value");
        if (um && std::fabs(*um) < 0.98 * least_um - 0.01)
            violated(
                fmt::format("{} is {} um, and its input is missing for {} s; by the ramp it is {}",
                            one.name, *um, now.missing_s, least_um));
    }

    std::optional<machine> facts_;
    double ahead_ms_ = 0;  // by which a position may be led, and its age
    std::vector<product> products_;
};

// Behind a jump of its time the box has no value of before (docs/faults.md). Of signals on wires of
// their own: a reading of the PLC comes in the same step.
class forgotten_invariant : public invariant {
  public:
    explicit forgotten_invariant(run &of) : invariant(of, "forgotten") {}
    void started() override {
        jumps_ = 0;
        steps_ = of_.steps_of_daemon;
        gap_ns_ = never;
        forgotten_ns_ = -never / 2;
    }
    void ticked() override {
        if (std::exchange(steps_, of_.steps_of_daemon) == of_.steps_of_daemon) return;
        const time_ns clock_ns = of_.clock_of_loop();
        const time_ns apart_ns = clock_ns - std::exchange(clock_ns_, clock_ns);
        if (apart_ns > 8 * of_.running().period_us * us) gap_ns_ = std::min(gap_ns_, ticked_ns_);
        ticked_ns_ = of_.time.now();
    }
    // What is measured by hand arrives some time behind.
    void sampled(const std::string &signal, double) override {
        if (signal[0] != 'H') given_ns_[signal] = of_.time.now();
    }
    // It counts jumps; of two in a row the first alone is judged.
    void shown(const json &snapshot) override {
        const std::uint64_t jumps = snapshot.at("counters").value("clock_jumps", std::uint64_t{0});
        if (std::exchange(jumps_, jumps) != jumps) {
            if (gap_ns_ != never) forgotten_ns_ = gap_ns_;
            gap_ns_ = never;
        }
        for (const json &signal : snapshot.at("signals")) {
            const auto given = given_ns_.find(signal.at("name"));
            if (given != given_ns_.end() && signal.at("state") == "fresh" &&
                given->second < forgotten_ns_ - 100 * ms)
                violated(fmt::format("{} is fresh, and its newest value came before a jump",
                                     given->first));
        }
    }

  private:
    std::uint64_t jumps_ = 0, steps_ = 0;   // of the newest snapshot; at the newest tick
    time_ns ticked_ns_ = 0, clock_ns_ = 0;  // the newest tick, and by the clock of the loop
    time_ns gap_ns_ = never;                // a gap of ticks began then, whose jump was not shown
    time_ns forgotten_ns_ = -never / 2;     // what came before is not known any more
    std::map<std::string, time_ns> given_ns_;
};

}  // namespace

void add_shown(run &of, invariants &all) {
    all.push_back(std::make_unique<fading_invariant>(of));
    all.push_back(std::make_unique<product_invariant>(of));
    all.push_back(std::make_unique<shown_invariant>(of));
    all.push_back(std::make_unique<forgotten_invariant>(of));
}

}  // namespace compbox::world
