// SPDX-License-Identifier: MIT
// The only source that includes Ceres.
#include "host-tools/regression/optimise.h"

#include <ceres/cost_function.h>
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <cmath>
#include <vector>

namespace compbox::regression {

namespace {

class ceres_function : public ceres::FirstOrderFunction {
  public:
    ceres_function(const gradient_function &function, Eigen::Index count)
        : function_(function), count_(static_cast<int>(count)) {}

    bool Evaluate(const double *parameters, double *cost, double *gradient) const override {
        *cost = function_(parameters, gradient);
        return std::isfinite(*cost);
    }
    int NumParameters() const override { return count_; }

  private:
    const gradient_function &function_;
    int count_;
};

// All residuals in one block: collecting hundreds of small ones would take longer than computing
// them.
class ceres_squares : public ceres::CostFunction {
  public:
    ceres_squares(const residual_function &function, Eigen::Index residuals, Eigen::Index count)
        : function_(function) {
        set_num_residuals(static_cast<int>(residuals));
        mutable_parameter_block_sizes()->push_back(static_cast<int>(count));
    }

    bool Evaluate(double const *const *parameters, double *values,
                  double **jacobians) const override {
        function_(parameters[0], values, jacobians == nullptr ? nullptr : jacobians[0]);
        return std::isfinite(
            Eigen::Map<const Eigen::VectorXd>(values, num_residuals()).squaredNorm());
    }

  private:
    const residual_function &function_;
};

// Reports each iteration; Ceres has copied its point into `point` before.
class listener : public ceres::IterationCallback {
  public:
    listener(const optimise_options &options, const Eigen::VectorXd &point)
        : options_(options), point_(point) {}

    ceres::CallbackReturnType operator()(const ceres::IterationSummary &summary) override {
        return options_.after(summary.iteration, summary.cost, point_)
                   ? ceres::SOLVER_CONTINUE
                   : ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    }

  private:
    const optimise_options &options_;
    const Eigen::VectorXd &point_;
};

}  // namespace

// As optimise.h, by Ceres' L-BFGS with Wolfe line search; least_decrease is the only tolerance.
optimise_result minimise(const gradient_function &function, Eigen::VectorXd &point,
                         const optimise_options &options) {
    ceres::GradientProblem problem(new ceres_function(function, point.size()));
    ceres::GradientProblemSolver::Options settings;
    settings.line_search_direction_type = ceres::LBFGS;
    settings.line_search_type = ceres::WOLFE;
    settings.max_lbfgs_rank = options.memory;
    settings.max_num_iterations = options.max_iterations;
    settings.function_tolerance = options.least_decrease;
    settings.gradient_tolerance = 1e-12;
    settings.parameter_tolerance = 1e-12;
    settings.logging_type = ceres::SILENT;
    listener report(options, point);
    if (options.after) {
        settings.update_state_every_iteration = true;
        settings.callbacks.push_back(&report);
    }
    ceres::GradientProblemSolver::Summary summary;
    ceres::Solve(settings, problem, point.data(), &summary);
    optimise_result result;
    result.value = summary.final_cost;
    result.iterations = static_cast<int>(summary.iterations.size()) - 1;
    result.usable = summary.termination_type != ceres::FAILURE || result.iterations > 0;
    return result;
}

// As optimise.h, by Ceres' Levenberg-Marquardt with one residual block on one thread.
optimise_result minimise_squares(const residual_function &function, Eigen::Index residuals,
                                 Eigen::VectorXd &point, const optimise_options &options) {
    ceres::Problem problem;
    problem.AddResidualBlock(new ceres_squares(function, residuals, point.size()), nullptr,
                             std::vector<double *>{point.data()});
    ceres::Solver::Options settings;
    settings.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
    settings.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    settings.max_num_iterations = options.max_iterations;
    settings.function_tolerance = options.least_decrease;
    settings.gradient_tolerance = 1e-12;
    settings.parameter_tolerance = 1e-12;
    settings.num_threads = 1;
    settings.logging_type = ceres::SILENT;
    listener report(options, point);
    if (options.after) {
        settings.update_state_every_iteration = true;
        settings.callbacks.push_back(&report);
    }
    ceres::Solver::Summary summary;
    ceres::Solve(settings, &problem, &summary);
    optimise_result result;
    result.value = summary.final_cost;
    result.iterations = static_cast<int>(summary.iterations.size()) - 1;
    result.usable = summary.IsSolutionUsable();
    return result;
}

}  // namespace compbox::regression
