// SPDX-License-Identifier: MIT
// The baselines: one polynomial, and the table of support points that every control has.
#include <algorithm>
#include <cmath>

#include "host-tools/algebra/solvers.h"
#include "host-tools/fitting/methods.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox::fitting {

namespace {

// Coefficients of the Chebyshev polynomials T_0 … T_degree in ascending powers, as columns.
Eigen::MatrixXd chebyshev_powers(int degree) {
    Eigen::MatrixXd powers = Eigen::MatrixXd::Zero(degree + 1, degree + 1);
    powers(0, 0) = 1.0;
    if (degree > 0) powers(1, 1) = 1.0;
    for (int k = 2; k <= degree; ++k) {
        powers.col(k).tail(degree) = 2.0 * powers.col(k - 1).head(degree);
        powers.col(k) -= powers.col(k - 2);
    }
    return powers;
}

// Weighted least squares in the Chebyshev basis, by QR, converted to powers of u.
Eigen::VectorXd solve_powers(const measurement &data, const power_polynomial &frame, int degree) {
    const auto n = static_cast<Eigen::Index>(data.position.size());
    Eigen::MatrixXd design(n, degree + 1);
    Eigen::VectorXd right(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const auto at = static_cast<std::size_t>(i);
        const double u = (data.position[at] - frame.centre) / frame.half_range;
        const double weight = 1.0 / std::sqrt(data.variance[at]);
        for (int k = 0; k <= degree; ++k) {
            design(i, k) = k == 0   ? 1.0
                           : k == 1 ? u
                                    : 2.0 * u * design(i, k - 1) - design(i, k - 2);
        }
        design.row(i) *= weight;
        right[i] = weight * data.mean[at];
    }
    return chebyshev_powers(degree) * algebra::solve_least_squares(design, right).x;
}

// Bound of the loss by rounding the coefficients to float32 and evaluating in float32: each product
// and sum of Horner's scheme rounds once.
double float_loss(const power_polynomial &curve) {
    double size = 0.0;
    for (const double a : curve.coefficients) size += std::abs(a);
    return size * 2.0 * static_cast<double>(curve.coefficients.size()) * 6.0e-8;
}

}  // namespace

void fit_polynomial(fit_result &result) {
    const measurement &data = result.data;
    const int degree = result.options.degree;
    require_points(result, static_cast<std::size_t>(degree) + 1);
    power_polynomial &curve = result.curve.polynomial;
    curve.from = to_float(data.from());
    curve.to = to_float(data.to());
    curve.centre = to_float(data.centre());
    curve.half_range = to_float(0.5 * (data.to() - data.from()));
    const Eigen::VectorXd powers = solve_powers(data, curve, degree);
    for (const double a : powers) curve.coefficients.push_back(to_float(a));
    const double loss = float_loss(curve);
    const auto [low, high] = std::minmax_element(data.mean.begin(), data.mean.end());
    if (loss > 1e-3 * std::max(*high - *low, 1.0)) {
        result.warnings.push_back(fmt::format(
            "degree {} has coefficients so large that the box's arithmetic may be off by {} um",
            degree, std::round(loss * 1000.0) / 1000.0));
    }
}

void fit_polyline(fit_result &result) {
    const measurement &data = result.data;
    require_points(result, 2);
    require_room(result, data.position.size());
    spline &curve = result.curve.bspline;
    curve.degree = 1;
    for (std::size_t i = 0; i < data.position.size(); ++i) {
        const double x = to_float(data.position[i]);
        if (i > 0 && !(x > curve.knots.back())) {
            throw input_error(
                data.file, 0, 0,
                "positions near {} mm are too close together for the box to distinguish", x);
        }
        if (i == 0) curve.knots.push_back(x);
        curve.knots.push_back(x);
        curve.control_points.push_back(to_float(data.mean[i]));
    }
    curve.knots.push_back(curve.knots.back());
}

}  // namespace compbox::fitting
