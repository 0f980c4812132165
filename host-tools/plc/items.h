// SPDX-License-Identifier: MIT
// Values in a server's registers: their types, scales and texts.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/fakeplc/number.h"
#include "host-tools/formats/json_type.h"
#include "host-tools/plc/libmodbus.h"

namespace compbox::plc {

// value = raw * scale + zero. Bits are a number of one word.
struct item {
    std::string name;  // "": the address alone
    table from = table::holding;
    int address = 0;
    fakeplc::number_format format;
    double scale = 1.0, zero = 0.0;
    std::string unit;     // "mm"; "": none
    int block = -1;       // items of one block share a request; -1: of none
    bool by_plc = false;  // of the block that the PLC writes and the box reads

    int end() const { return address + format.registers; }
    std::string place() const;  // "8 (X)", "8"
};

// Words by their address, of one table.
using words_at = std::map<int, std::uint16_t>;

// in : items of one table, at least one
// out: their words; those of one block, or without a gap between them, are one request
words_at read_items(client &from, const std::vector<item> &items);

// out: the item's words, in the order of their addresses
std::vector<std::uint16_t> words_of(const item &of, const words_at &words);

double value_of(const item &of, const words_at &words);

// "12.345 mm", "-3"
std::string value_text(const item &of, const words_at &words);

// "0x0001 0xe240"
std::string raw_text(const item &of, const words_at &words);

// {"address", "name", "value", "unit", "registers"}; value null where it is not finite
json item_figures(const item &of, const words_at &words);

// in : a number as typed, decimal or 0x…, in the item's unit
// out: its words. Throws input_error for a text that is no number, a value that the type does not
// hold, and a fraction in an integer without scale.
std::vector<std::uint16_t> encode(const item &to, const std::string &text);

}  // namespace compbox::plc
