// SPDX-License-Identifier: MIT
// Averages the runs to one curve. Without each run's own offset and slope, repeats at one position
// differ by noise alone, so they measure the noise without any model of the curve.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host-tools/algebra/solvers.h"
#include "host-tools/fitting/run_noise.h"
#include "host-tools/formats/error.h"

namespace compbox::fitting {

namespace {

// One reading, its run and its group. A group is one position in one direction.
struct reading {
    double x, y, weight;
    std::size_t run, position;
    bool backward;
    std::size_t group;
};

// Positions closer than this fraction of the range are one target.
constexpr double same_position = 1e-7;

std::vector<double> distinct_positions(const std::vector<measured_run> &runs) {
    std::vector<double> all;
    for (const auto &run : runs) all.insert(all.end(), run.position.begin(), run.position.end());
    std::sort(all.begin(), all.end());
    const double closest = closest_positions(runs);
    std::vector<double> kept;
    for (const double x : all) {
        if (kept.empty() || x - kept.back() > closest) kept.push_back(x);
    }
    return kept;
}

std::vector<reading> collect(const measurement &data) {
    std::vector<reading> all;
    for (std::size_t r = 0; r < data.runs.size(); ++r) {
        const measured_run &run = data.runs[r];
        for (std::size_t i = 0; i < run.position.size(); ++i) {
            auto place =
                std::upper_bound(data.position.begin(), data.position.end(), run.position[i]);
            const auto index = static_cast<std::size_t>(place - data.position.begin()) - 1;
            const bool backward = run.direction < 0;
            all.push_back({run.position[i], run.error[i], 1.0 / (run.sigma[i] * run.sigma[i]), r,
                           index, backward, 2 * index + (backward ? 1 : 0)});
        }
    }
    return all;
}

struct group_sums {
    std::vector<double> weight, value;
    std::vector<int> count;
    explicit group_sums(std::size_t groups) : weight(groups), value(groups), count(groups) {}
    void add(const reading &one, double value_of_one) {
        weight[one.group] += one.weight;
        value[one.group] += one.weight * value_of_one;
        ++count[one.group];
    }
    double mean(std::size_t group) const { return value[group] / weight[group]; }
    int filled() const {
        return static_cast<int>(std::count_if(count.begin(), count.end(), [](int c) { return c; }));
    }
};

struct alignment {
    Eigen::VectorXd offset, slope;  // of each run, minimum norm: they sum to zero over the runs
    double left = 0.0;              // weighted sum of squares between repeats after the alignment
    double before = 0.0;            // and before it
    int freedom_before = 0, freedom = 0;
};

// The effort of align() and its memory grow with the square of the runs.
void refuse_many_runs(const measurement &data, std::size_t readings) {
    constexpr double most = 5e9;
    const auto runs = static_cast<double>(data.runs.size());
    if (static_cast<double>(readings) * runs * runs <= most) return;
    throw input_error(data.file, 0, 0,
                      "has {} readings in {} runs, too many to align: all readings of one traverse "
                      "carry the same name in the column 'run' (so many readings: at most {:.0f} "
                      "runs)",
                      readings, data.runs.size(),
                      std::floor(std::sqrt(most / static_cast<double>(readings))));
}

// Rows of a least-squares problem, of which only the triangular factor is kept.
class factored_rows {
  public:
    explicit factored_rows(Eigen::Index columns)
        : kept_(columns), rows_(Eigen::MatrixXd::Zero(columns + most_rows, columns)) {}

    // out: a new row of zeros
    auto add() {
        if (used_ == most_rows) fold();
        return rows_.row(kept_ + used_++);
    }
    // out: the factor of all rows; columns x columns
    Eigen::MatrixXd factor() {
        fold();
        return rows_.topRows(kept_);
    }

  private:
    void fold() {
        rows_.topRows(kept_) = algebra::triangular_factor(rows_.topRows(kept_ + used_));
        rows_.bottomRows(most_rows).setZero();
        used_ = 0;
    }

