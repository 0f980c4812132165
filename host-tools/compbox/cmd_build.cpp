// SPDX-License-Identifier: MIT
// compbox build: machine file and terms to the coefficient file, if the box would take it.
#include <map>
#include <memory>
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
    coefficients::build_request request;
    bool as_json = false;
};

// Builds the file, and prints notes and remarks: to io.err where the file goes to io.out.
void run_build(const build_options &options, const cli::streams &io) {
    const auto &request = options.request;
    const auto built = coefficients::build_file(request, &io.out);
    if (options.as_json) {
        auto remarks = built.notes;
        remarks.insert(remarks.end(), built.remarks.begin(), built.remarks.end());
        return cli::print_summary(io.out, built.files,
                                  {{"terms", request.terms},
                                   {"demand", built.channels},
                                   {"curves", built.curves},
                                   {"range_accepted", request.accept_range}},
                                  remarks);
    }
    auto &out = cli::on_stdout({request.output}) ? io.err : io.out;
    for (const auto &note : built.notes) out << note << "\n";
    for (const auto &remark : built.remarks) out << "Remark: " << remark << "\n";
}

}  // namespace

void add_build(cli::command &app) {
    auto command = app.add_subcommand("build", "Join a machine file and terms for the box");
    const auto options = std::make_shared<build_options>();
    auto &request = options->request;
    command.add_option("MACHINE", request.machine, "Machine file, see init").required();
    command.add_option("TERM", request.terms, "Term files, see fit");
    command
        .add_option("--revision N", request.revision,
                    "Revision of the new file (else the machine file's)")
        .check(cli::whole_between(0, 4294967295));
    command.add_option("-o,--output F.json", request.output, "Coefficient file to write")
        .required();
    command.add_option("--plot F.svg|DIR", request.plot,
                       "Demand of each channel over the travel: one figure, or a folder of them");
    command.add_flag("--accept-range", request.accept_range,
                     "Build even if a demand exceeds error_um or a curve leaves travel uncovered");
    command.add_choice("--target BOX", request.for_stm32f405,
                       std::map<std::string, bool>{{"any", false}, {"stm32f405", true}},
                       "Box that will run the file: any, or stm32f405, with its memory in use");
    cli::add_json(command, options->as_json);
    command.footer(
        "Where the machine file has null, build fills in: a channel's sum (terms with ISO 230-1\n"
        "names: EZX and EZY go to channel Z) and a signal's min and max (the range of its\n"
        "curves and a tenth of it, at least 10 mm, beyond). It prints what it filled in, what "
        "each\n"
        "channel demands over the travel, and a remark on what hardly belongs together.\n\n"
        "Example:\n  compbox build machine.json EZX.json EZY.json -o coefficients.json");
    command.callback([options](const cli::streams &io) {
        cli::different_files({{"-o", options->request.output}, {"--plot", options->request.plot}});
        run_build(*options, io);
    });
}

}  // namespace compbox
