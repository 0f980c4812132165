// SPDX-License-Identifier: MIT
// Regression by a Gaussian process with a Matern kernel over a straight line, in state-space form.
// It is exact and O(points), because such a process is a linear system driven by white noise: a
// Kalman filter with a backward pass gives the same result as the dense n x n formulas.
#pragma once

#include <vector>

#include "host-tools/fitting/run_noise.h"

namespace compbox::fitting {

// The positions of a regression: measured ones and those without a reading.
struct process_points {
    std::vector<double> x;         // strictly ascending
    std::vector<double> y;         // ignored where not measured
    std::vector<double> variance;  // of y, in units of noise^2; 0 where x is not measured
    std::size_t measured = 0;      // their number
    std::vector<double> step;      // number of the target, fractions between two; along it the
                                   // noise of a run is correlated
    std::vector<double> drift;     // standard deviation of the mean's correlated noise, in units of
                                   // noise * sqrt(share); positive everywhere

    // Prior knowledge of noise^2 from repeats: a mean square with its degrees of freedom.
    double prior_variance = 0.0;
    double prior_freedom = 0.0;
};

// y = a + b x + f(x) + noise. f is a Matern process of smoothness kind + 1/2 (kind 0 … 4: the curve
// has kind continuous derivatives), signal variance ratio * noise^2.
struct matern {
    int kind = 1;
    double length = 1.0;  // in units of x
    double ratio = 1.0;   // signal variance / noise^2
    noise_kind noise = {};
};

enum { matern_kinds = 5 };

struct matern_likelihood {
    double log_likelihood = 0.0;  // restricted (line integrated out), noise^2 at its best; up to a
                                  // constant that all models of the same points share
    double noise_variance = 0.0;  // that noise^2, from the residuals and the repeats
};

// One forward pass.
matern_likelihood likelihood_of(const process_points &points, const matern &model);

// All at every x, given all readings.
struct matern_curve {
    matern_likelihood likelihood;
    std::vector<double> mean, variance;  // of the curve
    // With the correlated noise, which is all that a reading's neighbours know about it; equal to
    // `mean` and `variance` with white noise.
    std::vector<double> reading_mean, reading_variance;
    std::vector<double> covariance;  // of the curve with that
};

// One forward and one backward pass.
matern_curve regress(const process_points &points, const matern &model);

}  // namespace compbox::fitting
