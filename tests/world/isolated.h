// SPDX-License-Identifier: MIT
// A run in a process of its own: a wild pointer of the daemon, an abort, or a loop without an end
// is a violation like any other, and the next seed follows.
#pragma once

#include "tests/world/run.h"

namespace compbox::world {

// out: the result of the run; of a process that ended by itself a violation of "crash"
// Throws std::runtime_error if the system has no pipe or process.
run_result run_isolated(const run_options &options);

}  // namespace compbox::world
