// SPDX-License-Identifier: MIT
// A failing run made smaller: fewer cycles, fewer kinds of faults, fewer of each kind; every step
// is tried by another run, in a process of its own.
#pragma once

#include "tests/world/run.h"

namespace compbox::world {

struct failing_run {
    run_options options;
    violation found;
};

// in : a run that ends with this violation
// out: a run with a violation of the same invariant; at worst the given one
failing_run shrunk(const failing_run &whole);

}  // namespace compbox::world
