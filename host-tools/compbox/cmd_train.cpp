// SPDX-License-Identifier: MIT
// compbox train: rows of inputs and errors to a network or a linear map, whichever is better.
#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <sstream>

#include "host-tools/adaptation/adaptation.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/progress.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/training/select_inputs.h"
#include "host-tools/training/train.h"

namespace compbox {

namespace {

struct train_arguments {
    std::string data, output, plot, predictions, prior, moments;
    std::vector<std::string> choices;  // of select-inputs
    training::data_options columns;
    training::train_options options;
    std::vector<std::string> slopes;   // "X:T1,T2"
    std::vector<std::string> margins;  // "T*:3"
    double margin = -1.0;              // not given
    bool as_json = false, no_linear_path = false;
    adaptation::adapt_options adapt;

    bool simulates_probes() const { return adapt.write || !adapt.intervals_min.empty(); }

    // Whether the options ask for a map over given lags, or for a network with its own linear path,
    // instead of a bank.
    bool asks_for_map() const {
        return !options.lags.lags_s.empty() || !options.lags.squares.empty() || !slopes.empty() ||
               !options.hidden_inputs.empty() || no_linear_path || options.keep_network ||
               options.regularise == training::regularisation::evidence;
    }
};

constexpr const char *train_example =
    R"(Leaves out one run after the other to choose the weight decay. Prints the residual of the left-out
runs for the network and for a linear map of the same inputs. Writes the better one, with its lags,
as a term for `compbox build`. * in a name matches any text.

Example:
  compbox train warmup.csv --outputs ez_um --inputs 't*_degC,rpm' --lags 600,1800 --run-column run \
      --name net -o net.json)";

// in : "X:T1,T2" or "X*X*Z:T1,T2". out: `along` is empty without a colon
training::slope_option parse_slope(const std::string &text) {
    training::slope_option slope;
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos) return slope;
    std::istringstream positions(text.substr(0, colon)), rest(text.substr(colon + 1));
    for (std::string name; std::getline(positions, name, '*');) slope.along.push_back(name);
    for (std::string name; std::getline(rest, name, ',');) slope.of.push_back(name);
    return slope;
}

// in : "T*,rpm:3". out: nothing for another form
std::optional<training::margin_option> margin_of(const std::string &text) {
    training::margin_option margin;
    const std::size_t colon = text.rfind(':');
    if (colon == std::string::npos) return std::nullopt;
    std::istringstream names(text.substr(0, colon)), part(text.substr(colon + 1));
    for (std::string name; std::getline(names, name, ',');) margin.of.push_back(name);
    const bool good = static_cast<bool>(part >> margin.part) && part.eof() && margin.part >= 0.0 &&
                      margin.part <= 10.0 && !margin.of.empty();
    return good ? std::optional(margin) : std::nullopt;
}

// Trains, and writes the term and the predictions. Throws input_error that names the file.
void run_train(train_arguments &arguments, const cli::streams &io) {
    training::train_options &options = arguments.options;
    for (auto *names : {&options.lags.only, &options.lags.squares, &options.hidden_inputs}) {
        *names = training::own_names(*names);
    }
    for (const auto &text : arguments.margins) options.margins.push_back(*margin_of(text));
    for (const auto &text : arguments.slopes) options.slopes.push_back(parse_slope(text));
    const bool has_record = !arguments.columns.record.empty();
    if (has_record && options.starts_of_lags != training::lag_starts::both) {
        options.starts_of_lags = training::lag_starts::once;
    }
    for (const auto &choice : arguments.choices) {
        for (const auto &name : training::inputs_of_choice(choice)) {
            arguments.columns.inputs.push_back(name);
        }
    }
    options.linear_path = !arguments.no_linear_path;
    options.bank = !arguments.asks_for_map();
    options.margin = arguments.margin >= 0.0 ? arguments.margin : options.bank ? 1.0 : 0.1;
    arguments.columns.find_runs = arguments.columns.time_if_there = options.bank;
    arguments.columns.needs_time = has_record || !options.lags.lags_s.empty() ||
                                   !options.lags.squares.empty() || arguments.simulates_probes();
    if (!arguments.prior.empty()) {
        options.priors =
            std::make_shared<training::bank_priors>(training::read_priors(arguments.prior));
    }
    options.moments = !arguments.moments.empty();
    options.progress = cli::progress_bar_of(io, "training", "loss");
    const training::training_data data =
        training::read_training_data(arguments.data, arguments.columns);
    const training::train_result result = training::train(data, options);
    if (!arguments.plot.empty()) training::plot_training(result, arguments.plot);
    if (!arguments.predictions.empty())
        formats::write_file(arguments.predictions, training::predictions_csv(result), &io.out);
    if (result.moments) {
        const json moments = training::json_of(*result.moments);
        formats::write_file(arguments.moments, formats::json_text(moments), &io.out);
    }
    json fragment = training::fragment_of(result);
    std::string report = training::report_of(result);
    if (arguments.simulates_probes()) {
        const auto adapted = adaptation::adapt_outputs(result, arguments.adapt);
        adaptation::add_adapt_terms(fragment, adapted, result, arguments.adapt);
        report += adaptation::adapt_text(adapted, arguments.adapt);
    }
    formats::write_file(arguments.output, formats::json_text(fragment), &io.out);
    if (cli::on_stdout({arguments.output, arguments.predictions, arguments.moments})) return;
    io.out << (arguments.as_json ? formats::json_text(fragment) : report);
}

