// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/number.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace compbox::fakeplc {

namespace {

using byte_order = number_format::order;

// out: position on the wire of byte i of the big-endian number
std::size_t place_of(std::size_t i, std::size_t size, byte_order order) {
    if (order == byte_order::dcba) return size - 1 - i;
    if (order == byte_order::cdab && size == 4) return i ^ 2u;
    return i;
}

std::uint32_t to_bits(float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}

float to_float(std::uint32_t bits) {
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

bool ends_with(const std::string &text, const std::string &end) {
    return text.size() >= end.size() &&
           text.compare(text.size() - end.size(), end.size(), end) == 0;
}

}  // namespace

std::optional<number_format> number_format::parse(const std::string &name) {
    number_format format;
    std::string base = name;
    if (ends_with(base, "cdab")) format.bytes = order::cdab;
    if (ends_with(base, "le")) format.bytes = order::dcba;
    if (format.bytes == order::cdab) base.resize(base.size() - 4);
    if (format.bytes == order::dcba) base.resize(base.size() - 2);
    if (base == "int16" || base == "int32")
        format.what = kind::signed_integer;
    else if (base == "uint16" || base == "uint32")
        format.what = kind::unsigned_integer;
    else if (base == "float32")
        format.what = kind::floating;
    else
        return std::nullopt;
    format.registers = ends_with(base, "16") ? 1 : 2;
    if (format.registers == 1 && format.bytes == order::cdab) return std::nullopt;
    return format;
}

double number_format::lowest() const {
    if (what == kind::floating) return -static_cast<double>(std::numeric_limits<float>::max());
    if (what == kind::unsigned_integer) return 0.0;
    return registers == 1 ? -32768.0 : -2147483648.0;
}

double number_format::highest() const {
    if (what == kind::floating) return static_cast<double>(std::numeric_limits<float>::max());
    if (what == kind::unsigned_integer) return registers == 1 ? 65535.0 : 4294967295.0;
    return registers == 1 ? 32767.0 : 2147483647.0;
}

std::vector<std::uint16_t> number_format::encode(double number) const {
    std::vector<std::uint16_t> words(static_cast<std::size_t>(registers));
    encode_to(number, words.data());
    return words;
}

void number_format::encode_to(double number, std::uint16_t *words) const {
    const double held = std::isnan(number) ? 0.0 : std::clamp(number, lowest(), highest());
    const std::uint32_t bits =
        what == kind::floating
            ? to_bits(static_cast<float>(held))
            : static_cast<std::uint32_t>(static_cast<std::int64_t>(std::llround(held)));
    const std::size_t size = static_cast<std::size_t>(registers) * 2;
    std::array<std::uint8_t, 4> wire = {};
    for (std::size_t i = 0; i < size; ++i) {
        wire[place_of(i, size, bytes)] = static_cast<std::uint8_t>(bits >> (8 * (size - 1 - i)));
    }
    for (std::size_t i = 0; i < size; i += 2) {
        words[i / 2] = static_cast<std::uint16_t>(wire[i] << 8 | wire[i + 1]);
    }
}

double number_format::decode(const std::uint16_t *words) const {
    const std::size_t size = static_cast<std::size_t>(registers) * 2;
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < size; ++i) {
        const std::size_t at = place_of(i, size, bytes);
        const unsigned byte = at % 2 ? words[at / 2] & 0xFFu : words[at / 2] >> 8;
        bits = bits << 8 | byte;
    }
    if (what == kind::floating) return static_cast<double>(to_float(bits));
    if (what == kind::unsigned_integer) return static_cast<double>(bits);
    return registers == 1 ? static_cast<double>(static_cast<std::int16_t>(bits))
                          : static_cast<double>(static_cast<std::int32_t>(bits));
}

}  // namespace compbox::fakeplc
