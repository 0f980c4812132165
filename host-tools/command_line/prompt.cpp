// SPDX-License-Identifier: MIT
#include "host-tools/command_line/prompt.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ostream>

namespace compbox::cli {

namespace {

constexpr const char *blanks = " \t\r";

std::string trimmed(const std::string &text) {
    const std::size_t first = text.find_first_not_of(blanks);
    if (first == std::string::npos) return "";
    return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

}  // namespace

std::optional<typed_number> number_in(const std::string &text) {
    std::string digits = trimmed(text);
    if (digits.rfind('+', 0) == 0) {
        digits.erase(0, 1);
        if (digits.find_first_of("+-") == 0) return std::nullopt;
    }
    const std::size_t comma = digits.find(',');
    if (comma != std::string::npos) {
        if (digits.find('.') != std::string::npos) return std::nullopt;
        digits[comma] = '.';
    }
    typed_number number;
    const char *end = digits.data() + digits.size();
    const auto result = std::from_chars(digits.data(), end, number.value, std::chars_format::fixed);
    if (digits.empty() || result.ec != std::errc() || result.ptr != end ||
        !std::isfinite(number.value)) {
        return std::nullopt;
    }
    const std::size_t point = digits.find('.');
    if (point != std::string::npos) number.decimals = static_cast<int>(digits.size() - point - 1);
    return number;
}

prompt::prompt(const streams &io)
    : in_(io.in), err_(io.err), lines_(io.in), terminal_(::isatty(io.in) == 1) {}

// Calls it; what it throws begins on a line of its own.
void prompt::call(const std::function<void()> &wait) {
    try {
        wait();
    } catch (...) {
        err_ << std::endl;
        throw;
    }
}

std::optional<std::string> prompt::ask(const std::string &question,
                                       const std::function<void()> &wait) {
    err_ << question << std::flush;
    for (;;) {
        if (const auto line = lines_.next()) {
            if (!terminal_) err_ << "\n";
            return trimmed(*line);
        }
        if (wait) call(wait);
        pollfd input = {in_, POLLIN, 0};
        if (wait && ::poll(&input, 1, 0) <= 0) continue;
        if (lines_.read_more()) continue;
        err_ << std::endl;
        return std::nullopt;
    }
}

}  // namespace compbox::cli
