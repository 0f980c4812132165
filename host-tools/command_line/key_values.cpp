// SPDX-License-Identifier: MIT
#include "host-tools/command_line/key_values.h"

#include <fmt/core.h>

#include <charconv>
#include <cmath>

#include "host-tools/command_line/command_line.h"

namespace compbox::cli {

namespace {

[[noreturn]] void refuse_pair(const std::string &option, const std::string &text) {
    throw cli::usage_error(option, fmt::format("'{}' must read NAME=number or NAME=x,y,z", text));
}

// The number at `at`, which moves behind it and behind a comma that is not the last character.
bool take_number(const char *&at, const char *end, double &value) {
    const auto result = std::from_chars(at, end, value);
    if (result.ec != std::errc() || !std::isfinite(value)) return false;
    at = result.ptr;
    if (at == end) return true;
    return *at++ == ',' && at != end;
}

}  // namespace

key_values parse_key_values(const std::string &option, const std::string &text) {
    const auto equals = text.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == text.size()) {
        refuse_pair(option, text);
    }
    key_values result{text.substr(0, equals), {}};
    const char *at = text.data() + equals + 1, *end = text.data() + text.size();
    while (at != end) {
        double value = 0.0;
        if (!take_number(at, end, value)) refuse_pair(option, text);
        result.values.push_back(value);
    }
    return result;
}

std::vector<std::string> split_at_keys(const std::string &text) {
    std::vector<std::string> pieces;
    std::size_t start = 0;
    for (std::size_t comma = text.find(','); comma != std::string::npos;
         comma = text.find(',', comma + 1)) {
        const std::size_t next = text.find(',', comma + 1), equals = text.find('=', comma + 1);
        if (equals == std::string::npos || equals > next) continue;
        pieces.push_back(text.substr(start, comma - start));
        start = comma + 1;
    }
    pieces.push_back(text.substr(start));
    return pieces;
}

}  // namespace compbox::cli
