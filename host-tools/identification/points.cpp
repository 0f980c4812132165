// SPDX-License-Identifier: MIT
#include "host-tools/identification/points.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

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

// in : one point or more, mm
// out: distance of the farthest from the line through the two farthest from each other; 0 if all
//      are one place
double height_of(const std::vector<Eigen::Vector3d> &at) {
    double longest2 = 0.0;
    Eigen::Vector3d from = at.front(), way = Eigen::Vector3d::Zero();
    for (const auto &a : at) {
        for (const auto &b : at) {
            if ((b - a).squaredNorm() <= longest2) continue;
            longest2 = (b - a).squaredNorm();
            from = a;
            way = b - a;
        }
    }
    double height = 0.0;
    for (const auto &point : at) {
        if (longest2 > 0.0) height = std::max(height, way.cross(point - from).norm() / way.norm());
    }
    return height;
}

std::vector<Eigen::Vector3d> vectors_of(const points_mm &points) {
    std::vector<Eigen::Vector3d> at;
    for (const auto &point : points) at.push_back(vector_of(point));
    return at;
}

// out: "on one line" or "within 0.4 mm of one line"
std::string where(double height) {
    return height < 1e-6 ? "on one line" : fmt::format("within {:.3g} mm of one line", height);
}

}  // namespace

line_sigma sigma_of_lines(double along_um, double across_um, int axis, std::size_t points) {
    line_sigma sigma(3 * static_cast<Eigen::Index>(points));
    for (Eigen::Index line = 0; line < sigma.size(); ++line) {
        sigma(line) = line % 3 == axis ? along_um : across_um;
    }
    return sigma;
}

double height_mm(const points_mm &points) {
    return height_of(vectors_of(points));
}

double height_seen_along_mm(const points_mm &points, int axis) {
    auto at = vectors_of(points);
    for (auto &point : at) point(axis) = 0.0;
    return height_of(at);
}

std::string obstacle(const points_mm &points, const line_model &model) {
    const double height = height_mm(points);
    if (height < least_height_mm) {
        return fmt::format(
            "the {} points lie {}, so a rotation about it cannot be measured: move one of them off "
            "the line, by {:g} mm or more",
            points.size(), where(height), least_height_mm);
    }
    const double seen = height_seen_along_mm(points, model.axis);
    if (model.lines == setups::separate && seen < least_height_mm) {
        return fmt::format(
            "seen along {0}, the {1} points lie {2}, so the lines along {0} cannot show pitch and "
            "yaw, whose slopes come from these lines alone: move one of them across {0}, off that "
            "line by {3:g} mm or more",
            "XYZ"[model.axis], points.size(), where(seen), least_height_mm);
    }
    return "";
}

six closed_form_sigma(const points_mm &points, const line_sigma &sigma_um) {
    // Blocks of A^T W A; W of each point is a diagonal, and d = delta + 1e-3 eps x P.
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();
    Eigen::Matrix3d mixed = Eigen::Matrix3d::Zero(), turns = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Eigen::Vector3d w =
            sigma_um.segment<3>(3 * static_cast<Eigen::Index>(i)).array().square().inverse();
        const Eigen::Matrix3d turn = -cross_matrix(vector_of(points[i]));
        weights += w;
        mixed += w.asDiagonal() * turn;
        turns += turn.transpose() * w.asDiagonal() * turn;
    }
    const Eigen::Matrix3d per_weight = weights.cwiseInverse().asDiagonal();
    const Eigen::Matrix3d K = (turns - mixed.transpose() * per_weight * mixed).inverse();
    const Eigen::Matrix3d D = per_weight + per_weight * mixed * K * mixed.transpose() * per_weight;
    six sigma;
    for (int i = 0; i < 3; ++i) {
        sigma[static_cast<std::size_t>(i)] = std::sqrt(D(i, i));
        sigma[static_cast<std::size_t>(i) + 3] = urad_mm_per_um * std::sqrt(K(i, i));
    }
    return sigma;
}

Eigen::MatrixXd observation_matrix(const points_mm &points) {
    Eigen::MatrixXd A(3 * static_cast<Eigen::Index>(points.size()), 6);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto row = 3 * static_cast<Eigen::Index>(i);
        A.block<3, 3>(row, 0).setIdentity();
        A.block<3, 3>(row, 3) = -cross_matrix(vector_of(points[i])) / urad_mm_per_um;
    }
    return A;
}

std::array<int, 3> along_errors(int axis) {
    return {axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3};
}

Eigen::MatrixXd along_matrix(const points_mm &points, int axis) {
    const Eigen::MatrixXd A = observation_matrix(points);
    const auto known = along_errors(axis);
    Eigen::MatrixXd B(A.rows() / 3, 3);
    for (Eigen::Index point = 0; point < B.rows(); ++point) {
        for (int k = 0; k < 3; ++k) {
            B(point, k) = A(3 * point + axis, known[static_cast<std::size_t>(k)]);
        }
    }
    return B;
}

std::array<int, 6> traditional_rows_of(int axis) {
    std::array<int, 6> rows{};
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const int point = traditional_rows[i] / 3, direction = traditional_rows[i] % 3;
        rows[i] = 3 * point + (direction + axis) % 3;
    }
    return rows;
}

bool traditional_sigma(const points_mm &points, int axis, const line_sigma &sigma_um, six &sigma) {
    const auto A = observation_matrix(points);
    const auto rows = traditional_rows_of(axis);
    Eigen::Matrix<double, 6, 6> B;
    Eigen::Matrix<double, 6, 1> noise_um;
    for (int i = 0; i < 6; ++i) {
        B.row(i) = A.row(rows[static_cast<std::size_t>(i)]);
        noise_um(i) = sigma_um(rows[static_cast<std::size_t>(i)]);
    }
    // Scales the columns to one size, so that the rank test does not depend on µrad against µm.
    Eigen::Matrix<double, 6, 1> scale;
    for (int k = 0; k < 6; ++k) scale(k) = std::max(B.col(k).norm(), 1e-12);
    const algebra::least_squares solution = algebra::solve_least_squares(
        B * scale.cwiseInverse().asDiagonal(), Eigen::MatrixXd::Identity(6, 6), 1e-9);
    if (solution.rank < 6) return false;
    const Eigen::Matrix<double, 6, 6> inverse =
        scale.cwiseInverse().asDiagonal() * solution.x * noise_um.asDiagonal();
    for (int k = 0; k < 6; ++k) sigma[static_cast<std::size_t>(k)] = inverse.row(k).norm();
    return true;
}

six sigma_over_positions(const points_mm &points, const line_sigma &sigma_um, const six &one,
                         const line_model &model) {
    if (model.lines == setups::common) return one;
    const double n = model.positions;
    six all;
    for (std::size_t k = 0; k < 6; ++k) all[k] = one[k] * std::sqrt((n - 2.0) / n);
    Eigen::MatrixXd B = along_matrix(points, model.axis);
    for (Eigen::Index i = 0; i < B.rows(); ++i) B.row(i) /= sigma_um(3 * i + model.axis);
    const bool seen = height_seen_along_mm(points, model.axis) >= least_height_mm;
    const Eigen::Matrix3d slopes = (B.transpose() * B).inverse();  // times n: of one position
    const auto known = along_errors(model.axis);
    for (int k = 0; k < 3; ++k) {
        double &sigma = all[static_cast<std::size_t>(known[static_cast<std::size_t>(k)])];
        sigma = seen ? std::sqrt(sigma * sigma + slopes(k, k) / n)
                     : std::numeric_limits<double>::infinity();
    }
    return all;
}

}  // namespace compbox::identification
