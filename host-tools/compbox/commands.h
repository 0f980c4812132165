// SPDX-License-Identifier: MIT
// The commands of `compbox`, one file each. A command registers its options and a callback
// that does the work; it throws input_error for what the user can mend.
#pragma once

#include "host-tools/command_line/command_line.h"

namespace compbox {

// Commands that read files, compute and write files, of which one is required. A scenario may run
// them (simulation/tool_steps.h): a command that opens a network connection or a device belongs
// into live/.
void add_computing_commands(cli::command &app);

// All of them, of which one is required.
void add_commands(cli::command &app);

// Each registers one command with its options; the callback runs when `app` parses it.
void add_init(cli::command &app);
void add_fit(cli::command &app);
void add_report(cli::command &app);
void add_etve(cli::command &app);
void add_plan(cli::command &app);
void add_assemble(cli::command &app);
void add_identify(cli::command &app);
void add_squareness(cli::command &app);
void add_volumetric(cli::command &app);
void add_select_inputs(cli::command &app);
void add_train(cli::command &app);
void add_prior(cli::command &app);
void add_sensors(cli::command &app);
void add_build(cli::command &app);
void add_check(cli::command &app);
void add_pack(cli::command &app);
void add_eval(cli::command &app);
void add_export(cli::command &app);
void add_signing(cli::command &app);  // keygen, sign, verify
void add_join(cli::command &app);
void add_simulate(cli::command &app);

}  // namespace compbox
