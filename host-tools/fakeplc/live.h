// SPDX-License-Identifier: MIT
// Time and signals for a program that simulates a device in real time until SIGTERM.
#pragma once

#include <signal.h>
#include <time.h>

#include <cstdint>

namespace compbox::fakeplc {

// Monotonic.
std::int64_t now_us();

// For ppoll: the time from now to then, 0 to 1 s.
timespec time_until(std::int64_t due_us);

// Makes SIGTERM and SIGINT request a stop; they arrive only inside ppoll with the returned mask.
// Ignores SIGPIPE, SIGXFSZ and SIGTTIN, so that these conditions are reported as errors.
sigset_t mind_signals();

// out: whether SIGTERM or SIGINT arrived
bool stop_requested();

}  // namespace compbox::fakeplc
