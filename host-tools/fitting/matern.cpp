// SPDX-License-Identifier: MIT
// State: f and its derivatives, each divided by lambda^order. All then have one size, and the
// system depends on tau = lambda * step alone. With N = A + I nilpotent (N^(p+1) = 0) the
// transition is exp(A tau) = exp(-tau) sum_k (N tau)^k / k!.
//
// Correlated noise n adds one state. The first state is then g = f + n, which is what a reading
// shows: the measurement still is the first state, and f = g - n.
#include "host-tools/fitting/matern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <unordered_map>
#include <utility>

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

// The filter for smoothness D - 1/2; D states and one for correlated noise, three columns: y and
// the regressors 1 and x.
template <int D, bool correlated>
class filter {
  public:
    static constexpr int states = D + (correlated ? 1 : 0);
    using curve_square = small_matrix<D, D>;
    using curve_column = small_matrix<D, 1>;
    using square = small_matrix<states, states>;
    using column = small_matrix<states, 1>;
    using three = small_matrix<states, 3>;
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
    // A quantity after the filter: its three columns, its covariance with every state, its variance
    struct view {
        row3 state;
        column covariance;
        double variance;
    };
    struct step {
        const square *transition;  // from the previous point
        column gain;
        view reading, curve;
        row3 innovation;
        double inverse_spread;  // 1 / variance of the innovation; 0 where not measured
    };
    struct system {
        curve_square transition, noise;
    };
    // The smoothed view: three columns, and the covariance with the line's coefficients.
    struct smoothed {
        small_matrix<2, 1> line;
        double mean;
    };

    void make_system();
    curve_square transition_of(double tau) const;
    curve_square noise_of(double tau, const curve_square &transition) const;
    const system &system_of(double length);
    const square &joined(const system &curve, double length, double kept_noise);
    square start() const;
    const square &advance(std::size_t i, three &state, square &covariance);
    void correct(std::size_t i, three &state, square &covariance, step &kept);
    void solve_line();
    matern_likelihood sum_up() const;
    smoothed smooth_view(const view &seen, const three &later, std::size_t i) const;
    void write(std::size_t i, const three &later, const square &weight, matern_curve &curve) const;
    double place_of(std::size_t i) const { return (points_.x[i] - centre_) / half_range_; }

    const process_points &points_;
    matern model_;
    double lambda_, centre_ = 0.0, half_range_ = 1.0;
    curve_square nilpotent_, stationary_;
    curve_column drive_;  // white noise enters the highest derivative; scaled to unit variance of f
    std::unordered_map<double, system> systems_;
    std::map<std::pair<double, double>, square> joined_;  // by length and the noise's factor
    std::vector<step> steps_;
    small_matrix<3, 3> products_;  // of whitened innovations, col by col
    double log_determinant_ = 0.0;
    double line_determinant_ = 1.0;  // of line_covariance_
    small_matrix<2, 2> line_covariance_;
    small_matrix<2, 1> line_;
};

// The system matrix is a shift with the binomials of (d + 1)^D in its last row. The stationary
// covariance is the integral of the drive over all time, computed in pieces.
template <int D, bool correlated>
void filter<D, correlated>::make_system() {
    curve_square a;
    for (int i = 0; i + 1 < D; ++i) a(i, i + 1) = 1.0;
    for (int k = 0; k < D; ++k) a(D - 1, k) = -binomial(D, k);
    nilpotent_ = a + curve_square::identity();
    drive_(D - 1, 0) = 1.0;
    const curve_square transition = transition_of(1.0);
    const curve_square piece = noise_of(1.0, transition);
    curve_square carried = curve_square::identity();
    for (int i = 0; i < 60; ++i) {
        stationary_ += carried * piece * transposed(carried);
        carried = transition * carried;
    }
    const double scale = 1.0 / stationary_(0, 0);
    stationary_ = stationary_ * scale;
    drive_ = drive_ * std::sqrt(scale);
}

template <int D, bool correlated>
typename filter<D, correlated>::curve_square filter<D, correlated>::transition_of(
    double tau) const {
    curve_square sum = curve_square::identity(), power = sum;
    for (int k = 1; k < D; ++k) {
        power = power * nilpotent_ * (tau / k);
        sum += power;
    }
    return sum * std::exp(-tau);
}

// The integral of F(s) d d' F(s)' over the step. Quadrature keeps it positive and relatively exact
// for any short step; after a long step almost nothing remains.
template <int D, bool correlated>
typename filter<D, correlated>::curve_square filter<D, correlated>::noise_of(
    double tau, const curve_square &transition) const {
    if (tau > 2.0) return stationary_ - transition * stationary_ * transposed(transition);
    curve_square sum;
    for (std::size_t g = 0; g < gauss_node.size(); ++g) {
        for (const double sign : {-1.0, 1.0}) {
            const curve_column v = transition_of(0.5 * tau * (1.0 + sign * gauss_node[g])) * drive_;
            sum += v * transposed(v) * (0.5 * tau * gauss_weight[g]);
        }
    }
    return sum;
}

