// SPDX-License-Identifier: MIT
#include "host-tools/regression/network.h"

#include <cmath>
#include <random>

namespace compbox::regression {

namespace {

constexpr Eigen::Index block = 256;  // samples at a time, so that the scratch memory stays in the
                                     // cache

// f in place. tanh by exp, which Eigen vectorises; its absolute error is 1e-16.
template <typename matrix>
void activate(activation kind, matrix &&s) {
    if (kind == activation::tansig) {
        s.array() = 1.0 - 2.0 / ((2.0 * s.array().min(350.0)).exp() + 1.0);
    } else {
        s.array() = 1.0 / ((-s.array().max(-700.0)).exp() + 1.0);
    }
}

// back *= f'(s), computed from the value h of f
template <typename matrix, typename value>
void times_slope(activation kind, matrix &&back, const value &h) {
    if (kind == activation::tansig) {
        back.array() *= 1.0 - h.array().square();
    } else {
        back.array() *= h.array() * (1.0 - h.array());
    }
}

}  // namespace

Eigen::MatrixXd predict(const network_shape &shape, const Eigen::VectorXd &parameters,
                        const Eigen::MatrixXd &x) {
    const network_parts<const double> net(shape, parameters.data());
    Eigen::MatrixXd y = Eigen::MatrixXd::Zero(shape.outputs, x.cols());
    if (shape.hidden > 0) {
        Eigen::MatrixXd h = (net.weight1 * x.topRows(shape.seen())).colwise() + net.bias1;
        activate(shape.kind, h);
        y.noalias() += net.weight2 * h;
    }
    if (shape.linear) y.noalias() += net.linear * x;
    return y.colwise() + net.bias2;
}

network_loss::network_loss(const network_shape &shape, const Eigen::MatrixXd &x,
                           const Eigen::MatrixXd &t, const weight_decay &decay)
    : shape_(shape),
      x_(x),
      t_(t),
      decay_(decay),
      hidden_(shape.hidden, block),
      error_(shape.outputs, block),
      back_(shape.hidden, block) {}

// Adds the decay's part of L, and of the gradient if it is not null.
double network_loss::add_decay(const double *parameters, double *gradient) const {
    const network_parts<const double> net(shape_, parameters);
    double loss =
        decay_.hidden * net.weight1.squaredNorm() + decay_.output * net.weight2.squaredNorm();
    if (shape_.linear) {
        loss += (decay_.linear.asDiagonal() * net.linear.array().square().matrix()).sum();
    }
    if (gradient != nullptr) {
        network_parts<double> slope(shape_, gradient);
        slope.weight1 += decay_.hidden * net.weight1;
        slope.weight2 += decay_.output * net.weight2;
        if (shape_.linear) slope.linear += decay_.linear.asDiagonal() * net.linear;
    }
    return 0.5 * loss;
}

double network_loss::operator()(const double *parameters, double *gradient) {
    const network_parts<const double> net(shape_, parameters);
    double squares = 0.0;
    if (gradient != nullptr) Eigen::Map<Eigen::VectorXd>(gradient, shape_.count()).setZero();
    const double share = 1.0 / static_cast<double>(samples());
    for (Eigen::Index from = 0; from < samples(); from += block) {
        const Eigen::Index n = std::min(block, samples() - from);
        const auto x = x_.middleCols(from, n);
        auto h = hidden_.leftCols(n);
        auto error = error_.leftCols(n);
        h.noalias() = net.weight1 * x.topRows(shape_.seen());
        h.colwise() += net.bias1;
        activate(shape_.kind, h);
        error.noalias() = net.weight2 * h;
        error -= t_.middleCols(from, n);
        error.colwise() += net.bias2;
        if (shape_.linear) error.noalias() += net.linear * x;
        squares += error.squaredNorm();
        if (gradient == nullptr) continue;
        error *= share;
        network_parts<double> slope(shape_, gradient);
        auto back = back_.leftCols(n);
        back.noalias() = net.weight2.transpose() * error;
        times_slope(shape_.kind, back, h);
        slope.weight1.noalias() += back * x.topRows(shape_.seen()).transpose();
        slope.bias1 += back.rowwise().sum();
        slope.weight2.noalias() += error * h.transpose();
        slope.bias2 += error.rowwise().sum();
        if (shape_.linear) slope.linear.noalias() += error * x.transpose();
    }
    return 0.5 * squares * share + add_decay(parameters, gradient);
}

Eigen::MatrixXd network_loss::jacobian(const Eigen::VectorXd &parameters, Eigen::Index from,
                                       Eigen::Index n) const {
    const network_parts<const double> net(shape_, parameters.data());
    const auto x = x_.middleCols(from, n);
    Eigen::MatrixXd h = (net.weight1 * x.topRows(shape_.seen())).colwise() + net.bias1;
    activate(shape_.kind, h);
    Eigen::MatrixXd slope = Eigen::MatrixXd::Ones(h.rows(), h.cols());
    times_slope(shape_.kind, slope, h);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(n * shape_.outputs, shape_.count());
    for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index k = 0; k < shape_.outputs; ++k) {
            const Eigen::Index row = i * shape_.outputs + k;
            for (Eigen::Index u = 0; u < shape_.hidden; ++u) {
                const double back = net.weight2(k, u) * slope(u, i);
                for (Eigen::Index j = 0; j < shape_.seen(); ++j) {
                    rows(row, u + j * shape_.hidden) = back * x(j, i);
                }
                rows(row, shape_.bias1_at() + u) = back;
                rows(row, shape_.weight2_at() + k + u * shape_.outputs) = h(u, i);
            }
            rows(row, shape_.bias2_at() + k) = 1.0;
            for (Eigen::Index j = 0; shape_.linear && j < shape_.inputs; ++j) {
                rows(row, shape_.linear_at() + k + j * shape_.outputs) = x(j, i);
            }
        }
    }
    return rows;
}

