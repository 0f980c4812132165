// SPDX-License-Identifier: MIT
#include "host-tools/training/select_inputs.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "host-tools/formats/error.h"
#include "host-tools/regression/elimination.h"
#include "host-tools/regression/parallel.h"

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

// A linear map of the chosen candidates and the fixed inputs, judged on left-out runs.
train_result trained_on(const selection &result, const std::vector<std::size_t> &chosen) {
    std::vector<std::size_t> columns = chosen;
    for (std::size_t c = result.candidates; c < result.data.inputs.size(); ++c) {
        columns.push_back(c);
    }
    train_options options = result.options.model;
    options.hidden = 0;
    options.regularise = regularisation::folds;
    options.for_comparison = true;
    const training_data some = with_inputs(result.data, columns);
    const auto there = [&](const std::string &name) {
        return std::find(some.inputs.begin(), some.inputs.end(), name) != some.inputs.end();
    };
    for (auto *names : {&options.lags.only, &options.lags.squares}) {
        names->erase(std::remove_if(names->begin(), names->end(),
                                    [&](const std::string &name) { return !there(name); }),
                     names->end());
    }
    return train(some, options);
}

// in : inputs: of the map; left_out: its residuals on left-out runs; largest |error| of each output
checked_choice judged(const std::vector<std::string> &inputs, const residuals &left_out,
                      const Eigen::VectorXd &largest) {
    return {inputs, left_out, (left_out.rms.array() / largest.array()).mean()};
}

checked_choice check(const selection &result, const std::vector<std::size_t> &chosen) {
    const train_result trained = trained_on(result, chosen);
    return judged(trained.data.inputs, trained.linear.left_out, trained.largest);
}

// Adds the highest grades of the others where clusters were left empty, up to `count`.
void fill_up(std::vector<std::size_t> &chosen, const selection &result) {
    while (chosen.size() < result.options.count) {
        std::size_t best = result.candidates;
        for (std::size_t c = 0; c < result.candidates; ++c) {
            if (std::find(chosen.begin(), chosen.end(), c) != chosen.end()) continue;
            if (best == result.candidates || result.grade[c] > result.grade[best]) best = c;
        }
        chosen.push_back(best);
    }
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
    fill_up(chosen, result);
    std::sort(chosen.begin(), chosen.end());
    return chosen;
}

// Candidates that leave a linear map one after the other. The decay of a large map is chosen anew
// when an eighth of the candidates has left, that of a small one for each try.
class departure {
  public:
    departure(const selection &result, std::vector<std::size_t> chosen)
        : result_(result), chosen_(std::move(chosen)) {
        prepare();
    }

    const std::vector<std::size_t> &chosen() const { return chosen_; }

    checked_choice now() const { return judged_by(map_->residuals(), result_.candidates); }

    // out: the candidate, as an index of chosen(), without which the left-out runs are met best,
    //      and the residuals without it
    std::pair<std::size_t, checked_choice> best_to_leave() const {
        std::vector<std::pair<std::size_t, checked_choice>> tries(chosen_.size());
        regression::run_parallel(tries.size(), threads(), [&](std::size_t i) {
            tries[i] = {i, judged_by(map_->residuals_without(columns_of(chosen_[i])), chosen_[i])};
        });
        std::stable_sort(tries.begin(), tries.end(), [](const auto &a, const auto &b) {
            return a.second.merit < b.second.merit;
        });
        return is_small() ? best_with_own_decay(tries) : tries.front();
    }

