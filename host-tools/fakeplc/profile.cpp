// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/profile.h"

#include <algorithm>

namespace compbox {

namespace {

const std::vector<plc_profile> &profiles() {
    static const std::vector<plc_profile> all = {
        {"generic", {3, 4, 6, 16, 23}, {}, 8},
        // S7 server block: 1-6, 15, 16; everything else, 23 too, is exception 01. One client.
        {"sinumerik-840d", {3, 4, 6, 16}, {1, 2, 5, 15}, 1},
        // Option R968: holding registers only.
        {"fanuc", {3, 16, 23}, {}, 4},
    };
    return all;
}

bool contains(const std::vector<int> &list, int value) {
    return std::find(list.begin(), list.end(), value) != list.end();
}

}  // namespace

bool plc_profile::serves(int function) const {
    return contains(registers, function);
}

bool plc_profile::knows(int function) const {
    return serves(function) || contains(empty_tables, function);
}

std::optional<plc_profile> plc_profile::find(const std::string &name) {
    for (const auto &profile : profiles()) {
        if (profile.name == name) return profile;
    }
    return std::nullopt;
}

std::vector<std::string> plc_profile::names() {
    std::vector<std::string> names;
    for (const auto &profile : profiles()) names.push_back(profile.name);
    return names;
}

}  // namespace compbox
