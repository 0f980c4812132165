// SPDX-License-Identifier: MIT
// Options of read_csv() for tables without a header or with gaps.
#pragma once

#include <functional>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/units.h"

namespace compbox::formats {

struct csv_reading {
    std::vector<std::string> words;    // columns whose cells are texts
    std::vector<std::string> columns;  // names of the columns; an equal header line is allowed
    bool gaps = false;                 // an empty cell is NaN, not a fault
    // New names of columns, applied first; a name in use is not changed. With it the units are the
    // caller's matter.
    std::function<std::string(const std::string &)> rename = {};
    // Else: the name and unit of a column "Temp 1 [°C]", whose values are converted.
    unit_choice units = machine_unit;
    // Finds the header by the (renamed) names; lines above it are skipped. Default, and without a
    // match: the first line.
    std::function<bool(const std::vector<std::string> &)> is_header = {};
};

// Like read_csv of csv.h, which calls it.
csv_table read_csv(const std::string &path, const csv_reading &how,
                   std::vector<std::vector<std::string>> *word_lists = nullptr);

// The same for a text (table_text.h); path: for messages.
csv_table read_csv_text(const std::string &path, const std::string &text, const csv_reading &how,
                        std::vector<std::vector<std::string>> *word_lists = nullptr);

}  // namespace compbox::formats
