// SPDX-License-Identifier: MIT
#include "host-tools/commission/prompt.h"

#include <poll.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <iostream>
#include <optional>

#include "host-tools/formats/error.h"

namespace compbox::commission {

namespace {

// Bytes of standard input that no question has used yet.
std::string &waiting_text() {
    static std::string text;
    return text;
}

std::optional<std::string> waiting_line() {
    std::string &text = waiting_text();
    const std::size_t end = text.find('\n');
    if (end == std::string::npos) return std::nullopt;
    std::string line = text.substr(0, end);
    text.erase(0, end + 1);
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    return line;
}

void take_input() {
    pollfd input = {STDIN_FILENO, POLLIN, 0};
    if (::poll(&input, 1, 0) <= 0) return;
    char piece[256];
    const ssize_t got = ::read(STDIN_FILENO, piece, sizeof piece);
    if (got > 0) waiting_text().append(piece, static_cast<std::size_t>(got));
    if (got == 0) {
        throw input_error("no answer: standard input has ended; give --measured AXIS=UM instead");
    }
}

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

std::string ask(const std::string &question, const std::function<void()> &wait) {
    std::cerr << question << std::flush;
    for (;;) {
        if (const auto line = waiting_line()) {
            if (::isatty(STDIN_FILENO) == 0) std::cerr << "\n";
            return *line;
        }
        wait();
        take_input();
    }
}

double ask_number(const std::string &question, const std::function<void()> &wait) {
    for (;;) {
        if (const auto value = number_in(ask(question, wait))) return *value;
        std::cerr << "A number in µm, please, as in -19.8\n";
    }
}

}  // namespace compbox::commission
