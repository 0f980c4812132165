// SPDX-License-Identifier: MIT
#include "host-tools/identification/identify.h"

#include <algorithm>
#include <cmath>

#include "host-tools/algebra/solvers.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/identification/outliers.h"

namespace compbox::identification {

namespace {

using readings = nine_line_readings;
using solver = Eigen::Matrix<double, 6, 9>;

// The readings minus the offset and slope of each line over t = position - mean position.
struct detrended {
    Eigen::VectorXd t;
    double tt = 0.0;                    // sum of t^2
    Eigen::Matrix<double, 1, 9> slope;  // µm/mm
    readings rest;
};

detrended detrend(const nine_lines &table) {
    const Eigen::Index n = static_cast<Eigen::Index>(table.position_mm.size());
    detrended result;
    result.t = Eigen::Map<const Eigen::VectorXd>(table.position_mm.data(), n);
    result.t.array() -= result.t.mean();
    result.tt = result.t.squaredNorm();
    const readings centred = table.reading_um.rowwise() - table.reading_um.colwise().mean();
    result.slope = result.t.transpose() * centred / result.tt;
    result.rest = centred - result.t * result.slope;
    return result;
}

// in : rows: the rows of A in use
// out: S with e = S d; the other columns are zero. By QR, columns scaled to one size.
solver solver_of(const triple_mm &points, const std::vector<int> &rows) {
    const auto A = observation_matrix(points);
    Eigen::MatrixXd used(static_cast<Eigen::Index>(rows.size()), 6);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        used.row(static_cast<Eigen::Index>(i)) = A.row(rows[i]);
    }
    Eigen::VectorXd scale(6);
    for (int k = 0; k < 6; ++k) scale(k) = 1.0 / used.col(k).norm();
    const Eigen::MatrixXd scaled = used * scale.asDiagonal();
    const Eigen::MatrixXd pseudo =
        scale.asDiagonal() * algebra::solve_least_squares(
                                 scaled, Eigen::MatrixXd::Identity(scaled.rows(), scaled.rows()))
                                 .x;
    solver S = solver::Zero();
    for (std::size_t i = 0; i < rows.size(); ++i) {
        S.col(rows[i]) = pseudo.col(static_cast<Eigen::Index>(i));
    }
    return S;
}

std::vector<int> rows_of(const identify_options &options) {
    if (options.how == nine_line_method::improved) return {0, 1, 2, 3, 4, 5, 6, 7, 8};
    const auto rows = traditional_rows_of(options.axis);
    return {rows.begin(), rows.end()};
}

// Slopes from the three lines in the axis' own direction: of positioning and of the two rotations
// across the axis. Zero for the rest.
struct linear_parts {
    Eigen::Matrix<double, 6, 1> slope = Eigen::Matrix<double, 6, 1>::Zero();
    Eigen::Matrix<double, 6, 1> sigma =
        Eigen::Matrix<double, 6, 1>::Zero();  // for 1 µm, times |t|/sqrt(tt)
};

// in : axis 0 … 2; slopes of the lines in µm/mm
// out: slope and sigma of positioning, pitch and yaw per mm; a remark if the points are on one line
linear_parts identify_slopes(const detrended &lines, const triple_mm &points, int axis,
                             std::vector<std::string> &remarks) {
    const auto A = observation_matrix(points);
    const int known[3] = {axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3};
    Eigen::Matrix3d B;
    Eigen::Vector3d slope;
    for (int point = 0; point < 3; ++point) {
        for (int k = 0; k < 3; ++k) B(point, k) = A(3 * point + axis, known[k]);
        slope(point) = lines.slope(3 * point + axis);
    }
    linear_parts result;
    Eigen::Vector3d scale;
    for (int k = 0; k < 3; ++k) scale(k) = 1.0 / std::max(B.col(k).norm(), 1e-12);
    const algebra::least_squares solution =
        algebra::solve_least_squares(B * scale.asDiagonal(), Eigen::MatrixXd::Identity(3, 3), 1e-6);
    if (solution.rank < 3) {
        remarks.push_back(
            "seen along the axis the three points lie on one line: the linear parts "
            "of pitch and yaw cannot be identified and are zero");
        result.slope(axis) = slope.mean();
        result.sigma(axis) = 1.0 / std::sqrt(3.0);
        return result;
    }
    const Eigen::Matrix3d inverse = scale.asDiagonal() * solution.x;
    const Eigen::Vector3d solved = inverse * slope;
    for (int k = 0; k < 3; ++k) {
        result.slope(known[k]) = solved(k);
        result.sigma(known[k]) = inverse.row(k).norm();
    }
    return result;
}

// Improved method: residuals of d against A e give the noise, and the readings outside of it.
void judge_noise(six_curves &curves, const readings &data, const solver &S, const triple_mm &points,
                 const identify_options &options) {
    const auto A = observation_matrix(points);
    const Eigen::Matrix<double, 9, 9> residual_maker =
        Eigen::Matrix<double, 9, 9>::Identity() - A * S;
    const readings residual = data * residual_maker.transpose();
    const int positions = static_cast<int>(data.rows());
    curves.freedom = 3 * (options.lines == setups::separate ? positions - 2 : positions);
    if (curves.freedom <= 0) return;
    curves.noise_um = std::sqrt(residual.squaredNorm() / curves.freedom);
    curves.outliers =
        find_outliers(data, curves.position_mm, residual_maker, options, curves.freedom);
}

// A reflector is placed to about 0.1 mm, so a triangle lower than ten times that gives no
// information.
constexpr double least_height_mm = 1.0;

// Throws input_error if the points do not determine the errors with the chosen method.
void check_points(const triple_mm &points, const identify_options &options,
                  const std::string &file) {
    if (!spans_triangle(points)) {
        throw input_error(
            file, 0, 0,
            "the three points lie on one line, so a rotation about it cannot be measured: "
            "move one of them off the line");
    }
    const double height_mm = triangle_height_mm(points);
    if (height_mm < least_height_mm) {
        throw input_error(file, 0, 0,
                          "the three points lie within {} mm of one line, so a rotation about it "
                          "is smaller than the placing error of a reflector: move one of them well "
                          "off the line ({} mm is the minimum)",
                          height_mm, least_height_mm);
    }
    six sigma;
    if (options.how == nine_line_method::traditional &&
        !traditional_sigma(points, options.axis, sigma)) {
        throw input_error(
            file, 0, 0,
            "the traditional sequence cannot be solved at these points in this order: "
            "`compbox plan` orders them where it is possible");
    }
}

}  // namespace

