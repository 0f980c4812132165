// SPDX-License-Identifier: MIT
// Live commands to the PLC, one a line, each answered by one line (docs/fakeplc.md).
#pragma once

#include <string>
#include <string_view>

#include "host-tools/fakeplc/plc.h"
#include "host-tools/fakeplc/wire_server.h"

namespace compbox::fakeplc {

struct console {
    fake_plc &plc;
    wire_server &server;
    bool quit = false;

    // in : any text. out: the answer without a line end: "ok", "ok …" or "error: …"
    std::string run(const std::string &line);
};

// out: help for every command
std::string_view console_help();

}  // namespace compbox::fakeplc
