// SPDX-License-Identifier: MIT
#include "host-tools/metrology/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "host-tools/metrology/straightness.h"
#include "host-tools/metrology/temperature.h"

namespace compbox::metrology {

namespace {

// A range R of equally probable values has the standard uncertainty R / sqrt(12), so U = 0.6 R. The
// standards round 1 / sqrt(3) to this figure.
constexpr double U_of_range = 0.6;
// The error of a length by an offset up to R over it lies between 0 and R^2 / 2L: 0.6 / 2.
constexpr double U_of_cosine = 0.3;
constexpr double mm_per_m = 1000.0, um_per_mm = 1000.0;

// out: U of the instrument over a length: both parts by their squares
std::optional<double> device_over(const budget_inputs &inputs, double length_m) {
    if (!inputs.device_um && !inputs.device_um_per_m) return {};
    return std::hypot(inputs.device_um.value_or(0.0),
                      inputs.device_um_per_m.value_or(0.0) * length_m);
}

// Index of the target with the most (sign 1) or least (sign -1) rest about a slope.
std::size_t extreme(double sign, double slope, const std::vector<double> &x,
                    const std::vector<double> &y) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < x.size(); ++i) {
        if (sign * (y[i] - slope * x[i]) > sign * (y[best] - slope * x[best])) best = i;
    }
    return best;
}

// Targets on the edges of the minimum zone: those whose line has its slope.
std::pair<std::size_t, std::size_t> edge_of(double slope, const std::vector<double> &x,
                                            const std::vector<double> &y) {
    std::pair<std::size_t, std::size_t> best{0, x.size() - 1};
    double least = INFINITY;
    for (const double sign : {1.0, -1.0}) {
        const std::size_t a = extreme(sign, slope, x, y);
        for (std::size_t b = 0; b < x.size(); ++b) {
            if (b == a) continue;
            const double off = std::fabs((y[b] - slope * x[b]) - (y[a] - slope * x[a]));
            if (off < least) {
                least = off;
                best = std::minmax(a, b);
            }
        }
    }
    return best;
}

// out: the derivative of a line's slope by each y
std::vector<double> slope_weights(reference line, double slope, const std::vector<double> &x,
                                  const std::vector<double> &y) {
    std::vector<double> weights(x.size());
    if (line == reference::least_squares) {
        double mean = 0.0, squares = 0.0;
        for (const double at : x) mean += at / static_cast<double>(x.size());
        for (const double at : x) squares += (at - mean) * (at - mean);
        for (std::size_t i = 0; i < x.size(); ++i) weights[i] = (x[i] - mean) / squares;
        return weights;
    }
    const auto ends = line == reference::end_point
                          ? std::pair<std::size_t, std::size_t>{0, x.size() - 1}
                          : edge_of(slope, x, y);
    weights[ends.second] = 1.0 / (x[ends.second] - x[ends.first]);
    weights[ends.first] = -weights[ends.second];
    return weights;
}

// Whether R of both directions is 2 s + 2 s + |B| at its target, and not 4 s of one direction.
bool by_reversal(const iso230_2_figures &figures) {
    const auto &all = figures.repeatability;
    const auto worst =
        static_cast<std::size_t>(std::max_element(all.begin(), all.end()) - all.begin());
    const double s =
        std::max(*figures.forward->targets[worst].s, *figures.backward->targets[worst].s);
    return all[worst] > 4.0 * s;
}

double slope_of(reference line, const std::vector<double> &x, const std::vector<double> &y) {
    switch (line) {
        case reference::end_point:
            return end_point_line(x, y).slope;
        case reference::least_squares:
            return least_squares_line(x, y).slope;
        case reference::minimum_zone:
            break;
    }
    return minimum_zone_line(x, y).slope;
}

}  // namespace

double budget::systematic() const {
    double squares = 0.0;
    for (const auto &one : {device, misalignment, temperature, expansion}) {
        squares += one.value_or(0.0) * one.value_or(0.0);
    }
    return std::sqrt(squares);
}

budget positioning_budget(const budget_inputs &inputs, double length_mm) {
    const double length_m = length_mm / mm_per_m;
    budget known = transverse_budget(inputs, length_mm);
    if (inputs.misalignment_mm) {
        const double offset = *inputs.misalignment_mm;
        known.misalignment = U_of_cosine * offset * offset / length_mm * um_per_mm;
    }
    if (inputs.temperature_K) {
        if (!inputs.expansion_um_per_m_K) throw std::logic_error("no expansion coefficient");
        known.temperature =
            U_of_range * std::fabs(*inputs.expansion_um_per_m_K) * length_m * *inputs.temperature_K;
    }
    if (inputs.expansion_range) {
        if (!inputs.material_degC) throw std::logic_error("no material temperature");
        known.expansion = U_of_range * std::fabs(*inputs.material_degC - reference_degC) *
                          length_m * *inputs.expansion_range;
    }
    return known;
}

budget transverse_budget(const budget_inputs &inputs, double length_mm) {
    budget known;
    known.device = device_over(inputs, length_mm / mm_per_m);
    if (inputs.eve_um) known.environment = U_of_range * *inputs.eve_um;
    return known;
}

double figure_uncertainty(const budget &known, const axis_readings &axis,
                          const iso230_2_figures &figures, char letter, approach which) {
    const bool both = which == approach::both;
    const double up = static_cast<double>(axis.runs_forward());
    const double down = static_cast<double>(axis.runs_backward());
    // A figure of both directions may take its largest and its smallest value from either.
    const double n = both ? std::min(up, down) : which == approach::forward ? up : down;
    const bool along = letter == 'A' || letter == 'E' || letter == 'M';
    double share = 0.0;
    switch (letter) {
        case 'A':  // two means and two standard deviations, each twice
            share = 2.0 / n + 8.0 / (n - 1.0);
            break;
        case 'R':  // a standard deviation, four times
            share = both && by_reversal(figures)
                        ? 4.0 / (up - 1.0) + 4.0 / (down - 1.0) + 1.0 / up + 1.0 / down
                        : 16.0 / (n - 1.0);
            break;
        case 'E':  // two means
            share = 2.0 / n;
            break;
        case 'M':  // two means of both directions
            share = 0.5 / up + 0.5 / down;
            break;
        case 'B':  // a mean of each direction
            share = 1.0 / up + 1.0 / down;
            break;
        default:
            throw std::logic_error("no figure of ISO 230-2");
    }
    const double environment = std::sqrt(share) * known.environment.value_or(0.0);
    return along ? std::hypot(known.systematic(), environment) : environment;
}

double straightness_uncertainty(const budget &known, reference line, const std::vector<double> &x,
                                const std::vector<double> &y, const std::vector<int> &readings) {
    const double slope = slope_of(line, x, y);
    const std::size_t high = extreme(1.0, slope, x, y), low = extreme(-1.0, slope, x, y);
    const std::vector<double> weights = slope_weights(line, slope, x, y);
    double squares = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double own = (i == high ? 1.0 : 0.0) - (i == low ? 1.0 : 0.0);
        const double effect = own - (x[high] - x[low]) * weights[i];
        squares += effect * effect / static_cast<double>(readings[i]);
    }
    return std::hypot(known.device.value_or(0.0),
                      std::sqrt(squares) * known.environment.value_or(0.0));
}

}  // namespace compbox::metrology
