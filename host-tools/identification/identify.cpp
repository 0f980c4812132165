// SPDX-License-Identifier: MIT
#include "host-tools/identification/identify.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host-tools/algebra/solvers.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/identification/noise.h"
#include "host-tools/identification/outliers.h"

namespace compbox::identification {

namespace {

using readings = nine_line_readings;
using solver = Eigen::MatrixXd;  // 6 x lines

// The readings minus the offset and slope of each line over t = position - mean position.
struct detrended {
    Eigen::VectorXd t;
    double tt = 0.0;           // sum of t^2
    Eigen::RowVectorXd slope;  // µm/mm
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

// in : rows: the rows of A in use; sigma of all lines, µm
// out: S with e = S d; the other columns are zero. By QR of the weighted rows, columns scaled to
//      one size.
solver solver_of(const points_mm &points, const std::vector<int> &rows, const line_sigma &sigma) {
    const auto A = observation_matrix(points);
    Eigen::MatrixXd used(static_cast<Eigen::Index>(rows.size()), 6);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        used.row(static_cast<Eigen::Index>(i)) = A.row(rows[i]) / sigma(rows[i]);
    }
    const Eigen::VectorXd scale = used.colwise().norm().cwiseInverse();
    const Eigen::MatrixXd scaled = used * scale.asDiagonal();
    const Eigen::MatrixXd pseudo =
        scale.asDiagonal() * algebra::solve_least_squares(
                                 scaled, Eigen::MatrixXd::Identity(scaled.rows(), scaled.rows()))
                                 .x;
    solver S = solver::Zero(6, A.rows());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        S.col(rows[i]) = pseudo.col(static_cast<Eigen::Index>(i)) / sigma(rows[i]);
    }
    return S;
}

std::vector<int> rows_of(const identify_options &options, Eigen::Index lines) {
    if (options.how == nine_line_method::traditional) {
        const auto rows = traditional_rows_of(options.axis);
        return {rows.begin(), rows.end()};
    }
    std::vector<int> all(static_cast<std::size_t>(lines));
    std::iota(all.begin(), all.end(), 0);
    return all;
}

// Slopes from the lines in the axis' own direction: of positioning and of the two rotations across
// the axis. Zero for the rest.
struct linear_parts {
    Eigen::Matrix<double, 6, 1> slope = Eigen::Matrix<double, 6, 1>::Zero();
    Eigen::Matrix<double, 6, 1> sigma = Eigen::Matrix<double, 6, 1>::Zero();  // times |t|/sqrt(tt)
};

// in : axis 0 … 2; slopes of the lines in µm/mm; sigma of the lines in µm
// out: slope and sigma of positioning, pitch and yaw per mm; a remark if the points are on one line
linear_parts identify_slopes(const detrended &lines, const points_mm &points, int axis,
                             const line_sigma &sigma_um, std::vector<std::string> &remarks) {
    const Eigen::MatrixXd B = along_matrix(points, axis);
    const auto known = along_errors(axis);
    Eigen::VectorXd slope(B.rows()), noise(B.rows());
    for (Eigen::Index point = 0; point < B.rows(); ++point) {
        slope(point) = lines.slope(3 * point + axis);
        noise(point) = sigma_um(3 * point + axis);
    }
    const Eigen::VectorXd weight = noise.cwiseInverse();  // root of the weight
    const Eigen::MatrixXd weighted = weight.asDiagonal() * B;
    const Eigen::Vector3d scale = weighted.colwise().norm().cwiseMax(1e-12).cwiseInverse();
    const algebra::least_squares solution = algebra::solve_least_squares(
        weighted * scale.asDiagonal(), Eigen::MatrixXd::Identity(B.rows(), B.rows()), 1e-6);
    linear_parts result;
    if (solution.rank < 3) {
        remarks.push_back(
            "seen along the axis the points lie on one line: the linear parts of pitch and yaw "
            "cannot be identified and are zero");
        const double weights = weight.squaredNorm();
        result.slope(axis) = weight.array().square().matrix().dot(slope) / weights;
        result.sigma(axis) = 1.0 / std::sqrt(weights);
        return result;
    }
    const Eigen::MatrixXd inverse = scale.asDiagonal() * solution.x;  // of the weighted slopes
    const Eigen::Vector3d solved = inverse * weight.cwiseProduct(slope);
    for (int k = 0; k < 3; ++k) {
        result.slope(known[static_cast<std::size_t>(k)]) = solved(k);
        result.sigma(known[static_cast<std::size_t>(k)]) = inverse.row(k).norm();
    }
    return result;
}

// Sigma by few runs is uncertain itself, and noise that is correlated along a line contradicts as
// if there were fewer positions. So only contradictions far beyond chance enlarge it.
constexpr double one_in_100000 = 4.26;

// Readings are weighted by 1/sigma, which exact ones, such as zeros, have too.
constexpr double least_noise = 1e-12;

// Improved method: residuals of d against A e give the noise, and the readings outside of it.
// in : data, S; curves.line_sigma_um: the table's, or 1 µm for each line if it has none (known
//      false)
// out: curves.noise_um, contradiction, outliers; line_sigma_um multiplied by the noise, or by the
//      contradiction where chance does not explain it
void judge_noise(six_curves &curves, const readings &data, const solver &S, const points_mm &points,
                 const identify_options &options, bool known) {
    const auto A = observation_matrix(points);
    const Eigen::VectorXd weight = curves.line_sigma_um.cwiseInverse();
    const Eigen::MatrixXd residual_maker =
        Eigen::MatrixXd::Identity(A.rows(), A.rows()) -
        weight.asDiagonal() * A * S * curves.line_sigma_um.asDiagonal();
    const readings whitened = data * weight.asDiagonal();
    const int positions = static_cast<int>(data.rows());
    curves.freedom = static_cast<int>(A.rows() - 6) *
                     (options.lines == setups::separate ? positions - 2 : positions);
    if (curves.freedom <= 0) return;
    const double squares = (whitened * residual_maker.transpose()).squaredNorm();
    const double ratio = std::sqrt(squares / curves.freedom);
    curves.noise_um =
        ratio * curves.line_sigma_um.norm() / std::sqrt(static_cast<double>(A.rows()));
    curves.outliers =
        find_outliers(whitened, curves.position_mm, residual_maker, options, curves.freedom);
    if (known) curves.contradiction = ratio;
    if (!known || squares > largest_chance(curves.freedom, one_in_100000)) {
        curves.line_sigma_um *= std::max(ratio, least_noise);
    }
}

// Throws input_error if the points do not determine the errors with the chosen method.
void check_points(const points_mm &points, const nine_lines &table, const identify_options &options,
                  const std::string &file) {
    if (3 * static_cast<Eigen::Index>(points.size()) != table.reading_um.cols()) {
        throw input_error(file, 0, 0, "has {} points, but {} has {} lines, three for each point",
                          points.size(), table.file, table.reading_um.cols());
    }
    // Lines that cannot show pitch and yaw were measured; what they do show is identified.
    const std::string fault = obstacle(points, {options.axis, setups::common, 0});
    if (!fault.empty()) throw input_error(file, 0, 0, "{}", fault);
    six sigma;
    if (options.how == nine_line_method::traditional &&
        !traditional_sigma(points, options.axis, line_sigma::Ones(table.reading_um.cols()),
                           sigma)) {
        throw input_error(
            file, 0, 0,
            "the traditional sequence cannot be solved at these points in this order: "
            "`compbox plan` orders them where it is possible");
    }
}

// Sigma of each position's errors from sigma of each line.
void state_sigma(six_curves &curves, const solver &S, const detrended &lines,
                 const linear_parts &linear, setups kind) {
    const Eigen::Index n = static_cast<Eigen::Index>(curves.position_mm.size());
    const Eigen::RowVectorXd one =
        (S * curves.line_sigma_um.asDiagonal()).rowwise().norm().transpose();
    curves.sigma = one.replicate(n, 1);
    if (kind == setups::common) return;
    for (Eigen::Index row = 0; row < n; ++row) {
        const double share = lines.t(row) * lines.t(row) / lines.tt;
        const double left = std::max(0.0, 1.0 - 1.0 / static_cast<double>(n) - share);
        curves.sigma.row(row) =
            (one.array().square() * left + linear.sigma.transpose().array().square() * share)
                .sqrt();
    }
}

constexpr const char *hidden_by_set_ups =
    "each line is a set-up of its own: constants, the slopes of both straightnesses (squareness) "
    "and the linear part of roll are not identified and are zero";

// in : known: the table has sigmas; enlarged: contradictions multiplied them
// out: curves.remarks with what a person can do about the sigma
void remark_on_noise(six_curves &curves, bool known, bool enlarged) {
    if (!known) {
        curves.remarks.push_back(
            "sigma of the lines is unknown, so all of them count alike: join files of several runs "
            "by `assemble`, or give --sigma-um ALONG,ACROSS");
    } else if (enlarged) {
        curves.remarks.push_back(fmt::format(
            "the lines contradict each other {:.2f} times as much as their sigma explains, so "
            "every sigma is multiplied by it: look at the outliers, the places of the reflectors "
            "and drift between the set-ups",
            curves.contradiction));
    } else if (curves.freedom > 0 && curves.contradiction < 0.5 && curves.freedom > 8) {
        curves.remarks.push_back(
            fmt::format("the lines contradict each other only {:.2f} times as much as their sigma "
                        "explains: sigma is that of a value of the table, which is the mean of its "
                        "runs; is it too large?",
                        curves.contradiction));
    }
}

}  // namespace

