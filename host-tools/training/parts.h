// SPDX-License-Identifier: MIT
// Parts of a table without a column of runs, which are left out of training as a whole.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace compbox::training {

struct table_parts {
    std::vector<double> number;  // of each row: 1, 2 …, never falling
    std::string what;            // for the report: "its 5 pauses", "days", "six equal parts"
};

// in : time_s of each row, or empty; rows >= 1
// out: three parts or more between pauses (a step of ten minutes and twenty usual ones, or a clock
//      that starts again); else days, of a record of three days; else six equal parts
table_parts parts_of(const std::vector<double> &time_s, std::size_t rows);

// Whether a speed changes in steps that last, so that its stretches are runs: 6 to 60 of them, of
// 20 rows in the middle one, three with a speed other than zero.
bool has_long_steps(const Eigen::VectorXd &speed);

}  // namespace compbox::training
