// SPDX-License-Identifier: MIT
// Options of the form NAME=number: "C0Y=12.5", "X=100,0,-50".
#pragma once

#include <string>
#include <vector>

namespace compbox::cli {

struct key_values {
    std::string key;
    std::vector<double> values;  // at least one, all finite
};

// in : "KEY=number" or "KEY=number,number,…"
// Throws cli::usage_error, naming `option`, for anything else.
key_values parse_key_values(const std::string &option, const std::string &text);

// "C0Y=12.5,B0Z=3" as single pieces: splits at the commas before a new KEY=.
std::vector<std::string> split_at_keys(const std::string &text);

}  // namespace compbox::cli
