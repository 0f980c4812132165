// SPDX-License-Identifier: MIT
// Checks of numbers on the command line. CLI11's own ones let a NaN pass and print an open end as
// a number of 309 digits. Each refuses, in a few words, what is no finite decimal number too.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace compbox {

CLI::Validator any_number();
CLI::Validator above_zero();
CLI::Validator zero_or_more();
CLI::Validator between(double least, double most);  // both included
CLI::Validator whole_between(long least, long most);

// Wrong usage where two of {option, file it writes} name the same file.
void different_files(const std::vector<std::pair<std::string, std::string>> &outputs);

// For transform(): one of the names, for an option whose variable is an enum; else lists them.
template <typename Choice>
CLI::Validator one_of(const std::map<std::string, Choice> &choices) {
    const auto choose = [choices](std::string &text) {
        const auto found = choices.find(text);
        if (found != choices.end()) {
            text = std::to_string(static_cast<int>(found->second));
            return std::string();
        }
        std::string names;
        for (const auto &choice : choices) names += (names.empty() ? "" : ", ") + choice.first;
        return "must be one of " + names + ", not " + text;
    };
    return CLI::Validator(choose, "");
}

}  // namespace compbox
