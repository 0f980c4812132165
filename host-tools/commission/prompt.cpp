// SPDX-License-Identifier: MIT
#include "host-tools/commission/prompt.h"

#include <poll.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <ostream>

#include "host-tools/formats/error.h"

namespace compbox::commission {

namespace {

std::optional<double> number_in(const std::string &line) {
    const std::size_t first = line.find_first_not_of(" \t+");
    double value = 0.0;
    if (first == std::string::npos) return std::nullopt;
    const char *end = line.data() + line.size();
    const auto result = std::from_chars(line.data() + first, end, value);
    if (result.ec != std::errc() || result.ptr != end || !std::isfinite(value)) return std::nullopt;
    return value;
}

}  // namespace

std::string prompt::ask(const std::string &question, const std::function<void()> &wait) {
    err_ << question << std::flush;
    for (;;) {
        if (auto line = lines_.next()) {
            if (::isatty(in_) == 0) err_ << "\n";
            line->erase(line->find_last_not_of("\r ") + 1);
            return *line;
        }
        wait();
        pollfd input = {in_, POLLIN, 0};
        if (::poll(&input, 1, 0) > 0 && !lines_.read_more()) {
            throw input_error(
                "no answer: standard input has ended; give --measured AXIS=UM instead");
        }
    }
}

double prompt::ask_number(const std::string &question, const std::function<void()> &wait) {
    for (;;) {
        if (const auto value = number_in(ask(question, wait))) return *value;
        err_ << "A number in µm, please, as in -19.8\n";
    }
}

}  // namespace compbox::commission
