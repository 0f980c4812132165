// SPDX-License-Identifier: MIT
// JSON on the host, with the place of every error. The box's own loader is firmware/load/load.h.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "host-tools/formats/json_type.h"

namespace compbox::formats {

// Maximum nesting, equal to the box's CB_JSON_MAX_DEPTH.
constexpr int json_max_depth = 32;

// Parses a file. Throws input_error with file, line and column, also for duplicate keys and deeper
// nesting.
json read_json(const std::string &path);

// out: text indented by two spaces, arrays of numbers on one line, with a line end. in : finite
// numbers; NaN or infinity throws std::logic_error (a programmer's error).
std::string json_text(const json &value);

// out: the value on one line. in : texts of others, which may be no UTF-8
std::string json_line(const json &value);

// out: value[key], or null
json member_or_null(const json &value, const char *key);

// out: the end of a sentence about a text that is no JSON, such as a table; "" if it may be JSON
std::string remedy_of_json(const std::string &text);

// out: value[key] as T. Throws input_error, naming file and path, if it is missing or of another
// type. Integers, also in a list, must be whole and in the range of T: 3.0 is 3, 1e300 is rejected.
// Texts have no control characters (text.h).
template <typename T>
T get(const json &value, const std::string &key, const std::string &file);
template <typename T>
T get_or(const json &value, const std::string &key, const T &otherwise, const std::string &file);

// Throws input_error if an object has a key that is not in `allowed`.
void only_keys(const json &value, std::initializer_list<const char *> allowed,
               const std::string &file, const std::string &path);

}  // namespace compbox::formats

#include "host-tools/formats/json_get.inl"
