// SPDX-License-Identifier: MIT
// Words of a step of a scenario (tool_steps.h), split as by a shell.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/command_line/command_line.h"
#include "host-tools/twin/machine.h"

namespace compbox::simulation {

// Adds the commands that a step may run. A scenario is untrusted: none of them opens a network
// connection or a device.
using step_commands = void (*)(cli::command &app);

struct step_world {
    const twin::twin_machine &twin;
    std::string file;                          // the scenario, for messages
    std::map<std::string, std::string> names;  // $NAME in a step
    step_commands commands;                    // beside measure; not null where a step runs
};

constexpr std::size_t most_words = 1000;     // of a step, choices counted
constexpr std::size_t longest_step = 65536;  // characters

// The words of a step, as a shell would make them: split at spaces; a{b,c}d to abd acd; $NAME
// replaced; $(FILE) replaced by the file's text without the line end. Throws input_error, also for
// more than most_words (counted before they are made), a longer step, and braces within braces.
std::vector<std::string> words_of(const std::string &step, const step_world &world);

}  // namespace compbox::simulation
