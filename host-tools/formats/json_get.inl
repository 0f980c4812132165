// SPDX-License-Identifier: MIT
// Templates of json.h.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "host-tools/formats/error.h"
#include "host-tools/formats/text.h"

namespace compbox::formats {

namespace json_detail {

// What the elements of a list are, or the type itself.
template <typename T>
struct element {
    using type = T;
};
template <typename T>
struct element<std::vector<T>> {
    using type = T;
};
template <typename T>
constexpr bool is_whole = std::is_integral_v<T> && !std::is_same_v<T, bool>;

// in : a number. out: it is whole, and T holds it
template <typename T>
bool holds(const json &number) {
    using limits = std::numeric_limits<T>;
    if (number.is_number_unsigned()) {
        return number.get<std::uint64_t>() <= static_cast<std::uint64_t>(limits::max());
    }
    if (number.is_number_integer()) {
        const auto value = number.get<std::int64_t>();
        return value >= 0 ||
               (limits::is_signed && value >= static_cast<std::int64_t>(limits::min()));
    }
    const double value = number.get<double>(), beyond = std::ldexp(1.0, limits::digits);
    return value == std::floor(value) && value < beyond &&
           value >= (limits::is_signed ? -beyond : 0.0);
}

// Throws where a number that becomes a T is none. Other types are the library's to refuse.
template <typename T>
void check_whole(const json &value, const std::string &key, const std::string &file) {
    if (value.is_array()) {
        for (const auto &one : value) check_whole<T>(one, key, file);
    } else if (value.is_number() && !holds<T>(value)) {
        throw input_error(file, 0, 0, "the key '{}' must be a whole number from {} to {}", key,
                          std::numeric_limits<T>::min(), std::numeric_limits<T>::max());
    }
}

// Throws where a text has a control character. A list's texts are looked at too.
inline void check_text(const json &value, const std::string &key, const std::string &file) {
    if (value.is_array()) {
        for (const auto &one : value) check_text(one, key, file);
    } else if (value.is_string()) {
        const auto &text = value.get_ref<const std::string &>();
        if (printable(text) == text) return;
        throw input_error(file, 0, 0, "the key '{}': '{}' contains a control character", key, text);
    }
}

}  // namespace json_detail

template <typename T>
T get(const json &value, const std::string &key, const std::string &file) {
    if (!value.is_object() || !value.contains(key)) {
        throw input_error(file, 0, 0, "the key '{}' is missing", key);
    }
    using element = typename json_detail::element<T>::type;
    if constexpr (json_detail::is_whole<element>) {
        json_detail::check_whole<element>(value.at(key), key, file);
    } else if constexpr (std::is_same_v<element, std::string>) {
        json_detail::check_text(value.at(key), key, file);
    }
    try {
        return value.at(key).get<T>();
    } catch (const nlohmann::json::exception &) {
        throw input_error(file, 0, 0, "the key '{}' has the wrong type ({})", key,
                          value.at(key).type_name());
    }
}

template <typename T>
T get_or(const json &value, const std::string &key, const T &otherwise, const std::string &file) {
    return value.is_object() && value.contains(key) ? get<T>(value, key, file) : otherwise;
}

}  // namespace compbox::formats
