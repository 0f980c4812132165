// SPDX-License-Identifier: MIT
// Names of the signals of an axis' touch probe.
#pragma once

#include <cctype>
#include <string>

namespace compbox::formats {

struct probe_names {
    std::string value, count;
};

// in : axis, such as X. out: probe_x and probe_x_n, in small letters
inline probe_names probe_names_of(const std::string &axis) {
    std::string value = "probe_" + axis;
    for (char &c : value) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return {value, value + "_n"};
}

}  // namespace compbox::formats
