// SPDX-License-Identifier: MIT
#include "host-tools/formats/text.h"

#include <iconv.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <string_view>

namespace compbox::formats {

namespace {

bool starts_with(const std::string &text, std::string_view start) {
    return text.compare(0, start.size(), start) == 0;
}

// out: length of the UTF-8 character at `at`; 0 if it is invalid (overlong, surrogate)
std::size_t utf8_length(const std::string &text, std::size_t at) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<std::uint8_t>(text[i]) : std::uint8_t{0};
    };
    const std::uint8_t first = byte(at);
    if (first < 0x80) return 1;
    const std::size_t length = first >= 0xF5 ? 0 : first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
    if (length == 0 || first < 0xC2) return 0;
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(at + i) & 0xC0) != 0x80) return 0;
    }
    const std::uint8_t second = byte(at + 1);
    const bool wrong = (first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
                       (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F);
    return wrong ? 0 : length;
}

bool is_utf8(const std::string &text) {
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = utf8_length(text, at);
        if (length == 0) return false;
        at += length;
    }
    return true;
}

// A lead byte of GBK is followed by a trail byte. Chinese text is almost all in the part where the
// trail is above 0xA0 too; a µ or ° of Windows-1252 is followed by ASCII.
bool looks_like_gbk(const std::string &text) {
    std::size_t pairs = 0, lonely = 0;
    for (std::size_t at = 0; at < text.size(); ++at) {
        if (static_cast<std::uint8_t>(text[at]) < 0x81) continue;
        const auto trail = at + 1 < text.size() ? static_cast<std::uint8_t>(text[at + 1]) : 0;
        if (trail >= 0x81) {
            ++pairs;
            ++at;
        } else {
            ++lonely;
        }
    }
    return pairs > lonely;
}

// out: the bytes as UTF-8, "?" for an invalid byte; the bytes themselves for an unknown code page
std::string converted(const std::string &bytes, const char *code_page) {
    const iconv_t converter = iconv_open("UTF-8", code_page);
    if (converter == reinterpret_cast<iconv_t>(-1)) return bytes;
    std::string in = bytes, out;
    char *from = in.data();
    std::size_t left = in.size();
    while (left > 0) {
        char piece[4096];
        char *to = piece;
        std::size_t room = sizeof piece;
        const bool ok = iconv(converter, &from, &left, &to, &room) != static_cast<std::size_t>(-1);
        const int reason = errno;
        out.append(piece, sizeof piece - room);
        if (ok || reason == E2BIG) continue;
        out += '?';  // invalid byte
        ++from;
        --left;
    }
    iconv_close(converter);
    return out;
}

}  // namespace

namespace {

std::string decoded(const std::string &bytes) {
    if (starts_with(bytes, "\xFF\xFE")) return converted(bytes.substr(2), "UTF-16LE");
    if (starts_with(bytes, "\xFE\xFF")) return converted(bytes.substr(2), "UTF-16BE");
    const bool marked = starts_with(bytes, "\xEF\xBB\xBF");
    if (is_utf8(bytes)) return marked ? bytes.substr(3) : bytes;
    return converted(bytes, looks_like_gbk(bytes) ? "GB18030" : "WINDOWS-1252");
}

}  // namespace

namespace {

// in : `length` bytes of one valid character at `at`
bool is_control(const std::string &text, std::size_t at, std::size_t length) {
    std::uint32_t code = static_cast<std::uint8_t>(text[at]);
    if (length > 1) code &= 0x7Fu >> length;
    for (std::size_t i = 1; i < length; ++i) {
        code = code << 6 | (static_cast<std::uint8_t>(text[at + i]) & 0x3Fu);
    }
    return code < 0x20 || (code >= 0x7F && code <= 0x9F) || code == 0x061C || code == 0x200E ||
           code == 0x200F || (code >= 0x2028 && code <= 0x202E) ||
           (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string printable(const std::string &text) {
    std::string shown;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = std::max<std::size_t>(utf8_length(text, at), 1);
        if (is_control(text, at, length)) {
            shown += '?';
        } else {
            shown.append(text, at, length);
        }
        at += length;
    }
    return shown;
}

std::string to_utf8(const std::string &bytes) {
    std::string text = decoded(bytes);
    std::replace(text.begin(), text.end(), '\0', '?');  // a zero byte would truncate messages
    return text;
}

std::vector<std::string> split(const std::string &text, char separator) {
    std::vector<std::string> pieces;
    std::size_t start = 0;
    for (std::size_t end; (end = text.find(separator, start)) != std::string::npos; start = end + 1)
        pieces.push_back(text.substr(start, end - start));
    pieces.push_back(text.substr(start));
    return pieces;
}

}  // namespace compbox::formats
