// SPDX-License-Identifier: MIT
// A step of a scenario (tool_steps.h), taken apart as a shell would.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/twin/machine.h"

namespace compbox {

struct step_world {
    const twin_machine &twin;
    std::string file;                          // the scenario, for messages
    std::map<std::string, std::string> names;  // $NAME in a step
};

constexpr std::size_t most_words = 1000;     // of a step, choices counted
constexpr std::size_t longest_step = 65536;  // characters

// The words of a step, as a shell would make them: split at spaces; a{b,c}d to abd acd; $NAME
// replaced; $(FILE) replaced by the file's text without the line end. Throws input_error, also for
// more than most_words (counted before they are made), a longer step, and braces within braces.
std::vector<std::string> words_of(const std::string &step, const step_world &world);

}  // namespace compbox
