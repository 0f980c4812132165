// SPDX-License-Identifier: MIT
// What the training of a bank does beside that of a map over given lags (train.h).
#pragma once

#include <functional>

#include "host-tools/regression/averaging.h"
#include "host-tools/training/bank.h"
#include "host-tools/training/train.h"

namespace compbox::training {

// in : result with options and data
// out: options.starts_of_lags without `automatic`; with a bank its time constants, at most as many
//      inputs as leave room for four of them (select_inputs chooses; a remark names them), and
//      errors from each run's first row if zero_at_start. With a prior its time constants;
//      throws input_error if it is of another bank
void prepare_options(train_result &result);

// in : result.range; out: result.test_held
void hold_test_rows(train_result &result);

// out: folds of whole runs, those of training_data::together in one; with fewer than three of them
//      six equal parts of the rows
regression::row_folds bank_folds(const train_result &result);

// in : x, t: scaled rows of result.learn
// out: the mean of maps over the parts of the bank's inputs; with a prior each output is drawn to
//      its brothers, and result.drawn is how
regression::averaged_map average_bank(train_result &result, const Eigen::MatrixXd &x,
                                      const Eigen::MatrixXd &t, const regression::row_folds &folds);

using network_trainer = std::function<train_result(const training_data &, const train_options &)>;

// in : bank: trained; train_network: trains a network on the bank's data; options: the user's, with
//      hidden > 0
// out: the result with the network, if on the runs left out it is significantly better for an
//      output and worse for none; else the bank, with the network's figures and a verdict
train_result best_of(train_result bank, const network_trainer &train_network,
                     const train_options &options);

// out: the rows where another run begins
std::vector<Eigen::Index> starts_of(const std::vector<std::size_t> &run);

}  // namespace compbox::training
