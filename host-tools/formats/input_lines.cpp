// SPDX-License-Identifier: MIT
#include "host-tools/formats/input_lines.h"

#include <unistd.h>

#include <cerrno>

namespace compbox::formats {

bool input_lines::read_more() {
    constexpr std::size_t longest = 65536;
    char block[1024];
    const ssize_t got = ::read(descriptor_, block, sizeof block);
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) return true;
    if (got <= 0) return false;
    if (text_.size() > longest) text_.clear();
    text_.append(block, static_cast<std::size_t>(got));
    return true;
}

std::optional<std::string> input_lines::next() {
    const std::size_t end = text_.find('\n');
    if (end == std::string::npos) return std::nullopt;
    std::string line = text_.substr(0, end);
    text_.erase(0, end + 1);
    return line;
}

}  // namespace compbox::formats