// The system of a step, cached for later steps of the same length. Lengths are equal within one
// part in 10^7, so that evenly spaced points share one.
template <int D, bool correlated>
const typename filter<D, correlated>::system &filter<D, correlated>::system_of(double length) {
    const double rounded = static_cast<double>(static_cast<float>(length));
    const auto [place, is_new] = systems_.try_emplace(rounded);
    if (is_new) {
        const double tau = lambda_ * rounded;
        place->second.transition = transition_of(tau);
        place->second.noise = noise_of(tau, place->second.transition);
    }
    return place->second;
}

// in : kept_noise: the noise of the previous point times this is what is left of it at this one
// out: the transition of (g, derivatives of f, n); of the curve alone if the noise is white
template <int D, bool correlated>
const typename filter<D, correlated>::square &filter<D, correlated>::joined(const system &curve,
                                                                            double length,
                                                                            double kept_noise) {
    if constexpr (!correlated) {
        return curve.transition;
    } else {
        const auto [place, is_new] = joined_.try_emplace({length, kept_noise});
        square &both = place->second;
        if (!is_new) return both;
        for (int i = 0; i < D; ++i) {
            for (int k = 0; k < D; ++k) both(i, k) = curve.transition(i, k);
            both(i, D) = -curve.transition(i, 0);
        }
        both(0, D) += kept_noise;
        both(D, D) = kept_noise;
        return both;
    }
}

// Covariance of the curve's states with the noise's variance where it enters: in g and in n.
template <int D, bool correlated>
small_matrix<D + (correlated ? 1 : 0), D + (correlated ? 1 : 0)> with_noise(
    const small_matrix<D, D> &curve, double noise) {
    if constexpr (!correlated) {
        return curve;
    } else {
        small_matrix<D + 1, D + 1> both;
        for (int i = 0; i < D; ++i) {
            for (int k = 0; k < D; ++k) both(i, k) = curve(i, k);
        }
        both(0, 0) += noise;
        both(0, D) = both(D, 0) = both(D, D) = noise;
        return both;
    }
}

template <int D, bool correlated>
typename filter<D, correlated>::square filter<D, correlated>::start() const {
    const double drift = correlated ? points_.drift.front() : 0.0;
    return with_noise<D, correlated>(stationary_ * model_.ratio,
                                     model_.noise.share * drift * drift);
}

// Moves state and covariance from point i - 1 to point i. out: the transition
template <int D, bool correlated>
const typename filter<D, correlated>::square &filter<D, correlated>::advance(std::size_t i,
                                                                             three &state,
                                                                             square &covariance) {
    const double length = points_.x[i] - points_.x[i - 1];
    const system &s = system_of(length);
    double kept = 0.0, added = 0.0;
    if constexpr (correlated) {
        const double decay =
            std::exp(-(points_.step[i] - points_.step[i - 1]) / model_.noise.length);
        const double drift = points_.drift[i];
        kept = decay * drift / points_.drift[i - 1];
        added = model_.noise.share * drift * drift * (1.0 - decay * decay);
    }
    const square &transition = joined(s, static_cast<double>(static_cast<float>(length)), kept);
    state = transition * state;
    covariance = transition * covariance * transposed(transition);
    covariance += with_noise<D, correlated>(s.noise * model_.ratio, added);
    return transition;
}

// Updates the state with the reading of point i. The first row of the covariance is multiplied by r
// / S directly, which avoids cancellation.
template <int D, bool correlated>
void filter<D, correlated>::correct(std::size_t i, three &state, square &covariance, step &kept) {
    const double reading_variance = points_.variance[i] * (1.0 - model_.noise.share);
    kept.inverse_spread = 0.0;
    if (reading_variance > 0.0) {
        const double spread = covariance(0, 0) + reading_variance;
        const column first = column_of(covariance, 0);
        kept.gain = first * (1.0 / spread);
        kept.inverse_spread = 1.0 / spread;
        kept.innovation = row3{{{points_.y[i], 1.0, place_of(i)}}} - row_of(state, 0);
        state += kept.gain * kept.innovation;
        covariance += kept.gain * transposed(first) * -1.0;
        for (int k = 0; k < states; ++k) {
            covariance(0, k) = covariance(k, 0) = first(k, 0) * (reading_variance / spread);
        }
        products_ += transposed(kept.innovation) * kept.innovation * kept.inverse_spread;
        log_determinant_ += std::log(spread);
    }
    kept.reading = {row_of(state, 0), column_of(covariance, 0), covariance(0, 0)};
    kept.curve = kept.reading;
    if constexpr (correlated) {
        kept.curve.state += row_of(state, D) * -1.0;
        kept.curve.covariance += column_of(covariance, D) * -1.0;
        kept.curve.variance += covariance(D, D) - 2.0 * covariance(0, D);
    }
}

// in : keep: store each step for the backward pass
// out: the likelihood of the model, with the line's two coefficients at their best
template <int D, bool correlated>
matern_likelihood filter<D, correlated>::forward(bool keep) {
    three state;
    square covariance = start();
    if (keep) steps_.resize(points_.x.size());
    step scratch;
    for (std::size_t i = 0; i < points_.x.size(); ++i) {
        step &kept = keep ? steps_[i] : scratch;
        if (i > 0) kept.transition = &advance(i, state, covariance);
        correct(i, state, covariance, kept);
    }
    solve_line();
    return sum_up();
}

