// SPDX-License-Identifier: MIT
// compbox build: machine file and terms to the coefficient file, if the box would take it.
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "host-tools/coefficients/build.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/json.h"

namespace compbox {

namespace {

struct build_options {
    std::string machine;
    std::vector<std::string> terms;
    std::optional<unsigned> revision;
    std::string output;
    bool as_json = false;
};

void run_build(const build_options &options, const cli::streams &io) {
    const auto notes = coefficients::build_file(options.machine, options.terms, options.revision,
                                                options.output, &io.out);
    if (options.as_json) {
        return print_summary(io.out, {options.output}, {{"terms", options.terms}}, notes);
    }
    auto &out = options.output == "-" ? io.err : io.out;
    for (const auto &note : notes) out << note << "\n";
}

}  // namespace

void add_build(cli::command &app) {
    auto command = app.add_subcommand("build", "Join a machine file and terms for the box");
    const auto options = std::make_shared<build_options>();
    command.add_option("MACHINE", options->machine, "Machine file, see init").required();
    command.add_option("TERM", options->terms, "Term files, see fit");
    command
        .add_option("--revision N", options->revision,
                    "Revision of the new file (else the machine file's)")
        .check(whole_between(0, 4294967295));
    command.add_option("-o,--output F.json", options->output, "Coefficient file to write")
        .required();
    add_json(command, options->as_json);
    command.footer(
        "Where the machine file has null, build fills in: a channel's sum (terms with ISO 230-1\n"
        "names: EZX and EZY go to channel Z) and a signal's min and max (the range of its\n"
        "curves and a tenth of it, at least 10 mm, beyond). It prints what it filled in.\n\n"
        "Example:\n  compbox build machine.json EZX.json EZY.json -o coefficients.json");
    command.callback([options](const cli::streams &io) { run_build(*options, io); });
}

}  // namespace compbox
