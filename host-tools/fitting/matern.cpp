// SPDX-License-Identifier: MIT
// State: f and its derivatives, each divided by lambda^order, so that all are of one size and the
// system depends on tau = lambda * step alone. With N = A + I nilpotent (N^(p+1) = 0) the
// transition is exp(A tau) = exp(-tau) sum_k (N tau)^k / k!.
#include "host-tools/fitting/matern.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <unordered_map>

namespace compbox {

namespace {

// Ten-point Gauss-Legendre rule on [-1, 1], positive half.
constexpr std::array<double, 5> gauss_node = {0.1488743389816312, 0.4333953941292472,
                                              0.6794095682990244, 0.8650633666889845,
                                              0.9739065285171717};
constexpr std::array<double, 5> gauss_weight = {0.2955242247147529, 0.2692667193099964,
                                                0.2190863625159820, 0.1494513491505806,
                                                0.0666713443086881};

double binomial(int n, int k) {
    double result = 1.0;
    for (int i = 1; i <= k; ++i) result = result * (n - k + i) / i;
    return result;
}

// The filter for smoothness D - 1/2; D states, three columns: y and the regressors 1 and x.
template <int D>
class filter {
  public:
    using square = Eigen::Matrix<double, D, D>;
    using column = Eigen::Matrix<double, D, 1>;
    using three = Eigen::Matrix<double, D, 3>;
    using row3 = Eigen::Matrix<double, 1, 3>;

    filter(const process_points &points, const matern &model)
        : points_(points), model_(model), lambda_(std::sqrt(2.0 * D - 1.0) / model.length) {
        centre_ = 0.5 * (points.x.front() + points.x.back());
        half_range_ = 0.5 * (points.x.back() - points.x.front());
        make_system();
    }

    matern_likelihood forward(bool keep);
    matern_curve back(const matern_likelihood &found);

  private:
    struct step {
        const square *transition;  // from the point before
        column gain;
        column covariance;  // first row of the filtered covariance
        row3 state, innovation;
        double inverse_spread;  // 1 / variance of the innovation; 0 where not measured
    };
    struct system {
        square transition, noise;
    };

    void make_system();
    square transition_of(double tau) const;
    square noise_of(double tau, const square &transition) const;
    const system &system_of(double length);
    void correct(std::size_t i, three &state, square &covariance, step &kept);
    matern_likelihood sum_up() const;