    static constexpr Eigen::Index most_rows = 4096;
    Eigen::Index kept_, used_ = 0;
    Eigen::MatrixXd rows_;
};

// in : all, by group; readings from begin to end are of one group; columns: an offset for each run,
//      a slope for each run, the value
// out: sqrt(weight) times (quantity - weighted mean of the group), a row for each reading
void add_group(const std::vector<const reading *> &all, std::size_t begin, std::size_t end,
               Eigen::Index runs, double centre, double half_range, factored_rows &rows) {
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(2 * runs + 1);
    const auto add = [&](const reading &one, double factor, auto &&row) {
        const auto run = static_cast<Eigen::Index>(one.run);
        row[run] += factor;
        row[runs + run] += factor * (one.x - centre) / half_range;
        row[2 * runs] += factor * one.y;
    };
    double weight = 0.0;
    for (std::size_t i = begin; i < end; ++i) {
        add(*all[i], all[i]->weight, mean);
        weight += all[i]->weight;
    }
    mean /= weight;
    for (std::size_t i = begin; i < end; ++i) {
        const double root = std::sqrt(all[i]->weight);
        auto row = rows.add();
        row = -root * mean;
        add(*all[i], root, row);
    }
}

// Least squares of each run's own offset and slope against the other runs at the same positions. A
// reading alone in its group says nothing about them.
alignment align(const std::vector<reading> &all, const group_sums &sums, std::size_t runs,
                double centre, double half_range) {
    const auto m = static_cast<Eigen::Index>(runs);
    std::vector<const reading *> repeated;
    for (const auto &one : all) {
        if (sums.count[one.group] > 1) repeated.push_back(&one);
    }
    std::stable_sort(repeated.begin(), repeated.end(),
                     [](const reading *a, const reading *b) { return a->group < b->group; });
    factored_rows rows(2 * m + 1);
    for (std::size_t begin = 0, end = 0; begin < repeated.size(); begin = end) {
        while (end < repeated.size() && repeated[end]->group == repeated[begin]->group) ++end;
        add_group(repeated, begin, end, m, centre, half_range, rows);
    }
    const Eigen::MatrixXd factor = rows.factor();
    const Eigen::VectorXd y = factor.col(2 * m);
    const algebra::least_squares solved =
        algebra::solve_least_squares(factor.leftCols(2 * m), y, 1e-9);
    const Eigen::VectorXd parts = solved.x;
    alignment result;
    result.offset = parts.head(m);
    result.slope = parts.tail(m);
    result.before = y.squaredNorm();
    result.left = (y - factor.leftCols(2 * m) * parts).squaredNorm();
    result.freedom_before = static_cast<int>(all.size()) - sums.filled();
    result.freedom = result.freedom_before - static_cast<int>(solved.rank);
    return result;
}

// What an information criterion with twice BIC's penalty asks of the runs' offsets and slopes, so
// that ordinary repeats stay exactly as measured: a gain of twice the log likelihood.
double needed_gain(const alignment &found) {
    const double n = found.freedom_before, k = found.freedom_before - found.freedom;
    return 2.0 * k * std::log(n) + 6.0;
}

// Whether offsets and slopes explain independent noise that much better.
bool explain_much(const alignment &found) {
    if (found.freedom < 4 || found.freedom == found.freedom_before) return false;
    const double floor = 1e-24 * found.before;
    return found.freedom_before * std::log(found.before / std::max(found.left, floor)) >
           needed_gain(found);
}

// Two standard deviations of few degrees of freedom (from 1) hold 95.45 % after multiplication by
// this (Student's t, ISO/IEC Guide 98-3, table G.2).
double widening(std::size_t freedom) {
    constexpr std::array<double, 11> half_of_t = {0,    6.99, 2.27, 1.66, 1.44, 1.33,
                                                  1.26, 1.22, 1.19, 1.16, 1.14};
    if (freedom < half_of_t.size()) return half_of_t[freedom];
    return 1.0 + 1.4 / static_cast<double>(freedom);
}

// How uncertain the mean of the runs' offsets and slopes is, by their scatter in each direction.
void find_line_variance(measurement &data) {
    if (!data.runs_aligned) return;
    for (const bool backward : {false, true}) {
        std::array<double, 3> squares = {};
        std::size_t runs = 0;
        for (const auto &run : data.runs) {
            if ((run.direction < 0) != backward) continue;
            squares[0] += run.offset * run.offset;
            squares[1] += 2.0 * run.offset * run.slope;
            squares[2] += run.slope * run.slope;
            ++runs;
        }
        if (runs < 2) continue;
        const double widened = widening(runs - 1), count = static_cast<double>(runs);
        const double share = (data.bidirectional ? 0.25 : 1.0) * widened * widened;
        for (std::size_t k = 0; k < 3; ++k) {
            data.line_variance[k] += share * squares[k] / (count * (count - 1.0));
        }
    }
}

void take_off_alignment(measurement &data, std::vector<reading> &all, const alignment &found,
                        double centre, double half_range) {
    for (std::size_t r = 0; r < data.runs.size(); ++r) {
        data.runs[r].offset = found.offset[static_cast<Eigen::Index>(r)];
        data.runs[r].slope = found.slope[static_cast<Eigen::Index>(r)] / half_range;
    }
    for (auto &one : all) {
        const measured_run &run = data.runs[one.run];
        one.y -= run.offset + run.slope * (one.x - centre);
    }
}

void average_lost_motion(measurement &data, const group_sums &sums) {
    double total = 0.0;
    int both = 0;
    data.lost_motion.assign(data.position.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < data.position.size(); ++i) {
        if (!sums.count[2 * i] || !sums.count[2 * i + 1]) continue;
        data.lost_motion[i] = sums.mean(2 * i) - sums.mean(2 * i + 1);
        total += data.lost_motion[i];
        ++both;
    }
    data.bidirectional = both > 0;
    data.mean_lost_motion = both ? total / both : 0.0;
}

// The mean of both directions' means. At a position with one direction only, half the mean lost
// motion is added, so that a missing reading makes no step.
void average_positions(measurement &data, const group_sums &sums) {
    for (std::size_t i = 0; i < data.position.size(); ++i) {
        const std::size_t up = 2 * i, down = 2 * i + 1;
        const double half = 0.5 * data.mean_lost_motion;
        data.readings[i] = sums.count[up] + sums.count[down];
        if (sums.count[up] && sums.count[down]) {
            data.mean[i] = 0.5 * (sums.mean(up) + sums.mean(down));
            data.variance[i] = 0.25 / sums.weight[up] + 0.25 / sums.weight[down];
        } else if (sums.count[up]) {
            data.mean[i] = sums.mean(up) - half;
            data.variance[i] = 1.0 / sums.weight[up];
        } else {
            data.mean[i] = sums.mean(down) + half;
            data.variance[i] = 1.0 / sums.weight[down];
        }
    }
}

}  // namespace

double closest_positions(const std::vector<measured_run> &runs) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto &run : runs) {
        for (const double x : run.position) {
            low = std::min(low, x);
            high = std::max(high, x);
        }
    }
    return high > low ? same_position * (high - low) : 0.0;
}

