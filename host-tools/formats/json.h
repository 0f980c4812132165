// SPDX-License-Identifier: MIT
// JSON on the host, with the place of every mistake. The box's own loader is
// firmware/load/load.h.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "host-tools/formats/json_type.h"

namespace compbox {

// Nesting that every reader of the host accepts, the box's own included (CB_JSON_MAX_DEPTH).
constexpr int json_max_depth = 32;

// Parses a file; duplicate keys and deeper nesting are mistakes. Throws input_error with file, line
// and column.
json read_json(const std::string &path);

// Pretty text, two spaces, arrays of numbers on one line; ends with a line end. Finite numbers
// only: a NaN or infinity throws std::logic_error (a fault of ours, not of the user).
std::string json_text(const json &value);

// value[key] as T, with one sentence naming file and path where it is missing or of another type.
// Whole numbers, also in a list, must be whole and in the range of T: 1e300 is refused, 3.0 is 3.
// Texts have no control characters (text.h).
template <typename T>
T get(const json &value, const std::string &key, const std::string &file);
template <typename T>
T get_or(const json &value, const std::string &key, const T &otherwise, const std::string &file);

// Throws input_error where an object has a key that is not in `allowed`.
void only_keys(const json &value, std::initializer_list<const char *> allowed,
               const std::string &file, const std::string &path);

}  // namespace compbox

#include "host-tools/formats/json_get.inl"
