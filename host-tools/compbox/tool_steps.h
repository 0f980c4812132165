// SPDX-License-Identifier: MIT
// Steps of a scenario as data: lines as a person would type them, commands of compbox and
// measurements by virtual instruments ("measure …", instruments.h). The tools are given paths of
// files, by their command line, and nothing else.
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

// The words of a step, as a shell would make them: split at spaces; a{b,c}d to abd acd; $NAME
// replaced; $(FILE) replaced by the file's text without the line end. Throws input_error.
std::vector<std::string> words_of(const std::string &step, const step_world &world);

// Runs the step within this process; out: what it said to stderr, by lines. What it prints is
// dropped. Throws input_error naming the step.
std::vector<std::string> run_step(const std::string &step, const step_world &world);

}  // namespace compbox
