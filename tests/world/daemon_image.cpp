// SPDX-License-Identifier: MIT
#include "tests/world/daemon_image.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

// The linker's names for the sections that objcopy renames; clang leaves no variable in the first.
extern "C" {
extern char __start_world_data[] __attribute__((weak)), __stop_world_data[] __attribute__((weak));
extern char __start_world_bss[], __stop_world_bss[];
}

namespace compbox::world {

namespace {

constexpr std::uintptr_t page_bytes = 4096;

// Megabytes, of which a run touches few: whole pages are given back, the rest is overwritten.
void zero(char *from, char *to) {
    const auto first =
        (reinterpret_cast<std::uintptr_t>(from) + page_bytes - 1) & ~(page_bytes - 1);
    const auto last = reinterpret_cast<std::uintptr_t>(to) & ~(page_bytes - 1);
    char *const begin = reinterpret_cast<char *>(first), *const end =
                                                             reinterpret_cast<char *>(last);
    if (begin >= end || ::madvise(begin, last - first, MADV_DONTNEED) != 0) {
        std::memset(from, 0, static_cast<std::size_t>(to - from));
        return;
    }
    std::memset(from, 0, static_cast<std::size_t>(begin - from));
    std::memset(end, 0, static_cast<std::size_t>(to - end));
}

}  // namespace

std::array<std::pair<char *, char *>, 2> daemon_variables() {
    using range = std::pair<char *, char *>;
    return {range(__start_world_data, __stop_world_data),
            range(__start_world_bss, __stop_world_bss)};
}

void reset_daemon_image() {
    const auto [with_values, zeros] = daemon_variables();
    static const std::vector<char> first(with_values.first, with_values.second);
    std::copy(first.begin(), first.end(), with_values.first);
    zero(zeros.first, zeros.second);
}

}  // namespace compbox::world
