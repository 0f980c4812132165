// SPDX-License-Identifier: MIT
// The name of the JSON type alone, for headers whose functions take or return it: the whole
// library costs every file that includes it a second of the compiler's time.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace compbox {

// Keeps the order of keys, so that files stay as people wrote them.
using json = nlohmann::ordered_json;

}  // namespace compbox
