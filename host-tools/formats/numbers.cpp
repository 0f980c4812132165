// SPDX-License-Identifier: MIT
#include "host-tools/formats/numbers.h"

#include <cstdio>

namespace compbox {

std::string formatted(const char *pattern, double value) {
    char text[64];
    std::snprintf(text, sizeof text, pattern, value);
    return text;
}

}  // namespace compbox
