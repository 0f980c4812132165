// SPDX-License-Identifier: MIT
// Rows from a known function, for tests of the training.
#pragma once

#include <random>
#include <string>

#include "host-tools/training/train.h"

namespace compbox {

// Two inputs a and b, uniform in -1 … 1, one output z = function + noise; runs "1", "2" … of equal
// length; a row every 10 s.
template <typename Function>
training::training_data made_of(int rows, int runs, const Function &function, double noise = 0.0) {
    std::mt19937 engine(42);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::normal_distribution<double> normal;
    training::training_data data;
    data.file = "made.csv";
    data.inputs = {"a", "b"};
    data.outputs = {"z"};
    data.x.resize(rows, 2);
    data.y.resize(rows, 1);
    for (int r = 0; r < rows; ++r) {
        data.x.row(r) << uniform(engine), uniform(engine);
        const Eigen::RowVectorXd x = data.x.row(r);
        data.y(r, 0) = function(x) + noise * normal(engine);
        data.time_s.push_back(10.0 * r);
        const int run = r * runs / rows;
        if (r == 0 || static_cast<std::size_t>(run) != data.run.back()) {
            data.run_names.push_back(std::to_string(run + 1));
            data.run_starts.push_back(static_cast<std::size_t>(r));
        }
        data.run.push_back(static_cast<std::size_t>(run));
    }
    return data;
}

// Small enough to be quick, large enough to bend.
inline training::train_options small_options() {
    training::train_options options;
    options.hidden = 4;
    options.starts = 3;
    options.threads = 1;
    options.max_iterations = 150;
    return options;
}

}  // namespace compbox
