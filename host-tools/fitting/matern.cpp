// SPDX-License-Identifier: MIT
// State: f and its derivatives, each divided by lambda^order. All then have one size, and the
// system depends on tau = lambda * step alone. With N = A + I nilpotent (N^(p+1) = 0) the
// transition is exp(A tau) = exp(-tau) sum_k (N tau)^k / k!.
#include "host-tools/fitting/matern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "host-tools/fitting/small_matrix.h"

namespace compbox::fitting {

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
    using square = small_matrix<D, D>;
    using column = small_matrix<D, 1>;
    using three = small_matrix<D, 3>;
    using row3 = small_matrix<1, 3>;

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
        const square *transition;  // from the previous point
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
    void solve_line();
    matern_likelihood sum_up() const;
    double place_of(std::size_t i) const { return (points_.x[i] - centre_) / half_range_; }

    const process_points &points_;
    matern model_;
    double lambda_, centre_ = 0.0, half_range_ = 1.0;
    square nilpotent_, stationary_;
    column drive_;  // white noise enters the highest derivative; scaled to unit variance of f
    std::unordered_map<double, system> systems_;
    std::vector<step> steps_;
    small_matrix<3, 3> products_;  // of whitened innovations, col by col
    double log_determinant_ = 0.0;
    double line_determinant_ = 1.0;  // of line_covariance_
    small_matrix<2, 2> line_covariance_;
    small_matrix<2, 1> line_;
};

// The system matrix is a shift with the binomials of (d + 1)^D in its last row. The stationary
// covariance is the integral of the drive over all time, computed in pieces.
template <int D>
void filter<D>::make_system() {
    square a;
    for (int i = 0; i + 1 < D; ++i) a(i, i + 1) = 1.0;
    for (int k = 0; k < D; ++k) a(D - 1, k) = -binomial(D, k);
    nilpotent_ = a + square::identity();
    drive_(D - 1, 0) = 1.0;
    const square transition = transition_of(1.0);
    const square piece = noise_of(1.0, transition);
    square carried = square::identity();
    for (int i = 0; i < 60; ++i) {
        stationary_ += carried * piece * transposed(carried);
        carried = transition * carried;
    }
    const double scale = 1.0 / stationary_(0, 0);
    stationary_ = stationary_ * scale;
    drive_ = drive_ * std::sqrt(scale);
}

template <int D>
typename filter<D>::square filter<D>::transition_of(double tau) const {
    square sum = square::identity(), power = sum;
    for (int k = 1; k < D; ++k) {
        power = power * nilpotent_ * (tau / k);
        sum += power;
    }
    return sum * std::exp(-tau);
}

// The integral of F(s) d d' F(s)' over the step. Quadrature keeps it positive and relatively exact
// for any short step; after a long step almost nothing remains.
template <int D>
typename filter<D>::square filter<D>::noise_of(double tau, const square &transition) const {
    if (tau > 2.0) return stationary_ - transition * stationary_ * transposed(transition);
    square sum;
    for (std::size_t g = 0; g < gauss_node.size(); ++g) {
        for (const double sign : {-1.0, 1.0}) {
            const column v = transition_of(0.5 * tau * (1.0 + sign * gauss_node[g])) * drive_;
            sum += v * transposed(v) * (0.5 * tau * gauss_weight[g]);
        }
    }
    return sum;
}

// The system of a step, cached for later steps of the same length. Lengths are equal within one
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

// Updates the state with the reading of point i. The first row of the covariance is multiplied by r
// / S directly, which avoids cancellation.
template <int D>
void filter<D>::correct(std::size_t i, three &state, square &covariance, step &kept) {
    const double reading_variance = points_.variance[i];
    kept.inverse_spread = 0.0;
    if (reading_variance > 0.0) {
        const double spread = covariance(0, 0) + reading_variance;
        const column first = column_of(covariance, 0);
        kept.gain = first * (1.0 / spread);
        kept.inverse_spread = 1.0 / spread;
        kept.innovation = row3{{{points_.y[i], 1.0, place_of(i)}}} - row_of(state, 0);
        state += kept.gain * kept.innovation;
        covariance += kept.gain * transposed(first) * -1.0;
        for (int k = 0; k < D; ++k) {
            covariance(0, k) = covariance(k, 0) = first(k, 0) * (reading_variance / spread);
        }
        products_ += transposed(kept.innovation) * kept.innovation * kept.inverse_spread;
        log_determinant_ += std::log(spread);
    }
    kept.state = row_of(state, 0);
    kept.covariance = column_of(covariance, 0);
}

