// SPDX-License-Identifier: MIT
// At rest each output is what its terms ask for: minus their sum, within its limit. The terms are
// evaluated here from the file's text, by their definitions in docs/coefficient-file.md.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
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
using numbers = std::vector<double>;
using signal_values = std::map<std::string, double>;

// out: nothing where a term needs more than the values of one reading: lags, branches
std::optional<double> value_of(const json &root, const std::string &output,
                               const signal_values &values);

// Columns in their order: inputs, powers, and one time constant, 0.
std::optional<double> bank_at(const json &bank, const signal_values &values) {
    if (bank.at("tau_s") != json::array({0})) return std::nullopt;
    double sum = bank.at("bias")[0].get<double>();
    std::size_t column = 0;
    for (const std::string name : bank.at("inputs")) {
        const auto input = values.find(name);
        if (input == values.end()) return std::nullopt;
        for (const unsigned power : bank.at("powers").at(name))
            sum += bank.at("weights")[0][column++].get<double>() * power_of(input->second, power);
    }
    return sum;
}

std::optional<double> linear_at(const json &term, const signal_values &values) {
    if (term.contains("bank")) return bank_at(term.at("bank"), values);
    double sum = term.value("constant", 0.0);
    for (std::size_t i = 0; i < term.at("inputs").size(); ++i) {
        const auto input = values.find(term.at("inputs")[i].get<std::string>());
        if (input == values.end()) return std::nullopt;
        sum += term.at("weights")[i].get<double>() * input->second;
    }
    return sum;
}

std::optional<double> volumetric_at(const json &root, const json &term, const std::string &output,
                                    const signal_values &values) {
    const auto value = [&values](const char *axis) {
        const auto found = values.find(axis);
        return found == values.end() ? std::nan("") : found->second;
    };
    const volumetric made(term);
    numbers errors;
    for (const volumetric::part &one : made.parts)
        errors.push_back(value_of(root, one.error, values).value_or(std::nan("")));
    const double um =
        made.um(std::string("XYZ").find(output[1]), {value("X"), value("Y"), value("Z")}, errors,
                made.tool.empty() ? 0 : value(made.tool.c_str()));
    if (std::isnan(um)) return std::nullopt;
    return um;
}

std::optional<double> value_of_term(const json &root, const json &term,
                                    const signal_values &values) {
    const std::string type = term.at("type");
    if (type == "linear") return linear_at(term, values);
    if (term.contains("backward") || !term.contains("signal")) return std::nullopt;
    const auto x = values.find(term.at("signal").get<std::string>());
    if (x == values.end()) return std::nullopt;
    if (type == "polyline") return polyline_at(term.at("positions"), term.at("values"), x->second);
    if (type == "bspline")
        return bspline_at(term.at("knots"), term.at("degree"), term.at("control_points"),
                          x->second);
    if (type == "polynomial") return polynomial(term).at(x->second);
    if (type != "product") return std::nullopt;
    const auto slope = value_of(root, term.at("term"), values);
    if (!slope) return std::nullopt;
    return *slope * (x->second - term.value("origin", 0.0));
}

std::optional<double> value_of(const json &root, const std::string &output,
                               const signal_values &values) {
    for (const auto &term : root.at("terms")) {
        if (term.value("name", "") == output) return value_of_term(root, term, values);
        if (term.at("type") == "volumetric" && output[0] == 'V')
            return volumetric_at(root, term, output, values);
    }
    return std::nullopt;
}

class models_invariant : public invariant {
  public:
    explicit models_invariant(run &of) : invariant(of, "models") {
        const bool disturbed =
            draws_any(of, {fault_kind::reload, fault_kind::hostile, fault_kind::memory,
                           fault_kind::foreign, fault_kind::sensors, fault_kind::wire,
                           fault_kind::exception, fault_kind::boundary});
        if (!disturbed) take_file(of.box_machine.file());
    }
    void started() override {
        wants_.clear();
        past_.clear();
        demand_fault_ = false;
    }
    void exchanged(const exchange &seen) override {
        if (root_.is_null()) return;
        const machine &facts = of_.running_at(seen.sent);
        if (!seen.written.empty() && seen.sent >= sent_ns_)
            judge(facts, block_of(facts, seen), seen.sent);
        // What the PLC may hold bounds the outputs for a while (decision 3).
        if (!seen.written.empty() && seen.duration == never) arrived_ns_ = seen.sent;
        if (!is_reading(facts, seen)) return;
        const bool whole = head_of(facts, seen).whole;
        if (whole) remember(seen);
        fresh_ = ++readings_ % sampled == 0 && whole;
        if (fresh_) take(facts, seen);
    }

