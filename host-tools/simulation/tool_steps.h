// SPDX-License-Identifier: MIT
// Steps of a scenario as data: lines as a person would type them, commands that the caller allows
// (step_world) and measurements by virtual instruments ("measure …", instruments.h). The tools get
// paths of files, by their command line, and nothing else. Where they may write: run_scenario.
#pragma once

#include <string>
#include <vector>

#include "host-tools/simulation/step_words.h"

namespace compbox::simulation {

// Runs the step within this process and drops its standard output. out: lines of its err stream.
// Throws input_error naming the step.
std::vector<std::string> run_step(const std::string &step, const step_world &world);

}  // namespace compbox::simulation
