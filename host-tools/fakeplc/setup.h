// SPDX-License-Identifier: MIT
// Makes machine, registers and kind of control from the command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "host-tools/fakeplc/profile.h"
#include "host-tools/fakeplc/register_map.h"
#include "host-tools/twin/twin_file.h"

namespace compbox::fakeplc {

struct plc_options {
    std::string profile;  // "": the map's
    std::string machine;  // "": a machine without errors, made from the map
    std::string map;      // "": the one that the twin file names, or the usual one
    std::optional<std::uint64_t> seed;
    std::optional<double> size_um = std::nullopt;  // of every axis, instead of the twin file's
};

struct plc_setup {
    twin::twin_config twin;
    register_map map;
    plc_profile profile;
};

// Throws input_error with one sentence when a file is bad. No option is needed.
plc_setup prepare(const plc_options &options);

}  // namespace compbox::fakeplc
