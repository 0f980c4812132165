// SPDX-License-Identifier: MIT
// How many random cases a test tries.
#pragma once

#include <cstdlib>

namespace compbox_test {

// out: true in the long tests (COMPBOX_LONG_TESTS, set by scripts/test --long)
inline bool long_tests() {
    static const bool set = std::getenv("COMPBOX_LONG_TESTS") != nullptr;
    return set;
}

// out: all with COMPBOX_LONG_TESTS, else a fifth of them: the first ones of the same seed
template <typename number>
number cases(number all) {
    return long_tests() ? all : all / 5;
}

}  // namespace compbox_test
