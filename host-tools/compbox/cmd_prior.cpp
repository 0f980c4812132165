// SPDX-License-Identifier: MIT
// compbox prior: what machines of one type know, for the training of another one.
#include <fmt/format.h>

#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/training/prior.h"

namespace compbox {

namespace {

struct prior_arguments {
    std::vector<std::string> moments;
    std::string output;
    bool as_json = false;
};

constexpr const char *prior_example =
    R"(Estimates how the models of machines of one type are spread. `compbox train --prior` draws the
model of another machine to them. Machines that are far from most are named, and not used.
`compbox train --moments` writes the files.

Example:
  compbox prior lathe-*.moments.json -o prior.json)";

// Reads the moments, writes the prior, and names the brothers that are not used. Throws
// input_error.
void run_prior(const prior_arguments &arguments, const cli::streams &io) {
    const std::size_t count = arguments.moments.size();
    if (count < training::least_brothers || count > training::most_brothers) {
        throw input_error(fmt::format("a prior needs {} to {} machines, not {}",
                                      training::least_brothers, training::most_brothers, count));
    }
    std::vector<training::bank_moments> brothers;
    for (const auto &path : arguments.moments) brothers.push_back(training::read_moments(path));
    const training::bank_priors priors = training::priors_of(brothers);
    formats::write_file(arguments.output, formats::json_text(training::json_of(priors)), &io.out);
    const training::bank_prior &whole = priors.spaces.front();
    std::vector<std::string> remarks;
    for (std::size_t k = 0; k < whole.strange.size(); ++k) {
        if (whole.strange[k].empty()) continue;
        remarks.push_back(fmt::format("{}: too far from most, and not used: {}",
                                      whole.space.outputs[k], fmt::join(whole.strange[k], ", ")));
    }
    if (arguments.as_json) {
        cli::print_summary(io.out, {arguments.output},
                           {{"machines", count}, {"strange", whole.strange}}, remarks);
        return;
    }
    if (cli::on_stdout({arguments.output})) return;
    io.out << fmt::format("{} machines: {}\n", count, arguments.output);
    for (const auto &remark : remarks) io.out << remark << "\n";
}

}  // namespace

void add_prior(cli::command &app) {
    const auto arguments = std::make_shared<prior_arguments>();
    cli::command prior = app.add_subcommand("prior", "What machines of one type share, for train");
    prior.footer(prior_example);
    prior.add_option("MOMENTS", arguments->moments, "Files of `compbox train --moments`")
        .required();
    prior.add_option("-o,--output PRIOR.json", arguments->output, "Prior to write, PRIOR.json")
        .required();
    cli::add_json(prior, arguments->as_json);
    prior.callback([arguments](const cli::streams &io) { run_prior(*arguments, io); });
}

}  // namespace compbox
