// SPDX-License-Identifier: MIT
// Coefficient files that nobody would write, made of a good one.
#pragma once

#include <string>

#include "tests/world/dice.h"

namespace compbox::world {

// out: `good`, changed in one to three ways: bits, cuts, numbers, keys, limits, registers
std::string hostile_file(const std::string &good, dice &chance);

}  // namespace compbox::world
