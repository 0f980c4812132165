// SPDX-License-Identifier: MIT
// Readings that stand out of the noise of nine lines.
#pragma once

#include "host-tools/identification/identify.h"

namespace compbox {

// in : data: readings, of separate set-ups less each line's offset and slope over `position_mm`
//      line_maker: 9 x 9, I - A S, which makes the residuals of a position's nine lines
//      freedom: degrees of freedom of all residuals, > 0
// out: readings that stand out, largest first. One bad reading leans on its neighbours in the
//      line and in the position, so the largest is left out, the rest solved again, and tested
//      again (Bonferroni over all, spread by the median), until nothing stands out or a quarter of
//      the freedom is used up. Nothing is taken out of the solution itself.
std::vector<six_curves::outlier> find_outliers(const nine_line_readings &data,
                                               const std::vector<double> &position_mm,
                                               const Eigen::Matrix<double, 9, 9> &line_maker,
                                               const identify_options &options, int freedom);

}  // namespace compbox
