// SPDX-License-Identifier: MIT
// Reads that are shorter than what was asked for. hal/linux/state_test.cpp defines the call of
// libc.
#pragma once

#include <cstddef>
#include <cstdint>

namespace short_reads {

extern std::size_t most;  // by one call; SIZE_MAX: no limit
extern std::size_t left;  // until the end of what is read

}  // namespace short_reads
