// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/compare.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "host-tools/coefficients/demand.h"
#include "host-tools/coefficients/machine_file.h"
#include "host-tools/coefficients/name_remarks.h"
#include "host-tools/coefficients/pair_remarks.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/numbers.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::coefficients {

namespace {

constexpr double uncovered_mm = plausible_beyond_mm + 1.0;  // a plausible range is in whole mm
constexpr double uncovered_share = 0.1, longer_share = 0.5;
constexpr double least_covered_share = 0.5;
constexpr double shift_um = 10.0;   // at home; less is noise of the curves
constexpr double least_um = 0.5;    // of a demand; less is errors in mm
constexpr double longest_s = 60.0;  // for the whole demand at the slew rate

// ---- home

// out: zero_at_mm of all curves of a signal, where all have the same
std::optional<double> common_zero(const cb_config &config, const json &provenance,
                                  unsigned signal) {
    std::optional<double> zero;
    for (unsigned t = 0; t < config.terms_count; ++t) {
        const cb_term_config &term = config.terms[t];
        if (!is_curve(term) || term.as.curve.signal != signal) continue;
        const json own = provenance.value(config.outputs[term.first_output].name, json());
        const json at = own.is_object() ? own.value("zero_at_mm", json()) : json();
        if (!at.is_number() || (zero && *zero != at.get<double>())) return {};
        zero = at.get<double>();
    }
    return zero;
}

json provenance_of(const json &file) {
    const json provenance = file.value("provenance", json::object());
    return provenance.is_object() ? provenance : json::object();
}

// ---- coverage

// Ends of a curve and of the travel of its signal.
struct coverage {
    std::string term;
    unsigned signal;
    double from, to, min, max;

