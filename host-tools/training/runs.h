// SPDX-License-Identifier: MIT
// Groups the rows of a table into runs, which are left out of training as a whole.
#pragma once

#include <string>
#include <vector>

namespace compbox::training {

struct found_runs {
    std::vector<std::size_t> row;     // of the table, in the order of the runs
    std::vector<std::size_t> run;     // of each of these: 0, 1, 2 …
    std::vector<std::size_t> starts;  // indices of `row` where lags restart, ascending; first 0
    std::vector<double> values;       // of each run
    std::vector<int> times;           // number of runs with its value so far: 1, 2 …
    bool reordered = false;           // rows are run by run, not as in the table
    std::string note;                 // for the report; "": none
};

// in : value of the run column in each row, >= 1 rows; time_s of each row, or empty
// out: a run is a series of equal values, and a value that returns later is another run. If values
//      return often (more than three series for each value, and one shorter than 20 rows), all rows
//      of a value are one run, because a left-out series would be known from its neighbours. Rows
//      of such runs keep their order if time rises over the whole table and series have two rows on
//      average (one record), and lags restart with each series; else the rows are sorted by run,
//      and lags restart with each run.
found_runs find_runs(const std::vector<double> &value, const std::vector<double> &time_s,
                     const std::string &column);

}  // namespace compbox::training