  private:
    static constexpr std::uint64_t sampled = 8;  // one reading of so many
    static constexpr time_ns most_measured_ms = 500;
    struct demand {
        double um = 0;         // the channel wants this …
        time_ns since_ns = 0;  // … within `band`, since then
    };

    // A demand that stays within this is at rest.
    static double band_um(const channel_facts &channel) {
        return std::max(0.5, 0.03 * channel.limit_um);
    }

    void take_file(json root) {
        root_ = std::move(root);
        for (const auto &signal : root_.at("signals")) {
            const std::string unit = signal.value("unit", "");
            if (unit == "mm" || unit == "deg") axes_.insert(signal.at("name"));
        }
        const json &lead = root_.at("cycle").value("lead_ms", json(0));
        ahead_ns_ = (lead.is_string() ? most_measured_ms : lead.get<time_ns>()) * ms;
    }
    void remember(const exchange &seen) {
        constexpr std::size_t most_remembered = 4096;
        if (past_.size() == most_remembered) past_.pop_front();
        past_.push_back(seen);
    }
    static signal_values values_of(const machine &facts, const exchange &seen) {
        signal_values values;
        for (const fakeplc::shown_signal &signal : facts.map.signals)
            values[signal.name] = signal_in(facts, signal, seen);
        return values;
    }
    void take(const machine &facts, const exchange &seen) {
        const signal_values values = values_of(facts, seen);
        wants_.resize(facts.channels.size());
        for (std::size_t c = 0; c < wants_.size(); ++c) {
            const auto want = want_of(root_.at("channels")[c], values);
            if (!want ||
                (wants_[c] && std::fabs(*want - wants_[c]->um) <= band_um(facts.channels[c])))
                continue;
            wants_[c] = demand{*want, seen.now};
        }
    }
    std::optional<double> want_of(const json &entry, const signal_values &values) const {
        double sum = 0;
        for (const auto &output : entry.at("sum")) {
            const auto value = value_of(root_, output, values);
            if (!value) return std::nullopt;
            sum += *value;
        }
        return -sum;
    }

    // out: whether the demand is within `band` at this reading, and everywhere on the way as far as
    // the box may look ahead by the axes' velocities
    bool rests(const machine &facts, const exchange &before, const exchange &seen,
               std::size_t c) const {
        constexpr int places = 4;
        const signal_values from = values_of(facts, before), to = values_of(facts, seen);
        const double ahead = static_cast<double>(ahead_ns_ + 3 * facts.period_us * us) /
                             static_cast<double>(std::max(seen.now - before.now, us));
        for (int place = 0; place <= places; ++place) {
            signal_values values = to;
            for (const auto &axis : axes_)
                values[axis] += ahead * place / places * (to.at(axis) - from.at(axis));
            const auto want = want_of(root_.at("channels")[c], values);
            if (want && std::fabs(*want - wants_[c]->um) > band_um(facts.channels[c])) return false;
        }
        return true;
    }
    // Looks at each reading since wants_[c]->since_ns: those between two sampled ones may have had
    // other demands. out: whether the demand was at rest; otherwise since_ns is that of the unrest
    bool has_rested(const machine &facts, std::size_t c) {
        for (std::size_t i = past_.size(); i-- > 1 && past_[i].now > wants_[c]->since_ns;) {
            if (rests(facts, past_[i - 1], past_[i], c)) continue;
            wants_[c]->since_ns = past_[i].now;
            return false;
        }
        return true;
    }

