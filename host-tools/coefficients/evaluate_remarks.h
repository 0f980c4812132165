// SPDX-License-Identifier: MIT
// Remarks on the rows of compbox eval.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "host-tools/formats/csv.h"

extern "C" {
#include "firmware/box/box.h"
}

namespace compbox::coefficients {

// The signals that a table has columns for; lags follow from them.
std::vector<unsigned> measured_signals(const cb_config &config);

// Rows of one kind: how many, and the first.
struct row_count {
    std::size_t count = 0;
    long first_line = 0;
    std::string detail;

    void add(long line, const std::string &what);
    std::string text() const;  // "2 rows, first line 3: detail"
};

// Collects remarks row by row. Keeps references to both arguments. In all functions `values` are
// those of measured_signals, and `box` has just been run on them.
class row_watcher {
  public:
    row_watcher(const cb_config &config, const formats::csv_table &samples);

    // Throws input_error where the first row lacks a signal without which the box does not run:
    // there is no value before it to hold.
    void require_steady_state(const cb_box &box, const std::vector<double> &values) const;

    // Before the cycle on a row: what the box counts from here on is counted for that row.
    void begin_row(const cb_box &box) { before_ = box.counters; }

    void look(std::size_t row, const cb_box &box, const std::vector<double> &values);

    // One sentence each; raw: what the box would do if it checked its inputs.
    std::vector<std::string> remarks(bool raw) const;

  private:
    std::string implausible_text(std::size_t sample, double value) const;

    const cb_config &config_;
    const formats::csv_table &samples_;
    std::vector<unsigned> measured_;
    std::vector<row_count> held_, missing_;  // implausible rows after a value, and before any
    std::vector<row_count> doubted_;         // rows that the other sensors contradict
    row_count not_active_;
    cb_counters before_ = {};
    row_count counted_[5];  // in the order of watched_counters
};

}  // namespace compbox::coefficients
