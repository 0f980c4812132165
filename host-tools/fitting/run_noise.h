// SPDX-License-Identifier: MIT
// How the noise of one run is correlated along it, by the runs' deviations from their mean. No
// model of the curve is needed: the curve is the same in all runs.
#pragma once

#include <vector>

#include "host-tools/fitting/measurement.h"

namespace compbox::fitting {

// This share of noise^2 is correlated by exp(-steps / length) between two targets, the rest is
// white. A step leads from one target to the next one.
struct noise_kind {
    double share = 0.0;   // 0 … < 1
    double length = 1.0;  // in steps
    bool white() const { return share <= 0.0; }
    // Of two readings of one run, at neighbouring targets.
    double neighbours() const;
};

// What the repeats show about one kind. With freedom 0 (no repeats) they show nothing.
struct noise_evidence {
    noise_kind kind;
    double log_prior = 0.0;        // white noise has one half
    double log_determinant = 0.0;  // of the deviations' covariance / noise^2
    double mean_square = 0.0;      // noise^2 by the deviations
    double freedom = 0.0;
    double log_likelihood() const;  // with noise^2 at its best
};

// in : runs with their positions; each run's offset and slope are subtracted first
// out: white noise, and with repeats each kind of a lattice of lengths (up to the travel) and
// shares Restricted likelihood of the independent differences between runs; exact if every run has
// every target with the same sigma, else an approximation with the right degrees of freedom.
std::vector<noise_evidence> noise_of_runs(const measurement &data);

// out: white noise and some kinds over all lengths, for one run, where nothing but readings
// averaged
//      in cells shows the white part
std::vector<noise_evidence> possible_noise(const measurement &data);

// in : a measurement with repeats at three or more positions
// out: variance of the slope of the least-squares line through the mean, with the kinds of noise
//      that the repeats show, each by its likelihood
double variance_of_slope(const measurement &data);

// How much offsets and slopes of the runs' own explain beyond correlated noise: the gain of twice
// the log likelihood, each with its most likely kind of noise.
double gain_by_lines(const measurement &data);

}  // namespace compbox::fitting
