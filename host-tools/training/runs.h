// SPDX-License-Identifier: MIT
// Which rows of a table belong together: the runs that are left out of training as a whole.
#pragma once

#include <string>
#include <vector>

namespace compbox {

struct found_runs {
    std::vector<std::size_t> row;     // of the table, in the order in which the runs are followed
    std::vector<std::size_t> run;     // of each of these: 0, 1, 2 …
    std::vector<std::size_t> starts;  // indices of `row` where lags start anew, ascending; first 0
    std::vector<double> values;       // of each run
    std::vector<int> times;  // how often its value was a run before, and this one: 1, 2 …
    bool reordered = false;  // rows stand run by run, not as in the table
    std::string note;        // for the report; "": nothing to say
};

// in : value of the run column in each row, >= 1 rows; time_s of each row, or empty
// out: a run is a stretch of equal values, and a value that comes back is another run. Where values
//      come back often (more than three stretches for each value, and one shorter than 20 rows) a
//      stretch is no run, its neighbours would betray it: then all rows of a value are one run.
//      Rows of such runs stay where they are if time rises over the whole table and stretches have
//      two rows on average (one record), and lags start anew with each stretch; else the rows are
//      put run by run, and lags start anew with each run.
found_runs find_runs(const std::vector<double> &value, const std::vector<double> &time_s,
                     const std::string &column);

}  // namespace compbox
