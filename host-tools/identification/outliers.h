// SPDX-License-Identifier: MIT
// Outliers among the readings of nine lines.
#pragma once

#include "host-tools/identification/identify.h"

namespace compbox::identification {

// in : data: readings over the sigma of their lines, of separate set-ups minus each line's offset
//      and slope over `position_mm`; line_maker: I - A S for these, a projection, which gives the
//      residuals of a position's lines; freedom: degrees of freedom of all residuals, > 0
// out: outliers, largest first. One bad reading affects its neighbours in the line and in the
//      position. The largest is therefore left out, the rest solved and tested again (Bonferroni
//      over all, spread by the median), until no outlier remains or a quarter of the freedom is
//      used. The solution itself keeps all readings.
std::vector<six_curves::outlier> find_outliers(const nine_line_readings &data,
                                               const std::vector<double> &position_mm,
                                               const Eigen::MatrixXd &line_maker,
                                               const identify_options &options, int freedom);

}  // namespace compbox::identification
