// SPDX-License-Identifier: MIT
#include "host-tools/training/train.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>

#include "host-tools/formats/error.h"
#include "host-tools/regression/network_training.h"
#include "host-tools/training/bank_training.h"
#include "host-tools/training/slopes.h"
#include "host-tools/training/verdict.h"

namespace compbox::training {

namespace {

constexpr std::size_t most_inputs = 64, most_outputs = 8;  // CB_BPNET_MAX_…

double as_float(double value) {
    return static_cast<double>(static_cast<float>(value));
}

Eigen::MatrixXd rounded(const Eigen::MatrixXd &values) {
    return values.unaryExpr(&as_float);
}

// Mean and spread of each column.
scaling scaling_of(const Eigen::MatrixXd &values) {
    const Eigen::VectorXd mean = values.colwise().mean();
    const Eigen::VectorXd square = (values.rowwise() - mean.transpose()).colwise().squaredNorm();
    const Eigen::VectorXd spread = (square / static_cast<double>(values.rows())).cwiseSqrt();
    return {rounded(mean), rounded(spread.cwiseMax(1e-6))};
}

Eigen::MatrixXd scaled(const scaling &by, const Eigen::MatrixXd &values) {
    return (values.rowwise() - by.centre.transpose()) * by.scale.cwiseInverse().asDiagonal();
}

Eigen::MatrixXd unscaled(const scaling &by, const Eigen::MatrixXd &values) {
    return (values * by.scale.asDiagonal()).rowwise() + by.centre.transpose();
}

model_rows chosen_rows(const model_rows &all, const std::vector<Eigen::Index> &rows) {
    model_rows some;
    some.x = all.x(rows, Eigen::all);
    some.y = all.y(rows, Eigen::all);
    for (const Eigen::Index r : rows) {
        some.run.push_back(all.run[static_cast<std::size_t>(r)]);
        some.source.push_back(all.source[static_cast<std::size_t>(r)]);
    }
    return some;
}

// Splits the rows into training rows and those of the held-out runs.
void split(train_result &result, const model_rows &all) {
    const auto &names = result.data.run_names;
    std::vector<bool> held(names.size(), false);
    for (const auto &name : result.options.hold_out) {
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end()) {
            std::string there;
            for (const auto &one : names) there += (there.empty() ? "" : ", ") + one;
            throw input_error(result.data.file, 0, 0, "has no run '{}' to hold out (it has {})",
                              name, there);
        }
        held[static_cast<std::size_t>(found - names.begin())] = true;
    }
    std::vector<Eigen::Index> learn, test;
    const std::vector<bool> &spoilt = result.data.spoilt;
    for (std::size_t r = 0; r < all.run.size(); ++r) {
        if (!spoilt.empty() && spoilt[all.source[r]]) continue;
        (held[all.run[r]] ? test : learn).push_back(static_cast<Eigen::Index>(r));
    }
    if (learn.size() < 10) {
        throw input_error(result.data.file, 0, 0,
                          "has fewer than 10 rows left to train on: hold out less");
    }
    result.learn = chosen_rows(all, learn);
    result.test = chosen_rows(all, test);
}

// Throws input_error for a name, inputs, outputs or hidden units that the box cannot take.
void check_sizes(const train_result &result) {
    if (!is_name_of_the_box(result.options.name)) {
        throw input_error("--name: the box cannot use the name '" + result.options.name +
                          "': it takes 1 to 23 letters A to Z, digits, _ - .");
    }
    const std::size_t inputs = result.plain_inputs(), outputs = result.data.outputs.size();
    if (result.options.for_comparison) return;
    if (inputs > most_inputs && !result.options.bank) {
        throw input_error(result.data.file, 0, 0,
                          "gives {} inputs with their lags; the box takes {}: choose fewer "
                          "(compbox select-inputs) or fewer lags",
                          inputs, most_inputs);
    }
    if (outputs > most_outputs) {
        throw input_error(result.data.file, 0, 0, "a network has at most 8 outputs, not {}",
                          outputs);
    }
    if (result.options.hidden > 64) {
        throw input_error("--hidden: the box takes at most 64 hidden units");
    }
}

bool fits_any(const std::string &name, const std::vector<std::string> &patterns) {
    return std::any_of(patterns.begin(), patterns.end(), [&](const std::string &pattern) {
        return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
    });
}

// As a fraction of the range. A slope's own column is no input of the box; its factors are held. So
// are the columns of a bank, from which their lags and powers follow.
double margin_of(const train_options &options, const model_input &input) {
    constexpr double unlimited = 1e6;
    if (input.is_slope()) return unlimited;
    if (options.bank && (input.tau_s > 0.0 || input.power > 1)) return unlimited;
    double margin = options.margin;
    for (const auto &one : options.margins) {
        if (fits_any(input.name, one.of)) margin = one.part;
    }
    return margin;
}

// in : range.low and range.high
// out: range.margin in the unit of each input; throws input_error for an unknown name of
//      --margin-of
void find_margins(train_result &result) {
    result.range.margin = result.range.high - result.range.low;
    for (std::size_t i = 0; i < result.inputs.size(); ++i) {
        result.range.margin[static_cast<Eigen::Index>(i)] *=
            margin_of(result.options, result.inputs[i]);
    }
    result.range.margin = rounded(result.range.margin);
    for (const auto &one : result.options.margins) {
        for (const auto &pattern : one.of) {
            const bool found =
                std::any_of(result.inputs.begin(), result.inputs.end(), [&](const auto &input) {
                    return !input.is_slope() && fits_any(input.name, {pattern});
                });
            if (!found) throw input_error("--margin-of: no input is called '" + pattern + "'");
        }
    }
}

// out: range.low, high and margin over the training rows; throws input_error for a constant input
void check_ranges(train_result &result) {
    result.range.low = rounded(result.learn.x.colwise().minCoeff().transpose());
    result.range.high = rounded(result.learn.x.colwise().maxCoeff().transpose());
    find_margins(result);
    for (std::size_t i = 0; i < result.inputs.size(); ++i) {
        const auto at = static_cast<Eigen::Index>(i);
        const double range = result.range.high[at] - result.range.low[at];
        constexpr double smallest = 4e-6;  // the box rejects an input_scale below 1e-6
        if (range > smallest) continue;
        if (result.options.bank && result.inputs[i].tau_s > 0.0) continue;
        throw input_error(result.data.file, 0, 0, "the input '{}' {}", result.inputs[i].name,
                          range > 0.0 ? "changes by less than 4e-6 in the runs trained on: give it "
                                        "in a smaller unit, or leave it out"
                                      : "does not change in the runs trained on: leave it out");
    }
}

void check_outputs(const train_result &result) {
    for (std::size_t k = 0; k < result.data.outputs.size(); ++k) {
        const auto column = result.learn.y.col(static_cast<Eigen::Index>(k));
        if (column.maxCoeff() > column.minCoeff()) continue;
        throw input_error(result.data.file, 0, 0,
                          "the output '{}' does not change in the runs trained on: leave it out",
                          result.data.outputs[k]);
    }
}

// Columns and lags, those of the hidden layer first; then slopes, which the hidden layer never
// uses.
void find_inputs(train_result &result) {
    const train_options &options = result.options;
    if (options.bank) {
        result.inputs = bank_inputs(result.data, result.data.speeds, result.tau_s);
        return;
    }
    result.inputs = model_inputs(result.data, options.lags);
    const auto first_unseen = std::stable_partition(
        result.inputs.begin(), result.inputs.end(), [&](const model_input &input) {
            return options.hidden_inputs.empty() || fits_any(input.name, options.hidden_inputs);
        });
    const auto seen = first_unseen - result.inputs.begin();
    for (const auto &pattern : options.hidden_inputs) {
        const bool found = std::any_of(result.inputs.begin(), first_unseen, [&](const auto &input) {
            return fits_any(input.name, {pattern});
        });
        if (!found) throw input_error("--hidden-inputs: no input is called '" + pattern + "'");
    }
    add_slopes(result.inputs, result.data, options.slopes);
    result.unseen = static_cast<Eigen::Index>(result.inputs.size()) - seen;
}

residuals residuals_of(const Eigen::MatrixXd &predicted, const Eigen::MatrixXd &measured) {
    residuals left;
    left.rows = static_cast<std::size_t>(measured.rows());
    if (left.rows == 0) return left;
    const Eigen::MatrixXd off = predicted - measured;
    left.rms = (off.colwise().squaredNorm() / static_cast<double>(left.rows)).cwiseSqrt();
    left.worst = off.cwiseAbs().colwise().maxCoeff();
    return left;
}

// in : judged.model; left_out: scaled predictions of each row by models without its run, or none
// out: the residuals of judged
void judge(judged_model &judged, const train_result &result, const Eigen::MatrixXd &left_out) {
    const scaling &out = judged.model.out;
    judged.trained =
        residuals_of(result.predict(judged.model, result.learn.x, result.learn), result.learn.y);
    if (result.test.x.rows() > 0) {
        const trained_range &range = result.range;
        const Eigen::MatrixXd free = result.predict(
            judged.model, result.options.bank ? result.test_held : range.held(result.test.x),
            result.test);
        judged.held_out =
            residuals_of(range.weight(result.test.x).asDiagonal() * free, result.test.y);
    }
    if (left_out.rows() == 0) return;
    judged.left_out_predictions = unscaled(out, left_out);
    if (result.options.zero_at_start) {
        judged.left_out_predictions =
            regression::from_starts(judged.left_out_predictions, starts_of(result.learn.run));
    }
    judged.left_out = residuals_of(judged.left_out_predictions, result.learn.y);
}

// All data in the network's scaled units.
struct scaled_rows {
    Eigen::MatrixXd x, t;
    regression::row_folds folds;
};

// out: a linear map in scaled units as a model with its parameters in float32
void take_map(train_result &result, const regression::linear_map &map) {
    trained_model &model = result.linear.model;
    model.shape = {map.weights.rows(), 0, map.weights.cols(), true, result.options.kind};
    model.parameters = Eigen::VectorXd::Zero(model.shape.count());
    regression::network_parts<double> parts(model.shape, model.parameters.data());
    parts.linear = map.weights.transpose();
    parts.bias2 = map.offset;
    model.parameters = rounded(model.parameters);
}

// out: as train_linear, of the mean of maps over the bank's inputs
void train_averaged(train_result &result, const scaled_rows &rows) {
    const regression::averaged_map mean = average_bank(result, rows.x, rows.t, rows.folds);
    const Eigen::MatrixXd logs = mean.decay.array().log().matrix();
    result.linear_decay = logs.cwiseProduct(mean.share).colwise().sum().array().exp();
    take_map(result, mean.map);
    judge(result.linear, result, mean.left_out);
}

// in : scaled rows; folds or evidence by result.by_folds
// out: result.linear, linear_decay and, with folds, the predictions of left-out rows
void train_linear(train_result &result, const scaled_rows &rows) {
    const regression::ridge_solver solver(rows.x, rows.t);
    Eigen::MatrixXd left_out;
    if (result.by_folds) {
        const regression::ridge_choice choice =
            regression::choose_by_folds(rows.x, rows.t, rows.folds);
        result.linear_decay = choice.decay;
        left_out = choice.left_out;
    } else {
        const auto evidence = solver.find_evidence();
        result.linear_decay = Eigen::VectorXd::Constant(rows.t.cols(), evidence.decay);
        result.linear.log_evidence = evidence.log_evidence;
    }
    take_map(result, solver.solve(result.linear_decay));
    judge(result.linear, result, left_out);
}

// At most `most` rows, one from each of as many intervals, at varying places in them. In points
// that were probed line by line, every k-th row would be the same columns of every line.
std::vector<Eigen::Index> thinned(Eigen::Index rows, int most) {
    constexpr double golden = 0.6180339887498949;
    std::vector<Eigen::Index> some;
    if (rows <= most) {
        for (Eigen::Index r = 0; r < rows; ++r) some.push_back(r);
        return some;
    }
    const double stretch = static_cast<double>(rows) / most;
    for (int i = 0; i < most; ++i) {
        const double part = std::fmod(golden * (i + 1), 1.0);
        some.push_back(std::min(rows - 1, static_cast<Eigen::Index>((i + part) * stretch)));
    }
    return some;
}

// in : some: indices of the rows in use
// out: the task with these rows and the user's options
regression::network_task task_of(const train_result &result, const scaled_rows &rows,
                                 const std::vector<Eigen::Index> &some) {
    const train_options &options = result.options;
    regression::network_task task;
    task.shape = {rows.x.cols(),       options.hidden, rows.t.cols(),
                  options.linear_path, options.kind,   result.unseen};
    task.x = rows.x(some, Eigen::all);
    task.t = rows.t(some, Eigen::all);
    for (const Eigen::Index r : some) {
        task.folds.fold.push_back(rows.folds.fold[static_cast<std::size_t>(r)]);
    }
    task.folds.count = rows.folds.count;
    task.starts = options.starts, task.seed = options.seed, task.threads = options.threads;
    task.way = options.way;
    task.max_iterations = options.max_iterations;
    task.progress = options.progress;
    return task;
}

// in : result.linear_decay from train_linear
// out: result.network with its parameters in float32, and the figures of its training
void train_network(train_result &result, const scaled_rows &rows) {
    const auto some = thinned(rows.x.rows(), result.options.max_rows);
    const regression::network_task task = task_of(result, rows, some);
    const regression::trained_network trained =
        result.by_folds ? regression::train_by_folds(task, result.linear_decay)
                        : regression::train_by_evidence(task, result.linear_decay[0]);
    trained_model &model = result.network.model;
    model.shape = task.shape;
    model.parameters = rounded(trained.parameters);
    result.network_decay = trained.decay;
    result.network_iterations = trained.iterations;
    result.network_loss = trained.loss;
    result.network_rows = some;
    result.network_inputs = result.inputs.size();
    result.best_start = trained.best_start;
    result.network.log_evidence = trained.log_evidence;
    judge(result.network, result, {});
    if (trained.left_out.rows() == 0) return;
    result.network.left_out_predictions = unscaled(model.out, trained.left_out);
    result.network.left_out =
        residuals_of(result.network.left_out_predictions, result.learn.y(some, Eigen::all));
}

}  // namespace

