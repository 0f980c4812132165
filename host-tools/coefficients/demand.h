// SPDX-License-Identifier: MIT
// The demand of a coefficient file's channels over the travel, by the box's own terms.
#pragma once

#include <cstddef>
#include <set>
#include <utility>
#include <vector>

extern "C" {
#include "firmware/config/term.h"
#include "firmware/terms/terms.h"
}

namespace compbox::coefficients {

// A value of each signal, in its unit; lags follow their signals.
using signal_values = std::vector<double>;

struct demand_range {
    double low_um = 0.0, high_um = 0.0;  // low <= high
    signal_values at_low, at_high;

    double largest_um() const { return high_um > -low_um ? high_um : -low_um; }
    const signal_values &at_largest() const { return high_um > -low_um ? at_high : at_low; }
};

// Demand of one channel: -sum of its terms, before limits.
struct channel_demand {
    demand_range travel;  // all positions of the travel, all combinations; other signals at rest
    demand_range alone;   // … and each other signal alone over its range, its lags with it
    // The same, but terms of several other signals at rest: thermometers that warm up together say
    // nothing about one of them alone.
    demand_range single;
    // What probes may add to the terms of type adapt, whose b and g are 0 above: the sum of
    // bias_max + gain_max |m|, with the largest |m| of each; 0 without such terms.
    double adapted_um = 0.0;
    double home_um = 0.0;                     // at home, of the terms of positions alone
    std::vector<unsigned> positions, others;  // signals that it depends on, without lags
};

// Positions have the unit mm or deg. At rest a thermometer (degC) shows 20, any other signal 0, or
// what is nearest in its range and in the range that models of it were trained on: beyond that a
// model fades to zero.
bool is_position(const cb_config &config, unsigned signal);
double rest_value(const cb_config &config, unsigned signal);

// out: the signals, without lags, that an output depends on, also by the terms that it uses
std::set<unsigned> signals_of_output(const cb_config &config, unsigned output);

// in : a curve. out: its lowest and highest x, with a branch those that both branches have
bool is_curve(const cb_term_config &term);
std::pair<double, double> domain_of(const cb_config &config, const cb_curve_config &curve);

// Evaluates a configuration, which must outlive it. Terms of different signals are searched apart
// and added, so a range of curves is that of all corners. A term of up to four positions is
// searched on a grid, then along each axis; of more than that or with other signals it is sampled.
class demand_model {
  public:
    // in : home, a value for each signal; positions within min … max
    demand_model(const cb_config &config, signal_values home);

    channel_demand of(unsigned channel);
    std::vector<unsigned> positions_of(unsigned channel) const;

    // The range with the position `signal` at x, the other positions anywhere or at home.
    demand_range across(unsigned channel, unsigned signal, double x);
    double with_home(unsigned channel, unsigned signal, double x);

    // Places where the curves of a position are searched: their ends and knots, and between.
    std::vector<double> places(unsigned signal) const;

  private:
    struct group {
        std::vector<unsigned> outputs, positions, others;
    };

    std::vector<group> groups_of(const std::vector<unsigned> &sum) const;
    std::vector<group> groups_of(unsigned channel) const;
    double adapted_um(unsigned output);
    void evaluate(const signal_values &at, int direction);
    double value(const group &terms, signal_values at, int direction);
    demand_range over(const group &terms, const std::vector<unsigned> &moved,
                      const signal_values &from, std::size_t most_places);
    void take(demand_range &range, const group &terms, const signal_values &at);
    void refine(demand_range &range, const group &terms, const std::vector<unsigned> &moved);
    demand_range each_alone(const group &terms, const demand_range &travel);

    const cb_config &config_;
    signal_values home_;
    std::vector<cb_signal_state> signals_;
    cb_bank_state bank_ = {};
    std::vector<cb_term_state> states_;
    std::vector<float> outputs_;
    cb_counters counters_ = {};
};

}  // namespace compbox::coefficients