std::array<std::string, 6> error_names(int axis) {
    const char name = "XYZ"[axis];
    std::array<std::string, 6> names;
    for (std::size_t k = 0; k < 6; ++k) names[k] = fmt::format("E{}{}", "XYZABC"[k], name);
    return names;
}

six_curves identify(const nine_lines &table, const triple_mm &points,
                    const identify_options &options, const std::string &file) {
    check_points(points, options, file);
    const solver S = solver_of(points, rows_of(options));
    six_curves curves;
    curves.position_mm = table.position_mm;
    const Eigen::Index n = table.reading_um.rows();
    curves.sigma.resize(n, 6);
    const Eigen::Matrix<double, 1, 6> one = S.rowwise().norm().transpose();
    if (options.lines == setups::common) {
        curves.value = table.reading_um * S.transpose();
        curves.sigma = one.replicate(n, 1);
        if (options.how == nine_line_method::improved)
            judge_noise(curves, table.reading_um, S, points, options);
    } else {
        if (n < 3) {
            throw input_error(table.file, 0, 0,
                              "each line has its own slope, so at least 3 positions are needed");
        }
        const detrended lines = detrend(table);
        const linear_parts linear = identify_slopes(lines, points, options.axis, curves.remarks);
        curves.value = lines.rest * S.transpose() + lines.t * linear.slope.transpose();
        for (Eigen::Index row = 0; row < n; ++row) {
            const double share = lines.t(row) * lines.t(row) / lines.tt;
            const double left = std::max(0.0, 1.0 - 1.0 / static_cast<double>(n) - share);
            curves.sigma.row(row) =
                (one.array().square() * left + linear.sigma.transpose().array().square() * share)
                    .sqrt();
        }
        if (options.how == nine_line_method::improved)
            judge_noise(curves, lines.rest, S, points, options);
        curves.remarks.push_back(
            "each line is a set-up of its own: constants, the slopes of both "
            "straightnesses (squareness) and the linear part of roll are not "
            "identified and are zero");
    }
    if (curves.freedom > 0) curves.sigma *= curves.noise_um;
    return curves;
}

}  // namespace compbox::identification
