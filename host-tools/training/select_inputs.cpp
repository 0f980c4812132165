// SPDX-License-Identifier: MIT
#include "host-tools/training/select_inputs.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host-tools/formats/error.h"
#include "host-tools/training/parallel.h"

namespace compbox::training {

namespace {

constexpr double distinguishing = 0.5;  // Deng's coefficient

Eigen::VectorXd to_unit(const Eigen::VectorXd &v) {
    const double low = v.minCoeff(), range = v.maxCoeff() - low;
    return (v.array() - low) / (range > 0.0 ? range : 1.0);
}

// The data with some of its inputs.
training_data with_inputs(const training_data &data, const std::vector<std::size_t> &columns) {
    training_data some = data;
    some.inputs.clear();
    some.x.resize(data.x.rows(), static_cast<Eigen::Index>(columns.size()));
    for (std::size_t c = 0; c < columns.size(); ++c) {
        some.inputs.push_back(data.inputs[columns[c]]);
        some.x.col(static_cast<Eigen::Index>(c)) =
            data.x.col(static_cast<Eigen::Index>(columns[c]));
    }
    return some;
}

// Residuals of the chosen candidates, with the fixed inputs, on left-out runs.
checked_choice check(const selection &result, const std::vector<std::size_t> &chosen) {
    std::vector<std::size_t> columns = chosen;
    for (std::size_t c = result.candidates; c < result.data.inputs.size(); ++c) {
        columns.push_back(c);
    }
    train_options options = result.options.model;
    options.hidden = 0;
    options.regularise = regularisation::folds;
    const training_data some = with_inputs(result.data, columns);
    const auto there = [&](const std::string &name) {
        return std::find(some.inputs.begin(), some.inputs.end(), name) != some.inputs.end();
    };
    for (auto *names : {&options.lags.only, &options.lags.squares}) {
        names->erase(std::remove_if(names->begin(), names->end(),
                                    [&](const std::string &name) { return !there(name); }),
                     names->end());
    }
    const train_result trained = train(some, options);
    checked_choice checked{some.inputs, trained.linear.left_out, 0.0};
    checked.merit = (checked.left_out.rms.array() / trained.largest.array()).mean();
    return checked;
}

// In each cluster the candidate with the highest grade.
std::vector<std::size_t> best_of_clusters(const selection &result) {
    std::vector<std::size_t> chosen;
    for (std::size_t k = 0; k < result.clusters.count; ++k) {
        std::size_t best = result.candidates;
        for (std::size_t c = 0; c < result.candidates; ++c) {
            if (result.clusters.cluster[c] != k) continue;
            if (best == result.candidates || result.grade[c] > result.grade[best]) best = c;
        }
        chosen.push_back(best);
    }
    std::sort(chosen.begin(), chosen.end());
    return chosen;
}

// Starts with all candidates and repeatedly removes the one with the least effect, down to `count`,
// or while the residuals of the left-out runs fall.
void eliminate(selection &result) {
    std::vector<std::size_t> chosen(result.candidates);
    std::iota(chosen.begin(), chosen.end(), 0);
    result.checks.push_back(check(result, chosen));
    const std::size_t least = std::max<std::size_t>(result.options.count, 1);
    while (chosen.size() > least) {
        std::vector<checked_choice> tries(chosen.size());
        run_parallel(chosen.size(), result.options.model.threads, [&](std::size_t i) {
            std::vector<std::size_t> without = chosen;
            without.erase(without.begin() + static_cast<std::ptrdiff_t>(i));
            tries[i] = check(result, without);
        });
        const auto best =
            std::min_element(tries.begin(), tries.end(),
                             [](const auto &a, const auto &b) { return a.merit < b.merit; });
        if (result.options.count == 0 && best->merit >= result.checks.back().merit) break;
        chosen.erase(chosen.begin() + (best - tries.begin()));
        result.checks.push_back(*best);
        if (result.options.progress) {
            result.options.progress(1.0 - static_cast<double>(chosen.size() - least) /
                                              static_cast<double>(result.candidates));
        }
    }
    if (result.options.progress) result.options.progress(1.0);
    result.chosen = chosen;
}

}  // namespace

Eigen::VectorXd grey_grades(const Eigen::MatrixXd &x, const Eigen::VectorXd &y) {
    const Eigen::VectorXd wanted = to_unit(y);
    Eigen::MatrixXd apart(x.rows(), x.cols());
    for (Eigen::Index c = 0; c < x.cols(); ++c) {
        const Eigen::VectorXd unit = to_unit(x.col(c));
        const double together =
            (unit.array() - unit.mean()).matrix().dot((wanted.array() - wanted.mean()).matrix());
        apart.col(c) = (together < 0.0 ? (1.0 - unit.array()).matrix() : unit) - wanted;
    }
    apart = apart.cwiseAbs();
    const double least = apart.minCoeff(), most = apart.maxCoeff();
    if (most == 0.0) return Eigen::VectorXd::Ones(x.cols());
    const Eigen::ArrayXXd relation =
        (least + distinguishing * most) / (apart.array() + distinguishing * most);
    return relation.colwise().mean();
}

selection select_inputs(const training_data &data, const select_options &options) {
    selection result;
    result.options = options;
    result.data = data;
    result.candidates = data.inputs.size() - options.keep.size();
    if (result.candidates < 2) {
        throw input_error(data.file, 0, 0, "with fewer than two candidates there is no choice");
    }
    if (options.count > result.candidates) {
        throw input_error(data.file, 0, 0, "has {} candidates, fewer than --count {}",
                          result.candidates, options.count);
    }
    const auto n = static_cast<Eigen::Index>(result.candidates);
    const Eigen::MatrixXd similarity = similarity_of(data.x.leftCols(n));
    result.clusters = options.method == cluster_method::c_means
                          ? fuzzy_c_means(similarity, options.count)
                          : transitive_closure(similarity, options.count);
    result.grades.resize(n, data.y.cols());
    for (Eigen::Index k = 0; k < data.y.cols(); ++k) {
        result.grades.col(k) = grey_grades(data.x.leftCols(n), data.y.col(k));
    }
    for (Eigen::Index c = 0; c < n; ++c) result.grade.push_back(result.grades.row(c).mean());
    if (options.by_runs) {
        eliminate(result);
        return result;
    }
    result.chosen = best_of_clusters(result);
    if (options.check) {
        std::vector<std::size_t> all(result.candidates);
        std::iota(all.begin(), all.end(), 0);
        result.checks.push_back(check(result, all));
        result.checks.push_back(check(result, result.chosen));
    }
    return result;
}

}  // namespace compbox::training
