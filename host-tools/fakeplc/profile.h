// SPDX-License-Identifier: MIT
// What each kind of control can do, as data: its Modbus server, its PLC's scan, and the way from
// the PLC to the NC (docs/fakeplc.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace compbox {

// How a compensation gets from the PLC into the NC.
enum class nc_way {
    direct,        // as it is, in the scan
    setting_data,  // SINUMERIK: K0, tan beta and P0 of one axis after the other, by FB3 PUT
    handshake,     // FANUC: EA/ED/ESTB/EREND, machine zero-point shift
};

struct nc_interface {
    nc_way way = nc_way::direct;
    double deadband_um = 0.0;  // the NC is written when it is off by so much
    // setting_data: from the request, or the variable before it, until a variable is in the NC; and
    // how far a half-written set may be off.
    double put_shortest_s = 0.0, put_longest_s = 0.0, tear_um = 0.0;
    // handshake: interpolation cycles until the NC answers; largest value, and first change that
    // is an alarm, in increments of the channel's register.
    int answer_shortest_cycles = 0, answer_longest_cycles = 0, alarm_units = 0;
    // MD32760: compensation enters with a part of the axis' velocity. Else at once.
    bool spreads = true;
};

struct plc_profile {
    std::string name;
    // Function codes that are served from the holding registers.
    std::vector<int> registers;
    // Function codes that exist, but for tables without any address here: exception 02, not 01.
    std::vector<int> empty_tables;
    int max_clients;
    double scan_jitter_s;  // a scan is longer or shorter by up to this
    nc_interface nc;

    bool serves(int function) const;
    bool knows(int function) const;

    // "generic", "sinumerik-840d" or "fanuc".
    static std::optional<plc_profile> find(const std::string &name);
    static std::vector<std::string> names();
};

}  // namespace compbox
