// SPDX-License-Identifier: MIT
// Properties of each kind of control as data: its Modbus server, its PLC's scan, and the transfer
// from the PLC to the NC (docs/fakeplc.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace compbox::fakeplc {

// Transfer of a compensation from the PLC to the NC.
enum class nc_way {
    direct,        // unchanged, in the scan
    setting_data,  // SINUMERIK: K0, tan beta and P0 of one axis after the other, by FB3 PUT
    handshake,     // FANUC: EA/ED/ESTB/EREND, machine zero-point shift
};

struct nc_interface {
    nc_way way = nc_way::direct;
    double deadband_um = 0.0;  // smallest difference that is written to the NC
    // setting_data: time until a variable is in the NC, from the request or from the previous
    // variable; largest error of an incomplete set.
    double put_shortest_s = 0.0, put_longest_s = 0.0, tear_um = 0.0;
    // handshake: interpolation cycles until the NC answers; largest value, and first change that
    // is an alarm, in increments of the channel's register.
    int answer_shortest_cycles = 0, answer_longest_cycles = 0, alarm_units = 0;
    // MD32760: limits compensation to a share of the axis velocity; else it enters at once.
    bool spreads = true;
};

struct plc_profile {
    std::string name;
    // Function codes that are served from the holding registers.
    std::vector<int> registers;
    // Function codes of tables without addresses: exception 02, not 01.
    std::vector<int> empty_tables;
    int max_clients;
    double scan_jitter_s;  // largest deviation of a scan
    nc_interface nc;

    bool serves(int function) const;
    bool knows(int function) const;

    // "generic", "sinumerik-840d" or "fanuc".
    static std::optional<plc_profile> find(const std::string &name);
    static std::vector<std::string> names();
};

}  // namespace compbox::fakeplc
