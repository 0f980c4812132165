// SPDX-License-Identifier: MIT
// The names in the terms of a coefficient file: what a term gives, and what it works on. Terms that
// the loader would refuse give what can be read of them.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

namespace compbox::coefficients {

// term: an object with a name. The names under which its outputs are summed.
std::vector<std::string> outputs_of(const json &term);

// The signals that a term names, or that it uses by its type (a volumetric term's axes).
std::vector<std::string> signals_of(const json &term);

// The outputs that other terms work on: a product's slope, a volumetric term's errors.
std::set<std::string> consumed_outputs(const json &terms);

}  // namespace compbox::coefficients
