// SPDX-License-Identifier: MIT
// The last month in bounded memory: for each span of time the lowest and the highest value, so
// that a peak stays visible, however long the curve.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "host-tools/view/columns.h"

namespace compbox::view {

constexpr unsigned history_most_hours = 744;
constexpr std::size_t history_most_columns = 512;

class history {
  public:
    history();

    // in : names of the values of later rows; comp_NAME_um is the output of channel NAME
    void set_names(const std::vector<std::string> &names);

    // in : mode, reason: numbers of the status register; values: as named, NaN: none. Rows may come
    // in any order; those of the same span become one, with its worst mode.
    void add(double unix_s, int mode, int reason, const std::vector<float> &values);

    // in : hours 1 to history_most_hours, before unix_s; terms: the names that are terms' outputs
    // out: at most 1440 rows: two for each span, where a column has its lowest and its highest
    // value in the order in which they were; one row of gaps for spans without a row
    columns last(unsigned hours, double unix_s, const std::set<std::string> &terms) const;

  private:
    struct span {
        std::int64_t number = -1;  // time / width
        int mode = -1, reason = -1;
        std::vector<float> low, high;  // by column
        std::vector<char> rises;       // the highest came after the lowest
    };
    struct level {
        double width_s;
        std::vector<span> spans;  // number n is at n % size
    };
    static void put_gap(columns &table, double unix_s);
    static void put_span(columns &table, const std::vector<std::size_t> &ids, const span &at,
                         double width_s);
    void add_to(level &one, double unix_s, int mode, int reason, const std::vector<float> &values);

    std::vector<level> levels_;
    std::map<std::string, std::size_t> ids_;  // of the columns
    std::vector<std::size_t> id_of_value_;    // of those of the rows
};

}  // namespace compbox::view
