// SPDX-License-Identifier: MIT
#include "tests/support/paths.h"

std::string from_source(const std::string &below) {
    return CB_SOURCE_DIR "/" + below;
}

std::string built(const std::string &name) {
    return CB_BINARY_DIR "/bin/" + name;
}
