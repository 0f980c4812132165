// SPDX-License-Identifier: MIT
// compbox eval: the box's answer to a table of inputs.
#include <memory>
#include <ostream>
#include <string>

#include "host-tools/coefficients/evaluate.h"
#include "host-tools/coefficients/load.h"
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
    bool raw = false, as_json = false;
};

void run_eval(const eval_options &options, const cli::streams &io) {
    const auto config = coefficients::load_coefficients(options.coefficients);
    const formats::csv_table samples = formats::read_csv(options.samples);
    const coefficients::evaluation result = coefficients::evaluate(*config, samples, options.raw);
    formats::write_file(options.output, coefficients::evaluation_csv(result), &io.out);
    if (options.as_json) {
        return cli::print_summary(io.out, {options.output},
                                  {{"rows", result.rows.size()}, {"columns", result.names}},
                                  result.remarks);
    }
    for (const auto &remark : result.remarks) {
        io.err << options.samples << ": " << remark << "\n";
    }
}

}  // namespace

void add_eval(cli::command &app) {
    auto command = app.add_subcommand("eval", "Run the box on a table of inputs");
    const auto options = std::make_shared<eval_options>();
    command.add_option("COEFFICIENTS", options->coefficients, "Coefficient file").required();
    command
        .add_option("--inputs F.csv", options->samples, "CSV: time_s and a column for each signal")
        .required();
    command.add_flag(
        "--raw", options->raw,
        "Channels as plain negative sums: no limits, slew, deadband, lead or plausibility");
    command.add_option("-o,--output F.csv", options->output, "CSV to write").required();
    cli::add_json(command, options->as_json);
    command.footer(
        "Inputs are physical values (mm, degC), taken after the registers' decoding; ranges, "
        "rates\n"
        "and ages apply as on the box. The first row is a steady state. Between two rows the box\n"
        "runs at its period with the first one's inputs; lags alone follow the straight line from\n"
        "row to row, as compbox train has it (docs/eval.md).\n\n"
        "Example:\n  compbox eval coefficients.json --inputs samples.csv -o out.csv");
    command.callback([options](const cli::streams &io) { run_eval(*options, io); });
}

}  // namespace compbox
