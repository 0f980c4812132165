// SPDX-License-Identifier: MIT
// What a probe every so often leaves of an error, with the box's own filter (models/adapt.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

extern "C" {
#include "models/adapt.h"
}

namespace compbox::adaptation {

// One output over the rows of a record in order of time.
struct error_series {
    std::vector<double> time_s, error_um;
    std::vector<double> model_um;  // by a model that has not seen the row's run
    std::vector<bool> begins;      // a row where the box starts anew: its clock or its zero does
    std::vector<std::size_t> run;
    std::vector<cb_sigma> own;  // the model's own sigma at each row; empty: it states none

    std::size_t rows() const { return time_s.size(); }
    const cb_sigma *own_at(std::size_t row) const { return own.empty() ? nullptr : &own[row]; }
};

// How the simulated control probes: at the first row of each interval since the last measurement,
// and, if it repeats, at the next row where the box asks for another one. A share of measurements
// is wrong by wrong_um.
struct probing {
    double interval_s = 3600.0;
    double wrong_share = 0.0, wrong_um = 100.0;
    bool repeats = false;
    std::uint64_t seed = 1;
};

struct probed_course {
    std::vector<double> left_um;   // of each row: error - term, as it is before the row's probe
    std::vector<double> sigma_um;  // of each row: what the filter states for left_um, probe's noise
                                   // included
    std::vector<double> innovation_um, expected_um;  // of each right probe that was judged
    double most_bias_um = 0.0;                       // largest |b|
    std::vector<double> gains;                       // |g| after each probe that was taken
    std::vector<double> moves_um;                    // |movement| by each probe that was taken
    std::size_t probes = 0, asked = 0;
};

// in : settings inside the ranges of models/adapt.h
// out: the course of an `adapt` term over the series
probed_course simulate_probes(const error_series &series, const cb_adapt_settings &settings,
                              const probing &how);

// out: error - last measurement at each row; the error itself before the first one: a compensation
//      by the probe alone
std::vector<double> rezero(const error_series &series, const probing &how);

// Drift, gain drift and noise of an error series, the box's names and units.
struct drift_rates {
    double drift_um_per_sqrt_h = 1.0, gain_drift_per_sqrt_h = 0.05, sigma_um = 1.0;
};

// in : intervals_s: 1 or more; sigma_um: of a probe if it is known, else 0
// out: the rates that maximise the likelihood of the filter's innovations, pooled over probes at
//      these intervals (prediction error decomposition), beside the model's own sigma. All are then
//      scaled alike, which leaves the filter's gain as it is, so that 94 to 97 % of the innovations
//      are within two standard deviations; a given sigma_um stays.
drift_rates estimate_drift(const error_series &series, const std::vector<double> &intervals_s,
                           double sigma_um);

// out: the value below which this share of the values lies; 0 of none
double quantile(std::vector<double> values, double share);

}  // namespace compbox::adaptation
