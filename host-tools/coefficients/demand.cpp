// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/demand.h"

#include <algorithm>
#include <cmath>
#include <string>

extern "C" {
#include "firmware/config/config.h"
#include "firmware/terms/kinds.h"
}

namespace compbox::coefficients {

namespace {

constexpr int dense_places = 401, swept_places = 65;
constexpr std::size_t grid_places = 15000, coarse_places = 300;
constexpr int passes = 4;
constexpr double reference_degC = 20.0;  // ISO 1

unsigned root_of(const cb_config &config, unsigned signal) {
    while (config.signals[signal].source == CB_SOURCE_LAG) signal = config.signals[signal].lag_of;
    return signal;
}

// in : ranges: place in the pool of a struct cb_training_range of each input
// out: the value nearest to `value` that a model saw of a signal, or of a lag of it, in training
double trained_near(const cb_config &config, const cb_term_inputs &inputs, unsigned ranges,
                    unsigned signal, double value) {
    const float *range = config.pool + ranges;
    for (unsigned i = 0; i < inputs.count; ++i, range += 4) {
        const unsigned input = config.links[inputs.link + i];
        if (root_of(config, input) != signal || config.signals[input].power == 2) continue;
        value = std::clamp(value, static_cast<double>(range[0]), static_cast<double>(range[1]));
    }
    return value;
}

std::vector<double> evenly(double from, double to, int count) {
    std::vector<double> all;
    for (int i = 0; i < count; ++i) all.push_back(from + (to - from) * i / (count - 1));
    return all;
}

std::vector<double> evenly(const cb_signal_config &signal, int count) {
    return evenly(static_cast<double>(signal.min), static_cast<double>(signal.max), count);
}

void add(demand_range &sum, const demand_range &one, const std::vector<unsigned> &signals) {
    sum.low_um += one.low_um;
    sum.high_um += one.high_um;
    for (const unsigned s : signals) sum.at_low[s] = one.at_low[s], sum.at_high[s] = one.at_high[s];
}

}  // namespace

bool is_position(const cb_config &config, unsigned signal) {
    const std::string unit = config.signals[signal].unit;
    return config.signals[signal].source != CB_SOURCE_LAG && (unit == "mm" || unit == "deg");
}

double rest_value(const cb_config &config, unsigned signal) {
    const cb_signal_config &own = config.signals[signal];
    double value = std::string(own.unit) == "degC" ? reference_degC : 0.0;
    for (unsigned t = 0; t < config.terms_count; ++t) {
        const cb_bpnet_config &net = config.terms[t].as.bpnet;
        if (config.terms[t].type == CB_TERM_BPNET)
            value = trained_near(config, net.inputs, net.ranges, signal, value);
    }
    for (unsigned b = 0; b < config.banks_count; ++b) {
        const cb_bank_config &bank = config.banks[b];
        if (bank.trained) value = trained_near(config, bank.inputs, bank.ranges, signal, value);
    }
    return std::clamp(value, static_cast<double>(own.min), static_cast<double>(own.max));
}

std::set<unsigned> signals_of_output(const cb_config &config, unsigned output) {
    const cb_term_config &term = config.terms[config.outputs[output].term];
    std::set<unsigned> signals;
    unsigned count = 0;
    const std::uint8_t *list = cb_term_signals(&config, &term, &count);
    for (unsigned i = 0; i < count; ++i) {
        if (list[i] != CB_NONE) signals.insert(root_of(config, list[i]));
    }
    list = cb_term_used(&term, &count);
    for (unsigned i = 0; i < count; ++i) {
        if (list[i] != CB_NONE) signals.merge(signals_of_output(config, list[i]));
    }
    return signals;
}

bool is_curve(const cb_term_config &term) {
    return term.type == CB_TERM_BSPLINE || term.type == CB_TERM_POLYLINE ||
           term.type == CB_TERM_POLYNOMIAL;
}

std::pair<double, double> domain_of(const cb_config &config, const cb_curve_config &curve) {
    const auto own = [&](const cb_curve_config &one) {
        const bool plain = one.to > one.from;  // a polynomial
        const float *breaks = config.pool + one.pool;
        return std::pair<double, double>(plain ? one.from : breaks[0],
                                         plain ? one.to : breaks[one.spans]);
    };
    auto domain = own(curve);
    if (curve.reversal_mm > 0.0f) {
        const auto backward = own(config.branches[curve.backward]);
        domain = {std::max(domain.first, backward.first), std::min(domain.second, backward.second)};
    }
    return domain;
}

demand_model::demand_model(const cb_config &config, signal_values home)
    : config_(config),
      home_(std::move(home)),
      signals_(config.signals_count),
      states_(config.terms_count),
      outputs_(config.outputs_count) {}

std::vector<demand_model::group> demand_model::groups_of(unsigned channel) const {
    const cb_channel_config &own = config_.channels[channel];
    return groups_of(std::vector<unsigned>(own.sum, own.sum + own.sum_count));
}

// out: the outputs of a sum, those that share a signal together
std::vector<demand_model::group> demand_model::groups_of(const std::vector<unsigned> &sum) const {
    std::vector<std::pair<std::vector<unsigned>, std::set<unsigned>>> parts;
    for (const unsigned one : sum) {
        std::vector<unsigned> outputs{one};
        auto signals = signals_of_output(config_, one);
        for (std::size_t k = parts.size(); k-- > 0;) {
            const bool apart = std::none_of(parts[k].second.begin(), parts[k].second.end(),
                                            [&](unsigned s) { return signals.count(s) > 0; });
            if (apart) continue;
            outputs.insert(outputs.end(), parts[k].first.begin(), parts[k].first.end());
            signals.insert(parts[k].second.begin(), parts[k].second.end());
            parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(k));
        }
        parts.emplace_back(outputs, signals);
    }
    std::vector<group> groups;
    for (const auto &[outputs, signals] : parts) {
        groups.push_back({outputs, {}, {}});
        for (const unsigned s : signals) {
            (is_position(config_, s) ? groups.back().positions : groups.back().others).push_back(s);
        }
    }
    return groups;
}

