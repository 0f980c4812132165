// SPDX-License-Identifier: MIT
// How the PLC lays numbers into registers. Written from the Modbus and type definitions, not from
// the box: the two must agree by themselves.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace compbox::fakeplc {

struct number_format {
    enum class kind { unsigned_integer, signed_integer, floating };
    enum class order { abcd, cdab, dcba };  // of the bytes; 16 bits: abcd is AB, dcba is BA

    kind what = kind::signed_integer;
    order bytes = order::abcd;
    int registers = 1;  // 1 or 2

    // "int16", "uint32le", "float32cdab" …; nothing for any other text.
    static std::optional<number_format> parse(const std::string &name);

    // Smallest and largest number that it holds.
    double lowest() const;
    double highest() const;

    // Integers are rounded to the nearest and held inside the range; a NaN becomes 0.
    std::vector<std::uint16_t> encode(double number) const;
    void encode_to(double number, std::uint16_t *words) const;  // `registers` of them
    // words: `registers` of them. The result may be NaN or infinite for a float.
    double decode(const std::uint16_t *words) const;
};

}  // namespace compbox::fakeplc
