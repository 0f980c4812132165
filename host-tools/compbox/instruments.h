// SPDX-License-Identifier: MIT
// The virtual instruments as commands, for the steps of a scenario: what a person would measure
// on the machine, written to files (docs/report.md, "Steps").
#pragma once

#include <CLI/CLI.hpp>

#include "host-tools/twin/machine.h"

namespace compbox {

// laser, nine-line, diagonals. The twin must outlive the app.
void add_instruments(CLI::App &app, const twin_machine &twin);

}  // namespace compbox
