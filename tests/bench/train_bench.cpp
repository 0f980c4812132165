// SPDX-License-Identifier: MIT
// Time of training 19-20-3 on the rows of a file to a given loss, by the code that `compbox train`
// runs.   train_bench ROWS.f64 LOSS SEED START.f64
// ROWS: float64, row after row: 19 inputs, 3 outputs. Writes the start it used to START, so that
// others can start there, and prints {"seconds": s, "iterations": n, "evaluations": n, "loss":
// l}.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "host-tools/training/network.h"
#include "host-tools/training/optimise.h"

namespace {

constexpr Eigen::Index inputs = 19, hidden = 20, outputs = 3;

Eigen::MatrixXd read_rows(const char *path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const auto bytes = static_cast<std::size_t>(file.tellg());
    Eigen::MatrixXd rows(inputs + outputs,
                         static_cast<Eigen::Index>(bytes / sizeof(double)) / (inputs + outputs));
    file.seekg(0);
    file.read(reinterpret_cast<char *>(rows.data()), static_cast<std::streamsize>(bytes));
    if (!file) std::exit(1);
    return rows;
}

}  // namespace

int main(int argc, char **argv) {
    if (argc != 5) return 2;
    const Eigen::MatrixXd rows = read_rows(argv[1]);
    const Eigen::MatrixXd x = rows.topRows(inputs), t = rows.bottomRows(outputs);
    const double wanted = std::atof(argv[2]);
    const compbox::network_shape shape{inputs, hidden, outputs, false, compbox::activation::tansig};
    const Eigen::VectorXd start = compbox::random_start(shape, std::strtoull(argv[3], nullptr, 10));
    std::ofstream(argv[4], std::ios::binary)
        .write(reinterpret_cast<const char *>(start.data()),
               static_cast<std::streamsize>(sizeof(double)) * start.size());
    int evaluations = 0;
    compbox::network_loss loss(shape, x, t, {});
    Eigen::VectorXd point = start;
    compbox::lbfgs_options options;
    options.max_iterations = 20000;
    options.least_decrease = 0.0;
    options.after = [&](int, double value, const Eigen::VectorXd &) { return value > wanted; };
    const auto began = std::chrono::steady_clock::now();
    const compbox::lbfgs_result result = compbox::minimise(
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