Eigen::MatrixXd trained_model::predict(const Eigen::MatrixXd &x) const {
    const Eigen::MatrixXd n = scaled(in, x).transpose();
    return unscaled(out, regression::predict(shape, parameters, n).transpose());
}

Eigen::MatrixXd trained_range::held(const Eigen::MatrixXd &x) const {
    const Eigen::RowVectorXd least = (low - margin).transpose(), most = (high + margin).transpose();
    return x.cwiseMax(least.replicate(x.rows(), 1)).cwiseMin(most.replicate(x.rows(), 1));
}

Eigen::VectorXd trained_range::weight(const Eigen::MatrixXd &x) const {
    const Eigen::RowVectorXd fade = 0.5 * (high - low).transpose();
    const Eigen::ArrayXXd beyond = (x - held(x)).cwiseAbs().array().rowwise() / fade.array();
    return (1.0 - beyond.rowwise().maxCoeff()).max(0.0);
}

std::size_t train_result::plain_inputs() const {
    return static_cast<std::size_t>(std::count_if(
        inputs.begin(), inputs.end(), [](const model_input &input) { return !input.is_slope(); }));
}

bool train_result::any_network() const {
    return std::find(network_better.begin(), network_better.end(), true) != network_better.end();
}

Eigen::MatrixXd train_result::predict(const trained_model &model, const Eigen::MatrixXd &x,
                                      const model_rows &of) const {
    const Eigen::MatrixXd predicted = model.predict(x);
    return options.zero_at_start ? regression::from_starts(predicted, starts_of(of.run))
                                 : predicted;
}

