// SPDX-License-Identifier: MIT
// The daemon's record (docs/compboxd.md) into a history, in small pieces: what is there when the
// program starts, its older files PATH.1, PATH.2 … (also compressed, PATH.N.gz), and what is
// appended.
#pragma once

#include <zlib.h>

#include <optional>
#include <string>
#include <vector>

#include "host-tools/box_files/followed_file.h"
#include "host-tools/view/history.h"

namespace compbox::view {

class record {
  public:
    // in : path: "": none
    explicit record(const std::string &path);
    ~record();
    record(const record &) = delete;
    record &operator=(const record &) = delete;

    // Reads about a megabyte. in : wall clock, s. out: whether there were rows
    bool poll(double unix_s);

    const history &values() const { return history_; }

  private:
    // The columns of one file, and its clock.
    struct table {
        std::vector<std::string> names;             // of the columns that are values
        std::vector<int> place;                     // of each cell: in `names`, or a part below
        std::optional<double> unix_s_of_time_zero;  // of a file without the column unix_s
    };
    enum part { time_part = -1, mode_part = -2, reason_part = -3, unix_part = -4 };

    std::size_t begin(int descriptor);
    void take(table &of, std::string_view line, double unix_s);
    void take_header(table &of, std::string_view line);
    void take_row(table &of, std::string_view line, double unix_s);
    void read_older(double unix_s);
    bool open_older();

    std::string path_;
    box_files::followed_file file_;
    history history_;
    table newest_;
    std::vector<float> row_;
    bool has_rows_ = false;

    // One older file after the other, from the newest.
    unsigned older_ = 1;  // number of the one that is read; 0: all are
    gzFile older_file_ = nullptr;
    table older_table_;
    box_files::line_cutter older_lines_;
    double oldest_s_ = 0.0;  // of the last row that was read
};

}  // namespace compbox::view
