// SPDX-License-Identifier: MIT
// compbox select-inputs: selects the few sensors that a model needs (Xiao and others: key
// temperatures by fuzzy clustering and grey relational grade).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"
#include "host-tools/regression/clusters.h"
#include "host-tools/training/dataset.h"
#include "host-tools/training/train.h"

namespace compbox::training {

enum class cluster_method { c_means, closure };

struct select_options {
    cluster_method method = cluster_method::c_means;
    std::size_t count = 0;          // number of clusters and of chosen inputs; 0: by the validity
                                    // index
    bool check = false;             // compare with all candidates on left-out runs
    bool by_runs = false;           // choose by removing candidates, judged on left-out runs
    std::vector<std::string> keep;  // fixed inputs, such as the spindle speed
    train_options model;            // lags and their start, for check and by_runs
    std::function<void(double)> progress;
};

// Residuals of a linear map of some inputs on runs that it was not trained on.
struct checked_choice {
    std::vector<std::string> inputs;
    residuals left_out;
    double merit = 0.0;  // mean over the outputs of rms / largest error
};

struct selection {
    select_options options;
    training_data data;  // inputs: candidates, then those of `keep`
    std::size_t candidates = 0;
    regression::clustering clusters;
    Eigen::MatrixXd grades;              // candidates by outputs: grey relational grade, 0 … 1
    std::vector<double> grade;           // mean over the outputs
    std::vector<std::size_t> chosen;     // candidates, in their order
    std::vector<checked_choice> checks;  // of check: all, then the choice; of by_runs: each step
};

// Grey relational grade (Deng, distinguishing coefficient 0.5) of each column of x to y, both
// scaled to 0 … 1; a column that falls while y rises is inverted first.
Eigen::VectorXd grey_grades(const Eigen::MatrixXd &x, const Eigen::VectorXd &y);

// Throws input_error. data: inputs are the candidates, then options.keep.
selection select_inputs(const training_data &data, const select_options &options);

json selection_json(const selection &result);
std::string report_of(const selection &result);
// in : a file of selection_json(). out: the model's inputs. Throws input_error.
std::vector<std::string> inputs_of_choice(const std::string &path);
// Plots the grades as bars, cluster by cluster, the chosen ones first. Throws input_error.
void plot_selection(const selection &result, const std::string &path);

}  // namespace compbox::training
