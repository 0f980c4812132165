// SPDX-License-Identifier: MIT
// The virtual instruments as commands for the steps of a scenario (docs/report.md, "Steps"). They
// write measurement files.
#pragma once

#include "host-tools/command_line/command_line.h"
#include "host-tools/twin/machine.h"

namespace compbox::simulation {

// laser, nine-line, diagonals. The twin must outlive the app.
void add_instruments(cli::command &app, const twin::twin_machine &twin);

}  // namespace compbox::simulation
