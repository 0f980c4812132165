// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/diagonals.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host-tools/algebra/solvers.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox::coefficients {

namespace {

using point_mm = std::array<double, 3>;

constexpr double most_beside_mm = 1.0;
constexpr double um_per_mm_per_ppm = 1e-3;
// A combination of causes with less than this share of their squares is invisible: 1 % of a length.
constexpr double least_share = 1e-4;
// A cause with less than this share of such a combination has no part in it.
constexpr double least_part = 1e-3;

double product(const point_mm &a, const point_mm &b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

point_mm way(const point_mm &from, const point_mm &to) {
    return {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
}

// Rows of the table that belong to one diagonal, in the order of the file.
struct diagonal {
    std::string name;
    std::vector<std::size_t> rows;
};

// Sets along of the diagonal's targets. Throws input_error where they are on no line.
void direct(const diagonal &one, const formats::csv_table &table,
            std::vector<diagonal_target> &targets) {
    const point_mm first = targets[one.rows.front()].position_mm;
    point_mm longest = {};
    for (const std::size_t r : one.rows) {
        const point_mm to = way(first, targets[r].position_mm);
        if (product(to, to) > product(longest, longest)) longest = to;
    }
    const double length = std::sqrt(product(longest, longest));
    if (!(length > most_beside_mm)) {
        throw input_error(table.file, table.lines[one.rows.front()], 0,
                          "the diagonal '{}' needs two targets or more", one.name);
    }
    for (double &part : longest) part /= length;
    for (const std::size_t r : one.rows) {
        const point_mm to = way(first, targets[r].position_mm);
        const double forth = product(to, longest);
        const double beside = std::sqrt(std::max(0.0, product(to, to) - forth * forth));
        if (beside > most_beside_mm || forth < -most_beside_mm) {
            throw input_error(table.file, table.lines[r], 0,
                              "this target is not on the line from the first to the last target of "
                              "the diagonal '{}'",
                              one.name);
        }
        targets[r].along = longest;
    }
}

// Columns without the mean of each set-up: the zeros of the set-ups have no effect on them.
Eigen::MatrixXd without_zeros(const std::vector<diagonal_target> &targets, Eigen::MatrixXd columns,
                              std::size_t set_ups) {
    const auto count = static_cast<Eigen::Index>(set_ups);
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(count, columns.cols());
    Eigen::VectorXd readings = Eigen::VectorXd::Zero(count);
    for (std::size_t r = 0; r < targets.size(); ++r) {
        const auto s = static_cast<Eigen::Index>(targets[r].set_up);
        mean.row(s) += columns.row(static_cast<Eigen::Index>(r));
        readings[s] += 1.0;
    }
    for (std::size_t r = 0; r < targets.size(); ++r) {
        const auto s = static_cast<Eigen::Index>(targets[r].set_up);
        columns.row(static_cast<Eigen::Index>(r)) -= mean.row(s) / readings[s];
    }
    return columns;
}

// out: the columns that have a part in a combination which the readings do not show
std::vector<bool> in_the_dark(const Eigen::MatrixXd &columns) {
    const Eigen::VectorXd length = columns.colwise().norm();
    const Eigen::VectorXd inverse =
        (length.array() > 1e-9 * length.maxCoeff()).select(length.cwiseInverse(), 0.0);
    const Eigen::MatrixXd unit = columns * inverse.asDiagonal();
    const algebra::symmetric_eigen eigen = algebra::eigen_of_symmetric(unit.transpose() * unit);
    std::vector<bool> dark(static_cast<std::size_t>(columns.cols()), false);
    for (Eigen::Index v = 0; v < columns.cols(); ++v) {
        if (eigen.values[v] > least_share) continue;
        for (Eigen::Index k = 0; k < columns.cols(); ++k) {
            const double part = eigen.vectors(k, v);
            if (part * part > least_part) dark[static_cast<std::size_t>(k)] = true;
        }
    }
    return dark;
}

Eigen::MatrixXd chosen_of(const Eigen::MatrixXd &columns, const std::vector<Eigen::Index> &chosen) {
    Eigen::MatrixXd made(columns.rows(), static_cast<Eigen::Index>(chosen.size()));
    for (std::size_t k = 0; k < chosen.size(); ++k) {
        made.col(static_cast<Eigen::Index>(k)) = columns.col(chosen[k]);
    }
    return made;
}

// out: the columns that the readings tell from each other; the last one is the scale. Rolls leave
// first, then squarenesses.
std::vector<Eigen::Index> told_apart(const Eigen::MatrixXd &columns,
                                     const std::vector<diagonal_cause> &causes) {
    std::vector<Eigen::Index> chosen(static_cast<std::size_t>(columns.cols()));
    std::iota(chosen.begin(), chosen.end(), 0);
    for (const auto leaving : {diagonal_cause::roll, diagonal_cause::squareness}) {
        const std::vector<bool> dark = in_the_dark(chosen_of(columns, chosen));
        std::vector<Eigen::Index> rest;
        for (std::size_t k = 0; k < chosen.size(); ++k) {
            const auto cause = static_cast<std::size_t>(chosen[k]);
            const bool leaves = dark[k] && cause < causes.size() && causes[cause].is == leaving;
            if (!leaves) rest.push_back(chosen[k]);
        }
        chosen = rest;
    }
    return chosen;
}

}  // namespace

std::vector<diagonal_target> read_diagonals(const std::string &path,
                                            std::optional<double> tool_mm) {
    std::vector<std::vector<std::string>> words;
    const formats::csv_table table = formats::read_csv(path, {"diagonal", "run"}, &words);
    const std::size_t name = table.column("diagonal"), error = table.column("error_um");
    const std::size_t axes[3] = {table.column("X_mm"), table.column("Y_mm"), table.column("Z_mm")};
    const int run = table.find("run"), tool = table.find("tool_mm");
    if (tool < 0 && !tool_mm) {
        throw input_error(path, table.header_line, 0,
                          "needs a column tool_mm, because the tool length is a signal");
    }
    std::vector<diagonal_target> targets;
    std::vector<diagonal> diagonals;
    std::map<std::pair<double, double>, std::size_t> set_ups;
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
        const std::vector<double> &row = table.rows[r];
        const double run_is = run < 0 ? 0.0 : row[static_cast<std::size_t>(run)];
        diagonal_target one = {};
        one.set_up = set_ups.insert({{row[name], run_is}, set_ups.size()}).first->second;
        for (std::size_t a = 0; a < 3; ++a) one.position_mm[a] = row[axes[a]];
        one.tool_mm = tool < 0 ? *tool_mm : row[static_cast<std::size_t>(tool)];
        one.error_um = row[error];
        targets.push_back(one);
        const auto index = static_cast<std::size_t>(row[name]);
        if (index == diagonals.size()) diagonals.push_back({words[0][index], {}});
        diagonals[index].rows.push_back(r);
    }
    for (const diagonal &one : diagonals) direct(one, table, targets);
    return targets;
}

diagonal_adjustment adjust_diagonals(const std::vector<diagonal_target> &targets,
                                     const std::vector<diagonal_cause> &causes) {
    const auto rows = static_cast<Eigen::Index>(targets.size());
    const auto scale = static_cast<Eigen::Index>(causes.size());
    Eigen::MatrixXd columns(rows, scale + 2);  // causes, scale, readings
    std::size_t set_ups = 0;
    for (std::size_t r = 0; r < targets.size(); ++r) {
        const auto row = static_cast<Eigen::Index>(r);
        const diagonal_target &one = targets[r];
        set_ups = std::max(set_ups, one.set_up + 1);
        for (std::size_t k = 0; k < causes.size(); ++k) {
            columns(row, static_cast<Eigen::Index>(k)) = causes[k].along_um[r];
        }
        columns(row, scale) = um_per_mm_per_ppm * product(one.position_mm, one.along);
        columns(row, scale + 1) = one.error_um;
    }
    columns = without_zeros(targets, columns, set_ups);
    const std::vector<Eigen::Index> chosen = told_apart(columns.leftCols(scale + 1), causes);
    const Eigen::MatrixXd a = chosen_of(columns, chosen);
    const Eigen::VectorXd size = a.colwise().norm();
    const Eigen::MatrixXd unit = a * size.cwiseInverse().asDiagonal();
    const Eigen::VectorXd x = algebra::solve_least_squares(unit, columns.col(scale + 1)).x;
    const Eigen::MatrixXd root = algebra::triangular_factor(unit);
    const Eigen::MatrixXd inverse =
        algebra::solve_least_squares(root, Eigen::MatrixXd::Identity(root.rows(), root.rows())).x;
    diagonal_adjustment made;
    made.freedom = static_cast<int>(targets.size() - set_ups - chosen.size());
    const double rest = (columns.col(scale + 1) - unit * x).squaredNorm();
    made.residual_um = made.freedom > 0 ? std::sqrt(rest / made.freedom) : 0.0;
    for (std::size_t k = 0; k < chosen.size(); ++k) {
        const auto column = static_cast<Eigen::Index>(k);
        const diagonal_adjustment::size one = {
            x[column] / size[column], made.residual_um * inverse.row(column).norm() / size[column]};
        if (chosen[k] == scale) {
            made.scale_ppm = one;
        } else {
            made.found[causes[static_cast<std::size_t>(chosen[k])].name] = one;
        }
    }
    for (const diagonal_cause &cause : causes) {
        if (made.found.count(cause.name) == 0) made.hidden.push_back(cause.name);
    }
    return made;
}

}  // namespace compbox::coefficients
