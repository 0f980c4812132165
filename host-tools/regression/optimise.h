// SPDX-License-Identifier: MIT
// L-BFGS and Levenberg-Marquardt by Ceres, with analytic derivatives.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace compbox::regression {

enum class optimiser { lbfgs, levenberg_marquardt };

// Value at `point`; sets `gradient` if it is not null.
using gradient_function = std::function<double(const double *point, double *gradient)>;

// Values of all residuals, and their row-major Jacobian if it is not null.
using residual_function =
    std::function<void(const double *point, double *values, double *jacobian)>;

struct optimise_options {
    int max_iterations = 500;
    double least_decrease = 1e-7;  // relative decrease of the value per iteration, below which it
                                   // stops
    int memory = 20;               // steps stored (L-BFGS)
    // Called after each iteration with its number (from 0: the start), value and point; false stops
    // there.
    std::function<bool(int, double, const Eigen::VectorXd &)> after;
};

struct optimise_result {
    double value = 0.0;
    int iterations = 0;
    bool usable = true;  // false: the function was not finite near the start
};

// in : point, the start
// out: point, the best found
optimise_result minimise(const gradient_function &function, Eigen::VectorXd &point,
                         const optimise_options &options);

// As minimise, for half the sum of squares, by Levenberg-Marquardt with normal equations
// (Cholesky). An iteration costs residuals x parameters^2, so few must suffice.
optimise_result minimise_squares(const residual_function &function, Eigen::Index residuals,
                                 Eigen::VectorXd &point, const optimise_options &options);

}  // namespace compbox::regression
