// SPDX-License-Identifier: MIT
// Options of the commands that read measurement files.
#pragma once

#include "host-tools/command_line/command_line.h"
#include "host-tools/fitting/measurement.h"

namespace compbox {

// Adds --unit.
void add_unit(cli::command &command, fitting::reading_options &reading);

}  // namespace compbox
