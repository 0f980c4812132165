// SPDX-License-Identifier: MIT
// Groups sensors with similar readings: fuzzy clustering of columns by their correlation.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace compbox::regression {

// A partition of sensors 0 … n - 1.
struct clustering {
    std::vector<std::size_t> cluster;  // of each sensor, numbered in order of the first sensor
    std::size_t count = 0;
    double validity = 0.0;       // the index that determined the count
    Eigen::MatrixXd membership;  // sensors by clusters, 0 … 1; rows sum to 1 (fuzzy c-means only)
};

// in : a sensor in each column, none constant
// out: |correlation|, 1 on the diagonal
Eigen::MatrixXd similarity_of(const Eigen::MatrixXd &sensors);

// Fuzzy c-means (Bezdek, m = 2) of the sensors as points whose distance is sqrt(2 - 2 |r|).
// in : count 1 … sensors; 0: the count with the least Xie-Beni index, 2 … the square root of the
//      sensors (rounded up)
// The start is deterministic: centres as far apart as possible.
clustering fuzzy_c_means(const Eigen::MatrixXd &similarity, std::size_t count);

// Max-min transitive closure of the similarity, cut into `count` classes (or the next larger
// possible number); 0: the cut with the largest F statistic.
clustering transitive_closure(const Eigen::MatrixXd &similarity, std::size_t count);

}  // namespace compbox::regression
