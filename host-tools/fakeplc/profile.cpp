// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/profile.h"

#include <algorithm>

namespace compbox::fakeplc {

namespace {

// All times are estimates; docs/fakeplc.md lists the sources of the other values.
nc_interface by_setting_data() {
    nc_interface nc;
    nc.way = nc_way::setting_data;
    nc.deadband_um = 0.1;
    nc.put_shortest_s = 0.001;
    nc.put_longest_s = 0.006;
    nc.tear_um = 0.5;
    return nc;
}

nc_interface by_handshake() {
    nc_interface nc;
    nc.way = nc_way::handshake;
    nc.answer_shortest_cycles = 1;
    nc.answer_longest_cycles = 2;
    nc.alarm_units = 9999;
    nc.spreads = false;
    return nc;
}

const std::vector<plc_profile> &profiles() {
    static const std::vector<plc_profile> all = {
        {"generic", {3, 4, 6, 16, 23}, {}, 8, 0.0, {}},
        // S7 server block: 1-6, 15, 16; everything else, 23 too, is exception 01. One client. OB1
        // runs freely.
        {"sinumerik-840d", {3, 4, 6, 16}, {1, 2, 5, 15}, 1, 0.0015, by_setting_data()},
        // Option R968: holding registers only. The ladder is clocked by the control.
        {"fanuc", {3, 16, 23}, {}, 4, 0.0001, by_handshake()},
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

}  // namespace compbox::fakeplc