// in : direction of travel of all axes: +1, -1, or 0 for unknown
// out: outputs_ of all terms
void demand_model::evaluate(const signal_values &at, int direction) {
    for (std::size_t s = 0; s < signals_.size(); ++s) {
        signals_[s].value = signals_[s].used = static_cast<float>(at[s]);
        signals_[s].known = signals_[s].fresh = true;
    }
    for (std::size_t t = 0; t < states_.size(); ++t) {
        if (!cb_term_has_branches(&config_.terms[t])) continue;
        const float x = signals_[config_.terms[t].as.curve.signal].value;
        states_[t].directed = direction != 0;
        states_[t].direction = {x, static_cast<float>(direction),
                                static_cast<std::int8_t>(direction)};
    }
    bank_ = {};  // steady state
    cb_banks_follow(&config_, signals_.data(), &bank_);
    cb_terms_evaluate(&config_, signals_.data(), &bank_, states_.data(), &counters_, 0.0f,
                      outputs_.data());
}

double demand_model::value(const group &terms, signal_values at, int direction) {
    for (unsigned i = 0; i < config_.lags_count; ++i) {
        const unsigned lag = config_.lags[i];
        const double input = at[config_.signals[lag].lag_of];
        at[lag] = config_.signals[lag].power == 2 ? input * input : input;
    }
    evaluate(at, direction);
    double sum_um = 0.0;
    for (const unsigned output : terms.outputs) {
        sum_um -= static_cast<double>(outputs_[output]);
    }
    return sum_um;
}

// Widens the range by the values at one place, in both directions of travel.
void demand_model::take(demand_range &range, const group &terms, const signal_values &at) {
    const bool first = range.at_low.empty();
    for (const int direction : {1, -1}) {
        if (direction < 0 && config_.branches_count == 0) continue;
        const double um = value(terms, at, direction);
        if ((first && direction > 0) || um < range.low_um) range.low_um = um, range.at_low = at;
        if ((first && direction > 0) || um > range.high_um) range.high_um = um, range.at_high = at;
    }
}

// Searches along one axis after the other from both ends of the range.
void demand_model::refine(demand_range &range, const group &terms,
                          const std::vector<unsigned> &moved) {
    for (int pass = 0; pass < passes; ++pass) {
        const double width_um = range.high_um - range.low_um;
        for (const unsigned s : moved) {
            for (signal_values at : {range.at_low, range.at_high}) {
                for (const double x : places(s)) {
                    at[s] = x;
                    take(range, terms, at);
                }
            }
        }
        if (!(range.high_um - range.low_um > width_um)) return;
    }
}

// in : moved, positions to be varied over their travel; from, the values of all others
// out: the range on a grid of at most most_places; of one position, and of the whole search, with
//      all of its places()
demand_range demand_model::over(const group &terms, const std::vector<unsigned> &moved,
                                const signal_values &from, std::size_t most_places) {
    demand_range range;
    const bool whole = most_places == grid_places;
    const double root = 1.0 / static_cast<double>(std::max<std::size_t>(moved.size(), 1));
    const int each = std::max(2, static_cast<int>(std::pow(most_places, root) + 1e-9));
    std::vector<std::vector<double>> axes;
    std::size_t count = 1;
    for (const unsigned s : moved) {
        axes.push_back(moved.size() == 1 && whole ? places(s) : evenly(config_.signals[s], each));
        count = std::min(count * axes.back().size(), 2 * grid_places);
    }
    signal_values at = from;
    for (std::size_t i = 0; i < count; ++i) {
        std::size_t rest = i;
        for (std::size_t k = 0; k < moved.size(); ++k) {
            at[moved[k]] = axes[k][rest % axes[k].size()];
            rest /= axes[k].size();
        }
        take(range, terms, at);
    }
    if (moved.size() > 1 && whole) refine(range, terms, moved);
    return range;
}