// in : keep: store each step for the backward pass
// out: the likelihood of the model, with the line's two coefficients at their best
template <int D>
matern_likelihood filter<D>::forward(bool keep) {
    three state;
    square covariance = stationary_ * model_.ratio;
    if (keep) steps_.resize(points_.x.size());
    step scratch;
    for (std::size_t i = 0; i < points_.x.size(); ++i) {
        step &kept = keep ? steps_[i] : scratch;
        if (i > 0) {
            const system &s = system_of(points_.x[i] - points_.x[i - 1]);
            state = s.transition * state;
            covariance = s.transition * covariance * transposed(s.transition);
            covariance += s.noise * model_.ratio;
            kept.transition = &s.transition;
        }
        correct(i, state, covariance, kept);
    }
    solve_line();
    return sum_up();
}

// The straight line's two coefficients and their covariance / noise^2, from `products_`.
template <int D>
void filter<D>::solve_line() {
    const double a = products_(1, 1), b = products_(1, 2), c = products_(2, 2);
    line_determinant_ = 1.0 / (a * c - b * b);
    line_covariance_ = small_matrix<2, 2>{{{c, -b}, {-b, a}}} * line_determinant_;
    line_ = line_covariance_ * small_matrix<2, 1>{{{products_(1, 0)}, {products_(2, 0)}}};
}

template <int D>
matern_likelihood filter<D>::sum_up() const {
    const double by_line = line_(0, 0) * products_(1, 0) + line_(1, 0) * products_(2, 0);
    const double squares = std::max(products_(0, 0) - by_line, 0.0);
    const double freedom = static_cast<double>(points_.measured) - 2.0 + points_.prior_freedom;
    matern_likelihood found;
    const double floor = 1e-300;
    found.noise_variance =
        std::max((squares + points_.prior_freedom * points_.prior_variance) / freedom, floor);
    // If the positions do not determine the line, all models get the same share.
    const bool determined = line_determinant_ > 0.0 && std::isfinite(line_determinant_);
    found.log_likelihood = determined ? -0.5 * (freedom * std::log(found.noise_variance) +
                                                log_determinant_ - std::log(line_determinant_))
                                      : -std::numeric_limits<double>::infinity();
    return found;
}

// The adjoint pass (Bryson and Frazier): information of later readings about a point, as a vector
// and a matrix; no covariance is inverted.
template <int D>
matern_curve filter<D>::back(const matern_likelihood &found) {
    matern_curve curve;
    curve.likelihood = found;
    const std::size_t n = points_.x.size();
    curve.mean.resize(n);
    curve.variance.resize(n);
    three later;
    square weight;
    for (std::size_t i = n; i-- > 0;) {
        const step &s = steps_[i];
        const row3 smoothed = s.state - transposed(s.covariance) * later;
        const small_matrix<2, 1> line{{{1.0 - smoothed(0, 1)}, {place_of(i) - smoothed(0, 2)}}};
        curve.mean[i] = smoothed(0, 0) + dot(line, line_);
        const double spread = s.covariance(0, 0) - dot(s.covariance, weight * s.covariance) +
                              dot(line, line_covariance_ * line);
        curve.variance[i] = std::max(spread, 0.0) * found.noise_variance;
        if (s.inverse_spread > 0.0) {
            square keep = square::identity();
            for (int k = 0; k < D; ++k) keep(k, 0) -= s.gain(k, 0);
            later = transposed(keep) * later;
            for (int k = 0; k < 3; ++k) later(0, k) -= s.innovation(0, k) * s.inverse_spread;
            weight = transposed(keep) * weight * keep;
            weight(0, 0) += s.inverse_spread;
        }
        if (i > 0) {
            later = transposed(*s.transition) * later;
            weight = transposed(*s.transition) * weight * *s.transition;
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

}  // namespace compbox::fitting
