// SPDX-License-Identifier: MIT
#include "host-tools/adaptation/probing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace compbox::adaptation {

namespace {

constexpr double s_of_h = 3600.0;
constexpr double least_sigma_um = 0.5, least_drift = 0.05, least_gain_drift = 1e-3;
constexpr double most_gain_drift = 0.5, most_rate_um = 500.0;

// Draws the wrong measurements; the same for each call with the same seed.
class wrong_ones {
  public:
    explicit wrong_ones(const probing &how) : how_(how), dice_(how.seed) {}

    // out: what is added to the next measurement, um
    double next_um() {
        const bool wrong = share_(dice_) < how_.wrong_share;
        const double sign = share_(dice_) < 0.5 ? -1.0 : 1.0;
        return wrong ? sign * how_.wrong_um : 0.0;
    }

  private:
    const probing &how_;
    std::mt19937_64 dice_;
    std::uniform_real_distribution<double> share_{0.0, 1.0};
};

// Says at which rows the control probes.
class timetable {
  public:
    explicit timetable(const probing &how) : how_(how) {}

    bool is_due(double time_s, bool begins, bool asked) {
        constexpr double rounding_s = 1e-3;
        if (begins) last_s_ = time_s;
        if (!asked && time_s - last_s_ < how_.interval_s - rounding_s) return false;
        if (time_s <= last_s_) return false;
        last_s_ = time_s;
        return true;
    }

  private:
    const probing &how_;
    double last_s_ = 0.0;
};

// A measurement as the likelihood sees it: hours since the one before (or the start), the error and
// the model.
struct measurement {
    double after_h, error_um, model_um;
    bool begins;
    double own_um2;  // variance by the model's own sigma: of the change since the one before; of a
                     // first one of the error itself
};

// out: the variance by which the model may be off at the row, beside what was known at the row
//      `before`; nothing was if this one begins
double own_variance(const error_series &series, std::size_t row, std::size_t before, bool begins) {
    if (series.own.empty()) return 0.0;
    const cb_sigma &own = series.own[row];
    return static_cast<double>(begins ? cb_sigma_variance(&own)
                                      : cb_sigma_change(&own, series.own[before].place));
}

// out: one measurement at each interval, and the first one after each start
std::vector<measurement> measurements_at(const error_series &series, double interval_s) {
    std::vector<measurement> all;
    probing how;
    how.interval_s = interval_s;
    timetable times(how);
    double last_s = 0.0;
    std::size_t last = 0;
    bool begins = true;
    for (std::size_t r = 0; r < series.rows(); ++r) {
        if (series.begins[r]) last_s = series.time_s[r], begins = true;
        if (!times.is_due(series.time_s[r], series.begins[r], false)) continue;
        all.push_back({(series.time_s[r] - last_s) / s_of_h, series.error_um[r], series.model_um[r],
                       begins, own_variance(series, r, last, begins)});
        last_s = series.time_s[r], last = r, begins = false;
    }
    return all;
}

// The filter of models/adapt.h in double precision, without bounds and gate: b, g and their
// covariance.
struct plain_filter {
    double b = 0.0, g = 0.0, bb = 1.0, bg = 0.0, gg = 0.25;

    // in : one measurement; out: innovation and its variance, before the state follows it
    std::array<double, 2> take(const measurement &one, const drift_rates &rates) {
        bb += rates.drift_um_per_sqrt_h * rates.drift_um_per_sqrt_h * one.after_h;
        gg += rates.gain_drift_per_sqrt_h * rates.gain_drift_per_sqrt_h * one.after_h;
        bb = one.begins ? std::max(bb, one.own_um2) : bb + one.own_um2;
        const double m = one.model_um;
        const double of_b = bb + m * bg, of_g = bg + m * gg;
        const double s = rates.sigma_um * rates.sigma_um + of_b + m * of_g;
        const double innovation = one.error_um - (b + (1.0 + g) * m);
        b += of_b / s * innovation, g += of_g / s * innovation;
        bb -= of_b * of_b / s, bg -= of_b * of_g / s, gg -= of_g * of_g / s;
        return {innovation, s};
    }
};

// Calls with each innovation and its variance. The first one after a start is left out, because it
// shows the start and no drift.
template <typename Function>
void for_each_innovation(const std::vector<measurement> &probes, const drift_rates &rates,
                         const Function &function) {
    plain_filter filter;
    for (const measurement &one : probes) {
        if (one.begins) filter = plain_filter();
        const auto [innovation, variance] = filter.take(one, rates);
        if (!one.begins) function(innovation, variance);
    }
}

// out: -2 times the logarithm of the likelihood, a mean over the innovations of each interval, so
//      that each interval counts alike
double unlikeliness(const std::vector<std::vector<measurement>> &all, const drift_rates &rates) {
    double sum = 0.0;
    for (const auto &probes : all) {
        double own = 0.0;
        std::size_t count = 0;
        for_each_innovation(probes, rates, [&](double innovation, double variance) {
            own += innovation * innovation / variance + std::log(variance), ++count;
        });
        sum += own / static_cast<double>(std::max<std::size_t>(count, 1));
    }
    return sum;
}

// in : known_sigma: sigma_um stays
drift_rates clamped(drift_rates rates, bool known_sigma) {
    rates.drift_um_per_sqrt_h = std::clamp(rates.drift_um_per_sqrt_h, least_drift, most_rate_um);
    rates.gain_drift_per_sqrt_h =
        std::clamp(rates.gain_drift_per_sqrt_h, least_gain_drift, most_gain_drift);
    if (known_sigma) return rates;
    rates.sigma_um = std::clamp(rates.sigma_um, least_sigma_um, most_rate_um);
    return rates;
}

// in : known_sigma: sigma_um stays
// out: the rates after a search along each of them by smaller and smaller factors
drift_rates most_likely(const std::vector<std::vector<measurement>> &all, drift_rates rates,
                        bool known_sigma) {
    std::vector<double drift_rates::*> searched{&drift_rates::drift_um_per_sqrt_h,
                                                &drift_rates::gain_drift_per_sqrt_h};
    if (!known_sigma) searched.push_back(&drift_rates::sigma_um);
    double best = unlikeliness(all, rates);
    for (double factor = 3.0; factor > 1.02;) {
        bool better = false;
        for (const auto rate : searched) {
            for (const double by : {factor, 1.0 / factor}) {
                drift_rates tried = rates;
                tried.*rate *= by;
                tried = clamped(tried, known_sigma);
                const double sum = unlikeliness(all, tried);
                if (sum < best - 1e-9) best = sum, rates = tried, better = true;
            }
        }
        if (!better) factor = std::sqrt(factor);
    }
    return rates;
}

// out: the factor for all standard deviations by which 94 to 97 % of the innovations are within
//      two, in the mean over the intervals
double scale_for_coverage(const std::vector<std::vector<measurement>> &all,
                          const drift_rates &rates) {
    constexpr std::size_t least = 20;
    double low = 0.0, high = 0.0, intervals = 0.0;
    for (const auto &probes : all) {
        std::vector<double> normalised;
        for_each_innovation(probes, rates, [&](double innovation, double variance) {
            normalised.push_back(std::fabs(innovation) / std::sqrt(variance));
        });
        if (normalised.size() < least) continue;
        low += quantile(normalised, 0.94), high += quantile(normalised, 0.97), intervals += 1.0;
    }
    if (intervals == 0.0) return 1.0;
    low /= intervals, high /= intervals;
    return low > 2.0 ? low / 2.0 : high < 2.0 ? std::max(high / 2.0, 0.1) : 1.0;
}

}  // namespace

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0.0;
    const auto at = static_cast<std::ptrdiff_t>(std::min(share * static_cast<double>(values.size()),
                                                         static_cast<double>(values.size() - 1)));
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return values[static_cast<std::size_t>(at)];
}

