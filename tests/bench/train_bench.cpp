// SPDX-License-Identifier: MIT
// Time of training a network on the rows of a file to a given loss, by the code that `compbox
// train` runs.   train_bench ROWS.f64 LOSS SEED START.f64 lbfgs|lm INPUTS HIDDEN OUTPUTS ROWS:
// float64, row after row: inputs, then outputs. Writes the start it used to START, so that others
// can start there, and prints {"seconds": s, "iterations": n, "evaluations": n, "loss": l}.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "host-tools/regression/network.h"
#include "host-tools/regression/optimise.h"

namespace {

Eigen::MatrixXd read_rows(const char *path, Eigen::Index columns) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const auto bytes = static_cast<std::size_t>(file.tellg());
    Eigen::MatrixXd rows(columns, static_cast<Eigen::Index>(bytes / sizeof(double)) / columns);
    file.seekg(0);
    file.read(reinterpret_cast<char *>(rows.data()), static_cast<std::streamsize>(bytes));
    if (!file) std::exit(1);
    return rows;
}

}  // namespace

int main(int argc, char **argv) {
    if (argc != 9) return 2;
    const Eigen::Index inputs = std::atoi(argv[6]), outputs = std::atoi(argv[8]);
    const compbox::regression::network_shape shape{inputs, std::atoi(argv[7]), outputs, false,
                                                   compbox::regression::activation::tansig};
    const Eigen::MatrixXd rows = read_rows(argv[1], inputs + outputs);
    const Eigen::MatrixXd x = rows.topRows(inputs), t = rows.bottomRows(outputs);
    const double wanted = std::atof(argv[2]);
    const Eigen::VectorXd start =
        compbox::regression::random_start(shape, std::strtoull(argv[3], nullptr, 10));
    std::ofstream(argv[4], std::ios::binary)
        .write(reinterpret_cast<const char *>(start.data()),
               static_cast<std::streamsize>(sizeof(double)) * start.size());
    const bool squares = std::string(argv[5]) == "lm";
    int evaluations = 0;
    compbox::regression::network_loss loss(shape, x, t, {0.0, 0.0, {}});
    Eigen::VectorXd point = start;
    compbox::regression::optimise_options options;
    options.max_iterations = squares ? 100 : 20000;
    options.least_decrease = 0.0;
    options.after = [&](int, double value, const Eigen::VectorXd &) { return value > wanted; };
    const auto began = std::chrono::steady_clock::now();
    const compbox::regression::optimise_result result =
        squares ? compbox::regression::minimise_squares(
                      [&](const double *p, double *r, double *j) {
                          ++evaluations;
                          loss.residuals(p, r, j);
                      },
                      loss.residual_count(), point, options)
                : compbox::regression::minimise(
                      [&](const double *p, double *g) {
                          ++evaluations;
                          return loss(p, g);
                      },
                      point, options);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    std::printf("{\"seconds\": %.6f, \"iterations\": %d, \"evaluations\": %d, \"loss\": %.9g}\n",
                took.count(), result.iterations, evaluations, result.value);
    return 0;
}
