// SPDX-License-Identifier: MIT
// Replays a file of `compboxd --record-inputs` through the core: the same inputs at the same times
// must give bit-identical outputs.
#pragma once

#include <string>
#include <vector>

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::simulation {

struct replay_result {
    long long cycles = 0;              // stepped and compared
    double duration_s = 0.0;           // of the recording, as far as it was stepped
    std::string difference;            // the first one, in words with its place; "": none
    std::vector<std::string> remarks;  // why not all of it was stepped
};

// in : the coefficient file that the recording began with; text of the recording, and its name
// Throws input_error where the recording is not what it should be.
replay_result replay(const cb_config &config, const std::string &recording,
                     const std::string &text);

}  // namespace compbox::simulation
