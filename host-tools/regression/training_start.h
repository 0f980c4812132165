// SPDX-License-Identifier: MIT
// Start weights of a training: random, with the path of a linear map.
#pragma once

#include "host-tools/regression/network.h"
#include "host-tools/regression/ridge.h"

namespace compbox::regression {

// A random start with the linear path and output bias of `linear`; without a linear path a plain
// random start.
Eigen::VectorXd start_from(const network_shape &shape, const linear_map &linear,
                           std::uint64_t seed);

}  // namespace compbox::regression
