// SPDX-License-Identifier: MIT
// Independent tasks on several threads; what they compute does not depend on how many.
#pragma once

#include <functional>

namespace compbox {

// Calls task(0) … task(count - 1), each once, on at most `threads` threads (0: as many as the
// machine has), and returns when all are done. The first exception of a task is thrown again here.
void run_parallel(std::size_t count, int threads, const std::function<void(std::size_t)> &task);

}  // namespace compbox
