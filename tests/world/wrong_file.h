// SPDX-License-Identifier: MIT
// Coefficient files at the edges of docs/coefficient-file.md.
#pragma once

#include <string>

#include "tests/world/dice.h"

namespace compbox::world {

// out: `good` with one mistake of those that it can have: no box takes it
std::string wrong_file(const std::string &good, dice &chance);

// out: `good` with a few values that the page allows and few files have: each box takes it
std::string rare_file(const std::string &good, dice &chance);

}  // namespace compbox::world