namespace {

// out: inputs, rows, ranges and scales; the models are not trained yet
void prepare(train_result &result) {
    prepare_options(result);
    find_inputs(result);
    check_sizes(result);
    check_slopes(result);
    split(result, rows_of(result.data, result.inputs, result.options.starts_of_lags));
    check_ranges(result);
    check_outputs(result);
    if (result.options.bank) hold_test_rows(result);
    result.largest = result.data.y.cwiseAbs().colwise().maxCoeff();
    scaling in = scaling_of(result.learn.x), out = scaling_of(result.learn.y);
    if (result.options.bank) {
        in.scale = rounded(bank_scales(result.learn.x, result.inputs, result.data.inputs));
    }
    if (result.options.zero_at_start) out.centre.setZero();
    for (judged_model *one : {&result.linear, &result.network}) {
        one->model.in = in, one->model.out = out;
    }
}

// One bank, or one map over given lags with its network.
train_result train_one(const training_data &data, const train_options &options) {
    train_result result;
    result.options = options;
    result.data = data;
    prepare(result);
    const bool bank_runs = options.bank || options.beside_bank;
    const scaled_rows rows{scaled(result.linear.model.in, result.learn.x),
                           scaled(result.linear.model.out, result.learn.y),
                           bank_runs ? bank_folds(result) : regression::folds_of(result.learn.run)};
    result.by_folds = bank_runs || options.regularise == regularisation::folds ||
                      (options.regularise == regularisation::automatic && rows.folds.usable());
    if (result.by_folds && !rows.folds.usable()) {
        throw input_error(data.file, 0, 0,
                          "cross-validation needs at least three runs to train on: name the column "
                          "of runs with --run-column, or choose --regularise evidence");
    }
    options.bank ? train_averaged(result, rows) : train_linear(result, rows);
    if (options.hidden > 0) train_network(result, rows);
    decide(result);
    return result;
}

// Whether the prior has no share in any output.
bool is_no_brother(const train_result &result) {
    return !result.drawn.empty() &&
           std::all_of(result.drawn.begin(), result.drawn.end(),
                       [](const prior_shares &share) { return share[0] == 1.0; });
}

// out: the bank without the prior, whose lags are those of its own record
train_result trained_alone(const training_data &data, const train_options &options,
                           const train_result &drawn) {
    train_options alone = options;
    alone.priors = nullptr;
    train_result result = train_one(data, alone);
    result.options.priors = options.priors, result.drawn = drawn.drawn;
    return result;
}

}  // namespace

train_result train(const training_data &data, const train_options &options) {
    train_options first = options;
    if (options.bank) first.hidden = 0;
    train_result result = train_one(data, first);
    if (is_no_brother(result)) result = trained_alone(data, first, result);
    const auto moments = options.moments ? std::optional(moments_of(result)) : std::nullopt;
    if (options.bank && options.hidden > 0 && !options.zero_at_start) {
        result = best_of(std::move(result), train_one, options);
    }
    result.moments = moments;
    if (!options.for_comparison) refuse_worse(result);
    return result;
}

}  // namespace compbox::training
