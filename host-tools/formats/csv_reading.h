// SPDX-License-Identifier: MIT
// Tables that are not quite as read_csv() wants them: without a header, with gaps.
#pragma once

#include <functional>

#include "host-tools/formats/csv.h"

namespace compbox {

struct csv_reading {
    std::vector<std::string> words;    // columns whose cells are texts
    std::vector<std::string> columns;  // names of the columns; a header line then only says so too
    bool gaps = false;                 // an empty cell is a NaN and not a mistake
    // Other names for columns, before all else; one that is taken already changes nothing.
    std::function<std::string(const std::string &)> rename = {};
    // Which line is the header, told by the (renamed) names: what a program wrote above it is
    // passed over. Where no line is, or without this, it is the first.
    std::function<bool(const std::vector<std::string> &)> is_header = {};
};

// As read_csv of csv.h, which calls it.
csv_table read_csv(const std::string &path, const csv_reading &how,
                   std::vector<std::vector<std::string>> *word_lists = nullptr);

}  // namespace compbox
