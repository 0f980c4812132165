// SPDX-License-Identifier: MIT
// Weight decay by evidence (MacKay 1992, with the Gauss-Newton Hessian of Foresee and Hagan 1997).
#include <algorithm>
#include <cmath>
#include <mutex>
#include <vector>

#include "host-tools/algebra/solvers.h"
#include "host-tools/regression/network_training.h"
#include "host-tools/regression/optimise.h"
#include "host-tools/regression/parallel.h"
#include "host-tools/regression/training_start.h"

namespace compbox::regression {

Eigen::VectorXd start_from(const network_shape &shape, const linear_map &linear,
                           std::uint64_t seed) {
    Eigen::VectorXd p = random_start(shape, seed);
    if (!shape.linear) return p;
    network_parts<double> net(shape, p.data());
    net.linear = linear.weights.transpose();
    net.bias2 = linear.offset;
    return p;
}

namespace {

constexpr int most_rounds = 8;
constexpr double two_pi = 6.283185307179586;
constexpr Eigen::Index samples_at_a_time = 128;

// J^T J of all samples.
Eigen::MatrixXd curvature_of(const network_loss &loss, const Eigen::VectorXd &p) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(p.size(), p.size());
    for (Eigen::Index from = 0; from < loss.samples(); from += samples_at_a_time) {
        const auto n = std::min(samples_at_a_time, loss.samples() - from);
        sum.selfadjointView<Eigen::Lower>().rankUpdate(loss.jacobian(p, from, n).transpose());
    }
    return sum.selfadjointView<Eigen::Lower>();
}

// A range of the parameters that shares one decay.
struct weight_group {
    Eigen::Index from, count;
    double alpha;
};

std::vector<weight_group> groups_of(const network_shape &shape) {
    std::vector<weight_group> groups = {{0, shape.hidden * shape.seen(), 1.0},
                                        {shape.weight2_at(), shape.outputs * shape.hidden, 1.0}};
    if (shape.linear) groups.push_back({shape.linear_at(), shape.outputs * shape.inputs, 1.0});
    return groups;
}

// One start: training and estimates of decay alternate.
class evidence_training {
  public:
    evidence_training(const network_task &task, const Eigen::MatrixXd &x, const Eigen::MatrixXd &t,
                      double linear_decay)
        : task_(task),
          loss_(task.shape, x, t, {1e-3, 1e-3, Eigen::VectorXd::Constant(t.rows(), linear_decay)}),
          groups_(groups_of(task.shape)),
          values_(static_cast<double>(t.size())),
          samples_(static_cast<double>(t.cols())) {}

    trained_network run(Eigen::VectorXd start) {
        trained_network best;
        best.log_evidence = -std::numeric_limits<double>::infinity();
        trained_network now;
        now.parameters = std::move(start);
        for (int round = 0; round < most_rounds; ++round) {
            descend(now);
            estimate(now);
            const double gain = now.log_evidence - best.log_evidence;
            if (gain > 0.0) best = now;
            if (gain < 0.1) break;
        }
        return best;
    }

  private:
    void descend(trained_network &now) {
        optimise_options options;
        options.max_iterations = task_.max_iterations;
        options.least_decrease = task_.least_decrease;
        const optimise_result found =
            task_.way == optimiser::lbfgs
                ? minimise([&](const double *p, double *g) { return loss_(p, g); }, now.parameters,
                           options)
                : minimise_squares(
                      [&](const double *p, double *r, double *j) { loss_.residuals(p, r, j); },
                      loss_.residual_count(), now.parameters, options);
        now.loss = found.value;
        now.iterations += found.iterations;
    }

    double decay_of(std::size_t group) const {
        const weight_decay &decay = loss_.decay();
        return group == 0 ? decay.hidden : group == 1 ? decay.output : decay.linear[0];
    }

