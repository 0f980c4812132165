// SPDX-License-Identifier: MIT
// compbox check: what the box itself says to a coefficient file.
#include <iostream>
#include <memory>
#include <string>

#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/load.h"

namespace compbox {

namespace {

void check(const std::string &path) {
    const auto config = load_coefficients(path);
    std::cout << config->machine << ", revision " << config->revision << ": " << summary(*config)
              << "\n";
}

}  // namespace

void add_check(CLI::App &app) {
    auto *command = app.add_subcommand("check", "Ask the box's own loader about a file");
    const auto path = std::make_shared<std::string>();
    command->add_option("FILE", *path, "Coefficient file")->required();
    command->footer("Example:\n  compbox check coefficients.json");
    command->callback([path] { check(*path); });
}

}  // namespace compbox
