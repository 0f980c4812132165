// SPDX-License-Identifier: MIT
// Declares the JSON type for headers; including the whole library takes the compiler a second.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace compbox {

// Keeps the order of keys.
using json = nlohmann::ordered_json;

}  // namespace compbox
