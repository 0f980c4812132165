// SPDX-License-Identifier: MIT
// compbox select-inputs: of many sensors the few that a model needs.
#include <fmt/core.h>

#include <map>
#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/progress.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/training/select_inputs.h"

namespace compbox {

namespace {

struct select_arguments {
    std::string data, output, plot;
    training::data_options columns;
    training::select_options options;
    bool as_json = false;
};

constexpr const char *select_inputs_example =
    R"(Groups sensors with similar readings by fuzzy clustering of their correlations, grades each by its
grey relational grade to the errors, and chooses the best of each group. --check and --by-runs
judge by whole runs that were left out of a linear map, with the model's lags.

Example:
  compbox select-inputs warmup.csv --outputs ez_um --candidates 't*_degC' --count 4)";

// Chooses the inputs, writes the plot and the report, and prints it.
void run_select(select_arguments &arguments, const cli::streams &io) {
    training::select_options &options = arguments.options;
    const training::lag_options &lags = options.model.lags;
    arguments.columns.needs_time = !lags.lags_s.empty() || !lags.squares.empty();
    options.keep = training::own_names(options.keep);
    for (const auto &name : options.keep) arguments.columns.inputs.push_back(name);
    if (options.by_runs) options.progress = cli::progress_of(io, "choosing");
    const training::training_data data =
        training::read_training_data(arguments.data, arguments.columns);
    const training::selection result = training::select_inputs(data, options);
    if (!arguments.plot.empty()) training::plot_selection(result, arguments.plot);
    const json report = training::selection_json(result);
    if (!arguments.output.empty())
        formats::write_file(arguments.output, formats::json_text(report), &io.out);
    if (cli::on_stdout({arguments.output})) return;
    io.out << (arguments.as_json ? formats::json_text(report) : training::report_of(result));
}

// Throws usage_error for invalid combinations of options.
void check_usage(const select_arguments &arguments) {
    const training::select_options &options = arguments.options;
    cli::different_files({{"-o", arguments.output}, {"--plot", arguments.plot}});
    for (const auto &name : options.keep) {
        if (name.find('*') == std::string::npos) continue;
        throw cli::usage_error("--keep", fmt::format("'{}': name each column, without *", name));
    }
    if ((options.check || options.by_runs) && arguments.columns.run_column.empty()) {
        throw cli::usage_error(options.by_runs ? "--by-runs" : "--check",
                               "needs --run-column: runs are left out, never rows");
    }
}

// Options of the model that is to be trained: runs, lags, squares.
void add_model(cli::command &select, select_arguments &arguments) {
    training::train_options &model = arguments.options.model;
    select.add_option("--run-column NAME", arguments.columns.run_column,
                      "A new run begins where this column changes");
    select.add_option("--time-column NAME", arguments.columns.time_column, "Seconds (time_s)");
    select
        .add_option("--lags TAU,TAU", model.lags.lags_s,
                    "Time constants, s, that the model will have")
        .delimiter(',')
        .check(cli::between(0.001, 86400));
    select.add_option("--squares C,D", model.lags.squares, "Inputs whose square it will have")
        .delimiter(',');
    const std::map<std::string, training::lag_starts> starts = {
        {"run", training::lag_starts::each_run},
        {"once", training::lag_starts::once},
        {"both", training::lag_starts::both}};
    select.add_choice("--lags-start HOW", model.starts_of_lags, starts, "As for compbox train");
}

}  // namespace

void add_select_inputs(cli::command &app) {
    auto arguments = std::make_shared<select_arguments>();
    training::select_options &options = arguments->options;
    cli::command select = app.add_subcommand("select-inputs", "Choose the inputs of a model");
    select.footer(select_inputs_example);
    select.add_option("DATA", arguments->data, "Rows, DATA.csv").required();
    select.add_option("--outputs A,B", arguments->columns.outputs, "Columns with errors")
        .required()
        .delimiter(',');
    select.add_option("--candidates C,D", arguments->columns.inputs, "Columns to choose from")
        .required()
        .delimiter(',');
    select
        .add_option("--count K", options.count,
                    "How many to choose; without it the validity index decides")
        .check(cli::whole_between(1, 64));
    const std::map<std::string, training::cluster_method> methods = {
        {"c-means", training::cluster_method::c_means},
        {"closure", training::cluster_method::closure}};
    select.add_choice("--method M", options.method, methods,
                      "c-means (default): fuzzy c-means, Xie-Beni index; closure: transitive "
                      "closure, F statistic");
    select.add_option("--keep C,D", options.keep, "Inputs that the model has in any case")
        .delimiter(',');
    select.add_flag("--check", options.check,
                    "Compare the choice with all candidates on runs left out");
    select.add_flag(
        "--by-runs", options.by_runs,
        "Choose by leaving candidates away one after the other, judged on runs left out");
    add_model(select, *arguments);
    select.add_option("--plot F.svg", arguments->plot, "Figure, F.svg, F.png or F.pdf");
    select.add_flag("--json", arguments->as_json, "Report as JSON");
    select.add_option("-o,--output F.json", arguments->output, "Report to write, CHOICE.json");
    select.callback([arguments](const cli::streams &io) {
        check_usage(*arguments);
        run_select(*arguments, io);
    });
}

}  // namespace compbox
