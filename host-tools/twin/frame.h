// SPDX-License-Identifier: MIT
// A rigid displacement: homogeneous 4 x 4 matrices without their last row.
#pragma once

#include "host-tools/twin/twin_file.h"

namespace compbox::twin {

struct frame {
    std::array<xyz, 3> turn = {xyz{1, 0, 0}, xyz{0, 1, 0}, xyz{0, 0, 1}};  // rows, orthogonal
    xyz shift = {};

    static frame translation(const xyz &by);
    // Rotation about the direction of `by_rad` by its length; exact for any angle.
    static frame rotation(const xyz &by_rad);

    frame operator*(const frame &then) const;  // `then` first, as matrices
    xyz operator*(const xyz &point) const;
};

}  // namespace compbox::twin
