// SPDX-License-Identifier: MIT
#include "host-tools/regression/averaging.h"

#include <cmath>

#include "host-tools/algebra/solvers.h"
#include "host-tools/regression/parallel.h"

namespace compbox::regression {

namespace {

using members_of = std::vector<std::vector<Eigen::Index>>;

constexpr int tried_decays = 15;

// 1e-6 … 10 in half decades, for scaled inputs.
double tried_decay(int index) {
    return std::pow(10.0, -6.0 + 0.5 * index);
}

// Calls with the first row and the number of rows of each run.
template <typename Function>
void for_each_run(Eigen::Index rows, const std::vector<Eigen::Index> &starts,
                  const Function &function) {
    for (std::size_t k = 0; k < starts.size(); ++k) {
        const Eigen::Index end = k + 1 < starts.size() ? starts[k + 1] : rows;
        function(starts[k], end - starts[k]);
    }
}

Eigen::MatrixXd from_means(Eigen::MatrixXd values, const std::vector<Eigen::Index> &starts) {
    for_each_run(values.rows(), starts, [&](Eigen::Index first, Eigen::Index count) {
        const Eigen::RowVectorXd mean = values.middleRows(first, count).colwise().mean();
        values.middleRows(first, count).rowwise() -= mean;
    });
    return values;
}

// Sums over some rows, from which the normal equations of any part of the columns follow.
struct sums {
    Eigen::MatrixXd xx, xt;
    Eigen::VectorXd x, t;
    double rows = 0.0;

    sums(const Eigen::MatrixXd &some_x, const Eigen::MatrixXd &some_t)
        : xx(some_x.transpose() * some_x),
          xt(some_x.transpose() * some_t),
          x(some_x.colwise().sum()),
          t(some_t.colwise().sum()),
          rows(static_cast<double>(some_x.rows())) {}

    void add(const sums &other, double sign) {
        xx += sign * other.xx, xt += sign * other.xt;
        x += sign * other.x, t += sign * other.t, rows += sign * other.rows;
    }
};

// The maps of one member for each decay of the grid.
class path {
  public:
    path(const sums &all, const std::vector<Eigen::Index> &columns)
        : x_mean_(all.x(columns) / all.rows), t_mean_(all.t / all.rows) {
        const Eigen::MatrixXd xx = all.xx(columns, columns) / all.rows;
        const auto eigen = algebra::eigen_of_symmetric(xx - x_mean_ * x_mean_.transpose());
        values_ = eigen.values.cwiseMax(0.0), vectors_ = eigen.vectors;
        const Eigen::MatrixXd xt = all.xt(columns, Eigen::all) / all.rows;
        projected_ = vectors_.transpose() * (xt - x_mean_ * t_mean_.transpose());
    }

    linear_map at(const Eigen::VectorXd &decay) const {
        linear_map map;
        map.weights.resize(vectors_.rows(), projected_.cols());
        for (Eigen::Index k = 0; k < projected_.cols(); ++k) {
            map.weights.col(k) =
                vectors_ * (projected_.col(k).array() / (values_.array() + decay[k])).matrix();
        }
        map.offset = t_mean_ - map.weights.transpose() * x_mean_;
        return map;
    }

  private:
    Eigen::VectorXd x_mean_, t_mean_, values_;
    Eigen::MatrixXd vectors_, projected_;
};

// One member: its decays, its residuals on the folds left out, and its map of all rows.
struct member {
    linear_map map;
    Eigen::VectorXd decay, worst_square;  // of each output
    Eigen::MatrixXd left_out;
};

class averaging {
  public:
    averaging(const Eigen::MatrixXd &x, const Eigen::MatrixXd &t, const row_folds &folds,
              const std::vector<Eigen::Index> &starts)
        : x_(x), t_(starts.empty() ? t : from_starts(t, starts)), starts_(starts), all_(x, t) {
        const Eigen::MatrixXd own_x = starts.empty() ? x : from_means(x, starts);
        const Eigen::MatrixXd own_t = starts.empty() ? t : from_means(t, starts);
        all_ = sums(own_x, own_t);
        for (std::size_t f = 0; f < folds.count; ++f) {
            rows_.push_back(rows_inside(folds, f));
            sums others = all_;
            others.add(sums(own_x(rows_[f], Eigen::all), own_t(rows_[f], Eigen::all)), -1.0);
            others_.push_back(others);
        }
    }

    // out: the member that uses these columns, with this decay or, for 0, its best
    member train(const std::vector<Eigen::Index> &columns, double decay) const {
        std::vector<path> paths;
        for (const sums &others : others_) paths.emplace_back(others, columns);
        const Eigen::MatrixXd x = x_(Eigen::all, columns);
        member one;
        if (decay > 0.0) {
            one.decay = Eigen::VectorXd::Constant(t_.cols(), decay);
            one.worst_square = Eigen::VectorXd::Ones(t_.cols());
        } else {
            choose_decay(one, x, paths);
        }
        one.left_out = left_out(x, paths, one.decay);
        one.map = path(all_, columns).at(one.decay);
        if (!starts_.empty()) one.map.offset = offset_of_runs(x, one.map.weights);
        return one;
    }