    // The outputs arrive at their slew rates, after a few periods. A step whose write the PLC never
    // got may have been one of HOLD, which does not move.
    void judge(const machine &facts, const written_block &block, time_ns sent) {
        using namespace box_reason;
        judge_fault(facts, block);
        const bool follows = block.mode == fakeplc::box_mode::active && block.reason != degraded &&
                             block.reason != unapplied &&
                             2 * (sent - sent_ns_) <= 3 * facts.period_us * us;
        sent_ns_ = sent;
        if (!follows) arrived_ns_ = sent;
        for (std::size_t c = 0; follows && fresh_ && c < wants_.size(); ++c) {
            const channel_facts &channel = facts.channels[c];
            if (!wants_[c]) continue;
            const time_ns rest_ns = sent - std::max(wants_[c]->since_ns, arrived_ns_) -
                                    2 * time_ns{sampled} * facts.period_us * us;
            const auto other = partner_of(facts, c);
            const channel_facts &partner = facts.channels[other.value_or(c)];
            const double slew_um_per_s =
                std::min(least_slew_um_per_s(facts, channel), least_slew_um_per_s(facts, partner));
            const double way_um = 2.2 * std::max(channel.limit_um, partner.limit_um);
            if (1e-9 * static_cast<double>(rest_ns) * slew_um_per_s < way_um) continue;
            if (other) {
                if (wants_[*other] && wants_[*other]->since_ns <= wants_[c]->since_ns)
                    compare_pair(facts, c, *other, block);
                continue;
            }
            const std::string words = mistake(channel, wants_[c]->um, block.um[c]);
            if (!words.empty() && has_rested(facts, c)) violated(words);
        }
    }
    // A demand beyond error_um keeps its fault, whoever presses reset.
    void judge_fault(const machine &facts, const written_block &block) {
        namespace box_mode = fakeplc::box_mode;
        const bool ended =
            demand_fault_ && (block.mode == box_mode::standby || block.mode == box_mode::ramp);
        demand_fault_ = block.mode == box_mode::fault && block.reason == box_reason::demand;
        for (std::size_t c = 0; ended && c < wants_.size(); ++c) {
            const channel_facts &channel = facts.channels[c];
            if (!wants_[c] ||
                std::fabs(wants_[c]->um) <= 1.01 * channel.error_um + 2 * band_um(channel))
                continue;
            if (has_rested(facts, c) &&
                past_.back().now - wants_[c]->since_ns > ahead_ns_ + 8 * facts.period_us * us)
                violated(fmt::format("FAULT ended, and {} wants {} µm beyond its error_um {}",
                                     channel.name, wants_[c]->um, channel.error_um));
        }
    }
    // Two motors that want to be too far apart both give way, so their centre stays where the
    // limits let it.
    void compare_pair(const machine &facts, std::size_t c, std::size_t other,
                      const written_block &block) {
        const channel_facts &one = facts.channels[c], &two = facts.channels[other];
        const double a = wants_[c]->um, b = wants_[other]->um;
        if (std::fabs(a) > 0.9 * one.limit_um || std::fabs(b) > 0.9 * two.limit_um) return;
        const double near = 2 * band_um(one) + 2 * band_um(two) + one.deadband_um +
                            two.deadband_um + 2 * one.unit_um + 2 * two.unit_um + 0.1;
        const double apart = (block.um[c] + block.um[other] - a - b) / 2;
        if (std::fabs(apart) > near)
            violated(fmt::format("the centre of {} and {} is {} µm from that of their demands",
                                 one.name, two.name, apart));
    }
    // out: what is wrong; "": nothing
    static std::string mistake(const channel_facts &channel, double demand_um, double um) {
        const double band = band_um(channel);
        if (std::fabs(demand_um) > channel.error_um * 1.01 + band && channel.error_um > 0)
            return fmt::format("ACTIVE, and {} wants {} µm beyond its error_um {}", channel.name,
                               demand_um, channel.error_um);
        const double want = std::clamp(demand_um, -channel.limit_um, channel.limit_um);
        const double near = 2 * band + channel.deadband_um + 1.01 * channel.unit_um + 0.02 +
                            1e-4 * std::fabs(demand_um);
        if (std::fabs(um - want) <= near) return "";
        return fmt::format("{} is {} µm at rest, its terms want {} µm", channel.name, um, want);
    }

    json root_;
    std::set<std::string> axes_;  // signals whose positions the box extrapolates …
    time_ns ahead_ns_ = 0;        // … by at most this time, and the age of a reading
    std::deque<exchange> past_;   // readings
    std::vector<std::optional<demand>> wants_;  // by channel
    std::uint64_t readings_ = 0;
    bool fresh_ = false;         // the newest reading is sampled
    bool demand_fault_ = false;  // the newest write is FAULT by a demand
    time_ns sent_ns_ = 0, arrived_ns_ = 0;
};

