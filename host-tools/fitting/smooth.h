// SPDX-License-Identifier: MIT
// The best estimate of a measured curve before the choice of a form: many smoothness assumptions,
// weighted by how well each explains the readings (docs/fitting.md).
#pragma once

#include <functional>
#include <vector>

#include "host-tools/fitting/measurement.h"

namespace compbox::fitting {

struct smooth_curve {
    std::vector<double> x;           // all measured positions and points between them, ascending
    std::vector<double> mean;        // best estimate, unit of the error
    std::vector<double> sigma;       // its standard deviation
    std::vector<double> more_sigma;  // in addition, not reducible by smoothing otherwise: the mean
                                     // of the runs' own lines, and in a single run slow noise
    std::vector<std::size_t> measured;  // index in x of each measured position

    double noise = 0.0;                   // standard deviation of one reading (of weight 1)
    bool noise_measured = false;          // by repeats or a sigma column; else assumed
    double noise_correlation = 0.0;       // of two readings of a run at neighbouring targets
    double widened = 1.0;                 // rms of sigma / rms of sigma if all readings were
                                          // independent; 1 without repeats
    double effective_coefficients = 0.0;  // number of degrees of freedom of the readings that the
                                          // estimate uses
    std::vector<double> left_out;  // reading - estimate made without it, at each measured position
    std::vector<double> left_out_variance;  // expected variance of such a difference
    double left_out_rms = 0.0;
    double white = 0.0;  // probability that the noise is white
    // Whether the repeats show noise that is correlated within the runs, and it matters.
    bool correlated() const { return white < 0.05 && widened > 1.3; }
};

// in : a measurement of at least 3 positions; between: number of additional points in each interval
//      (0 …); progress: called with 0 … 1, may be empty
// out: the average over Matern processes of five smoothnesses and of all length scales and signal
//      sizes, and over the kinds of noise that the repeats permit, weighted by restricted
//      likelihood and, without other knowledge of the noise, by the usual noise of instruments;
//      deterministic
smooth_curve smooth(const measurement &data, int between,
                    const std::function<void(double)> &progress = {});

}  // namespace compbox::fitting
