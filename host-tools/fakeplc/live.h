// SPDX-License-Identifier: MIT
// What a program needs that plays a device in real time until it is told to stop.
#pragma once

#include <signal.h>
#include <time.h>

#include <cstdint>

namespace compbox {

// Monotonic.
std::int64_t now_us();

// For ppoll: the time from now to then, 0 to 1 s.
timespec time_until(std::int64_t due_us);

// From now on SIGTERM and SIGINT ask to stop, and arrive only inside ppoll with the mask that this
// returns. A reader that went away, a file at its limit, and a background process's read of the
// terminal give errors instead of ends.
sigset_t mind_signals();

// Whether SIGTERM or SIGINT came.
bool stop_requested();

}  // namespace compbox
