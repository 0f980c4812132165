// SPDX-License-Identifier: MIT
// What the Modbus server of each kind of control can do, as data (docs/fakeplc.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace compbox {

struct plc_profile {
    std::string name;
    // Function codes that are served from the holding registers.
    std::vector<int> registers;
    // Function codes that exist, but for tables without any address here: exception 02, not 01.
    std::vector<int> empty_tables;
    int max_clients;

    bool serves(int function) const;
    bool knows(int function) const;

    // "generic", "sinumerik-840d" or "fanuc".
    static std::optional<plc_profile> find(const std::string &name);
    static std::vector<std::string> names();
};

}  // namespace compbox