// The decay of each parameter; biases have none.
Eigen::VectorXd network_loss::decay_of_each() const {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(shape_.count());
    network_parts<double> net(shape_, all.data());
    net.weight1.setConstant(decay_.hidden);
    net.weight2.setConstant(decay_.output);
    if (shape_.linear) net.linear.colwise() = decay_.linear;
    return all;
}

Eigen::Index network_loss::residual_count() const {
    return shape_.outputs * samples() + shape_.count();
}

void network_loss::residuals(const double *parameters, double *values, double *jacobian) const {
    const Eigen::Index misfits = shape_.outputs * samples(), count = shape_.count();
    const Eigen::Map<const Eigen::VectorXd> p(parameters, count);
    const Eigen::VectorXd root = decay_of_each().cwiseSqrt();
    const double share = 1.0 / std::sqrt(static_cast<double>(samples()));
    Eigen::Map<Eigen::MatrixXd>(values, shape_.outputs, samples()) =
        share * (predict(shape_, p, x_) - t_);
    Eigen::Map<Eigen::VectorXd>(values + misfits, count) = root.cwiseProduct(p);
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> rows(
        jacobian, misfits + count, count);
    for (Eigen::Index from = 0; from < samples(); from += block) {
        const Eigen::Index n = std::min(block, samples() - from);
        rows.middleRows(shape_.outputs * from, shape_.outputs * n) =
            share * this->jacobian(p, from, n);
    }
    rows.bottomRows(count) = root.asDiagonal();
}

Eigen::VectorXd random_start(const network_shape &shape, std::uint64_t seed) {
    std::mt19937_64 engine(seed);
    // An own distribution, because those of the standard libraries differ.
    const auto uniform = [&] {
        return static_cast<double>(engine() >> 11) * 0x1p-52 - 1.0;  // -1 … 1
    };
    Eigen::VectorXd p = Eigen::VectorXd::Zero(shape.count());
    network_parts<double> net(shape, p.data());
    const double spread = std::sqrt(3.0 / static_cast<double>(shape.seen()));
    for (Eigen::Index i = 0; i < net.weight1.size(); ++i)
        net.weight1.data()[i] = spread * uniform();
    for (Eigen::Index i = 0; i < net.bias1.size(); ++i) net.bias1[i] = uniform();
    if (shape.linear) return p;
    const double small = std::sqrt(6.0 / static_cast<double>(shape.hidden + shape.outputs));
    for (Eigen::Index i = 0; i < net.weight2.size(); ++i) net.weight2.data()[i] = small * uniform();
    return p;
}

}  // namespace compbox::regression
