// SPDX-License-Identifier: MIT
#include "host-tools/training/verdict.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/regression/gain.h"

namespace compbox::training {

namespace {

constexpr double clearly_better = 0.98;

Eigen::Index at(std::size_t index) {
    return static_cast<Eigen::Index>(index);
}

// Residuals of the linear map on the left-out rows that judged the network.
residuals linear_residuals(const train_result &result) {
    const Eigen::MatrixXd off =
        result.linear.left_out_predictions(result.network_rows, Eigen::all) -
        result.learn.y(result.network_rows, Eigen::all);
    residuals left;
    left.rows = result.network_rows.size();
    left.rms = (off.colwise().squaredNorm() / static_cast<double>(left.rows)).cwiseSqrt();
    left.worst = off.cwiseAbs().colwise().maxCoeff();
    return left;
}

// Mean square of one output over each run, of the rows that judged the network.
Eigen::ArrayXd square_of_runs(const train_result &result, const Eigen::VectorXd &off) {
    std::vector<double> sum(result.data.run_names.size()), rows(sum.size());
    for (std::size_t i = 0; i < result.network_rows.size(); ++i) {
        const std::size_t run = result.learn.run[static_cast<std::size_t>(result.network_rows[i])];
        sum[run] += off[at(i)] * off[at(i)];
        rows[run] += 1.0;
    }
    std::vector<double> squares;
    for (std::size_t run = 0; run < sum.size(); ++run) {
        if (rows[run] > 0.0) squares.push_back(sum[run] / rows[run]);
    }
    return Eigen::Map<const Eigen::ArrayXd>(squares.data(), at(squares.size()));
}

// Whether the network's gain on one output is significant.
bool clear_gain(const train_result &result, std::size_t output) {
    const Eigen::VectorXd measured = result.learn.y(result.network_rows, at(output));
    const Eigen::VectorXd linear =
        result.linear.left_out_predictions(result.network_rows, at(output));
    const Eigen::VectorXd network = result.network.left_out_predictions.col(at(output));
    return regression::is_clear_gain(square_of_runs(result, linear - measured),
                                     square_of_runs(result, network - measured));
}

std::vector<bool> better_outputs(const train_result &result) {
    const std::size_t outputs = result.data.outputs.size();
    if (result.options.hidden == 0) return std::vector<bool>(outputs, false);
    if (result.options.keep_network) return std::vector<bool>(outputs, true);
    if (!result.by_folds) {
        return std::vector<bool>(outputs, result.network.log_evidence > result.linear.log_evidence);
    }
    const residuals &network = result.network.left_out, linear = linear_residuals(result);
    std::vector<bool> better;
    for (std::size_t k = 0; k < outputs; ++k) {
        better.push_back(network.rms[at(k)] < clearly_better * linear.rms[at(k)] &&
                         network.worst[at(k)] <= linear.worst[at(k)] && clear_gain(result, k));
    }
    return better;
}

// The network's rows for the outputs where it is better, the linear map's elsewhere.
trained_model joined(const train_result &result) {
    const trained_model &linear = result.linear.model;
    if (!result.any_network()) return linear;
    const trained_model &network = result.network.model;
    trained_model both;
    both.in = network.in, both.out = network.out;
    both.shape = network.shape;
    both.shape.linear = network.shape.linear || std::count(result.network_better.begin(),
                                                           result.network_better.end(), false) > 0;
    const Eigen::Index more = both.shape.count() - network.parameters.size();
    both.parameters.resize(both.shape.count());
    both.parameters << network.parameters, Eigen::VectorXd::Zero(more);
    regression::network_parts<double> to(both.shape, both.parameters.data());
    const regression::network_parts<const double> from(linear.shape, linear.parameters.data());
    for (std::size_t k = 0; k < result.network_better.size(); ++k) {
        if (result.network_better[k]) continue;
        to.weight2.row(at(k)).setZero();
        to.bias2[at(k)] = from.bias2[at(k)];
        to.linear.row(at(k)) = from.linear.row(at(k));
    }
    return both;
}

// Figures of each output's better model.
residuals picked(const train_result &result, residuals judged_model::*which) {
    residuals some = result.linear.*which;
    for (std::size_t k = 0; some.rows > 0 && k < result.network_better.size(); ++k) {
        if (!result.network_better[k]) continue;
        some.rms[at(k)] = (result.network.*which).rms[at(k)];
        some.worst[at(k)] = (result.network.*which).worst[at(k)];
    }
    return some;
}

std::string listed(const std::vector<std::string> &names, const std::vector<bool> &pick,
                   bool wanted) {
    std::string text;
    for (std::size_t k = 0; k < names.size(); ++k) {
        if (pick[k] == wanted) text += (text.empty() ? "" : ", ") + names[k];
    }
    return text;
}

// out: which model is written, and why, in one sentence without a full stop
std::string verdict_of(const train_result &result) {
    const std::string by = result.by_folds ? "on the runs left out" : "by evidence";
    const auto &better = result.network_better;
    const auto &names = result.data.outputs;
    if (result.options.hidden == 0 && !result.options.bank) return "linear map only, as requested";
    if (result.options.hidden == 0) return "linear bank only, as requested";
    if (result.options.keep_network) return "network written, as requested (--keep-network)";
    if (!result.any_network()) {
        return fmt::format(
            "the network is not better than the linear map {}{}: the linear map is written", by,
            result.by_folds ? " beyond their spread" : "");
    }
    if (std::count(better.begin(), better.end(), false) == 0) {
        return "the network is better than the linear map " + by;
    }
    return fmt::format(
        "the network is better {} for {}; it is not for {}, where the linear map is written", by,
        listed(names, better, true), listed(names, better, false));
}

// The input that leaves the range of the other runs furthest, as a fraction of that range.
std::string beyond_others(const train_result &result, std::size_t run) {
    const auto rows = static_cast<Eigen::Index>(result.data.rows());
    double furthest = result.options.margin;
    std::string text;
    for (std::size_t c = 0; c < result.data.inputs.size(); ++c) {
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        for (Eigen::Index r = 0; r < rows; ++r) {
            const bool own = result.data.run[static_cast<std::size_t>(r)] == run;
            const double value = result.data.x(r, at(c));
            low[own] = std::min(low[own], value), high[own] = std::max(high[own], value);
        }
        const double range = high[0] - low[0];
        const double beyond = std::max(high[1] - high[0], low[0] - low[1]) / range;
        if (!(beyond > furthest)) continue;
        furthest = beyond;
        text = fmt::format(
            "run {}: {} reaches {:.6g}, the other runs {:.6g} to {:.6g}: its residuals there are "
            "an extrapolation",
            result.data.run_names[run], result.data.inputs[c],
            high[1] - high[0] > low[0] - low[1] ? high[1] : low[1], low[0], high[0]);
    }
    return text;
}

// Rows of the held-out runs beyond the margin of an input, where the box fades the term.
void warn_of_fading(train_result &result) {
    if (result.test.x.rows() == 0) return;
    const Eigen::VectorXd weight = result.range.weight(result.test.x);
    const auto rows = (weight.array() < 1.0).count();
    if (rows == 0) return;
    Eigen::Index row = 0, input = 0;
    const double least = weight.minCoeff(&row);
    const Eigen::RowVectorXd range = (result.range.high - result.range.low).transpose();
    const Eigen::RowVectorXd x = result.test.x.row(row);
    ((x - result.range.held(x)).cwiseAbs().array() / range.array()).maxCoeff(&input);
    result.warnings.push_back(fmt::format(
        "{} of {} rows of the runs held out lie beyond the margin of an input, where the box holds "
        "the input and fades the term, at worst to {:.6g} % ({} at {:.6g}, trained {:.6g} to "
        "{:.6g}): train on such runs too, or widen --margin",
        rows, weight.size(), 100.0 * least, result.inputs[static_cast<std::size_t>(input)].name,
        x[input], result.range.low[input], result.range.high[input]));
}

// Names the glitches; many of one table only by their number.
void warn_of_glitches(train_result &result) {
    constexpr std::size_t most = 10;
    const std::vector<std::string> &all = result.data.glitches;
    for (std::size_t i = 0; i < std::min(all.size(), most); ++i) {
        result.warnings.push_back(
            fmt::format("glitch: {}; the box would follow it, so it is not learnt: check the "
                        "sensor and its cable",
                        all[i]));
    }
    if (all.size() > most) {
        result.warnings.push_back(
            fmt::format("{} glitches more are not learnt either", all.size() - most));
    }
}

// "ez_um (4.1 um left, 3.2 um without)" of each output that the model makes worse
std::string worsened(const train_result &result) {
    const residuals &left = result.chosen_figures.left_out;
    std::string text;
    for (std::size_t k = 0; left.rows > 0 && k < result.data.outputs.size(); ++k) {
        const double none = std::sqrt(result.learn.y.col(at(k)).squaredNorm() /
                                      static_cast<double>(result.learn.y.rows()));
        if (left.rms[at(k)] <= none) continue;
        text += fmt::format("{}{} ({:.4g} rms left, {:.4g} without)", text.empty() ? "" : ", ",
                            result.data.outputs[k], left.rms[at(k)], none);
    }
    return text;
}

}  // namespace

void refuse_worse(train_result &result) {
    const std::string outputs = worsened(result);
    if (outputs.empty()) return;
    if (!result.options.accept_worse) {
        throw input_error(result.data.file, 0, 0,
                          "on runs left out the model is worse than no compensation for {}: "
                          "measure more runs or choose other inputs, leave the output out, or "
                          "write it with --accept-worse",
                          outputs);
    }
    result.warnings.push_back("on runs left out the model is worse than no compensation for " +
                              outputs);
}

void decide(train_result &result) {
    result.network_better = better_outputs(result);
    result.chosen = joined(result);
    judged_model &figures = result.chosen_figures;
    figures.model = result.chosen;
    figures.trained = picked(result, &judged_model::trained);
    figures.left_out = picked(result, &judged_model::left_out);
    figures.held_out = picked(result, &judged_model::held_out);
    result.verdict = verdict_of(result);
    if (!result.data.note.empty()) result.warnings.push_back(result.data.note);
    for (const auto &remark : result.data.remarks) result.warnings.push_back(remark);
    warn_of_glitches(result);
    if (!result.by_folds) {
        result.warnings.push_back(
            "weight decay by evidence takes every row for independent; rows of one warm-up are "
            "not: with three runs or more, name their column with --run-column");
    }
    for (std::size_t run = 0; result.by_folds && run < result.data.run_names.size(); ++run) {
        const std::string text = beyond_others(result, run);
        if (!text.empty()) result.warnings.push_back(text);
    }
    warn_of_fading(result);
}

}  // namespace compbox::training
