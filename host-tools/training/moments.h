// SPDX-License-Identifier: MIT
// What the rows of one machine say about the weights of its bank, in a file: enough for a prior.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"
#include "host-tools/training/dataset.h"

namespace compbox::training {

// Banks of the same inputs, powers and lags have their weights in one space.
struct bank_space {
    std::vector<std::string> inputs, speeds, outputs;
    std::vector<double> tau_s;  // ascending, without the 0 of the unlagged inputs

    Eigen::Index columns() const;  // of a bank, in its order
    // "" or in what they differ
    std::string difference(const bank_space &other) const;
};

// The members "outputs" and "bank" of a file. Reading throws input_error for what no bank has.
json json_of(const bank_space &space);
bank_space space_of(const json &file, const std::string &path);

// Each offset is free: x and t are counted from their means.
struct bank_moments {
    std::string file;
    bank_space space;
    Eigen::MatrixXd xx;     // mean products of the columns
    Eigen::MatrixXd xt;     // of the columns and each output
    Eigen::VectorXd tt;     // mean square of each output
    Eigen::VectorXd noise;  // mean square that the bank leaves of rows left out
    Eigen::VectorXd rows;   // of each output: as many independent rows would say the same
};

struct train_result;
// in : a bank with predictions of rows left out
bank_moments moments_of(const train_result &result);

// in : off: residuals; run: of each. out: how many rows in a row say the same: 1 for independent
//      ones, the sum of the correlations up to the first that is not positive, on both sides
double rows_alike(const Eigen::VectorXd &off, const std::vector<std::size_t> &run);

// The file of --moments. Reading throws input_error with the place.
json json_of(const bank_moments &moments);
bank_moments read_moments(const std::string &path);

// out: numbers by rows; throws input_error unless they are rows by columns and finite
Eigen::MatrixXd matrix_of(const json &file, const char *key, Eigen::Index rows,
                          Eigen::Index columns, const std::string &path);
json lists_of(const Eigen::MatrixXd &values);

}  // namespace compbox::training
