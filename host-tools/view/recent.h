// SPDX-License-Identifier: MIT
// The last ten minutes, one row a second, in bounded memory.
#pragma once

#include <map>

#include "host-tools/formats/json_type.h"
#include "host-tools/view/columns.h"

namespace compbox::view {

constexpr std::size_t recent_rows = 600;
constexpr std::size_t recent_most_columns = 1024;

class recent_values {
  public:
    // in : a snapshot as box_files/snapshot.h accepts it; null: there is no box, which ends the
    // curves by one empty row. At most one row for each second of unix_s is kept, the first. A wall
    // clock that goes back begins anew.
    void add(double unix_s, const json &snapshot);

    columns all() const;

  private:
    bool has_row_of(double unix_s) const;
    void set(const column_key &key, const json &from, const char *member);
    void set_row(const json &snapshot);
    void forget_empty();

    // Row n is at n % recent_rows of each list.
    std::size_t count_ = 0;
    std::vector<double> unix_s_ = std::vector<double>(recent_rows);
    std::vector<std::string> mode_ = std::vector<std::string>(recent_rows);
    std::vector<std::string> reason_ = std::vector<std::string>(recent_rows);
    struct series {
        std::vector<float> values;
        std::size_t last_row;  // that has a value
    };
    std::map<column_key, series> series_;
};

}  // namespace compbox::view