  private:
    // out: predictions of each row by the map of the others; from each run's start if runs have
    //      offsets
    Eigen::MatrixXd left_out(const Eigen::MatrixXd &x, const std::vector<path> &paths,
                             const Eigen::VectorXd &decay) const {
        Eigen::MatrixXd all(t_.rows(), t_.cols());
        for (std::size_t f = 0; f < paths.size(); ++f) {
            const Eigen::MatrixXd own = x(rows_[f], Eigen::all);
            all(rows_[f], Eigen::all) = paths[f].at(decay).predict(own);
        }
        return starts_.empty() ? all : from_starts(all, starts_);
    }

    // out: decay and worst_square: of the strongest decay within a fiftieth of the least
    void choose_decay(member &one, const Eigen::MatrixXd &x, const std::vector<path> &paths) const {
        Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(tried_decays, t_.cols());
        for (int g = 0; g < tried_decays; ++g) {
            const Eigen::MatrixXd off =
                left_out(x, paths, Eigen::VectorXd::Constant(t_.cols(), tried_decay(g))) - t_;
            for (const auto &rows : rows_) {
                const Eigen::MatrixXd own = off(rows, Eigen::all);
                squares.row(g) += own.cwiseAbs2().colwise().maxCoeff();
            }
        }
        one.decay.resize(t_.cols()), one.worst_square.resize(t_.cols());
        for (Eigen::Index k = 0; k < t_.cols(); ++k) {
            Eigen::Index strongest = tried_decays - 1;
            while (squares(strongest, k) > 1.02 * squares.col(k).minCoeff()) --strongest;
            one.decay[k] = tried_decay(static_cast<int>(strongest));
            one.worst_square[k] = squares(strongest, k) / static_cast<double>(rows_.size());
        }
    }

    // out: the mean over the runs of what each run's mean needs
    Eigen::VectorXd offset_of_runs(const Eigen::MatrixXd &x, const Eigen::MatrixXd &weights) const {
        Eigen::VectorXd sum = Eigen::VectorXd::Zero(t_.cols());
        for_each_run(t_.rows(), starts_, [&](Eigen::Index first, Eigen::Index count) {
            const Eigen::RowVectorXd mean = x.middleRows(first, count).colwise().mean();
            sum += t_.middleRows(first, count).colwise().mean().transpose() -
                   weights.transpose() * mean.transpose();
        });
        return sum / static_cast<double>(starts_.size());
    }

    const Eigen::MatrixXd &x_;
    Eigen::MatrixXd t_;
    std::vector<Eigen::Index> starts_;
    sums all_;
    std::vector<std::vector<Eigen::Index>> rows_;  // of each fold
    std::vector<sums> others_;                     // over the rows outside of each fold
};

}  // namespace

Eigen::MatrixXd from_starts(const Eigen::MatrixXd &values,
                            const std::vector<Eigen::Index> &starts) {
    Eigen::MatrixXd moved = values;
    for_each_run(values.rows(), starts, [&](Eigen::Index first, Eigen::Index count) {
        moved.middleRows(first, count).rowwise() -= values.row(first);
    });
    return moved;
}

averaged_map average_maps(const Eigen::MatrixXd &x, const Eigen::MatrixXd &t,
                          const row_folds &folds, const members_of &members,
                          const std::vector<Eigen::Index> &starts, int threads, double decay) {
    const averaging trainer(x, t, folds, starts);
    std::vector<member> trained(members.size());
    run_parallel(members.size(), threads,
                 [&](std::size_t m) { trained[m] = trainer.train(members[m], decay); });
    averaged_map mean;
    const auto count = static_cast<Eigen::Index>(members.size());
    mean.decay.resize(count, t.cols()), mean.share.resize(count, t.cols());
    for (Eigen::Index m = 0; m < count; ++m) {
        const member &one = trained[static_cast<std::size_t>(m)];
        mean.decay.row(m) = one.decay;
        mean.share.row(m) = one.worst_square.cwiseMax(1e-30).cwiseAbs2().cwiseInverse();
    }
    mean.share.array().rowwise() /= mean.share.colwise().sum().array().eval();
    mean.map.weights = Eigen::MatrixXd::Zero(x.cols(), t.cols());
    mean.map.offset = Eigen::VectorXd::Zero(t.cols());
    mean.left_out = Eigen::MatrixXd::Zero(t.rows(), t.cols());
    for (Eigen::Index m = 0; m < count; ++m) {
        const member &one = trained[static_cast<std::size_t>(m)];
        const auto share = mean.share.row(m).asDiagonal();
        mean.map.weights(members[static_cast<std::size_t>(m)], Eigen::all) +=
            one.map.weights * share;
        mean.map.offset += one.map.offset.cwiseProduct(mean.share.row(m).transpose());
        mean.left_out += one.left_out * share;
    }
    return mean;
}

}  // namespace compbox::regression
