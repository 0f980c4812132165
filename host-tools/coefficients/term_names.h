// SPDX-License-Identifier: MIT
// The names in the terms of a coefficient file: outputs and inputs of a term. For invalid terms,
// the functions return the readable names.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

namespace compbox::coefficients {

// in : term: an object with a name. out: the names of its outputs
std::vector<std::string> outputs_of(const json &term);

// out: the signals that a term names or uses by its type (a volumetric term's axes)
std::vector<std::string> signals_of(const json &term);

// out: outputs that other terms use: a product's slope, a volumetric term's errors, an
//      adapted term's model
std::set<std::string> consumed_outputs(const json &terms);

}  // namespace compbox::coefficients