void average_runs(measurement &data) {
    for (auto &run : data.runs) run.offset = run.slope = 0.0;
    data.line_variance = {};
    data.short_variance = 0.0;
    data.position = distinct_positions(data.runs);
    const std::size_t positions = data.position.size(), groups = 2 * positions;
    data.mean.assign(positions, 0.0);
    data.variance.assign(positions, 0.0);
    data.readings.assign(positions, 0);
    auto all = collect(data);
    group_sums sums(groups);
    for (const auto &one : all) sums.add(one, one.y);
    refuse_many_runs(data, all.size());
    const double half_range = std::max(0.5 * (data.to() - data.from()), 1e-9);
    const alignment found = align(all, sums, data.runs.size(), data.centre(), half_range);
    const bool lines = explain_much(found);
    // Noise that is correlated within a run looks like lines of the runs.
    data.runs_aligned = lines && gain_by_lines(data) > needed_gain(found);
    data.repeat_freedom = data.runs_aligned ? found.freedom : found.freedom_before;
    data.repeat_variance = data.runs_aligned ? found.left : found.before;
    if (data.repeat_freedom > 0) {
        data.repeat_variance /= data.repeat_freedom;
        data.short_variance = lines ? found.left / found.freedom : data.repeat_variance;
    } else if (data.cells.freedom > 0) {
        data.repeat_freedom = data.cells.freedom;
        data.repeat_variance = data.short_variance = data.cells.variance;
    }
    if (data.runs_aligned) {
        take_off_alignment(data, all, found, data.centre(), half_range);
        sums = group_sums(groups);
        for (const auto &one : all) sums.add(one, one.y);
    }
    average_lost_motion(data, sums);
    average_positions(data, sums);
    find_line_variance(data);
}

}  // namespace compbox::fitting
