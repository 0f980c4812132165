// SPDX-License-Identifier: MIT
#include "host-tools/twin/curve.h"

#include <algorithm>
#include <cmath>

#include "host-tools/twin/units.h"

namespace compbox::twin {

namespace {

constexpr double fundamental_in_travels = 4.0;
constexpr double shortest_in_cutoffs = 0.25;

}  // namespace

random_curve::random_curve(double min_mm, double max_mm, double amplitude_um,
                           const roughness &spectrum, random_stream stream)
    : min_mm_(min_mm), max_mm_(max_mm) {
    const double fundamental_mm = fundamental_in_travels * (max_mm - min_mm);
    const double count = std::ceil(fundamental_mm / (shortest_in_cutoffs * spectrum.cutoff_mm));
    for (int k = 1; k <= static_cast<int>(std::max(count, 8.0)); ++k) {
        const double per_mm = k / fundamental_mm;
        const double density = std::pow(k, -spectrum.exponent) /
                               (1.0 + std::pow(per_mm * spectrum.cutoff_mm, spectrum.roll_off));
        cosines_.push_back(std::sqrt(density) * stream.normal());
        sines_.push_back(std::sqrt(density) * stream.normal());
    }
    refer_to_line(amplitude_um);
}

// Computes harmonic k by rotating harmonic k - 1: the rounding error after n harmonics is about n
// ulp.
double random_curve::raw(double position_mm) const {
    const double angle =
        two_pi * (position_mm - min_mm_) / (fundamental_in_travels * (max_mm_ - min_mm_));
    const double c1 = std::cos(angle), s1 = std::sin(angle);
    double c = 1.0, s = 0.0, sum = 0.0;
    for (std::size_t k = 0; k < cosines_.size(); ++k) {
        const double turned = c * c1 - s * s1;
        s = s * c1 + c * s1;
        c = turned;
        sum += cosines_[k] * c + sines_[k] * s;
    }
    return sum;
}

double random_curve::operator()(double position_mm) const {
    const double middle_mm = 0.5 * (min_mm_ + max_mm_);
    return raw(position_mm) - line_offset_ - line_slope_ * (position_mm - middle_mm);
}

// Fits the line to the reference points, then scales all to the range about it.
void random_curve::refer_to_line(double amplitude_um) {
    const double middle_mm = 0.5 * (min_mm_ + max_mm_);
    std::vector<double> x, y;
    double sum = 0.0, sum_xy = 0.0, sum_xx = 0.0;
    for (int i = 0; i < reference_points; ++i) {
        const double position_mm = min_mm_ + (max_mm_ - min_mm_) * i / (reference_points - 1);
        x.push_back(position_mm - middle_mm);
        y.push_back(raw(position_mm));
        sum += y.back();
        sum_xy += x.back() * y.back();
        sum_xx += x.back() * x.back();
    }
    line_offset_ = sum / reference_points;
    line_slope_ = sum_xy / sum_xx;
    for (std::size_t i = 0; i < y.size(); ++i) y[i] -= line_offset_ + line_slope_ * x[i];
    const auto [low, high] = std::minmax_element(y.begin(), y.end());
    const double factor = amplitude_um / (*high - *low);
    for (auto &a : cosines_) a *= factor;
    for (auto &a : sines_) a *= factor;
    line_offset_ *= factor;
    line_slope_ *= factor;
}

}  // namespace compbox::twin