// Throws usage_error for options of probes without any probe, and for intervals that do not rise.
void check_probes(const train_arguments &arguments) {
    const adaptation::adapt_options &adapt = arguments.adapt;
    const auto &minutes = adapt.intervals_min;
    if (std::adjacent_find(minutes.begin(), minutes.end(), std::greater_equal<double>()) !=
        minutes.end()) {
        throw cli::usage_error("--simulate-probes", "the intervals must rise, as in 30,60,120");
    }
    if (adapt.write) return;
    for (const auto &[option, used] : {std::pair{"--probe-value", !adapt.values.empty()},
                                       std::pair{"--probe-count", !adapt.counts.empty()},
                                       std::pair{"--probe-whole", adapt.measures_whole}}) {
        if (used) throw cli::usage_error(option, "is for --adapt");
    }
    if (adapt.sigma_um > 0.0 && minutes.empty()) {
        throw cli::usage_error("--probe-sigma-um", "is for --adapt and --simulate-probes");
    }
}

// Throws usage_error for invalid combinations of options.
void check_usage(const train_arguments &arguments) {
    check_probes(arguments);
    const training::lag_options &lags = arguments.options.lags;
    cli::different_files({{"-o", arguments.output},
                          {"--predictions", arguments.predictions},
                          {"--moments", arguments.moments},
                          {"--plot", arguments.plot}});
    if (!lags.only.empty() && lags.lags_s.empty()) {
        throw cli::usage_error("--lag-only", "needs --lags");
    }
    if (arguments.options.hidden == 0 && arguments.no_linear_path) {
        throw cli::usage_error("--no-linear-path", "leaves nothing beside --hidden 0");
    }
    if (arguments.options.way == regression::optimiser::levenberg_marquardt &&
        arguments.options.regularise != training::regularisation::evidence) {
        throw cli::usage_error("--optimiser",
                               "levenberg-marquardt needs --regularise evidence: leaving out "
                               "runs counts the steps of L-BFGS");
    }
    const bool bank = !arguments.asks_for_map();
    if (!arguments.columns.record.empty() && lags.lags_s.empty() && lags.squares.empty() && !bank) {
        throw cli::usage_error("--record", "needs --lags: it is there for them");
    }
    if (!bank && arguments.options.zero_at_start) {
        throw cli::usage_error("--zero-at-start",
                               "is for a bank: leave out --lags, --squares, "
                               "--slope and the options of a network");
    }
    for (const auto &[option, used] : {std::pair{"--prior", !arguments.prior.empty()},
                                       std::pair{"--moments", !arguments.moments.empty()}}) {
        if (bank || !used) continue;
        throw cli::usage_error(option, "is for a bank: leave out the options of another map");
    }
    if (!bank && !arguments.columns.speeds.empty()) {
        throw cli::usage_error("--speeds", "is for a bank; with --lags name them in --squares");
    }
    for (const auto &text : arguments.slopes) {
        const training::slope_option slope = parse_slope(text);
        if (!slope.along.empty() && !slope.of.empty()) continue;
        throw cli::usage_error("--slope", fmt::format("'{}' is not POSITION:INPUT,INPUT", text));
    }
    for (const auto &text : arguments.margins) {
        if (margin_of(text)) continue;
        throw cli::usage_error("--margin-of",
                               "'" + text + "' is not INPUT,INPUT:PART with a part from 0 to 10");
    }
    if (!arguments.slopes.empty() && arguments.no_linear_path) {
        throw cli::usage_error("--slope", "is part of the linear path");
    }
    const training::lag_starts starts = arguments.options.starts_of_lags;
    if ((starts == training::lag_starts::once || starts == training::lag_starts::both) && !bank &&
        arguments.columns.run_column.empty()) {
        throw cli::usage_error("--lags-start", "needs --run-column");
    }
}

