// SPDX-License-Identifier: MIT
#include "host-tools/command_line/screen.h"

#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <ostream>

namespace compbox::cli {

namespace {

bool continues(char byte) {
    return (static_cast<unsigned char>(byte) & 0xC0) == 0x80;
}

winsize size_of_terminal() {
    winsize size = {};
    if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return {24, 80, 0, 0};
    return size;
}

}  // namespace

std::size_t characters(const std::string &text) {
    return static_cast<std::size_t>(
        std::count_if(text.begin(), text.end(), [](char byte) { return !continues(byte); }));
}

std::string clipped(const std::string &text, std::size_t columns) {
    std::size_t count = 0, at = 0;
    for (; at < text.size(); ++at) {
        if (!continues(text[at]) && count++ == columns) break;
    }
    return text.substr(0, at);
}

std::string padded(const std::string &text, std::size_t columns) {
    const std::size_t has = characters(text);
    return has < columns ? text + std::string(columns - has, ' ') : text;
}

std::size_t screen::rows() const {
    return std::max<std::size_t>(size_of_terminal().ws_row, 8) - 2;
}

void screen::draw(const std::vector<std::string> &lines) {
    if (!terminal_) return;
    const std::size_t columns = size_of_terminal().ws_col - 1u;
    const bool first = drawn_ == 0;
    if (first) drawn_ = std::min(lines.size(), rows());
    std::string text = first ? "" : fmt::format("\0337\033[{}A\r", drawn_);
    for (std::size_t i = 0; i < drawn_; ++i) {
        text += (i < lines.size() ? clipped(lines[i], columns) : "") + "\033[K\n";
    }
    if (!first) text += "\0338";
    err_ << text << std::flush;
}

void screen::clear() {
    if (drawn_ == 0) return;
    err_ << fmt::format("\033[{}A\r\033[J", drawn_ + 1) << std::flush;
    drawn_ = 0;
}

}  // namespace compbox::cli
