// SPDX-License-Identifier: MIT
// Measurements whose sign is wrong (metrology/mirrored.h), as sentences.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host-tools/fitting/measurement.h"

namespace compbox::fitting {

// out: one sentence for each run that mirrors the others
std::vector<std::string> mirrored_run_warnings(const measurement &data);

// out: a sentence if the error after compensation is about twice the error before, with its shape;
// compares the means at the positions of `before` that `after` covers
std::optional<std::string> doubled_error_warning(const measurement &before,
                                                 const measurement &after);

}  // namespace compbox::fitting
