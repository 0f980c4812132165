// SPDX-License-Identifier: MIT
// compbox check: what the box itself says to a coefficient file.
#include <iostream>
#include <memory>
#include <string>

#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/load.h"
#include "host-tools/compbox/summary.h"

namespace compbox {

namespace {

struct check_options {
    std::string path;
    bool as_json = false;
};

void check(const check_options &options) {
    const auto config = load_coefficients(options.path);
    if (options.as_json) {
        return print_summary({}, {{"machine", config->machine},
                                  {"revision", config->revision},
                                  {"signals", config->signals_count},
                                  {"terms", config->terms_count},
                                  {"channels", config->channels_count}});
    }
    std::cout << config->machine << ", revision " << config->revision << ": " << summary(*config)
              << "\n";
}

}  // namespace

void add_check(CLI::App &app) {
    auto *command = app.add_subcommand("check", "Ask the box's own loader about a file");
    const auto options = std::make_shared<check_options>();
    command->add_option("FILE", options->path, "Coefficient file")->required();
    add_json(*command, options->as_json);
    command->footer("Example:\n  compbox check coefficients.json");
    command->callback([options] { check(*options); });
}

}  // namespace compbox