// The straight line's two coefficients and their covariance / noise^2, from `products_`.
template <int D, bool correlated>
void filter<D, correlated>::solve_line() {
    const double a = products_(1, 1), b = products_(1, 2), c = products_(2, 2);
    line_determinant_ = 1.0 / (a * c - b * b);
    line_covariance_ = small_matrix<2, 2>{{{c, -b}, {-b, a}}} * line_determinant_;
    line_ = line_covariance_ * small_matrix<2, 1>{{{products_(1, 0)}, {products_(2, 0)}}};
}

template <int D, bool correlated>
matern_likelihood filter<D, correlated>::sum_up() const {
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

template <int D, bool correlated>
typename filter<D, correlated>::smoothed filter<D, correlated>::smooth_view(const view &seen,
                                                                            const three &later,
                                                                            std::size_t i) const {
    const row3 all = seen.state - transposed(seen.covariance) * later;
    const small_matrix<2, 1> line{{{1.0 - all(0, 1)}, {place_of(i) - all(0, 2)}}};
    return {line, all(0, 0) + dot(line, line_)};
}

// in : later, weight: the information of the readings after point i
// out: the values of point i in `curve`, variances in units of noise^2
template <int D, bool correlated>
void filter<D, correlated>::write(std::size_t i, const three &later, const square &weight,
                                  matern_curve &curve) const {
    const step &s = steps_[i];
    const smoothed own = smooth_view(s.curve, later, i), read = smooth_view(s.reading, later, i);
    const column weighted = weight * s.curve.covariance;
    const small_matrix<2, 1> spread = line_covariance_ * own.line;
    curve.mean[i] = own.mean;
    const double of_curve = s.curve.variance - dot(s.curve.covariance, weighted);
    curve.variance[i] = std::max(of_curve + dot(own.line, spread), 0.0);
    curve.reading_mean[i] = read.mean;
    const double of_reading =
        s.reading.variance - dot(s.reading.covariance, weight * s.reading.covariance);
    curve.reading_variance[i] =
        std::max(of_reading + dot(read.line, line_covariance_ * read.line), 0.0);
    curve.covariance[i] =
        s.curve.covariance(0, 0) - dot(s.reading.covariance, weighted) + dot(read.line, spread);
}

// The adjoint pass (Bryson and Frazier): information of later readings about a point, as a vector
// and a matrix; no covariance is inverted.
template <int D, bool correlated>
matern_curve filter<D, correlated>::back(const matern_likelihood &found) {
    matern_curve curve;
    curve.likelihood = found;
    const std::size_t n = points_.x.size();
    for (auto *values : {&curve.mean, &curve.variance, &curve.reading_mean, &curve.reading_variance,
                         &curve.covariance}) {
        values->resize(n);
    }
    three later;
    square weight;
    for (std::size_t i = n; i-- > 0;) {
        const step &s = steps_[i];
        write(i, later, weight, curve);
        if (s.inverse_spread > 0.0) {
            square keep = square::identity();
            for (int k = 0; k < states; ++k) keep(k, 0) -= s.gain(k, 0);
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
    for (auto *values : {&curve.variance, &curve.reading_variance, &curve.covariance}) {
        for (double &value : *values) value *= found.noise_variance;
    }
    return curve;
}

template <bool correlated>
matern_likelihood likelihood_with(const process_points &points, const matern &model) {
    switch (model.kind) {
        case 0:
            return filter<1, correlated>(points, model).forward(false);
        case 1:
            return filter<2, correlated>(points, model).forward(false);
        case 2:
            return filter<3, correlated>(points, model).forward(false);
        case 3:
            return filter<4, correlated>(points, model).forward(false);
        default:
            return filter<5, correlated>(points, model).forward(false);
    }
}

template <int D, bool correlated>
matern_curve both_passes(const process_points &points, const matern &model) {
    filter<D, correlated> pass(points, model);
    const matern_likelihood found = pass.forward(true);
    return pass.back(found);
}

template <bool correlated>
matern_curve regress_with(const process_points &points, const matern &model) {
    switch (model.kind) {
        case 0:
            return both_passes<1, correlated>(points, model);
        case 1:
            return both_passes<2, correlated>(points, model);
        case 2:
            return both_passes<3, correlated>(points, model);
        case 3:
            return both_passes<4, correlated>(points, model);
        default:
            return both_passes<5, correlated>(points, model);
    }
}

}  // namespace

matern_likelihood likelihood_of(const process_points &points, const matern &model) {
    return model.noise.white() ? likelihood_with<false>(points, model)
                               : likelihood_with<true>(points, model);
}

matern_curve regress(const process_points &points, const matern &model) {
    return model.noise.white() ? regress_with<false>(points, model)
                               : regress_with<true>(points, model);
}

}  // namespace compbox::fitting
