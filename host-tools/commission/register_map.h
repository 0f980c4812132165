// SPDX-License-Identifier: MIT
// The registers of a file by name, with what was seen in them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/commission/live.h"

extern "C" {
#include "firmware/wire/number.h"
}

namespace compbox::commission {

// A number of the read or write block, and its newest observation.
struct map_row {
    std::string name;      // of a signal its own; "X applied"; "control word"
    std::string unit;      // "": a word of bits or a count
    unsigned index = 0;    // in its block
    unsigned address = 0;  // of its first register
    cb_number_type type = CB_NUMBER_UINT16;
    double scale = 1.0, zero = 0.0;
    bool written = false;               // of the write block
    std::optional<std::size_t> signal;  // index in the configuration

    std::vector<std::uint16_t> raw;
    double value = 0.0, low = 0.0, high = 0.0;  // newest, smallest and largest in `unit`
    bool seen = false, in_range = true;
};

// out: "int32cdab"
const char *type_word(cb_number_type type);

// out: "register 8" or "registers 8 and 9"
std::string registers_of(const map_row &row);

// out: value of registers of this type, as the row's signal has it
double decoded(const map_row &row, cb_number_type type, const std::uint16_t *registers);

// out: mm or deg, which is a position to jog
bool is_position(const map_row &row);

class register_map {
  public:
    explicit register_map(const box_setup &setup);

    // Takes the registers of the live box's last cycle; without a good reading only those written.
    void observe(const live_box &live);

    const std::vector<map_row> &rows() const { return rows_; }
    // out: rows of the signals, in the order of the file
    std::vector<const map_row *> signals() const;

  private:
    void add(const std::string &name, unsigned index, bool written);
    void take(map_row &row, const std::uint16_t *registers);

    const cb_config &config_;
    std::vector<map_row> rows_;
};

}  // namespace compbox::commission
