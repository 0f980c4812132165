// SPDX-License-Identifier: MIT
// Independent tasks on several threads; the results do not depend on the number of threads.
#pragma once

#include <functional>

namespace compbox::regression {

// Calls task(0) … task(count - 1), each once, on at most `threads` threads (0: one per processor),
// and returns when all are done. Rethrows the first exception of a task.
void run_parallel(std::size_t count, int threads, const std::function<void(std::size_t)> &task);

}  // namespace compbox::regression
