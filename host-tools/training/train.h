// SPDX-License-Identifier: MIT
// compbox train: a network, or the linear map that beats it, from rows of inputs and errors.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"
#include "host-tools/training/dataset.h"
#include "host-tools/training/lagged.h"
#include "host-tools/training/network.h"
#include "host-tools/training/optimise.h"

namespace compbox {

enum class regularisation { automatic, folds, evidence };

struct margin_option {
    std::vector<std::string> of;  // names of inputs; * stands for anything
    double part = 0.1;
};

struct train_options {
    std::string name = "net";
    lag_options lags;
    lag_starts starts_of_lags = lag_starts::each_run;
    std::vector<slope_option> slopes;
    std::vector<std::string> hidden_inputs;  // what the hidden layer sees (* allowed); empty: all
    std::vector<std::string> hold_out;       // names of runs: never trained on, only judged by
    int hidden = 10;                         // 0: the linear map alone
    activation kind = activation::tansig;
    bool linear_path = true;
    bool keep_network = false;  // written even where the linear map is better
    regularisation regularise = regularisation::automatic;  // folds where there are three runs
    optimiser way = optimiser::lbfgs;                       // Levenberg-Marquardt: by evidence only
    int starts = 5;
    std::uint64_t seed = 1;
    int threads = 0;
    int max_iterations = 300;
    int max_rows = 2000;                 // for the network: neighbouring rows are nearly equal
    double margin = 0.1;                 // parts of the trained range: extrapolated no further
    std::vector<margin_option> margins;  // of some inputs another one; the last that fits counts
    std::function<void(double, double)> progress;  // 0 … 1, loss
};

// A value is centre + scale * scaled value. Rounded to float32, as the box has them.
struct scaling {
    Eigen::VectorXd centre, scale;
};

struct trained_model {
    network_shape shape;         // hidden 0: linear
    Eigen::VectorXd parameters;  // rounded to float32
    scaling in, out;
    // x: one sample in each row. out: one prediction in each row
    Eigen::MatrixXd predict(const Eigen::MatrixXd &x) const;
};

// What is left of the errors over some rows, for each output, in its unit.
struct residuals {
    std::size_t rows = 0;
    Eigen::VectorXd rms, worst;
};

// The guard of the box (models/training_range.h): inputs are held at the margin, and beyond it the
// outputs fade to zero over half of the trained range.
struct trained_range {
    Eigen::VectorXd low, high, margin;  // of each input
    Eigen::MatrixXd held(const Eigen::MatrixXd &x) const;
    Eigen::VectorXd weight(const Eigen::MatrixXd &x) const;  // of each row: 1 … 0
};

struct judged_model {
    trained_model model;
    residuals trained;   // on the rows trained on
    residuals left_out;  // each run by a model that never saw it; rows 0: not known
    residuals held_out;  // on the runs of --hold-out; rows 0: there are none
    Eigen::MatrixXd left_out_predictions;  // of train_result::learn.x; empty: not known
    double log_evidence = 0.0;
};

struct train_result {
    train_options options;
    training_data data;
    std::vector<model_input> inputs;
    model_rows learn, test;   // test: the runs held out
    Eigen::Index unseen = 0;  // inputs at the end that the hidden layer does not see
    Eigen::VectorXd largest;  // largest |error| of each output in the file
    trained_range range;      // of each input in the rows trained on
    bool by_folds = false;
    judged_model linear, network;  // network: nothing where options.hidden is 0
    Eigen::VectorXd linear_decay;
    double network_decay = 0.0;
    int network_iterations = 0, best_start = 0;
    std::vector<Eigen::Index> network_rows;  // of learn: those that the network was trained on
    double network_loss = 0.0;
    std::vector<bool> network_better;  // for each output
    trained_model chosen;
    judged_model chosen_figures;
    std::string verdict;
    std::vector<std::string> warnings;

    std::size_t plain_inputs() const;  // inputs that are no slopes; slopes stand behind them
    bool any_network() const;
};

// Throws input_error for what the user can mend.
train_result train(const training_data &data, const train_options &options);

// The fragment for `build`: lags, the term, and under provenance.NAME how it was trained.
json fragment_of(const train_result &result);
// Tables for a person.
std::string report_of(const train_result &result);
// CSV, rows as in the file: time_s, name of the run, and for each output the measured value and the
// prediction. Rows of the first kind of lag start only.
std::string predictions_csv(const train_result &result);
// Measured, predicted and left-out curves over the rows, one panel for each output. Throws
// input_error.
void plot_training(const train_result &result, const std::string &path);

}  // namespace compbox
