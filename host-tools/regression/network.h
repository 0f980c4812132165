// SPDX-License-Identifier: MIT
// One hidden layer with an optional linear path, as in models/bpnet.h, with the derivatives for
// training. In scaled inputs and outputs, double precision.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <type_traits>

namespace compbox::regression {

enum class activation { tansig, logsig };

struct network_shape {
    Eigen::Index inputs = 0, hidden = 0, outputs = 0;
    bool linear = true;  // y = W2 f(W1 x + b1) + b2 + L x
    activation kind = activation::tansig;
    Eigen::Index unseen = 0;  // number of inputs at the end that only the linear path uses

    Eigen::Index seen() const { return inputs - unseen; }

    // Parameters in one vector: W1 (column by column), b1, W2, b2, L.
    Eigen::Index count() const { return linear_at() + (linear ? outputs * inputs : 0); }
    Eigen::Index bias1_at() const { return hidden * seen(); }
    Eigen::Index weight2_at() const { return bias1_at() + hidden; }
    Eigen::Index bias2_at() const { return weight2_at() + outputs * hidden; }
    Eigen::Index linear_at() const { return bias2_at() + outputs; }
};

// The parts of a parameter vector, without copying.
template <typename number>
struct network_parts {
    template <typename kind>
    using map = Eigen::Map<std::conditional_t<std::is_const_v<number>, const kind, kind>>;
    using matrix = map<Eigen::MatrixXd>;
    using column = map<Eigen::VectorXd>;
    network_parts(const network_shape &shape, number *p)
        : weight1(p, shape.hidden, shape.seen()),
          bias1(p + shape.bias1_at(), shape.hidden),
          weight2(p + shape.weight2_at(), shape.outputs, shape.hidden),
          bias2(p + shape.bias2_at(), shape.outputs),
          linear(p + shape.linear_at(), shape.linear ? shape.outputs : 0,
                 shape.linear ? shape.inputs : 0) {}
    matrix weight1;
    column bias1;
    matrix weight2;
    column bias2;
    matrix linear;
};

// in : x, one sample per column
// out: y, one sample per column
Eigen::MatrixXd predict(const network_shape &shape, const Eigen::VectorXd &parameters,
                        const Eigen::MatrixXd &x);

// Weight decay of each kind of weight; biases have none.
struct weight_decay {
    double hidden = 0.0, output = 0.0;  // of all of W1, of all of W2
    Eigen::VectorXd linear;             // of each output's row of L
};

// L = 1/(2N) sum |y - t|^2 + 1/2 sum decay * weight^2 with its analytic gradient. Keeps its scratch
// memory between calls: use one object per thread.
class network_loss {
  public:
    // x, t: one sample per column; both must outlive this object
    network_loss(const network_shape &shape, const Eigen::MatrixXd &x, const Eigen::MatrixXd &t,
                 const weight_decay &decay);

    // gradient may be null; count() numbers otherwise. Returns L.
    double operator()(const double *parameters, double *gradient);

    // d y / d parameters of samples from … from + n - 1: row k + outputs * i is output k of sample
    // from + i.
    Eigen::MatrixXd jacobian(const Eigen::VectorXd &parameters, Eigen::Index from,
                             Eigen::Index n) const;

    // L as half a sum of squares, for Levenberg-Marquardt: (y - t)/sqrt(N), then the weights times
    // the roots of their decays. The Jacobian is row-major; it may be null.
    Eigen::Index residual_count() const;
    void residuals(const double *parameters, double *values, double *jacobian) const;

    const network_shape &shape() const { return shape_; }
    Eigen::Index samples() const { return x_.cols(); }
    const weight_decay &decay() const { return decay_; }
    void set_decay(const weight_decay &decay) { decay_ = decay; }

  private:
    double add_decay(const double *parameters, double *gradient) const;
    Eigen::VectorXd decay_of_each() const;

    network_shape shape_;
    const Eigen::MatrixXd &x_, &t_;
    weight_decay decay_;
    Eigen::MatrixXd hidden_, error_, back_;
};

// A start: hidden weights uniform, so that each unit's argument has a spread of about 1; output
// weights after Glorot and Bengio, or zero beside a linear path, so that training starts from the
// linear map. The linear path and the output bias are zero. The same seed gives the same start on
// every machine.
Eigen::VectorXd random_start(const network_shape &shape, std::uint64_t seed);

}  // namespace compbox::regression
