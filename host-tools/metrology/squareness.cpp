// SPDX-License-Identifier: MIT
#include "host-tools/metrology/squareness.h"

#include <cmath>

namespace compbox::metrology {

namespace {

constexpr double urad_mm_per_um = 1e3;

}  // namespace

int opening_sign(const std::string &name) {
    if (name == "C0Y" || name == "A0Z") return 1;
    return name == "B0Z" ? -1 : 0;
}

// In the plane of first (1) and second (2), the first axis runs along (1, a), the second along (b,
// 1). The angle between them is 90 degrees - a - b. A square that is open by q turns the second
// reference by -q towards the first.
squareness from_optical_square(const std::string &name, squareness first_slope,
                               squareness second_slope, double square_error_urad) {
    const double opening = square_error_urad - first_slope.value_urad - second_slope.value_urad;
    return {opening_sign(name) * opening,
            std::hypot(first_slope.sigma_urad, second_slope.sigma_urad)};
}

// If the angle is open by s, the second axis leans by -s towards the first. The rising diagonal is
// then shorter by s a b / d, and the falling one longer by the same length.
squareness from_diagonals(const std::string &name, double first_mm, double second_mm,
                          double rising_um, double falling_um, double sigma_um) {
    const double d = std::hypot(first_mm, second_mm);
    const double share = urad_mm_per_um * d / (2.0 * first_mm * second_mm);
    return {opening_sign(name) * (falling_um - rising_um) * share,
            std::sqrt(2.0) * sigma_um * share};
}

squareness from_ball_bar(const std::string &name, double diameter_mm, double at_45_um,
                         double at_135_um, double sigma_um) {
    const double side_mm = diameter_mm / std::sqrt(2.0);
    return from_diagonals(name, side_mm, side_mm, at_45_um, at_135_um, sigma_um);
}

}  // namespace compbox::metrology
