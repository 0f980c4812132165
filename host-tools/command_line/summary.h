// SPDX-License-Identifier: MIT
// What a command did, as one JSON object on stdout: for commands whose result is a file.
#pragma once

#include <string>
#include <vector>

#include "host-tools/command_line/command_line.h"
#include "host-tools/formats/json_type.h"

namespace compbox::cli {

void add_json(cli::command &command, bool &as_json);

// Whether one of the files written is stdout itself ("-"), which then takes no report behind it.
bool on_stdout(const std::vector<std::string> &files);

// Prints {"files": …, the keys of `figures`, "remarks": …}. Nothing where a file is
// on_stdout().
void print_summary(std::ostream &out, const std::vector<std::string> &files, const json &figures,
                   const std::vector<std::string> &remarks = {});

}  // namespace compbox::cli
