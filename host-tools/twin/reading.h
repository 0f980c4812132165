// SPDX-License-Identifier: MIT
// Reading a twin file: every message begins with the file and the key.
#pragma once

#include <initializer_list>
#include <limits>
#include <string>

#include "host-tools/formats/json_type.h"

namespace compbox::twin::reading {

constexpr double unlimited = std::numeric_limits<double>::max();

// A place in the file, for messages.
struct place {
    std::string file, path;

    place in(const std::string &key) const { return {file, path.empty() ? key : path + "." + key}; }
    place at(std::size_t i) const { return {file, path + "[" + std::to_string(i) + "]"}; }
    [[noreturn]] void fail(const std::string &sentence) const;  // throws input_error
};

// All of these throw input_error with the place of an unknown or missing key, or a value of the
// wrong type or size. Ranges are inclusive.
void check_keys(const json &value, std::initializer_list<const char *> allowed, const place &at);
double as_number(const json &value, double low, double high, const place &at);
double required(const json &value, const char *key, double low, double high, const place &at);
double optional(const json &value, const char *key, double otherwise, double low, double high,
                const place &at);
std::string optional_text(const json &value, const char *key, const place &at);  // "" if missing
const json &optional_object(const json &value, const char *key, const place &at);

}  // namespace compbox::twin::reading
