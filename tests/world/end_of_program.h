// SPDX-License-Identifier: MIT
// A run that takes the program with it: a wild pointer of the daemon, an abort, or a loop without
// an end. The program then reports seed and replay line like a violation, and ends with 1.
#pragma once

#include <string>

#include "tests/world/scheduler.h"

namespace compbox::world {

// in : what to print after the cause; time: of the run, which must go on. Both stay valid until the
// next call.
void report_end_of_program(const std::string &replay, const scheduler *time);

}  // namespace compbox::world
