// SPDX-License-Identifier: MIT
#include "host-tools/regression/network_training.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <vector>

#include "host-tools/regression/optimise.h"
#include "host-tools/regression/parallel.h"
#include "host-tools/regression/training_start.h"

namespace compbox::regression {

namespace {

constexpr double decay_grid[] = {3e-1, 3e-2, 3e-3, 3e-4};
constexpr std::size_t decays = sizeof decay_grid / sizeof decay_grid[0];

// One left-out fold with one decay: after each iteration the square of the worst residual on the
// fold, averaged over the outputs.
struct fold_trace {
    std::vector<double> worst_square;
    double after(std::size_t iteration) const {
        return worst_square[std::min(iteration, worst_square.size() - 1)];
    }
};

struct fold_rows {
    Eigen::MatrixXd x, t, left_x, left_t;  // samples in columns, as required by the loss
    linear_map start;
};

fold_rows rows_of_fold(const network_task &task, const Eigen::VectorXd &linear_decay,
                       std::size_t fold) {
    const auto in = rows_inside(task.folds, fold), out = rows_outside(task.folds, fold);
    fold_rows rows;
    const Eigen::MatrixXd x = task.x(out, Eigen::all), t = task.t(out, Eigen::all);
    rows.start = ridge_solver(x, t).solve(linear_decay);
    rows.x = x.transpose(), rows.t = t.transpose();
    rows.left_x = task.x(in, Eigen::all).transpose();
    rows.left_t = task.t(in, Eigen::all).transpose();
    return rows;
}

weight_decay decay_of(double hidden, const Eigen::VectorXd &linear) {
    return {hidden, hidden, linear};
}

double worst_square(const network_shape &shape, const Eigen::VectorXd &point,
                    const fold_rows &rows) {
    const Eigen::MatrixXd off = predict(shape, point, rows.left_x) - rows.left_t;
    return off.cwiseAbs2().rowwise().maxCoeff().mean();
}

// Trains without the fold. out: the trace; `point` after `iterations`
fold_trace train_without(const network_task &task, const fold_rows &rows, const weight_decay &decay,
                         std::uint64_t seed, int iterations, Eigen::VectorXd &point) {
    network_loss loss(task.shape, rows.x, rows.t, decay);
    point = start_from(task.shape, rows.start, seed);
    fold_trace trace;
    optimise_options options;
    options.max_iterations = iterations;
    options.least_decrease = task.least_decrease;
    options.after = [&](int, double, const Eigen::VectorXd &now) {
        trace.worst_square.push_back(worst_square(task.shape, now, rows));
        const auto best = std::min_element(trace.worst_square.begin(), trace.worst_square.end());
        return trace.worst_square.end() - best < 40;  // long past its best value
    };
    minimise([&](const double *p, double *g) { return loss(p, g); }, point, options);
    trace.worst_square.push_back(worst_square(task.shape, point, rows));
    return trace;
}

// Best decay and length of training by the traces.
struct best_length {
    std::size_t decay = 0;
    int iterations = 0;
};

// Best by all folds but `without`; without = folds: by all.
best_length choose(const std::vector<fold_trace> &traces, std::size_t folds, std::size_t without) {
    best_length best;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t d = 0; d < decays; ++d) {
        std::size_t longest = 0;
        for (std::size_t f = 0; f < folds; ++f) {
            if (f == without) continue;
            longest = std::max(longest, traces[d * folds + f].worst_square.size());
        }
        for (std::size_t i = 0; i < longest; ++i) {
            double sum = 0.0;
            for (std::size_t f = 0; f < folds; ++f) {
                if (f != without) sum += traces[d * folds + f].after(i);
            }
            if (sum < least) least = sum, best = {d, static_cast<int>(i)};
        }
    }
    return best;
}

// Counts and reports finished parts, one call at a time.
class meter {
  public:
    meter(const network_task &task, std::size_t parts) : task_(task), parts_(parts) {}
    void done(double loss) {
        const std::lock_guard<std::mutex> lock(mutex_);
        ++done_;
        if (task_.progress) {
            task_.progress(static_cast<double>(done_) / static_cast<double>(parts_), loss);
        }
    }

  private:
    const network_task &task_;
    std::size_t parts_, done_ = 0;
    std::mutex mutex_;
};

// All rows from each start; out: the start with the least final loss
trained_network train_starts(const network_task &task, const weight_decay &decay, int iterations,
                             const linear_map &linear, meter &progress) {
    const Eigen::MatrixXd x = task.x.transpose(), t = task.t.transpose();
    std::vector<trained_network> all(static_cast<std::size_t>(task.starts));
    run_parallel(all.size(), task.threads, [&](std::size_t s) {
        network_loss loss(task.shape, x, t, decay);
        all[s].parameters = start_from(task.shape, linear, task.seed + s);
        optimise_options options;
        options.max_iterations = iterations;
        options.least_decrease = task.least_decrease;
        const optimise_result found = minimise(
            [&](const double *p, double *g) { return loss(p, g); }, all[s].parameters, options);
        all[s].loss = found.value;
        all[s].iterations = found.iterations;
        all[s].best_start = static_cast<int>(s);
        progress.done(found.value);
    });
    return *std::min_element(all.begin(), all.end(),
                             [](const auto &a, const auto &b) { return a.loss < b.loss; });
}

}  // namespace

trained_network train_by_folds(const network_task &task, const Eigen::VectorXd &linear_decay) {
    const std::size_t folds = task.folds.count;
    std::vector<fold_rows> rows(folds);
    run_parallel(folds, task.threads,
                 [&](std::size_t f) { rows[f] = rows_of_fold(task, linear_decay, f); });
    std::vector<fold_trace> traces(decays * folds);
    meter progress(task, traces.size() + folds + static_cast<std::size_t>(task.starts));
    run_parallel(traces.size(), task.threads, [&](std::size_t i) {
        Eigen::VectorXd point;
        traces[i] =
            train_without(task, rows[i % folds], decay_of(decay_grid[i / folds], linear_decay),
                          task.seed, task.max_iterations, point);
        progress.done(
            *std::min_element(traces[i].worst_square.begin(), traces[i].worst_square.end()));
    });
    const best_length length = choose(traces, folds, folds);
    const weight_decay decay = decay_of(decay_grid[length.decay], linear_decay);
    Eigen::MatrixXd left_out(task.t.rows(), task.t.cols());
    run_parallel(folds, task.threads, [&](std::size_t f) {
        // A run must not judge the length that it chose, so the others choose for it.
        const best_length others = choose(traces, folds, f);
        Eigen::VectorXd point;
        train_without(task, rows[f], decay_of(decay_grid[others.decay], linear_decay), task.seed,
                      others.iterations, point);
        const Eigen::MatrixXd y = predict(task.shape, point, rows[f].left_x);
        const auto in = rows_inside(task.folds, f);
        for (std::size_t i = 0; i < in.size(); ++i) {
            left_out.row(in[i]) = y.col(static_cast<Eigen::Index>(i)).transpose();
        }
        progress.done(
            traces[others.decay * folds + f].after(static_cast<std::size_t>(others.iterations)));
    });
    trained_network best = train_starts(task, decay, length.iterations,
                                        ridge_solver(task.x, task.t).solve(linear_decay), progress);
    best.decay = decay.hidden;
    best.left_out = std::move(left_out);
    return best;
}

}  // namespace compbox::regression
