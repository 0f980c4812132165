// SPDX-License-Identifier: MIT
// Options of read_csv() for tables without a header or with gaps.
#pragma once

#include <functional>

#include "host-tools/formats/csv.h"

namespace compbox {

struct csv_reading {
    std::vector<std::string> words;    // columns whose cells are texts
    std::vector<std::string> columns;  // names of the columns; an equal header line is allowed
    bool gaps = false;                 // an empty cell is NaN, not a fault
    // New names of columns, applied first; a name in use is not changed.
    std::function<std::string(const std::string &)> rename = {};
    // Finds the header by the (renamed) names; lines above it are skipped. Default, and without a
    // match: the first line.
    std::function<bool(const std::vector<std::string> &)> is_header = {};
};

// Like read_csv of csv.h, which calls it.
csv_table read_csv(const std::string &path, const csv_reading &how,
                   std::vector<std::vector<std::string>> *word_lists = nullptr);

}  // namespace compbox
