// SPDX-License-Identifier: MIT
#include "host-tools/twin/frame.h"

#include <cmath>

namespace compbox::twin {

namespace {

double dot(const xyz &a, const xyz &b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace

frame frame::translation(const xyz &by) {
    frame f;
    f.shift = by;
    return f;
}

// Rodrigues: R = I + sin(t)/t K + (1 - cos(t))/t² K², K the cross product by the vector.
frame frame::rotation(const xyz &v) {
    const double square = dot(v, v), angle = std::sqrt(square);
    if (angle == 0.0) return {};
    const double half = std::sin(0.5 * angle);
    const double first = std::sin(angle) / angle, second = 2.0 * half * half / square;
    const double cross[3][3] = {{0.0, -v[2], v[1]}, {v[2], 0.0, -v[0]}, {-v[1], v[0], 0.0}};
    frame f;
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const double own = i == j ? square : 0.0;
            f.turn[i][j] += first * cross[i][j] + second * (v[i] * v[j] - own);
        }
    }
    return f;
}

frame frame::operator*(const frame &then) const {
    frame f;
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            f.turn[i][j] = turn[i][0] * then.turn[0][j] + turn[i][1] * then.turn[1][j] +
                           turn[i][2] * then.turn[2][j];
        }
    }
    f.shift = *this * then.shift;
    return f;
}

xyz frame::operator*(const xyz &point) const {
    return {dot(turn[0], point) + shift[0], dot(turn[1], point) + shift[1],
            dot(turn[2], point) + shift[2]};
}

}  // namespace compbox::twin
