// SPDX-License-Identifier: MIT
// A linear map drawn to what brothers know: machines of one type (prior.h).
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "host-tools/regression/averaging.h"
#include "host-tools/training/prior.h"

namespace compbox::training {

struct drawn_map {
    regression::linear_map map;  // of one output
    Eigen::VectorXd left_out;
    std::array<double, 3> share;  // of the own map, the brothers' mean, the shrunk map; sum 1
};

// in : spread: for scaled x and t; own, own_left_out: the map of one output without brothers, and
//      its predictions of rows left out; rows: so many independent rows would say as much as x; x,
//      t, folds, starts: as for average_maps, of this output
// out: a mix of three maps, each with an offset of its own: the own one, the brothers' mean, the
// most
//      probable map given both. It leaves least (mean square) of the folds left out, where the
//      first two have to gain a standard error. If three quarters of it are the own map, that is
//      all of it: then the machine is no brother
drawn_map draw_to(const weight_spread &spread, const regression::linear_map &own,
                  const Eigen::VectorXd &own_left_out, double rows, const Eigen::MatrixXd &x,
                  const Eigen::VectorXd &t, const regression::row_folds &folds,
                  const std::vector<Eigen::Index> &starts);

// in : square: products of the residuals of three models; symmetric, not negative; doubt >= 0
// out: shares >= 0 with the sum 1 whose mix has the least square, with the doubt added to the
//      squares of the first two
std::array<double, 3> best_mix(const Eigen::Matrix3d &square, double doubt);

}  // namespace compbox::training