    const process_points &points_;
    matern model_;
    double lambda_, centre_ = 0.0, half_range_ = 1.0;
    square nilpotent_, stationary_;
    column drive_;  // white noise enters the highest derivative; scaled to unit variance of f
    std::unordered_map<double, system> systems_;
    std::vector<step> steps_;
    Eigen::Matrix3d products_ = Eigen::Matrix3d::Zero();  // of whitened innovations, col by col
    double log_determinant_ = 0.0;
    Eigen::Matrix2d line_covariance_ = Eigen::Matrix2d::Zero();
    Eigen::Vector2d line_ = Eigen::Vector2d::Zero();
};

// The system matrix is a shift with the binomials of (d + 1)^D in its last row; the stationary
// covariance follows from the drive by an integral over all time, done in pieces.
template <int D>
void filter<D>::make_system() {
    square a = square::Zero();
    for (int i = 0; i + 1 < D; ++i) a(i, i + 1) = 1.0;
    for (int k = 0; k < D; ++k) a(D - 1, k) = -binomial(D, k);
    nilpotent_ = a + square::Identity();
    drive_ = column::Zero();
    drive_[D - 1] = 1.0;
    stationary_ = square::Zero();
    const square transition = transition_of(1.0);
    const square piece = noise_of(1.0, transition);
    square carried = square::Identity();
    for (int i = 0; i < 60; ++i) {
        stationary_ += carried * piece * carried.transpose();
        carried = transition * carried;
    }
    const double scale = 1.0 / stationary_(0, 0);
    stationary_ *= scale;
    drive_ *= std::sqrt(scale);
}

template <int D>
typename filter<D>::square filter<D>::transition_of(double tau) const {
    square sum = square::Identity(), power = square::Identity();
    for (int k = 1; k < D; ++k) {
        power = power * nilpotent_ * (tau / k);
        sum += power;
    }
    return sum * std::exp(-tau);
}

// The integral of F(s) d d' F(s)' over the step: by quadrature, which keeps it positive and
// relatively exact however short the step; a long step has forgotten nearly everything.
template <int D>
typename filter<D>::square filter<D>::noise_of(double tau, const square &transition) const {
    if (tau > 2.0) return stationary_ - transition * stationary_ * transition.transpose();
    square sum = square::Zero();
    for (std::size_t g = 0; g < gauss_node.size(); ++g) {
        for (const double sign : {-1.0, 1.0}) {
            const column v = transition_of(0.5 * tau * (1.0 + sign * gauss_node[g])) * drive_;
            sum += 0.5 * tau * gauss_weight[g] * v * v.transpose();
        }
    }
    return sum;
}

// The system of a step, kept for the next step of the same length: lengths are told apart to one
// part in 10^7, so that evenly spaced points share one.
template <int D>
const typename filter<D>::system &filter<D>::system_of(double length) {
    const double rounded = static_cast<double>(static_cast<float>(length));
    const auto [place, is_new] = systems_.try_emplace(rounded);
    if (is_new) {
        const double tau = lambda_ * rounded;
        place->second.transition = transition_of(tau);
        place->second.noise = noise_of(tau, place->second.transition);
    }
    return place->second;
}

// Takes the reading of point i into the state; the first row of the covariance is shrunk by
// r / S directly, free of cancellation.
template <int D>
void filter<D>::correct(std::size_t i, three &state, square &covariance, step &kept) {
    const double reading_variance = points_.variance[i];
    kept.inverse_spread = 0.0;
    if (reading_variance > 0.0) {
        const double u = (points_.x[i] - centre_) / half_range_;
        const double spread = covariance(0, 0) + reading_variance;
        const column first = covariance.col(0);
        kept.gain = first / spread;
        kept.inverse_spread = 1.0 / spread;
        kept.innovation = row3(points_.y[i], 1.0, u) - state.row(0);
        state += kept.gain * kept.innovation;
        covariance -= kept.gain * first.transpose();
        covariance.col(0) = first * (reading_variance / spread);
        covariance.row(0) = covariance.col(0).transpose();
        products_ += kept.innovation.transpose() * kept.innovation / spread;
        log_determinant_ += std::log(spread);
    }
    kept.state = state.row(0);
    kept.covariance = covariance.col(0);
}

template <int D>
matern_likelihood filter<D>::forward(bool keep) {
    three state = three::Zero();
    square covariance = model_.ratio * stationary_;
    if (keep) steps_.resize(points_.x.size());
    step scratch;
    for (std::size_t i = 0; i < points_.x.size(); ++i) {
        step &kept = keep ? steps_[i] : scratch;
        if (i > 0) {
            const system &s = system_of(points_.x[i] - points_.x[i - 1]);
            state = (s.transition * state).eval();
            covariance = (s.transition * covariance * s.transition.transpose()).eval();
            covariance += model_.ratio * s.noise;
            kept.transition = &s.transition;
        }
        correct(i, state, covariance, kept);
    }
    const Eigen::Matrix2d line_information = products_.bottomRightCorner<2, 2>();
    line_covariance_ = line_information.inverse();
    line_ = line_covariance_ * products_.block<2, 1>(1, 0);
    return sum_up();
}

template <int D>
matern_likelihood filter<D>::sum_up() const {
    const double squares =
        std::max(products_(0, 0) - line_.dot(products_.template block<2, 1>(1, 0)), 0.0);
    const double freedom = static_cast<double>(points_.measured) - 2.0 + points_.prior_freedom;
    matern_likelihood found;
    const double floor = 1e-300;
    found.noise_variance =
        std::max((squares + points_.prior_freedom * points_.prior_variance) / freedom, floor);
    found.log_likelihood = -0.5 * (freedom * std::log(found.noise_variance) + log_determinant_ -
                                   std::log(line_covariance_.determinant()));
    return found;
}

// The adjoint pass (Bryson and Frazier): what later readings say about a point, as a vector and a
// matrix; no covariance is inverted.
template <int D>
matern_curve filter<D>::back(const matern_likelihood &found) {
    matern_curve curve;
    curve.likelihood = found;
    const std::size_t n = points_.x.size();
    curve.mean.resize(n);
    curve.variance.resize(n);
    three later = three::Zero();
    square weight = square::Zero();
    for (std::size_t i = n; i-- > 0;) {
        const step &s = steps_[i];
        const row3 smoothed = s.state - s.covariance.transpose() * later;
        const double u = (points_.x[i] - centre_) / half_range_;
        const Eigen::Vector2d line = Eigen::Vector2d(1.0 - smoothed[1], u - smoothed[2]);
        curve.mean[i] = smoothed[0] + line.dot(line_);
        const double spread = s.covariance[0] - s.covariance.dot(weight * s.covariance) +
                              line.dot(line_covariance_ * line);
        curve.variance[i] = std::max(spread, 0.0) * found.noise_variance;
        if (s.inverse_spread > 0.0) {
            square keep = square::Identity();
            keep.col(0) -= s.gain;
            later = (keep.transpose() * later).eval();
            later.row(0) -= s.innovation * s.inverse_spread;
            weight = (keep.transpose() * weight * keep).eval();
            weight(0, 0) += s.inverse_spread;
        }
        if (i > 0) {
            later = (s.transition->transpose() * later).eval();
            weight = (s.transition->transpose() * weight * *s.transition).eval();
        }
    }
    return curve;
}

template <int D>
matern_likelihood likelihood_with(const process_points &points, const matern &model) {
    return filter<D>(points, model).forward(false);
}

template <int D>
matern_curve regress_with(const process_points &points, const matern &model) {
    filter<D> pass(points, model);
    const matern_likelihood found = pass.forward(true);
    return pass.back(found);
}

}  // namespace

matern_likelihood likelihood_of(const process_points &points, const matern &model) {
    switch (model.kind) {
        case 0:
            return likelihood_with<1>(points, model);
        case 1:
            return likelihood_with<2>(points, model);
        case 2:
            return likelihood_with<3>(points, model);
        case 3:
            return likelihood_with<4>(points, model);
        default:
            return likelihood_with<5>(points, model);
    }
}

matern_curve regress(const process_points &points, const matern &model) {
    switch (model.kind) {
        case 0:
            return regress_with<1>(points, model);
        case 1:
            return regress_with<2>(points, model);
        case 2:
            return regress_with<3>(points, model);
        case 3:
            return regress_with<4>(points, model);
        default:
            return regress_with<5>(points, model);
    }
}

}  // namespace compbox
