// SPDX-License-Identifier: MIT
// Coefficient files with one mistake that docs/coefficient-file.md names: no box takes them.
#pragma once

#include <string>

#include "tests/world/dice.h"

namespace compbox::world {

// out: `good` with one mistake of those that it can have
std::string wrong_file(const std::string &good, dice &chance);

}  // namespace compbox::world
