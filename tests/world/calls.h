// SPDX-License-Identifier: MIT
// For calls_*.cpp, which define world_NAME for each NAME of calls.txt: what compboxd calls instead
// of libc. No such call keeps an object that allocates across a point where time passes.
#pragma once

#include "tests/world/computer.h"

namespace compbox::world {

inline computer &here() {
    return *computer::current;
}

inline int &error_number() {
    return here().time.running()->error_number;
}

// in : a result ≥ 0, or -errno. out: what libc returns; errno is set
template <typename Result>
Result returned(Result result) {
    if (result >= 0) return result;
    error_number() = static_cast<int>(-result);
    return -1;
}

// Begins a call on a descriptor. out: the file; nullptr: errno is set
inline open_file *begin_on(int fd, const char *name, call_fate *fate) {
    const auto file = here().descriptor(fd);
    if (file == nullptr) {
        error_number() = EBADF;
        return nullptr;
    }
    *fate = here().begin(name, file.get());
    if (fate->error != 0) return nullptr;
    const auto still = here().descriptor(fd);  // another thread may have closed it meanwhile
    if (still == nullptr) error_number() = EBADF;
    return still.get();
}

}  // namespace compbox::world
