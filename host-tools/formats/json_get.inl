// SPDX-License-Identifier: MIT
// Templates of json.h.
#pragma once

#include "host-tools/formats/error.h"

namespace compbox {

template <typename T>
T get(const json &value, const std::string &key, const std::string &file) {
    if (!value.is_object() || !value.contains(key)) {
        throw input_error(file, 0, 0, "the key '" + key + "' is missing");
    }
    try {
        return value.at(key).get<T>();
    } catch (const nlohmann::json::exception &) {
        throw input_error(file, 0, 0,
                          "the key '" + key + "' has the wrong type (" +
                              std::string(value.at(key).type_name()) + ")");
    }
}

template <typename T>
T get_or(const json &value, const std::string &key, const T &otherwise, const std::string &file) {
    return value.is_object() && value.contains(key) ? get<T>(value, key, file) : otherwise;
}

}  // namespace compbox
