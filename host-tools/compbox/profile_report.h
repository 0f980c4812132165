// SPDX-License-Identifier: MIT
// What the control of a coefficient file allows, and what follows for this file.
#pragma once

#include <string>

#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config.h"
}

namespace compbox {

// {"profile", "functions", "exchange", "registers", "update_ms", …, "channels": {NAME: …}}
json profile_figures(const cb_config &config);

// The same in lines for a person.
std::string profile_text(const cb_config &config);

}  // namespace compbox
