// SPDX-License-Identifier: MIT
// Output of the training: the fragment for `build`, tables for a person, predictions row by row.
#include <algorithm>
#include <cmath>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/numbers.h"
#include "host-tools/training/bank.h"
#include "host-tools/training/bank_sigma.h"
#include "host-tools/training/slopes.h"
#include "host-tools/training/train.h"

namespace compbox::training {

namespace {

template <typename vector>
json numbers(const vector &values) {
    json list = json::array();
    for (Eigen::Index i = 0; i < values.size(); ++i)
        list.push_back(formats::short_float(values[i]));
    return list;
}

template <typename matrix>
json rows(const matrix &values) {
    json list = json::array();
    for (Eigen::Index r = 0; r < values.rows(); ++r) list.push_back(numbers(values.row(r)));
    return list;
}

// The unit of a column's power; at most 7 bytes, the box's limit.
std::string unit_of(const std::string &column, int power) {
    const std::string unit = training::unit_of(column);
    return power == 2 && unit != "1" ? unit + "^2" : unit;
}

json signals_of(const train_result &result) {
    json signals = json::array();
    if (result.options.bank) return signals;  // its lags are the term's own
    for (const auto &input : result.inputs) {
        if (input.tau_s == 0.0 || input.is_slope()) continue;
        const std::string &column = result.data.inputs[input.column];
        json lag{{"name", input.name},
                 {"unit", unit_of(column, input.power)},
                 {"lag_of", column},
                 {"tau_s", formats::short_float(input.tau_s)}};
        if (input.power != 1) lag["power"] = input.power;
        signals.push_back(lag);
    }
    return signals;
}

// The box has no network without a hidden unit, so a linear map gets one of weight zero.
void add_empty_layer(json &term, Eigen::Index inputs, Eigen::Index outputs) {
    term["activation"] = "tansig";
    term["hidden_weights"] = rows(Eigen::MatrixXd::Zero(1, inputs));
    term["hidden_bias"] = json::array({0.0});
    term["output_weights"] = rows(Eigen::MatrixXd::Zero(outputs, 1));
}

// Inputs that the hidden layer does not use get weight zero.
void add_layers(json &term, const trained_model &model, const plain_linear &linear) {
    const regression::network_parts<const double> net(model.shape, model.parameters.data());
    const Eigen::Index inputs = linear.weights.cols();
    if (model.shape.hidden == 0) {
        add_empty_layer(term, inputs, model.shape.outputs);
    } else {
        Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(model.shape.hidden, inputs);
        weights.leftCols(model.shape.seen()) = net.weight1;
        term["activation"] =
            model.shape.kind == regression::activation::tansig ? "tansig" : "logsig";
        term["hidden_weights"] = rows(weights);
        term["hidden_bias"] = numbers(net.bias1);
        term["output_weights"] = rows(net.weight2);
    }
    term["output_bias"] = numbers(linear.bias);
    if (model.shape.linear) term["linear_weights"] = rows(linear.weights);
}

// out: the term of type bpnet with the chosen model, without slopes (docs/coefficient-file.md)
json term_of(const train_result &result) {
    const trained_model &model = result.chosen;
    json term{{"name", result.options.name}, {"type", "bpnet"}};
    term["outputs"] = result.data.outputs;
    const auto plain = static_cast<Eigen::Index>(result.plain_inputs());
    for (Eigen::Index i = 0; i < plain; ++i) {
        term["inputs"].push_back(result.inputs[static_cast<std::size_t>(i)].name);
    }
    add_layers(term, model, linear_without_slopes(result));
    term["input_center"] = numbers(model.in.centre.head(plain));
    term["input_scale"] = numbers(model.in.scale.head(plain));
    term["output_center"] = numbers(model.out.centre);
    term["output_scale"] = numbers(model.out.scale);
    term["input_min"] = numbers(result.range.low.head(plain));
    term["input_max"] = numbers(result.range.high.head(plain));
    term["margin"] = numbers(result.range.margin.head(plain));
    return term;
}

// Each output's weights in its unit per unit of the columns, and its bias, from the scaled map.
void add_weights(json &bank, const trained_model &model) {
    const regression::network_parts<const double> net(model.shape, model.parameters.data());
    for (Eigen::Index k = 0; k < model.shape.outputs; ++k) {
        const Eigen::RowVectorXd weights =
            model.out.scale[k] * net.linear.row(k) * model.in.scale.cwiseInverse().asDiagonal();
        bank["weights"].push_back(numbers(weights));
        bank["bias"].push_back(formats::short_float(model.out.centre[k] +
                                                    model.out.scale[k] * net.bias2[k] -
                                                    weights.dot(model.in.centre)));
    }
}

// out: the term of type linear with a bank (docs/coefficient-file.md), whose columns are the inputs
json bank_of(const train_result &result) {
    json bank;
    for (std::size_t i = 0; i < result.inputs.size(); ++i) {
        const model_input &input = result.inputs[i];
        const auto at = static_cast<Eigen::Index>(i);
        const std::string &name = result.data.inputs[input.column];
        if (input.tau_s > 0.0) continue;
        if (input.power > 1) {
            if (input.power == 2) bank["powers"][name] = {1};
            bank["powers"][name].push_back(input.power);
            continue;
        }
        bank["inputs"].push_back(name);
        bank["input_min"].push_back(formats::short_float(result.range.low[at]));
        bank["input_max"].push_back(formats::short_float(result.range.high[at]));
        bank["margin"].push_back(formats::short_float(result.range.margin[at]));
    }
    bank["tau_s"] = {0};
    for (const double tau_s : result.tau_s) bank["tau_s"].push_back(formats::short_float(tau_s));
    add_weights(bank, result.linear.model);
    return {{"name", result.options.name},
            {"type", "linear"},
            {"outputs", result.data.outputs},
            {"bank", bank}};
}

// out: how far the bank's prediction may be off, as the box computes it (models/sigma.h)
json sigma_json(const train_result &result) {
    const bank_sigma sigma = sigma_of_bank(result);
    const auto digits = [](const auto &values) {
        json list = json::array();
        for (Eigen::Index i = 0; i < values.size(); ++i) {
            list.push_back(formats::five_digits(values[i]));
        }
        return list;
    };
    json directions = json::array();
    for (Eigen::Index k = 0; k < sigma.offset.size(); ++k) {
        directions.push_back(digits(sigma.weights.row(k)));
    }
    return {{"floor_um", digits(sigma.floor_um)},
            {"along_um", digits(sigma.along_um)},
            {"offsets", numbers(sigma.offset)},
            {"directions", directions}};
}

// The slopes along the same positions as outputs of a separate term, which is held and faded like
// the first: output k in um per mm is the sum of gains times (input - from). Along several
// positions these are inputs of weight zero, so that the term fades beyond their range too.
json slopes_term(const train_result &result, const model_input &slope,
                 const std::string &position) {
    const trained_model &model = result.chosen;
    std::vector<slope_gain> gains;
    for (const auto &gain : slope_gains(result)) {
        if (gain.along == slope.along) gains.push_back(gain);
    }
    const auto outputs = static_cast<Eigen::Index>(result.data.outputs.size());
    const auto inputs = static_cast<Eigen::Index>(gains.size());
    json term{{"name", fmt::format("{}_per_{}", result.options.name, position)}, {"type", "bpnet"}};
    for (const auto &name : result.data.outputs)
        term["outputs"].push_back(fmt::format("{}_per_{}", name, position));
    std::vector<Eigen::Index> plain;
    Eigen::MatrixXd weights(outputs, inputs);
    Eigen::VectorXd bias = Eigen::VectorXd::Zero(outputs);
    for (Eigen::Index i = 0; i < inputs; ++i) {
        const slope_gain &gain = gains[static_cast<std::size_t>(i)];
        plain.push_back(gain.input);
        term["inputs"].push_back(result.inputs[static_cast<std::size_t>(gain.input)].name);
        weights.col(i) = gain.um_per_mm * model.in.scale[gain.input];
        bias += gain.um_per_mm * (model.in.centre[gain.input] - gain.from);
    }
    for (const Eigen::Index at : distinct_positions(result, slope)) {
        if (std::find(plain.begin(), plain.end(), at) != plain.end()) continue;
        plain.push_back(at);
        term["inputs"].push_back(result.inputs[static_cast<std::size_t>(at)].name);
        weights.conservativeResize(Eigen::NoChange, weights.cols() + 1);
        weights.rightCols(1).setZero();
    }
    add_empty_layer(term, weights.cols(), outputs);
    term["output_bias"] = numbers(bias);
    term["linear_weights"] = rows(weights);
    term["input_center"] = numbers(model.in.centre(plain));
    term["input_scale"] = numbers(model.in.scale(plain));
    term["input_min"] = numbers(result.range.low(plain));
    term["input_max"] = numbers(result.range.high(plain));
    term["margin"] = numbers(result.range.margin(plain));
    return term;
}

// in : slope: along one position or several
// out: a product for each output and position; each but the first multiplies the one before it
void add_products(json &terms, const train_result &result, const model_input &slope,
                  const std::string &position) {
    for (const auto &name : result.data.outputs) {
        std::string factor = fmt::format("{}_per_{}", name, position);
        for (std::size_t k = 0; k < slope.along.size(); ++k) {
            const bool last = k + 1 == slope.along.size();
            const std::string product = last ? fmt::format("{}_by_{}", name, position)
                                             : fmt::format("{}_{}_{}", name, position, k + 1);
            terms.push_back(
                {{"name", product},
                 {"type", "product"},
                 {"term", factor},
                 {"signal", result.data.inputs[static_cast<std::size_t>(slope.along[k])]},
                 {"origin", formats::short_float(slope.origin[k])}});
            factor = product;
        }
    }
}

// Adds the slopes' term for each position or product of positions, and its products.
void add_slope_terms(json &terms, const train_result &result) {
    std::vector<std::vector<int>> done;
    for (const auto &input : result.inputs) {
        if (!input.is_slope() || std::find(done.begin(), done.end(), input.along) != done.end()) {
            continue;
        }
        done.push_back(input.along);
        const std::string position = positions_of(result, input);
        terms.push_back(slopes_term(result, input, position));
        add_products(terms, result, input, position);
    }
}

json residuals_json(const residuals &left, const train_result &result) {
    json all;
    for (std::size_t k = 0; k < result.data.outputs.size(); ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        all[result.data.outputs[k]] = {
            {"rms", formats::five_digits(left.rms[at])},
            {"worst", formats::five_digits(left.worst[at])},
            {"worst_percent_of_largest",
             formats::five_digits(100.0 * left.worst[at] / result.largest[at])}};
    }
    return all;
}

json figures_of(const judged_model &judged, const train_result &result) {
    json all;
    if (judged.left_out.rows > 0) all["left_out"] = residuals_json(judged.left_out, result);
    if (judged.held_out.rows > 0) all["held_out"] = residuals_json(judged.held_out, result);
    all["trained"] = residuals_json(judged.trained, result);
    if (!result.by_folds) all["log_evidence"] = formats::five_digits(judged.log_evidence);
    return all;
}

std::size_t bank_lags(const train_result &result) {
    return static_cast<std::size_t>(
        std::count_if(result.inputs.begin(), result.inputs.end(),
                      [](const model_input &input) { return input.tau_s > 0.0; }));
}

// out: how far each output was drawn to the brothers
json prior_json(const train_result &result) {
    json found{{"machines", result.options.priors->machines}};
    for (std::size_t k = 0; k < result.drawn.size(); ++k) {
        const prior_shares &share = result.drawn[k];
        found["shares"][result.data.outputs[k]] = {{"own", formats::five_digits(share[0])},
                                                   {"mean", formats::five_digits(share[1])},
                                                   {"shrunk", formats::five_digits(share[2])}};
    }
    return found;
}

// out: the member of "provenance": data, runs, decays, figures of both models, warnings
json findings_of(const train_result &result) {
    json found;
    found["data"] = result.data.file.substr(result.data.file.find_last_of('/') + 1);
    found["rows"] = result.learn.x.rows();
    found["runs"] = result.data.run_names;
    if (!result.options.hold_out.empty()) found["runs_held_out"] = result.options.hold_out;
    found["decay_by"] = result.by_folds ? "leaving out runs" : "evidence";
    for (std::size_t k = 0; k < result.data.outputs.size(); ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        found["largest_error"][result.data.outputs[k]] = formats::five_digits(result.largest[at]);
        found["linear_decay"][result.data.outputs[k]] =
            formats::five_digits(result.linear_decay[at]);
    }
    if (result.options.bank) {
        found["bank"] = {{"inputs", result.data.inputs},
                         {"speeds", result.data.speeds},
                         {"tau_s", result.tau_s},
                         {"lags", bank_lags(result)},
                         {"averaged_maps", bank_members(result.inputs).size()},
                         {"zero_at_start", result.options.zero_at_start}};
    }
    if (!result.drawn.empty()) found["prior"] = prior_json(result);
    found["linear"] = figures_of(result.linear, result);
    if (result.options.hidden > 0) {
        json network = figures_of(result.network, result);
        network["hidden"] = result.options.hidden;
        network["rows"] = result.network_rows.size();
        network["optimiser"] =
            result.options.way == regression::optimiser::lbfgs ? "l-bfgs" : "levenberg-marquardt";
        network["decay"] = formats::five_digits(result.network_decay);
        network["iterations"] = result.network_iterations;
        network["loss"] = formats::five_digits(result.network_loss);
        network["start"] = result.best_start + 1;
        network["seed"] = result.options.seed;
        found["network"] = network;
    }
    found["written"] = figures_of(result.chosen_figures, result);
    found["written"].erase("log_evidence");
    found["verdict"] = result.verdict;
    if (!result.warnings.empty()) found["warnings"] = result.warnings;
    return found;
}

// ---- for a person ----

// " worst 12.3 %  rms 1.234" of one output.
std::string cell(const residuals &left, const train_result &result, Eigen::Index k) {
    if (left.rows == 0) return std::string(22, ' ');
    return fmt::format("{:10.1f} %{:10.3f}", 100.0 * left.worst[k] / result.largest[k],
                       left.rms[k]);
}

// A cell of a CSV, in quotes if needed.
std::string quoted(const std::string &text) {
    return text.find_first_of(",; \t") == std::string::npos ? text : fmt::format("\"{}\"", text);
}

void add_table(std::string &text, const train_result &result, const std::string &title,
               residuals judged_model::*which) {
    if ((result.linear.*which).rows == 0) return;
    const bool network = result.options.hidden > 0;
    text += fmt::format(
        "\n{}\n"
        "                     largest        linear map{}\n"
        "  output             |error|     worst       rms{}\n",
        title, network ? "               network" : "", network ? "     worst       rms" : "");
    for (std::size_t k = 0; k < result.data.outputs.size(); ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        text += fmt::format("  {:16}{:10.3f}{}", result.data.outputs[k], result.largest[at],
                            cell(result.linear.*which, result, at));
        if (network) text += cell(result.network.*which, result, at);
        text += "\n";
    }
}

// out: what the bank holds, and what was averaged
std::string bank_text(const train_result &result) {
    std::string text = "bank: each input unlagged";
    if (!result.tau_s.empty()) {
        text += fmt::format(" and with {} lags from {} s to {} s", result.tau_s.size(),
                            result.tau_s.front(), result.tau_s.back());
    }
    for (const auto &name : result.data.speeds) text += fmt::format("; {} to its cube", name);
    return text +
           fmt::format(
               "; {} of the box's {} lags\nmean of {} linear maps over parts of it, "
               "by what they leave of the runs left out{}\n",
               bank_lags(result), most_bank_lags, bank_members(result.inputs).size(),
               result.options.zero_at_start ? "; errors count from each run's first row" : "");
}

// out: a line for each output that was drawn to brothers
std::string prior_text(const train_result &result) {
    std::string text;
    for (std::size_t k = 0; k < result.drawn.size(); ++k) {
        const prior_shares &share = result.drawn[k];
        text += fmt::format(
            "{}: {:.0f} % of this machine's own map, {:.0f} % of the mean of {} others of its "
            "type, "
            "{:.0f} % of the most probable map between them\n",
            result.data.outputs[k], 100.0 * share[0], 100.0 * share[1],
            result.options.priors->machines, 100.0 * share[2]);
    }
    return text;
}

// out: the report's first lines: data, decay, structure and training of the network
std::string header_of(const train_result &result) {
    std::string text = fmt::format(
        "{} from {}: {} columns, {} inputs with lags, {} outputs; {} rows to train on, {} runs",
        result.options.name, result.data.file, result.data.inputs.size(), result.inputs.size(),
        result.data.outputs.size(), result.learn.x.rows(), result.data.run_names.size());
    if (!result.options.hold_out.empty()) {
        text += fmt::format(", {} of them held out", result.options.hold_out.size());
    }
    text += "\nweight decay ";
    text += result.by_folds ? "by leaving out one run after the other\n" : "by evidence\n";
    if (result.options.bank) text += bank_text(result) + prior_text(result);
    if (result.options.hidden > 0) {
        text += fmt::format(
            "network: {}-{}-{}{}, on {} rows, {} iterations, start {} of {}, loss {:.4g}\n",
            result.network_inputs, result.options.hidden, result.data.outputs.size(),
            result.options.linear_path ? " beside a linear path" : "", result.network_rows.size(),
            result.network_iterations, result.best_start + 1, result.options.starts,
            result.network_loss);
    }
    return text;
}

}  // namespace

json fragment_of(const train_result &result) {
    json fragment;
    fragment["signals"] = signals_of(result);
    fragment["terms"] = json::array({result.options.bank ? bank_of(result) : term_of(result)});
    if (has_sigma(result)) fragment["terms"][0]["sigma"] = sigma_json(result);
    add_slope_terms(fragment["terms"], result);
    fragment["provenance"] = json{{result.options.name, findings_of(result)}};
    return fragment;
}

std::string report_of(const train_result &result) {
    std::string text = header_of(result);
    add_table(text, result,
              "Residuals of each run when left out of training (worst: part of the "
              "largest error)",
              &judged_model::left_out);
    add_table(text, result, "Residuals of the held-out runs, as the box would leave them",
              &judged_model::held_out);
    add_table(text, result, "Residuals of the training rows", &judged_model::trained);
    text += "\n" + result.verdict + "\n";
    for (const auto &warning : result.warnings) text += fmt::format("note: {}\n", warning);
    return text;
}

std::string predictions_csv(const train_result &result) {
    const training_data &data = result.data;
    std::string text = data.time_s.empty() ? "run" : "time_s,run";
    for (const auto &name : data.outputs) text += fmt::format(",{},{}_predicted", name, name);
    const auto starts = result.options.starts_of_lags;
    const model_rows all =
        rows_of(data, result.inputs, starts == lag_starts::both ? lag_starts::once : starts);
    const Eigen::MatrixXd predicted = result.predict(result.chosen, all.x, all);
    std::vector<std::string> lines(data.rows());
    for (std::size_t r = 0; r < data.rows(); ++r) {
        const auto at = static_cast<Eigen::Index>(r);
        std::string line = data.time_s.empty() ? "" : fmt::format("{},", data.time_s[r]);
        line += quoted(data.run_names[data.run[r]]);
        for (Eigen::Index k = 0; k < predicted.cols(); ++k) {
            line += fmt::format(",{},{}", data.y(at, k), predicted(at, k));
        }
        lines[data.file_row.empty() ? r : data.file_row[r]] = line;
    }
    for (const auto &line : lines) text += "\n" + line;
    return text + "\n";
}

}  // namespace compbox::training
