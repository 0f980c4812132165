// SPDX-License-Identifier: MIT
// The commands of `compbox`, one file each. A command registers its options with CLI11 and a
// callback that does the work; it throws input_error for what the user can mend.
#pragma once

#include <CLI/CLI.hpp>

namespace compbox {

// All of them, of which one is required.
void add_commands(CLI::App &app);

void add_init(CLI::App &app);
void add_fit(CLI::App &app);
void add_report(CLI::App &app);
void add_plan(CLI::App &app);
void add_assemble(CLI::App &app);
void add_identify(CLI::App &app);
void add_squareness(CLI::App &app);
void add_volumetric(CLI::App &app);
void add_select_inputs(CLI::App &app);
void add_train(CLI::App &app);
void add_build(CLI::App &app);
void add_check(CLI::App &app);
void add_pack(CLI::App &app);
void add_eval(CLI::App &app);
void add_export(CLI::App &app);
void add_join(CLI::App &app);
void add_simulate(CLI::App &app);
void add_commission(CLI::App &app);

}  // namespace compbox
