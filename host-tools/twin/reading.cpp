// SPDX-License-Identifier: MIT
#include "host-tools/twin/reading.h"

#include <cmath>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

namespace compbox::twin::reading {

void place::fail(const std::string &sentence) const {
    throw input_error(file, 0, 0, path + (path.empty() ? "" : ": ") + sentence);
}

void check_keys(const json &value, std::initializer_list<const char *> allowed, const place &at) {
    formats::only_keys(value, allowed, at.file, at.path.empty() ? "the file" : at.path);
}

double as_number(const json &value, double low, double high, const place &at) {
    if (!value.is_number()) at.fail("must be a number");
    const double number = value.get<double>();
    if (!std::isfinite(number) || number < low || number > high) {
        at.fail(fmt::format("{} is not {}", number,
                            high == unlimited ? fmt::format("{} or more", low)
                                              : fmt::format("between {} and {}", low, high)));
    }
    return number;
}

double required(const json &value, const char *key, double low, double high, const place &at) {
    if (!value.contains(key)) at.fail(fmt::format("the key '{}' is missing", key));
    return as_number(value.at(key), low, high, at.in(key));
}

double optional(const json &value, const char *key, double otherwise, double low, double high,
                const place &at) {
    return value.contains(key) ? as_number(value.at(key), low, high, at.in(key)) : otherwise;
}

std::string optional_text(const json &value, const char *key, const place &at) {
    if (!value.contains(key)) return "";
    if (!value.at(key).is_string()) at.in(key).fail("must be a text");
    return formats::get<std::string>(value, key, at.file);
}

const json &optional_object(const json &value, const char *key, const place &at) {
    static const json none = json::object();
    if (!value.contains(key)) return none;
    if (!value.at(key).is_object()) at.in(key).fail("must be an object");
    return value.at(key);
}

}  // namespace compbox::twin::reading
