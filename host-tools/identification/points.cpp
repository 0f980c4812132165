// SPDX-License-Identifier: MIT
#include "host-tools/identification/points.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "host-tools/algebra/solvers.h"

namespace compbox::identification {

namespace {

constexpr double urad_mm_per_um = 1e3;  // µm at 1 mm are 1000 µrad

Eigen::Vector3d vector_of(const point_mm &point) {
    return {point[0], point[1], point[2]};
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d &v) {
    Eigen::Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

}  // namespace

bool spans_triangle(const triple_mm &points) {
    const Eigen::Vector3d a = vector_of(points[1]) - vector_of(points[0]);
    const Eigen::Vector3d b = vector_of(points[2]) - vector_of(points[0]);
    const double longest2 = std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()});
    return a.cross(b).norm() > 1e-6 * longest2;
}

double triangle_height_mm(const triple_mm &points) {
    const Eigen::Vector3d a = vector_of(points[1]) - vector_of(points[0]);
    const Eigen::Vector3d b = vector_of(points[2]) - vector_of(points[0]);
    const double longest = std::max({a.norm(), b.norm(), (b - a).norm()});
    return longest > 0.0 ? a.cross(b).norm() / longest : 0.0;
}

six closed_form_sigma(const triple_mm &points) {
    Eigen::Vector3d c = Eigen::Vector3d::Zero();
    for (const auto &point : points) c += vector_of(point) / 3.0;
    Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
    for (const auto &point : points) {
        const Eigen::Vector3d q = vector_of(point) - c;
        J += q.squaredNorm() * Eigen::Matrix3d::Identity() - q * q.transpose();
    }
    const Eigen::Matrix3d K = J.inverse();
    const Eigen::Matrix3d C = cross_matrix(c);
    const Eigen::Matrix3d D = Eigen::Matrix3d::Identity() / 3.0 + C * K * C.transpose();
    six sigma;
    for (int i = 0; i < 3; ++i) {
        sigma[static_cast<std::size_t>(i)] = std::sqrt(D(i, i));
        sigma[static_cast<std::size_t>(i) + 3] = urad_mm_per_um * std::sqrt(K(i, i));
    }
    return sigma;
}

Eigen::Matrix<double, 9, 6> observation_matrix(const triple_mm &points) {
    Eigen::Matrix<double, 9, 6> A;
    for (int i = 0; i < 3; ++i) {
        A.block<3, 3>(3 * i, 0).setIdentity();
        A.block<3, 3>(3 * i, 3) =
            -cross_matrix(vector_of(points[static_cast<std::size_t>(i)])) / urad_mm_per_um;
    }
    return A;
}

std::array<int, 6> traditional_rows_of(int axis) {
    std::array<int, 6> rows{};
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const int point = traditional_rows[i] / 3, direction = traditional_rows[i] % 3;
        rows[i] = 3 * point + (direction + axis) % 3;
    }
    return rows;
}

bool traditional_sigma(const triple_mm &points, int axis, six &sigma) {
    const auto A = observation_matrix(points);
    const auto rows = traditional_rows_of(axis);
    Eigen::Matrix<double, 6, 6> B;
    for (int i = 0; i < 6; ++i) B.row(i) = A.row(rows[static_cast<std::size_t>(i)]);
    // Scales the columns to one size, so that the rank test does not depend on µrad against µm.
    Eigen::Matrix<double, 6, 1> scale;
    for (int k = 0; k < 6; ++k) scale(k) = std::max(B.col(k).norm(), 1e-12);
    const algebra::least_squares solution = algebra::solve_least_squares(
        B * scale.cwiseInverse().asDiagonal(), Eigen::MatrixXd::Identity(6, 6), 1e-9);
    if (solution.rank < 6) return false;
    const Eigen::Matrix<double, 6, 6> inverse = scale.cwiseInverse().asDiagonal() * solution.x;
    for (int k = 0; k < 6; ++k) sigma[static_cast<std::size_t>(k)] = inverse.row(k).norm();
    return true;
}

}  // namespace compbox::identification
