// SPDX-License-Identifier: MIT
// compbox train: a network, or a better linear map, from rows of inputs and errors.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"
#include "host-tools/regression/network.h"
#include "host-tools/regression/optimise.h"
#include "host-tools/training/dataset.h"
#include "host-tools/training/lagged.h"
#include "host-tools/training/prior.h"

namespace compbox::training {

enum class regularisation { automatic, folds, evidence };

struct margin_option {
    std::vector<std::string> of;  // names of inputs; * matches any text
    double part = 0.1;
};

struct train_options {
    std::string name = "net";
    lag_options lags;
    bool bank = false;           // the mean of maps over a bank of lags, instead of `lags`
    bool beside_bank = false;    // the network that a bank is compared with
    bool zero_at_start = false;  // with a bank: errors count from each run's first row
    std::shared_ptr<const bank_priors> priors;  // with a bank: what brothers know; or none
    bool moments = false;                       // with a bank: compute what a prior needs
    lag_starts starts_of_lags = lag_starts::automatic;
    std::vector<slope_option> slopes;
    std::vector<std::string> hidden_inputs;  // inputs of the hidden layer (* allowed); empty: all
    std::vector<std::string> hold_out;       // names of runs for the final judgement only, never
                                             // for training
    int hidden = 10;                         // 0: the linear map alone
    regression::activation kind = regression::activation::tansig;
    bool linear_path = true;
    bool keep_network = false;    // use it even if the linear map is better
    bool accept_worse = false;    // write a model that is worse than no compensation, too
    bool for_comparison = false;  // of any size, because no box gets it, and never refused
    regularisation regularise = regularisation::automatic;  // folds if there are three runs or more
    regression::optimiser way = regression::optimiser::lbfgs;  // Levenberg-Marquardt: with evidence
                                                               // only
    int starts = 5;
    std::uint64_t seed = 1;
    int threads = 0;
    int max_iterations = 300;
    int max_rows = 2000;                 // for the network, because neighbouring rows are nearly
                                         // equal
    double margin = 0.1;                 // fraction of the trained range: limit of extrapolation
    std::vector<margin_option> margins;  // exceptions for some inputs; the last match applies
    std::function<void(double, double)> progress;  // 0 … 1, loss
};

// value = centre + scale * scaled value. Rounded to float32, as in the box.
struct scaling {
    Eigen::VectorXd centre, scale;
};

struct trained_model {
    regression::network_shape shape;  // hidden 0: linear
    Eigen::VectorXd parameters;       // rounded to float32
    scaling in, out;
    // in: x, one sample per row. out: one prediction per row
    Eigen::MatrixXd predict(const Eigen::MatrixXd &x) const;
};

// Residual errors over some rows, for each output, in its unit.
struct residuals {
    std::size_t rows = 0;
    Eigen::VectorXd rms, worst;
};

// The box's guard (models/training_range.h): inputs are held at the margin, and beyond it the
// outputs fade to zero over half of the trained range.
struct trained_range {
    Eigen::VectorXd low, high, margin;  // of each input
    Eigen::MatrixXd held(const Eigen::MatrixXd &x) const;
    Eigen::VectorXd weight(const Eigen::MatrixXd &x) const;  // of each row: 1 … 0
};

// How one output's bank was drawn to those of its brothers (shrinkage.h).
using prior_shares = std::array<double, 3>;  // of the own map, the brothers' mean, the shrunk map

struct judged_model {
    trained_model model;
    residuals trained;   // on the training rows
    residuals left_out;  // each run by a model trained without it; rows 0: unknown
    residuals held_out;  // on the runs of --hold-out; rows 0: none
    Eigen::MatrixXd left_out_predictions;  // of train_result::learn.x; empty: unknown
    double log_evidence = 0.0;
};

struct train_result {
    train_options options;
    training_data data;
    std::vector<model_input> inputs;
    model_rows learn, test;             // test: the held-out runs
    Eigen::MatrixXd test_held;          // of a bank: test.x with its columns held at their margins
    std::vector<double> tau_s;          // of a bank: its time constants
    const bank_prior *prior = nullptr;  // that of options.priors whose lags the bank has, or none
    std::optional<bank_moments> moments;  // of a bank, with options.moments
    std::vector<prior_shares> drawn;      // of each output, with a prior
    Eigen::Index unseen = 0;              // inputs at the end that the hidden layer does not use
    Eigen::VectorXd largest;              // largest |error| of each output in the file
    trained_range range;                  // of each input in the training rows
    bool by_folds = false;
    judged_model linear, network;  // network: empty if options.hidden is 0
    Eigen::VectorXd linear_decay;
    double network_decay = 0.0;
    int network_iterations = 0, best_start = 0;
    std::size_t network_inputs = 0;          // with their lags
    std::vector<Eigen::Index> network_rows;  // rows of learn used for the network
    double network_loss = 0.0;
    std::vector<bool> network_better;  // for each output
    trained_model chosen;
    judged_model chosen_figures;
    std::string verdict;
    std::vector<std::string> warnings;

    // in : x: the inputs of `of`. out: the predictions of one of the models; from each run's first
    //      row with zero_at_start
    Eigen::MatrixXd predict(const trained_model &model, const Eigen::MatrixXd &x,
                            const model_rows &of) const;
    std::size_t plain_inputs() const;  // number of inputs that are no slopes; slopes follow them
    bool any_network() const;
};

// With options.bank the result is the bank, or a network over a few lags of the same inputs where
// that is better for an output and worse for none (best_of in bank_training.h). Throws input_error
// for a mistake of the user.
train_result train(const training_data &data, const train_options &options);

// The fragment for `build`: lags, the term, and the figures of the training under provenance.NAME.
json fragment_of(const train_result &result);
// Tables for a person.
std::string report_of(const train_result &result);
// CSV, rows as in the file: time_s, name of the run, and for each output the measured value and the
// prediction. Only with the first kind of lag start.
std::string predictions_csv(const train_result &result);
// Measured, predicted and left-out curves over the rows, one panel for each output. Throws
// input_error.
void plot_training(const train_result &result, const std::string &path);

}  // namespace compbox::training