    double travel() const { return max - min; }
    double most_uncovered() const { return std::max(uncovered_mm, uncovered_share * travel()); }
    bool covers() const { return from - min <= most_uncovered() && max - to <= most_uncovered(); }
    bool apart() const { return from >= max || to <= min; }
};

// out: outputs that act through a channel
std::set<unsigned> outputs_in_use(const cb_config &config) {
    std::set<unsigned> all;
    for (unsigned c = 0; c < config.channels_count; ++c) {
        const cb_channel_config &channel = config.channels[c];
        all.insert(channel.sum, channel.sum + channel.sum_count);
    }
    for (auto next = all; !next.empty();) {
        std::set<unsigned> used;
        for (const unsigned output : next) {
            unsigned count = 0;
            const cb_term_config &term = config.terms[config.outputs[output].term];
            const std::uint8_t *list = cb_term_used(&term, &count);
            for (unsigned i = 0; i < count; ++i) {
                if (list[i] != CB_NONE && all.insert(list[i]).second) used.insert(list[i]);
            }
        }
        next = std::move(used);
    }
    return all;
}

std::vector<coverage> coverages(const cb_config &config) {
    std::vector<coverage> all;
    const auto in_use = outputs_in_use(config);
    for (unsigned t = 0; t < config.terms_count; ++t) {
        const cb_term_config &term = config.terms[t];
        if (!is_curve(term) || in_use.count(term.first_output) == 0) continue;
        const unsigned s = term.as.curve.signal;
        const auto [from, to] = domain_of(config, term.as.curve);
        all.push_back({config.outputs[term.first_output].name, s, from, to,
                       static_cast<double>(config.signals[s].min),
                       static_cast<double>(config.signals[s].max)});
    }
    return all;
}

// A curve that does not cover its travel is refused. Of other signals a curve may cover a part.
void judge_coverage(const cb_config &config, const coverage &one, comparison &result) {
    const cb_signal_config &signal = config.signals[one.signal];
    const std::string ends =
        fmt::format("{} is a curve from {:.6g} to {:.6g} {}, and {} goes from {:.6g} to {:.6g}",
                    one.term, one.from, one.to, signal.unit, signal.name, one.min, one.max);
    const bool position = is_position(config, one.signal);
    if (one.apart() || (position && !one.covers())) {
        result.refusals.push_back(
            {one.term, ends + (position ? "; measure the whole travel, check that its positions "
                                          "are in mm, or correct min and max"
                                        : "; check the unit of both")});
    } else if (position && one.to - one.from < least_covered_share * one.travel()) {
        result.remarks.push_back("term " + ends + "; are its positions metres instead of mm?");
    } else if (position && one.to - one.from > (1.0 + longer_share) * one.travel()) {
        result.remarks.push_back("term " + ends +
                                 "; check its positions, and that it is the curve of this axis");
    }
}

// out: result with the ends of each curve in use, a line for each signal, and judge_coverage()
void add_coverage(const cb_config &config, comparison &result) {
    std::map<unsigned, std::string> axes;
    for (const coverage &one : coverages(config)) {
        const cb_signal_config &signal = config.signals[one.signal];
        std::string &text = axes[one.signal];
        if (text.empty()) {
            text = fmt::format("{} from {:.6g} to {:.6g} {}: curves", signal.name, one.min, one.max,
                               signal.unit);
        }
        text += fmt::format("{} {} {:.6g} to {:.6g}", text.back() == 's' ? "" : ",", one.term,
                            one.from, one.to);
        result.curves[one.term] = {{"signal", signal.name},
                                   {"from", formats::five_digits(one.from)},
                                   {"to", formats::five_digits(one.to)},
                                   {"travel_from", formats::five_digits(one.min)},
                                   {"travel_to", formats::five_digits(one.max)}};
        judge_coverage(config, one, result);
    }
    for (const auto &[signal, text] : axes) result.lines.push_back(text);
}

// ---- demand

std::string names_of(const cb_config &config, const std::vector<unsigned> &signals) {
    std::string text;
    for (const unsigned s : signals)
        text += fmt::format("{}{}", text.empty() ? "" : ", ", config.signals[s].name);
    return text;
}

// What a channel demands, as a line for reading.
std::string demand_text(const cb_config &config, const cb_channel_config &channel,
                        const channel_demand &demand) {
    std::string text = fmt::format("channel {}: demand {:.1f} to {:.1f} µm", channel.name,
                                   demand.travel.low_um, demand.travel.high_um);
    if (!demand.positions.empty()) {
        text += fmt::format(" over the travel of {}", names_of(config, demand.positions));
    }
    if (!demand.others.empty()) {
        text += fmt::format(
            "{}; {:.1f} to {:.1f} µm with {} alone over its range",
            demand.positions.empty() ? " at rest" : "", demand.alone.low_um, demand.alone.high_um,
            demand.others.size() == 1 ? names_of(config, demand.others)
                                      : fmt::format("one of {} signals", demand.others.size()));
    }
    text += fmt::format(" (limit_um {:.6g}, error_um {:.6g})", channel.limit_um, channel.error_um);
    if (demand.others.size() > 1) text += ", combinations of these are not covered";
    if (demand.adapted_um > 0.0)
        text += fmt::format("; probes may move it by up to {:.1f} µm more", demand.adapted_um);
    return text;
}

// in : um, the largest demand at `at`
// out: what is beyond error_um or limit_um: "channel Z: the demand reaches 512.3 µm at X = 7000"
std::string reach_text(const cb_config &config, const cb_channel_config &channel,
                       const std::vector<unsigned> &signals, const demand_range &range) {
    return fmt::format("channel {}: the demand reaches {:.1f} µm at {}", channel.name,
                       range.largest_um(), place_text(config, signals, range.at_largest()));
}

// Refuses a demand beyond error_um at rest; remarks one that other signals could cause, and one
// beyond limit_um.
void judge_reach(const cb_config &config, const cb_channel_config &channel,
                 const channel_demand &demand, comparison &result) {
    const auto limit_um = static_cast<double>(channel.limit_um);
    const auto error_um = static_cast<double>(channel.error_um);
    std::vector<unsigned> all = demand.positions;
    all.insert(all.end(), demand.others.begin(), demand.others.end());
    if (demand.travel.largest_um() > error_um) {
        result.refusals.push_back(
            {"", fmt::format("{}, and beyond error_um {:.6g} the box stops with a fault; check "
                             "that the curves are in µm, or set limit_um and error_um to it",
                             reach_text(config, channel, all, demand.travel), error_um)});
    } else if (demand.single.largest_um() > error_um) {
        result.remarks.push_back(fmt::format(
            "{}, and beyond error_um {:.6g} the box stops with a fault; narrow min and max of the "
            "signals to what they can be, or check the term",
            reach_text(config, channel, all, demand.single), error_um));
    }
    if (demand.travel.largest_um() > limit_um && demand.travel.largest_um() <= error_um &&
        limit_um > least_limit_um) {
        result.remarks.push_back(
            fmt::format("{}, and the box ends at limit_um {:.6g}; raise it, or check the curves",
                        reach_text(config, channel, all, demand.travel), limit_um));
    } else if (demand.travel.largest_um() + demand.adapted_um > limit_um &&
               limit_um > least_limit_um && demand.adapted_um > 0.0) {
        result.remarks.push_back(fmt::format(
            "channel {}: probes may move its demand of {:.1f} µm by up to {:.1f} µm more, and the "
            "box ends at limit_um {:.6g}; raise it, or lower bias_max_um and gain_max",
            channel.name, demand.travel.largest_um(), demand.adapted_um, limit_um));
    }
}

void judge_home(const cb_config &config, const cb_channel_config &channel,
                const channel_demand &demand, const std::vector<double> &home, comparison &result) {
    if (!(std::fabs(demand.home_um) > shift_um)) return;
    result.remarks.push_back(fmt::format(
        "channel {}: the demand at {} is {:.1f} µm, so the tool moves when compensation is enabled "
        "there; fit the curves with --zero-at the reference point, or set home_mm in the machine "
        "file's provenance to it",
        channel.name, place_text(config, demand.positions, home), demand.home_um));
}

// Compares the size of the demand with what the channel can write.
void judge_size(const cb_channel_config &channel, const channel_demand &demand,
                comparison &result) {
    const double range_um = demand.travel.high_um - demand.travel.low_um;
    const double largest_um = demand.alone.largest_um();
    const auto slew_um_per_s = static_cast<double>(channel.slew_um_per_s);
    if (largest_um > 0.0 && largest_um < least_um) {
        result.remarks.push_back(fmt::format(
            "channel {}: the demand is {:.3g} µm at most; check that the errors are in µm, not mm",
            channel.name, largest_um));
    } else if (largest_um > 0.0 && static_cast<double>(channel.deadband_um) >= largest_um) {
        result.remarks.push_back(fmt::format(
            "channel {}: deadband_um {:.6g} is more than the whole demand ({:.3g} µm), so the box "
            "writes none of it; lower it",
            channel.name, channel.deadband_um, largest_um));
    } else if (static_cast<double>(channel.unit_um) > largest_um && largest_um > 0.0) {
        result.remarks.push_back(fmt::format(
            "channel {}: one unit of its register is {:.6g} µm, more than the whole demand ({:.3g} "
            "µm); check scale",
            channel.name, channel.unit_um, largest_um));
    }
    if (!demand.positions.empty() && range_um > longest_s * slew_um_per_s) {
        result.remarks.push_back(fmt::format(
            "channel {}: at slew_um_per_s {:.6g} its range of {:.1f} µm takes {:.0f} s; it is a "
            "rate in µm/s",
            channel.name, slew_um_per_s, range_um, range_um / slew_um_per_s));
    }
}

json figures_of(const cb_config &config, const cb_channel_config &channel,
                const channel_demand &demand) {
    json figures = {{"low_um", formats::five_digits(demand.travel.low_um)},
                    {"high_um", formats::five_digits(demand.travel.high_um)},
                    {"home_um", formats::five_digits(demand.home_um)},
                    {"limit_um", formats::five_digits(static_cast<double>(channel.limit_um))},
                    {"error_um", formats::five_digits(static_cast<double>(channel.error_um))}};
    if (demand.adapted_um > 0.0) figures["adapted_um"] = formats::five_digits(demand.adapted_um);
    if (demand.others.empty()) return figures;
    figures["alone_low_um"] = formats::five_digits(demand.alone.low_um);
    figures["alone_high_um"] = formats::five_digits(demand.alone.high_um);
    for (const unsigned s : demand.others)
        figures["alone_signals"].push_back(config.signals[s].name);
    return figures;
}

// Adds a remark for each signal of a bus that is too old before its next reading comes.
void judge_ages(const cb_config &config, comparison &result) {
    for (unsigned s = 0; s < config.signals_count; ++s) {
        const cb_signal_config &signal = config.signals[s];
        if (signal.source != CB_SOURCE_BUS) continue;
        const double every_ms = 1e-3 * config.buses[signal.bus].every_us;
        if (signal.max_age_ms > every_ms) continue;
        result.remarks.push_back(fmt::format(
            "signal {}: the bus reads it every {:.6g} ms, and max_age_ms is {}: it is missing "
            "before each reading",
            signal.name, every_ms, signal.max_age_ms));
    }
}

// Adds a remark for each entry of home_mm that is no place on the travel of an axis.
void judge_home_names(const cb_config &config, const json &file, comparison &result) {
    const json home = provenance_of(file).value("home_mm", json::object());
    for (const auto &[name, value] : home.items()) {
        bool known = false;
        for (unsigned s = 0; s < config.signals_count && value.is_number(); ++s) {
            const cb_signal_config &signal = config.signals[s];
            const auto mm = value.get<double>();
            known = known || (signal.name == name && is_position(config, s) &&
                              mm >= static_cast<double>(signal.min) &&
                              mm <= static_cast<double>(signal.max));
        }
        if (known) continue;
        result.remarks.push_back(fmt::format(
            "provenance.home_mm: {} is no place on the travel of an axis of this file; name "
            "positions, with numbers in mm",
            name));
    }
}

}  // namespace

