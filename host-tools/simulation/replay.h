// SPDX-License-Identifier: MIT
// Replays a file of `compboxd --record-inputs` through the core: the same inputs at the same times
// must give bit-identical outputs.
#pragma once

#include <string>
#include <vector>

namespace compbox::simulation {

struct replay_result {
    long long cycles = 0;              // stepped and compared
    double duration_s = 0.0;           // of the recording, as far as it was stepped
    std::string difference;            // the first one, in words with its place; "": none
    std::vector<std::string> remarks;  // why not all of it was stepped
};

// in : the coefficient file that the recording began with
// Throws input_error where a file is not what it should be.
replay_result replay(const std::string &coefficients, const std::string &recording);

}  // namespace compbox::simulation