// out: `travel` widened by each other signal of the group alone over its range
demand_range demand_model::each_alone(const group &terms, const demand_range &travel) {
    demand_range range = travel;
    for (const unsigned s : terms.others) {
        signal_values at = home_;
        for (const double x : evenly(config_.signals[s], swept_places)) {
            at[s] = x;
            const demand_range one = over(terms, terms.positions, at, coarse_places);
            if (one.low_um < range.low_um) range.low_um = one.low_um, range.at_low = one.at_low;
            if (one.high_um > range.high_um)
                range.high_um = one.high_um, range.at_high = one.at_high;
        }
    }
    return range;
}

// out: how far probes may move an output from its model, by its bounds; 0 unless its term adapts
double demand_model::adapted_um(unsigned output) {
    const cb_term_config &term = config_.terms[config_.outputs[output].term];
    if (term.type != CB_TERM_ADAPT) return 0.0;
    double model_um = 0.0;
    for (const group &terms : groups_of(std::vector<unsigned>{term.as.adapt.output})) {
        const demand_range travel = over(terms, terms.positions, home_, grid_places);
        model_um += each_alone(terms, travel).largest_um();
    }
    return static_cast<double>(term.as.adapt.settings.bias_max_um) +
           static_cast<double>(term.as.adapt.settings.gain_max) * model_um;
}

// out: the ranges of the groups of the channel, added
channel_demand demand_model::of(unsigned channel) {
    channel_demand demand;
    for (demand_range *range : {&demand.travel, &demand.alone, &demand.single}) {
        range->at_low = range->at_high = home_;
    }
    for (const group &terms : groups_of(channel)) {
        const demand_range travel = over(terms, terms.positions, home_, grid_places);
        std::vector<unsigned> signals = terms.positions;
        signals.insert(signals.end(), terms.others.begin(), terms.others.end());
        add(demand.travel, travel, signals);
        const demand_range alone = each_alone(terms, travel);
        add(demand.alone, alone, signals);
        add(demand.single, terms.others.size() == 1 ? alone : travel, signals);
        if (terms.others.empty()) demand.home_um += value(terms, home_, 0);
        demand.positions.insert(demand.positions.end(), terms.positions.begin(),
                                terms.positions.end());
        demand.others.insert(demand.others.end(), terms.others.begin(), terms.others.end());
    }
    const cb_channel_config &own = config_.channels[channel];
    for (unsigned i = 0; i < own.sum_count; ++i) demand.adapted_um += adapted_um(own.sum[i]);
    std::sort(demand.positions.begin(), demand.positions.end());
    std::sort(demand.others.begin(), demand.others.end());
    return demand;
}

std::vector<unsigned> demand_model::positions_of(unsigned channel) const {
    std::vector<unsigned> all;
    for (const group &terms : groups_of(channel))
        all.insert(all.end(), terms.positions.begin(), terms.positions.end());
    std::sort(all.begin(), all.end());
    return all;
}

demand_range demand_model::across(unsigned channel, unsigned signal, double x) {
    demand_range sum;
    sum.at_low = sum.at_high = home_;
    for (const group &terms : groups_of(channel)) {
        std::vector<unsigned> moved = terms.positions;
        moved.erase(std::remove(moved.begin(), moved.end(), signal), moved.end());
        signal_values at = home_;
        at[signal] = x;
        add(sum, over(terms, moved, at, coarse_places), terms.positions);
    }
    return sum;
}

double demand_model::with_home(unsigned channel, unsigned signal, double x) {
    signal_values at = home_;
    at[signal] = x;
    double sum_um = 0.0;
    for (const group &terms : groups_of(channel)) sum_um += value(terms, at, 0);
    return sum_um;
}

std::vector<double> demand_model::places(unsigned signal) const {
    const cb_signal_config &own = config_.signals[signal];
    std::vector<double> all = evenly(own, dense_places);
    for (unsigned t = 0; t < config_.terms_count; ++t) {
        const cb_term_config &term = config_.terms[t];
        if (!is_curve(term) || term.as.curve.signal != signal) continue;
        const bool pieces = term.type != CB_TERM_POLYNOMIAL;
        for (unsigned i = 0; pieces && i <= term.as.curve.spans; ++i) {
            all.push_back(static_cast<double>(config_.pool[term.as.curve.pool + i]));
        }
    }
    for (double &x : all) {
        x = std::clamp(x, static_cast<double>(own.min), static_cast<double>(own.max));
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

}  // namespace compbox::coefficients