probed_course simulate_probes(const error_series &series, const cb_adapt_settings &settings,
                              const probing &how) {
    probed_course course;
    timetable times(how);
    wrong_ones wrong(how);
    cb_adapt state;
    for (std::size_t r = 0; r < series.rows(); ++r) {
        if (series.begins[r]) cb_adapt_start(&state);
        const double gone_s = series.begins[r] ? 0.0 : series.time_s[r] - series.time_s[r - 1];
        cb_adapt_wait(&settings, &state, static_cast<float>(gone_s / s_of_h));
        const auto m = static_cast<float>(series.model_um[r]);
        const float before = cb_adapt_value(&settings, state.bias_um, state.gain, m);
        course.left_um.push_back(series.error_um[r] - static_cast<double>(before));
        const auto sigma = static_cast<double>(cb_adapt_sigma(&state, m, series.own_at(r)));
        course.sigma_um.push_back(std::hypot(sigma, static_cast<double>(settings.sigma_um)));
        if (!times.is_due(series.time_s[r], series.begins[r], how.repeats && state.asked)) continue;
        const double off_um = wrong.next_um();
        const float probed = static_cast<float>(series.error_um[r] + off_um);
        const cb_adapt_outcome outcome =
            cb_adapt_probe(&settings, &state, probed, m, series.own_at(r));
        ++course.probes, course.asked += outcome == CB_ADAPT_ASK;
        if (off_um == 0.0 && outcome != CB_ADAPT_EARLY && outcome != CB_ADAPT_IMPLAUSIBLE) {
            course.innovation_um.push_back(static_cast<double>(state.innovation_um));
            course.expected_um.push_back(static_cast<double>(state.expected_um));
        }
        if (!cb_adapt_was_taken(outcome)) continue;
        const float after = cb_adapt_value(&settings, state.bias_um, state.gain, m);
        course.moves_um.push_back(std::fabs(static_cast<double>(after - before)));
        course.most_bias_um =
            std::max(course.most_bias_um, std::fabs(static_cast<double>(state.bias_um)));
        course.gains.push_back(std::fabs(static_cast<double>(state.gain)));
    }
    return course;
}

std::vector<double> rezero(const error_series &series, const probing &how) {
    std::vector<double> left_um;
    timetable times(how);
    wrong_ones wrong(how);
    double last_um = 0.0;
    for (std::size_t r = 0; r < series.rows(); ++r) {
        if (series.begins[r]) last_um = 0.0;
        left_um.push_back(series.error_um[r] - last_um);
        if (!times.is_due(series.time_s[r], series.begins[r], false)) continue;
        last_um = series.error_um[r] + wrong.next_um();
    }
    return left_um;
}

drift_rates estimate_drift(const error_series &series, const std::vector<double> &intervals_s,
                           double sigma_um) {
    std::vector<std::vector<measurement>> all;
    for (const double interval_s : intervals_s) {
        all.push_back(measurements_at(series, interval_s));
    }
    drift_rates rates;
    const bool known = sigma_um > 0.0;
    if (known) rates.sigma_um = sigma_um;
    rates = most_likely(all, rates, known);
    const double scale = scale_for_coverage(all, rates);
    rates.drift_um_per_sqrt_h *= scale, rates.gain_drift_per_sqrt_h *= scale;
    if (!known) rates.sigma_um *= scale;
    return clamped(rates, known);
}

}  // namespace compbox::adaptation
