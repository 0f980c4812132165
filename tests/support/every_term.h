// SPDX-License-Identifier: MIT
// A coefficient file with every kind of term and every key that a term, a position or a channel may
// have. It is the seed of the tests that damage files, and of the fuzzer
// (tests/fuzz/corpus/config).
#pragma once

#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/paths.h"

namespace compbox_test {

inline std::string every_term() {
    std::ifstream file(from_source("tests/fuzz/corpus/config/every_term.json"));
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

}  // namespace compbox_test
