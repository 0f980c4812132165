// SPDX-License-Identifier: MIT
// Text with places to fill in.
#pragma once

#include <string>

#include "host-tools/formats/json_type.h"

namespace compbox::formats {

// in : text; values, an object
//      @key@ in a line       is values[key], a text or a whole number
//      a line @each key@     repeats the lines up to its @end@ for each object of the list
//                            values[key], whose keys come before those outside
//      a line @if key@, @not key@   keeps the lines up to its @end@ where values[key] is true
//                            (false); lists and texts are true where they are not empty
// out: the text. Throws std::logic_error for a key that is not there: a fault of ours.
std::string expanded(const std::string &text, const json &values);

}  // namespace compbox::formats