    // The evidence of the current decays, and better ones for the next round.
    void estimate(trained_network &now) {
        const Eigen::VectorXd &p = now.parameters;
        double penalty = 0.0;
        for (std::size_t g = 0; g < groups_.size(); ++g) {
            const auto w = p.segment(groups_[g].from, groups_[g].count);
            penalty += 0.5 * decay_of(g) * w.squaredNorm();
        }
        const double squares = 2.0 * samples_ * std::max(now.loss - penalty, 1e-16);
        const Eigen::MatrixXd data = curvature_of(loss_, p);
        double beta = values_ / squares, gamma = 0.0;
        for (int round = 0; round < 2; ++round) {  // beta depends on gamma, gamma on beta
            now.log_evidence = solve(data, p, squares, beta, gamma);
            beta = std::max(values_ - gamma, 1.0) / squares;
        }
        now.effective_parameters = gamma;
        now.decay = decay_of(0);
        now.linear_decay = task_.shape.linear ? decay_of(2) : 0.0;
        weight_decay next = loss_.decay();
        const auto decay = [&](std::size_t g) { return groups_[g].alpha / (beta * samples_); };
        next.hidden = decay(0);
        next.output = decay(1);
        if (task_.shape.linear) next.linear.setConstant(decay(2));
        loss_.set_decay(next);
    }

    // With noise beta and the current decays: log evidence, gamma, and new alphas.
    double solve(const Eigen::MatrixXd &data, const Eigen::VectorXd &p, double squares, double beta,
                 double &gamma) {
        Eigen::MatrixXd hessian = beta * data;
        const auto alpha_of = [&](std::size_t g) {
            return std::max(decay_of(g), 1e-12) * beta * samples_;
        };
        double alphas = 0.0, weights = 0.0;
        for (std::size_t g = 0; g < groups_.size(); ++g) {
            const double alpha = alpha_of(g);
            const auto size = static_cast<double>(groups_[g].count);
            hessian.diagonal().segment(groups_[g].from, groups_[g].count).array() += alpha;
            alphas += size * std::log(alpha);
            weights += alpha * p.segment(groups_[g].from, groups_[g].count).squaredNorm();
        }
        hessian.diagonal().array() += 1.0;  // biases: a prior of unit spread
        const algebra::positive_definite factor = algebra::factor_positive_definite(hessian);
        gamma = static_cast<double>(task_.shape.hidden + task_.shape.outputs);
        for (std::size_t g = 0; g < groups_.size(); ++g) {
            weight_group &group = groups_[g];
            const double trace = factor.inverse.diagonal().segment(group.from, group.count).sum();
            const double determined =
                std::clamp(static_cast<double>(group.count) - alpha_of(g) * trace, 1e-3,
                           static_cast<double>(group.count));
            const double power = p.segment(group.from, group.count).squaredNorm();
            group.alpha = std::clamp(determined / std::max(power, 1e-12), 1e-9 * beta * samples_,
                                     1e3 * beta * samples_);
            gamma += determined;
        }
        return 0.5 * (alphas - factor.log_determinant + values_ * std::log(beta / two_pi) -
                      beta * squares - weights);
    }

    const network_task &task_;
    network_loss loss_;
    std::vector<weight_group> groups_;
    double values_, samples_;
};

}  // namespace

trained_network train_by_evidence(const network_task &task, double linear_decay) {
    const Eigen::MatrixXd x = task.x.transpose(), t = task.t.transpose();
    const linear_map linear =
        ridge_solver(task.x, task.t).solve(Eigen::VectorXd::Constant(t.rows(), linear_decay));
    std::vector<trained_network> all(static_cast<std::size_t>(task.starts));
    std::size_t done = 0;
    std::mutex reporting;
    run_parallel(all.size(), task.threads, [&](std::size_t s) {
        all[s] = evidence_training(task, x, t, linear_decay)
                     .run(start_from(task.shape, linear, task.seed + s));
        all[s].best_start = static_cast<int>(s);
        const std::lock_guard<std::mutex> lock(reporting);
        ++done;
        if (task.progress) {
            task.progress(static_cast<double>(done) / static_cast<double>(all.size()), all[s].loss);
        }
    });
    return *std::max_element(all.begin(), all.end(), [](const auto &a, const auto &b) {
        return a.log_evidence < b.log_evidence;
    });
}

}  // namespace compbox::regression