std::array<std::string, 6> error_names(int axis) {
    const char name = "XYZ"[axis];
    std::array<std::string, 6> names;
    for (std::size_t k = 0; k < 6; ++k) names[k] = fmt::format("E{}{}", "XYZABC"[k], name);
    return names;
}

six_curves identify(const nine_lines &table, const points_mm &points,
                    const identify_options &options, const std::string &file) {
    check_points(points, table, options, file);
    const bool improved = options.how == nine_line_method::improved;
    if (!improved && points.size() > 3) {  // its sequence takes readings at the first three only
        nine_lines first = table;
        first.reading_um.conservativeResize(Eigen::NoChange, 9);
        if (first.sigma_um.size() > 0) first.sigma_um.conservativeResize(9);
        if (first.slope_factor.size() > 0) first.slope_factor.conservativeResize(9);
        return identify(first, {points.begin(), points.begin() + 3}, options, file);
    }
    const Eigen::Index n = table.reading_um.rows(), columns = table.reading_um.cols();
    const bool known = table.sigma_um.size() > 0, separate = options.lines == setups::separate;
    if (separate && n < 3) {
        throw input_error(table.file, 0, 0,
                          "each line has its own slope, so at least 3 positions are needed");
    }
    six_curves curves;
    curves.position_mm = table.position_mm;
    curves.line_sigma_um = known ? table.sigma_um : line_sigma::Ones(columns);
    const solver S = solver_of(points, rows_of(options, columns), curves.line_sigma_um);
    detrended lines;
    if (separate) lines = detrend(table);
    const readings &data = separate ? lines.rest : table.reading_um;
    curves.value = data * S.transpose();
    if (improved) judge_noise(curves, data, S, points, options, known);
    linear_parts linear;
    if (separate) {
        line_sigma of_slopes = curves.line_sigma_um;
        if (table.slope_factor.size() > 0) of_slopes.array() *= table.slope_factor.array();
        linear = identify_slopes(lines, points, options.axis, of_slopes, curves.remarks);
        curves.value += lines.t * linear.slope.transpose();
        curves.remarks.push_back(hidden_by_set_ups);
    }
    state_sigma(curves, S, lines, linear, options.lines);
    if (improved) {
        const bool enlarged = known && curves.line_sigma_um(0) > table.sigma_um(0);
        remark_on_noise(curves, known, enlarged);
    }
    return curves;
}

}  // namespace compbox::identification