std::vector<double> home_of(const cb_config &config, const json &file) {
    const json provenance = provenance_of(file);
    const json stated = provenance.value("home_mm", json::object());
    std::vector<double> home;
    for (unsigned s = 0; s < config.signals_count; ++s) {
        const cb_signal_config &signal = config.signals[s];
        home.push_back(rest_value(config, s));
        if (!is_position(config, s)) continue;
        const json own = stated.is_object() ? stated.value(signal.name, json()) : json();
        const auto zero = common_zero(config, provenance, s);
        if (own.is_number())
            home.back() = own.get<double>();
        else if (zero)
            home.back() = *zero;
        home.back() = std::clamp(home.back(), static_cast<double>(signal.min),
                                 static_cast<double>(signal.max));
    }
    return home;
}

std::string place_text(const cb_config &config, const std::vector<unsigned> &signals,
                       const std::vector<double> &at) {
    std::string text;
    for (const unsigned s : signals) {
        text +=
            fmt::format("{}{} = {:.6g}", text.empty() ? "" : ", ", config.signals[s].name, at[s]);
    }
    return text;
}

comparison compare(const cb_config &config, const json &file) {
    comparison result;
    result.channels = result.curves = json::object();
    const auto home = home_of(config, file);
    add_coverage(config, result);
    demand_model model(config, home);
    for (unsigned c = 0; c < config.channels_count; ++c) {
        const cb_channel_config &channel = config.channels[c];
        const channel_demand demand = model.of(c);
        result.channels[channel.name] = figures_of(config, channel, demand);
        result.lines.push_back(demand_text(config, channel, demand));
        judge_reach(config, channel, demand, result);
        judge_home(config, channel, demand, home, result);
        judge_size(channel, demand, result);
    }
    judge_home_names(config, file, result);
    judge_ages(config, result);
    for (const auto &remark : name_remarks(config, file)) result.remarks.push_back(remark);
    for (const auto &remark : pair_remarks(config)) result.remarks.push_back(remark);
    return result;
}

}  // namespace compbox::coefficients
