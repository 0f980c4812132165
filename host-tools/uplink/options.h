// SPDX-License-Identifier: MIT
// --mqtt and what belongs to it.
#pragma once

#include <optional>
#include <string>

#include "host-tools/command_line/command_line.h"
#include "host-tools/uplink/uplink.h"

namespace compbox::uplink {

struct options {
    std::string broker;  // HOST:PORT, HOST or [IPV6]:PORT; "": none
    std::string topic, user, password_file, ca_file;
    double every_s = 10.0;
    unsigned buffer_mb = 32;
};

void add_options(cli::command &app, options &chosen);

// out: nothing without --mqtt. Throws usage_error for options that do not fit together, input_error
// for a password file that cannot be read.
std::optional<settings> settings_of(const options &chosen);

}  // namespace compbox::uplink
