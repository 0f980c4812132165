// SPDX-License-Identifier: MIT
// compbox eval: the box's answer to a table of inputs.
#include <memory>
#include <ostream>
#include <string>

#include "host-tools/coefficients/evaluate.h"
#include "host-tools/coefficients/load.h"
#include "host-tools/coefficients/sigma.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox {

namespace {

struct eval_options {
    std::string coefficients, samples, output;
    std::string map_plot;
    bool raw = false, sigma = false, as_map = false, as_json = false;
};

// Appends the columns of a table of standard deviations.
void append(const coefficients::sigma_table &sigma, coefficients::evaluation &result) {
    result.names.insert(result.names.end(), sigma.names.begin(), sigma.names.end());
    for (std::size_t r = 0; r < result.rows.size(); ++r) {
        for (const double value : sigma.rows[r])
            result.rows[r].push_back(static_cast<float>(value));
    }
    result.remarks.insert(result.remarks.end(), sigma.remarks.begin(), sigma.remarks.end());
}

void print(const eval_options &options, std::size_t rows, const std::vector<std::string> &names,
           const std::vector<std::string> &remarks, const cli::streams &io) {
    if (options.as_json) {
        return cli::print_summary(io.out, {options.output}, {{"rows", rows}, {"columns", names}},
                                  remarks);
    }
    const std::string &about = options.as_map ? options.coefficients : options.samples;
    for (const auto &remark : remarks) io.err << about << ": " << remark << "\n";
}

void run_map(const eval_options &options, const cli::streams &io) {
    const coefficients::sigma_map map = coefficients::map_of_sigma(options.coefficients);
    formats::write_file(options.output, coefficients::sigma_map_csv(map), &io.out);
    if (!options.map_plot.empty()) coefficients::plot_sigma_map(map, options.map_plot);
    std::vector<std::string> names = map.axes;
    for (const auto &channel : map.channels) names.push_back("U_" + channel + "_um");
    names.push_back("U_um");
    print(options, map.nodes.size(), names, map.remarks, io);
}

// Throws usage_error.
void check_usage(const eval_options &options) {
    if (options.as_map != options.samples.empty()) {
        throw cli::usage_error("eval", "takes one of --inputs and --sigma-map");
    }
    cli::different_files({{"-o", options.output}, {"--plot", options.map_plot}});
}

void run_eval(const eval_options &options, const cli::streams &io) {
    check_usage(options);
    if (options.as_map) return run_map(options, io);
    const auto config = coefficients::load_coefficients(options.coefficients);
    const formats::csv_table samples = formats::read_csv(options.samples);
    coefficients::evaluation result = coefficients::evaluate(*config, samples, options.raw);
    if (options.sigma) append(coefficients::sigma_of(options.coefficients, samples), result);
    formats::write_file(options.output, coefficients::evaluation_csv(result), &io.out);
    print(options, result.rows.size(), result.names, result.remarks, io);
}

}  // namespace

void add_eval(cli::command &app) {
    auto command = app.add_subcommand("eval", "Run the box on a table of inputs");
    const auto options = std::make_shared<eval_options>();
    command.add_option("COEFFICIENTS", options->coefficients, "Coefficient file").required();
    command.add_option("--inputs F.csv", options->samples,
                       "CSV: time_s and a column for each signal");
    command.add_flag(
        "--raw", options->raw,
        "Channels as plain negative sums: no limits, slew, deadband, lead or plausibility");
    command.add_flag(
        "--sigma", options->sigma,
        "Also the standard deviation of each term and channel, by those of the curves");
    auto map =
        command.add_flag("--sigma-map", options->as_map,
                         "Instead of --inputs: uncertainty (k = 2) of the channels on a grid "
                         "over the axes");
    command.add_option("--plot F.svg", options->map_plot, "Picture of the map (.svg, .png, .pdf)")
        .needs(map);
    command.add_option("-o,--output F.csv", options->output, "CSV to write").required();
    cli::add_json(command, options->as_json);
    command.footer(
        "Inputs are physical values (mm, degC), taken after the registers' decoding; ranges, "
        "rates\n"
        "and ages apply as on the box. The first row is a steady state. Between two rows the box\n"
        "runs at its period with the first one's inputs; lags alone follow the straight line from\n"
        "row to row, as compbox train has it (docs/eval.md).\n\n"
        "Example:\n  compbox eval coefficients.json --inputs samples.csv -o out.csv\n"
        "  compbox eval coefficients.json --sigma-map --plot map.svg -o map.csv");
    command.callback([options](const cli::streams &io) { run_eval(*options, io); });
}

}  // namespace compbox
