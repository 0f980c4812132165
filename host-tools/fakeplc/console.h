// SPDX-License-Identifier: MIT
// Live commands to the PLC, one a line, each answered by one line (docs/fakeplc.md).
#pragma once

#include <string>
#include <string_view>

#include "host-tools/fakeplc/plc.h"
#include "host-tools/fakeplc/wire_server.h"

namespace compbox {

struct console {
    fake_plc &plc;
    wire_server &server;
    bool quit = false;

    // The answer, without a line end: "ok", "ok …" or "error: …". Any text is allowed.
    std::string run(const std::string &line);
};

// Every command, for --help.
std::string_view console_help();

}  // namespace compbox