// A term that states a sigma is never surer than its floor, and one that states none is silent. By
// the file it is floor^2 + along^2 |D x + o|^2 (docs/coefficient-file.md), compared where the
// columns x are powers of one signal.
class sigma_invariant : public invariant {
  public:
    explicit sigma_invariant(run &of) : invariant(of, "sigma") {
        // Another file may have another floor, and a bit may flip in this one.
        if (draws_any(of, {fault_kind::hostile, fault_kind::memory})) return;
        const json &root = of.box_machine.file();
        for (const auto &term : root.at("terms")) {
            const std::string type = term.at("type");
            if (type == "adapt") continue;  // its own filter's
            const json outputs = outputs_of(term);
            for (std::size_t k = 0; k < outputs.size(); ++k) {
                floors_[outputs[k]] = -1;
                if (!term.contains("sigma")) continue;
                floors_[outputs[k]] = term.at("sigma").at("floor_um")[k];
                stated_[outputs[k]] = {term, k};
            }
        }
        for (const auto &signal : root.at("signals"))
            if (signal.value("power", 1) == 2) squares_.insert(signal.at("name"));
    }
    void shown(const json &snapshot) override {
        if (floors_.empty()) return;
        for (const auto &term : snapshot.at("terms")) {
            const auto floor = floors_.find(term.at("name"));
            if (floor != floors_.end()) judge(term, floor->second);
            const auto stated = stated_.find(term.at("name"));
            if (stated != stated_.end())
                compare(term, stated->second.term, stated->second.output, snapshot.at("signals"));
        }
    }

  private:
    // in : floor_um: below 0: the term states none
    void judge(const json &term, double floor_um) {
        const json &sigma = term.at("sigma_um");
        const bool good = sigma.is_null() || (floor_um >= 0 && sigma.is_number() &&
                                              sigma.get<double>() >= floor_um * (1 - 1e-6));
        if (!good)
            violated(fmt::format("term {} states a sigma of {} um, and its floor is {}",
                                 term.at("name").get<std::string>(), sigma.dump(), floor_um));
    }

    // in : x: of the bank's only input, without lags
    static double sigma_at(const json &term, std::size_t output, double x) {
        const json &sigma = term.at("sigma");
        const double floor = sigma.at("floor_um")[output], along = sigma.at("along_um")[output];
        double square = 0;
        for (std::size_t d = 0; d < sigma.at("directions").size(); ++d) {
            double z = sigma.at("offsets")[d];
            double column = 1;
            for (const double weight : sigma.at("directions")[d]) z += weight * (column *= x);
            square += z * z;
        }
        return std::sqrt(floor * floor + along * along * square);
    }
    // The box goes over a bank once a second, so its sigma may be of a value from before.
    void compare(const json &stated, const json &term, std::size_t output, const json &signals) {
        const json &bank = term.at("bank");
        if (bank.at("tau_s") != json::array({0}) || !stated.at("sigma_um").is_number() ||
            hides_exchanges(of_) ||
            draws_any(of_, {fault_kind::sensors, fault_kind::can, fault_kind::reload}))
            return;
        const std::string input = bank.at("inputs")[0];
        if (squares_.count(input) > 0) return;  // which moves far
        const double near =
            input[0] == 'B' ? 2.1 : 0.4 + 3 * of_.box_machine.wanders_k;  // modules jump
        for (const auto &signal : signals) {
            if (signal.at("name") != input || signal.at("state") != "fresh") continue;
            const double x = signal.at("value"), um = stated.at("sigma_um");
            double low = 1e30, high = 0;
            constexpr int steps = 32;
            double before = sigma_at(term, output, x - near);
            for (int k = -steps; k <= steps; ++k) {
                const double there = sigma_at(term, output, x + near * k / steps);
                // It may have a narrow minimum between two steps.
                low = std::min(low, there - std::fabs(there - std::exchange(before, there)));
                high = std::max(high, there);
            }
            if (um < low * (1 - 1e-2) - 1e-3 || um > high * (1 + 1e-2) + 1e-3)
                violated(fmt::format("term {} states a sigma of {} um, by its file it is {} to {}",
                                     term.at("name").get<std::string>(), um, low, high));
        }
    }

    std::map<std::string, double> floors_;
    struct stated_sigma {
        json term;
        std::size_t output = 0;  // of those of the term
    };
    std::map<std::string, stated_sigma> stated_;  // by output
    std::set<std::string> squares_;               // lags of the square of a signal
};

}  // namespace

void add_models(run &of, invariants &all) {
    all.push_back(std::make_unique<models_invariant>(of));
    all.push_back(std::make_unique<sigma_invariant>(of));
}

}  // namespace compbox::world