    void leave(std::size_t index) {
        map_->remove(columns_of(chosen_[index]));
        chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(index));
        if (is_small() || 8 * chosen_.size() < 7 * prepared_) prepare();
    }

  private:
    int threads() const { return result_.options.model.threads; }
    // Whether there is time to choose the decay of each try.
    bool is_small() const { return trained_.inputs.size() <= 64; }

    // in : tries, the most promising first
    // out: the best of the first eight, each with a decay of its own
    std::pair<std::size_t, checked_choice> best_with_own_decay(
        std::vector<std::pair<std::size_t, checked_choice>> tries) const {
        tries.resize(std::min<std::size_t>(tries.size(), 8));
        regression::run_parallel(tries.size(), threads(), [&](std::size_t i) {
            std::vector<std::size_t> without = chosen_;
            without.erase(without.begin() + static_cast<std::ptrdiff_t>(tries[i].first));
            tries[i].second = check(result_, without);
        });
        return *std::min_element(tries.begin(), tries.end(), [](const auto &a, const auto &b) {
            return a.second.merit < b.second.merit;
        });
    }

    void prepare() {
        trained_ = trained_on(result_, chosen_);
        prepared_ = chosen_.size();
        const scaling &in = trained_.linear.model.in, &out = trained_.linear.model.out;
        const auto scaled = [](const Eigen::MatrixXd &values, const scaling &by) {
            return Eigen::MatrixXd((values.rowwise() - by.centre.transpose()) *
                                   by.scale.cwiseInverse().asDiagonal());
        };
        const double decay = std::exp(trained_.linear_decay.array().log().mean());
        map_.emplace(scaled(trained_.learn.x, in), scaled(trained_.learn.y, out),
                     regression::folds_of(trained_.learn.run), decay, threads());
    }

    // out: the inputs of the map that are made of a candidate
    std::vector<Eigen::Index> columns_of(std::size_t candidate) const {
        std::vector<Eigen::Index> columns;
        for (std::size_t i = 0; i < trained_.inputs.size(); ++i) {
            const std::string &name = trained_.data.inputs[trained_.inputs[i].column];
            if (name == result_.data.inputs[candidate]) {
                columns.push_back(static_cast<Eigen::Index>(i));
            }
        }
        return columns;
    }

    // in : scaled residuals; without: a candidate that is not among the inputs, if there is one
    checked_choice judged_by(const Eigen::MatrixXd &scaled, std::size_t without) const {
        std::vector<std::string> inputs;
        for (std::size_t c : chosen_) {
            if (c != without) inputs.push_back(result_.data.inputs[c]);
        }
        inputs.insert(inputs.end(),
                      result_.data.inputs.begin() + static_cast<std::ptrdiff_t>(result_.candidates),
                      result_.data.inputs.end());
        residuals left;
        left.rows = static_cast<std::size_t>(scaled.rows());
        const Eigen::ArrayXd scale = trained_.linear.model.out.scale;
        const Eigen::ArrayXd squares = scaled.colwise().squaredNorm();
        left.rms = scale * (squares / static_cast<double>(left.rows)).sqrt();
        left.worst = scale * scaled.cwiseAbs().colwise().maxCoeff().transpose().array();
        return judged(inputs, left, trained_.largest);
    }

    const selection &result_;
    std::vector<std::size_t> chosen_;
    train_result trained_;
    std::optional<regression::elimination> map_;
    std::size_t prepared_ = 0;  // candidates at the last choice of the decay
};

// Starts with all candidates and repeatedly removes the one with the least effect, down to `count`,
// or while the residuals of the left-out runs fall.
void eliminate(selection &result) {
    std::vector<std::size_t> all(result.candidates);
    std::iota(all.begin(), all.end(), 0);
    departure leaving(result, all);
    result.checks.push_back(leaving.now());
    const std::size_t least = std::max<std::size_t>(result.options.count, 1);
    while (leaving.chosen().size() > least) {
        const auto [index, without] = leaving.best_to_leave();
        if (result.options.count == 0 && without.merit >= result.checks.back().merit) break;
        leaving.leave(index);
        result.checks.push_back(without);
        if (result.options.progress) {
            result.options.progress(1.0 - static_cast<double>(leaving.chosen().size() - least) /
                                              static_cast<double>(result.candidates));
        }
    }
    if (result.options.progress) result.options.progress(1.0);
    result.chosen = leaving.chosen();
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
    const Eigen::MatrixXd similarity = regression::similarity_of(data.x.leftCols(n));
    result.clusters = options.method == cluster_method::c_means
                          ? regression::fuzzy_c_means(similarity, options.count)
                          : regression::transitive_closure(similarity, options.count);
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
