// SPDX-License-Identifier: MIT
// L-BFGS by Ceres, on any function with an analytic gradient.
#pragma once

#include <Eigen/Dense>
#include <functional>

namespace compbox {

// Value at `point`; fills `gradient` where it is not null.
using gradient_function = std::function<double(const double *point, double *gradient)>;

struct lbfgs_options {
    int max_iterations = 500;
    double least_decrease = 1e-7;  // relative decrease of the value in one iteration, to go on
    int memory = 20;               // steps remembered
    // Called after each iteration with its number (from 0: the start), value and point; false
    // stops there.
    std::function<bool(int, double, const Eigen::VectorXd &)> after;
};

struct lbfgs_result {
    double value = 0.0;
    int iterations = 0;
    bool usable = true;  // false: the function was not finite anywhere near the start
};

// in : point, the start
// out: point, the best found
lbfgs_result minimise(const gradient_function &function, Eigen::VectorXd &point,
                      const lbfgs_options &options);

}  // namespace compbox
