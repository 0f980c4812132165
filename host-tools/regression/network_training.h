// SPDX-License-Identifier: MIT
// Training of the network: weight decay and length of training by leaving out whole runs, or
// weight decay by evidence; several starts.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>

#include "host-tools/regression/network.h"
#include "host-tools/regression/optimise.h"
#include "host-tools/regression/ridge.h"

namespace compbox::regression {

struct network_task {
    network_shape shape;
    Eigen::MatrixXd x, t;  // scaled; one sample per row
    row_folds folds;
    int starts = 5;
    std::uint64_t seed = 1;
    int threads = 0;
    optimiser way = optimiser::lbfgs;  // with evidence; folds always use L-BFGS
    int max_iterations = 300;
    double least_decrease = 1e-6;
    // Called with 0 … 1 and the loss of the finished part; calls never overlap.
    std::function<void(double, double)> progress;
};

struct trained_network {
    Eigen::VectorXd parameters;
    double decay = 0.0;         // of the hidden layer's weights, in and out
    double linear_decay = 0.0;  // with evidence only
    double loss = 0.0;          // of the best start
    double log_evidence = 0.0;  // with evidence only
    double effective_parameters = 0.0;
    int iterations = 0;  // of the best start
    int best_start = 0;
    Eigen::MatrixXd left_out;  // with folds only: each row by a network trained without its run
};

// Chooses decay (of a grid) and number of iterations by the least residuals of the left-out runs
// (square of the worst residual, averaged over outputs and folds). Then trains on all rows from
// each start, with the same number. The residuals of a left-out run are those with the decay and
// length that the other runs choose. Beside a linear path training starts from the linear map
// (decay `linear_decay` of each output), so that zero iterations give the baseline itself.
trained_network train_by_folds(const network_task &task, const Eigen::VectorXd &linear_decay);

// MacKay's evidence with the Gauss-Newton Hessian, with separate decays for hidden, output and
// linear weights. out: the start with the highest evidence
trained_network train_by_evidence(const network_task &task, double linear_decay);

}  // namespace compbox::regression
