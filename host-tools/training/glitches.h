// SPDX-License-Identifier: MIT
// Glitches of a logger: single readings, or short stretches, that no machine can follow.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace compbox::training {

// A stretch of one column that leaves its neighbours by a jump and comes back by another.
struct glitch {
    std::size_t first = 0, last = 0;   // rows
    double reached = 0.0;              // value furthest from the neighbours
    double before = 0.0, after = 0.0;  // the values around it; at an end of a run both are the same
};

// in : values of one column; starts: rows where a run begins, ascending, the first is 0
// out: its glitches, of at most five rows each. Only a column that otherwise changes smoothly has
//      any: they jump by eight times what 19 of 20 of its steps reach, by a twentieth of its range,
//      and by three times its largest other step. A speed that changes in steps and a position that
//      moves from row to row have none.
std::vector<glitch> find_glitches(const Eigen::VectorXd &values,
                                  const std::vector<std::size_t> &starts);

// Replaces the values of each glitch by the straight line between its neighbours.
void bridge(Eigen::Ref<Eigen::VectorXd> values, const std::vector<glitch> &glitches);

}  // namespace compbox::training
