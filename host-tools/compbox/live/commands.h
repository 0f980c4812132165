// SPDX-License-Identifier: MIT
// Commands that open a connection or a device, or meet a running box: no scenario may run them.
#pragma once

#include "host-tools/command_line/command_line.h"

namespace compbox::live {

// Each registers one command with its options; the callback runs when `app` parses it.
void add_commission(cli::command &app);
void add_plc(cli::command &app);
void add_measured(cli::command &app);
void add_watch(cli::command &app);
void add_fleet(cli::command &app);  // its help; the work is that of run_fleet()

// out: whether the words are `fleet COMMAND …`
bool is_for_fleet(int argc, char **argv);

// Becomes the Python package beside this program, share/compbox/fleet, with the words after
// `fleet`. out: 1 if Python is missing; else it does not return
int run_fleet(char **argv, const cli::streams &io);

}  // namespace compbox::live
