// SPDX-License-Identifier: MIT
// Regression by a Gaussian process with a Matern kernel over a straight line, in state-space form:
// exact, O(points), because such a process is a linear system driven by white noise. What a Kalman
// filter and a backward pass over it give is the same as the dense n x n formulas.
#pragma once

#include <vector>

namespace compbox {

// The positions of a regression: measured ones and those where only the curve is wanted.
struct process_points {
    std::vector<double> x;         // strictly ascending
    std::vector<double> y;         // ignored where not measured
    std::vector<double> variance;  // of y, in units of noise^2; 0 where x is not measured
    std::size_t measured = 0;      // how many are

    // What repeats say beforehand about noise^2: a mean square with its degrees of freedom.
    double prior_variance = 0.0;
    double prior_freedom = 0.0;
};

// y = a + b x + f(x) + noise. f is a Matern process of smoothness kind + 1/2 (kind 0 … 4: the
// curve has kind continuous derivatives), signal variance ratio * noise^2.
struct matern {
    int kind = 1;
    double length = 1.0;  // in units of x
    double ratio = 1.0;   // signal variance / noise^2
};

enum { matern_kinds = 5 };

struct matern_likelihood {
    double log_likelihood = 0.0;  // restricted (line integrated out), noise^2 at its best; up to a
                                  // constant that is the same for every model of the same points
    double noise_variance = 0.0;  // that noise^2, from the residuals and the repeats together
};

// One pass forward.
matern_likelihood likelihood_of(const process_points &points, const matern &model);

struct matern_curve {
    matern_likelihood likelihood;
    std::vector<double> mean, variance;  // of the curve at every x, given all readings
};

// Forward and back.
matern_curve regress(const process_points &points, const matern &model);

}  // namespace compbox
