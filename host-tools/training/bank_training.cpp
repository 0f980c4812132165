// SPDX-License-Identifier: MIT
#include "host-tools/training/bank_training.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "host-tools/formats/error.h"
#include "host-tools/regression/gain.h"
#include "host-tools/training/select_inputs.h"
#include "host-tools/training/shrinkage.h"

namespace compbox::training {

namespace {

constexpr std::size_t least_lags = 4;  // of each input; with fewer, inputs are left out instead
constexpr double pause_steps = 20.0;   // a longer step between rows is a pause
constexpr std::size_t six_parts = 6;
constexpr std::size_t most_network_inputs = 64;  // CB_BPNET_MAX_INPUTS

// Whether the runs are stretches of one record without pauses, in its order.
bool is_one_record(const training_data &data) {
    if (data.time_s.empty() || data.reordered || data.run_names.size() < 2) return false;
    double longest_inside = 0.0;
    std::vector<double> between;
    for (std::size_t r = 1; r < data.rows(); ++r) {
        const double step = data.time_s[r] - data.time_s[r - 1];
        if (step <= 0.0) return false;
        if (data.run[r] == data.run[r - 1]) {
            longest_inside = std::max(longest_inside, step);
        } else {
            between.push_back(step);
        }
    }
    return std::all_of(between.begin(), between.end(),
                       [&](double step) { return step <= pause_steps * longest_inside; });
}

// The data with these inputs alone, those of both lists.
training_data only_inputs(const training_data &data, std::vector<std::string> names,
                          const std::vector<std::string> &more) {
    names.insert(names.end(), more.begin(), more.end());
    std::vector<Eigen::Index> columns;
    for (const auto &name : names) {
        columns.push_back(std::find(data.inputs.begin(), data.inputs.end(), name) -
                          data.inputs.begin());
    }
    training_data some = data;
    some.inputs = names;
    some.x = data.x(Eigen::all, columns);
    if (data.history.size() > 0) some.history = data.history(Eigen::all, columns);
    return some;
}

// Leaves inputs out until the others have room for a few lags each.
void fit_to_box(train_result &result) {
    training_data &data = result.data;
    const auto fits = [&](const std::vector<std::string> &names) {
        return names.size() <= most_bank_inputs &&
               (data.time_s.empty() || room_for_lags(names, data.speeds) >= least_lags);
    };
    if (fits(data.inputs)) return;
    std::vector<std::string> sensors;
    for (const auto &name : data.inputs) {
        if (powers_of(data.speeds, name) == 1) sensors.push_back(name);
    }
    const std::size_t columns =
        data.time_s.empty() ? most_bank_inputs : most_bank_lags / least_lags;
    const std::size_t speeds = 3 * data.speeds.size();
    if (columns < speeds + 2 || sensors.size() < 3) return;
    select_options options;
    options.count = std::min(columns - speeds, sensors.size() - 1);
    options.keep = data.speeds;
    training_data ordered = only_inputs(data, sensors, data.speeds);
    const selection chosen = select_inputs(ordered, options);
    std::vector<std::string> kept;
    for (const std::size_t c : chosen.chosen) kept.push_back(ordered.inputs[c]);
    data = only_inputs(ordered, kept, ordered.speeds);
    data.remarks.push_back(fmt::format(
        "{} inputs have no room for {} lags each among the box's {}, so {} that differ most are "
        "taken: {}",
        ordered.inputs.size(), least_lags, most_bank_lags, kept.size(), fmt::join(kept, ", ")));
}

// out: the user's options for a network beside the bank: the inputs with two lags, or without where
//      these would be too many; nothing where even so they are
std::optional<train_options> network_options(const train_result &bank,
                                             const train_options &options) {
    train_options others = options;
    others.bank = false, others.beside_bank = true;
    others.margin = std::min(options.margin, 0.1);  // what bends is not continued far
    others.starts_of_lags = bank.options.starts_of_lags;
    others.lags.squares.clear();
    const std::size_t inputs = bank.data.inputs.size();
    if (inputs > most_network_inputs) return std::nullopt;
    const std::size_t speeds = bank.data.speeds.size();
    if (bank.tau_s.empty() || 3 * (inputs + speeds) > most_network_inputs) return others;
    const std::size_t lags = bank.tau_s.size();
    others.lags.lags_s = {bank.tau_s[lags / 3]};
    if (lags > 2) others.lags.lags_s.push_back(bank.tau_s[2 * lags / 3]);
    others.lags.squares = bank.data.speeds;
    return others;
}

// out: mean square of one output over each run, of the rows that judged the network: of the
// network,
//      or of another model of the same rows
Eigen::ArrayXd squares_of(const train_result &network, const judged_model &judged,
                          Eigen::Index output) {
    const bool all_rows = judged.left_out_predictions.rows() == network.learn.y.rows();
    std::map<std::size_t, std::pair<double, double>> runs;  // sum and number of rows
    for (std::size_t i = 0; i < network.network_rows.size(); ++i) {
        const Eigen::Index row = network.network_rows[i];
        const Eigen::Index of_model = all_rows ? row : static_cast<Eigen::Index>(i);
        const double off =
            judged.left_out_predictions(of_model, output) - network.learn.y(row, output);
        auto &[sum, count] = runs[network.learn.run[static_cast<std::size_t>(row)]];
        sum += off * off, count += 1.0;
    }
    Eigen::ArrayXd squares(static_cast<Eigen::Index>(runs.size()));
    Eigen::Index next = 0;
    for (const auto &[run, of_run] : runs) squares[next++] = of_run.first / of_run.second;
    return squares;
}

// Throws input_error if the bank of this data has other weights than the prior.
void check_prior(const std::string &file, const bank_space &prior, const training_data &data) {
    const std::string text =
        prior.difference({data.inputs, data.speeds, data.outputs, prior.tau_s});
    if (!text.empty()) throw input_error(file, 0, 0, "and {} have {}", data.file, text);
    if (!prior.tau_s.empty() && data.time_s.empty()) {
        throw input_error(data.file, 0, 0, "has no time, which the lags of {} need", file);
    }
}

// out: the spread of one output's weights among brothers, for scaled inputs and outputs
weight_spread scaled_spread(const train_result &result, Eigen::Index output) {
    const trained_model &model = result.linear.model;
    const weight_spread &spread = result.prior->outputs[static_cast<std::size_t>(output)];
    const Eigen::VectorXd unit = model.in.scale / model.out.scale[output];
    return {unit.asDiagonal() * spread.mean, unit.asDiagonal() * spread.factor};
}

}  // namespace

void prepare_options(train_result &result) {
    train_options &options = result.options;
    training_data &data = result.data;
    if (options.starts_of_lags == lag_starts::automatic) {
        const bool both = options.bank && is_one_record(data);
        options.starts_of_lags = both ? lag_starts::both : lag_starts::each_run;
    }
    if (!options.bank) return;
    fit_to_box(result);
    result.tau_s = time_constants(data, room_for_lags(data.inputs, data.speeds));
    if (options.priors) {
        result.prior = &prior_for(*options.priors, result.tau_s);
        result.tau_s = result.prior->space.tau_s;
        check_prior(options.priors->file, result.prior->space, data);
    }
    if (options.zero_at_start) data.y = regression::from_starts(data.y, starts_of(data.run));
}

void hold_test_rows(train_result &result) {
    training_data held = result.data;
    for (std::size_t i = 0; i < result.inputs.size(); ++i) {
        const model_input &input = result.inputs[i];
        if (input.tau_s > 0.0 || input.power > 1) continue;
        const auto at = static_cast<Eigen::Index>(i);
        const double least = result.range.low[at] - result.range.margin[at];
        const double most = result.range.high[at] + result.range.margin[at];
        for (Eigen::MatrixXd *values : {&held.x, &held.history}) {
            if (values->size() == 0) continue;
            auto column = values->col(static_cast<Eigen::Index>(input.column));
            column = column.cwiseMax(least).cwiseMin(most).eval();
        }
    }
    const model_rows all = rows_of(held, result.inputs, result.options.starts_of_lags);
    std::vector<Eigen::Index> rows;
    std::vector<bool> is_test(result.data.run_names.size(), false);
    for (const std::size_t run : result.test.run) is_test[run] = true;
    for (std::size_t r = 0; r < all.run.size(); ++r) {
        const bool spoilt = !result.data.spoilt.empty() && result.data.spoilt[all.source[r]];
        if (is_test[all.run[r]] && !spoilt) rows.push_back(static_cast<Eigen::Index>(r));
    }
    result.test_held = all.x(rows, Eigen::all);
}

regression::row_folds bank_folds(const train_result &result) {
    std::vector<std::size_t> runs;
    for (const std::size_t run : result.learn.run) {
        runs.push_back(result.data.together.empty() ? run : result.data.together[run]);
    }
    regression::row_folds folds = regression::folds_of(runs);
    if (folds.usable()) return folds;
    if (result.options.zero_at_start) {
        throw input_error(result.data.file, 0, 0,
                          "--zero-at-start needs at least three runs to train on, because each has "
                          "an offset of its own");
    }
    for (std::size_t r = 0; r < runs.size(); ++r) {
        folds.fold[r] = result.learn.source[r] * six_parts / result.data.rows();
    }
    return regression::folds_of(folds.fold);
}

regression::averaged_map average_bank(train_result &result, const Eigen::MatrixXd &x,
                                      const Eigen::MatrixXd &t,
                                      const regression::row_folds &folds) {
    const std::vector<Eigen::Index> starts =
        result.options.zero_at_start ? starts_of(result.learn.run) : std::vector<Eigen::Index>{};
    regression::averaged_map mean = regression::average_maps(
        x, t, folds, bank_members(result.inputs), starts, result.options.threads);
    if (result.prior == nullptr) return mean;
    const bool twice = result.options.starts_of_lags == lag_starts::both;
    const double rows = static_cast<double>(t.rows()) / (twice ? 2.0 : 1.0);
    for (Eigen::Index k = 0; k < t.cols(); ++k) {
        const regression::linear_map own{mean.map.weights.col(k), mean.map.offset.segment(k, 1)};
        const double alike = rows_alike(mean.left_out.col(k) - t.col(k), result.learn.run);
        const drawn_map drawn = draw_to(scaled_spread(result, k), own, mean.left_out.col(k),
                                        rows / alike, x, t.col(k), folds, starts);
        mean.map.weights.col(k) = drawn.map.weights, mean.map.offset[k] = drawn.map.offset[0];
        mean.left_out.col(k) = drawn.left_out;
        result.drawn.push_back(drawn.share);
    }
    return mean;
}

train_result best_of(train_result bank, const network_trainer &train_network,
                     const train_options &options) {
    const std::optional<train_options> others = network_options(bank, options);
    if (!others) {
        bank.verdict = fmt::format("the bank is written; a network takes at most {} inputs",
                                   most_network_inputs);
        return bank;
    }
    train_result network = train_network(bank.data, *others);
    std::vector<bool> better;
    bool worse = false;
    for (Eigen::Index k = 0; k < bank.learn.y.cols(); ++k) {
        const Eigen::ArrayXd of_bank = squares_of(network, bank.linear, k);
        const Eigen::ArrayXd of_network = squares_of(network, network.network, k);
        better.push_back(network.network_better[static_cast<std::size_t>(k)] &&
                         regression::is_clear_gain(of_bank, of_network));
        worse = worse || (!better.back() && of_network.mean() > of_bank.mean());
    }
    const bool any = std::find(better.begin(), better.end(), true) != better.end();
    if (any && !worse) {
        network.verdict =
            "a network over a few lags is better on the runs left out than the bank of "
            "lags: the network is written";
        return network;
    }
    bank.options.hidden = options.hidden;
    bank.network = network.network;
    bank.network_rows = network.network_rows;
    bank.network_decay = network.network_decay, bank.network_loss = network.network_loss;
    bank.network_iterations = network.network_iterations, bank.best_start = network.best_start;
    bank.network_inputs = network.inputs.size();
    bank.verdict =
        "a network over a few lags is not better on the runs left out beyond their spread: "
        "the linear bank is written";
    return bank;
}

std::vector<Eigen::Index> starts_of(const std::vector<std::size_t> &run) {
    std::vector<Eigen::Index> starts;
    for (std::size_t r = 0; r < run.size(); ++r) {
        if (r == 0 || run[r] != run[r - 1]) starts.push_back(static_cast<Eigen::Index>(r));
    }
    return starts;
}

}  // namespace compbox::training