// Options that name inputs, outputs, time and runs.
void add_columns(cli::command &train, train_arguments &arguments) {
    training::data_options &columns = arguments.columns;
    train.add_option("DATA", arguments.data, "Rows to train on, DATA.csv").required();
    train
        .add_option("--outputs A,B", columns.outputs, "Columns with errors, um: the term's outputs")
        .required()
        .delimiter(',');
    train
        .add_option("--inputs C,D", columns.inputs,
                    "Columns that the box will have as signals (all that may be inputs)")
        .delimiter(',');
    train.add_option("--inputs-of CHOICE.json", arguments.choices,
                     "Inputs that select-inputs chose (its -o), after those of --inputs; may be "
                     "given several times");
    train
        .add_option("--speeds C,D", columns.speeds,
                    "Inputs taken to their square and cube too (those with rpm, speed or Drehzahl "
                    "in their names)")
        .delimiter(',');
    train.add_flag("--zero-at-start", arguments.options.zero_at_start,
                   "Errors count from the first row of each run, as in logs that begin at zero");
    train.add_option("--prior PRIOR.json", arguments.prior,
                     "What other machines of this type know (compbox prior): the own bank is drawn "
                     "to them as far as the runs left out show");
    train.add_option("--moments F.json", arguments.moments,
                     "Write what `compbox prior` needs to know of this machine");
    train.add_option(
        "--run-column NAME", columns.run_column,
        "A new run begins where this column changes: lags start anew (--lags-start), and "
        "decay is chosen by leaving out whole runs");
    train.add_option("--time-column NAME", columns.time_column, "Seconds (time_s); lags need it");
    train
        .add_option("--hold-out RUN,RUN", arguments.options.hold_out,
                    "Runs that are never trained on, only judged by: values of the run column "
                    "(#2: where it comes back)")
        .delimiter(',');
}

// Options of lagged and squared inputs, record and slopes; time constants in s.
void add_lags(cli::command &train, train_arguments &arguments) {
    training::lag_options &lags = arguments.options.lags;
    train
        .add_option("--lags TAU,TAU", lags.lags_s,
                    "Time constants, s, of one map with these lags, instead of the bank")
        .delimiter(',')
        .check(cli::between(0.001, 86400));
    train.add_option("--lag-only C,D", lags.only, "Inputs that lag (all)").delimiter(',');
    train.add_option("--squares C,D", lags.squares, "Inputs whose square is taken too, and lagged")
        .delimiter(',');
    train.add_option("--record RECORD.csv", arguments.columns.record,
                     "What the box recorded around the rows: lags follow it from its beginning");
    train.add_option(
        "--slope X:T1,T2", arguments.slopes,
        "The error's slope along a position is linear in these inputs, as the control's "
        "tan beta is in temperature (* matches any text); X*X*Z: along a product of positions; may "
        "be given several times");
    const std::map<std::string, training::lag_starts> starts = {
        {"run", training::lag_starts::each_run},
        {"once", training::lag_starts::once},
        {"both", training::lag_starts::both}};
    train.add_choice(
        "--lags-start HOW", arguments.options.starts_of_lags, starts,
        "run: lags start anew with each run; once: the runs are one record; both: each "
        "row counts both ways (default of a bank from one record; else run)");
}

// Options of the network beside the linear map.
void add_network(cli::command &train, train_arguments &arguments) {
    training::train_options &options = arguments.options;
    train.add_option("--hidden N", options.hidden, "Hidden units (10); 0: the linear map alone")
        .check(cli::whole_between(0, 64));
    train
        .add_option("--hidden-inputs C,D", options.hidden_inputs,
                    "What the hidden layer sees (all); the others go to the linear path alone")
        .delimiter(',');
    const std::map<std::string, regression::activation> kinds = {
        {"tansig", regression::activation::tansig}, {"logsig", regression::activation::logsig}};
    train.add_choice("--activation F", options.kind, kinds, "tansig (default) or logsig");
    train.add_flag("--no-linear-path", arguments.no_linear_path,
                   "Network without the linear path beside its hidden layer");
    train.add_flag("--keep-network", options.keep_network,
                   "Write the network even where the linear map is better");
    train.add_flag("--accept-worse", options.accept_worse,
                   "Write a model that runs left out show to be worse than no compensation");
    const std::map<std::string, training::regularisation> ways = {
        {"auto", training::regularisation::automatic},
        {"runs", training::regularisation::folds},
        {"evidence", training::regularisation::evidence}};
    train.add_choice("--regularise WAY", options.regularise, ways,
                     "Weight decay by runs (leaving them out), evidence, or auto: runs where there "
                     "are three");
}

// Options of the optimiser.
void add_search(cli::command &train, train_arguments &arguments) {
    training::train_options &options = arguments.options;
    const std::map<std::string, regression::optimiser> optimisers = {
        {"l-bfgs", regression::optimiser::lbfgs},
        {"levenberg-marquardt", regression::optimiser::levenberg_marquardt}};
    train.add_choice("--optimiser WAY", options.way, optimisers,
                     "l-bfgs (default), or levenberg-marquardt for a small network on data almost "
                     "without noise, with --regularise evidence");
    train.add_option("--starts N", options.starts, "Random starts (5)")
        .check(cli::whole_between(1, 1000));
    train.add_option("--seed N", options.seed, "Of the starts (1): the same seed, the same term")
        .check(cli::whole_between(0, std::numeric_limits<long>::max()));
    train
        .add_option("--threads N", options.threads,
                    "Threads (as many as there are processors); the result does not depend on it")
        .check(cli::whole_between(0, 256));
    train.add_option("--iterations N", options.max_iterations, "At most so many (300)")
        .check(cli::whole_between(1, 100000));
    train
        .add_option("--rows N", options.max_rows,
                    "The network is trained on at most so many rows, spread over all (2000)")
        .check(cli::whole_between(10, 1000000));
}

// Options of extrapolation beyond the trained range.
void add_margins(cli::command &train, train_arguments &arguments) {
    train
        .add_option("--margin PART", arguments.margin,
                    "Extrapolate an input no further than this part of its trained range (1 of a "
                    "bank, else 0.1)")
        .check(cli::between(0, 10));
    train.add_option("--margin-of C,D:PART", arguments.margins,
                     "Another margin for some inputs (* matches any text); may be given several "
                     "times, the last that fits counts");
}

// Options of simulated probes and of the terms that a probe adapts.
void add_probes(cli::command &train, train_arguments &arguments) {
    adaptation::adapt_options &adapt = arguments.adapt;
    train
        .add_option("--simulate-probes M,M", adapt.intervals_min,
                    "Print what a probe every so many minutes would leave of the runs left out, "
                    "with the box's own filter")
        .delimiter(',')
        .check(cli::between(1, 10080));
    train.add_flag("--adapt", adapt.write,
                   "Write an adapt term for each output, with bounds from what the model leaves of "
                   "the runs left out (simulates probes every 30 and 60 min)");
    train
        .add_option(
            "--probe-value P,Q", adapt.values,
            "Signals with the probed values, um, one for each output (probe_x of error_X_um, else "
            "probe_OUTPUT)")
        .delimiter(',');
    train
        .add_option("--probe-count P,Q", adapt.counts,
                    "Signals that count the measurements (the values' names with _n)")
        .delimiter(',');
    train.add_flag("--probe-whole", adapt.measures_whole,
                   "The probe shows the whole error: nothing is compensated while it measures");
    train
        .add_option("--probe-sigma-um S", adapt.sigma_um,
                    "Standard deviation of one measurement (from the record)")
        .check(cli::between(0.001, 1000));
}

}  // namespace

void add_train(cli::command &app) {
    auto arguments = std::make_shared<train_arguments>();
    cli::command train =
        app.add_subcommand("train", "Train a network on rows of inputs and errors");
    train.footer(train_example);
    add_columns(train, *arguments);
    add_lags(train, *arguments);
    add_network(train, *arguments);
    add_search(train, *arguments);
    add_margins(train, *arguments);
    add_probes(train, *arguments);
    train.add_option("--name NAME", arguments->options.name, "Name of the term").required();
    train.add_option("--predictions F.csv", arguments->predictions,
                     "CSV with the prediction for every row");
    train.add_option("--plot F.svg", arguments->plot, "Figure, F.svg, F.png or F.pdf");
    train.add_flag("--json", arguments->as_json, "Report as JSON (the fragment with its findings)");
    train.add_option("-o,--output TERM.json", arguments->output, "Term to write, TERM.json")
        .required();
    train.callback([arguments](const cli::streams &io) {
        check_usage(*arguments);
        run_train(*arguments, io);
    });
}

}  // namespace compbox
